//! Colliders against MuJoCo's contacts, and against truths that need no other engine.

use penny::collision::broad_phase::{Filter, may_touch, order};
use penny::collision::{Hits, POINT, Placed, collider, detect, frame};
use penny::data::Data;
use penny::math::{Mat3, Vec3, mat, quat, vec3};
use penny::model::{GeomKind, Model, Pair, Pairs};
use penny::state::State;
use serde::Deserialize;

const KINDS: [GeomKind; 6] =
    [GeomKind::Plane, GeomKind::Sphere, GeomKind::Capsule, GeomKind::Ellipsoid, GeomKind::Cylinder, GeomKind::Box];

#[derive(Deserialize)]
struct Golden {
    poses: Vec<Poses>,
    scenes: Vec<Scene>,
    stacks: Vec<Stacks>,
}

/// Two things that stand exactly on each other, lower kind first; how many contacts there are, and how many 1e-11 m
/// deeper.
#[derive(Deserialize)]
struct Stacks {
    name: String,
    kinds: [usize; 2],
    cases: Vec<Vec<f64>>,
    contacts: Vec<[usize; 2]>,
}

/// The contacts of a whole scene: two geoms, condim, dist, pos, normal, first tangent.
#[derive(Deserialize)]
struct Scene {
    name: String,
    xml: String,
    contacts: Vec<[f64; 13]>,
}

/// One pair of shapes; see `tests/golden/topics/contacts.py` for the layout of the numbers.
#[derive(Deserialize)]
struct Poses {
    name: String,
    kinds: [usize; 2],
    cases: Vec<Vec<f64>>,
    contacts: Vec<Vec<[f64; 10]>>,
}

fn golden() -> Golden {
    serde_json::from_str(include_str!("../golden/contacts.json")).unwrap()
}

/// Size, position and axes of a shape.
#[derive(Clone, Debug)]
struct Shape {
    size: Vec3,
    pos: Vec3,
    mat: Mat3,
}

impl Shape {
    fn read(v: &[f64]) -> Shape {
        Shape { size: vec3(&v[..3]), pos: vec3(&v[3..6]), mat: mat(&quat(&v[6..10])) }
    }
    fn placed(&self) -> Placed<'_> {
        Placed { size: &self.size, pos: &self.pos, mat: &self.mat }
    }
}

fn collide(kinds: [GeomKind; 2], a: &Shape, b: &Shape, margin: f64) -> Hits {
    let mut hits = Hits::default();
    let f = collider(kinds[0], kinds[1]).unwrap_or_else(|| panic!("no collider for {kinds:?}"));
    f(&a.placed(), &b.placed(), margin, &mut hits);
    hits
}

