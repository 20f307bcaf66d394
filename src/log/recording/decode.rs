//! One decoder for the messages of a topic, whatever their encoding.

use super::cdr::CdrReader;
use super::cursor::Encoding;
use super::json;
use super::msg::Definition;
use super::path::Path;
use super::proto::ProtoReader;
use super::value::Value;

/// How the messages of a topic are written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Schema {
    /// Type, e.g. `sensor_msgs/msg/JointState`.
    pub(crate) name: String,
    /// Language of the definition: `ros2msg`, `protobuf`, `jsonschema`, ...
    pub(crate) language: String,
    /// The definition.
    pub(crate) text: Vec<u8>,
    /// Encoding of the messages: `cdr`, `json`, `protobuf`, ...
    pub(crate) encoding: String,
}

/// Reads some fields out of the messages of one topic.
#[derive(Debug, Clone)]
pub(crate) struct Decoder {
    fields: Vec<Vec<Path>>,
    form: Form,
}

#[derive(Debug, Clone)]
enum Form {
    Cdr(CdrReader),
    Json,
    Proto(ProtoReader),
}

impl Decoder {
    /// Makes a decoder for `fields`: for each the paths that it may have.
    ///
    /// # Errors
    /// Why messages of this schema cannot be read, for the user.
    pub(crate) fn new(schema: &Schema, fields: &[Vec<Path>]) -> Result<Self, String> {
        let cdr = |encoding| -> Result<Form, String> {
            let text = std::str::from_utf8(&schema.text)
                .map_err(|_| "its definition is no text".to_owned())?;
            if text.contains("\nIDL:") || text.starts_with("IDL:") {
                return Err("its definition is IDL, which is not read".to_owned());
            }
            let definition = Definition::parse(&schema.name, text).map_err(|e| e.to_string())?;
            Ok(Form::Cdr(CdrReader::new(&definition, encoding, fields).0))
        };
        let form = match (schema.encoding.as_str(), schema.language.as_str()) {
            ("cdr", "ros2msg" | "") => cdr(Encoding::Cdr)?,
            ("ros1", "ros1msg" | "") => cdr(Encoding::Ros1)?,
            ("json", _) => Form::Json,
            ("protobuf", "protobuf") => Form::Proto(ProtoReader::new(&schema.name, &schema.text)?),
            (encoding, language) => {
                return Err(format!(
                    "its encoding `{encoding}` with a `{language}` definition is not read"
                ));
            }
        };
        Ok(Self {
            fields: fields.to_vec(),
            form,
        })
    }

    /// Reads the fields of one message.
    ///
    /// # Errors
    /// What is wrong with the message, for the user.
    pub(crate) fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String> {
        match &mut self.form {
            Form::Cdr(reader) => reader.read(data, out).map_err(|error| error.to_string()),
            Form::Json => json::read(data, &self.fields, out).map_err(|error| error.to_string()),
            Form::Proto(reader) => reader.read(data, &self.fields, out),
        }
    }

    /// Names that the message which was read last lists: those of its joints, or of its fields.
    pub(crate) fn names(&self, data: &[u8]) -> Vec<String> {
        match &self.form {
            Form::Cdr(reader) => reader.names(data),
            Form::Json => json::names(data),
            Form::Proto(reader) => reader.names(),
        }
    }
}
