"""Closed forms beside MuJoCo: what the truth is, and what MuJoCo 4.0.0 makes of it.

A case is a scene whose `<custom><text name="penny.truth">` names the closed form, and whose keyframe 0 is the start.
Beside it: `seconds`, `exact` from the formulas below (a second implementation of those in the library), and `mujoco`,
the same quantity measured on MuJoCo's run at tolerance 0. `measured_ns` is the time of one of its steps, at its default
tolerance.
"""

import math
import time

import mujoco
import numpy as np

G = 9.81
DEGREE = math.pi / 180
GROUND = '<geom name="ground" type="plane" size="50 50 .1"/>'
# Impedance as constant and as close to 1 as MuJoCo lets it be: a pure spring-damper.
PURE = 'solimp=".9999 .9999 .001"'


def scene(truth, world, start, option="", default="", more="", timestep=0.002):
    default = f"<default><geom {default}/></default>" if default else ""
    return (
        f'<mujoco model="{truth}"><option timestep="{timestep}" {option}/>'
        f'<custom><text name="penny.truth" data="{truth}"/></custom>{default}<worldbody>{world}</worldbody>{more}'
        f"<keyframe><key {start}/></keyframe></mujoco>"
    )


def slope(degrees, g=G):
    """Gravity along a slope that runs down along x."""
    return f'gravity="{g * math.sin(degrees * DEGREE)!r} 0 {-g * math.cos(degrees * DEGREE)!r}"'


def free(z, vx=0.0, vz=0.0, wy=0.0, wz=0.0):
    return f'qpos="0 0 {z!r} 1 0 0 0" qvel="{vx!r} 0 {vz!r} 0 {wy!r} {wz!r}"'


def settled(xml, steps):
    """Where a scene comes to rest."""
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.tolerance, model.opt.iterations = 0, 100
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return " ".join(repr(float(x)) for x in data.qpos)


# Each measure looks at (model, data) after every step and is reduced to one number at the end.


def last(signal):
    return lambda model, values, times: values[-1], signal


def mean(signal):
    return lambda model, values, times: float(np.mean(values[1:])), signal


def rate(signal):
    """Mean slope over the second half of the run."""

    def reduce(model, values, times):
        half = len(values) // 2
        return (values[-1] - values[half]) / (times[-1] - times[half])

    return reduce, signal


def until(limit, signal):
    """Time at which a falling signal passes the limit, between two steps by a straight line."""

    def reduce(model, values, times):
        for i in range(1, len(values)):
            if values[i] <= limit:
                share = (values[i - 1] - limit) / (values[i - 1] - values[i])
                return times[i - 1] + share * (times[i] - times[i - 1])
        return math.inf

    return reduce, signal


def period(signal):
    """Mean time between passages through zero upwards."""

    def reduce(model, values, times):
        passages = []
        for i in range(1, len(values)):
            if values[i - 1] < 0 <= values[i]:
                share = values[i - 1] / (values[i - 1] - values[i])
                passages.append(times[i - 1] + share * (times[i] - times[i - 1]))
        return (passages[-1] - passages[0]) / (len(passages) - 1) if len(passages) > 1 else math.inf

    return reduce, signal


def rotation(data, body=1):
    return data.xmat[body].reshape(3, 3)


def forces(model, data):
    """Normal and tangential force, and position, of every contact."""
    out, found = np.zeros(6), []
    for i in range(data.ncon):
        mujoco.mj_contactForce(model, data, i, out)
        found.append((out[0], math.hypot(out[1], out[2]), data.contact[i].pos.copy()))
    return found


def momenta(model, data):
    """Angular momentum about the centre of mass, world axes, of the first body on a free joint."""
    frame = rotation(data) @ rotation_of(model.body_iquat[1])
    w = rotation(data) @ data.qvel[3:6]
    return frame @ (model.body_inertia[1] * (frame.T @ w))


def rotation_of(quat):
    out = np.zeros(9)
    mujoco.mju_quat2Mat(out, quat)
    return out.reshape(3, 3)


