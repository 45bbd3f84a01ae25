"""Functions of MuJoCo's that follow from others: solutions with the inertia matrix, inverse dynamics without contacts,
derivatives of a step by finite differences.
"""

from __future__ import annotations

import numpy as np

from ._enums import mjtState
from ._penny import MjData, MjModel, mj_differentiatePos, mj_fullM, mj_integratePos, mj_step
from ._state import mj_getState, mj_setState, mj_stateSize

__all__ = ["mj_rne", "mj_solveM", "mjd_transitionFD"]


def _inertia(m: MjModel, d: MjData) -> np.ndarray:
    matrix = np.zeros((m.nv, m.nv))
    mj_fullM(m, d, matrix)
    return matrix


def mj_solveM(m: MjModel, d: MjData, x: np.ndarray, y) -> None:
    """x = M⁻¹ y, for one vector (nv) or several as rows (n, nv)."""
    rows = np.asarray(y, dtype=float).reshape(-1, m.nv)
    if np.size(x) != rows.size:
        raise TypeError(f"x should have {rows.size} numbers, not {np.size(x)}")
    x[...] = np.linalg.solve(_inertia(m, d), rows.T).T.reshape(np.shape(x))


def mj_rne(m: MjModel, d: MjData, flg_acc: int, result: np.ndarray) -> None:
    """result = c(q, q̇), with `flg_acc` M q̈ + c: what the joints exert in all."""
    if np.size(result) != m.nv:
        raise TypeError(f"result should have nv = {m.nv} numbers, not {np.size(result)}")
    force = d.qfrc_bias.copy()
    if flg_acc:
        force += _inertia(m, d) @ d.qacc
    result[...] = force.reshape(np.shape(result))


def mjd_transitionFD(m: MjModel, d: MjData, eps: float, flg_centered: int, A=None, B=None, C=None, D=None) -> None:
    """Derivatives of a step by finite differences of size `eps`, one-sided or centred.

        x' = A x + B u,   s = C x + D u        x = (tangent of qpos, qvel, act), u = ctrl, s = sensordata

    Out: A (2 nv + na, 2 nv + na), B (2 nv + na, nu), C (nsensordata, 2 nv + na), D (nsensordata, nu), those that are
    given. As in MuJoCo a control at its limit is moved inwards only. `d` is left as it was.
    """
    sig = mjtState.mjSTATE_INTEGRATION
    start = np.zeros(mj_stateSize(m, sig))
    mj_getState(m, d, start, sig)
    nv, na, controls = m.nv, m.na, d.ctrl.copy()

    def step(direction=None, size=0.0, control=None):
        """State and sensors after a step from the start, moved along a direction, or with a control changed."""
        mj_setState(m, d, start, sig)
        if direction is not None:
            mj_integratePos(m, d.qpos, direction[:nv], size)
            d.qvel += size * direction[nv : 2 * nv]
            d.act += size * direction[2 * nv :]
        if control is not None:
            d.ctrl[control] += size
        mj_step(m, d)
        return d.qpos.copy(), d.qvel.copy(), d.act.copy(), d.sensordata.copy()

    def difference(low, high, by):
        moved = np.zeros(nv)
        mj_differentiatePos(m, moved, 1.0, low[0], high[0])
        state = np.concatenate([moved, high[1] - low[1], high[2] - low[2]]) / by
        return state, (high[3] - low[3]) / by

    def derivative(**how):
        forwards, backwards = how.pop("forwards", True), how.pop("backwards", bool(flg_centered))
        high = step(size=eps, **how) if forwards else here
        low = step(size=-eps, **how) if backwards else here
        return difference(low, high, eps * (forwards + backwards))

    here = step()
    size = 2 * nv + na
    for k, direction in enumerate(np.eye(size) if A is not None or C is not None else ()):
        state, sensors = derivative(direction=direction)
        if A is not None:
            A[:, k] = state
        if C is not None:
            C[:, k] = sensors
    for k in range(m.nu if B is not None or D is not None else 0):
        low, high = m.actuator_ctrlrange[k] if m.actuator_ctrllimited[k] else (-np.inf, np.inf)
        forwards = bool(controls[k] + eps <= high)
        backwards = bool(controls[k] - eps >= low) and (bool(flg_centered) or not forwards)
        state, sensors = derivative(control=k, forwards=forwards, backwards=backwards)
        if B is not None:
            B[:, k] = state
        if D is not None:
            D[:, k] = sensors
    mj_setState(m, d, start, sig)
