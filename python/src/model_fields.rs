//! The arrays of `MjModel`: name, shape, where the numbers are, and what a write changes.

use penny::math::{Quat, Vec3, quat, vec3, wxyz};
use penny::model::{
    Activation, Actuator as Drive, CameraMode, EqualityKind, JointKind, Model, Object, Parts, SensorKind, Transmission,
};
use penny::quantities;

use crate::values::Type::{self, Flag, Int, Real, Single};

/// What an array has a row for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    Body,
    Joint,
    Dof,
    Qpos,
    Geom,
    Site,
    Actuator,
    Sensor,
    Key,
    Camera,
    Tendon,
    Equality,
}

impl Per {
    /// How many rows.
    pub fn rows(self, m: &Model) -> usize {
        match self {
            Per::Body => m.bodies.len(),
            Per::Joint => m.joints.len(),
            Per::Dof => m.nv,
            Per::Qpos => m.nq,
            Per::Geom => m.geoms.len(),
            Per::Site => m.sites.len(),
            Per::Actuator => m.actuators.len(),
            Per::Sensor => m.sensors.len(),
            Per::Key => m.keyframes.len(),
            Per::Camera => m.cameras.len(),
            Per::Tendon => m.tendons.len(),
            Per::Equality => m.equalities.len(),
        }
    }
}

/// Numbers in a row: one, and then the array has one dimension; a fixed number; or as many as the model says.
#[derive(Clone, Copy, Debug)]
pub enum Width {
    One,
    Many(usize),
    Of(fn(&Model) -> usize),
}
use Width::{Many, Of, One};

/// Changes a row of the scene.
///
/// Errors: why that cannot be changed.
pub type Set = fn(&mut Parts, usize, &[f64]) -> Result<(), &'static str>;

/// An array of the model.
pub struct Field {
    pub name: &'static str,
    pub per: Per,
    pub width: Width,
    pub kind: Type,
    /// Row i.
    pub get: fn(&Model, usize) -> Vec<f64>,
    /// `None`: the array cannot be written.
    pub set: Option<Set>,
}

impl Field {
    pub fn shape(&self, m: &Model) -> Vec<usize> {
        let rows = self.per.rows(m);
        match self.width {
            One => vec![rows],
            Many(n) => vec![rows, n],
            Of(n) => vec![rows, n(m)],
        }
    }

    pub fn numbers(&self, m: &Model) -> Vec<f64> {
        (0..self.per.rows(m)).flat_map(|i| (self.get)(m, i)).collect()
    }
}

const fn fixed(name: &'static str, per: Per, width: Width, kind: Type, get: fn(&Model, usize) -> Vec<f64>) -> Field {
    Field { name, per, width, kind, get, set: None }
}

const fn field(name: &'static str, per: Per, width: Width, get: fn(&Model, usize) -> Vec<f64>, set: Set) -> Field {
    Field { name, per, width, kind: Real, get, set: Some(set) }
}

fn v3(v: &Vec3) -> Vec<f64> {
    v.as_slice().to_vec()
}

fn q4(q: &Quat) -> Vec<f64> {
    wxyz(q).to_vec()
}

/// An index, or −1 for none.
fn id(of: Option<usize>) -> f64 {
    of.map_or(-1.0, |i| i as f64)
}

/// Where a range begins, or −1 if it is empty.
fn start(range: &std::ops::Range<usize>) -> f64 {
    id((!range.is_empty()).then_some(range.start))
}

/// Bounds that are there can be moved.
fn bound(range: &mut Option<[f64; 2]>, v: &[f64]) -> Result<(), &'static str> {
    match range {
        Some(range) => *range = [v[0], v[1]],
        None if v == [0.0; 2] => {}
        None => return Err("nothing is limited there: that has to stand in the file"),
    }
    Ok(())
}

/// Numbers where Penny has three and MuJoCo ten.
fn ten(first: [f64; 3]) -> Vec<f64> {
    let mut all = vec![0.0; 10];
    all[..3].copy_from_slice(&first);
    all
}

fn three(v: &[f64], to: &mut [f64; 3]) -> Result<(), &'static str> {
    if v[3..].iter().any(|x| *x != 0.0) {
        return Err("Penny's actuators have three parameters");
    }
    to.copy_from_slice(&v[..3]);
    Ok(())
}

/// Damping and armature that actuators give what they move: MuJoCo's arrays have them apart, a model's joints and tendons with
/// their own.
fn rotor(m: &Parts, moves: impl Fn(Transmission) -> bool) -> [f64; 2] {
    let given = m.actuators.iter().filter(|a| moves(a.transmission)).map(Drive::rotor);
    given.fold([0.0; 2], |sum, more| [sum[0] + more[0], sum[1] + more[1]])
}

