"""What MuJoCo's compiler makes of the models and of generated scenes: poses, masses, inertia, contact parameters."""

import pathlib

import mujoco
import numpy as np

MODELS = pathlib.Path(__file__).parents[3] / "models"
SHAPES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
EULER = ["xyz", "XYZ", "zyx", "ZxY", "yXz", "zxz"]


def text(values):
    return " ".join(repr(float(v)) for v in np.atleast_1d(values))


class Writer:
    """Random pieces of MJCF; every angle is written in the unit that the scene's compiler element names."""

    def __init__(self, seed, degree=True):
        self.rng = np.random.default_rng(seed)
        self.unit = 180 / np.pi if degree else 1.0
        self.names = 0

    def vector(self, scale=1.0, n=3):
        return self.rng.uniform(-scale, scale, n)

    def angle(self, scale=np.pi):
        return self.rng.uniform(-scale, scale) * self.unit

    def orientation(self, form=None):
        form = form or self.rng.choice(["quat", "axisangle", "xyaxes", "zaxis", "euler"])
        values = {
            "quat": lambda: self.vector(n=4),
            "axisangle": lambda: [*self.vector(), self.angle()],
            "xyaxes": lambda: self.vector(n=6),
            "zaxis": lambda: self.vector(),
            "euler": lambda: [self.angle(), self.angle(), self.angle()],
        }[form]()
        return f'{form}="{text(values)}"'

    def pose(self, form=None):
        return f'pos="{text(self.vector(0.5))}" {self.orientation(form)}'

    def size(self, shape):
        return f'size="{text(self.rng.uniform(0.02, 0.3, SHAPES[shape]))}"'

    def geom(self, shape=None, extra="", pose=None):
        shape = shape or self.rng.choice(list(SHAPES))
        pose = self.pose() if pose is None else pose
        return f'<geom type="{shape}" {self.size(shape)} {pose} {extra}/>'

    def weight(self):
        if self.rng.random() < 0.5:
            return f'mass="{text(self.rng.uniform(0.1, 3))}"'
        return f'density="{text(self.rng.uniform(100, 3000))}"'

    def joint(self, kind):
        low, high = np.sort(self.rng.uniform(-1, 1, 2)) * (self.unit if kind == "hinge" else 1)
        extra = f'pos="{text(self.vector(0.3))}"'
        if kind in ("hinge", "slide"):
            ref = self.angle() if kind == "hinge" else self.rng.uniform(-1, 1)
            extra += f' axis="{text(self.vector())}" ref="{text(ref)}" springref="{text(ref / 2)}"'
            if self.rng.random() < 0.5:
                extra += f' range="{text([low, high])}"'
        elif self.rng.random() < 0.5:
            extra += f' range="0 {text(abs(self.angle(1)))}"'
        if self.rng.random() < 0.3:
            extra += f' armature="{text(self.rng.uniform(0, 0.2))}"'
        return f'<joint type="{kind}" {extra}/>'

    def tree(self, depth, first=None):
        """A body of random joints, geoms, static and moving children, some inside frames."""
        choices = [["hinge"], ["slide"], ["ball"], ["hinge", "hinge"], ["slide", "hinge"], ["slide", "slide", "ball"]]
        kinds = first or choices[self.rng.integers(len(choices))]
        joints = "".join("<freejoint/>" if k == "free" else self.joint(k) for k in kinds)
        inner = joints + self.geom(extra=self.weight())
        if self.rng.random() < 0.4:
            inner = f"<frame {self.pose()}>{inner}</frame>" if kinds != ["free"] else inner
        if self.rng.random() < 0.5:
            inner += f"<body {self.pose()}>{self.geom(extra=self.weight())}</body>"
        if depth > 0:
            child = self.tree(depth - 1)
            inner += f"<frame {self.pose()}>{child}</frame>" if self.rng.random() < 0.5 else child
        return f"<body {self.pose()}>{inner}</body>"


NO_CONTACTS = '<option><flag contact="disable"/></option>'


def scene(world, compiler="", rest="", option=NO_CONTACTS, end=""):
    return f"<mujoco><compiler {compiler}/>{option}{rest}<worldbody>{world}</worldbody>{end}</mujoco>"


def touching(world, end="", option=""):
    return scene(world, option=option, end=end)


def free(inner, attributes=""):
    return f"<body {attributes}><freejoint/>{inner}</body>"


