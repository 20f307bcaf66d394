//! Numbers out of JSON messages by field path or JSON pointer.

use serde_json::Value as Json;

use crate::log::recording::message::{MessageReader, Schema};
use crate::log::recording::path::{FieldPath, PathStep};
use crate::log::recording::value::Value;

/// Reads some fields of JSON messages.
struct JsonReader {
    fields: Vec<Vec<FieldPath>>,
}

/// Messages in JSON, whatever their schema.
pub(super) fn open(
    schema: &Schema,
    fields: &[Vec<FieldPath>],
) -> Option<Result<Box<dyn MessageReader>, String>> {
    let fields = fields.to_vec();
    (schema.encoding == "json").then(|| Ok(Box::new(JsonReader { fields }) as Box<_>))
}

impl MessageReader for JsonReader {
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String> {
        read(data, &self.fields, out).map_err(|error| error.to_string())
    }

    fn names(&self, data: &[u8]) -> Vec<String> {
        names(data)
    }
}

/// Reads `fields` of one message into `out`: for each the first of its paths that leads to a number.
fn read(
    data: &[u8],
    fields: &[Vec<FieldPath>],
    out: &mut [Value],
) -> Result<(), serde_json::Error> {
    let root: Json = serde_json::from_slice(data)?;
    for (paths, out) in fields.iter().zip(out) {
        let numbers = paths.iter().filter_map(|path| find(&root, &path.steps));
        *out = numbers.map(number).find(is_there).unwrap_or_default();
    }
    Ok(())
}

fn is_there(value: &Value) -> bool {
    *value != Value::Absent
}

fn number(value: &Json) -> Value {
    match value {
        Json::Bool(value) => Value::Int((*value).into()),
        Json::Number(number) => {
            if let Some(value) = number.as_i64() {
                Value::Int(value)
            } else if let Some(value) = number.as_u64() {
                Value::Unsigned(value)
            } else {
                number.as_f64().map_or(Value::Absent, Value::Float)
            }
        }
        _ => Value::Absent,
    }
}

/// Follows a path; elements that are named are looked up beside their array, then further out.
fn find<'j>(root: &'j Json, steps: &[PathStep]) -> Option<&'j Json> {
    let mut at = root;
    let mut outer = vec![root];
    for step in steps {
        at = match step {
            PathStep::Field(name) => match at {
                Json::Object(fields) => fields.get(name)?,
                Json::Array(elements) => elements.get(name.parse::<usize>().ok()?)?,
                _ => return None,
            },
            PathStep::Index(index) => at.as_array()?.get(*index)?,
            PathStep::Named { list, value } => {
                let elements = at.as_array()?;
                let is = |name: Option<&Json>| name.and_then(Json::as_str) == Some(value);
                match elements.iter().find(|element| is(element.get(list))) {
                    Some(element) => element,
                    None => {
                        let names = outer.iter().rev().find_map(|o| o.get(list)?.as_array())?;
                        elements.get(names.iter().position(|name| is(Some(name)))?)?
                    }
                }
            }
        };
        outer.push(at);
    }
    Some(at)
}

/// Names under which a message lists its parts, for messages to the user.
fn names(data: &[u8]) -> Vec<String> {
    let Ok(Json::Object(fields)) = serde_json::from_slice::<Json>(data) else {
        return Vec::new();
    };
    match fields.get("name").and_then(Json::as_array) {
        Some(names) => names
            .iter()
            .filter_map(|name| Some(name.as_str()?.to_owned()))
            .collect(),
        None => fields.into_iter().map(|(name, _)| name).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MESSAGE: &[u8] = br#"{"t": 1.5, "on": true, "big": 18446744073709551615, "text": "1",
        "name": ["a", "b"], "arm": {"position": [1, 2.5]},
        "joints": [{"id": "x", "q": -1}, {"id": "y", "q": 7}], "deep/key": {"~": [[4]]}}"#;

    fn value(paths: &[&str]) -> Value {
        let fields = [paths.iter().map(|path| FieldPath::parse(path)).collect()];
        let mut out = [Value::Absent];
        read(MESSAGE, &fields, &mut out).unwrap();
        out[0]
    }

    #[test]
    fn pointers_paths_and_names_lead_to_numbers() {
        assert_eq!(value(&["/t"]), Value::Float(1.5));
        assert_eq!(value(&["t"]), Value::Float(1.5));
        assert_eq!(value(&["/on"]), Value::Int(1));
        assert_eq!(value(&["big"]), Value::Unsigned(u64::MAX));
        assert_eq!(value(&["/arm/position/1"]), Value::Float(2.5));
        assert_eq!(value(&["arm.position[name=b]"]), Value::Float(2.5));
        assert_eq!(value(&["joints[id=y].q"]), Value::Int(7));
        assert_eq!(value(&["/deep~1key/~0/0/0"]), Value::Int(4));
    }

    #[test]
    fn what_is_not_there_or_no_number_is_absent_and_the_next_path_is_tried() {
        for path in [
            "/text",
            "/arm",
            "/arm/position/2",
            "arm.position[name=c]",
            "/t/x",
        ] {
            assert_eq!(value(&[path]), Value::Absent, "{path}");
        }
        assert_eq!(value(&["/none", "/text", "/t"]), Value::Float(1.5));
    }
}
