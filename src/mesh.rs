//! Meshes that are only seen: files of triangles (OBJ, STL), read when somebody looks.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use crate::math::{Quat, Vec3};

/// Larger files are not read, bytes.
const MOST: u64 = 256 << 20;

/// A mesh of a file, m.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Its file.
    pub path: PathBuf,
    /// What its numbers are multiplied by, axis by axis.
    pub scale: Vec3,
    /// Where in the file's frame its own frame is.
    pub refpos: Vec3,
    /// The orientation of that.
    pub refquat: Quat,
    /// Read once, whoever asks; copies of the mesh share it.
    faces: Arc<OnceLock<Result<Vec<Face>, String>>>,
}

/// Corners of a triangle, counter-clockwise seen from outside, m.
pub type Face = [[f32; 3]; 3];

impl Mesh {
    /// A mesh that is yet to be read.
    pub fn new(path: PathBuf, scale: Vec3, refpos: Vec3, refquat: Quat) -> Mesh {
        Mesh { path, scale, refpos, refquat, faces: Arc::default() }
    }

    /// Whether its file has a form that is read.
    pub fn is_known(path: &Path) -> bool {
        form(path).is_some()
    }

    /// Its triangles in its own frame.
    ///
    ///     p = R(refquat)⁻¹ (scale ⊙ p_file − refpos)
    ///
    /// Errors: why they cannot be read.
    pub fn faces(&self) -> Result<&[Face], &str> {
        let read = || {
            let mut faces = read(&self.path)?;
            let (inverse, mirrored) = (self.refquat.inverse(), self.scale.product() < 0.0);
            for face in &mut faces {
                for corner in &mut *face {
                    let p = Vec3::from(corner.map(f64::from)).component_mul(&self.scale);
                    *corner = (inverse * (p - self.refpos)).map(|x| x as f32).into();
                }
                if mirrored {
                    face.swap(1, 2);
                }
            }
            Ok(faces)
        };
        self.faces.get_or_init(read).as_deref().map_err(String::as_str)
    }

    /// Centre and half-widths of the box along its axes that holds it, m. `None`: it cannot be read, or is empty.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let corners = || self.faces().into_iter().flatten().flatten();
        let bound = |from: f32, pick: fn(f32, f32) -> f32| {
            let all = corners().fold([from; 3], |most, p| std::array::from_fn(|i| pick(most[i], p[i])));
            Vec3::from(all.map(f64::from))
        };
        let (low, high) = (bound(f32::INFINITY, f32::min), bound(f32::NEG_INFINITY, f32::max));
        let half = 0.5 * (high - low);
        half.iter().all(|x| x.is_finite()).then(|| (0.5 * (low + high), half))
    }
}

type Form = fn(&[u8]) -> Option<Vec<Face>>;

fn form(path: &Path) -> Option<Form> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "stl" => Some(stl),
        "obj" => Some(obj),
        _ => None,
    }
}

fn read(path: &Path) -> Result<Vec<Face>, String> {
    let form = form(path).ok_or("it is neither OBJ nor STL")?;
    let about = std::fs::metadata(path).map_err(crate::draft::reason)?;
    if !about.is_file() || about.len() > MOST {
        return Err(format!("it is no file of at most {} MiB", MOST >> 20));
    }
    let bytes = std::fs::read(path).map_err(crate::draft::reason)?;
    let faces = form(&bytes).ok_or("its triangles cannot be read")?;
    let finite = faces.as_flattened().iter().flatten().all(|x| x.is_finite());
    if finite { Ok(faces) } else { Err("it has numbers that are not finite".into()) }
}

/// Binary STL: 80 bytes, the number of triangles, and of each its normal, three corners and two bytes.
fn stl(bytes: &[u8]) -> Option<Vec<Face>> {
    let (count, rest) = bytes.get(80..)?.split_first_chunk::<4>()?;
    let (records, _) = rest.as_chunks::<50>();
    let records = records.get(..u32::from_le_bytes(*count) as usize)?;
    let number = |record: &[u8; 50], i: usize| {
        let at = 12 + 4 * i;
        f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
    };
    let corner = |record: &[u8; 50], i: usize| std::array::from_fn(|k| number(record, 3 * i + k));
    Some(records.iter().map(|record| std::array::from_fn(|i| corner(record, i))).collect())
}

/// Wavefront OBJ: `v x y z`, and `f` with the numbers of corners from 1, or backwards from −1; polygons become fans.
fn obj(bytes: &[u8]) -> Option<Vec<Face>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let (mut corners, mut faces): (Vec<[f32; 3]>, Vec<Face>) = Default::default();
    let mut polygon: Vec<[f32; 3]> = Vec::new();
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let mut number = || words.next()?.parse().ok();
                corners.push([number()?, number()?, number()?]);
            }
            Some("f") => {
                polygon.clear();
                for word in words {
                    let index: i64 = word.split('/').next()?.parse().ok()?;
                    let index = if index < 0 { index + corners.len() as i64 } else { index - 1 };
                    polygon.push(*corners.get(usize::try_from(index).ok()?)?);
                }
                faces.extend((2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]]));
            }
            _ => {}
        }
    }
    Some(faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_give_the_same_triangles() {
        let text = "# a square\nv 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0.5\nf 1/1 2//3 3 -1\n";
        let faces = obj(text.as_bytes()).unwrap();
        assert_eq!(faces[1], [[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.5]]);
        let mut bytes = vec![0; 80];
        bytes.extend((faces.len() as u32).to_le_bytes());
        for face in &faces {
            bytes.extend([0; 12]);
            bytes.extend(face.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        assert_eq!(stl(&bytes).unwrap(), faces);
        assert_eq!((stl(&bytes[..90]), obj(b"f 1 2 3\n"), obj(b"v 1 x 2\n")), (None, None, None));
    }

    #[test]
    fn a_mesh_is_scaled_and_placed() {
        let path = std::env::temp_dir().join(format!("penny-mesh-{}.obj", std::process::id()));
        std::fs::write(&path, "v 1 0 0\nv 3 0 0\nv 1 4 0\nf 1 2 3\n").unwrap();
        let quarter = Quat::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
        let mesh = Mesh::new(path.clone(), Vec3::new(-1.0, 1.0, 1.0), Vec3::new(-2.0, 0.0, 0.0), quarter);
        // (1, −1, −1, ±…): mirrored, from −2, turned back by a quarter.
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        let face = mesh.faces().unwrap()[0];
        assert!(near(face[0], [0.0, -1.0, 0.0]) && near(face[1], [4.0, -1.0, 0.0]), "{face:?}");
        let (centre, half) = mesh.bounds().unwrap();
        assert!((centre - Vec3::new(2.0, 0.0, 0.0)).norm() < 1e-6 && (half - Vec3::new(2.0, 1.0, 0.0)).norm() < 1e-6);
        std::fs::remove_file(path).unwrap();
        let missing = Mesh::new("no/such.stl".into(), Vec3::repeat(1.0), Vec3::zeros(), Quat::identity());
        assert!(missing.faces().is_err() && missing.bounds().is_none());
    }
}
