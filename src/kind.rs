//! The kinds of joints, shapes, actuators and cones: what a file can name is what a model can have.

/// How a joint lets a body move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JointKind {
    /// Six degrees of freedom.
    Free,
    /// Three rotations.
    Ball,
    /// Along an axis.
    Slide,
    /// About an axis.
    Hinge,
}

impl JointKind {
    /// The MJCF keyword.
    pub fn name(self) -> &'static str {
        match self {
            JointKind::Free => "free",
            JointKind::Ball => "ball",
            JointKind::Slide => "slide",
            JointKind::Hinge => "hinge",
        }
    }
    /// Numbers of this joint in `qpos`.
    pub fn nq(self) -> usize {
        match self {
            JointKind::Free => 7,
            JointKind::Ball => 4,
            JointKind::Slide | JointKind::Hinge => 1,
        }
    }
    /// Degrees of freedom: numbers of this joint in `qvel`.
    pub fn nv(self) -> usize {
        match self {
            JointKind::Free => 6,
            JointKind::Ball => 3,
            JointKind::Slide | JointKind::Hinge => 1,
        }
    }
}

/// In MuJoCo's order: in a contact the geom of lower kind comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum GeomKind {
    /// Half-space below a plane.
    Plane,
    /// Ball.
    Sphere,
    /// Cylinder with half-balls at its ends.
    Capsule,
    /// Ellipsoid.
    Ellipsoid,
    /// Cylinder.
    Cylinder,
    /// Cuboid.
    Box,
}

impl GeomKind {
    /// The MJCF keyword.
    pub fn name(self) -> &'static str {
        match self {
            GeomKind::Plane => "plane",
            GeomKind::Sphere => "sphere",
            GeomKind::Capsule => "capsule",
            GeomKind::Ellipsoid => "ellipsoid",
            GeomKind::Cylinder => "cylinder",
            GeomKind::Box => "box",
        }
    }
}

/// How an actuator was written; gain and bias say what it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActuatorKind {
    /// `<motor>`
    Motor,
    /// `<position>`
    Position,
    /// `<velocity>`
    Velocity,
    /// `<intvelocity>`
    IntVelocity,
    /// `<damper>`
    Damper,
    /// `<cylinder>`
    Cylinder,
    /// `<general>`
    General,
}

/// How an actuator's activation follows its control; times in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// It has none.
    None,
    /// Its rate is the control.
    Integrator,
    /// A first-order filter of this time constant.
    Filter(f64),
    /// The same, exact over a step of constant control.
    ExactFilter(f64),
}

/// The friction cones of the `mujoco` law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// Approximated by a pyramid.
    Pyramidal,
    /// Exact.
    Elliptic,
}

/// How a camera moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraMode {
    /// With its body.
    Fixed,
    /// At a constant offset (world axes) from its body's origin, its axes as in `qpos0`.
    Track,
    /// The same from the centre of mass of its body and all that hangs on it.
    TrackCom,
    /// With its body, and it looks at the origin of the target body.
    TargetBody,
    /// The same at the centre of mass of the target body and all that hangs on it.
    TargetBodyCom,
}

