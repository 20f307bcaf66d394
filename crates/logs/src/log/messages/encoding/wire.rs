//! The wire format of protobuf: fields of a message one after the other, borrowed from its bytes.

/// Bytes that are no protobuf message: a field that ends behind them, or of no known form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BrokenBytes;

/// A value as the wire has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WireValue<'m> {
    Varint(u64),
    Fixed64([u8; 8]),
    Fixed32([u8; 4]),
    /// A text, a message, or numbers one after the other.
    Bytes(&'m [u8]),
}

/// The fields of a message, groups passed over, up to the first that is broken.
#[derive(Debug, Clone)]
pub(super) struct WireFields<'m> {
    rest: &'m [u8],
}

impl<'m> WireFields<'m> {
    pub(super) fn new(message: &'m [u8]) -> Self {
        Self { rest: message }
    }

    fn read(&mut self) -> Result<Option<(u32, WireValue<'m>)>, BrokenBytes> {
        let mut groups = 0usize;
        loop {
            if self.rest.is_empty() {
                return if groups == 0 {
                    Ok(None)
                } else {
                    Err(BrokenBytes)
                };
            }
            let tag = u32::try_from(varint(&mut self.rest)?).map_err(|_| BrokenBytes)?;
            let item = match tag & 7 {
                0 => WireValue::Varint(varint(&mut self.rest)?),
                1 => WireValue::Fixed64(fixed(&mut self.rest)?),
                2 => {
                    let length = varint(&mut self.rest)?;
                    let length = usize::try_from(length).map_err(|_| BrokenBytes)?;
                    WireValue::Bytes(take(&mut self.rest, length)?)
                }
                3 => {
                    groups += 1;
                    continue;
                }
                4 => {
                    groups = groups.checked_sub(1).ok_or(BrokenBytes)?;
                    continue;
                }
                5 => WireValue::Fixed32(fixed(&mut self.rest)?),
                _ => return Err(BrokenBytes),
            };
            if groups == 0 {
                return Ok(Some((tag >> 3, item)));
            }
        }
    }
}

impl<'m> Iterator for WireFields<'m> {
    type Item = Result<(u32, WireValue<'m>), BrokenBytes>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let read = self.read().transpose();
        if let Some(Err(_)) = read {
            self.rest = &[];
        }
        read
    }
}

pub(super) fn elements(
    data: &[u8],
    number: u32,
) -> impl Iterator<Item = Result<WireValue<'_>, BrokenBytes>> {
    WireFields::new(data).filter_map(move |field| match field {
        Ok((found, item)) => (found == number).then_some(Ok(item)),
        Err(broken) => Some(Err(broken)),
    })
}

/// Takes a number of changing length off the bytes: seven bits a byte, lowest first.
#[inline]
pub(super) fn varint(rest: &mut &[u8]) -> Result<u64, BrokenBytes> {
    let mut value = 0;
    for (index, byte) in rest.iter().take(10).enumerate() {
        // Of the tenth byte one bit is left; what is beyond is dropped, as everyone does.
        value |= u64::from(byte & 0x7f) << (7 * index);
        if byte & 0x80 == 0 {
            *rest = &rest[index + 1..];
            return Ok(value);
        }
    }
    Err(BrokenBytes)
}

pub(super) fn fixed<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], BrokenBytes> {
    let (bytes, tail) = rest.split_first_chunk().ok_or(BrokenBytes)?;
    *rest = tail;
    Ok(*bytes)
}

fn take<'m>(rest: &mut &'m [u8], count: usize) -> Result<&'m [u8], BrokenBytes> {
    let (bytes, tail) = rest.split_at_checked(count).ok_or(BrokenBytes)?;
    *rest = tail;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(bytes: &[u8]) -> Vec<Result<(u32, WireValue<'_>), BrokenBytes>> {
        WireFields::new(bytes).collect()
    }

    #[test]
    fn fields_of_every_form_are_read_and_groups_passed_over() {
        // The first example of the encoding's documentation: field 1 is 150.
        assert_eq!(
            fields(&[0x08, 0x96, 0x01]),
            [Ok((1, WireValue::Varint(150)))]
        );
        let bytes = [
            &[0x12, 2, b'h', b'i'][..],
            // a group of field 3 with a group of field 4 in it
            &[0x1b, 0x08, 1, 0x23, 0x24, 0x1c],
            &[0x2d, 1, 2, 3, 4],
            &[0x31, 1, 2, 3, 4, 5, 6, 7, 8],
            &[
                0x38, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1,
            ],
        ]
        .concat();
        let expected = [
            Ok((2, WireValue::Bytes(&b"hi"[..]))),
            Ok((5, WireValue::Fixed32([1, 2, 3, 4]))),
            Ok((6, WireValue::Fixed64([1, 2, 3, 4, 5, 6, 7, 8]))),
            Ok((7, WireValue::Varint(u64::MAX))),
        ];
        assert_eq!(fields(&bytes), expected);
        assert_eq!(fields(&[]), []);
    }

    #[test]
    fn broken_bytes_end_the_fields_with_an_error() {
        for bytes in [
            &[0x08][..],
            &[0x08, 0x80],
            &[0x12, 3, b'h', b'i'],
            &[
                0x12, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1,
            ],
            &[0x2d, 1, 2, 3],
            &[0x31, 1],
            &[0x1b, 0x08, 1],
            &[0x1c],
            &[0x0e],
            &[0x80; 11],
        ] {
            assert_eq!(fields(bytes), [Err(BrokenBytes)], "{bytes:?}");
        }
        assert_eq!(
            fields(&[0x08, 1, 0x0f]),
            [Ok((1, WireValue::Varint(1))), Err(BrokenBytes)]
        );
    }
}
