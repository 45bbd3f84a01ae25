//! The text of one file, and where in it a byte is.

use std::path::PathBuf;
use std::sync::Arc;

/// A file of a scene, as it was read.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// The path as the user wrote it, for messages (of an included file: that of the file's folder and its own).
    pub name: String,
    /// The same, to open it.
    pub path: PathBuf,
    /// Its text, which the values of its attributes are parts of.
    pub text: Arc<String>,
}

impl Source {
    /// Line and column of a byte, both from 1; columns count characters. Computed only when something is printed.
    pub fn line_column(&self, byte: usize) -> (usize, usize) {
        let before = &self.text[..self.floor(byte)];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    /// The nearest character boundary at or before a byte, inside the text.
    pub(super) fn floor(&self, byte: usize) -> usize {
        let mut byte = byte.min(self.text.len());
        while !self.text.is_char_boundary(byte) {
            byte -= 1;
        }
        byte
    }
}
