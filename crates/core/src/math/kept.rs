//! A zero-phase filter of which every m-th output is kept, over rows that are made one after the other and forgotten.
//!
//! From one output that is kept to the next both passes are linear in the states in which they begin and in the samples
//! between, u_0 .. u_(m-1). With s the state of the forward pass before them and r that of the backward pass behind them,
//!
//! ```text
//! s' = F s + sum f_k u_k             z = p s + q r + sum z_k u_k             r' = P s + Q r + sum r_k u_k
//! ```
//!
//! so that no pass over single samples is left but at the ends. They are those of [`ZeroPhase`].

use super::MathError;
use super::lanes::{LaneWork, Simd, widest};
use super::sos::Section;
use super::zero_phase::ZeroPhase;

/// Channels side by side.
const GROUP: usize = 8;
/// Sums that are formed at once: they stay in registers.
const TOGETHER: usize = 3;

/// One number of each lane of a group.
type LaneGroup = [f64; GROUP];
const ZERO: LaneGroup = [0.0; GROUP];

/// A filter that keeps every so many outputs.
#[derive(Debug, Clone)]
pub struct KeptEvery {
    filter: ZeroPhase,
    every: usize,
    /// What each sample adds to s', z and r', padded to whole [`TOGETHER`].
    of_sample: Vec<f64>,
    /// What each number of s does to s', z and r'.
    of_forward: Vec<Vec<f64>>,
    /// What each number of r does to z and r'.
    of_backward: Vec<Vec<f64>>,
}

/// Memory of a run, for the next one.
#[derive(Debug, Default)]
pub struct KeptWork {
    /// Rows that are looked at, of a whole number of groups.
    rows: Vec<f64>,
    /// State of the pass that runs, `[number][channel]`.
    state: Vec<f64>,
    /// z and r' of every stretch between two outputs, but for the part of r.
    parts: Vec<f64>,
    /// Whether a group has held zeros only, as the columns of links do that a joint does not carry: so do its outputs.
    empty: Vec<bool>,
}

/// What is filtered: so many rows of so many channels; outputs are kept from this row on.
#[derive(Debug, Clone, Copy)]
pub struct KeptRows {
    pub samples: usize,
    pub channels: usize,
    pub first: usize,
    pub kept: usize,
}

impl KeptEvery {
    /// Keeps every so many outputs of a filter.
    pub fn new(filter: ZeroPhase, every: usize) -> Self {
        let states = 2 * filter.sos().sections().len();
        let sums = 2 * states + 1;
        let unit = |k: usize, of: usize| f64::from(u8::from(k == of));
        let response = |u: &dyn Fn(usize) -> f64, of: [usize; 2]| -> Vec<f64> {
            let begin = |of: usize| -> Vec<f64> { (0..states).map(|m| unit(m, of)).collect() };
            let [mut s, mut r] = of.map(begin);
            let sections = filter.sos().sections();
            let y: Vec<f64> = (0..every)
                .map(|k| one_step(sections, &mut s, u(k)))
                .collect();
            let back = y.iter().rev().map(|y| one_step(sections, &mut r, *y));
            let z = back.last().unwrap_or(0.0);
            [&s[..], &[z][..], &r[..]].concat()
        };
        let of_state = |forward: bool, m: usize| match forward {
            true => response(&|_| 0.0, [m, states]),
            false => response(&|_| 0.0, [states, m]).split_off(states),
        };
        // short stretches have fewer samples than states: both passes over all samples are less work
        let pays = every > states;
        let of_sample = (0..if pays { every } else { 0 }).flat_map(|k| {
            let mut sums_of = response(&|i| unit(i, k), [states; 2]);
            sums_of.resize(sums.next_multiple_of(TOGETHER), 0.0);
            sums_of
        });
        Self {
            of_sample: of_sample.collect(),
            of_forward: (0..states).map(|m| of_state(true, m)).collect(),
            of_backward: (0..states).map(|m| of_state(false, m)).collect(),
            every,
            filter,
        }
    }

