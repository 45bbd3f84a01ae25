"""MuJoCo's names for drawing, over Penny's own painter: no GPU, no display.

What is drawn is Penny's picture of the scene: the same poses and cameras as MuJoCo's, other materials and light.
"""

from __future__ import annotations

import copy
import warnings

import numpy as np

from ._enums import mjtCamera, mjtCatBit, mjtDepthMap, mjtFontScale, mjtGeom, mjtObj, mjtRndFlag, mjtVisFlag
from ._errors import FatalError
from ._math import mju_quat2Mat, mju_quatZ2Vec
from ._penny import MjData, MjModel, _depth, _framing, _paint, mj_name2id

__all__ = [
    "MjrContext",
    "MjrRect",
    "MjvCamera",
    "MjvGLCamera",
    "MjvGeom",
    "MjvOption",
    "MjvPerturb",
    "MjvScene",
    "Renderer",
    "mjr_overlay",
    "mjr_readPixels",
    "mjr_render",
    "mjr_resizeOffscreen",
    "mjr_setBuffer",
    "mjv_addGeoms",
    "mjv_connector",
    "mjv_defaultCamera",
    "mjv_defaultFreeCamera",
    "mjv_defaultOption",
    "mjv_defaultPerturb",
    "mjv_initGeom",
    "mjv_updateScene",
    "png",
    "snapshot",
]


class MjvCamera:
    """From where a picture is taken: a free camera about `lookat`, one that tracks a body, or one of the scene's."""

    def __init__(self):
        self.type = mjtCamera.mjCAMERA_FREE
        self.fixedcamid = self.trackbodyid = -1
        self._lookat = np.zeros(3)
        self.distance, self.azimuth, self.elevation = 2.0, 90.0, -45.0
        self.orthographic = 0

    @property
    def lookat(self):
        return self._lookat

    @lookat.setter
    def lookat(self, value):
        self._lookat[:] = value


class MjvOption:
    """What is shown: `geomgroup`, and of `flags` contact points and contact forces."""

    def __init__(self):
        self.geomgroup = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
        self.flags = np.zeros(len(mjtVisFlag.__members__), dtype=np.uint8)
        self.label = self.frame = 0


class MjvPerturb:
    """What a mouse holds: nothing, in a picture."""

    def __init__(self):
        self.active = self.select = 0


class MjvGeom:
    """A geom that was added to a scene. Pictures show spheres, capsules, ellipsoids, cylinders and boxes."""

    def __init__(self):
        self.type, self.objtype, self.objid, self.category, self.segid = 0, 0, -1, 0, -1
        self.size, self.pos, self.mat = np.zeros(3), np.zeros(3), np.eye(3)
        self.rgba = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
        self.label = ""


# Between the eyes, m: MuJoCo's default. Penny draws with one eye, in the middle.
_EYES = 0.068


class MjvGLCamera:
    """Where one eye of a picture is, and which way is ahead and up. Penny has no numbers of its frustum."""

    def __init__(self, place, axes, side: float):
        right, up, back = axes
        self.pos, self.forward, self.up = (np.asarray(v, np.float32) for v in (place + side * right, -back, up))


class MjvScene:
    """What the next picture shows: data and camera, taken by `mjv_updateScene`."""

    def __init__(self, model: MjModel | None = None, maxgeom: int = 1000):
        self.maxgeom, self.ngeom = maxgeom, 0
        self.flags = np.zeros(len(mjtRndFlag.__members__), dtype=np.uint8)
        self._model, self._data, self._camera, self._option = model, None, None, None
        self._geoms = None

    @property
    def geoms(self):
        if self._geoms is None:
            self._geoms = [MjvGeom() for _ in range(self.maxgeom)]
        return self._geoms

    @property
    def _added(self):
        return self.geoms[: self.ngeom] if self.ngeom else []

    @property
    def camera(self) -> list[MjvGLCamera]:
        """The left and the right eye; zeros before `mjv_updateScene`."""
        if self._data is None:
            return [MjvGLCamera(np.zeros(3), np.zeros((3, 3)), 0) for _ in range(2)]
        place, axes = _pose(self._data, _place(self._model, self._data, self._camera))
        return [MjvGLCamera(place, axes, side) for side in (-_EYES / 2, _EYES / 2)]


