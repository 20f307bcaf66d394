//! A section cascade run forward and backward over interleaved channels: no phase shift, squared
//! gain.
//!
//! The ends are those of `scipy.signal.sosfiltfilt`: the signal is extended oddly about its first
//! and last sample (Gustafsson 1996 discusses the choice), and each pass starts in the steady
//! state of its first value.

use super::MathError;
use super::lanes::widest;
use super::sos::Sos;

/// Sections of the highest order that [`Sos`] offers.
const MAX_SECTIONS: usize = 8;

/// Zero-phase filter with its start states.
#[derive(Debug, Clone)]
pub struct ZeroPhase {
    sos: Sos,
    /// State of each section after a long constant input of 1 to the cascade.
    steady: Vec<[f64; 2]>,
}

impl ZeroPhase {
    /// Prepares a cascade for forward-backward filtering.
    pub fn new(sos: Sos) -> Self {
        let mut gain = 1.0;
        let steady = sos
            .sections()
            .iter()
            .map(|section| {
                let state = section.steady_state().map(|s| s * gain);
                gain *= section.dc_gain();
                state
            })
            .collect();
        Self { sos, steady }
    }

    /// The cascade.
    pub fn sos(&self) -> &Sos {
        &self.sos
    }

    /// Filters `data`, `samples x channels` row-major, in place.
    ///
    /// # Errors
    /// [`MathError::TooShort`] unless there are more samples than [`Sos::pad_samples`].
    pub fn run(&self, data: &mut [f64], channels: usize) -> Result<(), MathError> {
        run_each(|_| self, data, channels)
    }
}

/// Filters `data`, `samples x channels` row-major, in place, each channel by its own filter. All filters are of
/// one design and order: they differ in their cut-offs.
///
/// # Errors
/// [`MathError::TooShort`] unless there are more samples than [`Sos::pad_samples`].
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
    // A pass takes as long as its recursion, whether a lane is empty or not: few passes are fast.
    let (filter, mut first) = (&filter as &dyn Fn(usize) -> &'a ZeroPhase, 0);
    while first < channels {
        let left = channels - first;
        match left {
            8.. => widest(|| run_lanes::<8, 8>(filter, data, channels, first)),
            7 => widest(|| run_lanes::<8, 7>(filter, data, channels, first)),
            6 => widest(|| run_lanes::<8, 6>(filter, data, channels, first)),
            5 => widest(|| run_lanes::<8, 5>(filter, data, channels, first)),
            4 => widest(|| run_lanes::<4, 4>(filter, data, channels, first)),
            3 => widest(|| run_lanes::<4, 3>(filter, data, channels, first)),
            2 => run_lanes::<2, 2>(filter, data, channels, first),
            _ => run_lanes::<1, 1>(filter, data, channels, first),
        }
        first += left.min(8);
    }
    Ok(())
}

/// Both passes over the channels `first..first + W`, in L lanes of which those behind W are empty.
#[inline(always)]
fn run_lanes<'a, const L: usize, const W: usize>(
    filter: &dyn Fn(usize) -> &'a ZeroPhase,
    data: &mut [f64],
    channels: usize,
    first: usize,
) {
    let filters: [&ZeroPhase; L] = std::array::from_fn(|l| filter(first + l.min(W - 1)));
    let samples = data.len() / channels;
    let pad = filters[0].sos.pad_samples();
    let last = samples - 1;
    let lanes = |data: &[f64], i: usize| -> [f64; L] {
        let at = i * channels + first;
        std::array::from_fn(|l| if l < W { data[at + l] } else { 0.0 })
    };
    let reflected =
        |end: [f64; L], x: [f64; L]| -> [f64; L] { std::array::from_fn(|l| 2.0 * end[l] - x[l]) };

    // The forward pass overwrites what the extension of the far end mirrors.
    let end = lanes(data, last);
    let mut tail: Vec<[f64; L]> = (1..=pad)
        .map(|i| reflected(end, lanes(data, last - i)))
        .collect();

    let start = lanes(data, 0);
    let sections = sections(&filters);
    let sections = &sections[..filters[0].sos.sections().len()];
    let mut cascade = Cascade::settled(sections, reflected(start, lanes(data, pad)));
    for i in (1..=pad).rev() {
        cascade.step(reflected(start, lanes(data, i)));
    }
    for sample in data.chunks_exact_mut(channels) {
        cascade.step_in_place::<W>(sample, first);
    }
    for x in &mut tail {
        *x = cascade.step(*x);
    }

    let mut cascade = Cascade::settled(sections, tail.last().copied().unwrap_or(end));
    for x in tail.iter().rev() {
        cascade.step(*x);
    }
    for sample in data.chunks_exact_mut(channels).rev() {
        cascade.step_in_place::<W>(sample, first);
    }
}