fn dof_rotor(m: &Parts, i: usize) -> [f64; 2] {
    rotor(m, |t| matches!(t, Transmission::Joint(j) | Transmission::JointInParent(j) if m.joints[j].dofadr == i))
}

fn tendon_rotor(m: &Parts, i: usize) -> [f64; 2] {
    rotor(m, |t| matches!(t, Transmission::Tendon(of) if of == i))
}

/// Type and id of what a sensor is about, MuJoCo's numbers.
fn object(of: Option<Object>) -> [f64; 2] {
    let (kind, i) = match of {
        None => (0, None),
        Some(Object::World) => (0, None),
        Some(Object::Body(b)) => (1, Some(b)),
        Some(Object::Xbody(b)) => (2, Some(b)),
        Some(Object::Joint(j)) => (3, Some(j)),
        Some(Object::Geom(g)) => (5, Some(g)),
        Some(Object::Site(s)) => (6, Some(s)),
        Some(Object::Tendon(t)) => (18, Some(t)),
        Some(Object::Actuator(a)) => (19, Some(a)),
    };
    [f64::from(kind), id(i)]
}

/// mjtJoint
pub fn joint_kind(kind: JointKind) -> f64 {
    match kind {
        JointKind::Free => 0.0,
        JointKind::Ball => 1.0,
        JointKind::Slide => 2.0,
        JointKind::Hinge => 3.0,
    }
}

/// mjtGeom, by the shape's name.
pub fn geom_kind(name: &str) -> f64 {
    const NAMES: [&str; 9] = ["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"];
    id(NAMES.iter().position(|n| *n == name))
}

/// mjtSensor of the element's name, as `penny.mjtSensor` has it.
fn sensor_kind(kind: SensorKind) -> f64 {
    const NAMES: [&str; 47] = [
        "touch", "accelerometer", "velocimeter", "gyro", "force", "torque", "magnetometer", "rangefinder",
        "camprojection", "jointpos", "jointvel", "tendonpos", "tendonvel", "actuatorpos", "actuatorvel", "actuatorfrc",
        "jointactuatorfrc", "tendonactuatorfrc", "ballquat", "ballangvel", "jointlimitpos", "jointlimitvel",
        "jointlimitfrc", "tendonlimitpos", "tendonlimitvel", "tendonlimitfrc", "framepos", "framequat", "framexaxis",
        "frameyaxis", "framezaxis", "framelinvel", "frameangvel", "framelinacc", "frameangacc", "subtreecom",
        "subtreelinvel", "subtreeangmom", "insidesite", "distance", "normal", "fromto", "contact", "e_potential",
        "e_kinetic", "clock", "tactile",
    ];
    id(NAMES.iter().position(|n| *n == kind.name()))
}

/// mjtStage at which a sensor is computed: 1 position, 2 velocity, 3 acceleration.
fn stage(kind: SensorKind) -> f64 {
    use SensorKind::*;
    match kind {
        Magnetometer | RangeFinder | JointPos | ActuatorPos | BallQuat | JointLimitPos | TendonPos | TendonLimitPos
        | FramePos | FrameQuat | FrameXAxis | FrameYAxis | FrameZAxis | SubtreeCom | InsideSite | PotentialEnergy
        | KineticEnergy | Clock => 1.0,
        Velocimeter | Gyro | JointVel | ActuatorVel | BallAngVel | JointLimitVel | TendonVel | TendonLimitVel
        | FrameLinVel | FrameAngVel | SubtreeLinVel | SubtreeAngMom => 2.0,
        _ => 3.0,
    }
}

/// mjtDataType: 0 number, 1 not negative, 2 unit vector, 3 quaternion.
fn data_type(kind: SensorKind) -> f64 {
    use SensorKind::*;
    match kind {
        FrameXAxis | FrameYAxis | FrameZAxis => 2.0,
        FrameQuat | BallQuat => 3.0,
        _ if kind.positive() => 1.0,
        _ => 0.0,
    }
}

use Per::{Actuator, Body, Camera, Dof, Equality, Geom, Joint, Key, Qpos, Sensor, Site, Tendon};

