"""MuJoCo's small mathematics: quaternions w x y z, matrices row by row; results go into the first argument.

Source: MuJoCo 4.0 manual, API reference › Quaternions, Poses, Vector math.
"""

from __future__ import annotations

import numpy as np

__all__ = [
    "mju_axisAngle2Quat",
    "mju_cross",
    "mju_euler2Quat",
    "mju_mat2Quat",
    "mju_mulPose",
    "mju_mulQuat",
    "mju_negPose",
    "mju_negQuat",
    "mju_norm",
    "mju_norm3",
    "mju_normalize",
    "mju_normalize3",
    "mju_normalize4",
    "mju_quat2Mat",
    "mju_quat2Vel",
    "mju_quatIntegrate",
    "mju_quatZ2Vec",
    "mju_rotVecQuat",
    "mju_subQuat",
    "mju_trnVecPose",
]

_MINVAL = 1e-15


def _vector(values, n: int, name: str) -> np.ndarray:
    array = np.asarray(values, dtype=float).reshape(-1)
    if array.size != n:
        raise TypeError(f"{name} should have {n} numbers, not {array.size}")
    return array


def _fill(res, values, name: str = "res") -> None:
    if not isinstance(res, np.ndarray) or res.dtype != np.float64:
        raise TypeError(f"{name} should be an array of float64")
    if res.size != np.size(values):
        raise TypeError(f"{name} should have {np.size(values)} numbers, not {res.size}")
    res[...] = np.reshape(values, res.shape)


def _product(a, b):
    (w, x, y, z), (s, u, v, t) = a, b
    return np.array([
        w * s - x * u - y * v - z * t,
        w * u + x * s + y * t - z * v,
        w * v - x * t + y * s + z * u,
        w * t + x * v - y * u + z * s,
    ])  # fmt: skip


def _matrix(q):
    w, x, y, z = q
    return np.array([
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ])  # fmt: skip


def _turn(axis, angle):
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.asarray(axis))])


def _rotation_vector(q, dt):
    """Axis times angle in (−π, π], over dt."""
    sine = np.linalg.norm(q[1:])
    axis = q[1:] / sine if sine >= _MINVAL else np.array([1.0, 0, 0])
    angle = 2 * np.arctan2(sine, q[0])
    return axis * ((angle - 2 * np.pi if angle > np.pi else angle) / dt)


def mju_mulQuat(res, quat1, quat2) -> None:
    """res = quat1 quat2: first the rotation by quat2."""
    _fill(res, _product(_vector(quat1, 4, "quat1"), _vector(quat2, 4, "quat2")))


def mju_negQuat(res, quat) -> None:
    """The opposite rotation."""
    _fill(res, _vector(quat, 4, "quat") * [1, -1, -1, -1])


def mju_rotVecQuat(res, vec, quat) -> None:
    """The vector turned by the quaternion."""
    _fill(res, _matrix(_vector(quat, 4, "quat")) @ _vector(vec, 3, "vec"))


def mju_quat2Mat(res, quat) -> None:
    """The quaternion as a matrix, nine numbers."""
    _fill(res, _matrix(_vector(quat, 4, "quat")))


def mju_mat2Quat(quat, mat) -> None:
    """The matrix as a unit quaternion."""
    m = _vector(mat, 9, "mat").reshape(3, 3)
    # 4 q_i² for each component; one that is large enough divides safely, and is positive.
    squares = 1 + np.array([np.trace(m), *(2 * np.diag(m) - np.trace(m))])
    q = np.array([
        [squares[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], squares[1], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
        [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], squares[2], m[1, 2] + m[2, 1]],
        [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], squares[3]],
    ])[0 if np.trace(m) > 0 else 1 + int(np.argmax(squares[1:]))]  # fmt: skip
    _fill(quat, q / np.linalg.norm(q), "quat")


def mju_axisAngle2Quat(res, axis, angle: float) -> None:
    """The rotation by an angle (rad) about a unit axis."""
    _fill(res, _turn(_vector(axis, 3, "axis"), angle) if angle else [1, 0, 0, 0])


