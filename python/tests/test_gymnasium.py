"""Gymnasium's environments, unchanged, with Penny where they import MuJoCo."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ENVIRONMENTS = [
    "InvertedPendulum", "InvertedDoublePendulum", "Reacher", "Pusher", "Hopper", "Walker2d", "HalfCheetah", "Ant",
    "Swimmer", "Humanoid",
]  # fmt: skip
STEPS = 200


def run(module, name, folder):
    out = folder / f"{module}.npz"
    client = Path(__file__).parent / "gym_client.py"
    environment = {**os.environ, "MUJOCO_GL": "egl"} if module == "penny" else os.environ
    subprocess.run([sys.executable, client, module, f"{name}-v5", str(STEPS), out], check=True, env=environment)
    return np.load(out)


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_environment(name, tmp_path, record_property):
    ours, theirs = run("penny", name, tmp_path), run("mujoco", name, tmp_path)
    difference = np.abs(ours["seen"] - theirs["seen"]).reshape(STEPS, -1).max(axis=1)
    scale = np.maximum(1, np.abs(theirs["seen"]).reshape(STEPS, -1).max(axis=1))
    until = int(np.argmax(difference > 1e-9 * scale)) if (difference > 1e-9 * scale).any() else STEPS
    print(f"{name}: equal for {until} steps, {ours['rate']:.0f} steps/s, MuJoCo {theirs['rate']:.0f}")
    assert until == STEPS, f"observations differ from step {until} on, by {difference[until]:.1e}"
    assert np.allclose(ours["rewards"], theirs["rewards"], rtol=0, atol=1e-9 * scale.max())
    assert np.array_equal(ours["ends"], theirs["ends"])
    picture = ours["picture"]
    assert picture.shape == (480, 480, 3) and picture.dtype == np.uint8 and picture.std() > 5
