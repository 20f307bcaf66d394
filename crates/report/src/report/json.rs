//! The JSON document of a command: the envelope that all of them share.
//!
//! `{"schema": "cft-ident/<command>/1", "version", "inputs": [..], "warnings": [..], ...}`, followed
//! by the fields of the command's own result. Numbers that are not finite become null, since JSON
//! has no other word for them. Nothing of the moment (clock, duration, threads, absolute path)
//! belongs in it.

use std::fmt::Display;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::Serialize;
use serde_json::{Map, Value, json};
use thiserror::Error;

use cft_ident_logs::log::Provenance;

/// Why no document can be made from a result.
#[derive(Debug, Error)]
pub enum JsonError {
    /// The result is not an object with named fields.
    #[error("the result of `{command}` is {found}, and a document needs named fields")]
    NotAnObject {
        command: String,
        found: &'static str,
    },
    /// The result repeats a field of the envelope.
    #[error("the result of `{command}` has a field `{field}` of its own, which the envelope holds")]
    FieldTaken { command: String, field: String },
    /// The result cannot be expressed in JSON.
    #[error("the result of `{command}` cannot be expressed in JSON: {source}")]
    Serialize {
        command: String,
        source: serde_json::Error,
    },
}

/// Of a command that warns of nothing.
pub const NO_WARNINGS: [&str; 0] = [];

/// A complete document, ready to be printed.
#[derive(Debug, Clone, PartialEq)]
pub struct JsonDocument {
    fields: Map<String, Value>,
}

impl JsonDocument {
    /// The document of `command` (`"friction"`, ...) around the fields of `result`.
    ///
    /// # Errors
    /// When `result` is no object, repeats a field of the envelope, or cannot be expressed in JSON.
    pub fn new<T: Serialize, W: Display>(
        command: &str,
        inputs: &[Provenance],
        warnings: &[W],
        result: &T,
    ) -> Result<Self, JsonError> {
        let named = || command.to_owned();
        let failed = |source| JsonError::Serialize {
            command: named(),
            source,
        };
        let mut fields = Map::new();
        fields.insert("schema".into(), schema_of(command).into());
        fields.insert("version".into(), env!("CARGO_PKG_VERSION").into());
        let inputs = serde_json::to_value(inputs).map_err(failed)?;
        fields.insert("inputs".into(), inputs);
        let warnings: Vec<String> = warnings.iter().map(W::to_string).collect();
        fields.insert("warnings".into(), warnings.into());
        let found = match serde_json::to_value(result).map_err(failed)? {
            Value::Object(own) => {
                for (field, value) in own {
                    if fields.contains_key(&field) {
                        let command = named();
                        return Err(JsonError::FieldTaken { command, field });
                    }
                    fields.insert(field, value);
                }
                return Ok(JsonDocument { fields });
            }
            Value::Null => "null",
            Value::Bool(_) => "a truth value",
            Value::Number(_) => "a number",
            Value::String(_) => "a text",
            Value::Array(_) => "a list",
        };
        let command = named();
        Err(JsonError::NotAnObject { command, found })
    }

    /// The warnings in it.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        let warnings = self.fields.get("warnings").and_then(Value::as_array);
        warnings.into_iter().flatten().filter_map(Value::as_str)
    }

    /// Puts further warnings before those that are in it; none stands there twice.
    pub fn warn_first(&mut self, further: Vec<String>) {
        let mut all = further;
        all.retain(|text| self.warnings().all(|own| own != text));
        all.extend(self.warnings().map(str::to_owned));
        self.fields.insert("warnings".into(), all.into());
    }

    /// The fields, the envelope's first.
    pub fn fields(&self) -> &Map<String, Value> {
        &self.fields
    }

    /// The text of the document, indented, with a line end.
    pub fn text(&self) -> String {
        // `Value`'s alternate form is the indented one; it cannot fail, keys are strings already.
        format!("{:#}\n", Value::Object(self.fields.clone()))
    }
}

