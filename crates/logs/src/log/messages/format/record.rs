//! The records of an MCAP file that are needed, borrowed from their bytes.
//!
//! They are read here and not by the mcap crate, which makes room for a text of the length that the
//! record states before it looks whether the record is that long.

/// A record that ends inside a field, or whose text is no UTF-8.
pub(super) const CUT: &str = "a record ends inside one of its fields";

pub(super) struct SchemaRecord<'r> {
    pub(super) id: u16,
    pub(super) name: &'r str,
    pub(super) language: &'r str,
    pub(super) text: &'r [u8],
}

pub(super) struct ChannelRecord<'r> {
    pub(super) id: u16,
    /// 0 for none.
    pub(super) schema: u16,
    pub(super) topic: &'r str,
    pub(super) encoding: &'r str,
}

pub(super) struct MessageRecord<'r> {
    pub(super) channel: u16,
    pub(super) log_ns: u64,
    pub(super) publish_ns: u64,
    pub(super) data: &'r [u8],
}

impl<'r> SchemaRecord<'r> {
    pub(super) fn parse(mut body: &'r [u8]) -> Option<Self> {
        Some(Self {
            id: u16::from_le_bytes(take(&mut body)?),
            name: text(&mut body)?,
            language: text(&mut body)?,
            text: bytes(&mut body)?,
        })
    }
}

impl<'r> ChannelRecord<'r> {
    pub(super) fn parse(mut body: &'r [u8]) -> Option<Self> {
        // What follows, its metadata, is of no interest.
        Some(Self {
            id: u16::from_le_bytes(take(&mut body)?),
            schema: u16::from_le_bytes(take(&mut body)?),
            topic: text(&mut body)?,
            encoding: text(&mut body)?,
        })
    }
}

impl<'r> MessageRecord<'r> {
    #[inline]
    pub(super) fn parse(mut body: &'r [u8]) -> Option<Self> {
        let channel = u16::from_le_bytes(take(&mut body)?);
        let _sequence: [u8; 4] = take(&mut body)?;
        Some(Self {
            channel,
            log_ns: u64::from_le_bytes(take(&mut body)?),
            publish_ns: u64::from_le_bytes(take(&mut body)?),
            data: body,
        })
    }
}

fn take<const N: usize>(body: &mut &[u8]) -> Option<[u8; N]> {
    let (taken, rest) = body.split_first_chunk()?;
    *body = rest;
    Some(*taken)
}

fn bytes<'r>(body: &mut &'r [u8]) -> Option<&'r [u8]> {
    let length = u32::from_le_bytes(take(body)?);
    let (taken, rest) = body.split_at_checked(usize::try_from(length).ok()?)?;
    *body = rest;
    Some(taken)
}

fn text<'r>(body: &mut &'r [u8]) -> Option<&'r str> {
    std::str::from_utf8(bytes(body)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_read_and_those_that_end_inside_a_field_are_not() {
        let schema = b"\x01\x00\x02\0\0\0ab\x01\0\0\0c\x03\0\0\0xyz";
        let found = SchemaRecord::parse(schema).unwrap();
        assert_eq!((found.id, found.name, found.language), (1, "ab", "c"));
        assert_eq!(found.text, b"xyz");
        let channel = b"\x02\x00\x01\x00\x02\0\0\0/t\x03\0\0\0cdr\0\0\0\0";
        let found = ChannelRecord::parse(channel).unwrap();
        assert_eq!((found.id, found.schema), (2, 1));
        assert_eq!((found.topic, found.encoding), ("/t", "cdr"));
        let message = b"\x02\x00\x09\0\0\0\x07\0\0\0\0\0\0\0\x08\0\0\0\0\0\0\0data";
        let found = MessageRecord::parse(message).unwrap();
        assert_eq!((found.channel, found.log_ns, found.publish_ns), (2, 7, 8));
        assert_eq!(found.data, b"data");
        for length in 0..schema.len() {
            assert!(SchemaRecord::parse(&schema[..length]).is_none());
        }
        for length in 0..channel.len() - 4 {
            assert!(ChannelRecord::parse(&channel[..length]).is_none());
        }
        for length in 0..message.len() - 4 {
            assert!(MessageRecord::parse(&message[..length]).is_none());
        }
    }
}
