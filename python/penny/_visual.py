"""What pictures need of a model: `m.vis`, `m.stat`."""

from __future__ import annotations

import warnings

import numpy as np

from ._enums import mjtGeom


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
    """What pictures are scaled by: size and centre of the model in `qpos0` and mean size of its bodies, m, from
    `<statistic>` where the file has them.

    Otherwise as in MuJoCo: the centre of the box about all bodies, their centres of mass, joints, sites and the spheres
    about geoms (a tenth of a plane); its longest side, or twice the mean size of a body if that is more. The size of a
    body is how far from its centre of mass its joints, those of its children and its geoms reach.
    """

    __slots__ = ("center", "extent", "meansize")

    def __init__(self, model, given=()):
        from ._penny import MjData

        data, radius, of = MjData(model), model.geom_rbound.copy(), model.geom_bodyid
        plane = model.geom_type == mjtGeom.mjGEOM_PLANE
        size = np.zeros(model.nbody)

        def grow(bodies, places, beyond=0.0):
            np.maximum.at(size, bodies, np.linalg.norm(places - data.xipos[bodies], axis=1) + beyond)

        round_ = ~plane & (radius > 0)
        grow(of[round_], data.geom_xpos[round_], radius[round_])
        for bodies in (model.jnt_bodyid, model.body_parentid[model.jnt_bodyid]):
            grow(bodies, data.xanchor)
        self.meansize = float(size[1:].mean()) if model.nbody > 1 else 0.2
        radius[plane] = 0.1 * model.geom_size[plane, :2].max(axis=1)
        seen = radius > 0
        spheres = [data.geom_xpos[seen] + sign * radius[seen, None] for sign in (-1, 1)]
        points = np.concatenate([data.xpos[1:], data.xipos[1:], data.xanchor, data.site_xpos, *spheres])
        if len(points) == 0:
            points = np.zeros((1, 3)) if model.ngeom else np.array([-np.ones(3), np.ones(3)])
        low, high = points.min(axis=0), points.max(axis=0)
        self.center = 0.5 * (low + high)
        self.extent = max(float((high - low).max()), 2 * self.meansize, 1e-5)
        given = dict(given)
        for name in ("extent", "meansize"):
            if name in given:
                setattr(self, name, float(given[name]))
        if "center" in given:
            self.center = np.array([float(x) for x in given["center"].split()])
