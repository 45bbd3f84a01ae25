//! XML text to [`Document`]: quick-xml's events, made into a tree that keeps every place; includes spliced in.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::io::{ErrorKind, Read};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use quick_xml::Reader;
use quick_xml::escape::{EscapeError, unescape};
use quick_xml::events::attributes::AttrError;
use quick_xml::events::{BytesStart, Event};

use super::document::{Attribute, Document, Node, NodeId, Quoted, Span};
use super::error::{Problem, ProblemKind, Severity};
use super::limits::Limits;
use super::nearest::nearest;
use super::printable::{is_command, one_line};
use super::schema;
use super::source::Source;

/// Quotes of word processors.
const CURLY: [char; 8] = ['“', '”', '„', '‟', '‘', '’', '‚', '«'];

/// Reads a file and what it includes.
pub fn load(path: &Path, limits: &Limits) -> (Document, Vec<Problem>) {
    let name = path.display().to_string();
    match read_text(path, &name, limits.bytes, limits) {
        Ok(text) => parse_file(path, text, limits),
        Err(unread) => {
            let end = unread.valid.len();
            let source = Source { name, path: path.to_path_buf(), text: unread.valid.into() };
            let document = Document { files: vec![source], ..Document::default() };
            let problem = Problem::new(*unread.kind, Span::new(0, end, end));
            let near = || Some(path.with_file_name(similar_file(path)?).display().to_string());
            let problem = match unread.help {
                Some(help) => problem.help(help),
                None => problem.suggest(near().as_deref()),
            };
            (document, vec![problem])
        }
    }
}

/// Reads text as if it were the file `name`; includes are looked for beside it.
pub fn parse(name: &str, text: &str, limits: &Limits) -> (Document, Vec<Problem>) {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    parse_file(Path::new(name), text.to_string(), limits)
}

fn parse_file(path: &Path, text: String, limits: &Limits) -> (Document, Vec<Problem>) {
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut parser = Parser {
        document: Document::default(),
        problems: Vec::new(),
        limits,
        root: canonical(if folder.as_os_str().is_empty() { Path::new(".") } else { &folder }),
        folder,
        open: vec![canonical(path)],
        seen: BTreeSet::from([canonical(path)]),
        last_stray: Span::default(),
        left: limits.bytes,
        full: false,
    };
    let name = path.display().to_string();
    if text.len() > parser.left {
        parser.exceeds("bytes", limits.bytes, Span::default());
        parser.document.files.push(Source { name, path: path.to_path_buf(), text: Arc::default() });
        return (parser.document, parser.problems);
    }
    parser.file(Source { name: name.clone(), path: path.to_path_buf(), text: text.into() }, None, 0);
    if parser.document.nodes.is_empty() && parser.problems.is_empty() {
        parser.report(ProblemKind::EmptyFile { file: name }, Span::default());
    }
    (parser.document, parser.problems)
}

/// Why a file has no text.
struct Unread {
    kind: Box<ProblemKind>,
    help: Option<String>,
    /// The part that could be read.
    valid: String,
}

impl From<ProblemKind> for Unread {
    fn from(kind: ProblemKind) -> Unread {
        Unread { kind: Box::new(kind), help: None, valid: String::new() }
    }
}

impl Unread {
    fn help(self, help: impl Into<String>) -> Unread {
        Unread { help: Some(help.into()), ..self }
    }
}

