//! What makes a run questionable: geoms deep in one another at the start, energy from nowhere at the end.

use super::rounded_down;
use crate::explain::geom_name;
use crate::format::{short, si};
use penny::data::Contact;
use penny::forward::Method;
use penny::integrate;
use penny::model::Model;
use penny_lab::explain;
use penny_lab::record::Sample;

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
             apart; begin with them apart (pos in the file, or --qpos)\n",
            self.names(model),
            si(self.depth, "m"),
            short(self.depth / self.size)
        )
    }
}

/// The energy over the run.
pub struct EnergyGain {
    /// Of all that moves, J.
    first: f64,
    last: f64,
    /// What a change of energy is measured by: the largest kinetic energy, and the work of lifting all that moves by
    /// its largest geom's radius, J.
    scale: f64,
}

impl EnergyGain {
    /// Growth by less than this part of the scale is the usual error of a method.
    const MUCH: f64 = 0.05;

    pub fn new(model: &Model, first: &Sample) -> EnergyGain {
        let moves = |body: usize| model.bodies[body].tree.is_some();
        let radii = model.geoms.iter().filter(|g| moves(g.body)).map(|g| g.rbound);
        let mass: f64 = model.bodies.iter().filter(|b| b.tree.is_some()).map(|b| b.mass).sum();
        let lift = mass * explain::weight(model) * radii.fold(0.0, f64::max);
        EnergyGain { first: first.energy, last: first.energy, scale: lift + first.kinetic }
    }

    pub fn enter(&mut self, sample: &Sample) {
        self.last = sample.energy;
        self.scale = self.scale.max(sample.kinetic);
    }

    pub fn grew(&self) -> bool {
        self.last - self.first > EnergyGain::MUCH * self.scale
    }

    /// Says by how much the energy grew, and the likeliest cause and remedy.
    pub fn told(&self, model: &Model, method: &Method, overlap: Option<&Overlap>, limit: Option<f64>) -> String {
        let [first, last] = [self.first, self.last].map(|e| si(e, "J"));
        let (h, integrator) = (method.timestep, method.integrator.name);
        let cause = match (overlap, limit) {
            (Some(overlap), _) => {
                let names = overlap.names(model);
                format!("{names} overlapped by {} at the start; begin with them apart", si(overlap.depth, "m"))
            }
            (None, Some(limit)) if 0.0 < limit && limit < h => {
                format!("the timestep is too long for the springs: try --timestep {:.1e}", rounded_down(limit))
            }
            _ => {
                // Of the highest order; that one itself can only take smaller steps.
                let best = integrate::ALL.iter().rev().max_by_key(|i| i.order).filter(|i| i.name != integrator);
                let other = best.map_or_else(String::new, |best| format!(" or --integrator {}", best.name));
                format!("{integrator} errs at this timestep: try --timestep {:.1e}{other}", 0.25 * h)
            }
        };
        format!("warning: the energy grew from {first} to {last}, though nothing drives the scene: {cause}")
    }
}
