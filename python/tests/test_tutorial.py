"""What MuJoCo's own Python tutorial does, cell by cell, on scenes of our own: once on MuJoCo and once on Penny.

`docs/clients.md` says which cell each function stands for. Each returns numbers by name, which are the same on both: to
rounding, in runs too short for chaos to show it.
"""

import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from conftest import close

import penny


def scene(mj, body, option="", rest=""):
    """A model and its data: a floor, a light, a camera and the bodies."""
    model = mj.MjModel.from_xml_string(f"""
    <mujoco>
      <option tolerance="0" iterations="500" ls_iterations="200" {option}/>
      <visual><global offwidth="640" offheight="480"/></visual>
      <worldbody>
        <light pos="0 0 3"/>
        <camera name="side" pos="0 -2 1" xyaxes="1 0 0 0 .5 1"/>
        <geom name="floor" type="plane" size="2 2 .1" condim="3"/>
        {body}
      </worldbody>
      {rest}
    </mujoco>""")
    return model, mj.MjData(model)


def run(mj, m, d, steps, watch):
    """What `watch` says after each of so many steps."""
    seen = []
    for _ in range(steps):
        mj.mj_step(m, d)
        seen.append(np.concatenate([np.atleast_1d(x).ravel() for x in watch()]))
    return np.array(seen)


BALL = "<body name='ball' pos='0 0 .5'><freejoint name='fly'/><geom name='red' size='.1' rgba='1 0 0 1'/></body>"
DOUBLE = """
  <body pos="0 0 2"><joint name="upper" axis="0 1 0"/><geom type="capsule" size=".03" fromto="0 0 0 0 0 -.5"/>
    <body pos="0 0 -.5"><joint name="lower" axis="0 1 0"/><geom type="capsule" size=".03" fromto="0 0 0 0 0 -.4"/>
    </body>
  </body>"""


def names(mj):
    m, d = scene(mj, BALL)
    mj.mj_kinematics(m, d)
    with pytest.raises(KeyError):
        m.geom("blue")
    id = mj.mj_name2id(m, mj.mjtObj.mjOBJ_GEOM, "red")
    assert [mj.mj_id2name(m, mj.mjtObj.mjOBJ_GEOM, i) for i in range(m.ngeom)] == ["floor", "red"]
    return {
        "rgba": m.geom_rgba, "by name": m.geom("red").rgba, "id": [id, m.geom("red").id, m.geom(1).id],
        "place": d.geom_xpos, "place by name": d.geom("red").xpos, "sizes": [m.ngeom, m.nq, m.nv, m.nbody],
    }  # fmt: skip


