#!/usr/bin/env python3
"""Contacts of two convex shapes: Penny's against MuJoCo 4.0.0's, as the table tests/collision/pairs.md.

    python tests/collision/pairs.py            print the table
    python tests/collision/pairs.py --write    write it into pairs.md
    python tests/collision/pairs.py PAIR…      only these pairs, as `cylinder-box`
    python tests/collision/pairs.py --cases N  N cases in place of 10,000 (and a tenth of them aligned)

Needs `pip install mujoco==4.0.0` and `cargo build --release --example contacts`, or its path in CONTACTS.

- random: any sizes and poses, from just apart to as deep as the shapes are thick, a third of them with a margin.
- aligned: upright, lying or flush with each other, some leaning by up to 3°; as they are written or turned and moved as a
  whole; 1e-9 m to 1e-2 m deep, or as far apart but within the margin.
- touching: aligned, exactly touching or by 1e-12 m in each other, without margin.

Both engines get the same file. A row says in how many cases of how many with a contact the number of contacts differs,
and the difference of normals (rad), points (m) and distances (m) in all others: the median, the 99th of 100, the largest.
Below it: MuJoCo against itself when every position and rotation is moved by one last digit of the largest number in it.
"""

import math
import os
import pathlib
import subprocess
import sys
import tempfile

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
PROGRAM = os.environ.get("CONTACTS", str(ROOT / "target/release/examples/contacts"))
USED = {"plane": 3, "sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
PAIRS = [
    ("plane", "ellipsoid"),
    ("plane", "cylinder"),
    ("sphere", "cylinder"),
    ("capsule", "box"),
    ("sphere", "ellipsoid"),
    ("capsule", "ellipsoid"),
    ("ellipsoid", "ellipsoid"),
    ("ellipsoid", "cylinder"),
    ("ellipsoid", "box"),
    ("capsule", "cylinder"),
    ("cylinder", "cylinder"),
    ("cylinder", "box"),
]
FAMILIES = ["random", "aligned", "touching"]
HALF = math.sqrt(0.5)
# Rotations that put an axis of a shape along the world's z.
ALONG_Z = [[1, 0, 0, 0], [0, 1, 0, 0], [HALF, HALF, 0, 0], [HALF, 0, HALF, 0], [0.5, 0.5, 0.5, 0.5]]


def text(values):
    return " ".join(repr(float(x)) for x in values)


def unit(rng, n=3):
    v = rng.normal(size=n)
    return v / np.linalg.norm(v)


def matrix(quat):
    m = np.zeros(9)
    mujoco.mju_quat2Mat(m, np.array(quat, float))
    return m.reshape(3, 3)


def product(a, b):
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, np.array(a, float), np.array(b, float))
    return out


def turn(axis, angle):
    out = np.zeros(4)
    mujoco.mju_axisAngle2Quat(out, np.array(axis, float), angle)
    return out


def reach(kind, size, quat, d):
    """How far a shape reaches from its centre in the unit direction d."""
    l = matrix(quat).T @ d
    return {
        "plane": 0.0,
        "sphere": size[0],
        "capsule": size[0] + size[1] * abs(l[2]),
        "ellipsoid": np.linalg.norm(l * size),
        "cylinder": size[0] * math.hypot(l[0], l[1]) + size[1] * abs(l[2]),
        "box": np.abs(l) @ size,
    }[kind]


def random_case(pair, rng):
    size = rng.uniform(0.03, 0.3, (2, 3))
    quat = [unit(rng, 4), unit(rng, 4)]
    margin = float(rng.choice([0.0, 0.0, 0.02]))
    start = rng.uniform(-1, 1, 3)
    n = matrix(quat[0])[:, 2] if pair[0] == "plane" else unit(rng)
    touching = sum(reach(k, s, q, n) for k, s, q in zip(pair, size, quat))
    part = rng.uniform(-0.03, 0.1) if rng.uniform() < 0.5 else rng.uniform(0, 0.9)
    return {"size": size, "quat": quat, "pos": [start, start + n * touching * (1 - part)], "margin": margin}


def aligned_case(pair, rng, depths, margins, most_tilt):
    size = np.round(rng.uniform(0.03, 0.3, (2, 3)), 2)
    plain = rng.uniform() < 0.5
    lean, around = 0.0, 0.0
    if not plain:
        lean = float(rng.choice([t for t in (0, 0, 1e-4, 1e-3, 3e-3, 0.05) if t <= most_tilt]))
        around = float(rng.choice([0, 0.3, math.pi / 2]))
    quat = [np.array(ALONG_Z[rng.integers(len(ALONG_Z))], float) for _ in range(2)]
    if pair[0] == "plane":
        quat[0] = np.array(ALONG_Z[0], float)
    quat[1] = product(turn(unit(rng), lean), product(turn([0, 0, 1], around), quat[1]))
    z = np.array([0.0, 0.0, 1.0])
    height = sum(reach(k, s, q, z) for k, s, q in zip(pair, size, quat))
    depth, margin = float(rng.choice(depths)), float(rng.choice(margins))
    beside = np.zeros(2) if rng.uniform() < 0.4 else np.round(rng.uniform(-0.05, 0.05, 2), 3)
    above = 1.0 if pair[0] == "plane" else float(rng.choice([-1, 1]))
    low = np.array([0, 0, round(float(rng.uniform(0, 0.5)), 2)])
    pos = [low, low + np.array([*beside, above * ((round(height, 4) if plain else height) - depth)])]
    if not plain:
        base = unit(rng, 4)
        quat, pos = [product(base, q) for q in quat], [matrix(base) @ p for p in pos]
    return {"size": size, "quat": quat, "pos": pos, "margin": margin}


