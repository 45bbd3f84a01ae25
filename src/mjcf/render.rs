//! Problems as text, with the lines they are about.

use std::collections::hash_map::RandomState;
use std::collections::{BTreeMap, HashMap};
use std::hash::{BuildHasher, Hash, Hasher};

use annotate_snippets::{Annotation, AnnotationKind, Level, Renderer, Snippet};

use super::document::{Document, Span};
use super::error::{Problem, ProblemKind, Severity};
use super::printable::{is_command, one_line};

/// Problems that are shown in full. Who has more has one cause for most of them.
const SHOWN: usize = 50;
/// Of problems alike, this many are shown one by one; of more, the first, and the lines of the others.
const ALIKE: usize = 5;
/// Lines that are named of problems alike.
const LINES: usize = 10;
/// A help text this long stands below the snippet, a shorter one beside the carets.
const LABEL_WIDTH: usize = 70;
/// Bytes of a line that are shown on either side of a mark; more are cut.
const MARGIN: usize = 120;
/// Bytes of a sentence, a help text or a label.
const SENTENCE: usize = 600;
/// A mark that runs over more lines ends with its first.
const MARKED_LINES: usize = 8;
/// Marks further apart, in lines, stand in snippets of their own.
const APART: usize = 100;

/// The problems in the order of their places, errors and warnings as they come: 50 in full, errors first where there
/// are more, and how many are left out. Problems alike are shown once.
pub fn render(document: &Document, problems: &[Problem], colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    let mut page = Page { document, renderer, lines: BTreeMap::new() };
    let mut groups = alike(problems);
    let hidden = groups.len().saturating_sub(SHOWN);
    if hidden > 0 {
        // Those of one severity stay in their order.
        groups.sort_by_key(|group| group.first.severity() != Severity::Error);
    }
    let rest = groups.split_off(groups.len() - hidden);
    let rest: Vec<&Problem> = rest.into_iter().flat_map(Group::all).collect();
    groups.sort_by_key(|group| group.place());
    let mut out = String::new();
    for group in &groups {
        if !out.is_empty() {
            out.push('\n');
        }
        out.push_str(page.report(group.first).trim_end());
        out.push('\n');
        if !group.others.is_empty() {
            out.push_str(&page.others(&group.others));
        }
    }
    if !rest.is_empty() {
        let errors = rest.iter().filter(|p| p.severity() == Severity::Error).count();
        let counts = [(errors, "error"), (rest.len() - errors, "warning")];
        let counts = counts.into_iter().filter(|(n, _)| *n > 0);
        let counts: Vec<String> = counts.map(|(n, what)| format!("{n} more {what}{}", plural(n))).collect();
        out.push_str(&format!("\n… and {}, which are not shown\n", counts.join(" and ")));
    }
    out
}

fn plural(n: usize) -> &'static str {
    if n == 1 { "" } else { "s" }
}

/// Problems that say the same, in the order of their places.
struct Group<'p> {
    first: &'p Problem,
    others: Vec<&'p Problem>,
}

impl<'p> Group<'p> {
    fn one(first: &'p Problem) -> Group<'p> {
        Group { first, others: Vec::new() }
    }

    fn all(self) -> impl Iterator<Item = &'p Problem> {
        std::iter::once(self.first).chain(self.others)
    }

    /// Problems of one place stand as they come.
    fn place(&self) -> (Span, *const Problem) {
        (self.first.span, std::ptr::from_ref(self.first))
    }
}

