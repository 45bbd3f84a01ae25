"""Scenario 4 of the course: the MuJoCo disk, from the tutorial's own file, under three contact laws.

python examples/disk.py [picture.png]
"""

import sys
from pathlib import Path

import numpy as np

import penny

SCENE = Path(__file__).resolve().parents[2] / "models" / "disk.xml"


def main(seconds=3.0, picture=None):
    ends = {}
    for law in ("mujoco", "penalty", "tutorial"):
        sim = penny.Simulation.from_path(SCENE, law=law)
        # Thrown forwards, and turning.
        sim.data.qvel = [1, 0, 0, 0, 5, 0]
        path = sim.trajectory(seconds, every=10)
        ends[law] = sim.data.qpos[:3].copy()
        energy = path.energy.sum(axis=1)
        print(f"{law:10} rests at {np.round(ends[law], 4)}, lost {energy[0] - energy[-1]:.3f} J of {energy[0]:.3f} J")
        if picture and law == "mujoco":
            Path(picture).write_bytes(path._repr_png_())
    return ends


if __name__ == "__main__":
    main(picture=sys.argv[1] if len(sys.argv) > 1 else None)
