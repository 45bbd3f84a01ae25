//! What the world is: the compiled scene, in SI units and radians.
//!
//! Field names are MuJoCo's. Bodies, joints, dofs and geoms are numbered in MuJoCo's depth-first order, so
//! `qpos`, `qvel` and contact lists compare element by element. Body 0 is the world.
//! A `Model` is valid by construction: whatever could be wrong was reported by [`crate::compile`].

use std::collections::BTreeMap;
use std::ops::{Deref, Range};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::math::{Mat3, Quat, Vec3};
use crate::mesh::Mesh;
use crate::mjcf::Limits;

pub use crate::kind::{Activation, ActuatorKind, CameraMode, Cone, GeomKind, JointKind, SensorKind};

/// A compiled scene.
///
/// Its [`Parts`] are read through it: `model.bodies[1].mass`. They change only by [`Model::edit`], which keeps what follows
/// from them right and gives the model a new [revision](Model::revision), so that a step knows that something has changed.
#[derive(Clone, Debug)]
pub struct Model {
    parts: Parts,
    revision: u64,
}

impl Deref for Model {
    type Target = Parts;

    #[inline]
    fn deref(&self) -> &Parts {
        &self.parts
    }
}

impl Model {
    pub(crate) fn new(parts: Parts) -> Model {
        let mut model = Model { parts, revision: 0 };
        model.revise();
        model
    }

    /// A number that no other scene has: two models of the same revision are equal.
    #[inline]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// For the compiler and [`Model::edit`], which must [`revise`](Model::revise) afterwards.
    pub(crate) fn parts_mut(&mut self) -> &mut Parts {
        &mut self.parts
    }

    pub(crate) fn revise(&mut self) {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        self.revision = NEXT.fetch_add(1, Ordering::Relaxed);
    }
}

/// What a [`Model`] is made of.
#[derive(Clone, Debug)]
pub struct Parts {
    /// As in the file; empty if it has none.
    pub name: String,
    /// Length of qpos.
    pub nq: usize,
    /// Degrees of freedom: length of qvel.
    pub nv: usize,
    /// `<option>`
    pub opt: Options,
    /// The world first.
    pub bodies: Vec<Body>,
    /// By body.
    pub joints: Vec<Joint>,
    /// By joint.
    pub dofs: Vec<Dof>,
    /// By body.
    pub geoms: Vec<Geom>,
    /// By body.
    pub sites: Vec<Site>,
    /// By body.
    pub cameras: Vec<Camera>,
    /// By body: what is only seen.
    pub visuals: Vec<Visual>,
    /// In the order of the file.
    pub tendons: Vec<Tendon>,
    /// In the order of the file.
    pub equalities: Vec<Equality>,
    /// In the order of the file.
    pub actuators: Vec<Actuator>,
    /// In the order of the file.
    pub sensors: Vec<Sensor>,
    /// Number of activations.
    pub na: usize,
    /// Bodies that are placed from outside: see [`State`](crate::state::State).
    pub mocap: Vec<usize>,
    /// How many numbers the sensors give.
    pub nsensordata: usize,
    /// The moving parts of the scene; what is in no tree never moves.
    pub trees: Vec<Tree>,
    /// Geom pairs that can touch, in MuJoCo's contact order.
    pub pairs: Pairs,
    /// Contact parameters that occur, each once; [`Pair::mix`] and `Contact::mix` point here.
    pub mixes: Vec<Mix>,
    /// In the order of the file.
    pub keyframes: Vec<Keyframe>,
    /// `<custom>`: numbers by name, as in the file. No step looks at them: those of the tutorial's law are in `tutorial`.
    pub numerics: BTreeMap<String, Vec<f64>>,
    /// `<custom><text>` by name.
    pub texts: BTreeMap<String, String>,
    /// The tutorial law's parameters, from `<custom>` numerics `penny.*`.
    pub tutorial: TutorialParams,
    /// Position at which joints are at their `ref` and free bodies at their body pose.
    pub qpos0: Vec<f64>,
    /// What the scene requires.
    pub requires: Requirements,
}

