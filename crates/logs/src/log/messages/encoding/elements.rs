//! Items of the fields of a protobuf message: all of one field, how many they are, and their numbers.

use super::descriptor::{FieldKind, FieldType, MessageType, NumberType};
use super::wire::{BrokenBytes, WireValue, elements, fixed, varint};
use crate::log::messages::value::Value;

pub(super) fn field<'t>(kind: &'t MessageType, name: &str) -> Option<&'t FieldType> {
    kind.fields.iter().find(|field| field.name == name)
}

pub(super) fn text_is(
    data: &[u8],
    kind: &MessageType,
    name: &str,
    value: &str,
) -> Result<bool, BrokenBytes> {
    let Some(field) = field(kind, name).filter(|f| f.kind == FieldKind::Text && !f.repeated) else {
        return Ok(false);
    };
    let mut is = false;
    for item in elements(data, field.number) {
        if let WireValue::Bytes(text) = item? {
            is = text == value.as_bytes();
        }
    }
    Ok(is)
}

/// Elements of a field, those that lie packed one after the other counted one by one.
pub(super) fn count(data: &[u8], field: &FieldType) -> Result<usize, BrokenBytes> {
    let mut count = 0;
    for item in elements(data, field.number) {
        count += match (field.kind, item?) {
            (FieldKind::Number(kind), WireValue::Bytes(packed)) => {
                let mut left = usize::MAX;
                packed_number(kind, packed, &mut left)?;
                usize::MAX - left
            }
            _ => 1,
        };
    }
    Ok(count)
}

/// A number as an item of its own; `None` for an item of another form.
pub(super) fn number_of(kind: NumberType, item: WireValue<'_>) -> Option<Value> {
    Some(match (kind, item) {
        (NumberType::Double, WireValue::Fixed64(bytes)) => Value::Float(f64::from_le_bytes(bytes)),
        (NumberType::Fixed64, WireValue::Fixed64(bytes)) => {
            Value::Unsigned(u64::from_le_bytes(bytes))
        }
        (NumberType::Sfixed64, WireValue::Fixed64(bytes)) => Value::Int(i64::from_le_bytes(bytes)),
        (NumberType::Float, WireValue::Fixed32(bytes)) => {
            Value::Float(f32::from_le_bytes(bytes).into())
        }
        (NumberType::Fixed32, WireValue::Fixed32(bytes)) => {
            Value::Int(u32::from_le_bytes(bytes).into())
        }
        (NumberType::Sfixed32, WireValue::Fixed32(bytes)) => {
            Value::Int(i32::from_le_bytes(bytes).into())
        }
        // Numbers of 32 bits are cut to these, as everyone does.
        (NumberType::Int32, WireValue::Varint(number)) => Value::Int((number as i32).into()),
        (NumberType::Uint32, WireValue::Varint(number)) => Value::Int((number as u32).into()),
        (NumberType::Sint32, WireValue::Varint(number)) => {
            let number = number as u32;
            Value::Int(((number >> 1) as i32 ^ -((number & 1) as i32)).into())
        }
        (NumberType::Int64, WireValue::Varint(number)) => Value::Int(number as i64),
        (NumberType::Uint64, WireValue::Varint(number)) => Value::Unsigned(number),
        (NumberType::Sint64, WireValue::Varint(number)) => {
            Value::Int((number >> 1) as i64 ^ -((number & 1) as i64))
        }
        (NumberType::Bool, WireValue::Varint(number)) => Value::Int((number != 0).into()),
        _ => return None,
    })
}

/// Number `left` of those that lie one after the other; counts `left` down where there are fewer.
pub(super) fn packed_number(
    kind: NumberType,
    packed: &[u8],
    left: &mut usize,
) -> Result<Option<Value>, BrokenBytes> {
    let size = match kind {
        NumberType::Double | NumberType::Fixed64 | NumberType::Sfixed64 => 8,
        NumberType::Float | NumberType::Fixed32 | NumberType::Sfixed32 => 4,
        _ => 1,
    };
    let mut rest = packed;
    if size > 1 {
        let count = packed.len() / size;
        if *left >= count {
            *left -= count;
            return Ok(None);
        }
        rest = &packed[*left * size..];
        let item = match size {
            8 => WireValue::Fixed64(fixed(&mut rest)?),
            _ => WireValue::Fixed32(fixed(&mut rest)?),
        };
        return Ok(number_of(kind, item));
    }
    while !rest.is_empty() {
        let number = varint(&mut rest)?;
        if *left == 0 {
            return Ok(number_of(kind, WireValue::Varint(number)));
        }
        *left -= 1;
    }
    Ok(None)
}
