"""Writes `penny/_penny.pyi`: what the compiled module has, with types, for editors and type checkers.

    python stubs.py [--check]

Names and docstrings are those of the built module; the types of arrays follow from a model with one of everything.
"""

import inspect
import sys
import textwrap
from pathlib import Path

import numpy as np

import penny
from penny import _penny

OUT = Path(__file__).parent / "penny" / "_penny.pyi"
SCENE = "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
HEAD = '''"""The compiled module. Written by `python stubs.py`; see there."""

from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._visual import MjStatistic, MjVisual
from ._warning import MjWarningStatList

'''
# What arguments and results are: by their names, which mean the same everywhere.
ARGUMENTS = {
    "m": "MjModel", "d": "MjData", "model": "MjModel", "nstep": "int", "type": "int", "name": "str", "id": "int",
    "key": "int", "body": "int", "geom": "int", "site": "int", "objtype": "int", "objid": "int", "flg_local": "int", "dt": "float",
    "text": "str", "xml": "str", "filename": "str | PathLike[str]", "assets": "dict[str, bytes] | None",
    "fps": "float | None", "path": "str | PathLike[str]", "frames": "list[NDArray[np.uint8]]", "name_or_id": "str | int | None",
    "jacp": "NDArray[np.float64] | None", "jacr": "NDArray[np.float64] | None",
    **dict.fromkeys(("dst", "res", "result", "qfrc_target", "qpos"), "NDArray[np.float64]"),
    **dict.fromkeys(("point", "force", "torque", "vec", "qvel", "qpos1", "qpos2"), "ArrayLike"),
}  # fmt: skip
# Attributes that a scene may lack.
OPTIONAL = {"scene_law": "str | None"}
# What a type checker does not look for in `__getattr__`.
SPECIAL = {"__len__": "(self) -> int", "__getitem__": "(self, key: Any) -> Any"}
WRITTEN = {("mj_differentiatePos", "qvel"): "NDArray[np.float64]"}
RESULTS = {
    "mj_name2id": "int", "mj_id2name": "str | None", "mj_getTotalmass": "float", "check": "list[Any]",
    "explain": "list[dict[str, Any]]", "from_xml_path": "MjModel", "from_xml_string": "MjModel",
}  # fmt: skip


def documented(of, indent="    "):
    return textwrap.indent(f'''"""{of.__doc__}"""''', indent, lambda line: line.strip())


def function(name, of, indent="", static=False):
    parameters = []
    for parameter in inspect.signature(of).parameters.values():
        if parameter.name in {"self", "$self"}:
            parameters.append("self")
            continue
        kind = WRITTEN.get((name, parameter.name), ARGUMENTS.get(parameter.name, "Any"))
        default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
        parameters.append(f"{parameter.name}: {kind}{default}")
    result = "View" if "name_or_id" in inspect.signature(of).parameters else RESULTS.get(name, "None")
    head = f"{indent}@staticmethod\n" if static else ""
    return f"{head}{indent}def {name}({', '.join(parameters)}) -> {result}:\n{documented(of, indent + '    ')}\n"


def attribute(name, value):
    if isinstance(value, np.ndarray):
        return f"    {name}: NDArray[np.{value.dtype.name if value.dtype != bool else 'bool_'}]"
    if name in OPTIONAL:
        return f"    {name}: {OPTIONAL[name]}"
    kind = type(value)
    return f"    {name}: {kind.__name__ if kind.__module__.split('.')[0] in ('builtins', 'penny') else 'Any'}"


def describe(name, cls, instance):
    lines = [f"class {name}:", documented(cls), ""]
    lines += ["    def __init__(self, model: MjModel) -> None: ..."] if name == "MjData" else []
    if instance is not None:
        names = [n for n in sorted(set(dir(instance))) if not n.startswith("_") and hasattr(instance, n)]
        plain = [n for n in names if not callable(getattr(instance, n))]
        lines += [attribute(n, getattr(instance, n)) for n in plain]
        for n in names:
            if n not in plain:
                lines += ["", function(n, getattr(cls, n), "    ", n.startswith("from_xml")).rstrip()]
    else:
        lines += ["    def __getattr__(self, name: str) -> Any: ..."]
        lines += ["    def __setattr__(self, name: str, value: Any) -> None: ..."] if name == "View" else []
        lines += [f"    def {special}{types}: ..." for special, types in SPECIAL.items() if special in vars(cls)]
        lines += ["    id: int", "    name: str"] if name == "View" else []
    return "\n".join(lines) + "\n"


def write():
    m = penny.MjModel.from_xml_string(SCENE)
    instances = {"MjModel": m, "MjData": penny.MjData(m), "MjOption": m.opt}
    parts = []
    for name in sorted(dir(_penny)):
        of = getattr(_penny, name)
        if name.startswith("_"):
            continue
        parts.append(describe(name, of, instances.get(name)) if inspect.isclass(of) else function(name, of))
    return HEAD + "\n".join(parts)


if __name__ == "__main__":
    text = write()
    if "--check" in sys.argv:
        sys.exit(0 if OUT.read_text() == text else f"{OUT} is not what `python stubs.py` writes")
    OUT.write_text(text)
