//! From data to px along one axis, and the numbers that stand at it.

use crate::report::encode::extent;

/// A linear map of a closed interval of data onto an interval of px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisScale {
    pub data: [f64; 2],
    px: [f64; 2],
}

impl AxisScale {
    /// An interval of the data (in order, both finite, not equal) onto `px_from..px_to`.
    pub fn new(data: [f64; 2], px_from: f64, px_to: f64) -> Self {
        let px = [px_from, px_to];
        AxisScale { data, px }
    }

    pub(crate) fn px(&self, value: f64) -> f64 {
        let ([from, to], [px_from, px_to]) = (self.data, self.px);
        px_from + (value - from) / (to - from) * (px_to - px_from)
    }
}

/// The same, widened by `margin` of itself on both sides; a single value gets an interval around it.
pub(super) fn interval(values: impl IntoIterator<Item = f64>, margin: f64) -> Option<[f64; 2]> {
    let [low, high] = extent(values)?;
    let size = low.abs().max(high.abs());
    if high - low <= 1e-12 * size || size == 0.0 {
        let half = if size == 0.0 { 1.0 } else { 0.1 * size };
        return Some([low - half, high + half]);
    }
    let room = margin * (high - low);
    Some([low - room, high + room])
}

/// The numbers at an axis: round, about `wanted` and three at least, with texts of equal precision.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AxisTicks {
    pub values: Vec<f64>,
    pub texts: Vec<String>,
    /// The texts are to be multiplied by ten to this power (a multiple of 3, mostly 0).
    pub power: i32,
}

impl AxisTicks {
    pub fn new([from, to]: [f64; 2], wanted: usize) -> Self {
        // Steps are counted as whole numbers, so that 3 * 0.1 stays 0.3.
        let counted = |step: f64| {
            let first = (from / step - 1e-9).ceil();
            let last = (to / step + 1e-9).floor();
            let count = (last - first + 1.0).clamp(0.0, 1000.0) as usize;
            (step, first, count)
        };
        let (step, first, count) = (0..4)
            .map(|halvings| (to - from) / wanted.max(2) as f64 / f64::from(1 << halvings))
            .map(|raw| counted(round_step(raw)))
            .find(|(_, _, count)| *count >= 3)
            .unwrap_or_else(|| counted(0.25 * (to - from)));
        let values = (0..count).map(|k| (first + k as f64) * step);
        let at_zero = |value: f64| value.abs() < 1e-9 * step;
        let values = values.map(|value| if at_zero(value) { 0.0 } else { value });
        let values: Vec<f64> = values.collect();
        let size = from.abs().max(to.abs());
        let leading = size.log10().floor();
        let power = match leading {
            -3.0..5.0 => 0,
            0.0.. => 3 * (leading / 3.0).floor() as i32,
            _ => 3 * ((leading + 1.0) / 3.0).floor() as i32,
        };
        let unit = 10f64.powi(power);
        let decimals = (-(step / unit).log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
        let texts = values
            .iter()
            .map(|value| format!("{:.decimals$}", value / unit).replace('-', "\u{2212}"))
            .collect();
        AxisTicks {
            values,
            texts,
            power,
        }
    }

    /// A unit with the power of ten that the texts leave out: `N`, `10³ N`.
    pub fn unit(&self, unit: &str) -> String {
        if self.power == 0 {
            return unit.to_owned();
        }
        let raised = |c: char| match c {
            '-' => '\u{207b}',
            '1' => '\u{b9}',
            '2' => '\u{b2}',
            '3' => '\u{b3}',
            c => char::from_u32(0x2070 + c.to_digit(10).unwrap_or(0)).unwrap_or(c),
        };
        let digits: String = self.power.to_string().chars().map(raised).collect();
        format!("10{digits} {unit}")
    }
}

/// The one of 1, 2, 5, 10 times a power of ten that is nearest to `raw` in proportion.
fn round_step(raw: f64) -> f64 {
    let decade = 10f64.powf(raw.log10().floor());
    let factor = match raw / decade {
        mantissa if mantissa < 2f64.sqrt() => 1.0,
        mantissa if mantissa < 10f64.sqrt() => 2.0,
        mantissa if mantissa < 50f64.sqrt() => 5.0,
        _ => 10.0,
    };
    factor * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        for (ends, wanted, texts) in [
            ([-0.31, 0.52], 5, "\u{2212}0.2 0.0 0.2 0.4"),
            ([0.0, 20.0], 5, "0 5 10 15 20"),
            ([0.0, 0.3], 3, "0.0 0.1 0.2 0.3"),
        ] {
            assert_eq!(AxisTicks::new(ends, wanted).texts.join(" "), texts);
        }
    }

    #[test]
    fn every_axis_has_three_numbers_and_few_more_than_wanted() {
        for k in 0..400 {
            let half = 1.013f64.powi(k) * 1e-3;
            for (wanted, most) in [(3, 7), (4, 8), (5, 9), (9, 15)] {
                for from in [-half, 0.4 * half] {
                    let count = AxisTicks::new([from, half], wanted).values.len();
                    assert!(
                        (3..=most).contains(&count),
                        "{from} {half} {wanted}: {count}"
                    );
                }
            }
        }
    }

    #[test]
    fn very_large_and_very_small_numbers_share_a_power_of_ten() {
        let ticks = AxisTicks::new([0.0, 250_000.0], 5);
        assert_eq!((ticks.power, ticks.texts[1].as_str()), (3, "50"));
        assert_eq!(ticks.unit("N"), "10\u{b3} N");
        let ticks = AxisTicks::new([-4e-6, 4e-6], 4);
        assert_eq!(ticks.texts, ["\u{2212}4", "\u{2212}2", "0", "2", "4"]);
        assert_eq!(ticks.unit("Nm"), "10\u{207b}\u{2076} Nm");
        let ticks = AxisTicks::new([-6e-4, 6e-4], 3);
        assert_eq!((ticks.power, ticks.texts[0].as_str()), (-3, "\u{2212}0.5"));
    }

    #[test]
    fn an_interval_ignores_what_is_not_finite_and_is_never_empty() {
        let values = [f64::NAN, 1.0, f64::INFINITY, 3.0, 1e308];
        assert_eq!(interval(values, 0.0), Some([1.0, 3.0]));
        assert_eq!(interval([0.0], 0.1), Some([-1.0, 1.0]));
        assert_eq!(interval([f64::NAN], 0.1), None);
        let [low, high] = interval([5.0, 5.0], 0.1).unwrap();
        assert!(low < 5.0 && high > 5.0);
    }
}