/// Inputs are of order 1, so 1e-12 leaves room for some thousand roundings.
#[test]
fn every_collider_finds_mujocos_contacts() {
    let mut wrong = Vec::new();
    for set in golden().poses {
        let kinds = set.kinds.map(|k| KINDS[k]);
        let (mut worst, mut bad) = (0.0f64, 0);
        for (i, (case, expected)) in set.cases.iter().zip(&set.contacts).enumerate() {
            let (a, b) = (Shape::read(&case[1..11]), Shape::read(&case[11..21]));
            let hits = collide(kinds, &a, &b, case[0]);
            let found = hits.as_slice();
            let mut error = if found.len() == expected.len() { 0.0 } else { f64::INFINITY };
            for (hit, e) in found.iter().zip(expected) {
                let frame = frame(&hit.normal, &hit.tangent);
                error = error.max((hit.dist - e[0]).abs()).max((hit.pos - vec3(&e[1..4])).norm());
                error = error.max((frame.row(0).transpose() - vec3(&e[4..7])).norm());
                error = error.max((frame.row(1).transpose() - vec3(&e[7..10])).norm());
            }
            worst = worst.max(error);
            if error.is_nan() || error > 1e-12 {
                bad += 1;
                if bad == 1 {
                    wrong.push(format!("{} case {i}: {error:e}: {found:#?} against {expected:?}", set.name));
                }
            }
        }
        println!("{:18} {} cases, {bad} differ, worst {worst:e}", set.name, set.cases.len());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What a test of geometry needs to know of a golden case.
struct Case {
    name: String,
    kinds: [GeomKind; 2],
    margin: f64,
    shapes: [Shape; 2],
    hits: Hits,
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for set in golden().poses {
        let kinds = set.kinds.map(|k| KINDS[k]);
        for (i, case) in set.cases.iter().enumerate() {
            let shapes = [Shape::read(&case[1..11]), Shape::read(&case[11..21])];
            let hits = collide(kinds, &shapes[0], &shapes[1], case[0]);
            cases.push(Case { name: format!("{} {i}", set.name), kinds, margin: case[0], shapes, hits });
        }
    }
    cases
}

/// Signed distance from a point to the surface of a shape; of an ellipsoid only its sign and zero are right.
fn signed_distance(kind: GeomKind, shape: &Shape, point: &Vec3) -> f64 {
    let p = shape.mat.tr_mul(&(point - shape.pos));
    let s = shape.size;
    let slab = |d: [f64; 3]| {
        let outside = d.map(|x| x.max(0.0)).iter().map(|x| x * x).sum::<f64>().sqrt();
        outside + d.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0)
    };
    match kind {
        GeomKind::Plane => p.z,
        GeomKind::Sphere => p.norm() - s.x,
        GeomKind::Capsule => Vec3::new(p.x, p.y, p.z - p.z.clamp(-s.y, s.y)).norm() - s.x,
        GeomKind::Ellipsoid => p.component_div(&s).norm() - 1.0,
        GeomKind::Cylinder => slab([p.x.hypot(p.y) - s.x, p.z.abs() - s.y, f64::NEG_INFINITY]),
        GeomKind::Box => slab([p.x.abs() - s.x, p.y.abs() - s.y, p.z.abs() - s.z]),
    }
}

/// A contact lies midway between two points of the surfaces, half its distance along the normal to each side.
///
/// That is so for the deepest contact of a pair; others may lie inside (the upper end of a leaning capsule), none
/// outside. Left out: two box edges that pass each other beyond their ends, and a capsule whose axis runs inside a
/// box. Capsules within 1e-4 rad count as parallel, which misses the surface by up to 2e-9.
#[test]
fn contacts_lie_midway_between_the_surfaces() {
    for case in cases() {
        let hits = case.hits.as_slice();
        let deepest = hits.iter().map(|hit| hit.dist).fold(f64::INFINITY, f64::min);
        for hit in hits {
            let distance = [(0, -0.5), (1, 0.5)].map(|(k, half)| {
                signed_distance(case.kinds[k], &case.shapes[k], &(hit.pos + hit.normal * (half * hit.dist)))
            });
            if case.kinds == [GeomKind::Box; 2] && hit.feature >= 16 && hits.len() == 1 {
                continue;
            }
            let inside = case.kinds == [GeomKind::Capsule, GeomKind::Box];
            for (k, d) in distance.into_iter().enumerate() {
                assert!(d < 1e-8, "{}: {d} outside surface {k}", case.name);
                assert!(d > -1e-8 || hit.dist > deepest || inside, "{}: {d} inside surface {k}", case.name);
            }
        }
    }
}

/// A capsule that stands upright on a slope asks for its normal as tangent: of the difference only rounding is left.
#[test]
fn tangents_are_across_the_normal_whatever_is_asked_for() {
    let mut seed = 5;
    for i in 0..2000 {
        let normal = if i == 0 { Vec3::x() } else { scatter3(&mut seed).normalize() };
        let off = scatter3(&mut seed) * 10f64.powi(-(i % 20));
        let rows = frame(&normal, &(normal + off).normalize());
        let skew = (rows * rows.transpose() - Mat3::identity()).abs().max();
        assert!(skew < 1e-12, "{skew:e} with {normal} and {off}");
    }
}

/// It slides as it does where the slope is level and gravity is not.
#[test]
fn an_upright_capsule_slides_on_a_slope() {
    let scene = |turned: &str, gravity: &str| {
        format!(
            "<mujoco><option gravity='{gravity}' cone='elliptic'/><worldbody><frame {turned}>
            <geom type='plane' size='9 9 1' friction='.1'/>
            <body pos='0 0 .1299'><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 0 1'/>
            <geom type='capsule' size='.08 .05' friction='.1'/></body></frame></worldbody></mujoco>"
        )
    };
    for law in penny::contact::ALL {
        for degrees in [3.0f64, 20.0, 41.0, 77.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let level = scene("", &format!("{} 0 {}", 10.0 * sin, -10.0 * cos));
            let [mut level, mut slope] = [level, scene(&format!("euler='0 {degrees} 0'"), "0 0 -10")]
                .map(|xml| crate::sim::Sim::law(&xml, law.name));
            level.run(0.2);
            slope.run(0.2);
            let (a, b) = (&level.state.qvel, &slope.state.qvel);
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-7), "{} at {degrees}°: {a:?} {b:?}", law.name);
        }
    }
}

