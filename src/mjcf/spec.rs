//! The scene as written, typed: defaults merged, names checked, but nothing computed yet.
//!
//! Numbers keep the file's units (degrees or radians as `<compiler angle>` says); the compiler converts. Each
//! item keeps the `node` it was read from, so that later problems can point at the file.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::document::NodeId;
pub use crate::kind::{Activation, ActuatorKind, CameraMode, Cone, GeomKind, JointKind, SensorKind};
pub use crate::mesh::Mesh;

#[derive(Clone, Debug)]
pub struct Spec {
    pub model_name: String,
    pub compiler: Compiler,
    pub option: OptionSpec,
    /// `<flag>`: name to enabled, all flags, defaults filled in.
    pub flags: BTreeMap<&'static str, bool>,
    pub world: Body,
    pub pairs: Vec<Pair>,
    pub excludes: Vec<Exclude>,
    pub tendons: Vec<Tendon>,
    pub equalities: Vec<Equality>,
    pub actuators: Vec<Actuator>,
    pub sensors: Vec<Sensor>,
    pub keyframes: Vec<Keyframe>,
    pub numerics: Vec<Numeric>,
    pub texts: Vec<Text>,
}

#[derive(Clone, Debug)]
pub struct Compiler {
    /// `angle="degree"` (MJCF's default) or radian.
    pub degree: bool,
    /// Three of xyzXYZ.
    pub eulerseq: [u8; 3],
    pub autolimits: bool,
    /// `None` is "auto".
    pub inertiafromgeom: Option<bool>,
    pub inertiagrouprange: [i32; 2],
    pub balanceinertia: bool,
    pub boundmass: f64,
    pub boundinertia: f64,
    /// −1: leave masses alone.
    pub settotalmass: f64,
}

/// `<option>`, defaults filled in. Attributes that Penny cannot honour were reported by the reader.
#[derive(Clone, Debug)]
pub struct OptionSpec {
    pub node: Option<NodeId>,
    pub timestep: f64,
    pub gravity: [f64; 3],
    /// The keyword.
    pub integrator: String,
    pub cone: Cone,
    pub impratio: f64,
    pub tolerance: f64,
    pub iterations: usize,
    pub noslip_iterations: usize,
    pub noslip_tolerance: f64,
    pub magnetic: [f64; 3],
    /// Of the medium.
    pub density: f64,
    pub viscosity: f64,
    pub wind: [f64; 3],
    /// Contact override (`<flag override>`): used only when that flag is enabled.
    pub o_margin: f64,
    pub o_solref: [f64; 2],
    pub o_solimp: [f64; 5],
    pub o_friction: [f64; 5],
}

#[derive(Clone, Debug, Default)]
pub struct Body {
    pub node: NodeId,
    pub name: Option<String>,
    pub pose: Pose,
    /// Seldom there, and large.
    pub inertial: Option<Box<Inertial>>,
    pub joints: Vec<Joint>,
    pub geoms: Vec<Geom>,
    pub sites: Vec<Site>,
    pub cameras: Vec<Camera>,
    pub visuals: Vec<Visual>,
    /// Child bodies in file order. `<frame>` elements are already gone: their poses are in `Pose::frames`.
    pub children: Vec<Body>,
    pub mocap: bool,
    pub gravcomp: f64,
}

/// `pos` and at most one orientation, in the enclosing body after all `frames`.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    pub pos: [f64; 3],
    /// Seldom given, and large.
    pub orientation: Option<Box<Orientation>>,
    /// Poses of the `<frame>` elements around this one, outermost first; each has no frames of its own.
    pub frames: Arc<[Pose]>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Orientation {
    Quat([f64; 4]),
    AxisAngle([f64; 4]),
    XyAxes([f64; 6]),
    ZAxis([f64; 3]),
    Euler([f64; 3]),
}

#[derive(Clone, Debug)]
pub struct Inertial {
    pub node: NodeId,
    pub pos: [f64; 3],
    pub orientation: Option<Box<Orientation>>,
    pub mass: f64,
    pub diaginertia: Option<[f64; 3]>,
    /// M11 M22 M33 M12 M13 M23
    pub fullinertia: Option<[f64; 6]>,
    /// `<frame>`s around it, outermost first.
    pub frames: Arc<[Pose]>,
}

