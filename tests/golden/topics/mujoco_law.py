"""What MuJoCo's own contact model does: constraint rows and accelerations at single states, and whole runs.

Every scene runs with tolerance 0 and 100 iterations, so that MuJoCo's answer is the minimum and not a place near it.
"""

import mujoco
import numpy as np

GROUND = '<geom name="ground" type="plane" size="10 10 .1"/>'


def scene(body, option="", default="", more="", ground=GROUND):
    return (
        f'<mujoco><option tolerance="0" iterations="100" {option}/><default>{default}</default>'
        f"<worldbody>{ground}{body}</worldbody>{more}</mujoco>"
    )


def free(geom, pos="0 0 1", extra="", **_):
    return f'<body pos="{pos}" {extra}><freejoint/>{geom}</body>'


def geom(kind, size, **attributes):
    rest = " ".join(f'{k}="{v}"' for k, v in attributes.items())
    return f'<geom type="{kind}" size="{size}" {rest}/>'


DISK = """<mujoco><compiler angle="radian"/><option timestep="0.001" tolerance="0" iterations="100" cone="{cone}"><flag warmstart="disable"/></option>
<default><geom friction="0 0 0.01" condim="6" solimp="0.99 0.995 0.001" solref="0.01 1.0"/></default>
<worldbody><geom name="ground" type="plane" size="10 10 0.1"/><body name="disk" pos="0 0 {z}"><inertial pos="0 0 0" mass="1" diaginertia="0.010033 0.02 0.010033"/>
<geom type="cylinder" size="0.2 0.01" euler="1.5708 0 0"/><geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.01" density="0" contype="0" conaffinity="0"/><freejoint/></body></worldbody></mujoco>"""

SPIN = [0.7, 0.2, 0, 4, -2, 3]
TILTED = 'euler="20 35 10"'
T_SHAPE = geom("box", ".2 .05 .05", pos="0 0 .2") + geom("box", ".05 .05 .15")
TWO_LINKS = """<body pos="0 0 .62"><joint name="a" type="hinge" axis="0 1 0" damping=".02" {joint}/>{link}
<body pos=".3 0 0"><joint name="b" type="hinge" axis="0 1 0" armature=".001" {joint}/>{link}</body></body>"""
LINK = '<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" density="800"/>'


def pile(n):
    rng = np.random.default_rng(3)
    spots = [(*rng.uniform(-0.06, 0.06, 2), 0.12 + 0.21 * i) for i in range(n)]
    return "".join(free(geom("sphere", ".1", friction=".6 .01 .001", condim=6 if i % 2 else 3), f"{x:.4f} {y:.4f} {z:.4f}") for i, (x, y, z) in enumerate(spots))


def stack(n):
    return "".join(free(geom("box", f"{.1 - .002 * i:.3f} .1 .05"), f"{.002 * (i % 3)} 0 {.051 + .101 * i:.3f}") for i in range(n))


def pair_of(first, second, height=0.35):
    return free(first, "0 0 .12", 'euler="5 8 0"') + free(second, f".02 .015 {height}", 'euler="25 40 15"')


def both(name, seconds, xml_of, **more):
    return [dict(name=f"{name} {cone}", seconds=seconds, xml=xml_of(f'cone="{cone}"'), **more) for cone in ("pyramidal", "elliptic")]


