//! What a law makes of one contact, in SI units: for people (`penny explain`, `run`, `compare`) and for theory. No step
//! reads it.
//!
//! A law says what it can say in closed form; what it leaves out is measured where that is possible (`explain` in
//! `crates/lab`), and said to be measured.

use super::constants::{self, Carried, Spring};
use crate::dynamics;
use crate::model::Model;

/// Two geoms that can touch, and how.
#[derive(Clone, Debug)]
pub struct Touch {
    /// Lower kind first.
    pub geom: [usize; 2],
    /// Index of its contact parameters.
    pub mix: usize,
    /// Contact points when they lie flat on each other; the weight is shared by them.
    pub points: usize,
    /// Mass that the pair puts against each other along the normal, kg; see [`constants::effective_mass`].
    pub mass: f64,
    /// Inverse mass that MuJoCo's model assumes (diagApprox), over the true one.
    pub estimate: f64,
    /// Stiffest way in which the points together can press on their bodies, as a mass: 1 / (points · A) with the
    /// largest inverse mass A of a point, kg. A bound, for the timestep.
    pub lightest: f64,
    /// Whether one of the two never moves, so that the other can rest on it.
    pub rests: bool,
}

/// What a law is asked about.
#[derive(Clone, Copy, Debug)]
pub struct Ask<'a> {
    /// The scene.
    pub model: &'a Model,
    /// The contact that is asked about.
    pub touch: &'a Touch,
    /// s
    pub timestep: f64,
    /// Angle of the slope that [`Description::creep`] is about, rad.
    pub slope: f64,
}

/// What a law makes of a contact. `None`: the law has no formula for it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    /// Spring and damper, with the mass that they carry: at rest under the weight, and pressed hard. Where forces are
    /// not linear, those of small motions: k = ∂F/∂d, c = ∂F/∂ḋ.
    pub springs: Option<[Spring; 2]>,
    /// Whether springs and depth are those of each contact point; else of all points together.
    pub each_point: bool,
    /// Whether the damper acts on approach only.
    pub approach_only: bool,
    /// Share of the speed that a fast impact gives back (v ≫ g/ω).
    pub restitution: Option<f64>,
    /// Depth at rest under the weight, m.
    pub rest_depth: Option<f64>,
    /// What friction does on a slope.
    pub creep: Option<Creep>,
}

/// What becomes of a body at rest on a slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Creep {
    /// Friction does not hold it.
    Slides,
    /// It holds.
    Sticks,
    /// It goes down at this speed, m/s.
    At(f64),
}

/// How a law's forces differ from MuJoCo's at the same state, as clauses for `penny compare`.
#[derive(Clone, Copy)]
pub struct Unlike {
    /// Of the normal forces.
    pub normal: fn(&Model, timestep: f64) -> String,
    /// Of friction.
    pub friction: &'static str,
}

/// A law without formulas.
pub fn nothing(_: &Ask) -> Description {
    Description::default()
}

/// The spring of MuJoCo's kind, of all points together; without creep.
///
/// Source: [`constants::spring`], [`constants::rest_depth`], [`constants::restitution`].
pub fn soft(ask: &Ask) -> Description {
    let Ask { model, touch, timestep, .. } = *ask;
    let springs = touch.springs(model, timestep);
    Description {
        springs: Some(springs),
        restitution: Some(constants::restitution(springs[1].zeta())),
        rest_depth: Some(touch.rest_depth(model, timestep)),
        ..Description::default()
    }
}

/// Creep under friction of MuJoCo's kind; it slides where tan θ ≥ μ.
pub fn soft_creep(ask: &Ask) -> Creep {
    if ask.slides(ask.model.mixes[ask.touch.mix].friction[0]) {
        return Creep::Slides;
    }
    Creep::At(ask.touch.creep(ask.model, ask.timestep, ask.slope))
}

impl Ask<'_> {
    /// Whether Coulomb friction does not hold a body on the slope: tan θ ≥ μ.
    pub fn slides(&self, mu: f64) -> bool {
        self.slope.tan() >= mu
    }

    /// Size of gravity, m/s².
    pub fn gravity(&self) -> f64 {
        dynamics::gravity(self.model).norm()
    }
}

impl Touch {
    /// Mass that each point carries of the whole, kg.
    pub fn share(&self) -> f64 {
        self.mass / self.points as f64
    }

    /// Spring of MuJoCo's kind of all points together, at rest and pressed hard.
    pub fn springs(&self, model: &Model, timestep: f64) -> [Spring; 2] {
        let mix = &model.mixes[self.mix];
        let carried = Carried { mass: self.mass, softness: self.softness(model) };
        let hard = mix.solimp[2].max(1.0);
        [self.rest_depth(model, timestep), hard]
            .map(|depth| constants::spring(mix, carried, depth, timestep, model.opt.flags.refsafe))
    }

    /// How deep one rests on the other under its weight by a spring of MuJoCo's kind, m.
    pub fn rest_depth(&self, model: &Model, timestep: f64) -> f64 {
        let (gravity, refsafe) = (dynamics::gravity(model).norm(), model.opt.flags.refsafe);
        constants::rest_depth(&model.mixes[self.mix], self.softness(model), gravity, timestep, refsafe)
    }

    /// Speed at which it creeps down a `slope` (rad) that it should stick to, by friction of MuJoCo's kind, m/s.
    pub fn creep(&self, model: &Model, timestep: f64, slope: f64) -> f64 {
        let scene = constants::Scene {
            cone: model.opt.cone,
            impratio: model.opt.impratio,
            gravity: dynamics::gravity(model).norm(),
            timestep,
            refsafe: model.opt.flags.refsafe,
        };
        let depth = self.rest_depth(model, timestep);
        constants::creep(&model.mixes[self.mix], &scene, self.estimate, self.points, depth, slope)
    }

    fn softness(&self, model: &Model) -> f64 {
        let mix = &model.mixes[self.mix];
        constants::softness(mix, model.opt.cone, model.opt.impratio, self.estimate, self.points)
    }
}
