//! One window of a segment: smoothing, differentiation, the computed channels and their filter.

use std::cell::RefCell;

use super::settings::FilterDesign;
use super::thinning::TorqueThinner;
use super::{FilteredRow, MotionError, MotionSample, rest};
use crate::math::kept::{KeptRows, KeptWork};

/// Share of movement in what a row is mostly made of, above which it is none of rest for sure.
const MAY_REST: f64 = 0.6;

thread_local! {
    /// The memory of a filter, kept from one window to the next that a thread computes.
    static WORK: RefCell<KeptWork> = RefCell::default();
}

/// A stretch of one segment with the overlaps that its filters need, and its rows; its memory serves again and again.
#[derive(Debug, Default)]
pub(super) struct FilterWindow {
    /// Number of the segment among those that are used.
    pub segment: usize,
    /// Index within the segment of the window's first sample.
    pub first: usize,
    /// Samples of the segment whose rows this window gives, as indices within the segment.
    pub core: std::ops::Range<usize>,
    /// Whether the window reaches the segment's end.
    pub ends: bool,
    /// Time from one row that is kept to the next [s].
    step: f64,
    pub t: Vec<f64>,
    pub q: Vec<f64>,
    pub tau: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    weight: Vec<f64>,
    rests: Vec<bool>,
    /// Torques one sample before and after those that are left of a log that is thinned.
    beside: [Vec<f64>; 2],
    /// Samples of the rows, as indices within the window.
    kept: Vec<usize>,
    /// Channels of the rows before and after the filter, row-major.
    raw: Vec<f64>,
    filtered: Vec<f64>,
}

