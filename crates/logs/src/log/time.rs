//! Instants that are exact however far from zero they are: epoch and ISO stamps to the femtosecond.

use std::fmt;

/// Femtoseconds in one second.
const SECOND: i128 = 1_000_000_000_000_000;
/// Femtoseconds in one nanosecond.
const NANOSECOND: i128 = 1_000_000;
/// Times beyond this are counted from the log's first one [s]: below, f64 resolves 0.12 ns.
pub(super) const FAR_S: f64 = (1 << 20) as f64;

/// An instant on the clock of a log, in whole femtoseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instant(pub(super) i128);

impl Instant {
    /// An instant from whole nanoseconds.
    pub fn from_ns(ns: impl Into<i128>) -> Self {
        Self(ns.into() * NANOSECOND)
    }

    pub(crate) fn from_s_ns(s: i64, ns: i64) -> Self {
        Self(i128::from(s) * SECOND + i128::from(ns) * NANOSECOND)
    }

    /// Seconds since the zero of the clock, as near as f64 has them.
    pub fn seconds(self) -> f64 {
        self.since(Self::default())
    }

    /// Whole nanoseconds since the zero of the clock, rounded down.
    pub fn nanoseconds(self) -> i128 {
        self.0.div_euclid(NANOSECOND)
    }

    /// Seconds from `origin` to this instant; the nearest f64 where both are whole nanoseconds.
    pub fn since(self, origin: Self) -> f64 {
        let Ok(fs) = i64::try_from(self.0 - origin.0) else {
            let ns = (self.0 - origin.0) / NANOSECOND;
            return ns as f64 / 1e9;
        };
        if fs % NANOSECOND as i64 == 0 {
            (fs / NANOSECOND as i64) as f64 / 1e9
        } else {
            fs as f64 / 1e15
        }
    }

    /// Whether seconds from the zero of the clock would lose resolution.
    pub(super) fn is_far(self) -> bool {
        self.0.unsigned_abs() >= (FAR_S as u128) * SECOND as u128
    }

    /// So many times as far from the zero of the clock.
    pub(super) fn times(self, times: i128) -> Self {
        Self(self.0.saturating_mul(times))
    }

    /// The sum with an instant that counts from it.
    pub(super) fn and(self, rest: Self) -> Self {
        Self(self.0.saturating_add(rest.0))
    }

    /// Later by `s` seconds, rounded to the femtosecond.
    pub(super) fn plus(self, s: f64) -> Self {
        Self(self.0.saturating_add((s * 1e15).round() as i128))
    }

    /// Later by `s` seconds, rounded to the nanosecond.
    pub fn later(self, s: f64) -> Self {
        let exact = self.plus(s).0;
        Self((exact + NANOSECOND / 2).div_euclid(NANOSECOND) * NANOSECOND)
    }

    /// Reads a decimal number in units of 10^`power` s, e.g. -9 for nanoseconds.
    pub(super) fn parse_decimal(field: &[u8], power: i32) -> Option<Self> {
        let text = unquoted(field);
        let (negative, text) = match text.strip_prefix(b"-") {
            Some(rest) => (true, rest),
            None => (false, text.strip_prefix(b"+").unwrap_or(text)),
        };
        let end = text.iter().position(|b| b"eE".contains(b));
        let (digits, exponent) = match end {
            None => (text, 0),
            Some(end) => {
                let exponent = std::str::from_utf8(&text[end + 1..]).ok()?;
                (&text[..end], exponent.parse::<i16>().ok()?.into())
            }
        };
        let mut mantissa: i128 = 0;
        let (mut count, mut fraction) = (0, None);
        for byte in digits {
            match byte {
                b'0'..=b'9' => {
                    mantissa = mantissa
                        .checked_mul(10)?
                        .checked_add(i128::from(byte - b'0'))?;
                    count += 1;
                    fraction = fraction.map(|places: i32| places + 1);
                }
                b'.' if fraction.is_none() => fraction = Some(0),
                _ => return None,
            }
        }
        if count == 0 {
            return None;
        }
        let shift: i32 = exponent - fraction.unwrap_or(0) + power + 15;
        let scale = 10i128.checked_pow(shift.unsigned_abs());
        let fs = match (shift < 0, scale) {
            (true, None) => 0,
            (true, Some(scale)) => (mantissa + scale / 2) / scale,
            (false, None) if mantissa == 0 => 0,
            (false, scale) => mantissa.checked_mul(scale?)?,
        };
        Some(Self(if negative { -fs } else { fs }))
    }

