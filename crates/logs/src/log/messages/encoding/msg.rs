//! Message definitions as ROS writes them (`.msg` text with its dependencies): parsed and resolved.

use std::collections::BTreeMap;

/// Levels of messages in messages that are followed.
const MAX_DEPTH: usize = 32;
/// Bytes of definition text that are read.
const MAX_DEFINITION_BYTES: usize = 1 << 20;

/// The types of fields that are no messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PrimitiveType {
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

impl PrimitiveType {
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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementType {
    Primitive(PrimitiveType),
    String,
    WideString,
    /// Index into [`MessageFields`].
    Message(usize),
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementCount {
    One,
    Fixed(usize),
    Sequence,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: ElementType,
    pub(super) count: ElementCount,
}

/// The fields of a message type and of every type that it needs; the first one is the message itself.
pub(super) type MessageFields = Vec<Vec<Field>>;

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
    count: ElementCount,
}

/// The fields of each type, by its name.
type TypeSections<'t> = BTreeMap<String, Vec<UnresolvedField<'t>>>;

/// Parses the definition of message `name` (`package/msg/Type`), empty for a known type, and resolves every type in it.
pub(super) fn parse(name: &str, text: &str) -> Result<MessageFields, String> {
    if text.len() > MAX_DEFINITION_BYTES {
        return Err(format!(
            "the definition is {} bytes long, more than {MAX_DEFINITION_BYTES}",
            text.len()
        ));
    }
    let root = short(name);
    let mut sections = TypeSections::new();
    for (name, known) in KNOWN {
        read_sections(name, known, &mut sections)?;
    }
    if !text.trim().is_empty() {
        read_sections(&root, text, &mut sections)?;
    }
    if !sections.contains_key(&root) {
        return Err(undefined(name, &root));
    }
    let mut messages = Vec::new();
    let mut numbers = BTreeMap::new();
    resolve(&root, &root, &sections, &mut numbers, &mut messages, 0)?;
    Ok(messages)
}

/// Reads the fields of message `name`, and of the messages that follow it in the text.
fn read_sections<'t>(
    name: &str,
    text: &'t str,
    sections: &mut TypeSections<'t>,
) -> Result<(), String> {
    let mut current = name.to_owned();
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
        let field = field(line, &current, index + 1)?;
        sections.entry(current.clone()).or_default().extend(field);
    }
    Ok(())
}

/// `package/msg/Type` as `package/Type`, as definitions name it.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

fn undefined(message: &str, name: &str) -> String {
    format!("the definition of {message} needs {name}, which is not defined with it")
}

/// The field of one line; `None` for a comment, a constant or an empty line.
fn field<'t>(
    line: &'t str,
    message: &str,
    number: usize,
) -> Result<Option<UnresolvedField<'t>>, String> {
    let code = line.split('#').next().unwrap_or_default().trim();
    if code.is_empty() {
        return Ok(None);
    }
    let refuse = || {
        let text: String = line.chars().take(80).collect();
        format!("invalid field at line {number} of {message}: `{text}`")
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
        None => (of, ElementCount::One),
        Some((of, size)) => {
            let size = size.strip_suffix(']').ok_or_else(refuse)?;
            let count = match size.parse() {
                _ if size.is_empty() || size.starts_with("<=") => ElementCount::Sequence,
                // An element takes bytes, so that no count outlasts the message; none would not.
                Ok(count) if count > 0 => ElementCount::Fixed(count),
                _ => return Err(refuse()),
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
    sections: &TypeSections<'_>,
    numbers: &mut BTreeMap<String, usize>,
    messages: &mut MessageFields,
    depth: usize,
) -> Result<usize, String> {
    let known = numbers.get(name).copied();
    // A number without fields yet is a message inside itself.
    if depth > MAX_DEPTH || known.is_some_and(|number| messages[number].is_empty()) {
        return Err(format!(
            "{root} holds messages in messages, more than {MAX_DEPTH} levels deep"
        ));
    }
    if let Some(number) = known {
        return Ok(number);
    }
    let number = messages.len();
    numbers.insert(name.to_owned(), number);
    messages.push(Vec::new());
    let mut fields = Vec::new();
    for field in sections.get(name).map(Vec::as_slice).unwrap_or_default() {
        let kind = match field.of {
            "string" => ElementType::String,
            "wstring" => ElementType::WideString,
            other => match PrimitiveType::named(other) {
                Some(primitive) => ElementType::Primitive(primitive),
                None => {
                    let full = full_name(other, name, sections);
                    let full = full.ok_or_else(|| undefined(name, other))?;
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
            kind: ElementType::Primitive(PrimitiveType::U8),
            count: ElementCount::One,
        });
    }
    messages[number] = fields;
    Ok(number)
}

/// Name under which a type is defined: as it stands, in the package of the message, or the header.
fn full_name(name: &str, inside: &str, sections: &TypeSections<'_>) -> Option<String> {
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
        let written = parse("sensor_msgs/msg/JointState", text).unwrap();
        assert_eq!(
            Ok(&written),
            parse("sensor_msgs/msg/JointState", "").as_ref()
        );
        let names: Vec<&str> = written[0].iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["header", "name", "position", "velocity", "effort"]);
    }

    #[test]
    fn constants_defaults_bounds_and_arrays_are_distinguished() {
        let text = "uint8 A=1\nstring B = \"x # y\"\nint32 count 7\nstring<=5 label\nfloat32[3] v\nfloat64[<=4] w\nInner[] list\nwstring wide\n===\nMSG: p/Inner\nbyte b\n";
        let outer = &parse("p/msg/Outer", text).unwrap()[0];
        let kinds: Vec<_> = (outer.iter().map(|f| (&*f.name, f.kind, f.count))).collect();
        let expected = [
            (
                "count",
                ElementType::Primitive(PrimitiveType::I32),
                ElementCount::One,
            ),
            ("label", ElementType::String, ElementCount::One),
            (
                "v",
                ElementType::Primitive(PrimitiveType::F32),
                ElementCount::Fixed(3),
            ),
            (
                "w",
                ElementType::Primitive(PrimitiveType::F64),
                ElementCount::Sequence,
            ),
            ("list", ElementType::Message(1), ElementCount::Sequence),
            ("wide", ElementType::WideString, ElementCount::One),
        ];
        assert_eq!(kinds, expected);
    }

    #[test]
    fn what_is_no_definition_is_refused_with_the_reason() {
        let long = "#".repeat(MAX_DEFINITION_BYTES + 1);
        for (name, text, word) in [
            ("p/M", "float64\n", "line 1"),
            ("p/M", "float64[x] y", "float64[x] y"),
            ("p/M", "float64[0] y", "invalid field"),
            ("p/M", "Other o", "needs Other"),
            ("p/M", "M m", "levels deep"),
            (
                "p/M",
                "A a\n===\nMSG: p/A\nB b\n===\nMSG: p/B\nA a\n",
                "levels deep",
            ),
            ("unknown/msg/Type", "", "not defined"),
            ("p/M", &long, "bytes long"),
        ] {
            let problem = parse(name, text).unwrap_err();
            assert!(problem.contains(word), "{problem}");
        }
    }
}
