"""What MuJoCo reads from the files in tests/mjcf/good: the numbers that it takes over as they are."""

import pathlib

import mujoco

GOOD = pathlib.Path(__file__).parents[2] / "mjcf" / "good"
GEOM = "type condim contype conaffinity group priority friction solmix solref solimp margin gap rgba"
JOINT = "type limited margin stiffness solref solimp"
DOF = "damping armature frictionloss solref solimp"
PAIR = "dim friction solref solreffriction solimp margin gap"
ACTUATOR = "gear ctrllimited ctrlrange forcelimited forcerange gainprm biasprm"
OPTION = (
    "timestep gravity integrator cone impratio tolerance iterations disableflags enableflags "
    "o_margin o_solref o_solimp o_friction"
)


def arrays(model, kind, names):
    return {name: getattr(model, f"{kind}_{name}").tolist() for name in names.split()}


def names(model, kind, count):
    return [getattr(model, kind)(i).name for i in range(count)]


def texts(model):
    found = {}
    for i in range(model.ntext):
        start = model.text_adr[i]
        data = model.text_data[start : start + model.text_size[i]]
        found[mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TEXT, i)] = bytes(data).rstrip(b"\0").decode()
    return found


def option(model):
    values = {name: getattr(model.opt, name) for name in OPTION.split()}
    return {name: value.tolist() if hasattr(value, "tolist") else value for name, value in values.items()}


def generate():
    scenes = []
    for path in sorted(GOOD.glob("*.xml")):
        model = mujoco.MjModel.from_xml_path(str(path))
        scenes.append(
            {
                "name": path.name,
                "option": option(model),
                "body": names(model, "body", model.nbody),
                "geom": {"name": names(model, "geom", model.ngeom), **arrays(model, "geom", GEOM)},
                "joint": {"name": names(model, "joint", model.njnt), **arrays(model, "jnt", JOINT)},
                "dof": {"joint": model.dof_jntid.tolist(), **arrays(model, "dof", DOF)},
                "pair": arrays(model, "pair", PAIR),
                "actuator": arrays(model, "actuator", ACTUATOR),
                "numeric": {model.numeric(i).name: model.numeric(i).data.tolist() for i in range(model.nnumeric)},
                "text": texts(model),
                "key": {"name": names(model, "key", model.nkey), "time": model.key_time.tolist()},
            }
        )
    return scenes