def cases(family, pair, rng, count):
    if family == "random":
        return [random_case(pair, rng) for _ in range(count)]
    if family == "aligned":
        deep, near = ([1e-5, 1e-4, 1e-3, 1e-2], [0.0]), ([-1e-4, 0.0, 1e-4], [0.01])
        make = lambda: aligned_case(pair, rng, *(deep if rng.uniform() < 0.6 else near), 0.05)
        return [make() for _ in range(count)]
    return [aligned_case(pair, rng, [0.0, 0.0, 1e-12, 1e-9], [0.0], 0.0) for _ in range(count)]


def scene(pair, cases):
    """All cases in one place: the first shapes are the world's, the second one body's, and only <pair>s touch."""
    first, second, pairs = [], [], []
    for i, c in enumerate(cases):
        for k, lines in ((0, first), (1, second)):
            size = c["size"][k][: USED[pair[k]]]
            lines.append(
                f'<geom name="{"ab"[k]}{i}" type="{pair[k]}" size="{text(size)}" pos="{text(c["pos"][k])}" '
                f'quat="{text(c["quat"][k])}"/>'
            )
        pairs.append(f'<pair geom1="a{i}" geom2="b{i}" margin="{text([c["margin"]])}"/>')
    return f"""<mujoco><size memory="400M"/><default><geom contype="0" conaffinity="0"/></default><worldbody>
{chr(10).join(first)}
<body><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
{chr(10).join(second)}</body>
</worldbody><contact>{chr(10).join(pairs)}</contact></mujoco>"""


def collect(rows, count):
    """Contacts by case; each is dist, pos (3), normal (3). Geoms are a0 … and then b0 …."""
    found = [[] for _ in range(count)]
    for a, b, *numbers in rows:
        assert b == a + count
        found[a].append(numbers)
    return found


def by_mujoco(model, count):
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    order = lambda c: (min(c.geom), max(c.geom))
    return collect([(*order(c), c.dist, *c.pos, *c.frame[:3]) for c in data.contact], count)


def by_penny(xml, count):
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(xml)
        file.flush()
        out = subprocess.run([PROGRAM, file.name], check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in out.splitlines()]
    return collect([(int(r[0]), int(r[1]), *map(float, r[2:])) for r in rows], count)


def nudged(model, rng):
    """Moves every geom by one last digit of the largest number in its position, or of 0.1, and turns it by as much."""
    for numbers, least in ((model.geom_pos, 0.1), (model.geom_quat, 1.0)):
        digit = np.spacing(np.maximum(np.abs(numbers).max(axis=1, keepdims=True), least))
        numbers[:] = numbers + rng.choice([-1, 1], numbers.shape) * digit


def differences(theirs, ours):
    """For each case with a contact: the two counts, and if they are equal the largest difference of normal, point and
    distance. Points of one case are compared with the nearest."""
    rows = []
    for t, o in zip(theirs, ours):
        if not t and not o:
            continue
        row = [len(t), len(o), np.nan, np.nan, np.nan]
        if len(t) == len(o):
            t, left = np.array(t), [np.array(x) for x in o]
            row[2:] = [0.0, 0.0, 0.0]
            for x in t:
                k = min(range(len(left)), key=lambda k: np.linalg.norm(x[1:4] - left[k][1:4]))
                y = left.pop(k)
                off = [np.linalg.norm(x[4:] - y[4:]), np.linalg.norm(x[1:4] - y[1:4]), abs(x[0] - y[0])]
                row[2:] = np.maximum(row[2:], off)
        rows.append(row)
    return np.array(rows).reshape(-1, 5)


def row(name, r):
    same = r[r[:, 0] == r[:, 1]]
    cells = [name, f"{len(r) - len(same)} of {len(r)}"]
    for column in (2, 3, 4):
        numbers = [np.quantile(same[:, column], q) for q in (0.5, 0.99, 1)] if len(same) else []
        cells.append("  ".join(f"{x:.0e}" for x in numbers))
    cells.append(str(int((same[:, 3:] > 1e-6).any(axis=1).sum())))
    return "| " + " | ".join(cells) + " |"


def main():
    if mujoco.__version__ != "4.0.0":
        sys.exit(f"the table is about MuJoCo 4.0.0, but {mujoco.__version__} is installed")
    args = sys.argv[1:]
    count = int(args.pop(args.index("--cases") + 1)) if "--cases" in args else 10_000
    wanted = [a for a in args if not a.startswith("-")]
    lines = ["| pair, family | other count | normal, rad | point, m | distance, m | over 1e-6 m |", "|---|---|---|---|---|---|"]
    for seed, pair in enumerate(PAIRS):
        name = "-".join(pair)
        if wanted and name not in wanted:
            continue
        for family in FAMILIES:
            rng = np.random.default_rng([seed, FAMILIES.index(family)])
            made = cases(family, pair, rng, count if family == "random" else count // 10)
            xml = scene(pair, made)
            model = mujoco.MjModel.from_xml_string(xml)
            theirs = by_mujoco(model, len(made))
            lines.append(row(f"{name.replace('-', '–')}, {family}", differences(theirs, by_penny(xml, len(made)))))
            nudged(model, rng)
            lines.append(row("MuJoCo, one digit moved", differences(theirs, by_mujoco(model, len(made)))))
            print("\n".join(lines[-2:]), flush=True)
    if "--write" in args:
        path = HERE / "pairs.md"
        head = path.read_text().split("| pair, family")[0] if path.exists() else ""
        path.write_text(head + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
