//! JSON schemas of the files of the user, from the types that read them.

use schemars::{JsonSchema, schema_for};
use serde_json::Value;

use super::{CampaignFile, RobotFile, model_text, trajectory};

fn of<T: JsonSchema>() -> Value {
    Value::from(schema_for!(T))
}

/// Of a robot file.
pub fn robot() -> Value {
    of::<RobotFile>()
}

/// Of a model file.
pub fn model() -> Value {
    of::<model_text::ModelToml>()
}

/// Of a campaign file.
pub fn campaign() -> Value {
    of::<CampaignFile>()
}

/// Of a trajectory file.
pub fn trajectory() -> Value {
    of::<trajectory::TrajectoryToml>()
}
