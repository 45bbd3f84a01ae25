"""Pictures: cameras are MuJoCo's, and what is drawn is where MuJoCo has it."""

import os
import subprocess
import sys
import zlib

import mujoco
import numpy as np
import pytest
from conftest import ASSETS, MODELS, Pair, close

import penny

# Nothing but a red ball: where it is in a picture is where its pixels are.
BALL = """<mujoco><visual><global offwidth="800" offheight="600"/></visual><worldbody><light pos="0 0 4"/>
<camera name="fixed" pos="1 -2 1" xyaxes="0.9 0.5 0.1 -0.2 0.3 1" fovy="50"/>
<body name="cart" pos="0.3 0.2 0.4" euler="0 0 30"><camera name="track" mode="track" pos="0 -2 0.5" euler="80 0 0"/>
<camera name="com" mode="trackcom" pos="0.5 -2 0.5" euler="80 10 0"/><joint type="slide" axis="1 0 0"/>
<joint type="hinge" axis="0 0 1"/><geom type="sphere" size="0.15" rgba="1 0 0 1"/>
<body pos="0.5 0 0"><geom type="sphere" size="0.01" rgba="0 0 1 1" group="3"/><joint axis="0 1 0"/></body></body>
<camera name="target" mode="targetbody" target="cart" pos="-1.5 -1 1"/>
<camera name="targetcom" mode="targetbodycom" target="cart" pos="-1 1.5 1.5"/></worldbody></mujoco>"""


def both(text=BALL):
    pair = Pair.__new__(Pair)
    pair.mm, pair.pm = mujoco.MjModel.from_xml_string(text), penny.MjModel.from_xml_string(text)
    pair.md, pair.pd = mujoco.MjData(pair.mm), penny.MjData(pair.pm)
    for module, m, d in ((mujoco, pair.mm, pair.md), (penny, pair.pm, pair.pd)):
        d.qpos = [0.2, 0.7, 0.3]
        module.mj_forward(m, d)
    mujoco.mj_camlight(pair.mm, pair.md)
    return pair


def test_cameras_are_where_mujoco_has_them():
    pair = both()
    assert pair.pm.ncam == 5
    for name in ("cam_bodyid", "cam_mode", "cam_targetbodyid", "cam_pos", "cam_quat", "cam_fovy"):
        assert close(getattr(pair.pm, name), getattr(pair.mm, name)), name
    assert close(pair.pd.cam_xpos, pair.md.cam_xpos) and close(pair.pd.cam_xmat, pair.md.cam_xmat)


def centre(pixels):
    """Column and row of the middle of what is red."""
    red = (pixels[..., 0] > 90) & (pixels[..., 1] < 80) & (pixels[..., 2] < 80)
    rows, columns = np.nonzero(red)
    assert len(rows) > 50
    return np.array([columns.min() + columns.max(), rows.min() + rows.max()]) / 2


def expected(d, camera, fovy, width, height):
    """Where a pinhole camera sees the ball's centre."""
    axes, place = d.cam_xmat[camera].reshape(3, 3), d.cam_xpos[camera]
    x, y, z = axes.T @ (d.xpos[1] - place)
    focal = 0.5 * height / np.tan(np.radians(fovy) / 2)
    return np.array([0.5 * width + focal * x / -z, 0.5 * height - focal * y / -z])


@pytest.mark.parametrize("camera", ["fixed", "track", "com", "target", "targetcom"])
def test_a_picture_shows_the_ball_where_the_camera_sees_it(camera):
    pair = both()
    with penny.Renderer(pair.pm, 300, 400) as renderer:
        renderer.update_scene(pair.pd, camera)
        pixels = renderer.render()
    assert pixels.shape == (300, 400, 3) and pixels.dtype == np.uint8
    i = pair.pm.camera(camera).id
    assert np.abs(centre(pixels) - expected(pair.md, i, pair.mm.cam_fovy[i], 400, 300)).max() < 6


