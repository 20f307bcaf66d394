//! Numbers out of protobuf messages by field path.
//!
//! Each path is followed through the bytes of the message as they are; nothing is decoded that no path
//! leads to, and nothing is allocated. Of a field that stands there twice the last one counts.

use std::cell::RefCell;

use super::descriptor::{FieldKind, FieldType, MessageType, MessageTypes, NumberType};
use super::elements::{count, field, number_of, packed_number, text_is};
use super::leaves::{Tree, of_tree};
use super::wire::{BrokenBytes, WireFields, WireValue, elements};
use crate::log::messages::message::{
    FieldLeaf, MOST_LEAVES, MessageReader, OpenedReader, Schema, UnevenArray,
};
use crate::log::messages::path::{FieldPath, PathStep};
use crate::log::messages::value::Value;

/// Steps that a path may have.
const MAX_PATH_STEPS: usize = 16;

/// Messages in protobuf, by the descriptor set that is their schema.
pub(super) fn open(schema: &Schema, fields: &[Vec<FieldPath>]) -> Option<OpenedReader> {
    if (&*schema.encoding, &*schema.language) != ("protobuf", "protobuf") {
        return None;
    }
    let reader = ProtoReader::new(&schema.name, &schema.text, fields);
    Some(reader.map(|reader| Box::new(reader) as Box<_>))
}

#[derive(Debug)]
struct ProtoReader {
    types: MessageTypes,
    fields: Vec<Vec<FieldPath>>,
    /// An array of the last message that does not fit its list of names.
    uneven: RefCell<Option<UnevenArray>>,
}

/// Where a path has come to.
#[derive(Clone, Copy)]
enum PathPlace<'m> {
    Message(&'m [u8], &'m MessageType),
    /// All elements of a field of the message.
    Elements(&'m [u8], &'m FieldType),
    Number(Value),
    Nothing,
}

impl MessageReader for ProtoReader {
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String> {
        self.uneven.replace(None);
        let broken = |_: BrokenBytes| "it is no protobuf message, or is cut off".to_owned();
        for field in WireFields::new(data) {
            field.map_err(broken)?;
        }
        for (paths, out) in self.fields.iter().zip(out) {
            *out = Value::Absent;
            for path in paths {
                *out = self.find(data, &path.steps).map_err(broken)?;
                if *out != Value::Absent {
                    break;
                }
            }
        }
        Ok(())
    }

    fn names(&self, _: &[u8]) -> Vec<String> {
        let root = &self.types.messages[self.types.root];
        root.fields.iter().map(|field| field.name.clone()).collect()
    }

    fn uneven(&self) -> Option<UnevenArray> {
        self.uneven.borrow().clone()
    }

    fn leaves(&self, data: &[u8]) -> Vec<FieldLeaf> {
        of_tree(&self.tree(data, self.types.root, 0))
    }
}

impl ProtoReader {
    fn new(name: &str, set: &[u8], fields: &[Vec<FieldPath>]) -> Result<Self, String> {
        Ok(Self {
            types: MessageTypes::parse(name, set)?,
            fields: fields.to_vec(),
            uneven: RefCell::default(),
        })
    }

    /// Follows a path; elements that are named are looked up beside their array, then further out.
    fn find(&self, data: &[u8], steps: &[PathStep]) -> Result<Value, BrokenBytes> {
        if steps.len() > MAX_PATH_STEPS {
            return Ok(Value::Absent);
        }
        // Places on the way.
        let mut way = [PathPlace::Nothing; MAX_PATH_STEPS + 1];
        way[0] = PathPlace::Message(data, &self.types.messages[self.types.root]);
        for (index, step) in steps.iter().enumerate() {
            // from nowhere every step leads nowhere
            way[index + 1] = self.go(&way[..=index], step)?;
        }
        Ok(match way[steps.len()] {
            PathPlace::Number(value) => value,
            _ => Value::Absent,
        })
    }