/// Turning and moving the whole scene turns and moves its contacts.
///
/// Nearly parallel axes amplify rounding by 1e5 and more; a wrong transform is off by the scene's size.
#[test]
fn contacts_move_with_the_scene() {
    let turn = mat(&quat(&[0.3, -0.7, 0.2, 0.6]));
    let shift = Vec3::new(1.5, -2.0, 0.7);
    for case in cases() {
        // Exactly along a box's edges, the order of points and a capsule's second one hang on the last bits.
        if case.kinds[1] == GeomKind::Box && case.shapes[0].mat == case.shapes[1].mat {
            continue;
        }
        let moved = case.shapes.clone().map(|s| Shape { size: s.size, pos: turn * s.pos + shift, mat: turn * s.mat });
        let after = collide(case.kinds, &moved[0], &moved[1], case.margin);
        assert_eq!(case.hits.as_slice().len(), after.as_slice().len(), "{}", case.name);
        for (before, after) in case.hits.as_slice().iter().zip(after.as_slice()) {
            assert!((before.dist - after.dist).abs() < 1e-9, "{}: distance", case.name);
            assert!((turn * before.pos + shift - after.pos).norm() < 1e-7, "{}: point", case.name);
            assert!((turn * before.normal - after.normal).norm() < 1e-7, "{}: normal", case.name);
            assert_eq!(before.feature, after.feature, "{}: feature", case.name);
        }
    }
}

/// Moving the second shape along the normal by the deepest penetration takes two boxes apart, and a little less
/// does not.
#[test]
fn the_normal_of_two_boxes_separates_them() {
    for case in cases().iter().filter(|case| case.kinds == [GeomKind::Box; 2]) {
        let Some(hit) = case.hits.as_slice().iter().min_by(|a, b| a.dist.total_cmp(&b.dist)) else { continue };
        let touches = |by: f64| {
            let [a, mut b] = case.shapes.clone();
            b.pos += hit.normal * by;
            !collide(case.kinds, &a, &b, 0.0).as_slice().is_empty()
        };
        if hit.dist < -1e-6 {
            assert!(!touches(-hit.dist + 1e-9), "{}: still in touch", case.name);
            assert!(touches(-hit.dist * 0.99), "{}: apart too early", case.name);
        }
    }
}

/// The distance of a ball to a box against the nearest of 60,000 points of the box's surface.
#[test]
fn sphere_box_distance_is_that_of_the_nearest_surface_point() {
    const N: usize = 100;
    let step = |k: usize| 2.0 * k as f64 / (N - 1) as f64 - 1.0;
    for case in cases().iter().filter(|case| case.kinds == [GeomKind::Sphere, GeomKind::Box]).step_by(10) {
        let [ball, cuboid] = &case.shapes;
        let center = cuboid.mat.tr_mul(&(ball.pos - cuboid.pos));
        let mut nearest = f64::INFINITY;
        for face in 0..6 {
            for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                let mut p = Vec3::zeros();
                p[face / 2] = if face % 2 == 0 { -1.0 } else { 1.0 };
                p[(face / 2 + 1) % 3] = step(i);
                p[(face / 2 + 2) % 3] = step(j);
                nearest = nearest.min((p.component_mul(&cuboid.size) - center).norm());
            }
        }
        let inside = signed_distance(GeomKind::Box, cuboid, &ball.pos) < 0.0;
        let expected = if inside { -nearest } else { nearest } - ball.size.x;
        // Half a grid cell of the largest face.
        let coarse = cuboid.size.max() / N as f64 * 2.0;
        match case.hits.as_slice() {
            [hit] => assert!((hit.dist - expected).abs() < coarse, "{}: {} not {expected}", case.name, hit.dist),
            _ => assert!(expected > case.margin - coarse, "{}: no contact at {expected}", case.name),
        }
    }
}

/// Equal boxes stacked exactly: the last bits decide which box is the reference and which corners are clipped,
/// and the features must not show it.
#[test]
fn features_of_a_stack_ignore_the_last_bits() {
    let a = Shape { size: Vec3::new(0.1, 0.1, 0.05), pos: Vec3::zeros(), mat: Mat3::identity() };
    let features = |noise: Vec3| {
        let turned = mat(&penny::math::exp(&noise));
        let b = Shape { size: a.size, pos: Vec3::new(0.0, 0.0, 0.0999) + noise, mat: turned };
        let mut f: Vec<u32> = collide([GeomKind::Box; 2], &a, &b, 0.0).as_slice().iter().map(|h| h.feature).collect();
        f.sort();
        f
    };
    let exact = features(Vec3::zeros());
    assert_eq!(exact, [4, 5, 6, 7], "the upper corners of the lower box");
    for k in 0..60 {
        let k = f64::from(k);
        let noise = Vec3::new(k.sin(), (2.0 * k).cos(), (3.0 * k).sin()) * 1e-12;
        assert_eq!(features(noise), exact, "noise {noise:?}");
    }
}

