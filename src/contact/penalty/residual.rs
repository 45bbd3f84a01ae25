//! How far forces are from a solution of the law's equations, and how that changes with them.
//!
//! Forces f cause the accelerations of w = Wᵀ f, x = W w + J a₀ − a_ref. What each constraint then asks of its force, by
//! itself, is
//!
//!     normal:    f⁺ = max(0, f − (x + R f)/λ)        R = 1/D, λ an inverse mass
//!     friction:  f⁺ = f − (x + R f)/λ brought back to the limit μ n,    n normal force
//!     equality:  f⁺ = f − (x + R f)/λ
//!
//! f⁺ is f if and only if f = −∂s/∂x under the limit μ n, and the difference is well conditioned however stiff they are.

use std::ops::Range;

use super::super::cost::{Cone, Kind};
use super::super::curvature::Curvature;
use super::super::island::Island;
use super::super::newton::Constraint;

/// By how much the forces differ from what their formulas ask for under the acceleration that they cause together: the
/// largest λ |f − f⁺| relative to the largest acceleration that a normal force causes.
///
/// Writes: w = Wᵀ f into `p`, x of the constraints into `y`, f⁺ − f into `change`.
pub fn residual(island: &mut Island) -> f64 {
    accelerate(island);
    misfit(island)
}

/// w = Wᵀ f, into `p`.
pub fn accelerate(island: &mut Island) {
    island.add_to_p(|c| &c.force);
}

/// The residual, where w is in `p`.
pub fn misfit(island: &mut Island) -> f64 {
    island.multiply_p(|c, _, product| {
        let x = c.at(product);
        c.y[..6].copy_from_slice(&x);
    });
    judge(island)
}

/// The residual, where w is in `p` and x in `y`.
pub fn judge(island: &mut Island) -> f64 {
    let (mut most, mut scale) = (0.0f64, 0.0f64);
    for c in &mut island.constraints {
        c.change = wish(&c.cone, &c.y, &c.force, &c.inverse);
        most = lacks(c).fold(most, f64::max);
        scale = scale.max(size(c));
    }
    match most / scale {
        _ if island.p.iter().any(|p| !p.is_finite()) => f64::INFINITY,
        _ if most == 0.0 => 0.0,
        residual => residual,
    }
}

/// λ |f⁺ − f| of the rows of a constraint, m/s² and rad/s².
pub fn lacks(c: &Constraint) -> impl Iterator<Item = f64> {
    let Constraint { cone, change, inverse, .. } = c;
    let mass = move |k: usize| match (cone.kind, k) {
        (Kind::TwoSided, _) => inverse[k / 3],
        (_, 0) => inverse[0],
        (_, 1 | 2) => inverse[1],
        (_, 3) => inverse[2],
        _ => inverse[3],
    };
    (0..cone.dim).map(move |k| mass(k) * change[k].abs())
}

/// What a residual is measured by, m/s²: what the normal force does, and more than the rounding of v/h, of a_ref and of J a₀:
/// bodies that touch without a force have none to compare with.
fn size(c: &Constraint) -> f64 {
    let pushed = match c.cone.kind {
        Kind::TwoSided => (0..c.cone.dim).fold(0.0, |most: f64, k| most.max(c.inverse[k / 3] * c.force[k].abs())),
        _ => c.inverse[0] * c.force[0].abs(),
    };
    pushed.max(1e-4 * c.bias[..c.cone.dim].iter().chain(&c.smooth[..c.cone.dim]).fold(0.0, |m, b| b.abs().max(m)))
}

/// Part of the way that [`relax`] goes: Jacobi's method converges for eight contacts on a body that all act alike.
pub const RELAXED: f64 = 1.0 / 8.0;

/// Lets forces that were taken as they were go part of the way to what their formulas ask for (Jacobi's method): else an error
/// within the tolerance would stay, and grow beyond it in a later step.
pub fn relax(constraints: &mut [Constraint]) {
    for c in constraints {
        (0..c.cone.dim).for_each(|k| c.force[k] += RELAXED * c.change[k]);
    }
}

