//! Changes of a text of XML by its elements: every other byte stays as it is written.

use std::collections::BTreeMap;
use std::ops::Range;

use cft_ident_files::config::xml::{Element, tag_end};

/// Changes that are gathered before the first is made.
pub(super) struct TextEdits<'p> {
    /// The text with spaces in place of comments.
    plain: &'p str,
    /// Attributes to be set or taken out, by the place of their tag.
    tags: BTreeMap<usize, Vec<(&'static str, Option<String>)>>,
    /// What stands in place of the `/>` of elements of a single tag, by the place of that.
    filled: BTreeMap<usize, String>,
    pieces: Vec<(Range<usize>, String)>,
}

impl<'p> TextEdits<'p> {
    pub(super) fn of(plain: &'p str) -> Self {
        Self {
            plain,
            tags: BTreeMap::new(),
            filled: BTreeMap::new(),
            pieces: Vec::new(),
        }
    }

    pub(super) fn set(&mut self, of: &Element, attribute: &'static str, value: impl Into<String>) {
        let all = self.tags.entry(of.range().start).or_default();
        all.push((attribute, Some(value.into())));
    }

    pub(super) fn remove_attribute(&mut self, of: &Element, attribute: &'static str) {
        let all = self.tags.entry(of.range().start).or_default();
        all.push((attribute, None));
    }

    pub(super) fn replace(&mut self, of: &Element, with: &str) {
        self.pieces.push((of.range(), with.to_owned()));
    }

    /// Puts a text in front of an element.
    pub(super) fn put_before(&mut self, of: &Element, text: String) {
        let at = of.range().start;
        self.pieces.push((at..at, text));
    }

    /// Puts a text behind the end of an element.
    pub(super) fn put_behind(&mut self, of: &Element, text: &str) {
        let at = of.range().end;
        self.pieces.push((at..at, text.to_owned()));
    }

    /// Puts a text behind the begin of an element, one of a single tag gets an end.
    pub(super) fn put_into(&mut self, of: &Element, text: &str) {
        let start = of.range().start;
        let end = tag_end(self.plain, start);
        if self.plain[start..end].ends_with("/>") {
            // its tag may be changed too, and both are one piece
            self.tags.entry(start).or_default();
            let inner = format!(">\n{text}\n</{}>", of.name());
            self.filled.insert(start, inner);
        } else {
            self.pieces.push((end..end, format!("\n{text}")));
        }
    }

    /// Puts a text before the end of an element that has one.
    pub(super) fn put_last(&mut self, of: &Element, text: &str) {
        let range = of.range();
        let end = self.plain[range.clone()]
            .rfind("</")
            .map_or(range.end, |at| range.start + at);
        self.pieces.push((end..end, text.to_owned()));
    }

    /// Takes the tags of an element away, what it holds stays.
    pub(super) fn unwrap(&mut self, of: &Element) {
        let range = of.range();
        let end = tag_end(self.plain, range.start);
        self.pieces.push((range.start..end, String::new()));
        if let Some(at) = self.plain[end..range.end].rfind("</") {
            self.pieces.push((end + at..range.end, String::new()));
        }
    }

    pub(super) fn made(self, text: &str) -> String {
        let mut pieces = self.pieces;
        for (begin, attributes) in self.tags {
            let tag = begin..tag_end(self.plain, begin);
            let mut anew = attributes
                .iter()
                .fold(self.plain[tag.clone()].to_owned(), |tag, (name, value)| {
                    with_attribute(&tag, name, value.as_deref())
                });
            if let Some(inner) = self.filled.get(&begin) {
                anew.truncate(anew.len() - 2);
                anew.push_str(inner);
            }
            pieces.push((tag, anew));
        }
        // what is put behind a tag begins where that ends; what stands before another stays before it
        pieces.sort_by_key(|(range, _)| (range.start, range.end));
        let mut out = text.to_owned();
        for (range, anew) in pieces.into_iter().rev() {
            out.replace_range(range, &anew);
        }
        out
    }
}

/// A tag with an attribute set or taken out: in the place of the old value, or behind the others.
fn with_attribute(tag: &str, name: &str, value: Option<&str>) -> String {
    // the whole of the old one, and its value in it
    let old = tag.match_indices(name).find_map(|(at, _)| {
        let begins = tag[..at].ends_with(|c: char| c.is_ascii_whitespace());
        let rest = tag[at + name.len()..].trim_start();
        let rest = rest.strip_prefix('=')?.trim_start();
        let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let length = rest[1..].find(quote)?;
        let start = tag.len() - rest.len() + 1;
        begins.then_some((at - 1..start + length + 1, start..start + length))
    });
    let mut out = tag.to_owned();
    match (old, value) {
        (Some((_, inner)), Some(value)) => out.replace_range(inner, value),
        (Some((whole, _)), None) => out.replace_range(whole, ""),
        (None, Some(value)) => {
            let end = out
                .trim_end_matches('>')
                .trim_end_matches('/')
                .trim_end()
                .len();
            out.insert_str(end, &format!(" {name}=\"{value}\""));
        }
        (None, None) => {}
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_files::config::xml::XmlTree;

    #[test]
    fn an_element_of_a_single_tag_takes_an_attribute_and_a_child_at_once() {
        let text = "<a><b x='1'/></a>";
        let tree = XmlTree::parse(text).unwrap();
        let b = tree.root().child("b").unwrap();
        for child_first in [true, false] {
            let mut edits = TextEdits::of(text);
            if child_first {
                edits.put_into(&b, "<c/>");
            }
            edits.set(&b, "x", "2");
            edits.set(&b, "longer", "3 4 5");
            if !child_first {
                edits.put_into(&b, "<c/>");
            }
            let wanted = "<a><b x='2' longer=\"3 4 5\">\n<c/>\n</b></a>";
            assert_eq!(edits.made(text), wanted);
        }
    }

    #[test]
    fn an_attribute_is_set_in_its_place_or_behind_the_others_or_goes() {
        let tag = "<joint name=\"j\" damping='1' springdamper=\"2 3\"/>";
        let set = with_attribute(tag, "damping", Some("3.0"));
        assert_eq!(
            set,
            "<joint name=\"j\" damping='3.0' springdamper=\"2 3\"/>"
        );
        let gone = with_attribute(tag, "damping", None);
        assert_eq!(gone, "<joint name=\"j\" springdamper=\"2 3\"/>");
        let more = with_attribute("<joint>", "armature", Some("1"));
        assert_eq!(more, "<joint armature=\"1\">");
        assert_eq!(with_attribute("<joint/>", "armature", None), "<joint/>");
    }
}
