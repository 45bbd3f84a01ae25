//! Text on its way to a file or to standard output, whole lines at a time.

use std::fs::File;
use std::io::{Result, Seek, SeekFrom, Write};

/// Lines that are written some at a time. What there is of a run that is interrupted can be read: no line is cut, and a
/// file always ends as it must.
pub struct Lines {
    to: To,
    /// Not written yet.
    waiting: String,
    /// What the text ends with when no more lines come.
    end: &'static str,
}

enum To {
    /// One can go back in it: the end is always there, and the next lines replace it.
    File(File),
    Stream(Box<dyn Write>),
}

/// Bytes that may wait.
const PATIENCE: usize = 1 << 13;

impl Lines {
    pub fn file(mut file: File) -> Lines {
        let seeks = file.stream_position().is_ok();
        let to = if seeks { To::File(file) } else { To::Stream(Box::new(file)) };
        Lines { to, waiting: String::new(), end: "" }
    }

    pub fn stream(out: impl Write + 'static) -> Lines {
        Lines { to: To::Stream(Box::new(out)), waiting: String::new(), end: "" }
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
        if self.waiting.len() < PATIENCE { Ok(()) } else { self.flush() }
    }

    fn flush(&mut self) -> Result<()> {
        match &mut self.to {
            To::File(file) => {
                // In one piece with the end, so that it is never without.
                self.waiting.push_str(self.end);
                file.write_all(self.waiting.as_bytes())?;
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
        match self.to {
            To::File(_) => Ok(()),
            To::Stream(mut out) => {
                out.write_all(self.end.as_bytes())?;
                out.flush()
            }
        }
    }
}