def kinetic(model, data):
    frame = rotation_of(model.body_iquat[1])
    w = frame.T @ data.qvel[3:6]
    return 0.5 * float(np.dot(model.body_inertia[1], w * w))


def agm(a, b):
    while abs(a - b) > 1e-15 * a:
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return a


def elliptic_k(k):
    """Complete elliptic integral of the first kind of modulus k."""
    return math.pi / (2 * agm(1.0, math.sqrt(1 - k * k)))


def restitution(zeta):
    s = math.sqrt(1 - zeta * zeta)
    return math.exp(-zeta / s * (math.pi - math.atan2(2 * zeta * s, 1 - 2 * zeta * zeta)))


# Round bodies: the inertia ratio k = I/(mR²) is set by an inertial element, R = 0.1 m and m = 1 kg.


def ball(k, attributes=""):
    inertia = k * 0.01
    return (
        f'<body name="ball"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'
        f'<geom name="ball" type="sphere" size="0.1" {attributes}/></body>'
    )


ELLIPTIC = 'cone="elliptic"'
# Constant impedance, so that the depth of rest is known and the start is at rest.
PLAIN = 'solimp="0.95 0.95 .001"'


def rest(half, contacts=1, degrees=0.0):
    """Height of the centre at rest: depth (1 − d) g cos θ (τζ)²/n."""
    return half - 0.05 * G * math.cos(degrees * DEGREE) * 0.02**2 / contacts


REST = rest(0.1)


def slide_to_roll(name, k, cone):
    mu, v0, x = 0.4, 2.0, scene
    xml = lambda truth: x(truth, GROUND + ball(k), free(REST, v0), cone, f'{PLAIN} condim="3" friction="{mu} 0 0"')
    slip_end = v0 * k / ((1 + k) * mu * G)
    end = v0 / (1 + k)
    yield f"{name}: speed after sliding", "slide-to-roll-speed", xml, 1.0, end, last(lambda m, d: d.qvel[0])
    limit = 1e-3
    yield (f"{name}: end of slip", "slip-end", xml, 1.0, slip_end * (1 - limit / v0),
           until(limit, lambda m, d: d.qvel[0] - 0.1 * d.qvel[4]))
    path = 0.5 * slip_end * (v0 + end) + end * (1.0 - slip_end)
    yield f"{name}: path", "slide-to-roll-path", xml, 1.0, path, last(lambda m, d: d.qpos[0])


def down(name, k, degrees, mu):
    theta = degrees * DEGREE
    rolls = math.tan(theta) <= mu * (1 + k) / k
    a = G * math.sin(theta) / (1 + k) if rolls else G * (math.sin(theta) - mu * math.cos(theta))
    xml = lambda truth: scene(truth, GROUND + ball(k), free(REST), f"{ELLIPTIC} {slope(degrees)}",
                              f'{PLAIN} condim="3" friction="{mu} 0 0"')
    yield f"{name}: acceleration", "incline", xml, 1.0, a, rate(lambda m, d: d.qvel[0])


def pushed(name, k, force, mu):
    rolls = force <= mu * G * (1 + k) / k
    a = force / (1 + k) if rolls else force - mu * G
    motor = '<actuator><motor joint="push" gear="1 0 0 0 0 0"/></actuator>'
    body = ball(k).replace("<freejoint/>", '<freejoint name="push"/>')
    start = f'{free(REST)} ctrl="{force!r}"'
    xml = lambda truth: scene(truth, GROUND + body, start, ELLIPTIC, f'{PLAIN} condim="3" friction="{mu} 0 0"', motor)
    yield f"{name}: acceleration", "push", xml, 1.0, a, rate(lambda m, d: d.qvel[0])


