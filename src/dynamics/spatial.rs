//! Six-vectors of a rigid body in world axes about a fixed point o: linear part first, then angular.
//!
//!     twist   V = [v, ω]    v: velocity of the body's material point at o
//!     wrench  F = [f, n]    n: moment about o
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 2; with the linear part first.

use crate::math::{Mat3, Vec3, Vec6, cross};

/// The linear part.
pub fn lin(s: &Vec6) -> Vec3 {
    Vec3::new(s[0], s[1], s[2])
}

/// The angular part.
pub fn ang(s: &Vec6) -> Vec3 {
    Vec3::new(s[3], s[4], s[5])
}

pub fn join(lin: &Vec3, ang: &Vec3) -> Vec6 {
    Vec6::new(lin.x, lin.y, lin.z, ang.x, ang.y, ang.z)
}

/// How a motion vector changes when it is carried along by the twist `v`.
///
///     [v, ω] × [s, a] = [ω × s + v × a, ω × a]
pub fn cross_motion(v: &Vec6, s: &Vec6) -> Vec6 {
    let (w, a) = (ang(v), ang(s));
    join(&(w.cross(&lin(s)) + lin(v).cross(&a)), &w.cross(&a))
}

/// How a momentum changes when it is carried along by the twist `v`.
///
///     [v, ω] ×* [f, n] = [ω × f, ω × n + v × f]
pub fn cross_force(v: &Vec6, p: &Vec6) -> Vec6 {
    let (w, f) = (ang(v), lin(p));
    join(&w.cross(&f), &(w.cross(&ang(p)) + lin(v).cross(&f)))
}

/// The same twist, its linear part taken at a point `r` away from o.
pub fn at(v: &Vec6, r: &Vec3) -> Vec6 {
    join(&(lin(v) + ang(v).cross(r)), &ang(v))
}

/// Inertia of a rigid body about o: mass m (kg), m·(com − o) (kg m), rotational inertia about o (kg m²).
#[derive(Clone, Copy, Debug, Default)]
pub struct Inertia {
    pub mass: f64,
    pub moment: Vec3,
    pub about: Mat3,
}

impl Inertia {
    /// From the mass, the centre of mass relative to o and the inertia about the centre of mass.
    ///
    ///     I_o = I_c − m [c]²
    pub fn new(mass: f64, com: &Vec3, central: &Mat3) -> Inertia {
        let c = cross(com);
        Inertia { mass, moment: mass * com, about: central - mass * c * c }
    }

    pub fn add(&mut self, other: &Inertia) {
        self.mass += other.mass;
        self.moment += other.moment;
        self.about += other.about;
    }

    /// Momentum of the twist `v`.
    ///
    ///     p = m v + ω × h,   L = I_o ω + h × v,   h = m (com − o)
    pub fn mul(&self, v: &Vec6) -> Vec6 {
        let (u, w) = (lin(v), ang(v));
        join(&(self.mass * u + w.cross(&self.moment)), &(self.about * w + self.moment.cross(&u)))
    }
}