class MjrRect:
    """A rectangle of pixels."""

    def __init__(self, left: int, bottom: int, width: int, height: int):
        self.left, self.bottom, self.width, self.height = left, bottom, width, height


class MjrContext:
    """Where pictures are kept between `mjr_render` and `mjr_readPixels`."""

    def __init__(self, model: MjModel | None = None, fontscale: int = 0):
        self.offWidth = model.vis.global_.offwidth if model else 640
        self.offHeight = model.vis.global_.offheight if model else 480
        self.currentBuffer = 1
        self.readDepthMap = mjtDepthMap.mjDEPTH_ZERONEAR
        self._picture = self._shown = None

    def free(self):
        self._picture = self._shown = None


def mjv_defaultCamera(cam: MjvCamera) -> None:
    """The camera as it was made."""
    cam.__init__()


def mjv_defaultFreeCamera(m: MjModel, cam: MjvCamera) -> None:
    """A free camera that shows the whole model."""
    cam.__init__()
    cam.lookat, cam.distance = m.stat.center, 1.5 * m.stat.extent
    cam.azimuth, cam.elevation = m.vis.global_.azimuth, m.vis.global_.elevation


def mjv_defaultOption(opt: MjvOption) -> None:
    """The option as it was made."""
    opt.__init__()


def mjv_defaultPerturb(pert: MjvPerturb) -> None:
    """The perturbation as it was made."""
    pert.__init__()


def mjv_initGeom(geom: MjvGeom, type, size=None, pos=None, mat=None, rgba=None) -> None:
    """Sets a geom that is added by hand. In: `size` as in MJCF."""
    geom.type = int(type)
    for name, value in (("size", size), ("pos", pos), ("rgba", rgba)):
        if value is not None:
            setattr(geom, name, np.array(value, dtype=float))
    if size is not None:
        geom.size = _shown_size(geom.type, geom.size)
    if mat is not None:
        geom.mat = np.reshape(mat, (3, 3))


def _shown_size(kind, size):
    """MJCF's `size` as scenes have it: radius, radius and half-length of what is round."""
    if kind == mjtGeom.mjGEOM_SPHERE:
        return np.full(3, size[0])
    return size[[0, 0, 1]] if kind in _HALVED else size


_HALVED = {mjtGeom.mjGEOM_CAPSULE, mjtGeom.mjGEOM_CYLINDER}
_WHOLE = {mjtGeom.mjGEOM_ARROW, mjtGeom.mjGEOM_ARROW1, mjtGeom.mjGEOM_ARROW2, mjtGeom.mjGEOM_LINE}


def mjv_connector(geom: MjvGeom, type, width: float, from_, to) -> None:
    """Places a geom that is added by hand between two points, its z axis from one to the other.

    Capsules and cylinders have their middle in `pos` and half their length in `size`, arrows and lines begin there.
    """
    kind, start, end = int(type), np.array(from_, dtype=float), np.array(to, dtype=float)
    if kind not in _HALVED | _WHOLE:
        raise FatalError(f"mjv_connector: invalid geom type {kind} for connector")
    length, quat, mat = np.linalg.norm(end - start), np.zeros(4), np.zeros(9)
    if kind in _HALVED:
        start, length = (start + end) / 2, length / 2
    mju_quatZ2Vec(quat, end - start)
    mju_quat2Mat(mat, quat)
    geom.type, geom.size, geom.pos, geom.mat = kind, np.array([width, width, length]), start, mat.reshape(3, 3)


