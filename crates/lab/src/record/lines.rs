//! Text on its way to a file or to standard output, whole lines at a time.

use std::fs::File;
use std::io::{Result, Seek, SeekFrom, Write};
use std::time::{Duration, Instant};

use penny::draft::Draft;

/// Lines that are written some at a time. What there is of a run that is interrupted can be read: no line is cut, and a
/// file always ends as it must. A file of that name stays until the first lines are written.
pub struct Lines {
    to: To,
    /// Not written yet.
    waiting: String,
    /// What the text ends with when no more lines come.
    end: &'static str,
    written: Instant,
}

enum To {
    /// One can go back in it: the end is always there, and the next lines replace it. `draft` until it has lines.
    File {
        file: File,
        draft: Option<Draft>,
    },
    Stream(Box<dyn Write>),
}

/// Bytes that may wait, and for how long.
const PATIENCE: (usize, Duration) = (1 << 13, Duration::from_millis(500));

impl Lines {
    /// Into a file that this begins.
    pub fn file(draft: Draft) -> Result<Lines> {
        let file = draft.open()?;
        // Of a device one cannot take back what it has.
        let to =
            if file.metadata()?.is_file() { To::File { file, draft: Some(draft) } } else { To::Stream(Box::new(file)) };
        Ok(Lines { to, waiting: String::new(), end: "", written: Instant::now() })
    }

    pub fn stream(out: impl Write + 'static) -> Lines {
        Lines { to: To::Stream(Box::new(out)), waiting: String::new(), end: "", written: Instant::now() }
    }

    /// Begins with `head`; the text will end with `end`.
    pub(super) fn begin(mut self, head: &str, end: &'static str) -> Result<Lines> {
        self.end = end;
        self.waiting.push_str(head);
        self.flush()?;
        Ok(self)
    }

    /// Adds what is to stay together.
    pub(super) fn push(&mut self, text: &str) -> Result<()> {
        self.waiting.push_str(text);
        let first = matches!(&self.to, To::File { draft: Some(_), .. });
        if self.waiting.len() >= PATIENCE.0 || first { self.flush() } else { self.tick() }?;
        self.keep()
    }

    /// Writes what has waited long enough.
    pub(super) fn tick(&mut self) -> Result<()> {
        if self.waiting.is_empty() || self.written.elapsed() < PATIENCE.1 { Ok(()) } else { self.flush() }
    }

    /// The file has lines: it takes the place of an old one.
    fn keep(&mut self) -> Result<()> {
        match &mut self.to {
            To::File { draft, .. } => draft.take().map_or(Ok(()), Draft::keep),
            To::Stream(_) => Ok(()),
        }
    }

    fn flush(&mut self) -> Result<()> {
        self.written = Instant::now();
        match &mut self.to {
            To::File { file, .. } => {
                // In one piece with the end, so that it is never without.
                self.waiting.push_str(self.end);
                let whole = file.stream_position()?;
                if let Err(error) = file.write_all(self.waiting.as_bytes()) {
                    // No room: what was there stays, and the end has room, because it was there.
                    file.seek(SeekFrom::Start(whole))?;
                    file.write_all(self.end.as_bytes())?;
                    file.set_len(whole + self.end.len() as u64)?;
                    return Err(error);
                }
                file.seek(SeekFrom::Current(-(self.end.len() as i64)))?;
            }
            To::Stream(out) => {
                out.write_all(self.waiting.as_bytes())?;
                out.flush()?;
            }
        }
        self.waiting.clear();
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<()> {
        self.flush()?;
        self.keep()?;
        match self.to {
            To::File { .. } => Ok(()),
            To::Stream(mut out) => {
                out.write_all(self.end.as_bytes())?;
                out.flush()
            }
        }
    }
}
