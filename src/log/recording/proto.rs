//! Numbers out of protobuf messages by field path: the only door to prost-reflect.

use prost_reflect::{
    Cardinality, DescriptorPool, DynamicMessage, MapKey, MessageDescriptor, ReflectMessage,
    Value as Field,
};

use super::path::{Path, Step};
use super::value::Value;

/// Finds message type `name` in the descriptor set that a recording carries.
///
/// # Errors
/// What is wrong with the set, or that it lacks the type.
pub(crate) fn descriptor(name: &str, set: &[u8]) -> Result<MessageDescriptor, String> {
    let pool = DescriptorPool::decode(set).map_err(|error| error.to_string())?;
    pool.get_message_by_name(name)
        .ok_or_else(|| format!("its descriptor set does not define {name}"))
}

/// Reads `fields` of one message into `out`: for each the first of its paths that leads to a number.
///
/// # Errors
/// What the decoder says of bytes that are no message of this type.
pub(crate) fn read(
    descriptor: &MessageDescriptor,
    data: &[u8],
    fields: &[Vec<Path>],
    out: &mut [Value],
) -> Result<(), String> {
    let decoded = DynamicMessage::decode(descriptor.clone(), data);
    let root = Field::Message(decoded.map_err(|error| error.to_string())?);
    for (paths, out) in fields.iter().zip(out) {
        let numbers = paths.iter().map(|path| find(&root, &path.steps));
        *out = numbers
            .into_iter()
            .find(|value| *value != Value::Absent)
            .unwrap_or_default();
    }
    Ok(())
}

fn number(field: &Field) -> Value {
    match field {
        Field::Bool(value) => Value::Int((*value).into()),
        Field::I32(value) | Field::EnumNumber(value) => Value::Int((*value).into()),
        Field::U32(value) => Value::Int((*value).into()),
        Field::I64(value) => Value::Int(*value),
        Field::U64(value) => Value::Unsigned(*value),
        Field::F32(value) => Value::Float((*value).into()),
        Field::F64(value) => Value::Float(*value),
        _ => Value::Absent,
    }
}

/// Where a step leads: to a field that the message holds, or to a number that is left out because
/// it is 0.
enum Stop<'f> {
    Field(&'f Field),
    Zero(Value),
}

/// Follows a path; elements that are named are looked up beside their array, then further out.
fn find(root: &Field, steps: &[Step]) -> Value {
    let mut at = root;
    let mut outer = vec![root];
    let mut steps = steps.iter();
    while let Some(step) = steps.next() {
        match go(at, step, &outer) {
            None => return Value::Absent,
            Some(Stop::Zero(value)) if steps.len() == 0 => return value,
            Some(Stop::Zero(_)) => return Value::Absent,
            Some(Stop::Field(field)) => at = field,
        }
        outer.push(at);
    }
    number(at)
}

fn go<'f>(at: &'f Field, step: &Step, outer: &[&'f Field]) -> Option<Stop<'f>> {
    let field = match (step, at) {
        (Step::Field(name), Field::Message(message)) => return member(message, name),
        (Step::Field(name), Field::Map(map)) => map.get(&MapKey::String(name.clone()))?,
        (Step::Field(name), Field::List(list)) => list.get(name.parse::<usize>().ok()?)?,
        (Step::Index(index), Field::List(list)) => list.get(*index)?,
        (Step::Named { list, value }, Field::List(elements)) => {
            let is = |field: &Field| field.as_str() == Some(value);
            let own = |element: &&Field| match element {
                Field::Message(message) => text(message, list).is_some_and(is),
                _ => false,
            };
            match elements.iter().find(own) {
                Some(element) => element,
                None => {
                    let names = outer.iter().rev().find_map(|o| match o {
                        Field::Message(message) => text(message, list)?.as_list(),
                        _ => None,
                    })?;
                    elements.get(names.iter().position(is)?)?
                }
            }
        }
        _ => return None,
    };
    Some(Stop::Field(field))
}

/// A field that a message holds.
fn text<'f>(message: &'f DynamicMessage, name: &str) -> Option<&'f Field> {
    message
        .fields()
        .find(|(descriptor, _)| descriptor.name() == name)
        .map(|(_, field)| field)
}

fn member<'f>(message: &'f DynamicMessage, name: &str) -> Option<Stop<'f>> {
    if let Some(field) = text(message, name) {
        return Some(Stop::Field(field));
    }
    let descriptor = message.descriptor().get_field_by_name(name)?;
    // A number without presence that is 0 is not written.
    if descriptor.supports_presence() || descriptor.cardinality() == Cardinality::Repeated {
        return None;
    }
    match number(&descriptor.default_value()) {
        Value::Absent => None,
        zero => Some(Stop::Zero(zero)),
    }
}

/// Names of the message's fields, for messages to the user.
pub(crate) fn names(descriptor: &MessageDescriptor) -> Vec<String> {
    let fields = descriptor.fields();
    fields.map(|field| field.name().to_owned()).collect()
}
