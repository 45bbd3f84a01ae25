//! Lints: numbers that MuJoCo accepts silently although they are seldom meant: each a warning, never an error.
//!
//! Nothing is changed here: the numbers keep MuJoCo's meaning, and the warning says what that is.

use std::f64::consts::PI;

use super::defaults::{Value, Values};
use super::document::{Document, NodeId};
use super::error::{Advice, Problem, ProblemKind};
use super::schema::{Lint, Row};
use super::suggestions::{neat, unit_of};

/// What is questionable about number `index` of an attribute's `all`, and what to write instead.
pub fn number(doubt: Lint, attribute: &str, index: usize, word: &str, all: &[f64]) -> Option<(ProblemKind, Advice)> {
    let value = *all.get(index)?;
    match doubt {
        Lint::Clamped(bounds) => {
            let &(low, high) = bounds.get(index).filter(|(low, high)| value < *low || value > *high)?;
            let used = value.clamp(low, high);
            // A dmin of 0 counts as 0.0001, which nothing shows.
            if index == 0 && value == 0.0 {
                return None;
            }
            let advice = Advice::Word(format!("write `{used}`"), used.to_string());
            Some((
                ProblemKind::Clamped { attribute: attribute.to_string(), word: word.to_string(), used, low, high },
                advice,
            ))
        }
        Lint::Raised(least) if value > 0.0 && value < least => {
            let used = least.to_string();
            let help = format!("write `{used}`, or `0` for as little as there can be");
            Some((ProblemKind::Raised { attribute: attribute.to_string(), word: word.to_string(), used }, help.into()))
        }
        // One warning a colour: at the first number that is beyond.
        Lint::Colour if all.iter().position(|c| !(0.0..=1.0).contains(c)) == Some(index) => {
            // Of a colour in bytes the opacity is often given from 0 to 1; "2 0 0 1" is no such colour.
            let whole = |(i, c): (usize, &f64)| (0.0..=255.0).contains(c) && (c.fract() == 0.0 || i == 3 && *c <= 1.0);
            let bytes = all.iter().enumerate().all(whole) && all.iter().any(|&c| c >= 16.0);
            let part = |(i, c): (usize, &f64)| if i == 3 && *c <= 1.0 { *c } else { (c / 2.55).round() / 100.0 };
            let help = if bytes {
                let parts: Vec<String> = all.iter().enumerate().map(|c| part(c).to_string()).collect();
                let meant = parts.join(" ");
                Advice::Value(format!("divide by 255: `{meant}`"), meant)
            } else {
                "1 is full brightness, 0 is none".into()
            };
            Some((ProblemKind::ColourCut { attribute: attribute.to_string(), word: word.to_string() }, help))
        }
        Lint::TooLong(seconds) if value >= seconds => {
            let meant = neat(value / 1e3);
            let advice = Advice::Word(format!("it is in seconds: {word} ms are `{meant}`"), meant);
            Some((ProblemKind::LongTimestep { word: word.to_string() }, advice))
        }
        // Densities in g/cm³ are mostly broken numbers (7.85, 2.7, 1.2); a whole one may be meant.
        Lint::Density if (0.1..23.0).contains(&value) && value.fract() != 0.0 => {
            let meant = neat(value * 1e3);
            let advice = Advice::Word(format!("it is in kg/m³: {word} g/cm³ are `{meant}`"), meant);
            Some((ProblemKind::LightDensity { word: word.to_string() }, advice))
        }
        _ => None,
    }
}

/// Warns of an impedance that falls with depth. MuJoCo takes it, and so does Penny.
pub fn falling_impedance(document: &Document, node: NodeId, values: &Values, problems: &mut Vec<Problem>) {
    for attribute in document.attributes(node).iter().filter(|a| a.name.starts_with("solimp")) {
        let Some(Value::Numbers(v)) = values.get(&attribute.name) else { continue };
        if let [first, second, width, ..] = v[..]
            && first > second
            && width > 0.0
        {
            let kind = ProblemKind::ImpedanceFalls { attribute: attribute.name.to_string(), first, second };
            let help = format!("its numbers are dmin dmax width: `{second} {first} {width}` rises");
            problems.push(Problem::new(kind, attribute.value_span).help(help));
        }
    }
}

