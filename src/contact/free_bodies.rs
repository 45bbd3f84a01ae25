//! Free bodies that touch one another and what never moves, without rows: their motion at the points of contact, and what
//! forces there do to them.
//!
//! Bodies that rest, slide, or roll on need in every step nearly what they needed in the last one. A law that tries the
//! last solution ([`super::Shortcut`]) needs no rows and no matrix for that, only J v, J a and Jᵀ f, which are short in the
//! axes n, s, t of the frame that the contacts of two bodies mostly share. For one of the two, r is the arm from its centre of
//! mass, W the inverse inertia, m the mass, σ = 1 if it is the second of the two, else −1:
//!
//!     J v = σ (v + ω × r, ω),     M⁻¹ Jᵀ (f, τ) = σ (f/m, W (r × f + τ))
//!
//! and where both move, the sum over the two.

use super::cost::Spread;
use super::{Lever, Task};
use crate::collision;
use crate::data::{Contact, Mover};
use crate::math::{Mat3, Vec3, Vec6};
use crate::model::Model;

/// Most contacts that are looked at together.
pub const MOST: usize = 8;

/// An island of free bodies, or of bodies whose joints are uncoupled ([`crate::dynamics::uncoupled`]), on which nothing acts but
/// contacts: its trees, and its contacts in order.
#[derive(Clone, Copy)]
pub struct FreeBodies<'a> {
    /// Indices into the model's trees.
    pub trees: &'a [usize],
    /// Indices into `data.contacts`.
    pub contacts: &'a [usize],
}

impl<'a> FreeBodies<'a> {
    /// The only body and its only manifold, if there is no other.
    #[inline(always)]
    pub fn single(&self, contacts: &[Contact]) -> Option<usize> {
        let (&[tree], [first, others @ ..]) = (self.trees, self.contacts) else { return None };
        let same = |c: &usize| alike(&contacts[*first], &contacts[*c]);
        (others.len() < MOST && others.iter().all(same)).then_some(tree)
    }

    /// The contacts from the first of `rest` on that belong together: one frame, one mix, the same two bodies, at most [`MOST`].
    #[inline(always)]
    pub fn manifold(rest: &'a [usize], contacts: &[Contact]) -> &'a [usize] {
        let same = |c: &&usize| alike(&contacts[rest[0]], &contacts[**c]);
        &rest[..1 + rest[1..].iter().take(MOST - 1).take_while(same).count()]
    }
}

#[inline(always)]
fn alike(a: &Contact, b: &Contact) -> bool {
    a.mix == b.mix && a.body == b.body && a.frame == b.frame
}

/// What a law keeps while it tries: by tree, and by contact.
#[derive(Clone, Debug, Default)]
pub struct Room {
    /// Accelerations of the movers, if it finds them: m/s², rad/s².
    pub acceleration: Vec<Vec6>,
    /// What constraint forces add to the accelerations, where that is asked, or what that is off by.
    pub pushed: Vec<Vec6>,
    /// D and x of contacts that were evaluated, one after the other.
    pub tried: Vec<(f64, Spread)>,
    /// How many contacts belong together, one manifold after the other.
    pub manifolds: Vec<usize>,
    /// By how much forces differ from what is asked of them: N, N m.
    pub change: Vec<[f64; 6]>,
}

impl Room {
    /// Room for all trees, and this many contacts.
    pub fn reserve(&mut self, model: &Model, contacts: usize) {
        self.acceleration.resize(model.trees.len(), Vec6::zeros());
        self.pushed.resize(model.trees.len(), Vec6::zeros());
        self.tried.reserve(contacts);
        self.manifolds.reserve(contacts);
        self.change.reserve(contacts);
    }
}

/// A free body as the contacts of one manifold see it.
pub struct Side<'a> {
    /// Its tree.
    pub tree: usize,
    /// Which of the two bodies it is.
    pub side: usize,
    /// Its mover.
    pub mover: &'a Mover,
    /// Rows n, s, t, in the world.
    frame: Mat3,
    /// From the mover's axes to n, s, t.
    axes: Mat3,
    /// σ
    sign: f64,
    /// How far along n the point where it is touched is from the contact point, m per m of distance.
    shift: f64,
}

/// A velocity or an acceleration of a body in n, s, t.
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

/// The one body of a manifold that moves, or one of two. In: a contact of it, of `DIM` rows.
#[inline(always)]
pub fn first<'a, const DIM: usize>(task: &Task<'a>, contact: &Contact) -> Side<'a> {
    let [first, second] = contact.body.map(|body| task.model.bodies[body as usize].tree);
    let at_surface = task.settings.law.lever == Lever::Surface && (first.is_none() || second.is_none());
    // What acts in an island has a tree.
    let (side, tree) = first.map_or((1, second.unwrap_or(0)), |first| (0, first));
    Side::new(task, &frame::<DIM>(contact), side, tree, at_surface)
}

/// The other body that moves, if two do.
#[inline(always)]
pub fn second<'a, const DIM: usize>(task: &Task<'a>, contact: &Contact) -> Option<Side<'a>> {
    let [first, second] = contact.body.map(|body| task.model.bodies[body as usize].tree);
    let (_, tree) = first.zip(second)?;
    Some(Side::new(task, &frame::<DIM>(contact), 1, tree, false))
}

/// A frictionless contact comes without tangents.
#[inline(always)]
fn frame<const DIM: usize>(contact: &Contact) -> Mat3 {
    if DIM > 1 { contact.frame } else { collision::frame(&contact.frame.row(0).transpose(), &Vec3::zeros()) }
}

impl<'a> Side<'a> {
    #[inline(always)]
    fn new(task: &Task<'a>, frame: &Mat3, side: usize, tree: usize, at_surface: bool) -> Side<'a> {
        let mover = &task.data.movers[task.model.trees[tree].bodies.start];
        let sign = if side == 1 { 1.0 } else { -1.0 };
        let shift = if at_surface { 0.5 * sign } else { 0.0 };
        Side { tree, side, mover, frame: *frame, axes: frame * mover.axes, sign, shift }
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
