"""Penny: a pocket-sized rigid-body engine that reads MuJoCo's MJCF files and has MuJoCo's names.

    import penny as mujoco

    m = mujoco.MjModel.from_xml_path("scene.xml")
    d = mujoco.MjData(m)
    mujoco.mj_step(m, d, nstep=1000)
    print(d.qpos, d.body("ball").xpos)

Penny's own: `m.opt.law` chooses the contact law ('mujoco', the default here; 'penalty'; 'tutorial'), `Simulation` is
one way in, `check` lists the problems of a scene, `explain` says what its contacts mean, `compare` runs it beside
MuJoCo, `sweep` and `rollout` run it many times, here or on a cluster.
What MuJoCo has and Penny has not is an `AttributeError` or a `NotImplementedError` that names it.
"""

import numpy as np

from . import _dynamics, _enums, _math, _penny, _render, rollout, viewer
from ._dynamics import *  # noqa: F403
from ._enums import *  # noqa: F403
from ._errors import FatalError, Problem, SceneError, StepError
from ._math import *  # noqa: F403
from ._penny import *  # noqa: F403
from ._render import *  # noqa: F403
from ._simulation import Simulation, Trajectory
from ._state import mj_getState, mj_setKeyframe, mj_setState, mj_stateSize
from ._sweep import compare, set_parameter, sweep
from ._table import Sweep, Table
from ._visual import MjStatistic, MjVisual
from ._warning import MjWarningStat
from .egl import GLContext

# Numbers are float64.
MJTNUM_DTYPE, MJTNUM_BYTES = np.float64, 8
mjVERSION_HEADER = 4000000
mjMINVAL, mjPI, mjMAXVAL, mjNREF, mjNIMP = 1e-15, 3.141592653589793, 1e10, 2, 5
# The version of MuJoCo whose names and numbers these are, and Penny's own.
__version__ = "4.0.0+penny.0.1.0"


def mj_version() -> int:
    """The version of MuJoCo whose names these are."""
    return mjVERSION_HEADER


def mj_versionString() -> str:
    """The same as text."""
    return "4.0.0"


def __getattr__(name: str):
    raise AttributeError(f"module 'penny' has no attribute '{name}': MuJoCo may have it, Penny has not")


__all__ = [
    "FatalError",
    "GLContext",
    "MjStatistic",
    "MjVisual",
    "MjWarningStat",
    "Problem",
    "SceneError",
    "Simulation",
    "StepError",
    "Sweep",
    "Table",
    "Trajectory",
    "compare",
    "mj_getState",
    "mj_setKeyframe",
    "mj_setState",
    "mj_stateSize",
    "mj_version",
    "mj_versionString",
    "rollout",
    "set_parameter",
    "sweep",
    "viewer",
    *_dynamics.__all__,
    *_math.__all__,
    *_render.__all__,
    *(
        n
        for module in (_enums, _penny)
        for n in dir(module)
        if n.startswith(("mj", "Mj", "check", "explain", "save_", "set_mj", "get_mj"))
    ),
]
