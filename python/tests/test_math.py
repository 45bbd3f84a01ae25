"""The small mathematics against MuJoCo's."""

import mujoco
import numpy as np
import pytest
from conftest import close

import penny

# Sizes of results and arguments; "q" a unit quaternion, "m" a rotation matrix, numbers as they are.
CASES = {
    "mju_mulQuat": ([4], "qq"), "mju_negQuat": ([4], "q"), "mju_rotVecQuat": ([3], "vq"), "mju_quat2Mat": ([9], "q"),
    "mju_mat2Quat": ([4], "m"), "mju_axisAngle2Quat": ([4], "us"), "mju_quat2Vel": ([3], "qs"),
    "mju_subQuat": ([3], "qq"), "mju_quatZ2Vec": ([4], "v"), "mju_mulPose": ([3, 4], "vqvq"),
    "mju_negPose": ([3, 4], "vq"), "mju_trnVecPose": ([3], "vqv"), "mju_cross": ([3], "vv"),
}  # fmt: skip


def argument(kind, random):
    if kind == "s":
        return float(random.uniform(0.1, 2))
    v = random.normal(size=4 if kind in "qm" else 3)
    if kind in "qum":
        v /= np.linalg.norm(v)
    if kind == "m":
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, v)
        return matrix
    return v


@pytest.mark.parametrize("name", CASES)
def test_function(name):
    sizes, kinds = CASES[name]
    for seed in range(20):
        random = np.random.default_rng(seed)
        args = [argument(kind, random) for kind in kinds]
        ours, theirs = [np.zeros(n) for n in sizes], [np.zeros(n) for n in sizes]
        getattr(mujoco, name)(*theirs, *args)
        getattr(penny, name)(*ours, *args)
        assert all(close(a, b, 1e-12) for a, b in zip(ours, theirs))


def test_the_others():
    random = np.random.default_rng(0)
    for _ in range(20):
        q, v = argument("q", random), argument("v", random)
        a, b = q.copy(), q.copy()
        mujoco.mju_quatIntegrate(a, v, 0.3)
        penny.mju_quatIntegrate(b, v, 0.3)
        assert close(b, a, 1e-12)
        for seq in ("xyz", "XYZ", "zyx", "xYz"):
            mujoco.mju_euler2Quat(a, v, seq)
            penny.mju_euler2Quat(b, v, seq)
            assert close(b, a, 1e-12)
        for name, x in (("mju_normalize3", v), ("mju_normalize4", q * 3), ("mju_normalize", random.normal(size=6))):
            a, b = x.copy(), x.copy()
            assert np.isclose(getattr(penny, name)(b), getattr(mujoco, name)(a)) and close(b, a, 1e-12)
        assert np.isclose(penny.mju_norm3(v), mujoco.mju_norm3(v))
    with pytest.raises(TypeError, match="quat should have 4"):
        penny.mju_negQuat(np.zeros(4), [1, 2, 3])
