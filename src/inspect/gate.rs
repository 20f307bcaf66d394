//! What a fit must know of a log before it begins: whether it can be used, and which of its rows
//! are to be left out.

use super::channel::InspectedChannel;
use super::fault::{LogFault, Severity};
use super::judge::{Depth, LogJudge};
use super::words::ChannelRole;
use crate::log::{Block, Channels, Instant, Layout, LogError, Reader, escape};

/// A step that is cut out is longer than what counts as a gap by this factor, so that an uneven
/// clock closes none.
const WIDER: f64 = 1.1;

/// What the first look at a log found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gate {
    /// The first fault for which a fit refuses the log.
    refusal: Option<LogFault>,
    /// Faults whose rows are left out.
    marked: Vec<LogFault>,
    /// First and last time of the rows to leave out [s], in order and apart.
    cuts: Vec<[f64; 2]>,
    /// Median step of the log [s].
    dt: f64,
    /// The instant from which the log's times are counted.
    origin: Instant,
}

impl Gate {
    /// Reads a log to its end, its channels as logged; `None` where `stop` asks for it. `also` gets every
    /// block, and the layout that it was read by.
    ///
    /// # Errors
    /// Whatever keeps the reader from the log.
    pub fn look(
        reader: &mut Reader,
        stop: &dyn Fn() -> bool,
        also: &mut dyn FnMut(&Block, &Layout),
    ) -> Result<Option<Self>, LogError> {
        let mut judge = LogJudge::new(channels(reader), Depth::Gate);
        let mut block = Block::default();
        let mut columns: Vec<Vec<f64>> = Vec::new();
        while reader.read(&mut block)? {
            if stop() {
                return Ok(None);
            }
            also(&block, reader.layout());
            let rows = block.len();
            let torques = block.tau.len().checked_div(rows).unwrap_or(0);
            columns.resize_with(block.joints() + torques, Vec::new);
            columns.iter_mut().for_each(Vec::clear);
            let (positions, others) = columns.split_at_mut(block.joints());
            part(&block.q, positions);
            part(&block.tau, others);
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            judge.take(&block.t, &columns);
        }
        let found = judge.finish();
        let refusal = found.of(Severity::Error).next().cloned();
        let marked = found.of(Severity::Warning).filter(|fault| fault.cut);
        Ok(Some(Self {
            refusal,
            marked: marked.cloned().collect(),
            dt: found.rate_hz.map_or(0.0, |rate| 1.0 / rate),
            cuts: found.cuts,
            origin: reader.origin(),
        }))
    }

    /// The instant from which the log's times are counted.
    pub fn origin(&self) -> Instant {
        self.origin
    }

    /// The fault for which a fit refuses the log.
    pub fn refusal(&self) -> Option<&LogFault> {
        self.refusal.as_ref()
    }

    /// Takes rows out of the log so that a step longer than `gap_factor` median ones is left, which
    /// parts it.
    pub fn cutter(&self, gap_factor: f64) -> Cutter {
        let gap = WIDER * gap_factor * self.dt;
        let widened = self.cuts.iter().map(|[from, to]| {
            let more = (0.5 * (gap - (to - from))).max(0.6 * self.dt);
            [from - more, to + more]
        });
        Cutter {
            spans: widened.collect(),
            next: 0,
            removed: 0,
        }
    }

    /// What is left out and where, one sentence for each channel and kind of fault.
    pub fn warnings(&self) -> Vec<String> {
        let mut told: Vec<(&LogFault, u64, Vec<String>)> = Vec::new();
        for fault in &self.marked {
            let alike = told
                .iter_mut()
                .find(|(first, ..)| (first.kind, &first.channel) == (fault.kind, &fault.channel));
            match alike {
                Some((_, rows, spans)) => {
                    *rows += fault.rows;
                    spans.push(fault.span());
                }
                None => told.push((fault, fault.rows, vec![fault.span()])),
            }
        }
        let sentence = |(fault, rows, spans): (&LogFault, u64, Vec<String>)| {
            let channel = fault.channel.as_deref().map(escape).unwrap_or_default();
            let more = match spans.len() {
                0..=4 => String::new(),
                many => format!(" and {} more", many - 4),
            };
            format!(
                "{} of `{channel}`, {rows} row(s) at {}{more} s: left out, and nothing is differentiated across",
                fault.kind.word(),
                spans[..spans.len().min(4)].join(", "),
            )
        };
        told.into_iter().map(sentence).collect()
    }
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
    let kinds = [
        (&layout.positions, ChannelRole::Position),
        (&layout.torques, ChannelRole::Torque),
    ];
    let each = kinds.into_iter().flat_map(|(channels, role)| {
        let joints = channels.iter().zip(&layout.joints);
        joints.map(move |(channel, joint)| {
            let mut seen = InspectedChannel::new(&channel.column, role, Some(joint), None);
            // Volts are logged as the amplifier gave them.
            seen.saturates = role == ChannelRole::Torque && layout.channels == Channels::Actuator;
            seen
        })
    });
    each.collect()
}

/// Takes rows out of the blocks of a log, which are given in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cutter {
    spans: Vec<[f64; 2]>,
    /// The first span that may reach into the next block.
    next: usize,
    removed: u64,
}

impl Cutter {
    /// Removes the rows that lie in a span.
    pub fn cut(&mut self, block: &mut Block) {
        let (Some(first), Some(last)) = (block.t.first(), block.t.last()) else {
            return;
        };
        let (first, last) = (*first, *last);
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
        let gate = Gate {
            cuts: vec![[0.5, 0.5], [1.0, 1.4], [9.0, 9.0]],
            dt: 0.1,
            ..Gate::default()
        };
        let mut cutter = gate.cutter(2.5);
        let mut kept = Vec::new();
        for (from, to) in [(0, 11), (11, 14), (14, 30)] {
            let mut block = block(from, to);
            cutter.cut(&mut block);
            assert_eq!(block.q.len(), 2 * block.len());
            assert!(
                block
                    .q
                    .chunks(2)
                    .zip(&block.tau)
                    .all(|(q, tau)| q[1] == *tau)
            );
            kept.extend(block.tau);
        }
        let expected: Vec<f64> = (0..30u32)
            .filter(|k| ![4, 5, 6, 10, 11, 12, 13, 14].contains(k))
            .map(f64::from)
            .collect();
        assert_eq!(kept, expected);
        assert_eq!(cutter.removed(), 8);
        let steps = kept.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(steps.into_iter().all(|step| step == 1.0 || step > 2.5));
    }
}
