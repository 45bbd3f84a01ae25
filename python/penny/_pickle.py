"""Models and data as `pickle` and other processes see them."""

from __future__ import annotations

import os
import tempfile

from ._penny import MjData, MjModel

_OPTIONS = (
    "timestep", "gravity", "wind", "magnetic", "density", "viscosity", "impratio", "tolerance", "iterations", "cone",
    "disableflags", "enableflags", "law", "integrator",
)  # fmt: skip


def _editable(model):
    names = [n for n in dir(model) if n.split("_")[0] in _PREFIXES]
    arrays = {name: getattr(model, name) for name in names}
    return {name: a.copy() for name, a in arrays.items() if getattr(a, "flags", None) is not None and a.flags.writeable}


_PREFIXES = {"body", "jnt", "dof", "qpos0", "qpos", "geom", "site", "actuator", "sensor", "key", "tendon", "eq"}


def reduce_model(model):
    """The files of the scene, its arrays that can be written, and its options."""
    options = {name: getattr(model.opt, name) for name in _OPTIONS}
    options = {name: value.copy() if hasattr(value, "copy") else value for name, value in options.items()}
    return load_model, (model.files, _editable(model), options)


def load_model(files, arrays, options) -> MjModel:
    """The model of `reduce_model`."""
    model = MjModel.from_xml_string(files[0][1]) if len(files) == 1 else _with_includes(files)
    for name, value in arrays.items():
        if (getattr(model, name) != value).any():
            setattr(model, name, value)
    for name, value in options.items():
        setattr(model.opt, name, value)
    return model


def _with_includes(files) -> MjModel:
    top = os.path.dirname(os.path.abspath(files[0][0]))
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files:
            path = os.path.join(folder, os.path.relpath(os.path.abspath(name), top))
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        return MjModel.from_xml_path(os.path.join(folder, os.path.basename(files[0][0])))


def reduce_data(data):
    """The model and the whole state."""
    return load_data, (data.model, bytes(data._state()))


def load_data(model, state) -> MjData:
    """The data of `reduce_data`: what follows from the state is computed anew."""
    data = MjData(model)
    data._restore(state)
    return data
