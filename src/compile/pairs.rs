//! Which geoms can touch, and with which parameters.

use std::collections::{BTreeMap, BTreeSet};

use super::Log;
use super::layout::World;
use crate::collision::broad_phase::{Filter, may_touch, order};
use crate::math::MIN_MU;
use crate::mjcf::{NodeId, ProblemKind, Spec, instead_of, spec};
use crate::model::{ContactOverride, Geom, GeomKind, Mix, Pair, Pairs};

/// Up to this many pairs among geoms other than planes are listed one by one (24 free spheres have 276);
/// beyond, a broad phase looks for them in each step. From about 8 bodies on that is as fast.
pub const MOST_LISTED: usize = 276;

/// Pairs with planes are listed all, each with room for its contacts.
const MOST_PAIRS: usize = 1_000_000;

/// Many geoms have a table of what each two classes of contact parameters make together: 64 MB.
const MOST_CLASSES: usize = 4096;

/// The pairs of a scene in MuJoCo's contact order, and their parameters.
///
/// A `<pair>` replaces what the filters would let pass.
pub fn find(world: &World, spec: &Spec, over: Option<ContactOverride>, log: &mut Log) -> (Pairs, Vec<Mix>) {
    let excluded = excluded(world, spec, log);
    refuse_meshes_that_touch(world, &excluded, log);
    let given = explicit(world, spec, log);
    let on = |flag: &str| spec.flags.get(flag).copied().unwrap_or(true);
    if !(on("contact") && on("constraint")) {
        return (Pairs::default(), Vec::new());
    }
    let replaced: BTreeSet<(usize, usize)> = given.iter().map(|e| sorted(e.geom)).collect();
    let touch = |a: usize, b: usize| {
        let [first, second] = [a, b].map(|g| Filter::from(&world.geoms[g]));
        may_touch(&world.bodies, first, second, on("filterparent"), &excluded) && !replaced.contains(&sorted([a, b]))
    };
    let plane = |g: &usize| world.geoms[*g].kind == GeomKind::Plane;
    let colliding = (0..world.geoms.len()).filter(|&g| collides(&world.geoms[g]));
    let (planes, others): (Vec<usize>, Vec<usize>) = colliding.partition(plane);
    let mut candidates = among(world, &others, touch);
    let swept = candidates.len() > MOST_LISTED;
    if swept {
        candidates.clear();
    }
    for &plane in &planes {
        candidates.extend(others.iter().filter(|&&g| touch(plane, g)).map(|&g| [plane.min(g), plane.max(g)]));
        if candidates.len() > MOST_PAIRS {
            let help =
                "planes are endless: one is enough for a floor; or let fewer geoms touch (`contype`, `conaffinity`)";
            log.error(world.geom_specs[plane].node, ProblemKind::TooManyPairs { limit: MOST_PAIRS }, help);
            return (Pairs::default(), Vec::new());
        }
    }
    candidates.sort_unstable();

    let mut pairs = Pairs { excluded, ..Pairs::default() };
    let mut mixes = Mixes::default();
    let mut list = |geom: [usize; 2], index: usize, mixes: &Mixes, given: Option<usize>| {
        let pair = Pair::new(&world.geoms, geom, index, &mixes.list[index]);
        pairs.listed.extend(pair.map(|pair| Pair { given, ..pair }));
    };
    for (i, e) in given.into_iter().enumerate() {
        let index = mixes.index(overridden(e.mix, over));
        list(e.geom, index, &mixes, Some(i));
    }
    // Pairs in a row are mostly alike.
    let mut last: Option<([&Geom; 2], usize)> = None;
    for geom in candidates {
        let both = geom.map(|g| &world.geoms[g]);
        let same = last.filter(|([a, b], _)| alike(a, both[0]) && alike(b, both[1]));
        let index = same.map_or_else(|| mixes.index(overridden(mixed(both[0], both[1]), over)), |(_, index)| index);
        last = Some((both, index));
        list(geom, index, &mixes, None);
    }
    pairs.listed.sort_by_key(|pair| order(&world.geoms, pair));
    if swept {
        let examples = classes(&world.geoms, &mut pairs);
        if let Some(&geom) = examples.get(MOST_CLASSES) {
            let help = "give geoms that are alike the same `friction`, `solref`, `solimp`, `margin` …";
            log.error(world.geom_specs[geom].node, ProblemKind::TooManyClasses { limit: MOST_CLASSES }, help);
        } else {
            tabulate(&world.geoms, &examples, &mut pairs, &mut mixes, over);
        }
    }
    (pairs, mixes.list)
}