def test_free_cameras_and_options():
    pair = both()
    renderer, camera = penny.Renderer(pair.pm, 300, 400), penny.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = pair.md.xpos[1], 3, 40, -20
    renderer.update_scene(pair.pd, camera)
    pixels = renderer.render()
    # What it looks at is in the middle.
    assert np.abs(centre(pixels) - [199.5, 149.5]).max() < 3
    option = penny.MjvOption()
    option.geomgroup[0] = 0
    renderer.update_scene(pair.pd, camera, option)
    assert not (renderer.render()[..., 0] > renderer.render()[..., 2].astype(int) + 60).any()
    out = np.zeros((300, 400, 3), np.uint8)
    renderer.update_scene(pair.pd)
    assert renderer.render(out=out) is out and out.any()
    option.flags[penny.mjtVisFlag.mjVIS_JOINT] = 1
    renderer.update_scene(pair.pd, camera, option)
    with pytest.warns(UserWarning, match="mjVIS_JOINT"):
        renderer.render()
    with pytest.warns(UserWarning, match=r"vis\.scale\.forcewidth"):
        pair.pm.vis.scale.forcewidth = 0.1
    assert not penny.Renderer(pair.pm).render().any()
    with pytest.raises(ValueError, match="does not exist"):
        renderer.update_scene(pair.pd, "nowhere")
    with pytest.raises(ValueError, match="out of range"):
        renderer.update_scene(pair.pd, 7)
    with pytest.raises(ValueError, match="framebuffer width"):
        penny.Renderer(pair.pm, 300, 4000)
    camera.orthographic = 1
    renderer.update_scene(pair.pd, camera)
    with pytest.raises(NotImplementedError, match="orthographic"):
        renderer.render()
    renderer.close()
    with pytest.raises(RuntimeError, match="close"):
        renderer.render()


# A floor, a ball above it, and a box; a camera looks straight down from 2 m. Near and far are 0.02 m and 100 m.
DEEP = """<mujoco><statistic extent="2" center="0 0 0"/><worldbody><geom type="plane" size="1 1 1"/>
<camera name="down" pos="0 0 2" fovy="60"/><camera name="side" pos="0 -3 .5" euler="90 0 0"/>
<body pos=".2 .1 .5"><freejoint/><geom size=".3"/></body>
<geom type="box" pos="-.5 0 .2" size=".2 .3 .2"/><geom group="3" size=".1" pos="0 0 1.5"/></worldbody></mujoco>"""


def test_eyes_of_a_scene_are_mujocos():
    pair = both()
    scenes = mujoco.MjvScene(pair.mm, 100), penny.MjvScene(pair.pm, 100)
    assert not any(eye.pos.any() or eye.forward.any() for eye in scenes[1].camera)
    for kind, number in ((0, -1), (1, -1), *((2, i) for i in range(pair.pm.ncam))):
        for module, m, d, scene in zip((mujoco, penny), (pair.mm, pair.pm), (pair.md, pair.pd), scenes):
            camera = module.MjvCamera()
            camera.lookat, camera.distance, camera.azimuth, camera.elevation = [0.1, 0.2, 0.3], 3, 40, -20
            camera.type, camera.fixedcamid, camera.trackbodyid = kind, number, 1
            module.mjv_updateScene(m, d, module.MjvOption(), None, camera, 7, scene)
        for ours, theirs in zip(scenes[1].camera, scenes[0].camera):
            for name in ("pos", "forward", "up"):
                a, b = getattr(ours, name), getattr(theirs, name)
                assert a.dtype == b.dtype and np.abs(a - b).max() < 1e-6, (kind, number, name)


# Nothing; planes without end and with one; a body away from its joint and its mass; a size that is given.
STATISTICS = (
    "<mujoco/>",
    "<mujoco><worldbody><geom type='plane' size='0 0 1'/></worldbody></mujoco>",
    "<mujoco><worldbody><geom type='plane' size='0 3 1'/><site pos='4 0 0'/></worldbody></mujoco>",
    "<mujoco><statistic meansize='.01'/><worldbody><body pos='1 2 3'><geom size='.1'/></body></worldbody></mujoco>",
    """<mujoco><worldbody><body><joint axis="0 1 0" pos="0 0 2"/><geom size=".1 .2" type="capsule" pos=".3 0 0"/>
    <body pos="0 1 0"><joint pos=".5 0 0"/><inertial pos="0 0 .1" mass="1" diaginertia="1 1 1"/>
    <geom size=".1 .2 .3" type="box" euler="10 20 30"/></body></body></worldbody></mujoco>""",
    BALL,
)


