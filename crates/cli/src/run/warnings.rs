//! What makes a run questionable: geoms deep in one another at the start, energy from nowhere at the end.

use std::collections::VecDeque;

use super::rounded_down;
use super::watch::LOOKS;
use crate::format::{short, si};
use penny::data::{Contact, Data};
use penny::forward::Method;
use penny::integrate;
use penny::model::{JointKind, Model};
use penny::state::State;
use penny_lab::explain::{self, joints, trial_run};
use penny_lab::names::geom as geom_name;
use penny_lab::record::Sample;
use penny_lab::sweep::theory;

/// Two geoms that are deep in one another before the first step.
pub struct Overlap {
    geom: [usize; 2],
    /// m
    depth: f64,
    /// Radius of the smaller of the two, m.
    size: f64,
}

impl Overlap {
    /// Deep is more than this part of the smaller geom's radius.
    const DEEP: f64 = 0.1;

    /// The deepest overlap of all, by the sizes of the geoms, if it is deep.
    pub fn find(model: &Model, contacts: &[Contact]) -> Option<Overlap> {
        let overlap = |c: &Contact| {
            let geom = c.geom.map(|g| g as usize);
            // A plane has no radius.
            let radii = geom.iter().map(|&g| model.geoms[g].rbound).filter(|r| *r > 0.0);
            Overlap { geom, depth: -c.dist, size: radii.fold(f64::INFINITY, f64::min) }
        };
        let deep = contacts.iter().map(overlap).filter(|o| o.depth > Overlap::DEEP * o.size);
        deep.max_by(|a, b| (a.depth / a.size).total_cmp(&(b.depth / b.size)))
    }

    fn names(&self, model: &Model) -> String {
        let [a, b] = self.geom.map(|g| geom_name(model, g));
        format!("{a} and {b}")
    }

    pub fn warning(&self, model: &Model) -> String {
        format!(
            "warning: {} overlap by {} at the start, {} times the radius of the smaller: their contact will throw them \
             apart; {}",
            self.names(model),
            si(self.depth, "m"),
            short(self.depth / self.size),
            self.cure(model)
        )
    }

    /// A joint may forbid them to move apart: a link in its own mount.
    fn cure(&self, model: &Model) -> String {
        let body = self.geom.map(|g| model.geoms[g].body);
        let weld = body.map(|b| model.bodies[b].weld);
        let parent = |b: usize| model.bodies[model.bodies[b].parent].weld;
        let hangs = |child: usize, on: usize| {
            let free = model.joints[model.bodies[child].joints.clone()].iter().any(|j| j.kind == JointKind::Free);
            child != 0 && !free && parent(child) == on
        };
        if !hangs(weld[0], weld[1]) && !hangs(weld[1], weld[0]) {
            return "begin with them apart (pos in the file, or --qpos)".to_owned();
        }
        let names = body.map(|b| model.bodies[b].name.as_str());
        let [a, b] = self.geom.map(|g| geom_name(model, g));
        match names {
            [one, other] if !one.is_empty() && !other.is_empty() && body[0] != 0 && body[1] != 0 => format!(
                "a joint holds them together: let them not touch, with <contact><exclude body1=\"{one}\" body2=\"{other}\"/></contact>"
            ),
            _ => format!(
                "a joint holds them together: let them not touch, with contype=\"0\" conaffinity=\"0\" on {a} or {b}"
            ),
        }
    }
}

/// Energy that comes from nowhere.
///
/// Actuators at constant controls are a potential U ([`joints::actuator_potential`]): E' = E + U. A contact or joint limit
/// with force F at a depth d stores no more than F d, so E' + Σ F d is at least what can come back from a state:
///
///     gain = min over t − w ≤ s ≤ t of E'(s) − min (E'(0), min over 0 < s < t − w of (E'(s) + Σ F d))
///
/// What an oscillation loses and regains by the error of a symplectic step is back within the window w, a twentieth of the
/// run, and is no gain. While something touches, w = 0: contacts gain in bursts.
pub struct EnergyGain {
    /// E' + Σ F d where it was least so far, J; what is in the window left out.
    least: f64,
    /// Of the last looks: E', E' + Σ F d, E and U, J.
    window: VecDeque<[f64; 4]>,
    /// The largest gain, and the energies between which it was, J.
    gain: f64,
    from_to: [f64; 2],
    /// The largest kinetic energy, J.
    kinetic: f64,
    /// Whether all that drives the scene has a potential.
    judged: bool,
    /// The work of lifting all that moves by its largest geom's radius, J.
    lift: f64,
}

impl EnergyGain {
    /// Growth by less than this part of the scale is the usual error of a method.
    const MUCH: f64 = 0.05;
    /// Looks in a window.
    const WINDOW: usize = LOOKS / 20;

