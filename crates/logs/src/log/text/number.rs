//! Decimal numbers from bytes.

/// The nearest f64 to a number, NaN and infinities included, spaces and one pair of quotes around it passed over.
#[inline]
pub(super) fn parse(field: &[u8]) -> Option<f64> {
    fast_float2::parse(field)
        .ok()
        .or_else(|| parse_quoted(field))
}

#[cold]
fn parse_quoted(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?.trim();
    let text = text
        .strip_prefix('"')
        .and_then(|inner| inner.strip_suffix('"'))
        .unwrap_or(text);
    fast_float2::parse(text.trim()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_in_every_spelling_equal_the_standard_library() {
        let spellings = "0 -0 +1.5 1. .5 -.5e3 1e22 1e23 1e-22 1e999 1e+5 1E5 NaN inf 9007199254740993 \
            123456789012345678901234567890 2.2250738585072014e-308 4.9e-324 1.7976931348623157e308 \
            7.67021588343e-06 0.30000000000000004 99999999999999999999e-20 0.000000000000000000000000001";
        for text in spellings.split_whitespace() {
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