/// What a sensor measures; [`crate::sensors`] says how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorKind {
    /// `touch`: normal forces of the contacts within a site's volume, N.
    Touch,
    /// `accelerometer`: acceleration of a site less gravity, site axes, m/s².
    Accelerometer,
    /// `velocimeter`: velocity of a site, site axes, m/s.
    Velocimeter,
    /// `gyro`: angular velocity of a site, site axes, rad/s.
    Gyro,
    /// `force`: force between a body and its parent, site axes, N.
    Force,
    /// `torque`: torque between a body and its parent, site axes, N m.
    Torque,
    /// `magnetometer`: the magnetic field, site axes.
    Magnetometer,
    /// `rangefinder`: distance to the nearest geom along a site's z axis, m; −1: none.
    RangeFinder,
    /// `jointpos`: position of a slide or hinge, m or rad.
    JointPos,
    /// `jointvel`: its velocity, m/s or rad/s.
    JointVel,
    /// `jointactuatorfrc`: force of the actuators on a joint, N or N m.
    JointActuatorForce,
    /// `actuatorpos`: length of an actuator's transmission.
    ActuatorPos,
    /// `actuatorvel`: its velocity.
    ActuatorVel,
    /// `actuatorfrc`: force of an actuator, N or N m.
    ActuatorForce,
    /// `ballquat`: quaternion of a ball joint.
    BallQuat,
    /// `ballangvel`: its angular velocity, rad/s.
    BallAngVel,
    /// `jointlimitpos`: distance from the limit less the margin, m or rad.
    JointLimitPos,
    /// `jointlimitvel`: its rate.
    JointLimitVel,
    /// `jointlimitfrc`: force of a limit, N or N m.
    JointLimitForce,
    /// `tendonpos`: length of a tendon, m.
    TendonPos,
    /// `tendonvel`: its rate, m/s.
    TendonVel,
    /// `tendonactuatorfrc`: force of the actuators on a tendon, N.
    TendonActuatorForce,
    /// `tendonlimitpos`: distance from the limit less the margin, m.
    TendonLimitPos,
    /// `tendonlimitvel`: its rate, m/s.
    TendonLimitVel,
    /// `tendonlimitfrc`: force of a limit, N.
    TendonLimitForce,
    /// `framepos`: place of a frame, m.
    FramePos,
    /// `framequat`: its orientation.
    FrameQuat,
    /// `framexaxis`: its x axis.
    FrameXAxis,
    /// `frameyaxis`: its y axis.
    FrameYAxis,
    /// `framezaxis`: its z axis.
    FrameZAxis,
    /// `framelinvel`: velocity of a frame, m/s.
    FrameLinVel,
    /// `frameangvel`: its angular velocity, rad/s.
    FrameAngVel,
    /// `framelinacc`: acceleration of a frame, world axes, m/s².
    FrameLinAcc,
    /// `frameangacc`: its angular acceleration, world axes, rad/s².
    FrameAngAcc,
    /// `subtreecom`: centre of mass of a body and all that hangs on it, m.
    SubtreeCom,
    /// `subtreelinvel`: its velocity, m/s.
    SubtreeLinVel,
    /// `subtreeangmom`: angular momentum about it, kg m²/s.
    SubtreeAngMom,
    /// `insidesite`: 1 where an object is inside a site, else 0.
    InsideSite,
    /// `e_potential`, J.
    PotentialEnergy,
    /// `e_kinetic`, J.
    KineticEnergy,
    /// `clock`: time, s.
    Clock,
}

impl SensorKind {
    /// All of them.
    pub const ALL: &[SensorKind] = &[
        SensorKind::Touch,
        SensorKind::Accelerometer,
        SensorKind::Velocimeter,
        SensorKind::Gyro,
        SensorKind::Force,
        SensorKind::Torque,
        SensorKind::Magnetometer,
        SensorKind::RangeFinder,
        SensorKind::JointPos,
        SensorKind::JointVel,
        SensorKind::JointActuatorForce,
        SensorKind::ActuatorPos,
        SensorKind::ActuatorVel,
        SensorKind::ActuatorForce,
        SensorKind::BallQuat,
        SensorKind::BallAngVel,
        SensorKind::JointLimitPos,
        SensorKind::JointLimitVel,
        SensorKind::JointLimitForce,
        SensorKind::TendonPos,
        SensorKind::TendonVel,
        SensorKind::TendonActuatorForce,
        SensorKind::TendonLimitPos,
        SensorKind::TendonLimitVel,
        SensorKind::TendonLimitForce,
        SensorKind::FramePos,
        SensorKind::FrameQuat,
        SensorKind::FrameXAxis,
        SensorKind::FrameYAxis,
        SensorKind::FrameZAxis,
        SensorKind::FrameLinVel,
        SensorKind::FrameAngVel,
        SensorKind::FrameLinAcc,
        SensorKind::FrameAngAcc,
        SensorKind::SubtreeCom,
        SensorKind::SubtreeLinVel,
        SensorKind::SubtreeAngMom,
        SensorKind::InsideSite,
        SensorKind::PotentialEnergy,
        SensorKind::KineticEnergy,
        SensorKind::Clock,
    ];

