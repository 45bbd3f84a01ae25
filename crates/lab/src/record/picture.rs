//! A run as a chart: where the centre of mass was, what energy there was, how the largest motion looks in phase space.

use super::{Coordinate, Group, Quantity, Sample, coordinates};
use crate::plot::palette::{CURVES, DASHES};
use crate::plot::{Axis, Figure, Layer, Line, Panel};
use penny::model::Model;
use penny::state::State;

/// What a chart needs of each recorded state.
#[derive(Clone, Debug)]
pub struct Picture {
    time: Vec<f64>,
    samples: Vec<Sample>,
    /// The coordinates that have a velocity of their own, each with its position and velocity over time.
    phase: Vec<(Phase, Vec<[f64; 2]>)>,
    /// Whether what is drawn was chosen, and not only what matters in this scene.
    asked: bool,
    /// What was chosen instead of all that, or what is drawn beside it, each over time.
    curves: Vec<Curve>,
}

/// Charts of one size, two beside each other.
fn figure(title: &str, subtitle: String, panels: Vec<Panel>) -> Figure {
    let mut figure = Figure::new(title, subtitle, panels);
    figure.columns = figure.panels.len().clamp(1, 2);
    figure.panel_size = [330.0, 220.0];
    figure
}

/// A panel for each unit and group, of a few curves each.
fn panels(curves: &[&Curve]) -> Vec<Panel> {
    let mut panels: Vec<Vec<&Curve>> = Vec::new();
    for curve in curves {
        let alike = |panel: &&mut Vec<&Curve>| {
            let first = &panel[0].0;
            panel.len() < CURVES_IN_PANEL && first.unit == curve.0.unit && first.group == curve.0.group
        };
        match panels.iter_mut().find(alike) {
            Some(panel) => panel.push(curve),
            None => panels.push(vec![curve]),
        }
    }
    let panel = |curves: &Vec<&Curve>| {
        let Quantity { unit, .. } = &curves[0].0;
        let word = super::GROUPS.iter().find(|(_, group)| *group == curves[0].0.group).map_or("", |(word, _)| word);
        let title = if curves.len() == 1 { curves[0].0.name.clone() } else { word.to_owned() };
        let label = if unit.is_empty() { word.to_owned() } else { format!("{word} [{unit}]") };
        let line = |(i, (quantity, points)): (usize, &&Curve)| {
            let name = if curves.len() == 1 { "" } else { &quantity.name };
            Layer::Line(Line::new(name, CURVES[i], points.clone()).dashed(DASHES[i]))
        };
        let layers = curves.iter().enumerate().map(line).collect();
        Panel::new(title, Axis::linear("time [s]").tight(), Axis::linear(label), layers)
    };
    panels.iter().map(panel).collect()
}

/// A quantity, and its values (time in s, value).
type Curve = (Quantity, Vec<[f64; 2]>);

/// Curves in one panel.
const CURVES_IN_PANEL: usize = 4;

/// A coordinate with its velocity: indices into qpos and qvel.
#[derive(Clone, Debug)]
struct Phase {
    coordinate: Coordinate,
    qpos: usize,
    qvel: usize,
}

impl Picture {
    /// Of the chosen quantities; if there are none, of the usual, and of the joints, the spin and the loads that matter.
    pub fn new(model: &Model, chosen: &[Quantity]) -> Picture {
        let own = |(qpos, coordinate): (usize, Coordinate)| {
            let qvel = coordinate.qvel?;
            Some((Phase { coordinate, qpos, qvel }, Vec::new()))
        };
        let phase = coordinates(model).into_iter().enumerate().filter_map(own).collect();
        let asked = !chosen.is_empty();
        let quantities = if asked { chosen.to_vec() } else { super::usual(model) };
        let curves = quantities.into_iter().map(|q| (q, Vec::new())).collect();
        Picture { time: Vec::new(), samples: Vec::new(), phase, asked, curves }
    }

    /// What each state needs the values of.
    pub fn quantities(&self) -> Vec<Quantity> {
        self.curves.iter().map(|(quantity, _)| quantity.clone()).collect()
    }

    /// `values`: of [`Picture::quantities`].
    pub fn push(&mut self, state: &State, sample: &Sample, values: &[f64]) {
        for ((_, points), value) in self.curves.iter_mut().zip(values) {
            points.push([state.time, *value]);
        }
        self.time.push(state.time);
        self.samples.push(*sample);
        for (c, points) in &mut self.phase {
            points.push([state.qpos[c.qpos], state.qvel[c.qvel]]);
        }
    }

