//! Numbers out of CDR messages by field path, nothing else decoded.
//!
//! The definition is turned into a plan once; each message is then walked up to the last field
//! that is asked for.

use super::cursor::{ByteSpan, Cursor, Encoding, MalformedMessage};
use super::leaves;
use super::msg::{Definition, DefinitionError, ElementType, Field};
use super::plan::{By, Node, Slot, Walkthrough};
use crate::log::recording::message::{Leaf, MessageReader, Schema, Uneven};
use crate::log::recording::path::{FieldPath, PathStep};
use crate::log::recording::value::Value;

/// Messages in CDR, and in the packed form of ROS 1, by their `.msg` definitions.
pub(super) fn open(
    schema: &Schema,
    fields: &[Vec<FieldPath>],
) -> Option<Result<Box<dyn MessageReader>, String>> {
    let encoding = match (schema.encoding.as_str(), schema.language.as_str()) {
        ("cdr", _) => Encoding::Cdr,
        ("ros1", "ros1msg" | "") => Encoding::Ros1,
        _ => return None,
    };
    let reader = || -> Result<Box<dyn MessageReader>, String> {
        let text = std::str::from_utf8(&schema.text)
            .map_err(|_| "its definition is no text".to_owned())?;
        let other = !matches!(&*schema.language, "ros2msg" | "ros1msg" | "")
            || text.contains("\nIDL:")
            || text.starts_with("IDL:");
        // what the type is called says how it is laid out, where it is one that is known here
        let text = if other { "" } else { text };
        let definition = Definition::parse(&schema.name, text).map_err(|error| match other {
            true => format!(
                "its definition is `{}`, which is read for sensor_msgs/msg/JointState alone",
                schema.language
            ),
            false => error.to_string(),
        })?;
        Ok(Box::new(CdrReader::new(&definition, encoding, fields).0))
    };
    Some(reader())
}

/// Reads the numbers of some fields out of the messages of one type.
#[derive(Debug, Clone)]
pub struct CdrReader {
    messages: Vec<Vec<Field>>,
    encoding: Encoding,
    plan: Walkthrough,
    /// Place and number of the elements of each array that is asked for.
    arrays: Vec<Option<ByteSpan>>,
    /// Places of the texts in each list of names.
    lists: Vec<Vec<ByteSpan>>,
    outputs: usize,
    /// Names of the arrays that are asked for by names, by the outputs.
    labels: Vec<String>,
    uneven: Option<Uneven>,
    order: u64,
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
    /// [`DefinitionError`] where the definition cannot be used.
    pub fn parse(name: &str, definition: &str, paths: &[&str]) -> Result<Self, DefinitionError> {
        let definition = Definition::parse(name, definition)?;
        let fields: Vec<Vec<FieldPath>> = paths
            .iter()
            .map(|path| vec![FieldPath::parse(path)])
            .collect();
        Ok(Self::new(&definition, Encoding::Cdr, &fields).0)
    }

    /// The fields of one message, in the order of their paths.
    ///
    /// # Errors
    /// [`MalformedMessage`]: the bytes are no message of this type.
    pub fn values(&mut self, data: &[u8]) -> Result<Vec<Value>, MalformedMessage> {
        let mut out = vec![Value::Absent; self.outputs];
        self.read(data, &mut out)?;
        Ok(out)
    }

    /// Plans the reading of `fields`: for each the paths it may have, the first that leads to a
    /// number is taken. Says for each whether one does.
    fn new(
        definition: &Definition,
        encoding: Encoding,
        fields: &[Vec<FieldPath>],
    ) -> (Self, Vec<bool>) {
        let mut plan = Walkthrough::default();
        let mut found = Vec::with_capacity(fields.len());
        for (output, paths) in fields.iter().enumerate() {
            let mut steps = paths.iter().map(|path| &path.steps);
            found.push(steps.any(|steps| plan.add(&definition.messages, steps, output)));
        }
        let reader = Self {
            messages: definition.messages.clone(),
            encoding,
            arrays: vec![None; plan.arrays.len()],
            lists: vec![Vec::new(); plan.lists],
            plan,
            outputs: fields.len(),
            labels: fields.iter().map(|paths| label(paths)).collect(),
            uneven: None,
            order: 0,
        };
        (reader, found)
    }

