//! `cft-ident torque`: feed-forward torque along a recorded or planned motion.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Outcome, arguments};
use crate::config::ModelFile;
use crate::identify::{IdentifyError, Log, LoggedRobot, refined, summary_warnings};
use crate::log::LogSpec;
use crate::motion::{self, FilterSettings, Summary};
use crate::number;
use crate::output::LogWriter;
use crate::report::json::Document;
use crate::report::table::{Align, Table};

const EXAMPLE: &str = "\
Example:
  cft-ident torque unseen.csv -m model.toml -o feedforward.csv";

/// Write the feed-forward torque along a motion, with its prediction band.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident torque [OPTIONS] -m MODEL.toml -o OUT.csv|.mcap LOG")]
pub struct Args {
    /// Log or trajectory of q; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(value_name = "LOG")]
    pub log: LogSpec,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Log to write
    #[arg(short, long, value_name = "OUT.csv|.mcap", value_parser = arguments::log_file)]
    pub output: PathBuf,
}

/// The torque along a motion.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Along {
    joints: Vec<JointAlong>,
    /// Rows that were written.
    samples: u64,
    processing: Summary,
}

/// The torque of one joint.
#[derive(Debug, Serialize, JsonSchema)]
struct JointAlong {
    joint: String,
    /// "N" or "Nm".
    unit: String,
    /// Root mean square \[unit\].
    rms: f64,
    /// Largest modulus \[unit\].
    peak: f64,
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; nothing is written then.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs: [&Path; 2] = [&args.log.path, &args.model];
    context.check_outputs(&inputs, &[args.output.as_path()])?;
    let name = args.model.display().to_string();
    let file = ModelFile::load(&args.model)?;
    let refined = refined(&file, &name)?;
    let model = &refined.model;
    let machine = LoggedRobot::new(&name, file.robot.clone());
    let joints = machine.robot.joint_names();
    let n = joints.len();
    let p = model.parameters();
    let covariance = file.model_covariance(model);
    let residual: Vec<f64> = joints
        .iter()
        .map(|j| file.residual_std.get(j).copied().unwrap_or(0.0))
        .collect();
    let named = |kind: &'static str| joints.iter().map(move |j| format!("{kind}_{j}"));
    let columns: Vec<String> = std::iter::once("t".to_owned())
        .chain(named("tau"))
        .chain(named("tau_std"))
        .collect();
    let mut out = LogWriter::create(&args.output, &columns)?;
    // every row gets its torque: nothing is decimated, and nothing left off at the ends
    let settings = FilterSettings {
        decimation: Some(1),
        q_trim_s: Some(0.0),
        trim_s: Some(0.0),
        ..machine.settings()
    };
    let bar = context.progress("torque", None);
    let mut log = machine.open_positions(&Log::from(&args.log), context.control())?;
    out.set_origin(log.origin());
    let mut failed = None;
    let mut peak = vec![0.0f64; n];
    let mut square = vec![0.0f64; n];
    let mut emit = |t: f64, values: &[f64]| {
        for j in 0..n {
            peak[j] = peak[j].max(values[j].abs());
            square[j] += values[j] * values[j];
        }
        if failed.is_none() {
            failed = out
                .row(std::iter::once(t).chain(values.iter().copied()))
                .err();
        }
    };
    let band = |q: &[f64], v: &[f64], a: &[f64], out: &mut [f64]| {
        GRADIENT.with_borrow_mut(|g| {
            g.resize(p, 0.0);
            for (j, out) in out.iter_mut().enumerate() {
                model.gradient(j, q, v, a, g);
                *out = (quadratic(&covariance, g) + residual[j] * residual[j]).sqrt();
            }
        });
    };
    let mut read = |block: &mut _| log.read(block);
    let summary = if refined.effects.is_empty() {
        motion::run(
            &mut read,
            n,
            &settings,
            None,
            2 * n,
            &|s, out| {
                let (tau, std) = out.split_at_mut(n);
                model.torque(s.q, s.v, s.a, tau);
                band(s.q, s.v, s.a, std);
            },
            &mut |row| emit(row.t, row.raw),
        )
        .map_err(|e| IdentifyError::of_run(&args.log.name(), e))?
    } else {
        // effects remember: they need a stretch from its begin
        let (found, summary) = motion::stretches(0, n, &settings, &mut read)
            .map_err(|e| IdentifyError::of_run(&args.log.name(), e))?;
        let mut values = vec![0.0; 2 * n];
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for stretch in &found {
            let hat = refined.reconstruct(stretch);
            for (k, t) in stretch.t.iter().enumerate() {
                stretch.at(k, &mut q, &mut v, &mut a);
                for (x, hat) in values.iter_mut().zip(&hat) {
                    *x = hat[k];
                }
                band(&q, &v, &a, &mut values[n..]);
                emit(*t, &values);
            }
        }
        summary
    };
    drop(bar);
    if let Some(error) = failed {
        return Err(error.into());
    }
    context.check()?;
    let mut warnings = log.warnings();
    warnings.extend(summary_warnings(&args.log.name(), &summary));
    let provenance = [log.provenance()?];
    let rows = summary.rows.max(1) as f64;
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("rms", Align::Decimal),
        ("peak", Align::Decimal),
        ("unit", Align::Left),
    ])
    .caption(&format!("torque of {} along {}", name, args.log.name()));
    let mut found = Vec::new();
    for (j, joint) in joints.iter().enumerate() {
        let rms = (square[j] / rows).sqrt();
        let unit = machine.file.torque_unit(j);
        table.row([
            joint.as_str(),
            &number::significant(rms, 4),
            &number::significant(peak[j], 4),
            unit,
        ]);
        found.push(JointAlong {
            joint: joint.clone(),
            unit: unit.to_owned(),
            rms,
            peak: peak[j],
        });
    }
    let result = Along {
        joints: found,
        samples: summary.rows,
        processing: summary,
    };
    let document = Document::new("torque", &provenance, &warnings, &result)?;
    out.commit()?;
    Ok(Outcome {
        text: format!("{table}written: {}\n", args.output.display()),
        document,
        missed: Vec::new(),
    })
}

thread_local! {
    /// Gradient of one sample, kept from sample to sample.
    static GRADIENT: std::cell::RefCell<Vec<f64>> = const { std::cell::RefCell::new(Vec::new()) };
}

/// g' C g for a row-major square C; never negative.
fn quadratic(covariance: &[f64], g: &[f64]) -> f64 {
    let p = g.len();
    let sum: f64 = (0..p)
        .filter(|i| g[*i] != 0.0)
        .map(|i| {
            let row = &covariance[i * p..(i + 1) * p];
            g[i] * row.iter().zip(g).map(|(c, x)| c * x).sum::<f64>()
        })
        .sum();
    sum.max(0.0)
}
