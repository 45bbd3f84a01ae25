//! XML text as a tree whose every name and value knows its place in the file.

/// Bytes `start..end` of file number `file`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    pub file: u32,
    pub start: u32,
    pub end: u32,
}

/// An element of a [`Document`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// The files of a scene (the main file and its includes) and their elements.
#[derive(Clone, Debug, Default)]
pub struct Document {}

impl Document {
    /// The element's start tag: `<geom …>` from `<` to the end of its name.
    pub fn span(&self, node: NodeId) -> Span {
        let _ = node;
        todo!()
    }
    /// The value of an attribute where the element itself has it; the element's tag where it came from a default.
    pub fn value_span(&self, node: NodeId, attribute: &str) -> Span {
        let _ = (node, attribute);
        todo!()
    }
}
