//! Two runs of one command side by side, by the JSON documents that they wrote: parameters in standard
//! deviations of their difference, errors, and the verdicts that changed.

use cft_ident_core::explain::Explain;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use thiserror::Error;

use super::parameters::{ParameterEntry, ParameterEstimate, SideBySide, paired};
use cft_ident_core::verdict::Verdict;

/// Commands whose documents can be set side by side.
const COMMANDS: [&str; 5] = ["friction", "lsq", "validate", "diagnose", "identify"];

/// Documents that cannot be compared.
#[derive(Debug, Explain, Error, PartialEq, Eq)]
pub enum DiffError {
    /// No document of this tool.
    #[explain("{file} is no JSON document of a run", "write one with --json FILE")]
    NoDocument { file: String },
    /// A command without parameters, errors and verdicts.
    #[explain(
        "{file} is a document of `{command}`, which estimates nothing",
        format!("give two of {}", COMMANDS.join(", "))
    )]
    NothingEstimated { file: String, command: String },
    /// Two commands.
    #[explain(
        "the documents are those of `{a}` and of `{b}`",
        "give two of one command"
    )]
    TwoCommands { a: String, b: String },
}

/// What differs between two runs, B after A.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct RunDifference {
    /// Command that wrote both.
    pub command: String,
    /// Versions of the tool, A and B.
    pub versions: Vec<String>,
    /// Inputs that one of them has alone: other logs, spans, or contents.
    pub changed_inputs: Vec<InputChange>,
    #[serde(flatten)]
    pub table: SideBySide,
    /// Relative errors, in the order of the documents.
    pub errors: Vec<ErrorChange>,
    /// Verdicts that are not the same.
    pub verdicts: Vec<VerdictChange>,
}

/// An input of one run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct InputChange {
    pub name: String,
    pub span: Option<String>,
    pub sha256: String,
    /// Which run has it.
    #[schemars(extend("enum" = ["a", "b"]))]
    pub only_in: &'static str,
}

/// A relative error in both runs \[1\].
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ErrorChange {
    /// What the error is of.
    pub of: String,
    /// Joint; null over all of them.
    pub joint: Option<String>,
    /// Null where a run has none.
    pub a: Option<f64>,
    pub b: Option<f64>,
    /// 95 % confidence interval of each, where the document has one.
    pub a_interval_95: Option<[f64; 2]>,
    pub b_interval_95: Option<[f64; 2]>,
}

/// A verdict that is another one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct VerdictChange {
    /// What is judged.
    pub of: String,
    pub joint: Option<String>,
    /// Null where a run does not judge it.
    pub a: Option<String>,
    pub b: Option<String>,
}

#[derive(Default)]
struct Said {
    parameters: Vec<ParameterEntry>,
    errors: Vec<Of<RelativeError>>,
    verdicts: Vec<Of<String>>,
}

/// Something that a document says, and what it is of.
struct Of<T> {
    of: String,
    joint: Option<String>,
    said: T,
}

/// A relative error and its interval, where the document has them.
#[derive(Clone, Copy)]
struct RelativeError(Option<f64>, Option<[f64; 2]>);

/// Sets two documents side by side; each is given with the name of its file.
///
/// Deviations are those of independent estimates: runs on the same logs differ by less.
///
/// # Errors
/// Documents of two commands, or of one that estimates nothing.
pub fn runs(a: (&str, &Value), b: (&str, &Value)) -> Result<RunDifference, DiffError> {
    let commands = [command(a)?, command(b)?];
    if commands[0] != commands[1] {
        let [a, b] = commands;
        return Err(DiffError::TwoCommands { a, b });
    }
    let [command, _] = commands;
    let [ours, theirs] = [a.1, b.1].map(|document| {
        let mut said = Said::default();
        match command.as_str() {
            "identify" => COMMANDS.iter().for_each(|c| said.add(c, &document[*c])),
            command => said.add(command, document),
        }
        said
    });
    let version = |document: &Value| text(&document["version"]).unwrap_or_default();
    Ok(RunDifference {
        command,
        versions: vec![version(a.1), version(b.1)],
        changed_inputs: changed_inputs(a.1, b.1),
        table: paired(&ours.parameters, &theirs.parameters),
        errors: errors(&ours.errors, &theirs.errors),
        verdicts: verdicts(&ours.verdicts, &theirs.verdicts),
    })
}

