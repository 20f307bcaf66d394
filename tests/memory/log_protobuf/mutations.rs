//! Seeded mutations of the descriptor set and the messages of a protobuf recording: bytes that are
//! changed, and parts of the tree of fields that are changed, moved, repeated, nested or made to
//! refer to themselves.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a field holds on the wire.
#[derive(Debug, Clone)]
enum Part {
    Varint(u64),
    Fixed64([u8; 8]),
    Fixed32([u8; 4]),
    Bytes(Vec<u8>),
    Message(Vec<Field>),
    /// Bytes whose length says that there are more.
    Lying(u64, Vec<u8>),
}

type Field = (u32, Part);

fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for index in 0..10 {
        let (&byte, tail) = rest.split_first()?;
        *rest = tail;
        value |= u64::from(byte & 0x7f) << (7 * index);
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

fn put_varint(mut value: u64, out: &mut Vec<u8>) {
    while value > 0x7f {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// The fields of a message, those that can be messages themselves as such.
fn fields(mut rest: &[u8]) -> Option<Vec<Field>> {
    let mut out = Vec::new();
    while !rest.is_empty() {
        let tag = u32::try_from(varint(&mut rest)?).ok()?;
        let part = match tag & 7 {
            0 => Part::Varint(varint(&mut rest)?),
            1 => {
                let (bytes, tail) = rest.split_first_chunk()?;
                rest = tail;
                Part::Fixed64(*bytes)
            }
            2 => {
                let length = usize::try_from(varint(&mut rest)?).ok()?;
                let (bytes, tail) = rest.split_at_checked(length)?;
                rest = tail;
                let text = bytes.iter().all(|b| b.is_ascii_graphic());
                match fields(bytes) {
                    Some(inner) if !text => Part::Message(inner),
                    _ => Part::Bytes(bytes.to_vec()),
                }
            }
            5 => {
                let (bytes, tail) = rest.split_first_chunk()?;
                rest = tail;
                Part::Fixed32(*bytes)
            }
            _ => return None,
        };
        out.push((tag >> 3, part));
    }
    Some(out)
}

/// A field with its bytes after their length.
fn put_bytes(number: u32, length: usize, data: &[u8], out: &mut Vec<u8>) {
    put_varint(u64::from(number) << 3 | 2, out);
    put_varint(length as u64, out);
    out.extend(data);
}

fn bytes(fields: &[Field]) -> Vec<u8> {
    let mut out = Vec::new();
    for (number, part) in fields {
        let tag = u64::from(*number) << 3;
        match part {
            Part::Varint(value) => {
                put_varint(tag, &mut out);
                put_varint(*value, &mut out);
            }
            Part::Fixed64(bytes) => {
                put_varint(tag | 1, &mut out);
                out.extend(bytes);
            }
            Part::Fixed32(bytes) => {
                put_varint(tag | 5, &mut out);
                out.extend(bytes);
            }
            Part::Bytes(data) => put_bytes(*number, data.len(), data, &mut out),
            Part::Lying(length, data) => put_bytes(*number, *length as usize, data, &mut out),
            Part::Message(inner) => {
                let data = bytes(inner);
                put_bytes(*number, data.len(), &data, &mut out);
            }
        }
    }
    out
}

/// Names that a definition may have or refer to.
const NAMES: [&str; 16] = [
    ".lab.Arm",
    ".lab.Joint",
    ".google.protobuf.Timestamp",
    "Arm",
    "lab.Arm",
    ".lab.Arm.Joint",
    "proto2",
    "proto3",
    "editions",
    "arm.proto",
    "google/protobuf/timestamp.proto",
    "",
    ".",
    "-1",
    "\\777",
    "\\x1\u{20ac}",
];

const NUMBERS: [u64; 12] = [
    0,
    1,
    2,
    3,
    7,
    11,
    14,
    19_000,
    (1 << 29) - 1,
    1 << 31,
    u32::MAX as u64,
    u64::MAX,
];

fn one<'a, T>(draw: &mut ChaCha8Rng, of: &'a [T]) -> &'a T {
    &of[draw.random_range(0..of.len())]
}

/// A value for a field of a definition.
fn value(draw: &mut ChaCha8Rng) -> Part {
    match draw.random_range(0..8) {
        0..3 => Part::Varint(*one(draw, &NUMBERS)),
        3 => Part::Varint(draw.random_range(0..20)),
        4..7 => Part::Bytes(one(draw, &NAMES).as_bytes().to_vec()),
        // options of a message that make it the entry of a map, those of a packed field
        _ => Part::Message(vec![(draw.random_range(1..9), Part::Varint(1))]),
    }
}

/// Some message in the tree.
fn somewhere<'t>(draw: &mut ChaCha8Rng, mut at: &'t mut Vec<Field>) -> &'t mut Vec<Field> {
    loop {
        let inner: Vec<usize> = (0..at.len())
            .filter(|i| matches!(at[*i].1, Part::Message(_)))
            .collect();
        if inner.is_empty() || draw.random_range(0..4) == 0 {
            return at;
        }
        let chosen = *one(draw, &inner);
        match &mut at[chosen].1 {
            Part::Message(inner) => at = inner,
            _ => unreachable!("it was chosen among messages"),
        }
    }
}

