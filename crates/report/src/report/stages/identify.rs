//! The report of `identify`: the whole campaign.

use super::{diagnose, diagnose_words, first_screen, friction as filter};
use super::{lsq, quality_of_fit, validate};
use crate::report::sections::quality::{self, InspectedLog};
use crate::report::sections::{fit, friction, parameters, provenance, residual, sketch, torque};
use crate::report::words::{escaped, listed};
use crate::report::{Report, Writer};
use cft_ident_core::number;
use cft_ident_core::validate::JointError;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{Campaigned, DiagnoseEnd, Diagnosed, RobotSetup};
use cft_ident_stages::replay::{ReplayedDiagnosis, ReplayedLogs};

/// The parts of the report.
pub struct IdentifyReport<'a> {
    pub setup: &'a RobotSetup,
    /// Name of the campaign.
    pub campaign: &'a str,
    pub found: &'a Campaigned,
    /// Names of the held-out logs.
    pub unseen: &'a [String],
    /// The true value of a parameter, where it is known.
    pub truth: &'a dyn Fn(&Parameter) -> Option<f64>,
    /// Limit that the user set on every joint's relative error.
    pub limit: Option<f64>,
    /// The guesses in the robot file, with the lines to change.
    pub guesses: &'a [String],
    /// Path of the model that is written last, and the logs that were fitted, as a shell takes them.
    pub path: &'a str,
    pub logs: &'a str,
}

impl IdentifyReport<'_> {
    fn model(&self) -> &ModelFile {
        self.found.refined.as_ref().unwrap_or(&self.found.model)
    }

    fn diagnosed(&self) -> Option<&Diagnosed> {
        match &self.found.diagnosed {
            Ok(DiagnoseEnd::Diagnosed(found)) => Some(found),
            _ => None,
        }
    }

    fn verdicts(&self, page: &mut Writer) {
        match &self.found.diagnosed {
            Ok(DiagnoseEnd::DataFault(fault)) => {
                let text = diagnose::at_fault(fault);
                page.verdict(&format!("{text} What to do: {}.", fault.remedy), false);
            }
            Ok(DiagnoseEnd::Diagnosed(found)) => {
                diagnose_words::words(self.setup, found).write(page);
            }
            _ => {}
        }
        match &self.found.validated {
            // the diagnosis has said how far the model is off
            Some(_) if self.diagnosed().is_some() && self.limit.is_none() => {}
            Some(validated) => {
                let errors = validated.judged();
                let torque_is = self.setup.file.log.torque_is;
                let words = validate::words(errors, (self.limit, torque_is), &escaped(self.unseen));
                words.write(page);
            }
            None => page.verdict(
                "There is no validation log: the held-out error is not known.",
                false,
            ),
        }
    }
}

/// The parameters, the quality of the fit, the errors, and the effects that the model lacks.
pub fn identify(of: &IdentifyReport) -> Report {
    let (setup, found) = (of.setup, of.found);
    let mut report = Report::new(&format!("Identification: {}", escape(of.campaign)));
    of.verdicts(&mut report.everywhere());
    if let Some(diagnosed) = of.diagnosed() {
        let typed = (of.model(), of.path, of.logs);
        diagnose::diagnosed(&mut report, (setup, diagnosed), typed);
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
    detail.table(parameters::beside_truth(
        &of.model().estimated_parameters(),
        of.truth,
    ));
    detail.line("");
    quality_of_fit::condition(&mut detail, &found.dynamics);
    quality_of_fit::fit_quality(&mut detail, &found.dynamics);
    guesses(&mut report.terminal(), of.guesses);
    report.terminal().line("");
    let mut page = report.page();
    match (of.diagnosed(), &found.validated) {
        (Some(diagnosed), _) => {
            first_screen::show(&mut page, setup, diagnosed);
            diagnose::errors(&mut page, setup, diagnosed);
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

/// The guesses in the robot file, one after the other.
fn guesses(writer: &mut Writer, guesses: &[String]) {
    if !guesses.is_empty() {
        writer.line("");
        writer.paragraph("Guessed, please check (CHECK IT in robot.toml):");
        writer.list(guesses);
    }
}

/// The origin of the pages of a campaign.
pub struct CampaignOrigin<'a> {
    /// Text of the campaign file.
    pub campaign: &'a str,
    pub inputs: &'a [Provenance],
    pub warnings: &'a [String],
    pub quality: &'a [InspectedLog],
    pub command: &'a str,
}

/// The logs that stand beside the model.
#[derive(Debug, Clone, Copy)]
pub enum ShownLogs<'a> {
    /// There are no unseen logs, or they are too long to be held.
    Nothing,
    /// The unseen logs, where nothing was diagnosed.
    Model(&'a ReplayedLogs),
    /// The logs of the diagnosis.
    Diagnosis(&'a ReplayedDiagnosis),
}

/// Further parts of the page.
pub fn pictures(page: &mut Writer, of: &IdentifyReport, shown: ShownLogs, origin: &CampaignOrigin) {
    let (setup, found) = (of.setup, of.found);
    if let Some((laws, _)) = &found.friction {
        page.heading("Friction");
        page.paragraph(
            "From the one-joint logs, by the Kalman filter: the curve with its 95 % band over the \
             speeds that the logs cover, and the mean torque of their plateaus, which took no part \
             in the fit.",
        );
        page.figures(filter::figure(setup, laws).cells());
    } else {
        match shown {
            ShownLogs::Nothing => {}
            ShownLogs::Model(of) => friction::section(page, setup, &of.friction, &of.logs),
            ShownLogs::Diagnosis(of) => friction::section(page, setup, &of.friction, &of.logs),
        }
    }
    match (shown, of.diagnosed()) {
        (ShownLogs::Diagnosis(replayed), Some(diagnosed)) => {
            diagnose::sections(page, setup, diagnosed, replayed);
        }
        (ShownLogs::Model(replayed), _) => {
            if let Some(validated) = &found.validated {
                let errors = validated.judged().joints.iter().map(JointError::headline);
                sketch::section(page, setup, replayed.poses.as_ref(), errors);
            }
            let title = escaped(of.unseen);
            torque::section(page, setup, &replayed.torque, &[torque::ONLY], &title);
            residual::section(page, setup, &replayed.residual);
        }
        _ => {}
    }
    fit::section(page, &found.dynamics, of.model());
    quality::section(page, origin.quality, origin.warnings);
    let (file, summary) = (&setup.file, Some(&found.dynamics.summary));
    provenance::section(page, file, origin.inputs, &[], summary, origin.command);
    let names = setup.robot.joint_names().iter().enumerate();
    let noise = names.filter_map(|(j, joint)| {
        let std = of.model().residual_std.get(joint)?;
        let unit = setup.file.torque_unit(j);
        Some(format!("{joint} {} {unit}", number::significant(*std, 3)))
    });
    page.paragraph(&format!(
        "Standard deviation of the torque residual before the parallel filter, by joint: {}.",
        listed(noise)
    ));
    page.details("campaign file", origin.campaign);
}