fn command((file, document): (&str, &Value)) -> Result<String, DiffError> {
    let schema = document["schema"].as_str().unwrap_or_default();
    let mut parts = schema.split('/');
    let (Some("cft-ident"), Some(command)) = (parts.next(), parts.next()) else {
        return Err(DiffError::NoDocument { file: file.into() });
    };
    match COMMANDS.contains(&command) {
        true => Ok(command.to_owned()),
        false => Err(DiffError::NothingEstimated {
            file: file.into(),
            command: command.into(),
        }),
    }
}

impl Said {
    /// What the document of a command says; nothing where it is null.
    fn add(&mut self, command: &str, document: &Value) {
        self.judge("run", None, &document["verdict"]);
        match command {
            "friction" => self.friction(document),
            "lsq" => self.least_squares(document),
            "validate" => self.errors("error", document),
            "diagnose" => self.diagnosis(document),
            _ => {}
        }
    }

    fn friction(&mut self, document: &Value) {
        for joint in list(&document["joints"]) {
            let name = text(&joint["joint"]);
            for (key, found) in fields(&joint["parameters"]) {
                self.parameter(key, name.clone(), "", found);
            }
            self.error("friction fit", joint);
        }
    }

    fn least_squares(&mut self, document: &Value) {
        for found in list(&document["parameters"]) {
            // the name of a base parameter says its meaning, its key is short
            let name = text(&found["name"]).unwrap_or_default();
            let key = text(&found["key"]).unwrap_or_else(|| name.clone());
            self.parameter(&key, text(&found["joint"]), &name, found);
        }
        for joint in list(&document["friction"]) {
            for (key, found) in fields(&joint["parameters"]) {
                self.parameter(key, text(&joint["joint"]), "refined", found);
            }
        }
        for joint in list(&document["joints"]) {
            self.error("fit", joint);
        }
    }

    fn diagnosis(&mut self, document: &Value) {
        let mut before: Vec<String> = Vec::new();
        for step in list(&document["steps"]) {
            let effect = text(&step["effect"]).unwrap_or_default();
            let joint = text(&step["joint"]);
            let place = format!("{effect} {}", joint.as_deref().unwrap_or_default());
            // an effect may be there more than once, as two ripples of one joint are
            let name = match before.iter().filter(|known| **known == place).count() {
                0 => effect,
                n => format!("{effect}#{}", n + 1),
            };
            before.push(place);
            for (key, found) in fields(&step["parameters"]) {
                self.parameter(&format!("{name}.{key}"), joint.clone(), "", found);
            }
            let status = text(&step["status"]).unwrap_or_else(|| "added".to_owned());
            self.judge(&name, joint, &Value::from(status));
        }
        for (of, key) in [("held-out, before", "before"), ("held-out, after", "after")] {
            self.errors(of, &document[key]["holdout"]);
        }
    }

    fn errors(&mut self, of: &str, document: &Value) {
        for joint in list(&document["joints"]) {
            self.error(of, joint);
        }
        let overall = &document["overall"];
        if overall.is_object() {
            let value = overall["mean_relative_error"].as_f64();
            self.errors.push(Of {
                of: of.to_owned(),
                joint: None,
                said: RelativeError(value, interval(overall)),
            });
        }
    }

    fn error(&mut self, of: &str, joint: &Value) {
        self.errors.push(Of {
            of: of.to_owned(),
            joint: text(&joint["joint"]),
            said: RelativeError(joint["relative_error"].as_f64(), interval(joint)),
        });
    }

