//! What a run ends with: the forces of its contacts, and where its energy went.

use crate::format::{count, short, si};
use penny::data::Data;
use penny::math::Vec3;
use penny::model::Model;
use penny_lab::record::{self, Balance, Sample, Side};

/// Pairs of bodies listed, and contacts of each.
const PAIRS: usize = 6;
const POINTS: usize = 8;

/// The contacts of a state whose forces are known, by pairs of bodies, the largest load first.
pub fn contacts(model: &Model, data: &Data) -> String {
    struct Pair {
        sides: [Side; 2],
        /// N
        normal: Vec<f64>,
        friction: Vec3,
    }
    let mut pairs: Vec<Pair> = Vec::new();
    for c in data.contacts.iter().filter(|c| c.force[0] != 0.0) {
        let sides = record::sides(model, c.geom.map(|g| g as usize));
        let at = pairs.iter().position(|p| p.sides == sides).unwrap_or_else(|| {
            pairs.push(Pair { sides, normal: Vec::new(), friction: Vec3::zeros() });
            pairs.len() - 1
        });
        pairs[at].normal.push(c.force[0]);
        pairs[at].friction += c.frame.tr_mul(&Vec3::new(0.0, c.force[1], c.force[2]));
    }
    if pairs.is_empty() {
        return String::new();
    }
    let total = |p: &Pair| p.normal.iter().sum::<f64>();
    pairs.sort_by(|a, b| total(b).total_cmp(&total(a)));
    let mut text = "\n  contact forces at the end\n".to_owned();
    for pair in pairs.iter().take(PAIRS) {
        let normal = total(pair);
        text += &format!("    {}: normal {}", record::pair_name(model, pair.sides), newtons(normal));
        if pair.normal.len() > 1 {
            let each: Vec<String> = pair.normal.iter().take(POINTS).map(|f| four(*f)).collect();
            let more = if pair.normal.len() > POINTS { " …" } else { "" };
            text += &format!(" at {} ({}{more})", count(pair.normal.len(), "point", "points"), each.join(", "));
        }
        // Rounding of the sum.
        let friction = pair.friction.norm();
        let friction = if friction < 1e-9 * normal { 0.0 } else { friction };
        text += &format!(", friction {}\n", newtons(friction));
    }
    if pairs.len() > PAIRS {
        text += &format!("    and {} more; --show forces for all\n", count(pairs.len() - PAIRS, "pair", "pairs"));
    }
    text
}

fn newtons(x: f64) -> String {
    if x == 0.0 || (1e-2..1e5).contains(&x) { format!("{} N", four(x)) } else { si(x, "N") }
}

/// Four significant digits: 78.48 N of weight, not 78.5.
fn four(x: f64) -> String {
    if x == 0.0 || !(1e-2..1e5).contains(&x.abs()) {
        return short(x);
    }
    let decimals = (3 - x.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Where the energy went between two states, and what of it is the integrator's error.
///
/// `kinetic`: the largest kinetic energy of the run, J; without a balance only the two energies are told.
pub fn energy(model: &Model, first: &Sample, last: &Sample, kinetic: f64, balance: Option<&Balance>) -> String {
    if model.trees.is_empty() {
        return String::new();
    }
    let ends = format!("  energy {} to {}", si(first.energy, "J"), si(last.energy, "J"));
    let Some(balance) = balance else { return format!("{ends}\n") };
    let scale = kinetic.max((last.energy - first.energy).abs()).max(balance.actuators.abs());
    // Rounding of the run's sums.
    let counts = |x: f64| x.abs() > 1e-9 * scale;
    let signed = |x: f64| format!("{}{}", if x > 0.0 { "+" } else { "" }, si(x, "J"));
    let mut parts = Vec::new();
    if !model.actuators.is_empty() {
        parts.push(format!("actuators {}", signed(balance.actuators)));
    }
    for (what, work) in
        [("dampers", balance.dampers), ("the medium", balance.medium), ("gravity compensation", balance.lift)]
    {
        if counts(work) {
            parts.push(format!("{what} {}", signed(work)));
        }
    }
    if counts(balance.constraints) {
        let friction = if counts(balance.friction) {
            format!(" (friction about {})", signed(balance.friction))
        } else {
            String::new()
        };
        let tied = model.requires.equalities + model.requires.tendons > 0;
        let what = if tied { "contacts, limits and equalities" } else { "contacts and joint limits" };
        parts.push(format!("{what} {}{friction}", signed(balance.constraints)));
    }
    let drift = last.energy - first.energy - balance.total();
    let share = if kinetic > 0.0 && counts(drift) {
        format!(" ({} % of the largest kinetic energy)", short(100.0 * drift.abs() / kinetic))
    } else {
        String::new()
    };
    parts.push(format!("drift {}{share}", if counts(drift) { signed(drift) } else { "0 J".to_owned() }));
    format!("{ends}: {}\n", parts.join(", "))
}