def test_a_model_is_as_large_as_mujoco_has_it():
    for text in STATISTICS:
        m, p = mujoco.MjModel.from_xml_string(text), penny.MjModel.from_xml_string(text)
        for name in ("extent", "center", "meansize"):
            assert close(getattr(p.stat, name), getattr(m.stat, name)), (text, name)
    for path in [*MODELS.glob("*.xml"), *(ASSETS / f"{name}.xml" for name in ("ant", "humanoid", "hopper"))]:
        try:
            m, p = mujoco.MjModel.from_xml_path(str(path)), penny.MjModel.from_xml_path(str(path))
        except ValueError:
            continue
        assert close(p.stat.extent, m.stat.extent) and close(p.stat.center, m.stat.center), path


def test_geoms_between_two_points():
    m = mujoco.MjModel.from_xml_string("<mujoco/>")
    for kind in (3, 5, 100, 101, 102, 103):
        for end in ([1, 2, 0], [1, 0, 3], [1.5, -1, -3], [1, 0, -2], [1, 0, 0]):
            geoms = mujoco.MjvScene(m, 1).geoms[0], penny.MjvGeom()
            for module, geom in zip((mujoco, penny), geoms):
                module.mjv_initGeom(geom, kind, np.ones(3), np.zeros(3), np.eye(3).ravel(), np.ones(4, np.float32))
                module.mjv_connector(geom, kind, 0.1, np.array([1.0, 0, 0]), np.array(end, dtype=float))
            for name in ("type", "size", "pos", "mat"):
                assert close(getattr(geoms[1], name), getattr(geoms[0], name), 1e-6), (kind, end, name)
    with pytest.raises(penny.FatalError, match="invalid geom type 2"):
        penny.mjv_connector(penny.MjvGeom(), penny.mjtGeom.mjGEOM_SPHERE, 0.1, np.zeros(3), np.ones(3))
    with penny.Renderer(both().pm) as renderer:
        renderer.update_scene(both().pd)
        renderer.scene.ngeom += 1
        with pytest.warns(UserWarning, match="geoms added"):
            renderer.render()
        renderer.update_scene(both().pd)
        assert renderer.scene.ngeom == 0


def test_geoms_that_are_added_are_seen_where_they_are():
    pair, nothing = both(), penny.MjvOption()
    nothing.geomgroup[:] = 0
    with penny.Renderer(pair.pm, 300, 400) as renderer:
        renderer.update_scene(pair.pd, "fixed")
        own = renderer.render()
        renderer.update_scene(pair.pd, "fixed", nothing)
        assert not ((renderer.render()[..., 0] > 90) & (renderer.render()[..., 1] < 80)).any()
        penny.mjv_addGeoms(pair.pm, pair.pd, penny.MjvOption(), None, penny.mjtCatBit.mjCAT_ALL, renderer.scene)
        added = renderer.render()
        assert renderer.scene.ngeom == 1
    assert np.abs(centre(added) - centre(own)).max() < 1
    full = penny.MjvScene(pair.pm, 0)
    with pytest.warns(UserWarning, match="room for 0 geoms"):
        penny.mjv_addGeoms(pair.pm, pair.pd, penny.MjvOption(), None, penny.mjtCatBit.mjCAT_DYNAMIC, full)


def test_depths_are_those_of_the_surfaces():
    m = penny.MjModel.from_xml_string(DEEP)
    d, width, height = penny.MjData(m), 61, 47
    with penny.Renderer(m, height, width) as renderer:
        renderer.enable_depth_rendering()
        assert (renderer.render() == np.float32(100)).all()
        renderer.update_scene(d, "down")
        depth = renderer.render()
        renderer.enable_segmentation_rendering()
        ids = renderer.render()
        renderer.disable_segmentation_rendering()
        assert renderer.render().shape == (height, width, 3)
    focal = 0.5 * height / np.tan(np.radians(30))
    x, y = np.meshgrid((np.arange(width) + 0.5 - width / 2) / focal, -(np.arange(height) + 0.5 - height / 2) / focal)
    # Floor: z = 0 within 1 m; lid of the box: z = 0.4 m; ball: |eye + z (x, y, −1) − c| = r, the nearer solution.
    expected, seen = np.full((height, width), 100.0), np.full((height, width), -1)
    inside = (np.abs(2 * x) <= 1) & (np.abs(2 * y) <= 1)
    expected[inside], seen[inside] = 2, 0
    lid = (np.abs(1.6 * x + 0.5) <= 0.2) & (np.abs(1.6 * y) <= 0.3)
    to = np.array([0, 0, 2]) - [0.2, 0.1, 0.5]
    a, b, c = x**2 + y**2 + 1, x * to[0] + y * to[1] - to[2], to @ to - 0.3**2
    ball = b**2 > a * c
    near = np.where(ball, (-b - np.sqrt(np.maximum(b**2 - a * c, 0))) / a, np.inf)
    for where, z, i in ((lid, 1.6, 1), (ball, near, 3)):
        nearer = where & (z < expected)
        expected, seen = np.where(nearer, z, expected), np.where(nearer, i, seen)
    # Below its lid the box's sides are seen from further out.
    sides = (ids[..., 0] == 1) & (seen != 1)
    assert np.abs(depth - expected)[~sides].max() < 1e-5 and (depth[sides] > 1.6).all() and sides.sum() < 30
    assert (ids[..., 0] == seen)[~sides].all() and (ids[..., 1] == np.where(ids[..., 0] < 0, -1, 5)).all()
    assert depth.dtype == np.float32 and ids.dtype == np.int32
    assert {0, 1, 3} <= set(np.unique(seen)) and lid.sum() > 20 and ball.sum() > 100


