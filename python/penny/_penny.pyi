"""The compiled module. Written by `python stubs.py`; see there."""

from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._visual import MjStatistic, MjVisual
from ._warning import MjWarningStatList

class MjContact:
    """One contact."""

    def __getattr__(self, name: str) -> Any: ...

class MjContactList:
    """A list of contacts: `len`, index, slice, and arrays over all of them (`contact.geom`, `contact.dist` …)."""

    def __getattr__(self, name: str) -> Any: ...
    def __len__(self) -> int: ...
    def __getitem__(self, key: Any) -> Any: ...

class MjData:
    """State and results of a model, under MuJoCo's names.

    As in MuJoCo, what follows from the state (`xpos`, `qacc`, `contact` …) belongs after `mj_step` to the beginning of that
    step. It is computed when it is asked for, and an array that somebody keeps is brought up to date by every call."""

    def __init__(self, model: MjModel) -> None: ...
    act: NDArray[np.float64]
    act_dot: NDArray[np.float64]
    actuator_force: NDArray[np.float64]
    actuator_length: NDArray[np.float64]
    actuator_moment: NDArray[np.float64]
    actuator_velocity: NDArray[np.float64]
    cacc: NDArray[np.float64]
    cam_xmat: NDArray[np.float64]
    cam_xpos: NDArray[np.float64]
    cdof: NDArray[np.float64]
    cfrc_ext: NDArray[np.float64]
    cfrc_int: NDArray[np.float64]
    cinert: NDArray[np.float64]
    contact: MjContactList
    ctrl: NDArray[np.float64]
    cvel: NDArray[np.float64]
    efc_D: NDArray[np.float64]
    efc_J: NDArray[np.float64]
    efc_R: NDArray[np.float64]
    efc_aref: NDArray[np.float64]
    efc_force: NDArray[np.float64]
    efc_vel: NDArray[np.float64]
    energy: NDArray[np.float64]
    eq_active: NDArray[np.bool_]
    geom_xmat: NDArray[np.float64]
    geom_xpos: NDArray[np.float64]
    geom_xquat: NDArray[np.float64]
    mocap_pos: NDArray[np.float64]
    mocap_quat: NDArray[np.float64]
    model: MjModel
    moment_colind: NDArray[np.int32]
    moment_rowadr: NDArray[np.int32]
    moment_rownnz: NDArray[np.int32]
    ncon: int
    ne: int
    nefc: int
    nf: int
    nl: int
    qacc: NDArray[np.float64]
    qacc_smooth: NDArray[np.float64]
    qacc_warmstart: NDArray[np.float64]
    qfrc_actuator: NDArray[np.float64]
    qfrc_applied: NDArray[np.float64]
    qfrc_bias: NDArray[np.float64]
    qfrc_constraint: NDArray[np.float64]
    qfrc_gravcomp: NDArray[np.float64]
    qfrc_inverse: NDArray[np.float64]
    qfrc_passive: NDArray[np.float64]
    qfrc_smooth: NDArray[np.float64]
    qpos: NDArray[np.float64]
    qvel: NDArray[np.float64]
    sensordata: NDArray[np.float64]
    site_xmat: NDArray[np.float64]
    site_xpos: NDArray[np.float64]
    site_xquat: NDArray[np.float64]
    subtree_angmom: NDArray[np.float64]
    subtree_com: NDArray[np.float64]
    subtree_linvel: NDArray[np.float64]
    ten_length: NDArray[np.float64]
    ten_velocity: NDArray[np.float64]
    time: float
    warning: MjWarningStatList
    xanchor: NDArray[np.float64]
    xaxis: NDArray[np.float64]
    xfrc_applied: NDArray[np.float64]
    ximat: NDArray[np.float64]
    xipos: NDArray[np.float64]
    xiquat: NDArray[np.float64]
    xmat: NDArray[np.float64]
    xpos: NDArray[np.float64]
    xquat: NDArray[np.float64]

    def actuator(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def body(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def cam(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def camera(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def geom(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def jnt(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def joint(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def sensor(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def site(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def ten(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def tendon(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

class MjModel:
    """A compiled scene, under MuJoCo's names. `MjModel.from_xml_path` and `MjModel.from_xml_string` make one.

    Arrays are NumPy's, with MuJoCo's shapes. What is written into one takes effect at the next step, under every contact
    law, and what follows from it is found anew, as if `mj_setConst` had been called. Arrays that cannot be changed without
    compiling a new scene (kinds, ids, numbers of things) are read-only."""

    actuator_actadr: NDArray[np.int32]
    actuator_actearly: NDArray[np.bool_]
    actuator_actlimited: NDArray[np.bool_]
    actuator_actnum: NDArray[np.int32]
    actuator_actrange: NDArray[np.float64]
    actuator_armature: NDArray[np.float64]
    actuator_biasprm: NDArray[np.float64]
    actuator_biastype: NDArray[np.int32]
    actuator_ctrllimited: NDArray[np.bool_]
    actuator_ctrlrange: NDArray[np.float64]
    actuator_damping: NDArray[np.float64]
    actuator_dyntype: NDArray[np.int32]
    actuator_forcelimited: NDArray[np.bool_]
    actuator_forcerange: NDArray[np.float64]
    actuator_gainprm: NDArray[np.float64]
    actuator_gaintype: NDArray[np.int32]
    actuator_gear: NDArray[np.float64]
    actuator_trnid: NDArray[np.int32]
    actuator_trntype: NDArray[np.int32]
    body_dofadr: NDArray[np.int32]
    body_dofnum: NDArray[np.int32]
    body_geomadr: NDArray[np.int32]
    body_geomnum: NDArray[np.int32]
    body_gravcomp: NDArray[np.float64]
    body_inertia: NDArray[np.float64]
    body_invweight0: NDArray[np.float64]
    body_ipos: NDArray[np.float64]
    body_iquat: NDArray[np.float64]
    body_jntadr: NDArray[np.int32]
    body_jntnum: NDArray[np.int32]
    body_mass: NDArray[np.float64]
    body_mocapid: NDArray[np.int32]
    body_parentid: NDArray[np.int32]
    body_pos: NDArray[np.float64]
    body_quat: NDArray[np.float64]
    body_rootid: NDArray[np.int32]
    body_subtreemass: NDArray[np.float64]
    body_treeid: NDArray[np.int32]
    body_weldid: NDArray[np.int32]
    cam_bodyid: NDArray[np.int32]
    cam_fovy: NDArray[np.float64]
    cam_mode: NDArray[np.int32]
    cam_pos: NDArray[np.float64]
    cam_quat: NDArray[np.float64]
    cam_targetbodyid: NDArray[np.int32]
    dof_armature: NDArray[np.float64]
    dof_bodyid: NDArray[np.int32]
    dof_damping: NDArray[np.float64]
    dof_frictionloss: NDArray[np.float64]
    dof_invweight0: NDArray[np.float64]
    dof_jntid: NDArray[np.int32]
    dof_parentid: NDArray[np.int32]
    dof_solimp: NDArray[np.float64]
    dof_solref: NDArray[np.float64]
    dof_treeid: NDArray[np.int32]
    eq_active0: NDArray[np.bool_]
    eq_solimp: NDArray[np.float64]
    eq_solref: NDArray[np.float64]
    eq_type: NDArray[np.int32]
    files: list
    geom_bodyid: NDArray[np.int32]
    geom_conaffinity: NDArray[np.int32]
    geom_condim: NDArray[np.int32]
    geom_contype: NDArray[np.int32]
    geom_friction: NDArray[np.float64]
    geom_gap: NDArray[np.float64]
    geom_group: NDArray[np.int32]
    geom_margin: NDArray[np.float64]
    geom_pos: NDArray[np.float64]
    geom_priority: NDArray[np.int32]
    geom_quat: NDArray[np.float64]
    geom_rbound: NDArray[np.float64]
    geom_rgba: NDArray[np.float32]
    geom_size: NDArray[np.float64]
    geom_solimp: NDArray[np.float64]
    geom_solmix: NDArray[np.float64]
    geom_solref: NDArray[np.float64]
    geom_type: NDArray[np.int32]
    jnt_actfrclimited: NDArray[np.bool_]
    jnt_actfrcrange: NDArray[np.float64]
    jnt_actgravcomp: NDArray[np.bool_]
    jnt_axis: NDArray[np.float64]
    jnt_bodyid: NDArray[np.int32]
    jnt_dofadr: NDArray[np.int32]
    jnt_limited: NDArray[np.bool_]
    jnt_margin: NDArray[np.float64]
    jnt_pos: NDArray[np.float64]
    jnt_qposadr: NDArray[np.int32]
    jnt_range: NDArray[np.float64]
    jnt_solimp: NDArray[np.float64]
    jnt_solref: NDArray[np.float64]
    jnt_stiffness: NDArray[np.float64]
    jnt_type: NDArray[np.int32]
    key_act: NDArray[np.float64]
    key_ctrl: NDArray[np.float64]
    key_mpos: NDArray[np.float64]
    key_mquat: NDArray[np.float64]
    key_qpos: NDArray[np.float64]
    key_qvel: NDArray[np.float64]
    key_time: NDArray[np.float64]
    nJmom: int
    na: int
    nactuator: int
    nbody: int
    ncam: int
    neq: int
    nflex: int
    ngeom: int
    nhfield: int
    njnt: int
    nkey: int
    nmesh: int
    nmocap: int
    nplugin: int
    npluginstate: int
    nq: int
    nsensor: int
    nsensordata: int
    nsite: int
    ntendon: int
    ntree: int
    nu: int
    nuserdata: int
    nv: int
    opt: MjOption
    qpos0: NDArray[np.float64]
    qpos_spring: NDArray[np.float64]
    scene_law: str | None
    sensor_adr: NDArray[np.int32]
    sensor_cutoff: NDArray[np.float64]
    sensor_datatype: NDArray[np.int32]
    sensor_dim: NDArray[np.int32]
    sensor_needstage: NDArray[np.int32]
    sensor_noise: NDArray[np.float64]
    sensor_objid: NDArray[np.int32]
    sensor_objtype: NDArray[np.int32]
    sensor_refid: NDArray[np.int32]
    sensor_reftype: NDArray[np.int32]
    sensor_type: NDArray[np.int32]
    site_bodyid: NDArray[np.int32]
    site_pos: NDArray[np.float64]
    site_quat: NDArray[np.float64]
    site_size: NDArray[np.float64]
    stat: MjStatistic
    tendon_actfrclimited: NDArray[np.bool_]
    tendon_actfrcrange: NDArray[np.float64]
    tendon_armature: NDArray[np.float64]
    tendon_damping: NDArray[np.float64]
    tendon_frictionloss: NDArray[np.float64]
    tendon_invweight0: NDArray[np.float64]
    tendon_length0: NDArray[np.float64]
    tendon_lengthspring: NDArray[np.float64]
    tendon_limited: NDArray[np.bool_]
    tendon_margin: NDArray[np.float64]
    tendon_range: NDArray[np.float64]
    tendon_solimp_fri: NDArray[np.float64]
    tendon_solimp_lim: NDArray[np.float64]
    tendon_solref_fri: NDArray[np.float64]
    tendon_solref_lim: NDArray[np.float64]
    tendon_stiffness: NDArray[np.float64]
    vis: MjVisual
    warnings: str

    def actuator(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def body(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def cam(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def camera(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def eq(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def equality(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    @staticmethod
    def from_xml_path(filename: str | PathLike[str], assets: dict[str, bytes] | None = None) -> MjModel:
        """Reads and compiles a file.

        Errors: `penny.SceneError` (a `ValueError`) with every problem of the file, each with its place."""

    @staticmethod
    def from_xml_string(xml: str, assets: dict[str, bytes] | None = None) -> MjModel:
        """The same from text."""

    def geom(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def jnt(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def joint(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def key(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def keyframe(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def sensor(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def site(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

    def tendon(self, name_or_id: str | int | None = None) -> View:
        """One of them by name or number, with its rows of all arrays.

        Errors: `KeyError` for a name, `IndexError` for a number that there is not; without either `KeyError`, which
        lists the names."""

class MjOption:
    """Options of a model; what is set takes effect at the next step.

    `law` is Penny's: 'mujoco' (the default in this module), 'penalty', 'tutorial'. `integrator` takes MuJoCo's numbers
    (`mjtIntegrator`) and Penny's names: 'explicit-euler', 'semi-implicit-euler', 'implicit-euler', 'rk4', 'implicitfast',
    'cash-karp', 'extrapolated-euler'."""

    cone: int
    density: float
    disableflags: int
    enableflags: int
    gravity: NDArray[np.float64]
    impratio: float
    integrator: int
    iterations: int
    law: str
    magnetic: NDArray[np.float64]
    noslip_iterations: int
    noslip_tolerance: float
    solver: int
    timestep: float
    tolerance: float
    viscosity: float
    wind: NDArray[np.float64]

class View:
    """One body, joint, geom … of a model or data: its rows of all arrays. What is written to them is written to the arrays."""

    def __getattr__(self, name: str) -> Any: ...
    def __setattr__(self, name: str, value: Any) -> None: ...
    id: int
    name: str

def check(text: str, name: str = 'scene.xml') -> list[Any]:
    """All problems of a scene's text, each with its place and cure: errors and warnings, in the order of the file."""

def explain(m: MjModel) -> list[dict[str, Any]]:
    """What the contacts of a scene mean in SI units under the law, integrator and timestep of `m.opt`: a list of
    dictionaries, one for each pair of geoms that can touch, ready for `pandas.DataFrame`.

    | key | what |
    |---|---|
    | `geom1`, `geom2` | names, or numbers where there is none |
    | `points`, `mass` | contact points; effective mass along the normal, kg |
    | `stiffness`, `damping` | N/m, N s/m at rest under the weight |
    | `restitution` | share of its speed that a fast impact gives back |
    | `rest_depth` | m |
    | `largest_timestep` | the largest at which the pair is stable, s, measured |

    `None` where the law has no such number."""

def get_mjcb_control() -> None:
    """That function, or `None`."""

def mj_applyFT(m: MjModel, d: MjData, force: ArrayLike, torque: ArrayLike, point: ArrayLike, body: int, qfrc_target: NDArray[np.float64]) -> None:
    """Adds to `qfrc_target` (nv) what a force (N) and a torque (N m) at a point of a body exert along the dofs."""

def mj_comPos(m: MjModel, d: MjData) -> None:
    """`subtree_com`, `cinert` and `cdof` are computed when they are read; this call changes nothing."""

def mj_contactForce(m: MjModel, d: MjData, id: int, result: NDArray[np.float64]) -> None:
    """Force and torque of a contact in its frame: normal, two tangential (N), torsional, two rolling (N m)."""

def mj_copyData(dest: Any, m: MjModel, src: Any) -> None:
    """`dest` becomes a copy of `src`: the state, and what belongs to it."""

def mj_differentiatePos(m: MjModel, qvel: NDArray[np.float64], dt: float, qpos1: ArrayLike, qpos2: ArrayLike) -> None:
    """The velocity (nv) that leads from `qpos1` to `qpos2` (nq) in a time `dt`, s, into `qvel`."""

def mj_energyPos(m: MjModel, d: MjData) -> None:
    """`energy` is computed when it is read; this call changes nothing."""

def mj_energyVel(m: MjModel, d: MjData) -> None:
    """`energy` is computed when it is read; this call changes nothing."""

def mj_forward(m: MjModel, d: MjData) -> None:
    """Everything at the state: poses, contacts, forces, accelerations, sensors. Nothing moves."""

def mj_fullM(m: MjModel, d: MjData, dst: NDArray[np.float64]) -> None:
    """The inertia matrix, (nv, nv), into `dst`."""

def mj_getTotalmass(m: MjModel) -> float:
    """Mass of all bodies, kg."""

def mj_id2name(m: MjModel, type: int, id: int) -> str | None:
    """The name of an id; `None` if it has none, or there is no such thing."""

def mj_integratePos(m: MjModel, qpos: NDArray[np.float64], qvel: ArrayLike, dt: float) -> None:
    """Moves `qpos` (nq) along the velocity `qvel` (nv) for a time `dt`, s."""

def mj_inverse(m: MjModel, d: MjData) -> None:
    """Inverse dynamics: the forces that accelerations `d.qacc` need at the state, into `d.qfrc_inverse`.

        qfrc_inverse = M qacc + qfrc_bias − qfrc_passive − Jᵀ f,    f each constraint's own formula at qacc

    Forces of contacts, `qfrc_constraint` and sensors are those at `qacc`, too."""

def mj_jac(m: MjModel, d: MjData, jacp: NDArray[np.float64] | None, jacr: NDArray[np.float64] | None, point: ArrayLike, body: int) -> None:
    """Jacobian of a point of the world that is attached to a body: `jacp` (linear) and `jacr` (angular), each (3, nv) or None."""

def mj_jacBody(m: MjModel, d: MjData, jacp: NDArray[np.float64] | None, jacr: NDArray[np.float64] | None, body: int) -> None:
    """Jacobian of the origin of a body's frame."""

def mj_jacBodyCom(m: MjModel, d: MjData, jacp: NDArray[np.float64] | None, jacr: NDArray[np.float64] | None, body: int) -> None:
    """Jacobian of a body's centre of mass."""

def mj_jacGeom(m: MjModel, d: MjData, jacp: NDArray[np.float64] | None, jacr: NDArray[np.float64] | None, geom: int) -> None:
    """Jacobian of a geom's centre."""

def mj_jacSite(m: MjModel, d: MjData, jacp: NDArray[np.float64] | None, jacr: NDArray[np.float64] | None, site: int) -> None:
    """Jacobian of a site's centre."""

def mj_jacSubtreeCom(m: MjModel, d: MjData, jacp: NDArray[np.float64] | None, body: int) -> None:
    """Jacobian of the centre of mass of a body and all that hangs on it: `jacp` (3, nv)."""

def mj_kinematics(m: MjModel, d: MjData) -> None:
    """Poses of everything at qpos and mocap poses, and nothing else, unless the model was changed."""

def mj_mulM(m: MjModel, d: MjData, res: NDArray[np.float64], vec: ArrayLike) -> None:
    """res = M vec"""

def mj_name2id(m: MjModel, type: int, name: str) -> int:
    """The id of a name; −1 if there is none."""

def mj_normalizeQuat(m: MjModel, qpos: NDArray[np.float64]) -> None:
    """Makes all quaternions of `qpos` (nq) unit quaternions."""

def mj_objectVelocity(m: MjModel, d: MjData, objtype: int, objid: int, res: NDArray[np.float64], flg_local: int) -> None:
    """Velocity of a body, geom or site at its centre: angular (rad/s), linear (m/s), into `res` (6); in world axes or, with
    `flg_local`, its own."""

def mj_ray(m: MjModel, d: MjData, pnt: Any, vec: ArrayLike, geomgroup: Any, flg_static: Any, bodyexclude: Any, geomid: Any, normal: Any = None) -> None:
    """Distance along a ray (in lengths of `vec`) from a point of the world to the nearest geom; −1 if there is none.

    Geoms are left out whose group `geomgroup` (6) says 0 for, with `flg_static` false those that never move, those of
    the body `bodyexclude` (−1: none), and what is quite transparent. `geomid` (1) gets the geom's id."""

def mj_resetData(m: MjModel, d: MjData) -> None:
    """The model's state at rest: `qpos0`, time 0, no controls or applied forces. All that follows from it is computed."""

def mj_resetDataKeyframe(m: MjModel, d: MjData, key: int) -> None:
    """The state of a keyframe.

    Errors: `IndexError` if there is no such keyframe."""

def mj_rnePostConstraint(m: MjModel, d: MjData) -> None:
    """`cacc`, `cfrc_ext` and `cfrc_int` are computed when they are read; this call changes nothing."""

def mj_setConst(m: MjModel, d: MjData) -> None:
    """Takes up what was written into the model now instead of at the next step."""

def mj_step(m: MjModel, d: MjData, nstep: int = 1) -> None:
    """Advances by `nstep` timesteps.

    Errors: `penny.StepError` where the run diverges; `d` then holds what the failed step left."""

def mj_step1(m: MjModel, d: MjData) -> None:
    """The first half of a step, before controls and forces are set: everything at the state."""

def mj_step2(m: MjModel, d: MjData) -> None:
    """The second half of a step, with the controls and forces that are set now. As in MuJoCo RK4 becomes Euler here."""

def mj_subtreeVel(m: MjModel, d: MjData) -> None:
    """`subtree_linvel` and `subtree_angmom` are computed when they are read; this call changes nothing."""

def save_video(path: str | PathLike[str], frames: list[NDArray[np.uint8]], fps: float | None = None) -> None:
    """Writes pictures, each (height, width, 3) and uint8, as a video: .gif, .apng, .png (the last one), and with ffmpeg .mp4
    and .webm."""

def set_mjcb_control(callback: Any) -> None:
    """Calls `callback(m, d)` in every step, `mj_forward` and `mj_step1` of every model; `None`: no more."""
