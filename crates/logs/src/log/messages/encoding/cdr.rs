//! Numbers out of CDR messages by field path, nothing else decoded.
//!
//! The definition is turned into a plan once; each message is then walked up to the last field
//! that is asked for.

use super::cursor::{ByteCursor, ByteSpan, Encoding, MalformedMessage};
use super::leaves;
use super::msg::{self, ElementType, Field, MessageFields};
use super::plan::{ElementSelector, MessagePlan, PlanNode, PlanSlot};
use crate::log::messages::message::{FieldLeaf, MessageReader, OpenedReader, Schema, UnevenArray};
use crate::log::messages::path::{FieldPath, PathStep};
use crate::log::messages::value::Value;

/// Messages in CDR, and in the packed form of ROS 1, by their `.msg` definitions.
pub(super) fn open(schema: &Schema, fields: &[Vec<FieldPath>]) -> Option<OpenedReader> {
    let encoding = match (schema.encoding.as_str(), schema.language.as_str()) {
        ("cdr", _) => Encoding::Cdr,
        ("ros1", "ros1msg" | "") => Encoding::Ros1,
        _ => return None,
    };
    let reader = || -> OpenedReader {
        let text = std::str::from_utf8(&schema.text)
            .map_err(|_| "its definition is no text".to_owned())?;
        let other = !matches!(&*schema.language, "ros2msg" | "ros1msg" | "")
            || text.contains("\nIDL:")
            || text.starts_with("IDL:");
        // what the type is called says how it is laid out, where it is one that is known here
        let text = if other { "" } else { text };
        let messages = msg::parse(&schema.name, text).map_err(|error| match other {
            true => format!(
                "its definition is `{}`, which is read for sensor_msgs/msg/JointState alone",
                schema.language
            ),
            false => error,
        })?;
        Ok(Box::new(CdrReader::new(messages, encoding, fields)))
    };
    Some(reader())
}

/// Reads the numbers of some fields out of the messages of one type.
#[derive(Debug, Clone)]
pub struct CdrReader {
    messages: MessageFields,
    encoding: Encoding,
    plan: MessagePlan,
    /// Place and number of the elements of each array that is asked for.
    arrays: Vec<Option<ByteSpan>>,
    /// Places of the texts in each list of names.
    lists: Vec<Vec<ByteSpan>>,
    /// Of each output the name of the array that is asked for an element by its name.
    labels: Vec<String>,
    uneven: Option<UnevenArray>,
    order: u64,
    /// Fields that are messages of arrays by their names, and the names in the message that they were placed by.
    by_name: Option<(Vec<Vec<FieldPath>>, Option<u64>)>,
}

impl CdrReader {
    /// Plans the reading of some fields of message type `name` (`package/msg/Type`), given by paths
    /// such as `header.stamp.sec`, `position[2]` or `position[name=arm]`, from ROS 2 messages.
    ///
    /// `definition` is the type's `.msg` text with its dependencies, as recordings hold it; it may be
    /// empty for `sensor_msgs/msg/JointState` and some others. A path that leads to no number gives
    /// [`Value::Absent`].
    ///
    /// # Errors
    /// Why the definition cannot be used.
    pub fn parse(name: &str, definition: &str, paths: &[&str]) -> Result<Self, String> {
        let messages = msg::parse(name, definition)?;
        Ok(Self::new(messages, Encoding::Cdr, &FieldPath::each(paths)))
    }

    /// The fields of one message, in the order of their paths.
    ///
    /// # Errors
    /// Why the bytes are no message of this type.
    pub fn values(&mut self, data: &[u8]) -> Result<Vec<Value>, String> {
        let mut out = vec![Value::Absent; self.labels.len()];
        self.read(data, &mut out)?;
        Ok(out)
    }

    /// Plans the reading of `fields`: of the paths that each may have the first that leads to a number.
    fn new(messages: MessageFields, encoding: Encoding, fields: &[Vec<FieldPath>]) -> Self {
        let mut plan = MessagePlan::default();
        for (output, paths) in fields.iter().enumerate() {
            let mut paths = paths.iter();
            paths.any(|path| plan.add(&messages, &path.steps, output));
        }
        Self {
            messages,
            encoding,
            arrays: vec![None; plan.arrays.len()],
            lists: vec![Vec::new(); plan.lists],
            plan,
            labels: fields.iter().map(|paths| label(paths)).collect(),
            uneven: None,
            order: 0,
            by_name: fields
                .iter()
                .flatten()
                .any(leaves::is_by_name)
                .then(|| (fields.to_vec(), None)),
        }
    }

    /// Finds the messages of arrays that are asked for by name, where they stand elsewhere than in the message before.
    fn place(&mut self, data: &[u8]) {
        let Some((fields, known)) = &mut self.by_name else {
            return;
        };
        let tree = leaves::tree(&self.messages, self.encoding, data);
        let names = leaves::names_of(&tree);
        if *known == Some(names) {
            return;
        }
        let placed = |path: &FieldPath| match leaves::is_by_name(path) {
            true => leaves::placed(&tree, path),
            false => Some(path.clone()),
        };
        let placed: Vec<Vec<FieldPath>> = (fields.iter())
            .map(|paths| paths.iter().filter_map(placed).collect())
            .collect();
        let by_name = Some((std::mem::take(fields), Some(names)));
        let messages = std::mem::take(&mut self.messages);
        *self = Self {
            by_name,
            ..Self::new(messages, self.encoding, &placed)
        };
    }

