//! What may have touched between the two ends of a step, unseen at either: a thin wall that was jumped over, a ceiling or a
//! joint's limit that was grazed.
//!
//! Let x be what two geoms are apart, or a joint from its limit, and ẋ its rate, both known at the ends of a step of h. Where both
//! ends see the same contact, x between them is nearly the cubic with these values and rates; where they do not, x is taken to
//! change at the rate of the one that sees it. The step may have missed a touch if that is not above zero throughout.
//!
//!     x(τ) = x₀ + h ẋ₀ τ + c τ² + d τ³,    c = 3 (x₁ − x₀) − h (2 ẋ₀ + ẋ₁),    d = 2 (x₀ − x₁) + h (ẋ₀ + ẋ₁)        0 ≤ τ ≤ 1
//!
//! Far from everything nothing is looked at: geoms whose bounding spheres were apart by x cannot touch before they have moved by x.
//!
//! A run that has met something is compared with others that have, too: a bounce that is missed shows there. But not what both have
//! passed through. So in it x counts where it is below minus half the thickness of the thinnest geom, and steps in which nothing
//! moves as far as that are not looked at.
//!
//! Source: Hermite's interpolation; E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, §II.6.

use penny::control::{sizes, thinnest};
use penny::data::Data;
use penny::dynamics::{kinematics, mocap, twist, xipos};
use penny::forward::{Method, forward};
use penny::math::Vec3;
use penny::model::{GeomKind, JointKind, Model};
use penny::state::State;

use crate::sweep::Case;

/// The looks of one run.
pub struct Between {
    /// The scene, whose contacts are listed from `gap` on (m), and do not push sooner than they do.
    model: Model,
    data: Data,
    gap: f64,
    /// How far a unit of each dof moves what it carries, m per m or per rad.
    sizes: Vec<f64>,
    /// What all geoms were apart at least when that was last seen, and how far they may have moved since, m.
    apart: f64,
    moved: f64,
    touching: bool,
    tendons: bool,
    /// Half the thickness of the thinnest geom, m.
    thin: f64,
    /// What was near at the end of the last step, where that was looked at: the next one begins there.
    last: Option<Vec<Near>>,
    /// Evaluations of the forces that looks took.
    pub evaluations: usize,
}

/// What is near at one end of a step.
struct Near {
    /// The geoms and the feature; or the tendon and its end.
    key: ([u32; 2], u32),
    /// From the first geom to the second.
    normal: Vec3,
    /// x, m, and its rate, m/s.
    x: f64,
    rate: f64,
}

/// The key of a tendon's limits, in place of geoms.
const TENDON: u32 = u32::MAX;

impl Between {
    /// Looks for a run that begins where the case does; `None` where nothing could touch.
    pub fn new(case: &Case) -> Option<Between> {
        let flags = &case.model.opt.flags;
        let touching = flags.contact && !(case.model.pairs.listed.is_empty() && case.model.pairs.swept.is_empty());
        let limits = flags.limit && case.model.joints.iter().any(|j| j.range.is_some());
        let tendons = flags.limit && case.model.tendons.iter().any(|t| t.range.is_some());
        if !flags.constraint || !(touching || limits || tendons) {
            return None;
        }
        let model = case.model.clone();
        let mut data = Data::new(&model);
        let sizes = sizes(&model, &case.start.qpos, &mut data);
        let thin = thinnest(&model);
        Some(Between {
            model,
            data,
            gap: 0.0,
            sizes,
            apart: 0.0,
            moved: 0.0,
            touching,
            tendons,
            thin,
            last: None,
            evaluations: 0,
        })
    }

