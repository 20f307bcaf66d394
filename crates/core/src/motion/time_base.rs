//! The time base of a log: its sampling step, stretches without gaps, and samples at equal steps.
//!
//! A log whose rows keep their step within 2 % is taken as it is; a row that came early, late or
//! not at all is replaced by interpolation. Where most steps are uneven, every sample is
//! interpolated on an even grid (cubic, through the four nearest rows). A step longer than the gap
//! factor ends a stretch, unless the rows to be kept are so slow that they do not see it.

use super::MotionError;
use super::settings::{FilterSettings, TorqueTiming};
use crate::block::Block;

/// Rows from which the sampling step is estimated.
const PREFIX: usize = 8192;
/// Share of a step by which rows may be off and still count as even.
const EVEN: f64 = 0.02;
/// Share of the steps of a steady clock that are even.
const STEADY: f64 = 0.9;
/// Rows that an interpolated value is formed from.
const NODES: usize = 4;
/// Rows kept behind the one in work: interpolation reaches that far back.
const HISTORY: usize = 4;
/// Rows buffered before the oldest are dropped.
const BUFFER: usize = 4096;

/// What the time base hands on.
pub(super) enum Event<'a> {
    /// A sample at an even step after the one before.
    Sample {
        /// Time (s).
        t: f64,
        q: &'a [f64],
        /// Torques at time t.
        tau: &'a [f64],
    },
    /// The stretch is over.
    End,
}

/// Sampling step and evenness of a list of times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SampleClock {
    /// Sampling step (s).
    pub dt: f64,
    /// Whether most steps are even, so that rows are taken as they are.
    pub even: bool,
    /// Whether nearly all are: what is missing then are rows, and not the clock's steadiness.
    pub steady: bool,
}

impl SampleClock {
    /// The clock of the rows at times `t` (s): the mean of the even steps, or the median step
    /// where fewer than half are even.
    pub fn of(t: &[f64]) -> Result<Self, MotionError> {
        let mut steps = Vec::with_capacity(t.len());
        for pair in t.windows(2) {
            steps.push(checked_step(pair[0], pair[1])?);
        }
        if steps.is_empty() {
            return Err(MotionError::TooFewSamples {
                samples: t.len() as u64,
            });
        }
        let middle = steps.len() / 2;
        let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        // Summed from the times, not from `steps`, whose order is no longer that of the log.
        let (mut sum, mut count) = (0.0, 0_usize);
        for pair in t.windows(2) {
            let step = pair[1] - pair[0];
            if (step - median).abs() <= EVEN * median {
                sum += step;
                count += 1;
            }
        }
        let even = 2 * count >= steps.len();
        let dt = if even { sum / count as f64 } else { median };
        let steady = count as f64 >= STEADY * steps.len() as f64;
        Ok(Self { dt, even, steady })
    }
}

impl SampleClock {
    /// Whether a step (s) splits a log: it is longer than the gap factor, and no number of rows of a steady clock that are
    /// missing for so short a time that the rows to be kept do not see it.
    pub fn splits(&self, step: f64, settings: &FilterSettings) -> bool {
        let steps = step / self.dt;
        let missing = self.steady && (steps - steps.round()).abs() <= EVEN * steps;
        steps > settings.gap_factor && !(missing && step <= settings.bridge_s)
    }
}

fn checked_step(before: f64, after: f64) -> Result<f64, MotionError> {
    let step = after - before;
    if step > 0.0 && step.is_finite() {
        Ok(step)
    } else {
        Err(MotionError::Time { before, after })
    }
}

/// Turns rows of a log into stretches of evenly spaced samples.
pub(super) struct TimeBase {
    joints: usize,
    clock: Option<SampleClock>,
    settings: FilterSettings,
    /// Rows of the stretch in work; before the clock is known, the log's first rows.
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
    /// Torques brought to the times of the rows, as far as the rows so far determine them.
    acting: Vec<f64>,
    /// Rows known to follow the one before without a gap.
    checked: usize,
    /// Row in work: every sample before its time is handed out.
    cursor: usize,
    /// Time from which the grid is counted (s), and the number of its next point.
    anchor: f64,
    next: f64,
    interpolated: u64,
    out_q: Vec<f64>,
    out_tau: Vec<f64>,
}

