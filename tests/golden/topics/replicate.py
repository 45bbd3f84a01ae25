"""`<replicate>`: names, order and poses of the copies, and what refers to them."""

import numpy as np

from scenes import scene, wrap

ARM = """<body name="arm" pos="0.1 0 0"><joint name="hinge" axis="0 1 0"/><geom name="link" size="0.05" pos="0 0 -0.3"/>
  <site name="tip" pos="0 0 -0.3"/></body>"""
FOOT = """<body name="foot" pos="0 0 1"><joint name="slide" type="slide" axis="1 0 1"/><geom name="sole" size="0.05"/></body>"""
SCENES = [
    ("one", wrap(f'<replicate count="3" offset="0 1 0" euler="10 20 30">{ARM}</replicate>')),
    ("nested", wrap(f"""<body name="base"><joint type="ball" name="root"/><geom size="0.2" pos="0.1 0 0"/>
        <replicate count="2" offset="0 1 0" euler="90 0 0"><replicate count="12" sep="-" offset="1 0 0" euler="0 0 30">{ARM}
        </replicate></replicate></body>{FOOT}""")),
    ("referred to", wrap(
        f"""{FOOT}<replicate count="2" sep="_" offset="0 1 0"><frame pos="1 0 0" euler="0 0 40">{ARM}
        {ARM.replace('name="', 'name="l')}</frame></replicate>""",
        """<contact><exclude body1="foot" body2="arm"/></contact>
        <actuator><motor name="pull" joint="hinge" gear="2"/><motor name="push" joint="slide"/>
          <position joint="lhinge" kp="3"/><motor joint="lhinge_1"/></actuator>""")),
    ("extrinsic, radian", '<mujoco><compiler angle="radian" eulerseq="XZY"/>' + wrap(
        f'<replicate count="4" offset="0.1 0 0.3" euler="0.3 0.2 0.1">{ARM}</replicate>').removeprefix("<mujoco>")),
]
COMPILED = ["body_pos", "body_quat", "geom_pos", "geom_quat"]


def generate():
    rng = np.random.default_rng(11)
    return [scene(name, xml, rng, ["xpos", "qfrc_actuator"], COMPILED) for name, xml in SCENES]