    /// Whether something may have touched in a step of a run that has met nothing, or may have been passed through where it
    /// `met` something.
    pub fn missed(&mut self, method: &Method, before: &State, after: &State, met: bool) -> bool {
        let h = after.time - before.time;
        let limits = method.contact.joints && !met;
        let deep = if met { -self.thin } else { 0.0 };
        if limits && self.jumped_limit(before, after, h) {
            return true;
        }
        let tendons = limits && self.tendons;
        if !self.touching && !tendons {
            return false;
        }
        // Two bodies may move towards one another.
        let reach = 2.0 * self.speed(before).max(self.speed(after)) * h;
        if !reach.is_finite() {
            // The run says so itself.
            return false;
        }
        let last = self.last.take();
        if met && reach < self.thin {
            self.apart = 0.0;
            return false;
        }
        self.moved += reach;
        if self.moved >= self.apart {
            (self.apart, self.moved) = (self.clearance(before, met), reach);
        }
        if self.moved < self.apart && !tendons {
            return false;
        }
        let wide = reach <= self.gap;
        if !wide && !self.widen(2.0 * reach) {
            return true;
        }
        let Some(start) = last.filter(|_| wide).or_else(|| self.near(method, before)) else { return true };
        let Some(end) = self.near(method, after) else { return true };
        let passed = |near: &Near, other: Option<&Near>, towards: f64| match other {
            Some(other) if near.normal.dot(&other.normal) > ALIKE => {
                let ends = if towards > 0.0 { [near, other] } else { [other, near] };
                least(ends.map(|near| [near.x, near.rate]), h) <= deep
            }
            _ => near.x + (towards * near.rate).min(0.0) * h <= deep,
        };
        // What touches at an end on the same side is seen by the run.
        let seen = |near: &Near| {
            let alike = |n: &&Near| n.key.0 == near.key.0 && n.normal.dot(&near.normal) > ALIKE;
            [&start, &end].into_iter().flatten().filter(alike).any(|n| n.x <= 0.0)
        };
        let other = |near: &Near, list: &[Near]| list.iter().position(|n| n.key == near.key);
        let missed = start.iter().any(|near| !seen(near) && passed(near, other(near, &end).map(|k| &end[k]), 1.0))
            || end.iter().any(|near| !seen(near) && passed(near, other(near, &start).map(|k| &start[k]), -1.0));
        self.last = Some(end);
        missed
    }

    /// The fastest that anything moves, m/s, at most.
    fn speed(&self, state: &State) -> f64 {
        let of = |dofs: std::ops::Range<usize>| dofs.map(|d| self.sizes[d] * state.qvel[d].abs()).sum::<f64>();
        self.model.trees.iter().map(|tree| of(tree.dofs.clone())).fold(0.0, f64::max)
    }

    /// Lists contacts from farther on. Out: whether it can.
    fn widen(&mut self, gap: f64) -> bool {
        self.gap = gap;
        let wide = self.model.edit(|m| {
            m.geoms.iter_mut().for_each(|g| g.gap = gap);
            m.mixes.iter_mut().for_each(|mix| mix.gap = gap);
        });
        wide.is_ok()
    }

    /// What all geoms that can touch are apart at least, m, where the run has `met` something those that can be passed through.
    fn clearance(&mut self, state: &State, met: bool) -> f64 {
        let Between { model, data, .. } = self;
        mocap(model, state, data);
        kinematics(model, &state.qpos, data);
        let (pairs, geoms) = (&model.pairs, &model.geoms);
        let way = |[a, b]: [usize; 2]| data.geom_xpos[b] - data.geom_xpos[a];
        let apart = |pair: [usize; 2]| way(pair).norm() - geoms[pair[0]].rbound - geoms[pair[1]].rbound;
        let listed = pairs.listed.iter().map(|pair| {
            let margin = model.mixes[pair.mix].margin;
            match pair.kind[0] {
                GeomKind::Plane if met => f64::INFINITY,
                GeomKind::Plane => {
                    let height = data.geom_xmat[pair.geom[0]].column(2).dot(&way(pair.geom));
                    height - geoms[pair.geom[1]].rbound - margin
                }
                _ => apart(pair.geom) - margin,
            }
        });
        let widest = model.mixes.iter().map(|mix| mix.margin).fold(0.0, f64::max);
        let moves = |g: usize| model.bodies[geoms[g].body].tree.is_some();
        let swept = pairs.swept.iter().enumerate().flat_map(|(i, &a)| {
            let others = pairs.swept[i + 1..].iter().filter(move |b| moves(a) || moves(**b));
            others.map(move |&b| apart([a, b]) - widest)
        });
        listed.chain(swept).fold(f64::INFINITY, f64::min)
    }

