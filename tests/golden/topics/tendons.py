"""Tendons: fixed and spatial, over pulleys and round geoms, with limits, springs, dampers, dry friction, armature, actuators
and sensors; slider-cranks."""

import numpy as np

from scenes import scene, wrap

BODIES = """<site name="hook" pos="0.1 0.2 1.5" euler="20 30 0"/><geom name="post" type="cylinder" size="0.1 0.3" pos="0.2 0.1 1.2" euler="80 10 0"/>
  <body name="upper" pos="0 0 1" euler="0 0 30"><joint name="h" axis="0 1 0" range="-50 80" damping="0.1" springref="20"/>
    <geom name="rod" type="capsule" size="0.03" fromto="0 0 0 0 0.1 -0.5"/><site name="elbow" pos="0.05 0.1 -0.4"/><geom name="ball" size="0.08" pos="0 0.1 -0.5"/>
    <site name="side" pos="0.3 0.1 -0.5"/>
    <body name="lower" pos="0 0.1 -0.5"><joint name="b" type="ball" pos="0 0 0.02"/>
      <geom type="box" size="0.02 0.04 0.2" pos="0.03 0 -0.2"/><site name="tip" pos="0.1 0 -0.3"/>
      <body pos="0 0.1 0"><joint name="s" type="slide" axis="1 0 1" springref="0.1" armature="0.1"/><joint name="s2" type="slide" axis="0 1 0"/><geom size="0.06"/><site name="inner" pos="0.02 0 0.01"/></body></body>
    <body pos="0 -0.1 -0.3"><joint name="w" axis="1 0 0" ref="10"/><geom type="box" size="0.1 0.02 0.03" pos="0.1 0 0"/><site name="wing" pos="0.2 0 0"/></body></body>
  <body pos="-1 0 1"><joint name="k" axis="1 0 0"/><geom size="0.1" pos="0.3 0 0.1"/><site name="base" pos="0.1 0 0" euler="20 0 0"/></body>
  <body pos="1 0 1"><joint name="f" type="free"/><geom name="crate" type="box" size="0.1 0.2 0.3" pos="0.05 0 0" density="200" euler="0 0 20"/>
    <site name="jet" pos="0.1 0.1 0.3"/></body>
  <body pos="2 0 1"><joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/><geom size="0.1"/><site name="cart"/></body>
  <body pos="0.5 1 1"><joint name="round" type="free"/><geom size="0.1"/><site name="pole" pos="0 0 0.1"/></body>"""
FIXED = """<fixed name="spring" stiffness="20" damping="0.5"><joint joint="h" coef="1"/><joint joint="s" coef="-2"/></fixed>
    <fixed name="dead band" stiffness="20 3 100" damping="0.5 0.3 0.1" springlength="-0.2 0.1"><joint joint="w" coef="0.7"/><joint joint="k" coef="0.5"/></fixed>
    <fixed name="limit" range="-0.3 0.2" margin="0.1" solreflimit="0.03 0.8" solimplimit="0.8 0.9 0.1"><joint joint="h" coef="0.4"/><joint joint="k" coef="1"/><joint joint="x" coef="-1"/></fixed>
    <fixed name="dry" frictionloss="0.6" solreffriction="0.05 1" solimpfriction="0.7 0.9 0.01"><joint joint="w" coef="1"/><joint joint="z" coef="0.3"/></fixed>
    <fixed name="heavy" armature="0.3"><joint joint="h" coef="1"/><joint joint="w" coef="0.5"/><joint joint="k" coef="2"/></fixed>
    <fixed name="pulled" range="-1 1" limited="false" actuatorfrcrange="-1 2"><joint joint="s" coef="1"/><joint joint="s2" coef="-0.4"/></fixed>"""
SPATIAL = """<spatial name="string" stiffness="30" damping="1"><site site="hook"/><site site="elbow"/><site site="tip"/></spatial>
    <spatial name="rope" range="0 1.2" margin="0.05"><site site="base"/><site site="jet"/></spatial>
    <spatial name="rounds" stiffness="10" damping="0.2" springlength="0.3"><site site="hook"/><geom geom="post"/><site site="elbow"/><geom geom="ball" sidesite="side"/><site site="tip"/></spatial>
    <spatial name="pulleys" frictionloss="0.4" damping="0.3 0.1"><site site="hook"/><site site="wing"/><pulley divisor="2"/><site site="wing"/><site site="cart"/><pulley divisor="3"/><site site="jet"/><site site="inner"/><site site="pole"/></spatial>
    <spatial name="heavy" armature="0.5"><site site="hook"/><site site="tip"/><site site="inner"/><site site="cart"/></spatial>
    <spatial name="pulled" actuatorfrcrange="-3 2"><site site="hook"/><geom geom="ball"/><site site="tip"/></spatial>"""
