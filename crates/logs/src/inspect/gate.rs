//! What a fit must know of a log before it begins: whether it can be used, and which of its rows
//! are to be left out.

use super::channel::InspectedChannel;
use super::fault::{FaultKind, LogFault, Severity};
use super::findings::{LogFindings, RowCost, RowFate, joined};
use super::judge::{InspectionDepth, LogJudge};
use super::words::ChannelRole;
use crate::log::{
    Block, DeclaredChannels, Instant, Layout, LogError, MendingSettings, Reader, RowFault, escape,
};

/// A step that is cut out is longer than what counts as a gap by this factor, so that an uneven clock closes none.
const CUT_GAP_FACTOR: f64 = 1.1;
/// Readings at most that look for what was hidden by what an earlier one found.
const MAX_READINGS: usize = 4;

/// What the first look at a log found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InspectionGate {
    /// What the last reading found.
    found: LogFindings,
    /// What every reading found that a fit leaves out or mends, and torques that are exactly 0 in motion.
    marked: Vec<LogFault>,
    /// Whether the robot moves as without its motors where they are, once known.
    freely: Option<bool>,
    /// Positions among the channels.
    positions: usize,
    /// The instant from which the log's times are counted.
    origin: Instant,
    /// What is mended as the log is read.
    mending: MendingSettings,
}

