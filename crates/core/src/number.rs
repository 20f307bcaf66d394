//! Numbers as a person reads them: as many digits as they deserve. And how large one may be that a file
//! or the command line gives.

/// What stands for a number that is not there.
pub const ABSENT: &str = "-";

/// Largest magnitude of a number that is given, in whatever unit: far beyond every quantity of a machine
/// (nanoseconds since 1970 are 2e18), and small enough that products of ten of them are still numbers.
pub const LARGEST: f64 = 1e30;

/// Smallest of a number that is given and must be above 0: one over it is usable too.
pub const SMALLEST: f64 = 1e-30;

/// Lengths below so many metres are reported in millimetres.
pub const MILLIMETRES: f64 = 0.01;

/// Whether a number that is given can be worked with: neither inf nor nan, nor beyond [`LARGEST`].
#[inline]
pub fn is_usable(value: f64) -> bool {
    // false for nan too
    value.abs() <= LARGEST
}

/// What is wrong with a number that [`is_usable`] refuses, to be reported behind it.
pub fn beyond(value: f64) -> &'static str {
    match value.is_finite() {
        true => ", beyond 1e30 in SI units",
        false => "",
    }
}

/// `value` with `digits` significant digits, `1.23e-7` style where zeros would pile up.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return ABSENT.into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = digits.max(1) as i32;
    let exponent = exponent_after_rounding(value, digits);
    if (-4..6.max(digits)).contains(&exponent) {
        let decimals = (digits - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.*e}", (digits - 1) as usize)
    }
}

/// A time \[s\] to the millisecond; `1.235e12` where its digits would fill a line.
pub fn clock(seconds: f64) -> String {
    match seconds.abs() < 1e12 {
        true => format!("{seconds:.3}"),
        false => significant(seconds, 4),
    }
}

/// Value and standard deviation as two texts: the deviation with two significant digits, the value
/// down to the same place. Without a usable deviation the value has five digits.
pub fn value_and_std(value: f64, std: f64) -> (String, String) {
    if !std.is_finite() || std <= 0.0 {
        let text = if std == 0.0 { "0" } else { ABSENT };
        return (significant(value, 5), text.into());
    }
    if !value.is_finite() {
        return (ABSENT.into(), significant(std, 2));
    }
    let last_place = exponent_after_rounding(std, 2) - 1;
    let largest = exponent_after_rounding(value, 5).max(last_place + 1);
    if last_place >= -7 && largest < 7 {
        let decimals = (-last_place).max(0) as usize;
        let value = format!("{value:.decimals$}");
        let value = match value.strip_prefix('-') {
            Some(rest) if rest.bytes().all(|c| c == b'0' || c == b'.') => rest.to_owned(),
            _ => value,
        };
        (value, format!("{std:.decimals$}"))
    } else {
        let digits = (exponent_after_rounding(value, 5) - last_place).clamp(1, 9) as usize;
        (format!("{value:.digits$e}"), format!("{std:.1e}"))
    }
}

/// `value ± std` in one text.
pub fn plus_minus(value: f64, std: f64) -> String {
    let (value, std) = value_and_std(value, std);
    format!("{value} ± {std}")
}

/// A fraction as percent with three significant digits: `0.0523` is `5.23 %`.
pub fn percent(fraction: f64) -> String {
    if fraction.is_finite() {
        format!("{} %", hundredths(fraction))
    } else {
        ABSENT.into()
    }
}

/// The same where the header of a column says `%`: `0.0523` is `5.23`.
/// Below a ten-thousandth it is `<0.0001`.
pub fn hundredths(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    match percent.abs() < 1e-4 && percent != 0.0 {
        true => "<0.0001".to_owned(),
        false => significant(percent, 3),
    }
}

/// Power of ten of the leading digit, once `value` is rounded to `digits` digits.
fn exponent_after_rounding(value: f64, digits: i32) -> i32 {
    if value == 0.0 {
        return 0;
    }
    // The formatter rounds as the output will: 9.996 with three digits leads with 1.00e1.
    let text = format!("{value:.*e}", (digits - 1) as usize);
    text.rsplit_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_milliseconds_and_never_a_line_of_digits() {
        assert_eq!(clock(12.3456), "12.346");
        assert_eq!(clock(1.7e9), "1700000000.000");
        assert_eq!(clock(1e29), "1.000e29");
    }

    #[test]
    fn significant_digits_survive_rounding_up_a_decade() {
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(0.000123456, 3), "0.000123");
        assert_eq!(significant(0.0000123456, 3), "1.23e-5");
        assert_eq!(significant(-1234.56, 3), "-1235");
        assert_eq!(significant(1.5e9, 3), "1.50e9");
        assert_eq!(significant(0.0, 4), "0");
        assert_eq!(significant(f64::NAN, 4), "-");
    }

    #[test]
    fn the_deviation_decides_where_the_value_ends() {
        let pair = |value, std| {
            let (value, std) = value_and_std(value, std);
            format!("{value} {std}")
        };
        assert_eq!(pair(95.10891, 0.0412), "95.109 0.041");
        assert_eq!(pair(95.10891, 0.0996), "95.11 0.10");
        assert_eq!(pair(-0.0004, 0.31), "0.00 0.31");
        assert_eq!(pair(1234.6, 220.0), "1235 220");
        assert_eq!(pair(1.23456e-6, 4.0e-9), "1.2346e-6 4.0e-9");
        assert_eq!(pair(2.0, f64::NAN), "2.0000 -");
        assert_eq!(pair(2.0, 0.0), "2.0000 0");
        assert_eq!(pair(f64::NAN, 0.5), "- 0.50");
    }

    #[test]
    fn fractions_are_shown_as_percent() {
        assert_eq!(percent(0.00523), "0.523 %");
        assert_eq!(percent(1.0), "100 %");
        assert_eq!(percent(2.83e-7), "<0.0001 %");
        assert_eq!(percent(0.0), "0 %");
        assert_eq!(percent(f64::INFINITY), "-");
        assert_eq!(plus_minus(13.5, 0.25), "13.50 ± 0.25");
    }
}
