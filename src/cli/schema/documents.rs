//! Schemas of the JSON documents: the fields that a script may rely on.

use serde_json::{Map, Value, json};

use super::Kind;

/// A number, or null where nothing determines it.
fn number() -> Value {
    json!({"type": ["number", "null"]})
}

fn text() -> Value {
    json!({"type": "string"})
}

/// A text, or null where it concerns all.
fn maybe_text() -> Value {
    json!({"type": ["string", "null"]})
}

fn truth() -> Value {
    json!({"type": "boolean"})
}

fn count() -> Value {
    json!({"type": ["number", "null"], "minimum": 0})
}

fn one_of(words: &[&str]) -> Value {
    json!({"type": "string", "enum": words})
}

fn list(of: Value) -> Value {
    json!({"type": "array", "items": of})
}

/// An object that has these fields, and may have others.
fn object(fields: &[(&str, Value)]) -> Value {
    let names: Vec<&str> = fields.iter().map(|(name, _)| *name).collect();
    let properties: Map<String, Value> = fields
        .iter()
        .map(|(name, of)| ((*name).to_owned(), of.clone()))
        .collect();
    json!({"type": "object", "properties": properties, "required": names})
}

/// An object with any keys, each of this kind.
fn table(of: Value) -> Value {
    json!({"type": "object", "additionalProperties": of})
}

fn verdict() -> Value {
    json!({"enum": ["identified", "weak", "not-identifiable", "lower-bound", null]})
}

fn measured() -> Value {
    object(&[("value", number()), ("std", number()), ("unit", text())])
}

/// A file that was read, by its content.
fn input() -> Value {
    object(&[
        ("name", text()),
        ("span", maybe_text()),
        (
            "sha256",
            json!({"type": "string", "pattern": "^[0-9a-f]{64}$"}),
        ),
        ("samples", count()),
        ("duration_s", number()),
    ])
}

fn processing() -> Value {
    object(&[("cutoff_hz", number()), ("decimation", number())])
}

/// Errors of torques, by joint and over all.
fn errors() -> Vec<(&'static str, Value)> {
    let joint = object(&[
        ("joint", text()),
        ("unit", text()),
        ("rmse", number()),
        ("relative_error", number()),
        ("relative_error_raw", number()),
        ("max_abs", number()),
        ("r2", number()),
        ("samples", count()),
    ]);
    let overall = object(&[
        ("relative_error", number()),
        ("mean_relative_error", number()),
    ]);
    vec![("joints", list(joint)), ("overall", overall)]
}

fn diagnose() -> Vec<(&'static str, Value)> {
    let step = object(&[
        ("effect", text()),
        ("family", text()),
        ("joint", maybe_text()),
        ("parameters", table(measured())),
        (
            "alternatives",
            json!({"type": "array", "items": text(), "maxItems": 3}),
        ),
        ("assured", json!({"type": "boolean"})),
        ("separate_by", maybe_text()),
        ("delta_bic", number()),
        ("cv_gain", number()),
        ("holdout_before", number()),
        ("holdout_after", number()),
        ("holdout_worsened", json!({"type": ["boolean", "null"]})),
    ]);
    let side = || {
        let mut of = object(&errors());
        of["type"] = json!(["object", "null"]);
        of
    };
    let sides = || object(&[("train", side()), ("holdout", side())]);
    let candidate = object(&[
        ("effect", text()),
        ("joint", maybe_text()),
        ("score", number()),
        ("unique_share", number()),
        ("accepted", truth()),
        ("significant", truth()),
        ("reason", text()),
    ]);
    vec![
        (
            "verdict",
            one_of(&[
                "effects-found",
                "nothing-missing",
                "unexplained-residual",
                "data-fault",
            ]),
        ),
        ("steps", list(step)),
        ("before", sides()),
        ("after", sides()),
        (
            "unexplained",
            list(object(&[("joint", text()), ("share", number())])),
        ),
        ("candidates", list(candidate)),
        ("processing", processing()),
    ]
}

fn compare() -> Vec<(&'static str, Value)> {
    let model = object(&[
        ("name", text()),
        ("version", text()),
        ("command", text()),
        ("inputs", list(input())),
    ]);
    let side = || {
        object(&[
            ("value", number()),
            ("std", number()),
            ("verdict", verdict()),
        ])
    };
    let parameter = object(&[
        ("name", text()),
        ("joint", maybe_text()),
        ("theta", number()),
        ("unit", text()),
        ("a", side()),
        ("b", side()),
        ("difference", number()),
        ("difference_std", number()),
        ("deviation", number()),
    ]);
    let alone = || {
        list(object(&[
            ("name", text()),
            ("joint", maybe_text()),
            ("value", number()),
            ("std", number()),
            ("unit", text()),
            ("reason", one_of(&["absent", "other-unit", "other-meaning"])),
        ]))
    };
    let curve = object(&[
        ("v", number()),
        ("a", number()),
        ("a_std", number()),
        ("b", number()),
        ("b_std", number()),
    ]);
    let friction = object(&[
        ("joint", text()),
        ("speed_unit", text()),
        ("torque_unit", text()),
        ("speeds_from", one_of(&["logs", "limits", "assumed"])),
        ("curve", list(curve)),
    ]);
    let error = || {
        object(&[
            ("rmse", number()),
            ("relative_error", number()),
            ("relative_error_raw", number()),
            ("max_abs", number()),
            ("r2", number()),
            ("samples", count()),
        ])
    };
    let interval = || json!({"type": ["array", "null"], "items": number()});
    let joint = object(&[
        ("joint", text()),
        ("unit", text()),
        ("a", error()),
        ("b", error()),
        ("difference", number()),
        ("interval_95", interval()),
    ]);
    let all = || {
        object(&[
            ("relative_error", number()),
            ("mean_relative_error", number()),
        ])
    };
    let overall = object(&[
        ("a", all()),
        ("b", all()),
        ("difference", number()),
        ("interval_95", interval()),
    ]);
    // without a log there is nothing to reconstruct
    let mut logs = object(&[
        ("joints", list(joint)),
        ("overall", overall),
        ("processing", processing()),
    ]);
    logs["type"] = json!(["object", "null"]);
    vec![
        ("models", list(model)),
        ("parameters", list(parameter)),
        ("only_in_a", alone()),
        ("only_in_b", alone()),
        ("friction", list(friction)),
        ("logs", logs),
    ]
}

/// Fields of a command's own result.
fn fields(kind: Kind) -> (&'static str, Vec<(&'static str, Value)>) {
    let part = || json!({"type": ["object", "null"]});
    match kind {
        Kind::Diagnose => ("diagnose", diagnose()),
        Kind::Compare => ("compare", compare()),
        Kind::Identify => (
            "identify",
            vec![
                ("friction", part()),
                ("lsq", part()),
                ("validate", part()),
                ("diagnose", part()),
                ("truth", part()),
                ("files", json!({})),
            ],
        ),
        _ => ("convert", Vec::new()),
    }
}

/// The schema of a command's document.
pub(super) fn schema(kind: Kind) -> Value {
    let (command, own) = fields(kind);
    let mut all = vec![
        ("schema", json!({"const": format!("cft-ident/{command}/1")})),
        ("version", text()),
        ("inputs", list(input())),
        ("warnings", list(text())),
    ];
    all.extend(own);
    let mut found = object(&all);
    found["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    found["title"] = format!("JSON document of `cft-ident {command}`").into();
    found
}