#[derive(Clone, Debug)]
pub struct Joint {
    pub node: NodeId,
    pub name: Option<String>,
    pub kind: JointKind,
    pub pos: [f64; 3],
    pub axis: [f64; 3],
    pub springref: f64,
    pub reference: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub armature: f64,
    pub frictionloss: f64,
    /// Time constant (s) and damping ratio from which stiffness and damping follow.
    pub springdamper: Option<[f64; 2]>,
    pub actuatorfrcrange: Option<[f64; 2]>,
    pub actuatorfrclimited: Option<bool>,
    pub actuatorgravcomp: bool,
    pub range: Option<[f64; 2]>,
    /// `None` is "auto".
    pub limited: Option<bool>,
    pub margin: f64,
    pub solreflimit: [f64; 2],
    pub solimplimit: [f64; 5],
    pub solreffriction: [f64; 2],
    pub solimpfriction: [f64; 5],
    /// `<frame>`s around the joint, outermost first (they move its anchor and axis).
    pub frames: Arc<[Pose]>,
}

#[derive(Clone, Debug)]
pub struct Geom {
    pub node: NodeId,
    pub name: Option<String>,
    pub kind: GeomKind,
    pub pose: Pose,
    /// Seldom there, as `fluid`.
    pub fromto: Option<Box<[f64; 6]>>,
    pub size: [f64; 3],
    /// How many numbers of `size` were given.
    pub sizes: usize,
    pub mass: Option<f64>,
    pub density: f64,
    pub shellinertia: bool,
    pub contype: u32,
    pub conaffinity: u32,
    pub condim: usize,
    pub group: i32,
    pub priority: i32,
    pub friction: [f64; 3],
    pub solmix: f64,
    pub solref: [f64; 2],
    pub solimp: [f64; 5],
    pub margin: f64,
    pub gap: f64,
    /// `fluidcoef` of a geom that feels the medium as an ellipsoid.
    pub fluid: Option<Box<[f64; 5]>>,
    pub rgba: [f32; 4],
}

/// A geom that is only seen: a mesh. The compiler refuses it where something could touch it.
#[derive(Clone, Debug)]
pub struct Visual {
    pub node: NodeId,
    pub name: Option<String>,
    pub pose: Pose,
    /// `None` if it has no file.
    pub mesh: Option<Mesh>,
    /// Not the mesh but a simple shape that takes its size from it: pictures do not show it.
    pub fitted: bool,
    pub contype: u32,
    pub conaffinity: u32,
    pub rgba: [f32; 4],
}

#[derive(Clone, Debug)]
pub struct Site {
    pub node: NodeId,
    pub name: Option<String>,
    /// `None` for a mesh.
    pub kind: Option<GeomKind>,
    pub pose: Pose,
    pub fromto: Option<[f64; 6]>,
    pub size: [f64; 3],
}

#[derive(Clone, Debug)]
pub struct Camera {
    pub node: NodeId,
    pub name: Option<String>,
    pub mode: CameraMode,
    pub target: Option<String>,
    /// Degrees.
    pub fovy: f64,
    pub pose: Pose,
}

/// An element of `<sensor>`.
#[derive(Clone, Debug)]
pub struct Sensor {
    pub node: NodeId,
    pub name: Option<String>,
    pub kind: SensorKind,
    /// What it measures: a kind (`joint`, `actuator`, `site`, `body`, `xbody`, `geom`) and a name; empty for none.
    pub object: (String, String),
    /// The same of the frame in which it measures, or the site of `insidesite`.
    pub reference: Option<(String, String)>,
    pub cutoff: f64,
    pub noise: f64,
}

/// `<contact><pair>`
#[derive(Clone, Debug)]
pub struct Pair {
    pub node: NodeId,
    pub geom1: String,
    pub geom2: String,
    pub condim: usize,
    pub friction: [f64; 5],
    pub solref: [f64; 2],
    /// As MuJoCo: (0, 0) means "as solref".
    pub solreffriction: [f64; 2],
    pub solimp: [f64; 5],
    pub margin: f64,
    pub gap: f64,
}

/// `<contact><exclude>`
#[derive(Clone, Debug)]
pub struct Exclude {
    pub node: NodeId,
    pub body1: String,
    pub body2: String,
}

