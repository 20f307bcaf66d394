//! A section cascade run forward and backward over interleaved channels: no phase shift, squared
//! gain.
//!
//! The ends are those of `scipy.signal.sosfiltfilt`: the signal is extended oddly about its first
//! and last sample (Gustafsson 1996 discusses the choice), and each pass starts in the steady
//! state of its first value.

use super::MathError;
use super::lanes::{LaneWork, Simd, widest};
use super::sos::{SosFilter, steady};

/// Sections of the highest order that [`SosFilter`] offers.
const MAX_SECTIONS: usize = 8;

/// Zero-phase filter with its start states.
#[derive(Debug, Clone)]
pub struct ZeroPhase {
    sos: SosFilter,
    /// State of each section after a long constant input of 1 to the cascade.
    steady: Vec<[f64; 2]>,
}

impl ZeroPhase {
    /// Prepares a cascade for forward-backward filtering.
    pub fn new(sos: SosFilter) -> Self {
        let steady = steady(sos.sections());
        Self { sos, steady }
    }

    pub fn sos(&self) -> &SosFilter {
        &self.sos
    }

    /// State of each section after a long constant input of 1 to the cascade.
    pub(super) fn steady(&self) -> &[[f64; 2]] {
        &self.steady
    }

    /// Filters `data`, `samples x channels` row-major, in place.
    ///
    /// # Errors
    /// [`MathError::TooShort`] unless there are more samples than [`SosFilter::pad_samples`].
    pub fn run(&self, data: &mut [f64], channels: usize) -> Result<(), MathError> {
        run_each(|_| self, data, channels)
    }
}

/// Filters `data`, `samples x channels` row-major, in place, each channel by its own filter. All filters are of
/// one design and order: they differ in their cut-offs.
///
/// # Errors
/// [`MathError::TooShort`] unless there are more samples than [`SosFilter::pad_samples`].
pub fn run_each<'a>(
    filter: impl Fn(usize) -> &'a ZeroPhase,
    data: &mut [f64],
    channels: usize,
) -> Result<(), MathError> {
    if channels == 0 {
        return Ok(());
    }
    let samples = data.len() / channels;
    let pad = filter(0).sos.pad_samples();
    if samples <= pad {
        return Err(MathError::TooShort {
            samples,
            needed: pad,
        });
    }
    widest(FilterPasses {
        filter: &filter as &dyn Fn(usize) -> &'a ZeroPhase,
        data,
        channels,
    });
    Ok(())
}

/// Vectors that go through a filter side by side: the recursion of one waits for its sums while the other's are formed.
const VECTORS: usize = 2;
/// Lanes of the widest of them.
const MOST_LANES: usize = 8 * VECTORS;

/// Both passes over all channels.
struct FilterPasses<'a, 'f> {
    filter: &'a dyn Fn(usize) -> &'f ZeroPhase,
    data: &'a mut [f64],
    channels: usize,
}

impl LaneWork for FilterPasses<'_, '_> {
    type Output = ();

    // A pass takes as long as its recursion, whether a lane is empty or not: few passes are fast.
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let whole = VECTORS * S::F64_LANES;
        let sections = (self.filter)(0).sos.sections().len();
        for first in (0..self.channels).step_by(whole) {
            let width = whole.min(self.channels - first);
            let lanes = ChannelLanes {
                simd,
                filter: self.filter,
                channels: self.channels,
                first,
                width,
            };
            // states whose number is known stay in registers
            match (width == whole, sections) {
                (true, 2) => lanes.both::<2, true>(self.data),
                (true, 4) => lanes.both::<4, true>(self.data),
                (true, _) => lanes.both::<MAX_SECTIONS, true>(self.data),
                (false, 2) => lanes.both::<2, false>(self.data),
                (false, _) => lanes.both::<MAX_SECTIONS, false>(self.data),
            }
        }
    }
}

/// One number of each channel that is filtered at once.
type ChannelVectors<S> = [<S as Simd>::f64s; VECTORS];