    /// Reads `2024-05-01T12:34:56.789+02:00` (ISO 8601) or `1.5.2024 12:34:56`, UTC without a zone; or a time of day.
    pub(super) fn parse_iso(field: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(unquoted(field)).ok()?;
        let (days, clock) = match text.split_once(['T', 't', ' ']) {
            Some((date, clock)) => (days_of(date)?, clock),
            None if text.matches(':').count() == 2 => (0, text),
            None => return None,
        };
        let clock = clock.trim_start();
        let end = clock
            .find(|c: char| !(c.is_ascii_digit() || ":.,".contains(c)))
            .unwrap_or(clock.len());
        let (clock, zone) = clock.split_at(end);
        let mut parts = clock.split(':');
        let hours = in_range(parts.next()?, 0, 24)?;
        let minutes = in_range(parts.next()?, 0, 59)?;
        let seconds = parts.next().unwrap_or("0");
        if parts.next().is_some() {
            return None;
        }
        let (whole, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, ""));
        // 60 is a leap second.
        let seconds = in_range(whole, 0, 60)?;
        let fraction = if fraction.is_empty() {
            Self::default()
        } else {
            Self::parse_decimal(format!("0.{fraction}").as_bytes(), 0)?
        };
        let whole = days * 86_400 + hours * 3600 + minutes * 60 + seconds - offset_s(zone.trim())?;
        Some(Self(i128::from(whole) * SECOND + fraction.0))
    }
}

/// Days since 1970 of a date, the year first, or last behind points.
fn days_of(date: &str) -> Option<i64> {
    let points = date.contains('.');
    let mut parts: Vec<&str> = date.split(['-', '/', '.']).collect();
    if points {
        parts.reverse();
    }
    let [year, month, day] = parts[..] else {
        return None;
    };
    let whole = year.len() == 4;
    let (month, day) = (in_range(month, 1, 12)?, in_range(day, 1, 31)?);
    whole.then_some(days(number(year)?, month, day))
}

/// Time of a row, before it is counted from anywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RowTime {
    /// Seconds as the log counts them.
    Seconds(f64),
    /// An exact instant, counted from the first one where it is far from zero.
    Exact(Instant),
}

impl Default for RowTime {
    fn default() -> Self {
        Self::Seconds(0.0)
    }
}

impl RowTime {
    /// Of a row without a time.
    pub(super) const NONE: Self = Self::Seconds(f64::NAN);

    pub(super) fn is_zero(self) -> bool {
        self.instant() == Instant::default()
    }

    /// Seconds, counted from the first time where that is far from zero.
    #[inline]
    pub(super) fn seconds(self, origin: &mut Option<Instant>) -> f64 {
        match self {
            Self::Seconds(seconds) => seconds,
            Self::Exact(instant) => {
                let origin = *origin.get_or_insert(match instant.is_far() {
                    true => instant,
                    false => Instant::default(),
                });
                instant.since(origin)
            }
        }
    }

    pub(super) fn instant(self) -> Instant {
        match self {
            Self::Exact(instant) => instant,
            Self::Seconds(seconds) => Instant::default().plus(seconds),
        }
    }
}

/// Seconds, with as many decimals as the instant has.
impl fmt::Display for Instant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let fs = self.0.unsigned_abs();
        let (whole, rest) = (fs / SECOND as u128, fs % SECOND as u128);
        let fraction = format!("{rest:015}");
        let fraction = fraction.trim_end_matches('0');
        match fraction {
            "" => write!(f, "{sign}{whole}"),
            fraction => write!(f, "{sign}{whole}.{fraction}"),
        }
    }
}

/// A field without the spaces and the quotes around it.
fn unquoted(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    let inner = field
        .strip_prefix(b"\"")
        .and_then(|field| field.strip_suffix(b"\""));
    inner.unwrap_or(field).trim_ascii()
}

fn number(text: &str) -> Option<i64> {
    let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    digits.then(|| text.parse().ok()).flatten()
}

fn in_range(text: &str, from: i64, to: i64) -> Option<i64> {
    number(text).filter(|value| (from..=to).contains(value))
}

