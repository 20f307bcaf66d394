//! The page of `identify`: the whole campaign.

use super::super::{CliError, Context};
use super::diagnose;
use crate::cli::pictures::inspected;
use crate::config::ModelFile;
use crate::config::model_file::Parameter;
use crate::effect::AugmentedModel;
use crate::identify::{
    DataFault, Diagnosed, IdentifiedDynamics, IdentifiedFriction, LoggedRobot, Validated,
};
use crate::log::{LogSpec, Provenance, escape};
use crate::number;
use crate::report::sections::torque::Drawn;
use crate::report::sections::{
    Look, fit, friction, parameters, provenance, quality, residual, torque,
};
use crate::report::stages::{self, validate};
use crate::report::{Report, Writer};

/// What the page is made from.
pub struct Identify<'a> {
    pub machine: &'a LoggedRobot,
    /// Name of the campaign, and its file.
    pub campaign: (&'a str, &'a str),
    pub friction: Option<&'a IdentifiedFriction>,
    pub fitted: &'a IdentifiedDynamics,
    /// The model as it was declared, and with the effects that were found.
    pub declared: &'a ModelFile,
    pub refined: Option<&'a ModelFile>,
    pub numbers: &'a AugmentedModel,
    pub validated: Option<&'a Validated>,
    pub diagnosed: Option<&'a Diagnosed>,
    pub fault: Option<&'a DataFault>,
    /// The unseen logs in memory, where there was no diagnosis.
    pub look: Option<Look<'a>>,
    pub unseen: &'a [LogSpec],
    pub logs: Vec<&'a LogSpec>,
    pub truth: &'a dyn Fn(&Parameter) -> Option<f64>,
    pub limit: Option<f64>,
    pub inputs: &'a [Provenance],
    pub warnings: &'a [String],
}

impl Identify<'_> {
    fn model(&self) -> &ModelFile {
        self.refined.unwrap_or(self.declared)
    }

    fn title(&self) -> String {
        let names: Vec<String> = self.unseen.iter().map(|l| escape(&l.name())).collect();
        names.join(", ")
    }

    fn verdicts(&self, page: &mut Writer) {
        if let Some(fault) = self.fault {
            let text = format!("The data are at fault ({}): {}.", fault.kind, fault.effect);
            page.verdict(&format!("{text} What to do: {}.", fault.remedy), false);
        }
        let (tally, mut good) = parameters::tally(self.model());
        let mut text = format!("{tally}.");
        if let Some(found) = self.diagnosed {
            let (words, named) = diagnose::words(self.machine, found);
            text += &format!(" {words}");
            good &= named;
        }
        page.verdict(&text, good);
        match self.validated {
            Some(validated) => {
                let validation = &validated.validation;
                let (text, good) = validate::words(validation, self.limit, &self.title());
                let declared = match self.refined {
                    Some(_) => text.replacen("The model", "The declared model", 1),
                    None => text,
                };
                page.verdict(&declared, good);
            }
            None => page.verdict(
                "There is no validation log: the error on unseen data is not known.",
                false,
            ),
        }
    }
}

/// The page as a file; `residuals` is the picture of the diagnosis, where there was one.
///
/// # Errors
/// Interruption, and stretches that are too short for the filter.
pub fn identify(of: &Identify, residuals: &str, context: &Context) -> Result<String, CliError> {
    let machine = of.machine;
    let mut report = Report::new(&format!("Identification: {}", escape(of.campaign.0)));
    let mut page = report.page();
    of.verdicts(&mut page);
    match (of.diagnosed, of.validated) {
        (Some(found), _) => diagnose::errors(&mut page, machine, found),
        (None, Some(validated)) => {
            let caption = "errors of the reconstructed torque on unseen data";
            validate::errors(&mut page, &validated.validation, caption);
        }
        (None, None) => stages::lsq::residuals(&mut page, of.fitted),
    }
    parameters::section(&mut page, of.model(), of.truth);
    if let Some(found) = of.friction {
        page.heading("Friction");
        page.paragraph(
            "From the one-joint logs, by the Kalman filter: the curve with its 95 % band over the \
             speeds that the logs cover, and the mean torque of their plateaus, which took no part \
             in the fit.",
        );
        page.figure(&stages::friction::figure(machine, found).svg());
    } else if let Some(look) = &of.look {
        let figure = friction::figure(look, of.declared, of.numbers);
        friction::section(&mut page, &figure);
    }
    if let Some(found) = of.diagnosed {
        diagnose::sections(&mut page, machine, found, residuals)?;
    } else if let Some(look) = &of.look {
        let logs: Vec<usize> = (0..of.unseen.len()).collect();
        torque::section(
            &mut page,
            look,
            &logs,
            &[Drawn::only(of.numbers)],
            &of.title(),
        )
        .map_err(CliError::input)?;
        let figure =
            residual::figure(look, &|_| true, of.numbers, None).map_err(CliError::input)?;
        residual::section(&mut page, &figure.svg());
    }
    fit::section(&mut page, of.fitted, of.model());
    let quality = inspected(of.logs.iter().copied(), machine, context)?;
    quality::section(&mut page, &quality, of.warnings);
    let summary = Some(&of.fitted.summary);
    provenance::section(
        &mut page,
        &machine.file,
        of.inputs,
        &[],
        summary,
        context.command(),
    );
    page.details("campaign file", of.campaign.1);
    page.paragraph(&format!(
        "Noise of the torque that is left, by joint: {}.",
        machine
            .robot
            .joint_names()
            .iter()
            .enumerate()
            .filter_map(|(j, joint)| {
                let std = of.model().residual_std.get(joint)?;
                let unit = machine.file.torque_unit(j);
                Some(format!("{joint} {} {unit}", number::significant(*std, 3)))
            })
            .collect::<Vec<_>>()
            .join(", ")
    ));
    Ok(report.html())
}
