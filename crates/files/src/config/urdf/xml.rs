//! The door to the XML reader: a text as a tree of elements that know their lines.
//!
//! The reader keeps its nodes in one table, so that no nesting exhausts the stack. It refuses
//! entities other than the five of XML, and document types, which could define some.

use cft_ident_core::explain::ErrorText;
use std::borrow::Cow;

use roxmltree::{Document, Error, Node, ParsingOptions};

use cft_ident_logs::log::escape;

/// Deepest nesting of elements. A URDF needs about ten levels.
const MAX_DEPTH: usize = 64;
/// Most elements. The largest robots with all their meshes have some thousands.
const MOST_ELEMENTS: usize = 200_000;
/// Most elements and texts between them.
const MOST_NODES: u32 = 1_000_000;
/// Longest tag [bytes]: each attribute of a tag is compared with all others of it.
const LONGEST_TAG: usize = 1 << 16;
/// Most declarations of a namespace: each is kept with all that hold around it.
const MOST_NAMESPACES: usize = 1000;

/// What is wrong with an element of xacro, and the way out.
pub const MACRO: &str = "is a macro of xacro, not yet expanded";
pub const EXPAND: &str = "expand it first: `xacro robot.urdf.xacro > robot.urdf`";

/// A text with spaces in place of its comments, in which the reader is strict about `--`, and with all of its lines.
pub fn without_comments(text: &str) -> Cow<'_, str> {
    let (mut out, mut rest) = (String::new(), text);
    while let Some((before, comment)) = rest.split_once("<!--") {
        let Some((comment, after)) = comment.split_once("-->") else {
            break;
        };
        out.push_str(before);
        out.push_str("       ");
        out.extend(comment.bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }));
        rest = after;
    }
    match out.is_empty() {
        true => Cow::Borrowed(text),
        false => Cow::Owned(out + rest),
    }
}

/// What is wrong with a text, and where.
#[derive(Debug)]
pub struct MalformedText {
    pub line: usize,
    pub problem: ErrorText,
}

/// A text that was read.
pub struct XmlTree<'t> {
    document: Document<'t>,
    /// Where the lines end.
    ends: Vec<usize>,
}

/// An element of a tree.
#[derive(Clone, Copy)]
pub struct Element<'a, 't> {
    node: Node<'a, 't>,
    tree: &'a XmlTree<'t>,
}

impl<'t> XmlTree<'t> {
    /// Reads a text [`without_comments`].
    pub fn parse(text: &'t str) -> Result<Self, MalformedText> {
        let last = 1 + text.matches('\n').count();
        let refused = |problem: ErrorText| MalformedText {
            line: last,
            problem,
        };
        let long = |(start, _)| tag_end(text, start) - start > LONGEST_TAG;
        if text.match_indices('<').any(long) {
            return Err(refused(
                ErrorText::new("a tag of more than 64 kB").remedy("no robot needs that"),
            ));
        }
        if text.matches("xmlns").count() > MOST_NAMESPACES {
            return Err(refused(
                ErrorText::new("more than 1000 namespaces").remedy("delete what is not used"),
            ));
        }
        let options = ParsingOptions {
            nodes_limit: MOST_NODES,
            ..ParsingOptions::default()
        };
        let document = Document::parse_with_options(text, options)
            .map_err(|error| malformed(text, last, &error))?;
        let ends = text.match_indices('\n').map(|(at, _)| at).collect();
        let tree = Self { document, ends };
        tree.bounded()?;
        Ok(tree)
    }

    /// Refuses more and deeper elements than a robot has.
    fn bounded(&self) -> Result<(), MalformedText> {
        let (mut open, mut elements) = (Vec::new(), 0);
        for node in self.document.descendants().filter(Node::is_element) {
            while open
                .last()
                .is_some_and(|around| node.parent() != Some(*around))
            {
                open.pop();
            }
            open.push(node);
            elements += 1;
            let problem = if open.len() > MAX_DEPTH {
                ErrorText::new(format!("elements are nested more than {MAX_DEPTH} deep"))
                    .remedy("no robot needs that")
            } else if elements > MOST_ELEMENTS {
                ErrorText::new(format!("more than {MOST_ELEMENTS} elements"))
                    .remedy("leave out what is no link and no joint")
            } else {
                continue;
            };
            let line = self.line(node);
            return Err(MalformedText { line, problem });
        }
        Ok(())
    }