def resistance(delta):
    k, v0 = 0.4, 1.0
    xml = lambda truth: scene(truth, GROUND + ball(k), free(REST, v0, wy=10.0), ELLIPTIC,
                              f'{PLAIN} condim="6" friction="1 0.0001 {delta!r}"')
    exact = -delta * G / (0.1 * (1 + k))
    yield f"rolling resistance, {delta:g} m", "rolling-resistance", xml, 1.0, exact, rate(lambda m, d: d.qvel[0])


def spin_down():
    xml = lambda truth: scene(truth, GROUND + ball(0.4), free(REST, wz=50.0), ELLIPTIC,
                              f'{PLAIN} condim="4" friction="1 0.005 0"')
    yield ("spinning ball: deceleration", "spin-down", xml, 1.0, -0.005 * G / 0.004,
           rate(lambda m, d: d.qvel[5]))


def bounce(zeta):
    xml = lambda truth: scene(truth, GROUND + ball(0.4), free(0.1005, vz=-1.0), 'gravity="0 0 0"',
                              f'condim="1" solref="-1e4 {-2 * zeta * 100!r}" {PURE}', timestep=0.0001)
    yield (f"bounce, damping ratio {zeta}", "restitution", xml, 0.1, restitution(zeta),
           last(lambda m, d: d.qvel[2]))


def collision():
    """A ball of 1 kg meets a resting one of 3 kg: the effective mass is right if the speeds are."""
    balls = "".join(
        f'<body><joint type="slide" axis="1 0 0"/><geom type="sphere" size="0.1" mass="{m}"/></body>' for m in (1, 3)
    )
    xml = lambda truth: scene(truth, balls, 'qpos="0 0.201" qvel="1 0"', 'gravity="0 0 0"',
                              f'condim="1" solref="-1e4 0" {PURE}', timestep=0.0001)
    yield "elastic collision, 1 kg on 3 kg", "collision", xml, 0.1, 2 / 4, last(lambda m, d: d.qvel[1])


def cradle():
    balls = "".join('<body><joint type="slide" axis="1 0 0"/><geom type="sphere" size="0.1" mass="1"/></body>' for _ in range(5))
    start = f'qpos="{" ".join(repr(0.201 * i) for i in range(5))}" qvel="1 0 0 0 0"'
    xml = lambda truth: scene(truth, balls, start, 'gravity="0 0 0"',
                              f'condim="1" solref="-1e7 0" {PURE}', timestep=0.00002)
    yield "Newton's cradle: last ball", "cradle", xml, 0.05, 1.0, last(lambda m, d: d.qvel[4])


def sink(name, body, contacts, height):
    d, tau, zeta = 0.95, 0.02, 1.0
    r = (1 - d) * G * (tau * zeta) ** 2 / contacts
    xml = lambda truth: scene(truth, GROUND + body, free(height - 1e-6), ELLIPTIC, f'solimp="{d} {d} .001"')
    yield f"{name} at rest: depth", "rest-depth", xml, 2.0, r, last(lambda m, d: height - d.qpos[2])


BOX = '<body name="box"><freejoint/><geom name="box" type="box" size="0.1 0.1 0.1" mass="1"/></body>'


def block(degrees, mu, seconds=1.0):
    theta = degrees * DEGREE
    if math.tan(theta) <= mu:
        # MuJoCo's default impedance: there it creeps most.
        xml = lambda truth: scene(truth, GROUND + BOX, free(0.0999), f"{ELLIPTIC} {slope(degrees)}", f'friction="{mu} 0 0"')
        yield f"block that sticks at {degrees}°: speed", "creep", xml, seconds, 0.0, last(lambda m, d: d.qvel[0])
        return
    xml = lambda truth: scene(truth, GROUND + BOX, free(rest(0.1, 4, degrees)), f"{ELLIPTIC} {slope(degrees)}",
                              f'{PLAIN} friction="{mu} 0 0"')
    a = G * (math.sin(theta) - mu * math.cos(theta))
    yield (f"block that slides at {degrees}°: acceleration", "block-acceleration", xml, seconds, a,
           rate(lambda m, d: d.qvel[0]))
    yield (f"block that slides at {degrees}°: path", "block-path", xml, seconds, 0.5 * a * seconds**2,
           last(lambda m, d: d.qpos[0]))
    h = 0.002
    yield (f"block that slides at {degrees}°: path by steps", "block-path-steps", xml, seconds,
           0.5 * a * seconds * (seconds + h), last(lambda m, d: d.qpos[0]))
    yield (f"block that slides at {degrees}°: in contact", "contact-share", xml, seconds, 1.0,
           mean(lambda m, d: float(any(f[0] > 0 for f in forces(m, d)))))

    def ratio(m, d):
        found = forces(m, d)
        normal = sum(f[0] for f in found)
        return sum(f[1] for f in found) / normal if normal > 0 else 0.0

    yield f"block that slides at {degrees}°: F_t/F_n", "friction-ratio", xml, seconds, mu, mean(ratio)


