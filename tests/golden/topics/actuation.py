"""Actuators with dynamics, other transmissions, compensation of gravity, bounded joint forces, mocap bodies."""

import numpy as np

from scenes import scene, wrap

BODIES = """<body name="upper" pos="0 0 1" euler="0 0 30"><joint name="h" axis="0 1 0" range="-50 80" damping="0.1" actuatorfrcrange="-4 3"/>
    <geom type="capsule" size="0.03" fromto="0 0 0 0 0.1 -0.5"/><site name="elbow" pos="0 0.1 -0.5" euler="10 20 0"/>
    <body name="lower" pos="0 0.1 -0.5" euler="10 0 0" gravcomp="0.7"><joint name="b" type="ball" pos="0 0 0.02"/>
      <geom type="box" size="0.02 0.04 0.2" pos="0.03 0 -0.2"/><site name="tip" pos="0.1 0 -0.2" euler="0 0 70"/>
      <body pos="0 0.1 0" gravcomp="1.2"><joint name="s" type="slide" axis="1 0 1" range="-0.3 0.5" actuatorgravcomp="true"/><geom size="0.06"/>
        <site name="inner" pos="0.02 0 0.01" euler="30 0 0"/></body></body></body>
  <body name="arm" pos="-1 0 1"><joint name="k" axis="1 0 0"/><geom size="0.1" pos="0.3 0 0.1"/><site name="base" pos="0.1 0 0" euler="20 0 0"/></body>
  <body pos="1 0 1"><joint name="f" type="free"/><geom type="box" size="0.1 0.2 0.3" pos="0.05 0 0" density="200" euler="0 0 20"/>
    <site name="jet" pos="0.1 0.1 0.3" euler="0 20 40"/></body>
  <body pos="2 0 1"><joint name="g" type="free"/><geom type="box" size="0.1 0.2 0.3" pos="0.05 0 0" density="100"/><site name="fan" euler="30 0 0"/></body>
  <body pos="3 0 1" gravcomp="1"><freejoint/><geom size="0.1" pos="0.1 0 0"/></body>"""
ACTUATORS = """<actuator>
    <intvelocity joint="h" kp="20" kv="1" actrange="-0.5 0.6"/><intvelocity joint="b" kp="5" gear="1 0.5 -2"/>
    <damper joint="h" kv="2" ctrlrange="0 1"/><damper joint="s" kv="3" ctrlrange="0 0.4" forcerange="-1 1"/>
    <cylinder joint="s" timeconst="0.1" diameter="0.5" bias="1 -2 -0.3"/>
    <position joint="h" kp="10" dampratio="1"/><position joint="s" kp="50" dampratio="0.4" timeconst="0.03" gear="2"/>
    <position joint="k" kp="7" kv="0.2" damping="0.3" armature="0.02" gear="1.5"/>
    <general joint="s" dyntype="integrator" gainprm="3" actlimited="true" actrange="-0.2 0.1"/>
    <general joint="k" dyntype="filter" dynprm="0.05" gaintype="affine" gainprm="2 0.5 0.3" biastype="affine" biasprm="0.1 -1 -0.2"/>
    <general joint="h" dyntype="filterexact" dynprm="0.02" actearly="true" gainprm="2"/>
    <general joint="k" dyntype="integrator" actearly="true" gaintype="affine" gainprm="1 0 -0.4"/>
    <motor jointinparent="b" gear="0.3 1 0.2"/><motor jointinparent="f" gear="1 2 3 0.3 0.2 0.1"/><motor jointinparent="s" gear="3"/>
    <position jointinparent="b" kp="2" kv="0.4" gear="0 1 0"/>
    <motor site="jet" gear="1 0 3 0 0.2 1"/><motor site="tip" gear="1 2 0 0.1 0 0.3"/><motor site="base" gear="0 0 1"/>
    <velocity site="fan" gear="0 0 1 0.1 0 0" kv="0.3"/><velocity site="inner" gear="1 0 0 0 0 0" kv="0.5"/>
    <position site="tip" refsite="elbow" gear="1 0 0 0 0 0" kp="10" kv="0.3"/><position site="inner" refsite="base" gear="0 0 0 0 1 0.5" kp="2" kv="0.1"/>
    <position site="jet" refsite="tip" gear="0 1 0 0 0 0" kp="2"/><position site="inner" refsite="elbow" gear="0 0 0 1 0 0" kp="4"/>
    <position joint="h" kp="3" inheritrange="0.5"/><intvelocity joint="s" kp="3" inheritrange="0.9"/>
  </actuator>"""