/// The file's text, or what is wrong with it. `left`: of all `limits.bytes`, this many.
fn read_text(path: &Path, name: &str, left: usize, limits: &Limits) -> Result<String, Unread> {
    let file = name.to_string();
    let cannot = |error: std::io::Error| {
        let why = match error.kind() {
            ErrorKind::NotFound => "there is no such file".to_string(),
            ErrorKind::PermissionDenied => "permission denied".to_string(),
            _ => error.to_string(),
        };
        Unread::from(ProblemKind::CannotRead { file: name.to_string(), why })
    };
    // Before it is opened: to open a pipe is to wait for whoever writes.
    let about = std::fs::metadata(path).map_err(cannot)?;
    if about.is_dir() {
        return Err(ProblemKind::IsFolder { file }.into());
    }
    if !about.is_file() {
        let unread = Unread::from(ProblemKind::NotAFile { file });
        return Err(unread.help("a pipe, a device or a socket is never read: save the scene to a file"));
    }
    // Room for one more shows the end of the file without a second buffer.
    let mut bytes = Vec::with_capacity(about.len().min(left as u64) as usize + 1);
    if about.len() <= left as u64 {
        // It may grow meanwhile.
        let open = std::fs::File::open(path);
        open.and_then(|f| f.take(left as u64 + 1).read_to_end(&mut bytes)).map_err(cannot)?;
    }
    if about.len().max(bytes.len() as u64) > left as u64 {
        let help = raise("bytes", limits.bytes);
        return Err(Unread::from(ProblemKind::OverLimit { what: "bytes", limit: limits.bytes }).help(help));
    }
    let text =
        String::from_utf8(bytes).map_err(|error| not_utf8(file, error.as_bytes(), error.utf8_error().valid_up_to()))?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_string).unwrap_or(text))
}

/// How to read a scene that exceeds a limit.
pub fn raise(limit: &str, value: usize) -> String {
    format!("if the scene is meant so and you trust it: `--limit {limit}={}`", value.saturating_mul(2))
}

/// `valid`: this many bytes are text.
fn not_utf8(file: String, bytes: &[u8], valid: usize) -> Unread {
    let text =
        Source { name: file, path: PathBuf::new(), text: String::from_utf8_lossy(&bytes[..valid]).into_owned().into() };
    let (line, column) = text.line_column(valid);
    let kind = ProblemKind::NotUtf8 { file: text.name, byte: bytes[valid], line, column };
    // UTF-16 begins with a mark. Apart from it no text has bytes 0, and what has some shows no lines worth reading.
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return Unread::from(kind).help("it is text in UTF-16: save it as UTF-8");
    }
    if bytes.contains(&0) {
        let help = "it is no text at all: a scene is an XML file that begins with `<mujoco>`";
        return Unread::from(kind).help(help);
    }
    Unread { valid: text.text.to_string(), ..Unread::from(kind).help("save it as UTF-8") }
}

/// A file beside the missing one with nearly its name.
pub(super) fn similar_file(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = folder.read_dir().ok()?.flatten().take(MOST_ENTRIES);
    let mut files: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    files.sort();
    let near = nearest(&name, files.iter().filter(|f| **f != name).map(String::as_str))?;
    Some(near.to_string())
}

/// Of a folder with more, a name is not worth looking for.
const MOST_ENTRIES: usize = 10_000;

fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

struct Parser<'a> {
    document: Document,
    problems: Vec<Problem>,
    limits: &'a Limits,
    /// The main file's folder, without links and detours.
    root: PathBuf,
    /// The same as it was written: included files are looked for there first.
    folder: PathBuf,
    /// The files being read, main file first.
    open: Vec<PathBuf>,
    seen: BTreeSet<PathBuf>,
    /// The text between elements that came last.
    last_stray: Span,
    /// Bytes that may still be read.
    left: usize,
    /// A limit is exceeded: nothing more is read.
    full: bool,
}

/// An element whose end tag has not come yet.
struct Open<'a> {
    name: &'a str,
    span: Span,
    /// Where its children go: itself, or for the outermost element of an included file the include's parent.
    node: NodeId,
}

/// One file while it is read.
struct File<'a> {
    number: u32,
    text: &'a Arc<String>,
    stack: Vec<Open<'a>>,
    /// Where the children of the outermost element go if this is an included file.
    into: Option<NodeId>,
    roots: usize,
    /// Levels of elements around this file.
    outer: usize,
    /// The warning about text between elements, if there is one.
    stray: Option<usize>,
}

impl File<'_> {
    /// Whether nothing stands between two places.
    fn blank(&self, from: u32, to: u32) -> bool {
        self.text.get(from as usize..to as usize).is_some_and(|between| between.trim().is_empty())
    }

    /// The place of a slice of the text.
    fn span(&self, part: &str) -> Span {
        let start = part.as_ptr() as usize - self.text.as_ptr() as usize;
        Span::new(self.number, start, start + part.len())
    }
}