def stop():
    mu, v0, limit = 0.5, 3.0, 1e-3
    xml = lambda truth: scene(truth, GROUND + BOX, free(rest(0.1, 4), v0), ELLIPTIC, f'{PLAIN} friction="{mu} 0 0"')
    yield "block that stops: path", "stop-path", xml, 1.5, v0**2 / (2 * mu * G), last(lambda m, d: d.qpos[0])
    h = 0.002
    n = math.floor(v0 / (mu * G * h))
    yield ("block that stops: path by steps", "stop-path-steps", xml, 1.5, h * n * (v0 - mu * G * h * (n + 1) / 2),
           last(lambda m, d: d.qpos[0]))
    yield ("block that stops: time", "stop-time", xml, 1.5, (v0 - limit) / (mu * G),
           until(limit, lambda m, d: d.qvel[0]))


def topple(degrees):
    """Half height 0.2 m on half width 0.1 m: tips beyond arctan 1/2 = 26.57°."""
    body = BOX.replace("0.1 0.1 0.1", "0.1 0.1 0.2")
    tips = float(math.tan(degrees * DEGREE) > 0.5)
    xml = lambda truth: scene(truth, GROUND + body, free(rest(0.2, 4, degrees)), f"{ELLIPTIC} {slope(degrees)}",
                              f'{PLAIN} friction="1 0 0"')
    yield (f"tall block at {degrees}° tips", "topple", xml, 3.0, tips,
           last(lambda m, d: float(rotation(d)[2, 2] < 0.7)))


def load_share():
    degrees = 15
    xml = lambda truth: scene(truth, GROUND + BOX, free(rest(0.1, 4, degrees)), f"{ELLIPTIC} {slope(degrees)}",
                              f'{PLAIN} friction="1 0 0"')

    def share(m, d):
        found = forces(m, d)
        total = sum(f[0] for f in found)
        return sum(f[0] for f in found if f[2][0] > d.qpos[0]) / total if total > 0 else 0.0

    exact = 0.5 * (1 + math.tan(degrees * DEGREE))
    yield "block on 15°: share of the load downhill", "load-share", xml, 2.0, exact, last(share)


INERTIA = (0.02, 0.03, 0.045)


