//! From a file to a session.

use std::path::{Path, PathBuf};

use super::log;
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
    /// Hash of all its files' texts.
    pub hash: String,
    pub files: Vec<PathBuf>,
    /// The text of its only file.
    pub text: Option<String>,
    /// What the reader warns of, as `penny check` prints it; empty if there is nothing.
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

/// The scene that a text is, which includes no other files.
///
/// Errors: the same report as `penny check`.
pub fn open_text(name: &str, text: &str) -> Result<Opened, String> {
    penny::parse(name, text).map(opened).map_err(|failure| failure.to_string())
}

fn opened(scene: Scene) -> Opened {
    let sources = &scene.document.files;
    let text: Vec<u8> = sources.iter().flat_map(|s| s.text.bytes()).collect();
    let files = sources.iter().map(|source| source.path.clone()).collect();
    let warnings =
        if scene.warnings.is_empty() { String::new() } else { render(&scene.document, &scene.warnings, false) };
    let only = match &sources[..] {
        [one] => Some(one.text.clone()),
        _ => None,
    };
    Opened { warnings, model: scene.model, hash: log::hash(&text), files, text: only }
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
pub fn session(model: Model, path: &Path, hash: String, seed: u64) -> Result<Session, String> {
    let (method, state) = (method(&model)?, State::new(&model));
    let source = Source { path: path.display().to_string(), hash, seed, text: None };
    Ok(Session::new(model, method, state, source))
}