impl Parser<'_> {
    fn report(&mut self, kind: ProblemKind, span: Span) {
        self.problems.push(Problem::new(kind, span));
    }

    /// Something of which a scene may not have so much.
    fn exceeds(&mut self, what: &'static str, limit: usize, span: Span) {
        let problem = Problem::new(ProblemKind::OverLimit { what, limit }, span);
        self.problems.push(problem.help(raise(what, limit)));
        self.full = true;
    }

    /// Reads a file. `outer`: levels of elements around it.
    fn file(&mut self, source: Source, into: Option<NodeId>, outer: usize) {
        let number = self.document.files.len();
        let text = source.text.clone();
        self.left -= text.len();
        self.document.files.push(source);
        let file = File { number: number as u32, text: &text, stack: Vec::new(), into, roots: 0, outer, stray: None };
        self.elements(file);
    }

    fn elements(&mut self, mut file: File) {
        let (number, text) = (file.number, &**file.text);
        if let Some(at) = text.find('\0') {
            let problem = Problem::new(ProblemKind::NulByte, Span::new(number, at, at + 1));
            return self.problems.push(problem.help("it is no text: write the file anew, or remove the byte"));
        }
        self.document.reserve(text);
        let mut reader = Reader::from_str(text);
        // End tags are matched here, where both places are known.
        reader.config_mut().check_end_names = false;
        reader.config_mut().allow_unmatched_ends = true;
        while !self.full {
            let start = reader.buffer_position() as usize;
            let event = reader.read_event();
            let span = Span::new(number, start, reader.buffer_position() as usize);
            match event {
                Ok(Event::Eof) => break,
                Ok(Event::Start(tag) | Event::Empty(tag)) if self.runs_on(&file, &tag) => return,
                Ok(Event::Start(tag)) => self.start(&mut file, &tag, span, true),
                Ok(Event::Empty(tag)) => self.start(&mut file, &tag, span, false),
                Ok(Event::End(tag)) => self.end(&mut file, tag.name().as_ref(), span),
                Ok(Event::Text(part)) => self.text(&mut file, &part, start),
                Ok(Event::CData(_) | Event::GeneralRef(_)) => self.stray(&mut file, span),
                Ok(Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_)) => {}
                Err(error) => {
                    let at = (reader.error_position() as usize).min(text.len());
                    let len = text.get(at..).and_then(|t| t.find(char::is_whitespace)).unwrap_or(text.len() - at);
                    self.problems.push(broken(&error, Span::new(number, at, at + len)));
                    return;
                }
            }
        }
        if let Some(open) = file.stack.last().filter(|_| !self.full) {
            let eof = Span::new(number, text.trim_end().len(), text.trim_end().len());
            self.problems.push(
                Problem::new(ProblemKind::UnclosedElement { element: open.name.to_string() }, open.span)
                    .help(format!("`</{}>` is missing before the end of the file", open.name))
                    .related(eof, "the file ends here"),
            );
        }
    }

    /// A tag that has swallowed the next one: what follows is not what was meant, so reading ends there.
    fn runs_on(&mut self, file: &File, tag: &BytesStart) -> bool {
        let content: &str = tag;
        // Of a text as short as a tag, faster than a search.
        let Some(next) = content.bytes().position(|c| c == b'<') else {
            return false;
        };
        let mut quote = None;
        for (i, c) in content[..next].char_indices() {
            match quote {
                None if c == '"' || c == '\'' => quote = Some((i, c)),
                Some((_, open)) if c == open => quote = None,
                _ => {}
            }
        }
        let place = |from: usize, to: usize| file.span(&content[from..to]);
        self.problems.push(match quote {
            Some((open, _)) => {
                let line = content[open..next].find('\n').map_or(next, |i| open + i);
                let what = "a value in quotes cannot contain `<`".to_string();
                Problem::new(ProblemKind::BrokenXml { what }, place(open, line))
                    .help("is a closing quote missing? a plain `<` is written `&lt;`")
            }
            None => {
                let what = format!("`<{}` is never closed by `>`", tag.name().as_ref());
                let mut start = place(0, tag.name().as_ref().len());
                start.start = start.start.saturating_sub(1);
                Problem::new(ProblemKind::BrokenXml { what }, start)
                    .related(place(next, next + 1), "the next tag begins here")
            }
        });
        true
    }

    /// `whole`: from `<` to `>`.
    fn start(&mut self, file: &mut File, tag: &BytesStart, whole: Span, has_content: bool) {
        let content: &str = tag;
        let name = tag.name();
        let name: &str = name.as_ref();
        let mut span = file.span(&content[..name.len()]);
        span.start = span.start.saturating_sub(1);
        if file.stack.is_empty() {
            file.roots += 1;
            if file.roots > 1 {
                self.report(ProblemKind::SecondRoot { element: name.to_string() }, span);
            }
        }
        let limit = self.limits.depth;
        if file.outer + file.stack.len() >= limit {
            let problem = Problem::new(ProblemKind::TooDeep { limit }, span).help(raise("depth", limit));
            self.problems.push(problem);
            return self.full = true;
        }
        if let [_, .., Open { name: "include", .. }] = file.stack[..] {
            let kind = ProblemKind::MisplacedElement { parent: "include".into(), element: name.to_string() };
            self.report(kind, span);
        }
        let attributes = self.attributes(file, tag);
        let parent = file.stack.last().map(|open| open.node).or(file.into);
        let node = match (file.stack.is_empty(), file.into) {
            (true, Some(into)) => {
                self.document.includes.contents.push(Span { start: whole.end, ..whole });
                into
            }
            _ if name == "include" && parent.is_some() => {
                let include = Node { name: schema::name_of(name), span, end: None, attributes, children: Vec::new() };
                let parent = parent.unwrap_or_default();
                let next = self.document.files.len();
                self.include(&include, parent, file);
                let read = (self.document.files.len() > next).then_some(next as u32);
                self.document.includes.tags.push((whole, read));
                parent
            }
            // A second root was reported; its children hang where they do no harm.
            (true, None) if file.roots > 1 => NodeId(0),
            _ if self.document.nodes.len() >= self.limits.elements => {
                return self.exceeds("elements", self.limits.elements, span);
            }
            _ => self
                .push(Node { name: schema::name_of(name), span, end: None, attributes, children: Vec::new() }, parent),
        };
        if has_content {
            let from = span.start as usize + 1;
            file.stack.push(Open { name: &file.text[from..from + name.len()], span, node });
        }
    }

    fn push(&mut self, node: Node, parent: Option<NodeId>) -> NodeId {
        let id = NodeId(self.document.nodes.len() as u32);
        self.document.nodes.push(node);
        if let Some(parent) = parent {
            self.document.nodes[parent.0 as usize].children.push(id);
        }
        id
    }

    /// Adds what a tag has to the attributes of the document. Out: which of them.
    fn attributes(&mut self, file: &File, tag: &BytesStart) -> Range<u32> {
        let content: &str = tag;
        let base = file.span(content).start as usize;
        let start = self.document.attributes.len();
        let mut by_name: HashMap<String, usize> = HashMap::new();
        // Whether one is given twice is looked at here, in a time that grows with their number only.
        for attribute in tag.attributes().with_checks(false) {
            match attribute {
                Ok(attribute) => {
                    // quick-xml lends slices of the tag, so their place is a difference of addresses.
                    let key: &str = attribute.key.as_ref();
                    let key_at = base + key.as_ptr() as usize - content.as_ptr() as usize;
                    if let Some(first) = earlier(&self.document.attributes[start..], &mut by_name, key) {
                        let name_span = Span::new(file.number, key_at, key_at + key.len());
                        let kind = ProblemKind::DuplicateAttribute { attribute: key.to_string() };
                        self.problems.push(Problem::new(kind, name_span).related(first, "first given here"));
                        continue;
                    }
                    let raw: &str = &attribute.value;
                    let raw_at = base + raw.as_ptr() as usize - content.as_ptr() as usize;
                    // Of an empty value one sees the quotes.
                    let value_span = match raw.len() {
                        0 => Span::new(file.number, raw_at - 1, raw_at + 1),
                        len => Span::new(file.number, raw_at, raw_at + len),
                    };
                    let value = self.value(file, raw, value_span);
                    self.document.attributes.push(Attribute {
                        name: schema::name_of(key),
                        name_span: Span::new(file.number, key_at, key_at + key.len()),
                        value,
                        value_span,
                    });
                }
                Err(error) => {
                    self.bad_attribute(file, content, base, &error);
                    // What follows a quote that is none falls to pieces: one error is enough.
                    if matches!(error, AttrError::UnquotedValue(at) if content[at..].starts_with(CURLY)) {
                        break;
                    }
                }
            }
        }
        start as u32..self.document.attributes.len() as u32
    }

    /// The value of an attribute as XML has it: entities replaced, and blanks where it breaks a line. What would
    /// give commands to a terminal is written out.
    fn value(&mut self, file: &File, raw: &str, span: Span) -> Quoted {
        if raw.bytes().all(|c| matches!(c, b' '..=b'~') && c != b'&') {
            let start = span.start as usize;
            return Quoted::part(file.text, start..start + raw.len());
        }
        let value = self.unescape(raw, span);
        match one_line(&value) {
            Cow::Borrowed(_) => value.into(),
            Cow::Owned(shown) => {
                if let Some(c) = value.chars().find(|&c| is_command(c) && c != '\r') {
                    let kind = ProblemKind::ControlCharacter { code: c as u32, shown: shown.clone() };
                    self.report(kind, span);
                }
                shown.into()
            }
        }
    }

    fn unescape(&mut self, raw: &str, span: Span) -> String {
        match unescape(raw) {
            Ok(value) => value.into_owned(),
            Err(error) => {
                let (what, range) = match &error {
                    EscapeError::UnrecognizedEntity(range, name) => {
                        (format!("XML has no entity `&{name};`"), range.clone())
                    }
                    EscapeError::UnterminatedEntity(range) => {
                        ("`&` begins an entity that no `;` ends".to_string(), range.start..range.start + 1)
                    }
                    _ => ("this is not a character reference".to_string(), 0..raw.len()),
                };
                let start = span.start as usize;
                self.problems.push(
                    Problem::new(
                        ProblemKind::BadEntity { what },
                        Span::new(span.file, start + range.start, start + range.end),
                    )
                    .help("write `&amp;` for a plain `&`"),
                );
                raw.to_string()
            }
        }
    }

    fn bad_attribute(&mut self, file: &File, content: &str, base: usize, error: &AttrError) {
        let at = |position: usize, len: usize| {
            let start = position.min(content.len());
            Span::new(file.number, base + start, base + (start + len).min(content.len()))
        };
        let (what, span) = match *error {
            AttrError::ExpectedEq(position) => {
                ("an attribute needs `=` and a value in quotes".to_string(), at(position, 1))
            }
            AttrError::ExpectedValue(position) => ("an attribute needs a value in quotes".to_string(), at(position, 1)),
            AttrError::UnquotedValue(position)
                if content.get(position..).is_some_and(|rest| rest.starts_with(CURLY)) =>
            {
                let rest = content.get(position..).unwrap_or("");
                let opening = rest.chars().next().unwrap_or('“');
                let close = rest.char_indices().skip(1).find(|(_, c)| CURLY.contains(c));
                let len = close.map_or(opening.len_utf8(), |(i, c)| i + c.len_utf8());
                let what = format!("`{opening}` is a typographic quote, which XML does not take");
                let help = "write plain quotes, \" or '; an editor may have replaced them";
                self.problems.push(Problem::new(ProblemKind::BrokenXml { what }, at(position, len)).help(help));
                return;
            }
            AttrError::UnquotedValue(position) => {
                let len =
                    content.get(position..).map_or(1, |rest| rest.find([' ', '\n', '\t', '/']).unwrap_or(rest.len()));
                ("the value of an attribute must be in quotes".to_string(), at(position, len))
            }
            AttrError::ExpectedQuote(position, quote) => {
                (format!("the value of an attribute is not closed by {}", quote as char), at(position, 1))
            }
            AttrError::Duplicated(position, _) => ("this attribute is given twice".to_string(), at(position, 1)),
        };
        self.report(ProblemKind::BrokenXml { what }, span);
    }

    fn end(&mut self, file: &mut File, name: &str, span: Span) {
        let Some(depth) = file.stack.iter().rposition(|open| open.name == name) else {
            let expected = file.stack.last().map(|open| open.name);
            let meant = expected.filter(|e| nearest(name, [*e]).is_some());
            if meant.is_some() {
                file.stack.pop();
            }
            let problem = Problem::new(ProblemKind::UnmatchedEnd { element: name.to_string() }, span);
            let known = |name: &str| schema::SCHEMA.iter().any(|row| row.is(name));
            self.problems.push(match meant {
                // The check mends the start.
                Some(start) if known(name) && !known(start) => problem.help(format!("`<{start}>` comes before it")),
                _ => {
                    let close = meant.map(|start| format!("/{start}"));
                    problem
                        .suggest(close.as_ref().map(|c| format!("<{c}>")).as_deref())
                        .replace(Span { start: span.start + 1, end: span.end - 1, ..span }, close.as_deref())
                }
            });
            return;
        };
        for open in file.stack.drain(depth + 1..) {
            self.problems.push(
                Problem::new(ProblemKind::UnclosedElement { element: open.name.to_string() }, open.span)
                    .help(format!("`</{}>` or `/>` is missing", open.name))
                    .related(span, format!("`</{name}>` comes first")),
            );
        }
        if let Some(open) = file.stack.pop() {
            let node = &mut self.document.nodes[open.node.0 as usize];
            // Children of an included file's outermost element are the include's parent's.
            if node.span == open.span {
                node.end = Some(Span::new(span.file, span.start as usize + 2, span.start as usize + 2 + name.len()));
            }
        }
        let contents = &mut self.document.includes.contents;
        match depth {
            0 => contents.iter_mut().filter(|c| c.file == file.number).for_each(|c| c.end = span.start),
            _ if name == "include" => self.document.includes.tags.push((span, None)),
            _ => {}
        }
    }

    fn text(&mut self, file: &mut File, part: &str, start: usize) {
        let trimmed = part.trim();
        if !trimmed.is_empty() {
            let from = start + part.len() - part.trim_start().len();
            self.stray(file, Span::new(file.number, from, from + trimmed.len()));
        }
    }

    fn stray(&mut self, file: &mut File, span: Span) {
        if file.stack.is_empty() {
            return self.report(ProblemKind::TextOutside, span);
        }
        // Entities cut a text into several events.
        let last = std::mem::replace(&mut self.last_stray, span);
        let goes_on = last.file == span.file && last.end > 0 && file.blank(last.end, span.start);
        // One warning for a file is enough: pasted text has a bar or a bullet on every line.
        match file.stray.map(|i| &mut self.problems[i]) {
            None => {
                file.stray = Some(self.problems.len());
                self.report(ProblemKind::StrayText { more: 0 }, span);
            }
            Some(first) if goes_on && first.span.end == last.end => first.span.end = span.end,
            Some(Problem { kind: ProblemKind::StrayText { more }, .. }) if !goes_on => *more += 1,
            Some(_) => {}
        }
    }

    /// Reads another file and puts the children of its outermost element in the include's place.
    fn include(&mut self, include: &Node, parent: NodeId, from: &File) {
        let mut misspelt = false;
        let attributes = self.document.attributes_of(include).to_vec();
        for other in attributes.iter().filter(|a| a.name != "file") {
            let kind = ProblemKind::UnknownAttribute { element: "include".into(), attribute: other.name.to_string() };
            self.problems.push(Problem::new(kind, other.name_span).correct(nearest(&other.name, ["file"])));
            misspelt = true;
        }
        let Some(attribute) = attributes.iter().find(|a| a.name == "file") else {
            if !misspelt {
                let kind = ProblemKind::MissingAttribute { element: "include".into(), attribute: "file".into() };
                self.report(kind, include.span);
            }
            return;
        };
        let file = attribute.value.to_string();
        let place = attribute.value_span;
        let Some(path) = self.find(&file, from) else {
            let problem = Problem::new(ProblemKind::Outside { file }, place);
            return self.problems.push(problem.help("if you trust the scene: `--allow-outside`"));
        };
        let name = path.display().to_string();
        let identity = canonical(&path);
        if self.open.contains(&identity) {
            return self.report(ProblemKind::IncludeCycle { file }, place);
        }
        if !self.seen.insert(identity.clone()) {
            return self.report(ProblemKind::IncludeTwice { file }, place);
        }
        if self.document.files.len() > self.limits.includes {
            return self.exceeds("includes", self.limits.includes, place);
        }
        match read_text(&path, &name, self.left, self.limits) {
            Err(unread) => {
                self.full |= matches!(*unread.kind, ProblemKind::OverLimit { .. });
                let near = || Some(Path::new(&file).with_file_name(similar_file(&path)?).display().to_string());
                let problem = Problem::new(*unread.kind, place);
                self.problems.push(match unread.help {
                    Some(help) => problem.help(help),
                    None => problem.correct(near().as_deref()),
                });
            }
            Ok(text) => {
                let (children, problems) = (self.document.node(parent).children.len(), self.problems.len());
                self.open.push(identity);
                self.file(Source { name, path, text: text.into() }, Some(parent), from.outer + from.stack.len() + 1);
                self.open.pop();
                // What is wrong with it may be why.
                let warned = self.problems[problems..].iter().all(|p| p.severity() == Severity::Warning);
                if self.document.node(parent).children.len() == children && warned {
                    self.report(ProblemKind::IncludeEmpty { file }, place);
                }
            }
        }
    }

    /// The file that an include means: in the main file's folder, else in the including file's. Where there is none,
    /// where it should be. `None`: outside the main file's folder, where nothing is looked at.
    ///
    /// Source: MuJoCo 4.0.0, by running it.
    fn find(&self, file: &str, from: &File) -> Option<PathBuf> {
        let including = self.document.files[from.number as usize].path.parent().unwrap_or(Path::new(""));
        let candidates = [self.folder.join(file), including.join(file)];
        let found = candidates.iter().find(|path| path.exists());
        match found {
            _ if self.limits.outside => found.or(candidates.first()),
            Some(path) => Some(path).filter(|path| canonical(path).starts_with(&self.root)),
            None => candidates.iter().find(|path| {
                let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
                stays_inside(path, &self.folder) && inside(folder, &self.root)
            }),
        }
        .cloned()
    }
}

