//! Numbers out of CDR messages (OMG DDSI-RTPS, section 10) by field path, nothing else decoded.
//!
//! The definition is turned into a plan once; each message is then walked up to the last field
//! that is asked for. Numbers are aligned to their own size, counted from after the four bytes that
//! say the byte order. A length is believed only as far as the message has bytes for it.

use thiserror::Error;

use super::msg::{Count, Definition, Field, Kind, Primitive};
use super::path::{Path, Step};
use super::value::Value;

/// What is wrong with the bytes of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Malformed {
    /// The message ends inside a field.
    #[error("it ends after {bytes} bytes, inside a field")]
    Short {
        /// Length of the message.
        bytes: usize,
    },
    /// An encoding that is not plain CDR.
    #[error("its encoding {kind:#06x} is not plain CDR")]
    Encapsulation {
        /// The identifier in its first two bytes.
        kind: u16,
    },
    /// A count that the message has no bytes for.
    #[error("it declares {count} elements, for which it has no bytes")]
    Count {
        /// The count.
        count: u64,
    },
}

/// How numbers and texts are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// CDR with its four bytes of header, as ROS 2 writes it.
    Cdr,
    /// Packed little-endian numbers without padding, as ROS 1 writes them.
    Ros1,
}

/// Reads the numbers of some fields out of the messages of one type.
#[derive(Debug, Clone)]
pub(crate) struct CdrReader {
    messages: Vec<Vec<Field>>,
    encoding: Encoding,
    plan: Node,
    picks: Vec<Pick>,
    /// Place and number of the elements of each array that is asked for.
    arrays: Vec<Option<Span>>,
    array_kinds: Vec<Primitive>,
    /// Places of the texts in each list of names.
    lists: Vec<Vec<Span>>,
    outputs: usize,
}

/// Bytes from `start`: `count` elements of an array, or bytes of a text.
#[derive(Debug, Clone, Copy)]
struct Span {
    start: usize,
    count: usize,
}

/// What is taken from a message: its fields in order, those of no interest left out.
#[derive(Debug, Clone, Default)]
struct Node {
    slots: Vec<(usize, Slot)>,
}

#[derive(Debug, Clone)]
enum Slot {
    /// A number for this output.
    Number(Vec<usize>),
    /// An array of numbers, remembered under this index.
    Array(usize),
    /// A list of texts, remembered under this index.
    List(usize),
    /// A message.
    Inner(Node),
    /// Some elements of an array of messages.
    Elements(Vec<(usize, Node)>),
}

/// An element of an array for one output.
#[derive(Debug, Clone)]
struct Pick {
    output: usize,
    array: usize,
    by: By,
}

#[derive(Debug, Clone)]
enum By {
    Index(usize),
    Name {
        list: usize,
        name: String,
        /// Where it stood in the message before: most likely there again.
        last: usize,
    },
}

/// Where a path leads, before it becomes part of the plan.
struct Route {
    /// Field indices and, between them, indices of elements.
    hops: Vec<Hop>,
    end: End,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Hop {
    Field(usize),
    Element(usize),
}

enum End {
    Number,
    Element(usize, Primitive),
    /// An element by its name: the route to the list of names.
    Named(Vec<Hop>, String, Primitive),
}

impl CdrReader {
    /// Plans the reading of `fields`: for each the paths it may have, the first that leads to a
    /// number is taken. Says for each whether one does.
    pub(crate) fn new(
        definition: &Definition,
        encoding: Encoding,
        fields: &[Vec<Path>],
    ) -> (Self, Vec<bool>) {
        let mut reader = Self {
            messages: definition.messages.clone(),
            encoding,
            plan: Node::default(),
            picks: Vec::new(),
            arrays: Vec::new(),
            array_kinds: Vec::new(),
            lists: Vec::new(),
            outputs: fields.len(),
        };
        let mut found = Vec::with_capacity(fields.len());
        for (output, paths) in fields.iter().enumerate() {
            let route = paths
                .iter()
                .find_map(|path| route(&reader.messages, &path.steps));
            found.push(route.is_some());
            if let Some(route) = route {
                reader.add(output, route);
            }
        }
        (reader, found)
    }