/// `<option>` and `<flag>`, as far as they change what a supported scene does.
#[derive(Clone, Debug)]
pub struct Options {
    /// s, with which a [`Method`](crate::forward::Method) begins; a step takes the method's.
    pub timestep: f64,
    /// m/s²
    pub gravity: Vec3,
    /// The MJCF keyword: `Euler`, `RK4`, `implicit`, `implicitfast`, `discrete`. A step takes the method's.
    pub integrator: String,
    /// Friction cones of the `mujoco` law.
    pub cone: Cone,
    /// Ratio of friction to normal impedance of elliptic contacts.
    pub impratio: f64,
    /// Solver of the `mujoco` law: scaled improvement at which it stops; 0 means to rounding.
    pub tolerance: f64,
    /// Newton steps of the `mujoco` law at most.
    pub iterations: usize,
    /// Sweeps of the `mujoco` law over friction without regularisation, after Newton's method; 0: none.
    pub noslip_iterations: usize,
    /// Scaled improvement at which these end.
    pub noslip_tolerance: f64,
    /// `<flag>`
    pub flags: Flags,
    /// `<flag override="enable">`: for every contact, in place of what its geoms say.
    pub contact_override: Option<ContactOverride>,
    /// Density of the medium, kg/m³.
    pub density: f64,
    /// Its viscosity, Pa s.
    pub viscosity: f64,
    /// Its velocity, m/s.
    pub wind: Vec3,
    /// Magnetic flux density, which magnetometers measure, T.
    pub magnetic: Vec3,
}

/// `o_friction`, `o_solref`, `o_solimp`, `o_margin`; units as in [`Mix`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactOverride {
    /// As in [`Mix`].
    pub friction: [f64; 5],
    /// (time constant in s, damping ratio), or (−stiffness in 1/s², −damping in 1/s).
    pub solref: [f64; 2],
    /// d0, dwidth, width (m), midpoint, power.
    pub solimp: [f64; 5],
    /// Distance at which a contact begins to push, m.
    pub margin: f64,
}

/// `<flag>`: true means enabled.
#[derive(Clone, Debug)]
pub struct Flags {
    /// Contacts, limits, dry friction and equalities.
    pub constraint: bool,
    /// Equalities.
    pub equality: bool,
    /// Dry friction of joints and tendons.
    pub frictionloss: bool,
    /// Limits of joints and tendons.
    pub limit: bool,
    /// Contacts.
    pub contact: bool,
    /// Springs of joints and tendons.
    pub spring: bool,
    /// Dampers of joints and tendons.
    pub damper: bool,
    /// Gravity.
    pub gravity: bool,
    /// Controls are held within `ctrlrange`.
    pub clampctrl: bool,
    /// The `mujoco` law starts from the last acceleration.
    pub warmstart: bool,
    /// Bodies do not touch their parents. Compiled into the pairs: it cannot be changed later.
    pub filterparent: bool,
    /// Actuators.
    pub actuation: bool,
    /// Time constants are at least two timesteps.
    pub refsafe: bool,
    /// Semi-implicit Euler takes dampers implicitly.
    pub eulerdamp: bool,
    /// Regularisation from the exact inverse mass, not from `invweight0`.
    pub diagexact: bool,
    /// Sensors.
    pub sensor: bool,
    /// Sweeps over friction end in each island for itself.
    pub island: bool,
}

/// A rigid body.
#[derive(Clone, Debug)]
pub struct Body {
    /// As in the file; empty if it has none.
    pub name: String,
    /// Index of the body that it is attached to.
    pub parent: usize,
    /// Position in the parent's frame, m.
    pub pos: Vec3,
    /// Orientation.
    pub quat: Quat,
    /// Centre of mass in the body's frame, m.
    pub ipos: Vec3,
    /// Principal axes of inertia in the body's frame.
    pub iquat: Quat,
    /// kg
    pub mass: f64,
    /// Principal moments in the inertial frame, kg m².
    pub inertia: Vec3,
    /// Its own joints.
    pub joints: Range<usize>,
    /// Its own degrees of freedom.
    pub dofs: Range<usize>,
    /// Its own geoms.
    pub geoms: Range<usize>,
    /// The body whose joints move this one: itself if it has joints, else its nearest ancestor that has;
    /// 0 for whatever is fixed to the world. (MuJoCo's `body_weldid`.)
    pub weld: usize,
    /// Index into [`Parts::trees`]; `None` for what never moves.
    pub tree: Option<usize>,
    /// Mean inverse mass (1/kg) and mean inverse inertia (1/(kg m²)) seen at the COM in `qpos0`.
    pub invweight0: [f64; 2],
    /// Share of its weight that is compensated.
    pub gravcomp: f64,
}

