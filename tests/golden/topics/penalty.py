"""Rollouts that the `penalty` law is compared with, and the solref mapping of the course.

Each case: `xml`, `start` (qvel at the start), `every` (steps between samples), `qpos` and `qvel` samples of MuJoCo
at tolerance 0, and `touching`: the share of steps with an active contact.
"""

import mujoco
import numpy as np

GROUND = '<geom name="ground" type="plane" size="5 5 .1"/>'


def scene(option, default, bodies):
    return (
        f'<mujoco><option timestep="0.002" {option}/><default><geom {default}/></default>'
        f"<worldbody>{GROUND}{bodies}</worldbody></mujoco>"
    )


def rollout(name, xml, seconds, qvel=None, every=50):
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.tolerance = 0
    model.opt.iterations = 100
    data = mujoco.MjData(model)
    if qvel:
        data.qvel[:] = qvel
    steps = round(seconds / model.opt.timestep)
    samples = {"qpos": [data.qpos.tolist()], "qvel": [data.qvel.tolist()]}
    touching = 0
    for step in range(1, steps + 1):
        mujoco.mj_step(model, data)
        touching += any(data.contact.efc_address >= 0)
        if step % every == 0:
            samples["qpos"].append(data.qpos.tolist())
            samples["qvel"].append(data.qvel.tolist())
    return {"name": name, "xml": xml, "start": qvel or [], "seconds": seconds, "every": every, **samples,
            "touching": touching / steps}


SOFTNESS = {
    "default": "",
    "hard": 'solref=".01 1" solimp=".99 .995 .001"',
    "underdamped": 'solref=".02 .3" solimp=".95 .95 .001"',
}

DISK = """<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.001"><flag warmstart="disable"/></option>
  <default><geom friction="0 0 0.01" condim="6" solimp="0.99 0.995 0.001" solref="0.01 1"/></default>
  <worldbody>
    <geom type="plane" size="5 5 .1"/>
    <body pos="0 0 1"><inertial pos="0 0 0" mass="1" diaginertia="0.010033 0.02 0.010033"/>
      <geom type="cylinder" size="0.2 0.01" euler="1.57079632679 0 0"/><freejoint/></body>
  </worldbody>
</mujoco>"""


def cases():
    ball = '<body pos="0 0 .3"><freejoint/><geom type="sphere" size=".1" condim="1"/></body>'
    point = (
        '<body pos="0 0 .3"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
        '<geom type="sphere" size=".1" mass="2" condim="1"/></body>'
    )
    for label, softness in SOFTNESS.items():
        xml = scene("", softness, ball).replace('size="5 5 .1"', 'size="5 5 .1" condim="1"')
        yield rollout(f"ball {label}", xml, 3)
        yield rollout(f"point {label}", xml.replace(ball, point), 3)
    yield rollout("ball elliptic", scene('cone="elliptic"', "", ball.replace('condim="1"', "")), 3)
    box = '<body pos="0 0 .11"><freejoint/><geom type="box" size=".2 .15 .1"/></body>'
    yield rollout("box at rest", scene('cone="elliptic"', "", box), 3)
    rolling = '<body pos="0 0 .0999"><freejoint/><geom type="sphere" size=".1" {}/></body>'
    for cone in ("elliptic", "pyramidal"):
        option = f'cone="{cone}"'
        for label, friction, condim in (("slides, then rolls", ".4", 3), ("with rolling friction", ".4 .005 .001", 6)):
            xml = scene(option, f'friction="{friction}" condim="{condim}"', rolling.format(""))
            yield rollout(f"sphere {label}: {cone}", xml, 1, [2, 0, 0, 0, 0, 0], 25)
    yield rollout("disk", DISK, 3, [2, 0, 0, 0, 10, 0])


def mapping():
    """A drop of 5 cm of 1 kg on k = 2500 N/m for three damping ratios: the correct solref and the course's."""
    k, m = 2500.0, 1.0
    for zeta in (0.2, 1.0, 3.0):
        c = 2 * zeta * float(np.sqrt(k * m))
        for label, timeconst in (("correct", 2 * m / c), ("course", float(np.sqrt(m / k)))):
            contact = f'condim="1" solref="{timeconst!r} {zeta}" solimp=".95 .95 .001"'
            xml = (
                f'<mujoco><option timestep="0.0001"/><worldbody><geom type="plane" size="5 5 .1" {contact}/>'
                f'<body pos="0 0 .15"><freejoint/><geom type="sphere" size=".1" mass="1" {contact}/></body>'
                "</worldbody></mujoco>"
            )
            case = rollout(f"mapping {label} {zeta}", xml, 0.5, every=100)
            case.update(k=k, c=c, zeta=zeta, mapping=label)
            yield case


def generate():
    return {"rollouts": list(cases()), "mapping": list(mapping())}