def tumbling():
    """A free body that turns mostly about its middle axis (Dzhanibekov)."""
    i1, i2, i3 = INERTIA
    body = (f'<body><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="{i1} {i2} {i3}"/>'
            '<geom type="box" size=".1 .1 .1" contype="0" conaffinity="0"/></body>')
    w = (0.5, 10.0, 0.5)
    start = f'qpos="0 0 0 1 0 0 0" qvel="0 0 0 {w[0]} {w[1]} {w[2]}"'
    energy = 0.5 * (i1 * w[0] ** 2 + i2 * w[1] ** 2 + i3 * w[2] ** 2)
    momentum = math.sqrt((i1 * w[0]) ** 2 + (i2 * w[1]) ** 2 + (i3 * w[2]) ** 2)
    # Landau, Lifshitz: with I3 > I2 > I1 and M² > 2 E I2 (else 1 and 3 change places).
    if momentum**2 < 2 * energy * i2:
        i1, i3 = i3, i1
    p = math.sqrt(abs((i3 - i2) * (momentum**2 - 2 * energy * i1) / (i1 * i2 * i3)))
    k2 = (i2 - i1) * (2 * energy * i3 - momentum**2) / ((i3 - i2) * (momentum**2 - 2 * energy * i1))
    exact = 4 * elliptic_k(math.sqrt(k2)) / p
    for integrator in ("Euler", "implicitfast", "RK4"):
        xml = lambda truth, i=integrator: scene(truth, body, start, f'gravity="0 0 0" integrator="{i}"')
        yield (f"free body, {integrator}: energy gain in 20 s", "free-energy", xml, 20.0, 0.0,
               last(lambda m, d: kinetic(m, d) / energy - 1))
    xml = lambda truth: scene(truth, body, start, 'gravity="0 0 0" integrator="RK4"')
    yield "free body, RK4: period", "free-period", xml, 20.0, exact, period(lambda m, d: d.qvel[4])
    yield ("free body, RK4: angular momentum drift", "free-momentum", xml, 20.0, 0.0,
           last(lambda m, d: float(np.linalg.norm(momenta(m, d) - np.array(INERTIA) * np.array(w))) / momentum))


def top():
    """A symmetric top on its tip, started exactly in steady precession."""
    mass, length, i3, transverse, theta, spin = 1.0, 0.1, 0.002, 0.012, 30 * DEGREE, 200.0
    # transverse: about the tip. Spin ω₃ about the axis, body; slow root of  I₁ Ω² cos θ − I₃ ω₃ Ω + m g l = 0.
    a, b, c = transverse * math.cos(theta), -i3 * spin, mass * G * length
    omega = (-b - math.sqrt(b * b - 4 * a * c)) / (2 * a)
    body = (f'<body><joint type="ball"/><inertial pos="0 0 {length}" mass="{mass}" '
            f'diaginertia="{transverse - mass * length**2!r} {transverse - mass * length**2!r} {i3}"/>'
            '<geom type="sphere" size=".01" contype="0" conaffinity="0"/></body>')
    # Tilted about y by θ; angular velocity in body axes: x −Ω sin θ, z ω₃.
    half = 0.5 * theta
    start = (f'qpos="{math.cos(half)!r} 0 {math.sin(half)!r} 0" '
             f'qvel="{-omega * math.sin(theta)!r} 0 {spin!r}"')
    xml = lambda truth: scene(truth, body, start, 'integrator="RK4"', timestep=0.0005)
    yield ("heavy top, RK4: period of precession", "top-period", xml, 10.0, 2 * math.pi / omega,
           period(lambda m, d: rotation(d)[1, 2]))


def oscillators():
    spring = ('<body><joint name="x" type="slide" axis="1 0 0" stiffness="{k}" {more}/>'
              '<geom type="sphere" size=".1" mass="1" contype="0" conaffinity="0"/></body>')
    for integrator in ("Euler", "RK4"):
        xml = lambda truth, i=integrator: scene(truth, spring.format(k=100, more=""), 'qpos="1"',
                                                f'gravity="0 0 0" integrator="{i}"')
        yield (f"spring, {integrator}: position at 3 s", "spring", xml, 3.0, math.cos(10 * 3.0),
               last(lambda m, d: d.qpos[0]))
    w, z = 10.0, 0.1
    wd = w * math.sqrt(1 - z * z)
    damped = math.exp(-z * w * 2) * (math.cos(wd * 2) + z * w / wd * math.sin(wd * 2))
    xml = lambda truth: scene(truth, spring.format(k=100, more='damping="2"'), 'qpos="1"',
                              'gravity="0 0 0" integrator="RK4"')
    yield "damped spring, RK4: position at 2 s", "spring", xml, 2.0, damped, last(lambda m, d: d.qpos[0])
    k = (2 * math.pi) ** 2
    xml = lambda truth: scene(truth, spring.format(k=repr(k), more='frictionloss="2"'), 'qpos="1"', 'gravity="0 0 0"')
    yield ("spring with dry friction: half a swing", "dry-spring", xml, 0.5, -(1 - 2 * 2 / k),
           last(lambda m, d: d.qpos[0]))
    theta = 2.0
    pendulum = ('<body><joint type="hinge" axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia=".01 .01 .01"/>'
                '<geom type="sphere" size=".1" contype="0" conaffinity="0"/></body>')
    small = math.sqrt(G * 1.0 / (1.0 + 0.01))
    for integrator in ("Euler", "RK4"):
        xml = lambda truth, i=integrator: scene(truth, pendulum, f'qpos="{theta}"', f'integrator="{i}"')
        yield (f"pendulum from 2 rad, {integrator}: period", "pendulum-period", xml, 20.0,
               4 / small * elliptic_k(math.sin(theta / 2)), period(lambda m, d: d.qpos[0]))


