//! One campaign as a laboratory runs it: fit, diagnose, and look at a log that nobody has used.

use std::path::Path as File;

use serde_json::{Value, json};

use crate::lab::errors;
use crate::model::Model;
use crate::study::StudyError;
use crate::tool::{ENDED, Tool};

/// Which logs serve for what; paths as the program takes them, with spans.
pub struct Campaign {
    pub robot: String,
    pub fitted: Vec<String>,
    pub holdout: Option<String>,
    pub unseen: Option<String>,
}

impl Campaign {
    /// The logs that the studies of simulated plants write.
    pub fn simulated() -> Self {
        Self {
            robot: "robot.toml".to_owned(),
            fitted: vec!["a.csv".to_owned(), "b.csv".to_owned()],
            holdout: Some("held.csv".to_owned()),
            unseen: Some("unseen.csv".to_owned()),
        }
    }

    /// Fits and diagnoses, and says what was written and what it did to the unseen log: the exit status, the steps as
    /// `[effect, family, joint, status, alternatives, parameters]`, the effects written as `[name, joint]`, those that are
    /// written for prediction alone apart, and the errors by joint before and after. `model.toml` and `refined.toml` are left in the folder.
    pub fn diagnosed(&self, tool: &Tool, folder: &File) -> Result<Value, StudyError> {
        let logs = || self.fitted.iter().map(String::as_str);
        let mut words = vec!["lsq", "-r", &self.robot, "-o", "model.toml"];
        words.extend(logs());
        let fit = tool.run(folder, &words)?;
        if fit.exit != 0 {
            return Ok(json!({ "exit": fit.exit, "said": fit.last_words() }));
        }
        let mut words = vec!["diagnose", "-m", "model.toml", "-o", "refined.toml"];
        words.extend(logs());
        if let Some(holdout) = &self.holdout {
            words.extend(["--holdout", holdout]);
        }
        let answer = tool.run(folder, &words)?;
        let steps: Vec<Value> = answer
            .list("steps")
            .iter()
            .map(|s| {
                json!([
                    s["effect"],
                    s["family"],
                    s["joint"],
                    s["status"],
                    s["alternatives"],
                    s["parameters"]
                ])
            })
            .collect();
        let mut row = json!({ "exit": answer.exit, "steps": steps });
        let refined = folder.join("refined.toml");
        if answer.exit != 0 || !refined.exists() {
            row["said"] = json!(answer.last_words());
            if answer.exit != ENDED {
                row["written"] = json!([]);
            }
            return Ok(row);
        }
        let before = effects(&Model::read(&folder.join("model.toml"))?);
        let mut after = effects(&Model::read(&refined)?);
        for name in &before {
            if let Some(at) = after.iter().position(|n| n == name) {
                after.remove(at);
            }
        }
        let (predicting, named): (Vec<_>, Vec<_>) =
            after.into_iter().partition(|e| e.predicts_only);
        row["written"] = json!(names_of(&named));
        row["predicting"] = json!(names_of(&predicting));
        if let Some(unseen) = &self.unseen {
            row["unseen_before"] = json!(errors(tool, folder, unseen, "model.toml")?);
            row["unseen_after"] = json!(errors(tool, folder, unseen, "refined.toml")?);
        }
        Ok(row)
    }
}

/// An effect of a model file.
#[derive(PartialEq)]
struct WrittenEffect {
    name: String,
    joint: String,
    predicts_only: bool,
}

/// The effects of a model.
fn effects(model: &Model) -> Vec<WrittenEffect> {
    let text = |effect: &toml::Value, key: &str| {
        let value = effect.get(key).and_then(toml::Value::as_str);
        value.unwrap_or_default().to_owned()
    };
    let of = |effect: &toml::Value| WrittenEffect {
        name: text(effect, "name"),
        joint: text(effect, "joint"),
        predicts_only: effect.get("prediction_only").and_then(toml::Value::as_bool) == Some(true),
    };
    model.effect.iter().map(of).collect()
}

/// Names and joints of effects.
fn names_of(effects: &[WrittenEffect]) -> Vec<[&str; 2]> {
    let names = effects.iter().map(|e| [e.name.as_str(), e.joint.as_str()]);
    names.collect()
}

/// Whether the diagnosis came to its end.
pub fn is_done(row: &Value) -> bool {
    row["written"].is_array() && row["exit"] != ENDED
}
