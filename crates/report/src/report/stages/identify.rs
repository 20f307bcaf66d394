//! The report of `identify`: the whole campaign.

use super::{diagnose, first_screen, friction as filter, lsq, quality_of_fit, validate};
use crate::report::sections::quality::{self, Inspected};
use crate::report::sections::{fit, friction, parameters, provenance, residual, sketch, torque};
use crate::report::table::Table;
use crate::report::{Report, Writer, summary};
use cft_ident_core::number;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{Campaigned, DataFault, DiagnoseEnd, Diagnosed, LoggedRobot};
use cft_ident_stages::replay::{Replayed, ReplayedDiagnosis};

/// What the report is made from.
pub struct Identify<'a> {
    pub machine: &'a LoggedRobot,
    /// Name of the campaign.
    pub campaign: &'a str,
    pub found: &'a Campaigned,
    /// Names of the held-out logs.
    pub unseen: &'a [String],
    /// The true value of a parameter, where it is known.
    pub truth: &'a dyn Fn(&Parameter) -> Option<f64>,
    /// Limit that the user set on every joint's relative error.
    pub limit: Option<f64>,
    /// What was guessed of the robot file, with the lines to change.
    pub guesses: &'a [String],
    /// Path of the model that is written last, and the logs that were fitted, as a shell takes them.
    pub path: &'a str,
    pub logs: &'a str,
}

impl Identify<'_> {
    fn model(&self) -> &ModelFile {
        self.found.refined.as_ref().unwrap_or(&self.found.model)
    }

    fn diagnosed(&self) -> Option<&Diagnosed> {
        match &self.found.diagnosed {
            Ok(DiagnoseEnd::Diagnosed(found)) => Some(found),
            _ => None,
        }
    }

    fn fault(&self) -> Option<&DataFault> {
        match &self.found.diagnosed {
            Ok(DiagnoseEnd::DataFault(fault)) => Some(fault),
            _ => None,
        }
    }

    fn title(&self) -> String {
        let names: Vec<String> = self.unseen.iter().map(|name| escape(name)).collect();
        names.join(", ")
    }

    fn verdicts(&self, page: &mut Writer) {
        if let Some(fault) = self.fault() {
            let text = diagnose::at_fault(fault);
            page.verdict(&format!("{text} What to do: {}.", fault.remedy), false);
        }
        if let Some(found) = self.diagnosed() {
            let (text, good) = diagnose::words(self.machine, found);
            page.verdict(&text, good);
        }
        match &self.found.validated {
            // the diagnosis has said what the model misses
            Some(_) if self.diagnosed().is_some() && self.limit.is_none() => {}
            Some(validated) => {
                let errors = validated.judged();
                let (text, good) = validate::words(errors, self.limit, &self.title());
                let given = match self.found.refined {
                    Some(_) => text.replacen("The model", "The model before the diagnosis", 1),
                    None => text,
                };
                page.verdict(&given, good);
            }
            None => page.verdict(
                "There is no validation log: the held-out error is not known.",
                false,
            ),
        }
    }
}

/// The parameters, the quality of the fit, the errors, and what the model lacks.
pub fn identify(of: &Identify) -> Report {
    let (machine, found) = (of.machine, of.found);
    let mut report = Report::new(&format!("Identification: {}", escape(of.campaign)));
    of.verdicts(&mut report.everywhere());
    guesses(&mut report.terminal(), of.guesses);
    if let Some(diagnosed) = of.diagnosed() {
        let typed = (of.model(), of.path, of.logs);
        diagnose::diagnosed(&mut report, (machine, diagnosed), typed);
    }
    if let Some(validated) = &found.validated {
        let caption = format!("torque on held-out data ({})", of.unseen.join(", "));
        let errors = validated.judged();
        let mut rest = match of.diagnosed() {
            // the table of the diagnosis has these errors
            Some(_) => report.detail(),
            None => report.terminal(),
        };
        rest.line("");
        validate::errors_by_joint(&mut rest, errors, &caption);
        validate::overall(&mut report.detail(), errors);
    }
    let (tally, _) = parameters::tally(of.model());
    let mut detail = report.detail();
    detail.line("");
    detail.paragraph(&format!("{tally}."));
    detail.table(beside_truth(of));
    detail.line("");
    quality_of_fit::condition(&mut detail, &found.dynamics);
    quality_of_fit::fit_quality(&mut detail, &found.dynamics);
    report.terminal().line("");
    let mut page = report.page();
    match (of.diagnosed(), &found.validated) {
        (Some(diagnosed), _) => {
            first_screen::show(&mut page, (machine, diagnosed), (of.path, of.logs));
            diagnose::errors(&mut page, machine, diagnosed);
        }
        (None, Some(validated)) => {
            let caption = "errors of the reconstructed torque on held-out data";
            validate::errors_by_joint(&mut page, validated.judged(), caption);
        }
        (None, None) => {
            let all: Vec<usize> = (0..found.dynamics.joints.len()).collect();
            lsq::residuals(&mut page, &found.dynamics, &all);
        }
    }
    guesses(&mut page, of.guesses);
    page.paragraph(&format!("{tally}."));
    parameters::section(&mut page, of.model(), of.truth);
    report
}