/// The schema of a command's document around a result of type `T`: the fields that a script may rely on.
/// A document may hold others.
pub fn schema<T: JsonSchema>(command: &str) -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut generator = settings.into_generator();
    let inputs = generator.subschema_for::<Vec<Provenance>>();
    let mut found = Value::from(generator.into_root_schema_for::<T>());
    found["title"] = format!("JSON document of `cft-ident {command}`").into();
    let texts = json!({"type": "array", "items": {"type": "string"}});
    let envelope = [
        ("schema", json!({ "const": schema_of(command) })),
        ("version", json!({"type": "string"})),
        ("inputs", inputs.into()),
        ("warnings", texts),
    ];
    let mut properties = Map::from_iter(envelope.map(|(name, schema)| (name.to_owned(), schema)));
    let mut required: Vec<Value> = properties.keys().map(|name| json!(name)).collect();
    if let Some(Value::Object(own)) = found.get_mut("properties").map(Value::take) {
        properties.extend(own);
    }
    if let Some(Value::Array(own)) = found.get_mut("required").map(Value::take) {
        required.extend(own);
    }
    found["properties"] = properties.into();
    found["required"] = required.into();
    with_null(&mut found);
    found
}

/// A number that is not finite becomes null, so every number of a schema may be null.
fn with_null(schema: &mut Value) {
    match schema {
        Value::Object(fields) => {
            if fields.get("type").is_some_and(|kind| kind == "number") {
                fields.insert("type".into(), json!(["number", "null"]));
            }
            fields.values_mut().for_each(with_null);
        }
        Value::Array(items) => items.iter_mut().for_each(with_null),
        _ => {}
    }
}

/// Name and version of a command's document.
fn schema_of(command: &str) -> String {
    let version = if command == "diagnose" { 4 } else { 1 };
    format!("cft-ident/{command}/{version}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input() -> Provenance {
        Provenance {
            role: None,
            name: "q4.csv".into(),
            span: Some("0..70%".into()),
            sha256: "00ff".into(),
            samples: 14_000,
            duration_s: 14.0,
        }
    }

    #[test]
    fn the_envelope_comes_first_and_the_result_follows_in_its_order() {
        let result = json!({"joints": [], "condition": {"raw": 2.5}});
        let document = JsonDocument::new("lsq", &[input()], &["a gap"], &result).unwrap();
        let keys: Vec<_> = document.fields().keys().map(String::as_str).collect();
        assert_eq!(
            keys.join(" "),
            "schema version inputs warnings joints condition"
        );
        let back: Value = serde_json::from_str(&document.text()).unwrap();
        assert_eq!(back["schema"], "cft-ident/lsq/1");
        assert_eq!(back["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(back["inputs"][0]["samples"], 14_000);
        assert_eq!(document.warnings().collect::<Vec<_>>(), ["a gap"]);
        assert!(document.text().ends_with("}\n"));
    }

    #[test]
    fn numbers_that_are_not_finite_become_null() {
        let list = [f64::INFINITY, 0.1 + 0.2, f64::NEG_INFINITY, f64::NAN];
        let odd = std::collections::BTreeMap::from([("list", list)]);
        let document = JsonDocument::new("friction", &[], &NO_WARNINGS, &odd).unwrap();
        let back: Value = serde_json::from_str(&document.text()).unwrap();
        assert_eq!(back["list"], json!([null, 0.30000000000000004, null, null]));
    }

    #[test]
    fn a_schema_has_the_envelope_and_the_fields_of_the_result() {
        /// Any.
        #[derive(Serialize, JsonSchema)]
        struct Fitted {
            /// Root mean square [N].
            rmse: f64,
            std: Option<f64>,
            joints: Vec<String>,
        }
        let schema = schema::<Fitted>("lsq");
        let required = [
            "schema", "version", "inputs", "warnings", "rmse", "std", "joints",
        ];
        assert_eq!(schema["required"], json!(required));
        assert_eq!(schema["properties"]["schema"]["const"], "cft-ident/lsq/1");
        let rmse = &schema["properties"]["rmse"];
        assert_eq!(rmse["type"], json!(["number", "null"]));
        assert_eq!(rmse["description"], "Root mean square [N].");
    }

    #[test]
    fn a_result_without_fields_or_with_fields_of_the_envelope_is_refused() {
        let list = JsonDocument::new("lsq", &[], &NO_WARNINGS, &json!([1, 2]));
        assert!(matches!(list, Err(JsonError::NotAnObject { found, .. }) if found == "a list"));
        let twice = JsonDocument::new("lsq", &[], &NO_WARNINGS, &json!({"version": 3}));
        assert!(matches!(twice, Err(JsonError::FieldTaken { field, .. }) if field == "version"));
    }
}