/// A joint: how a body moves relative to its parent.
#[derive(Clone, Debug)]
pub struct Joint {
    /// As in the file; empty if it has none.
    pub name: String,
    /// How the body can move.
    pub kind: JointKind,
    /// The body that it belongs to.
    pub body: usize,
    /// Anchor in the body's frame, m.
    pub pos: Vec3,
    /// Unit axis in the body's frame.
    pub axis: Vec3,
    /// Where its numbers begin in qpos.
    pub qposadr: usize,
    /// Where its numbers begin in qvel.
    pub dofadr: usize,
    /// N/m or N m/rad, about `springref` (m or rad; for ball and free joints `qpos0` is the reference).
    pub stiffness: f64,
    /// Position at which its spring is at rest, m or rad.
    pub springref: f64,
    /// m or rad; for a ball joint `range[1]` is the largest rotation angle.
    pub range: Option<[f64; 2]>,
    /// Distance from a limit at which it begins to push, m or rad.
    pub margin: f64,
    /// Bounds of what all actuators together exert along a slide or hinge, N or N m.
    pub actfrcrange: Option<[f64; 2]>,
    /// Compensation of gravity is exerted by the actuators, within `actfrcrange`.
    pub actgravcomp: bool,
    /// `solref` of its limits.
    pub solref_limit: [f64; 2],
    /// `solimp` of its limits.
    pub solimp_limit: [f64; 5],
    /// `solref` of its dry friction.
    pub solref_friction: [f64; 2],
    /// `solimp` of its dry friction.
    pub solimp_friction: [f64; 5],
}

/// One degree of freedom.
#[derive(Clone, Debug)]
pub struct Dof {
    /// Index of the joint.
    pub joint: usize,
    /// The body that it belongs to.
    pub body: usize,
    /// N s/m or N m s/rad; with what actuators give it ([`Actuator::rotor`]), as its armature.
    pub damping: f64,
    /// Added to the diagonal of the inertia matrix: kg or kg m².
    pub armature: f64,
    /// Dry friction, N or N m.
    pub frictionloss: f64,
    /// Diagonal of M⁻¹ at `qpos0` (for free and ball joints the mean of each block of three).
    pub invweight0: f64,
}

/// A mesh that is only seen: it touches nothing and has no mass.
#[derive(Clone, Debug)]
pub struct Visual {
    /// The body that it belongs to.
    pub body: usize,
    /// Position in the body's frame, m.
    pub pos: Vec3,
    /// Orientation.
    pub quat: Quat,
    /// Its triangles.
    pub mesh: Mesh,
    /// Colour and opacity, 0 to 1.
    pub rgba: [f32; 4],
}