def mjv_addGeoms(m: MjModel, d: MjData, opt: MjvOption, pert: MjvPerturb, catmask: int, scn: MjvScene) -> None:
    """Adds the model's geoms as they are now: those of the groups in `opt` that stand still (`mjCAT_STATIC`) or move.

    They stay until `mjv_updateScene`. Sites and tendons, which MuJoCo adds as well, are left out with a warning.
    """
    if catmask & mjtCatBit.mjCAT_DYNAMIC and m.nsite + m.ntendon > 0:
        warnings.warn("Penny adds geoms to a scene, no sites and tendons", UserWarning, stacklevel=2)
    for i in range(m.ngeom):
        body = m.geom_bodyid[i]
        still = m.body_weldid[body] == 0 and m.body_mocapid[m.body_rootid[body]] == -1
        category = mjtCatBit.mjCAT_STATIC if still else mjtCatBit.mjCAT_DYNAMIC
        if not category & catmask or not opt.geomgroup[np.clip(m.geom_group[i], 0, 5)]:
            continue
        if scn.ngeom == scn.maxgeom:
            warnings.warn(f"the scene has room for {scn.maxgeom} geoms (`maxgeom`)", UserWarning, stacklevel=2)
            return
        geom = scn.geoms[scn.ngeom]
        scn.ngeom += 1
        mjv_initGeom(geom, m.geom_type[i], m.geom_size[i], d.geom_xpos[i], d.geom_xmat[i], m.geom_rgba[i])
        geom.objtype, geom.objid, geom.category, geom.segid = int(mjtObj.mjOBJ_GEOM), i, int(category), scn.ngeom - 1


def mjv_updateScene(m, d, opt, pert, cam, catmask, scn) -> None:
    """Takes camera and options for the next picture, and no geom added by hand. Data are looked at when it is drawn."""
    scn.ngeom = 0
    scn._model, scn._data, scn._camera, scn._option = m, d, copy.deepcopy(cam), copy.deepcopy(opt)


def _place(m: MjModel, d: MjData, cam: MjvCamera):
    """Where a camera is, as the painter wants it."""
    kind = int(cam.type)
    if cam.orthographic:
        raise NotImplementedError("Penny has no orthographic camera")
    if kind == mjtCamera.mjCAMERA_FIXED:
        if not 0 <= cam.fixedcamid < m.ncam:
            raise ValueError(f"camera id {cam.fixedcamid} is out of range [0, {m.ncam})")
        return int(cam.fixedcamid)
    if kind not in (mjtCamera.mjCAMERA_FREE, mjtCamera.mjCAMERA_TRACKING):
        raise NotImplementedError(f"Penny has no camera type {kind}")
    lookat = cam.lookat
    if kind == mjtCamera.mjCAMERA_TRACKING:
        if not 0 <= cam.trackbodyid < m.nbody:
            raise ValueError(f"body id {cam.trackbodyid} is out of range [0, {m.nbody})")
        lookat = d.subtree_com[cam.trackbodyid]
    return [*map(float, lookat), cam.distance, cam.azimuth, cam.elevation, m.vis.global_.fovy]


def _pose(d: MjData, place):
    """Where the eye of `_place` is, and its axes in rows: right, up and back.

    z = −(cos e cos a, cos e sin a, sin e),   eye = lookat + distance z      e elevation, a azimuth
    """
    if isinstance(place, int):
        return d.cam_xpos[place], d.cam_xmat[place].reshape(3, 3).T
    lookat, distance, (a, e) = np.array(place[:3]), place[3], np.radians(place[4:6])
    back = -np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    up = np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])
    return lookat + distance * back, np.array([np.cross(up, back), up, back])


_SHOWN = {mjtVisFlag.mjVIS_CONTACTPOINT, mjtVisFlag.mjVIS_CONTACTFORCE}


_SHAPES = set(range(mjtGeom.mjGEOM_SPHERE, mjtGeom.mjGEOM_BOX + 1))


def _picture(m, d, width, height, cam, opt, added=()):
    unknown = [flag.name for flag in mjtVisFlag if flag < len(opt.flags) and opt.flags[flag] and flag not in _SHOWN]
    lacking = any(geom.type not in _SHAPES for geom in added)
    others = {
        "frames": opt.frame,
        "labels": opt.label,
        "planes, arrows or lines among geoms added to the scene": lacking,
    }
    unknown += [name for name, wanted in others.items() if wanted]
    if unknown:
        what = ", ".join(unknown)
        warnings.warn(f"Penny's pictures do not show {what}", UserWarning, stacklevel=4)
    contacts = bool(opt.flags[mjtVisFlag.mjVIS_CONTACTPOINT] or opt.flags[mjtVisFlag.mjVIS_CONTACTFORCE])
    shapes = [
        (
            int(g.type),
            [*map(float, g.size)],
            [*map(float, g.pos)],
            [*map(float, np.ravel(g.mat))],
            [*map(float, g.rgba)],
        )
        for g in added
        if g.type in _SHAPES
    ]
    return _paint(d, width, height, _place(m, d, cam), [bool(g) for g in opt.geomgroup], contacts, shapes)


