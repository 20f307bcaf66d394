//! A log that is being read for a fit: rows that are marked bad left out, torques at their rows' time.

use std::sync::Arc;

use super::control::Control;
use super::error::{IdentifyError, ReadError};
use super::first_look::FirstLook;
use super::held_torque::HeldTorque;
use cft_ident_core::motion::{MotionError, RunError, Stretch, Summary, ZeroOrderHold};
use cft_ident_core::number::{self, clock};
use cft_ident_core::robot::Robot;
use cft_ident_logs::inspect::RowCutter;
use cft_ident_logs::log::{Block, Instant, Layout, Provenance, Reader};

/// A velocity column is off by more than filters and steps make of it.
const VELOCITY_SCALE_TOLERANCE: f64 = 0.1;

/// A log that is being read.
pub struct OpenLog<'a> {
    pub(crate) reader: Reader,
    pub(crate) control: &'a Control,
    /// Brings motor forces by a zero-order hold to the rows' own time and pose.
    pub(crate) centre: Option<(&'a Robot, ZeroOrderHold)>,
    /// Torques of effects that a fit holds.
    pub(crate) held: Option<&'a HeldTorque>,
    pub(crate) name: String,
    pub(crate) look: Arc<FirstLook>,
    pub(crate) cutter: RowCutter,
}

