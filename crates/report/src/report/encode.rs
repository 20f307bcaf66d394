//! Numbers in a page: whole numbers of 16 and 32 bits as text.

/// What stands for a number that is none.
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

/// From and to of the finite numbers; `[0, 0]` where there is none.
pub(super) fn extent(values: &[f64]) -> [f64; 2] {
    let finite = values.iter().copied().filter(|v| v.abs() < 1e150);
    let found = finite.fold(None, |found: Option<[f64; 2]>, v| {
        let [low, high] = found.unwrap_or([v, v]);
        Some([low.min(v), high.max(v)])
    });
    found.unwrap_or([0.0, 0.0])
}

/// Numbers in steps of a 65534th of their extent, in 16 bits each.
pub(super) fn values(values: &[f64], [from, to]: [f64; 2]) -> String {
    let scale = if to > from { STEPS / (to - from) } else { 0.0 };
    let bytes: Vec<u8> = values
        .iter()
        .flat_map(|v| {
            let whole = match v.abs() < 1e150 {
                true => ((v - from) * scale).round().clamp(0.0, STEPS) as i32 - 32767,
                false => i32::from(GAP),
            };
            (whole as i16).to_le_bytes()
        })
        .collect();
    base64(&bytes)
}

/// Times in steps of their extent over 2^32 - 1, in 32 bits each.
pub(super) fn times(t: &[f64], [from, to]: [f64; 2]) -> String {
    let most = f64::from(u32::MAX);
    let scale = if to > from { most / (to - from) } else { 0.0 };
    let bytes: Vec<u8> = t
        .iter()
        .flat_map(|t| (((t - from) * scale).round().clamp(0.0, most) as u32).to_le_bytes())
        .collect();
    base64(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        let pairs = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, coded) in pairs {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xfb, 0xff]), "+/8=");
    }

    #[test]
    fn values_take_the_whole_range_and_a_gap_has_its_own() {
        let series = [-2.0, f64::NAN, 2.0, 0.0];
        let coded = values(&series, extent(&series));
        // -32767, -32768, 32767, 0 in little-endian order
        assert_eq!(coded, base64(&[1, 128, 0, 128, 255, 127, 0, 0]));
        assert_eq!(values(&[3.0], [3.0, 3.0]), base64(&[1, 128]));
        assert_eq!(extent(&[f64::NAN]), [0.0, 0.0]);
    }
}
