"""Smooth motion: forces, inertia, energy and one step of each integrator, from random states; and rollouts."""

import mujoco
import numpy as np

SAMPLES = 4
INTEGRATORS = {
    "semi-implicit-euler": mujoco.mjtIntegrator.mjINT_EULER,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}

# Name, body of <worldbody>, then optionally what else the file holds.
SCENES = [
    ("free", """
        <body pos="0.1 -0.2 1" euler="20 -30 50"><freejoint/>
          <inertial pos="0.05 -0.1 0.07" euler="10 80 -30" mass="1.3" diaginertia="0.02 0.035 0.05"/></body>"""),
    ("free-sphere", '<body pos="0 0 1"><freejoint/><geom size="0.1"/></body>'),
    ("free-compound", """
        <body pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.2 0.3"/>
          <body pos="0.3 0.1 0" euler="0 40 10"><geom type="capsule" size="0.05 0.2" pos="0.02 0 0.1"/>
            <body pos="0 0.1 0.2" axisangle="1 1 0 70"><geom size="0.07"/></body></body></body>"""),
    ("free-loaded", """
        <body pos="0.3 0 1" euler="40 0 10"><joint type="free" damping="0.3" armature="0.02" stiffness="7"/>
          <geom type="box" size="0.1 0.2 0.3" pos="0.05 0.02 -0.1" euler="10 20 30" density="300"/></body>"""),
    ("pendulum", """
        <body pos="0 0 1"><joint axis="0 1 0" damping="0.05" stiffness="2" springref="20" ref="10" armature="0.01"/>
          <geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/></body>"""),
    ("double-pendulum", """
        <body pos="0 0 1" euler="0 0 30"><joint axis="0 1 0" pos="0.01 0 0.05"/>
          <geom type="capsule" size="0.03" fromto="0 0 0 0 0.1 -0.5"/>
          <body pos="0 0.1 -0.5" euler="10 0 0"><joint axis="1 1 0.2" pos="0 0.02 0" damping="0.02"/>
            <geom type="box" size="0.02 0.04 0.2" pos="0.03 0 -0.2"/></body></body>"""),
    ("ball", """
        <body pos="0 0 1" euler="0 30 0"><joint type="ball" pos="0.1 0 0" stiffness="1.5" damping="0.03" armature="0.005"/>
          <geom type="cylinder" size="0.1 0.02" pos="0.05 0.02 0.3"/></body>"""),
    ("slides", """
        <body pos="1 0 1" euler="0 30 10"><joint type="slide" axis="1 0 0" damping="0.5"/>
          <joint type="slide" axis="0 1 1" stiffness="20" springref="0.1" ref="0.3"/><geom size="0.1"/>
          <body pos="0.2 0 0" euler="40 0 0"><joint type="slide" axis="0 0 1" armature="0.1"/><geom size="0.05"/>
            <body pos="0 0.1 0" euler="0 20 0"><geom type="box" size="0.05 0.05 0.1"/></body></body></body>"""),
    ("planar", """
        <body pos="0 0 1"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint axis="0 1 0" pos="0.1 0 0"/>
          <geom type="box" size="0.1 0.05 0.2" pos="0.03 0 0.04"/></body>"""),
    ("branches", """
        <body pos="5 0 0" euler="0 0 45"><body pos="0 0.2 1"><joint axis="0 1 0"/><joint axis="1 0 0.3" pos="0 0.1 0" ref="15"/>
            <joint type="slide" axis="0 0.2 1" stiffness="30"/><geom type="box" size="0.1 0.1 0.2"/>
          <body pos="0.3 0 0" euler="0 90 0"><joint type="ball" damping="0.1"/><geom type="capsule" size="0.04 0.2"/>
            <body pos="0 0 0.2"><geom size="0.06" pos="0.1 0 0"/>
              <body pos="0 0.1 0"><joint axis="1 0 0" armature="0.02"/><geom size="0.05" pos="0 0 0.2"/></body></body></body>
          <body pos="-0.3 0 0"><joint type="slide" axis="1 0 0"/><joint type="ball" pos="0 0 0.1" stiffness="0.5"/>
            <geom type="ellipsoid" size="0.1 0.05 0.07" pos="0 0.1 0"/></body>
          <body pos="0 0 0.4" euler="30 0 0"><geom size="0.1"/></body></body></body>"""),
    ("floating", """
        <body pos="0 0 2" euler="10 20 30"><freejoint/><geom type="box" size="0.1 0.2 0.1" pos="0.02 0 0.03"/>
          <body pos="0.1 0.2 0"><joint axis="0 1 0" damping="0.1"/><geom type="capsule" size="0.03 0.15" pos="0 0 -0.15"/>
            <body pos="0 0 -0.3"><joint axis="1 0 0" stiffness="2" springref="-30"/><geom size="0.05" pos="0 0 -0.1"/></body></body>
          <body pos="-0.1 0.2 0"><joint type="ball"/><geom type="capsule" size="0.03 0.15" pos="0.1 0 -0.15"/></body></body>
        <body pos="3 0 0"><freejoint/><geom type="box" size="0.1 0.2 0.3" pos="0 0 0.1" density="200"/></body>"""),
    ("actuators", """
        <body><joint name="h" axis="0 1 0" damping="0.1"/><geom size="0.1" pos="0 0 -0.5"/>
          <body pos="0 0 -0.5"><joint name="b" type="ball"/><geom size="0.08" pos="0.1 0 -0.3"/>
            <body pos="0 0 -0.3"><joint name="s" type="slide" axis="1 0 1"/><geom size="0.05" pos="0 0.1 0"/></body></body></body>
        <body pos="1 0 0"><joint name="f" type="free"/><geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0.05" density="100"/></body>
        <body pos="2 0 0"><joint name="g" type="free"/><geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0.05" density="50"/></body>""",
     """<actuator>
          <motor joint="h" gear="3"/><motor joint="s" gear="-2" ctrllimited="true" ctrlrange="-0.5 0.4"/>
          <position joint="h" kp="20" kv="1.5"/><position joint="s" kp="200" forcelimited="true" forcerange="-3 3" kv="2"/>
          <velocity joint="h" kv="0.7"/><velocity joint="b" kv="0.3" gear="1 0.5 -2"/>
          <position joint="b" kp="3" gear="0.3 1 0.2"/>
          <general joint="s" gainprm="2" biastype="affine" biasprm="0.5 -3 -0.4" gear="1.5"/>
          <motor joint="f" gear="1 2 3 0.3 0.2 0.1"/><velocity joint="g" kv="0.4" gear="1 0 2 0.5 0 1"/>
        </actuator>"""),
    ("applied", """
        <body><joint axis="0 1 0"/><geom size="0.1" pos="0 0 -0.5"/>
          <body pos="0 0 -0.5"><joint type="ball"/><geom size="0.08" pos="0.1 0 -0.3"/>
            <body pos="0 0 -0.3"><geom size="0.05" pos="0 0.1 0"/></body></body></body>
        <body pos="1 0 0"><freejoint/><geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0.05" density="100"/>
          <body pos="0.1 0.2 0" euler="0 30 0"><geom size="0.1"/></body></body>"""),
]
FLAGS = [("gravity", "branches"), ("damper", "branches"), ("spring", "branches"), ("eulerdamp", "branches"),
         ("actuation", "actuators"), ("clampctrl", "actuators")]