impl OpenLog<'_> {
    /// The next block, without the rows that are marked bad; false at the end.
    pub fn read(&mut self, block: &mut Block) -> Result<bool, ReadError> {
        loop {
            if self.control.stopped() {
                return Err(ReadError::Interrupted);
            }
            let more = self.reader.read(block)?;
            if let Some((robot, hold)) = &mut self.centre {
                hold.centre(robot, block);
            }
            if block.tau.is_empty() {
                // a log without torques moves with none
                block.tau.resize(block.q.len(), 0.0);
            }
            if let Some(held) = self.held {
                held.take_off(block);
            }
            self.cutter.cut(block);
            if !more || !block.is_empty() {
                return Ok(more);
            }
        }
    }

    /// Which columns are read.
    pub(crate) fn layout(&self) -> &Layout {
        self.reader.layout()
    }

    /// Counts stretches from where the machine began to run, as far as that is known: a part of a log begins later.
    pub(crate) fn count_run_time(&self, stretches: &mut [Stretch]) {
        for stretch in stretches {
            stretch.began += self.reader.started_s();
        }
    }

    /// The instant from which the times of the blocks are counted.
    pub fn origin(&self) -> Instant {
        self.look.gate.origin()
    }

    /// What was left out, mended or chosen, once the last block is read: how many rows each cause costs,
    /// the most first, then what and where.
    pub fn warnings(&self) -> Vec<String> {
        self.costs_and_places(0)
    }

    /// The same with what the processing left out.
    pub fn in_words(&self, summary: &Summary) -> Vec<String> {
        let mut out = self.costs_and_places(summary.skipped.samples);
        out.extend(self.velocities());
        out.extend(summary_warnings(&self.name, self.origin(), summary));
        out
    }

    /// Velocity columns that are no derivatives of the positions, as a warning: by one factor where it is the clock.
    fn velocities(&self) -> Option<String> {
        let names = &self.layout().joints;
        let off = |(j, factor): (usize, &Option<f64>)| {
            let factor = factor.filter(|x| (x - 1.0).abs() > VELOCITY_SCALE_TOLERANCE)?;
            Some((names.get(j)?.as_str(), factor))
        };
        let off: Vec<(&str, f64)> = self
            .look
            .velocities
            .iter()
            .enumerate()
            .filter_map(off)
            .collect();
        let known = self.look.velocities.iter().flatten().count();
        let (first, others) = off.split_first()?;
        let alike = |(_, x): &(&str, f64)| (x / first.1 - 1.0).abs() < VELOCITY_SCALE_TOLERANCE;
        let each: Vec<String> = off
            .iter()
            .map(|(j, x)| format!("{j} {}", number::significant(*x, 3)))
            .collect();
        let cause = match off.len() == known && known > 1 && others.iter().all(alike) {
            true => format!(
                "all by one factor: the clock of the log runs at {} of its rate (`time_unit` in [log], or the rate), or the unit of the velocities is another",
                number::significant(first.1.recip(), 3)
            ),
            false => {
                "its unit, sign or gear, or its joint, is another; give it in [log.joint.NAME]"
                    .to_owned()
            }
        };
        Some(format!(
            "{}: velocity columns are so many times the derivative of the positions: {}; {cause}",
            self.name,
            each.join(", ")
        ))
    }

    fn costs_and_places(&self, too_short: u64) -> Vec<String> {
        let mut out: Vec<String> = self.costs(too_short).into_iter().collect();
        out.extend(self.reader.warnings());
        let found = self.look.gate.warnings().into_iter();
        out.extend(found.map(|text| format!("{}: {text}", self.name)));
        out
    }

    /// How many rows each cause costs, the most first; `None` where none is left out or mended.
    fn costs(&self, too_short: u64) -> Option<String> {
        let by_reader = self.reader.left_out();
        let mut costs: Vec<(u64, String)> = (self.look.gate.costs().iter())
            .map(|cost| (cost.rows, cost.text()))
            .chain(by_reader.map(|(rows, kind)| (rows, format!("{rows} {kind}"))))
            .chain([(
                too_short,
                format!("{too_short} in stretches too short to filter"),
            )])
            .filter(|(rows, _)| *rows > 0)
            .collect();
        costs.sort_by_key(|(rows, _)| std::cmp::Reverse(*rows));
        if costs.is_empty() {
            return None;
        }
        let dropped: u64 = by_reader.iter().map(|(rows, _)| rows).sum();
        let dropped = dropped + self.reader.not_read();
        let rows = self.reader.samples() + dropped;
        let shown = match self.cutter.removed() + dropped + too_short {
            0 => format!("none of {rows} rows is left out in all"),
            removed => format!(
                "{removed} of {rows} rows are left out in all, those next to bad ones included"
            ),
        };
        let causes: Vec<String> = costs.into_iter().map(|(_, text)| text).collect();
        Some(format!(
            "{}: {shown}: {}; see `cft-ident inspect`",
            self.name,
            causes.join(", ")
        ))
    }

    /// What ended a run through it, with what was left out where too little remained.
    pub(crate) fn ended(&self, error: RunError<ReadError>) -> IdentifyError {
        match error {
            RunError::Source(error) => error.into(),
            RunError::Motion(error) => IdentifyError::Motion {
                of: self.name.clone(),
                left_out: matches!(error, MotionError::NoSegment { .. })
                    .then(|| self.costs(0).or_else(|| self.reader.warnings().pop()))
                    .flatten()
                    .map(String::into_boxed_str),
                error,
            },
        }
    }

    /// Whether torques come from a zero-order hold and so are means of two rows here.
    pub(crate) fn is_centred(&self) -> bool {
        self.centre.is_some()
    }

    /// Name, span, checksum and size of what was read.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn provenance(&self) -> Result<Provenance, IdentifyError> {
        Ok(self.reader.provenance()?)
    }
}

/// Warnings about what the processing left out of a log.
fn summary_warnings(name: &str, origin: Instant, summary: &Summary) -> Vec<String> {
    let zero = origin.seconds();
    let mut out = Vec::new();
    if summary.skipped.segments > 0 {
        let spans: Vec<String> = summary
            .skipped
            .spans_s
            .iter()
            .take(3)
            .map(|[a, b]| format!("{}..{} s", clock(zero + a), clock(zero + b)))
            .collect();
        out.push(format!(
            "{name}: {} between gaps, too short to filter, left out ({} samples; {})",
            match summary.skipped.segments {
                1 => "1 stretch".to_owned(),
                many => format!("{many} stretches"),
            },
            summary.skipped.samples,
            spans.join(", ")
        ));
    }
    if summary.segments > 1 {
        out.push(format!(
            "{name}: gaps part it into {} stretches; nothing is differentiated across them",
            summary.segments
        ));
    }
    if summary.interpolated > 0 {
        out.push(format!(
            "{name}: the clock is uneven; its {} samples were resampled to an even one, with {} points interpolated",
            summary.samples, summary.interpolated
        ));
    }
    out
}