/// A disc that stands on its rim touches with the same two features whichever way it leans.
#[test]
fn features_of_a_disc_follow_its_faces() {
    let plane = Shape { size: Vec3::zeros(), pos: Vec3::zeros(), mat: Mat3::identity() };
    let lean = |angle: f64| {
        let mat = mat(&penny::math::exp(&Vec3::new(std::f64::consts::FRAC_PI_2 + angle, 0.0, 0.0)));
        let disc = Shape { size: Vec3::new(0.2, 0.01, 0.0), pos: Vec3::new(0.0, 0.0, 0.1999), mat };
        let hits = collide([GeomKind::Plane, GeomKind::Cylinder], &plane, &disc, 0.0);
        let mut side: Vec<(u32, bool)> = hits.as_slice().iter().map(|h| (h.feature, h.pos.y > 0.0)).collect();
        side.sort();
        side
    };
    assert_eq!(lean(1e-4).len(), 2, "both rims touch");
    assert_eq!(lean(1e-4), lean(-1e-4));
}

/// How far a shape reaches in a direction, from the world's origin.
fn reach(kind: GeomKind, shape: &Shape, d: &Vec3) -> f64 {
    let (l, s) = (shape.mat.tr_mul(d), shape.size);
    shape.pos.dot(d)
        + match kind {
            GeomKind::Plane => f64::INFINITY,
            GeomKind::Sphere => s.x,
            GeomKind::Capsule => s.x + s.y * l.z.abs(),
            GeomKind::Ellipsoid => l.component_mul(&s).norm(),
            GeomKind::Cylinder => s.x * l.x.hypot(l.y) + s.y * l.z.abs(),
            GeomKind::Box => l.abs().dot(&s),
        }
}

/// The gap between two shapes seen along a direction: at most their distance, and equal to it along the normal.
fn gap(kinds: [GeomKind; 2], shapes: &[Shape; 2], n: &Vec3) -> f64 {
    -reach(kinds[0], &shapes[0], n) - reach(kinds[1], &shapes[1], &-n)
}

/// Numbers from −1 to 1 that look random and are the same everywhere.
fn scatter(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn scatter3(seed: &mut u64) -> Vec3 {
    Vec3::from_fn(|_, _| scatter(seed))
}

/// One pair without a closed form; see `tests/golden/topics/convex.py` for the layout of the numbers.
#[derive(Deserialize)]
struct ConvexPair {
    name: String,
    kinds: [usize; 2],
    cases: Vec<Vec<f64>>,
    contacts: Vec<Vec<[f64; 7]>>,
}

fn convex_pairs() -> Vec<ConvexPair> {
    #[derive(Deserialize)]
    struct Golden {
        pairs: Vec<ConvexPair>,
    }
    serde_json::from_str::<Golden>(include_str!("../golden/convex.json")).unwrap().pairs
}

/// Pairs without a closed form: MuJoCo's contacts, as many and as deep, and all but a few to 1e-8, in its order.
///
/// The cases are those that change by up to 1e-10 in MuJoCo when moved by a last digit. The few are in exact symmetry:
/// what the last bits decide there (which of two mirror images, which square of a cap's corners) they decide again in
/// the moved one. Of 10,000 poses a pair speaks `tests/collision/pairs.md`.
#[test]
fn convex_pairs_have_mujocos_contacts() {
    let (mut total, mut others) = (0, Vec::new());
    for set in convex_pairs() {
        let kinds = set.kinds.map(|k| KINDS[k]);
        assert!(!penny::collision::exact(kinds[0], kinds[1]));
        for (i, (case, expected)) in set.cases.iter().zip(&set.contacts).enumerate() {
            let (a, b) = (Shape::read(&case[1..11]), Shape::read(&case[11..21]));
            let hits = collide(kinds, &a, &b, case[0]);
            let found = hits.as_slice();
            assert_eq!(found.len(), expected.len(), "{} case {i}: {found:?} against {expected:?}", set.name);
            let deepest = |dist: &mut dyn Iterator<Item = f64>| dist.fold(0.0, f64::min);
            let [ours, theirs] =
                [deepest(&mut found.iter().map(|h| h.dist)), deepest(&mut expected.iter().map(|e| e[0]))];
            assert!((ours - theirs).abs() < 1e-6, "{} case {i}: {ours} deep, not {theirs}", set.name);
            let mut error = 0.0f64;
            for (hit, e) in found.iter().zip(expected) {
                error = error.max((hit.dist - e[0]).abs()).max((hit.pos - vec3(&e[1..4])).norm());
                error = error.max((hit.normal - vec3(&e[4..7])).norm());
            }
            total += 1;
            if error.is_nan() || error > 1e-8 {
                others.push(format!("{} case {i}: {error:e}: {found:?} against {expected:?}", set.name));
            }
        }
    }
    assert!(others.len() * 40 < total, "{} of {total} differ\n{}", others.len(), others.join("\n"));
}

/// Turning and moving the whole scene turns and moves their contacts.
///
/// Not so where the search begins with a segment: as in MuJoCo, the world's axes then choose where it looks first, and it
/// ends 1e-6 m from the surface in another direction. Round shapes exactly above each other do that.
#[test]
fn contacts_of_convex_pairs_move_with_the_scene() {
    let turn = mat(&quat(&[0.3, -0.7, 0.2, 0.6]));
    let shift = Vec3::new(1.5, -2.0, 0.7);
    let (mut cases, mut different) = (0, 0);
    for set in convex_pairs() {
        let kinds = set.kinds.map(|k| KINDS[k]);
        for (i, case) in set.cases.iter().enumerate() {
            let shapes = [Shape::read(&case[1..11]), Shape::read(&case[11..21])];
            let moved = shapes.clone().map(|s| Shape { size: s.size, pos: turn * s.pos + shift, mat: turn * s.mat });
            let before = collide(kinds, &shapes[0], &shapes[1], case[0]);
            let after = collide(kinds, &moved[0], &moved[1], case[0]);
            assert_eq!(before.as_slice().len(), after.as_slice().len(), "{} {i}", set.name);
            cases += 1;
            let off = |(before, after): (&penny::collision::Hit, &penny::collision::Hit)| {
                (turn * before.normal - after.normal).norm().max((before.dist - after.dist).abs())
            };
            different += usize::from(before.as_slice().iter().zip(after.as_slice()).map(off).any(|off| off > 1e-7));
        }
    }
    assert!(different * 20 < cases, "{different} of {cases} depend on the frame");
}

/// Exactly touching shapes, upright or lying, are not in contact, or no deeper than rounding makes them, and then in the
/// direction in which they touch.
#[test]
fn touching_convex_shapes_are_at_most_rounding_deep() {
    let mut seed = 5;
    let along_z = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5], [0.5, 0.5, -0.5, 0.5]];
    for set in convex_pairs() {
        let kinds = set.kinds.map(|k| KINDS[k]);
        let mut touching = 0;
        for i in 0..400 {
            let mut shape = |k: usize, z: f64| Shape {
                size: scatter3(&mut seed).map(|x| ((x * 0.1 + 0.15) * 100.0).round() / 100.0),
                pos: Vec3::z() * z,
                mat: mat(&quat(&along_z[(i / (4 * k + 1)) % 4])),
            };
            let mut shapes = [shape(0, 0.3), shape(1, 0.0)];
            let height = |k: usize| reach(kinds[k], &Shape { pos: Vec3::zeros(), ..shapes[k].clone() }, &Vec3::z());
            let beside = scatter3(&mut seed) * if i % 3 == 0 { 0.0 } else { 0.03 };
            shapes[1].pos = Vec3::new(beside.x, beside.y, 0.3 + height(0) + height(1));
            for hit in collide(kinds, &shapes[0], &shapes[1], 0.0).as_slice() {
                assert!(hit.dist > -1e-6, "{} {i}: depth {}", set.name, hit.dist);
                assert!(hit.normal.z > 0.9, "{} {i}: normal {}", set.name, hit.normal);
                touching += 1;
            }
        }
        assert!(touching <= 80, "{}: {touching} contacts of 400 pairs", set.name);
    }
}