SENSORS = "<sensor>" + "".join(f'<jointactuatorfrc joint="{j}"/>' for j in "hsk") + '<accelerometer site="tip"/><force site="tip"/></sensor>'
SPRINGS = """<body><joint type="slide" springdamper="0.2 0.2" axis="0 0 1" armature=".1" springref="0.1"/><joint springdamper="0.3 2" axis="0 1 0"/>
    <geom size=".1" mass="2" pos="1 0 0"/></body>
  <body><joint type="ball" springdamper="1 .5"/><geom type="box" size=".1 .2 .3" pos=".1 0 0"/></body>
  <body><joint type="free" springdamper="1 .5"/><geom type="box" size=".1 .2 .3" pos=".1 0 0"/></body>
  <body><joint type="slide" springdamper="0.2 0.2" axis="0 0 1" armature=".3"/><geom size=".1"/></body>
  <body><joint type="slide" springdamper="0.2 0.2" axis="0 0 1"/><geom size=".1"/></body>"""
PLACED = """<body name="carrier" mocap="true" pos="0.2 0 1" euler="0 0 20"><geom size="0.1"/><body pos="0.1 0 0" euler="10 0 0"><geom type="box" size="0.3 0.3 0.02" pos="0 0 -0.2"/></body>
    <body pos="0 0 0.3"><joint type="slide" axis="1 0 0" range="-0.2 0.2"/><geom size="0.05" contype="0" conaffinity="0"/></body>
    <body pos="0 0 0.4"><joint axis="0 1 0"/><geom size="0.05" pos="0 0 0.2" contype="0" conaffinity="0"/></body></body>
  <body name="other" mocap="true" pos="3 0 1"><geom size="0.1"/></body>
  <geom type="plane" size="3 3 0.1"/>
  <body pos="0.2 0 0.92"><freejoint/><geom size="0.05"/></body>"""


def generate():
    rng = np.random.default_rng(17)
    arrays = ["qfrc_actuator", "actuator_force", "qacc", "qfrc_passive", "act_dot"]
    compiled = ["actuator_biasprm", "actuator_ctrlrange", "actuator_actrange", "jnt_stiffness", "dof_damping", "dof_invweight0"]
    off = {name: wrap(BODIES, ACTUATORS, flag=f'<flag {name}="disable"/>') for name in ("actuation", "gravity", "clampctrl")}
    loose = {"default": "<geom friction='0.7'/>"}
    return [
        scene("actuators", wrap(BODIES, ACTUATORS + SENSORS), rng, arrays + ["sensordata"], compiled[:3], samples=6, spread=0.5),
        scene("far", wrap(BODIES, ACTUATORS), rng, arrays, samples=3, spread=2.0),
        scene("run", wrap(BODIES, ACTUATORS, 'timestep="0.002"'), rng, arrays, samples=1, spread=0.2, speed=0.2, seconds=0.4),
        *(scene(f"no {name}", xml, rng, arrays, samples=1) for name, xml in off.items()),
        scene("springdamper", wrap(SPRINGS), rng, ["qfrc_passive"], compiled[3:], seconds=1.0, spread=0.3),
        scene("mocap", wrap(PLACED, **loose), rng, ["xpos", "qacc"], samples=4, spread=0.05),
        scene("held ball", wrap("""<body pos="0 0 1"><joint type="ball" limited="true" damping="2" armature="0.01"/>
            <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/></body>"""), rng, ["qacc"], spread=0.3, seconds=0.5),
    ]