/// One section of L filters.
#[derive(Debug, Clone, Copy)]
struct LaneSection<const L: usize> {
    b: [[f64; L]; 3],
    a: [[f64; L]; 2],
    steady: [[f64; L]; 2],
}

/// The sections of L filters of one order, section by section; behind the last they are empty.
#[inline(always)]
fn sections<const L: usize>(filters: &[&ZeroPhase; L]) -> [LaneSection<L>; MAX_SECTIONS] {
    let empty = [0.0; L];
    let mut out = [LaneSection {
        b: [empty; 3],
        a: [empty; 2],
        steady: [empty; 2],
    }; MAX_SECTIONS];
    for (l, filter) in filters.iter().enumerate() {
        let own = filter.sos.sections().iter().zip(&filter.steady);
        for (lanes, (section, steady)) in out.iter_mut().zip(own) {
            for (lane, b) in lanes.b.iter_mut().zip(section.b) {
                lane[l] = b;
            }
            for (lane, a) in lanes.a.iter_mut().zip(section.a) {
                lane[l] = a;
            }
            for (lane, s) in lanes.steady.iter_mut().zip(steady) {
                lane[l] = *s;
            }
        }
    }
    out
}

/// Running state of L cascades, transposed direct form II.
struct Cascade<'a, const L: usize> {
    sections: &'a [LaneSection<L>],
    state: [[[f64; L]; 2]; MAX_SECTIONS],
}

impl<'a, const L: usize> Cascade<'a, L> {
    /// The state after a long constant input `x`.
    #[inline(always)]
    fn settled(sections: &'a [LaneSection<L>], x: [f64; L]) -> Self {
        let mut state = [[[0.0; L]; 2]; MAX_SECTIONS];
        for (state, section) in state.iter_mut().zip(sections) {
            *state = section.steady.map(|s| std::array::from_fn(|l| s[l] * x[l]));
        }
        Self { sections, state }
    }

    #[inline(always)]
    fn step(&mut self, mut x: [f64; L]) -> [f64; L] {
        for (section, [s1, s2]) in self.sections.iter().zip(&mut self.state) {
            let ([b0, b1, b2], [a1, a2]) = (&section.b, &section.a);
            for l in 0..L {
                let y = b0[l] * x[l] + s1[l];
                s1[l] = (b1[l] * x[l] + s2[l]) - a1[l] * y;
                s2[l] = b2[l] * x[l] - a2[l] * y;
                x[l] = y;
            }
        }
        x
    }

