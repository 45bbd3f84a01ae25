"""`MjModel` against MuJoCo's: numbers, types and shapes of all arrays, names, and what a write does."""

import copy
import pickle

import mujoco
import numpy as np
import pytest
from conftest import MODELS, close

import penny

# Principal axes are unique only up to signs, and not even that where two moments are equal.
AXES = {"body_iquat"}
# MuJoCo keeps what a default class gives to components of a size that a shape has not.
SIZES = {"geom_size", "site_size"}


def test_every_array_has_mujocos_numbers(pair):
    compared = 0
    for name in dir(pair.mm):
        theirs = getattr(pair.mm, name)
        if name.startswith("_") or not isinstance(theirs, (np.ndarray, int)) or not hasattr(pair.pm, name):
            continue
        ours = getattr(pair.pm, name)
        compared += 1
        if isinstance(theirs, int):
            assert ours == theirs, name
            continue
        assert (ours.shape, ours.dtype) == (theirs.shape, theirs.dtype), name
        # Places in `names`, which has none of what Penny lacks.
        if name not in AXES | SIZES and not name.startswith("name_"):
            assert close(ours, theirs), name
    assert compared > 90


def test_options_are_the_files(pair):
    for name in dir(pair.pm.opt):
        if name not in {"law", "solver", "disableflags", "enableflags"}:
            assert np.all(getattr(pair.pm.opt, name) == getattr(pair.mm.opt, name)), name


def test_names(pair):
    sizes = {
        "BODY": "nbody", "JOINT": "njnt", "GEOM": "ngeom", "SITE": "nsite", "ACTUATOR": "nu", "SENSOR": "nsensor",
        "KEY": "nkey", "CAMERA": "ncam", "TENDON": "ntendon", "EQUALITY": "neq",
    }  # fmt: skip
    for kind, n in sizes.items():
        kind = f"mjOBJ_{kind}"
        for i in range(-1, getattr(pair.mm, n) + 1):
            theirs = mujoco.mj_id2name(pair.mm, getattr(mujoco.mjtObj, kind), i)
            assert penny.mj_id2name(pair.pm, getattr(penny.mjtObj, kind), i) == theirs
            if theirs:
                assert penny.mj_name2id(pair.pm, getattr(penny.mjtObj, kind), theirs) == i
    assert penny.mj_name2id(pair.pm, penny.mjtObj.mjOBJ_BODY, "nothing") == -1


def test_things_by_name(pair):
    for kind, n in (
        ("body", "nbody"),
        ("joint", "njnt"),
        ("geom", "ngeom"),
        ("actuator", "nu"),
        ("camera", "ncam"),
        ("tendon", "ntendon"),
        ("equality", "neq"),
    ):
        for i in range(getattr(pair.mm, n)):
            theirs, ours = getattr(pair.mm, kind)(i), getattr(pair.pm, kind)(i)
            assert (ours.id, ours.name) == (theirs.id, theirs.name)
            for name in set(dir(theirs)) - {"id", "name", "iquat", "size"}:
                if not name.startswith("_") and hasattr(ours, name):
                    assert close(getattr(ours, name), getattr(theirs, name)), name
    with pytest.raises(KeyError, match="Valid names"):
        pair.pm.body("nothing")
    with pytest.raises(KeyError, match="Valid names"):
        pair.pm.geom()
    with pytest.raises(IndexError, match="Valid indices"):
        pair.pm.geom(10_000)


# What a write does is what the same number in the file does.
BALL = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" friction="0.1 0.005 0.0001"/>
    <body name="ball" pos="0 0 {z}">
      <joint name="x" type="slide" axis="1 0 0" damping="{damping}"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom name="ball" size=".1" mass="{mass}" friction="{friction}" solref="{solref}"/>
    </body>
  </worldbody>
  <actuator><motor joint="x" gear="{gear}"/></actuator>
