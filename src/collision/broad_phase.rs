//! The broad phase: which of many geoms are near one another, at a cost that grows with their number only.
//!
//! A list of near pairs is kept from step to step. Each bounding sphere is taken larger than it is, and the list
//! holds until some geom has moved by what was added to it (a Verlet list: Verlet, Phys. Rev. 159, 1967). It is
//! then found anew with a grid of cells, coarser for larger geoms, each cell as wide as two of its spheres, so that
//! whatever a sphere can touch lies in the 27 cells around it.
//!
//! The list only prunes: which contacts are found does not depend on when it was made.

use crate::math::Vec3;
use crate::model::{Body, Geom, Model, Pair};

/// How far a geom may move before the list is made anew, per radius.
const SLACK: f64 = 0.25;
const NONE: u32 = u32::MAX;

/// The broad phase of scenes with many geoms, and its buffers.
#[derive(Clone, Debug, Default)]
pub struct BroadPhase {
    /// The geoms, largest first.
    items: Vec<Item>,
    /// Edge of the smallest cells, m.
    cell: f64,
    /// First item of each bucket; a power of two of them.
    buckets: Vec<u32>,
    /// Levels that have items.
    levels: Vec<u32>,
    found: Vec<Pair>,
    /// The near pairs and `model.pairs.listed`, in contact order.
    near: Vec<Pair>,
    /// There are more than the scene may have.
    crowded: bool,
}

#[derive(Clone, Debug)]
struct Item {
    geom: usize,
    /// Bounding radius with half the detection distance and the slack, m.
    radius: f64,
    /// Square of the slack, m²; infinite for what never moves.
    slack2: f64,
    /// Cells of level l are 2ˡ times the smallest.
    level: u32,
    /// Where the geom was when the list was made, and its cell.
    pos: Vec3,
    cell: [i64; 3],
    /// Next item in the same bucket.
    next: u32,
}

impl BroadPhase {
    /// All pairs that may touch now, in contact order; `None` if there are more than the scene may have.
    pub fn near(&mut self, model: &Model, xpos: &[Vec3]) -> Option<&Vec<Pair>> {
        let first = self.items.is_empty();
        if first {
            self.prepare(model);
        }
        // Written so that a position that is not a number counts as moved.
        let stays = |item: &Item| (xpos[item.geom] - item.pos).norm_squared() <= item.slack2;
        if first || !self.items.iter().all(stays) {
            self.rebuild(model, xpos);
        }
        (!self.crowded).then_some(&self.near)
    }

    /// Sizes and levels, which do not change.
    fn prepare(&mut self, model: &Model) {
        let reach = model.mixes.iter().map(|mix| mix.margin + mix.gap).fold(0.0, f64::max);
        for &geom in &model.pairs.swept {
            let rbound = model.geoms[geom].rbound;
            let moves = model.bodies[model.geoms[geom].body].weld != 0;
            let slack = if moves { SLACK * rbound } else { 0.0 };
            self.items.push(Item {
                geom,
                radius: rbound + slack + 0.5 * reach,
                slack2: if moves { slack * slack } else { f64::INFINITY },
                level: 0,
                pos: Vec3::zeros(),
                cell: [0; 3],
                next: NONE,
            });
        }
        self.items.sort_by(|a, b| b.radius.total_cmp(&a.radius).then(a.geom.cmp(&b.geom)));
        self.cell = 2.0 * self.items.last().map_or(1.0, |smallest| smallest.radius);
        for item in &mut self.items {
            item.level = (2.0 * item.radius / self.cell).log2().ceil().max(0.0) as u32;
            if self.levels.last() != Some(&item.level) {
                self.levels.push(item.level);
            }
        }
        self.buckets = vec![NONE; (2 * self.items.len()).next_power_of_two()];
    }

    fn rebuild(&mut self, model: &Model, xpos: &[Vec3]) {
        self.buckets.fill(NONE);
        self.found.clear();
        // Largest first: each geom looks for those already placed, which are at its own or at coarser levels.
        for i in 0..self.items.len() {
            if self.found.len() > model.pairs.most_contacts {
                break;
            }
            let geom = self.items[i].geom;
            self.items[i].pos = xpos[geom];
            for l in 0..self.levels.len() {
                if self.levels[l] >= self.items[i].level {
                    self.look_around(model, i, self.levels[l]);
                }
            }
            self.place(i);
        }
        self.crowded = self.found.len() > model.pairs.most_contacts;
        if self.crowded {
            // The next call finds out whether that is still so.
            *self = BroadPhase::default();
            self.crowded = true;
            return;
        }
        merge(model, &mut self.found, &mut self.near);
    }

    fn cell_at(&self, pos: &Vec3, level: u32) -> [i64; 3] {
        let edge = self.cell * f64::from(level).exp2();
        [pos.x, pos.y, pos.z].map(|x| (x / edge).floor() as i64)
    }

    /// The bucket of what [`share`]s add up to.
    fn bucket(&self, hash: u64) -> usize {
        (hash >> (u64::BITS - self.buckets.len().ilog2())) as usize
    }

    fn place(&mut self, i: usize) {
        let level = self.items[i].level;
        let cell = self.cell_at(&self.items[i].pos, level);
        let hash = (0..3).map(|c| share(c, cell[c])).fold(share(3, level.into()), u64::wrapping_add);
        let bucket = self.bucket(hash);
        self.items[i].cell = cell;
        self.items[i].next = std::mem::replace(&mut self.buckets[bucket], i as u32);
    }