    pub fn root(&self) -> Element<'_, 't> {
        let node = self.document.root_element();
        Element { node, tree: self }
    }

    fn line(&self, node: Node) -> usize {
        1 + self.ends.partition_point(|end| *end < node.range().start)
    }
}

impl<'a> Element<'a, '_> {
    /// Its name as written, with the prefix of its namespace.
    pub fn name(&self) -> &'a str {
        name(&self.tree.document.input_text()[self.node.range()])
    }

    /// Line where it begins, from 1.
    pub fn line(&self) -> usize {
        self.tree.line(self.node)
    }

    /// Where it stands in the text.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.node.range()
    }

    /// Itself and all elements in it, however deep.
    pub fn descendants(self) -> impl Iterator<Item = Self> {
        let elements = self.node.descendants().filter(Node::is_element);
        elements.map(move |node| Self { node, ..self })
    }

    pub fn attribute(&self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    pub fn children(self) -> impl Iterator<Item = Self> {
        let elements = self.node.children().filter(Node::is_element);
        elements.map(move |node| Self { node, ..self })
    }

    /// First child of that name.
    pub fn child(self, name: &str) -> Option<Self> {
        self.children().find(|child| child.name() == name)
    }
}

/// End of the tag that begins at `start`: in quotes it may have a `>`, and nowhere another `<`.
pub fn tag_end(text: &str, start: usize) -> usize {
    let mut quote = None;
    for (at, byte) in text.bytes().enumerate().skip(start + 1) {
        match (quote, byte) {
            (_, b'<') => return at,
            (None, b'>') => return at + 1,
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), byte) if byte == open => quote = None,
            _ => {}
        }
    }
    text.len()
}

/// What the reader says of a text with `last` lines, with the line and the way out.
fn malformed(text: &str, last: usize, error: &Error) -> MalformedText {
    let at = error.pos();
    let (row, column) = (at.row as usize, at.col as usize);
    let here = text.lines().nth(row - 1).unwrap_or_default();
    let split = here.char_indices().nth(column - 1);
    let (before, after) = here.split_at(split.map_or(here.len(), |(at, _)| at));
    let line_of = |byte: usize| 1 + text[..byte].matches('\n').count();
    let said = escape(&error.to_string());
    let (line, what, remedy) = match error {
        Error::NoRootNode => (last, "no element at all".to_owned(), "give a URDF file"),
        Error::UnclosedRootNode | Error::UnexpectedEndOfStream => {
            let begins = |tag: &str| tag.starts_with(|c: char| c.is_alphabetic() || c == '_');
            let mut tags = text.match_indices('<').map(|(at, _)| at);
            let root = tags.find(|at| begins(&text[at + 1..])).unwrap_or(0);
            let (name, line) = (escape(name(&text[root..])), line_of(root));
            let inside = format!("the text ends inside <{name}> of line {line}");
            (last, inside, "the file is cut off")
        }
        Error::DtdDetected => {
            let line = line_of(text.find("<!DOCTYPE").unwrap_or(0));
            let what = "a document type, which could define entities";
            (line, what.to_owned(), "delete it")
        }
        Error::NodesLimitReached => {
            let what = format!("more than {MOST_NODES} elements and texts");
            (last, what, "leave out what is no link and no joint")
        }
        Error::UnknownNamespace(prefix, _) if prefix == "xacro" => {
            let name = escape(name(after));
            (row, format!("`<{name}>` {MACRO}"), EXPAND)
        }
        Error::UnknownEntityReference(..)
        | Error::MalformedEntityReference(_)
        | Error::InvalidAttributeValue(_)
        | Error::DuplicatedAttribute(..) => {
            let tag = escape(name(before.rsplit('<').next().unwrap_or_default()));
            (row, format!("<{tag}>: {said}"), "correct the attribute")
        }
        _ => {
            let what = format!("no well-formed XML: {said}");
            (row, what, "correct it, or export it anew")
        }
    };
    let problem = ErrorText::new(what).remedy(remedy);
    MalformedText { line, problem }
}

/// The name at the beginning of a tag.
fn name(tag: &str) -> &str {
    let tag = tag.strip_prefix('<').unwrap_or(tag);
    let end = |c: char| c.is_ascii_whitespace() || c == '/' || c == '>';
    tag.split(end).next().unwrap_or_default()
}
