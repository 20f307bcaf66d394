//! Every number of one message with the path that leads to it, whatever the encoding.

use super::cursor::{Cursor, Encoding, MalformedMessage};
use super::msg::{Count, ElementType, Field};
use crate::log::recording::message::{Leaf, MOST_LEAVES, name_elements};

/// What a message holds, as far as numbers and the texts that name them go.
pub(super) enum Tree {
    Number,
    Text(String),
    Numbers(usize),
    Texts(Vec<String>),
    Fields(Vec<(String, Tree)>),
    Elements(Vec<Tree>),
    Nothing,
}

/// Fields that are a time and no channel.
const TIMES: [&str; 4] = ["header", "stamp", "timestamp", "layout"];

pub(super) fn of_tree(tree: &Tree) -> Vec<Leaf> {
    let mut out = Vec::new();
    collect(tree, ("", ""), &mut Vec::new(), &mut out);
    out
}

/// Adds the numbers below a place, which `path` leads to and `label` names; `lists` are the lists of texts on the way.
fn collect<'t>(
    tree: &'t Tree,
    (path, label): (&str, &str),
    lists: &mut Vec<(&'t str, &'t [String])>,
    out: &mut Vec<Leaf>,
) {
    if out.len() >= MOST_LEAVES {
        return;
    }
    match tree {
        Tree::Number => out.push(Leaf {
            path: path.to_owned(),
            label: label.to_owned(),
        }),
        Tree::Numbers(count) => {
            let (list, names) = named(lists, *count).unzip();
            for index in 0..(*count).min(MOST_LEAVES - out.len()) {
                let name = names.and_then(|names: &[String]| names.get(index));
                // a bracket ends the name in a path
                let by_name = list.zip(name.filter(|name| !name.contains(']')));
                out.push(Leaf {
                    path: match by_name {
                        Some((list, name)) => format!("{path}[{list}={name}]"),
                        None => format!("{path}[{index}]"),
                    },
                    label: joined(label, name.map_or(&index.to_string(), |name| name)),
                });
            }
        }
        Tree::Elements(elements) => {
            let names = named(lists, elements.len()).map(|(_, names)| names);
            for (index, element) in elements.iter().enumerate() {
                let number = index.to_string();
                let beside = || names.and_then(|names| names.get(index)).map(String::as_str);
                let name = own_name(element).or_else(beside).unwrap_or(&number);
                let place = (&*format!("{path}[{index}]"), &*joined(label, name));
                collect(element, place, lists, out);
            }
        }
        Tree::Fields(fields) => {
            let before = lists.len();
            lists.extend(fields.iter().filter_map(|(name, tree)| match tree {
                Tree::Texts(texts) => Some((name.as_str(), texts.as_slice())),
                _ => None,
            }));
            for (name, tree) in fields {
                if !TIMES.contains(&name.as_str()) {
                    let place = (&*joined(path, name), &*joined(label, name));
                    collect(tree, place, lists, out);
                }
            }
            lists.truncate(before);
        }
        Tree::Text(_) | Tree::Texts(_) | Tree::Nothing => {}
    }
}

fn joined(head: &str, tail: &str) -> String {
    match head.is_empty() {
        true => tail.to_owned(),
        false => format!("{head}.{tail}"),
    }
}

/// The nearest list that has a name for each of so many elements.
fn named<'t>(lists: &[(&'t str, &'t [String])], count: usize) -> Option<(&'t str, &'t [String])> {
    let mut nearest = lists.iter().rev();
    nearest
        .find(|(_, names)| name_elements(names, count))
        .copied()
}

fn own_name(element: &Tree) -> Option<&str> {
    let Tree::Fields(fields) = element else {
        return None;
    };
    fields.iter().find_map(|(_, tree)| match tree {
        Tree::Text(name) if !name.is_empty() => Some(name.as_str()),
        _ => None,
    })
}

/// The numbers of a CDR message; those before its end where it is cut off.
pub(super) fn leaves(messages: &[Vec<Field>], encoding: Encoding, data: &[u8]) -> Vec<Leaf> {
    let mut fields = Vec::new();
    if let Ok(mut cursor) = Cursor::new(data, encoding) {
        // what was read before the message broke off stands
        let _ = message(messages, 0, &mut cursor, &mut fields);
    }
    of_tree(&Tree::Fields(fields))
}

fn message(
    messages: &[Vec<Field>],
    number: usize,
    cursor: &mut Cursor<'_>,
    out: &mut Vec<(String, Tree)>,
) -> Result<(), MalformedMessage> {
    for field in &messages[number] {
        let count = cursor.count(field.count)?;
        let one = field.count == Count::One;
        let tree = match field.kind {
            ElementType::Primitive(kind) => {
                cursor.primitives(count, kind)?;
                match one {
                    true => Tree::Number,
                    false => Tree::Numbers(count),
                }
            }
            ElementType::String => {
                let mut texts = Vec::new();
                for _ in 0..count {
                    let span = cursor.text()?;
                    let text = span.text(cursor.data).unwrap_or_default();
                    texts.push(String::from_utf8_lossy(text).into_owned());
                }
                match one {
                    true => Tree::Text(texts.pop().unwrap_or_default()),
                    false => Tree::Texts(texts),
                }
            }
            ElementType::WideString => {
                for _ in 0..count {
                    cursor.wide_text()?;
                }
                Tree::Nothing
            }
            ElementType::Message(inner) => {
                let mut elements = Vec::new();
                for _ in 0..count {
                    let mut fields = Vec::new();
                    message(messages, inner, cursor, &mut fields)?;
                    if elements.len() < MOST_LEAVES {
                        elements.push(Tree::Fields(fields));
                    }
                }
                match one {
                    true => elements.pop().unwrap_or(Tree::Nothing),
                    false => Tree::Elements(elements),
                }
            }
        };
        out.push((field.name.clone(), tree));
    }
    Ok(())
}