    /// Collects the near ones of a level's items in the 27 cells around item i.
    fn look_around(&mut self, model: &Model, i: usize, level: u32) {
        let center = self.cell_at(&self.items[i].pos, level);
        let around: [[i64; 3]; 3] = center.map(|c| [c.wrapping_sub(1), c, c.wrapping_add(1)]);
        let shares: [[u64; 3]; 3] = std::array::from_fn(|c| around[c].map(|at| share(c, at)));
        for k in 0..27 {
            let [x, y, z] = [k % 3, k / 3 % 3, k / 9];
            let hash =
                share(3, level.into()).wrapping_add(shares[0][x]).wrapping_add(shares[1][y]).wrapping_add(shares[2][z]);
            let mut j = self.buckets[self.bucket(hash)];
            if j == NONE {
                continue;
            }
            let cell = [around[0][x], around[1][y], around[2][z]];
            while j != NONE {
                let (item, other) = (&self.items[i], &self.items[j as usize]);
                j = other.next;
                let reach = item.radius + other.radius;
                if other.level == level
                    && other.cell == cell
                    && (other.pos - item.pos).norm_squared() <= reach * reach
                    && let Some(pair) = swept_pair(model, item.geom, other.geom)
                {
                    self.found.push(pair);
                }
            }
        }
    }
}

/// What each coordinate of a cell, and its level, adds to its hash: multiples of 2⁶⁴/gⁱ with g⁵ = g + 1 lie evenly (Roberts,
/// extremelearning.com.au, 2018), and sums of them are found faster than a hash of all.
fn share(c: usize, at: i64) -> u64 {
    const MULTIPLES: [u64; 4] =
        [0xdb4f_0b91_75ae_2165, 0xbbe0_5633_03a4_615f, 0xa0f2_ec75_a1fe_1575, 0x89e1_8285_7d9e_d689];
    (at as u64).wrapping_mul(MULTIPLES[c])
}

/// The pair of two swept geoms, unless they are never to touch.
fn swept_pair(model: &Model, g1: usize, g2: usize) -> Option<Pair> {
    let pairs = &model.pairs;
    let filters = [g1, g2].map(|g| Filter::from(&model.geoms[g]));
    if !may_touch(&model.bodies, filters[0], filters[1], model.opt.flags.filterparent, &pairs.excluded) {
        return None;
    }
    let classes = pairs.mix_table.len().isqrt();
    let mix = pairs.mix_table[pairs.class[g1] as usize * classes + pairs.class[g2] as usize] as usize;
    let pair = Pair::new(&model.geoms, [g1, g2], mix, &model.mixes[mix])?;
    let both = bodies(&model.geoms, &pair);
    let first = pairs.listed.partition_point(|p| bodies(&model.geoms, p) < both);
    let of_both = pairs.listed[first..].iter().take_while(|p| p.given.is_some() && bodies(&model.geoms, p) == both);
    of_both.into_iter().all(|p| p.geom != pair.geom).then_some(pair)
}

/// Sorts what was found and merges it with the listed pairs.
fn merge(model: &Model, found: &mut [Pair], near: &mut Vec<Pair>) {
    let key = |pair: &Pair| order(&model.geoms, pair);
    found.sort_unstable_by_key(key);
    near.clear();
    let mut rest = &model.pairs.listed[..];
    for pair in found {
        let before = rest.iter().take_while(|listed| key(listed) <= key(pair)).count();
        near.extend_from_slice(&rest[..before]);
        rest = &rest[before..];
        near.push(*pair);
    }
    near.extend_from_slice(rest);
}

/// MuJoCo's contact order: by the two bodies, first what `<contact><pair>` gives, as the file does, then by the geoms, the
/// one of lower kind first.
pub fn order(geoms: &[Geom], pair: &Pair) -> ([usize; 2], usize, [usize; 2]) {
    (bodies(geoms, pair), pair.given.unwrap_or(usize::MAX), pair.geom)
}

/// The bodies of a pair, the lower number first.
fn bodies(geoms: &[Geom], pair: &Pair) -> [usize; 2] {
    let [a, b] = pair.geom.map(|g| geoms[g].body);
    [a.min(b), a.max(b)]
}

/// What the filters ask of a geom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Filter {
    /// Its body.
    pub body: usize,
    /// The bits it has.
    pub contype: u32,
    /// The bits it touches.
    pub conaffinity: u32,
}

impl From<&Geom> for Filter {
    fn from(geom: &Geom) -> Filter {
        Filter { body: geom.body, contype: geom.contype, conaffinity: geom.conaffinity }
    }
}

/// MuJoCo's filters for two geoms that no `<contact><pair>` names.
///
/// Not on one rigid body (two that never move are one); not on a body and its parent, unless the parent never
/// moves; not where the bodies exclude each other; and the masks must match:
///
///     contype₁ & conaffinity₂  or  contype₂ & conaffinity₁
///
/// In:     `excluded`: body pairs (low, high), sorted.
/// Source: MuJoCo 4.0 manual, Computation › Collision › Selection.
pub fn may_touch(bodies: &[Body], a: Filter, b: Filter, filterparent: bool, excluded: &[(usize, usize)]) -> bool {
    if a.contype & b.conaffinity == 0 && b.contype & a.conaffinity == 0 {
        return false;
    }
    let (w1, w2) = (bodies[a.body].weld, bodies[b.body].weld);
    if w1 == w2 || (bodies[a.body].tree.is_none() && bodies[b.body].tree.is_none()) {
        return false;
    }
    let above = |weld: usize| bodies[bodies[weld].parent].weld;
    if filterparent && w1 != 0 && w2 != 0 && (above(w1) == w2 || above(w2) == w1) {
        return false;
    }
    excluded.binary_search(&(a.body.min(b.body), a.body.max(b.body))).is_err()
}
