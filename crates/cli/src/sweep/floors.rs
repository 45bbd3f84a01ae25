//! Errors that a smaller step does not go below: those of the law itself, of the reference, and of rounding that has grown.

use std::collections::BTreeMap;

use super::super::format::si;
use penny::contact::Law;
use penny::forward::{Method, ROUNDS};
use penny::integrate;
use penny_lab::accuracy::Stepping;
use penny_lab::accuracy::horizon::growth;
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
    if let Target::Poses(_) = target {
        horizons(case, laws, smallest, &told, &mut found);
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
    found: &mut Floors,
) {
    for &law in laws {
        let timestep = fit(case.seconds, smallest.max(case.seconds / MOST_STEPS)).0;
        let method =
            Method { contact: law, integrator: &integrate::semi_implicit_euler::METHOD, timestep, rounds: ROUNDS };
        let Ok(growth) = growth(case, &method, Stepping::Fixed(timestep)) else { continue };
        let Some(doubling) = growth.doubling().filter(|d| *d < case.seconds) else { continue };
        let floor = growth.floor();
        let until =
            growth.horizon(1e-6).map_or_else(String::new, |t| format!("; 1e-6 m can be had for {}", si(t, "s")));
        found.notes.push(format!(
            "{}: errors double in {} where they grow fastest{until}; rounding alone makes {}",
            told(law),
            si(doubling, "s"),
            si(floor, "m")
        ));
        if let Some(levels) = found.levels.get_mut(law.name) {
            levels.push(Level { name: "trust horizon".into(), error: floor });
        }
    }
}