/// `<tendon><fixed>` or `<spatial>`
#[derive(Clone, Debug)]
pub struct Tendon {
    pub node: NodeId,
    pub name: Option<String>,
    pub path: Path,
    pub range: Option<[f64; 2]>,
    pub limited: Option<bool>,
    pub margin: f64,
    pub solreflimit: [f64; 2],
    pub solimplimit: [f64; 5],
    pub solreffriction: [f64; 2],
    pub solimpfriction: [f64; 5],
    pub stiffness: [f64; 3],
    /// (−1, −1): its length at `springref`.
    pub springlength: [f64; 2],
    pub damping: [f64; 3],
    pub frictionloss: f64,
    pub armature: f64,
    pub actuatorfrcrange: Option<[f64; 2]>,
    pub actuatorfrclimited: Option<bool>,
    pub width: f64,
    pub rgba: [f32; 4],
}

#[derive(Clone, Debug)]
pub enum Path {
    /// Joints and their coef.
    Fixed(Vec<(NodeId, String, f64)>),
    Spatial(Vec<(NodeId, Waypoint)>),
}

/// What a spatial tendon passes, by name.
#[derive(Clone, Debug)]
pub enum Waypoint {
    Site(String),
    Geom { geom: String, side: Option<String> },
    Pulley(f64),
}

/// An element of `<equality>`.
#[derive(Clone, Debug)]
pub struct Equality {
    pub node: NodeId,
    pub name: Option<String>,
    pub active: bool,
    pub solref: [f64; 2],
    pub solimp: [f64; 5],
    pub kind: EqualityKind,
}

#[derive(Clone, Debug)]
pub enum EqualityKind {
    Joint {
        joints: (String, Option<String>),
        polycoef: [f64; 5],
    },
    Tendon {
        tendons: (String, Option<String>),
        polycoef: [f64; 5],
    },
    /// `weld` where a torquescale is given.
    Bodies {
        body1: String,
        body2: Option<String>,
        anchor: [f64; 3],
        weld: Option<Weld>,
    },
    Sites {
        sites: [String; 2],
        torquescale: Option<f64>,
    },
}

#[derive(Clone, Copy, Debug)]
pub struct Weld {
    /// Position and quaternion; without one (0 0 0 0) the pose is that of `qpos0`.
    pub relpose: [f64; 7],
    pub torquescale: f64,
}

#[derive(Clone, Debug)]
pub struct Actuator {
    pub node: NodeId,
    pub name: Option<String>,
    pub kind: ActuatorKind,
    pub transmission: Transmission,
    pub gear: [f64; 6],
    pub ctrlrange: Option<[f64; 2]>,
    pub ctrllimited: Option<bool>,
    pub forcerange: Option<[f64; 2]>,
    pub forcelimited: Option<bool>,
    pub actrange: Option<[f64; 2]>,
    pub actlimited: Option<bool>,
    pub activation: Activation,
    pub actearly: bool,
    /// force = gain · (1, length, velocity) · input + bias · (1, length, velocity)
    pub gain: [f64; 3],
    pub bias: [f64; 3],
    /// Damping in place of −bias₂, in units of critical damping; 0: as bias says.
    pub dampratio: f64,
    /// The range of controls (or of activations) is that of the joint times this; 0: it is not.
    pub inheritrange: f64,
    /// Added to the joint, times gear².
    pub damping: f64,
    pub armature: f64,
}

/// What an actuator acts on, by name.
#[derive(Clone, Debug)]
pub enum Transmission {
    Joint(String),
    JointInParent(String),
    Site {
        site: String,
        reference: Option<String>,
    },
    Tendon(String),
    SliderCrank {
        crank: String,
        slider: String,
        rod: f64,
    },
    /// None that Penny has, which was reported.
    None,
}

#[derive(Clone, Debug, Default)]
pub struct Keyframe {
    pub node: NodeId,
    pub name: Option<String>,
    pub time: f64,
    pub qpos: Option<Vec<f64>>,
    pub qvel: Option<Vec<f64>>,
    pub ctrl: Option<Vec<f64>>,
    pub act: Option<Vec<f64>>,
    pub mpos: Option<Vec<f64>>,
    pub mquat: Option<Vec<f64>>,
    pub plastic: Option<Vec<f64>>,
}

#[derive(Clone, Debug)]
pub struct Numeric {
    pub node: NodeId,
    pub name: String,
    pub data: Vec<f64>,
}

#[derive(Clone, Debug)]
pub struct Text {
    pub node: NodeId,
    pub name: String,
    pub data: String,
}
