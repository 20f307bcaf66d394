//! Message definitions as ROS writes them (`.msg` text with its dependencies): parsed and resolved.

use std::collections::BTreeMap;

use thiserror::Error;

/// Levels of messages in messages that are followed.
const MAX_DEPTH: usize = 32;
/// Bytes of definition text that are read.
const MAX_DEFINITION_BYTES: usize = 1 << 20;

/// Why a message definition cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DefinitionError {
    /// The text is no `.msg` definition.
    #[error("invalid field at line {line} of {message}: `{text}`")]
    Line {
        /// Message in which it stands.
        message: String,
        /// Line in the whole text, from 1.
        line: usize,
        /// The line.
        text: String,
    },
    /// A type that the text does not define.
    #[error("the definition of {message} needs {name}, which is not defined with it")]
    Undefined {
        /// Message that needs it.
        message: String,
        /// The type.
        name: String,
    },
    /// Messages in messages without an end.
    #[error("{message} holds messages in messages, more than {MAX_DEPTH} levels deep")]
    Deep {
        /// The outermost message.
        message: String,
    },
    /// A text that no real message has.
    #[error("the definition is {bytes} bytes long, more than {MAX_DEFINITION_BYTES}")]
    Long {
        /// Its length.
        bytes: usize,
    },
}

/// A type of fixed size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Primitive {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Primitive {
    /// Size, and alignment, in bytes.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Self::Bool,
            "int8" => Self::I8,
            // In ROS 2 both are unsigned bytes.
            "uint8" | "byte" | "char" => Self::U8,
            "int16" => Self::I16,
            "uint16" => Self::U16,
            "int32" => Self::I32,
            "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float32" => Self::F32,
            "float64" => Self::F64,
            _ => return None,
        })
    }
}

/// Type of one element of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementType {
    Primitive(Primitive),
    String,
    /// Text of two-byte characters.
    WideString,
    /// Index into [`Definition::messages`].
    Message(usize),
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Sequence,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: ElementType,
    pub(super) count: Count,
}

/// A message type with every type that it needs; the first one is the message itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Definition {
    pub(super) messages: Vec<Vec<Field>>,
}

/// Definitions that recordings may leave out: some recorders store type names alone.
const KNOWN: [(&str, &str); 9] = [
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    ),
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"),
    (
        "std_msgs/Float64MultiArray",
        "std_msgs/MultiArrayLayout layout\nfloat64[] data\n",
    ),
    (
        "std_msgs/MultiArrayLayout",
        "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n",
    ),
    (
        "std_msgs/MultiArrayDimension",
        "string label\nuint32 size\nuint32 stride\n",
    ),
    // Types of ROS 1 that are part of its language.
    ("time", "uint32 secs\nuint32 nsecs\n"),
    ("duration", "int32 secs\nint32 nsecs\n"),
];

/// A field as its line says, its type not yet looked up.
struct UnresolvedField<'t> {
    name: &'t str,
    of: &'t str,
    count: Count,
}

impl Definition {
    /// Parses the definition of message `name` (`package/msg/Type`) and resolves every type in it.
    ///
    /// `text` may be empty where the type is one that is known here.
    pub(super) fn parse(name: &str, text: &str) -> Result<Self, DefinitionError> {
        if text.len() > MAX_DEFINITION_BYTES {
            return Err(DefinitionError::Long { bytes: text.len() });
        }
        let root = short(name);
        let mut sections: BTreeMap<String, Vec<UnresolvedField<'_>>> = BTreeMap::new();
        for (name, known) in KNOWN {
            sections.insert(name.to_owned(), section(name, known)?);
        }
        if !text.trim().is_empty() {
            let mut current = root.clone();
            sections.insert(current.clone(), Vec::new());
            for (index, line) in text.lines().enumerate() {
                let line = line.trim();
                if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
                    continue;
                }
                if let Some(name) = line.strip_prefix("MSG:") {
                    current = short(name.trim());
                    sections.insert(current.clone(), Vec::new());
                    continue;
                }
                let fields = sections.entry(current.clone()).or_default();
                if let Some(field) = field(line, &current, index + 1)? {
                    fields.push(field);
                }
            }
        }
        if !sections.contains_key(&root) {
            return Err(DefinitionError::Undefined {
                message: name.to_owned(),
                name: root,
            });
        }
        let mut numbers = BTreeMap::new();
        let mut messages = Vec::new();
        resolve(&root, &root, &sections, &mut numbers, &mut messages, 0)?;
        Ok(Self { messages })
    }
}

