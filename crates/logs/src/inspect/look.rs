//! Shows a log, as it stands in its files, to the judge.

use std::collections::BTreeSet;

use super::channel::InspectedChannel;
use super::fault::{FaultKind, LogFault, Severity};
use super::findings::{LogFindings, RowCost};
use super::judge::{InspectionDepth, LogJudge};
use super::words::ChannelRole;
use crate::log::{
    EvenClock, EvenSpacing, LogError, PositionUnwrap, RawBlock, RawReader, RowFault, signed,
};

/// One column that is looked at: its number, times `factor`, plus `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelColumn {
    /// Place of the column.
    pub column: usize,
    /// Unit of the channel per unit of the column, sign included.
    pub factor: f64,
    /// Added after it.
    pub offset: f64,
    /// Range after which it begins anew [unit of the channel]: a position goes on through its turns, of a torque the
    /// number nearest to 0 is taken.
    pub wrap: Option<f64>,
    /// What it is.
    pub channel: InspectedChannel,
    /// There is a robot file, and it does not name the column: what is wrong with it keeps nobody from a fit.
    pub unused: bool,
}

/// Which columns of a table are what.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ColumnPlan {
    /// Place of the time, and seconds per unit of it; absent where rows carry their own.
    pub time: Option<(usize, f64)>,
    /// The other columns.
    pub channels: Vec<ChannelColumn>,
    /// Kinds of findings that are reported but not acted upon.
    pub keep: Vec<RowFault>,
    /// Rows for which each sample was held: only fresh rows are looked at.
    pub held: Option<usize>,
    /// Rows lie evenly though their stamps do not.
    pub even: Option<EvenSpacing>,
    /// Band that a fit keeps \[Hz\]; none where nobody has declared it.
    pub band_hz: Option<f64>,
}

impl ColumnPlan {
    /// Makes notes of errors that are of columns which nothing uses.
    pub fn ease_unused(&self, found: &mut LogFindings) {
        let unused = self.channels.iter().filter(|column| column.unused);
        let unused: BTreeSet<&String> = unused.map(|column| &column.channel.name).collect();
        let of_unused = |fault: &&mut LogFault| {
            let name = fault.channel.as_ref();
            fault.severity == Severity::Error && name.is_some_and(|name| unused.contains(name))
        };
        for fault in found.faults.iter_mut().filter(of_unused) {
            fault.severity = Severity::Info;
        }
        found.sort();
    }

    /// Whether a look by it found what hides the rest, so that another one sees more ([`look_again`]).
    pub fn hides(&self, found: &LogFindings) -> bool {
        let turning = |(place, _): &(usize, f64)| self.channels[*place].wrap.is_none();
        found.wraps.iter().any(turning)
            || (found.held.is_some() && self.held.is_none())
            || (found.even.is_some() && self.even.is_none())
    }
}

/// Looks at a log again where the look before found what hides the rest: positions that begin
/// anew, samples that were held, stamps that jitter. `None` where `stop` asks for it.
///
/// # Errors
/// A file that can no longer be read.
pub fn look_again(
    log: &mut RawReader,
    plan: &mut ColumnPlan,
    first: &LogFindings,
    stop: &dyn Fn() -> bool,
) -> Result<Option<LogFindings>, LogError> {
    for (place, range) in &first.wraps {
        plan.channels[*place].wrap = Some(*range);
    }
    plan.held = first.held;
    plan.even = plan.even.or(first.even);
    let Some(mut found) = look(log, plan, stop)? else {
        return Ok(None);
    };
    let hiding = [
        FaultKind::WrappedEncoder,
        FaultKind::SampleAndHold,
        FaultKind::IrregularClock,
    ];
    found
        .faults
        .retain(|fault| fault.kind != FaultKind::IrregularClock || first.even.is_none());
    let faults = first.faults.iter();
    let faults = faults.filter(|fault| hiding.contains(&fault.kind));
    found.faults.extend(faults.cloned());
    let costs = first.costs.iter();
    let held = costs.filter(|cost| cost.kind == FaultKind::SampleAndHold);
    found.costs.extend(held);
    RowCost::sort(&mut found.costs);
    found.rows = first.rows;
    found.wraps.clone_from(&first.wraps);
    found.held = first.held;
    found.even = found.even.or(first.even);
    if first.even.is_some() {
        // that of the stamps, and not of the clock that they were put on
        found.jitter = first.jitter;
    }
    found.sort();
    Ok(Some(found))
}