/// Offset of a zone from UTC [s]: `Z`, `UTC`, `+02:00`, `-0530`, `+01`, or nothing.
fn offset_s(zone: &str) -> Option<i64> {
    if zone.is_empty() || zone.eq_ignore_ascii_case("z") || zone.eq_ignore_ascii_case("utc") {
        return Some(0);
    }
    let (sign, rest) = match zone.split_at_checked(1)? {
        ("+", rest) => (1, rest),
        ("-", rest) => (-1, rest),
        _ => return None,
    };
    let digits = rest.replace(':', "");
    let (hours, minutes) = match digits.len() {
        2 => (digits.as_str(), "0"),
        4 => digits.split_at_checked(2)?,
        _ => return None,
    };
    Some(sign * (in_range(hours, 0, 18)? * 3600 + in_range(minutes, 0, 59)? * 60))
}

/// Days from 1970-01-01 to a date of the Gregorian calendar.
fn days(year: i64, month: i64, day: i64) -> i64 {
    // Years that begin in March end with the leap day, so that months have a pattern of days:
    // 153 in every five.
    let year = if month <= 2 { year - 1 } else { year };
    let month = (month + 9) % 12;
    let leap_days = year / 4 - year / 100 + year / 400;
    let to_epoch = 719_468;
    365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - to_epoch
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decimal(text: &str, power: i32) -> Instant {
        Instant::parse_decimal(text.as_bytes(), power).unwrap()
    }

    fn iso(text: &str) -> Option<Instant> {
        Instant::parse_iso(text.as_bytes())
    }

    #[test]
    fn epoch_stamps_keep_every_nanosecond() {
        let first = decimal("1700000000.123456789", 0);
        let second = decimal("1700000000.124456790", 0);
        assert_eq!(second.since(first), 0.001000001);
        assert_eq!(decimal("1700000000123456789", -9), first);
        assert_eq!(decimal(" \"1700000000123.456789\" ", -3), first);
        assert_eq!(decimal("1.700000000123456789e9", 0), first);
        assert_eq!(first.to_string(), "1700000000.123456789");
        assert_eq!(first.nanoseconds(), 1_700_000_000_123_456_789);
        assert_eq!(decimal("-0.5", 0).to_string(), "-0.5");
        let half = decimal("1700000000.1234567895", 0);
        assert_eq!(half.since(first), 5e-10);
    }

    #[test]
    fn the_difference_of_whole_nanoseconds_is_the_nearest_number() {
        for (ns, s) in [(8_000_000_i64, 0.008), (27_520_000_000, 27.52), (1, 1e-9)] {
            assert_eq!(Instant::from_ns(ns).since(Instant::default()), s);
        }
        let days = Instant::from_ns(100 * 86_400 * 1_000_000_000_i64 + 1);
        assert_eq!(days.since(Instant::default()), 8_640_000.000000001);
    }

    #[test]
    fn iso_stamps_are_read_with_date_fraction_and_zone() {
        let expected = Instant::from_s_ns(1_709_210_096, 789_000_000);
        for text in [
            "2024-02-29T12:34:56.789Z",
            "2024-02-29 12:34:56.789",
            "2024-02-29T14:34:56.789+02:00",
            "2024-02-29T07:04:56,789-0530",
            "\"2024/02/29 12:34:56.789 UTC\"",
        ] {
            assert_eq!(iso(text), Some(expected), "{text}");
        }
        assert_eq!(iso("29.2.2024 12:34:56.789"), Some(expected));
        assert_eq!(iso("1970-01-01T00:00"), Some(Instant::default()));
        let of_day = iso("12:34:56.789").unwrap();
        assert_eq!(of_day.seconds(), 45_296.789);
        for (text, s) in [
            ("1969-12-31T23:59:59Z", -1),
            ("2000-03-01T00:00:00Z", 951_868_800),
        ] {
            assert_eq!(iso(text), Some(Instant::from_s_ns(s, 0)));
        }
    }

    #[test]
    fn what_is_no_stamp_is_refused() {
        let stamps = "12:34|25:00:00|1.13.2024 00:00:00|2024-13-01T00:00|2024-01-01|2024-01-01T25:00|24-01-01T00:00|\
            2024-01-01T00:00:00+99:00|2024-01-01T00:00:00x|2024-01-01T00:00:00.x||T";
        for text in stamps.split('|') {
            assert_eq!(iso(text), None, "{text}");
        }
        let long = "9".repeat(60);
        for text in ["", "-", ".", "1e", "1.2.3", "0x1", "1e99999", &long] {
            assert_eq!(Instant::parse_decimal(text.as_bytes(), 0), None, "{text}");
        }
        assert_eq!(decimal("1e-300", 0), Instant::default());
    }
}
