//! A run as a chart: where the centre of mass was, what energy there was, how the largest motion looks in phase space.

use super::Sample;
use crate::model::{JointKind, Model};
use crate::plot::palette::{CURVES, DASHES};
use crate::plot::{Axis, Figure, Layer, Line, Panel};
use crate::state::State;

/// What a chart needs of each recorded state.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    time: Vec<f64>,
    samples: Vec<Sample>,
    /// Of every coordinate that has a velocity of its own: position and velocity.
    phase: Vec<Vec<[f64; 2]>>,
}

/// A coordinate with its velocity: indices into qpos and qvel.
struct Coordinate {
    name: String,
    qpos: usize,
    qvel: usize,
    unit: &'static str,
}

/// Slides, hinges and the linear part of free joints.
fn coordinates(model: &Model) -> Vec<Coordinate> {
    let mut list = Vec::new();
    for joint in &model.joints {
        let body = &model.bodies[joint.body].name;
        let name = if joint.name.is_empty() { body } else { &joint.name };
        let axes: &[(&str, &'static str)] = match joint.kind {
            JointKind::Free => &[("x of ", "m"), ("y of ", "m"), ("z of ", "m")],
            JointKind::Slide => &[("", "m")],
            JointKind::Hinge => &[("", "rad")],
            JointKind::Ball => &[],
        };
        for (i, (axis, unit)) in axes.iter().enumerate() {
            let name = if name.is_empty() { format!("{axis}body {}", joint.body) } else { format!("{axis}{name}") };
            list.push(Coordinate { name, qpos: joint.qposadr + i, qvel: joint.dofadr + i, unit });
        }
    }
    list
}

impl Picture {
    pub fn push(&mut self, model: &Model, state: &State, sample: &Sample) {
        self.time.push(state.time);
        self.samples.push(*sample);
        let coordinates = coordinates(model);
        self.phase.resize(coordinates.len(), Vec::new());
        for (points, c) in self.phase.iter_mut().zip(&coordinates) {
            points.push([state.qpos[c.qpos], state.qvel[c.qvel]]);
        }
    }

    /// The chart. `subtitle` says how it was computed.
    pub fn figure(&self, model: &Model, title: &str, subtitle: &str) -> Figure {
        let over_time = |label: &str, i: usize, of: &dyn Fn(&Sample) -> f64| {
            let points = self.time.iter().zip(&self.samples).map(|(t, s)| [*t, of(s)]).collect();
            let dash = if label.is_empty() { DASHES[0] } else { DASHES[i] };
            Layer::Line(Line::new(label, CURVES[i], points).dashed(dash))
        };
        let time = || Axis::linear("time [s]").tight();
        let position = (0..3).map(|i| over_time(["x", "y", "z"][i], i, &move |s| s.com[i])).collect();
        let mut panels = vec![
            Panel::new("Centre of mass", time(), Axis::linear("position [m]"), position),
            Panel::new(
                "Energy",
                time(),
                Axis::linear("kinetic and potential [J]"),
                vec![over_time("", 1, &|s| s.energy)],
            ),
        ];
        if self.samples.iter().any(|s| s.contacts > 0) {
            let depth = vec![over_time("", 2, &|s| 1e3 * s.penetration)];
            panels.push(Panel::new("Deepest contact", time(), Axis::linear("penetration [mm]"), depth));
        }
        panels.extend(self.phase_panel(model));
        let mut figure = Figure::new(title, subtitle, panels);
        (figure.columns, figure.panel_size) = (2, [330.0, 220.0]);
        figure
    }

    /// Velocity over position of the coordinate that moves most.
    fn phase_panel(&self, model: &Model) -> Option<Panel> {
        let span = |points: &Vec<[f64; 2]>| {
            let ends = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[0]), h.max(p[0])));
            ends.1 - ends.0
        };
        let widest = (0..self.phase.len()).max_by(|&a, &b| span(&self.phase[a]).total_cmp(&span(&self.phase[b])))?;
        let c = coordinates(model).swap_remove(widest);
        let line = Layer::Line(Line::new("", CURVES[0], self.phase[widest].clone()).wide(1.5));
        let (x, y) = (format!("{} [{}]", c.name, c.unit), format!("its velocity [{}/s]", c.unit));
        Some(Panel::new("Phase", Axis::linear(x), Axis::linear(y), vec![line]))
    }
}
