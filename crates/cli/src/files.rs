//! Files that commands write: which may be, and what is said of those that cannot.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::Failure;
use penny::draft::{self, Draft, real};
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;
use penny_lab::record::write_state as write_state_text;

/// Checks that files to write (with the options that name them) are apart from one another and from those to read.
///
/// Errors: wrong usage, if one would overwrite another.
pub fn apart(read: &[PathBuf], written: &[(&str, Option<&Path>)]) -> Result<(), Failure> {
    let written: Vec<(&str, &Path)> = written.iter().filter_map(|(option, path)| Some((*option, (*path)?))).collect();
    for (i, (option, path)) in written.iter().enumerate() {
        let name = shown(path);
        if read.iter().any(|scene| same(scene, path)) {
            let why = format!("error: {option} would overwrite {name}, which is read: name another file");
            return Err(Failure::Usage(why));
        }
        if let Some((other, _)) = written[..i].iter().find(|(_, other)| same(other, path)) {
            let why = format!("error: {other} and {option} both write to {name}: name two files");
            return Err(Failure::Usage(why));
        }
    }
    Ok(())
}

/// Whether two paths are one file, by whatever names (or both standard output). Devices as /dev/null are shared by all.
fn same(a: &Path, b: &Path) -> bool {
    let (a, b) = (real(a), real(b));
    (a == b && a.metadata().map_or(true, |m| m.is_file())) || linked(&a, &b)
}

/// Whether two names are hard links to one file.
#[cfg(unix)]
fn linked(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let file = |path: &Path| path.metadata().ok().filter(|m| m.is_file()).map(|m| (m.dev(), m.ino()));
    file(a).is_some_and(|a| Some(a) == file(b))
}

#[cfg(not(unix))]
fn linked(_: &Path, _: &Path) -> bool {
    false
}

/// Whether a file lies in the folder of another, or in a folder within.
pub fn inside(file: &Path, other: &Path) -> bool {
    // Of what does not exist, the nearest folder that does, and no detours after it.
    let plain = file.components().all(|part| part != std::path::Component::ParentDir);
    let file = if file.exists() || plain { real(file) } else { return false };
    real(other).parent().is_some_and(|folder| file.starts_with(folder))
}

/// Checks before a long run that a file can be written after it; leaves nothing behind.
///
/// Errors: [`cannot_write`].
pub fn writable(path: &Path) -> Result<(), Failure> {
    if path == Path::new("-") {
        return Ok(());
    }
    Draft::new(path).map(drop).map_err(|e| cannot_write(path, &e))
}

/// Writes a whole file, or to standard output where the path is `-`.
///
/// Errors: [`cannot_write`].
pub fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let written = if path == Path::new("-") {
        io::Write::write_all(&mut io::stdout(), text.as_bytes())
    } else {
        draft::write(path, text)
    };
    written.map_err(|e| cannot_write(path, &e))
}

/// Writes a state for `--load-state`.
///
/// Errors: [`cannot_write`]; numbers that are not finite.
pub fn write_state(path: &Path, model: &Model, method: &Method, state: &State) -> Result<(), Failure> {
    let text = write_state_text(model, method, state).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    write(path, &text)
}

/// A file, or standard output where the path is `-`, could not be written.
pub fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    match error.kind() {
        ErrorKind::BrokenPipe => Failure::Closed,
        _ => Failure::Problem(format!("error: cannot write {}: {}", shown(path), penny::reason(error))),
    }
}

fn shown(path: &Path) -> String {
    if path == Path::new("-") { "standard output".to_owned() } else { format!("`{}`", path.display()) }
}
