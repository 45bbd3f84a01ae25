//! Problems as text, with the lines they are about.

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Renderer, Snippet};

use super::document::{Document, Span};
use super::error::{Problem, Severity};

/// A help text this long stands below the snippet, a shorter one beside the carets.
const LABEL_WIDTH: usize = 70;

/// All problems in the order of their places, errors and warnings as they come.
pub fn render(document: &Document, problems: &[Problem], colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    let mut sorted: Vec<&Problem> = problems.iter().collect();
    sorted.sort_by_key(|problem| problem.span);
    let mut out = String::new();
    for problem in sorted {
        if !out.is_empty() {
            out.push('\n');
        }
        out.push_str(report(document, problem, &renderer).trim_end());
        out.push('\n');
    }
    out
}

fn report(document: &Document, problem: &Problem, renderer: &Renderer) -> String {
    let level = match problem.severity() {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let title = level.primary_title(problem.kind.to_string()).id(problem.kind.code());
    let help = problem.help.as_deref();
    // A file without text has no lines to show; its name is in the sentence.
    if document.files[problem.span.file as usize].text.trim().is_empty() {
        let help = help.map(|help| Group::with_title(Level::HELP.primary_title(help)));
        let lines = std::iter::once(Group::with_title(title)).chain(help);
        return lines.map(|line| renderer.render(&[line]) + "\n").collect();
    }
    let below = help.filter(|help| help.chars().count() > LABEL_WIDTH);
    let beside = help.filter(|_| below.is_none());
    let mut group = title.element(place(document, problem, beside));
    for (span, label) in problem.related.iter().filter(|(span, _)| span.file != problem.span.file) {
        group = group.element(snippet(document, &[(*span, Some(label), AnnotationKind::Context)]));
    }
    if let Some(help) = below {
        group = group.element(Level::HELP.message(help));
    }
    renderer.render(&[group])
}

/// The snippet of the problem itself, with the related places of the same file.
fn place<'a>(document: &'a Document, problem: &'a Problem, help: Option<&'a str>) -> Snippet<'a, Annotation<'a>> {
    let mut marks = vec![(problem.span, help, AnnotationKind::Primary)];
    for (span, label) in problem.related.iter().filter(|(span, _)| span.file == problem.span.file) {
        marks.push((*span, Some(label), AnnotationKind::Context));
    }
    snippet(document, &marks)
}

/// The lines from the first to the last mark.
fn snippet<'a>(
    document: &'a Document,
    marks: &[(Span, Option<&'a str>, AnnotationKind)],
) -> Snippet<'a, Annotation<'a>> {
    let source = &document.files[marks[0].0.file as usize];
    let text = source.text.as_str();
    let first = marks.iter().map(|m| source.floor(m.0.start as usize)).min().unwrap_or(0);
    let last = marks.iter().map(|m| source.floor(m.0.end as usize)).max().unwrap_or(0);
    let start = text[..first].rfind('\n').map_or(0, |i| i + 1);
    let end = text[last..].find('\n').map_or(text.len(), |i| last + i);
    let annotations = marks.iter().map(|(span, label, kind)| -> Annotation<'a> {
        let from = source.floor(span.start as usize) - start;
        let to = source.floor(span.end as usize) - start;
        kind.span(from..to.max(from)).label(*label)
    });
    Snippet::source(&text[start..end])
        .path(source.name.as_str())
        .line_start(source.line_column(start).0)
        .annotations(annotations)
}