/// Warns of a `solref` and of a geom's `friction` whose first two numbers look swapped.
///
///     solref:   timeconst ≥ 0.5 s, and dampratio ≤ 0.1
///     friction: torsional ≥ 0.1 m, and ten times the sliding coefficient, which is above 0
pub fn swapped(document: &Document, node: NodeId, values: &Values, problems: &mut Vec<Problem>) {
    let element = document.node(node);
    for attribute in document.attributes(node) {
        let Some(Value::Numbers(v)) = values.get(&attribute.name) else { continue };
        let (kind, names) = match v[..] {
            [timeconst, dampratio] if attribute.name.contains("solref") => {
                if timeconst < 0.5 || dampratio <= 0.0 || dampratio > 0.1 {
                    continue;
                }
                let kind = ProblemKind::SolrefSwapped { attribute: attribute.name.to_string(), timeconst, dampratio };
                (kind, "timeconst dampratio")
            }
            [sliding, torsional, _] if attribute.name == "friction" && element.name == "geom" => {
                if torsional < 0.1 || sliding <= 0.0 || torsional < 10.0 * sliding {
                    continue;
                }
                (ProblemKind::FrictionSwapped { sliding, torsional }, "sliding torsional rolling")
            }
            _ => continue,
        };
        let mut right = v.clone();
        right.swap(0, 1);
        let right = right.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let help = format!("its numbers are {names}: did you mean `{right}`?");
        problems.push(Problem::new(kind, attribute.value_span).help(help));
    }
}

/// Warns of an element's angles that are to be in radians and look like degrees: whole numbers of many turns.
///
/// A range may be of some turns (a wheel, a screw), an orientation hardly of one.
pub fn degrees(document: &Document, node: NodeId, row: &Row, kind: &str, problems: &mut Vec<Problem>) {
    for attribute in document.attributes(node) {
        let unit = row.attribute(&attribute.name).map_or("", |column| column.unit);
        if !unit.ends_with("angle") || (unit.starts_with("m or") && matches!(kind, "slide" | "free")) {
            continue;
        }
        let Some(all) = super::check::floats(&attribute.value) else { continue };
        let is_angle = |i: usize| unit_of(unit, i).ends_with("angle");
        let angles: Vec<f64> = all.iter().enumerate().filter(|(i, _)| is_angle(*i)).map(|(_, x)| *x).collect();
        let largest = angles.iter().fold(0.0, |m: f64, x| if x.abs() > m.abs() { *x } else { m });
        let turns = if unit.starts_with("m or") { 2.0 } else { 1.01 };
        if !looks_like_degrees(largest, turns) || angles.iter().any(|x| x.fract() != 0.0) {
            continue;
        }
        let radians = |(i, x): (usize, &f64)| if is_angle(i) { in_radians(*x) } else { x.to_string() };
        let help: Vec<String> = all.iter().enumerate().map(radians).collect();
        let kind = ProblemKind::LooksLikeDegrees {
            attribute: attribute.name.to_string(),
            word: largest.to_string(),
            turns: turned(largest),
        };
        let meant = help.join(" ");
        let help = format!("write `{meant}`, or `<compiler angle=\"degree\"/>` for the whole scene");
        let problem = Problem::new(kind, attribute.value_span).help(help);
        problems.push(problem.replace(attribute.value_span, Some(&meant)));
    }
}

/// Whether an angle in radians is more likely one in degrees: a multiple of 5 up to a turn of 360, of more than this many
/// turns as radians.
pub fn looks_like_degrees(x: f64, turns: f64) -> bool {
    x.abs() > turns * 2.0 * PI && x.abs() <= 360.0 && x % 5.0 == 0.0
}

