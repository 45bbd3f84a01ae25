#!/usr/bin/env python3
"""What `penny convert` writes is the same model in MuJoCo: every array of mjModel to 1e-12, and all names.

    python tests/census/convert.py [FILE…]    default: models/, tests/mjcf/good, the scenes of tests/golden, and the
                                              census's files where they were fetched

Needs `pip install mujoco==4.0.0` and Penny's binary, as the census. Numbers are compared with the largest of their array,
or 1. Inertial frames are compared as tensors: which principal axis is the first is nobody's choice where two are alike.
"""

import json
import pathlib
import sys
import tempfile

import mujoco
import numpy as np

from census import FOLDER, ROOT, penny

TOLERANCE = 1e-12
# What goes through the inverse of a mass matrix, which multiplies the rounding of a pose.
INVERTED = 1e-11
# Where files lie; and the looks of fixed tendons, which only a class can give and nobody sees.
PLACES = {"paths", "tendon_width", "tendon_rgba"}


def scenes():
    for path in [*sorted((ROOT / "models").glob("*.xml")), *sorted((ROOT / "tests/mjcf/good").glob("*.xml"))]:
        yield path.name, path
    for path in sorted((ROOT / "tests/golden").glob("*.json")):
        for i, text in enumerate(texts(json.loads(path.read_text()))):
            yield f"{path.name} {i}", text
    for path in sorted((FOLDER / "files").rglob("*.xml")):
        yield path.relative_to(FOLDER / "files").as_posix(), path


def texts(value):
    if isinstance(value, str):
        if value.lstrip().startswith("<mujoco"):
            yield value
    elif isinstance(value, (list, dict)):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from texts(inner)


def tensors(m):
    out = []
    for quat, moments in zip(m.body_iquat, m.body_inertia):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, quat)
        turn = turn.reshape(3, 3)
        out.append(turn @ np.diag(moments) @ turn.T)
    return np.array(out)


def difference(a, b):
    """The first field that differs, or nothing."""
    for name in dir(a):
        one, two = getattr(a, name, None), getattr(b, name, None)
        if name.startswith("_") or name in PLACES | {"body_iquat", "body_inertia"} or callable(one):
            continue
        if isinstance(one, np.ndarray) and one.dtype.kind in "fiub":
            if one.shape != two.shape:
                return f"{name}: {one.shape} is {two.shape}"
            one, two = one.astype(float).ravel(), two.astype(float).ravel()
            one, two = one[one != two], two[one != two]
            error = np.abs(one - two).max(initial=0)
            tolerance = INVERTED if "invweight" in name else TOLERANCE
            if not error <= tolerance * max(1, np.abs(one).max(initial=0)):
                return f"{name}: {error:.1e}"
        elif isinstance(one, bytes) and one != two and name == "names":
            return name
    error = np.abs(tensors(a) - tensors(b)).max(initial=0)
    if error > TOLERANCE * max(1, np.abs(a.body_inertia).max(initial=0)):
        return f"inertia: {error:.1e}"
    for name in ["timestep", "gravity", "wind", "density", "viscosity", "impratio", "integrator", "cone", "disableflags", "enableflags"]:
        if np.any(np.asarray(getattr(a.opt, name)) != np.asarray(getattr(b.opt, name))):
            return f"option {name}"
    return None


def main():
    given = [(path, pathlib.Path(path)) for path in sys.argv[1:]] or scenes()
    same, skipped, failed = 0, 0, []
    for name, scene in given:
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            if isinstance(scene, str):
                (folder / "scene.xml").write_text(scene)
                scene = folder / "scene.xml"
            ran = penny("convert", scene, "-o", folder / "canonical.xml")
            if ran.returncode:
                skipped += 1
                continue
            try:
                one = mujoco.MjModel.from_xml_path(str(scene))
            except ValueError:
                skipped += 1
                continue
            try:
                why = difference(one, mujoco.MjModel.from_xml_path(str(folder / "canonical.xml")))
            except ValueError as error:
                why = f"MuJoCo refuses it: {error}"
        same += why is None
        failed += [f"{name}: {why}"] if why else []
    print(f"{same} scenes are the same model, {len(failed)} are not; {skipped} are no scenes of both")
    print("\n".join(failed))
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
