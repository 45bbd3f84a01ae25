//! Colliders against MuJoCo's contacts, and against truths that need no other engine.

use penny::collision::{Hits, Placed, collider, frame};
use penny::math::{Mat3, Vec3, mat, quat, vec3};
use penny::model::GeomKind;
use serde::Deserialize;

const KINDS: [GeomKind; 6] =
    [GeomKind::Plane, GeomKind::Sphere, GeomKind::Capsule, GeomKind::Ellipsoid, GeomKind::Cylinder, GeomKind::Box];

#[derive(Deserialize)]
struct Golden {
    poses: Vec<Poses>,
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
        if collider(kinds[0], kinds[1]).is_none() {
            continue;
        }
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
