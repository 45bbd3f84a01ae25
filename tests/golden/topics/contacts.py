"""Contacts of two shapes in random poses, and the order of contacts in whole scenes.

A case is [margin, size1 (3), pos1 (3), quat1 (4), size2 (3), pos2 (3), quat2 (4)]; a contact is
[dist, pos (3), normal (3), first tangent (3)]. Inputs have few digits so that the file stays small.
"""

import math

import mujoco
import numpy as np

KINDS = ["plane", "sphere", "capsule", "ellipsoid", "cylinder", "box"]
USED = {"plane": 3, "sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
PAIRS = [
    ("plane", "sphere"),
    ("plane", "capsule"),
    ("plane", "ellipsoid"),
    ("plane", "cylinder"),
    ("plane", "box"),
    ("sphere", "sphere"),
    ("sphere", "capsule"),
    ("sphere", "cylinder"),
    ("sphere", "box"),
    ("capsule", "capsule"),
    ("capsule", "box"),
    ("box", "box"),
]
CASES = 200
IDENTITY = [1.0, 0.0, 0.0, 0.0]


def text(values):
    return " ".join(repr(float(x)) for x in values)


def scene(pair, case):
    kind1, kind2 = pair
    margin, size1, pos1, quat1 = case[0], case[1:4], case[4:7], case[7:11]
    size2, pos2, quat2 = case[11:14], case[14:17], case[17:21]
    joint1 = "" if kind1 == "plane" else "<freejoint/>"
    return f"""<mujoco><worldbody>
<body pos="{text(pos1)}" quat="{text(quat1)}">{joint1}
<geom type="{kind1}" size="{text(size1[:USED[kind1]])}" margin="{text([margin])}"/></body>
<body pos="{text(pos2)}" quat="{text(quat2)}"><freejoint/>
<geom type="{kind2}" size="{text(size2[:USED[kind2]])}"/></body>
</worldbody></mujoco>"""


def contacts(pair, case):
    model = mujoco.MjModel.from_xml_string(scene(pair, case))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    return [[c.dist, *c.pos, *c.frame[:6]] for c in data.contact]


def rounded(values, digits=5):
    return [round(float(x), digits) for x in values]


def unit(rng, n=3):
    v = rng.normal(size=n)
    return v / np.linalg.norm(v)


def rotate(quat, v):
    out = np.zeros(3)
    mujoco.mju_rotVecQuat(out, np.array(v, float), np.array(quat, float))
    return out


def turned(quat, axis, angle):
    q, out = np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(q, np.array(axis, float), angle)
    mujoco.mju_mulQuat(out, np.array(quat, float), q)
    return out


def reach(kind, size):
    return {
        "plane": 0.0,
        "sphere": size[0],
        "capsule": size[0] + size[1],
        "ellipsoid": max(size),
        "cylinder": math.hypot(size[0], size[1]),
        "box": math.sqrt(sum(x * x for x in size)),
    }[kind]


def candidate(pair, rng, i):
    """A random pose; every third one is special: aligned, nearly parallel or deep."""
    kind1, kind2 = pair
    margin = float(rng.choice([0.0, 0.01, 0.05]))
    size1, size2 = rng.uniform(0.03, 0.3, 3), rng.uniform(0.03, 0.3, 3)
    quat1, quat2 = unit(rng, 4), unit(rng, 4)
    special = i % 3 == 2
    if special:
        variant = (i // 3) % 4
        base = unit(rng, 4) if variant else IDENTITY
        quat1, quat2 = base, base
        if variant >= 1:
            # An axis nearly along a plane's normal leaves tangents to the last bits: not less than 3e-3 there.
            least = 3e-3 if kind1 == "plane" else 1e-5
            quat2 = turned(base, unit(rng), float(rng.choice([least, 8e-3, 0.03])))
        if variant == 3 and kind1 != "plane":
            quat2 = turned(base, [0, 0, 1], rng.uniform(0, 6))
    size1, size2 = rounded(size1, 4), rounded(size2, 4)
    quat1, quat2 = rounded(quat1, 9), rounded(quat2, 9)
    pos1 = rounded(rng.uniform(-1, 1, 3), 4)
    if kind1 == "plane":
        normal = rotate(np.array(quat1) / np.linalg.norm(quat1), [0, 0, 1])
        away = unit(rng)
        away -= normal * (away @ normal)
        pos2 = pos1 + away + normal * rng.uniform(-0.3, 1.05) * reach(kind2, size2)
    else:
        close = rng.uniform(0, 1) if special else rng.uniform(0.2, 1)
        pos2 = pos1 + unit(rng) * close * (reach(kind1, size1) + reach(kind2, size2))
    return [margin, *size1, *pos1, *quat1, *size2, *rounded(pos2), *quat2]


def poses(pair, seed):
    rng = np.random.default_rng(seed)
    cases, found, empty = [], [], 0
    i = 0
    while len(cases) < CASES:
        case = candidate(pair, rng, i)
        hits = contacts(pair, case)
        if any(abs(h[0] - case[0]) < 1e-9 for h in hits):
            continue
        if not hits:
            if empty >= CASES // 10:
                continue
            empty += 1
        i += 1
        cases.append(case)
        found.append(hits)
    return {"name": f"{pair[0]}-{pair[1]}", "kinds": [KINDS.index(k) for k in pair], "cases": cases, "contacts": found}




STACKED = ["sphere", "capsule", "cylinder", "box"]


def stacks(kinds, seed, count=20):
    """Things that stand exactly on each other, as turrets do on their bases, some of them off centre.

    Each is a case as above, the lower thing first in the list of two kinds whatever MuJoCo's order, and the number of
    MuJoCo's contacts when they are as written, and 1e-11 m deep.
    """
    rng = np.random.default_rng(seed)
    cases, found = [], []
    while len(cases) < count:
        sizes = [rounded(rng.uniform(0.03, 0.15, 3), 2) for _ in kinds]
        half = [{"sphere": s[0], "capsule": s[0] + s[1], "cylinder": s[1], "box": s[2]}[k] for k, s in zip(kinds, sizes)]
        floor = round(float(rng.uniform(0, 0.5)), 2)
        off = rounded(rng.uniform(-0.02, 0.02, 2), 3) if len(cases) % 2 and kinds[0] in ("box", "cylinder") else [0.0, 0.0]
        low, high = floor + half[0], floor + 2 * half[0] + half[1]
        case = [0.0, *sizes[0], 0.0, 0.0, low, *IDENTITY, *sizes[1], *off, high, *IDENTITY]
        deep = case[:16] + [high - 1e-11] + case[17:]
        cases.append(case)
        found.append([len(contacts(kinds, case)), len(contacts(kinds, deep))])
    return {"name": f"{kinds[1]} on {kinds[0]}", "kinds": [KINDS.index(k) for k in kinds], "cases": cases, "contacts": found}


SCENES = {
    "bodies of several geoms": """<mujoco><worldbody>
<geom type="box" size=".5 .5 .1" pos="0 0 -.15"/><geom type="plane" size="1 1 1" pos="0 0 -.01"/>
<body><freejoint/><geom type="box" size=".1 .1 .1" condim="1"/><geom type="sphere" size=".12"/>
  <geom type="capsule" size=".05 .1" euler="30 10 0"/></body>
<body pos=".05 .01 .02" euler="5 3 1"><freejoint/><geom type="capsule" size=".1 .1"/><geom type="sphere" size=".12" margin=".02"/>
  <geom type="box" size=".1 .1 .1"/></body>
<body pos="0 0.05 0"><freejoint/><geom type="sphere" size=".12"/></body>
</worldbody></mujoco>""",
    "pairs, excludes, masks and parents": """<mujoco><worldbody>
<geom name="floor" type="plane" size="1 1 1" condim="4"/>
<body name="a" pos="0 0 .09"><freejoint/><geom name="a1" type="sphere" size=".1"/><geom name="a2" type="box" size=".08 .08 .08" pos=".1 0 0" contype="2"/>
  <body name="b" pos=".1 0 .02"><joint axis="0 1 0"/><geom name="b1" type="capsule" size=".05 .1" gap=".01"/>
    <body name="c" pos="0 .02 .03"><geom name="c1" type="sphere" size=".06"/></body>
    <body name="d" pos="0 .03 .05"><joint axis="1 0 0"/><geom name="d1" type="sphere" size=".06" conaffinity="3"/></body></body></body>
<body name="e" pos=".03 .1 .08"><freejoint/><geom name="e1" type="box" size=".1 .1 .1" priority="1" condim="6"/><geom name="e2" type="sphere" size=".11"/></body>
<body name="f" pos=".2 .1 .08"><freejoint/><geom name="f1" type="sphere" size=".1"/></body>
</worldbody><contact>
<pair geom1="f1" geom2="e2" condim="1" margin=".05"/><pair geom1="e1" geom2="a1"/><pair geom1="a1" geom2="b1"/><pair geom1="d1" geom2="floor"/>
<exclude body1="a" body2="f"/><exclude body1="e" body2="b"/>
</contact></mujoco>""",
    "stack of equal boxes": """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 .0999"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
<body pos="0 0 .2998"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
<body pos="0 0 .4997"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
<body pos=".05 0 .6996"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
<body pos="0 0 .8495"><freejoint/><geom type="box" size=".05 .05 .05" /></body>
</worldbody></mujoco>""",
    "cans on tables, upright and upside down": """<mujoco><worldbody>
<geom type="box" size=".2 .2 .15" pos="0 0 .15"/><geom type="box" size=".2 .2 .15" pos="1 0 .15" euler="0 0 20"/>
<body pos="0 0 .3999"><freejoint/><geom type="cylinder" size=".05 .1"/></body>
<body pos="1.01 .02 .3999" euler="180 0 0"><freejoint/><geom type="cylinder" size=".05 .1"/></body>
</worldbody></mujoco>""",
    "a capsule beside a cylinder, leaning": """<mujoco><worldbody><geom type="cylinder" size=".2 .3"/>
<body pos="0 .28 .05" euler="3 0 0"><freejoint/><geom type="capsule" size=".1 .15" mass="1"/></body>
</worldbody></mujoco>""",
    "upright capsule, flat coin, lying rollers": """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 .1999"><freejoint/><geom type="capsule" size=".1 .1"/></body>
<body pos="1 0 .0099"><freejoint/><geom type="cylinder" size=".1 .01"/></body>
<body pos="2 0 .0999" euler="90 0 0"><freejoint/><geom type="cylinder" size=".1 .3"/></body>
<body pos="3 0 .0999" euler="90 0 0"><freejoint/><geom type="capsule" size=".1 .3"/></body>
<body pos="3 0 .2998" euler="90 0 0"><freejoint/><geom type="capsule" size=".1 .3"/></body>
<body pos="3 0 .4497"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
</worldbody></mujoco>""",
}


def heap(seed, count):
    """Many bodies of all sizes in a heap: enough for a broad phase."""
    rng = np.random.default_rng(seed)
    bodies = []
    for _ in range(count):
        kind = str(rng.choice(["sphere", "capsule", "box"]))
        size = rounded(0.05 * 4 ** rng.uniform(0, 1, 3) * 0.5, 3)
        pos, quat = rounded(rng.uniform(-0.9, 0.9, 3), 3), rounded(unit(rng, 4), 3)
        mask = rng.choice(["", ' contype="2"', ' conaffinity="3"', ' margin=".01"', ' condim="1"'])
        extra = '<geom type="sphere" size=".04" pos=".05 0 0"/>' if rng.uniform() < 0.3 else ""
        bodies.append(
            f'<body pos="{text(pos)}" quat="{text(quat)}"><freejoint/>'
            f'<geom type="{kind}" size="{text(size[:USED[kind]])}"{mask}/>{extra}</body>'
        )
    return f"""<mujoco><worldbody><geom type="plane" size="2 2 1" pos="0 0 -.8"/>
<geom type="box" size="1 .1 .4" pos="0 .9 0"/>{"".join(bodies)}
</worldbody></mujoco>"""


def listed(xml):
    """Geoms, position and distance of all contacts, in order."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return [[int(c.geom[0]), int(c.geom[1]), c.dim, c.dist, *c.pos, *c.frame[:6]] for c in data.contact]


def scenes():
    named = {**SCENES, "heap of 120": heap(3, 120)}
    return [{"name": name, "xml": xml, "contacts": listed(xml)} for name, xml in named.items()]


def generate():
    stacked = [stacks((low, high), seed) for seed, low in enumerate(STACKED) for high in STACKED]
    return {"poses": [poses(pair, seed) for seed, pair in enumerate(PAIRS)], "scenes": scenes(), "stacks": stacked}
