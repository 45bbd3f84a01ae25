//! Problems for programs: JSON of Penny's own, and SARIF 2.1.0, which editors and continuous integration read.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use penny::mjcf::{Document, Problem, Severity, Span};

/// What was found in one scene.
pub struct Found {
    /// As the command line names it.
    pub scene: String,
    pub document: Document,
    pub problems: Vec<Problem>,
    /// What is doubtful about the scene as a whole: warnings without a place.
    pub doubts: Vec<String>,
}

impl Found {
    pub fn count(&self, severity: Severity) -> usize {
        let own = self.problems.iter().filter(|p| p.severity() == severity).count();
        own + if severity == Severity::Warning { self.doubts.len() } else { 0 }
    }
}

/// The code of a doubt.
const DOUBT: &str = "doubt";

fn doubt(text: &str) -> &str {
    text.strip_prefix("warning: ").unwrap_or(text).trim_end()
}

fn level(problem: &Problem) -> &'static str {
    if problem.severity() == Severity::Error { "error" } else { "warning" }
}

fn file(document: &Document, span: Span) -> &str {
    document.files.get(span.file as usize).map_or("", |source| &source.name)
}

/// Lines and columns from 1, columns in characters; the end is the first that no longer belongs to it.
fn region(document: &Document, span: Span) -> Value {
    let Some(source) = document.files.get(span.file as usize) else { return json!({ "startLine": 1 }) };
    let (line, column) = source.line_column(span.start as usize);
    let (end_line, end_column) = source.line_column(span.end.max(span.start) as usize);
    json!({ "startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column })
}

/// A scene's problems: `{scene, errors, warnings, problems: [{severity, code, message, help, file, region, related, fix}]}`.
pub fn json(all: &[Found]) -> Value {
    let scenes = all.iter().map(|found| {
        let document = &found.document;
        let place = |span: Span| json!({ "file": file(document, span), "region": region(document, span) });
        let with = |mut place: Value, name: &str, value: &str| {
            place[name] = value.into();
            place
        };
        let problem = |p: &Problem| {
            let related: Vec<Value> = p.related.iter().map(|(span, label)| with(place(*span), "message", label)).collect();
            let fix: Vec<Value> = p.fix.iter().map(|edit| with(place(edit.span), "text", &edit.text)).collect();
            let mut out = json!({
                "severity": level(p), "code": p.kind.code(), "message": p.kind.to_string(), "help": p.help,
                "related": related, "fix": fix,
            });
            out["file"] = file(document, p.span).into();
            out["region"] = region(document, p.span);
            out
        };
        let doubts = found.doubts.iter().map(|text| {
            json!({ "severity": "warning", "code": DOUBT, "message": doubt(text), "help": null, "related": [], "fix": [],
                    "file": found.scene, "region": null })
        });
        json!({
            "scene": found.scene,
            "errors": found.count(Severity::Error),
            "warnings": found.count(Severity::Warning),
            "problems": found.problems.iter().map(problem).chain(doubts).collect::<Vec<_>>(),
        })
    });
    json!({ "version": 1, "scenes": scenes.collect::<Vec<_>>() })
}

/// A log in the Static Analysis Results Interchange Format.
///
/// Source: OASIS, SARIF Version 2.1.0, 2020.
pub fn sarif(all: &[Found]) -> Value {
    let codes: BTreeSet<&str> = all
        .iter()
        .flat_map(|found| {
            let doubt = found.doubts.first().map(|_| DOUBT);
            found.problems.iter().map(|p| p.kind.code()).chain(doubt)
        })
        .collect();
    let rules: Vec<Value> = codes.iter().map(|code| json!({ "id": code, "name": code })).collect();
    let mut results = Vec::new();
    for found in all {
        let document = &found.document;
        let artifact = |name: &str| json!({ "uri": uri(name) });
        let location = |span: Span| json!({ "physicalLocation": { "artifactLocation": artifact(file(document, span)), "region": region(document, span) } });
        for p in &found.problems {
            let text = match &p.help {
                Some(help) => format!("{}: {help}", p.kind),
                None => p.kind.to_string(),
            };
            let mut result = json!({
                "ruleId": p.kind.code(),
                "level": level(p),
                "message": { "text": text },
                "locations": [location(p.span)],
            });
            if !p.related.is_empty() {
                let related = p.related.iter().map(|(span, label)| {
                    let mut place = location(*span);
                    place["message"] = json!({ "text": label });
                    place
                });
                result["relatedLocations"] = related.collect();
            }
            if !p.fix.is_empty() {
                // A problem's changes are all in its own file.
                let replacements = p.fix.iter().map(|edit| {
                    json!({ "deletedRegion": region(document, edit.span), "insertedContent": { "text": edit.text } })
                });
                result["fixes"] = json!([{
                    "description": { "text": p.help.as_deref().unwrap_or("the change that was meant") },
                    "artifactChanges": [{
                        "artifactLocation": artifact(file(document, p.fix[0].span)),
                        "replacements": replacements.collect::<Vec<_>>(),
                    }],
                }]);
            }
            results.push(result);
        }
        results.extend(found.doubts.iter().map(|text| {
            json!({
                "ruleId": DOUBT,
                "level": "warning",
                "message": { "text": doubt(text) },
                "locations": [{ "physicalLocation": { "artifactLocation": artifact(&found.scene) } }],
            })
        }));
    }
    json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": { "name": "penny", "version": env!("CARGO_PKG_VERSION"), "rules": rules } },
            "columnKind": "unicodeCodePoints",
            "results": results,
        }],
    })
}

/// A path as a reference to a resource: of a full path with its scheme, else relative to where the command was started.
fn uri(path: &str) -> String {
    let mut out = String::new();
    if Path::new(path).is_absolute() {
        out.push_str(if path.starts_with('/') { "file://" } else { "file:///" });
    }
    for byte in path.bytes() {
        match byte {
            b'\\' => out.push('/'),
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => out.push(byte as char),
            b':' if cfg!(windows) => out.push(':'),
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    out
}