    fn add(&mut self, output: usize, route: Route) {
        let by = match route.end {
            End::Number => {
                if let Slot::Number(outputs) =
                    slot(&mut self.plan, &route.hops, || Slot::Number(Vec::new()))
                {
                    outputs.push(output);
                }
                return;
            }
            End::Element(index, _) => By::Index(index),
            End::Named(ref list, ref name, _) => {
                let next = self.lists.len();
                let list = match slot(&mut self.plan, list, || Slot::List(next)) {
                    Slot::List(list) => *list,
                    _ => return,
                };
                if list == next {
                    self.lists.push(Vec::new());
                }
                By::Name {
                    list,
                    name: name.clone(),
                    last: 0,
                }
            }
        };
        let (End::Element(_, kind) | End::Named(_, _, kind)) = route.end else {
            return;
        };
        let next = self.arrays.len();
        let Slot::Array(array) = slot(&mut self.plan, &route.hops, || Slot::Array(next)) else {
            return;
        };
        let array = *array;
        if array == next {
            self.arrays.push(None);
            self.array_kinds.push(kind);
        }
        self.picks.push(Pick { output, array, by });
    }

    /// Reads the fields of one message into `out`, one value for each field that was asked for.
    ///
    /// # Errors
    /// [`Malformed`]: the bytes are no message of this type.
    pub(crate) fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), Malformed> {
        out.fill(Value::Absent);
        if out.len() != self.outputs {
            return Ok(());
        }
        self.arrays.fill(None);
        self.lists.iter_mut().for_each(Vec::clear);
        let mut cursor = Cursor::new(data, self.encoding)?;
        let mut walk = Walk {
            messages: &self.messages,
            arrays: &mut self.arrays,
            lists: &mut self.lists,
            out,
        };
        walk.message(&mut cursor, 0, Some(&self.plan))?;
        for pick in &mut self.picks {
            let Some(Some(array)) = self.arrays.get(pick.array) else {
                continue;
            };
            let index = match &mut pick.by {
                By::Index(index) => *index,
                By::Name { list, name, last } => {
                    let names = self.lists.get(*list).map_or(&[][..], Vec::as_slice);
                    match find(cursor.data, names, name, *last) {
                        Some(index) => {
                            *last = index;
                            index
                        }
                        None => continue,
                    }
                }
            };
            let kind = self.array_kinds[pick.array];
            if index < array.count {
                let at = array.start + index * kind.size();
                out[pick.output] = cursor.number_at(at, kind)?;
            }
        }
        Ok(())
    }

    /// Names in the lists of the message that was read last, for messages to the user.
    pub(crate) fn names(&self, data: &[u8]) -> Vec<String> {
        let body = match self.encoding {
            Encoding::Cdr => data.get(4..).unwrap_or_default(),
            Encoding::Ros1 => data,
        };
        let texts = self.lists.iter().flatten();
        texts
            .filter_map(|span| body.get(span.start..span.start + span.count))
            .map(|bytes| String::from_utf8_lossy(bytes).into_owned())
            .collect()
    }
}

/// Index of a name, where it stood before or anywhere else.
fn find(data: &[u8], names: &[Span], name: &str, last: usize) -> Option<usize> {
    let is = |span: &Span| data.get(span.start..span.start + span.count) == Some(name.as_bytes());
    if names.get(last).is_some_and(is) {
        return Some(last);
    }
    names.iter().position(is)
}

/// Follows a path through the types.
fn route(messages: &[Vec<Field>], steps: &[Step]) -> Option<Route> {
    let mut hops = Vec::new();
    let mut inside = 0;
    let mut steps = steps.iter().peekable();
    // Messages on the way, with the hops that lead to them: where lists of names are looked for.
    let mut outer = vec![(0, 0)];
    loop {
        let Step::Field(name) = steps.next()? else {
            return None;
        };
        let (index, field) = find_field(&messages[inside], name)?;
        hops.push(Hop::Field(index));
        let selector = match field.count {
            Count::One => None,
            Count::Fixed(_) | Count::Sequence => Some(steps.next()?),
        };
        let number = match selector {
            None => None,
            Some(Step::Index(index)) => Some(*index),
            Some(Step::Field(digits)) => Some(digits.parse().ok()?),
            Some(Step::Named { list, value }) => {
                let Kind::Primitive(kind) = field.kind else {
                    return None;
                };
                let list = outer.iter().rev().find_map(|(message, depth)| {
                    let (index, field) = find_field(&messages[*message], list)?;
                    let texts = field.kind == Kind::String && field.count != Count::One;
                    texts.then(|| [&hops[..*depth], &[Hop::Field(index)]].concat())
                })?;
                return steps.next().is_none().then(|| Route {
                    hops,
                    end: End::Named(list, value.clone(), kind),
                });
            }
        };
        match field.kind {
            Kind::String | Kind::WideString => return None,
            Kind::Primitive(kind) => {
                let end = match number {
                    None => End::Number,
                    Some(number) => End::Element(number, kind),
                };
                return steps.next().is_none().then_some(Route { hops, end });
            }
            Kind::Message(message) => {
                hops.extend(number.map(Hop::Element));
                inside = message;
                outer.push((message, hops.len()));
            }
        }
    }
}