fn sorted([a, b]: [usize; 2]) -> (usize, usize) {
    (a.min(b), a.max(b))
}

/// Body pairs of `<exclude>`, low number first, sorted.
fn excluded(world: &World, spec: &Spec, log: &mut Log) -> Vec<(usize, usize)> {
    if spec.excludes.is_empty() {
        return Vec::new();
    }
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

/// A mesh is only seen: an error where masks and `<exclude>` let anything touch it. Flags do not count: they may be set
/// after a scene is read.
fn refuse_meshes_that_touch(world: &World, excluded: &[(usize, usize)], log: &mut Log) {
    let meshes = || world.visual_specs.iter().map(|&(body, spec)| (filter(body, spec), spec.node));
    if meshes().all(|(mesh, _)| mesh.contype == 0 && mesh.conaffinity == 0) {
        return;
    }
    let geoms = world.geoms.iter().zip(&world.geom_specs).map(|(geom, spec)| (Filter::from(geom), spec.node));
    // By masks and by rigid body, one for all that are alike: thousands of meshes that never touch are passed over whole.
    let mut kinds: BTreeMap<(u32, u32), BTreeMap<usize, BTreeMap<Filter, NodeId>>> = BTreeMap::new();
    for (filter, node) in geoms.chain(meshes()) {
        let welds = kinds.entry((filter.contype, filter.conaffinity)).or_default();
        welds.entry(world.bodies[filter.body].weld).or_default().entry(filter).or_insert(node);
    }
    for &(body, spec) in &world.visual_specs {
        let mesh = filter(body, spec);
        let matching = kinds
            .iter()
            .filter(|((contype, conaffinity), _)| mesh.contype & conaffinity != 0 || contype & mesh.conaffinity != 0);
        let others = matching.flat_map(|(_, welds)| welds).filter(|(weld, _)| **weld != world.bodies[body].weld);
        let mut others = others.flat_map(|(_, filters)| filters);
        if let Some((_, &other)) = others.find(|(other, _)| may_touch(&world.bodies, mesh, **other, false, excluded)) {
            let kind = ProblemKind::Unsupported { name: "mesh".into(), lost: "nothing would touch it".into() };
            let attribute = if spec.fitted { "mesh" } else { "type" };
            log.value_error(spec.node, attribute, kind, instead_of(spec.mesh.as_ref()));
            log.related(other, "may touch this");
        }
    }
}

fn filter(body: usize, mesh: &spec::Visual) -> Filter {
    Filter { body, contype: mesh.contype, conaffinity: mesh.conaffinity }
}

/// A `<contact><pair>` with its geoms found.
struct Explicit {
    geom: [usize; 2],
    mix: Mix,
}

fn explicit(world: &World, spec: &Spec, log: &mut Log) -> Vec<Explicit> {
    if spec.pairs.is_empty() {
        return Vec::new();
    }
    let names = world.geom_names();
    let mut found: Vec<Explicit> = Vec::new();
    let mut earlier: BTreeMap<(usize, usize), NodeId> = BTreeMap::new();
    for pair in &spec.pairs {
        let first = names.find(&pair.geom1, pair.node, "geom1", log);
        let second = names.find(&pair.geom2, pair.node, "geom2", log);
        let (Some(a), Some(b)) = (first, second) else { continue };
        let geom = [a, b];
        let weld = geom.map(|g| world.bodies[world.geoms[g].body].weld);
        if a == b {
            log.error(pair.node, ProblemKind::PairOfOne, "name two different geoms");
        } else if let Some(&earlier) = earlier.get(&sorted(geom)) {
            let help = "MuJoCo would count every contact twice; keep one of the two";
            log.error(pair.node, ProblemKind::PairTwice, help);
            log.related(earlier, "first given here");
        } else if weld[0] == weld[1] || geom.iter().all(|&g| world.bodies[world.geoms[g].body].tree.is_none()) {
            log.warning(pair.node, ProblemKind::PairAtRest, "remove the pair, or give one of the bodies a joint");
        } else {
            earlier.insert(sorted(geom), pair.node);
            found.push(Explicit { geom, mix: given(pair) });
        }
    }
    found
}

/// Pairs of these geoms that the filters let pass, until there are more than [`MOST_LISTED`].
///
/// Geoms of one rigid body with one contype and conaffinity are one group: two of a group never touch, and two groups
/// whose masks do not match are passed over whole. Other pairs that do not touch are few: they were named one by one
/// in the file, or are of a body and its parent.
fn among(world: &World, geoms: &[usize], touch: impl Fn(usize, usize) -> bool) -> Vec<[usize; 2]> {
    // Mostly the first ones show that there are more.
    const TRIED: usize = 100;
    if geoms.len() > TRIED {
        let pairs = (0..TRIED).flat_map(|i| (0..i).map(move |j| [geoms[j], geoms[i]]));
        let found: Vec<_> = pairs.filter(|&[a, b]| touch(a, b)).take(MOST_LISTED + 1).collect();
        if found.len() > MOST_LISTED {
            return found;
        }
    }
    let mut kinds: BTreeMap<(u32, u32), BTreeMap<usize, Vec<usize>>> = BTreeMap::new();
    for &g in geoms {
        let geom = &world.geoms[g];
        let bodies = kinds.entry((geom.contype, geom.conaffinity)).or_default();
        bodies.entry(world.bodies[geom.body].weld).or_default().push(g);
    }
    let kinds: Vec<_> = kinds.into_iter().collect();
    let mut found = Vec::new();
    for (i, ((type1, affinity1), bodies1)) in kinds.iter().enumerate() {
        for ((type2, affinity2), bodies2) in &kinds[i..] {
            if type1 & affinity2 == 0 && type2 & affinity1 == 0 {
                continue;
            }
            let same = std::ptr::eq(bodies1, bodies2);
            for (body1, first) in bodies1 {
                for (_, second) in bodies2.iter().filter(|(body2, _)| *body2 != body1 && (!same || *body2 > body1)) {
                    for (&a, &b) in first.iter().flat_map(|a| second.iter().map(move |b| (a, b))) {
                        if touch(a, b) {
                            found.push([a.min(b), a.max(b)]);
                            if found.len() > MOST_LISTED {
                                return found;
                            }
                        }
                    }
                }
            }
        }
    }
    found
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

/// Many geoms: those that collide with others than planes, and their classes of parameters. Gives a geom of each class.
fn classes(geoms: &[Geom], pairs: &mut Pairs) -> Vec<usize> {
    let swept = |g: &usize| geoms[*g].kind != GeomKind::Plane && collides(&geoms[*g]);
    pairs.swept = (0..geoms.len()).filter(swept).collect();
    let mut classes: BTreeMap<Vec<u64>, (u32, usize)> = BTreeMap::new();
    pairs.class = vec![0; geoms.len()];
    // Geoms in a row are mostly alike.
    let mut last: Option<(&Geom, u32)> = None;
    for &g in &pairs.swept {
        let count = classes.len() as u32;
        let same = last.filter(|(geom, _)| alike(geom, &geoms[g]));
        let class =
            same.map_or_else(|| classes.entry(parameters(&geoms[g])).or_insert((count, g)).0, |(_, class)| class);
        last = Some((&geoms[g], class));
        pairs.class[g] = class;
    }
    let mut examples = vec![0; classes.len()];
    for (class, geom) in classes.into_values() {
        examples[class as usize] = geom;
    }
    examples
}

/// The mixes of each two classes.
fn tabulate(geoms: &[Geom], examples: &[usize], pairs: &mut Pairs, mixes: &mut Mixes, over: Option<ContactOverride>) {
    for &a in examples {
        for &b in examples {
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
        let mix = if pair.given.is_some() { old[pair.mix].clone() } else { mixed(a, b) };
        let index = mixes.index(overridden(mix, over));
        let given = pair.given;
        if let Some(anew) = Pair::new(geoms, pair.geom, index, &mixes.list[index]) {
            *pair = Pair { given, ..anew };
        }
    }
    if !pairs.swept.is_empty() {
        pairs.mix_table.clear();
        let examples = classes(geoms, pairs);
        tabulate(geoms, &examples, pairs, &mut mixes, over);
    }
    mixes.list
}

/// All that a geom contributes to a mix.
fn parameters(g: &Geom) -> Vec<u64> {
    let numbers = [g.condim as f64, g.priority as f64, g.solmix, g.margin, g.gap].into_iter();
    numbers.chain(g.friction).chain(g.solref).chain(g.solimp).map(f64::to_bits).collect()
}

/// Whether these are the same for both.
fn alike(a: &Geom, b: &Geom) -> bool {
    (a.condim, a.priority) == (b.condim, b.priority)
        && [a.solmix, a.margin, a.gap] == [b.solmix, b.margin, b.gap]
        && (a.friction, a.solref, a.solimp) == (b.friction, b.solref, b.solimp)
}
