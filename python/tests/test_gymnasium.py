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


def run(which, name, folder):
    out = folder / f"{which}.npz"
    client = Path(__file__).parent / "gym_client.py"
    environment = {**os.environ, "MUJOCO_GL": "egl"} if which == "penny" else os.environ
    subprocess.run([sys.executable, client, which, f"{name}-v5", str(STEPS), out], check=True, env=environment)
    return np.load(out)


def equal_for(a, b, tolerance=1e-9):
    """So many steps two runs saw the same, relative to the larger of 1 and their greatest number."""
    scale = np.maximum(1, np.abs(b["seen"]).reshape(STEPS, -1).max(axis=1))
    apart = np.abs(a["seen"] - b["seen"]).reshape(STEPS, -1).max(axis=1) > tolerance * scale
    apart |= np.abs(a["rewards"] - b["rewards"]) > tolerance * scale
    apart |= a["ends"] != b["ends"]
    return int(np.argmax(apart)) if apart.any() else STEPS


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_environment(name, tmp_path):
    ours, theirs = run("penny", name, tmp_path), run("mujoco", name, tmp_path)
    until, most = equal_for(ours, theirs), STEPS
    if until < STEPS:
        # Chaos: rounding grows as fast in MuJoCo itself, and a step rounds more than once.
        most = equal_for(run("kicked", name, tmp_path), theirs, 1e-10)
    print(f"{name}: equal for {until} steps of {most}; {ours['rate']:.0f} steps/s, MuJoCo {theirs['rate']:.0f}")
    assert until >= most
    picture = ours["picture"]
    assert picture.shape == (480, 480, 3) and picture.dtype == np.uint8 and picture.std() > 5
