"""What pictures need of a model: `m.vis`, `m.stat`."""

from __future__ import annotations

import warnings

import numpy as np


class _Global:
    """`<visual><global>`: what Penny's pictures use of it."""

    __slots__ = ("azimuth", "elevation", "fovy", "offheight", "offwidth")

    def __init__(self, given):
        self.offwidth, self.offheight = int(given.get("offwidth", 640)), int(given.get("offheight", 480))
        self.fovy = float(given.get("fovy", 45.0))
        self.azimuth, self.elevation = float(given.get("azimuth", 90.0)), float(given.get("elevation", -45.0))


class _Map:
    """`<visual><map>`: between which depths pictures see, in `stat.extent`; what else is set only warns."""

    def __init__(self, given):
        for name, default in (("znear", 0.01), ("zfar", 50.0)):
            # As in MuJoCo of single precision.
            object.__setattr__(self, name, float(np.float32(given.get(name, default))))

    def __setattr__(self, name, value):
        if name not in ("znear", "zfar"):
            warnings.warn(f"vis.map.{name} changes nothing in Penny's pictures", UserWarning, stacklevel=2)
        object.__setattr__(self, name, value)

    def __getattr__(self, name):
        raise AttributeError(f"vis.map has no `{name}`: MuJoCo may have it, Penny has not")


class _Unused:
    """A section of `<visual>` that Penny's pictures do not use: what is set is kept, with a warning."""

    def __init__(self, name):
        object.__setattr__(self, "_name", name)

    def __setattr__(self, name, value):
        warnings.warn(f"vis.{self._name}.{name} changes nothing in Penny's pictures", UserWarning, stacklevel=2)
        object.__setattr__(self, name, value)

    def __getattr__(self, name):
        raise AttributeError(f"vis.{self._name} has no `{name}`: MuJoCo may have it, Penny has not")


class MjVisual:
    """MuJoCo's `MjVisual`: `global_` and `map` as far as Penny's pictures have them; other sections change nothing."""

    __slots__ = ("global_", "headlight", "map", "quality", "rgba", "scale")

    def __init__(self, given=(), depths=()):
        self.global_, self.map = _Global(dict(given)), _Map(dict(depths))
        for name in ("headlight", "quality", "rgba", "scale"):
            setattr(self, name, _Unused(name))


class MjStatistic:
    """What pictures are scaled by: size and centre of the model in `qpos0`, m, from `<statistic>` where the file has
    them.

    Otherwise both are Penny's own measure: those of the box that holds the spheres about all geoms.
    """

    __slots__ = ("center", "extent")

    def __init__(self, model, given=()):
        from ._penny import MjData

        data = MjData(model)
        radius = model.geom_rbound
        low = np.full(3, np.inf)
        high = -low
        for place, r in zip(data.geom_xpos, radius):
            if r > 0:
                low, high = np.minimum(low, place - r), np.maximum(high, place + r)
        if not np.isfinite(low).all():
            low, high = -np.ones(3), np.ones(3)
        self.center = 0.5 * (low + high)
        self.extent = max(float((high - low).max()), 1e-5)
        given = dict(given)
        if "extent" in given:
            self.extent = float(given["extent"])
        if "center" in given:
            self.center = np.array([float(x) for x in given["center"].split()])