/// All of them, as MuJoCo names them.
pub const FIELDS: &[Field] = &[
    fixed("body_parentid", Body, One, Int, |m, i| vec![m.bodies[i].parent as f64]),
    fixed("body_rootid", Body, One, Int, |m, i| vec![if i == 0 { 0.0 } else { quantities::root(m, i) as f64 }]),
    fixed("body_weldid", Body, One, Int, |m, i| vec![m.bodies[i].weld as f64]),
    fixed("body_mocapid", Body, One, Int, |m, i| vec![id(m.mocap.iter().position(|b| *b == i))]),
    fixed("body_jntnum", Body, One, Int, |m, i| vec![m.bodies[i].joints.len() as f64]),
    fixed("body_jntadr", Body, One, Int, |m, i| vec![start(&m.bodies[i].joints)]),
    fixed("body_dofnum", Body, One, Int, |m, i| vec![m.bodies[i].dofs.len() as f64]),
    fixed("body_dofadr", Body, One, Int, |m, i| vec![start(&m.bodies[i].dofs)]),
    fixed("body_geomnum", Body, One, Int, |m, i| vec![m.bodies[i].geoms.len() as f64]),
    fixed("body_geomadr", Body, One, Int, |m, i| vec![start(&m.bodies[i].geoms)]),
    fixed("body_treeid", Body, One, Int, |m, i| vec![id(m.bodies[i].tree)]),
    fixed("body_subtreemass", Body, One, Real, |m, i| vec![quantities::subtree_mass(m)[i]]),
    fixed("body_invweight0", Body, Many(2), Real, |m, i| m.bodies[i].invweight0.to_vec()),
    field(
        "body_pos",
        Body,
        Many(3),
        |m, i| v3(&m.bodies[i].pos),
        |m, i, v| {
            m.bodies[i].pos = vec3(v);
            Ok(())
        },
    ),
    field(
        "body_quat",
        Body,
        Many(4),
        |m, i| q4(&m.bodies[i].quat),
        |m, i, v| {
            m.bodies[i].quat = quat(v);
            Ok(())
        },
    ),
    field(
        "body_ipos",
        Body,
        Many(3),
        |m, i| v3(&m.bodies[i].ipos),
        |m, i, v| {
            m.bodies[i].ipos = vec3(v);
            Ok(())
        },
    ),
    field(
        "body_iquat",
        Body,
        Many(4),
        |m, i| q4(&m.bodies[i].iquat),
        |m, i, v| {
            m.bodies[i].iquat = quat(v);
            Ok(())
        },
    ),
    field(
        "body_mass",
        Body,
        One,
        |m, i| vec![m.bodies[i].mass],
        |m, i, v| {
            m.bodies[i].mass = v[0];
            Ok(())
        },
    ),
    field(
        "body_inertia",
        Body,
        Many(3),
        |m, i| v3(&m.bodies[i].inertia),
        |m, i, v| {
            m.bodies[i].inertia = vec3(v);
            Ok(())
        },
    ),
    field(
        "body_gravcomp",
        Body,
        One,
        |m, i| vec![m.bodies[i].gravcomp],
        |m, i, v| {
            m.bodies[i].gravcomp = v[0];
            Ok(())
        },
    ),
    fixed("jnt_type", Joint, One, Int, |m, i| vec![joint_kind(m.joints[i].kind)]),
    fixed("jnt_qposadr", Joint, One, Int, |m, i| vec![m.joints[i].qposadr as f64]),
    fixed("jnt_dofadr", Joint, One, Int, |m, i| vec![m.joints[i].dofadr as f64]),
    fixed("jnt_bodyid", Joint, One, Int, |m, i| vec![m.joints[i].body as f64]),
    fixed("jnt_limited", Joint, One, Flag, |m, i| vec![f64::from(m.joints[i].range.is_some())]),
    fixed("jnt_actfrclimited", Joint, One, Flag, |m, i| vec![f64::from(m.joints[i].actfrcrange.is_some())]),
    fixed("jnt_actgravcomp", Joint, One, Flag, |m, i| vec![f64::from(m.joints[i].actgravcomp)]),
    field(
        "jnt_pos",
        Joint,
        Many(3),
        |m, i| v3(&m.joints[i].pos),
        |m, i, v| {
            m.joints[i].pos = vec3(v);
            Ok(())
        },
    ),
    field(
        "jnt_axis",
        Joint,
        Many(3),
        |m, i| v3(&m.joints[i].axis),
        |m, i, v| {
            let axis = vec3(v);
            let unit = axis.try_normalize(penny::math::MIN_VAL).ok_or("an axis of a joint has a direction")?;
            m.joints[i].axis = unit;
            Ok(())
        },
    ),
    field(
        "jnt_stiffness",
        Joint,
        One,
        |m, i| vec![m.joints[i].stiffness],
        |m, i, v| {
            m.joints[i].stiffness = v[0];
            Ok(())
        },
    ),
    field(
        "jnt_range",
        Joint,
        Many(2),
        |m, i| m.joints[i].range.unwrap_or_default().to_vec(),
        |m, i, v| bound(&mut m.joints[i].range, v),
    ),
    field(
        "jnt_actfrcrange",
        Joint,
        Many(2),
        |m, i| m.joints[i].actfrcrange.unwrap_or_default().to_vec(),
        |m, i, v| bound(&mut m.joints[i].actfrcrange, v),
    ),
    field(
        "jnt_margin",
        Joint,
        One,
        |m, i| vec![m.joints[i].margin],
        |m, i, v| {
            m.joints[i].margin = v[0];
            Ok(())
        },
    ),
    field(
        "jnt_solref",
        Joint,
        Many(2),
        |m, i| m.joints[i].solref_limit.to_vec(),
        |m, i, v| {
            m.joints[i].solref_limit.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "jnt_solimp",
        Joint,
        Many(5),
        |m, i| m.joints[i].solimp_limit.to_vec(),
        |m, i, v| {
            m.joints[i].solimp_limit.copy_from_slice(v);
            Ok(())
        },
    ),
    fixed("dof_bodyid", Dof, One, Int, |m, i| vec![m.dofs[i].body as f64]),
    fixed("dof_jntid", Dof, One, Int, |m, i| vec![m.dofs[i].joint as f64]),
    fixed("dof_treeid", Dof, One, Int, |m, i| vec![id(m.bodies[m.dofs[i].body].tree)]),
    fixed("dof_parentid", Dof, One, Int, |m, i| {
        let body = &m.bodies[m.dofs[i].body];
        let parent = &m.bodies[m.bodies[body.parent].weld].dofs;
        let before = if i > body.dofs.start { body.dofs.start..i } else { parent.clone() };
        vec![id(before.last())]
    }),
    fixed("dof_invweight0", Dof, One, Real, |m, i| vec![m.dofs[i].invweight0]),
    field(
        "dof_damping",
        Dof,
        One,
        |m, i| vec![m.dofs[i].damping - dof_rotor(m, i)[0]],
        |m, i, v| {
            m.dofs[i].damping = v[0] + dof_rotor(m, i)[0];
            Ok(())
        },
    ),
    field(
        "dof_armature",
        Dof,
        One,
        |m, i| vec![m.dofs[i].armature - dof_rotor(m, i)[1]],
        |m, i, v| {
            m.dofs[i].armature = v[0] + dof_rotor(m, i)[1];
            Ok(())
        },
    ),
    field(
        "dof_frictionloss",
        Dof,
        One,
        |m, i| vec![m.dofs[i].frictionloss],
        |m, i, v| {
            m.dofs[i].frictionloss = v[0];
            Ok(())
        },
    ),
    fixed("dof_solref", Dof, Many(2), Real, |m, i| m.joints[m.dofs[i].joint].solref_friction.to_vec()),
    fixed("dof_solimp", Dof, Many(5), Real, |m, i| m.joints[m.dofs[i].joint].solimp_friction.to_vec()),
    field(
        "qpos0",
        Qpos,
        One,
        |m, i| vec![m.qpos0[i]],
        |m, i, v| {
            m.qpos0[i] = v[0];
            Ok(())
        },
    ),
    field(
        "qpos_spring",
        Qpos,
        One,
        |m, i| vec![spring(m, i)],
        |m, i, v| {
            let slides = |j: &&mut penny::model::Joint| j.qposadr == i && j.kind.nv() == 1;
            match m.joints.iter_mut().find(slides) {
                Some(joint) => joint.springref = v[0],
                None if v[0] == m.qpos0[i] => {}
                None => return Err("springs of free and ball joints are at rest in qpos0"),
            }
            Ok(())
        },
    ),
    fixed("geom_type", Geom, One, Int, |m, i| vec![geom_kind(m.geoms[i].kind.name())]),
    fixed("geom_bodyid", Geom, One, Int, |m, i| vec![m.geoms[i].body as f64]),
    fixed("geom_contype", Geom, One, Int, |m, i| vec![f64::from(m.geoms[i].contype as i32)]),
    fixed("geom_conaffinity", Geom, One, Int, |m, i| vec![f64::from(m.geoms[i].conaffinity as i32)]),
    fixed("geom_group", Geom, One, Int, |m, i| vec![f64::from(m.geoms[i].group)]),
    fixed("geom_rbound", Geom, One, Real, |m, i| vec![m.geoms[i].rbound]),
    Field {
        name: "geom_condim",
        per: Geom,
        width: One,
        kind: Int,
        get: |m, i| vec![m.geoms[i].condim as f64],
        set: Some(|m, i, v| {
            m.geoms[i].condim = v[0] as usize;
            Ok(())
        }),
    },
    Field {
        name: "geom_priority",
        per: Geom,
        width: One,
        kind: Int,
        get: |m, i| vec![f64::from(m.geoms[i].priority)],
        set: Some(|m, i, v| {
            m.geoms[i].priority = v[0] as i32;
            Ok(())
        }),
    },
    Field {
        name: "geom_rgba",
        per: Geom,
        width: Many(4),
        kind: Single,
        get: |m, i| m.geoms[i].rgba.iter().map(|x| f64::from(*x)).collect(),
        set: Some(|m, i, v| {
            m.geoms[i].rgba = [0, 1, 2, 3].map(|k| v[k] as f32);
            Ok(())
        }),
    },
    field(
        "geom_pos",
        Geom,
        Many(3),
        |m, i| v3(&m.geoms[i].pos),
        |m, i, v| {
            m.geoms[i].pos = vec3(v);
            Ok(())
        },
    ),
    field(
        "geom_quat",
        Geom,
        Many(4),
        |m, i| q4(&m.geoms[i].quat),
        |m, i, v| {
            m.geoms[i].quat = quat(v);
            Ok(())
        },
    ),
    field(
        "geom_size",
        Geom,
        Many(3),
        |m, i| v3(&m.geoms[i].size),
        |m, i, v| {
            m.geoms[i].size = vec3(v);
            Ok(())
        },
    ),
    field(
        "geom_friction",
        Geom,
        Many(3),
        |m, i| m.geoms[i].friction.to_vec(),
        |m, i, v| {
            m.geoms[i].friction.copy_from_slice(v);
            m.tutorial.follow_friction();
            Ok(())
        },
    ),
    field(
        "geom_solmix",
        Geom,
        One,
        |m, i| vec![m.geoms[i].solmix],
        |m, i, v| {
            m.geoms[i].solmix = v[0];
            Ok(())
        },
    ),
    field(
        "geom_solref",
        Geom,
        Many(2),
        |m, i| m.geoms[i].solref.to_vec(),
        |m, i, v| {
            m.geoms[i].solref.copy_from_slice(v);
            m.tutorial.follow_solref();
            Ok(())
        },
    ),
    field(
        "geom_solimp",
        Geom,
        Many(5),
        |m, i| m.geoms[i].solimp.to_vec(),
        |m, i, v| {
            m.geoms[i].solimp.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "geom_margin",
        Geom,
        One,
        |m, i| vec![m.geoms[i].margin],
        |m, i, v| {
            m.geoms[i].margin = v[0];
            Ok(())
        },
    ),
    field(
        "geom_gap",
        Geom,
        One,
        |m, i| vec![m.geoms[i].gap],
        |m, i, v| {
            m.geoms[i].gap = v[0];
            Ok(())
        },
    ),
    fixed("site_bodyid", Site, One, Int, |m, i| vec![m.sites[i].body as f64]),
    field(
        "site_pos",
        Site,
        Many(3),
        |m, i| v3(&m.sites[i].pos),
        |m, i, v| {
            m.sites[i].pos = vec3(v);
            Ok(())
        },
    ),
    field(
        "site_quat",
        Site,
        Many(4),
        |m, i| q4(&m.sites[i].quat),
        |m, i, v| {
            m.sites[i].quat = quat(v);
            Ok(())
        },
    ),
    fixed("site_size", Site, Many(3), Real, |m, i| v3(&m.sites[i].size)),
    fixed("actuator_trntype", Actuator, One, Int, |m, i| {
        vec![match m.actuators[i].transmission {
            Transmission::Joint(_) => 0.0,
            Transmission::JointInParent(_) => 1.0,
            Transmission::SliderCrank { .. } => 2.0,
            Transmission::Tendon(_) => 3.0,
            Transmission::Site { .. } => 4.0,
        }]
    }),
    fixed("actuator_trnid", Actuator, Many(2), Int, |m, i| match m.actuators[i].transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => vec![j as f64, -1.0],
        Transmission::Tendon(t) => vec![t as f64, -1.0],
        Transmission::SliderCrank { crank, slider, .. } => vec![crank as f64, slider as f64],
        Transmission::Site { site, reference } => vec![site as f64, id(reference)],
    }),
    fixed("actuator_dyntype", Actuator, One, Int, |m, i| {
        vec![match m.actuators[i].activation {
            Activation::None => 0.0,
            Activation::Integrator => 1.0,
            Activation::Filter(_) => 2.0,
            Activation::ExactFilter(_) => 3.0,
        }]
    }),
    fixed("actuator_gaintype", Actuator, One, Int, |m, i| vec![f64::from(m.actuators[i].gain[1..] != [0.0; 2])]),
    fixed("actuator_biastype", Actuator, One, Int, |m, i| vec![f64::from(m.actuators[i].bias != [0.0; 3])]),
    fixed("actuator_actadr", Actuator, One, Int, |m, i| vec![id(m.actuators[i].act)]),
    fixed("actuator_actnum", Actuator, One, Int, |m, i| vec![f64::from(m.actuators[i].act.is_some())]),
    fixed("actuator_actearly", Actuator, One, Flag, |m, i| vec![f64::from(m.actuators[i].actearly)]),
    fixed("actuator_ctrllimited", Actuator, One, Flag, |m, i| vec![f64::from(m.actuators[i].ctrlrange.is_some())]),
    fixed("actuator_forcelimited", Actuator, One, Flag, |m, i| vec![f64::from(m.actuators[i].forcerange.is_some())]),
    fixed("actuator_actlimited", Actuator, One, Flag, |m, i| vec![f64::from(m.actuators[i].actrange.is_some())]),
    field(
        "actuator_gear",
        Actuator,
        Many(6),
        |m, i| m.actuators[i].gear.to_vec(),
        |m, i, v| {
            m.actuators[i].gear.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "actuator_damping",
        Actuator,
        One,
        |m, i| vec![m.actuators[i].damping],
        |m, i, v| {
            m.actuators[i].damping = v[0];
            Ok(())
        },
    ),
    field(
        "actuator_armature",
        Actuator,
        One,
        |m, i| vec![m.actuators[i].armature],
        |m, i, v| {
            m.actuators[i].armature = v[0];
            Ok(())
        },
    ),
    field(
        "actuator_gainprm",
        Actuator,
        Many(10),
        |m, i| ten(m.actuators[i].gain),
        |m, i, v| three(v, &mut m.actuators[i].gain),
    ),
    field(
        "actuator_biasprm",
        Actuator,
        Many(10),
        |m, i| ten(m.actuators[i].bias),
        |m, i, v| three(v, &mut m.actuators[i].bias),
    ),
    field(
        "actuator_ctrlrange",
        Actuator,
        Many(2),
        |m, i| m.actuators[i].ctrlrange.unwrap_or_default().to_vec(),
        |m, i, v| bound(&mut m.actuators[i].ctrlrange, v),
    ),
    field(
        "actuator_forcerange",
        Actuator,
        Many(2),
        |m, i| m.actuators[i].forcerange.unwrap_or_default().to_vec(),
        |m, i, v| bound(&mut m.actuators[i].forcerange, v),
    ),
    field(
        "actuator_actrange",
        Actuator,
        Many(2),
        |m, i| m.actuators[i].actrange.unwrap_or_default().to_vec(),
        |m, i, v| bound(&mut m.actuators[i].actrange, v),
    ),
    fixed("sensor_type", Sensor, One, Int, |m, i| vec![sensor_kind(m.sensors[i].kind)]),
    fixed("sensor_datatype", Sensor, One, Int, |m, i| vec![data_type(m.sensors[i].kind)]),
    fixed("sensor_needstage", Sensor, One, Int, |m, i| vec![stage(m.sensors[i].kind)]),
    fixed("sensor_objtype", Sensor, One, Int, |m, i| vec![object(Some(m.sensors[i].object))[0]]),
    fixed("sensor_objid", Sensor, One, Int, |m, i| vec![object(Some(m.sensors[i].object))[1]]),
    fixed("sensor_reftype", Sensor, One, Int, |m, i| vec![object(m.sensors[i].reference)[0]]),
    fixed("sensor_refid", Sensor, One, Int, |m, i| vec![object(m.sensors[i].reference)[1]]),
    fixed("sensor_dim", Sensor, One, Int, |m, i| vec![m.sensors[i].kind.dim() as f64]),
    fixed("sensor_adr", Sensor, One, Int, |m, i| vec![m.sensors[i].adr as f64]),
    field(
        "sensor_cutoff",
        Sensor,
        One,
        |m, i| vec![m.sensors[i].cutoff],
        |m, i, v| {
            m.sensors[i].cutoff = v[0];
            Ok(())
        },
    ),
    field(
        "sensor_noise",
        Sensor,
        One,
        |m, i| vec![m.sensors[i].noise],
        |m, i, v| {
            m.sensors[i].noise = v[0];
            Ok(())
        },
    ),
    fixed("tendon_limited", Tendon, One, Flag, |m, i| vec![f64::from(m.tendons[i].range.is_some())]),
    fixed("tendon_actfrclimited", Tendon, One, Flag, |m, i| vec![f64::from(m.tendons[i].actfrcrange.is_some())]),
    fixed("tendon_length0", Tendon, One, Real, |m, i| vec![m.tendons[i].length0]),
    fixed("tendon_invweight0", Tendon, One, Real, |m, i| vec![m.tendons[i].invweight0]),
    field(
        "tendon_range",
        Tendon,
        Many(2),
        |m, i| m.tendons[i].range.unwrap_or_default().to_vec(),
        |m, i, v| bound(&mut m.tendons[i].range, v),
    ),
    field(
        "tendon_actfrcrange",
        Tendon,
        Many(2),
        |m, i| m.tendons[i].actfrcrange.unwrap_or_default().to_vec(),
        |m, i, v| bound(&mut m.tendons[i].actfrcrange, v),
    ),
    field(
        "tendon_margin",
        Tendon,
        One,
        |m, i| vec![m.tendons[i].margin],
        |m, i, v| {
            m.tendons[i].margin = v[0];
            Ok(())
        },
    ),
    field(
        "tendon_frictionloss",
        Tendon,
        One,
        |m, i| vec![m.tendons[i].frictionloss],
        |m, i, v| {
            m.tendons[i].frictionloss = v[0];
            Ok(())
        },
    ),
    field(
        "tendon_armature",
        Tendon,
        One,
        |m, i| vec![m.tendons[i].armature - tendon_rotor(m, i)[1]],
        |m, i, v| {
            m.tendons[i].armature = v[0] + tendon_rotor(m, i)[1];
            Ok(())
        },
    ),
    field(
        "tendon_stiffness",
        Tendon,
        One,
        |m, i| vec![m.tendons[i].stiffness[0]],
        |m, i, v| {
            m.tendons[i].stiffness[0] = v[0];
            Ok(())
        },
    ),
    field(
        "tendon_damping",
        Tendon,
        One,
        |m, i| vec![m.tendons[i].damping[0] - tendon_rotor(m, i)[0]],
        |m, i, v| {
            m.tendons[i].damping[0] = v[0] + tendon_rotor(m, i)[0];
            Ok(())
        },
    ),
    field(
        "tendon_lengthspring",
        Tendon,
        Many(2),
        |m, i| m.tendons[i].lengthspring.to_vec(),
        |m, i, v| {
            m.tendons[i].lengthspring.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "tendon_solref_lim",
        Tendon,
        Many(2),
        |m, i| m.tendons[i].solref_limit.to_vec(),
        |m, i, v| {
            m.tendons[i].solref_limit.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "tendon_solimp_lim",
        Tendon,
        Many(5),
        |m, i| m.tendons[i].solimp_limit.to_vec(),
        |m, i, v| {
            m.tendons[i].solimp_limit.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "tendon_solref_fri",
        Tendon,
        Many(2),
        |m, i| m.tendons[i].solref_friction.to_vec(),
        |m, i, v| {
            m.tendons[i].solref_friction.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "tendon_solimp_fri",
        Tendon,
        Many(5),
        |m, i| m.tendons[i].solimp_friction.to_vec(),
        |m, i, v| {
            m.tendons[i].solimp_friction.copy_from_slice(v);
            Ok(())
        },
    ),
    fixed("eq_active0", Equality, One, Flag, |m, i| vec![f64::from(m.equalities[i].active)]),
    fixed("eq_type", Equality, One, Int, |m, i| {
        vec![match m.equalities[i].kind {
            EqualityKind::Connect(_) => 0.0,
            EqualityKind::Weld { .. } => 1.0,
            EqualityKind::Joint { .. } => 2.0,
            EqualityKind::Tendon { .. } => 3.0,
        }]
    }),
    field(
        "eq_solref",
        Equality,
        Many(2),
        |m, i| m.equalities[i].solref.to_vec(),
        |m, i, v| {
            m.equalities[i].solref.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "eq_solimp",
        Equality,
        Many(5),
        |m, i| m.equalities[i].solimp.to_vec(),
        |m, i, v| {
            m.equalities[i].solimp.copy_from_slice(v);
            Ok(())
        },
    ),
    fixed("cam_bodyid", Camera, One, Int, |m, i| vec![m.cameras[i].body as f64]),
    fixed("cam_targetbodyid", Camera, One, Int, |m, i| vec![id(m.cameras[i].target)]),
    fixed("cam_mode", Camera, One, Int, |m, i| {
        vec![match m.cameras[i].mode {
            CameraMode::Fixed => 0.0,
            CameraMode::Track => 1.0,
            CameraMode::TrackCom => 2.0,
            CameraMode::TargetBody => 3.0,
            CameraMode::TargetBodyCom => 4.0,
        }]
    }),
    field(
        "cam_pos",
        Camera,
        Many(3),
        |m, i| v3(&m.cameras[i].pos),
        |m, i, v| {
            m.cameras[i].pos = vec3(v);
            Ok(())
        },
    ),
    field(
        "cam_quat",
        Camera,
        Many(4),
        |m, i| q4(&m.cameras[i].quat),
        |m, i, v| {
            m.cameras[i].quat = quat(v);
            Ok(())
        },
    ),
    field(
        "cam_fovy",
        Camera,
        One,
        |m, i| vec![m.cameras[i].fovy.to_degrees()],
        |m, i, v| {
            if !(v[0] > 0.0 && v[0] < 180.0) {
                return Err("a field of view is between 0 and 180 degrees");
            }
            m.cameras[i].fovy = v[0].to_radians();
            Ok(())
        },
    ),
    field(
        "key_time",
        Key,
        One,
        |m, i| vec![m.keyframes[i].time],
        |m, i, v| {
            m.keyframes[i].time = v[0];
            Ok(())
        },
    ),
    field(
        "key_qpos",
        Key,
        Of(|m| m.nq),
        |m, i| m.keyframes[i].qpos.clone(),
        |m, i, v| {
            m.keyframes[i].qpos.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "key_qvel",
        Key,
        Of(|m| m.nv),
        |m, i| m.keyframes[i].qvel.clone(),
        |m, i, v| {
            m.keyframes[i].qvel.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "key_ctrl",
        Key,
        Of(|m| m.actuators.len()),
        |m, i| m.keyframes[i].ctrl.clone(),
        |m, i, v| {
            m.keyframes[i].ctrl.copy_from_slice(v);
            Ok(())
        },
    ),
    field(
        "key_act",
        Key,
        Of(|m| m.na),
        |m, i| m.keyframes[i].act.clone(),
        |m, i, v| {
            m.keyframes[i].act.copy_from_slice(v);
            Ok(())
        },
    ),
    fixed("key_mpos", Key, Of(|m| 3 * m.mocap.len()), Real, |m, i| m.keyframes[i].mocap_pos.as_flattened().to_vec()),
    fixed("key_mquat", Key, Of(|m| 4 * m.mocap.len()), Real, |m, i| m.keyframes[i].mocap_quat.as_flattened().to_vec()),
];

/// Where a spring is at rest.
fn spring(m: &Model, i: usize) -> f64 {
    m.joints.iter().find(|j| j.qposadr == i && j.kind.nv() == 1).map_or(m.qpos0[i], |j| j.springref)
}

/// A name, and how many there are.
type Size = (&'static str, fn(&Model) -> usize);

/// How many there are of what.
pub const SIZES: &[Size] = &[
    ("nq", |m| m.nq),
    ("nv", |m| m.nv),
    ("nu", |m| m.actuators.len()),
    ("nactuator", |m| m.actuators.len()),
    ("na", |m| m.na),
    ("nbody", |m| m.bodies.len()),
    ("njnt", |m| m.joints.len()),
    ("ngeom", |m| m.geoms.len()),
    ("nsite", |m| m.sites.len()),
    ("nsensor", |m| m.sensors.len()),
    ("nsensordata", |m| m.nsensordata),
    ("nJmom", penny::quantities::moment_room),
    ("nkey", |m| m.keyframes.len()),
    ("ncam", |m| m.cameras.len()),
    ("ntendon", |m| m.tendons.len()),
    ("neq", |m| m.equalities.len()),
    ("nmocap", |m| m.mocap.len()),
    ("ntree", |m| m.trees.len()),
    ("nuserdata", |_| 0),
    ("nplugin", |_| 0),
    ("npluginstate", |_| 0),
    ("nflex", |_| 0),
    ("nmesh", |_| 0),
    ("nhfield", |_| 0),
];