/// The channels `first..first + width`.
#[derive(Clone, Copy)]
struct ChannelLanes<'a, 'f, S> {
    simd: S,
    filter: &'a dyn Fn(usize) -> &'f ZeroPhase,
    channels: usize,
    first: usize,
    width: usize,
}

impl<S: Simd> ChannelLanes<'_, '_, S> {
    /// Both passes with at most N sections; `FULL` where every lane has a channel.
    #[inline(always)]
    fn both<const N: usize, const FULL: bool>(self, data: &mut [f64]) {
        let like = (self.filter)(self.first);
        let pad = like.sos.pad_samples();
        let last = data.len() / self.channels - 1;
        let own = self.first..self.first + self.width;
        let at = |data: &[f64], i: usize| {
            let row = &data[i * self.channels..(i + 1) * self.channels];
            self.read::<FULL>(&row[own.clone()])
        };

        // The forward pass overwrites what the extension of the far end mirrors.
        let end = at(data, last);
        let tail = (1..=pad).map(|i| self.reflected(end, at(data, last - i)));
        let mut tail: Vec<ChannelVectors<S>> = tail.collect();

        let start = at(data, 0);
        let sections: [Section<S>; N] = self.sections();
        let sections = &sections[..like.sos.sections().len()];
        let mut cascade = SectionCascade::<S, N>::settled(
            self.simd,
            sections,
            self.reflected(start, at(data, pad)),
        );
        for i in (1..=pad).rev() {
            cascade.step(self.reflected(start, at(data, i)));
        }
        for row in data.chunks_exact_mut(self.channels) {
            let sample = &mut row[own.clone()];
            let y = cascade.step(self.read::<FULL>(sample));
            self.write::<FULL>(sample, y);
        }
        for x in &mut tail {
            *x = cascade.step(*x);
        }

        let from = tail.last().copied().unwrap_or(end);
        let mut cascade = SectionCascade::<S, N>::settled(self.simd, sections, from);
        for x in tail.iter().rev() {
            cascade.step(*x);
        }
        for row in data.chunks_exact_mut(self.channels).rev() {
            let sample = &mut row[own.clone()];
            let y = cascade.step(self.read::<FULL>(sample));
            self.write::<FULL>(sample, y);
        }
    }

    #[inline(always)]
    fn read<const FULL: bool>(self, sample: &[f64]) -> ChannelVectors<S> {
        if FULL {
            let (vectors, _) = S::as_simd_f64s(sample);
            return std::array::from_fn(|m| vectors[m]);
        }
        std::array::from_fn(|m| {
            let from = (m * S::F64_LANES).min(sample.len());
            self.simd.partial_load_f64s(&sample[from..])
        })
    }

    #[inline(always)]
    fn write<const FULL: bool>(self, sample: &mut [f64], values: ChannelVectors<S>) {
        if FULL {
            let (vectors, _) = S::as_mut_simd_f64s(sample);
            vectors.copy_from_slice(&values);
            return;
        }
        for (m, values) in values.into_iter().enumerate() {
            let from = (m * S::F64_LANES).min(sample.len());
            self.simd.partial_store_f64s(&mut sample[from..], values);
        }
    }

    /// 2 end - x.
    #[inline(always)]
    fn reflected(self, end: ChannelVectors<S>, x: ChannelVectors<S>) -> ChannelVectors<S> {
        let two = self.simd.splat_f64s(2.0);
        std::array::from_fn(|m| self.simd.sub_f64s(self.simd.mul_f64s(two, end[m]), x[m]))
    }

    /// A number of each channel.
    #[inline(always)]
    fn each(self, of: impl Fn(&ZeroPhase) -> f64) -> ChannelVectors<S> {
        let mut numbers = [0.0; MOST_LANES];
        for (l, number) in numbers[..self.width].iter_mut().enumerate() {
            *number = of((self.filter)(self.first + l));
        }
        self.read::<false>(&numbers[..VECTORS * S::F64_LANES])
    }

