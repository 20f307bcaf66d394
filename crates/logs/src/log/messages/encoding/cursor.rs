//! The bytes of one CDR message, read from front to back.
//!
//! Numbers are aligned to their own size, counted from after the four bytes that say the byte order
//! (OMG DDSI-RTPS, section 10). A length is believed only as far as the message has bytes for it.

use thiserror::Error;

use super::msg::{ElementCount, PrimitiveType};
use crate::log::messages::value::Value;

#[derive(Debug, Error)]
pub(super) enum MalformedMessage {
    #[error("it ends after {0} bytes, inside a field")]
    Short(usize),
    #[error("its encoding {0:#06x} is not plain CDR")]
    Encapsulation(u16),
    #[error("it declares {0} elements, for which it has no bytes")]
    Count(usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// CDR with its four bytes of header, as ROS 2 writes it.
    Cdr,
    /// Packed little-endian numbers without padding, as ROS 1 writes them.
    Ros1,
}

/// Bytes from `start`: `count` elements of an array, or bytes of a text.
#[derive(Debug, Clone, Copy)]
pub(super) struct ByteSpan {
    pub(super) start: usize,
    pub(super) count: usize,
}

impl ByteSpan {
    pub(super) fn text(self, data: &[u8]) -> Option<&[u8]> {
        data.get(self.start..self.start + self.count)
    }
}

/// Reads numbers and texts from the bytes of a message, one after the other.
pub(super) struct ByteCursor<'d> {
    pub(super) data: &'d [u8],
    at: usize,
    big: bool,
    /// Largest alignment; 1 for none.
    align: usize,
    /// Length of the message with its header, for errors.
    total: usize,
}

impl<'d> ByteCursor<'d> {
    pub(super) fn new(data: &'d [u8], encoding: Encoding) -> Result<Self, MalformedMessage> {
        let total = data.len();
        let (data, big, align) = match (encoding, data) {
            (Encoding::Ros1, data) => (data, false, 1),
            (Encoding::Cdr, [high, low, _, _, body @ ..]) => {
                let kind = u16::from_be_bytes([*high, *low]);
                // 0 and 1: CDR; 6 and 7: the plain form of its second version, aligned to 4 at most.
                match kind {
                    0 => (body, true, 8),
                    1 => (body, false, 8),
                    6 => (body, true, 4),
                    7 => (body, false, 4),
                    _ => return Err(MalformedMessage::Encapsulation(kind)),
                }
            }
            (Encoding::Cdr, _) => return Err(MalformedMessage::Short(total)),
        };
        Ok(Self {
            data,
            at: 0,
            big,
            align,
            total,
        })
    }

    fn short(&self) -> MalformedMessage {
        MalformedMessage::Short(self.total)
    }

    #[inline]
    fn align_to(&mut self, size: usize) {
        let size = size.min(self.align);
        self.at = self.at.next_multiple_of(size);
    }

    /// Passes over `count` bytes; where they begin.
    #[inline]
    fn pass(&mut self, count: usize) -> Result<usize, MalformedMessage> {
        let start = self.at;
        match start.checked_add(count) {
            Some(end) if end <= self.data.len() => {
                self.at = end;
                Ok(start)
            }
            _ => Err(self.short()),
        }
    }

    #[inline]
    fn bytes_at<const N: usize>(&self, at: usize) -> Result<[u8; N], MalformedMessage> {
        let bytes = self.data.get(at..).and_then(|tail| tail.first_chunk());
        let mut bytes: [u8; N] = *bytes.ok_or_else(|| self.short())?;
        if self.big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    #[inline]
    pub(super) fn number_at(
        &self,
        at: usize,
        kind: PrimitiveType,
    ) -> Result<Value, MalformedMessage> {
        Ok(match kind {
            PrimitiveType::F64 => Value::Float(f64::from_le_bytes(self.bytes_at(at)?)),
            PrimitiveType::F32 => Value::Float(f32::from_le_bytes(self.bytes_at(at)?).into()),
            PrimitiveType::Bool | PrimitiveType::U8 => {
                Value::Int(u8::from_le_bytes(self.bytes_at(at)?).into())
            }
            PrimitiveType::I8 => Value::Int(i8::from_le_bytes(self.bytes_at(at)?).into()),
            PrimitiveType::U16 => Value::Int(u16::from_le_bytes(self.bytes_at(at)?).into()),
            PrimitiveType::I16 => Value::Int(i16::from_le_bytes(self.bytes_at(at)?).into()),
            PrimitiveType::U32 => Value::Int(u32::from_le_bytes(self.bytes_at(at)?).into()),
            PrimitiveType::I32 => Value::Int(i32::from_le_bytes(self.bytes_at(at)?).into()),
            PrimitiveType::U64 => Value::Unsigned(u64::from_le_bytes(self.bytes_at(at)?)),
            PrimitiveType::I64 => Value::Int(i64::from_le_bytes(self.bytes_at(at)?)),
        })
    }

    fn length(&mut self) -> Result<usize, MalformedMessage> {
        self.align_to(4);
        let at = self.pass(4)?;
        Ok(u32::from_le_bytes(self.bytes_at(at)?) as usize)
    }

    /// Number of elements of a field; refused where fewer bytes than elements are left.
    pub(super) fn count(&mut self, count: ElementCount) -> Result<usize, MalformedMessage> {
        let count = match count {
            ElementCount::One => return Ok(1),
            ElementCount::Fixed(count) => count,
            ElementCount::Sequence => self.length()?,
        };
        if count > self.data.len().saturating_sub(self.at) {
            return Err(MalformedMessage::Count(count));
        }
        Ok(count)
    }

    /// A text without its closing NUL.
    pub(super) fn text(&mut self) -> Result<ByteSpan, MalformedMessage> {
        let length = self.length()?;
        let start = self.pass(length)?;
        let closed = length > 0 && self.data.get(start + length - 1) == Some(&0);
        Ok(ByteSpan {
            start,
            count: length - usize::from(closed),
        })
    }

    pub(super) fn wide_text(&mut self) -> Result<(), MalformedMessage> {
        let length = self.length()?;
        self.pass_all(length, 2).map(|_| ())
    }

    pub(super) fn primitives(
        &mut self,
        count: usize,
        kind: PrimitiveType,
    ) -> Result<ByteSpan, MalformedMessage> {
        if count > 0 {
            self.align_to(kind.size());
        }
        let start = self.pass_all(count, kind.size())?;
        Ok(ByteSpan { start, count })
    }

    /// Passes over elements of so many bytes; where they begin.
    fn pass_all(&mut self, count: usize, size: usize) -> Result<usize, MalformedMessage> {
        self.pass(count.checked_mul(size).ok_or_else(|| self.short())?)
    }
}