def shapes():
    for number, shape in enumerate(SHAPES):
        for shell in ("false", "true"):
            w = Writer(100 + number)
            bodies = [free(w.geom(shape, f'shellinertia="{shell}" {w.weight()}')) for _ in range(4)]
            yield f"{shape}, shell {shell}", scene("".join(bodies))
    w = Writer(110)
    long = free('<geom type="capsule" size="0.01 3"/>') + free('<geom type="cylinder" size="0.5 0.001"/>')
    yield "slender and flat", scene(long + free('<geom type="box" size="1 0.1 0.001" shellinertia="true"/>'))


def orientations():
    forms = [(f, "xyz") for f in ("quat", "axisangle", "xyaxes", "zaxis", "euler")] + [("euler", s) for s in EULER]
    for number, (form, sequence) in enumerate(forms):
        for degree in (True, False):
            w = Writer(200 + number, degree)
            inertial = f'<inertial {w.pose(form)} mass="2" diaginertia="1 2 2.5"/>'
            bodies = free(w.geom(pose=w.pose(form)), w.pose(form)) + free(inertial, w.pose(form))
            bodies += f'<frame {w.pose(form)}><frame {w.pose(form)}>{free(w.geom(), w.pose(form))}</frame></frame>'
            compiler = f'angle="{"degree" if degree else "radian"}" eulerseq="{sequence}"'
            yield f"orientation {form} {sequence} degree {degree}", scene(bodies, compiler)
    turned = "".join(free(f'<geom type="capsule" size="0.1 0.2" zaxis="{z}"/>') for z in ("0 0 -1", "0 0 2", "1e-12 0 -1"))
    yield "zaxis along Z", scene(turned)


def fromto():
    for number, shape in enumerate(["capsule", "cylinder", "box", "ellipsoid"]):
        w = Writer(300 + number)
        ends = [w.vector(n=6), [0, 0, 0, 0, 0, 1], [0, 0, 1, 0, 0, 0], [0.1, 0, 0, -0.3, 0, 0]]
        bodies = [free(f'<geom type="{shape}" size="0.05" fromto="{text(e)}"/>', w.pose()) for e in ends]
        bodies.append(free(f'<frame {w.pose()}><geom type="{shape}" size="0.05" fromto="{text(ends[0])}"/></frame>'))
        yield f"fromto {shape}", scene("".join(bodies))


def inertials():
    full = '<inertial pos="0.1 0.2 -0.1" mass="1.5" fullinertia="1 1.2 1.4 0.1 -0.2 0.05"/>'
    ball = '<geom size="0.1" pos="0.3 0 0"/><geom type="box" size="0.1 0.2 0.05" euler="10 20 30" group="2"/>'
    given = '<inertial pos="0 0.1 0" mass="1" diaginertia="0.3 0.5 0.4"/>'
    thin = '<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.2 0.5"/>'
    yield "fullinertia", scene(free(full) + free(f'<frame pos="1 2 3" euler="10 -20 40">{full}</frame>'))
    yield "inertial beats geoms", scene(free(given + ball))
    yield "inertiafromgeom", scene(free(given + ball) + free(given), 'inertiafromgeom="true"')
    yield "inertiafromgeom false", scene(free(given + ball), 'inertiafromgeom="false"')
    yield "inertiagrouprange", scene(free(ball), 'inertiagrouprange="1 3"')
    yield "groups above 5 are weightless", scene(free(ball + '<geom size="0.2" pos="0 1 0" group="6"/>'))
    yield "bounds", scene(free(ball) + free(given), 'boundmass="10" boundinertia="0.35"')
    yield "balanceinertia", scene(free(thin), 'balanceinertia="true"')
    yield "settotalmass", scene(free(ball) + free(given) + f"<body>{given}</body>" + ball, 'settotalmass="7"')
    visual = '<geom type="capsule" size="0.1 0.4" contype="0" conaffinity="0"/><geom size="0.3" mass="0" pos="1 0 0"/>'
    yield "visual geoms have weight, massless ones have none", scene(free(ball + visual))


