//! Spec to Model: frames, inertia, pairs, plan.

use crate::mjcf::{Document, Problem, Spec};
use crate::model::Model;

/// Compiles a checked scene.
///
/// Errors: every problem that only shows when the scene is put together (missing size, zero mass, a pair of
/// geoms without collider …), each with its place. The second part of the value are warnings.
pub fn compile(document: &Document, spec: &Spec) -> Result<(Model, Vec<Problem>), Vec<Problem>> {
    let _ = (document, spec);
    todo!()
}
