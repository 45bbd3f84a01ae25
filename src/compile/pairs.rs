//! Which geoms can touch, and with which parameters.

use std::collections::{BTreeMap, BTreeSet};

use super::Log;
use super::layout::World;
use crate::collision::sweep::{may_touch, order};
use crate::mjcf::{ProblemKind, Spec, spec};
use crate::model::{ContactOverride, Geom, GeomKind, Mix, Pair, Pairs};

/// Up to this many pairs among geoms other than planes are listed one by one (24 free spheres have 276);
/// beyond, a broad phase looks for them in each step. From about 8 bodies on that is as fast.
pub const MOST_LISTED: usize = 276;

/// Friction coefficients below this are raised to it (MuJoCo's `mjMINMU`).
pub const MIN_MU: f64 = 1e-5;

/// The pairs of a scene in MuJoCo's contact order, and their parameters.
///
/// A `<pair>` replaces what the filters would let pass.
pub fn find(world: &World, spec: &Spec, over: Option<ContactOverride>, log: &mut Log) -> (Pairs, Vec<Mix>) {
    let excluded = excluded(world, spec, log);
    let given = explicit(world, spec, log);
    let on = |flag: &str| spec.flags.get(flag).copied().unwrap_or(true);
    if !(on("contact") && on("constraint")) {
        return (Pairs::default(), Vec::new());
    }
    let with_plane = |c: &[usize; 2]| c.iter().any(|&g| world.geoms[g].kind == GeomKind::Plane);
    let mut candidates: Vec<[usize; 2]> = Vec::new();
    let mut unlisted = 0;
    each_possible(world, &given, &excluded, on("filterparent"), |geom| {
        unlisted += usize::from(!with_plane(&geom));
        if unlisted <= MOST_LISTED || with_plane(&geom) {
            candidates.push(geom);
        }
    });
    let swept = unlisted > MOST_LISTED;

    let mut pairs = Pairs { excluded, ..Pairs::default() };
    let mut mixes = Mixes::default();
    let mut list = |geom: [usize; 2], mix: Mix, explicit: bool| {
        let index = mixes.index(overridden(mix, over));
        let pair = Pair::new(&world.geoms, geom, index, &mixes.list[index]);
        pairs.listed.extend(pair.map(|pair| Pair { explicit, ..pair }));
    };
    for e in given {
        list(e.geom, e.mix, true);
    }
    for geom in candidates.into_iter().filter(|c| !swept || with_plane(c)) {
        list(geom, mixed(&world.geoms[geom[0]], &world.geoms[geom[1]]), false);
    }
    pairs.listed.sort_by_key(|pair| order(&world.geoms, pair));
    if swept {
        sweep(&world.geoms, &mut pairs, &mut mixes, over);
    }
    (pairs, mixes.list)
}

fn sorted([a, b]: [usize; 2]) -> (usize, usize) {
    (a.min(b), a.max(b))
}

/// Body pairs of `<exclude>`, low number first, sorted.
fn excluded(world: &World, spec: &Spec, log: &mut Log) -> Vec<(usize, usize)> {
    let names = world.body_names();
    let mut found = Vec::new();
    for exclude in &spec.excludes {
        let first = names.find(&exclude.body1, exclude.node, "body1", log);
        let second = names.find(&exclude.body2, exclude.node, "body2", log);
        if let (Some(a), Some(b)) = (first, second) {
            found.push(sorted([a, b]));
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// A `<contact><pair>` with its geoms found.
struct Explicit<'a> {
    geom: [usize; 2],
    mix: Mix,
    spec: &'a spec::Pair,
}

fn explicit<'a>(world: &World, spec: &'a Spec, log: &mut Log) -> Vec<Explicit<'a>> {
    let names = world.geom_names();
    let mut found: Vec<Explicit> = Vec::new();
    for pair in &spec.pairs {
        let first = names.find(&pair.geom1, pair.node, "geom1", log);
        let second = names.find(&pair.geom2, pair.node, "geom2", log);
        let (Some(a), Some(b)) = (first, second) else { continue };
        let geom = [a, b];
        let weld = geom.map(|g| world.bodies[world.geoms[g].body].weld);
        if a == b {
            log.error(pair.node, ProblemKind::PairOfOne, "name two different geoms");
        } else if let Some(earlier) = found.iter().find(|e| sorted(e.geom) == sorted(geom)) {
            let help = "MuJoCo would count every contact twice; keep one of the two";
            log.error(pair.node, ProblemKind::PairTwice, help);
            log.related(earlier.spec.node, "first given here");
        } else if weld[0] == weld[1] {
            log.warning(pair.node, ProblemKind::PairAtRest, "remove the pair, or give one of the bodies a joint");
        } else {
            found.push(Explicit { geom, mix: given(pair), spec: pair });
        }
    }
    found
}

