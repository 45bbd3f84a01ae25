"""`noslip_iterations`: friction once more without its regularisation, of both cones, of joints and of tendons."""

import numpy as np

from scenes import scene, wrap

GROUND = '<geom type="plane" size="5 5 1"/>'
# The second crate's centre of mass is not its origin; the arm stands on it by a hinge with dry friction.
CRATES = """<body pos="0 0 0.099"><freejoint/><geom type="box" size="0.1 0.2 0.1"/></body>
  <body pos="1 0 0.19"><freejoint/><geom type="box" size="0.1 0.2 0.15" pos="0.05 0 -0.04"/>
    <body pos="0 0 0.1"><joint name="h" frictionloss="0.3" axis="1 0 0"/><geom type="capsule" fromto="0 0 0.02 0.5 0 0.02" size="0.03"/></body></body>
  <body pos="1 0.26 0.098"><freejoint/><geom size="0.1"/></body>"""
WALKER = """<body pos="0 0 0.5"><joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/><joint name="pitch" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.05"/>
    <body><joint name="hip" axis="0 1 0" range="-60 60" frictionloss="0.2" damping="0.1"/><geom type="capsule" fromto="0 0 0 0.05 0 -0.25" size="0.04"/>
      <body pos="0.05 0 -0.25"><joint name="knee" axis="0 1 0" frictionloss="0.1"/><geom type="capsule" fromto="0 0 0 -0.05 0 -0.22" size="0.03"/></body></body>
    <body><joint name="hip2" axis="0 1 0"/><geom type="capsule" fromto="0 0.1 0 0.1 0.1 -0.44" size="0.035"/></body></body>"""
TIES = """<tendon><fixed name="t" frictionloss="0.4" range="-0.2 0.2"><joint joint="hip" coef="1"/><joint joint="hip2" coef="-1"/></fixed></tendon>
  <equality><joint joint1="knee" joint2="hip2" polycoef="0 0.3 0 0 0"/></equality>"""


def made(body, option, dim, rest="", flag=""):
    default = f'<geom condim="{dim}" friction="0.6 0.02 0.01"/>'
    return wrap(GROUND + body, rest, option=f'timestep="0.002" impratio="2" {option}', default=default, flag=flag)


def generate():
    rng = np.random.default_rng(31)
    scenes = []
    for cone in ("pyramidal", "elliptic"):
        for dim, sweeps in ((3, 'noslip_iterations="1"'), (4, 'noslip_iterations="5"'), (6, 'noslip_iterations="30"')):
            option = f'cone="{cone}" {sweeps}'
            scenes.append(scene(f"crates, {cone} {dim}", made(CRATES, option, dim), rng, ["qacc"], samples=4, spread=0.01, speed=0.3, seconds=0.1))
        option = f'cone="{cone}" noslip_iterations="20" noslip_tolerance="1e-5"'
        scenes.append(scene(f"walker, {cone}", made(WALKER, option, 3, TIES), rng, ["qacc"], samples=4, spread=0.02, speed=0.5, seconds=0.2))
        scenes.append(scene(f"one island, {cone}", made(CRATES, option, 3, flag='<flag island="disable"/>'), rng, ["qacc"], samples=4, spread=0.01, speed=0.3))
    return scenes
