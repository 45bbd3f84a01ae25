"""Every file of models/ as MuJoCo reads it: that it loads without a warning, and what it becomes."""

import pathlib
import warnings

import mujoco

MODELS = pathlib.Path(__file__).parents[3] / "models"


def generate():
    warnings.simplefilter("error")
    scenes = []
    for path in sorted(MODELS.glob("*.xml")):
        m = mujoco.MjModel.from_xml_path(str(path))
        scenes.append({
            "name": path.name,
            "nq": m.nq,
            "nv": m.nv,
            "timestep": m.opt.timestep,
            "qpos0": m.qpos0.tolist(),
            "body_mass": m.body_mass.tolist(),
            "body": [m.body(i).name for i in range(m.nbody)],
            "geom": [m.geom(i).name for i in range(m.ngeom)],
            "keys": [{"name": m.key(i).name, "qpos": m.key_qpos[i].tolist(), "qvel": m.key_qvel[i].tolist()}
                     for i in range(m.nkey)],
        })
    return {"scenes": scenes}