/// With one centre for both, any direction is as good to begin with; numbers are MuJoCo 4.0.0's.
#[test]
fn convex_shapes_with_one_centre_are_in_contact() {
    let tilted = mat(&penny::math::exp(&Vec3::new(0.3, 0.0, 0.0)));
    let a = Shape { size: Vec3::new(0.1, 0.12, 0.09), pos: Vec3::new(0.0, 0.0, 0.3), mat: Mat3::identity() };
    let b = Shape { size: Vec3::new(0.11, 0.1, 0.08), mat: tilted, ..a.clone() };
    let expected = [
        ([GeomKind::Cylinder, GeomKind::Cylinder], -0.209999978, Vec3::new(-1.0, 0.0, 0.0)),
        ([GeomKind::Ellipsoid, GeomKind::Ellipsoid], -0.168102213, Vec3::new(0.039914284, -0.235525744, 0.971048132)),
    ];
    for (kinds, dist, normal) in expected {
        let hits = collide(kinds, &a, &b, 0.0);
        let [hit] = hits.as_slice() else { panic!("{kinds:?}: {hits:?}") };
        assert!((hit.dist - dist).abs() < 1e-8 && (hit.normal - normal).norm() < 1e-5, "{kinds:?}: {hit:?}");
    }
}

/// Pairs without a closed form that touch in a point: no direction near or far shows a gap larger than that along the
/// normal found by more than the search's tolerance, and the contact is that deep.
///
/// 1e-3 deep in shapes of 0.05 to 0.3.
#[test]
fn convex_shapes_touch_along_the_direction_that_separates_them_best() {
    let mut seed = 7;
    for (set, i) in convex_pairs().iter().flat_map(|set| (0..100).map(move |i| (set, i))) {
        let kinds = set.kinds.map(|k| KINDS[k]);
        let mut shape = |at: Vec3| Shape {
            size: scatter3(&mut seed) * 0.125 + Vec3::repeat(0.175),
            pos: at,
            mat: mat(&penny::math::exp(&(scatter3(&mut seed) * 3.0))),
        };
        let mut shapes = [shape(Vec3::zeros()), shape(Vec3::zeros())];
        // From far away to 1e-3 deep, along a line of centres: the gap is then known by bisection.
        let away = scatter3(&mut seed).normalize();
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            shapes[1].pos = away * middle;
            let apart = collide(kinds, &shapes[0], &shapes[1], 0.0).as_slice().is_empty();
            if apart { high = middle } else { low = middle }
        }
        shapes[1].pos = away * (high - 1e-3);
        let hits = collide(kinds, &shapes[0], &shapes[1], 0.0);
        let Some(hit) = hits.as_slice().first() else { panic!("{} {i}: no contact", set.name) };
        // Areas and lines have the normal of a face; of some only one point is deep enough.
        if hit.feature != POINT {
            continue;
        }
        let found = gap(kinds, &shapes, &hit.normal);
        assert!(hit.dist < 0.0 && hit.dist > -1.1e-3, "{} {i}: depth {}", set.name, hit.dist);
        assert!((found - hit.dist).abs() < 2e-6, "{} {i}: {found} along the normal, not {}", set.name, hit.dist);
        for k in 0..500 {
            let tilt = scatter3(&mut seed) * [1e-4, 1e-2, 0.1, 3.0][k % 4];
            let other = gap(kinds, &shapes, &(hit.normal + tilt).normalize());
            assert!(
                other < found + 1e-6,
                "{} {i}: {other} along another direction, {found} along the normal",
                set.name
            );
        }
    }
}