    /// The outputs that are kept, row by row, of rows that `fill` writes in their order.
    ///
    /// # Errors
    /// [`MathError::TooShort`] unless there are more samples than the filter's extension at the ends.
    pub fn run(
        &self,
        of: KeptRows,
        work: &mut KeptWork,
        fill: &mut dyn FnMut(usize, &mut [f64]),
    ) -> Result<Vec<f64>, MathError> {
        let pad = self.filter.sos().pad_samples();
        let mut out = vec![0.0; of.kept * of.channels];
        if of.samples <= pad {
            return Err(MathError::TooShort {
                samples: of.samples,
                needed: pad,
            });
        }
        if of.channels == 0 || of.kept == 0 {
            return Ok(out);
        }
        let stride = of.channels.next_multiple_of(GROUP);
        let mut rows = Rows {
            stride,
            channels: of.channels,
            next: 0,
            fill,
        };
        let states = self.of_forward.len();
        work.state.clear();
        work.state.resize(states * stride, 0.0);
        work.empty.clear();
        work.empty.resize(stride / GROUP, true);
        work.parts.clear();
        work.rows.clear();
        // the far end mirrors as many rows behind the last stretch
        let mut begin = of.first % self.every;
        let mut stretches = of.samples.saturating_sub(begin + pad + 1) / self.every;
        if self.of_sample.is_empty() || stretches == 0 {
            (begin, stretches) = (0, 0);
        }
        rows.read(&mut work.rows, 0..begin.max(pad + 1));
        self.do_lanes(StretchPart::Begin(begin), work, stride);
        let skipped = (of.first - begin) / self.every;
        for k in 0..stretches {
            // what was read beyond the rows before is the first of these
            let from = begin + k * self.every;
            let seen = from - work.rows_from(rows.next, stride);
            work.rows.drain(..seen * stride);
            rows.read(&mut work.rows, from..from + self.every);
            let at = (k >= skipped).then_some((k - skipped.min(k)) * (states + 1) * stride);
            self.do_lanes(StretchPart::Stretch(at), work, stride);
        }
        let tail = begin + stretches * self.every;
        let seen = tail - work.rows_from(rows.next, stride);
        work.rows.drain(..seen * stride);
        rows.read(&mut work.rows, tail..of.samples);
        self.do_lanes(StretchPart::End, work, stride);
        let mut keep = |k: usize, z: &[f64]| {
            if k >= of.first && (k - of.first).is_multiple_of(self.every) {
                let row = (k - of.first) / self.every;
                if let Some(out) = out.chunks_exact_mut(of.channels).nth(row) {
                    out.copy_from_slice(&z[..of.channels]);
                }
            }
        };
        for (k, z) in work.rows.chunks_exact(stride).enumerate() {
            keep(tail + k, z);
        }
        let size = (states + 1) * stride;
        for k in (0..work.parts.len() / size).rev() {
            self.do_lanes(StretchPart::Back(k * size), work, stride);
            let from = begin + (skipped + k) * self.every;
            keep(from, &work.parts[k * size..k * size + stride]);
        }
        Ok(out)
    }

    fn do_lanes(&self, part: StretchPart, work: &mut KeptWork, stride: usize) {
        widest(PartOf {
            of: self,
            part,
            work,
            stride,
        });
    }

    /// The state after the near end's extension and the first rows.
    #[inline(always)]
    fn begin(&self, work: &mut KeptWork, (g, stride): (usize, usize), count: usize) {
        let at = |k: usize| lanes(&work.rows, k * stride + g * GROUP);
        let pad = self.filter.sos().pad_samples();
        let first = at(0);
        let mut s = self.settled(reflected(first, at(pad)));
        for k in (1..=pad).rev() {
            self.step(&mut s, reflected(first, at(k)));
        }
        for k in 0..count {
            self.step(&mut s, at(k));
        }
        self.keep_state(work, (g, stride), &s);
    }

    /// Forward over a stretch.
    #[inline(always)]
    fn stretch(&self, work: &mut KeptWork, (g, stride): (usize, usize), to: Option<usize>) {
        let states = self.of_forward.len();
        let width = (2 * states + 1).next_multiple_of(TOGETHER);
        let mut sums = [ZERO; MOST_SUMS];
        for (k, sums) in sums[..width].chunks_exact_mut(TOGETHER).enumerate() {
            let found = sums_of(&work.rows[g * GROUP..], stride, &self.of_sample, (width, k));
            sums.copy_from_slice(&found);
        }
        let s: [LaneGroup; MOST_STATES] = group(&work.state, (g, stride), states);
        for (s, weights) in s.iter().zip(&self.of_forward) {
            for (sum, w) in sums.iter_mut().zip(weights) {
                add(sum, *w, s);
            }
        }
        self.keep_state(work, (g, stride), &sums);
        if let Some(to) = to {
            for (m, sum) in sums[states..2 * states + 1].iter().enumerate() {
                put(&mut work.parts, to + m * stride + g * GROUP, sum);
            }
        }
    }