/// A shape of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Geom {
    /// As in the file; empty if it has none.
    pub name: String,
    /// Shape.
    pub kind: GeomKind,
    /// The body that it belongs to.
    pub body: usize,
    /// Position in the body's frame, m.
    pub pos: Vec3,
    /// Orientation.
    pub quat: Quat,
    /// Sphere: radius. Capsule, cylinder: radius, half-length. Box, ellipsoid: half-sizes. Plane: half-sizes,
    /// grid spacing (drawing only). m.
    pub size: Vec3,
    /// Radius of a sphere about the geom's centre that holds all of it; 0 for planes. m.
    pub rbound: f64,
    /// Bits that the other's `conaffinity` is compared with.
    pub contype: u32,
    /// Bits that the other's `contype` is compared with.
    pub conaffinity: u32,
    /// Directions of its contacts: 1, 3, 4 or 6.
    pub condim: usize,
    /// For drawing and `inertiagrouprange`.
    pub group: i32,
    /// The geom of higher priority gives a contact its parameters.
    pub priority: i32,
    /// Sliding (1), torsional (m), rolling (m).
    pub friction: [f64; 3],
    /// Weight in the mean of two geoms.
    pub solmix: f64,
    /// (time constant in s, damping ratio), or (−stiffness in 1/s², −damping in 1/s).
    pub solref: [f64; 2],
    /// d0, dwidth, width (m), midpoint, power.
    pub solimp: [f64; 5],
    /// Distance at which a contact begins to push, m.
    pub margin: f64,
    /// Further distance at which a contact is listed without pushing, m.
    pub gap: f64,
    /// How it feels a medium, if as an ellipsoid; otherwise the body does as a box.
    pub fluid: Option<Box<Fluid>>,
    /// Colour and opacity, 0 to 1.
    pub rgba: [f32; 4],
}

/// How a geom feels a medium as an ellipsoid; see [`Options::medium`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Coefficients of blunt, slender and angular drag, of Kutta and Magnus lift.
    pub coef: [f64; 5],
    /// Volume of the medium that it carries along each of its axes, m³.
    pub virtual_mass: Vec3,
    /// Its moments of inertia over the density of the medium, m⁵.
    pub virtual_inertia: Vec3,
}

/// A place on a body.
#[derive(Clone, Debug)]
pub struct Site {
    /// As in the file; empty if it has none.
    pub name: String,
    /// The body that it belongs to.
    pub body: usize,
    /// Position in the body's frame, m.
    pub pos: Vec3,
    /// Orientation.
    pub quat: Quat,
    /// Its volume, for sensors; `None` for a shape that Penny lacks. Size as in [`Geom::size`].
    pub kind: Option<GeomKind>,
    /// As of a geom, m.
    pub size: Vec3,
}

/// A place from which pictures are taken. No step looks at it.
#[derive(Clone, Debug)]
pub struct Camera {
    /// As in the file; empty if it has none.
    pub name: String,
    /// The body that it belongs to.
    pub body: usize,
    /// Position in the body's frame, m. The camera looks along −z; y is up in the picture.
    pub pos: Vec3,
    /// Orientation.
    pub quat: Quat,
    /// How it moves.
    pub mode: CameraMode,
    /// The body that it looks at, in the modes that have one.
    pub target: Option<usize>,
    /// Vertical field of view, rad.
    pub fovy: f64,
}

/// A length that depends on the position, and what acts along it; see [`crate::dynamics::tendon`].
#[derive(Clone, Debug)]
pub struct Tendon {
    /// As in the file; empty if it has none.
    pub name: String,
    /// What its length is.
    pub path: Path,
    /// Shortest and longest length, m (of fixed tendons that of coef times q).
    pub range: Option<[f64; 2]>,
    /// Distance from a limit at which it begins to push, m.
    pub margin: f64,
    /// `solref` of its limits.
    pub solref_limit: [f64; 2],
    /// `solimp` of its limits.
    pub solimp_limit: [f64; 5],
    /// `solref` of its dry friction.
    pub solref_friction: [f64; 2],
    /// `solimp` of its dry friction.
    pub solimp_friction: [f64; 5],
    /// Coefficients of its spring, by powers of the stretch beyond `lengthspring`: N/m, N/m², N/m³.
    pub stiffness: [f64; 3],
    /// Between these lengths its spring is slack, m.
    pub lengthspring: [f64; 2],
    /// Coefficients of its damper, by powers of its velocity: N s/m, N s²/m², N s³/m³.
    pub damping: [f64; 3],
    /// Dry friction, N.
    pub frictionloss: f64,
    /// Inertia along its length, kg.
    pub armature: f64,
    /// Bounds of what all actuators together exert along it, N.
    pub actfrcrange: Option<[f64; 2]>,
    /// Its length at `qpos0`, m.
    pub length0: f64,
    /// J M⁻¹ Jᵀ at `qpos0`, 1/kg.
    pub invweight0: f64,
    /// Radius for drawing, m.
    pub width: f64,
    /// Colour and opacity, 0 to 1.
    pub rgba: [f32; 4],
}