# MuJoCo's own depths and ids of DEEP, where OpenGL can draw without a display.
DRAWN_BY_MUJOCO = """
import sys, mujoco, numpy as np
m = mujoco.MjModel.from_xml_string(sys.argv[1])
d, drawn = mujoco.MjData(m), {}
mujoco.mj_forward(m, d)
for camera in ("down", "side"):
    with mujoco.Renderer(m, 120, 160) as renderer:
        renderer.update_scene(d, camera)
        renderer.enable_depth_rendering()
        drawn[camera] = renderer.render().copy()
        renderer.enable_segmentation_rendering()
        drawn[camera + " ids"] = renderer.render().copy()
np.savez(sys.argv[2], **drawn)
"""


def test_depths_and_segments_are_mujocos(tmp_path):
    out = tmp_path / "drawn.npz"
    command, environment = [sys.executable, "-c", DRAWN_BY_MUJOCO, DEEP, str(out)], {**os.environ, "MUJOCO_GL": "egl"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    if done.returncode:
        pytest.skip(f"MuJoCo cannot draw here: {done.stderr.strip().splitlines()[-1]}")
    m, drawn = penny.MjModel.from_xml_string(DEEP), np.load(out)
    for camera in ("down", "side"):
        with penny.Renderer(m, 120, 160) as renderer:
            renderer.update_scene(penny.MjData(m), camera)
            renderer.enable_depth_rendering()
            depth = renderer.render()
            renderer.enable_segmentation_rendering()
            ids = renderer.render()
        same = (ids == drawn[camera + " ids"]).all(axis=-1)
        assert same.mean() > 0.998
        # Plane and box; MuJoCo's ball is a polyhedron, and its farthest depth is rounded by its buffer.
        flat = same & np.isin(ids[..., 0], (0, 1))
        assert np.abs(depth - drawn[camera])[flat].max() < 1e-5 and flat.sum() > 2000
        assert np.abs(depth - drawn[camera])[same & (ids[..., 0] == 3)].max() < 0.06


def test_depth_of_the_buffer_and_what_is_not_seen():
    m = penny.MjModel.from_xml_string(DEEP)
    d, option, camera = penny.MjData(m), penny.MjvOption(), penny.MjvCamera()
    penny.GLContext(40, 30).make_current()
    scene, context, view = penny.MjvScene(m, 10), penny.MjrContext(m), penny.MjrRect(0, 0, 40, 30)
    camera.type, camera.fixedcamid = penny.mjtCamera.mjCAMERA_FIXED, m.camera("side").id
    penny.mjv_updateScene(m, d, option, None, camera, 7, scene)
    penny.mjr_render(view, scene, context)
    buffer, rgb = np.zeros((30, 40), np.float32), np.zeros((30, 40, 3), np.uint8)
    penny.mjr_readPixels(rgb, buffer, view, context)
    near, far = 0.02, 100.0
    # Rows from the bottom: the sky is the last, the middle is the ball or the box.
    z = near * far / (far - buffer.astype(float) * (far - near))
    assert (buffer[-1] == 1).all() and 2.6 < z[15, 21] < 3 and rgb.any()
    context.readDepthMap = penny.mjtDepthMap.mjDEPTH_ZEROFAR
    other = np.zeros_like(buffer)
    penny.mjr_readPixels(None, other, view, context)
    assert np.allclose(other, 1 - buffer, atol=1e-6)
    # From inside a ball it is not seen.
    d.qpos[:3] = [0, -3, 0.5]
    penny.mj_forward(m, d)
    with penny.Renderer(m, 30, 40) as renderer:
        renderer.enable_segmentation_rendering()
        renderer.update_scene(d, "side")
        assert 3 not in renderer.render()[..., 0]
        option.geomgroup[3] = 1
        renderer.update_scene(d, "down", option)
        assert 2 in renderer.render()[..., 0]
    string = BALL.replace("</worldbody>", "<site name='a'/><site name='b' pos='1 0 0'/></worldbody>").replace(
        "</mujoco>", "<tendon><spatial><site site='a'/><site site='b'/></spatial></tendon></mujoco>"
    )
    m = penny.MjModel.from_xml_string(string)
    with penny.Renderer(m) as renderer:
        renderer.update_scene(penny.MjData(m))
        renderer.enable_depth_rendering()
        with pytest.raises(NotImplementedError, match="tendons"):
            renderer.render()
    penny.mjv_updateScene(m, penny.MjData(m), option, None, penny.MjvCamera(), 7, scene)
    penny.mjr_render(view, scene, context)
    penny.mjr_readPixels(rgb, buffer, view, context)
    assert np.isnan(buffer).all() and rgb.any()


# Reads pictures as the window does, and does what a person would.
PERSON = r"""
import struct, sys
print("shown", flush=True)
for said in (b"size 320 200", b"rotate 0.5 0.25", b"zoom 1", b"pan 0.1 0", b"key 32", b"", b""):
    n = struct.unpack(">I", sys.stdin.buffer.read(4))[0]
    picture = sys.stdin.buffer.read(n)
    sys.stdout.buffer.write(said + b"\n" * bool(said) + b"shown\n")
    sys.stdout.flush()
open(sys.argv[1], "wb").write(picture)
"""


def test_a_window_shows_what_python_simulates(tmp_path, monkeypatch):
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    d, keys, last = penny.MjData(m), [], tmp_path / "last.ppm"
    monkeypatch.setattr(penny.viewer, "_WINDOW", (sys.executable, "-c", PERSON, str(last)))
    with penny.viewer.launch_passive(m, d, key_callback=keys.append) as viewer:
        before = viewer.cam.azimuth, viewer.cam.elevation, viewer.cam.distance, viewer.cam.lookat.copy()
        assert viewer.m is m and viewer.d is d
        while viewer.is_running():
            penny.mj_step(m, d)
            with viewer.lock():
                viewer.opt.flags[penny.mjtVisFlag.mjVIS_CONTACTPOINT] = 1
            viewer.sync()
        assert keys == [32] and (viewer.viewport.width, viewer.viewport.height) == (320, 200)
        assert viewer.cam.azimuth == before[0] - 90 and viewer.cam.elevation == max(before[1] - 45, -89)
        assert viewer.cam.distance == pytest.approx(0.9 * before[2]) and (viewer.cam.lookat != before[3]).any()
        viewer.sync()
    head, pixels = last.read_bytes().split(b"\n", 1)
    assert head == b"P6 320 200 255" and len(pixels) == 320 * 200 * 3 and d.time > 0


def test_without_a_display_the_window_says_so(monkeypatch):
    m = penny.MjModel.from_xml_path(MODELS / "stack.xml")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(RuntimeError, match=r"cannot open a window: .*(display|tkinter)"):
        penny.viewer.launch_passive(m, penny.MjData(m))


def test_notebooks_show_pictures():
    sim = penny.Simulation.from_path(MODELS / "stack.xml")
    for shown in (sim, sim.trajectory(0.1)):
        png = shown._repr_png_()
        assert png[:8] == b"\x89PNG\r\n\x1a\n"
        assert len(zlib.decompress(png[41 : png.rindex(b"IEND") - 8])) > 100_000


def test_videos(tmp_path):
    sim = penny.Simulation.from_path(MODELS / "stack.xml")
    frames = [sim.step(20).picture(160, 120) for _ in range(5)]
    penny.save_video(tmp_path / "a.gif", frames)
    assert (tmp_path / "a.gif").read_bytes()[:6] == b"GIF89a"
    with pytest.raises(ValueError, match="must end in"):
        penny.save_video(tmp_path / "a.xyz", frames)


def test_a_robot_is_seen():
    m = penny.MjModel.from_xml_path(ASSETS / "ant.xml")
    with penny.Renderer(m) as renderer:
        renderer.update_scene(penny.MjData(m), "track")
        assert renderer.render().std() > 10
