//! The contacts of a step: a cheap test for every pair that can touch, its collider if they are near.

use super::{Hit, Hits, Placed, Scratch, collider, frame};
use crate::data::{Contact, Data};
use crate::math::{Mat3, Vec3};
use crate::model::{Bound, GeomKind, Model, Pair};

/// Finds all contacts, in MuJoCo's order: by body pair, then by geom pair.
///
/// Where there are more than the scene may have (`pairs.most_contacts`) it keeps none, since some of them would be another
/// scene, and counts that: a [`step`](crate::forward::step) is refused then.
///
/// Reads: `geom_xpos`, `geom_xmat`. Writes: `contacts` (all but the forces), `counts`.
pub fn detect(model: &Model, data: &mut Data) {
    let Data { geom_xpos, geom_xmat, contacts, counts, detect: Scratch { hits, broad_phase }, .. } = data;
    contacts.clear();
    if !(model.opt.flags.contact && model.opt.flags.constraint) {
        return;
    }
    let near =
        if model.pairs.swept.is_empty() { Some(&model.pairs.listed) } else { broad_phase.near(model, geom_xpos) };
    let touching = near.into_iter().flatten().filter(|pair| !apart(pair, geom_xpos, geom_xmat));
    for pair in touching {
        counts.pairs += 1;
        collide(model, pair, geom_xpos, geom_xmat, hits, contacts);
        if contacts.len() > model.pairs.most_contacts {
            break;
        }
    }
    if near.is_none() || contacts.len() > model.pairs.most_contacts {
        *contacts = Vec::new();
        counts.crowded += 1;
    }
    counts.contacts += contacts.len();
}

/// Whether the bounding test rules a contact out.
fn apart(pair: &Pair, xpos: &[Vec3], xmat: &[Mat3]) -> bool {
    let [a, b] = pair.geom;
    match pair.bound {
        Bound::None => false,
        Bound::Height(bound) => xmat[a].column(2).dot(&(xpos[b] - xpos[a])) > bound,
        Bound::Distance2(bound) => (xpos[b] - xpos[a]).norm_squared() > bound,
    }
}

fn collide(model: &Model, pair: &Pair, xpos: &[Vec3], xmat: &[Mat3], hits: &mut Hits, contacts: &mut Vec<Contact>) {
    let Some(touch) = collider(pair.kind[0], pair.kind[1]) else { return };
    let placed = |g: usize| Placed { size: &model.geoms[g].size, pos: &xpos[g], mat: &xmat[g] };
    let (a, b) = (placed(pair.geom[0]), placed(pair.geom[1]));
    let mix = &model.mixes[pair.mix];
    hits.clear();
    touch(&a, &b, mix.margin + mix.gap, hits);
    let body = pair.geom.map(|g| model.bodies[model.geoms[g].body].weld as u32);
    let geom = pair.geom.map(|g| g as u32);
    let flat = pair.kind[0] == GeomKind::Plane;
    let (mut last, mut axes) = (None, Mat3::zeros());
    contacts.extend(hits.as_slice().iter().map(|hit| {
        // Points of one plane share their frame.
        if last.is_none_or(|last| !flat && !same_frame(last, hit)) {
            axes = if mix.condim > 1 {
                frame(&hit.normal, &hit.tangent)
            } else {
                Mat3::from_rows(&[hit.normal.transpose(), Vec3::zeros().transpose(), Vec3::zeros().transpose()])
            };
            last = Some(hit);
        }
        let (Hit { dist, pos, feature, .. }, mix) = (*hit, pair.mix as u32);
        Contact { geom, body, mix, feature, dist, pos, frame: axes, force: [0.0; 6] }
    }));
}

/// All six numbers are compared, whatever comes out: faster than stopping early at what hardly happens.
fn same_frame(a: &Hit, b: &Hit) -> bool {
    let same = |u: &Vec3, v: &Vec3| (u.x == v.x) & (u.y == v.y) & (u.z == v.z);
    same(&a.normal, &b.normal) & same(&a.tangent, &b.tangent)
}
