"""Every element and attribute name of MJCF 4.0.0, from MuJoCo's own schema."""

import re

import mujoco

ROW = re.compile(r"^( *)(\S+) \((.)\) *(.*)$")


def generate():
    """Returns a list of {parents: [...], element, attributes: [...]}; a recursive element stands in itself too."""
    rows, stack = [], []
    for line in mujoco.mj_printSchema(False, False).splitlines():
        match = ROW.match(line)
        if match is None:
            if rows and line.strip():
                rows[-1]["attributes"] += line.split()
            continue
        indent, name, kind, attributes = match.groups()
        world = name == "(world)body"
        name = "body" if world else name
        depth = len(indent) // 3
        del stack[depth:]
        parents = ["worldbody"] if world else stack[-1:]
        parents = parents + ([name] if kind == "R" else [])
        rows.append({"element": name, "parents": parents, "attributes": attributes.split()})
        stack.append(name)
    return rows
