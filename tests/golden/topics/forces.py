"""Contact forces as `mj_contactForce` has them, at states in the middle of runs: normal and friction of each contact."""

import mujoco
import numpy as np

SCENES = {
    "crate": """<mujoco><option tolerance="0" iterations="100" timestep="0.005"/><worldbody><geom name="ground" type="plane" size="5 5 .1"/>
<body name="crate" pos="0 0 .26" euler="3 2 0"><freejoint/><geom name="crate" type="box" size=".25 .25 .25" mass="8"/></body></worldbody></mujoco>""",
    "slope": """<mujoco><option tolerance="0" iterations="100" cone="elliptic" gravity="3 0 -9"/><worldbody><geom name="ground" type="plane" size="5 5 .1"/>
<body name="crate" pos="0 0 .1"><freejoint/><geom name="crate" type="box" size=".2 .1 .1" mass="3" friction=".2 .005 .0001"/></body></worldbody></mujoco>""",
    "stack": """<mujoco><option tolerance="0" iterations="100"/><worldbody><geom name="ground" type="plane" size="5 5 .1"/>
<body name="low" pos="0 0 .1"><freejoint/><geom name="low" type="box" size=".1 .1 .1" mass="2"/></body>
<body name="high" pos=".01 0 .299"><freejoint/><geom name="high" type="box" size=".1 .1 .1" mass="5"/></body></worldbody></mujoco>""",
    "roll": """<mujoco><option tolerance="0" iterations="100"/><default><geom condim="6" friction=".5 .01 .002"/></default><worldbody>
<geom name="ground" type="plane" size="5 5 .1"/><body name="ball" pos="0 0 .1"><freejoint/><geom name="ball" size=".1" mass="1"/></body></worldbody></mujoco>""",
}
START = {"roll": [1, 0.5, 0, 3, 0, 5]}


def generate():
    out = []
    for name, xml in SCENES.items():
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        data.qvel[: len(START.get(name, []))] = START.get(name, [])
        for _ in range(60):
            mujoco.mj_step(model, data)
        qpos, qvel = data.qpos.tolist(), data.qvel.tolist()
        mujoco.mj_forward(model, data)
        contacts = []
        for i in range(data.ncon):
            force = np.zeros(6)
            mujoco.mj_contactForce(model, data, i, force)
            contacts.append({"normal": force[0], "friction": float(np.hypot(force[1], force[2]))})
        out.append({"name": name, "xml": xml, "qpos": qpos, "qvel": qvel, "contacts": contacts})
    return out