/// f⁺ − f of a constraint.
///
/// In: `inverse` masses λ of the normal and of each group of friction, or of three rows each of an equality; for
/// [`Kind::OneSided`], [`Kind::TwoSided`], [`Kind::Dry`] and [`Kind::Coulomb`].
fn wish(cone: &Cone, x: &[f64], force: &[f64; 6], inverse: &[f64; 4]) -> [f64; 6] {
    let mut change = [0.0; 6];
    let normal = force[0] - (x[0] + force[0] / cone.d[0]) / inverse[0];
    if cone.kind == Kind::TwoSided {
        for k in 0..cone.dim {
            let rigid = inverse[k / 3].max(1.0 / cone.d[k]);
            change[k] = -(x[k] + force[k] / cone.d[k]) / rigid;
        }
        return change;
    }
    if cone.kind == Kind::Dry {
        change[0] = normal.clamp(-cone.mu[0], cone.mu[0]) - force[0];
        return change;
    }
    change[0] = normal.max(0.0) - force[0];
    for (group, inverse) in cone.groups().zip(&inverse[1..]) {
        let (d, mu) = (cone.d[group.start], cone.mu[group.start]);
        if d == 0.0 {
            continue;
        }
        // In slips and forces scaled by the rows' coefficients the limit is a circle.
        let (mut square, mut scaled) = (0.0, [0.0; 2]);
        for (scaled, k) in scaled.iter_mut().zip(group.clone()) {
            let f = force[k] / cone.mu[k];
            *scaled = f - (cone.mu[k] * x[k] + f / d) / (inverse * mu * mu);
            square += *scaled * *scaled;
        }
        let scale = if square > force[0] * force[0] { force[0] / square.sqrt() } else { 1.0 };
        for (scaled, k) in scaled.iter().zip(group) {
            change[k] = cone.mu[k] * scaled * scale - force[k];
        }
    }
    change
}

/// On which piece of the equations f⁺ = f a constraint is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Piece {
    /// A normal pushes.
    pub pushes: bool,
    /// Where it does not: how far it is from that, x, m/s².
    pub slack: f64,
    /// For each group of friction, and in the first place for dry friction: how it slips, if it does.
    pub slips: [Option<Slip>; 3],
}

/// A friction at its limit.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slip {
    /// Direction of the friction, in forces over the rows' coefficients, in which the limit is a circle.
    pub u: [f64; 2],
    /// How much more it slips than the limit's force would let it when it sticks: |σ| − R n, not negative.
    pub slack: f64,
}

impl Piece {
    /// The piece that the forces are on: those of the last step, where the bodies have moved on since. A normal without a force,
    /// and its friction, are where f⁺ is.
    pub fn of_forces(c: &Constraint) -> Piece {
        let Constraint { cone, y: x, force, .. } = c;
        let mut piece = Piece::of_wish(c);
        if cone.kind == Kind::TwoSided {
            return piece;
        }
        if cone.kind == Kind::Dry {
            let loss = cone.mu[0];
            let u = [force[0].signum(), 0.0];
            let slack = -u[0] * x[0] - loss / cone.d[0];
            piece.slips[0] = (force[0].abs() >= NEAR * loss).then_some(Slip { u, slack: slack.max(0.0) });
            return piece;
        }
        if force[0] <= 0.0 {
            return piece;
        }
        piece.pushes = true;
        for (slip, group) in piece.slips.iter_mut().zip(cone.groups()) {
            let (s, stiff) = (scaled(force, cone, &group), cone.d[group.start]);
            let length = norm(s);
            *slip = (stiff != 0.0 && length >= NEAR * force[0]).then(|| {
                let u = s.map(|s| s / length);
                let sigma = slips(x, cone, &group);
                let along = u[0] * sigma[0] + u[1] * sigma[1];
                Slip { u, slack: (-along - force[0] / stiff).max(0.0) }
            });
        }
        piece
    }

