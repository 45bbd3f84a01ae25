//! A file that takes its place only when it is whole.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Error, ErrorKind, Result, Seek};
use std::path::{Path, PathBuf};

/// A file that is written beside the one it will replace, as `name.unfinished.ending`.
///
/// Until [`Draft::keep`] the old file is untouched, and a draft that is dropped leaves nothing behind. Devices and pipes
/// are written to directly, and so is a file in a folder where no other can be made. As long as a draft or what it
/// [opens](Draft::open) is there, no other process begins one of the same file.
#[derive(Debug)]
pub struct Draft {
    /// Without links: the file itself is replaced, not a link to it.
    target: PathBuf,
    /// Where it is written meanwhile.
    aside: Option<PathBuf>,
    /// What is written, with its lock; none of devices and pipes.
    file: Option<File>,
}

impl Draft {
    /// Begins a draft, empty.
    ///
    /// Errors: the file could not be written.
    pub fn new(path: &Path) -> Result<Draft> {
        let about = fs::metadata(path).ok();
        // By its own name: where a link such as `/dev/stdout` leads may have none.
        if let Some(about) = about.as_ref().filter(|m| !m.is_file()) {
            // A pipe is opened once: who reads it takes a second time for the end.
            if !is_pipe(about) {
                OpenOptions::new().write(true).open(path)?;
            }
            return Ok(Draft { target: path.to_owned(), aside: None, file: None });
        }
        let target = real(path);
        // One that leads to itself is an error here.
        let old = if about.is_some() || target.is_symlink() {
            let old = OpenOptions::new().write(true).open(&target)?;
            lock(&old)?;
            Some(old)
        } else {
            None
        };
        let aside = beside(&target);
        let file = match create(&aside) {
            Ok(file) => file,
            Err(e) if e.kind() == ErrorKind::PermissionDenied && about.is_some() => {
                return Ok(Draft { target, aside: None, file: old });
            }
            Err(e) => return Err(e),
        };
        let draft = Draft { target, aside: Some(aside), file: Some(file) };
        if let Some(about) = about {
            fs::set_permissions(draft.path(), about.permissions())?;
        }
        Ok(draft)
    }

    /// Where to write.
    pub fn path(&self) -> &Path {
        self.aside.as_deref().unwrap_or(&self.target)
    }

    /// Opens it, emptied.
    pub fn open(&self) -> Result<File> {
        match &self.file {
            // With the lock.
            Some(file) => {
                file.set_len(0)?;
                (&mut &*file).rewind()?;
                file.try_clone()
            }
            None => OpenOptions::new().write(true).truncate(true).open(self.path()),
        }
    }

    /// It is whole: it replaces the old file in one go.
    pub fn keep(mut self) -> Result<()> {
        match self.aside.take() {
            None => Ok(()),
            Some(aside) => fs::rename(&aside, &self.target).inspect_err(|_| {
                let _ = fs::remove_file(&aside);
            }),
        }
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(aside) = &self.aside {
            let _ = fs::remove_file(aside);
        }
    }
}

#[cfg(unix)]
fn is_pipe(about: &fs::Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_fifo(&about.file_type())
}

#[cfg(not(unix))]
fn is_pipe(_: &fs::Metadata) -> bool {
    false
}

/// Replaces a file in one go: an interruption leaves the old one or the new one.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    let draft = Draft::new(path)?;
    std::io::Write::write_all(&mut draft.open()?, bytes.as_ref())?;
    draft.keep()
}

/// The path without links and detours, also of a file that does not exist yet.
pub fn real(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    // As many links as Linux follows.
    for _ in 0..40 {
        let Ok(linked) = fs::read_link(&path) else { break };
        path = folder(&path).join(linked);
    }
    let in_folder = || Some(folder(&path).canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(in_folder).unwrap_or(path)
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// What an earlier interruption left is replaced, and never followed if it is a link; what another process writes is not.
fn create(path: &Path) -> Result<File> {
    if path.symlink_metadata().is_ok_and(|m| m.is_file())
        && let Ok(left) = File::open(path)
    {
        lock(&left)?;
    }
    let _ = fs::remove_file(path);
    let file = OpenOptions::new().write(true).create_new(true).open(path)?;
    lock(&file)?;
    Ok(file)
}

/// Keeps other processes that ask for it, too, from a file or folder, as long as it is open.
///
/// Errors: another one has it.
pub fn lock(file: &File) -> Result<()> {
    // On Windows nobody could read it meanwhile.
    match if cfg!(unix) { file.try_lock() } else { Ok(()) } {
        Err(TryLockError::WouldBlock) => Err(Error::new(ErrorKind::ResourceBusy, "another process is writing it")),
        // Some file systems have no locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(".unfinished");
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

/// What the system says of a failure, for people: without the number of the error.
pub fn reason(error: impl std::fmt::Display) -> String {
    let text = error.to_string();
    match text.split_once(" (os error") {
        Some((reason, _)) => reason.to_owned(),
        None => text,
    }
}