/// Whether a path, which begins with `folder`, leads out of it by its own words.
fn stays_inside(path: &Path, folder: &Path) -> bool {
    let Ok(rest) = path.strip_prefix(folder) else { return false };
    let mut depth = 0i32;
    rest.components().all(|part| {
        depth += match part {
            Component::Normal(_) => 1,
            Component::CurDir => 0,
            _ => -1,
        };
        depth >= 0
    })
}

/// Whether a folder, or the nearest one above it that exists, lies in `root`.
fn inside(folder: &Path, root: &Path) -> bool {
    let nearest = folder.ancestors().find_map(|f| {
        let f = if f.as_os_str().is_empty() { Path::new(".") } else { f };
        f.canonicalize().ok()
    });
    nearest.is_some_and(|f| f.starts_with(root))
}

/// Where an attribute of that name was given before, if it was. `by_name` is made once they are many.
fn earlier(before: &[Attribute], by_name: &mut HashMap<String, usize>, name: &str) -> Option<Span> {
    const FEW: usize = 16;
    if before.len() < FEW {
        return before.iter().find(|a| a.name == name).map(|a| a.name_span);
    }
    for i in by_name.len()..before.len() {
        by_name.insert(before[i].name.to_string(), i);
    }
    by_name.get(name).map(|&i| before[i].name_span)
}

/// quick-xml's syntax errors, in our words.
fn broken(error: &quick_xml::Error, span: Span) -> Problem {
    use quick_xml::errors::SyntaxError::*;
    let quick_xml::Error::Syntax(syntax) = error else {
        return Problem::new(ProblemKind::BrokenXml { what: error.to_string() }, span);
    };
    let (what, help) = match syntax {
        UnclosedTag => ("this tag is never closed by `>`", ""),
        UnclosedSingleQuotedAttributeValue => ("a value is never closed by '", "check the quotes from here on"),
        UnclosedDoubleQuotedAttributeValue => ("a value is never closed by \"", "check the quotes from here on"),
        UnclosedComment => ("this comment is never closed by `-->`", ""),
        UnclosedCData => ("this CDATA section is never closed by `]]>`", ""),
        UnclosedDoctype => ("this DOCTYPE is never closed by `>`", ""),
        UnclosedPI | UnclosedXmlDecl => ("this processing instruction is never closed by `?>`", ""),
        InvalidBangMarkup => ("`<!` must begin a comment `<!-- … -->`", ""),
    };
    let problem = Problem::new(ProblemKind::BrokenXml { what: what.to_string() }, span);
    if help.is_empty() { problem } else { problem.help(help) }
}