ROLLOUTS = [
    ("pendulum", '<body pos="0 0 1"><joint axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/></body>',
     [1.5], [0.3]),
    ("double pendulum", """<body pos="0 0 1"><joint axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/>
        <body pos="0 0 -0.5"><joint axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.4"/></body></body>""",
     [1.0, 0.5], [0, 0]),
    ("top", """<body pos="0 0 1"><joint type="ball"/><geom type="cylinder" size="0.1 0.02" pos="0 0 0.2"/>
        <geom type="capsule" size="0.01" fromto="0 0 0 0 0 0.2"/></body>""",
     [np.cos(0.2), np.sin(0.2), 0, 0], [0, 0, 30]),
    ("tumbling box", '<body pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.2 0.3"/></body>',
     [0, 0, 1, 1, 0, 0, 0], [0.3, 0.1, 2, 0.2, 5, 0.1]),
]


def scene(body, rest="", flag="", timestep=0.005):
    return f"""<mujoco><option timestep="{timestep}">{flag}</option><default><geom contype="0" conaffinity="0"/></default>
  <worldbody>{body}</worldbody>{rest}</mujoco>"""


def load(xml):
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    return model, mujoco.MjData(model)


def sample(model, data, rng, applied):
    """A random state, what MuJoCo computes there, and where one step of each integrator leads."""
    mujoco.mj_resetData(model, data)
    qpos = data.qpos.copy()
    mujoco.mj_integratePos(model, qpos, rng.normal(size=model.nv), 1.0)
    qvel = rng.normal(scale=3, size=model.nv)
    ctrl = rng.normal(size=model.nu)
    xfrc = rng.normal(scale=5, size=(model.nbody, 6)) if applied else np.zeros((0, 6))

    def start():
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:], data.ctrl[:] = qpos, qvel, ctrl
        if applied:
            data.xfrc_applied[:] = xfrc

    start()
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    out = {
        "qpos": qpos, "qvel": qvel, "ctrl": ctrl, "xfrc": xfrc.ravel(),
        "xpos": data.xpos.ravel(), "xmat": data.xmat.ravel(), "xipos": data.xipos.ravel(),
        "xanchor": data.xanchor.ravel(), "xaxis": data.xaxis.ravel(),
        "qM": inertia.ravel(), "qfrc_bias": data.qfrc_bias, "qfrc_passive": data.qfrc_passive,
        "qfrc_actuator": data.qfrc_actuator, "qacc": data.qacc, "energy": data.energy,
        "linear": data.subtree_linvel[0] * model.body_subtreemass[0], "angular": data.subtree_angmom[0],
    }
    out = {key: np.array(value).tolist() for key, value in out.items()}
    out["steps"] = {}
    for name, integrator in INTEGRATORS.items():
        model.opt.integrator = integrator
        start()
        mujoco.mj_step(model, data)
        out["steps"][name] = {"qpos": data.qpos.tolist(), "qvel": data.qvel.tolist()}
    return out