fn find_field<'f>(fields: &'f [Field], name: &str) -> Option<(usize, &'f Field)> {
    fields.iter().enumerate().find(|(_, f)| f.name == name)
}

/// The slot at the end of some hops, made where there is none.
fn slot<'n>(mut node: &'n mut Node, hops: &[Hop], new: impl FnOnce() -> Slot) -> &'n mut Slot {
    let mut rest = hops;
    loop {
        let (field, tail) = match rest.split_first() {
            Some((Hop::Field(field), tail)) => (*field, tail),
            // Hops begin with a field, and an element is followed by one.
            _ => (0, &[][..]),
        };
        if tail.is_empty() {
            return node.entry(field, new);
        }
        rest = tail;
        node = match tail[0] {
            Hop::Field(_) => match node.entry(field, || Slot::Inner(Node::default())) {
                Slot::Inner(inner) => inner,
                other => return other,
            },
            Hop::Element(element) => {
                rest = &tail[1..];
                let elements = match node.entry(field, || Slot::Elements(Vec::new())) {
                    Slot::Elements(elements) => elements,
                    other => return other,
                };
                let at = elements.partition_point(|(index, _)| *index < element);
                if elements.get(at).is_none_or(|(index, _)| *index != element) {
                    elements.insert(at, (element, Node::default()));
                }
                &mut elements[at].1
            }
        };
    }
}

impl Node {
    fn entry(&mut self, field: usize, new: impl FnOnce() -> Slot) -> &mut Slot {
        let at = self.slots.partition_point(|(index, _)| *index < field);
        if self.slots.get(at).is_none_or(|(index, _)| *index != field) {
            self.slots.insert(at, (field, new()));
        }
        &mut self.slots[at].1
    }
}

/// The bytes of one message, and how far they are read.
struct Cursor<'d> {
    data: &'d [u8],
    at: usize,
    big: bool,
    /// Largest alignment; 1 for none.
    align: usize,
    /// Length of the message with its header, for errors.
    total: usize,
}

