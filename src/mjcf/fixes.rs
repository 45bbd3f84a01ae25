//! The changes that problems propose, made in the text.

use super::document::{Document, Span};
use super::error::{Edit, Problem};

/// A file as its fixes make it.
#[derive(Clone, Debug)]
pub struct Fixed {
    /// Index among the document's files.
    pub file: usize,
    /// The changes, in the order of their places; none touches another.
    pub edits: Vec<Edit>,
    /// The text with them.
    pub text: String,
}

/// Makes all changes that problems propose; of two that touch, the first. Gives the files that change.
pub fn fixed(document: &Document, problems: &[Problem]) -> Vec<Fixed> {
    let mut problems: Vec<&Problem> = problems.iter().filter(|problem| !problem.fix.is_empty()).collect();
    problems.sort_by_key(|problem| problem.span);
    let mut edits: Vec<Edit> = Vec::new();
    for problem in problems {
        let own: Vec<Edit> = problem.fix.iter().map(|edit| with_blanks(document, edit)).collect();
        let is_free = |edit: &Edit| !edits.iter().any(|other| touch(other.span, edit.span));
        if own.iter().all(is_free) {
            edits.extend(own);
        }
    }
    edits.sort_by_key(|edit| edit.span);
    let of_file = |(file, edits): (usize, Vec<Edit>)| {
        let text = applied(&document.files[file].text, 0, document.files[file].text.len(), &edits);
        Fixed { file, edits, text }
    };
    let files = (0..document.files.len()).map(|file| {
        let own = edits.iter().filter(|edit| edit.span.file as usize == file).cloned();
        (file, own.collect::<Vec<Edit>>())
    });
    files.filter(|(_, edits)| !edits.is_empty()).map(of_file).collect()
}

impl Fixed {
    /// The difference as `diff -u` and `patch` have it.
    pub fn diff(&self, document: &Document) -> String {
        const CONTEXT: usize = 3;
        let source = &document.files[self.file];
        let starts: Vec<usize> = std::iter::once(0)
            .chain(source.text.match_indices('\n').map(|(i, _)| i + 1).filter(|&i| i < source.text.len()))
            .collect();
        let line = |byte: u32| starts.partition_point(|&start| start <= byte as usize) - 1;
        let start = |line: usize| starts.get(line).copied().unwrap_or(source.text.len());
        // Changed lines of the old text, first and one past the last, with their edits.
        let mut blocks: Vec<(usize, usize, Vec<Edit>)> = Vec::new();
        for edit in &self.edits {
            let (first, end) = (line(edit.span.start), line(edit.span.end.max(edit.span.start + 1) - 1) + 1);
            match blocks.last_mut().filter(|block| block.1 >= first) {
                Some(block) => {
                    block.1 = block.1.max(end);
                    block.2.push(edit.clone());
                }
                None => blocks.push((first, end, vec![edit.clone()])),
            }
        }
        let name = source.name.as_str();
        let mut out = format!("--- {name}\n+++ {name}\n");
        let mut shift = 0;
        for hunk in blocks.chunk_by(|a, b| b.0 - a.1 <= 2 * CONTEXT) {
            let (from, to) = (hunk[0].0.saturating_sub(CONTEXT), (hunk[hunk.len() - 1].1 + CONTEXT).min(starts.len()));
            let (mut body, mut new, mut at) = (String::new(), 0, from);
            let lines = |sign: char, text: &str, body: &mut String| {
                text.lines().for_each(|line| body.extend([sign.to_string().as_str(), line, "\n"]));
                text.lines().count()
            };
            for (first, end, edits) in hunk {
                new += lines(' ', &source.text[start(at)..start(*first)], &mut body);
                lines('-', &source.text[start(*first)..start(*end)], &mut body);
                new += lines('+', &applied(&source.text, start(*first), start(*end), edits), &mut body);
                at = *end;
            }
            new += lines(' ', &source.text[start(at)..start(to)], &mut body);
            let begin = (from + 1).checked_add_signed(shift).unwrap_or_default();
            out += &format!("@@ -{},{} +{begin},{new} @@\n{body}", from + 1, to - from);
            shift += new as isize - (to - from) as isize;
        }
        out
    }
}

/// What is taken out goes with the blanks before it.
fn with_blanks(document: &Document, edit: &Edit) -> Edit {
    if !edit.text.is_empty() {
        return edit.clone();
    }
    let before = &document.files[edit.span.file as usize].text[..edit.span.start as usize];
    let span = Span { start: before.trim_end().len() as u32, ..edit.span };
    Edit { span, text: String::new() }
}

fn touch(a: Span, b: Span) -> bool {
    a.file == b.file && a.start < b.end && b.start < a.end
}

/// Part of a text with its edits.
fn applied(text: &str, from: usize, to: usize, edits: &[Edit]) -> String {
    let (mut out, mut at) = (String::new(), from);
    for Edit { span, text: new } in edits {
        out.push_str(&text[at..span.start as usize]);
        out.push_str(new);
        at = span.end as usize;
    }
    out + &text[at..to]
}