/// The problems in the order of their places, those alike in groups; small groups fall apart.
fn alike(problems: &[Problem]) -> Vec<Group<'_>> {
    let mut sorted: Vec<&Problem> = problems.iter().collect();
    sorted.sort_by_key(|problem| problem.span);
    let mut groups: Vec<Group> = Vec::new();
    // A hash stands for what a group has in common: text for each of thousands would only be thrown away.
    let mut known: HashMap<u64, usize> = HashMap::with_capacity(sorted.len());
    let random = RandomState::new();
    for problem in sorted {
        let mut common = Common(random.build_hasher());
        (problem.span.file, problem.kind.code()).hash(&mut common.0);
        // A hasher takes any text.
        let _ = subject(&problem.kind, &mut common);
        let group = *known.entry(common.0.finish()).or_insert(groups.len());
        match groups.get_mut(group) {
            Some(group) => group.others.push(problem),
            None => groups.push(Group::one(problem)),
        }
    }
    let small = |group: &Group| (1..ALIKE).contains(&group.others.len());
    if groups.iter().any(small) {
        for mut group in std::mem::take(&mut groups) {
            let others = if small(&group) { std::mem::take(&mut group.others) } else { Vec::new() };
            groups.push(group);
            groups.extend(others.into_iter().map(Group::one));
        }
        groups.sort_by_key(Group::place);
    }
    groups
}

/// Takes what problems have in common, as text.
struct Common<H>(H);

impl<H: Hasher> std::fmt::Write for Common<H> {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

/// What problems alike have in common, beside their kind: the sentence; of doubtful numbers the attribute, of names
/// that are taken or unknown what they are names of.
fn subject(kind: &ProblemKind, out: &mut impl std::fmt::Write) -> std::fmt::Result {
    use ProblemKind::*;
    match kind {
        Clamped { attribute, .. }
        | Raised { attribute, .. }
        | ColourCut { attribute, .. }
        | SolrefSwapped { attribute, .. }
        | MixedSolref { attribute, .. } => out.write_str(attribute),
        DuplicateName { what, .. } => out.write_str(what),
        _ => write!(out, "{kind}"),
    }
}

struct Page<'a> {
    document: &'a Document,
    renderer: Renderer,
    /// Where the lines of a file begin, found when it is first needed.
    lines: BTreeMap<u32, Vec<usize>>,
}

/// A place to point at, and what to say there.
type Mark<'p> = (Span, Option<&'p str>, AnnotationKind);