impl InspectionGate {
    /// Reads a log to its end, its channels as logged; `None` where `stop` asks for it. It is read
    /// again where the first look found what hides the rest: positions that begin anew, samples
    /// that were held; `also` gets every block, and the layout that it was read
    /// by, of the last reading after the blocks of any before it.
    ///
    /// # Errors
    /// Whatever keeps the reader from the log.
    pub fn look(
        open: &dyn Fn() -> Result<Reader, LogError>,
        keep: &[RowFault],
        stop: &dyn Fn() -> bool,
        also: &mut dyn FnMut(&Block, &Layout),
    ) -> Result<Option<Self>, LogError> {
        let mut mending = MendingSettings {
            keep_repeats: keep.contains(&RowFault::RepeatedRows),
            ..MendingSettings::default()
        };
        let mut read = |mending: &MendingSettings| -> Result<_, LogError> {
            let mut reader = open()?;
            reader.mend(mending);
            let found = findings(&mut reader, keep, stop, also)?;
            let positions = reader.layout().positions.len();
            Ok(found.map(|found| (found, reader.origin(), reader.hold(), positions)))
        };
        let Some((mut found, mut origin, held, positions)) = read(&mending)? else {
            return Ok(None);
        };
        let held = held.filter(|_| !keep.contains(&RowFault::SampleAndHold));
        let mut marked = Vec::new();
        for _ in 0..MAX_READINGS {
            let first = mending.wraps.is_empty();
            let even = found.even.filter(|_| mending.even.is_none());
            if !(even.is_some() || first && (held.is_some() || !found.wraps.is_empty())) {
                break;
            }
            mending.held = held;
            mending.even = mending.even.or(even);
            mending.wraps.resize(positions, None);
            for (place, range) in &found.wraps {
                mending.wraps[*place] = Some(*range);
            }
            let hiding = |fault: &LogFault| match fault.kind {
                FaultKind::WrappedEncoder => true,
                FaultKind::IrregularClock => even.is_some(),
                _ => false,
            };
            marked.extend(found.faults.into_iter().filter(hiding));
            (found, origin, ..) = match read(&mending)? {
                Some(again) => again,
                None => return Ok(None),
            };
        }
        // what is mended may have hidden more of its kind, and what goes along takes no number of it
        let (mut bridges, mut failed, mut mended) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..MAX_READINGS {
            if found.bridges.is_empty() && found.failed.is_empty() {
                break;
            }
            let of_mended =
                |kind: FaultKind| matches!(kind, FaultKind::Spike | FaultKind::FailedRead);
            let faults = found.faults.into_iter().filter(|fault| fault.cut);
            marked.extend(faults.filter(|fault| of_mended(fault.kind)));
            mended.extend(found.costs.into_iter().filter(|cost| of_mended(cost.kind)));
            bridges.append(&mut found.bridges);
            failed.append(&mut found.failed);
            bridges.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.channel.cmp(&b.channel)));
            failed.sort_by(f64::total_cmp);
            mending.bridges = bridges.as_slice().into();
            mending.failed = failed.as_slice().into();
            (found, origin, ..) = match read(&mending)? {
                Some(again) => again,
                None => return Ok(None),
            };
        }
        for cost in mended {
            let same = |own: &&mut RowCost| (own.kind, own.fate) == (cost.kind, cost.fate);
            match found.costs.iter_mut().find(same) {
                Some(own) => own.rows += cost.rows,
                None => found.costs.push(cost),
            }
        }
        let cut = found.of(Severity::Warning).filter(|fault| fault.cut);
        marked.extend(cut.cloned());
        let off = found.of(Severity::Info);
        let off = off.filter(|fault| fault.kind == FaultKind::MotorOff);
        marked.extend(off.cloned());
        Ok(Some(Self {
            found,
            marked,
            freely: None,
            positions,
            origin,
            mending,
        }))
    }

    /// Median step of the log [s].
    fn dt(&self) -> f64 {
        self.found.rate_hz.map_or(0.0, |rate| 1.0 / rate)
    }

    /// The instant from which the log's times are counted.
    pub fn origin(&self) -> Instant {
        self.origin
    }

    /// The fault for which a fit refuses the log.
    pub fn refusal(&self) -> Option<&LogFault> {
        self.found.of(Severity::Error).next()
    }

    /// What a reader of the log is to mend.
    pub fn mending(&self) -> &MendingSettings {
        &self.mending
    }

    /// Stretches in which a torque is exactly 0 while its joint moves, by the torque's place: from,
    /// to [s].
    pub fn off(&self) -> Vec<(usize, [f64; 2])> {
        let place = |place: usize| place.saturating_sub(self.positions);
        let off = self.found.off.iter();
        off.map(|(at, span)| (place(*at), *span)).collect()
    }

    /// Says whether the robot moves in them as it does without its motors: if not, they are left out.
    pub fn set_freely(&mut self, freely: bool) {
        self.freely = Some(freely);
        if freely {
            return;
        }
        let dt = self.dt();
        let found = &mut self.found;
        let spans = joined(found.off.iter().map(|(_, span)| *span).collect());
        let rows = |[from, to]: &[f64; 2]| ((to - from) / dt).round() as u64 + 1;
        found.costs.push(RowCost {
            kind: FaultKind::MotorOff,
            rows: spans.iter().map(rows).sum(),
            fate: RowFate::LeftOut,
        });
        RowCost::sort(&mut found.costs);
        found.cuts = joined(found.cuts.drain(..).chain(spans).collect());
    }

    /// Takes rows out of the log so that a step is left that parts it: one longer than `longest` has it for the
    /// median step \[s\].
    pub fn cutter(&self, longest: &dyn Fn(f64) -> f64) -> RowCutter {
        let dt = self.dt();
        let gap = CUT_GAP_FACTOR * longest(dt);
        let widened = self.found.cuts.iter().map(|[from, to]| {
            let more = (0.5 * (gap - (to - from))).max(0.6 * dt);
            [from - more, to + more]
        });
        RowCutter {
            spans: widened.collect(),
            ..RowCutter::default()
        }
    }

    /// How many rows each cause costs, the most first.
    pub fn costs(&self) -> &[RowCost] {
        &self.found.costs
    }

    /// What is left out or mended and where, one sentence for each kind of fault.
    pub fn warnings(&self) -> Vec<String> {
        let mut kinds: Vec<(FaultKind, u64)> = Vec::new();
        for fault in &self.marked {
            match kinds.iter_mut().find(|(kind, _)| *kind == fault.kind) {
                Some((_, rows)) => *rows += fault.rows,
                None => kinds.push((fault.kind, fault.rows)),
            }
        }
        kinds.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        let kinds = kinds.into_iter();
        kinds.map(|(kind, _)| self.sentence(kind)).collect()
    }

    /// All that is marked as of one kind, channel by channel.
    fn sentence(&self, kind: FaultKind) -> String {
        let mut channels: Vec<(Option<&str>, u64, Vec<String>)> = Vec::new();
        for fault in self.marked.iter().filter(|fault| fault.kind == kind) {
            let name = fault.channel.as_deref();
            match channels.iter_mut().find(|(known, ..)| *known == name) {
                Some((_, rows, spans)) => {
                    *rows += fault.rows;
                    spans.push(fault.span());
                }
                None => channels.push((name, fault.rows, vec![fault.span()])),
            }
        }
        let of = channels.iter().map(|(name, rows, spans)| {
            let name = name.map_or(String::new(), |name| format!(" of `{}`", escape(name)));
            let more = match spans.len() {
                0..=4 => String::new(),
                many => format!(" and {} more", many - 4),
            };
            let what = match kind {
                FaultKind::WrappedEncoder | FaultKind::PositionStep => "time(s)",
                _ => "row(s)",
            };
            format!(
                "{name}, {rows} {what} at {}{more} s",
                spans[..spans.len().min(4)].join(", ")
            )
        });
        let of = of.collect::<Vec<_>>().join(";");
        let followed;
        let then = match kind {
            FaultKind::WrappedEncoder => {
                let remedies = self.marked.iter().filter(|fault| fault.kind == kind);
                let remedies: Vec<&str> = remedies.map(|fault| fault.remedy.as_str()).collect();
                followed = format!("followed through its turns; {}", remedies.join(", "));
                &*followed
            }
            FaultKind::PositionStep => {
                "the log is parted there; before or after it the position is off"
            }
            FaultKind::MotorOff if self.freely == Some(true) => {
                "torques of 0 that are data, for the robot moves as it does without its motors"
            }
            FaultKind::MotorOff => {
                "torques of 0 in motion that does not go with them: left out, and nothing is differentiated across"
            }
            FaultKind::Spike => "bridged by the rows beside them",
            FaultKind::IrregularClock => {
                "stamps jitter, and positions were sampled evenly: put on an even clock"
            }
            FaultKind::FailedRead => "left out, and the log is interpolated over a few of them",
            _ => "left out, and nothing is differentiated across",
        };
        format!("{}{of}: {then}", kind.word())
    }
}