/// Reads a table to its end and says what there is to say; `None` where `stop` asks for it.
///
/// # Errors
/// A file that can no longer be read.
pub fn look(
    log: &mut RawReader,
    plan: &ColumnPlan,
    stop: &dyn Fn() -> bool,
) -> Result<Option<LogFindings>, LogError> {
    if let Some((column, seconds)) = plan.time {
        log.set_time(column, seconds);
    }
    let channels = plan.channels.iter().map(|planned| planned.channel.clone());
    let mut judge = LogJudge::new(channels.collect(), InspectionDepth::Whole);
    judge.keep.clone_from(&plan.keep);
    judge.band_hz = plan.band_hz.unwrap_or(judge.band_hz);
    judge.messages = log.is_recording();
    let is_torque = |planned: &ChannelColumn| planned.channel.role == ChannelRole::Torque;
    let mut turning: Vec<Option<PositionUnwrap>> = (plan.channels.iter())
        .map(|planned| planned.wrap.filter(|_| !is_torque(planned)))
        .map(|wrap| wrap.map(PositionUnwrap::new))
        .collect();
    let mut even = plan.even.map(EvenClock::new);
    let mut fresh = plan.held.map(|rows| FreshRows::new(rows, plan));
    let mut block = RawBlock::default();
    while log.read(&mut block)? {
        block.drop_unusable();
        if stop() {
            return Ok(None);
        }
        if let Some(fresh) = &mut fresh {
            fresh.keep(&mut block);
        }
        if let Some(even) = &mut even {
            block.t.iter_mut().for_each(|t| *t = even.take(*t));
        }
        for (planned, turning) in plan.channels.iter().zip(&mut turning) {
            let column = &mut block.columns[planned.column];
            let (factor, offset) = (planned.factor, planned.offset);
            if factor != 1.0 || offset != 0.0 {
                column.iter_mut().for_each(|x| *x = *x * factor + offset);
            }
            if let Some(range) = planned.wrap.filter(|_| is_torque(planned)) {
                column
                    .iter_mut()
                    .for_each(|x| *x = offset + signed(*x - offset, range));
            }
            if let Some(turning) = turning {
                column.iter_mut().for_each(|q| *q = turning.take(*q));
            }
        }
        let columns: Vec<&[f64]> = (plan.channels.iter())
            .map(|planned| block.columns[planned.column].as_slice())
            .collect();
        judge.take(&block.t, &columns);
    }
    judge.clock.seams = log.seams();
    let mut findings = judge.finish();
    findings.check_clock(&log.log_name(), log.is_recording())?;
    findings.count_from(log.origin().seconds());
    let rows = log.malformed();
    if rows > 0 {
        let effect = format!(
            "{rows} rows have more or fewer fields than the header names: a fit refuses the log"
        );
        let remedy = "complete or delete these rows; write decimal points, not commas";
        let fault = (Severity::Error, FaultKind::MalformedRows);
        findings.put_first(fault, rows, effect, remedy);
    }
    let rows = findings.rows;
    if rows < 2 {
        let effect = format!("{rows} row(s): nothing can be said, and a fit refuses the log");
        let remedy = "record again, or check the span";
        let fault = (Severity::Error, FaultKind::IncompleteFile);
        findings.put_first(fault, rows, effect, remedy);
    }
    for (rows, effect) in log.contradictions() {
        let remedy = "stop the other publisher, or remap its topic, and record again; what is left is the machine that was recorded most";
        let fault = (Severity::Warning, FaultKind::OtherPublisher);
        findings.put_first(fault, rows, effect, remedy);
    }
    for (rows, effect) in log.uneven() {
        let remedy = "where it is known whose they are, say so by their places, `torque = \"effort[0]\"`, .. in [log.joint] of the robot file; else record again with one number for each name";
        let fault = (Severity::Error, FaultKind::MissingChannel);
        findings.put_first(fault, rows, effect, remedy);
    }
    for effect in log.breaks() {
        let remedy = "copy it again from where it was recorded; a recorder that is killed loses its last chunk";
        let fault = (Severity::Warning, FaultKind::IncompleteFile);
        findings.put_first(fault, 0, effect, remedy);
        findings.faults[0].from_s = findings.duration_s;
    }
    findings.place();
    Ok(Some(findings))
}

/// Leaves out rows that hold the sample of the row before.
#[derive(Debug)]
struct FreshRows {
    rows: usize,
    /// Columns of positions, torques and velocities.
    columns: Vec<usize>,
    last: Vec<f64>,
    since: usize,
}

impl FreshRows {
    fn new(rows: usize, plan: &ColumnPlan) -> Self {
        let all = plan.channels.iter();
        let of_motion = all.filter(|planned| planned.channel.role.has_shape());
        let columns: Vec<usize> = of_motion.map(|planned| planned.column).collect();
        Self {
            rows,
            last: vec![f64::NAN; columns.len()],
            columns,
            since: 0,
        }
    }

    fn keep(&mut self, block: &mut RawBlock) {
        let mut kept = 0;
        for row in 0..block.rows() {
            let own = || self.columns.iter().map(|at| block.columns[*at][row]);
            self.since += 1;
            if own().eq(self.last.iter().copied()) && self.since < self.rows {
                continue;
            }
            self.since = 0;
            self.last.clear();
            self.last.extend(own());
            block.t[kept] = block.t[row];
            let columns = block.columns.iter_mut();
            columns.for_each(|column| column[kept] = column[row]);
            kept += 1;
        }
        block.t.truncate(kept);
        let columns = block.columns.iter_mut();
        columns.for_each(|column| column.truncate(kept));
    }
}