    /// Forward over the rows that are left, and back: outputs in their place, and the state before them.
    #[inline(always)]
    fn end(
        &self,
        work: &mut KeptWork,
        (g, stride): (usize, usize),
        extension: &mut Vec<LaneGroup>,
    ) {
        let count = work.rows.len() / stride;
        let pad = self.filter.sos().pad_samples();
        let place = |k: usize| k * stride + g * GROUP;
        let last = lanes(&work.rows, place(count - 1));
        extension.clear();
        extension
            .extend((1..=pad).map(|i| reflected(last, lanes(&work.rows, place(count - 1 - i)))));
        let mut s: [LaneGroup; MOST_STATES] =
            group(&work.state, (g, stride), self.of_forward.len());
        for k in 0..count {
            let y = self.step(&mut s, lanes(&work.rows, place(k)));
            put(&mut work.rows, place(k), &y);
        }
        for x in extension.iter_mut() {
            *x = self.step(&mut s, *x);
        }
        let mut r = self.settled(extension.last().copied().unwrap_or(last));
        for x in extension.iter().rev() {
            self.step(&mut r, *x);
        }
        for k in (0..count).rev() {
            let z = self.step(&mut r, lanes(&work.rows, place(k)));
            put(&mut work.rows, place(k), &z);
        }
        self.keep_state(work, (g, stride), &r);
    }

    /// Back over a stretch: z takes the place of its part.
    #[inline(always)]
    fn back(&self, work: &mut KeptWork, (g, stride): (usize, usize), at: usize) {
        let count = self.of_backward.len() + 1;
        let mut sums: [LaneGroup; MOST_STATES + 1] = group(&work.parts[at..], (g, stride), count);
        for (m, weights) in self.of_backward.iter().enumerate() {
            let r = lanes(&work.state, m * stride + g * GROUP);
            for (sum, w) in sums.iter_mut().zip(weights) {
                add(sum, *w, &r);
            }
        }
        put(&mut work.parts, at + g * GROUP, &sums[0]);
        self.keep_state(work, (g, stride), &sums[1..]);
    }

    #[inline(always)]
    fn keep_state(&self, work: &mut KeptWork, (g, stride): (usize, usize), state: &[LaneGroup]) {
        for (m, s) in state[..self.of_forward.len()].iter().enumerate() {
            put(&mut work.state, m * stride + g * GROUP, s);
        }
    }

    #[inline(always)]
    fn settled(&self, x: LaneGroup) -> [LaneGroup; MOST_STATES] {
        let steady = self.filter.steady().iter().flatten();
        let mut state = [ZERO; MOST_STATES];
        for (s, steady) in state.iter_mut().zip(steady) {
            *s = x.map(|x| steady * x);
        }
        state
    }

    #[inline(always)]
    fn step(&self, state: &mut [LaneGroup; MOST_STATES], mut x: LaneGroup) -> LaneGroup {
        let sections = self.filter.sos().sections().iter();
        for (section, s) in sections.zip(state.chunks_exact_mut(2)) {
            let (b, a) = (section.b, section.a);
            for l in 0..GROUP {
                let y = b[0] * x[l] + s[0][l];
                s[0][l] = b[1] * x[l] + s[1][l] - a[0] * y;
                s[1][l] = b[2] * x[l] - a[1] * y;
                x[l] = y;
            }
        }
        x
    }
}

/// Most numbers of a state: those of order 16.
const MOST_STATES: usize = 16;
const MOST_SUMS: usize = (2 * MOST_STATES + 1).next_multiple_of(TOGETHER);

impl KeptWork {
    /// The row that its first one is, where `next` comes behind its last.
    fn rows_from(&self, next: usize, stride: usize) -> usize {
        next - self.rows.len() / stride
    }
}

struct Rows<'a> {
    stride: usize,
    channels: usize,
    /// The row that is made next.
    next: usize,
    fill: &'a mut dyn FnMut(usize, &mut [f64]),
}

