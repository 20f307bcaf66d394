//! Every number of one message with the path that leads to it, whatever the encoding.

use super::cursor::{ByteCursor, Encoding, MalformedMessage};
use super::msg::{ElementCount, ElementType, Field};
use crate::log::messages::message::{FieldLeaf, MOST_LEAVES, name_elements};
use crate::log::messages::path::{FieldPath, PathStep};

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

pub(super) fn of_tree(tree: &Tree) -> Vec<FieldLeaf> {
    let mut out = Vec::new();
    collect(tree, ("", ""), &mut Vec::new(), &mut out);
    out
}

/// Whether a path takes a message of an array by a name, so that its place is known from the message alone.
pub(super) fn is_by_name(path: &FieldPath) -> bool {
    let pairs = path.steps.windows(2);
    pairs
        .into_iter()
        .any(|pair| matches!(pair, [PathStep::Named { .. }, _]))
}

/// The path with places instead of the names of messages in arrays, as this message has them.
pub(super) fn placed(tree: &Tree, path: &FieldPath) -> Option<FieldPath> {
    let mut lists: Vec<(&str, &[String])> = Vec::new();
    let (mut at, mut steps) = (tree, Vec::new());
    let last = path.steps.len().checked_sub(1)?;
    for (k, step) in path.steps.iter().enumerate() {
        at = match (step, at) {
            (PathStep::Field(name), Tree::Fields(fields)) => {
                lists.extend(text_lists(fields));
                steps.push(step.clone());
                &fields.iter().find(|(own, _)| own == name)?.1
            }
            (PathStep::Index(index), Tree::Elements(elements)) => {
                steps.push(step.clone());
                elements.get(*index)?
            }
            (PathStep::Named { list, value }, Tree::Elements(elements)) => {
                let own =
                    |element: &Tree| own_name(element) == Some((list.as_str(), value.as_str()));
                let beside = || {
                    let (_, names) = lists.iter().rev().find(|(name, _)| name == list)?;
                    names.iter().position(|name| name == value)
                };
                let index = elements.iter().position(own).or_else(beside)?;
                steps.push(PathStep::Index(index));
                elements.get(index)?
            }
            _ if k == last => {
                steps.push(step.clone());
                at
            }
            _ => return None,
        };
    }
    Some(FieldPath::of_steps(steps))
}

fn text_lists(fields: &[(String, Tree)]) -> impl Iterator<Item = (&str, &[String])> {
    fields.iter().filter_map(|(name, tree)| match tree {
        Tree::Texts(texts) => Some((name.as_str(), texts.as_slice())),
        _ => None,
    })
}

/// Adds the numbers below a place, which `path` leads to and `label` names; `lists` are the lists of texts on the way.
fn collect<'t>(
    tree: &'t Tree,
    (path, label): (&str, &str),
    lists: &mut Vec<(&'t str, &'t [String])>,
    out: &mut Vec<FieldLeaf>,
) {
    if out.len() >= MOST_LEAVES {
        return;
    }
    match tree {
        Tree::Number => out.push(FieldLeaf {
            path: path.to_owned(),
            label: label.to_owned(),
        }),
        Tree::Numbers(count) => {
            let (list, names) = named(lists, *count).unzip();
            for index in 0..(*count).min(MOST_LEAVES - out.len()) {
                let name = names.and_then(|names: &[String]| names.get(index));
                // a bracket ends the name in a path
                let by_name = list.zip(name.filter(|name| !name.contains(']')));
                out.push(FieldLeaf {
                    path: match by_name {
                        Some((list, name)) => format!("{path}[{list}={name}]"),
                        None => format!("{path}[{index}]"),
                    },
                    label: joined(label, name.map_or(&index.to_string(), |name| name)),
                });
            }
        }
        Tree::Elements(elements) => {
            let (list, names) = named(lists, elements.len()).unzip();
            let own: Vec<Option<(&str, &str)>> = elements.iter().map(own_name).collect();
            let apart = |name: &str| {
                own.iter()
                    .flatten()
                    .filter(|(_, other)| *other == name)
                    .count()
                    == 1
            };
            for (index, element) in elements.iter().enumerate() {
                let number = index.to_string();
                let own = own[index].filter(|(_, name)| apart(name));
                let beside = || Some((list?, names?.get(index)?.as_str()));
                let found = own.or_else(beside).filter(|(_, name)| !name.contains(']'));
                let (selector, name) = match found {
                    Some((list, name)) => (format!("{list}={name}"), name),
                    None => (number.clone(), &*number),
                };
                let place = (&*format!("{path}[{selector}]"), &*joined(label, name));
                collect(element, place, lists, out);
            }
        }
        Tree::Fields(fields) => {
            let before = lists.len();
            lists.extend(text_lists(fields));
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

/// The text that a message is named by, and the field that holds it.
fn own_name(element: &Tree) -> Option<(&str, &str)> {
    let Tree::Fields(fields) = element else {
        return None;
    };
    fields.iter().find_map(|(field, tree)| match tree {
        Tree::Text(name) if !name.is_empty() => Some((field.as_str(), name.as_str())),
        _ => None,
    })
}

/// The numbers of a CDR message; those before its end where it is cut off.
pub(super) fn leaves(messages: &[Vec<Field>], encoding: Encoding, data: &[u8]) -> Vec<FieldLeaf> {
    of_tree(&tree(messages, encoding, data))
}

/// What a CDR message holds.
pub(super) fn tree(messages: &[Vec<Field>], encoding: Encoding, data: &[u8]) -> Tree {
    let mut fields = Vec::new();
    if let Ok(mut cursor) = ByteCursor::new(data, encoding) {
        // what was read before the message broke off stands
        let _ = message(messages, 0, &mut cursor, &mut fields);
    }
    Tree::Fields(fields)
}

/// The texts of a message that name others in it, as one number (FNV-1a).
pub(super) fn names_of(tree: &Tree) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut add = |text: &str| {
        for byte in text.bytes().chain([0]) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    fn walk(tree: &Tree, add: &mut dyn FnMut(&str)) {
        match tree {
            Tree::Text(text) => add(text),
            Tree::Texts(texts) => texts.iter().for_each(|text| add(text)),
            Tree::Fields(fields) => fields
                .iter()
                .filter(|(name, _)| !TIMES.contains(&name.as_str()))
                .for_each(|(_, tree)| walk(tree, add)),
            Tree::Elements(elements) => elements.iter().for_each(|tree| walk(tree, add)),
            Tree::Number | Tree::Numbers(_) | Tree::Nothing => {}
        }
    }
    walk(tree, &mut add);
    hash
}

fn message(
    messages: &[Vec<Field>],
    number: usize,
    cursor: &mut ByteCursor<'_>,
    out: &mut Vec<(String, Tree)>,
) -> Result<(), MalformedMessage> {
    for field in &messages[number] {
        let count = cursor.count(field.count)?;
        let one = field.count == ElementCount::One;
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
