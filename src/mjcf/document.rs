//! XML text as a tree whose every name and value knows its place in the file.
//!
//! What an element means is not known here; [`super::parse`] builds the tree, [`super::schema`] judges it.

use std::borrow::Cow;
use std::fmt;
use std::ops::{Deref, Range};
use std::sync::Arc;

use super::error::Problem;
use super::source::Source;

/// Bytes `start..end` of file number `file`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    /// Index of the file among those that were read.
    pub file: u32,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    pub(super) fn new(file: u32, start: usize, end: usize) -> Span {
        Span { file, start: start as u32, end: end as u32 }
    }
}

/// An element of a [`Document`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// The files of a scene (the main file and its includes) and their elements.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// The main file first, then the included ones in the order they were met.
    pub files: Vec<Source>,
    pub(super) nodes: Vec<Node>,
    /// Of all elements, in one list: one a piece would be millions.
    pub(super) attributes: Vec<Attribute>,
    pub(super) includes: Box<Includes>,
}

/// What was spliced in, and where.
#[derive(Clone, Debug, Default)]
pub(super) struct Includes {
    /// Tags of includes, and the files that stand in their places (end tags: none).
    pub tags: Vec<(Span, Option<u32>)>,
    /// Of each included file, what its outermost element holds.
    pub contents: Vec<Span>,
}

/// An element: name, attributes and children, each in file order.
#[derive(Clone, Debug)]
pub struct Node {
    /// Of the element.
    pub name: Cow<'static, str>,
    /// From `<` to the end of the name.
    pub span: Span,
    /// The name in its end tag, if it has one.
    pub end: Option<Span>,
    /// Where its attributes are among all, as written.
    pub(super) attributes: Range<u32>,
    /// Elements within it.
    pub children: Vec<NodeId>,
}

/// An attribute.
#[derive(Clone, Debug)]
pub struct Attribute {
    /// Its name.
    pub name: Cow<'static, str>,
    /// Where its name stands.
    pub name_span: Span,
    /// Entities replaced.
    pub value: Quoted,
    /// What stands between the quotes.
    pub value_span: Span,
}

/// What an attribute's quotes hold: a part of the file's text, or where that has entities a text of its own.
#[derive(Clone)]
pub struct Quoted {
    of: Arc<String>,
    start: u32,
    end: u32,
}

impl Quoted {
    /// `span`: in the file whose text is `of`.
    pub(super) fn part(of: &Arc<String>, span: Range<usize>) -> Quoted {
        Quoted { of: of.clone(), start: span.start as u32, end: span.end as u32 }
    }
}

impl From<String> for Quoted {
    fn from(text: String) -> Quoted {
        Quoted { start: 0, end: text.len() as u32, of: text.into() }
    }
}

impl Deref for Quoted {
    type Target = str;

    fn deref(&self) -> &str {
        &self.of[self.start as usize..self.end as usize]
    }
}

impl fmt::Debug for Quoted {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl Attribute {
    /// Whether its value stands in the file as it is: it has no entities.
    pub(super) fn is_plain(&self) -> bool {
        self.value.len() == (self.value_span.end - self.value_span.start) as usize
    }

    /// From its name to the quote behind its value.
    pub(super) fn whole(&self) -> Span {
        let quote = u32::from(!self.value.is_empty());
        Span { end: self.value_span.end + quote, ..self.name_span }
    }
}

impl Document {
    /// Room for what a text has, so that its lists are not copied while they grow: a `<` without `/` for every element, a `=`
    /// for every attribute, and no more than a short list of them of a text of nothing else.
    pub(super) fn reserve(&mut self, text: &str) {
        const MOST: usize = 1 << 20;
        let bytes = text.as_bytes();
        let starts = bytes.iter().zip(bytes.iter().skip(1)).filter(|(a, b)| **a == b'<' && **b != b'/').count();
        let equals = bytes.iter().filter(|c| **c == b'=').count();
        self.nodes.reserve(starts.min(text.len() / 8).min(MOST));
        self.attributes.reserve(equals.min(text.len() / 4).min(MOST));
    }

    /// Adds to a problem the change that calls an element by another name, in both of its tags.
    pub(super) fn rename(&self, problem: Problem, node: NodeId, name: Option<&str>) -> Problem {
        let &Node { span, end, .. } = self.node(node);
        let start = Span { start: span.start + 1, ..span };
        let problem = problem.replace(start, name);
        match end {
            Some(end) => problem.replace(end, name),
            None => problem,
        }
    }

    /// The scene as one file, which includes no others and means the same.
    pub fn joined(&self) -> String {
        let mut tags: Vec<Vec<(Span, Option<u32>)>> = vec![Vec::new(); self.files.len()];
        for &(span, file) in &self.includes.tags {
            tags[span.file as usize].push((span, file));
        }
        tags.iter_mut().for_each(|tags| tags.sort());
        let mut text = String::new();
        if let Some(main) = self.files.first() {
            self.join(Span::new(0, 0, main.text.len()), &tags, &mut text);
        }
        text
    }

    fn join(&self, part: Span, tags: &[Vec<(Span, Option<u32>)>], out: &mut String) {
        let text = &self.files[part.file as usize].text;
        let mut from = part.start as usize;
        for (tag, file) in &tags[part.file as usize] {
            out.push_str(&text[from..tag.start as usize]);
            let content = file.and_then(|file| self.includes.contents.binary_search_by_key(&file, |c| c.file).ok());
            if let Some(i) = content {
                self.join(self.includes.contents[i], tags, out);
            }
            from = tag.end as usize;
        }
        out.push_str(&text[from..part.end as usize]);
    }

    /// The outermost element, if there is one.
    pub fn root(&self) -> Option<NodeId> {
        (!self.nodes.is_empty()).then_some(NodeId(0))
    }

    /// An element.
    pub fn node(&self, node: NodeId) -> &Node {
        &self.nodes[node.0 as usize]
    }

    /// The attributes of an element, as written.
    pub fn attributes(&self, node: NodeId) -> &[Attribute] {
        self.attributes_of(self.node(node))
    }

    pub(super) fn attributes_of(&self, node: &Node) -> &[Attribute] {
        &self.attributes[node.attributes.start as usize..node.attributes.end as usize]
    }

    /// Its attribute of that name.
    pub fn attribute(&self, node: NodeId, name: &str) -> Option<&Attribute> {
        self.attributes(node).iter().find(|a| a.name == name)
    }

    /// The element's start tag: `<geom` from `<` to the end of its name.
    pub fn span(&self, node: NodeId) -> Span {
        self.node(node).span
    }

    /// The name of an attribute where the element itself has it; the element's tag where it came from a default.
    pub fn name_span(&self, node: NodeId, attribute: &str) -> Span {
        self.attribute(node, attribute).map_or(self.span(node), |a| a.name_span)
    }

    /// The value of an attribute where the element itself has it; the element's tag where it came from a default.
    pub fn value_span(&self, node: NodeId, attribute: &str) -> Span {
        self.attribute(node, attribute).map_or(self.span(node), |a| a.value_span)
    }

    /// The `index`-th word of an attribute's value (all of it if it has entities, which move the words).
    pub fn word_span(&self, attribute: &Attribute, index: usize) -> Span {
        let Span { file, start, .. } = attribute.value_span;
        if !attribute.is_plain() {
            return attribute.value_span;
        }
        match attribute.value.split_ascii_whitespace().nth(index) {
            Some(word) => {
                let from = start as usize + word.as_ptr() as usize - attribute.value.as_ptr() as usize;
                Span::new(file, from, from + word.len())
            }
            None => attribute.value_span,
        }
    }
}
