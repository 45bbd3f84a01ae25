//! MJCF text to a checked, typed scene: the only part of Penny that knows XML.
//!
//! ```text
//! file ─ parse → Document (spans) ─ check against the schema → read, defaults merged → Spec
//! ```
//!
//! Every stage collects its problems instead of stopping at the first.

mod bodies;
mod check;
mod defaults;
pub mod document;
pub mod error;
mod files;
mod fixes;
mod item;
mod limits;
pub(crate) mod lints;
mod nearest;
mod parse;
mod printable;
mod read;
mod removed;
mod render;
mod replicate;
pub mod schema;
mod shortcuts;
pub mod source;
// Fields have the names and units of the attributes that they come from: see `table`.
#[allow(missing_docs)]
pub mod spec;
mod suggestions;
mod table;
mod ties;

use std::path::Path;

pub(crate) use bodies::instead_of;
pub(crate) use defaults::{Classes, MAIN, ORIENTATIONS, Value};
pub use document::{Document, NodeId, Span};
pub use error::{Edit, Problem, ProblemKind, Severity};
pub(crate) use files::files_of;
pub use fixes::{Fixed, fixed};
pub use limits::Limits;
pub use nearest::nearest;
pub(crate) use printable::is_command;
pub use printable::{one_line, printable};
pub use read::PENNY_TRUTHS;
pub(crate) use read::compiler;
pub use render::render;
pub(crate) use shortcuts::{is_actuator, replaced};
pub use spec::Spec;

/// A scene that can be compiled.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The text, its elements and their places.
    pub document: Document,
    /// What it says.
    pub spec: Spec,
    /// What is valid, but probably not meant.
    pub warnings: Vec<Problem>,
}

/// A file that is no scene: at least one of the problems is an error.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The text, its elements and their places.
    pub document: Document,
    /// All that is wrong with it, and its warnings.
    pub problems: Vec<Problem>,
}

/// All problems as plain text.
impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&render(&self.document, &self.problems, false))
    }
}

impl std::error::Error for Failure {}

/// Reads a file and what it includes.
///
/// Errors: everything that is wrong with it, each problem with its place.
pub fn load(path: &Path) -> Result<Loaded, Failure> {
    load_within(path, &Limits::default())
}

/// The same within limits of one's own.
pub fn load_within(path: &Path, limits: &Limits) -> Result<Loaded, Failure> {
    finish(parse::load(path, limits), limits)
}

/// Reads text as if it were the file `name`; included files are looked for beside it.
pub fn parse(name: &str, text: &str) -> Result<Loaded, Failure> {
    parse_within(name, text, &Limits::default())
}

/// The same within limits of one's own.
pub fn parse_within(name: &str, text: &str, limits: &Limits) -> Result<Loaded, Failure> {
    finish(parse::parse(name, text, limits), limits)
}

fn finish((mut document, mut problems): (Document, Vec<Problem>), limits: &Limits) -> Result<Loaded, Failure> {
    let failed = |problems: &[Problem]| problems.iter().any(|p| p.severity() == Severity::Error);
    let whole = !failed(&problems);
    check::forget_empty(&mut document);
    if whole {
        let compiler = read::compiler(&document);
        replicate::expand(&mut document, &compiler, limits, &mut problems);
    }
    let (found, names) = check::check(&document, whole, limits);
    problems.extend(found);
    let spec = document.root().filter(|_| whole).map(|root| read::read(&document, root, names, &mut problems));
    once_each(&mut problems);
    match spec {
        Some(spec) if !failed(&problems) => Ok(Loaded { document, spec, warnings: problems }),
        _ => Err(Failure { document, problems }),
    }
}

/// What every replica of an element has wrong is said once.
fn once_each(problems: &mut Vec<Problem>) {
    let mut order: Vec<usize> = (0..problems.len()).collect();
    order.sort_by_key(|&i| problems[i].span);
    let mut again = vec![false; problems.len()];
    // What two say is compared only where they have one place.
    for place in order.chunk_by(|&a, &b| problems[a].span == problems[b].span).filter(|place| place.len() > 1) {
        let mut said = std::collections::HashSet::new();
        place.iter().for_each(|&i| again[i] = !said.insert(problems[i].kind.to_string()));
    }
    let mut again = again.into_iter();
    problems.retain(|_| again.next() == Some(false));
}