    fn take(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), MalformedMessage> {
        out.fill(Value::Absent);
        if out.len() != self.labels.len() {
            return Ok(());
        }
        self.arrays.fill(None);
        self.lists.iter_mut().for_each(Vec::clear);
        self.uneven = None;
        let mut cursor = ByteCursor::new(data, self.encoding)?;
        let mut walk = CdrWalk {
            messages: &self.messages,
            arrays: &mut self.arrays,
            lists: &mut self.lists,
            out,
        };
        walk.message(&mut cursor, 0, Some(&self.plan.root))?;
        self.order = order(cursor.data, &self.lists);
        for pick in &mut self.plan.picks {
            let Some(Some(array)) = self.arrays.get(pick.array) else {
                continue;
            };
            let index = match &mut pick.by {
                ElementSelector::Index(index) => *index,
                ElementSelector::Name { list, name, last } => {
                    let names = self.lists.get(*list).map_or(&[][..], Vec::as_slice);
                    if names.len() != array.count {
                        if array.count > 0 && self.uneven.is_none() {
                            self.uneven = Some(UnevenArray {
                                array: self.labels[pick.output].clone(),
                                numbers: array.count,
                                names: names.len(),
                            });
                        }
                        continue;
                    }
                    let Some(index) = find(cursor.data, names, name, *last) else {
                        continue;
                    };
                    *last = index;
                    index
                }
            };
            let kind = self.plan.arrays[pick.array];
            if index < array.count {
                let at = array.start + index * kind.size();
                out[pick.output] = cursor.number_at(at, kind)?;
            }
        }
        Ok(())
    }
}

impl MessageReader for CdrReader {
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String> {
        self.place(data);
        self.take(data, out).map_err(|error| error.to_string())
    }

    fn names(&self, data: &[u8]) -> Vec<String> {
        let body = match self.encoding {
            Encoding::Cdr => data.get(4..).unwrap_or_default(),
            Encoding::Ros1 => data,
        };
        let texts = self.lists.iter().flatten();
        let texts = texts.filter_map(|span| span.text(body));
        texts
            .map(|text| String::from_utf8_lossy(text).into_owned())
            .collect()
    }

    fn order(&self) -> u64 {
        self.order
    }

    fn uneven(&self) -> Option<UnevenArray> {
        self.uneven.clone()
    }

    fn leaves(&self, data: &[u8]) -> Vec<FieldLeaf> {
        leaves::leaves(&self.messages, self.encoding, data)
    }
}

/// Name of the array that a path takes an element of by its name.
fn label(paths: &[FieldPath]) -> String {
    let of = |path: &FieldPath| {
        let pairs = path.steps.windows(2);
        pairs.into_iter().find_map(|pair| match pair {
            [PathStep::Field(name), PathStep::Named { .. }] => Some(name.clone()),
            _ => None,
        })
    };
    paths.iter().find_map(of).unwrap_or_default()
}

/// The names of lists and their order as one number (FNV-1a).
fn order(data: &[u8], lists: &[Vec<ByteSpan>]) -> u64 {
    let spans = lists.iter().flatten();
    let names = spans.filter_map(|span| span.text(data));
    names.fold(0xcbf2_9ce4_8422_2325, |hash, name| {
        let ended = name.iter().chain(&[0]);
        ended.fold(hash, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
        })
    })
}

/// Index of a name, where it stood before or anywhere else.
fn find(data: &[u8], names: &[ByteSpan], name: &str, last: usize) -> Option<usize> {
    let is = |span: &ByteSpan| span.text(data) == Some(name.as_bytes());
    match names.get(last).is_some_and(is) {
        true => Some(last),
        false => names.iter().position(is),
    }
}

struct CdrWalk<'w> {
    messages: &'w [Vec<Field>],
    arrays: &'w mut [Option<ByteSpan>],
    lists: &'w mut [Vec<ByteSpan>],
    out: &'w mut [Value],
}

impl CdrWalk<'_> {
    /// Walks a message, to its end where it is not the outermost.
    fn message(
        &mut self,
        cursor: &mut ByteCursor<'_>,
        message: usize,
        node: Option<&PlanNode>,
    ) -> Result<(), MalformedMessage> {
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
        cursor: &mut ByteCursor<'_>,
        field: &Field,
        slot: Option<&PlanSlot>,
    ) -> Result<(), MalformedMessage> {
        let count = cursor.count(field.count)?;
        match field.kind {
            ElementType::Primitive(kind) => {
                let span = cursor.primitives(count, kind)?;
                match slot {
                    Some(PlanSlot::Number(outputs)) => {
                        let value = cursor.number_at(span.start, kind)?;
                        for output in outputs {
                            self.out[*output] = value;
                        }
                    }
                    Some(PlanSlot::Array(array)) => self.arrays[*array] = Some(span),
                    _ => {}
                }
            }
            ElementType::String => {
                for _ in 0..count {
                    let text = cursor.text()?;
                    if let Some(PlanSlot::List(list)) = slot {
                        self.lists[*list].push(text);
                    }
                }
            }
            ElementType::WideString => {
                for _ in 0..count {
                    cursor.wide_text()?;
                }
            }
            ElementType::Message(message) => {
                let mut elements = match slot {
                    Some(PlanSlot::Elements(elements)) => elements.as_slice(),
                    _ => &[],
                };
                for index in 0..count {
                    let inner = match (slot, elements.first()) {
                        (Some(PlanSlot::Inner(node)), _) => Some(node),
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

#[cfg(test)]
mod tests;
