"""Sensors: every kind that Penny measures, in free and articulated trees, at rest and in motion, with contacts."""

import numpy as np

from scenes import scene, wrap

JOINTS = """<body name="upper" pos="0 0 1" euler="0 0 30"><joint name="hinge" axis="0 1 0" range="-20 30" damping="0.1"/>
    <geom name="rod" type="capsule" size="0.03" fromto="0 0 0 0 0.1 -0.5"/><site name="elbow" pos="0 0.1 -0.5" euler="10 20 0"/>
    <body name="lower" pos="0 0.1 -0.5"><joint name="ball" type="ball" range="0 50" pos="0 0 0.02"/>
      <geom type="box" size="0.02 0.04 0.2" pos="0.03 0 -0.2" euler="20 0 10"/>
      <body name="welded" pos="0.1 0 0" euler="0 40 0"><geom name="knob" size="0.05" pos="0 0.2 0"/><site name="tip" pos="0.1 0 0" euler="0 0 70"/>
        <body name="drawer" pos="0 0.1 0"><joint name="slide" type="slide" axis="1 0 1" range="-0.1 0.2"/><geom size="0.06"/>
          <site name="inner" pos="0.02 0 0.01" euler="30 0 0"/></body></body></body></body>"""
FREE = """<body name="float" pos="1 0 1"><freejoint name="float"/><geom name="hull" type="box" size="0.1 0.2 0.3" pos="0.05 0 0" euler="0 0 20"/>
    <site name="deck" pos="0.1 0.1 0.3" euler="0 20 40"/>
    <body name="mast" pos="0 0.1 0.2" euler="0 10 0"><geom size="0.1" pos="0 0 0.3"/><site name="top" pos="0 0 0.4" euler="5 0 0"/></body></body>
  <body name="walker" pos="2 0 1" euler="0 0 50"><freejoint/><geom size="0.1" pos="0.1 0 0"/><site name="hip" pos="0 0.1 0"/>
    <body name="leg" pos="0 0 -0.1"><joint name="knee" axis="1 1 0"/><geom type="capsule" size="0.03 0.1" pos="0 0 -0.2"/>
      <site name="toe" pos="0 0 -0.3" euler="0 0 90"/></body></body>
  <body name="post" pos="3 1 0" euler="0 0 20"><geom type="cylinder" size="0.1 0.4"/><site name="base" pos="0.2 0 0.3"/></body>"""
ACTUATORS = """<actuator><motor name="m" joint="hinge" gear="3"/><position name="p" joint="ball" gear="0.3 1 0.2" kp="2"/>
    <velocity name="v" joint="slide" kv="2" gear="-2" forcerange="-0.5 0.5"/><motor name="thrust" joint="float" gear="1 2 3 0.3 0.2 0.1"/></actuator>"""

SITES = ["elbow", "tip", "inner", "deck", "top", "hip", "toe", "base"]


def sensors(*lines):
    return "<sensor>" + "\n".join(lines) + "</sensor>"


def of_joints():
    yield from (f'<{kind} joint="{joint}"/>' for kind in ("jointpos", "jointvel", "jointactuatorfrc")
                for joint in ("hinge", "slide"))
    yield '<ballquat joint="ball"/><ballangvel joint="ball"/><clock/><e_potential/><e_kinetic/>'
    yield from (f'<jointlimit{what} joint="{joint}"/>' for what in ("pos", "vel", "frc")
                for joint in ("hinge", "slide", "ball"))
    yield from (f'<actuator{what} actuator="{name}"/>' for what in ("pos", "vel", "frc") for name in ("m", "p", "v", "thrust"))


def of_frames():
    objects = [("body", "lower"), ("xbody", "welded"), ("geom", "knob"), ("site", "tip"), ("site", "inner"), ("body", "mast"),
               ("site", "toe"), ("geom", "hull"), ("site", "base"), ("body", "world")]
    for i, (kind, name) in enumerate(objects):
        other = objects[(3 * i + 4) % len(objects)]
        ref = f'reftype="{other[0]}" refname="{other[1]}"'
        for what in ("pos", "quat", "xaxis", "yaxis", "zaxis", "linvel", "angvel"):
            yield f'<frame{what} objtype="{kind}" objname="{name}"/>'
            yield f'<frame{what} objtype="{kind}" objname="{name}" {ref}/>'
        for what in ("linacc", "angacc"):
            yield f'<frame{what} objtype="{kind}" objname="{name}"/>'


def of_sites(kinds, sites=SITES):
    yield from (f'<{kind} site="{site}"/>' for kind in kinds for site in sites)


def of_subtrees():
    for body in ("world", "upper", "welded", "drawer", "float", "mast", "walker", "post"):
        yield f'<subtreecom body="{body}"/><subtreelinvel body="{body}"/><subtreeangmom body="{body}"/>'


PLANAR = """<body name="a" pos="0 0 1"><joint name="x" type="slide" axis="1 0 0"/><joint name="r" axis="0 1 0"/>
    <geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.5"/><body name="b" pos="0 0 -0.5"><joint axis="0 1 0"/>
    <geom size="0.1" pos="0 0 -0.3"/><site name="s" pos="0.1 0 -0.3" euler="10 20 30"/></body></body>
  <body name="c" pos="2 0 1"><joint type="slide" axis="1 0 1"/><geom size="0.1"/><site name="t" euler="0 40 0" pos="0 0 .1"/></body>"""