impl Rows<'_> {
    /// Makes the rows of a span that are not yet there; `into` ends with the last one made.
    fn read(&mut self, into: &mut Vec<f64>, span: std::ops::Range<usize>) {
        while self.next < span.end {
            let at = into.len();
            into.resize(at + self.stride, 0.0);
            (self.fill)(self.next, &mut into[at..at + self.channels]);
            self.next += 1;
        }
    }
}

/// A part of the run of both passes: its two ends, and what lies between outputs that are kept.
#[derive(Clone, Copy)]
enum StretchPart {
    /// So many rows are no stretch.
    Begin(usize),
    /// Where z and r' go, if they are asked for.
    Stretch(Option<usize>),
    End,
    /// Where z and r' are.
    Back(usize),
}

struct PartOf<'a> {
    of: &'a KeptEvery,
    part: StretchPart,
    work: &'a mut KeptWork,
    stride: usize,
}

impl LaneWork for PartOf<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self {
            of,
            part,
            work,
            stride,
        } = self;
        if let StretchPart::Stretch(Some(to)) = part {
            work.parts
                .resize(to + (of.of_forward.len() + 1) * stride, 0.0);
        }
        let mut extension = Vec::new();
        for g in 0..stride / GROUP {
            let mut own = work.rows.chunks_exact(stride);
            let zero = |row: &[f64]| row[g * GROUP..(g + 1) * GROUP].iter().all(|x| *x == 0.0);
            let seen = !matches!(part, StretchPart::Back(_));
            work.empty[g] = work.empty[g] && !(seen && own.any(|row| !zero(row)));
            if work.empty[g] {
                continue;
            }
            let at = (g, stride);
            match part {
                StretchPart::Begin(count) => of.begin(work, at, count),
                StretchPart::Stretch(to) => of.stretch(work, at, to),
                StretchPart::End => of.end(work, at, &mut extension),
                StretchPart::Back(from) => of.back(work, at, from),
            }
        }
    }
}

/// Sums of rows `stride` numbers apart in the weights k, k + 1 .. of each.
#[inline(always)]
fn sums_of(
    rows: &[f64],
    stride: usize,
    weights: &[f64],
    (width, k): (usize, usize),
) -> [LaneGroup; TOGETHER] {
    let mut sums = [ZERO; TOGETHER];
    for (row, weights) in rows.chunks(stride).zip(weights.chunks_exact(width)) {
        let x = lanes(row, 0);
        for (sum, w) in sums
            .iter_mut()
            .zip(&weights[k * TOGETHER..(k + 1) * TOGETHER])
        {
            add(sum, *w, &x);
        }
    }
    sums
}

#[inline(always)]
fn lanes(of: &[f64], at: usize) -> LaneGroup {
    let mut out = ZERO;
    out.copy_from_slice(&of[at..at + GROUP]);
    out
}

/// A group's channels of each of `count` rows, and zeros for those that are not there.
#[inline(always)]
fn group<const N: usize>(of: &[f64], (g, stride): (usize, usize), count: usize) -> [LaneGroup; N] {
    std::array::from_fn(|m| match m < count {
        true => lanes(of, m * stride + g * GROUP),
        false => ZERO,
    })
}

#[inline(always)]
fn put(to: &mut [f64], at: usize, x: &LaneGroup) {
    to[at..at + GROUP].copy_from_slice(x);
}

#[inline(always)]
fn add(to: &mut LaneGroup, w: f64, x: &LaneGroup) {
    for (to, x) in to.iter_mut().zip(x) {
        *to += w * x;
    }
}

/// 2 end - x.
#[inline(always)]
fn reflected(end: LaneGroup, x: LaneGroup) -> LaneGroup {
    std::array::from_fn(|l| 2.0 * end[l] - x[l])
}

/// One sample through a cascade, transposed direct form II.
fn one_step(sections: &[Section], state: &mut [f64], mut x: f64) -> f64 {
    for (Section { b, a }, s) in sections.iter().zip(state.chunks_exact_mut(2)) {
        let y = b[0] * x + s[0];
        s[0] = b[1] * x + s[1] - a[0] * y;
        s[1] = b[2] * x - a[1] * y;
        x = y;
    }
    x
}

#[cfg(test)]
mod tests;
