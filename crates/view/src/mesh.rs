//! The primitives as triangles. Only their outline matters: normals are taken from the exact shape.

use std::f32::consts::{PI, TAU};
use std::sync::OnceLock;

use super::raster::V3;

/// What a drawn thing looks like. Sizes as in [`penny::model::Geom`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Sphere,
    Capsule,
    Ellipsoid,
    Cylinder,
    Box,
    /// Radius and half-height; the tip at +z.
    Cone,
    /// A triangle from its corner: two edges, in parts of the size, are the first two axes, its normal the third.
    Facet,
}

/// Vertices of a unit shape: a direction that is scaled, and on which end of the axis (−1, 0, 1) it sits.
///
///     vertex = direction ⊙ scale + end · h · ẑ
pub struct Mesh {
    pub vertices: Vec<([f32; 3], f32)>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u16; 3]>,
}

/// Segments around the axis at the four levels of detail.
const SEGMENTS: [usize; 4] = [12, 24, 40, 72];

/// The mesh whose outline is within about 0.2 pixel of the shape when its radius covers `pixels`.
pub fn mesh(shape: Shape, pixels: f32) -> &'static Mesh {
    static MESHES: OnceLock<Vec<Mesh>> = OnceLock::new();
    let all = MESHES.get_or_init(|| {
        let mut all = vec![cube()];
        for n in SEGMENTS {
            all.extend([ball(n, false), ball(n, true), tube(n), cone(n)]);
        }
        all.push(facet());
        all
    });
    let wanted = PI * (pixels.max(1.0) / 0.4).sqrt();
    let level = SEGMENTS.iter().position(|&n| n as f32 >= wanted).unwrap_or(SEGMENTS.len() - 1);
    match shape {
        Shape::Box => &all[0],
        Shape::Sphere | Shape::Ellipsoid => &all[1 + 4 * level],
        Shape::Capsule => &all[2 + 4 * level],
        Shape::Cylinder => &all[3 + 4 * level],
        Shape::Cone => &all[4 + 4 * level],
        Shape::Facet => &all[1 + 4 * SEGMENTS.len()],
    }
}

/// Scale and axial offset that turn the unit mesh into the shape.
pub fn scale(shape: Shape, size: &V3) -> (V3, f32) {
    match shape {
        Shape::Sphere => (V3::repeat(size.x), 0.0),
        Shape::Capsule => (V3::repeat(size.x), size.y),
        Shape::Cylinder | Shape::Cone => (V3::new(size.x, size.x, size.y), 0.0),
        Shape::Box | Shape::Ellipsoid | Shape::Facet => (*size, 0.0),
    }
}

/// Outward normal of the shape at (or next to) a point of its surface, in its own axes; not normalised.
pub fn normal(shape: Shape, size: &V3, p: &V3) -> V3 {
    let radial = V3::new(p.x, p.y, 0.0);
    match shape {
        Shape::Sphere => *p,
        Shape::Facet => V3::z(),
        Shape::Ellipsoid => p.component_div(&size.component_mul(size)),
        Shape::Capsule => V3::new(p.x, p.y, p.z - p.z.clamp(-size.y, size.y)),
        Shape::Cylinder => {
            if (size.y - p.z.abs()).abs() < (size.x - radial.norm()).abs() {
                V3::new(0.0, 0.0, p.z)
            } else {
                radial
            }
        }
        Shape::Cone => {
            if p.z + size.y < 1e-3 * size.y {
                V3::new(0.0, 0.0, -1.0)
            } else {
                radial.try_normalize(1e-9).unwrap_or_else(V3::zeros) * (2.0 * size.y) + V3::new(0.0, 0.0, size.x)
            }
        }
        Shape::Box => {
            let gap = |i: usize| (size[i] - p[i].abs()).abs();
            let axis = if gap(0) <= gap(1) && gap(0) <= gap(2) {
                0
            } else if gap(1) <= gap(2) {
                1
            } else {
                2
            };
            let mut n = V3::zeros();
            n[axis] = p[axis].signum();
            n
        }
    }
}

fn facet() -> Mesh {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    Mesh { vertices: corners.map(|c| (c, 0.0)).to_vec(), triangles: vec![[0, 1, 2]] }
}

fn cube() -> Mesh {
    let corner = |i: usize, bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let vertices = (0..8).map(|i| ([corner(i, 0), corner(i, 1), corner(i, 2)], 0.0)).collect();
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { vertices, triangles }
}

/// Rings from the tip at +z down to −z, stitched together. Each ring is (radius, z, end).
fn lathe(n: usize, rings: &[(f32, f32, f32)]) -> Mesh {
    let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
    for &(radius, z, end) in rings {
        for k in 0..n {
            let (s, c) = (TAU * k as f32 / n as f32).sin_cos();
            mesh.vertices.push(([radius * c, radius * s, z], end));
        }
    }
    for ring in 0..rings.len() - 1 {
        for k in 0..n {
            let (a, b) = (ring * n + k, ring * n + (k + 1) % n);
            let [a, b, c, d] = [a as u16, b as u16, (b + n) as u16, (a + n) as u16];
            // A ring of radius zero is a point: one of the two triangles is empty.
            if rings[ring].0 > 0.0 {
                mesh.triangles.push([a, c, b]);
            }
            if rings[ring + 1].0 > 0.0 {
                mesh.triangles.push([a, d, c]);
            }
        }
    }
    mesh
}

fn ball(n: usize, split: bool) -> Mesh {
    let rows = n / 2;
    let ring = |k: usize, end: f32| {
        let (s, c) = (PI * k as f32 / rows as f32).sin_cos();
        (if k == 0 || k == rows { 0.0 } else { s }, c, end)
    };
    let mut rings: Vec<_> = (0..=rows / 2).map(|k| ring(k, if split { 1.0 } else { 0.0 })).collect();
    let lower = if split { rows / 2 } else { rows / 2 + 1 };
    rings.extend((lower..=rows).map(|k| ring(k, if split { -1.0 } else { 0.0 })));
    lathe(n, &rings)
}

fn tube(n: usize) -> Mesh {
    lathe(n, &[(0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0), (0.0, -1.0, 0.0)])
}

fn cone(n: usize) -> Mesh {
    lathe(n, &[(0.0, 1.0, 0.0), (1.0, -1.0, 0.0), (0.0, -1.0, 0.0)])
}