def mju_euler2Quat(quat, euler, seq: str) -> None:
    """Rotations about the axes that `seq` names: x y z the turned ones, X Y Z the fixed ones."""
    angles = _vector(euler, 3, "euler")
    if len(seq) != 3 or any(letter not in "xyzXYZ" for letter in seq):
        raise ValueError(f"seq has three letters of xyzXYZ, not '{seq}'")
    q = np.array([1.0, 0, 0, 0])
    for letter, angle in zip(seq, angles):
        turn = _turn(np.eye(3)["xyz".index(letter.lower())], angle)
        q = _product(q, turn) if letter.islower() else _product(turn, q)
    _fill(quat, q, "quat")


def mju_quat2Vel(res, quat, dt: float) -> None:
    """The angular velocity (rad/s) that makes the rotation in a time dt."""
    _fill(res, _rotation_vector(_vector(quat, 4, "quat"), dt))


def mju_subQuat(res, qa, qb) -> None:
    """The rotation vector (rad, in b's axes) that leads from qb to qa."""
    back = _vector(qb, 4, "qb") * [1, -1, -1, -1]
    _fill(res, _rotation_vector(_product(back, _vector(qa, 4, "qa")), 1.0))


def mju_quatIntegrate(quat, vel, scale: float) -> None:
    """quat ← quat exp(scale vel), vel in the body's axes, rad/s."""
    velocity = _vector(vel, 3, "vel")
    speed = np.linalg.norm(velocity)
    if speed >= _MINVAL:
        q = _product(_vector(quat, 4, "quat"), _turn(velocity / speed, scale * speed))
        _fill(quat, q / np.linalg.norm(q), "quat")


def mju_quatZ2Vec(quat, vec) -> None:
    """The rotation that turns the z axis to a vector by the shortest way."""
    v = _vector(vec, 3, "vec")
    size = np.linalg.norm(v)
    if size < _MINVAL:
        _fill(quat, [1, 0, 0, 0], "quat")
        return
    v = v / size
    axis = np.array([-v[1], v[0], 0])
    sine = np.linalg.norm(axis)
    if sine < 1e-10:
        _fill(quat, [0, 1, 0, 0] if v[2] < 0 else [1, 0, 0, 0], "quat")
        return
    _fill(quat, _turn(axis / sine, np.arctan2(sine, v[2])), "quat")


def mju_mulPose(posres, quatres, pos1, quat1, pos2, quat2) -> None:
    """Pose 2, seen from pose 1, in the frame in which pose 1 is given."""
    q = _vector(quat1, 4, "quat1")
    place = _vector(pos1, 3, "pos1") + _matrix(q) @ _vector(pos2, 3, "pos2")
    _fill(quatres, _product(q, _vector(quat2, 4, "quat2")), "quatres")
    _fill(posres, place, "posres")


def mju_negPose(posres, quatres, pos, quat) -> None:
    """The opposite pose."""
    back = _vector(quat, 4, "quat") * [1, -1, -1, -1]
    place = -_matrix(back) @ _vector(pos, 3, "pos")
    _fill(quatres, back, "quatres")
    _fill(posres, place, "posres")


def mju_trnVecPose(res, pos, quat, vec) -> None:
    """The point `vec` of a frame with that pose."""
    _fill(res, _vector(pos, 3, "pos") + _matrix(_vector(quat, 4, "quat")) @ _vector(vec, 3, "vec"))


def mju_cross(res, a, b) -> None:
    """res = a × b"""
    _fill(res, np.cross(_vector(a, 3, "a"), _vector(b, 3, "b")))


def mju_norm(res) -> float:
    """Length of a vector."""
    return float(np.linalg.norm(np.asarray(res, dtype=float).reshape(-1)))


def mju_norm3(vec) -> float:
    """Length of a vector of three numbers."""
    return float(np.linalg.norm(_vector(vec, 3, "vec")))


def _normalize(vec: np.ndarray, unit) -> float:
    size = mju_norm(vec)
    _fill(vec, np.reshape(vec, -1) / size if size >= _MINVAL else unit, "vec")
    return size


def mju_normalize(res) -> float:
    """Makes it a unit vector and gives the length that it had; a zero vector becomes the first axis."""
    return _normalize(res, np.eye(1, np.size(res))[0])


def mju_normalize3(vec) -> float:
    """The same for three numbers."""
    _vector(vec, 3, "vec")
    return _normalize(vec, [1, 0, 0])


def mju_normalize4(vec) -> float:
    """The same for a quaternion."""
    _vector(vec, 4, "vec")
    return _normalize(vec, [1, 0, 0, 0])