    /// The piece that f⁺ is on.
    pub fn of_wish(c: &Constraint) -> Piece {
        let Constraint { cone, y: x, force, inverse, .. } = c;
        let mut piece = Piece::default();
        if cone.kind == Kind::TwoSided {
            return piece;
        }
        let normal = force[0] - (x[0] + force[0] / cone.d[0]) / inverse[0];
        if cone.kind == Kind::Dry {
            let loss = cone.mu[0];
            let slip = Slip { u: [normal.signum(), 0.0], slack: inverse[0] * (normal.abs() - loss) };
            piece.slips[0] = (normal.abs() >= loss).then_some(slip);
            return piece;
        }
        piece.pushes = normal > 0.0;
        piece.slack = x[0].max(0.0);
        if !piece.pushes {
            return piece;
        }
        for ((slip, group), inverse) in piece.slips.iter_mut().zip(cone.groups()).zip(&inverse[1..]) {
            let (stiff, mu) = (cone.d[group.start], cone.mu[group.start]);
            if stiff == 0.0 {
                continue;
            }
            let inverse = inverse * mu * mu;
            let (s, sigma) = (scaled(force, cone, &group), slips(x, cone, &group));
            let z: [f64; 2] = std::array::from_fn(|i| s[i] - (sigma[i] + s[i] / stiff) / inverse);
            let length = norm(z);
            *slip = (length > normal).then(|| Slip { u: z.map(|z| z / length), slack: inverse * (length - normal) });
        }
        piece
    }
}

/// Part of the limit from which a force counts as being there.
const NEAR: f64 = 1.0 - 1e-9;

/// Forces of a group of friction over the rows' coefficients.
pub fn scaled(force: &[f64; 6], cone: &Cone, group: &Range<usize>) -> [f64; 2] {
    let mut s = [0.0; 2];
    s.iter_mut().zip(group.clone()).for_each(|(s, k)| *s = force[k] / cone.mu[k]);
    s
}

/// Slips of a group of friction, times the rows' coefficients.
pub fn slips(x: &[f64], cone: &Cone, group: &Range<usize>) -> [f64; 2] {
    let mut s = [0.0; 2];
    s.iter_mut().zip(group.clone()).for_each(|(s, k)| *s = cone.mu[k] * x[k]);
    s
}

/// Its length.
pub fn norm(s: [f64; 2]) -> f64 {
    (s[0] * s[0] + s[1] * s[1]).sqrt()
}

