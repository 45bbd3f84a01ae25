//! Six-vectors of a rigid body in world axes about a fixed point o: linear part first, then angular.
//!
//!     twist   V = [v, ω]    v: velocity of the body's material point at o
//!     wrench  F = [f, n]    n: moment about o
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 2; with the linear part first.

use crate::math::{Sym3, Vec3, Vec6, point_mass};

/// The linear part.
#[inline]
pub fn lin(s: &Vec6) -> Vec3 {
    Vec3::new(s[0], s[1], s[2])
}

/// The angular part.
#[inline]
pub fn ang(s: &Vec6) -> Vec3 {
    Vec3::new(s[3], s[4], s[5])
}

/// Both parts as one six-vector.
#[inline]
pub fn join(lin: &Vec3, ang: &Vec3) -> Vec6 {
    Vec6::new(lin.x, lin.y, lin.z, ang.x, ang.y, ang.z)
}

/// Power of a wrench and a twist. The products are summed two by two.
#[inline]
pub fn dot(a: &Vec6, b: &Vec6) -> f64 {
    let even = a[0] * b[0] + a[2] * b[2] + a[4] * b[4];
    let odd = a[1] * b[1] + a[3] * b[3] + a[5] * b[5];
    even + odd
}

/// How a motion vector changes when it is carried along by the twist `v`.
///
///     [v, ω] × [s, a] = [ω × s + v × a, ω × a]
#[inline]
pub fn cross_motion(v: &Vec6, s: &Vec6) -> Vec6 {
    let (w, a) = (ang(v), ang(s));
    join(&(w.cross(&lin(s)) + lin(v).cross(&a)), &w.cross(&a))
}

/// How a momentum changes when it is carried along by the twist `v`.
///
///     [v, ω] ×* [f, n] = [ω × f, ω × n + v × f]
#[inline]
pub fn cross_force(v: &Vec6, p: &Vec6) -> Vec6 {
    let (w, f) = (ang(v), lin(p));
    join(&w.cross(&f), &(w.cross(&ang(p)) + lin(v).cross(&f)))
}

/// The same twist, its linear part taken at a point `r` away from o.
#[inline]
pub fn at(v: &Vec6, r: &Vec3) -> Vec6 {
    join(&(lin(v) + ang(v).cross(r)), &ang(v))
}

/// Inertia of a rigid body about o: mass m (kg), m·(com − o) (kg m), rotational inertia about o (kg m²).
#[derive(Clone, Copy, Debug, Default)]
pub struct Inertia {
    /// kg
    pub mass: f64,
    /// Mass times place of the centre of mass, kg m.
    pub moment: Vec3,
    /// Moments about the origin, kg m².
    pub about: Sym3,
}

impl Inertia {
    /// From the mass, the centre of mass relative to o and the inertia about the centre of mass.
    ///
    ///     I_o = I_c − m [c]²
    #[inline]
    pub fn new(mass: f64, com: &Vec3, central: &Sym3) -> Inertia {
        let mut about = point_mass(mass, com);
        about.add(central);
        Inertia { mass, moment: mass * com, about }
    }

    /// Two bodies as one.
    #[inline]
    pub fn add(&mut self, other: &Inertia) {
        self.mass += other.mass;
        self.moment += other.moment;
        self.about.add(&other.about);
    }

    /// Momentum of the twist `v`.
    ///
    ///     p = m v + ω × h,   L = I_o ω + h × v,   h = m (com − o)
    #[inline]
    pub fn mul(&self, v: &Vec6) -> Vec6 {
        let (u, w) = (lin(v), ang(v));
        join(&(self.mass * u + w.cross(&self.moment)), &(self.about.mul(&w) + self.moment.cross(&u)))
    }
}