    /// What is near in a state; `None` where that is too much.
    fn near(&mut self, method: &Method, state: &State) -> Option<Vec<Near>> {
        let Between { model, data, .. } = self;
        data.counts = Default::default();
        forward(model, method, state, data);
        self.evaluations += 1;
        if data.counts.crowded > 0 {
            return None;
        }
        let mut list: Vec<Near> = Vec::new();
        for c in &data.contacts {
            let velocity = |body: u32| {
                let twist = twist(model, data, body as usize);
                let (v, w) = (Vec3::new(twist[0], twist[1], twist[2]), Vec3::new(twist[3], twist[4], twist[5]));
                v + w.cross(&(c.pos - xipos(model, data, body as usize)))
            };
            let normal = c.frame.row(0).transpose();
            let rate = normal.dot(&(velocity(c.body[1]) - velocity(c.body[0])));
            let x = c.dist - model.mixes[c.mix as usize].margin;
            list.push(Near { key: (c.geom, c.feature), normal, x, rate });
        }
        for (t, tendon) in model.tendons.iter().enumerate().filter(|_| self.tendons) {
            let Some([lower, upper]) = tendon.range else { continue };
            let (length, rate) = (data.ten_length[t], data.ten_velocity[t]);
            for (end, x, rate) in [(0, length - lower, rate), (1, upper - length, -rate)] {
                let x = x - tendon.margin;
                list.push(Near { key: ([TENDON, t as u32], end), normal: Vec3::x(), x, rate });
            }
        }
        Some(list)
    }

    /// Whether a joint was beyond its limit in the step, and is not at its ends.
    fn jumped_limit(&self, before: &State, after: &State, h: f64) -> bool {
        let limited = self.model.joints.iter().filter(|_| self.model.opt.flags.limit);
        limited.filter_map(|j| Some((j, j.range?))).any(|(joint, [lower, upper])| {
            // A ball joint may, at worst, turn there and back.
            let of = |state: &State, back: f64| {
                let (q, v) = (&state.qpos[joint.qposadr..], &state.qvel[joint.dofadr..]);
                match joint.kind {
                    JointKind::Slide | JointKind::Hinge => [[q[0] - lower, v[0]], [upper - q[0], -v[0]]],
                    JointKind::Ball | JointKind::Free => {
                        let angle = 2.0 * Vec3::new(q[1], q[2], q[3]).norm().atan2(q[0].abs());
                        [[lower.max(upper) - angle, back * Vec3::new(v[0], v[1], v[2]).norm()]; 2]
                    }
                }
            };
            let ends = of(before, -1.0).into_iter().zip(of(after, 1.0));
            let mut inside = ends.map(|(a, b)| [a, b].map(|[x, rate]| [x - joint.margin, rate]));
            inside.any(|ends| ends.iter().all(|[x, _]| *x > 0.0) && least(ends, h) <= 0.0)
        })
    }
}

/// Normals are of one contact if the cosine of the angle between them is larger.
const ALIKE: f64 = 0.5;

/// The least of the cubic with these values and rates at the ends of a step.
fn least([[x0, r0], [x1, r1]]: [[f64; 2]; 2], h: f64) -> f64 {
    let (b, c, d) = (h * r0, 3.0 * (x1 - x0) - h * (2.0 * r0 + r1), 2.0 * (x0 - x1) + h * (r0 + r1));
    // b + 2 c τ + 3 d τ² = 0, without cancellation
    let q = -(c + (c * c - 3.0 * b * d).max(0.0).sqrt().copysign(c));
    let inside = [q / (3.0 * d), b / q].into_iter().filter(|t| (0.0..=1.0).contains(t));
    inside.map(|t| x0 + t * (b + t * (c + t * d))).fold(x0.min(x1), f64::min)
}

#[cfg(test)]
mod tests {
    use super::least;

    /// Under a constant acceleration a the cubic is the parabola, whose least is x₀ − v²/2a; and one that has its least at 1/3.
    #[test]
    fn the_least_between_two_ends_is_that_of_the_motion() {
        let (x, v, a, h) = (0.05, -1.0, 9.81, 0.2);
        let end = [x + v * h + 0.5 * a * h * h, v + a * h];
        assert!((least([[x, v], end], h) - (x - v * v / (2.0 * a))).abs() < 1e-15);
        // τ³ + τ² − τ
        assert!((least([[0.0, -1.0], [1.0, 4.0]], 1.0) + 5.0 / 27.0).abs() < 1e-15);
        assert_eq!(least([[1.0, 2.0], [3.0, 2.0]], 1.0), 1.0, "straight away");
    }
}