IMU = ("accelerometer", "velocimeter", "gyro", "force", "torque", "magnetometer")
RANGE = """<geom name="floor" type="plane" size="3 3 0.1" pos="0 0 -1" euler="5 0 0"/><geom type="box" size="1 0.5 0.2" pos="2 0 0.5" euler="0 20 30"/>
  <geom type="sphere" size="0.6" pos="-2 0 0.5"/><geom type="capsule" size="0.3 0.7" pos="0 2 0.5" euler="60 0 0"/>
  <geom type="cylinder" size="0.4 0.6" pos="0 -2 0.5" euler="50 0 20"/><geom type="ellipsoid" size="0.4 0.6 0.9" pos="0 0 3"/>
  <geom size="20" rgba="1 1 1 0"/>
  <body name="probe"><freejoint/><geom size="0.1"/>""" + "".join(
    f'<site name="r{i}" euler="{x} {y} 0"/>' for i, (x, y) in enumerate(
        (x, y) for x in range(0, 360, 45) for y in (-60, -20, 0, 20, 60))) + "</body>"
PRESSED = """<geom type="plane" size="3 3 0.1"/>
  <body name="box" pos="0 0 0.095"><freejoint/><geom type="box" size="0.2 0.1 0.1"/>
    <site name="all" type="box" size="0.21 0.11 0.11"/><site name="half" type="box" size="0.1 0.11 0.11" pos="0.11 0 0"/>
    <site name="ball" type="sphere" size="0.05" pos="0.2 0.1 -0.05"/><site name="tube" type="cylinder" size="0.05 0.3" pos="0.2 0.1 0"/>
    <site name="pill" type="capsule" size="0.05 0.3" pos="-0.2 0.1 0"/><site name="egg" type="ellipsoid" size="0.1 0.2 0.3" pos="-0.2 0.1 0"/>
    <body pos="0 0 0.1"><geom size="0.05"/><site name="top" type="sphere" size="0.06"/>
      <body name="pole"><joint axis="1 0 0" range="-5 5" damping="0.5"/><geom type="capsule" size="0.02" fromto="0 0 0.05 0 0 0.3"/><site name="foot"/></body></body></body>
  <body pos="0.1 0 0.24"><freejoint/><geom size="0.045"/></body>"""
INSIDE = """<body name="can"><geom size="0.1"/><site name="s" size="0.7"/><site name="b" type="box" size="0.7 0.4 0.5" euler="10 20 30"/>
    <site name="c" type="capsule" size="0.5 0.3"/><site name="y" type="cylinder" size="0.5 0.7" euler="40 0 0"/>
    <site name="e" type="ellipsoid" size="0.9 0.5 0.3"/><site name="f" type="capsule" size="0.3" fromto="0 0 0 0.5 0.5 0"/></body>
  <body name="mouse"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/><geom size="0.01"/></body>"""


def generate():
    rng = np.random.default_rng(13)
    loaded = 'timestep="0.005" magnetic="0.1 -0.5 0.3"'
    free_flags = {"default": '<geom contype="0" conaffinity="0"/>'}
    touching = {"default": "<geom friction='0.7'/>", "option": 'timestep="0.002" cone="elliptic"'}
    scenes = [
        ("joints", wrap(JOINTS + FREE, ACTUATORS + sensors(*of_joints())), {}),
        ("frames", wrap(JOINTS + FREE, ACTUATORS + sensors(*of_frames())), {}),
        ("sites", wrap(JOINTS + FREE, ACTUATORS + sensors(*of_sites(IMU)), loaded), {}),
        ("subtrees", wrap(JOINTS + FREE, sensors(*of_subtrees())), {}),
        ("planar", wrap(PLANAR, sensors(*of_sites(IMU, ["s", "t"]), '<e_kinetic/><e_potential/><subtreeangmom body="a"/>')), {}),
        ("no gravity", wrap(JOINTS, sensors(*of_sites(("accelerometer", "force"), ["tip"])), flag='<flag gravity="disable"/>'), {}),
        ("switched off", wrap(JOINTS, sensors(*of_sites(("accelerometer",), ["tip"])), flag='<flag sensor="disable"/>'), {}),
        ("cutoff", wrap(JOINTS, sensors('<jointvel joint="hinge" cutoff="0.5" noise="2"/><accelerometer site="tip" cutoff="3"/>',
                                        '<rangefinder site="tip" cutoff="0.3"/><e_potential cutoff="0.1"/>')), {}),
        ("range", wrap(RANGE, sensors(*(f'<rangefinder name="{i}" site="r{i}"/>' for i in range(40)))), {"samples": 6}),
        ("inside", wrap(INSIDE, sensors(*(f'<insidesite objtype="body" objname="mouse" site="{s}"/>' for s in "sbcyef"))),
         {"samples": 12, "spread": 0.4}),
        ("touch", wrap(PRESSED, sensors(*of_sites(("touch",), ["all", "half", "ball", "tube", "pill", "egg", "top"]),
                                        *of_sites(("force", "torque", "accelerometer"), ["foot", "top", "all"])), **touching),
         {"spread": 0.004, "speed": 0.05, "seconds": 0.4}),
        ("arm", wrap(JOINTS, ACTUATORS.split("<motor name=\"thrust\"")[0] + "</actuator>" + sensors(
            *of_sites(IMU, ["elbow", "inner"]), '<jointlimitfrc joint="hinge"/>')), {"seconds": 1.0, "spread": 0.2}),
    ]
    return [scene(name, xml, rng, ["sensordata"], **more) for name, xml, more in scenes]
