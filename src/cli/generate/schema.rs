//! The JSON schema of every file that is read or written.

use clap::ValueEnum;
use serde_json::Value;

use crate::cli::{
    CliError, Outcome, convert, example, excite, export, identify, inspect, new, reduce, show,
    simulate,
};
use cft_ident_drive::drive::outcome::DriveResult;
use cft_ident_files::config::schema::{campaign, model, robot, trajectory};
use cft_ident_plant::excite::MotionJudgements;
use cft_ident_plant::simulate::truth::TruthFile;
use cft_ident_report::report::json::{self, JsonDocument, NO_WARNINGS};
use cft_ident_stages::identify::{
    ComparisonResult, DiagnosisResult, IdentifiedDynamics, IdentifiedFriction, Payload,
    TorqueAlong, Tracked, Validated, Watched,
};
use cft_ident_tool::held::GravityFit;
use cft_ident_tool::tool::ToolResult;

/// What a schema is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SchemaKind {
    /// Robot file (TOML)
    Robot,
    /// Model file (TOML)
    Model,
    /// Campaign file (TOML)
    Campaign,
    /// Trajectory file (TOML)
    Trajectory,
    /// Truth of a simulated log (TOML)
    Truth,
    /// JSON document of `friction`
    Friction,
    /// JSON document of `lsq`
    Lsq,
    /// JSON document of `lsq --static`
    LsqStatic,
    /// JSON document of `validate`
    Validate,
    /// JSON document of `reduce`
    Reduce,
    /// JSON document of `track`
    Track,
    /// JSON document of `diagnose`
    Diagnose,
    /// JSON document of `drive`
    Drive,
    /// JSON document of `compare`
    Compare,
    /// JSON document of `identify`
    Identify,
    /// JSON document of `excite`
    Excite,
    /// JSON document of `excite --static`
    ExciteStatic,
    /// JSON document of `simulate`
    Simulate,
    /// JSON document of `inspect`
    Inspect,
    /// JSON document of `payload`
    Payload,
    /// JSON document of `tool`
    Tool,
    /// JSON document of `show`
    Show,
    /// JSON document of `torque`
    Torque,
    /// JSON document of `watch`
    Watch,
    /// JSON document of `convert`
    Convert,
    /// JSON document of `export`
    Export,
    /// JSON document of `new`
    New,
    /// JSON document of `example`
    Example,
}

/// Write the JSON schema of a file, or of the JSON document of a command, to standard output.
///
/// A schema of a TOML file is that of its tables as JSON; editors check and complete TOML by it.
/// Documents may hold more fields than their schema names: those that it names are the contract.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// File, or command whose document
    #[arg(value_name = "KIND")]
    pub kind: SchemaKind,
}

/// The schema of a kind.
pub fn schema(kind: SchemaKind) -> Value {
    match kind {
        SchemaKind::Robot => robot(),
        SchemaKind::Model => model(),
        SchemaKind::Campaign => campaign(),
        SchemaKind::Trajectory => trajectory(),
        SchemaKind::Truth => serde_json::Value::from(schemars::schema_for!(TruthFile)),
        SchemaKind::Friction => json::schema::<IdentifiedFriction>("friction"),
        SchemaKind::Lsq => json::schema::<IdentifiedDynamics>("lsq"),
        SchemaKind::LsqStatic => json::schema::<GravityFit>("lsq-static"),
        SchemaKind::Validate => json::schema::<Validated>("validate"),
        SchemaKind::Reduce => json::schema::<reduce::ReducedFile>("reduce"),
        SchemaKind::Track => json::schema::<Tracked>("track"),
        SchemaKind::Diagnose => json::schema::<DiagnosisResult>("diagnose"),
        SchemaKind::Drive => json::schema::<DriveResult>("drive"),
        SchemaKind::Compare => json::schema::<ComparisonResult>("compare"),
        SchemaKind::Identify => json::schema::<identify::StageResults>("identify"),
        SchemaKind::Excite => json::schema::<MotionJudgements>("excite"),
        SchemaKind::ExciteStatic => json::schema::<excite::held::PosesToHold>("excite-static"),
        SchemaKind::Simulate => json::schema::<simulate::SimulationResult>("simulate"),
        SchemaKind::Inspect => json::schema::<inspect::InspectionResult>("inspect"),
        SchemaKind::Payload => json::schema::<Payload>("payload"),
        SchemaKind::Tool => json::schema::<ToolResult>("tool"),
        SchemaKind::Show => json::schema::<show::ShownModel>("show"),
        SchemaKind::Torque => json::schema::<TorqueAlong>("torque"),
        SchemaKind::Watch => json::schema::<Watched>("watch"),
        SchemaKind::Convert => json::schema::<convert::ConvertedLog>("convert"),
        SchemaKind::Export => json::schema::<export::ExportedModel>("export"),
        SchemaKind::New => json::schema::<new::WrittenRobotFile>("new"),
        SchemaKind::Example => json::schema::<example::ExampleList>("example"),
    }
}

pub fn run(args: &Args) -> Result<Outcome, CliError> {
    let found = schema(args.kind);
    let text = format!("{found:#}\n");
    let name = args.kind.to_possible_value();
    let result = serde_json::json!({"kind": name.as_ref().map(|n| n.get_name()), "of": found});
    Ok(Outcome::new(
        text,
        JsonDocument::new("generate", &[], &NO_WARNINGS, &result)?,
    ))
}