impl Tendon {
    /// Whether it has a spring, a damper or inertia.
    pub fn acts(&self) -> bool {
        self.armature != 0.0 || self.stiffness.iter().chain(&self.damping).any(|c| *c != 0.0)
    }

    /// Whether a geom is on its path.
    pub fn goes_round(&self) -> bool {
        matches!(&self.path, Path::Spatial(points) if points.iter().any(|p| matches!(p, Waypoint::Geom { .. })))
    }
}

impl Tendon {
    /// The bodies along its path.
    pub fn bodies(&self, joints: &[Joint], sites: &[Site], geoms: &[Geom]) -> Vec<usize> {
        match &self.path {
            Path::Fixed(parts) => parts.iter().map(|(j, _)| joints[*j].body).collect(),
            Path::Spatial(points) => points
                .iter()
                .filter_map(|point| match *point {
                    Waypoint::Site(s) => Some(sites[s].body),
                    Waypoint::Geom { geom, .. } => Some(geoms[geom].body),
                    Waypoint::Pulley(_) => None,
                })
                .collect(),
        }
    }
}

/// What a tendon's length is.
#[derive(Clone, Debug, PartialEq)]
pub enum Path {
    /// Σ coef q of slides and hinges: index of the joint, coef.
    Fixed(Vec<(usize, f64)>),
    /// That of the shortest way along what is listed.
    Spatial(Vec<Waypoint>),
}

/// What a spatial tendon passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Waypoint {
    /// It passes through this site.
    Site(usize),
    /// It goes round this sphere or cylinder, on the side of a site if one is given; inside if that site is inside.
    Geom {
        /// Index of the geom.
        geom: usize,
        /// Index of the site.
        side: Option<usize>,
    },
    /// A new branch begins, whose length counts divided by this.
    Pulley(f64),
}

/// Something that is held equal by forces: see [`crate::contact::ties`].
#[derive(Clone, Debug)]
pub struct Equality {
    /// As in the file; empty if it has none.
    pub name: String,
    /// Whether it holds at the start: after a change, from the next reset on. To switch it while the scene runs, write
    /// [`State::eq_active`](crate::state::State::eq_active).
    pub active: bool,
    /// What is equal.
    pub kind: EqualityKind,
    /// `solref`
    pub solref: [f64; 2],
    /// `solimp`
    pub solimp: [f64; 5],
}

/// What is held equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EqualityKind {
    /// The position of a slide or hinge is a polynomial of another's, both counted from `qpos0`.
    Joint {
        /// Index of the joint, and of the other.
        joints: (usize, Option<usize>),
        /// y = a₀ + a₁ x + …
        polycoef: [f64; 5],
    },
    /// The length of a tendon is a polynomial of another's, both counted from their length at `qpos0`.
    Tendon {
        /// Index of the tendon, and of the other.
        tendons: (usize, Option<usize>),
        /// y = a₀ + a₁ x + …
        polycoef: [f64; 5],
    },
    /// Two points are at the same place.
    Connect([Anchor; 2]),
    /// Two frames are the same.
    Weld {
        /// The frames.
        anchors: [Anchor; 2],
        /// What a rotation by one radian counts for, m.
        torquescale: f64,
        /// Whether the first follows from the second, so that they agree at `qpos0`: the file has no `relpose`.
        follows: bool,
    },
}

/// A frame that an equality holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// That of a site.
    Site(usize),
    /// One of a body, given in the body's frame (m).
    Body {
        /// Index of the body.
        body: usize,
        /// Its origin.
        pos: Vec3,
        /// Its orientation.
        quat: Quat,
    },
}

impl Anchor {
    /// The body, and the frame in it.
    pub fn place(&self, sites: &[Site]) -> (usize, Vec3, Quat) {
        match *self {
            Anchor::Site(s) => (sites[s].body, sites[s].pos, sites[s].quat),
            Anchor::Body { body, pos, quat } => (body, pos, quat),
        }
    }
}