def scenes():
    out = []
    slick = GROUND.replace("/>", ' condim="1" friction=".05 .001 .0001"/>')  # else its condim 3 and friction 1 win
    for dim in (1, 3, 4, 6):
        ball = free(geom("sphere", ".1", condim=dim, friction=".4 .02 .01"), "0 0 .15")
        out += both(f"sphere condim {dim}", 2, lambda o: scene(ball, o, ground=slick), qvel=SPIN, rows=4)
    out += both("box dropped tilted", 3, lambda o: scene(free(geom("box", ".1 .15 .05"), ".1 0 .4", TILTED), o), qvel=SPIN, rows=6)
    out += both("T-shape", 3, lambda o: scene(free(T_SHAPE, "0 0 .5", TILTED), o), qvel=[0, 0, 0, 1, 0, 0], rows=4)
    # A coin that settles on its face is chaos for a while: MuJoCo, kicked by 1e-16, is 1e-7 away from itself.
    out += both("coin wobbling", 0.4, lambda o: scene(free(geom("cylinder", ".12 .01", condim=4), "0 0 .3", TILTED), o), qvel=[1, 0, 0, 0, 0, 9], rows=2)
    out += both("coin sliding", 3, lambda o: scene(free(geom("cylinder", ".12 .02", condim=4), "0 0 .3", TILTED), o), qvel=[1, 0, 0, 0, 0, 0], rows=2, until=.4)
    out += both("coin rolling", 3, lambda o: scene(free(geom("cylinder", ".12 .02", condim=6, friction=".8 .01 .002"), "0 0 .13", 'euler="80 0 0"'), o), qvel=[1, 0, 0, 0, 0, -8], rows=2)
    out += both("capsule", 3, lambda o: scene(free(geom("capsule", ".05 .1", condim=6, friction=".5 .01 .005"), "0 0 .3", TILTED), o), rows=3)
    out += both("ellipsoid", 3, lambda o: scene(free(geom("ellipsoid", ".1 .07 .05"), "0 0 .3", TILTED), o), rows=2)
    out += both("ten spheres", 2, lambda o: scene(pile(10), o))
    out += both("stack of ten boxes", 2, lambda o: scene(stack(10), o))
    shapes = {
        "sphere": geom("sphere", ".1"), "capsule": geom("capsule", ".07 .1"), "box": geom("box", ".12 .1 .09"), "cylinder": geom("cylinder", ".1 .08"),
    }
    for a, b in [("sphere", "sphere"), ("sphere", "capsule"), ("sphere", "cylinder"), ("sphere", "box"), ("capsule", "capsule"), ("box", "capsule"), ("box", "box")]:
        out.append(dict(name=f"{b} on {a}", seconds=1, xml=scene(pair_of(shapes[b], shapes[a])), rows=2, until=.1 if b == "cylinder" else 1))
    out += [
        dict(name="disk pyramidal", seconds=3, xml=DISK.format(cone="pyramidal", z=1), rows=4, qvel=[2, 0, 0, 0, 10, 0], tolerance=1e-8),
        dict(name="disk elliptic", seconds=3, xml=DISK.format(cone="elliptic", z=1), rows=4, qvel=[2, 0, 0, 0, 10, 0]),
        dict(name="off-centre mass and welded child", seconds=2, xml=scene(
            f'<body pos="0 0 .4" euler="10 20 30"><freejoint/>{geom("box", ".1 .1 .1")}<body pos=".15 0 .1" euler="0 30 0">{geom("sphere", ".08")}</body></body>'), qvel=SPIN, rows=3),
        dict(name="mixed parameters", seconds=2, xml=scene(
            free(geom("sphere", ".1", solref="-3000 -60", solimp=".8 .9 .01", priority=1, margin=".02"), "0 0 .2")
            + free(geom("sphere", ".1", solref=".03 .5", solimp=".7 .99 .02 .3 3", solmix=2, friction=".2 .003 .001", condim=4), ".03 0 .45")
            + free(geom("box", ".1 .1 .1", solimp=".9 .9 .001", margin=".01", gap=".005"), ".02 .05 .75"),
            default='<geom solref=".015 .8" friction=".9 .01 .002"/>'), rows=4),
        dict(name="incline", seconds=2, xml=scene(free(geom("box", ".1 .1 .05", friction=".3"), "0 0 .07", 'euler="0 25 0"'),
            ground='<geom type="plane" size="9 9 1" euler="0 25 0" friction=".2"/>'), rows=2),
        dict(name="impratio 10 elliptic", seconds=1, xml=scene(free(geom("box", ".1 .15 .05"), ".1 0 .3", TILTED), 'cone="elliptic" impratio="10"'), qvel=SPIN, rows=3),
        dict(name="impratio 10 pyramidal", seconds=1, xml=scene(free(geom("box", ".1 .15 .05"), ".1 0 .3", TILTED), 'impratio="10"'), qvel=SPIN, rows=3),
        *both("exact diagonal", 1, lambda o: scene(free(geom("box", ".1 .15 .05"), ".1 0 .3", TILTED), o).replace("iterations=\"100\" " + o + "/>", f'iterations="100" {o}><flag diagexact="enable"/></option>'), qvel=SPIN, rows=3),
        *both("pair with its own friction reference", 1, lambda o: scene(free(geom("box", ".1 .15 .05", name="b"), ".1 0 .2"), o,
            more='<contact><pair geom1="ground" geom2="b" condim="4" friction=".5 .3 .01 .001 .001" solref=".03 1" solreffriction=".01 .7" margin=".01"/></contact>'), qvel=SPIN, rows=3),
        dict(name="joint limits", seconds=2, xml=scene(TWO_LINKS.format(link=LINK, joint='range="-40 50" margin=".05" solreflimit=".03 .7"'), ground=""), rows=4),
        dict(name="dry friction", seconds=2, xml=scene(TWO_LINKS.format(link=LINK, joint='frictionloss=".25" solreffriction=".03 1"'), ground=""), qvel=[3, -5], rows=4),
        dict(name="ball joint limit", seconds=2, xml=scene(
            '<body pos="0 0 1"><joint type="ball" range="0 40" damping=".01"/><geom type="capsule" fromto="0 0 0 .3 .05 .1" size=".03"/></body>', ground=""), qvel=[1, 2, 3], rows=3),
        *both("arm on the ground", 2, lambda o: scene(TWO_LINKS.format(link=LINK.replace("/>", ' condim="4"/>'), joint='range="-150 150"').replace(".62", ".2") + free(geom("sphere", ".08"), ".45 .01 .4"), o,
            default='<geom friction=".7 .01 .001"/>'), rows=4),
        dict(name="motor arm", seconds=2, ctrl=[0.8, -0.5], xml=scene(TWO_LINKS.format(link=LINK, joint='range="-60 70" frictionloss=".05"'), ground="",
            more='<actuator><motor joint="a" gear="3" ctrlrange="-1 1"/><motor joint="b" forcerange="-.4 .4"/></actuator>'), rows=3),
        dict(name="free joint with dry friction", seconds=1, xml=scene(
            f'<body pos="0 0 .3" euler="10 20 0"><joint type="free" frictionloss=".3"/>{T_SHAPE}</body>'), qvel=SPIN, rows=2),
    ]
    for integrator in ("RK4", "implicitfast"):
        out.append(dict(name=f"box {integrator}", seconds=2, xml=scene(free(geom("box", ".1 .15 .05"), ".1 0 .3", TILTED), f'integrator="{integrator}"'), qvel=SPIN))
        out.append(dict(name=f"arm {integrator}", seconds=1, xml=scene(TWO_LINKS.format(link=LINK, joint='range="-40 50" margin=".05"').replace(".62", ".2"), f'integrator="{integrator}"')))
    return out