    #[inline(always)]
    fn step_in_place<const W: usize>(&mut self, sample: &mut [f64], first: usize) {
        let lanes = &mut sample[first..first + W];
        let y = self.step(std::array::from_fn(|l| if l < W { lanes[l] } else { 0.0 }));
        lanes.copy_from_slice(&y[..W]);
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
                Some(ripple) => Sos::chebyshev(self.order, ripple, self.cutoff_hz, rate_hz),
                None => Sos::butterworth(self.order, self.cutoff_hz, rate_hz),
            };
            ZeroPhase::new(sos.expect("a valid design"))
        }

        fn name(&self) -> String {
            format!("{} {} at {} Hz", self.kind, self.order, self.cutoff_hz)
        }
    }

    fn oracle() -> Oracle {
        let text = include_str!("../../fixtures/oracle/filters.json");
        serde_json::from_str(text).expect("the oracle file is valid")
    }

    #[test]
    fn forward_backward_filtering_equals_scipy() {
        let Oracle { rate_hz, cases } = oracle();
        assert_eq!(cases.len(), 11);
        for case in cases {
            let mut data = case.input.clone();
            case.filter(rate_hz).run(&mut data, 1).expect("long enough");
            let worst = data
                .iter()
                .zip(&case.output)
                .map(|(x, y)| (x - y).abs())
                .fold(0.0, f64::max);
            assert!(worst < 1e-10, "{}: {worst:e}", case.name());
        }
    }

    #[test]
    fn gains_padding_and_time_constants_equal_scipy() {
        let Oracle { rate_hz, cases } = oracle();
        for case in cases {
            let filter = case.filter(rate_hz);
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
    fn channels_do_not_touch_each_other() {
        let filter = ZeroPhase::new(Sos::butterworth(4, 20.0, 1000.0).expect("valid"));
        let samples = 90;
        let value = |i: usize, c: usize| ((i * (c + 3)) as f64 * 0.05).sin() + c as f64;
        for channels in 1..=19 {
            let mut together: Vec<f64> = (0..samples * channels)
                .map(|k| value(k / channels, k % channels))
                .collect();
            filter.run(&mut together, channels).expect("long enough");
            for c in 0..channels {
                let mut alone: Vec<f64> = (0..samples).map(|i| value(i, c)).collect();
                filter.run(&mut alone, 1).expect("long enough");
                for i in 0..samples {
                    assert_eq!(together[i * channels + c], alone[i], "{channels}, {c}, {i}");
                }
            }
        }
    }

    #[test]
    fn each_channel_may_have_a_cut_off_of_its_own() {
        let filters: Vec<ZeroPhase> = (0..11)
            .map(|c| Sos::butterworth(5, 10.0 + 7.0 * c as f64, 1000.0).expect("valid"))
            .map(ZeroPhase::new)
            .collect();
        let value = |i: usize, c: usize| ((i * (c + 3)) as f64 * 0.05).sin() + c as f64;
        for channels in 1..=11 {
            let mut together: Vec<f64> = (0..90 * channels)
                .map(|k| value(k / channels, k % channels))
                .collect();
            run_each(|c| &filters[c], &mut together, channels).expect("long enough");
            for (c, filter) in filters[..channels].iter().enumerate() {
                let mut alone: Vec<f64> = (0..90).map(|i| value(i, c)).collect();
                filter.run(&mut alone, 1).expect("long enough");
                let own = together.iter().skip(c).step_by(channels);
                assert!(own.eq(&alone), "{channels}, {c}");
            }
        }
    }

    #[test]
    fn a_straight_line_passes_unchanged() {
        let filter = ZeroPhase::new(Sos::butterworth(4, 20.0, 1000.0).expect("valid"));
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
        let filter = ZeroPhase::new(Sos::butterworth(4, 20.0, 1000.0).expect("valid"));
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
            Sos::butterworth(0, 1.0, 100.0),
            Err(MathError::FilterOrder { order: 0 })
        ));
        assert!(Sos::butterworth(17, 1.0, 100.0).is_err());
        let message = Sos::butterworth(4, 60.0, 100.0)
            .expect_err("above Nyquist")
            .to_string();
        assert!(
            message.contains("more than 120 Hz, found 100 Hz"),
            "{message}"
        );
        assert!(Sos::butterworth(4, f64::NAN, 100.0).is_err());
        assert!(Sos::chebyshev(4, 0.0, 10.0, 100.0).is_err());
    }
}