    fn parameter(&mut self, name: &str, joint: Option<String>, meaning: &str, found: &Value) {
        self.judge(name, joint.clone(), &found["verdict"]);
        let Some(value) = found["value"].as_f64() else {
            return;
        };
        let theta = found["theta"].as_u64();
        self.parameters.push(ParameterEntry {
            name: name.to_owned(),
            joint,
            theta: theta.and_then(|theta| u32::try_from(theta).ok()),
            unit: text(&found["unit"]).unwrap_or_default(),
            meaning: meaning.to_owned(),
            estimate: ParameterEstimate {
                value,
                std: found["std"].as_f64(),
                verdict: serde_json::from_value::<Verdict>(found["verdict"].clone()).ok(),
            },
        });
    }

    fn judge(&mut self, of: &str, joint: Option<String>, verdict: &Value) {
        self.verdicts.extend(text(verdict).map(|said| Of {
            of: of.to_owned(),
            joint,
            said,
        }));
    }
}

fn changed_inputs(a: &Value, b: &Value) -> Vec<InputChange> {
    let only = |of: &Value, other: &Value, only_in: &'static str| -> Vec<InputChange> {
        let same = |x: &Value, y: &Value| x["sha256"] == y["sha256"] && x["span"] == y["span"];
        let inputs = list(&of["inputs"]);
        inputs
            .filter(|input| !list(&other["inputs"]).any(|there| same(input, there)))
            .map(|input| InputChange {
                name: text(&input["name"]).unwrap_or_default(),
                span: text(&input["span"]),
                sha256: text(&input["sha256"]).unwrap_or_default(),
                only_in,
            })
            .collect()
    };
    [only(a, b, "a"), only(b, a, "b")].concat()
}

/// What both documents say of the same, then what the second says alone.
fn both<'a, T>(ours: &'a [Of<T>], theirs: &'a [Of<T>]) -> Vec<(&'a Of<T>, [Option<&'a T>; 2])> {
    let same = |x: &Of<T>, y: &Of<T>| x.of == y.of && x.joint == y.joint;
    let of_ours = ours.iter().map(|a| {
        let b = theirs.iter().find(|b| same(a, b));
        (a, [Some(&a.said), b.map(|b| &b.said)])
    });
    let added = theirs.iter().filter(|b| !ours.iter().any(|a| same(a, b)));
    of_ours
        .chain(added.map(|b| (b, [None, Some(&b.said)])))
        .collect()
}

fn errors(ours: &[Of<RelativeError>], theirs: &[Of<RelativeError>]) -> Vec<ErrorChange> {
    let none = RelativeError(None, None);
    let change = |(of, said): (&Of<RelativeError>, [Option<&RelativeError>; 2])| {
        let [a, b] = said.map(|said| said.copied().unwrap_or(none));
        ErrorChange {
            of: of.of.clone(),
            joint: of.joint.clone(),
            a: a.0,
            b: b.0,
            a_interval_95: a.1,
            b_interval_95: b.1,
        }
    };
    both(ours, theirs).into_iter().map(change).collect()
}

