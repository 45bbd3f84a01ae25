//! Errors that a smaller step does not go below: those of the law itself, of the reference, and of rounding that has grown.

use std::collections::BTreeMap;

use super::super::format::si;
use penny::contact::Law;
use penny::forward::{Method, ROUNDS};
use penny::integrate;
use penny_lab::accuracy::Stepping;
use penny_lab::accuracy::horizon::{Growth, growth};
use penny_lab::plot::number;
use penny_lab::sweep::Case;
use penny_lab::sweep::diagram::Level;
use penny_lab::sweep::grid::Target;
use penny_lab::sweep::reference::Reference;
use penny_lab::sweep::trajectory::{distance, fit};
use penny_lab::sweep::truth::Truth;

/// Levels by law, and what there is to say about them.
pub struct Floors {
    pub levels: BTreeMap<String, Vec<Level>>,
    pub notes: Vec<String>,
}

/// A law's own error counts where it is this many times what halving the step still changes.
const CLEAR: f64 = 3.0;
/// The error of which is said for how long it can be had, m.
const WANTED: f64 = 1e-6;
/// Steps of the runs that tell how errors grow.
const MOST_STEPS: f64 = 2e5;

/// The floors under the curves of a sweep; `unit` is the error's.
pub fn floors(
    case: &Case,
    target: &Target,
    laws: &[&'static Law],
    smallest: f64,
    unit: &str,
    contactless: bool,
) -> Floors {
    let told = |law: &Law| if contactless { "all laws" } else { law.name };
    let mut found = Floors { levels: BTreeMap::new(), notes: Vec::new() };
    for &law in laws {
        let mut levels = Vec::new();
        match target {
            Target::Poses(references) => {
                let Some(reference) = references.get(law.name) else { continue };
                levels.push(Level { name: "uncertain below".into(), error: reference.uncertainty });
                let others = other_laws(case, references, reference, law, laws);
                let (nearest, farthest) = (others.first(), others.get(1..).and_then(<[_]>::last));
                if let Some((nearest, error)) = nearest {
                    let farthest = farthest.map_or_else(String::new, |(other, error)| {
                        format!(", {other}, the farthest, {}", si(*error, "m"))
                    });
                    found.notes.push(format!(
                        "{}: {nearest}, the law nearest to it, is {} away{farthest}: a smaller error buys nothing if either will do",
                        law.name,
                        si(*error, "m")
                    ));
                }
                let level = |(other, error): &(&str, f64)| Level { name: format!("from {other}"), error: *error };
                levels.extend([nearest, farthest].into_iter().flatten().map(level));
            }
            Target::Exact(truth) => {
                let Some((error, change)) = own_error(case, truth, law, smallest) else { continue };
                let quantity = unit.split_once('[').map_or("", |(_, u)| u.trim_end_matches(']'));
                if error > CLEAR * change {
                    found.notes.push(format!(
                        "{}: its own error, at step 0: {} {quantity}: no smaller step goes below",
                        told(law),
                        number(error)
                    ));
                    levels.push(Level { name: "the law's own".into(), error });
                } else {
                    let most = error.max(change);
                    found.notes.push(format!(
                        "{}: its own error, at step 0, is below {} {quantity}",
                        told(law),
                        number(most)
                    ));
                }
            }
        }
        found.levels.insert(law.name.to_owned(), levels);
    }
    if let Target::Poses(references) = target {
        horizons(case, laws, smallest, &told, references, &mut found);
    }
    found
}

/// How far other laws are from this one, m, each at its own smallest step, the nearest first; those that are within the
/// uncertainty of its reference are left out.
fn other_laws<'l>(
    case: &Case,
    references: &BTreeMap<&'static str, Reference>,
    reference: &Reference,
    law: &Law,
    laws: &[&'l Law],
) -> Vec<(&'l str, f64)> {
    let apart = |other: &Law| {
        let other = references.get(other.name)?;
        distance(&case.model, &reference.samples, &other.samples)
    };
    let others = laws.iter().copied().filter(|other| other.name != law.name);
    let mut found: Vec<(&str, f64)> = others
        .filter_map(|other| Some((other.name, apart(other)?)))
        .filter(|(_, apart)| *apart > reference.uncertainty)
        .collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    found
}

/// A law's error against a closed form at half of the smallest step, and how much the halving changed it: by the integrator
/// that it changes least.
fn own_error(case: &Case, truth: &Truth, law: &'static Law, smallest: f64) -> Option<(f64, f64)> {
    let by = |integrator| {
        let at = |h: f64| {
            let method = Method { contact: law, integrator, timestep: fit(case.seconds, h).0, rounds: ROUNDS };
            Some((truth.measure(case, &method).ok()? - (truth.exact)(case, &method)?).abs())
        };
        let (coarse, fine) = (at(smallest)?, at(0.5 * smallest)?);
        Some((fine, (fine - coarse).abs())).filter(|(fine, _)| fine.is_finite())
    };
    let all = integrate::ALL.iter().filter(|i| !i.implicit).filter_map(|i| by(*i));
    all.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// How errors grow under each law, and what that makes of rounding.
fn horizons(
    case: &Case,
    laws: &[&'static Law],
    smallest: f64,
    told: &dyn Fn(&Law) -> &'static str,
    references: &BTreeMap<&'static str, Reference>,
    found: &mut Floors,
) {
    for &law in laws {
        let Some(reference) = references.get(law.name) else { continue };
        let timestep = fit(case.seconds, smallest.max(case.seconds / MOST_STEPS)).0;
        let method =
            Method { contact: law, integrator: &integrate::semi_implicit_euler::METHOD, timestep, rounds: ROUNDS };
        let Ok(growth) = growth(case, &method, Stepping::Fixed(timestep)) else { continue };
        let Some((note, floor)) = growing(&growth, case.seconds, reference.uncertainty) else { continue };
        found.notes.push(format!("{}: {note}", told(law)));
        let levels = found.levels.get_mut(law.name);
        if let (Some(levels), Some(floor)) = (levels, floor) {
            levels.push(Level { name: "trust horizon".into(), error: floor });
        }
    }
}

/// What there is to say of errors that grow, and what rounding alone makes, m. `None` where they do not, or where the runs of the
/// reference agree and twins that part are wrong ([`penny_lab::accuracy::horizon`]).
///
/// In: length of the run, s; `uncertainty` of the reference, m: how far two runs are apart at most, rounding included.
fn growing(growth: &Growth, seconds: f64, uncertainty: f64) -> Option<(String, Option<f64>)> {
    let doubling = growth.doubling().filter(|d| *d < seconds)?;
    let until = growth.horizon(WANTED);
    if until.is_some() && uncertainty <= WANTED {
        return None;
    }
    let floor = Some(growth.floor()).filter(|floor| *floor <= uncertainty.max(WANTED));
    let until = until.map_or_else(String::new, |t| format!("; {WANTED:e} m can be had for {}", si(t, "s")));
    let made = floor.map_or_else(String::new, |floor| format!("; rounding alone makes {}", si(floor, "m")));
    Some((format!("errors double in {} where they grow fastest{until}{made}", si(doubling, "s")), floor))
}

#[cfg(test)]
mod tests {
    use super::{Growth, growing};

    #[test]
    fn rounding_makes_no_more_than_the_runs_of_the_reference_are_apart() {
        let seconds = |i: u32| f64::from(i) / 8.0;
        let doubling_in = |time: f64| Growth {
            times: (1..=8).map(seconds).collect(),
            log: (1..=8).map(|i| seconds(i) / time * std::f64::consts::LN_2).collect(),
        };
        // 1e-15 m, doubled ten times.
        let (note, floor) = growing(&doubling_in(0.1), 1.0, 1e-9).expect("a note");
        assert_eq!(note, "errors double in 100 ms where they grow fastest; rounding alone makes 1.02 pm");
        assert!((floor.expect("a level") / 1.024e-12 - 1.0).abs() < 1e-9);
        // 1000 times would be 1e286 m.
        let (note, floor) = growing(&doubling_in(1e-3), 1.0, 0.3).expect("a note");
        assert_eq!(
            (note.contains("1e-6 m can be had"), note.contains("rounding"), floor),
            (true, false, None),
            "{note}"
        );
        assert_eq!(growing(&doubling_in(1e-3), 1.0, 1e-8), None);
    }
}
