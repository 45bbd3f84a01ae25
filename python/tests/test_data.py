"""`MjData` and MuJoCo's functions on it, against MuJoCo, at random states with contacts."""

import copy
import gc
import pickle
import resource
import threading

import mujoco
import numpy as np
import pytest
from conftest import ASSETS, MODELS, Pair, close

import penny

# Of other axes of inertia than MuJoCo's, which are not unique.
AXES = {"ximat", "xiquat"}
# Where MuJoCo's solver starts, which no result depends on.
STARTS = {"qacc_warmstart"}


def test_every_array_has_mujocos_numbers(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    mujoco.mj_rnePostConstraint(mm, md)
    mujoco.mj_subtreeVel(mm, md)
    mujoco.mj_energyPos(mm, md)
    mujoco.mj_energyVel(mm, md)
    compared = 0
    for name in dir(md):
        theirs = getattr(md, name)
        if name.startswith("_") or not isinstance(theirs, (np.ndarray, int, float)) or not hasattr(pd, name):
            continue
        ours = getattr(pd, name)
        compared += 1
        if not isinstance(theirs, np.ndarray):
            assert ours == theirs, name
            continue
        assert (ours.shape, ours.dtype) == (theirs.shape, theirs.dtype), name
        if name not in AXES | STARTS:
            assert close(ours, theirs, 1e-8), name
    assert compared > 45
    for ours, theirs, moments in zip(pd.ximat, md.ximat, pm.body_inertia):
        about = [axes.reshape(3, 3) @ np.diag(moments) @ axes.reshape(3, 3).T for axes in (ours, theirs)]
        assert close(*about)


def test_contacts(random_state):
    md, pd = random_state.md, random_state.pd
    assert pd.ncon == len(pd.contact) == md.ncon
    for name in (
        "dist", "pos", "frame", "includemargin", "friction", "solref", "solimp", "dim", "geom1", "geom2", "geom",
        "exclude", "efc_address",
    ):  # fmt: skip
        assert close(getattr(pd.contact, name), getattr(md.contact, name), 1e-8), name
    for i in range(md.ncon):
        ours, theirs = np.zeros(6), np.zeros(6)
        mujoco.mj_contactForce(random_state.mm, md, i, theirs)
        penny.mj_contactForce(random_state.pm, pd, i, ours)
        assert close(ours, theirs, 1e-7)
        assert pd.contact[i].geom1 == md.contact[i].geom1 and close(pd.contact[i].pos, md.contact[i].pos)
    assert len(pd.contact[: pd.ncon]) == pd.ncon
    with pytest.raises(IndexError):
        pd.contact[pd.ncon]


def test_inertia_matrix(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    ours, theirs = np.zeros((mm.nv, mm.nv)), np.zeros((mm.nv, mm.nv))
    mujoco.mj_fullM(mm, md, theirs)
    penny.mj_fullM(pm, pd, ours)
    assert close(ours, theirs)
    x, y = np.zeros(mm.nv), np.arange(mm.nv, dtype=float)
    penny.mj_mulM(pm, pd, x, y)
    assert close(x, theirs @ y)


def test_solutions_and_inverse_dynamics(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    y = np.random.default_rng(0).normal(size=(2, mm.nv))
    ours, theirs = np.zeros((2, mm.nv)), np.zeros((2, mm.nv))
    mujoco.mj_solveM(mm, md, theirs, y)
    penny.mj_solveM(pm, pd, ours, y)
    assert close(ours, theirs, 1e-8)
    for acceleration in (0, 1):
        ours, theirs = np.zeros(mm.nv), np.zeros(mm.nv)
        mujoco.mj_rne(mm, md, acceleration, theirs)
        penny.mj_rne(pm, pd, acceleration, ours)
        # MuJoCo leaves armatures to others here.
        armature = pm.dof_armature * pd.qacc if acceleration else 0
        if not mm.ntendon:
            assert close(ours - armature, theirs, 1e-7)


def test_inverse_dynamics_of_given_accelerations(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    qacc = 10 * np.random.default_rng(0).normal(size=mm.nv)
    for module, m, d in ((mujoco, mm, md), (penny, pm, pd)):
        d.qacc = qacc
        module.mj_inverse(m, d)
    for name in ("qacc", "qfrc_inverse", "qfrc_constraint", "sensordata"):
        assert close(getattr(pd, name), getattr(md, name)), name
    with pytest.raises(NotImplementedError, match="after mj_inverse"):
        pd.efc_force  # noqa: B018


@pytest.mark.parametrize("law", ["mujoco", "penalty", "tutorial"])
def test_inverse_dynamics_of_a_laws_own_accelerations_are_the_applied_forces(random_state, law):
    m, d = random_state.pm, random_state.pd
    m.opt.law = law
    penny.mj_forward(m, d)
    applied = d.qfrc_smooth + d.qfrc_bias - d.qfrc_passive
    penny.mj_inverse(m, d)
    scale = np.abs(d.qfrc_constraint).max(initial=1)
    # Stiff edges of friction pyramids drown in the last digits of qacc.
    assert np.abs(d.qfrc_inverse - applied).max(initial=0) < 1e-7 * scale
    if law != "mujoco":
        with pytest.raises(NotImplementedError, match=f"the law `{law}`"):
            d.efc_J  # noqa: B018


@pytest.mark.parametrize("local", [0, 1])
def test_accelerations_of_things(random_state, local):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    mujoco.mj_rnePostConstraint(mm, md)
    for kind, n in (("BODY", mm.nbody), ("XBODY", mm.nbody), ("GEOM", mm.ngeom), ("SITE", mm.nsite)):
        # Axes of inertia are not unique.
        for i in range(0 if kind == "BODY" and local else n):
            ours, theirs = np.zeros(6), np.zeros(6)
            mujoco.mj_objectAcceleration(mm, md, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), i, theirs, local)
            penny.mj_objectAcceleration(pm, pd, getattr(penny.mjtObj, f"mjOBJ_{kind}"), i, ours, local)
            assert close(ours, theirs, 1e-8), (kind, i)


def test_a_function_controls_every_step():
    pair = Pair(ASSETS / "half_cheetah.xml")
    times = []

    def control(m, d):
        times.append(d.time)
        d.ctrl[:] = -0.5 * d.qvel[3:] + 0.1 * d.xpos[1, 2]

    try:
        for module, m, d in ((mujoco, pair.mm, pair.md), (penny, pair.pm, pair.pd)):
            module.set_mjcb_control(control)
            module.mj_step(m, d, 20)
            module.mj_forward(m, d)
            module.mj_step1(m, d)
        assert penny.get_mjcb_control() is control and times[:22] == times[22:]
        assert close(pair.pd.qpos, pair.md.qpos) and close(pair.pd.qacc, pair.md.qacc, 1e-8)

        def broken(m, d):
            raise KeyError("gain")

        penny.set_mjcb_control(broken)
        with pytest.raises(KeyError, match="gain"):
            penny.mj_step(pair.pm, pair.pd)
        pair.pm.opt.integrator = int(penny.mjtIntegrator.mjINT_RK4)
        with pytest.raises(NotImplementedError, match="RK4"):
            penny.mj_step(pair.pm, pair.pd)
    finally:
        penny.set_mjcb_control(None)
        mujoco.set_mjcb_control(None)


@pytest.mark.parametrize("centred", [0, 1])
@pytest.mark.parametrize("scene", [ASSETS / "half_cheetah.xml", MODELS / "arm.xml"], ids=lambda p: p.stem)
def test_derivatives_of_a_step(scene, centred):
    pair = Pair(scene).randomize(2)
    m, results = pair.mm, []
    n, ns = 2 * m.nv + m.na, m.nsensordata
    for module, model, d in ((mujoco, pair.mm, pair.md), (penny, pair.pm, pair.pd)):
        matrices = [np.zeros(shape) for shape in ((n, n), (n, m.nu), (ns, n), (ns, m.nu))]
        before = d.qpos.copy()
        module.mjd_transitionFD(model, d, 1e-6, centred, *matrices)
        assert np.array_equal(d.qpos, before)
        results.append(matrices)
    # MuJoCo does not compute energies anew where only velocities change.
    same = np.ones(ns, dtype=bool)
    same[m.sensor_adr[m.sensor_type == int(mujoco.mjtSensor.mjSENS_E_KINETIC)]] = False
    for theirs, ours, rows in zip(*results, (slice(None), slice(None), same, same)):
        assert close(ours[rows], theirs[rows], 1e-4)


def test_jacobians(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd

    def both(name, *args):
        result = []
        for module, m, d in ((mujoco, mm, md), (penny, pm, pd)):
            p, r = np.zeros((3, mm.nv)), np.zeros((3, mm.nv))
            getattr(module, name)(m, d, p, r, *args)
            result.append(np.vstack([p, r]))
        return close(*reversed(result))

    for body in range(mm.nbody):
        assert both("mj_jac", np.array([0.1, 0.2, 0.3]), body)
        assert both("mj_jacBody", body) and both("mj_jacBodyCom", body)
        ours, theirs = np.zeros((3, mm.nv)), np.zeros((3, mm.nv))
        mujoco.mj_jacSubtreeCom(mm, md, theirs, body)
        penny.mj_jacSubtreeCom(pm, pd, ours, body)
        assert close(ours, theirs)
    assert all(both("mj_jacGeom", i) for i in range(mm.ngeom)) and all(both("mj_jacSite", i) for i in range(mm.nsite))
    only = np.zeros((3, mm.nv))
    penny.mj_jac(pm, pd, None, only, [0, 0, 0], mm.nbody - 1)


def test_object_velocity_and_applied_wrench(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    for kind, n in (("BODY", mm.nbody), ("XBODY", mm.nbody), ("GEOM", mm.ngeom), ("SITE", mm.nsite)):
        for i in range(n):
            # Axes of inertia are not unique: velocities in them are not either.
            for local in (0,) if kind == "BODY" else (0, 1):
                ours, theirs = np.zeros(6), np.zeros(6)
                mujoco.mj_objectVelocity(mm, md, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), i, theirs, local)
                penny.mj_objectVelocity(pm, pd, getattr(penny.mjtObj, f"mjOBJ_{kind}"), i, ours, local)
                assert close(ours, theirs), (kind, i, local)
    ours, theirs = np.ones(mm.nv), np.ones(mm.nv)
    args = np.array([1.0, 2, 3]), np.array([3.0, 2, 1]), np.array([0.1, 0.2, 0.3]), mm.nbody - 1
    mujoco.mj_applyFT(mm, md, *args, theirs)
    penny.mj_applyFT(pm, pd, *args, ours)
    assert close(ours, theirs)


def test_rays(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    random = np.random.default_rng(0)
    met = 0
    for _ in range(50):
        point = np.array([0, 0, 1.5]) + random.normal(size=3)
        # Towards something, and past it.
        way = md.geom_xpos[random.integers(mm.ngeom)] - point + 0.1 * random.normal(size=3)
        group, static = random.integers(0, 2, 6).astype(np.uint8), int(random.integers(2))
        for args in ((None, True, -1), (group, static, int(random.integers(mm.nbody)))):
            a, b = np.zeros(1, np.int32), np.zeros(1, np.int32)
            theirs = mujoco.mj_ray(mm, md, point, way, *args, a)
            ours = penny.mj_ray(pm, pd, point, way, *args, b)
            # Where two geoms touch either may be met first.
            assert np.isclose(ours, theirs, atol=1e-9) and (a[0] < 0) == (b[0] < 0)
            met += a[0] >= 0
    assert met > 20


def test_positions_on_the_manifold(random_state):
    mm, pm = random_state.mm, random_state.pm
    velocity = np.random.default_rng(0).normal(size=mm.nv)
    ours, theirs = random_state.md.qpos.copy(), random_state.md.qpos.copy()
    mujoco.mj_integratePos(mm, theirs, velocity, 0.3)
    penny.mj_integratePos(pm, ours, velocity, 0.3)
    assert close(ours, theirs)
    back, expected = np.zeros(mm.nv), np.zeros(mm.nv)
    mujoco.mj_differentiatePos(mm, expected, 0.3, random_state.md.qpos, theirs)
    penny.mj_differentiatePos(pm, back, 0.3, random_state.md.qpos, ours)
    assert close(back, expected, 1e-8)
    q = np.full(mm.nq, 0.5)
    other = q.copy()
    mujoco.mj_normalizeQuat(mm, q)
    penny.mj_normalizeQuat(pm, other)
    assert close(other, q)


def test_states_as_vectors(random_state):
    mm, md, pm, pd = random_state.mm, random_state.md, random_state.pm, random_state.pd
    for sig in (1, 2, 4, 6, 1 | 64, 256, "PHYSICS", "FULLPHYSICS", "USER", "INTEGRATION"):
        ours = sig if isinstance(sig, int) else getattr(penny.mjtState, f"mjSTATE_{sig}")
        theirs = sig if isinstance(sig, int) else int(getattr(mujoco.mjtState, f"mjSTATE_{sig}"))
        n = penny.mj_stateSize(pm, ours)
        if mm.ntendon == mm.neq == 0:
            assert n == mujoco.mj_stateSize(mm, theirs)
        a = np.zeros(n)
        penny.mj_getState(pm, pd, a, ours)
        if n == mujoco.mj_stateSize(mm, theirs) and sig != "INTEGRATION":
            b = np.zeros(n)
            mujoco.mj_getState(mm, md, b, theirs)
            a[0], b[0] = 0, 0
            assert close(a, b)
    state = np.zeros(penny.mj_stateSize(pm, penny.mjtState.mjSTATE_INTEGRATION))
    penny.mj_getState(pm, pd, state, penny.mjtState.mjSTATE_INTEGRATION)
    penny.mj_step(pm, pd, 10)
    after = pd.qpos.copy()
    penny.mj_setState(pm, pd, state, penny.mjtState.mjSTATE_INTEGRATION)
    penny.mj_step(pm, pd, 10)
    assert np.array_equal(pd.qpos, after)
    with pytest.raises(TypeError, match="mj_stateSize"):
        penny.mj_setState(pm, pd, state[1:], penny.mjtState.mjSTATE_INTEGRATION)


def test_moments_are_stored_as_mujoco_stores_them():
    text = """<mujoco><worldbody>
      <body><joint name="a" axis="0 0 1"/><geom size=".1" pos=".1 0 0"/><site name="r" pos="0 .1 0"/>
        <body pos=".2 0 0"><joint name="b" axis="0 0 1"/><geom size=".1" pos=".1 0 0"/><site name="s"/></body></body>
      <body pos="0 0 1"><freejoint name="f"/><geom size=".1"/><site name="t"/></body>
      <body pos="0 1 1"><joint type="ball" name="g"/><geom size=".1"/><site name="u" pos="0 .1 0"/></body></worldbody>
      <tendon><fixed name="x"><joint joint="b" coef="0"/><joint joint="a" coef="1"/></fixed>
        <spatial name="y"><site site="s"/><site site="t"/></spatial></tendon>
      <actuator><motor site="s" gear="0 0 1 0 0 0"/><motor site="s" gear="1 1 0 0 0 0"/><motor joint="b"/>
        <motor joint="f" gear="0 0 1"/><motor jointinparent="f" gear="0 0 1 0 1 0"/><motor joint="g" gear="1 0 2"/>
        <motor tendon="x"/><motor tendon="y"/><motor site="s" refsite="t" gear="1 0 0 0 0 0"/>
        <motor site="u" refsite="u"/><motor site="s" refsite="r" gear="1 1 0 0 0 1"/>
        <general cranksite="s" slidersite="u" cranklength="3"/></actuator></mujoco>"""
    mm, pm = mujoco.MjModel.from_xml_string(text), penny.MjModel.from_xml_string(text)
    md, pd = mujoco.MjData(mm), penny.MjData(pm)
    mujoco.mj_forward(mm, md)
    assert pm.nJmom == mm.nJmom
    for name in ("moment_rownnz", "moment_rowadr", "moment_colind", "actuator_moment"):
        ours, theirs = getattr(pd, name), getattr(md, name)
        assert ours.dtype == theirs.dtype and close(ours, theirs), name
    kept = pd.actuator_moment
    md.qpos[0] = pd.qpos[0] = 0.3
    mujoco.mj_forward(mm, md)
    penny.mj_forward(pm, pd)
    assert close(kept, md.actuator_moment)


SLIDE = "<mujoco><worldbody><body><joint name='s' type='slide'/><geom size='.1'/></body></worldbody>{}</mujoco>"


@pytest.mark.parametrize(
    ("name", "value"), [("qpos", np.nan), ("qvel", 1e11), ("ctrl", np.inf), ("qfrc_applied", 1e300)]
)
def test_warnings_count_what_left_the_numbers(name, value):
    text = SLIDE.format("<actuator><motor joint='s'/></actuator>")
    mm, pm = mujoco.MjModel.from_xml_string(text), penny.MjModel.from_xml_string(text)
    md, pd = mujoco.MjData(mm), penny.MjData(pm)
    ours, before = pd.warning, copy.copy(pd)
    for d in (md, pd):
        getattr(d, name)[0] = value
    mujoco.mj_step(mm, md)
    with pytest.raises(penny.StepError):
        penny.mj_step(pm, pd)
    assert np.array_equal(ours.number, md.warning.number) and ours.number.sum() == 1
    assert np.array_equal(ours.lastinfo, md.warning.lastinfo) and len(ours) == len(md.warning)
    kind = penny.mjtWarning(int(ours.number.argmax()))
    assert kind.name == mujoco.mjtWarning(int(kind)).name and ours[kind].number == ours[kind - 7].number == 1
    assert copy.copy(pd).warning == ours != before.warning and [w.number for w in ours[3:]] == list(ours.number[3:])
    ours[kind].number = 5
    assert ours.number[kind] == 5 and "number: 5" in repr(ours[kind])
    penny.mj_resetData(pm, pd)
    assert not pd.warning.number.any() and not ours.lastinfo.any()
    with pytest.raises(IndexError):
        ours[7]


def test_steps(pair):
    pair.randomize(3)
    for _ in range(10):
        mujoco.mj_step(pair.mm, pair.md)
    penny.mj_step(pair.pm, pair.pd, nstep=10)
    # Chaos has little time in ten steps.
    assert close(pair.pd.qpos, pair.md.qpos, 1e-8) and close(pair.pd.qvel, pair.md.qvel, 1e-6)
    assert pair.pd.time == pytest.approx(pair.md.time)
    # What follows from the state is that of the beginning of the step.
    assert close(pair.pd.xpos, pair.md.xpos, 1e-8) and close(pair.pd.sensordata, pair.md.sensordata, 1e-6)


def test_a_step_in_two_halves():
    m = penny.MjModel.from_xml_path(ASSETS / "half_cheetah.xml")
    a, b = penny.MjData(m), penny.MjData(m)
    for _ in range(20):
        penny.mj_step1(m, a)
        a.ctrl = -0.5 * a.qvel[3:]
        penny.mj_step2(m, a)
        b.ctrl = -0.5 * b.qvel[3:]
        penny.mj_step(m, b)
    assert np.array_equal(a.qpos, b.qpos)


def test_resets(pair):
    pair.randomize(5)
    for module, m, d in ((mujoco, pair.mm, pair.md), (penny, pair.pm, pair.pd)):
        module.mj_step(m, d, 3)
        module.mj_resetData(m, d)
    for name in ("qpos", "qvel", "ctrl", "qfrc_applied", "xfrc_applied", "act", "time"):
        assert np.all(getattr(pair.pd, name) == getattr(pair.md, name)), name
    for key in range(pair.mm.nkey):
        mujoco.mj_resetDataKeyframe(pair.mm, pair.md, key)
        penny.mj_resetDataKeyframe(pair.pm, pair.pd, key)
        assert close(pair.pd.qpos, pair.md.qpos) and close(pair.pd.qvel, pair.md.qvel)
    with pytest.raises(IndexError, match="keyframe"):
        penny.mj_resetDataKeyframe(pair.pm, pair.pd, pair.mm.nkey)


def test_things_by_name(random_state):
    mm, md, pd = random_state.mm, random_state.md, random_state.pd
    mujoco.mj_rnePostConstraint(mm, md)
    mujoco.mj_subtreeVel(mm, md)
    for kind, n in (("body", mm.nbody), ("joint", mm.njnt), ("geom", mm.ngeom), ("site", mm.nsite), ("actuator", mm.nu),
                    ("sensor", mm.nsensor)):  # fmt: skip
        for i in range(n):
            theirs, ours = getattr(md, kind)(i), getattr(pd, kind)(i)
            assert (ours.id, ours.name) == (theirs.id, theirs.name)
            for name in dir(theirs):
                if name.startswith("_") or name in AXES | STARTS | {"id", "name"} or not hasattr(ours, name):
                    continue
                assert close(getattr(ours, name), getattr(theirs, name), 1e-7), (kind, i, name)


def test_what_is_written_by_name_is_written():
    m = penny.MjModel.from_xml_path(MODELS / "arm.xml")
    d = penny.MjData(m)
    d.joint(0).qvel = 2
    d.actuator(0).ctrl = 0.5
    d.body(2).xfrc_applied[2] = 7
    assert d.qvel[0] == 2 and d.ctrl[0] == 0.5 and d.xfrc_applied[2, 2] == 7


def test_arrays_follow_the_state_and_outlive_everything():
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    d = penny.MjData(m)
    qpos, xpos, row = d.qpos, d.xpos, d.xpos[1]
    before = qpos.copy(), xpos.copy()
    penny.mj_step(m, d, 50)
    assert qpos is d.qpos and xpos is d.xpos
    assert not np.array_equal(qpos, before[0]) and not np.array_equal(xpos, before[1])
    assert np.array_equal(row, d.xpos[1])
    last = qpos.copy(), xpos.copy()
    del m, d
    gc.collect()
    assert np.array_equal(qpos, last[0]) and np.array_equal(xpos, last[1])


def test_wrong_shapes_and_types_are_refused():
    m = penny.MjModel.from_xml_path(MODELS / "arm.xml")
    d = penny.MjData(m)
    with pytest.raises(ValueError, match="broadcast"):
        d.qpos = np.zeros(m.nq + 1)
    with pytest.raises(ValueError, match="could not convert"):
        d.qvel = "fast"
    with pytest.raises(TypeError, match="shape"):
        penny.mj_jac(m, d, np.zeros((2, m.nv)), None, np.zeros(3), 1)
    with pytest.raises(TypeError):
        penny.mj_jac(m, d, np.zeros((3, m.nv), dtype=np.float32), None, np.zeros(3), 1)
    with pytest.raises(TypeError, match="point"):
        penny.mj_jac(m, d, np.zeros((3, m.nv)), None, np.zeros(4), 1)
    with pytest.raises(IndexError, match="body 99"):
        penny.mj_jacBody(m, d, np.zeros((3, m.nv)), None, 99)
    wide = np.zeros((m.nv, 2 * m.nv))[:, ::2]
    penny.mj_fullM(m, d, wide)
    dense = np.zeros((m.nv, m.nv))
    penny.mj_fullM(m, d, dense)
    assert np.array_equal(wide, dense)
    dense.flags.writeable = False
    with pytest.raises(TypeError, match="cannot be written"):
        penny.mj_fullM(m, d, dense)
    with pytest.raises(ValueError, match="own its data"):
        d.qpos.resize(100, refcheck=False)
    with pytest.raises(AttributeError, match="did you mean `qpos`"):
        d.qops  # noqa: B018
    with pytest.raises(AttributeError, match="MuJoCo may have it"):
        d.flexvert_xpos  # noqa: B018
    with pytest.raises(TypeError, match="another model"):
        penny.mj_step(penny.MjModel.from_xml_path(MODELS / "tee.xml"), d)


def test_a_run_that_diverges_says_where():
    m = penny.MjModel.from_xml_path(MODELS / "arm.xml")
    d = penny.MjData(m)
    d.qvel[0] = np.nan
    with pytest.raises(penny.StepError, match="at 0"):
        penny.mj_step(m, d)
    penny.mj_resetData(m, d)
    penny.mj_step(m, d)


def test_copies_and_pickles_go_on_alike():
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    d = penny.MjData(m)
    penny.mj_step(m, d, 100)
    others = copy.copy(d), copy.deepcopy(d), pickle.loads(pickle.dumps(d))
    assert others[0].model is m and others[1].model is not m
    assert np.array_equal(others[1].xpos, d.xpos)
    penny.mj_step(m, d, 100)
    for other in others:
        penny.mj_step(other.model, other, 100)
        assert np.array_equal(other.qpos, d.qpos) and other.time == d.time


def test_one_data_becomes_another():
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    a, b = penny.MjData(m), penny.MjData(m)
    penny.mj_step(m, a, 100)
    penny.mj_copyData(b, m, a)
    assert np.array_equal(a.xpos, b.xpos) and np.array_equal(a.contact.dist, b.contact.dist)
    for d in (a, b):
        penny.mj_step(m, d, 100)
    assert np.array_equal(a.qpos, b.qpos)


def test_a_keyframe_is_set():
    m = penny.MjModel.from_xml_path(MODELS / "disk_traction.xml")
    d = penny.MjData(m)
    penny.mj_step(m, d, 10)
    penny.mj_setKeyframe(m, d, 0)
    other = penny.MjData(m)
    penny.mj_resetDataKeyframe(m, other, 0)
    assert np.array_equal(other.qpos, d.qpos) and other.time == d.time


def test_threads():
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    alone = penny.MjData(m)
    penny.mj_step(m, alone, 300)
    datas = [penny.MjData(m) for _ in range(4)]
    work = [threading.Thread(target=penny.mj_step, args=(m, d, 300)) for d in datas]
    [t.start() for t in work]
    [t.join() for t in work]
    assert all(np.array_equal(d.qpos, alone.qpos) for d in datas)


def memory():
    """Peak so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def test_memory_does_not_grow():
    text = (MODELS / "pendulum.xml").read_text()
    m = penny.MjModel.from_xml_string(text)
    d = penny.MjData(m)

    def work(loads, steps):
        for _ in range(loads):
            penny.MjData(penny.MjModel.from_xml_string(text)).xpos  # noqa: B018
        for _ in range(steps):
            penny.mj_step(m, d)
            d.xpos  # noqa: B018

    work(500, 20_000)
    before = memory()
    work(10_000, 1_000_000)
    assert memory() - before < 2