/// A coin flat on a box rests on four points of its rim, a roller on two, a box on a wide coin on its corners.
#[test]
fn areas_are_held_by_several_points() {
    use GeomKind::{Box, Capsule, Cylinder};
    let upright = |size: [f64; 3], z: f64| Shape { size: size.into(), pos: Vec3::z() * z, mat: Mat3::identity() };
    let lying = |size: [f64; 3], z: f64| {
        let turn = penny::math::exp(&Vec3::new(std::f64::consts::FRAC_PI_2, 0.0, 0.0));
        Shape { mat: mat(&turn), ..upright(size, z) }
    };
    let base = upright([0.5, 0.5, 0.1], 0.0);
    let check = |kinds: [GeomKind; 2], a: &Shape, b: &Shape, n: usize| {
        let hits = collide(kinds, a, b, 0.0);
        assert_eq!(hits.as_slice().len(), n, "{kinds:?}: {hits:?}");
        for hit in hits.as_slice() {
            assert!((hit.dist + 1e-4).abs() < 1e-12, "{kinds:?}: depth {}", hit.dist);
            assert!((hit.pos.z - 0.09995).abs() < 1e-12, "{kinds:?}: height {}", hit.pos.z);
        }
    };
    check([Cylinder, Box], &upright([0.2, 0.02, 0.0], 0.1199), &base, 4);
    check([Cylinder, Box], &lying([0.05, 0.3, 0.0], 0.1499), &base, 2);
    let wide = upright([0.5, 0.1, 0.0], 0.0);
    check([Cylinder, Box], &wide, &upright([0.1, 0.1, 0.1], 0.1999), 4);
    check([Cylinder, Cylinder], &wide, &upright([0.2, 0.02, 0.0], 0.1199), 4);
    check([Capsule, Cylinder], &lying([0.05, 0.3, 0.0], 0.1499), &wide, 2);
}

/// Whole scenes: the same contacts in the same order, frames included; also with every pair found by the sweep.
#[test]
fn scenes_have_mujocos_contacts_in_mujocos_order() {
    for scene in golden().scenes {
        let model = penny::parse(&scene.name, &scene.xml).unwrap_or_else(|e| panic!("{e}")).model;
        let state = State::new(&model);
        let mut data = Data::new(&model);
        penny::dynamics::kinematics(&model, &state.qpos, &mut data);
        detect(&model, &mut data);
        let pair = |geom: [u32; 2]| format!("{}-{}", geom[0], geom[1]);
        let found: Vec<String> = data.contacts.iter().map(|c| pair(c.geom)).collect();
        let expected: Vec<String> = scene.contacts.iter().map(|c| pair([c[0] as u32, c[1] as u32])).collect();
        assert_eq!(found, expected, "{}", scene.name);
        for (c, e) in data.contacts.iter().zip(&scene.contacts) {
            let which = format!("{}: {}", scene.name, pair(c.geom));
            let condim = model.mixes[c.mix as usize].condim;
            assert_eq!(condim, e[2] as usize, "{which}: condim");
            assert!((c.dist - e[3]).abs() < 1e-12, "{which}: dist {} not {}", c.dist, e[3]);
            assert!((c.pos - vec3(&e[4..7])).norm() < 1e-12, "{which}: pos {} not {:?}", c.pos, &e[4..7]);
            assert!((c.frame.row(0).transpose() - vec3(&e[7..10])).norm() < 1e-12, "{which}: normal");
            let tangent = if condim > 1 { vec3(&e[10..13]) } else { Vec3::zeros() };
            assert!((c.frame.row(1).transpose() - tangent).norm() < 1e-12, "{which}: tangent");
        }
    }
}

