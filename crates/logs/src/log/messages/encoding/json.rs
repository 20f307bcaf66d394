//! Numbers out of JSON messages by field path or JSON pointer.

use serde_json::Value as Json;

use super::leaves::{Tree, of_tree};
use crate::log::json_text::parsed;
use crate::log::messages::message::{FieldLeaf, MessageReader, OpenedReader, Schema, UnevenArray};
use crate::log::messages::path::{FieldPath, PathStep};
use crate::log::messages::value::Value;

struct JsonReader {
    fields: Vec<Vec<FieldPath>>,
    uneven: Option<UnevenArray>,
}

/// Messages in JSON, whatever their schema.
pub(super) fn open(schema: &Schema, fields: &[Vec<FieldPath>]) -> Option<OpenedReader> {
    let (fields, uneven) = (fields.to_vec(), None);
    (schema.encoding == "json").then(|| Ok(Box::new(JsonReader { fields, uneven }) as Box<_>))
}

impl MessageReader for JsonReader {
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String> {
        self.uneven = None;
        let root = parsed(data).map_err(|error| error.to_string())?;
        for (paths, out) in self.fields.iter().zip(out) {
            let found = |path: &FieldPath| find(&root, &path.steps, &mut self.uneven);
            let mut numbers = paths.iter().filter_map(found).map(number);
            let there = numbers.find(|number| *number != Value::Absent);
            *out = there.unwrap_or_default();
        }
        Ok(())
    }

    fn names(&self, data: &[u8]) -> Vec<String> {
        let Ok(Json::Object(fields)) = parsed(data) else {
            return Vec::new();
        };
        let text = |name: &Json| name.as_str().map(str::to_owned);
        match fields.get("name").and_then(Json::as_array) {
            Some(names) => names.iter().filter_map(text).collect(),
            None => fields.into_iter().map(|(name, _)| name).collect(),
        }
    }

    fn uneven(&self) -> Option<UnevenArray> {
        self.uneven.clone()
    }

    fn leaves(&self, data: &[u8]) -> Vec<FieldLeaf> {
        parsed(data).map_or_else(|_| Vec::new(), |root| of_tree(&tree(&root)))
    }
}

fn tree(value: &Json) -> Tree {
    match value {
        Json::Null | Json::Bool(_) | Json::Number(_) => Tree::Number,
        Json::String(text) => Tree::Text(text.clone()),
        Json::Object(fields) => {
            let field = |(name, value): (&String, &Json)| (name.clone(), tree(value));
            Tree::Fields(fields.iter().map(field).collect())
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

fn number(value: &Json) -> Value {
    let whole = value.as_bool().map(i64::from).or_else(|| value.as_i64());
    let whole = whole
        .map(Value::Int)
        .or_else(|| value.as_u64().map(Value::Unsigned));
    let number = whole.or_else(|| value.as_f64().map(Value::Float));
    number.unwrap_or_default()
}

/// Follows a path; elements that are named are looked up beside their array, then further out.
fn find<'j>(
    root: &'j Json,
    steps: &[PathStep],
    uneven: &mut Option<UnevenArray>,
) -> Option<&'j Json> {
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
                            if let Some(PathStep::Field(array)) = field
                                && !elements.is_empty()
                            {
                                *uneven = Some(UnevenArray {
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

#[cfg(test)]
mod tests {
    use super::*;

    const MESSAGE: &[u8] = br#"{"t": 1.5, "on": true, "big": 18446744073709551615, "text": "1",
        "name": ["a", "b"], "arm": {"position": [1, 2.5]},
        "joints": [{"id": "x", "q": -1}, {"id": "y", "q": 7}], "deep/key": {"~": [[4]]}}"#;

    fn read<const N: usize>(
        text: &[u8],
        fields: [&[&str]; N],
    ) -> ([Value; N], Option<UnevenArray>) {
        let parse = |paths: &[&str]| paths.iter().map(|path| FieldPath::parse(path)).collect();
        let mut reader = JsonReader {
            fields: fields.map(parse).to_vec(),
            uneven: None,
        };
        let mut out = [Value::Absent; N];
        reader.read(text, &mut out).unwrap();
        (out, reader.uneven)
    }

    fn value(paths: &[&str]) -> Value {
        read(MESSAGE, [paths]).0[0]
    }

    #[test]
    fn numbers_that_json_does_not_have_are_no_numbers() {
        let text = br#"{"name": ["NaN", "b\""], "position": [NaN, -Infinity], "x": 2}"#;
        let (out, _) = read(text, [&["position[0]"], &["position[name=NaN]"], &["x"]]);
        assert_eq!(out, [Value::Absent, Value::Absent, Value::Int(2)]);
        assert!(parsed(br#"{"a": None}"#).is_err());
    }

    #[test]
    fn an_array_of_another_length_than_its_names_is_given_to_no_name() {
        let text = br#"{"name": ["a", "b"], "effort": [1.0]}"#;
        let (out, uneven) = read(text, [&["effort[name=a]"]]);
        let said = uneven.unwrap();
        assert_eq!(out, [Value::Absent]);
        assert_eq!((&*said.array, said.numbers, said.names), ("effort", 1, 2));
    }

    #[test]
    fn every_number_is_listed_with_its_path_and_the_names_beside_it() {
        let listed = of_tree(&tree(&parsed(MESSAGE).unwrap()));
        for (path, label, expected) in [
            ("arm.position[name=b]", "arm.position.b", Value::Float(2.5)),
            ("joints[id=y].q", "joints.y.q", Value::Int(7)),
        ] {
            let mut pairs = listed.iter().map(|leaf| (&*leaf.path, &*leaf.label));
            assert!(pairs.any(|leaf| leaf == (path, label)), "{listed:?}");
            assert_eq!(value(&[path]), expected, "{path}");
        }
    }

    #[test]
    fn pointers_paths_and_names_lead_to_numbers() {
        for (path, expected) in [
            ("/t", Value::Float(1.5)),
            ("t", Value::Float(1.5)),
            ("/on", Value::Int(1)),
            ("big", Value::Unsigned(u64::MAX)),
            ("/arm/position/1", Value::Float(2.5)),
            ("arm.position[name=b]", Value::Float(2.5)),
            ("joints[id=y].q", Value::Int(7)),
            ("/deep~1key/~0/0/0", Value::Int(4)),
        ] {
            assert_eq!(value(&[path]), expected, "{path}");
        }
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