PULLS = """<actuator><motor tendon="{0}" gear="2"/><position tendon="{0}" kp="20" dampratio="0.7" ctrlrange="-1 1"/><velocity tendon="{0}" kv="1" forcerange="-1 3"/>
    <motor tendon="{1}"/><position tendon="{1}" kp="9" kv="2" damping="0.2" armature="{2}"/><intvelocity tendon="{1}" kp="3" actrange="-1 1"/></actuator>"""
CRANKS = """<actuator><motor cranksite="elbow" slidersite="hook" cranklength="1.5"/><position cranksite="cart" slidersite="base" cranklength="4" gear="2" kp="5" kv="1"/>
    <motor cranksite="jet" slidersite="hook" cranklength="0.01"/></actuator>"""
KINDS = ["pos", "vel", "actuatorfrc"]


def sensors(names, limited):
    every = "".join(f'<tendon{kind} tendon="{name}"/>' for name in names for kind in KINDS)
    ends = "".join(f'<tendonlimit{kind} tendon="{name}"/>' for name in limited for kind in ("pos", "vel", "frc"))
    return f'<sensor>{every}{ends}<force site="tip"/><torque site="elbow"/><accelerometer site="tip"/><force site="jet"/><e_potential/><e_kinetic/></sensor>'


def tendons(content, rest="", **kw):
    return wrap(BODIES, f"<tendon>{content}</tendon>{rest}", **kw)


def generate():
    rng = np.random.default_rng(23)
    arrays = ["ten_length", "ten_velocity", "qfrc_passive", "qfrc_actuator", "actuator_force", "qacc"]
    compiled = ["tendon_length0", "tendon_lengthspring", "tendon_invweight0", "dof_invweight0"]
    fixed = tendons(FIXED, PULLS.format("limit", "pulled", 0.1) + sensors(["spring", "limit", "heavy", "pulled"], ["limit"]))
    spatial = tendons(SPATIAL, PULLS.format("rope", "pulled", 0) + sensors(["string", "rope", "rounds", "pulleys", "pulled"], ["rope"]))
    off = {name: f'<flag {name}="disable"/>' for name in ("spring", "damper", "limit", "frictionloss", "actuation")}
    small = 'timestep="0.001"'
    inside = tendons("""<spatial name="inside" stiffness="10"><site site="hook"/><geom geom="post" sidesite="within"/><site site="elbow"/></spatial>""")
    inside = inside.replace('<site name="hook"', '<site name="within" pos="0.2 0.1 1.2"/><site name="hook"')
    loose = scene("inside", inside, rng, arrays, samples=8, spread=0.3)
    # MuJoCo's own point of contact is so far off.
    loose["loose"] = 1e-6
    return [
        scene("fixed", fixed, rng, arrays + ["sensordata"], compiled, samples=6, spread=0.5),
        scene("spatial", spatial, rng, arrays + ["sensordata"], compiled, samples=10, spread=0.5),
        *(scene(f"no {name}", tendons(FIXED + SPATIAL.replace('"heavy"', '"lead"').replace('"pulled"', '"drawn"'), PULLS.format("limit", "drawn", 0), flag=flag), rng, arrays, samples=1) for name, flag in off.items()),
        scene("slider-cranks", wrap(BODIES, CRANKS), rng, arrays, samples=4, spread=0.3),
        scene("fixed, run", tendons(FIXED, PULLS.format("limit", "pulled", 0.1), option=small), rng, ["qacc"], samples=1, spread=0.1, speed=0.3, seconds=0.3),
        scene("spatial, run", tendons(SPATIAL, PULLS.format("rope", "pulled", 0), option=small), rng, ["qacc"], samples=1, spread=0.1, speed=0.3, seconds=0.3),
        loose,
    ]
