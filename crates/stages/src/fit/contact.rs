//! Stretches in which something pushes the robot, and rows that a fit hangs on.

use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::log_data::{LogData, bridges};
use crate::input::passes::{LogPasses, PositionFilter};
use crate::input::robot_setup::RobotSetup;
use crate::input::unknowns::{FittedUnknown, columns};
use crate::note::{FitNote, NumberWithStd, StageNote};
use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::jumps::ResidualJump;
use cft_ident_core::inertia::solve::{RowWeighting, fit};
use cft_ident_files::config::robot_file::FrictionLawKind;
use cft_ident_logs::log::{RowFault, escape};

/// Deviations by which rows move a parameter: twice as many miss doubtful fits, half as many report chance.
const MOVED_DEVIATIONS: f64 = 4.0;
/// Room on both sides of a stretch that is to be left out \[s\]: the filters carry it so far.
const ROOM_S: f64 = 0.1;

/// Stretches of these logs in which something pushes the robot, one note each.
pub(crate) fn contacts(
    setup: &RobotSetup,
    logs: &[LogData],
    control: &Control,
) -> Result<Vec<StageNote>, IdentifyError> {
    let linear = setup.file.friction_law() != FrictionLawKind::DoubleTanh;
    if !linear || setup.robot.joints() < 2 || logs.iter().any(|log| log.reduced().is_some()) {
        return Ok(Vec::new());
    }
    let own = setup.own_settings(logs, &[], control)?;
    let mut passes = LogPasses::new(setup, logs, control).each_by_itself(own);
    passes.read(PositionFilter::Declared, &columns(setup, None), None)?;
    passes.contacts()
}

impl LogPasses<'_> {
    /// The stretches that the first reading found, one note each.
    pub(crate) fn contacts(&self) -> Result<Vec<StageNote>, IdentifyError> {
        let noted = |(log, jump): &(usize, ResidualJump)| {
            let log = &self.logs[*log];
            let first = log.first_row()?;
            Ok(StageNote::Fit(contact(self.setup, log, jump, first)))
        };
        self.jumps.iter().map(noted).collect()
    }
}

/// `first` is the time of the first row that is read, as the rows have it [s].
fn contact(setup: &RobotSetup, log: &LogData, jump: &ResidualJump, first: f64) -> FitNote {
    let [from, to] = jump.span.map(|t| t - first);
    let names = setup.robot.joint_names();
    let joints = jump.joints.iter();
    FitNote::Contact {
        log: escape(&log.name()),
        joints: joints.clone().map(|(j, _)| names[*j].clone()).collect(),
        ratio: joints.map(|(_, ratio)| *ratio).fold(0.0, f64::max),
        span: [from, to],
        leave_out: [(from - ROOM_S).max(0.0), to + ROOM_S],
    }
}

/// What a fit says with the rows that were bridged as they were logged, where that is another thing.
pub(crate) fn hangs_on_bridged(
    setup: &RobotSetup,
    logs: &[LogData],
    (linear, rows): (&RegressorColumns, &BlockFactors),
    unknowns: &[FittedUnknown],
    control: &Control,
) -> Result<Option<FitNote>, IdentifyError> {
    if !bridges(logs)? {
        return Ok(None);
    }
    let kept = setup.keeping(RowFault::Spike);
    let logs = logs.iter().map(|log| log.read_again(&kept, control));
    let logs = &logs.collect::<Result<Vec<_>, _>>()?;
    let own = kept.own_settings(logs, &[], control)?;
    let mut passes = LogPasses::new(&kept, logs, control).each_by_itself(own);
    let as_logged = passes.read(PositionFilter::Declared, linear, None)?;
    let (Ok(now), Ok(other)) = (
        fit(rows, RowWeighting::Wls),
        fit(&as_logged, RowWeighting::Wls),
    ) else {
        return Ok(None);
    };
    let moved = unknowns.iter().enumerate().filter_map(|(i, unknown)| {
        let std =
            |fit: &cft_ident_core::inertia::solve::Fit| fit.covariance[(i, i)].max(0.0).sqrt();
        let (a, b) = (now.theta.get(i)?, other.theta.get(i)?);
        let both = std(&now).hypot(std(&other));
        let known = now.determined[i] && other.determined[i];
        (known && (a - b).abs() > MOVED_DEVIATIONS * both).then(|| {
            let [a, b] = [(a, &now), (b, &other)].map(|(value, fit)| NumberWithStd {
                value: *value,
                std: std(fit),
            });
            (unknown.key.clone(), [a, b])
        })
    });
    let moved: Vec<_> = moved.collect();
    Ok((!moved.is_empty()).then_some(FitNote::HangsOnBridged { moved }))
}