def fall():
    body = ball(0.4).replace("<geom", '<geom contype="0" conaffinity="0"')
    h, n = 0.002, 500
    xml = lambda truth: scene(truth, body, free(10.0, vz=3.0))
    yield ("free fall by steps: height", "fall-steps", xml, 1.0, 10 + 3 * h * n - G * h * h * n * (n + 1) / 2,
           last(lambda m, d: d.qpos[2]))
    yield ("free fall: height", "fall", xml, 1.0, 10 + 3 - G / 2, last(lambda m, d: d.qpos[2]))


def rolling_plate():
    """SimBenchmark's rolling test (RSL, ETH Zurich): a pushed plate carries 25 balls."""
    plate, ball_mass, n, force, radius = 10.0, 1.0, 25, 150.0, 0.5
    top = 0.2 - 5e-6
    direction = (0.5, math.sqrt(0.75))
    balls, start = "", f"0 0 {0.1 - 5e-6!r} 1 0 0 0"
    for i in range(5):
        for j in range(5):
            balls += f'<body><freejoint/><geom type="sphere" size="{radius}" mass="1" friction="0.8 0 0"/></body>'
            start += f" {2 * (i - 2)} {2 * (j - 2)} {top + radius - 5e-6!r} 1 0 0 0"
    world = (GROUND + '<body><freejoint name="plate"/><geom type="box" size="10 10 0.1" mass="10" friction="0.4 0 0"/>'
             "</body>" + balls)
    gear = " ".join(repr(force * x) for x in direction)
    motor = f'<actuator><motor joint="plate" gear="{gear} 0 0 0 0"/></actuator>'
    at = lambda truth, qpos, ctrl: scene(truth, world, f'qpos="{qpos}" ctrl="{ctrl}"', ELLIPTIC, 'friction="0.4 0 0"',
                                         motor, 0.001)
    # The closed form is about rigid bodies: start where the soft contacts already carry the load.
    start = settled(at("rolling-plate", start, 0), 2000)
    xml = lambda truth: at(truth, start, 1)
    f1 = 0.4 * (plate + n * ball_mass) * G
    f2 = (force - f1) / plate / (3.5 / ball_mass + n / plate)
    a1, a2 = (force - f1 - n * f2) / plate, f2 / ball_mass

    def error(m, d):
        v = d.qvel.reshape(-1, 6)[:, :3]
        away = lambda v, a: float(np.sum((v - a * d.time * np.array([*direction, 0.0])) ** 2))
        return away(v[0], a1) + float(np.mean([away(x, a2) for x in v[1:]]))

    yield "SimBenchmark's rolling: velocity error squared", "rolling-plate", xml, 4.0, 0.0, mean(error)


