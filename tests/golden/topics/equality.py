"""Equalities: joint, tendon, connect, weld; between bodies and sites, trees and the world, free and mocap bodies."""

import mujoco
import numpy as np

from scenes import scene, wrap

BODIES = """<body name="upper" pos="0 0 1" euler="0 0 30"><joint name="h" axis="0 1 0" range="-50 80" damping="0.1" ref="15"/>
    <geom type="capsule" size="0.03" fromto="0 0 0 0 0.1 -0.5"/><site name="elbow" pos="0.05 0.1 -0.4" euler="10 20 0"/>
    <body name="lower" pos="0 0.1 -0.5"><joint name="b" type="ball" pos="0 0 0.02"/>
      <geom type="box" size="0.02 0.04 0.2" pos="0.03 0 -0.2"/><site name="tip" pos="0.1 0 -0.3" euler="0 0 40"/>
      <body name="end" pos="0 0.1 0"><joint name="s" type="slide" axis="1 0 1"/><geom size="0.06"/></body></body>
    <body name="wing" pos="0 -0.1 -0.3"><joint name="w" axis="1 0 0"/><geom type="box" size="0.1 0.02 0.03" pos="0.1 0 0"/></body></body>
  <body name="arm" pos="-1 0 1"><joint name="k" axis="1 0 0"/><geom size="0.1" pos="0.3 0 0.1"/><site name="base" pos="0.1 0 0" euler="20 0 0"/></body>
  <body name="crate" pos="1 0 1" euler="0 20 30"><freejoint/><geom type="box" size="0.1 0.2 0.3" pos="0.05 0 0" density="200" euler="0 0 20"/>
    <site name="jet" pos="0.1 0.1 0.3" euler="40 0 0"/><body name="lid" pos="0 0 0.3" euler="5 0 0"><geom size="0.05"/></body></body>
  <body name="box" pos="1 1 1"><freejoint/><geom type="box" size="0.1 0.2 0.3"/></body>
  <body name="cart" pos="2 0 1"><joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/><geom size="0.1"/></body>
  <body name="hand" mocap="true" pos="0 1 1"/><site name="wall" pos="-0.5 0 0.7" euler="0 50 0"/>"""
TENDONS = """<tendon><fixed name="one"><joint joint="h" coef="1"/><joint joint="k" coef="0.5"/></fixed><fixed name="two"><joint joint="x" coef="1"/><joint joint="s" coef="2"/></fixed>
  <spatial name="string"><site site="wall"/><site site="tip"/><site site="jet"/></spatial></tendon>"""
SCALAR = """<joint joint1="h" joint2="k" polycoef="0.1 0.5 -0.2 0.3 0.1" solref="0.05 0.7" solimp="0.8 0.9 0.5"/><joint joint1="w" polycoef="0.2"/>
    <joint joint1="x" joint2="z" active="false"/><tendon tendon1="one" tendon2="two" polycoef="0 1 0.3" solref="-500 -20"/><tendon tendon1="string" solref="0.1 1"/>
    <tendon tendon1="string" tendon2="one" polycoef="0.1 0.4 0.2" solref="0.05 1"/>"""
CONNECT = """<connect body1="lower" anchor="0.1 0 -0.2"/><connect body1="arm" body2="crate" anchor="0.3 0.1 0.2" solref="0.1 1" solimp="0.9 0.95 0.01"/>
    <connect site1="tip" site2="base" solref="0.2 1"/><connect body1="hand" body2="box" anchor="0.1 0 0"/><connect body1="lid" body2="cart" anchor="0 0 0" solref="0.1 0.4"/>
    <connect site1="wall" site2="elbow" active="false"/><connect body1="hand" anchor="0 0 0"/>"""
WELD = """<weld body1="crate" body2="box" solref="0.1 1"/><weld body1="end" body2="hand" anchor="0.1 0.2 0" torquescale="0.3" solref="0.05 0.8"/>
    <weld body1="wing" body2="arm" relpose="0.1 0.2 0 1 0.2 0 0.3" anchor="0.05 0 0.1" solref="0.1 1" solimp="0.5 0.9 0.3"/><weld site1="tip" site2="jet" torquescale="2" solref="0.2 1"/>
    <weld body1="cart" solref="0.1 1" torquescale="0"/><weld body1="lid" solref="0.3 1"/>"""
SENSORS = '<sensor><force site="tip"/><torque site="elbow"/><force site="jet"/><torque site="base"/><accelerometer site="tip"/></sensor>'
CHAIN = """<body pos="0 0 1"><joint axis="0 1 0" damping="0.05"/><geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0"/>
    <body name="b" pos="0.3 0 0"><joint axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0.1"/></body></body>
  <body name="c" pos="0.9 0 1"><joint axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0.1"/></body>"""


def generate():
    rng = np.random.default_rng(29)
    arrays = ["qacc", "sensordata"]
    out = []
    for name, content in {"scalar": SCALAR, "connect": CONNECT, "weld": WELD, "all": SCALAR + CONNECT + WELD}.items():
        xml = wrap(BODIES, f"{TENDONS}<equality>{content}</equality>{SENSORS}")
        compiled = ["eq_data"] if name in ("connect", "weld") else []
        made = scene(name, xml, rng, arrays, compiled, samples=4, spread=0.3)
        if compiled:
            data = np.reshape(made["compiled"]["eq_data"], (-1, 12))
            # What a reader leaves there of no use: whether a relpose was given, all but the torquescale of sites.
            data[:, 11] = 0
            sites = mujoco.MjModel.from_xml_string(xml).eq_objtype == mujoco.mjtObj.mjOBJ_SITE
            data[sites, :10] = 0
            if name == "connect":
                data[:, 10] = 0
            made["compiled"]["eq_data"] = data.ravel().tolist()
        out.append(made)
    loop = f'<equality><connect body1="b" body2="c" anchor="0.4 0 0.1"/></equality>'
    defaults = '<geom contype="0" conaffinity="0"/><equality solref="0.04 1" active="true"/>'
    out.append(scene("four-bar", wrap(CHAIN, loop, 'timestep="0.002"', default=defaults), rng, ["qacc"], samples=2, spread=0.05, speed=0.5, seconds=0.5))
    run = wrap(BODIES, f"{TENDONS}<equality>{SCALAR}{CONNECT}</equality>", 'timestep="0.001"')
    out.append(scene("run", run, rng, ["qacc"], samples=1, spread=0.05, speed=0.2, seconds=0.2))
    for flag in ("equality", "constraint"):
        out.append(scene(f"no {flag}", wrap(BODIES, f"{TENDONS}<equality>{SCALAR}{WELD}</equality>", flag=f'<flag {flag}="disable"/>'), rng, ["qacc"], samples=1))
    exact = wrap(BODIES, f"{TENDONS}<equality>{SCALAR}{CONNECT}{WELD}</equality>", flag='<flag diagexact="enable"/>')
    out.append(scene("exact diagonal", exact, rng, ["qacc"], samples=2, spread=0.3))
    return out