/// What was guessed of the robot file, as one verdict.
fn guesses(writer: &mut Writer, guesses: &[String]) {
    if !guesses.is_empty() {
        writer.verdict(
            &format!("Guessed, CHECK IT: {}.", guesses.join("; ")),
            false,
        );
    }
}

/// Every parameter of the model, beside its truth where that is known.
fn beside_truth(of: &Identify) -> Table {
    let rows: Vec<summary::ParameterRow> = of
        .model()
        .parameters
        .iter()
        .map(|p| {
            let unknown = p.verdict == Some(Verdict::NotIdentifiable);
            summary::ParameterRow {
                joint: p.joint.as_deref().unwrap_or(""),
                name: &p.name,
                theta: p.theta,
                value: if unknown { f64::NAN } else { p.value },
                std: p.std.filter(|_| !unknown).unwrap_or(f64::NAN),
                unit: &p.unit,
                verdict: p.verdict_word(),
                truth: (of.truth)(p),
            }
        })
        .collect();
    summary::parameters("identified parameters", &rows)
}

/// What the pages of a campaign come from.
pub struct Origin<'a> {
    /// Text of the campaign file.
    pub campaign: &'a str,
    pub inputs: &'a [Provenance],
    pub warnings: &'a [String],
    pub quality: &'a [Inspected],
    pub command: &'a str,
}

/// What the logs show beside the model.
#[derive(Debug, Clone, Copy)]
pub enum ShownLogs<'a> {
    /// There are no unseen logs, or they are too long to be held.
    Nothing,
    /// The unseen logs, where nothing was diagnosed.
    Model(&'a Replayed),
    /// The logs of the diagnosis.
    Diagnosis(&'a ReplayedDiagnosis),
}

/// What a page has room for besides.
pub fn pictures(page: &mut Writer, of: &Identify, shown: ShownLogs, origin: &Origin) {
    let (machine, found) = (of.machine, of.found);
    if let Some((laws, _)) = &found.friction {
        page.heading("Friction");
        page.paragraph(
            "From the one-joint logs, by the Kalman filter: the curve with its 95 % band over the \
             speeds that the logs cover, and the mean torque of their plateaus, which took no part \
             in the fit.",
        );
        page.figures(&filter::figure(machine, laws).cells());
    } else if let ShownLogs::Model(Replayed {
        friction: rows,
        logs,
        ..
    })
    | ShownLogs::Diagnosis(ReplayedDiagnosis {
        friction: rows,
        logs,
        ..
    }) = shown
    {
        friction::section(page, machine, rows, logs);
    }
    match (shown, of.diagnosed()) {
        (ShownLogs::Diagnosis(replayed), Some(diagnosed)) => {
            diagnose::sections(page, machine, diagnosed, replayed);
        }
        (ShownLogs::Model(replayed), _) => {
            if let Some(validated) = &found.validated {
                let errors = validated.judged().joints.iter();
                let errors: Vec<f64> = errors.map(|joint| joint.relative_error).collect();
                sketch::section(page, machine, replayed.poses.as_ref(), &errors);
            }
            torque::section(
                page,
                machine,
                &replayed.torque,
                &[torque::ONLY],
                &of.title(),
            );
            let figure = residual::figure(machine, &replayed.residual);
            residual::section(page, &figure);
        }
        _ => {}
    }
    fit::section(page, &found.dynamics, of.model());
    quality::section(page, origin.quality, origin.warnings);
    let (file, summary) = (&machine.file, Some(&found.dynamics.summary));
    provenance::section(page, file, origin.inputs, &[], summary, origin.command);
    let names = machine.robot.joint_names().iter().enumerate();
    let noise = names.filter_map(|(j, joint)| {
        let std = of.model().residual_std.get(joint)?;
        let unit = machine.file.torque_unit(j);
        Some(format!("{joint} {} {unit}", number::significant(*std, 3)))
    });
    page.paragraph(&format!(
        "Standard deviation of the torque residual before the parallel filter, by joint: {}.",
        noise.collect::<Vec<_>>().join(", ")
    ));
    page.details("campaign file", origin.campaign);
}