def extremes():
    """Numbers at the edge of what a scene may hold: the same answers as long as MuJoCo converges."""
    ball = lambda **a: free(geom("sphere", ".1", **a), "0 0 .12")
    two = lambda light, heavy: free(geom("sphere", ".1", mass=light), "0 0 .101") + free(geom("sphere", ".1", mass=heavy), "0 0 .302")
    off = lambda xml: xml.replace("/><default>", '><flag refsafe="disable"/></option><default>', 1)
    return [
        *[dict(name=f"timestep {h}", steps=n, xml=scene(ball(), f'timestep="{h}"'), qvel=SPIN) for h, n in [("1e-5", 2000), (".05", 100), (".2", 50), ("1", 20)]],
        *[dict(name=f"solref {tau}", steps=300, xml=scene(ball(solref=f"{tau} 1"))) for tau in (".0005", ".004")],
        dict(name="solref .003 without refsafe", steps=200, xml=off(scene(ball(solref=".003 1")))),
        dict(name="solref .0015 without refsafe", steps=20, xml=off(scene(ball(solref=".0015 1")))),
        *[dict(name=f"mass ratio {r:g}", steps=300, xml=scene(two(1, r), 'cone="elliptic"')) for r in (1e2, 1e4, 1e6)],
        *[dict(name=f"impratio {r:g}", steps=300, xml=scene(free(geom("box", ".1 .15 .05"), ".1 0 .12", TILTED), f'cone="elliptic" impratio="{r:g}"'), qvel=SPIN) for r in (1e-2, 1e4)],
        dict(name="solimp at its bounds", steps=300, xml=scene(ball(solimp="0 1 0 .5 1"))),
        dict(name="undamped direct reference", steps=200, xml=scene(ball(solref="-5000 0"))),
    ]


