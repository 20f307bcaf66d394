//! Decimal numbers from bytes: exact, and fast for the numbers that logs hold.

/// Powers of ten that an f64 holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// The nearest f64 to a decimal number; `None` where the field is no number.
///
/// Where mantissa and power of ten are both exact in f64, one correctly rounded operation gives the
/// nearest value (Clinger 1990); all else goes to the standard library. Spaces around the number
/// and one pair of quotes are passed over.
#[inline]
pub(super) fn parse(field: &[u8]) -> Option<f64> {
    // So long a number has more digits than f64 holds exactly: looking at them here is in vain.
    if field.len() > 18 {
        return parse_any(field);
    }
    let (negative, mut at) = match field.first() {
        Some(b'-') => (true, 1),
        Some(b'+') => (false, 1),
        _ => (false, 0),
    };
    let mut mantissa = 0u64;
    let whole = digits(field, &mut at, &mut mantissa);
    let mut fraction = 0;
    if field.get(at) == Some(&b'.') {
        at += 1;
        fraction = digits(field, &mut at, &mut mantissa);
    }
    // At most 18 bytes: the mantissa cannot overflow.
    if whole + fraction == 0 {
        return parse_any(field);
    }
    let mut power = -(fraction as i64);
    if let Some(b'e' | b'E') = field.get(at) {
        at += 1;
        let downwards = field.get(at) == Some(&b'-');
        if let Some(b'-' | b'+') = field.get(at) {
            at += 1;
        }
        let mut exponent = 0u64;
        let count = digits(field, &mut at, &mut exponent);
        if count == 0 || count > 4 {
            return parse_any(field);
        }
        power += if downwards {
            -(exponent as i64)
        } else {
            exponent as i64
        };
    }
    if at != field.len() || mantissa > (1 << 53) {
        return parse_any(field);
    }
    let Some(scale) = POWERS.get(power.unsigned_abs() as usize) else {
        return parse_any(field);
    };
    let magnitude = if power < 0 {
        mantissa as f64 / scale
    } else {
        mantissa as f64 * scale
    };
    Some(if negative { -magnitude } else { magnitude })
}

/// Adds the digits at `at` to `value`, moves on, and says how many there were.
#[inline]
fn digits(field: &[u8], at: &mut usize, value: &mut u64) -> usize {
    let start = *at;
    while let Some(byte) = field.get(*at) {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            break;
        }
        *value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
        *at += 1;
    }
    *at - start
}

/// Anything that the standard library takes for a number, NaN and infinities included.
fn parse_any(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?;
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    let text = text.trim();
    let text = text
        .strip_prefix('"')
        .and_then(|inner| inner.strip_suffix('"'))
        .unwrap_or(text);
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_in_every_spelling_equal_the_standard_library() {
        for text in [
            "0",
            "-0",
            "+1.5",
            "1.",
            ".5",
            "-.5e3",
            "1e22",
            "1e23",
            "1e-22",
            "9007199254740993",
            "123456789012345678901234567890",
            "2.2250738585072014e-308",
            "4.9e-324",
            "1.7976931348623157e308",
            "1e999",
            "7.67021588343e-06",
            "0.30000000000000004",
            "NaN",
            "inf",
            "99999999999999999999e-20",
            "1e+5",
            "1E5",
            "0.000000000000000000000000001",
        ] {
            let expected: f64 = text.parse().unwrap();
            let found = parse(text.as_bytes()).unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in [
            "", " ", "-", ".", "e5", "1e", "1e+", "1,5", "0x10", "1.2.3", "1 2", "abc", "1_000",
            "--1", "\"", "\"\"",
        ] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
        assert_eq!(parse(&[0xff, b'1']), None);
    }

    #[test]
    fn spaces_and_quotes_around_a_number_are_passed_over() {
        for text in [" 1.5", "1.5 ", "\t1.5", "\"1.5\"", "\" 1.5 \""] {
            assert_eq!(parse(text.as_bytes()), Some(1.5), "{text}");
        }
    }

    proptest! {
        #[test]
        fn every_finite_number_written_shortest_is_read_back_bit_for_bit(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            for text in [format!("{value:?}"), format!("{value:e}"), format!("{value}")] {
                prop_assert_eq!(parse(text.as_bytes()).map(f64::to_bits), Some(bits));
            }
        }

        #[test]
        fn random_decimal_text_equals_the_standard_library(text in "[-+]?[0-9]{0,25}\\.?[0-9]{0,25}([eE][-+]?[0-9]{0,6})?") {
            prop_assert_eq!(parse(text.as_bytes()).map(f64::to_bits), text.parse::<f64>().ok().map(f64::to_bits));
        }
    }
}