    pub fn new(model: &Model, first: &Sample) -> EnergyGain {
        let moves = |body: usize| model.bodies[body].tree.is_some();
        let radii = model.geoms.iter().filter(|g| moves(g.body)).map(|g| g.rbound);
        let mass: f64 = model.bodies.iter().filter(|b| b.tree.is_some()).map(|b| b.mass).sum();
        let lift = mass * explain::weight(model) * radii.fold(0.0, f64::max);
        EnergyGain {
            judged: joints::have_potential(model),
            least: f64::INFINITY,
            window: VecDeque::with_capacity(EnergyGain::WINDOW),
            gain: 0.0,
            from_to: [first.energy; 2],
            kinetic: first.kinetic,
            lift,
        }
    }

    /// In: forces at the state.
    pub fn enter(&mut self, model: &Model, state: &State, sample: &Sample, data: &Data) {
        let stored = trial_run::stored(data);
        // What is pressed or stretched at the start, contacts left out: said before the run.
        let contacts: f64 = data.contacts.iter().map(|c| (c.force[0] * c.dist).abs()).sum();
        let at_start = stored - contacts;
        let given = joints::actuator_potential(model, state);
        let now = sample.energy + given;
        self.kinetic = self.kinetic.max(sample.kinetic);
        if !self.least.is_finite() {
            self.least = now + at_start;
            return;
        }
        if stored > 0.0 {
            let least = self.window.iter().map(|look| look[1]).fold(self.least, f64::min);
            if now - least > self.gain {
                self.gain = now - least;
                self.from_to = [least - given, sample.energy];
            }
        }
        if self.window.len() == EnergyGain::WINDOW {
            self.weigh();
            let oldest = self.window.pop_front().unwrap_or([f64::INFINITY; 4]);
            self.least = self.least.min(oldest[1]);
        }
        self.window.push_back([now, now + stored, sample.energy, given]);
    }

    /// Compares the least of the window with the least before it.
    fn weigh(&mut self) {
        let Some([.., energy, given]) = self.window.back() else { return };
        let gain = self.window.iter().map(|look| look[0]).fold(f64::INFINITY, f64::min) - self.least;
        if gain > self.gain {
            self.gain = gain;
            self.from_to = [self.least - given, *energy];
        }
    }

    /// The largest kinetic energy so far, J.
    pub fn kinetic(&self) -> f64 {
        self.kinetic
    }

    /// Measured by the largest kinetic energy, and by what it takes to lift all that moves by its radius.
    pub fn grew(&mut self) -> bool {
        self.weigh();
        self.judged && self.gain > EnergyGain::MUCH * (self.kinetic + self.lift)
    }

    /// Says by how much the energy grew, and the likeliest cause and remedy. In `unconverged` steps the forces were not
    /// solved for.
    pub fn told(
        &self,
        model: &Model,
        method: &Method,
        overlap: Option<&Overlap>,
        limit: Option<&(f64, String)>,
        unconverged: usize,
    ) -> String {
        let [first, last] = self.from_to.map(|e| si(e, "J"));
        let (h, integrator) = (method.timestep, method.integrator.name);
        let cause = match (overlap, limit) {
            (Some(overlap), _) => {
                let names = overlap.names(model);
                format!("{names} overlapped by {} at the start; {}", si(overlap.depth, "m"), overlap.cure(model))
            }
            _ if unconverged > 0 => {
                format!("the contact forces of some steps did not converge: {}", method.contact.nearer)
            }
            (None, Some((limit, whose))) if 0.0 < *limit && *limit < h && whose != super::THE_SCENE => {
                format!("the timestep is too long for {whose}: try --timestep {:.1e}", rounded_down(*limit))
            }
            _ if gains_anyway(method) => {
                let others = integrate::ALL.iter().filter(|i| !gains_anyway(&Method { integrator: i, ..*method }));
                let others: Vec<&str> = others.filter(|i| !i.implicit).map(|i| i.name).take(2).collect();
                format!(
                    "{integrator} adds energy to every oscillation, at any timestep: take --integrator {}",
                    others.join(" or ")
                )
            }
            (None, Some((limit, _))) if 0.0 < *limit && *limit < h => format!(
                "the timestep is too long for the impacts and turns of this motion: try --timestep {:.1e}",
                rounded_down(*limit)
            ),
            _ => {
                // Of the highest order; that one itself can only take smaller steps.
                let best = integrate::ALL.iter().rev().max_by_key(|i| i.order).filter(|i| i.name != integrator);
                let other = best.map_or_else(String::new, |best| format!(" or --integrator {}", best.name));
                format!("the error of {integrator} at this timestep: try --timestep {:.1e}{other}", 0.25 * h)
            }
        };
        let driven =
            if model.actuators.is_empty() { "though nothing drives the scene" } else { "beyond the actuators' work" };
        format!("warning: the energy grew from {first} to {last}, {driven}: {cause}")
    }
}

/// Whether the integrator lets every undamped oscillation grow.
pub fn gains_anyway(method: &Method) -> bool {
    let spring =
        theory::Spring { omega: 1.0, zeta: 0.0, joint: true, servo: false, approach_only: false, name: String::new() };
    theory::limit(method.integrator, &spring) == Some(0.0)
}