def rollout(name, body, qpos, qvel):
    """States every half second over 3 s."""
    xml = scene(body, timestep=0.001)
    model, data = load(xml)
    out = {"name": name, "xml": xml, "qpos": list(qpos), "qvel": list(qvel), "runs": {}}
    for integrator, number in INTEGRATORS.items():
        model.opt.integrator = number
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = qpos, qvel
        states = []
        for step in range(1, 3001):
            mujoco.mj_step(model, data)
            if step % 500 == 0:
                states.append({"qpos": data.qpos.tolist(), "qvel": data.qvel.tolist()})
        assert not any(w.number for w in data.warning), name
        out["runs"][integrator] = states
    return out


def generate():
    rng = np.random.default_rng(7)
    scenes = []
    bodies = {name: rest for name, *rest in SCENES}
    named = [(name, scene(*rest)) for name, rest in bodies.items()]
    for flag, name in FLAGS:
        body, *rest = bodies[name]
        named.append((f"{name}, no {flag}", scene(body, *(rest or [""]), flag=f'<flag {flag}="disable"/>')))
    for name, xml in named:
        model, data = load(xml)
        count = SAMPLES if "no " not in name else 1
        samples = [sample(model, data, rng, name == "applied") for _ in range(count)]
        scenes.append({"name": name, "xml": xml, "samples": samples})
    return {"scenes": scenes, "rollouts": [rollout(*r) for r in ROLLOUTS]}