impl TimeBase {
    /// A time base for logs of `joints` joints; the step is found from the first rows unless
    /// `rate_hz` gives it.
    pub fn new(
        joints: usize,
        settings: &FilterSettings,
        rate_hz: Option<f64>,
    ) -> Result<Self, MotionError> {
        if !(settings.gap_factor > 1.0 && settings.gap_factor.is_finite()) {
            return Err(MotionError::Setting {
                name: "gap_factor",
                value: settings.gap_factor,
                remedy: "more than 1, 2.5 say",
            });
        }
        let clock = match rate_hz {
            None => None,
            Some(rate) if rate > 0.0 && rate.is_finite() => Some(SampleClock {
                dt: 1.0 / rate,
                even: true,
                steady: true,
            }),
            Some(value) => {
                return Err(MotionError::Setting {
                    name: "rate_hz",
                    value,
                    remedy: "a sampling rate in Hz, more than 0",
                });
            }
        };
        Ok(Self {
            joints,
            clock,
            settings: settings.clone(),
            t: Vec::new(),
            q: Vec::new(),
            tau: Vec::new(),
            acting: Vec::new(),
            checked: 0,
            cursor: 0,
            anchor: 0.0,
            next: 0.0,
            interpolated: 0,
            out_q: vec![0.0; joints],
            out_tau: vec![0.0; joints],
        })
    }

    pub fn clock(&self) -> Option<SampleClock> {
        self.clock
    }

    /// Takes a clock that is known already.
    pub(crate) fn use_clock(&mut self, clock: SampleClock) {
        self.clock = Some(clock);
    }

    /// Samples handed out that no row of the log gave as it was.
    pub fn interpolated(&self) -> u64 {
        self.interpolated
    }

    /// Takes rows; hands out nothing until the clock is known.
    pub fn push(&mut self, block: &Block) -> Result<(), MotionError> {
        let rows = block.t.len();
        for (channel, values) in [("q", block.q.len()), ("tau", block.tau.len())] {
            if values != rows * self.joints {
                return Err(MotionError::Shape {
                    channel,
                    values,
                    rows,
                    joints: self.joints,
                });
            }
        }
        self.t.extend_from_slice(&block.t);
        self.q.extend_from_slice(&block.q);
        self.tau.extend_from_slice(&block.tau);
        if self.clock.is_none() && self.t.len() >= PREFIX {
            self.clock = Some(SampleClock::of(&self.t[..PREFIX])?);
        }
        Ok(())
    }

    /// Finds the clock of a log shorter than the rows it is usually found from.
    pub(crate) fn settle_clock(&mut self) -> Result<SampleClock, MotionError> {
        match self.clock {
            Some(clock) => Ok(clock),
            None => Ok(*self.clock.insert(SampleClock::of(&self.t)?)),
        }
    }

