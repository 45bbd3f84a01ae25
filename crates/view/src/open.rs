//! From a file to a session.

use std::path::{Path, PathBuf};

use super::fnv::Fnv;
use super::session::{Session, Source};
use penny::Scene;
use penny::forward::Method;
use penny::mjcf::{Limits, render};
use penny::model::Model;
use penny::state::State;
use penny::{contact, integrate};

/// A scene and the files it was read from.
pub struct Opened {
    pub model: Model,
    /// Hash of `text`.
    pub hash: String,
    pub files: Vec<PathBuf>,
    /// The scene as one file, what it includes in its place.
    pub text: String,
    /// What the reader warns of, as `penny check` prints it, and what pictures lack; empty if there is nothing.
    pub warnings: String,
}

/// Reads and compiles a scene.
///
/// Errors: the same report as `penny check`.
pub fn open(path: &Path) -> Result<Opened, String> {
    open_within(path, &Limits::default())
}

/// The same within limits of one's own.
pub fn open_within(path: &Path, limits: &Limits) -> Result<Opened, String> {
    let scene = penny::load_within(path, limits).map_err(|failure| failure.to_string())?;
    Ok(opened(scene))
}

/// The scene that a text is. It may include no files: who wrote it is not trusted to name any.
///
/// Errors: the same report as `penny check`.
pub fn open_text(name: &str, text: &str) -> Result<Opened, String> {
    let limits = Limits { includes: 0, ..Limits::default() };
    penny::parse_within(name, text, &limits).map(opened).map_err(|failure| failure.to_string())
}

fn opened(scene: Scene) -> Opened {
    let sources = &scene.document.files;
    let files = sources.iter().map(|source| source.path.clone()).collect();
    let mut warnings =
        if scene.warnings.is_empty() { String::new() } else { render(&scene.document, &scene.warnings, false) };
    super::scene::unseen(&scene.model).iter().for_each(|line| warnings += &format!("warning: {line}\n"));
    let text = scene.document.joined();
    Opened { warnings, model: scene.model, hash: Fnv::of(text.bytes()).to_string(), files, text }
}

/// How a scene asks to be computed.
///
/// Errors: one sentence if it asks for what Penny does not have.
pub fn method(model: &Model) -> Result<Method, String> {
    let law = model.contact_law().unwrap_or(contact::default().name);
    let integrator = &model.opt.integrator;
    Ok(Method {
        contact: contact::by_name(law).ok_or_else(|| format!("there is no contact law `{law}`"))?,
        integrator: integrate::by_name(integrator).ok_or_else(|| format!("there is no integrator `{integrator}`"))?,
        timestep: model.opt.timestep,
        rounds: penny::forward::ROUNDS,
    })
}

/// A session of a scene as its file has it.
///
/// Errors: as [`method`].
pub fn session(opened: Opened, path: &Path, seed: u64) -> Result<Session, String> {
    let Opened { model, hash, text, .. } = opened;
    let (method, state) = (method(&model)?, State::new(&model));
    let source = Source { path: path.display().to_string(), hash, seed, text: Some(text) };
    Ok(Session::new(model, method, state, source))
}
