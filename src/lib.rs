//! Penny: a pocket-sized rigid-body simulator that reads MuJoCo's MJCF files.
//!
//!     MJCF text ─ mjcf → Document (spans) → Spec (typed, defaults merged) ─ compile → Model (SI)
//!     step(&Model, &Method, &mut State, &mut Data):  detect → smooth dynamics → contact law → integrate
//!
//! Begin with [`Simulation`]: a scene that is stepped, read and changed by name. [`load`] and [`forward::step`] are what it is
//! made of, [`Batch`] runs many. Units are SI, angles in rad, quaternions (w, x, y, z).

#![deny(missing_docs)]

pub mod batch;
pub mod collision;
pub mod compile;
pub mod contact;
pub mod control;
pub mod data;
pub mod diverged;
pub mod draft;
pub mod dynamics;
pub mod forward;
pub mod integrate;
pub mod kind;
pub mod math;
pub mod mesh;
pub mod method;
pub mod mjcf;
pub mod model;
mod prepare;
pub mod quantities;
pub mod sensors;
pub mod simulation;
pub mod snapshot;
pub mod state;

use std::path::Path;

use mjcf::{Document, Loaded, Problem};

pub use batch::Batch;
pub use draft::reason;
pub use mjcf::Failure;
pub use simulation::Simulation;

/// A file, ready to be simulated.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The text with its elements and their places.
    pub document: Document,
    /// What it describes.
    pub model: model::Model,
    /// What is valid, but probably not meant.
    pub warnings: Vec<Problem>,
}

/// Reads and compiles a file.
///
/// Errors: everything that is wrong with it, each problem with its place; `Display` prints them.
pub fn load(path: &Path) -> Result<Scene, Failure> {
    load_within(path, &mjcf::Limits::default())
}

/// Reads and compiles a file within limits of one's own.
pub fn load_within(path: &Path, limits: &mjcf::Limits) -> Result<Scene, Failure> {
    compiled(mjcf::load_within(path, limits)?, limits)
}

/// Reads and compiles text as if it were the file `name`.
pub fn parse(name: &str, text: &str) -> Result<Scene, Failure> {
    parse_within(name, text, &mjcf::Limits::default())
}

/// The same within limits of one's own.
pub fn parse_within(name: &str, text: &str, limits: &mjcf::Limits) -> Result<Scene, Failure> {
    compiled(mjcf::parse_within(name, text, limits)?, limits)
}

fn compiled(Loaded { document, spec, mut warnings }: Loaded, limits: &mjcf::Limits) -> Result<Scene, Failure> {
    match compile::compile(&document, &spec) {
        Ok((mut model, more)) => {
            model.parts_mut().pairs.most_contacts = limits.contacts;
            warnings.extend(more);
            Ok(Scene { document, model, warnings })
        }
        Err(problems) => {
            warnings.extend(problems);
            Err(Failure { document, problems: warnings })
        }
    }
}