/// Changes a part of the tree.
fn change(draw: &mut ChaCha8Rng, tree: &mut Vec<Field>) {
    let from = somewhere(draw, tree);
    let taken = (!from.is_empty()).then(|| one(draw, from).clone());
    let at = somewhere(draw, tree);
    let index = match at.len() {
        0 => return at.push((draw.random_range(1..20), value(draw))),
        length => draw.random_range(0..length),
    };
    match draw.random_range(0..12) {
        0 => at[index].0 = *one(draw, &NUMBERS) as u32 & ((1 << 29) - 1),
        1 => at[index].0 = draw.random_range(0..20),
        2 | 3 => at[index].1 = value(draw),
        4 => at.push((draw.random_range(1..20), value(draw))),
        5 => drop(at.remove(index)),
        // a part from elsewhere, itself perhaps
        6 | 7 => at.extend(taken),
        8 => {
            let many = 1 << draw.random_range(1..8);
            let part = at[index].clone();
            at.extend(std::iter::repeat_n(part, many));
        }
        9 => {
            // as deep as a chain of fields of one number
            let (number, mut part) = at[index].clone();
            for _ in 0..1 << draw.random_range(0..11) {
                part = Part::Message(vec![(number, part)]);
            }
            at[index].1 = part;
        }
        10 => {
            let data = match &at[index].1 {
                Part::Bytes(data) => data.clone(),
                Part::Message(inner) => bytes(inner),
                _ => Vec::new(),
            };
            at[index].1 = Part::Lying(*one(draw, &NUMBERS), data);
        }
        _ => {
            // a name of its own for the type of a field: of itself, perhaps
            for (number, part) in at.iter_mut() {
                if *number == 6 {
                    *part = Part::Bytes(one(draw, &NAMES[..6]).as_bytes().to_vec());
                }
            }
        }
    }
}

/// Changes some bytes.
fn spoil(draw: &mut ChaCha8Rng, data: &mut Vec<u8>) {
    for _ in 0..draw.random_range(1..6) {
        if data.is_empty() {
            return;
        }
        let at = draw.random_range(0..data.len());
        match draw.random_range(0..5) {
            0 | 1 => data[at] = draw.random_range(0..=255),
            2 => data[at] ^= 1 << draw.random_range(0..8),
            3 => data.insert(at, draw.random_range(0..=255)),
            _ => data.truncate(at + 1),
        }
    }
}

/// The types made to hold themselves, and a message as deep as they allow.
fn cyclic(draw: &mut ChaCha8Rng, set: &[u8], message: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let mut set = fields(set).expect("the recording's own");
    for (_, file) in &mut set {
        let Part::Message(file) = file else { continue };
        // a file that needs itself
        if draw.random_range(0..2) == 0 {
            file.push((3, Part::Bytes(b"arm.proto".to_vec())));
            file.push((10, Part::Varint(draw.random_range(0..3))));
        }
        for (number, kind) in file.iter_mut() {
            let (4, Part::Message(kind)) = (*number, kind) else {
                continue;
            };
            let mut itself = vec![
                (1, Part::Bytes(b"itself".to_vec())),
                (3, Part::Varint(15)),
                (4, Part::Varint(draw.random_range(1..4))),
                (5, Part::Varint(draw.random_range(9..12))),
            ];
            itself.push((6, Part::Bytes(one(draw, &NAMES[..2]).as_bytes().to_vec())));
            kind.push((2, Part::Message(itself)));
        }
    }
    let mut deep = fields(message).expect("the recording's own");
    for _ in 0..1 << draw.random_range(0..14) {
        // groups nest as well as messages do
        deep = vec![(15, Part::Message(deep))];
    }
    (bytes(&set), bytes_flat(deep))
}

/// [`bytes`] of a message that is too deep to be followed by calls.
fn bytes_flat(mut tree: Vec<Field>) -> Vec<u8> {
    let mut numbers = Vec::new();
    while let [(number, Part::Message(_))] = &tree[..] {
        numbers.push(*number);
        let Some((_, Part::Message(inner))) = tree.pop() else {
            break;
        };
        tree = inner;
    }
    let mut data = bytes(&tree);
    for number in numbers.into_iter().rev() {
        let mut outer = Vec::with_capacity(data.len() + 8);
        put_bytes(number, data.len(), &data, &mut outer);
        data = outer;
    }
    data
}

/// One mutation of a descriptor set and of a message of it.
pub fn mutated(seed: u64, set: &[u8], message: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let draw = &mut ChaCha8Rng::seed_from_u64(seed);
    let (mut set, mut message) = (set.to_vec(), message.to_vec());
    match draw.random_range(0..20) {
        0..2 => return cyclic(draw, &set, &message),
        2 => {
            // as long as a field can honestly be
            let number = draw.random_range(1..5);
            let part = match draw.random_range(0..2) {
                0 => Part::Message(Vec::new()),
                _ => Part::Bytes(vec![0; 8 << draw.random_range(0..16)]),
            };
            let many = 1 << draw.random_range(0..4);
            message.extend(bytes(&vec![(number, part); many]));
        }
        3..6 => spoil(draw, &mut set),
        6..8 => spoil(draw, &mut message),
        kind => {
            if kind < 17 {
                let mut tree = fields(&set).expect("the recording's own");
                for _ in 0..draw.random_range(1..5) {
                    change(draw, &mut tree);
                }
                set = bytes(&tree);
            }
            if kind >= 14 {
                let mut tree = fields(&message).expect("the recording's own");
                for _ in 0..draw.random_range(1..5) {
                    change(draw, &mut tree);
                }
                message = bytes(&tree);
            }
        }
    }
    (set, message)
}