    /// Reads the fields of one message into `out`, one value for each field that was asked for.
    ///
    /// # Errors
    /// [`MalformedMessage`]: the bytes are no message of this type.
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), MalformedMessage> {
        out.fill(Value::Absent);
        if out.len() != self.outputs {
            return Ok(());
        }
        self.arrays.fill(None);
        self.lists.iter_mut().for_each(Vec::clear);
        self.uneven = None;
        let mut cursor = Cursor::new(data, self.encoding)?;
        let mut walk = Walk {
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
                By::Index(index) => *index,
                By::Name { list, name, last } => {
                    let names = self.lists.get(*list).map_or(&[][..], Vec::as_slice);
                    if names.len() != array.count {
                        if array.count > 0 && self.uneven.is_none() {
                            self.uneven = Some(Uneven {
                                array: self.labels[pick.output].clone(),
                                numbers: array.count,
                                names: names.len(),
                            });
                        }
                        continue;
                    }
                    match find(cursor.data, names, name, *last) {
                        Some(index) => {
                            *last = index;
                            index
                        }
                        None => continue,
                    }
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

    /// Names in the lists of the message that was read last, for messages to the user.
    fn names(&self, data: &[u8]) -> Vec<String> {
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

impl MessageReader for CdrReader {
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String> {
        self.read(data, out).map_err(|error| error.to_string())
    }

    fn names(&self, data: &[u8]) -> Vec<String> {
        self.names(data)
    }

    fn order(&self) -> u64 {
        self.order
    }

    fn uneven(&self) -> Option<Uneven> {
        self.uneven.clone()
    }

    fn leaves(&self, data: &[u8]) -> Vec<Leaf> {
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
    let names = spans.filter_map(|span| data.get(span.start..span.start + span.count));
    names.fold(0xcbf2_9ce4_8422_2325, |hash, name| {
        let ended = name.iter().chain(&[0]);
        ended.fold(hash, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
        })
    })
}

/// Index of a name, where it stood before or anywhere else.
fn find(data: &[u8], names: &[ByteSpan], name: &str, last: usize) -> Option<usize> {
    let is =
        |span: &ByteSpan| data.get(span.start..span.start + span.count) == Some(name.as_bytes());
    if names.get(last).is_some_and(is) {
        return Some(last);
    }
    names.iter().position(is)
}

/// One message being walked, and where its numbers go.
struct Walk<'w> {
    messages: &'w [Vec<Field>],
    arrays: &'w mut [Option<ByteSpan>],
    lists: &'w mut [Vec<ByteSpan>],
    out: &'w mut [Value],
}

impl Walk<'_> {
    /// Walks a message, to its end where it is not the outermost.
    fn message(
        &mut self,
        cursor: &mut Cursor<'_>,
        message: usize,
        node: Option<&Node>,
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
        cursor: &mut Cursor<'_>,
        field: &Field,
        slot: Option<&Slot>,
    ) -> Result<(), MalformedMessage> {
        let count = cursor.count(field.count)?;
        match field.kind {
            ElementType::Primitive(kind) => {
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
            ElementType::String => {
                for _ in 0..count {
                    let text = cursor.text()?;
                    if let Some(Slot::List(list)) = slot {
                        self.lists[*list].push(text);
                    }
                }
            }
            ElementType::WideString => {
                for _ in 0..count {
                    let length = cursor.length()?;
                    let bytes = length.checked_mul(2).ok_or_else(|| cursor.short())?;
                    cursor.pass(bytes)?;
                }
            }
            ElementType::Message(message) => {
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Writes CDR by its rules, independently of the reader.
    struct Writer {
        bytes: Vec<u8>,
        big: bool,
        align: usize,
    }

    impl Writer {
        fn new(kind: u8) -> Self {
            Self {
                bytes: vec![0, kind, 0, 0],
                big: kind & 1 == 0,
                align: if kind < 2 { 8 } else { 4 },
            }
        }

        fn put(&mut self, little: &[u8]) {
            let size = little.len().min(self.align);
            while !(self.bytes.len() - 4).is_multiple_of(size) {
                self.bytes.push(0xee);
            }
            let mut bytes = little.to_vec();
            if self.big {
                bytes.reverse();
            }
            self.bytes.extend(bytes);
        }

        fn text(&mut self, text: &str) {
            self.put(&(text.len() as u32 + 1).to_le_bytes());
            self.bytes.extend(text.as_bytes());
            self.bytes.push(0);
        }

        fn numbers(&mut self, numbers: &[f64]) {
            self.put(&(numbers.len() as u32).to_le_bytes());
            for number in numbers {
                self.put(&number.to_le_bytes());
            }
        }
    }

    #[derive(Debug, Clone)]
    struct State {
        stamp: (i32, u32),
        frame: String,
        joints: Vec<(String, f64, f64)>,
    }

    fn states() -> impl Strategy<Value = State> {
        let joints = prop::collection::btree_map("[a-z]{1,9}", (any::<f64>(), any::<f64>()), 0..6);
        let joints = joints.prop_map(|joints| {
            let joints = joints.into_iter();
            joints
                .map(|(name, (q, tau))| (name, q, tau))
                .collect::<Vec<_>>()
        });
        let joints = joints.prop_shuffle();
        (any::<(i32, u32)>(), "\\PC{0,9}", joints).prop_map(|(stamp, frame, joints)| State {
            stamp,
            frame,
            joints,
        })
    }

    fn written(state: &State, kind: u8) -> Vec<u8> {
        let mut out = Writer::new(kind);
        out.put(&state.stamp.0.to_le_bytes());
        out.put(&state.stamp.1.to_le_bytes());
        out.text(&state.frame);
        out.put(&(state.joints.len() as u32).to_le_bytes());
        for (name, _, _) in &state.joints {
            out.text(name);
        }
        out.numbers(&state.joints.iter().map(|joint| joint.1).collect::<Vec<_>>());
        out.numbers(&[]);
        out.numbers(&state.joints.iter().map(|joint| joint.2).collect::<Vec<_>>());
        out.bytes
    }

    fn reader(paths: &[&str]) -> (CdrReader, Vec<bool>) {
        let definition = Definition::parse("sensor_msgs/msg/JointState", "").unwrap();
        let fields: Vec<Vec<FieldPath>> = paths
            .iter()
            .map(|path| vec![FieldPath::parse(path)])
            .collect();
        CdrReader::new(&definition, Encoding::Cdr, &fields)
    }

    #[test]
    fn paths_that_lead_to_no_number_are_told() {
        let paths = [
            "header.stamp.sec",
            "position[3]",
            "/effort/0",
            "position[name=a]",
            "position",
            "name[0]",
            "header",
            "header.frame_id",
            "position[frame=a]",
            "header.stamp.sec[0]",
            "none",
        ];
        let (_, found) = reader(&paths);
        let expected = [
            true, true, true, true, false, false, false, false, false, false, false,
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn arrays_of_messages_are_read_by_index_past_fields_of_changing_size() {
        let text = "Drive[] drives\nint8 last\n===\nMSG: p/Drive\nstring[] notes\nint16 code\nfloat64[2] pair\nbool on\n";
        let definition = Definition::parse("p/msg/Drives", text).unwrap();
        let paths = [
            "drives[1].pair[1]",
            "drives[0].code",
            "drives[1].on",
            "last",
            "drives[2].code",
        ];
        let fields: Vec<Vec<FieldPath>> = paths
            .iter()
            .map(|path| vec![FieldPath::parse(path)])
            .collect();
        let (mut reader, found) = CdrReader::new(&definition, Encoding::Cdr, &fields);
        assert_eq!(found, [true; 5]);
        let mut out = Writer::new(1);
        out.put(&2u32.to_le_bytes());
        for (notes, code, pair) in [
            (&["x"][..], -7i16, [1.0, 2.0f64]),
            (&["", "yz"], 9, [3.0, 4.0]),
        ] {
            out.put(&(notes.len() as u32).to_le_bytes());
            for note in notes {
                out.text(note);
            }
            out.put(&code.to_le_bytes());
            for number in pair {
                out.put(&number.to_le_bytes());
            }
            out.put(&[1]);
        }
        out.put(&[0xff]);
        let mut values = [Value::Absent; 5];
        reader.read(&out.bytes, &mut values).unwrap();
        let expected = [
            Value::Float(4.0),
            Value::Int(-7),
            Value::Int(1),
            Value::Int(-1),
            Value::Absent,
        ];
        assert_eq!(values, expected);
    }

    #[test]
    fn packed_messages_of_the_first_ros_are_read_without_padding() {
        let text = "Header header\nfloat64[] position\n===\nMSG: std_msgs/Header\nuint32 seq\nuint8 odd\ntime stamp\n";
        let definition = Definition::parse("p/M", text).unwrap();
        let fields = [
            vec![FieldPath::parse("header.stamp.nsecs")],
            vec![FieldPath::parse("position[1]")],
        ];
        let (mut reader, _) = CdrReader::new(&definition, Encoding::Ros1, &fields);
        let mut bytes = vec![1, 0, 0, 0, 5];
        bytes.extend([3u32, 250].map(u32::to_le_bytes).concat());
        bytes.extend(2u32.to_le_bytes());
        bytes.extend([7.0f64, 8.0].map(f64::to_le_bytes).concat());
        let mut values = [Value::Absent; 2];
        reader.read(&bytes, &mut values).unwrap();
        assert_eq!(values, [Value::Int(250), Value::Float(8.0)]);
    }

    #[test]
    fn other_encodings_and_short_messages_are_refused() {
        let (mut reader, _) = reader(&["position[0]"]);
        let mut out = [Value::Absent];
        let mut refused = |data: &[u8]| reader.read(data, &mut out).unwrap_err().to_string();
        assert!(refused(&[0, 3, 0, 0, 1]).contains("0x0003"));
        assert!(refused(&[0, 1]).contains("ends after 2 bytes"));
        assert!(refused(&[0, 1, 0, 0, 1, 2]).contains("inside a field"));
        let long = [&[0, 1, 0, 0][..], &[0; 12], &[0xff; 4], &[0; 8]].concat();
        assert!(
            refused(&long).contains("4294967295 elements"),
            "{}",
            refused(&long)
        );
    }

    proptest! {
        #[test]
        fn any_joint_state_is_read_in_both_byte_orders_and_both_versions(
            states in prop::collection::vec(states(), 1..4),
            kind in prop::sample::select(vec![0u8, 1, 6, 7]),
            wanted in "[a-z]{1,2}",
        ) {
            let named = states[0].joints.first().map_or(wanted, |joint| joint.0.clone());
            let paths = [
                "header.stamp.sec".to_owned(),
                "header.stamp.nanosec".to_owned(),
                format!("position[name={named}]"),
                format!("effort[name={named}]"),
                "velocity[0]".to_owned(),
                "position[1]".to_owned(),
            ];
            let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
            let (mut reader, _) = reader(&paths);
            let mut out = [Value::Absent; 6];
            for state in &states {
                reader.read(&written(state, kind), &mut out).unwrap();
                let joint = state.joints.iter().find(|joint| joint.0 == named);
                let float = |number: Option<f64>| number.map_or(Value::Absent, Value::Float);
                let bits = |value: Value| value.number().map(f64::to_bits);
                prop_assert_eq!(out[0], Value::Int(state.stamp.0.into()));
                prop_assert_eq!(out[1], Value::Int(state.stamp.1.into()));
                prop_assert_eq!(bits(out[2]), bits(float(joint.map(|j| j.1))));
                prop_assert_eq!(bits(out[3]), bits(float(joint.map(|j| j.2))));
                prop_assert_eq!(out[4], Value::Absent);
                prop_assert_eq!(bits(out[5]), bits(float(state.joints.get(1).map(|j| j.1))));
            }
        }

        #[test]
        fn no_bytes_and_no_definition_make_the_decoder_panic(
            text in prop_oneof![
                "(((float64|string|uint8|A|B)(\\[\\]|\\[[0-9]{1,9}\\])? [ab]|===|MSG: p/[AB])\n){0,9}",
                "\\PC{0,60}",
            ],
            path in "[ab](\\[[0-9]\\]|\\[[ab]=[ab]\\])?(\\.[ab](\\[[0-9]\\])?){0,2}",
            data in prop::collection::vec(any::<u8>(), 0..80),
            kind in prop::sample::select(vec![0u8, 1, 7]),
        ) {
            let Ok(definition) = Definition::parse("p/R", &text) else {
                return Ok(());
            };
            let fields = [vec![FieldPath::parse(&path)]];
            for encoding in [Encoding::Cdr, Encoding::Ros1] {
                let (mut reader, _) = CdrReader::new(&definition, encoding, &fields);
                let message = [&[0, kind, 0, 0][..], &data].concat();
                let mut out = [Value::Absent];
                let _ = reader.read(&message, &mut out);
                reader.names(&message);
            }
        }
    }
}
