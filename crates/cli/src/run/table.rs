//! The table over time: what matters in this scene, on one screen.
//!
//! Without `--show` a rule chooses:
//!
//! | scene | columns |
//! |---|---|
//! | at most four slides and hinges | their values |
//! | joints, nothing free | the six joints that move most |
//! | else | the centre of mass of all that moves |
//!
//! and then speed, the spin of a single free body that turns, the largest loads of contacts, energy, penetration, contacts.

use crate::format::{column, fixed, short, table};
use penny::model::{JointKind, Model};
use penny::state::State;
use penny_lab::record::{self, Group, Quantity, Sample};

/// Columns of chosen quantities, and characters of a line, that fit on a screen.
const SHOWN: usize = 10;
const WIDTH: usize = 120;
/// Joints of an arm in the table.
const JOINTS: usize = 6;
/// A load below this is none, N.
const NO_LOAD: f64 = 1e-9;

pub struct Table {
    /// Chosen by the user; else by the rule.
    asked: bool,
    /// How many were asked for.
    wanted: usize,
    quantities: Vec<Quantity>,
    lines: Vec<Line>,
}

struct Line {
    time: f64,
    sample: Sample,
    values: Vec<f64>,
}

impl Table {
    /// Of the chosen quantities; if there are none, of what the rule chooses.
    pub fn new(model: &Model, shown: &[Quantity]) -> Table {
        let asked = !shown.is_empty();
        let quantities = if asked { shown.iter().take(SHOWN).cloned().collect() } else { record::usual(model) };
        Table { asked, wanted: shown.len(), quantities, lines: Vec::new() }
    }

    /// What a line needs the values of.
    pub fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    pub fn push(&mut self, state: &State, sample: &Sample, values: Vec<f64>) {
        self.lines.push(Line { time: state.time, sample: *sample, values });
    }

    pub fn text(&self, model: &Model) -> String {
        let of = |get: &dyn Fn(&Line) -> f64| self.lines.iter().map(get).collect::<Vec<f64>>();
        let mut columns = vec![times(&of(&|l| l.time))];
        let mut caption = String::new();
        let quantity = |i: usize| {
            let Quantity { name, unit, .. } = &self.quantities[i];
            column(name, unit, &of(&|l| l.values[i]))
        };
        if self.asked {
            let width = |column: &[String]| 2 + column.iter().map(|cell| cell.chars().count()).max().unwrap_or(0);
            let mut room = WIDTH - width(&columns[0]);
            for i in 0..self.quantities.len() {
                let column = quantity(i);
                // One there is always.
                if i > 0 && width(&column) > room {
                    break;
                }
                room = room.saturating_sub(width(&column));
                columns.push(column);
            }
            if self.wanted >= columns.len() {
                let more = self.wanted + 1 - columns.len();
                caption += &format!(
                    "  {more} more of what was asked for do not fit here: --csv, --json and --plot have all\n"
                );
            }
            return caption + &table(&transposed(columns));
        }
        let group = |group: Group| (0..self.quantities.len()).filter(move |&i| self.quantities[i].group == group);
        let joints: Vec<usize> = group(Group::Joints).collect();
        let free = model.joints.iter().any(|j| matches!(j.kind, JointKind::Free | JointKind::Ball));
        if free || joints.is_empty() {
            let moving = model.bodies.iter().filter(|b| b.tree.is_some()).count();
            if moving > 1 {
                caption += "  position and speed of the common centre of mass\n";
            }
            for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                columns.push(column(name, "m", &of(&|l| l.sample.com[axis])));
            }
        } else {
            let span = |i: &usize| span(&of(&|l| l.values[*i]));
            let mut most = joints.clone();
            most.sort_by(|a, b| span(b).total_cmp(&span(a)));
            most.truncate(if joints.len() <= 4 { 4 } else { JOINTS });
            most.sort_unstable();
            if most.len() < joints.len() {
                caption +=
                    &format!("  the {} of {} joints that move most; --show joints for all\n", most.len(), joints.len());
            }
            columns.extend(most.into_iter().map(quantity));
        }
        let wide = columns.len() > 4;
        if !wide || free {
            columns.push(column("speed", "m/s", &of(&|l| l.sample.speed)));
        }
        let turns = |i: &usize| of(&|l| l.values[*i]).iter().any(|w| *w > 1e-6);
        columns.extend(group(Group::Rotation).filter(turns).map(|i| {
            let mut cells = quantity(i);
            cells[0] = cells[0].replacen(&self.quantities[i].name, "spin", 1);
            cells
        }));
        let load = |i: &usize| of(&|l| l.values[*i]).iter().sum::<f64>();
        let mut loads: Vec<usize> = group(Group::Forces).filter(|i| load(i) > NO_LOAD).collect();
        loads.sort_by(|a, b| load(b).total_cmp(&load(a)));
        loads.truncate(if columns.len() > 5 { 1 } else { 2 });
        columns.extend(loads.into_iter().map(quantity));
        columns.push(column("energy", "J", &of(&|l| l.sample.energy)));
        let depth =
            |l: &Line| if l.sample.penetration < 1e-12 { "0".to_owned() } else { short(l.sample.penetration * 1e3) };
        columns.push(headed("penetration mm", self.lines.iter().map(depth)));
        columns.push(headed("contacts", self.lines.iter().map(|l| l.sample.contacts.to_string())));
        caption + &table(&transposed(columns))
    }
}

/// Thousandths of a second, or as many digits as tell one line from the next.
fn times(times: &[f64]) -> Vec<String> {
    let gap = times.windows(2).map(|t| t[1] - t[0]).filter(|gap| *gap > 0.0).fold(1.0, f64::min);
    let decimals = (1.0 - gap.log10().floor()).clamp(3.0, 12.0) as usize;
    headed("time s", times.iter().map(|t| fixed(*t, decimals)))
}

fn headed(heading: &str, cells: impl Iterator<Item = String>) -> Vec<String> {
    std::iter::once(heading.to_owned()).chain(cells).collect()
}

fn transposed(columns: Vec<Vec<String>>) -> Vec<Vec<String>> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).map(|i| columns.iter().map(|c| c[i].clone()).collect()).collect()
}

fn span(values: &[f64]) -> f64 {
    let ends = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    ends.1 - ends.0
}