/// What there is to say of the log that a reader gives; `None` where `stop` asks for it.
fn findings(
    reader: &mut Reader,
    keep: &[RowFault],
    stop: &dyn Fn() -> bool,
    also: &mut dyn FnMut(&Block, &Layout),
) -> Result<Option<LogFindings>, LogError> {
    let mut judge = LogJudge::new(channels(reader), InspectionDepth::Gate);
    judge.keep = keep.to_vec();
    let mut block = Block::default();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    while reader.read(&mut block)? {
        if stop() {
            return Ok(None);
        }
        also(&block, reader.layout());
        let torques = block.tau.len().checked_div(block.len()).unwrap_or(0);
        columns.resize_with(block.joints() + torques, Vec::new);
        columns.iter_mut().for_each(Vec::clear);
        let (positions, others) = columns.split_at_mut(block.joints());
        part(&block.q, positions);
        part(&block.tau, others);
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        judge.take(&block.t, &columns);
    }
    judge.clock.seams = reader.seams();
    let mut found = judge.finish();
    found.check_clock(&escape(&reader.name()), reader.is_recording())?;
    found.count_from(reader.origin().seconds());
    Ok(Some(found))
}

/// Puts row-major numbers into columns.
fn part(rows: &[f64], columns: &mut [Vec<f64>]) {
    if columns.is_empty() {
        return;
    }
    for row in rows.chunks_exact(columns.len()) {
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(*value);
        }
    }
}

