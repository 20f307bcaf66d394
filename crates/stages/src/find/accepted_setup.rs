//! The check of a set-up before a fit, and what the fit goes on with.

use super::check_setup::check_setup_where_possible;
use crate::fit::dynamics::IdentifiedDynamics;
use crate::fit::friction::{FrictionSettings, IdentifiedFriction, friction};
use crate::fit::lsq::lsq;
use crate::fit::lsq_problem::LsqSettings;
use crate::input::control::Control;
use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::robot_setup::RobotSetup;
use crate::note::{SetupNote, StageNote};
use crate::setup::{Finding, FindingSeverity, SetupReport};
use cft_ident_files::config::correction::KeyEdit;
use cft_ident_files::config::{ModelFile, RobotFile};

/// A set-up that a fit goes on with.
pub struct AcceptedSetup {
    /// The logs, and the robot to go on with: where the logs ask for more than its drives give, with those limits.
    pub data: Dataset,
    pub report: SetupReport,
    pub notes: Vec<StageNote>,
}

/// A set-up that the torques contradict.
pub struct ContradictedSetup {
    /// The logs, and the robot as it is declared.
    pub data: Dataset,
    /// What was found; the refusals among it are why.
    pub report: SetupReport,
    pub notes: Vec<StageNote>,
    /// The robot file with all that is sure put right; none where no line does that.
    pub corrected: Option<RobotFile>,
    /// What differs in it.
    pub edits: Vec<KeyEdit>,
}

/// Why a fit does not go on.
pub enum SetupRefusal {
    Interrupted,
    Contradicted(Box<ContradictedSetup>),
}

/// Checks the set-up by the logs before a fit; of logs that cannot be checked the fit itself says why.
///
/// # Errors
/// [`SetupRefusal::Contradicted`] where the torques plainly contradict the robot file, and interruption.
pub fn accepted_setup(data: Dataset, control: &Control) -> Result<AcceptedSetup, SetupRefusal> {
    let found = check_setup_where_possible(&data, control);
    let found = found.map_err(|_| SetupRefusal::Interrupted)?;
    let report = found.report;
    let likely = |f: &&Finding| f.severity == FindingSeverity::Warning;
    let likely = report.findings.iter().filter(likely).cloned();
    let power = report.friction_power.iter().cloned();
    let limits = report.torque_limits.iter().cloned();
    let notes = likely
        .map(|finding| SetupNote::Likely(Box::new(finding)))
        .chain(power.map(SetupNote::FrictionPower))
        .chain(limits.map(SetupNote::TorqueLimit));
    let notes = notes.map(StageNote::Setup).collect();
    if report.refusals().next().is_some() {
        return Err(SetupRefusal::Contradicted(Box::new(ContradictedSetup {
            data,
            report,
            notes,
            corrected: found.corrected,
            edits: found.edits,
        })));
    }
    let data = found.limited.unwrap_or(data);
    Ok(AcceptedSetup {
        data,
        report,
        notes,
    })
}

impl AcceptedSetup {
    /// [`lsq`], what the check found before what the fit found, and the model that it is.
    ///
    /// # Errors
    /// Those of [`lsq`].
    pub fn lsq(
        &self,
        settings: &LsqSettings,
        control: &Control,
    ) -> Result<(IdentifiedDynamics, ModelFile), IdentifyError> {
        let mut found = lsq(&self.data, settings, control)?;
        self.put_before(&mut found.setup, &mut found.notes);
        let friction = settings.friction.map(|given| &given.file);
        let model = found.model(&self.data.setup, friction);
        Ok((found, model))
    }

    /// [`friction`] in the same way; joints that these logs do not move are those of `old`.
    ///
    /// # Errors
    /// Those of [`friction`].
    pub fn friction(
        &self,
        settings: &FrictionSettings,
        old: Option<&ModelFile>,
        control: &Control,
    ) -> Result<(IdentifiedFriction, ModelFile), IdentifyError> {
        let mut found = friction(&self.data, settings, control)?;
        self.put_before(&mut found.setup, &mut found.notes);
        let model = found.model(&self.data.setup, old);
        Ok((found, model))
    }

    /// Puts what the check found before what a fit found and noticed.
    fn put_before(&self, findings: &mut Vec<Finding>, notes: &mut Vec<StageNote>) {
        findings.splice(0..0, self.report.findings.iter().cloned());
        notes.splice(0..0, self.notes.iter().cloned());
    }
}

impl ContradictedSetup {
    /// The same with the robot of a file that is right by the torques, which is named.
    ///
    /// # Errors
    /// Logs that cannot be read by it.
    pub fn put_right(
        self,
        file: &str,
        corrected: RobotFile,
        control: &Control,
    ) -> Result<AcceptedSetup, IdentifyError> {
        let right = self.report.refusals().map(|finding| {
            StageNote::Setup(SetupNote::PutRight {
                file: file.to_owned(),
                finding: Box::new(finding.clone()),
            })
        });
        let corrected = RobotSetup::new(file, corrected);
        Ok(AcceptedSetup {
            notes: self.notes.iter().cloned().chain(right).collect(),
            data: self.data.of_robot(corrected, control)?,
            report: self.report,
        })
    }
}
