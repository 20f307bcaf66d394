//! Types of protobuf messages, from the descriptor set that a recording carries.
//!
//! A set is what `protoc --descriptor_set_out` writes: messages of `descriptor.proto` themselves. What
//! is needed of them, names, numbers and types of fields, is read as any other message is, field by
//! field, and what a damaged set says is taken for a type that has no such fields.

use std::collections::BTreeMap;

use super::wire::{BrokenBytes, WireFields, WireValue, elements};

/// Messages inside messages inside ..., deepest.
const MAX_DEPTH: usize = 64;

/// The message types of a schema, and which of them its messages have.
#[derive(Debug, Clone)]
pub(super) struct MessageTypes {
    pub(super) messages: Vec<MessageType>,
    /// Index of the type that was asked for.
    pub(super) root: usize,
}

#[derive(Debug, Clone, Default)]
pub(super) struct MessageType {
    pub(super) fields: Vec<FieldType>,
    /// It is the pair of key and value that a map is made of.
    pub(super) is_map_entry: bool,
}

#[derive(Debug, Clone)]
pub(super) struct FieldType {
    pub(super) name: String,
    pub(super) number: u32,
    pub(super) repeated: bool,
    /// Not written where it is 0.
    pub(super) zero_if_absent: bool,
    pub(super) kind: FieldKind,
}

/// What a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FieldKind {
    Number(NumberType),
    Text,
    /// A message of this type.
    Message(usize),
    /// Bytes, groups, types that the set does not define: no number is in them.
    Other,
}

/// The types of numbers of a protobuf field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberType {
    Double,
    Float,
    Int32,
    Int64,
    Uint32,
    Uint64,
    Sint32,
    Sint64,
    Fixed32,
    Fixed64,
    Sfixed32,
    Sfixed64,
    Bool,
}

/// A field with the name of its type, which is not looked up yet.
type UnresolvedType = (FieldType, Option<String>);

/// All types of a set, by their full name.
#[derive(Default)]
struct TypeSet {
    names: BTreeMap<String, usize>,
    messages: Vec<(Vec<UnresolvedType>, bool)>,
}

impl MessageTypes {
    pub(super) fn parse(name: &str, set: &[u8]) -> Result<Self, String> {
        let damaged = |_: BrokenBytes| "its descriptor set is damaged".to_owned();
        let mut found = TypeSet::default();
        for field in WireFields::new(set) {
            if let (1, WireValue::Bytes(file)) = field.map_err(damaged)? {
                found.add_file(file).map_err(damaged)?;
            }
        }
        let full = format!(".{}", name.trim_start_matches('.'));
        let root = found.names.get(&full).copied();
        let root = root.ok_or_else(|| format!("its descriptor set does not define {name}"))?;
        let TypeSet { names, messages } = found;
        let resolve = |(mut field, type_name): UnresolvedType| {
            if matches!(field.kind, FieldKind::Message(_)) {
                let found = type_name.and_then(|name| names.get(&name).copied());
                field.kind = found.map_or(FieldKind::Other, FieldKind::Message);
            }
            field
        };
        let messages = messages.into_iter();
        let messages = messages.map(|(fields, is_map_entry)| MessageType {
            fields: fields.into_iter().map(resolve).collect(),
            is_map_entry,
        });
        Ok(Self {
            messages: messages.collect(),
            root,
        })
    }
}

impl TypeSet {
    /// `FileDescriptorProto`: package 2, messages 4, options 8, syntax 12, edition 14.
    fn add_file(&mut self, file: &[u8]) -> Result<(), BrokenBytes> {
        let mut package = String::new();
        // whether fields are left out where they are 0
        let mut implicit = false;
        for field in WireFields::new(file) {
            match field? {
                (2, WireValue::Bytes(name)) => package = format!(".{}", text(name)),
                (12, WireValue::Bytes(syntax)) => implicit |= syntax == b"proto3",
                (8, WireValue::Bytes(options)) => ask_presence(options, 50, &mut implicit)?,
                _ => {}
            }
        }
        let mut waiting: Vec<(String, &[u8], usize)> = Vec::new();
        let messages =
            |scope: &str, data, tag, depth, to: &mut Vec<_>| -> Result<(), BrokenBytes> {
                for field in WireFields::new(data) {
                    if let (number, WireValue::Bytes(message)) = field?
                        && number == tag
                        && depth < MAX_DEPTH
                    {
                        to.push((scope.to_owned(), message, depth));
                    }
                }
                Ok(())
            };
        messages(&package, file, 4, 0, &mut waiting)?;
        while let Some((scope, message, depth)) = waiting.pop() {
            let full = self.add_message(&scope, message, implicit)?;
            messages(&full, message, 3, depth + 1, &mut waiting)?;
        }
        Ok(())
    }

