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
    /// `<general>`
    General,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// Approximated by a pyramid.
    Pyramidal,
    /// Exact.
    Elliptic,
}

/// What a sensor measures; [`crate::sensors`] says how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorKind {
    Touch,
    Accelerometer,
    Velocimeter,
    Gyro,
    Force,
    Torque,
    Magnetometer,
    RangeFinder,
    JointPos,
    JointVel,
    JointActuatorForce,
    ActuatorPos,
    ActuatorVel,
    ActuatorForce,
    BallQuat,
    BallAngVel,
    JointLimitPos,
    JointLimitVel,
    JointLimitForce,
    FramePos,
    FrameQuat,
    FrameXAxis,
    FrameYAxis,
    FrameZAxis,
    FrameLinVel,
    FrameAngVel,
    FrameLinAcc,
    FrameAngAcc,
    SubtreeCom,
    SubtreeLinVel,
    SubtreeAngMom,
    InsideSite,
    PotentialEnergy,
    KineticEnergy,
    Clock,
}

impl SensorKind {
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