/// Hands on all pairs that the filters let pass and that no `<pair>` replaces.
fn each_possible(
    world: &World,
    given: &[Explicit],
    excluded: &[(usize, usize)],
    filterparent: bool,
    mut found: impl FnMut([usize; 2]),
) {
    let replaced: BTreeSet<(usize, usize)> = given.iter().map(|e| sorted(e.geom)).collect();
    let geoms: Vec<usize> = (0..world.geoms.len()).filter(|&g| collides(&world.geoms[g])).collect();
    for (i, &a) in geoms.iter().enumerate() {
        for &b in &geoms[i + 1..] {
            if may_touch(&world.bodies, &world.geoms, a, b, filterparent, excluded) && !replaced.contains(&(a, b)) {
                found([a, b]);
            }
        }
    }
}

fn collides(geom: &Geom) -> bool {
    geom.contype != 0 || geom.conaffinity != 0
}

/// Contact parameters of two geoms.
///
///     higher priority:  condim, friction, solref, solimp are that geom's
///     same priority:    condim and friction: the larger, element by element
///                       solimp, solref: w a + (1 − w) b,  w = solmixₐ/(solmixₐ + solmix_b)
///                       solref where one is direct (solref[0] ≤ 0): the smaller, element by element
///     always:           margin and gap: the sums
///
/// Source: MuJoCo manual, Modeling › Contact parameters; checked against 4.0.0.
pub fn mixed(a: &Geom, b: &Geom) -> Mix {
    let (margin, gap) = (a.margin + b.margin, a.gap + b.gap);
    if a.priority != b.priority {
        let g = if a.priority > b.priority { a } else { b };
        return mix(g.condim, g.friction, g.solref, g.solimp, margin, gap);
    }
    let weight = match (a.solmix < crate::math::MIN_VAL, b.solmix < crate::math::MIN_VAL) {
        (false, false) => a.solmix / (a.solmix + b.solmix),
        (true, true) => 0.5,
        (true, false) => 0.0,
        (false, true) => 1.0,
    };
    let blend = |x: f64, y: f64| weight * x + (1.0 - weight) * y;
    let direct = a.solref[0] <= 0.0 || b.solref[0] <= 0.0;
    let solref = [0, 1].map(|i| if direct { a.solref[i].min(b.solref[i]) } else { blend(a.solref[i], b.solref[i]) });
    let solimp = [0, 1, 2, 3, 4].map(|i| blend(a.solimp[i], b.solimp[i]));
    let friction = [0, 1, 2].map(|i| a.friction[i].max(b.friction[i]));
    mix(a.condim.max(b.condim), friction, solref, solimp, margin, gap)
}

fn mix(condim: usize, [slide, spin, roll]: [f64; 3], solref: [f64; 2], solimp: [f64; 5], margin: f64, gap: f64) -> Mix {
    let friction = [slide, slide, spin, roll, roll].map(|mu| mu.max(MIN_MU));
    Mix { condim, friction, solref, solreffriction: solref, solimp, margin, gap }
}