</mujoco>
"""
USUAL = {"z": 0.1, "damping": 0.1, "mass": 1, "friction": "0.7 0.01 0.001", "solref": "0.02 1", "gear": 1}


@pytest.mark.parametrize("law", ["mujoco", "penalty", "tutorial"])
@pytest.mark.parametrize(
    ("key", "text", "field", "row", "value"),
    [
        ("z", 0.25, "body_pos", 1, [0, 0, 0.25]),
        ("damping", 0.7, "dof_damping", 0, 0.7),
        ("friction", "0.2 0.01 0.001", "geom_friction", 1, [0.2, 0.01, 0.001]),
        ("solref", "0.05 0.5", "geom_solref", 1, [0.05, 0.5]),
        ("gear", 3, "actuator_gear", 0, [3, 0, 0, 0, 0, 0]),
    ],
)
def test_what_is_written_takes_effect_at_the_next_step(law, key, text, field, row, value):
    written = penny.MjModel.from_xml_string(BALL.format(**USUAL))
    data, untouched = penny.MjData(written), penny.MjData(written)
    compiled = penny.MjModel.from_xml_string(BALL.format(**{**USUAL, key: text}))
    expected = penny.MjData(compiled)
    written.opt.law = compiled.opt.law = law
    for d in (data, expected, untouched):
        d.ctrl, d.qvel = 2.0, [1.5, -1]
    penny.mj_step(written, untouched, 100)
    getattr(written, field)[row] = value
    penny.mj_step(written, data, 100)
    penny.mj_step(compiled, expected, 100)
    assert np.array_equal(data.qpos, expected.qpos)
    assert not np.array_equal(data.qpos, untouched.qpos)


ROTORS = """
<mujoco>
  <worldbody>
    <body><joint name="j" damping="1" armature="0.5"/><geom size="0.1" pos="0.2 0 0"/></body>
    <body pos="1 0 0"><joint name="k" type="slide"/><geom size="0.1"/></body>
  </worldbody>
  <tendon><fixed name="t" damping="0.5" armature="0.25"><joint joint="k" coef="2"/></fixed></tendon>
  <actuator>
    <motor joint="j" gear="2" damping="3" armature="0.25"/>
    <motor tendon="t" gear="0.5" damping="2" armature="1"/>
  </actuator>
