"""Not a topic: what several topics ask of a scene. Random states, what MuJoCo computes there, where one step leads."""

import mujoco
import numpy as np

INTEGRATORS = {
    "semi-implicit-euler": mujoco.mjtIntegrator.mjINT_EULER,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
NAMES = {"body": "nbody", "joint": "njnt", "geom": "ngeom", "site": "nsite", "actuator": "nu", "sensor": "nsensor"}


def wrap(body, rest="", option='timestep="0.005"', flag="", default='<geom contype="0" conaffinity="0"/>'):
    """A scene without collisions, solved to rounding."""
    return f"""<mujoco><option tolerance="0" iterations="100" {option}>{flag}</option><default>{default}</default>
  <worldbody>{body}</worldbody>{rest}</mujoco>"""


def numbers(data, names):
    return {name: np.array(getattr(data, name)).ravel().tolist() for name in names}


def randomise(model, data, rng, spread=1.0, speed=2.0):
    """A random state in place of the one in `data`."""
    mujoco.mj_resetData(model, data)
    mujoco.mj_integratePos(model, data.qpos, spread * rng.normal(size=model.nv), 1.0)
    data.qvel[:] = speed * rng.normal(size=model.nv)
    data.ctrl[:] = rng.normal(size=model.nu)
    data.act[:] = 0.5 * rng.normal(size=model.na)
    for i in range(model.nmocap):
        data.mocap_pos[i] += 0.2 * rng.normal(size=3)
        data.mocap_quat[i] = rng.normal(size=4)


def start(data):
    names = ["qpos", "qvel", "ctrl", "act", "mocap_pos", "mocap_quat"]
    return {name: values for name, values in numbers(data, names).items() if values}


def sample(model, data, rng, arrays, spread, speed):
    """A random state, arrays of `mj_forward` there, and the state after one step of each integrator."""
    randomise(model, data, rng, spread, speed)
    out = start(data)
    kept = {name: np.array(getattr(data, name)) for name in out}

    def restore():
        mujoco.mj_resetData(model, data)
        for name, values in kept.items():
            getattr(data, name)[:] = values

    restore()
    mujoco.mj_forward(model, data)
    out["forward"] = numbers(data, arrays)
    out["steps"] = {}
    for name, integrator in INTEGRATORS.items():
        model.opt.integrator = integrator
        restore()
        mujoco.mj_step(model, data)
        ends = ["qpos", "qvel"] + (["act"] if model.na else []) + (["sensordata"] if model.nsensordata else [])
        out["steps"][name] = numbers(data, ends)
    return out


def rollout(model, data, rng, spread, speed, seconds):
    """From a random state: the state and the sensors ten times on the way."""
    randomise(model, data, rng, spread, speed)
    out = start(data)
    kept = {name: np.array(getattr(data, name)) for name in out}
    out["every"] = round(seconds / model.opt.timestep / 10)
    out["runs"] = {}
    for name, integrator in INTEGRATORS.items():
        model.opt.integrator = integrator
        mujoco.mj_resetData(model, data)
        for key, values in kept.items():
            getattr(data, key)[:] = values
        out["runs"][name] = []
        for _ in range(10):
            for _ in range(out["every"]):
                mujoco.mj_step(model, data)
            ends = ["qpos", "qvel"] + (["sensordata"] if model.nsensordata else [])
            out["runs"][name].append(numbers(data, ends))
        assert not any(w.number for w in data.warning)
    return out


def scene(name, xml, rng, arrays=(), compiled=(), samples=3, spread=1.0, speed=2.0, seconds=0.0):
    """All of it for one scene; `compiled`: fields of the model."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    names = {kind: [getattr(model, kind)(i).name for i in range(getattr(model, n))] for kind, n in NAMES.items()}
    out = {"name": name, "xml": xml, "names": names, "compiled": numbers(model, compiled)}
    out["samples"] = [sample(model, data, rng, arrays, spread, speed) for _ in range(samples)]
    out["rollouts"] = [rollout(model, data, rng, spread, speed, seconds)] if seconds else []
    return out
