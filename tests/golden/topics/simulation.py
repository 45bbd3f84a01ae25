"""A run that is changed as it goes: gravity, friction, solref, mass, timestep, a push, a control, a keyframe.

The scene is tests/client/scene.xml. After each phase: qpos, qvel, and the force of the ground on the crate.
"""

import pathlib

import mujoco
import numpy as np

SCENE = pathlib.Path(__file__).parents[2] / "client" / "scene.xml"
STEPS = 40


def force_on(model, data, geom1, geom2):
    """Force of the contacts between two geoms on the second, world axes."""
    ids = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in (geom1, geom2)]
    total, wrench = np.zeros(3), np.zeros(6)
    for i in range(data.ncon):
        contact = data.contact[i]
        if sorted(contact.geom) == sorted(ids):
            mujoco.mj_contactForce(model, data, i, wrench)
            sign = 1 if contact.geom[1] == ids[1] else -1
            total += sign * contact.frame.reshape(3, 3).T @ wrench[:3]
    return total


def phases(model, data):
    """What is changed before each phase."""
    geom = lambda name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    body = lambda name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)

    def gravity():
        model.opt.gravity[:] = [1.5, -0.5, -3.7]

    def friction():
        for name in ("ground", "crate"):
            model.geom_friction[geom(name)] = [0.1, 0.001, 0.0001]

    def solref():
        model.geom_solref[geom("crate")] = [0.05, 0.6]

    def mass():
        for name in ("crate", "bob"):
            model.body_mass[body(name)] *= 3
            model.body_inertia[body(name)] *= 3
        # invweight0 follows from the masses in qpos0. mj_setConst moves the state there: take it back.
        state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_setConst(model, data)
        mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)

    def push():
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        force, point = np.array([4.0, 2.0, 1.0]), np.array([0.1, 0.2, 0.3])
        data.xfrc_applied[body("crate")] = [*force, *np.cross(point - data.xipos[body("crate")], force)]

    def release():
        data.xfrc_applied[:] = 0
        data.ctrl[0] = 0.4

    def timestep():
        model.opt.timestep = 0.001

    def key():
        mujoco.mj_resetDataKeyframe(model, data, 0)

    return [("start", lambda: None), gravity, friction, solref, mass, push, release, timestep, key]


def generate():
    model = mujoco.MjModel.from_xml_path(str(SCENE))
    model.opt.tolerance = 0
    model.opt.iterations = 100
    data = mujoco.MjData(model)
    found = []
    for phase in phases(model, data):
        name, change = phase if isinstance(phase, tuple) else (phase.__name__, phase)
        change()
        for _ in range(STEPS):
            mujoco.mj_step(model, data)
        found.append(
            {
                "name": name,
                "qpos": data.qpos.tolist(),
                "qvel": data.qvel.tolist(),
                "force": force_on(model, data, "ground", "crate").tolist(),
            }
        )
    return {"steps": STEPS, "phases": found}
