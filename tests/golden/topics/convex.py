"""Contacts of two shapes whose pair has no closed form: random poses, and aligned ones (upright, lying, flush).

A case is [margin, size1 (3), pos1 (3), quat1 (4), size2 (3), pos2 (3), quat2 (4)]; a contact is [dist, pos (3), normal (3)].
Left out are cases in which MuJoCo's own contacts change by more than 1e-10 when every position and rotation changes by one last digit:
there the last bits choose among directions, corners or points. How many those are says tests/collision/pairs.md.
"""

import importlib.util
import pathlib

import mujoco
import numpy as np

FILE = pathlib.Path(__file__).parents[2] / "collision" / "pairs.py"
SPEC = importlib.util.spec_from_file_location("pairs", FILE)
pairs = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(pairs)

KINDS = ["plane", "sphere", "capsule", "ellipsoid", "cylinder", "box"]
PAIRS = pairs.PAIRS[4:]
KEPT = {"random": 30, "aligned": 25}
MOVED = 1e-10


def rounded(case):
    case["size"] = np.round(case["size"], 4)
    case["pos"] = [np.round(p, 7) for p in case["pos"]]
    case["quat"] = [np.round(q, 9) for q in case["quat"]]
    return case


def sample(pair, seed):
    found, contacts = [], []
    for family, wanted in KEPT.items():
        rng = np.random.default_rng([seed, wanted])
        made = [rounded(c) for c in pairs.cases(family, pair, rng, 8 * wanted)]
        model = mujoco.MjModel.from_xml_string(pairs.scene(pair, made))
        first = pairs.by_mujoco(model, len(made))
        position, rotation = model.geom_pos.copy(), model.geom_quat.copy()
        steady = np.ones(len(made), bool)
        for _ in range(8):
            model.geom_pos[:], model.geom_quat[:] = position, rotation
            pairs.nudged(model, rng)
            for i, moved in enumerate(pairs.by_mujoco(model, len(made))):
                same = len(moved) == len(first[i])
                steady[i] &= same and np.allclose(moved, first[i], rtol=0, atol=MOVED)
        # One in six may have no contact.
        empty = wanted // 6
        for i in np.flatnonzero(steady):
            if not first[i] and (empty := empty - 1) < 0:
                continue
            c = made[i]
            sides = [[*map(float, (*c["size"][k], *c["pos"][k], *c["quat"][k]))] for k in (0, 1)]
            found.append([c["margin"], *sides[0], *sides[1]])
            contacts.append([[float(x) for x in contact] for contact in first[i]])
            wanted -= 1
            if wanted == 0:
                break
    return {"name": "-".join(pair), "kinds": [KINDS.index(k) for k in pair], "cases": found, "contacts": contacts}


def generate():
    return {"pairs": [sample(pair, seed) for seed, pair in enumerate(PAIRS)]}