/// A measurement, taken in every step.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// As in the file; empty if it has none.
    pub name: String,
    /// What it measures.
    pub kind: SensorKind,
    /// Of what.
    pub object: Object,
    /// The frame in which something is measured, `None` for the world's; of `insidesite` the site.
    pub reference: Option<Object>,
    /// Values are clipped to this; 0: they are not.
    pub cutoff: f64,
    /// Standard deviation that the file states; nothing is added to the values.
    pub noise: f64,
    /// Where in `sensordata` its first number is.
    pub adr: usize,
}

/// What a sensor is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Object {
    /// The world.
    World,
    /// The inertial frame of a body.
    Body(usize),
    /// The frame of a body.
    Xbody(usize),
    /// Index of a geom.
    Geom(usize),
    /// Index of a site.
    Site(usize),
    /// Index of a joint.
    Joint(usize),
    /// Index of an actuator.
    Actuator(usize),
    /// Index of a tendon.
    Tendon(usize),
}

/// A kinematic tree: bodies that hang together by joints, apart from the world.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Its bodies, parents first.
    pub bodies: Range<usize>,
    /// Its own degrees of freedom.
    pub dofs: Range<usize>,
    /// Its numbers in qpos.
    pub qpos: Range<usize>,
    /// `Some` if the tree is one rigid body on a free joint: then everything has a closed form.
    pub free: Option<FreeBody>,
    /// Whether any joint of the tree can turn a body.
    pub rotates: bool,
}

/// A free body and all that is welded to it, as one rigid body.
#[derive(Clone, Debug)]
pub struct FreeBody {
    /// kg
    pub mass: f64,
    /// Centre of mass in the body's frame, m.
    pub com: Vec3,
    /// Principal axes: columns are the axes, in the body's frame.
    pub axes: Mat3,
    /// Principal moments, kg m².
    pub inertia: Vec3,
}

/// Which geom pairs a step looks at.
#[derive(Clone, Debug)]
pub struct Pairs {
    /// Contacts that there may be at one time, and pairs near enough for one: `mjcf::Limits::contacts`.
    pub most_contacts: usize,
    /// All of them, in contact order, when they are few; otherwise those that the broad phase cannot find
    /// (planes against everything, `<contact><pair>`).
    pub listed: Vec<Pair>,
    /// Many geoms: the geoms among which a broad phase looks for pairs in each step. Empty when all are listed.
    pub swept: Vec<usize>,
    /// Body pairs (low, high) that never collide, by `<exclude>`. Sorted.
    pub excluded: Vec<(usize, usize)>,
    /// Swept geoms with the same class have the same contact parameters (indexed by geom).
    pub class: Vec<u32>,
    /// Index into [`Parts::mixes`] of each two classes: a square matrix, row by row.
    pub mix_table: Vec<u32>,
}

impl Default for Pairs {
    fn default() -> Pairs {
        Pairs {
            most_contacts: Limits::default().contacts,
            listed: Vec::new(),
            swept: Vec::new(),
            excluded: Vec::new(),
            class: Vec::new(),
            mix_table: Vec::new(),
        }
    }
}

/// Two geoms that can touch.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Lower geom kind first.
    pub geom: [usize; 2],
    /// Which collider serves them follows from these: `collision::collider`.
    pub kind: [GeomKind; 2],
    /// Index of the contact parameters in [`Parts::mixes`].
    pub mix: usize,
    /// The cheap test before the collider.
    pub bound: Bound,
    /// Which `<contact><pair>` of the file gives it.
    pub given: Option<usize>,
}

/// The cheap test that a pair has to pass before its collider runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// The collider is as cheap itself.
    None,
    /// The second centre is at most this high above the plane, m.
    Height(f64),
    /// The square of the distance between the centres is at most this, m².
    Distance2(f64),
}

