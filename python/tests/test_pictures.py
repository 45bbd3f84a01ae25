"""Pictures: cameras are MuJoCo's, and what is drawn is where MuJoCo has it."""

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
    with pytest.raises(NotImplementedError, match="depth"):
        renderer.enable_depth_rendering()
    renderer.close()
    with pytest.raises(RuntimeError, match="close"):
        renderer.render()


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