    /// Hands out what the rows so far determine; with `last`, all that is left.
    pub fn drain(
        &mut self,
        last: bool,
        out: &mut impl FnMut(Event<'_>),
    ) -> Result<(), MotionError> {
        let Some(clock) = self.clock else {
            return Ok(());
        };
        while let Some(gap) = self.find_gap(clock)? {
            self.advance(clock, gap, true, out);
            out(Event::End);
            self.begin_behind(gap);
        }
        self.advance(clock, self.checked, last, out);
        if last {
            if self.checked > 0 {
                out(Event::End);
            }
            self.begin_behind(self.t.len());
        } else if self.cursor > HISTORY + BUFFER {
            let rows = self.cursor - HISTORY;
            self.forget(rows);
            self.checked -= rows;
            self.cursor = HISTORY;
        }
        Ok(())
    }

    /// Checks the rows that are new; the first row behind a gap, if there is one.
    fn find_gap(&mut self, clock: SampleClock) -> Result<Option<usize>, MotionError> {
        while self.checked < self.t.len() {
            if self.checked > 0 {
                let step = checked_step(self.t[self.checked - 1], self.t[self.checked])?;
                if clock.splits(step, &self.settings) {
                    return Ok(Some(self.checked));
                }
            }
            self.checked += 1;
        }
        Ok(None)
    }

    /// Hands out the samples that the rows before `end` determine; `closed` when no more rows of this stretch follow.
    fn advance(
        &mut self,
        clock: SampleClock,
        end: usize,
        closed: bool,
        out: &mut impl FnMut(Event<'_>),
    ) {
        let n = self.joints;
        self.bring_torques(clock, end, closed);
        let ready = self.acting.len() / n;
        let tolerance = clock.dt * if clock.even { EVEN } else { 1e-6 };
        if self.cursor == 0 && ready > 0 {
            self.anchor = self.t[0];
            self.next = 0.0;
        }
        while self.cursor < ready {
            let k = self.cursor;
            let due = self.anchor + self.next * clock.dt;
            let late = self.t[k] - due;
            if late.abs() <= tolerance {
                if clock.even {
                    self.anchor = self.t[k];
                    self.next = 1.0;
                } else {
                    self.next += 1.0;
                }
                self.cursor += 1;
                out(Event::Sample {
                    t: if clock.even { self.t[k] } else { due },
                    q: &self.q[k * n..(k + 1) * n],
                    tau: &self.acting[k * n..(k + 1) * n],
                });
            } else if late < 0.0 {
                self.cursor += 1;
            } else if closed || ready >= NODES.max(k + 2) {
                self.interpolate(due, ready);
                self.next += 1.0;
                self.interpolated += 1;
                out(Event::Sample {
                    t: due,
                    q: &self.out_q,
                    tau: &self.out_tau,
                });
            } else {
                break;
            }
        }
    }

    /// Extends `acting` over the rows before `end` whose neighbours are known.
    fn bring_torques(&mut self, clock: SampleClock, end: usize, closed: bool) {
        let n = self.joints;
        let from = self.acting.len() / n;
        match self.settings.torque {
            TorqueTiming::Sampled => {
                self.acting.extend_from_slice(&self.tau[from * n..end * n]);
            }
            TorqueTiming::ZeroOrderHold => {
                let to = if closed { end } else { end.saturating_sub(1) };
                let t = &self.t;
                let even = |k: usize| (t[k + 1] - t[k] - clock.dt).abs() <= EVEN * clock.dt;
                for k in from..to {
                    let wide = k >= 2 && k + 1 < end && (k - 2..=k).all(even);
                    for i in k * n..(k + 1) * n {
                        let tau = &self.tau;
                        // the mean of the staircase about t_k, its first error of fourth order in frequency
                        self.acting.push(if wide {
                            (13.0 * (tau[i - n] + tau[i]) - (tau[i - 2 * n] + tau[i + n])) / 24.0
                        } else if k >= 1 {
                            (tau[i - n] + tau[i]) / 2.0
                        } else {
                            tau[i]
                        });
                    }
                }
            }
        }
    }

    /// The value at time `due` of the cubic through the four rows nearest to it.
    fn interpolate(&mut self, due: f64, ready: usize) {
        let n = self.joints;
        let first = self
            .cursor
            .saturating_sub(2)
            .min(ready.saturating_sub(NODES));
        let nodes = &self.t[first..ready.min(first + NODES)];
        interpolate(nodes, &self.q[first * n..], due, &mut self.out_q);
        interpolate(nodes, &self.acting[first * n..], due, &mut self.out_tau);
    }

    /// Drops the rows of a stretch that is over.
    fn begin_behind(&mut self, rows: usize) {
        self.forget(rows);
        self.checked = 0;
        self.cursor = 0;
    }

    /// Drops rows from the front of the buffers.
    fn forget(&mut self, rows: usize) {
        self.t.drain(..rows);
        self.q.drain(..rows * self.joints);
        self.tau.drain(..rows * self.joints);
        let acting = self.acting.len().min(rows * self.joints);
        self.acting.drain(..acting);
    }
}

/// Writes what the rows `x` at the times `nodes` are at time `due`, by the polynomial through all of them.
pub(super) fn interpolate(nodes: &[f64], x: &[f64], due: f64, out: &mut [f64]) {
    out.fill(0.0);
    let rows = x.chunks_exact(out.len());
    for (m, (node, row)) in nodes.iter().zip(rows).enumerate() {
        let mut weight = 1.0;
        for (l, other) in nodes.iter().enumerate() {
            if l != m {
                weight *= (due - other) / (node - other);
            }
        }
        for (sum, value) in out.iter_mut().zip(row) {
            *sum += weight * value;
        }
    }
}
