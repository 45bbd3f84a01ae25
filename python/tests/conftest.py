"""What the tests share: the real MuJoCo, and ten models that both engines load."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

import penny

mujoco = pytest.importorskip("mujoco", reason="the real MuJoCo, to compare with")

MODELS = Path(__file__).resolve().parents[2] / "models"
ASSETS = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
SCENES = [
    ASSETS / "ant.xml", ASSETS / "half_cheetah.xml", ASSETS / "hopper.xml", ASSETS / "humanoid.xml",
    ASSETS / "pusher_v5.xml", ASSETS / "reacher.xml", ASSETS / "swimmer.xml", MODELS / "arm.xml", MODELS / "stack.xml",
    MODELS / "tee.xml", Path(__file__).with_name("ties.xml"), MODELS / "top.xml",
]  # fmt: skip


class Pair:
    """The same scene in MuJoCo and in Penny, in the same state."""

    def __init__(self, path):
        self.mm, self.pm = mujoco.MjModel.from_xml_path(str(path)), penny.MjModel.from_xml_path(path)
        for m in (self.mm, self.pm):
            m.opt.tolerance, m.opt.iterations = 0, 1000
        self.mm.opt.ls_iterations = 200
        self.md, self.pd = mujoco.MjData(self.mm), penny.MjData(self.pm)

    def randomize(self, seed):
        """A random state near the model's own, with controls and applied forces; everything that follows computed."""
        rng, m = np.random.default_rng(seed), self.mm
        qpos = m.qpos0 + 0.1 * rng.normal(size=m.nq)
        mujoco.mj_normalizeQuat(m, qpos)
        qvel, ctrl = rng.normal(size=m.nv), rng.uniform(-1, 1, size=m.nu)
        qfrc, xfrc = 0.1 * rng.normal(size=m.nv), 0.1 * rng.normal(size=(m.nbody, 6))
        for d in (self.md, self.pd):
            d.qpos, d.qvel, d.ctrl, d.qfrc_applied, d.xfrc_applied = qpos, qvel, ctrl, qfrc, xfrc
        mujoco.mj_forward(self.mm, self.md)
        penny.mj_forward(self.pm, self.pd)
        return self


@pytest.fixture(params=SCENES, ids=lambda path: path.stem)
def pair(request):
    return Pair(request.param)


@pytest.fixture
def random_state(pair):
    """A state with contacts, where the scene can have them: after some steps from a random one."""
    pair.randomize(1)
    for _ in range(20):
        mujoco.mj_step(pair.mm, pair.md)
    pair.pd.qpos, pair.pd.qvel, pair.pd.act, pair.pd.time = pair.md.qpos, pair.md.qvel, pair.md.act, pair.md.time
    mujoco.mj_forward(pair.mm, pair.md)
    penny.mj_forward(pair.pm, pair.pd)
    return pair


def close(a, b, tolerance=1e-9):
    """Whether two arrays are equal, relative to the larger of their greatest number and 1."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    assert a.shape == b.shape
    return a.size == 0 or np.abs(a - b).max() <= tolerance * max(1.0, np.abs(b).max())
