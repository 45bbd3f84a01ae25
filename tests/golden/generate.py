#!/usr/bin/env python3
"""Golden data: what MuJoCo 4.0.0 does, for the tests to compare with.

    python tests/golden/generate.py            write every tests/golden/*.json anew
    python tests/golden/generate.py NAME…      only these
    python tests/golden/generate.py --check    regenerate in memory and compare with the committed files

Needs `pip install mujoco==4.0.0`. Each topic is a module beside this file with a function `generate()` that
returns what goes into its JSON file. Numbers are written with all their digits. `--check` allows for another
machine's last bits: 1e-9 of the largest number in the same array. Keys that start with `measured_` hold times: those
differ.
"""

import importlib
import json
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
TOPICS = sorted(p.stem for p in (HERE / "topics").glob("*.py") if "def generate" in p.read_text())
TOLERANCE = 1e-9


def differences(old, new, where=""):
    """Yields a line for every place where two JSON values differ."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(set(old) | set(new)):
            if key.startswith("measured_"):
                continue
            if key not in old or key not in new:
                yield f"{where}.{key}: only in the {'committed' if key in old else 'regenerated'} file"
            else:
                yield from differences(old[key], new[key], f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{where}: {len(old)} elements, regenerated {len(new)}"
        elif old and all(isinstance(x, (int, float)) for x in old + new):
            scale = max(1.0, max(abs(x) for x in old))
            for i, (a, b) in enumerate(zip(old, new)):
                if not math.isclose(a, b, rel_tol=0, abs_tol=TOLERANCE * scale):
                    yield f"{where}[{i}]: {a!r}, regenerated {b!r}"
        else:
            for i, (a, b) in enumerate(zip(old, new)):
                yield from differences(a, b, f"{where}[{i}]")
    elif isinstance(old, (int, float)) and isinstance(new, (int, float)):
        if not math.isclose(old, new, rel_tol=TOLERANCE, abs_tol=TOLERANCE):
            yield f"{where}: {old!r}, regenerated {new!r}"
    elif old != new:
        yield f"{where}: {old!r}, regenerated {new!r}"


def main():
    import mujoco

    if mujoco.__version__ != "4.0.0":
        sys.exit(f"golden data is MuJoCo 4.0.0's, but {mujoco.__version__} is installed: pip install mujoco==4.0.0")
    check = "--check" in sys.argv
    names = [a for a in sys.argv[1:] if not a.startswith("-")] or TOPICS
    sys.path.insert(0, str(HERE / "topics"))
    failed = False
    for name in names:
        data = json.loads(json.dumps(importlib.import_module(name).generate()))
        path = HERE / f"{name}.json"
        if check:
            found = list(differences(json.loads(path.read_text()), data, name))
            for line in found[:20]:
                print(line)
            failed |= bool(found)
            print(f"{name}: {'differs' if found else 'same'}")
        else:
            path.write_text(json.dumps(data, indent=None, separators=(",", ":")).replace('{"name"', '\n{"name"') + "\n")
            print(f"{name}: {path.stat().st_size / 1024:.0f} KiB")
    sys.exit(failed)


if __name__ == "__main__":
    main()