    /// The sections of the channels' filters, section by section; behind the last they are empty.
    #[inline(always)]
    fn sections<const N: usize>(self) -> [Section<S>; N] {
        let count = (self.filter)(self.first).sos.sections().len();
        std::array::from_fn(|k| {
            let number = |of: &dyn Fn(&ZeroPhase) -> f64| {
                self.each(|filter| if k < count { of(filter) } else { 0.0 })
            };
            Section {
                b: std::array::from_fn(|m| number(&|filter| filter.sos.sections()[k].b[m])),
                a: std::array::from_fn(|m| number(&|filter| filter.sos.sections()[k].a[m])),
                steady: std::array::from_fn(|m| number(&|filter| filter.steady[k][m])),
            }
        })
    }
}

/// One section of the filters of all lanes.
#[derive(Clone, Copy)]
struct Section<S: Simd> {
    b: [ChannelVectors<S>; 3],
    a: [ChannelVectors<S>; 2],
    steady: [ChannelVectors<S>; 2],
}

/// Running state of cascades of at most N sections, transposed direct form II.
struct SectionCascade<'a, S: Simd, const N: usize> {
    simd: S,
    sections: &'a [Section<S>],
    state: [[ChannelVectors<S>; 2]; N],
}

impl<'a, S: Simd, const N: usize> SectionCascade<'a, S, N> {
    /// The state after a long constant input `x`.
    #[inline(always)]
    fn settled(simd: S, sections: &'a [Section<S>], x: ChannelVectors<S>) -> Self {
        let mut state = [[[simd.splat_f64s(0.0); VECTORS]; 2]; N];
        for (state, section) in state.iter_mut().zip(sections) {
            *state = section
                .steady
                .map(|s| std::array::from_fn(|m| simd.mul_f64s(s[m], x[m])));
        }
        Self {
            simd,
            sections,
            state,
        }
    }