</mujoco>
"""


@pytest.mark.parametrize("gear", [None, 0.25])
def test_damping_and_armature_of_actuators_are_apart_from_those_of_joints_and_tendons(gear):
    seen = []
    for module in (mujoco, penny):
        m = module.MjModel.from_xml_string(ROTORS)
        d = module.MjData(m)
        fields = [f"{of}_{what}" for of in ("dof", "tendon", "actuator") for what in ("damping", "armature")]
        seen.append([getattr(m, field).copy() for field in fields])
        if gear:
            m.actuator_gear[:, 0] = gear
        m.dof_damping[0], m.dof_armature[0] = 0.25, 0
        m.tendon_damping[0], m.tendon_armature[0] = 0, 0.5
        m.actuator_armature[0] = 2
        d.qvel[:] = 1
        module.mj_forward(m, d)
        seen[-1] += [getattr(m, field).copy() for field in fields] + [d.qfrc_passive.copy(), d.qacc.copy()]
    for theirs, ours in zip(*seen):
        np.testing.assert_allclose(ours, theirs, rtol=1e-14, atol=1e-15)


def test_a_view_of_an_array_is_watched_after_the_array_is_gone():
    m = penny.MjModel.from_xml_string(BALL.format(**USUAL))
    d = penny.MjData(m)
    row = m.actuator_gear[0]
    for _ in range(3):
        penny.mj_step(m, d)
    row[0] = 5
    d.ctrl = 1
    penny.mj_forward(m, d)
    assert d.qfrc_actuator[0] == 5


def test_options_take_effect():
    m = penny.MjModel.from_xml_string(BALL.format(**{**USUAL, "z": 1}))
    d = penny.MjData(m)
    m.opt.gravity[2] = -1
    m.opt.timestep = 0.01
    penny.mj_step(m, d)
    assert d.time == 0.01 and d.qvel[1] == -0.01
    m.opt.disableflags |= penny.mjtDisableBit.mjDSBL_GRAVITY
    penny.mj_forward(m, d)
    assert d.qacc[1] == 0
    m.opt.integrator = penny.mjtIntegrator.mjINT_RK4
    assert m.opt.integrator == 1
    m.opt.integrator = "implicit-euler"
    assert m.opt.integrator == "implicit-euler"
    penny.mj_step(m, d)


@pytest.mark.parametrize(
    ("name", "value", "error", "says"),
    [
        ("timestep", 0, ValueError, "above zero"),
        ("law", "penaltie", ValueError, "did you mean 'penalty'"),
        ("integrator", 2, NotImplementedError, "implicit"),
        ("solver", 1, NotImplementedError, "Newton"),
        ("noslip_tolerance", -1, ValueError, "noslip_tolerance"),
        ("timstep", 3, AttributeError, "timestep"),
        ("gravity", [1, 2], ValueError, "broadcast"),
    ],
)
def test_options_that_cannot_be_say_so(name, value, error, says):
    m = penny.MjModel.from_xml_string(BALL.format(**USUAL))
    with pytest.raises(error, match=says):
        setattr(m.opt, name, value)


def test_what_a_scene_cannot_be_is_refused_and_leaves_the_old_numbers():
    m = penny.MjModel.from_xml_string(BALL.format(**USUAL))
    d = penny.MjData(m)
    m.body_mass[1] = -1
    with pytest.raises(ValueError, match=r"body_mass.*ball"):
        penny.mj_step(m, d)
    assert m.body_mass[1] == 1
    m.jnt_range[0] = [0, 1]
    with pytest.raises(ValueError, match="limited"):
        penny.mj_step(m, d)
    m.opt.gravity = np.nan
    with pytest.raises(ValueError, match="gravity"):
        penny.mj_step(m, d)
    assert m.opt.gravity[2] == -9.81
    penny.mj_step(m, d)
    with pytest.raises(ValueError, match="read-only"):
        m.jnt_type[0] = 3
    with pytest.raises(AttributeError, match="cannot be set"):
        m.nq = 3
    with pytest.raises(AttributeError, match="geom_friction"):
        m.geom_frcition  # noqa: B018
    with pytest.raises(AttributeError, match="MuJoCo may have it"):
        m.flex_vert  # noqa: B018


def test_errors_of_a_file_have_places_and_cures():
    text = '<mujoco><worldbody><body><freejoint/><geom size=".1" fricton="1"/></body></worldbody></mujoco>'
    with pytest.raises(penny.SceneError, match="did you mean `friction`") as caught:
        penny.MjModel.from_xml_string(text)
    [problem] = caught.value.problems
    assert (problem.severity, problem.code, problem.line) == ("error", "unknown-attribute", 1)
    assert problem.column == text.index("fricton") + 1
    assert penny.check(text) == [problem]
    with pytest.raises(ValueError, match="cannot read"):
        penny.MjModel.from_xml_path("/no/such/file.xml")


def test_copies_and_pickles_are_models_of_their_own():
    m = penny.MjModel.from_xml_path(MODELS / "arm.xml")
    m.body_mass[2] = 3
    m.opt.timestep, m.opt.law = 0.001, "penalty"
    for other in (copy.copy(m), copy.deepcopy(m), pickle.loads(pickle.dumps(m))):
        assert other.body_mass[2] == 3 and other.opt.timestep == 0.001 and other.opt.law == "penalty"
        a, b = penny.MjData(m), penny.MjData(other)
        for model, d in ((m, a), (other, b)):
            penny.mj_step(model, d, 50)
        assert np.array_equal(a.qpos, b.qpos)
        other.body_mass[2] = 1
        assert m.body_mass[2] == 3


def test_names_as_mujoco_keeps_them(pair):
    def all_names(m, kind):
        return [m.names[at:].split(b"\0")[0].decode() for at in getattr(m, f"name_{kind}adr")]

    for kind in ("body", "jnt", "geom", "site", "cam", "eq", "tendon", "actuator", "sensor", "key"):
        assert all_names(pair.pm, kind) == all_names(pair.mm, kind), kind


def test_dofs_of_what_a_body_without_joints_carries_have_no_parent():
    scene = """<mujoco><worldbody><body><joint/><geom size="0.1"/></body>
        <body mocap="true"><body><joint/><geom size="0.1"/>
        <body><joint/><geom size="0.1"/></body></body></body></worldbody></mujoco>"""
    theirs, ours = (module.MjModel.from_xml_string(scene).dof_parentid for module in (mujoco, penny))
    assert np.array_equal(ours, theirs)
