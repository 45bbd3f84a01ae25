//! Text from files on its way to a terminal or a picture.

use std::borrow::Cow;

/// Whether a character does something instead of being seen: control characters but the end of a line and the
/// tabulator, and marks that turn the direction of writing (Unicode 16, Bidi_Control).
pub fn is_command(c: char) -> bool {
    let turns = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}') || (c.is_control() && c != '\n' && c != '\t')
}

/// The text with such characters written out: `\u{1b}` is the escape that begins a command to a terminal.
pub fn printable(text: &str) -> Cow<'_, str> {
    if text.bytes().all(|b| matches!(b, b' '..=b'~' | b'\n' | b'\t')) || !text.contains(is_command) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_command(c) { out.extend(c.escape_unicode()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

/// The same, in one line: whatever ends a line is a blank, as XML has it in the values of attributes.
pub fn one_line(text: &str) -> Cow<'_, str> {
    let breaks = |c: char| matches!(c, '\n' | '\r' | '\t');
    if !text.contains(breaks) {
        return printable(text);
    }
    Cow::Owned(printable(&text.replace(breaks, " ")).into_owned())
}
