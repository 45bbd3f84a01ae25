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
    let Data { geom_xpos, geom_xmat, contacts, counts, detect: Scratch { hits, broad_phase, last }, .. } = data;
    contacts.clear();
    if !(model.opt.flags.contact && model.opt.flags.constraint) {
        return;
    }
    let near =
        if model.pairs.swept.is_empty() { Some(&model.pairs.listed) } else { broad_phase.near(model, geom_xpos) };
    for pair in near.map_or(&[][..], |near| near) {
        if apart(pair, geom_xpos, geom_xmat) {
            continue;
        }
        counts.pairs += 1;
        collide(model, pair, geom_xpos, geom_xmat, hits, last, contacts);
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

/// The last frame that was found: that of all points of a face, and of all that lies on a plane, also in the next step.
#[derive(Clone, Debug)]
pub struct Framed {
    normal: Vec3,
    tangent: Vec3,
    /// Whether it has tangents.
    complete: bool,
    frame: Mat3,
}

impl Default for Framed {
    fn default() -> Framed {
        Framed { normal: Vec3::zeros(), tangent: Vec3::zeros(), complete: false, frame: Mat3::zeros() }
    }
}

impl Framed {
    /// Makes it that of a hit. All six numbers are compared, whatever comes out: faster than stopping early at what hardly happens;
    /// and bit by bit, lest the sign of a zero depend on the steps before.
    #[inline(always)]
    fn see(&mut self, hit: &Hit, complete: bool) {
        let same = |u: &Vec3, v: &Vec3| (0..3).fold(true, |same, i| same & (u[i].to_bits() == v[i].to_bits()));
        if !(same(&self.normal, &hit.normal) & same(&self.tangent, &hit.tangent) & (self.complete == complete)) {
            let Hit { normal, tangent, .. } = *hit;
            let none = Vec3::zeros().transpose();
            let frame =
                if complete { frame(&normal, &tangent) } else { Mat3::from_rows(&[normal.transpose(), none, none]) };
            *self = Framed { normal, tangent, complete, frame };
        }
    }
}

fn collide(
    model: &Model,
    pair: &Pair,
    xpos: &[Vec3],
    xmat: &[Mat3],
    hits: &mut Hits,
    last: &mut Framed,
    contacts: &mut Vec<Contact>,
) {
    let Some(touch) = collider(pair.kind[0], pair.kind[1]) else { return };
    let placed = |g: usize| Placed { size: &model.geoms[g].size, pos: &xpos[g], mat: &xmat[g] };
    let (a, b) = (placed(pair.geom[0]), placed(pair.geom[1]));
    let mix = &model.mixes[pair.mix];
    hits.clear();
    // Below zero: what is not as deep as that is left out.
    let reach = mix.margin + mix.gap;
    touch(&a, &b, reach.max(0.0), hits);
    let body = pair.geom.map(|g| model.bodies[model.geoms[g].body].weld as u32);
    let geom = pair.geom.map(|g| g as u32);
    let flat = pair.kind[0] == GeomKind::Plane;
    let found = hits.as_slice().iter().filter(|hit| reach >= 0.0 || hit.dist <= reach);
    contacts.extend(found.enumerate().map(|(i, hit)| {
        // Points of one plane share their frame.
        if i == 0 || !flat {
            last.see(hit, mix.condim > 1);
        }
        let (Hit { dist, pos, feature, .. }, mix) = (*hit, pair.mix as u32);
        Contact { geom, body, mix, feature, dist, pos, frame: last.frame, force: [0.0; 6] }
    }));
}