def compounds():
    for number in range(8):
        w = Writer(400 + number, number % 2 == 0)
        geoms = lambda n: "".join(w.geom(extra=w.weight()) for _ in range(n))
        shell = 'shellinertia="true"'
        bodies = free(geoms(2), w.pose()) + free(geoms(3) + w.geom("box", shell) + w.geom("cylinder", shell), w.pose())
        # Bodies welded to a free one, one of them without mass.
        inner = f"<body {w.pose()}>{geoms(1)}</body>"
        bodies += free(geoms(1) + f"<body {w.pose()}><body {w.pose()}>{geoms(2)}</body></body>{inner}", w.pose())
        yield f"compound {number}", scene(bodies, f'angle="{"degree" if number % 2 == 0 else "radian"}"')
    tee = '<geom type="box" size="0.1 0.05 0.3"/><geom type="box" size="0.4 0.05 0.1" pos="0 0 0.4"/>'
    yield "tee", scene(free(tee, 'pos="0 0 1"'))


def joints():
    planar = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>'
    box = '<geom type="box" size="0.2 0.1 0.3"/>'
    def slides(geom, axis="1 0 0", child="", joint="", body=""):
        return f'<body {body}><joint type="slide" axis="{axis}" armature="0.5" {joint}/>{geom}{child}</body>'

    # MuJoCo treats a lone body that slides along its principal axes in its own way, and only that.
    small = '<geom size="0.1"/>'
    variants = [slides(box), slides(box, "0 -2 0", body='euler="10 20 30"'), slides(box, "1 1 0"), slides(box, joint='pos="1 0 0"')]
    variants += [slides('<geom type="box" size="0.2 0.1 0.3" pos="1 0 0"/>'), slides('<geom type="box" size="0.2 0.1 0.3" euler="9 0 0"/>')]
    variants += [slides(box, child=f"<body>{small}</body>"), slides(box, child=slides(small)), f"<body>{small}{slides(box)}</body>"]
    two = lambda a, b: f'<geom type="box" size="{a}" pos="0.5 0 0"/><geom type="box" size="{b}" pos="-0.5 0 0"/>'
    variants += [slides(two("0.1 0.2 0.3", "0.1 0.2 0.3")), slides(two("0.1 0.2 0.2", "0.1 0.2 0.2")), slides(box + small)]
    stacked = '<geom size="0.1" pos="0 0 {0}"/><geom size="0.1" pos="0 0 -{0}"/><geom type="box" size="{1} 0.1 0.1"/>'
    variants += [slides(stacked.format(0.5, 0.3)), slides(stacked.format(0.5, 0.1))]
    yield "slides, simple or not", scene("".join(variants))
    sliders = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
    yield "planar body", scene(f'<body pos="0 0 1">{planar}{box}</body><body>{planar}{box}<geom size="0.1" pos="1 0 0"/></body>')
    yield "slides only", scene(f"<body>{sliders}{box}</body><body><joint type='slide' axis='1 1 0'/>{box}</body>")
    yield "hinge through the centre", scene(f'<body><joint axis="0 1 0"/>{box}</body>')
    yield "armature on a free joint", scene(f'<body pos="1 2 3"><joint type="free" armature="0.5" damping="1"/>{box}</body>')
    yield "far from the origin", scene(f'<body pos="1e4 -2e4 3e4" euler="10 20 30">{planar}{box}</body>')
    for number in range(16):
        w = Writer(500 + number, number % 2 == 0)
        first = [["free"], None, ["ball"], None][number % 4]
        world = w.tree(1 + number % 4, first) + f"<body {w.pose()}>{w.geom()}{w.tree(1)}</body>"
        yield f"tree {number}", scene(world, f'angle="{"degree" if number % 2 == 0 else "radian"}"')


def classes():
    defaults = """<default><geom density="500" rgba="1 0 0 1"/><joint armature="0.1" range="-30 30"/>
      <default class="a"><geom type="capsule" size="0.05 0.2" friction="0.3"/><joint axis="0 1 0" ref="20"/>
        <default class="b"><geom type="box" size="0.1 0.1 0.2" margin="0.01"/><joint type="slide" axis="1 0 0"/></default>
      </default></default>"""
    inner = '<joint/><geom/><geom class="b" pos="0.3 0 0"/>'
    world = f'<body childclass="a">{inner}<body pos="0 0 1">{inner}</body><body childclass="b"><joint/><geom/>'
    world += '<geom class="main" type="sphere" size="0.1"/></body></body>'
    yield "classes", scene(world, rest=defaults)
    framed = f'<frame childclass="a" pos="1 0 0"><body>{inner}</body><frame childclass="b"><body><joint/><geom/></body></frame></frame>'
    yield "classes of frames", scene(framed, rest=defaults)
    yield "free joint and default armature", scene(free('<geom class="b"/>') + f'<body pos="2 0 0"><joint class="a" type="free"/><geom class="a"/></body>', rest=defaults)