fn section<'t>(name: &str, text: &'t str) -> Result<Vec<UnresolvedField<'t>>, DefinitionError> {
    let lines = text.lines().enumerate();
    lines
        .filter_map(|(index, line)| field(line, name, index + 1).transpose())
        .collect()
}

/// `package/msg/Type` as `package/Type`, as definitions name it.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

/// The field of one line; `None` for a comment, a constant or an empty line.
fn field<'t>(
    line: &'t str,
    message: &str,
    number: usize,
) -> Result<Option<UnresolvedField<'t>>, DefinitionError> {
    let code = line.split('#').next().unwrap_or_default().trim();
    if code.is_empty() {
        return Ok(None);
    }
    let refuse = || DefinitionError::Line {
        message: message.to_owned(),
        line: number,
        text: line.chars().take(80).collect(),
    };
    let (of, rest) = code.split_once(char::is_whitespace).ok_or_else(refuse)?;
    let rest = rest.trim_start();
    let plain = |c: char| c.is_alphanumeric() || c == '_';
    let end = rest.find(|c| !plain(c)).unwrap_or(rest.len());
    let (name, rest) = rest.split_at(end);
    if name.is_empty() {
        return Err(refuse());
    }
    // What follows without `=` is a default value.
    if rest.trim_start().starts_with('=') {
        return Ok(None);
    }
    let (of, count) = match of.split_once('[') {
        None => (of, Count::One),
        Some((of, size)) => {
            let size = size.strip_suffix(']').ok_or_else(refuse)?;
            let count = if size.is_empty() || size.starts_with("<=") {
                Count::Sequence
            } else {
                match size.parse() {
                    // An element takes bytes, so that no count outlasts the message; none would not.
                    Ok(count) if count > 0 => Count::Fixed(count),
                    _ => return Err(refuse()),
                }
            };
            (of, count)
        }
    };
    let of = of.split_once("<=").map_or(of, |(of, _)| of);
    let known = |c: char| plain(c) || c == '/';
    if of.is_empty() || !of.chars().all(known) {
        return Err(refuse());
    }
    Ok(Some(UnresolvedField { name, of, count }))
}

/// Adds message `name` and all it needs to `messages`; its index there.
fn resolve(
    name: &str,
    root: &str,
    sections: &BTreeMap<String, Vec<UnresolvedField<'_>>>,
    numbers: &mut BTreeMap<String, usize>,
    messages: &mut Vec<Vec<Field>>,
    depth: usize,
) -> Result<usize, DefinitionError> {
    if depth > MAX_DEPTH {
        return Err(DefinitionError::Deep {
            message: root.to_owned(),
        });
    }
    if let Some(number) = numbers.get(name) {
        // A number without fields yet is a message inside itself.
        return match messages.get(*number) {
            Some(fields) if !fields.is_empty() => Ok(*number),
            _ => Err(DefinitionError::Deep {
                message: root.to_owned(),
            }),
        };
    }
    let number = messages.len();
    numbers.insert(name.to_owned(), number);
    messages.push(Vec::new());
    let mut fields = Vec::new();
    for field in sections.get(name).map(Vec::as_slice).unwrap_or_default() {
        let kind = match field.of {
            "string" => ElementType::String,
            "wstring" => ElementType::WideString,
            other => match Primitive::named(other) {
                Some(primitive) => ElementType::Primitive(primitive),
                None => {
                    let full = full_name(other, name, sections).ok_or_else(|| {
                        DefinitionError::Undefined {
                            message: name.to_owned(),
                            name: other.to_owned(),
                        }
                    })?;
                    let inner = resolve(&full, root, sections, numbers, messages, depth + 1)?;
                    ElementType::Message(inner)
                }
            },
        };
        fields.push(Field {
            name: field.name.to_owned(),
            kind,
            count: field.count,
        });
    }
    if fields.is_empty() {
        // In CDR a message without fields still takes one byte.
        fields.push(Field {
            name: String::new(),
            kind: ElementType::Primitive(Primitive::U8),
            count: Count::One,
        });
    }
    messages[number] = fields;
    Ok(number)
}

