"""MuJoCo's state vectors: `mj_stateSize`, `mj_getState`, `mj_setState`."""

from __future__ import annotations

import numpy as np

from ._enums import mjtState

# In MuJoCo's order: bit, attribute, how many numbers. What Penny lacks has no numbers.
_PARTS = (
    (mjtState.mjSTATE_TIME, "time", lambda m: 1),
    (mjtState.mjSTATE_QPOS, "qpos", lambda m: m.nq),
    (mjtState.mjSTATE_QVEL, "qvel", lambda m: m.nv),
    (mjtState.mjSTATE_ACT, "act", lambda m: m.na),
    (mjtState.mjSTATE_WARMSTART, "qacc_warmstart", lambda m: m.nv),
    (mjtState.mjSTATE_CTRL, "ctrl", lambda m: m.nu),
    (mjtState.mjSTATE_QFRC_APPLIED, "qfrc_applied", lambda m: m.nv),
    (mjtState.mjSTATE_XFRC_APPLIED, "xfrc_applied", lambda m: 6 * m.nbody),
    (mjtState.mjSTATE_EQ_ACTIVE, "eq_active", lambda m: m.neq),
    (mjtState.mjSTATE_MOCAP_POS, "mocap_pos", lambda m: 3 * m.nmocap),
    (mjtState.mjSTATE_MOCAP_QUAT, "mocap_quat", lambda m: 4 * m.nmocap),
)


def _parts(m, sig):
    sig = int(sig)
    if sig < 0 or sig >= 1 << int(mjtState.mjNSTATE):
        raise ValueError(f"invalid state signature {sig}: it is a sum of mjtState bits")
    return [(name, size(m)) for bit, name, size in _PARTS if sig & bit]


def mj_stateSize(m, sig) -> int:
    """How many numbers the parts of the state have that `sig`, a sum of `mjtState` bits, asks for."""
    return sum(size for _, size in _parts(m, sig))


def mj_getState(m, d, state, sig) -> None:
    """Copies those parts of the state into `state`."""
    parts = _parts(m, sig)
    size = sum(n for _, n in parts)
    if np.size(state) != size:
        raise TypeError(f"state size should equal mj_stateSize(m, sig) = {size}, not {np.size(state)}")
    if not isinstance(state, np.ndarray) or not state.flags.writeable:
        raise TypeError("state should be an array that can be written")
    flat, at = state.reshape(-1), 0
    if not np.shares_memory(flat, state) and state.size:
        raise TypeError("state should be contiguous")
    for name, n in parts:
        flat[at : at + n] = np.ravel(getattr(d, name))
        at += n


def mj_setState(m, d, state, sig) -> None:
    """Copies `state` into those parts of the state."""
    parts = _parts(m, sig)
    flat, at = np.asarray(state, dtype=float).reshape(-1), 0
    size = sum(n for _, n in parts)
    if flat.size != size:
        raise TypeError(f"state size should equal mj_stateSize(m, sig) = {size}, not {flat.size}")
    for name, n in parts:
        if name == "time":
            d.time = float(flat[at])
        elif n:
            array = getattr(d, name)
            array[...] = flat[at : at + n].reshape(array.shape)
        at += n


def mj_setKeyframe(m, d, k: int) -> None:
    """The state of the data becomes the k-th keyframe of the model, but for mocap bodies.

    Errors: `IndexError` if there is no such keyframe, `NotImplementedError` for a model with mocap bodies.
    """
    if not 0 <= k < m.nkey:
        raise IndexError(f"keyframe {k}: there are {m.nkey}")
    if m.nmocap:
        raise NotImplementedError("Penny cannot set the mocap bodies of a keyframe")
    m.key_time[k], m.key_qpos[k], m.key_qvel[k], m.key_act[k], m.key_ctrl[k] = d.time, d.qpos, d.qvel, d.act, d.ctrl