    #[inline(always)]
    fn step(&mut self, mut x: ChannelVectors<S>) -> ChannelVectors<S> {
        let simd = self.simd;
        for (Section { b, a, .. }, [s1, s2]) in self.sections.iter().zip(&mut self.state) {
            for m in 0..VECTORS {
                let of = |number: &ChannelVectors<S>, x: S::f64s| simd.mul_f64s(number[m], x);
                let y = simd.add_f64s(of(&b[0], x[m]), s1[m]);
                let next = simd.add_f64s(of(&b[1], x[m]), s2[m]);
                s1[m] = simd.sub_f64s(next, of(&a[0], y));
                s2[m] = simd.sub_f64s(of(&b[2], x[m]), of(&a[1], y));
                x[m] = y;
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Deserialize)]
    struct Oracle {
        rate_hz: f64,
        cases: Vec<OracleCase>,
    }

    #[derive(Deserialize)]
    struct OracleCase {
        kind: String,
        order: usize,
        ripple_db: Option<f64>,
        cutoff_hz: f64,
        pad_samples: usize,
        time_constant_samples: f64,
        frequencies_hz: Vec<f64>,
        gains: Vec<f64>,
        input: Vec<f64>,
        output: Vec<f64>,
    }

    impl OracleCase {
        fn filter(&self, rate_hz: f64) -> ZeroPhase {
            let sos = match self.ripple_db {
                Some(ripple) => SosFilter::chebyshev(self.order, ripple, self.cutoff_hz, rate_hz),
                None => SosFilter::butterworth(self.order, self.cutoff_hz, rate_hz),
            };
            ZeroPhase::new(sos.expect("a valid design"))
        }

        fn name(&self) -> String {
            format!("{} {} at {} Hz", self.kind, self.order, self.cutoff_hz)
        }
    }

    fn oracle() -> Oracle {
        let text = include_str!("../../../../fixtures/oracle/filters.json");
        serde_json::from_str(text).expect("the oracle file is valid")
    }

    #[test]
    fn filtering_gains_padding_and_time_constants_equal_scipy() {
        let Oracle { rate_hz, cases } = oracle();
        assert_eq!(cases.len(), 11);
        for case in cases {
            let filter = case.filter(rate_hz);
            let mut data = case.input.clone();
            filter.run(&mut data, 1).expect("long enough");
            let worst = data
                .iter()
                .zip(&case.output)
                .map(|(x, y)| (x - y).abs())
                .fold(0.0, f64::max);
            assert!(worst < 1e-10, "{}: {worst:e}", case.name());
            let sos = filter.sos();
            assert_eq!(sos.pad_samples(), case.pad_samples, "{}", case.name());
            let tau = case.time_constant_samples;
            assert!(
                (sos.time_constant() - tau).abs() < 1e-9 * tau,
                "{}",
                case.name()
            );
            for (&f, &gain) in case.frequencies_hz.iter().zip(&case.gains) {
                let error = (sos.gain(f, rate_hz) - gain).abs();
                assert!(error < 1e-10, "{} at {f} Hz: {error:e}", case.name());
            }
        }
    }

    #[test]
    fn channels_do_not_touch_each_other_and_may_have_cut_offs_of_their_own() {
        let value = |i: usize, c: usize| ((i * (c + 3)) as f64 * 0.05).sin() + c as f64;
        for order in [4, 5] {
            let filters: Vec<ZeroPhase> = (0..19)
                .map(|c| {
                    SosFilter::butterworth(order, 10.0 + 7.0 * c as f64, 1000.0).expect("valid")
                })
                .map(ZeroPhase::new)
                .collect();
            for channels in 1..=19 {
                let mut together: Vec<f64> = (0..90 * channels)
                    .map(|k| value(k / channels, k % channels))
                    .collect();
                run_each(|c| &filters[c], &mut together, channels).expect("long enough");
                for (c, filter) in filters[..channels].iter().enumerate() {
                    let mut alone: Vec<f64> = (0..90).map(|i| value(i, c)).collect();
                    filter.run(&mut alone, 1).expect("long enough");
                    let own = together.iter().skip(c).step_by(channels);
                    assert!(own.eq(&alone), "{order}, {channels}, {c}");
                }
            }
        }
    }

    #[test]
    fn a_straight_line_passes_unchanged() {
        let filter = ZeroPhase::new(SosFilter::butterworth(4, 20.0, 1000.0).expect("valid"));
        let line: Vec<f64> = (0..2000).map(|i| 3.0 - 0.01 * i as f64).collect();
        let mut data = line.clone();
        filter.run(&mut data, 1).expect("long enough");
        // Far from the ends: there the odd extension of 15 samples is short of the memory.
        for i in 800..1200 {
            assert!((data[i] - line[i]).abs() < 1e-9, "{i}");
        }
    }

    #[test]
    fn a_signal_shorter_than_its_extension_is_refused() {
        let filter = ZeroPhase::new(SosFilter::butterworth(4, 20.0, 1000.0).expect("valid"));
        let mut data = vec![1.0; 15];
        assert_eq!(
            filter.run(&mut data, 1),
            Err(MathError::TooShort {
                samples: 15,
                needed: 15
            })
        );
        assert!(filter.run(&mut [1.0; 16], 1).is_ok());
    }

    #[test]
    fn what_no_filter_can_do_is_an_error() {
        assert!(matches!(
            SosFilter::butterworth(0, 1.0, 100.0),
            Err(MathError::FilterOrder { order: 0 })
        ));
        assert!(SosFilter::butterworth(17, 1.0, 100.0).is_err());
        let message = SosFilter::butterworth(4, 60.0, 100.0)
            .expect_err("above Nyquist")
            .to_string();
        assert!(
            message.contains("more than 120 Hz, found 100 Hz"),
            "{message}"
        );
        assert!(SosFilter::butterworth(4, f64::NAN, 100.0).is_err());
        assert!(SosFilter::chebyshev(4, 0.0, 10.0, 100.0).is_err());
    }
}
