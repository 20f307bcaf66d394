//! Items of the fields of a protobuf message: all of one field, how many they are, and their numbers.

use super::descriptor::{FieldType, Kind, MessageType, Number};
use super::wire::{Broken, Item, elements, fixed, varint};
use crate::log::recording::value::Value;

pub(super) fn field<'t>(kind: &'t MessageType, name: &str) -> Option<&'t FieldType> {
    kind.fields.iter().find(|field| field.name == name)
}

pub(super) fn text_is(
    data: &[u8],
    kind: &MessageType,
    name: &str,
    value: &str,
) -> Result<bool, Broken> {
    let Some(field) = field(kind, name).filter(|f| f.kind == Kind::Text && !f.repeated) else {
        return Ok(false);
    };
    let mut is = false;
    for item in elements(data, field.number) {
        if let Item::Bytes(text) = item? {
            is = text == value.as_bytes();
        }
    }
    Ok(is)
}

/// Elements of a field, those that lie packed one after the other counted one by one.
pub(super) fn count(data: &[u8], field: &FieldType) -> Result<usize, Broken> {
    let mut count = 0;
    for item in elements(data, field.number) {
        count += match (field.kind, item?) {
            (Kind::Number(kind), Item::Bytes(packed)) => {
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
pub(super) fn number_of(kind: Number, item: Item<'_>) -> Option<Value> {
    Some(match (kind, item) {
        (Number::Double, Item::Fixed64(bytes)) => Value::Float(f64::from_le_bytes(bytes)),
        (Number::Fixed64, Item::Fixed64(bytes)) => Value::Unsigned(u64::from_le_bytes(bytes)),
        (Number::Sfixed64, Item::Fixed64(bytes)) => Value::Int(i64::from_le_bytes(bytes)),
        (Number::Float, Item::Fixed32(bytes)) => Value::Float(f32::from_le_bytes(bytes).into()),
        (Number::Fixed32, Item::Fixed32(bytes)) => Value::Int(u32::from_le_bytes(bytes).into()),
        (Number::Sfixed32, Item::Fixed32(bytes)) => Value::Int(i32::from_le_bytes(bytes).into()),
        // Numbers of 32 bits are cut to these, as everyone does.
        (Number::Int32, Item::Varint(number)) => Value::Int((number as i32).into()),
        (Number::Uint32, Item::Varint(number)) => Value::Int((number as u32).into()),
        (Number::Sint32, Item::Varint(number)) => {
            let number = number as u32;
            Value::Int(((number >> 1) as i32 ^ -((number & 1) as i32)).into())
        }
        (Number::Int64, Item::Varint(number)) => Value::Int(number as i64),
        (Number::Uint64, Item::Varint(number)) => Value::Unsigned(number),
        (Number::Sint64, Item::Varint(number)) => {
            Value::Int((number >> 1) as i64 ^ -((number & 1) as i64))
        }
        (Number::Bool, Item::Varint(number)) => Value::Int((number != 0).into()),
        _ => return None,
    })
}

/// Number `left` of those that lie one after the other; counts `left` down where there are fewer.
pub(super) fn packed_number(
    kind: Number,
    packed: &[u8],
    left: &mut usize,
) -> Result<Option<Value>, Broken> {
    let size = match kind {
        Number::Double | Number::Fixed64 | Number::Sfixed64 => 8,
        Number::Float | Number::Fixed32 | Number::Sfixed32 => 4,
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
            8 => Item::Fixed64(fixed(&mut rest)?),
            _ => Item::Fixed32(fixed(&mut rest)?),
        };
        return Ok(number_of(kind, item));
    }
    while !rest.is_empty() {
        let number = varint(&mut rest)?;
        if *left == 0 {
            return Ok(number_of(kind, Item::Varint(number)));
        }
        *left -= 1;
    }
    Ok(None)
}