/// The channels whose numbers a fit reads.
fn channels(reader: &Reader) -> Vec<InspectedChannel> {
    let layout = reader.layout();
    // Volts are logged as the amplifier gave them.
    let volts = layout.channels == DeclaredChannels::Actuator;
    let kinds = [
        (&layout.positions, ChannelRole::Position, false),
        (&layout.torques, ChannelRole::Torque, volts),
    ];
    let commands = layout.section.torque.is_some();
    let each = kinds.into_iter().flat_map(|(channels, role, saturates)| {
        let each = channels.iter().enumerate();
        each.map(move |(place, channel)| {
            let joint = &layout.joints[layout.joint_of(place)];
            InspectedChannel {
                saturates,
                delivers: match role {
                    ChannelRole::Torque if !volts => layout.torque_limit(joint),
                    _ => None,
                },
                commands: commands && role == ChannelRole::Torque,
                factor: channel.factor,
                zero: channel.offset,
                // what a controller adds may be 0 throughout
                ..InspectedChannel::new(
                    &channel.column,
                    match place < layout.joints.len() {
                        true => role,
                        false => ChannelRole::Command,
                    },
                    Some(joint),
                    None,
                )
            }
        })
    });
    each.collect()
}

/// Takes rows out of the blocks of a log, which are given in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RowCutter {
    spans: Vec<[f64; 2]>,
    /// The first span that may reach into the next block.
    next: usize,
    removed: u64,
}

impl RowCutter {
    /// Removes the rows that lie in a span.
    pub fn cut(&mut self, block: &mut Block) {
        let (Some(&first), Some(&last)) = (block.t.first(), block.t.last()) else {
            return;
        };
        while self.spans.get(self.next).is_some_and(|[_, to]| *to < first) {
            self.next += 1;
        }
        let mut spans = self.spans[self.next..].iter().peekable();
        if spans.peek().is_none_or(|[from, _]| *from > last) {
            return;
        }
        let before = block.len();
        block.retain(|t| {
            while spans.next_if(|[_, to]| *to < t).is_some() {}
            spans.peek().is_none_or(|[from, _]| t < *from)
        });
        self.removed += (before - block.len()) as u64;
    }

    /// Rows that were taken out so far.
    pub fn removed(&self) -> u64 {
        self.removed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(from: u32, to: u32) -> Block {
        let rows = from..to;
        Block {
            t: rows.clone().map(|k| f64::from(k) * 0.1).collect(),
            q: rows.clone().flat_map(|k| [f64::from(k); 2]).collect(),
            tau: rows.map(f64::from).collect(),
            ..Block::default()
        }
    }

    #[test]
    fn what_is_cut_out_leaves_a_step_that_is_a_gap_across_blocks_too() {
        let mut gate = InspectionGate::default();
        gate.found.cuts = vec![[0.5, 0.5], [1.0, 1.4], [9.0, 9.0]];
        gate.found.rate_hz = Some(10.0);
        let mut cutter = gate.cutter(&|dt| 2.5 * dt);
        let mut kept = Vec::new();
        for (from, to) in [(0, 11), (11, 14), (14, 30)] {
            let mut block = block(from, to);
            cutter.cut(&mut block);
            assert_eq!(block.q.len(), 2 * block.len());
            let mut pairs = block.q.chunks(2).zip(&block.tau);
            assert!(pairs.all(|(q, tau)| q[1] == *tau));
            kept.extend(block.tau);
        }
        let rows = (0..30).filter(|k| ![4, 5, 6, 10, 11, 12, 13, 14].contains(k));
        let expected: Vec<f64> = rows.map(f64::from).collect();
        assert_eq!(kept, expected);
        assert_eq!(cutter.removed(), 8);
        let steps = kept.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(steps.into_iter().all(|step| step == 1.0 || step > 2.5));
    }
}
