//! The door to the XML reader: a text as a tree of elements that know their lines.
//!
//! The reader goes from event to event without recursion, so that no nesting exhausts the stack;
//! entities other than the five of XML, and document types that could define some, are refused.

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

/// Deepest nesting of elements. A URDF needs about ten levels.
const DEEPEST: usize = 64;
/// Most elements. The largest robots with all their meshes have some thousands.
const MOST_ELEMENTS: usize = 200_000;

/// An element, its attributes as written, its children in order. Text is left out: URDF has none.
#[derive(Debug, Default)]
pub(super) struct Element {
    pub name: String,
    pub attributes: Vec<(String, String)>,
    /// Line where it begins, from 1.
    pub line: usize,
    pub children: Vec<Element>,
}

impl Element {
    /// Value of an attribute.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(key, _)| key == name);
        found.map(|(_, value)| value.as_str())
    }

    /// First child of that name.
    pub(super) fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|child| child.name == name)
    }
}

/// What is wrong with a text, and where.
#[derive(Debug)]
pub(super) struct Malformed {
    pub line: usize,
    pub message: String,
}

/// Counts lines as the reader goes on.
struct Lines<'a> {
    text: &'a str,
    at: usize,
    line: usize,
}

impl Lines<'_> {
    /// Line of a byte that is not before the last one asked for.
    fn to(&mut self, byte: u64) -> usize {
        let byte = usize::try_from(byte).unwrap_or(usize::MAX);
        let byte = byte.clamp(self.at, self.text.len());
        let passed = &self.text.as_bytes()[self.at..byte];
        self.line += passed.iter().filter(|b| **b == b'\n').count();
        self.at = byte;
        self.line
    }
}

/// Reads a text to its root element.
pub(super) fn root(text: &str) -> Result<Element, Malformed> {
    let mut reader = Reader::from_str(text);
    let mut lines = Lines {
        text,
        at: 0,
        line: 1,
    };
    // the elements that are open, from the root inward
    let mut open: Vec<Element> = Vec::new();
    let mut root: Option<Element> = None;
    let mut elements = 0;
    loop {
        let before = lines.to(reader.buffer_position());
        let event = reader.read_event().map_err(|error| Malformed {
            line: lines.to(reader.error_position()),
            message: format!("no well-formed XML: {error}; correct it, or export it anew"),
        })?;
        let malformed = |message: &str| Malformed {
            line: before,
            message: message.to_owned(),
        };
        match event {
            Event::Start(start) => {
                if root.is_some() {
                    return Err(malformed("a second root element; keep one <robot>"));
                }
                if open.len() >= DEEPEST {
                    return Err(malformed(&format!(
                        "elements are nested more than {DEEPEST} deep; no URDF needs that"
                    )));
                }
                elements += 1;
                open.push(element(&start, before)?);
            }
            Event::Empty(start) => {
                elements += 1;
                let done = element(&start, before)?;
                close(done, &mut open, &mut root).map_err(malformed)?;
            }
            Event::End(_) => {
                let done = open
                    .pop()
                    .ok_or_else(|| malformed("an end tag without its begin; delete it"))?;
                close(done, &mut open, &mut root).map_err(malformed)?;
            }
            Event::DocType(_) => {
                return Err(malformed(
                    "a document type, which could define entities; delete it",
                ));
            }
            Event::Eof => break,
            Event::Text(_)
            | Event::CData(_)
            | Event::Comment(_)
            | Event::Decl(_)
            | Event::PI(_)
            | Event::GeneralRef(_) => {}
        }
        if elements > MOST_ELEMENTS {
            return Err(malformed(&format!(
                "more than {MOST_ELEMENTS} elements; leave out what is no link and no joint"
            )));
        }
    }
    let line = lines.to(u64::MAX);
    if let Some(unfinished) = open.last() {
        let message = format!(
            "the text ends inside <{}> of line {}; the file is cut off",
            crate::log::escape(&unfinished.name),
            unfinished.line
        );
        return Err(Malformed { line, message });
    }
    root.ok_or_else(|| Malformed {
        line,
        message: "no element at all; give a URDF file".to_owned(),
    })
}

/// Puts a finished element into the one around it.
fn close(
    done: Element,
    open: &mut [Element],
    root: &mut Option<Element>,
) -> Result<(), &'static str> {
    match open.last_mut() {
        Some(around) => around.children.push(done),
        None if root.is_none() => *root = Some(done),
        None => return Err("a second root element; keep one <robot>"),
    }
    Ok(())
}

fn element(start: &BytesStart, line: usize) -> Result<Element, Malformed> {
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let malformed = |error: &dyn std::fmt::Display| Malformed {
            line,
            message: format!(
                "<{}>: {error}; correct the attribute",
                crate::log::escape(start.name().0)
            ),
        };
        let attribute = attribute.map_err(|error| malformed(&error))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0);
        let value = value.map_err(|error| malformed(&error))?;
        attributes.push((attribute.key.0.to_owned(), value.into_owned()));
    }
    Ok(Element {
        name: start.name().0.to_owned(),
        attributes,
        line,
        children: Vec::new(),
    })
}