impl Pair {
    /// The pair of two geoms, in contact order; none of two planes, which never move.
    pub fn new(geoms: &[Geom], [g1, g2]: [usize; 2], index: usize, mix: &Mix) -> Option<Pair> {
        use GeomKind::{Plane, Sphere};
        let key = |g: usize| (geoms[g].kind, g);
        let geom = if key(g1) <= key(g2) { [g1, g2] } else { [g2, g1] };
        let [a, b] = geom.map(|g| &geoms[g]);
        let reach = a.rbound + b.rbound + mix.margin + mix.gap;
        let bound = match (a.kind, b.kind) {
            (Plane, Plane) => return None,
            (Plane, Sphere) => Bound::None,
            (Plane, _) => Bound::Height(reach),
            _ => Bound::Distance2(reach * reach),
        };
        Some(Pair { geom, kind: [a.kind, b.kind], mix: index, bound, given: None })
    }
}

/// Parameters of a contact, mixed from its two geoms or given by `<contact><pair>`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mix {
    /// 1, 3, 4 or 6
    pub condim: usize,
    /// Two sliding (1), one torsional (m), two rolling (m); each at least 1e-5.
    pub friction: [f64; 5],
    /// (time constant in s, damping ratio), or (−stiffness in 1/s², −damping in 1/s).
    pub solref: [f64; 2],
    /// Reference of the friction rows; equals `solref` unless a `<pair>` gives its own.
    pub solreffriction: [f64; 2],
    /// d0, dwidth, width (m), midpoint, power.
    pub solimp: [f64; 5],
    /// A contact is found when dist ≤ margin + gap, and pushes when dist < margin. m.
    pub margin: f64,
    /// Further distance at which a contact is listed without pushing, m.
    pub gap: f64,
}

/// A force along a transmission: see [`crate::dynamics::actuation`].
#[derive(Clone, Debug)]
pub struct Actuator {
    /// As in the file; empty if it has none.
    pub name: String,
    /// How it was written.
    pub kind: ActuatorKind,
    /// What it acts on.
    pub transmission: Transmission,
    /// Ratio of the force along the transmission to its own; the first counts for slides and hinges.
    pub gear: [f64; 6],
    /// Bounds of the control.
    pub ctrlrange: Option<[f64; 2]>,
    /// Bounds of its force, N or N m.
    pub forcerange: Option<[f64; 2]>,
    /// How its activation follows its control.
    pub activation: Activation,
    /// Where in `act` its activation is, if it has one.
    pub act: Option<usize>,
    /// Bounds of the activation.
    pub actrange: Option<[f64; 2]>,
    /// The force is that of the next activation.
    pub actearly: bool,
    /// Force a unit of input, times (1, length, velocity).
    pub gain: [f64; 3],
    /// Force without input, times (1, length, velocity).
    pub bias: [f64; 3],
    /// What its joint or tendon has more times gear² for it: of damping, N s/m or N m s/rad.
    pub damping: f64,
    /// Of armature, kg or kg m².
    pub armature: f64,
}

impl Actuator {
    /// Damping and armature that its joint or tendon has for it.
    pub fn rotor(&self) -> [f64; 2] {
        [self.damping, self.armature].map(|x| self.gear[0] * self.gear[0] * x)
    }
}

/// What an actuator acts on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transmission {
    /// The axes of a joint.
    Joint(usize),
    /// A ball or free joint, turned about axes of its parent.
    JointInParent(usize),
    /// A wrench at a site, in its axes or in those of a reference.
    Site {
        /// Where it acts.
        site: usize,
        /// In whose axes, and against what.
        reference: Option<usize>,
    },
    /// The length of a tendon.
    Tendon(usize),
    /// The length of a slider-crank: of a rod between a crank and a slider.
    SliderCrank {
        /// Where the rod is on the crank.
        crank: usize,
        /// Where the slider begins; it moves along the z axis.
        slider: usize,
        /// Length of the rod, m.
        rod: f64,
    },
}

impl Options {
    /// Whether bodies move in a medium that they feel.
    pub fn medium(&self) -> bool {
        self.density > 0.0 || self.viscosity > 0.0
    }
}

impl Transmission {
    /// The joint along whose axes it acts.
    pub fn joint(self) -> Option<usize> {
        match self {
            Transmission::Joint(j) | Transmission::JointInParent(j) => Some(j),
            Transmission::Site { .. } | Transmission::Tendon(_) | Transmission::SliderCrank { .. } => None,
        }
    }

