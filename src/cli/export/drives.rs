//! Exports of a model file of `drive`.

use super::{Args, ExportedModel, WrittenFile};
use crate::cli::{CliError, Context, Outcome, file_name};
use cft_ident_drive::drive::drive_file::DriveFile;
use cft_ident_drive::drive::export::{ExportGains, ExportedText, bam, isaaclab, mjcf};
use cft_ident_files::config;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::table::{CellAlignment, Table};

/// Whether one of them is asked for.
pub(super) fn asked(args: &Args) -> bool {
    args.mjcf_actuators.is_some() || args.bam.is_some() || args.isaaclab.is_some()
}

pub(super) fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let others = [
        &args.urdf, &args.mjcf, &args.sdf, &args.usd, &args.c, &args.rust,
    ];
    if others.iter().any(|path| path.is_some()) || !args.logs.is_empty() {
        return Err(CliError::usage(
            "--mjcf-actuators, --bam and --isaaclab are of drives, and take no other file and no log",
        )
        .hint("export the links by a second command"));
    }
    let paths = [&args.mjcf_actuators, &args.bam, &args.isaaclab];
    let paths = paths.into_iter().filter_map(|path| path.as_deref());
    context.check_outputs([&*args.model], paths)?;
    let name = escape(&args.model.to_string_lossy());
    let text = config::text(&args.model)?;
    let file = DriveFile::parse(&name, &text)?;
    let gains = || match args.kp {
        Some(kp) => Ok(ExportGains {
            kp,
            kd: args.kd,
            timestep: args.timestep,
        }),
        None => Err(CliError::usage("the gain of the actuators is not given")
            .hint("give the one that the simulator is to run at: --kp 16")),
    };
    let mut texts = Vec::new();
    if let Some(path) = &args.mjcf_actuators {
        texts.push((
            path,
            "actuators of MuJoCo",
            mjcf::actuators(&file, &gains()?)?,
        ));
    }
    if let Some(path) = &args.bam {
        texts.push((
            path,
            "parameters of BAM",
            bam::parameters(&file, &args.actuator)?,
        ));
    }
    if let Some(path) = &args.isaaclab {
        texts.push((
            path,
            "actuators of Isaac Lab",
            isaaclab::actuators(&file, &gains()?)?,
        ));
    }
    let mut table = Table::new(&[("file", CellAlignment::Left), ("what", CellAlignment::Left)])
        .caption(&format!("drives of {name} for simulators"));
    let mut warnings = Vec::new();
    let mut files = Vec::new();
    for (path, what, ExportedText { text, left_out }) in texts {
        context.write_text(path, &text)?;
        table.row([path.display().to_string().as_str(), what]);
        let shown = file_name(path);
        warnings.extend(
            left_out
                .iter()
                .map(|line| format!("{shown} does not say: {line}")),
        );
        files.push(WrittenFile {
            file: shown,
            what: what.to_owned(),
        });
    }
    let names: Vec<&str> = files.iter().map(|of| of.file.as_str()).collect();
    let brief = format!("written: {}", names.join(", "));
    let result = ExportedModel {
        joints: file.drive.joints.clone(),
        files,
        left_out: warnings.clone(),
        beyond: Vec::new(),
        lines: None,
    };
    let inputs = [Provenance::of_text(&file_name(&args.model), &text)];
    Ok(Outcome::new(
        context.text(table.to_string(), &brief),
        JsonDocument::new("export", &inputs, &warnings, &result)?,
    ))
}
