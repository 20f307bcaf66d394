//! Words and numbers in a page: without markup, and whole numbers of 16 and 32 bits as text.

/// The code of a number that is none.
const GAP: i16 = i16::MIN;
const STEPS: f64 = 65534.0;

/// Base64 (RFC 4648, section 4).
pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let at = |k: usize| three.get(k).copied().map_or(0, u32::from);
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for k in 0..4 {
            let digit = (bits >> (18 - 6 * k)) & 63;
            out.push(match k <= three.len() {
                true => char::from(DIGITS[digit as usize]),
                false => '=',
            });
        }
    }
    out
}

/// Beyond this the width of an interval itself would overflow; no torque or time is there.
const LARGEST: f64 = 1e150;

/// From and to of the finite values; `None` where there are none.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    let drawable = values.into_iter().filter(|value| value.abs() < LARGEST);
    let ends = drawable.map(|value| [value, value]);
    ends.reduce(|[low, high], [value, _]| [low.min(value), high.max(value)])
}

/// Text of these characters that HTML and SVG may hold.
pub(super) fn without_markup(text: impl Iterator<Item = char>) -> String {
    let text: String = text.collect();
    let text = text.replace('&', "&amp;").replace('"', "&quot;");
    text.replace('<', "&lt;").replace('>', "&gt;")
}

/// Numbers in steps of a 65534th of their extent, in 16 bits each; and that extent.
pub(super) fn values(values: &[f64]) -> (String, [f64; 2]) {
    let ([from, to], scale) = steps(values, STEPS);
    let bytes = values.iter().flat_map(|v| {
        let whole = match v.abs() < LARGEST {
            true => ((v - from) * scale).round().clamp(0.0, STEPS) as i32 - 32767,
            false => i32::from(GAP),
        };
        (whole as i16).to_le_bytes()
    });
    (base64(&bytes.collect::<Vec<u8>>()), [from, to])
}

/// Times in steps of their extent over 2^32 - 1, in 32 bits each; and that extent.
pub(super) fn times(t: &[f64]) -> (String, [f64; 2]) {
    let most = f64::from(u32::MAX);
    let ([from, to], scale) = steps(t, most);
    let whole = |t: &f64| ((t - from) * scale).round().clamp(0.0, most) as u32;
    let bytes = t.iter().flat_map(|t| whole(t).to_le_bytes());
    (base64(&bytes.collect::<Vec<u8>>()), [from, to])
}

/// From and to of the finite numbers, `[0, 0]` where there is none, and how many of `steps` a unit has.
fn steps(values: &[f64], steps: f64) -> ([f64; 2], f64) {
    let [from, to] = extent(values.iter().copied()).unwrap_or([0.0, 0.0]);
    let scale = if to > from { steps / (to - from) } else { 0.0 };
    ([from, to], scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        let pairs: [(&[u8], &str); 5] = [
            (b"", ""),
            (b"f", "Zg=="),
            (b"fo", "Zm8="),
            (b"foobar", "Zm9vYmFy"),
            (&[0xfb, 0xff], "+/8="),
        ];
        for (plain, coded) in pairs {
            assert_eq!(base64(plain), coded);
        }
    }

    #[test]
    fn values_take_the_whole_range_and_a_gap_has_its_own() {
        // -32767, -32768, 32767, 0 in little-endian order
        let coded = base64(&[1, 128, 0, 128, 255, 127, 0, 0]);
        assert_eq!(values(&[-2.0, f64::NAN, 2.0, 0.0]), (coded, [-2.0, 2.0]));
        assert_eq!(values(&[3.0]), (base64(&[1, 128]), [3.0, 3.0]));
        assert_eq!(values(&[f64::NAN]).1, [0.0, 0.0]);
    }
}
