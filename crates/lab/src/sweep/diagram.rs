//! The work–precision diagram: error over cost, one panel a law, one curve an integrator.

use std::collections::BTreeMap;

use super::grid::{Row, pareto};
use crate::plot::palette::{CURVES, DASHES, GREY, MARKERS, Rgb};
use crate::plot::{Axis, Figure, Layer, Line, Panel};

/// Colour of the Pareto front: behind everything.
const FRONT: Rgb = [255, 214, 102];

/// What the diagram says besides its curves.
pub struct Words {
    pub title: String,
    /// Scene, reference, how it was measured.
    pub subtitle: String,
    /// What the error is of: `position [m]`.
    pub error: String,
}

/// An error that a smaller step does not go below, in the error's unit, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    pub name: String,
    pub error: f64,
}

/// Error over cost of all stable rows, and the levels of each law below which cost buys nothing.
pub fn work_precision(rows: &[Row], words: Words, levels: &BTreeMap<String, Vec<Level>>) -> Figure {
    let listed = penny::contact::ALL.iter().map(|law| law.name);
    let laws: Vec<&str> = listed.filter(|law| rows.iter().any(|r| r.law == *law)).collect();
    let front: Vec<[f64; 2]> = pareto(rows).into_iter().filter_map(Row::place).map(floor).collect();
    let panels =
        laws.iter().map(|law| panel(rows, law, &words.error, &front, levels.get(*law).map_or(&[], |l| l))).collect();
    let of = if laws.len() > 1 { " of all laws together" } else { "" };
    let hidden = match rows.iter().filter(|r| r.place().is_none()).count() {
        0 => String::new(),
        n => format!(" Not drawn: {n} of {} methods, which were unstable.", rows.len()),
    };
    let subtitle = format!(
        "{}\nDown and left is better; broad: the Pareto front{of}, which no method beats.{hidden}",
        words.subtitle
    );
    Figure { shared: true, ..Figure::new(words.title, subtitle, panels) }
}

/// An error of 0 has no place on a logarithmic axis: rounding is the least that is shown.
fn floor([cost, error]: [f64; 2]) -> [f64; 2] {
    [cost, error.max(1e-16)]
}

fn panel(rows: &[Row], law: &str, error: &str, front: &[[f64; 2]], levels: &[Level]) -> Panel {
    let mut layers = vec![Layer::Line(Line::new("", FRONT, front.to_vec()).wide(9.0))];
    let ends = rows.iter().filter_map(Row::place).map(|[cost, _]| cost);
    let (low, high) = ends.fold((f64::INFINITY, 0.0f64), |(l, h), c| (l.min(c), h.max(c)));
    for (i, Level { name, error }) in levels.iter().enumerate().filter(|(_, l)| l.error > 1e-16 && low < high) {
        let line = Line::new(name, GREY, vec![[low, *error], [high, *error]]);
        layers.push(Layer::Line(line.wide(1.0).dashed(DASHES[(i + 1) % DASHES.len()])));
    }
    for (i, integrator) in penny::integrate::ALL.iter().enumerate() {
        let of = |r: &&Row| r.law == law && r.integrator == integrator.name;
        let mut points: Vec<[f64; 2]> = rows.iter().filter(of).filter_map(Row::place).map(floor).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        if !points.is_empty() {
            let line = Line::new(integrator.name, CURVES[i % CURVES.len()], points);
            layers.push(Layer::Line(line.dashed(DASHES[i % DASHES.len()]).marked(MARKERS[i % MARKERS.len()])));
        }
    }
    Panel::new(
        law,
        Axis::log("computing time per simulated time [s/s]"),
        Axis::log(format!("error of {error}")),
        layers,
    )
}
