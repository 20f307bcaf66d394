//! Whether a value is as its JSON schema says.

use serde_json::Value;

/// What is wrong with a value by a schema: the part of JSON Schema that ours use.
pub fn wrong(value: &Value, schema: &Value, root: &Value, at: &str) -> Option<String> {
    if let Some(target) = schema.get("$ref").and_then(Value::as_str) {
        let target = root.pointer(target.trim_start_matches('#')).expect(target);
        return wrong(value, target, root, at);
    }
    for word in ["anyOf", "oneOf"] {
        if let Some(any) = schema.get(word).and_then(Value::as_array) {
            let fits = any.iter().filter(|s| wrong(value, s, root, at).is_none());
            if fits.count() == 0 {
                return Some(format!("{at}: none of {word}"));
            }
        }
    }
    if let Some(known) = schema.get("enum").and_then(Value::as_array)
        && !known.contains(value)
    {
        return Some(format!("{at}: {value} is none of {known:?}"));
    }
    if let Some(only) = schema.get("const")
        && only != value
    {
        return Some(format!("{at}: {value} and not {only}"));
    }
    let is = |kind: &str| match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("{other}"),
    };
    match schema.get("type") {
        Some(Value::String(kind)) if !is(kind) => return Some(format!("{at}: no {kind}: {value}")),
        Some(Value::Array(kinds)) if !kinds.iter().any(|k| is(k.as_str().unwrap())) => {
            return Some(format!("{at}: none of {kinds:?}: {value}"));
        }
        _ => {}
    }
    if let Some(fields) = value.as_object() {
        for name in schema
            .get("required")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
        {
            if !fields.contains_key(name.as_str().unwrap()) {
                return Some(format!("{at}: {name} is missing"));
            }
        }
        for (name, field) in fields {
            let below = format!("{at}/{name}");
            let known = schema.get("properties").and_then(|p| p.get(name));
            let found = match (known, schema.get("additionalProperties")) {
                (Some(of), _) => wrong(field, of, root, &below),
                (None, Some(Value::Bool(false))) => Some(format!("{below}: unknown")),
                (None, Some(of @ Value::Object(_))) => wrong(field, of, root, &below),
                _ => None,
            };
            if found.is_some() {
                return found;
            }
        }
    }
    if let (Some(items), Some(of)) = (value.as_array(), schema.get("items")) {
        for (i, item) in items.iter().enumerate() {
            let found = wrong(item, of, root, &format!("{at}/{i}"));
            if found.is_some() {
                return found;
            }
        }
    }
    None
}