/// As MuJoCo 4.0.0: what `<contact><pair>` gives two bodies comes before their other contacts, in the order of the file; also
/// where a sweep finds the others.
#[test]
fn given_pairs_of_two_bodies_are_in_the_order_of_the_file() {
    let dumbbell = |[a, b]: [&str; 2], z: f64| {
        format!(
            "<body pos='0 0 {z}'><freejoint/><geom name='{a}' size='.1'/><geom name='{b}' size='.1' pos='.3 0 0'/></body>"
        )
    };
    let dumbbells = dumbbell(["a0", "a1"], 0.0) + &dumbbell(["b0", "b1"], 0.1);
    for others in [0, 100] {
        let far = "<body pos='9 9 9'><freejoint/><geom size='.1'/></body>".repeat(others);
        let found = |pairs: &[[&str; 2]]| {
            let given = |[a, b]: &[&str; 2]| format!("<pair geom1='{a}' geom2='{b}'/>");
            let pairs: String = pairs.iter().map(given).collect();
            let text = format!("<mujoco><worldbody>{dumbbells}{far}</worldbody><contact>{pairs}</contact></mujoco>");
            let model = penny::parse("pairs", &text).unwrap_or_else(|e| panic!("{e}")).model;
            assert_eq!(model.pairs.swept.is_empty(), others == 0);
            let mut data = Data::for_poses(&model);
            detect(&model, &mut data);
            data.contacts.iter().map(|c| c.geom).filter(|geom| geom[0] < 2).collect::<Vec<_>>()
        };
        assert_eq!(found(&[["b1", "a1"], ["b0", "a0"]]), [[1, 3], [0, 2]]);
        assert_eq!(found(&[["a0", "b0"], ["a1", "b1"]]), [[0, 2], [1, 3]]);
        assert_eq!(found(&[["b1", "a1"]]), [[1, 3], [0, 2]]);
    }
}

/// What stands exactly on a base: a cylinder, or on a cylinder, does not touch it, and where a closed form decides by
/// the last bit, it does so as MuJoCo's. Not compared so are capsules, for which both go by different last bits. All
/// touch 1e-11 m deeper.
#[test]
fn stacks_touch_where_mujocos_do() {
    for set in golden().stacks {
        let kinds = set.kinds.map(|k| KINDS[k]);
        for (i, (case, expected)) in set.cases.iter().zip(&set.contacts).enumerate() {
            let touches = |deeper: f64| {
                let (low, mut high) = (Shape::read(&case[1..11]), Shape::read(&case[11..21]));
                high.pos.z -= deeper;
                let ordered = kinds[0] <= kinds[1];
                let (a, b) = if ordered { (&low, &high) } else { (&high, &low) };
                !collide([kinds[0].min(kinds[1]), kinds[0].max(kinds[1])], a, b, 0.0).as_slice().is_empty()
            };
            let [now, deeper] = expected.map(|n| n > 0);
            assert!(kinds.contains(&GeomKind::Capsule) || touches(0.0) == now, "{} {i}: {case:?}", set.name);
            assert!(deeper && touches(1e-11), "{} {i}, deeper: {case:?}", set.name);
        }
    }
}

/// Every pair of a model listed one by one, as if there were no broad phase.
fn without_sweep(model: &Model) -> Model {
    let mut listed = model.pairs.listed.clone();
    let replaced = |a: usize, b: usize| listed.iter().any(|p| p.geom == [a, b] || p.geom == [b, a]);
    let mut more = Vec::new();
    for &a in &model.pairs.swept {
        for &b in model.pairs.swept.iter().filter(|&&b| b > a && !replaced(a, b)) {
            let [first, second] = [a, b].map(|g| Filter::from(&model.geoms[g]));
            if may_touch(&model.bodies, first, second, true, &model.pairs.excluded) {
                let classes = model.pairs.mix_table.len().isqrt();
                let place = model.pairs.class[a] as usize * classes + model.pairs.class[b] as usize;
                let mix = model.pairs.mix_table[place] as usize;
                more.extend(Pair::new(&model.geoms, [a, b], mix, &model.mixes[mix]));
            }
        }
    }
    listed.append(&mut more);
    listed.sort_by_key(|pair| order(&model.geoms, pair));
    model.with_pairs(Pairs { listed, ..Pairs::default() })
}