def pictures(mj):
    m, d = scene(mj, BALL)
    with mj.Renderer(m, 60, 80) as renderer:
        before = renderer.render()
        mj.mj_forward(m, d)
        renderer.update_scene(d, camera="side")
        after = renderer.render()
    # Light and materials are each engine's own: the ball is red where it is.
    row, column = np.argwhere((after[..., 0] > 100) & (after[..., 1] < 60)).mean(axis=0).round()
    return {"before": [before.max()], "shape": after.shape, "ball within a pixel": [row // 3, column // 3]}


def time_and_gravity(mj):
    m, d = scene(mj, DOUBLE)
    falls = run(mj, m, d, 100, lambda: (d.time, d.qpos))
    mj.mj_resetData(m, d)
    m.opt.gravity = (0, 0, 9.81)
    d.joint("upper").qpos = 0.1
    return {"falls": falls, "rises": run(mj, m, d, 100, lambda: (d.time, d.qpos)), "timestep": [m.opt.timestep]}


def tippe_top(mj):
    m, d = scene(
        mj,
        """<body name="top" pos="0 0 .02"><freejoint/><site name="tip" pos="0 0 .03"/>
             <geom type="sphere" size=".02"/><geom type="cylinder" size=".004 .008" pos="0 0 .02"/>
             <geom type="box" size=".01 .01 .002" pos="0 0 -.012" density="8000" contype="0" conaffinity="0"/>
           </body>""",
        'integrator="RK4"',
        '<keyframe><key name="spin" qpos="0 0 .02 1 0 0 0" qvel="0 0 0 0 1 200"/></keyframe>',
    )
    mj.mj_resetDataKeyframe(m, d, 0)
    spins = run(mj, m, d, 150, lambda: (d.qpos, d.joint(0).qvel[3:], d.site("tip").xpos))
    return {"spins": spins, "energy": [m.body("top").mass[0], m.key("spin").qvel[-1]]}


def chaos(mj):
    m, d = scene(mj, DOUBLE, 'timestep=".002"', '<size memory="1M"/>')
    m.opt.enableflags |= mj.mjtEnableBit.mjENBL_ENERGY
    runs = []
    for push in (5.0, 5.0 + 1e-5):
        mj.mj_resetData(m, d)
        d.joint("upper").qvel = push
        runs.append(run(mj, m, d, 300, lambda: (d.qpos, d.energy)))
    # What is small at first has grown alike.
    return {"runs": np.array(runs), "apart": (runs[1] - runs[0])[-1] * 1e5}


def timesteps(mj):
    m, d = scene(mj, DOUBLE)
    m.opt.enableflags |= mj.mjtEnableBit.mjENBL_ENERGY
    drift = {}

    def energy():
        # After a step MuJoCo's is that of the last stage of RK4, Penny's that of the step's beginning.
        mj.mj_forward(m, d)
        return (d.energy,)

    for integrator in (mj.mjtIntegrator.mjINT_EULER, mj.mjtIntegrator.mjINT_RK4):
        for step in (0.01, 0.001):
            mj.mj_resetData(m, d)
            m.opt.integrator, m.opt.timestep = integrator, step
            d.joint("upper").qvel = 4
            drift[f"{integrator.name} {step}"] = run(mj, m, d, 60, energy)
    return drift


def divergence(mj):
    m, d = scene(mj, "<body><joint type='slide' name='s' stiffness='1e4'/><geom size='.1' contype='0'/></body>")
    seen = {}
    for step in (0.2, 0.1):
        mj.mj_resetData(m, d)
        m.opt.timestep = step
        m.opt.disableflags |= mj.mjtDisableBit.mjDSBL_EULERDAMP
        d.joint("s").qpos = 1
        steps = 0
        while not d.warning.number.any() and steps < 1000:
            steps += 1
            # Penny's step is an error as well.
            try:
                mj.mj_step(m, d)
            except mj.FatalError:
                assert mj is penny
        kind = mj.mjtWarning(np.flatnonzero(d.warning.number)[0])
        seen[f"{kind.name} at {step}"] = [steps, *d.warning.number, d.warning[kind].lastinfo]
    mj.mj_resetData(m, d)
    return {**seen, "after a reset": d.warning.number}


def contacts(mj):
    m, d = scene(
        mj,
        """<body name="box and ball" euler="0 0 -30" pos="0 0 .4"><freejoint/>
             <geom type="box" size=".1 .1 .1" rgba="1 0 0 1"/><geom size=".06" pos=".15 .15 .15"/></body>""",
    )

    def watch():
        force = np.zeros((4, 6))
        for i in range(min(d.ncon, 4)):
            mj.mj_contactForce(m, d, i, force[i])
        return d.qpos, [d.ncon], force[:, 0], sorted(c.dist for c in d.contact[: d.ncon]) + [0.0] * (8 - d.ncon)

    return {"tumbles": run(mj, m, d, 300, watch)}


def contact_forces(mj):
    m, d = scene(mj, "<body pos='0 0 .1'><freejoint/><geom type='box' size='.1 .1 .1' mass='.5'/></body>")
    d.qvel[0], d.qvel[4] = 0.5, 3
    force = np.zeros(6)

    def watch():
        total, friction = 0.0, np.zeros(2)
        for i, contact in enumerate(d.contact):
            mj.mj_contactForce(m, d, i, force)
            total += force[0]
            friction += (contact.frame.reshape(3, 3).T @ [0, force[1], force[2]])[:2]
        return [d.ncon, total, m.body_mass.sum() * 9.81], friction, d.qacc, d.efc_force.sum()

    return {"rocks": run(mj, m, d, 250, watch)}


def friction(mj):
    m, d = scene(
        mj,
        """<body name="rough" pos="-.3 0 .05"><freejoint/><geom type="box" size=".05 .05 .05" friction=".33"/></body>
           <body name="smooth" pos=".3 0 .05"><freejoint/>
             <geom type="box" size=".05 .05 .05" priority="1" friction=".1"/></body>""",
        'gravity="0 2.3 -9.5"',
    )
    m.geom("floor").friction[0] = 0.2
    return {"slide": run(mj, m, d, 300, lambda: (d.body("rough").xpos, d.body("smooth").xpos, d.qvel))}


def bat(mj):
    m, d = scene(
        mj,
        """<site name="hook" pos="0 0 1.2"/><geom name="pole" type="cylinder" fromto=".3 0 0 .3 0 .5" size=".02"/>
           <body name="bat" pos=".3 0 .56"><joint name="swing" damping=".1" axis="0 0 1"/>
             <geom type="capsule" size=".04" fromto="0 .05 0 0 .3 0"/></body>
           <body name="target" pos="0 .3 .55"><freejoint/><site name="in" pos="0 0 .05"/>
             <geom type="ellipsoid" size=".06 .05 .05" mass=".4"/></body>""",
        "",
        """<tendon><spatial name="string" limited="true" range="0 .7" width=".005">
             <site site="hook"/><site site="in"/></spatial></tendon>
           <actuator><motor name="arm" joint="swing" gear="1"/></actuator>
           <sensor><accelerometer name="shock" site="in"/><tendonpos tendon="string"/>
             <actuatorfrc actuator="arm"/></sensor>""",
    )
    d.ctrl[:] = 3

    def watch():
        return d.qpos, d.sensor("shock").data, d.tendon("string").length, d.actuator("arm").force, d.sensordata

    strikes = run(mj, m, d, 200, watch)
    return {"strikes": strikes, "moments": [m.nJmom, *d.moment_rownnz, *d.moment_colind, *d.actuator_moment]}


def camera_matrix(mj):
    m, d = scene(mj, "<body pos='0 0 .3' euler='0 20 30'><geom name='box' type='box' size='.1 .2 .15'/></body>")
    mj.mj_forward(m, d)
    with mj.Renderer(m, 48, 64) as renderer:
        renderer.update_scene(d, "side")
        eyes = renderer.scene.camera
        pos = np.mean([eye.pos for eye in eyes], axis=0)
        ahead, up = (np.mean([getattr(eye, name) for eye in eyes], axis=0) for name in ("forward", "up"))
    turn = np.array([np.cross(ahead, up), up, -ahead])
    focal = 0.5 * 48 / np.tan(np.radians(m.cam("side").fovy[0]) / 2)
    image = np.array([[-focal, 0, 31.5], [0, focal, 23.5], [0, 0, 1]])
    matrix = image @ np.hstack([turn, -turn @ pos[:, None]])
    corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T * m.geom("box").size
    places = d.geom("box").xpos + corners @ d.geom("box").xmat.reshape(3, 3).T
    seen = np.column_stack([places, np.ones(8)]) @ matrix.T
    # The eyes are of single precision.
    return {"matrix": matrix.astype(np.float32), "pixels": (seen[:, :2] / seen[:, 2:]).round(2)}


def depths_and_segments(mj):
    m, d = scene(mj, BALL)
    mj.mj_forward(m, d)
    with mj.Renderer(m, 30, 40) as renderer:
        renderer.update_scene(d, "side")
        renderer.enable_depth_rendering()
        depth = renderer.render()
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        ids = renderer.render()[..., 0]
    # MuJoCo's ball is a polyhedron, and its depths are of single precision.
    return {
        "a corner": (depth[-1, 0] * 1e3).round()[None],
        "ball": [ids[15, 20], ids.min(), round((ids == 1).sum() / 20)],
    }


def geoms_of(s):
    """The last geoms of a scene: kinds, sizes, places, colours."""
    list = [s.geoms[i] for i in range(s.ngeom)]
    return [
        np.array([np.asarray(getattr(g, name), dtype=np.float32).ravel() for g in list])
        for name in ("type", "objtype", "objid", "category", "size", "pos", "mat", "rgba")
    ]


def trace(mj):
    m, d = scene(mj, BALL)
    d.joint("fly").qvel[:3] = 1, 0, 2
    s, places = mj.MjvScene(m, 50), []
    for _ in range(20):
        mj.mj_step(m, d, 5)
        places.append(d.geom("red").xpos.copy())
    for start, end in zip(places[:-1], places[1:]):
        geom = s.geoms[s.ngeom]
        s.ngeom += 1
        mj.mjv_initGeom(
            geom, mj.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.zeros(9), np.float32([0.2, 0.4, 0.6, 1])
        )
        mj.mjv_connector(geom, mj.mjtGeom.mjGEOM_CAPSULE, 0.01, start, end)
    places = geoms_of(s)
    return {"capsules": np.hstack([places[i] for i in (0, 4, 5, 6, 7)])}


def several_frames(mj):
    m, d = scene(mj, BALL + "<body pos='1 0 .2'><freejoint/><geom type='box' size='.1 .2 .1' group='2'/></body>")
    option, nobody, s = mj.MjvOption(), mj.MjvPerturb(), mj.MjvScene(m, 50)
    for _ in range(3):
        mj.mj_step(m, d, 50)
        mj.mjv_addGeoms(m, d, option, nobody, mj.mjtCatBit.mjCAT_DYNAMIC.value, s)
    option.geomgroup[2] = 0
    mj.mjv_addGeoms(m, d, option, nobody, mj.mjtCatBit.mjCAT_ALL.value, s)
    return {"geoms": np.hstack(geoms_of(s)), "how many": [s.ngeom]}


def dominos(mj):
    boxes = "".join(
        f"<body pos='{0.1 * i} 0 .1'><freejoint/><geom type='box' size='.01 .05 .1' condim='3'/></body>"
        for i in range(4)
    )
    m, d = scene(mj, boxes)
    d.qvel[4] = 2
    camera = mj.MjvCamera()
    mj.mjv_defaultFreeCamera(m, camera)
    option = mj.MjvOption()
    eyes = []
    with mj.Renderer(m, 30, 40) as renderer:
        falls = []
        for i in range(6):
            falls.append(run(mj, m, d, 20, lambda: (d.qpos,)))
            camera.lookat, camera.distance, camera.azimuth, camera.elevation = d.body(1).xpos, 1 + i, 90 + 10 * i, -20
            renderer.update_scene(d, camera, option)
            eyes.append([*renderer.scene.camera[0].pos, *renderer.scene.camera[1].forward])
    return {"falls": np.concatenate(falls), "eyes": np.float32(eyes)}


FEATURES = [
    names, pictures, time_and_gravity, tippe_top, chaos, timesteps, divergence, contacts, contact_forces, friction, bat,
    camera_matrix, depths_and_segments, trace, several_frames, dominos,
]  # fmt: skip


# Where MuJoCo needs OpenGL, in a process of its own: it says when it is imported which.
DRAWN = [pictures, camera_matrix, depths_and_segments, dominos]


def of_mujoco(feature, out):
    if feature not in DRAWN:
        return feature(mujoco)
    command = [sys.executable, __file__, feature.__name__, str(out)]
    done = subprocess.run(command, env={**os.environ, "MUJOCO_GL": "egl"}, capture_output=True, text=True, timeout=120)
    if done.returncode:
        pytest.skip(f"MuJoCo cannot draw here: {done.stderr.strip().splitlines()[-1]}")
    return dict(np.load(out))


@pytest.mark.parametrize("feature", FEATURES, ids=lambda feature: feature.__name__)
def test_a_cell_of_the_tutorial_gives_mujocos_numbers(feature, tmp_path):
    ours, theirs = feature(penny), of_mujoco(feature, tmp_path / "numbers.npz")
    assert list(ours) == list(theirs)
    for name, expected in theirs.items():
        single = np.asarray(expected).dtype == np.float32
        assert close(ours[name], expected, 1e-6 if single else 1e-9), name


if __name__ == "__main__":
    np.savez(sys.argv[2], **globals()[sys.argv[1]](mujoco))