    /// The bodies on which it acts.
    pub fn bodies(self, joints: &[Joint], sites: &[Site], geoms: &[Geom], tendons: &[Tendon]) -> Vec<usize> {
        match self {
            Transmission::Joint(j) | Transmission::JointInParent(j) => vec![joints[j].body],
            Transmission::Site { site, reference } => {
                [Some(site), reference].into_iter().flatten().map(|s| sites[s].body).collect()
            }
            Transmission::Tendon(t) => tendons[t].bodies(joints, sites, geoms),
            Transmission::SliderCrank { crank, slider, .. } => vec![sites[crank].body, sites[slider].body],
        }
    }
}

impl Actuator {
    /// Whether its force does.
    pub fn depends_on_velocity(&self) -> bool {
        self.bias[2] != 0.0 || self.gain[2] != 0.0
    }
}

/// A state in the file, to start from.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// As in the file; empty if it has none.
    pub name: String,
    /// s
    pub time: f64,
    /// (nq)
    pub qpos: Vec<f64>,
    /// (nv)
    pub qvel: Vec<f64>,
    /// (number of actuators)
    pub ctrl: Vec<f64>,
    /// Activations of actuators with dynamics.
    pub act: Vec<f64>,
    /// Places of mocap bodies, m.
    pub mocap_pos: Vec<[f64; 3]>,
    /// Their orientations (w, x, y, z).
    pub mocap_quat: Vec<[f64; 4]>,
}

/// `<custom>` numerics `penny.k` and so on; `None` where the scene gives none.
#[derive(Clone, Debug, Default)]
pub struct TutorialParams {
    /// N/m
    pub k: Option<f64>,
    /// N s/m
    pub c: Option<f64>,
    /// s/m
    pub alpha: Option<f64>,
    /// Sliding coefficient instead of the geoms'.
    pub mu: Option<f64>,
    /// Rolling coefficient (m) instead of the geoms'.
    pub mu_roll: Option<f64>,
}

impl TutorialParams {
    /// From here on the friction of the contacts counts, not the scene's own numbers.
    pub fn follow_friction(&mut self) {
        (self.mu, self.mu_roll) = (None, None);
    }

    /// From here on `solref` of the contacts counts, not the scene's own stiffness and damping.
    pub fn follow_solref(&mut self) {
        (self.k, self.c) = (None, None);
    }
}

/// What a scene requires: a step does nothing that the plan rules out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Requirements {
    /// Bodies that can move, by joints of their own or of a body they are attached to.
    pub moving_bodies: usize,
    /// Trees that are one rigid body on a free joint: closed forms.
    pub free_trees: usize,
    /// All other trees: an inertia matrix each.
    pub articulated_trees: usize,
    /// Trees in which a joint can turn a body.
    pub rotating_trees: usize,
    /// Largest number of dofs of an articulated tree.
    pub largest_matrix: usize,
    /// Whether joints couple bodies: some tree has more than one body that moves by its own joints.
    pub coupled: bool,
    /// Geom pairs listed.
    pub pairs: usize,
    /// Geoms among which a broad phase looks for more.
    pub swept: usize,
    /// Pairs of shapes that need a collider, lower kind first. Sorted.
    pub colliders: Vec<[GeomKind; 2]>,
    /// Geoms that take part in collisions. Sorted.
    pub colliding_geoms: Vec<usize>,
    /// The largest condim that occurs; 0 without contacts.
    pub condim: usize,
    /// Joints with limits.
    pub limits: usize,
    /// Joints with springs.
    pub springs: usize,
    /// Joints with dampers.
    pub dampers: usize,
    /// Joints with dry friction.
    pub frictionloss: usize,
    /// Joints with armature.
    pub armature: usize,
    /// Actuators.
    pub actuators: usize,
    /// Tendons.
    pub tendons: usize,
    /// Equalities.
    pub equalities: usize,
}

impl Parts {
    /// The scene's own contact law, from `<custom><text name="penny.contact">`, if it names one.
    pub fn contact_law(&self) -> Option<&str> {
        self.texts.get("penny.contact").map(String::as_str)
    }
}