    /// `DescriptorProto`: name 1, fields 2, options 7 (map_entry 7); its full name.
    fn add_message(
        &mut self,
        scope: &str,
        message: &[u8],
        implicit: bool,
    ) -> Result<String, BrokenBytes> {
        let (mut full, mut fields, mut is_map_entry) = (String::new(), Vec::new(), false);
        for field in WireFields::new(message) {
            match field? {
                (1, WireValue::Bytes(name)) => full = format!("{scope}.{}", text(name)),
                (2, WireValue::Bytes(field)) => fields.push(field_type(field, implicit)?),
                (7, WireValue::Bytes(options)) => {
                    for option in WireFields::new(options) {
                        is_map_entry |= matches!(option?, (7, WireValue::Varint(1..)));
                    }
                }
                _ => {}
            }
        }
        self.names
            .entry(full.clone())
            .or_insert(self.messages.len());
        self.messages.push((fields, is_map_entry));
        Ok(full)
    }
}

/// Takes from field `features` of options, a `FeatureSet`, its field_presence 1: explicit 1, implicit 2, required 3.
fn ask_presence(options: &[u8], features: u32, implicit: &mut bool) -> Result<(), BrokenBytes> {
    for set in elements(options, features) {
        if let WireValue::Bytes(set) = set? {
            for presence in elements(set, 1) {
                if let WireValue::Varint(presence) = presence? {
                    *implicit = presence == 2;
                }
            }
        }
    }
    Ok(())
}

/// `FieldDescriptorProto`: name 1, number 3, label 4, type 5, type name 6, options 8, oneof 9, proto3_optional 17.
fn field_type(field: &[u8], mut implicit: bool) -> Result<UnresolvedType, BrokenBytes> {
    let (mut name, mut type_name) = (String::new(), None);
    let (mut number, mut label, mut kind, mut chosen) = (0, 1, 0, false);
    for item in WireFields::new(field) {
        match item? {
            (1, WireValue::Bytes(text_of)) => name = text(text_of),
            (3, WireValue::Varint(value)) => number = u32::try_from(value).unwrap_or(0),
            (4, WireValue::Varint(value)) => label = value,
            (5, WireValue::Varint(value)) => kind = value,
            (6, WireValue::Bytes(name)) => type_name = Some(text(name)),
            (8, WireValue::Bytes(options)) => ask_presence(options, 21, &mut implicit)?,
            (9, WireValue::Varint(_)) | (17, WireValue::Varint(1..)) => chosen = true,
            _ => {}
        }
    }
    let kind = match kind {
        1 => FieldKind::Number(NumberType::Double),
        2 => FieldKind::Number(NumberType::Float),
        3 => FieldKind::Number(NumberType::Int64),
        4 => FieldKind::Number(NumberType::Uint64),
        // An enumeration is a number too.
        5 | 14 => FieldKind::Number(NumberType::Int32),
        6 => FieldKind::Number(NumberType::Fixed64),
        7 => FieldKind::Number(NumberType::Fixed32),
        8 => FieldKind::Number(NumberType::Bool),
        9 => FieldKind::Text,
        11 if type_name.is_some() => FieldKind::Message(0),
        13 => FieldKind::Number(NumberType::Uint32),
        15 => FieldKind::Number(NumberType::Sfixed32),
        16 => FieldKind::Number(NumberType::Sfixed64),
        17 => FieldKind::Number(NumberType::Sint32),
        18 => FieldKind::Number(NumberType::Sint64),
        _ => FieldKind::Other,
    };
    let repeated = label == 3;
    let field = FieldType {
        name,
        number,
        repeated,
        zero_if_absent: implicit && !chosen && !repeated,
        kind,
    };
    Ok((field, type_name))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