fn verdicts(ours: &[Of<String>], theirs: &[Of<String>]) -> Vec<VerdictChange> {
    let mut all = both(ours, theirs);
    all.retain(|(_, [a, b])| a != b);
    let change = |(of, [a, b]): (&Of<String>, [Option<&String>; 2])| VerdictChange {
        of: of.of.clone(),
        joint: of.joint.clone(),
        a: a.cloned(),
        b: b.cloned(),
    };
    all.into_iter().map(change).collect()
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn fields(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let fields = value.as_object().into_iter().flatten();
    fields.map(|(key, value)| (key.as_str(), value))
}

fn text(value: &Value) -> Option<String> {
    value.as_str().map(str::to_owned)
}

fn interval(of: &Value) -> Option<[f64; 2]> {
    let ends = of["interval_95"].as_array()?;
    Some([ends.first()?.as_f64()?, ends.get(1)?.as_f64()?])
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn fit(mass: f64, verdict: &str, error: f64) -> Value {
        json!({
            "schema": "cft-ident/lsq/1", "version": "0.2.0",
            "inputs": [{"name": "a.csv", "span": null, "sha256": "1"}],
            "parameters": [
                {"name": "m1 + m2", "key": "m1", "value": mass, "std": 0.3, "unit": "kg",
                 "verdict": verdict, "theta": null, "joint": null},
                {"name": "mx1", "value": null, "std": null, "unit": "kg m",
                 "verdict": "not-identifiable", "theta": null, "joint": null}
            ],
            "joints": [{"joint": "q1", "relative_error": error}]
        })
    }

    #[test]
    fn a_parameter_is_shown_in_deviations_and_a_verdict_where_it_changed() {
        let (a, b) = (fit(10.0, "identified", 0.05), fit(11.0, "weak", 0.04));
        let found = runs(("a.json", &a), ("b.json", &b)).unwrap();
        let [mass] = found.table.parameters.as_slice() else {
            panic!("one parameter has a value in both")
        };
        let expected = 1.0 / 0.3f64.hypot(0.3);
        assert!((mass.deviation.unwrap() - expected).abs() < 1e-12);
        let [change] = found.verdicts.as_slice() else {
            panic!("one verdict changed: {:?}", found.verdicts)
        };
        assert_eq!((&*change.of, change.b.as_deref()), ("m1", Some("weak")));
        let error = &found.errors[0];
        assert_eq!((error.a, error.b), (Some(0.05), Some(0.04)));
        assert!(found.changed_inputs.is_empty());
    }

    #[test]
    fn the_same_document_twice_differs_in_nothing() {
        let a = fit(10.0, "identified", 0.05);
        let found = runs(("a.json", &a), ("a.json", &a)).unwrap();
        assert_eq!(found.table.parameters[0].deviation, Some(0.0));
        assert!(found.verdicts.is_empty() && found.changed_inputs.is_empty());
    }

    #[test]
    fn an_effect_that_one_run_found_is_a_verdict_that_changed() {
        let diagnosis = |steps: Value| {
            json!({"schema": "cft-ident/diagnose/1", "verdict": "effects-found", "steps": steps,
                   "after": {"holdout": {"joints": [], "overall":
                       {"mean_relative_error": 0.1, "interval_95": [0.08, 0.12]}}}})
        };
        let step = json!({"effect": "ripple", "joint": "q1", "status": "assured",
            "parameters": {"order": {"value": 12.0, "std": 0.1, "unit": "1/m"}}});
        let (a, b) = (diagnosis(json!([])), diagnosis(json!([step])));
        let found = runs(("a", &a), ("b", &b)).unwrap();
        assert_eq!(found.verdicts[0].a, None);
        assert_eq!(found.verdicts[0].b.as_deref(), Some("assured"));
        assert_eq!(found.table.only_in_b[0].name, "ripple.order");
        assert_eq!(found.errors[0].a_interval_95, Some([0.08, 0.12]));
    }

    #[test]
    fn documents_that_cannot_be_compared_are_refused_by_name() {
        let of = |command: &str| json!({"schema": format!("cft-ident/{command}/1")});
        let (fit, log, other) = (of("lsq"), of("simulate"), json!({"a": 1}));
        let error = runs(("a", &fit), ("b", &of("validate"))).unwrap_err();
        assert!(matches!(error, DiffError::TwoCommands { .. }));
        let error = runs(("a", &fit), ("b", &log)).unwrap_err();
        assert!(error.to_string().contains("simulate"), "{error}");
        let error = runs(("a", &other), ("b", &fit)).unwrap_err();
        assert_eq!(error, DiffError::NoDocument { file: "a".into() });
    }
}