def _range(m):
    """The nearest and the farthest depth that is seen, m."""
    return m.vis.map.znear * m.stat.extent, m.vis.map.zfar * m.stat.extent


def _depths(m, d, width, height, cam, opt):
    """What the middle of each pixel sees, rows from the top: depth, m; geom, −1 where there is none."""
    return _depth(d, width, height, _place(m, d, cam), [bool(g) for g in opt.geomgroup], *_range(m))


def _segments(m, *shown):
    """Which geom the middle of each pixel sees, −1 where there is none."""
    depth, ids = _depths(m, *shown)
    if ((ids < 0) & (depth < np.float32(_range(m)[1]))).any():
        raise NotImplementedError("Penny has no ids of meshes, which are seen here")
    return ids


def mjr_setBuffer(framebuffer, con) -> None:
    """There is one buffer only, off the screen."""
    con.currentBuffer = int(framebuffer)


def mjr_resizeOffscreen(width, height, con) -> None:
    """Pictures have any size."""
    con.offWidth, con.offHeight = width, height


def mjr_render(viewport: MjrRect, scn: MjvScene, con: MjrContext) -> None:
    """Draws the scene."""
    if scn._data is None:
        raise ValueError("mjr_render before mjv_updateScene: there is nothing to draw")
    if scn.flags[mjtRndFlag.mjRND_SEGMENT]:
        raise NotImplementedError("Penny draws no segmentation")
    con._shown = scn._model, scn._data, viewport.width, viewport.height, scn._camera, scn._option
    con._picture = _picture(*con._shown, scn._added)


def mjr_readPixels(rgb, depth, viewport: MjrRect, con: MjrContext) -> None:
    """The picture that `mjr_render` drew, and its depth, rows from the bottom as in OpenGL.

        depth = far (z − near) / (z (far − near)):    0 where nearest, 1 at the farthest and where nothing is

    With `con.readDepthMap` of `mjDEPTH_ZEROFAR` it is 1 minus that. Data are looked at again for it. Where Penny cannot
    draw depths they are NaN beside a picture, and alone an error.
    """
    if con._picture is None:
        raise ValueError("mjr_readPixels before mjr_render: there is no picture")
    if rgb is not None:
        np.copyto(rgb.reshape(con._picture.shape), con._picture[::-1])
    if depth is not None:
        try:
            z, _ = _depths(*con._shown)
        except (NotImplementedError, ValueError):
            if rgb is None:
                raise
            depth.fill(np.nan)
            return
        near, far = _range(con._shown[0])
        reversed_z = near * (far / z.astype(float)[::-1] - 1) / (far - near)
        zero_far = con.readDepthMap == mjtDepthMap.mjDEPTH_ZEROFAR
        np.copyto(depth.reshape(z.shape), reversed_z if zero_far else 1 - reversed_z, casting="unsafe")


def mjr_overlay(font, gridpos, viewport, overlay, overlay2, con) -> None:
    """Text over a picture: Penny draws none."""