impl<'d> Cursor<'d> {
    fn new(data: &'d [u8], encoding: Encoding) -> Result<Self, Malformed> {
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
                    _ => return Err(Malformed::Encapsulation { kind }),
                }
            }
            (Encoding::Cdr, _) => return Err(Malformed::Short { bytes: total }),
        };
        Ok(Self {
            data,
            at: 0,
            big,
            align,
            total,
        })
    }

    fn short(&self) -> Malformed {
        Malformed::Short { bytes: self.total }
    }

    #[inline]
    fn align_to(&mut self, size: usize) {
        let size = size.min(self.align);
        self.at = self.at.next_multiple_of(size);
    }

    /// Passes over `count` bytes; where they begin.
    #[inline]
    fn pass(&mut self, count: usize) -> Result<usize, Malformed> {
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
    fn bytes_at<const N: usize>(&self, at: usize) -> Result<[u8; N], Malformed> {
        let bytes = self.data.get(at..).and_then(|tail| tail.first_chunk());
        let mut bytes: [u8; N] = *bytes.ok_or_else(|| self.short())?;
        if self.big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    #[inline]
    fn number_at(&self, at: usize, kind: Primitive) -> Result<Value, Malformed> {
        Ok(match kind {
            Primitive::F64 => Value::Float(f64::from_le_bytes(self.bytes_at(at)?)),
            Primitive::F32 => Value::Float(f32::from_le_bytes(self.bytes_at(at)?).into()),
            Primitive::Bool | Primitive::U8 => {
                Value::Int(u8::from_le_bytes(self.bytes_at(at)?).into())
            }
            Primitive::I8 => Value::Int(i8::from_le_bytes(self.bytes_at(at)?).into()),
            Primitive::U16 => Value::Int(u16::from_le_bytes(self.bytes_at(at)?).into()),
            Primitive::I16 => Value::Int(i16::from_le_bytes(self.bytes_at(at)?).into()),
            Primitive::U32 => Value::Int(u32::from_le_bytes(self.bytes_at(at)?).into()),
            Primitive::I32 => Value::Int(i32::from_le_bytes(self.bytes_at(at)?).into()),
            Primitive::U64 => Value::Unsigned(u64::from_le_bytes(self.bytes_at(at)?)),
            Primitive::I64 => Value::Int(i64::from_le_bytes(self.bytes_at(at)?)),
        })
    }

    fn length(&mut self) -> Result<usize, Malformed> {
        self.align_to(4);
        let at = self.pass(4)?;
        Ok(u32::from_le_bytes(self.bytes_at(at)?) as usize)
    }

    /// Number of elements of a field; refused where fewer bytes than elements are left.
    fn count(&mut self, count: Count) -> Result<usize, Malformed> {
        let count = match count {
            Count::One => return Ok(1),
            Count::Fixed(count) => count,
            Count::Sequence => self.length()?,
        };
        if count > self.data.len().saturating_sub(self.at) {
            return Err(Malformed::Count {
                count: count as u64,
            });
        }
        Ok(count)
    }

    /// A text without its closing NUL.
    fn text(&mut self) -> Result<Span, Malformed> {
        let length = self.length()?;
        let start = self.pass(length)?;
        let closed = length > 0 && self.data.get(start + length - 1) == Some(&0);
        Ok(Span {
            start,
            count: length - usize::from(closed),
        })
    }

    fn primitives(&mut self, count: usize, kind: Primitive) -> Result<Span, Malformed> {
        if count == 0 {
            return Ok(Span {
                start: self.at,
                count,
            });
        }
        self.align_to(kind.size());
        let bytes = count.checked_mul(kind.size()).ok_or_else(|| self.short())?;
        let start = self.pass(bytes)?;
        Ok(Span { start, count })
    }
}

/// One message being walked, and where its numbers go.
struct Walk<'w> {
    messages: &'w [Vec<Field>],
    arrays: &'w mut [Option<Span>],
    lists: &'w mut [Vec<Span>],
    out: &'w mut [Value],
}

impl Walk<'_> {
    /// Walks a message, to its end where it is not the outermost.
    fn message(
        &mut self,
        cursor: &mut Cursor<'_>,
        message: usize,
        node: Option<&Node>,
    ) -> Result<(), Malformed> {
        let mut wanted = node.map_or(&[][..], |node| &node.slots).iter().peekable();
        let messages = self.messages;
        for (index, field) in messages[message].iter().enumerate() {
            let slot = match wanted.peek() {
                Some((at, slot)) if *at == index => {
                    wanted.next();
                    Some(slot)
                }
                // Nothing more is asked for; what follows the outermost message does not matter.
                None if node.is_some() && message == 0 => return Ok(()),
                _ => None,
            };
            self.field(cursor, field, slot)?;
        }
        Ok(())
    }

    fn field(
        &mut self,
        cursor: &mut Cursor<'_>,
        field: &Field,
        slot: Option<&Slot>,
    ) -> Result<(), Malformed> {
        let count = cursor.count(field.count)?;
        match field.kind {
            Kind::Primitive(kind) => {
                let span = cursor.primitives(count, kind)?;
                match slot {
                    Some(Slot::Number(outputs)) => {
                        let value = cursor.number_at(span.start, kind)?;
                        for output in outputs {
                            self.out[*output] = value;
                        }
                    }
                    Some(Slot::Array(array)) => self.arrays[*array] = Some(span),
                    _ => {}
                }
            }
            Kind::String => {
                for _ in 0..count {
                    let text = cursor.text()?;
                    if let Some(Slot::List(list)) = slot {
                        self.lists[*list].push(text);
                    }
                }
            }
            Kind::WideString => {
                for _ in 0..count {
                    let length = cursor.length()?;
                    let bytes = length.checked_mul(2).ok_or_else(|| cursor.short())?;
                    cursor.pass(bytes)?;
                }
            }
            Kind::Message(message) => {
                let mut elements = match slot {
                    Some(Slot::Elements(elements)) => elements.as_slice(),
                    _ => &[],
                };
                for index in 0..count {
                    let inner = match (slot, elements.first()) {
                        (Some(Slot::Inner(node)), _) => Some(node),
                        (_, Some((element, node))) if *element == index => {
                            elements = &elements[1..];
                            Some(node)
                        }
                        _ => None,
                    };
                    self.message(cursor, message, inner)?;
                }
            }
        }
        Ok(())
    }
}