    /// The chart. `subtitle` says how it was computed.
    pub fn figure(&self, title: &str, subtitle: &str) -> Figure {
        if self.asked {
            let panels = panels(&self.curves.iter().collect::<Vec<_>>());
            return figure(title, subtitle.to_owned(), panels);
        }
        let over_time = |label: &str, i: usize, of: &dyn Fn(&Sample) -> f64| {
            let points = self.time.iter().zip(&self.samples).map(|(t, s)| [*t, of(s)]).collect();
            let dash = if label.is_empty() { DASHES[0] } else { DASHES[i] };
            Layer::Line(Line::new(label, CURVES[i], points).dashed(dash))
        };
        let time = || Axis::linear("time [s]").tight();
        let axes = self.axes_that_change().into_iter();
        let position = axes.map(|i| over_time(["x", "y", "z"][i], i, &move |s| s.com[i])).collect();
        let energy = vec![
            over_time("kinetic", 1, &|s| s.kinetic),
            over_time("potential", 2, &|s| s.energy - s.kinetic),
            over_time("sum", 0, &|s| s.energy),
        ];
        let mut panels = vec![
            Panel::new("Centre of mass", time(), Axis::linear("position [m]"), position),
            Panel::new("Energy", time(), Axis::linear("energy [J]"), energy),
        ];
        if self.samples.iter().any(|s| s.contacts > 0) {
            let depth = vec![over_time("", 2, &|s| 1e3 * s.penetration)];
            panels.push(Panel::new("Deepest contact", time(), Axis::linear("penetration [mm]"), depth));
        }
        let mut subtitle = subtitle.to_owned();
        match self.phase_panel() {
            Some(panel) => panels.extend(panel),
            None => subtitle += "\nno phase picture: a ball joint's quaternion has no velocity of its own",
        }
        panels.extend(self::panels(&self.telling()));
        figure(title, subtitle, panels)
    }

    /// The curves that say something beside the usual: of each group the few that change most, or carry most.
    fn telling(&self) -> Vec<&Curve> {
        let of = |group: Group, size: &dyn Fn(&Curve) -> f64| {
            let mut list: Vec<(f64, &Curve)> =
                self.curves.iter().filter(|c| c.0.group == group).map(|c| (size(c), c)).collect();
            list.retain(|(size, _)| *size > 1e-6);
            list.sort_by(|a, b| b.0.total_cmp(&a.0));
            list.truncate(CURVES_IN_PANEL);
            list.into_iter().map(|(_, curve)| curve).collect::<Vec<_>>()
        };
        let largest = |c: &Curve| c.1.iter().fold(0.0, |m: f64, p| m.max(p[1].abs()));
        let change = |c: &Curve| span(c.1.iter().map(|p| p[1]));
        [of(Group::Rotation, &largest), of(Group::Joints, &change), of(Group::Forces, &largest)].concat()
    }

    /// The world's axes of which there is something to see: a planar scene stays at zero across its plane.
    fn axes_that_change(&self) -> Vec<usize> {
        let spans = [0, 1, 2].map(|i| span(self.samples.iter().map(|s| s.com[i])));
        let least = 1e-3 * spans.iter().fold(0.0, |a: f64, b| a.max(*b));
        (0..3).filter(|&i| self.samples.iter().any(|s| s.com[i].abs() >= least)).collect()
    }

    /// Velocity over position of the coordinate that moves most, if any does; `None` where no coordinate has a velocity.
    fn phase_panel(&self) -> Option<Option<Panel>> {
        let width = |points: &[[f64; 2]]| span(points.iter().map(|p| p[0]));
        let (c, points) = self.phase.iter().max_by(|a, b| width(&a.1).total_cmp(&width(&b.1)))?;
        if width(points) == 0.0 && points.iter().all(|p| p[1] == 0.0) {
            return Some(None);
        }
        let line = Layer::Line(Line::new("", CURVES[0], points.clone()).wide(1.5));
        let Coordinate { name, unit, .. } = &c.coordinate;
        let (x, y) = (format!("{name} [{unit}]"), format!("its velocity [{unit}/s]"));
        Some(Some(Panel::new("Phase", Axis::linear(x), Axis::linear(y), vec![line])))
    }
}

fn span(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    high - low
}