def euler_disk():
    """A disk that rolls on its edge with its centre at rest: Moffatt's Ω² sin α = 4 g/a, for a disk of thickness 2 b.

    At rest are the centre and the touching point, so ω lies along r = a d − b e (e axis, d down the disk's slope), and
    with ė = Ω z × e, L̇ = Ω z × L = r × m g z follows Ω² = m g (a cos α − b sin α)/(sin α (I₁ cos α − I₃ (b/a) sin α)).
    """
    a, b, alpha, mass = 0.1, 0.0005, 20 * DEGREE, 1.0
    i3, i1 = 0.5 * mass * a**2, 0.25 * mass * a**2
    sin, cos = math.sin(alpha), math.cos(alpha)
    omega = math.sqrt(mass * G * (a * cos - b * sin) / (sin * (i1 * cos - i3 * b / a * sin)))
    body = (f'<body><freejoint/><inertial pos="0 0 0" mass="{mass}" diaginertia="{i1} {i1} {i3}"/>'
            f'<geom type="cylinder" size="{a} {b}"/></body>')
    height = a * sin + b * cos - 2e-6
    # Tilted about y: the body's x axis is d.
    start = (f'qpos="0 0 {height!r} {math.cos(alpha / 2)!r} 0 {math.sin(alpha / 2)!r} 0" '
             f'qvel="0 0 0 {-omega * sin!r} 0 {omega * sin * b / a!r}"')
    xml = lambda truth: scene(truth, GROUND + body, start, ELLIPTIC, 'condim="3" friction="1 0 0" solref="0.002 1"',
                              timestep=0.0001)
    yield "Euler's disk: period", "euler-disk", xml, 1.0, 2 * math.pi / omega, period(lambda m, d: rotation(d)[1, 2])


def cases():
    yield from fall()
    yield from oscillators()
    yield from slide_to_roll("sphere", 0.4, ELLIPTIC)
    yield from list(slide_to_roll("disk", 0.5, ELLIPTIC))[:2]
    yield from list(slide_to_roll("hoop", 1.0, ELLIPTIC))[:2]
    yield from down("sphere that rolls at 20°", 0.4, 20, 0.5)
    yield from down("hoop that slips at 40°", 1.0, 40, 0.3)
    yield from pushed("disk pushed by 3 N", 0.5, 3.0, 0.5)
    yield from pushed("hoop pushed by 12 N", 1.0, 12.0, 0.5)
    for delta in (1e-2, 1e-3, 1e-4):
        yield from resistance(delta)
    yield from spin_down()
    for zeta in (0.1, 0.3, 0.7):
        yield from bounce(zeta)
    yield from collision()
    yield from cradle()
    yield from sink("sphere", ball(0.4), 1, 0.1)
    yield from sink("box", BOX, 4, 0.1)
    yield from block(20, 0.5)
    yield from block(35, 0.5)
    yield from stop()
    yield from topple(26)
    yield from topple(27)
    yield from load_share()
    yield from tumbling()
    yield from top()
    yield from euler_disk()
    yield from rolling_plate()


def run(xml, seconds, measure):
    reduce, signal = measure
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.tolerance = 0
    model.opt.iterations = 100
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    values, times = [signal(model, data)], [0.0]
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        # A step leaves positions of bodies where it began.
        mujoco.mj_kinematics(model, data)
        values.append(signal(model, data))
        times.append(data.time)
    return float(reduce(model, values, times))


def cost(xml, seconds):
    """Nanoseconds per step of the whole run: the best of five, without Python between the steps."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    steps = min(round(seconds / model.opt.timestep), 2000)
    best = math.inf
    for _ in range(5):
        mujoco.mj_resetDataKeyframe(model, data, 0)
        before = time.perf_counter_ns()
        mujoco.mj_step(model, data, nstep=steps)
        best = min(best, (time.perf_counter_ns() - before) / steps)
    return round(best)


def generate():
    found = []
    for name, truth, xml, seconds, exact, measure in cases():
        text = xml(truth)
        found.append({"name": name, "truth": truth, "seconds": seconds, "exact": exact,
                      "mujoco": run(text, seconds, measure), "measured_ns": cost(text, seconds), "xml": text})
    return found
