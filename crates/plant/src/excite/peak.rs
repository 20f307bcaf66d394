//! The highest value of a function between samples.

/// Where a function is highest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FunctionPeak {
    /// Argument of the highest value found.
    pub t: f64,
    /// That value.
    pub value: f64,
    /// What the function does not exceed anywhere on the interval.
    pub bound: f64,
}

/// Narrowest part that is still halved, as a share of the whole interval.
const MIN_WIDTH_SHARE: f64 = 1e-9;

/// Highest value of `f` on `[from, to]` from its values at the ends of equal parts, by halving those parts that could
/// hold a higher one, until they could exceed it by `tolerance` at most.
///
/// Between two samples h apart a function exceeds the larger by h^2/8 times the most of its second
/// derivative. With that number given (`curvature`) the bound is certain; without, the second
/// difference at the part's middle estimates it, 16 times as large as a parabola would need,
/// and the first parts must be fine enough to meet every bend.
pub(super) fn highest(
    f: &mut dyn FnMut(f64) -> f64,
    [from, to]: [f64; 2],
    samples: &[f64],
    curvature: Option<f64>,
    tolerance: f64,
) -> FunctionPeak {
    let pieces = samples.len().saturating_sub(1).max(1);
    let h = (to - from) / pieces as f64;
    let at = |k: usize| from + (to - from) * k as f64 / pieces as f64;
    let mut peak = FunctionPeak {
        t: from,
        value: f64::NEG_INFINITY,
        bound: f64::NEG_INFINITY,
    };
    let see = |peak: &mut FunctionPeak, t: f64, value: f64| {
        // a value that is not a number counts as beyond everything
        let value = if value.is_nan() { f64::INFINITY } else { value };
        if value > peak.value {
            (peak.t, peak.value) = (t, value);
        }
    };
    for (k, value) in samples.iter().enumerate() {
        see(&mut peak, at(k), *value);
    }
    if peak.value == f64::INFINITY {
        peak.bound = f64::INFINITY;
        return peak;
    }
    let parts = samples.windows(2).enumerate();
    let parts = parts.map(|(k, pair)| (at(k), at(k + 1), pair[0], pair[1]));
    let mut open: Vec<(f64, f64, f64, f64)> = parts.collect();
    while let Some((a, b, left, right)) = open.pop() {
        let top = left.max(right);
        if let Some(most) = curvature {
            let bound = top + most * (b - a) * (b - a) / 8.0;
            if bound <= peak.value + tolerance || b - a < MIN_WIDTH_SHARE * h {
                peak.bound = peak.bound.max(bound);
                continue;
            }
        }
        let t = 0.5 * (a + b);
        let middle = f(t);
        see(&mut peak, t, middle);
        if peak.value == f64::INFINITY {
            break;
        }
        if curvature.is_none() {
            let bend = (left - 2.0 * middle + right).abs();
            let bound = top.max(middle) + 2.0 * bend;
            if bound <= peak.value + tolerance {
                peak.bound = peak.bound.max(bound);
                continue;
            }
            // a step, such as that of Coulomb friction: its bend never ends, its two sides are seen
            if b - a < MIN_WIDTH_SHARE * h {
                continue;
            }
        }
        open.push((a, t, left, middle));
        open.push((t, b, middle, right));
    }
    peak.bound = peak.bound.max(peak.value);
    peak
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bent(t: f64) -> f64 {
        (3.0 * t).sin() + 0.4 * (7.0 * t + 0.3).cos() - 0.2 * (11.0 * t).sin()
    }

    /// From samples at the ends of equal parts.
    fn highest(
        f: &mut dyn FnMut(f64) -> f64,
        span: [f64; 2],
        parts: u32,
        curvature: Option<f64>,
    ) -> FunctionPeak {
        let at = |k: u32| span[0] + (span[1] - span[0]) * f64::from(k) / f64::from(parts);
        let samples: Vec<f64> = (0..=parts).map(|k| f(at(k))).collect();
        super::highest(f, span, &samples, curvature, 1e-9)
    }

    #[test]
    fn peaks_between_samples_are_found_and_bounded() {
        let most = 9.0 + 0.4 * 49.0 + 0.2 * 121.0;
        let fine = (0..=2_000_000).map(|k| bent(3e-6 * f64::from(k)));
        let exact = fine.fold(f64::NEG_INFINITY, f64::max);
        for curvature in [Some(most), None] {
            let mut count = 0;
            let mut counted = |t| {
                count += 1;
                bent(t)
            };
            let peak = highest(&mut counted, [0.0, 6.0], 64, curvature);
            assert!((peak.value - exact).abs() < 1e-9, "{peak:?} {exact}");
            assert!(peak.bound >= exact && peak.bound < exact + 2e-9);
            assert_eq!(bent(peak.t), peak.value);
            assert!(count < 2000, "{count}");
        }
    }

    #[test]
    fn a_step_ends_and_a_value_that_is_not_a_number_is_beyond_every_limit() {
        let mut step = |t: f64| if t < 0.3333 { 0.0 } else { 1.0 };
        let peak = highest(&mut step, [0.0, 1.0], 10, None);
        assert_eq!((peak.value, peak.bound), (1.0, 1.0));
        let mut fall = |t: f64| if t < 0.3333 { t } else { -1.0 };
        let peak = highest(&mut fall, [0.0, 1.0], 10, None);
        assert!((peak.value - 0.3333).abs() < 1e-9 && (peak.bound - 0.3333).abs() < 1e-8);
        let mut gap = |t: f64| {
            if (0.7..0.8).contains(&t) {
                f64::NAN
            } else {
                0.0
            }
        };
        let peak = highest(&mut gap, [0.0, 1.0], 40, None);
        assert_eq!((peak.value, peak.bound), (f64::INFINITY, f64::INFINITY));
    }
}