def load(case):
    m = mujoco.MjModel.from_xml_string(case["xml"])
    m.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    d = mujoco.MjData(m)
    if "qvel" in case:
        d.qvel[:] = case["qvel"]
    if "ctrl" in case:
        d.ctrl[:] = case["ctrl"]
    return m, d


def snapshot(m, d, rows):
    """Everything the constraint solver sees and says at the state of `d`."""
    mujoco.mj_forward(m, d)
    out = dict(qpos=d.qpos.tolist(), qvel=d.qvel.tolist(), qacc=d.qacc.tolist(), qfrc_constraint=d.qfrc_constraint.tolist(), nefc=int(d.nefc))
    force, forces = np.zeros(6), []
    for c in range(d.ncon):
        mujoco.mj_contactForce(m, d, c, force)
        forces.append(force.tolist())
    out["contact_force"] = forces
    if rows:
        out.update(efc_J=d.efc_J.tolist(), efc_R=d.efc_R.tolist(), efc_aref=d.efc_aref.tolist(), efc_force=d.efc_force.tolist())
    return out


def run(case):
    m, d = load(case)
    steps = case.get("steps") or round(case["seconds"] / m.opt.timestep)
    every = max(1, steps // 30)
    trace = []
    busy = []  # steps with constraint rows
    for i in range(1, steps + 1):
        mujoco.mj_step(m, d)
        if i % every == 0:
            trace.append(d.qpos.tolist())
        if d.nefc and d.time < case.get("until", np.inf):
            busy.append(i)
    assert abs(d.time - steps * m.opt.timestep) < 1e-6 * d.time, f"MuJoCo reset {case['name']}"
    wanted = case.get("rows", 0)
    states = []
    count = max(wanted, 20 if m.nv <= 12 else 3) if "seconds" in case else 0
    picks = sorted({busy[k] for k in np.linspace(0, len(busy) - 1, count).astype(int)}) if busy and count else []
    m, d = load(case)
    with_rows = set(picks[:: max(1, len(picks) // wanted)][:wanted]) if wanted else set()
    for i in range(1, steps + 1):
        if i in picks:
            save = d.qacc_warmstart.copy()
            states.append(snapshot(m, d, i in with_rows))
            d.qacc_warmstart[:] = save
        mujoco.mj_step(m, d)
    out = dict(name=case["name"], xml=case["xml"], qvel=case.get("qvel"), ctrl=case.get("ctrl"), every=every, steps=steps,
               tolerance=case.get("tolerance", 1e-10), qpos=trace, qvel_end=d.qvel.tolist(), states=states)
    return out


def generate():
    return dict(scenes=[run(c) for c in scenes()], extremes=[run(c) for c in extremes()])