    /// The MJCF element.
    pub fn name(self) -> &'static str {
        match self {
            SensorKind::Touch => "touch",
            SensorKind::Accelerometer => "accelerometer",
            SensorKind::Velocimeter => "velocimeter",
            SensorKind::Gyro => "gyro",
            SensorKind::Force => "force",
            SensorKind::Torque => "torque",
            SensorKind::Magnetometer => "magnetometer",
            SensorKind::RangeFinder => "rangefinder",
            SensorKind::JointPos => "jointpos",
            SensorKind::JointVel => "jointvel",
            SensorKind::JointActuatorForce => "jointactuatorfrc",
            SensorKind::ActuatorPos => "actuatorpos",
            SensorKind::ActuatorVel => "actuatorvel",
            SensorKind::ActuatorForce => "actuatorfrc",
            SensorKind::BallQuat => "ballquat",
            SensorKind::BallAngVel => "ballangvel",
            SensorKind::JointLimitPos => "jointlimitpos",
            SensorKind::JointLimitVel => "jointlimitvel",
            SensorKind::JointLimitForce => "jointlimitfrc",
            SensorKind::TendonPos => "tendonpos",
            SensorKind::TendonVel => "tendonvel",
            SensorKind::TendonActuatorForce => "tendonactuatorfrc",
            SensorKind::TendonLimitPos => "tendonlimitpos",
            SensorKind::TendonLimitVel => "tendonlimitvel",
            SensorKind::TendonLimitForce => "tendonlimitfrc",
            SensorKind::FramePos => "framepos",
            SensorKind::FrameQuat => "framequat",
            SensorKind::FrameXAxis => "framexaxis",
            SensorKind::FrameYAxis => "frameyaxis",
            SensorKind::FrameZAxis => "framezaxis",
            SensorKind::FrameLinVel => "framelinvel",
            SensorKind::FrameAngVel => "frameangvel",
            SensorKind::FrameLinAcc => "framelinacc",
            SensorKind::FrameAngAcc => "frameangacc",
            SensorKind::SubtreeCom => "subtreecom",
            SensorKind::SubtreeLinVel => "subtreelinvel",
            SensorKind::SubtreeAngMom => "subtreeangmom",
            SensorKind::InsideSite => "insidesite",
            SensorKind::PotentialEnergy => "e_potential",
            SensorKind::KineticEnergy => "e_kinetic",
            SensorKind::Clock => "clock",
        }
    }

    /// How many numbers it gives.
    pub fn dim(self) -> usize {
        use SensorKind::*;
        match self {
            FrameQuat | BallQuat => 4,
            Accelerometer | Velocimeter | Gyro | Force | Torque | Magnetometer | BallAngVel | FramePos | FrameXAxis
            | FrameYAxis | FrameZAxis | FrameLinVel | FrameAngVel | FrameLinAcc | FrameAngAcc | SubtreeCom
            | SubtreeLinVel | SubtreeAngMom => 3,
            _ => 1,
        }
    }

    /// Whether `cutoff` means something: not for unit vectors and quaternions.
    pub fn clips(self) -> bool {
        use SensorKind::*;
        !matches!(self, FrameQuat | BallQuat | FrameXAxis | FrameYAxis | FrameZAxis)
    }

    /// Never negative: `cutoff` bounds it from above only.
    pub fn positive(self) -> bool {
        matches!(self, SensorKind::Touch | SensorKind::InsideSite)
    }
}