impl<'a> Page<'a> {
    fn text(&self, file: u32) -> &'a str {
        &self.document.files[file as usize].text
    }

    fn starts(&mut self, file: u32) -> &[usize] {
        let text = self.text(file);
        self.lines.entry(file).or_insert_with(|| {
            let ends = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1);
            std::iter::once(0).chain(ends).collect()
        })
    }

    /// The line of a byte, from 0.
    fn line(&mut self, file: u32, byte: usize) -> usize {
        self.starts(file).partition_point(|&start| start <= byte).saturating_sub(1)
    }

    /// "the same in 466 more places: lines 12, 13, 14, …"
    fn others(&mut self, others: &[&Problem]) -> String {
        let mut numbers: Vec<usize> =
            others.iter().map(|p| self.line(p.span.file, p.span.start as usize) + 1).collect();
        numbers.dedup();
        let more = if numbers.len() > LINES { ", …" } else { "" };
        numbers.truncate(LINES);
        let lines = plural(numbers.len());
        let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
        let n = others.len();
        format!("  = the same in {n} more place{}: line{lines} {}{more}\n", plural(n), numbers.join(", "))
    }

    fn report(&mut self, problem: &Problem) -> String {
        let level = match problem.severity() {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let title = level.primary_title(sentence(&problem.kind.to_string())).id(problem.kind.code());
        let help = problem.help.as_deref().map(sentence);
        let help = help.as_deref();
        // A file without text has no lines to show; its name is in the sentence.
        if self.text(problem.span.file).trim().is_empty() {
            let help = help.map(|help| annotate_snippets::Group::with_title(Level::HELP.primary_title(help)));
            let lines = std::iter::once(annotate_snippets::Group::with_title(title)).chain(help);
            return lines.map(|line| self.renderer.render(&[line]) + "\n").collect();
        }
        let below = help.filter(|help| help.chars().count() > LABEL_WIDTH);
        let beside = help.filter(|_| below.is_none());
        let first = self.line(problem.span.file, problem.span.start as usize);
        let mut near: Vec<Mark> = vec![(problem.span, beside, AnnotationKind::Primary)];
        let mut far: Vec<Mark> = Vec::new();
        for (span, label) in &problem.related {
            let mark = (*span, Some(label.as_str()), AnnotationKind::Context);
            let close = span.file == problem.span.file
                && self.line(span.file, span.start as usize).abs_diff(first) < APART
                && !self.is_long(problem.span, *span);
            if close { near.push(mark) } else { far.push(mark) }
        }
        let mut group = title.element(self.snippet(&near));
        for mark in far {
            group = group.element(self.snippet(&[mark]));
        }
        if let Some(help) = below {
            group = group.element(Level::HELP.message(help));
        }
        self.renderer.render(&[group])
    }

    /// Whether two places share a line, or stand in lines, that cannot be shown whole.
    fn is_long(&mut self, a: Span, b: Span) -> bool {
        let (text, file) = (self.text(a.file), a.file);
        [a, b].into_iter().any(|span| {
            let line = self.line(file, span.start as usize);
            let start = self.starts(file)[line];
            line_end(text, start) - start > 4 * MARGIN
        })
    }

    /// The lines from the first to the last mark; of one too long to be shown what is around the mark.
    fn snippet<'m>(&mut self, marks: &[Mark<'m>]) -> Snippet<'m, Annotation<'m>> {
        let file = marks[0].0.file;
        let document = self.document;
        let source = &document.files[file as usize];
        let text = &*source.text;
        let places: Vec<(usize, usize)> = marks.iter().map(|(span, ..)| self.clamped(*span)).collect();
        let first = places.iter().map(|m| m.0).min().unwrap_or(0);
        let last = places.iter().map(|m| m.1).max().unwrap_or(0);
        let line = self.line(file, first);
        let start = self.starts(file)[line];
        let end = line_end(text, last);
        let (mut from, mut to) = (start, end);
        if marks.len() == 1 && !text[first..last].contains('\n') {
            from = if first - start > 2 * MARGIN { source.floor(first - MARGIN) } else { start };
            to = source.floor((last + MARGIN).min(first + 4 * MARGIN).min(end));
        }
        // Blanks stand for what is left out before: the column is counted, and blanks are not printed.
        let blanks = text[start..from].chars().count();
        let more = if to < end { "…" } else { "" };
        // The renderer replaces what gives commands in one byte; others become signs of the same length, as places are
        // counted in bytes.
        let harmless = |c: char| match c.len_utf8() {
            2 if is_command(c) => '·',
            3 if is_command(c) => '\u{fffd}',
            _ => c,
        };
        let part: String = text[from..to].chars().map(harmless).collect();
        let shown = " ".repeat(blanks) + &part + more;
        let annotations = marks.iter().zip(&places).map(|((_, label, kind), (first, last))| {
            let (first, last) = (first - from + blanks, (*last).min(to) - from + blanks);
            kind.span(first..last.max(first)).label(label.map(sentence))
        });
        let annotations: Vec<Annotation> = annotations.collect();
        let name = one_line(&source.name).into_owned();
        Snippet::source(shown).path(name).line_start(line + 1).annotations(annotations)
    }

    /// The bytes of a mark, on character boundaries; of one over many lines what is in the first.
    fn clamped(&mut self, span: Span) -> (usize, usize) {
        let source = &self.document.files[span.file as usize];
        let (from, to) = (source.floor(span.start as usize), source.floor(span.end as usize));
        let to = to.max(from);
        let lines = self.line(span.file, to) - self.line(span.file, from);
        if lines > MARKED_LINES { (from, line_end(&source.text, from)) } else { (from, to) }
    }
}

/// Where the line of a byte ends.
fn line_end(text: &str, byte: usize) -> usize {
    text[byte..].find('\n').map_or(text.len(), |i| byte + i)
}

/// A sentence with names out of a file: none of it gives commands to a terminal, and a long one is cut.
fn sentence(text: &str) -> String {
    let text = one_line(text);
    match text.char_indices().nth(SENTENCE) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into_owned(),
    }
}