    /// One step from the last place of the way.
    fn go<'m>(
        &'m self,
        way: &[PathPlace<'m>],
        step: &PathStep,
    ) -> Result<PathPlace<'m>, BrokenBytes> {
        let Some(at) = way.last() else {
            return Ok(PathPlace::Nothing);
        };
        match (at, step) {
            (PathPlace::Message(data, kind), PathStep::Field(name)) => match field(kind, name) {
                None => Ok(PathPlace::Nothing),
                Some(field) if field.repeated => Ok(PathPlace::Elements(data, field)),
                Some(field) => self.last(data, field),
            },
            (PathPlace::Elements(data, field), PathStep::Index(index)) => {
                self.element(data, field, *index)
            }
            (PathPlace::Elements(data, field), PathStep::Field(name)) => {
                match self.map_entry(field) {
                    Some(entry) => self.map_value(data, field, entry, name),
                    None => match name.parse() {
                        Ok(index) => self.element(data, field, index),
                        Err(_) => Ok(PathPlace::Nothing),
                    },
                }
            }
            (PathPlace::Elements(data, field), PathStep::Named { list, value }) => {
                if let FieldKind::Message(kind) = field.kind {
                    let kind = &self.types.messages[kind];
                    for element in elements(data, field.number) {
                        let WireValue::Bytes(element) = element? else {
                            continue;
                        };
                        if text_is(element, kind, list, value)? {
                            return Ok(PathPlace::Message(element, kind));
                        }
                    }
                }
                for place in way.iter().rev() {
                    if let Some((index, names)) = named(place, list, value)? {
                        let numbers = count(data, field)?;
                        if numbers != names {
                            self.uneven.replace((numbers > 0).then(|| UnevenArray {
                                array: field.name.clone(),
                                numbers,
                                names,
                            }));
                            return Ok(PathPlace::Nothing);
                        }
                        return match index {
                            Some(index) => self.element(data, field, index),
                            None => Ok(PathPlace::Nothing),
                        };
                    }
                }
                Ok(PathPlace::Nothing)
            }
            _ => Ok(PathPlace::Nothing),
        }
    }

    /// A field that stands there once.
    fn last<'m>(
        &'m self,
        data: &'m [u8],
        field: &'m FieldType,
    ) -> Result<PathPlace<'m>, BrokenBytes> {
        let mut found = match (field.zero_if_absent, field.kind) {
            (true, FieldKind::Number(NumberType::Double | NumberType::Float)) => {
                PathPlace::Number(Value::Float(0.0))
            }
            (true, FieldKind::Number(_)) => PathPlace::Number(Value::Int(0)),
            _ => PathPlace::Nothing,
        };
        for item in elements(data, field.number) {
            match self.place(field.kind, item?) {
                PathPlace::Nothing => {}
                place => found = place,
            }
        }
        Ok(found)
    }

    fn place<'m>(&'m self, kind: FieldKind, item: WireValue<'m>) -> PathPlace<'m> {
        match (kind, item) {
            (FieldKind::Number(number), item) => {
                number_of(number, item).map_or(PathPlace::Nothing, PathPlace::Number)
            }
            (FieldKind::Message(kind), WireValue::Bytes(data)) => {
                PathPlace::Message(data, &self.types.messages[kind])
            }
            _ => PathPlace::Nothing,
        }
    }

    /// Element `index` of a field; numbers may lie packed one after the other.
    fn element<'m>(
        &'m self,
        data: &'m [u8],
        field: &'m FieldType,
        index: usize,
    ) -> Result<PathPlace<'m>, BrokenBytes> {
        let mut left = index;
        for item in elements(data, field.number) {
            let item = item?;
            if let (FieldKind::Number(kind), WireValue::Bytes(packed)) = (field.kind, item) {
                match packed_number(kind, packed, &mut left)? {
                    Some(value) => return Ok(PathPlace::Number(value)),
                    None => continue,
                }
            }
            if left == 0 {
                return Ok(self.place(field.kind, item));
            }
            left -= 1;
        }
        Ok(PathPlace::Nothing)
    }

    /// What a message of a type holds, as far as it can be read.
    fn tree(&self, data: &[u8], number: usize, depth: usize) -> Tree {
        if depth >= MAX_PATH_STEPS {
            return Tree::Nothing;
        }
        let of_field = |field: &FieldType| {
            let items = || elements(data, field.number).map_while(Result::ok);
            match (field.kind, field.repeated) {
                (FieldKind::Number(_), false) => Tree::Number,
                (FieldKind::Number(_), true) => Tree::Numbers(count(data, field).unwrap_or(0)),
                (FieldKind::Text, repeated) => {
                    let text = |item| match item {
                        WireValue::Bytes(text) => String::from_utf8_lossy(text).into_owned(),
                        _ => String::new(),
                    };
                    let texts: Vec<String> = items().map(text).collect();
                    match repeated {
                        true => Tree::Texts(texts),
                        false => Tree::Text(texts.into_iter().next().unwrap_or_default()),
                    }
                }
                (FieldKind::Message(inner), repeated) => {
                    let message = |item| match item {
                        WireValue::Bytes(data) => self.tree(data, inner, depth + 1),
                        _ => Tree::Nothing,
                    };
                    let mut all: Vec<Tree> = items().take(MOST_LEAVES).map(message).collect();
                    match repeated {
                        true => Tree::Elements(all),
                        false => all.pop().unwrap_or(Tree::Nothing),
                    }
                }
                (FieldKind::Other, _) => Tree::Nothing,
            }
        };
        let fields = self.types.messages[number].fields.iter();
        Tree::Fields(fields.map(|f| (f.name.clone(), of_field(f))).collect())
    }

    /// The type of a map's entries; `None` for a field that is no map.
    fn map_entry(&self, field: &FieldType) -> Option<&MessageType> {
        let FieldKind::Message(kind) = field.kind else {
            return None;
        };
        Some(&self.types.messages[kind]).filter(|kind| kind.is_map_entry)
    }

    /// The value of a key that is a text.
    fn map_value<'m>(
        &'m self,
        data: &'m [u8],
        map: &'m FieldType,
        entry: &'m MessageType,
        key: &str,
    ) -> Result<PathPlace<'m>, BrokenBytes> {
        let Some(value) = field(entry, "value") else {
            return Ok(PathPlace::Nothing);
        };
        let mut found = PathPlace::Nothing;
        for item in elements(data, map.number) {
            if let WireValue::Bytes(item) = item?
                && text_is(item, entry, "key", key)?
            {
                found = self.last(item, value)?;
            }
        }
        Ok(found)
    }
}

/// Where `value` stands in the list of texts `list` of a message, and how many it has; `None` without such a list.
fn named(
    place: &PathPlace<'_>,
    list: &str,
    value: &str,
) -> Result<Option<(Option<usize>, usize)>, BrokenBytes> {
    let PathPlace::Message(data, kind) = place else {
        return Ok(None);
    };
    let Some(field) = field(kind, list).filter(|f| f.kind == FieldKind::Text && f.repeated) else {
        return Ok(None);
    };
    let (mut found, mut names) = (None, 0);
    for item in elements(data, field.number) {
        if item? == WireValue::Bytes(value.as_bytes()) && found.is_none() {
            found = Some(names);
        }
        names += 1;
    }
    Ok(Some((found, names)))
}

#[cfg(test)]
mod tests;
