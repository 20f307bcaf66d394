//! Numbers out of JSON messages by field path or JSON pointer.

use serde_json::Value as Json;

use super::leaves::{Tree, of_tree};
use crate::log::json_text::parsed;
use crate::log::recording::message::{Leaf, MessageReader, Schema, Uneven};
use crate::log::recording::path::{FieldPath, PathStep};
use crate::log::recording::value::Value;

/// Reads some fields of JSON messages.
struct JsonReader {
    fields: Vec<Vec<FieldPath>>,
    uneven: Option<Uneven>,
}

/// Messages in JSON, whatever their schema.
pub(super) fn open(
    schema: &Schema,
    fields: &[Vec<FieldPath>],
) -> Option<Result<Box<dyn MessageReader>, String>> {
    let reader = || JsonReader {
        fields: fields.to_vec(),
        uneven: None,
    };
    (schema.encoding == "json").then(|| Ok(Box::new(reader()) as Box<_>))
}

impl MessageReader for JsonReader {
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String> {
        self.uneven = None;
        read(data, &self.fields, out, &mut self.uneven).map_err(|error| error.to_string())
    }

    fn names(&self, data: &[u8]) -> Vec<String> {
        names(data)
    }

    fn uneven(&self) -> Option<Uneven> {
        self.uneven.clone()
    }

    fn leaves(&self, data: &[u8]) -> Vec<Leaf> {
        parsed(data).map_or_else(|_| Vec::new(), |root| of_tree(&tree(&root)))
    }
}

/// What a JSON value holds.
fn tree(value: &Json) -> Tree {
    match value {
        Json::Null | Json::Bool(_) | Json::Number(_) => Tree::Number,
        Json::String(text) => Tree::Text(text.clone()),
        Json::Object(fields) => {
            let fields = fields
                .iter()
                .map(|(name, value)| (name.clone(), tree(value)));
            Tree::Fields(fields.collect())
        }
        Json::Array(all) => {
            let texts = all.iter().map(|x| x.as_str().map(str::to_owned));
            match texts.collect::<Option<Vec<String>>>() {
                Some(texts) if !texts.is_empty() => Tree::Texts(texts),
                _ if all.iter().all(|x| x.is_number() || x.is_null()) => Tree::Numbers(all.len()),
                _ => Tree::Elements(all.iter().map(tree).collect()),
            }
        }
    }
}

/// Reads `fields` of one message into `out`: for each the first of its paths that leads to a number.
fn read(
    data: &[u8],
    fields: &[Vec<FieldPath>],
    out: &mut [Value],
    uneven: &mut Option<Uneven>,
) -> Result<(), serde_json::Error> {
    let root = parsed(data)?;
    for (paths, out) in fields.iter().zip(out) {
        let numbers = paths
            .iter()
            .filter_map(|path| find(&root, &path.steps, uneven));
        let mut numbers = numbers.map(number);
        *out = numbers.find(is_there).unwrap_or_default();
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
fn find<'j>(root: &'j Json, steps: &[PathStep], uneven: &mut Option<Uneven>) -> Option<&'j Json> {
    let mut at = root;
    let mut outer = vec![root];
    for (place, step) in steps.iter().enumerate() {
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
                        if names.len() != elements.len() {
                            let field = place.checked_sub(1).and_then(|before| steps.get(before));
                            if let (Some(PathStep::Field(array)), false) =
                                (field, elements.is_empty())
                            {
                                *uneven = Some(Uneven {
                                    array: array.clone(),
                                    numbers: elements.len(),
                                    names: names.len(),
                                });
                            }
                            return None;
                        }
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
    let Ok(Json::Object(fields)) = parsed(data) else {
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
        read(MESSAGE, &fields, &mut out, &mut None).unwrap();
        out[0]
    }

    #[test]
    fn numbers_that_json_does_not_have_are_no_numbers() {
        let text = br#"{"name": ["NaN", "b\""], "position": [NaN, -Infinity], "x": 2}"#;
        let fields = ["position[0]", "position[name=NaN]", "x"];
        let fields = fields.map(|path| vec![FieldPath::parse(path)]);
        let mut out = [Value::Absent; 3];
        read(text, &fields, &mut out, &mut None).unwrap();
        assert_eq!(out, [Value::Absent, Value::Absent, Value::Int(2)]);
        assert!(parsed(br#"{"a": None}"#).is_err());
    }

    #[test]
    fn an_array_of_another_length_than_its_names_is_given_to_no_name() {
        let text = br#"{"name": ["a", "b"], "effort": [1.0]}"#;
        let fields = [vec![FieldPath::named("effort", "name", "a")]];
        let (mut out, mut uneven) = ([Value::Absent], None);
        read(text, &fields, &mut out, &mut uneven).unwrap();
        let said = uneven.unwrap();
        assert_eq!(out, [Value::Absent]);
        assert_eq!((&*said.array, said.numbers, said.names), ("effort", 1, 2));
    }

    #[test]
    fn every_number_is_listed_with_its_path_and_the_names_beside_it() {
        let listed: Vec<(String, String)> = of_tree(&tree(&parsed(MESSAGE).unwrap()))
            .into_iter()
            .map(|leaf| (leaf.path, leaf.label))
            .collect();
        let has = |path: &str, label: &str| listed.contains(&(path.into(), label.into()));
        assert!(has("arm.position[name=b]", "arm.position.b"), "{listed:?}");
        assert!(has("joints[1].q", "joints.y.q"), "{listed:?}");
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