def contact_parameters(w):
    r = w.rng
    out = f'friction="{text(r.uniform(0, 1, r.integers(1, 4)))}" condim="{r.choice([1, 3, 4, 6])}"'
    out += f' margin="{text(r.uniform(0, 0.1))}" gap="{text(r.uniform(0, 0.1))}" solmix="{text(r.uniform(0, 2))}"'
    out += f' priority="{r.integers(0, 2)}" solimp="{text(r.uniform(0.5, 0.95, 2))} 0.01 0.4 3"'
    direct = r.random() < 0.3
    solref = [-r.uniform(100, 1000), -r.uniform(1, 20)] if direct else [r.uniform(0.01, 0.1), r.uniform(0.3, 2)]
    return out + f' solref="{text(solref)}"'


def crowd(w, bodies, geoms=1, names=True, parameters=contact_parameters):
    """Balls that all overlap, on a plane that they all sink into: every pair that may touch does."""
    world = f'<geom name="floor" type="plane" size="1 1 1" {parameters(w)}/><geom name="rock" size="0.5" {parameters(w)}/>'
    for b in range(bodies):
        inner = "".join(
            f'<geom name="g{b}{g}" size="{text(w.rng.uniform(0.3, 0.5))}" pos="{text(w.vector(0.05))}" {parameters(w)}/>'
            for g in range(geoms)
        )
        world += f'<body name="b{b}" pos="{text(w.vector(0.05))}"><freejoint/>{inner}</body>'
    return world


def contacts():
    for number in range(8):
        w = Writer(600 + number)
        yield f"mixed parameters {number}", touching(crowd(w, 4, 1 + number % 3))
    w = Writer(620)
    masks = lambda w: f'contype="{w.rng.integers(0, 4)}" conaffinity="{w.rng.integers(0, 4)}"'
    for number in range(3):
        w = Writer(620 + number)
        yield f"bit masks {number}", touching(crowd(w, 6, 2, parameters=masks))
    w = Writer(630)
    listed = """<contact><exclude body1="b2" body2="b0"/><exclude body1="world" body2="b1"/>
      <pair geom1="g21" geom2="g10"/><pair geom1="g00" geom2="floor" condim="6" friction="0.5 0.6 0.01 0 0.002"/>
      <pair geom1="floor" geom2="g10" margin="0.1" gap="0.05" solref="0.05 0.7" solimp="0.7 0.8 0.01 0.3 4"/>
      <pair geom1="g00" geom2="g11" condim="4" solreffriction="0.03 0.5"/>
      <pair geom1="g21" geom2="g11" condim="1" solref="-300 -20"/></contact>"""
    yield "pairs and excludes", touching(crowd(w, 3, 2), listed)
    override = """<option o_margin="0.05" o_solref="0.03 0.5" o_solimp="0.8 0.9 0.01 0.4 3" o_friction="0 2 3 4 5">
      <flag override="enable"/></option>"""
    pair = '<contact><pair geom1="g00" geom2="floor" condim="6" solreffriction="0.03 0.5"/></contact>'
    yield "override", touching(crowd(Writer(631), 2), pair, override)
    family = """<body name="a"><joint/><geom size="0.3"/>
      <body><geom size="0.3" pos="0.1 0 0"/><body><joint axis="1 0 0"/><geom size="0.3" pos="0 0.1 0"/>
      <body><joint axis="0 1 0"/><geom size="0.3"/><body><geom size="0.25"/></body></body>
      <body><joint axis="0 0 1" pos="1 0 0"/><geom size="0.3" pos="0.05 0 0"/></body></body></body></body>"""
    statics = '<geom type="plane" size="1 1 1"/><body><geom size="0.4"/><body><joint/><geom size="0.2" pos="0 0.1 0"/></body></body>'
    yield "families", touching(statics + family)
    yield "families without filterparent", touching(statics + family, option='<option><flag filterparent="disable"/></option>')
    yield "contacts disabled", scene(statics + family)
    kinds = "".join(
        free(f'<geom type="{kind}" size="{size}" condim="4" contype="{con}" conaffinity="{aff}"/>', 'pos="0 0 0.1"')
        for kind, size, con, aff in [
            ("box", "0.3 0.2 0.25", 1, 1),
            ("sphere", "0.3", 1, 1),
            ("capsule", "0.3 0.2", 0, 2),
            ("sphere", "0.25", 1, 1),
            ("ellipsoid", "0.3 0.2 0.25", 0, 2),
            ("cylinder", "0.3 0.2", 0, 2),
        ]
    )
    yield "order of kinds", touching(kinds + '<geom type="plane" size="9 9 1" contype="3" conaffinity="3"/>')


