"""`rollout` against `mujoco.rollout`, and tables of trajectories in pieces."""

import mujoco
import numpy as np
import pytest
from conftest import ASSETS, MODELS, Pair, close
from mujoco import rollout as theirs

import penny
from penny import rollout as ours


def starts(pair, n):
    spec = penny.mjtState.mjSTATE_FULLPHYSICS
    states = np.zeros((n, penny.mj_stateSize(pair.pm, spec)))
    for i in range(n):
        pair.randomize(i)
        mujoco.mj_getState(pair.mm, pair.md, states[i], int(spec))
    return states


@pytest.mark.parametrize("scene", [ASSETS / "hopper.xml", MODELS / "arm.xml"], ids=lambda p: p.stem)
def test_trajectories_are_mujocos(scene):
    pair = Pair(scene)
    initial, control = starts(pair, 5), np.random.default_rng(0).uniform(-1, 1, (5, 12, pair.mm.nu))
    a, s = ours.rollout(pair.pm, pair.pd, initial, control)
    b, t = theirs.rollout(pair.mm, pair.md, initial, control)
    assert close(a, b, 1e-7) and close(s, t, 1e-5)
    # What has one of a thing has it for all.
    a1, _ = ours.rollout([pair.pm], [pair.pd], initial[0], control)
    b1, _ = theirs.rollout([pair.mm], [pair.md], initial[0], control)
    assert close(a1, b1, 1e-7)
    # Without controls those of the data count, of which MuJoCo's rollouts leave other ones.
    pair.randomize(9)
    a2, _ = ours.rollout(pair.pm, pair.pd, initial, nstep=3)
    b2, _ = theirs.rollout(pair.mm, pair.md, initial, nstep=3)
    assert close(a2, b2, 1e-7)
    out = np.zeros_like(a)
    same, _ = ours.rollout(pair.pm, pair.pd, initial, control, state=out)
    assert same is out and np.array_equal(out, a)


def test_threads_change_nothing():
    pair = Pair(ASSETS / "hopper.xml")
    initial, control = starts(pair, 6), np.random.default_rng(0).uniform(-1, 1, (6, 30, 3))
    with ours.Rollout(nthread=1) as one, ours.Rollout(nthread=2) as two:
        a, _ = one.rollout(pair.pm, pair.pd, initial, control)
        b, _ = two.rollout(pair.pm, pair.pd, initial, control)
    assert np.array_equal(a, b)
    d = penny.MjData(pair.pm)
    penny.mj_setState(pair.pm, d, initial[3], penny.mjtState.mjSTATE_FULLPHYSICS)
    for u in control[3]:
        d.ctrl = u
        penny.mj_step(pair.pm, d)
    assert np.array_equal(a[3, -1, 1:7], d.qpos)
    with pytest.raises(RuntimeError, match="shutdown"):
        one.rollout(pair.pm, pair.pd, initial, control)


def test_shapes_that_do_not_fit():
    pair = Pair(ASSETS / "hopper.xml")
    initial = starts(pair, 3)
    with pytest.raises(ValueError, match="trailing dimension of control"):
        ours.rollout(pair.pm, pair.pd, initial, np.zeros((3, 5, 2)))
    with pytest.raises(ValueError, match="lengths along dimension 0"):
        ours.rollout(pair.pm, pair.pd, initial, np.zeros((4, 5, 3)))
    with pytest.raises(ValueError, match="mjSTATE_USER"):
        ours.rollout(pair.pm, pair.pd, initial, control_spec=1)
    with pytest.raises(ValueError, match="'nstep': 4, 'control': 5"):
        ours.rollout(pair.pm, pair.pd, initial, np.zeros((3, 5, 3)), nstep=4)
    with pytest.raises(ValueError, match="trailing dimension of initial_state"):
        penny.rollout(pair.pm, initial.T)
    with pytest.raises(ValueError, match="'initial_state': 3, 'control': 2"):
        penny.rollout(pair.pm, initial, np.zeros((2, 5, 3)))
    assert len(penny.rollout(pair.pm, initial, nstep=0)["world"]) == 0


def test_a_world_that_fails_is_named():
    pair = Pair(ASSETS / "hopper.xml")
    initial = starts(pair, 2)
    initial[1, 1] = np.nan
    with pytest.warns(RuntimeWarning, match="world 1 stopped in step 0"):
        states, _ = ours.rollout(pair.pm, pair.pd, initial, nstep=4)
    assert np.isfinite(states[0]).all()


def test_a_table_of_trajectories():
    pair = Pair(ASSETS / "hopper.xml")
    initial, control = starts(pair, 5), np.random.default_rng(0).uniform(-1, 1, (5, 7, 3))
    table = penny.rollout(pair.pm, initial, control, piece=2)
    states, _ = ours.rollout(pair.pm, None, initial, control)
    assert np.array_equal(table["qpos1"].reshape(5, 7), states[:, :, 2])
    assert table["world"].tolist() == sorted(list(range(5)) * 7) and table["step"][:3].tolist() == [1, 2, 3]
