"""Functions of MuJoCo's that follow from others: solutions with the inertia matrix, inverse dynamics without contacts,
derivatives of a step by finite differences.
"""

from __future__ import annotations

import numpy as np

from ._enums import mjtObj, mjtState
from ._penny import MjData, MjModel, mj_differentiatePos, mj_forward, mj_fullM, mj_integratePos, mj_step
from ._state import mj_getState, mj_setState, mj_stateSize

# Parts of MuJoCo's `mj_forward`. Each does all of it: what MuJoCo would leave as it was is that of the state, too.
_PARTS = (
    "mj_camlight", "mj_collision", "mj_comVel", "mj_fwdAcceleration", "mj_fwdActuation", "mj_fwdConstraint",
    "mj_fwdPosition", "mj_fwdVelocity", "mj_passive",
)  # fmt: skip
globals().update(dict.fromkeys(_PARTS, mj_forward))

__all__ = ["mj_objectAcceleration", "mj_rne", "mj_solveM", "mjd_transitionFD", *_PARTS]


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


def mj_objectAcceleration(m: MjModel, d: MjData, objtype: int, objid: int, res: np.ndarray, flg_local: int) -> None:
    """Angular and linear acceleration of a thing, in its own axes or the world's; −g for what rests, as in `cacc`.

    a = a_ref + α × r + ω × v        r from the reference point of `cacc`, v and ω of the thing
    """
    if np.size(res) != 6:
        raise TypeError(f"res should have 6 numbers, not {np.size(res)}")
    kinds = {
        mjtObj.mjOBJ_BODY: (None, d.xipos, d.ximat),
        mjtObj.mjOBJ_XBODY: (None, d.xpos, d.xmat),
        mjtObj.mjOBJ_GEOM: (m.geom_bodyid, d.geom_xpos, d.geom_xmat),
        mjtObj.mjOBJ_SITE: (m.site_bodyid, d.site_xpos, d.site_xmat),
        mjtObj.mjOBJ_CAMERA: (m.cam_bodyid, d.cam_xpos, d.cam_xmat),
    }
    if objtype not in kinds:
        raise NotImplementedError(f"mj_objectAcceleration: Penny has no places of mjtObj {int(objtype)}")
    bodies, places, axes = kinds[objtype]
    if not 0 <= objid < len(places):
        raise IndexError(f"object {objid}: there are {len(places)}")
    body = objid if bodies is None else int(bodies[objid])
    r = places[objid] - d.subtree_com[m.body_rootid[body]]
    (spin, speed), (turn, pull) = d.cvel[body].reshape(2, 3), d.cacc[body].reshape(2, 3)
    linear = pull + np.cross(turn, r) + np.cross(spin, speed + np.cross(spin, r))
    frame = axes[objid].reshape(3, 3) if flg_local else np.eye(3)
    res[...] = np.concatenate([turn @ frame, linear @ frame]).reshape(np.shape(res))


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