def keyframes():
    keys = """<keyframe><key name="up" time="2" qpos="1 2 3 2 0 0 2 0.5 3 4 0 0" qvel="1 2 3 4 5 6 7 8 9 10" ctrl="0.3"/>
      <key qvel="0 0 0 0 0 0 1 0 0 0"/><key qpos="0 0 0 0 0 0 0 0 0 0 0 0"/></keyframe>"""
    world = free('<geom size="0.1"/>', 'pos="1 2 3"') + '<body><joint name="h" ref="30"/><geom size="0.1" pos="1 0 0"/>'
    world += '<body pos="1 0 0"><joint type="ball"/><geom size="0.2"/></body></body>'
    motor = '<actuator><motor joint="h"/></actuator>'
    yield "keyframes", scene(world, end=motor + keys)


def tensor(m, b):
    r = np.zeros(9)
    mujoco.mju_quat2Mat(r, m.body_iquat[b])
    r = r.reshape(3, 3)
    return (r @ np.diag(m.body_inertia[b]) @ r.T).ravel().tolist()


def compiled(m):
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    inertia = np.zeros((m.nv, m.nv))
    mujoco.mj_fullM(m, d, inertia)
    trees = [np.flatnonzero(m.dof_treeid == t) for t in range(m.ntree)]
    limited = lambda j: m.jnt_range[j].tolist() if m.jnt_limited[j] else None
    return {
        "bodies": [
            {
                "parent": int(m.body_parentid[b]),
                "weld": int(m.body_weldid[b]),
                "pose": [*m.body_pos[b].tolist(), *m.body_quat[b].tolist()],
                "mass": float(m.body_mass[b]),
                "com": m.body_ipos[b].tolist(),
                "tensor": tensor(m, b),
                "invweight0": m.body_invweight0[b].tolist(),
            }
            for b in range(m.nbody)
        ],
        "joints": [
            {
                "kind": int(m.jnt_type[j]),
                "place": [*m.jnt_pos[j].tolist(), *m.jnt_axis[j].tolist()],
                "range": limited(j),
                "stiffness": float(np.ravel(m.jnt_stiffness[j])[0]),
                "springref": float(m.qpos_spring[m.jnt_qposadr[j]]) if m.jnt_type[j] > 1 else 0.0,
            }
            for j in range(m.njnt)
        ],
        "geoms": [
            {
                "kind": int(m.geom_type[g]),
                "pose": [*m.geom_pos[g].tolist(), *m.geom_quat[g].tolist()],
                "size": m.geom_size[g].tolist(),
                "rbound": float(m.geom_rbound[g]),
            }
            for g in range(m.ngeom)
        ],
        "condition": max([1.0] + [float(np.linalg.cond(inertia[np.ix_(t, t)])) for t in trees]),
        "dof_invweight0": m.dof_invweight0.tolist(),
        "qpos0": m.qpos0.tolist(),
        "keys": [[*m.key_qpos[k].tolist(), *m.key_qvel[k].tolist(), *m.key_ctrl[k].tolist()] for k in range(m.nkey)],
        "contacts": [
            {
                "geom": c.geom.tolist(),
                "condim": int(c.dim),
                "friction": c.friction.tolist(),
                "solref": c.solref.tolist(),
                "solreffriction": (c.solreffriction if np.any(c.solreffriction) else c.solref).tolist(),
                "solimp": c.solimp.tolist(),
                "margin": float(c.includemargin),
            }
            for c in d.contact
        ],
    }


def generate():
    parts = [shapes, orientations, fromto, inertials, compounds, joints, classes, contacts, keyframes]
    scenes = [(name, xml) for part in parts for name, xml in part()]
    out = [{"name": n, "xml": x, **compiled(mujoco.MjModel.from_xml_string(x))} for n, x in scenes]
    for path in sorted(MODELS.glob("*.xml")):
        out.append({"name": f"models/{path.name}", "xml": path.read_text(), **compiled(mujoco.MjModel.from_xml_path(str(path)))})
    return {"scenes": out}