/// The sweep keeps its list from step to step; bodies drift apart and together and jump, and no contact is lost or
/// added. One heap of all sizes, one of equal balls, where a list kept too long would show.
#[test]
fn the_sweep_finds_what_testing_every_pair_finds() {
    let heap = golden().scenes.into_iter().find(|scene| scene.name.starts_with("heap")).unwrap();
    let ball = "<body><freejoint/><geom size='.05'/></body>";
    let balls = format!("<mujoco><worldbody>{}</worldbody></mujoco>", ball.repeat(100));
    for xml in [heap.xml, balls] {
        let model = penny::parse("heap", &xml).unwrap_or_else(|e| panic!("{e}")).model;
        assert!(!model.pairs.swept.is_empty(), "the heap is too small for a broad phase");
        let brute = without_sweep(&model);
        let mut seed = 11;
        let mut place = |scale: f64| model.joints.iter().map(|_| scatter3(&mut seed) * scale).collect::<Vec<_>>();
        let (mut pos, drift, jumps) = (place(0.6), place(0.004), place(0.6));
        let mut qpos = model.qpos0.clone();
        let (mut swept, mut all) = (Data::new(&model), Data::new(&brute));
        for step in 0..120 {
            for (k, joint) in model.joints.iter().enumerate() {
                let back_and_forth = drift[k] * if step / 20 % 2 == 0 { 1.0 } else { -1.0 };
                pos[k] = if step % 40 == 39 && k % 10 == 0 { jumps[k] } else { pos[k] + back_and_forth };
                qpos[joint.qposadr..joint.qposadr + 3].copy_from_slice(pos[k].as_slice());
            }
            let contacts = [(&model, &mut swept), (&brute, &mut all)].map(|(model, data)| {
                penny::dynamics::kinematics(model, &qpos, data);
                detect(model, data);
                data.contacts.iter().map(|c| (c.geom, c.feature, c.dist.to_bits())).collect::<Vec<_>>()
            });
            assert!(contacts[1].len() > 5, "step {step}: only {} contacts", contacts[1].len());
            assert_eq!(contacts[0], contacts[1], "step {step}");
        }
    }
}

/// Each two shapes are 10 mm deep in one another: a margin or gap of −5 mm leaves what is deeper than that, one of −1 m nothing.
#[test]
fn a_margin_below_zero_leaves_what_is_deeper() {
    let names = ["plane", "sphere", "capsule", "ellipsoid", "cylinder", "box"];
    for (a, b) in (0..6).flat_map(|a| (1..6).map(move |b| (a, b))) {
        let contacts = |numbers: &str| {
            let z = if a == 0 { 0.09 } else { 0.19 };
            let text = format!(
                "<mujoco><worldbody><geom type='{}' size='.1 .1 .1' {numbers}/><body pos='0 0 {z}'><freejoint/>
                <geom type='{}' size='.1 .1 .1'/></body></worldbody></mujoco>",
                names[a], names[b]
            );
            let model = penny::parse("two", &text).unwrap_or_else(|e| panic!("{e}")).model;
            let mut data = Data::for_poses(&model);
            detect(&model, &mut data);
            data.contacts.iter().map(|c| c.dist).collect::<Vec<_>>()
        };
        let deep: Vec<f64> = contacts("").into_iter().filter(|dist| *dist <= -0.005).collect();
        assert!(!deep.is_empty(), "{} {}", names[a], names[b]);
        for attribute in ["margin", "gap"] {
            assert_eq!(contacts(&format!("{attribute}='-.005'")), deep, "{attribute} of {} {}", names[a], names[b]);
            assert!(contacts(&format!("{attribute}='-1'")).is_empty(), "{attribute} of {} {}", names[a], names[b]);
        }
    }
}

/// Whatever a diverging run hands to the colliders, they return.
#[test]
fn no_collider_panics_on_wild_numbers() {
    let wild = [0.0, -0.0, 1e-300, 1e300, f64::INFINITY, f64::NAN];
    let mut seed = 3;
    let mut number = || {
        let k = (scatter(&mut seed) * 12.0) as i32;
        if (0..6).contains(&k) { wild[k as usize] } else { scatter(&mut seed) }
    };
    let pairs = KINDS.into_iter().flat_map(|a| KINDS.map(|b| [a, b])).filter(|k| collider(k[0], k[1]).is_some());
    for (kinds, _) in pairs.flat_map(|kinds| (0..500).map(move |i| (kinds, i))) {
        let mut shape = || Shape {
            size: Vec3::new(0.1, 0.2, 0.3),
            pos: Vec3::from_fn(|_, _| number()),
            mat: Mat3::from_fn(|_, _| number()),
        };
        collide(kinds, &shape(), &shape(), 0.01);
    }
}
