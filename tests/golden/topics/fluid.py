"""Forces of a medium: density, viscosity and wind on free and articulated bodies (inertia boxes)."""

import numpy as np

from scenes import scene, wrap

BODIES = """<body pos="0 0 1" euler="0 0 30"><joint axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0.1 -0.5"/>
    <body pos="0 0.1 -0.5"><joint type="ball" damping="0.1"/><geom type="box" size="0.02 0.1 0.2" pos="0.03 0 -0.2" euler="20 0 10"/>
      <body pos="0.1 0 0" euler="0 40 0"><geom size="0.05" pos="0 0.2 0"/></body></body></body>
  <body pos="1 0 1"><freejoint/><geom type="ellipsoid" size="0.1 0.2 0.3" pos="0.05 0 0" density="300"/></body>
  <body pos="2 0 1"><joint type="slide" axis="1 0 0"/><geom type="box" size="0.1 0.2 0.3"/></body>"""
PLANAR = """<body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint axis="0 0 1"/><geom type="capsule" fromto="1.5 0 0 0.5 0 0" size="0.1"/>
    <body pos="0.5 0 0"><joint axis="0 0 1" range="-100 100"/><geom type="capsule" fromto="0 0 0 -1 0 0" size="0.1"/></body></body>"""
MEDIA = {"water": 'density="1000" viscosity="0.001"', "honey": 'viscosity="10"', "air": 'density="1.2" wind="5 -2 1"',
         "current": 'density="500" viscosity="2" wind="0.5 0.2 0.1"'}


def generate():
    rng = np.random.default_rng(19)
    out = []
    for name, medium in MEDIA.items():
        for bodies in (BODIES, PLANAR):
            xml = wrap(bodies, option=f'timestep="0.002" {medium}')
            out.append(scene(name, xml, rng, ["qfrc_passive", "qacc"], seconds=0.5 if bodies == PLANAR else 0, spread=0.5))
    flag = '<flag spring="disable" damper="disable"/>'
    out.append(scene("no passive forces", wrap(BODIES, option=MEDIA["water"], flag=flag), rng, ["qacc"], samples=1))
    ellipsoids = BODIES.replace("<geom ", '<geom fluidshape="ellipsoid" ', 3).replace('type="ellipsoid"', 'type="ellipsoid" fluidshape="ellipsoid" fluidcoef="1 0.4 0.8 2 0.5"')
    for name, medium in MEDIA.items():
        xml = wrap(ellipsoids, option=f'timestep="0.002" {medium}')
        out.append(scene(f"ellipsoids in {name}", xml, rng, ["qfrc_passive", "qacc"], ["geom_fluid"], spread=0.5))
    swimmer = wrap(PLANAR.replace("<geom ", '<geom fluidshape="ellipsoid" '), option=f'timestep="0.002" {MEDIA["water"]}')
    out.append(scene("ellipsoids, run", swimmer, rng, ["qacc"], seconds=0.3, samples=1, spread=0.5))
    return out