/// The equations f⁺ = f of a constraint on its piece, linearised at its force and its x (in `y`):
///
///     f becomes f + e − C δx
///
/// n' the new normal force, s = f/μ and σ = μ x friction and slip in which the limit is a circle:
///
///     normal pushes:    n' = −D (x + δx)                or else 0
///     friction sticks:  s' = −D (σ + δσ)
///     friction slips:   s' = n' u + s'_⊥,    s'_⊥ = −n/|σ| (σ + δσ)_⊥,    |σ| = R n + slack
///
/// C is not symmetric where friction slips: it feels the normal force, which does not feel it.
pub fn linearise(c: &Constraint) -> (Curvature, [f64; 6]) {
    let Constraint { cone, y: x, force, piece, .. } = c;
    let d = cone.d[0];
    if cone.kind == Kind::TwoSided {
        let e = std::array::from_fn(|k| if k < cone.dim { -(cone.d[k] * x[k] + force[k]) } else { 0.0 });
        return (Curvature::Diagonal(cone.d), e);
    }
    let mut e = [0.0; 6];
    if cone.kind == Kind::Dry {
        if let Some(slip) = piece.slips[0] {
            e[0] = cone.mu[0] * slip.u[0] - force[0];
            return (Curvature::Zero, e);
        }
        e[0] = -d * (x[0] + force[0] / d);
        return (Curvature::Diagonal([d, 0.0, 0.0, 0.0, 0.0, 0.0]), e);
    }
    if !piece.pushes {
        (0..cone.dim).for_each(|k| e[k] = -force[k]);
        return (Curvature::Zero, e);
    }
    e[0] = -d * (x[0] + force[0] / d);
    if piece.slips.iter().all(Option::is_none) {
        let mut diagonal = [0.0; 6];
        diagonal[0] = d;
        for k in (1..cone.dim).filter(|&k| cone.d[k] != 0.0) {
            diagonal[k] = cone.d[k] * cone.mu[k] * cone.mu[k];
            e[k] = -diagonal[k] * x[k] - force[k];
        }
        return (Curvature::Diagonal(diagonal), e);
    }
    let (mut diagonal, mut normal, mut turns) = ([0.0; 6], [0.0; 6], [0.0; 2]);
    diagonal[0] = d;
    let next = force[0] + e[0];
    for (slip, group) in piece.slips.iter().zip(cone.groups()) {
        let stiff = cone.d[group.start];
        if stiff == 0.0 {
            continue;
        }
        let Some(Slip { u, slack }) = slip else {
            for k in group {
                diagonal[k] = stiff * cone.mu[k] * cone.mu[k];
                e[k] = -diagonal[k] * x[k] - force[k];
            }
            continue;
        };
        let (s, sigma) = (scaled(force, cone, &group), slips(x, cone, &group));
        let along = u[0] * sigma[0] + u[1] * sigma[1];
        let n = force[0].max(0.0);
        let turn = if group.len() == 1 || n == 0.0 { 0.0 } else { n / (slack + n / stiff) };
        for (i, k) in group.clone().enumerate() {
            let mu = cone.mu[k];
            e[k] = mu * (next * u[i] - turn * (sigma[i] - along * u[i]) - s[i]);
            normal[k] = mu * u[i] * d;
            diagonal[k] = mu * mu * turn * (1.0 - u[i] * u[i]);
        }
        if group.len() == 2 {
            let [a, b] = [group.start, group.start + 1];
            turns[usize::from(a > 1)] = -cone.mu[a] * cone.mu[b] * turn * u[0] * u[1];
        }
    }
    (Curvature::Limited { diagonal, normal, turn: turns }, e)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n = −D x₀; of each group −D σ within the limit n, −n σ/|σ| beyond, times the coefficients.
    fn forces(cone: &Cone, x: &[f64; 6]) -> [f64; 6] {
        let mut force = [0.0; 6];
        force[0] = (-cone.d[0] * x[0]).max(0.0);
        for group in cone.groups() {
            let stiff = cone.d[group.start];
            let length = norm(slips(x, cone, &group));
            let by = if stiff * length > force[0] { force[0] / length } else { stiff };
            group.for_each(|k| force[k] = -cone.mu[k] * cone.mu[k] * by * x[k]);
        }
        force
    }

    /// Where forces solve a constraint's equations e is 0, and C is minus their derivative, by central differences.
    #[test]
    fn the_matrix_of_a_piece_is_the_forces_derivative() {
        let cone = Cone {
            kind: Kind::Coulomb,
            d: [3.0, 40.0, 40.0, 30.0, 20.0, 20.0],
            mu: [0.0, 0.6, 0.9, 0.2, 0.1, 0.3],
            ..Cone::default()
        };
        let mut kinds = [0; 2];
        for (i, dim) in (0..40).flat_map(|i| [1, 3, 4, 6].map(|dim| (i, dim))) {
            let number = |k: usize| ((7 * i + k) as f64 * 1.3).sin();
            let x: [f64; 6] =
                std::array::from_fn(|k| if k == 0 { -1.0 - 0.5 * number(0) } else { number(k) / (1 + i) as f64 });
            let mut c = Constraint { cone: Cone { dim, ..cone }, inverse: [1.0; 4], ..Constraint::default() };
            c.y[..6].copy_from_slice(&x);
            c.force = forces(&c.cone, &x);
            c.piece = Piece::of_forces(&c);
            let (curvature, e) = linearise(&c);
            let (full, h) = (curvature.matrix(), 1e-6);
            for l in 0..dim {
                let at = |by: f64| forces(&c.cone, &std::array::from_fn(|k| if k == l { x[k] + by } else { x[k] }));
                let (up, down) = (at(h), at(-h));
                for k in 0..dim {
                    let slope = -(up[k] - down[k]) / (2.0 * h);
                    assert!(
                        (slope - full[k][l]).abs() < 1e-6,
                        "{dim} rows at {x:?}, {k}, {l}: {slope} and {}",
                        full[k][l]
                    );
                }
            }
            assert!(e.iter().all(|e| e.abs() < 1e-12), "{e:?}");
            (0..c.cone.groups().count()).for_each(|g| kinds[usize::from(c.piece.slips[g].is_some())] += 1);
        }
        assert!(kinds.iter().all(|kind| *kind > 20), "stick and slip: {kinds:?}");
    }
}