impl FilterWindow {
    pub fn process(
        &mut self,
        chain: &FilterDesign,
        joints: usize,
        channels: usize,
        fill: &(dyn Fn(&MotionSample<'_>, &mut [f64]) + Sync),
    ) -> Result<(), MotionError> {
        let samples = self.t.len();
        self.step = chain.dt * chain.decimation as f64;
        let dt = step_of(&self.t, chain.dt);
        if let Some(filter) = &chain.position {
            filter.run(&mut self.q, joints)?;
        }
        self.v.resize(samples * joints, 0.0);
        self.a.resize(samples * joints, 0.0);
        chain
            .differences
            .apply(&self.q, joints, dt, &mut self.v, &mut self.a);

        self.weigh(chain, joints);

        // At a segment's end the parallel filter starts where the whole segment's would; at an
        // artificial end, where the position filter has settled.
        let lost = |at_end: bool| {
            if at_end {
                chain.edge
            } else {
                chain.position_overlap
            }
        };
        let from = lost(self.first == 0);
        let to = samples - lost(self.ends);
        self.choose_rows(chain, samples);
        self.beside.iter_mut().for_each(Vec::clear);
        let (from, to) = match &chain.thinner {
            None => (from, to),
            Some(thinner) => (0, self.thin(chain, thinner, joints, from..to)),
        };
        WORK.with_borrow_mut(|work| self.filter(work, chain, from..to, (joints, channels), fill))?;
        match self.filtered.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(self.offending(from..to, joints, channels, fill)),
        }
    }

    /// Keeps every so many samples of a span, counted as the rows are; how many they are.
    fn thin(
        &mut self,
        chain: &FilterDesign,
        thinner: &TorqueThinner,
        joints: usize,
        span: std::ops::Range<usize>,
    ) -> usize {
        let every = chain.thinned;
        // the first of the span that lies on the rows' grid, which begins at the edge
        let index = self.first + span.start;
        let start = match index < chain.edge {
            true => chain.edge - self.first,
            false => (index - chain.edge).next_multiple_of(every) + chain.edge - self.first,
        };
        let left = (start..span.end).step_by(every);
        let count = left.len();
        let mut torques = vec![0.0; count * joints];
        self.beside
            .iter_mut()
            .for_each(|tau| tau.resize(count * joints, 0.0));
        for (i, k) in left.enumerate() {
            let own = i * joints..(i + 1) * joints;
            thinner.at(&self.tau, joints, k as isize, &mut torques[own.clone()]);
            let [before, after] = &mut self.beside;
            thinner.at(&self.tau, joints, k as isize - 1, &mut before[own.clone()]);
            thinner.at(&self.tau, joints, k as isize + 1, &mut after[own]);
            self.t[i] = self.t[k];
            for of in [&mut self.q, &mut self.v, &mut self.a, &mut self.weight] {
                of.copy_within(k * joints..(k + 1) * joints, i * joints);
            }
        }
        self.tau = torques;
        self.t.truncate(count);
        for of in [&mut self.q, &mut self.v, &mut self.a, &mut self.weight] {
            of.truncate(count * joints);
        }
        for k in &mut self.kept {
            *k = (*k - start) / every;
        }
        count
    }

    /// Weighs the samples of every joint, and sees which of them rest.
    fn weigh(&mut self, chain: &FilterDesign, joints: usize) {
        self.weight.clear();
        self.weight.resize(self.t.len() * joints, 1.0);
        self.rests.clear();
        // where no speed of rest is given, any joint may rest
        self.rests.resize(joints, chain.rests.is_empty());
        for (j, (speed, reach)) in chain.rests.iter().enumerate().take(joints) {
            rest::weigh(&self.v, (joints, j), *speed, *reach, &mut self.weight);
            // of as many samples as a row takes, about, so many weigh nothing
            let mut sum = 0.0;
            for k in 0..self.t.len() {
                sum += self.weight[k * joints + j];
                if k >= chain.row_samples {
                    sum -= self.weight[(k - chain.row_samples) * joints + j];
                }
                self.rests[j] |=
                    k >= chain.row_samples && sum < MAY_REST * chain.row_samples as f64;
            }
        }
    }

    /// Filters the channels of the samples `span` and keeps those of the rows, and the raw values.
    fn filter(
        &mut self,
        work: &mut KeptWork,
        chain: &FilterDesign,
        span: std::ops::Range<usize>,
        (joints, channels): (usize, usize),
        fill: &(dyn Fn(&MotionSample<'_>, &mut [f64]) + Sync),
    ) -> Result<(), MotionError> {
        let mut raw = std::mem::take(&mut self.raw);
        raw.clear();
        let mut rows = self.kept.iter().peekable();
        let of = KeptRows {
            samples: span.len(),
            channels,
            first: self.kept.first().map_or(0, |k| k - span.start),
            kept: self.kept.len(),
        };
        let filtered = chain.kept.run(of, work, &mut |k, values| {
            let k = span.start + k;
            fill(&self.sample(k, joints), values);
            if rows.next_if_eq(&&k).is_some() {
                raw.extend_from_slice(values);
            }
        })?;
        (self.raw, self.filtered) = (raw, filtered);
        Ok(())
    }

    /// The rows, in order of time.
    pub fn rows(&self, joints: usize, channels: usize) -> impl Iterator<Item = FilteredRow<'_>> {
        self.kept.iter().enumerate().map(move |(row, &k)| {
            let state = k * joints..(k + 1) * joints;
            let values = row * channels..(row + 1) * channels;
            FilteredRow {
                t: self.t[k],
                segment: self.segment,
                step: self.step,
                q: &self.q[state.clone()],
                v: &self.v[state.clone()],
                a: &self.a[state],
                raw: &self.raw[values.clone()],
                filtered: &self.filtered[values],
            }
        })
    }

    /// Every m-th sample of the core, counted from where the segment's parallel filter starts, and none within the trim.
    fn choose_rows(&mut self, chain: &FilterDesign, samples: usize) {
        let lowest = chain.edge + chain.trim;
        let highest = if self.ends {
            (self.first + samples).saturating_sub(lowest)
        } else {
            usize::MAX
        };
        let start = self.core.start.max(lowest) - chain.edge;
        let start = start.next_multiple_of(chain.decimation) + chain.edge;
        self.kept.clear();
        self.kept.extend(
            (start..self.core.end.min(highest))
                .step_by(chain.decimation)
                .map(|index| index - self.first),
        );
    }

    /// The first sample at which a channel is not finite.
    fn offending(
        &self,
        span: std::ops::Range<usize>,
        joints: usize,
        channels: usize,
        fill: &(dyn Fn(&MotionSample<'_>, &mut [f64]) + Sync),
    ) -> MotionError {
        let mut values = vec![0.0; channels];
        for k in span {
            fill(&self.sample(k, joints), &mut values);
            if let Some(channel) = values.iter().position(|x| !x.is_finite()) {
                return MotionError::NotFinite {
                    channel,
                    value: values[channel],
                    t: self.t[k],
                };
            }
        }
        // Every value is finite, but their weighted sum overflows.
        let index = self.filtered.iter().position(|x| !x.is_finite());
        let index = index.unwrap_or(0);
        MotionError::NotFinite {
            channel: index % channels.max(1),
            value: self.filtered[index],
            t: self.t[self.kept[index / channels.max(1)]],
        }
    }

    fn sample(&self, k: usize, joints: usize) -> MotionSample<'_> {
        let row = k * joints..(k + 1) * joints;
        let torques = |k: usize| &self.tau[k * joints..(k + 1) * joints];
        let beside = match self.beside[0].is_empty() {
            true => [k.saturating_sub(1), (k + 1).min(self.t.len() - 1)].map(torques),
            false => self.beside.each_ref().map(|tau| &tau[row.clone()]),
        };
        MotionSample {
            t: self.t[k],
            q: &self.q[row.clone()],
            v: &self.v[row.clone()],
            a: &self.a[row.clone()],
            tau: torques(k),
            tau_beside: beside,
            weight: &self.weight[row],
            rests: &self.rests,
        }
    }
}

/// The log's sampling step, unless the window's own times run away from it by a tenth of a step (a clock that drifts).
pub(super) fn step_of(t: &[f64], dt: f64) -> f64 {
    match t {
        [first, .., last] => {
            let steps = (t.len() - 1) as f64;
            let span = last - first;
            if (span - steps * dt).abs() > 0.1 * dt {
                span / steps
            } else {
                dt
            }
        }
        _ => dt,
    }
}
