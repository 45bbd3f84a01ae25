//! The kinds of joints, shapes, actuators and cones: what a file can name is what a model can have.

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JointKind {
    Free,
    Ball,
    Slide,
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
    Plane,
    Sphere,
    Capsule,
    Ellipsoid,
    Cylinder,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActuatorKind {
    Motor,
    Position,
    Velocity,
    General,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    Pyramidal,
    Elliptic,
}