/// Name under which a type is defined: as it stands, in the package of the message, or the header.
fn full_name(
    name: &str,
    inside: &str,
    sections: &BTreeMap<String, Vec<UnresolvedField<'_>>>,
) -> Option<String> {
    let package = inside.split_once('/').map(|(package, _)| package);
    let candidates = [
        Some(short(name)),
        package.map(|package| format!("{package}/{name}")),
        (name == "Header").then(|| "std_msgs/Header".to_owned()),
    ];
    let mut found = candidates.into_iter().flatten();
    found.find(|name| sections.contains_key(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_joint_state_is_known_and_equal_to_the_text_that_recordings_hold() {
        let text = "# a comment\nstd_msgs/Header header\n\nstring[] name # joints\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
            ================================================================================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
            ================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec";
        let written = Definition::parse("sensor_msgs/msg/JointState", text).unwrap();
        let known = Definition::parse("sensor_msgs/msg/JointState", "").unwrap();
        assert_eq!(written, known);
        let names: Vec<&str> = written.messages[0]
            .iter()
            .map(|f| f.name.as_str())
            .collect();
        assert_eq!(names, ["header", "name", "position", "velocity", "effort"]);
    }

    #[test]
    fn constants_defaults_bounds_and_arrays_are_told_apart() {
        let text = "uint8 A=1\nstring B = \"x # y\"\nint32 count 7\nstring<=5 label\nfloat32[3] v\nfloat64[<=4] w\nInner[] list\nwstring wide\n===\nMSG: p/Inner\nbyte b\n";
        let definition = Definition::parse("p/msg/Outer", text).unwrap();
        let fields = &definition.messages[0];
        let kinds: Vec<_> = fields
            .iter()
            .map(|f| (f.name.as_str(), f.kind, f.count))
            .collect();
        assert_eq!(
            kinds,
            [
                ("count", ElementType::Primitive(Primitive::I32), Count::One),
                ("label", ElementType::String, Count::One),
                ("v", ElementType::Primitive(Primitive::F32), Count::Fixed(3)),
                ("w", ElementType::Primitive(Primitive::F64), Count::Sequence),
                ("list", ElementType::Message(1), Count::Sequence),
                ("wide", ElementType::WideString, Count::One),
            ]
        );
    }

    #[test]
    fn what_is_no_definition_is_refused_with_the_reason() {
        let parse = |text: &str| Definition::parse("p/M", text).unwrap_err().to_string();
        assert!(
            parse("float64\n").contains("line 1"),
            "{}",
            parse("float64\n")
        );
        assert!(parse("float64[x] y").contains("float64[x] y"));
        assert!(parse("float64[0] y").contains("invalid field"));
        assert!(parse("Other o").contains("needs Other"));
        assert!(parse("M m").contains("levels deep"));
        assert!(parse("A a\n===\nMSG: p/A\nB b\n===\nMSG: p/B\nA a\n").contains("levels deep"));
        let unknown = Definition::parse("unknown/msg/Type", "").unwrap_err();
        assert!(unknown.to_string().contains("not defined"), "{unknown}");
        assert!(parse(&"#".repeat(MAX_DEFINITION_BYTES + 1)).contains("bytes long"));
    }
}