/// The parameters of a `<pair>`: all its own, nothing from the geoms.
fn given(pair: &spec::Pair) -> Mix {
    let solreffriction = if pair.solreffriction == [0.0, 0.0] { pair.solref } else { pair.solreffriction };
    Mix {
        condim: pair.condim,
        friction: pair.friction.map(|mu| mu.max(MIN_MU)),
        solref: pair.solref,
        solreffriction,
        solimp: pair.solimp,
        margin: pair.margin,
        gap: pair.gap,
    }
}

/// `<flag override="enable">`: condim and gap stay.
fn overridden(mix: Mix, over: Option<ContactOverride>) -> Mix {
    match over {
        None => mix,
        Some(ContactOverride { friction, solref, solimp, margin }) => {
            Mix { friction, solref, solreffriction: solref, solimp, margin, ..mix }
        }
    }
}

/// Contact parameters that occur, each once.
#[derive(Default)]
struct Mixes {
    list: Vec<Mix>,
    index: BTreeMap<[u64; 17], usize>,
}

impl Mixes {
    fn index(&mut self, mix: Mix) -> usize {
        *self.index.entry(bits(&mix)).or_insert_with(|| {
            self.list.push(mix);
            self.list.len() - 1
        })
    }
}

/// All numbers of a mix, to tell two apart.
fn bits(mix: &Mix) -> [u64; 17] {
    let numbers = [mix.condim as f64].into_iter();
    let numbers = numbers.chain(mix.friction).chain(mix.solref).chain(mix.solreffriction).chain(mix.solimp);
    let mut bits = [0; 17];
    for (slot, number) in bits.iter_mut().zip(numbers.chain([mix.margin, mix.gap])) {
        *slot = number.to_bits();
    }
    bits
}

/// Many geoms: those that collide with others than planes, and a table of mixes by class of parameters.
fn sweep(geoms: &[Geom], pairs: &mut Pairs, mixes: &mut Mixes, over: Option<ContactOverride>) {
    let swept = |g: &usize| geoms[*g].kind != GeomKind::Plane && collides(&geoms[*g]);
    pairs.swept = (0..geoms.len()).filter(swept).collect();
    let mut classes: BTreeMap<Vec<u64>, (u32, usize)> = BTreeMap::new();
    pairs.class = vec![0; geoms.len()];
    for &g in &pairs.swept {
        let count = classes.len() as u32;
        pairs.class[g] = classes.entry(parameters(&geoms[g])).or_insert((count, g)).0;
    }
    let mut examples = vec![0; classes.len()];
    for (class, geom) in classes.into_values() {
        examples[class as usize] = geom;
    }
    for &a in &examples {
        for &b in &examples {
            let mix = overridden(mixed(&geoms[a], &geoms[b]), over);
            pairs.mix_table.push(mixes.index(mix) as u32);
        }
    }
}

/// Contact parameters anew, after geoms have changed; those of a `<pair>` stay.
pub fn remix(geoms: &[Geom], over: Option<ContactOverride>, pairs: &mut Pairs, old: &[Mix]) -> Vec<Mix> {
    let mut mixes = Mixes::default();
    for pair in &mut pairs.listed {
        let [a, b] = pair.geom.map(|g| &geoms[g]);
        let mix = if pair.explicit { old[pair.mix].clone() } else { mixed(a, b) };
        let index = mixes.index(overridden(mix, over));
        let explicit = pair.explicit;
        if let Some(anew) = Pair::new(geoms, pair.geom, index, &mixes.list[index]) {
            *pair = Pair { explicit, ..anew };
        }
    }
    if !pairs.swept.is_empty() {
        pairs.mix_table.clear();
        sweep(geoms, pairs, &mut mixes, over);
    }
    mixes.list
}

/// All that a geom contributes to a mix.
fn parameters(g: &Geom) -> Vec<u64> {
    let numbers = [g.condim as f64, g.priority as f64, g.solmix, g.margin, g.gap].into_iter();
    numbers.chain(g.friction).chain(g.solref).chain(g.solimp).map(f64::to_bits).collect()
}