/// Of degrees, with four digits.
pub fn in_radians(degrees: f64) -> String {
    let x = degrees.to_radians();
    if x == 0.0 { "0".to_string() } else { format!("{}", format!("{x:.3e}").parse::<f64>().unwrap_or(x)) }
}

/// Turns of an angle in radians, with three digits.
pub fn turned(x: f64) -> String {
    format!("{}", format!("{:.2e}", x.abs() / (2.0 * PI)).parse::<f64>().unwrap_or(x))
}

/// Warns of an element's angles that are to be in degrees and look like radians.
///
/// `kind`: the element's `type`, also an inherited one: a joint's says whether its `range` is an angle.
pub fn radians(document: &Document, node: NodeId, row: &Row, kind: &str, problems: &mut Vec<Problem>) {
    for attribute in document.attributes(node) {
        let unit = row.attribute(&attribute.name).map_or("", |column| column.unit);
        if !unit.ends_with("angle") || (unit.starts_with("m or") && matches!(kind, "slide" | "free")) {
            continue;
        }
        let Some(all) = super::check::floats(&attribute.value) else {
            continue;
        };
        let is_angle = |i: usize| unit_of(unit, i).ends_with("angle");
        let angles = || all.iter().enumerate().filter(|(i, _)| is_angle(*i)).map(|(_, x)| *x);
        // Beside 45 or 90 even a 1.5708 is in degrees.
        if !angles().any(|x| degrees_of_radians(x).is_some()) || angles().any(|x| x.abs() > 2.01 * PI) {
            continue;
        }
        let degrees = |(i, x): (usize, &f64)| match degrees_of_radians(*x) {
            _ if !is_angle(i) => x.to_string(),
            Some(degrees) => degrees.to_string(),
            None => ((x.to_degrees() * 100.0).round() / 100.0).to_string(),
        };
        let help: Vec<String> = all.iter().enumerate().map(degrees).collect();
        let kind = ProblemKind::LooksLikeRadians { attribute: attribute.name.to_string() };
        let meant = help.join(" ");
        let help = format!("write `{meant}`, or `<compiler angle=\"radian\"/>` for the whole scene");
        let problem = Problem::new(kind, attribute.value_span).help(help);
        problems.push(problem.replace(attribute.value_span, Some(&meant)));
    }
}

/// The degrees of an angle that looks like radians: a multiple of π/6 or π/4, up to a turn, as people write it, that
/// is to one part in a thousand (3.14 is π to 5 in 10 000). With at most one decimal (5.5) it is more likely degrees.
fn degrees_of_radians(x: f64) -> Option<f64> {
    let twelfths = (x * 12.0 / PI).round();
    let exact = twelfths * PI / 12.0;
    let listed = twelfths != 0.0 && twelfths.abs() <= 24.0 && (twelfths % 2.0 == 0.0 || twelfths % 3.0 == 0.0);
    let round = (x * 10.0).round() / 10.0 == x;
    (listed && !round && (x - exact).abs() <= 1e-3 * exact.abs()).then_some(15.0 * twelfths)
}

#[cfg(test)]
mod tests {
    use super::degrees_of_radians;

    #[test]
    fn radians_are_told_from_degrees() {
        let of = |word: &str| degrees_of_radians(word.parse().unwrap());
        for (radians, degrees) in
            [("1.5708", 90.0), ("-1.57", -90.0), ("3.14", 180.0), ("0.785", 45.0), ("0.5236", 30.0)]
        {
            assert_eq!(of(radians), Some(degrees), "{radians}");
        }
        for degrees in [0.0, 0.5, 0.52, 1.0, 1.5, 1.6, 2.0, 3.1, 5.5, 15.0, 30.0, 45.0, 90.0, 180.0, 0.2618] {
            assert_eq!(degrees_of_radians(degrees), None, "{degrees}");
        }
    }
}