class Renderer:
    """Pictures of a scene as arrays (height, width, 3), uint8.

    with Renderer(m, 480, 640) as renderer:
        renderer.update_scene(d, camera="side")
        pixels = renderer.render()

    After `enable_depth_rendering` they are depths along the line of sight, (height, width), float32, m; after
    `enable_segmentation_rendering` id and `mjtObj` of what is seen, (height, width, 2), int32, −1 where nothing is.
    Both show geoms, at the middle of each pixel.
    """

    def __init__(self, model: MjModel, height: int = 240, width: int = 320, max_geom: int = 10000,
                 font_scale: mjtFontScale = mjtFontScale.mjFONTSCALE_150):  # fmt: skip
        for name, asked, most in (
            ("width", width, model.vis.global_.offwidth),
            ("height", height, model.vis.global_.offheight),
        ):
            if asked > most:
                raise ValueError(
                    f"Image {name} {asked} > framebuffer {name} {most}. Either reduce the image {name} or write "
                    f'<visual><global off{name}="{asked}"/></visual> into the scene, or set '
                    f"model.vis.global_.off{name}."
                )
        self._model, self._height, self._width = model, height, width
        self._scene = MjvScene(model, max_geom)
        self._closed = False
        self._kind = "picture"

    @property
    def model(self) -> MjModel:
        return self._model

    @property
    def scene(self) -> MjvScene:
        return self._scene

    @property
    def height(self) -> int:
        return self._height

    @property
    def width(self) -> int:
        return self._width

    def enable_depth_rendering(self):
        """Depths from now on."""
        self._kind = "depth"

    def enable_segmentation_rendering(self):
        """Ids of geoms from now on."""
        self._kind = "segments"

    def disable_depth_rendering(self):
        """Pictures again, if it was depths."""
        self._kind = "picture" if self._kind == "depth" else self._kind

    def disable_segmentation_rendering(self):
        """Pictures again, if it was ids."""
        self._kind = "picture" if self._kind == "segments" else self._kind

    def update_scene(self, data: MjData, camera=-1, scene_option: MjvOption | None = None) -> None:
        """What the next picture shows.

        In: a camera of the scene by name or number, −1 for a free one that shows all, or an `MjvCamera`.
        """
        if not isinstance(camera, MjvCamera):
            number = camera
            if isinstance(camera, str):
                number = mj_name2id(self._model, mjtObj.mjOBJ_CAMERA, camera)
                if number == -1:
                    raise ValueError(f'The camera "{camera}" does not exist.')
            if not -1 <= number < self._model.ncam:
                raise ValueError(f"The camera id {number} is out of range [-1, {self._model.ncam}).")
            camera = MjvCamera()
            if number == -1:
                mjv_defaultFreeCamera(self._model, camera)
            else:
                camera.type, camera.fixedcamid = mjtCamera.mjCAMERA_FIXED, number
        option = scene_option or MjvOption()
        mjv_updateScene(self._model, data, option, None, camera, None, self._scene)

    def render(self, *, out: np.ndarray | None = None) -> np.ndarray:
        """The picture, into `out` if that is given."""
        if self._closed:
            raise RuntimeError("render cannot be called after close.")
        scene, size = self._scene, (self._height, self._width)
        shape = {"picture": (*size, 3), "depth": size, "segments": (*size, 2)}[self._kind]
        if out is not None and out.shape != shape:
            raise ValueError(f"Expected `out.shape == {shape}`. Got `out.shape={out.shape}` instead.")
        pixels = self._pixels(scene, shape)
        if out is None:
            return pixels
        np.copyto(out, pixels, casting="unsafe")
        return out

    def _pixels(self, scene, shape):
        shown = self._model, scene._data, self._width, self._height, scene._camera, scene._option
        if self._kind == "picture":
            # As in MuJoCo: nothing to be seen before `update_scene`.
            return _picture(*shown, scene._added) if scene._data is not None else np.zeros(shape, np.uint8)
        if self._kind == "depth":
            farthest = _range(self._model)[1]
            return _depths(*shown)[0] if scene._data is not None else np.full(shape, farthest, np.float32)
        if scene._data is None:
            return np.full(shape, -1, np.int32)
        ids = _segments(*shown)
        return np.stack([ids, np.where(ids < 0, -1, np.int32(mjtObj.mjOBJ_GEOM))], axis=-1)

    def close(self) -> None:
        self._closed = True

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_) -> None:
        self.close()


def snapshot(d: MjData, width: int = 640, height: int = 400, camera=None, contacts: bool = False) -> np.ndarray:
    """A picture (height, width, 3) of the data: all that moves, or from a camera of the scene, by name or number."""
    where = _framing(d) if camera is None else int(d.model.camera(camera).id)
    return _paint(d, width, height, list(where) if camera is None else where, [True] * 6, contacts)


def png(pixels: np.ndarray) -> bytes:
    """A picture (height, width, 3), uint8, as the bytes of a PNG file."""
    import struct
    import zlib

    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body
