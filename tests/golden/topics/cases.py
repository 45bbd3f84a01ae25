"""Kinds of scene that people asked about, four of each: what MuJoCo makes of them after some steps, or that it refuses them.

A scene starts at its first keyframe if it has one.
"""

import mujoco

FREE = '<body pos="{}" {}><freejoint/><geom {}/></body>'
GROUND = '<geom type="plane" size="5 5 .1"/>'
ARM = '<body><joint name="j" axis="0 1 0" range="-60 60"/><geom name="g" type="capsule" fromto="0 0 0 .3 0 0" size=".03"/><site name="s"/></body>'


def world(inside, around="", option=""):
    return f'<mujoco><option tolerance="0" {option}/>{around}<worldbody>{inside}</worldbody></mujoco>'


def moving(inside, key, around=""):
    return world(inside).replace("</mujoco>", f"{around}<keyframe><key {key}/></keyframe></mujoco>")


def pair(below, top, key="", turn=""):
    """Something on something fixed, at a height of 0.1 m."""
    return moving(f"{below}{FREE.format('0 0 .1', turn, top)}", key)


TABLE = '<geom type="box" size="1 1 .05" pos="0 0 .05"/>'
SPIN = 'qvel="1"'
STEPS = 200

KINDS = {
    # What rolls on something fixed goes on rolling, whichever of the two geoms comes first.
    "rolling": [
        moving('<geom type="box" size="1 1 .1"/><body pos="0 0 .1499"><freejoint/><geom size=".05"/></body>', 'qvel=".3 0 0 0 6 0"'),
        moving('<body pos="0 0 .1499"><freejoint/><geom size=".05"/></body><geom type="box" size="1 1 .1"/>', 'qvel=".3 0 0 0 6 0"'),
        moving('<body pos="0 0 .0799"><freejoint/><geom size=".08" condim="6"/></body><body><geom type="box" size="2 2 .1" pos="0 0 -.1"/></body>', 'qvel="0 -.4 0 5 0 0"'),
        moving(GROUND + '<body pos="0 0 .0999" euler="90 0 0"><freejoint/><geom type="cylinder" size=".1 .05"/></body>', 'qvel=".5 0 0 0 0 -5"'),
    ],
    # MuJoCo's own words for a spring by its time and damping, at the masses of the start.
    "springdamper": [
        world('<body pos="0 0 1"><joint type="slide" axis="0 0 1" springdamper=".2 .2" springref=".1"/><geom type="box" size=".05 .05 .05" mass="2"/></body>', option='timestep=".001"'),
        world('<body><joint axis="0 1 0" springdamper=".1 .5"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".02"/></body>'),
        world('<body><joint type="ball" springdamper=".3 1"/><geom type="box" size=".1 .05 .02" pos=".1 0 0"/></body>'),
        world('<body><joint axis="0 1 0" springdamper=".1 .5"/><geom size=".1" pos=".2 0 0"/><body pos=".4 0 0"><joint axis="0 1 0" springdamper=".05 .7" armature=".01" stiffness="3"/><geom size=".05" pos=".1 0 0"/></body></body>'),
    ],
    # A key for one of many is filled up from where the others stand.
    "short key": [
        moving(GROUND + '<replicate count="3" offset="0 .3 0"><body name="m" pos="0 0 .5"><freejoint/><geom size=".05"/></body></replicate>', 'qpos="0 0 .1 1 0 0 0"'),
        moving('<replicate count="4" euler="0 0 30"><body name="m" pos="1 0 0"><joint axis="0 1 0"/><geom size=".05" pos=".1 0 0"/></body></replicate>', 'qpos=".5 .25" qvel="1"'),
        moving(ARM + ARM.replace('"j"', '"k"').replace('"g"', '"h"').replace('"s"', '"t"'), 'qpos=".3" ctrl="1"', '<actuator><motor joint="j"/><motor joint="k"/></actuator>'),
        moving(GROUND + '<replicate count="2" offset=".2 0 0"><replicate count="2" offset="0 .2 0"><body name="m" pos="0 0 .2"><freejoint/><geom type="box" size=".05 .05 .05"/></body></replicate></replicate>', 'qpos="0 0 .06 1 0 0 0 0 .2 .07"'),
    ],
    # What stands exactly on its base, on a hinge, has no contact and turns freely.
    "touching": [
        moving('<geom type="box" size=".1 .1 .05" pos="0 0 .05"/><body pos="0 0 .15"><joint axis="0 0 1"/><geom type="cylinder" size=".04 .05"/></body>', SPIN),
        moving('<geom type="cylinder" size=".2 .1" pos="0 0 .1"/><body pos="0 0 .25"><joint axis="0 0 1"/><geom type="cylinder" size=".07 .05"/></body>', SPIN),
        moving('<geom type="cylinder" size=".1 .3" pos="0 0 .3"/><body pos="0 0 .65"><joint axis="0 0 1"/><geom size=".05"/></body>', SPIN),
        moving('<geom type="box" size=".2 .1 .04" pos="0 0 .04"/><body pos="0 0 .11"><joint axis="0 0 1"/><geom type="capsule" size=".03 .1" euler="0 90 0"/></body>', SPIN),
    ],
    # Upright cylinders on flat tops: the four points of the first step.
    "can": [
        moving('<geom type="box" size=".2 .2 .15" pos="0 0 .15"/><body pos="0 0 .3999"><freejoint/><geom type="cylinder" size=".05 .1"/></body>', 'qvel=".1"'),
        moving('<geom type="box" size=".3 .3 .1" euler="0 0 25"/><body pos=".02 0 .1999"><freejoint/><geom type="cylinder" size=".06 .1"/></body>', 'qvel="0 .2"'),
        moving('<geom type="box" size=".3 .3 .1"/><body pos="0 .05 .1499" euler="0 0 50"><freejoint/><geom type="cylinder" size=".08 .05"/></body>', 'qpos="0 .05 .1499 .9 0 0 .43589" qvel=".1 .1"'),
        moving('<geom type="box" size=".3 .3 .1"/><body pos="0 0 .2998"><freejoint/><geom type="cylinder" size=".03 .2"/></body>', 'qvel="0 0 -.1 0 0 2"'),
    ],
    "nkey": [
        '<mujoco><size nkey="2"/><worldbody><body pos="0 0 1"><freejoint/><geom size=".1"/></body></worldbody></mujoco>',
        f'<mujoco><size nkey="1"/><worldbody>{ARM}</worldbody></mujoco>',
        f'<mujoco><size nkey="3"/><worldbody>{ARM}</worldbody><keyframe><key qpos=".5"/></keyframe></mujoco>',
        f'<mujoco><size nkey="1"/><worldbody>{ARM}</worldbody><keyframe><key qpos=".5"/><key qpos=".7"/></keyframe></mujoco>',
    ],
    # A damping below zero drives, and is implicit only beside others.
    "driving damper": [
        world('<body><joint axis="0 1 0" damping="-.05"/><geom size=".1" pos=".2 0 0"/></body>'),
        world('<body><joint axis="0 1 0" damping="-.05"/><geom size=".1" pos=".2 0 0"/></body><body><joint axis="0 1 0" damping=".05"/><geom size=".1" pos=".2 0 0"/></body>'),
    ],
    # A ball joint that is limited without a range is held where it is.
    "held ball": [
        world('<body pos="0 0 1"><joint type="ball" damping="2"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/></body>', '<default><joint limited="true"/></default>'),
        world('<body pos="0 0 1"><joint type="ball" limited="true"/><geom type="box" size=".1 .05 .02" pos=".1 0 0"/></body>'),
        moving('<body pos="0 0 1"><joint type="ball" limited="true" range="0 0" damping=".1"/><geom size=".05" pos=".2 0 0"/></body>', 'qvel="0 0 1"'),
        world('<body pos="0 0 1"><joint axis="0 1 0" range="-30 30"/><geom size=".05" pos=".2 0 0"/><body pos=".3 0 0"><joint type="ball" limited="true" solreflimit=".05 1"/><geom size=".05" pos=".2 0 0"/></body></body>'),
    ],
    # Converters write attributes without a value: they count as not given.
    "empty": [
        world('<body pos=""><freejoint/><geom size=".1" rgba="" material="" mass="" friction=""/></body>'),
        world(GROUND + '<body pos="0 0 .2" quat="" name=""><joint type="slide" axis="0 0 1" range="" damping="" name=""/><geom type="box" size=".1 .1 .1" density="" condim="" solref="" solimp=""/></body>'),
        f'<mujoco><compiler boundmass="" settotalmass=""/><option timestep="" gravity="" tolerance="0"/><default><joint damping="" range=""/></default><worldbody>{ARM}</worldbody></mujoco>',
        world(ARM).replace("</mujoco>", '<actuator><motor joint="j" gear="" ctrlrange="" name=""/></actuator><keyframe><key qpos="" qvel="" ctrl="1"/></keyframe></mujoco>'),
    ],
    # … but for words that must be one of a few.
    "empty word": [f'<mujoco><compiler angle=""/><worldbody>{ARM}</worldbody></mujoco>', world(ARM, option='cone=""')],
    # Words must be right, too, where they change nothing.
    "word without effect": [f'<mujoco><compiler passthrough="{word}"/><worldbody>{ARM}</worldbody></mujoco>' for word in ("textures", "yes")],
    # A class may name what is not there as long as nothing ends up with it.
    "unused default": [
        world('<body><freejoint/><geom class="paint" material="blue" size=".1"/></body>', '<asset><material name="blue"/></asset><default><default class="paint"><geom material="none"/></default><default class="hull"><geom type="mesh" mesh="none"/></default></default>'),
        world(ARM, '<default><default class="a"><geom material="none"/><default class="b"><geom rgba="1 0 0 1"/></default></default></default>'),
        world('<body><freejoint/><geom class="paint" size=".1"/></body>', '<default><default class="paint"><geom material="none"/></default></default>'),
        world('<body><freejoint/><geom class="paint" material="" size=".1"/></body>', '<default><default class="paint"><geom material="none"/></default></default>'),
        world('<body childclass="hull"><freejoint/><geom type="sphere" mesh="" size=".1"/><geom size=".1" class="main" pos=".1 0 0"/></body>', '<default><default class="hull"><geom mesh="none"/></default></default>'),
    ],
    # A sensor of something that is not there, and more `user` numbers than there is room for.
    "sensor of nothing": [
        world(ARM).replace("</mujoco>", f"<sensor>{sensor}</sensor></mujoco>")
        for sensor in ['<jointpos joint="jj"/>', '<touch site="S"/>', '<framepos objtype="body" objname="arm"/>', '<actuatorfrc actuator="motor1"/>']
    ],
    "too many numbers": [
        world(ARM).replace("</mujoco>", '<size nuser_sensor="1"/><sensor><clock user="1 2"/></sensor></mujoco>'),
        world(ARM.replace('name="g"', 'user="1 2 3"')).replace("</mujoco>", '<size nuser_geom="2"/></mujoco>'),
        world(ARM.replace('name="j"', 'user="1"')).replace("</mujoco>", '<size nuser_jnt="0"/></mujoco>'),
        world(ARM.replace("<body", '<body user="1 2"')).replace("</mujoco>", '<size nuser_body="1"/></mujoco>'),
        moving(ARM, 'plastic=".1"'),
    ],
    # Too little inertia.
    "too light": [
        world('<body><freejoint/><geom size="4e-5"/></body>'),
        world('<body><freejoint/><inertial pos="0 0 0" mass="1e-3" diaginertia="1e-16 1e-16 1e-16"/></body>'),
        world('<body><joint/><geom type="box" size="3e-5 3e-5 3e-5"/></body>'),
        world('<body><freejoint/><geom size=".01"/><body pos="0 0 1"><joint/><geom type="capsule" size="2e-5 5e-5" mass="1e-12"/></body></body>'),
    ],
}


def ran(xml):
    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as refused:
        return {"refused": str(refused)}
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    out = {"nkey": model.nkey}
    for steps in (1, STEPS - 1):
        for _ in range(steps):
            mujoco.mj_step(model, data)
        out[f"qpos{steps}"], out[f"qvel{steps}"] = data.qpos.tolist(), data.qvel.tolist()
    return out


def generate():
    return [{"name": kind, "xml": xml, **ran(xml)} for kind, scenes in KINDS.items() for xml in scenes]
