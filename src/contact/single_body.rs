//! One free body against what never moves, without rows: its motion at the points of contact, and what forces there do to it.
//!
//! A body that rests, slides, or rolls on needs in every step nearly what it needed in the last one. A law that tries the
//! last solution ([`super::Shortcut`]) needs no rows and no matrix for that, only J v, J a and Jᵀ f, which are short in the
//! axes n, s, t of the contacts' common frame. r is the arm from the centre of mass, W the inverse inertia, m the mass,
//! σ = 1 if the body is the second of the two, else −1:
//!
//!     J v = σ (v + ω × r, ω),     M⁻¹ Jᵀ (f, τ) = σ (f/m, W (r × f + τ))

use super::Lever;
use crate::collision;
use crate::data::{Contact, Mover};
use crate::math::{Mat3, Vec3, Vec6};

/// Most contacts that are tried.
pub const MOST: usize = 8;

/// The body as its contacts see it.
pub struct SingleBody<'a> {
    mover: &'a Mover,
    /// Rows n, s, t, in the world.
    frame: Mat3,
    /// From the mover's axes to n, s, t.
    axes: Mat3,
    /// σ
    sign: f64,
    /// Which of the two bodies it is.
    pub side: usize,
    /// How far along n the point where it is touched is from the contact point, m per m of distance.
    shift: f64,
}

/// A velocity or an acceleration of the body in n, s, t.
#[derive(Clone, Copy)]
pub struct Motion {
    /// Of the centre of mass: m/s, m/s².
    pub linear: Vec3,
    /// rad/s, rad/s².
    pub angular: Vec3,
}

impl Motion {
    /// J v of a contact at `arm`: along n, s, t, and about them.
    #[inline(always)]
    pub fn along(&self, arm: &Vec3) -> [f64; 6] {
        let (v, w) = (self.linear + self.angular.cross(arm), self.angular);
        [v.x, v.y, v.z, w.x, w.y, w.z]
    }
}

impl<'a> SingleBody<'a> {
    /// The body `root`, one of whose contacts is `contact`. `DIM`: rows of each contact.
    #[inline(always)]
    pub fn new<const DIM: usize>(mover: &'a Mover, root: usize, contact: &Contact, lever: Lever) -> SingleBody<'a> {
        let side = usize::from(contact.body[1] as usize == root);
        let sign = if side == 1 { 1.0 } else { -1.0 };
        // A frictionless contact comes without tangents.
        let frame =
            if DIM > 1 { contact.frame } else { collision::frame(&contact.frame.row(0).transpose(), &Vec3::zeros()) };
        let shift = if lever == Lever::Surface { 0.5 * sign } else { 0.0 };
        SingleBody { mover, frame, axes: frame * mover.axes, sign, side, shift }
    }

    /// A twist or acceleration of the mover in n, s, t.
    #[inline(always)]
    pub fn motion(&self, six: &Vec6) -> Motion {
        let (linear, angular) = (Vec3::new(six[0], six[1], six[2]), Vec3::new(six[3], six[4], six[5]));
        Motion { linear: self.frame * linear * self.sign, angular: self.axes * angular * self.sign }
    }

    /// Arm of a contact in n, s, t, from the centre of mass to where the body is touched, m.
    #[inline(always)]
    pub fn arm(&self, contact: &Contact) -> Vec3 {
        let mut arm = self.frame * (contact.pos - self.mover.com);
        arm.x += self.shift * contact.dist;
        arm
    }

    /// The acceleration of the mover that a force and a torque about the centre of mass cause, both in n, s, t.
    #[inline(always)]
    pub fn acceleration(&self, force: &Vec3, torque: &Vec3) -> Vec6 {
        let linear = self.frame.tr_mul(force) * self.sign;
        let angular = self.axes.tr_mul(torque) * self.sign;
        Vec6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z).component_mul(&self.mover.minv)
    }
}

/// Whether contacts have one frame, one mix and the same two bodies, and are not too many.
#[inline]
pub fn alike(which: &[usize], contacts: &[Contact]) -> bool {
    let first = &contacts[which[0]];
    let same = |c: &Contact| c.mix == first.mix && c.frame == first.frame && c.body == first.body;
    which.len() <= MOST && which[1..].iter().all(|&c| same(&contacts[c]))
}
