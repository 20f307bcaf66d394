//! Angles and axes as people write them: 1.5708 for pi/2, 0.866 for the cosine of 30 degrees.
//!
//! An angle that is off by 4e-6 rad makes axes that are parallel in the machine cross far away, and the
//! model a base parameter that no motion can determine: so what is written as a rounded multiple of pi/12 is
//! taken as that multiple. 1.5704391 of a calibrated arm is no rounded multiple and stays.

use std::f64::consts::PI;

/// Parts of a turn that count as meant: multiples of pi/12 [rad].
const PARTS: f64 = 12.0;
/// Fewest decimals that distinguish a rounded multiple from a number that is near one by chance.
const FEWEST_DECIMALS: i32 = 3;
/// A change below it [rad] is no news: the file says pi/2 in ten digits or more.
const SAME_ANGLE_RAD: f64 = 1e-9;

/// What was changed in a file, for one warning.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct FileChanges {
    count: usize,
    first: String,
}

impl FileChanges {
    /// Takes the angle [rad] that a text stands for; `place` says where it is.
    pub(super) fn angle(&mut self, value: f64, written: &str, place: &str) -> f64 {
        let Some(meant) = angle(written, value) else {
            return value;
        };
        if (meant - value).abs() > SAME_ANGLE_RAD {
            self.add(place, written, &in_words(meant));
        }
        meant
    }

    /// Takes the unit vector that three texts stand for.
    pub(super) fn axis(&mut self, value: [f64; 3], written: [&str; 3], place: &str) -> [f64; 3] {
        let Some(meant) = axis(written, value) else {
            return value;
        };
        let length = value.iter().map(|x| x * x).sum::<f64>().sqrt();
        let turned = meant.iter().zip(&value);
        let turned = turned.map(|(m, v)| (m - v / length).powi(2)).sum::<f64>();
        if turned.sqrt() > SAME_ANGLE_RAD {
            let exact: Vec<String> = meant.iter().map(|x| format!("{x:.9}")).collect();
            self.add(place, &written.join(" "), &exact.join(" "));
        }
        meant
    }

    fn add(&mut self, place: &str, written: &str, meant: &str) {
        if self.count == 0 {
            self.first = format!("{place} {written} as {meant}");
        }
        self.count += 1;
    }

    /// What happened to the angles of `file`, where anything did.
    pub(super) fn in_words(&self, file: &str) -> Option<String> {
        let more = match self.count {
            0 => return None,
            1 => String::new(),
            count => format!(" and {} more", count - 1),
        };
        Some(format!(
            "{file}: angles written as rounded multiples of 15 degrees are taken as those: {}{more}; `angles_as_written = true` in [robot] takes them as they are written",
            self.first
        ))
    }
}

/// k/12 in its smallest numbers.
fn reduced(k: i64) -> (i64, i64) {
    let shared = (1..=12).rev().find(|d| k % d == 0 && 12 % d == 0);
    let divisor = shared.unwrap_or(1);
    (k / divisor, 12 / divisor)
}

/// A multiple of pi/12 as people say it.
fn in_words(angle: f64) -> String {
    let (above, below) = reduced((angle / PI * PARTS).round() as i64);
    let above = match above {
        1 => "pi".to_owned(),
        -1 => "-pi".to_owned(),
        other => format!("{other} pi"),
    };
    match below {
        1 => above,
        below => format!("{above}/{below}"),
    }
}

/// Decimals that a number is written with, exponent counted; `None` where it has no point.
fn decimals(written: &str) -> Option<i32> {
    let (mantissa, exponent) = match written.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (written, 0),
    };
    let behind = mantissa.split_once('.')?.1;
    let digits = behind.chars().filter(char::is_ascii_digit).count();
    Some(i32::try_from(digits).ok()? - exponent.clamp(-400, 400))
}

/// Whether `exact`, rounded to as many decimals as are written, is what is written.
fn is_rounded(written: &str, value: f64, exact: f64) -> bool {
    let Some(decimals) = decimals(written).filter(|d| *d >= FEWEST_DECIMALS) else {
        return false;
    };
    // where more digits are written than f64 has, the last two of f64 may differ
    let half = 0.5 * 10f64.powi(-decimals);
    (value - exact).abs() <= half.max(2.0 * f64::EPSILON * exact.abs())
}

/// The multiple of pi/12 that a text stands for [rad].
fn angle(written: &str, value: f64) -> Option<f64> {
    let k = (value / PI * PARTS).round();
    // in the smallest numbers, which divide as those of a library do
    let (above, below) = reduced(k as i64);
    let exact = PI * above as f64 / below as f64;
    (k != 0.0 && is_rounded(written, value, exact)).then_some(exact)
}

/// The unit vector whose components are cosines of multiples of 15 degrees that three texts stand for.
fn axis(written: [&str; 3], value: [f64; 3]) -> Option<[f64; 3]> {
    let component = |i: usize| {
        let (size, text) = (value[i].abs(), written[i]);
        let cosines = (0..=6).map(|k| match k {
            // the cosine of 60 and 90 degrees, which no library rounds to themselves
            4 => 0.5,
            6 => 0.0,
            k => (PI * f64::from(k) / PARTS).cos(),
        });
        let meant = cosines.into_iter().find(|c| {
            size == *c || (*c != 0.0 && is_rounded(text.trim_start_matches(['-', '+']), size, *c))
        })?;
        Some(meant.copysign(value[i]))
    };
    let meant = [component(0)?, component(1)?, component(2)?];
    let square = meant.iter().map(|x| x * x).sum::<f64>();
    ((square - 1.0).abs() < 1e-12 && meant != value).then_some(meant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_6};

    fn read(text: &str) -> f64 {
        FileChanges::default().angle(text.parse().unwrap(), text, "rpy")
    }

    #[test]
    fn rounded_multiples_of_15_degrees_are_what_they_stand_for() {
        for (text, exact) in [
            ("1.5708", FRAC_PI_2),
            ("-1.571", -FRAC_PI_2),
            ("1.57079632679", FRAC_PI_2),
            ("1.570796326794897", FRAC_PI_2),
            ("15.708e-1", FRAC_PI_2),
            ("+1.57080E+0", FRAC_PI_2),
            ("3.1416", PI),
            ("3.142", PI),
            ("-3.14159265359", -PI),
            ("0.785398", FRAC_PI_4),
            ("0.785", FRAC_PI_4),
            ("0.5236", FRAC_PI_6),
            ("2.356194", 3.0 * FRAC_PI_4),
            ("0.2618", PI / 12.0),
            ("6.2832", 2.0 * PI),
        ] {
            // which of two neighbours of f64 is nearest to pi/6 is a matter of how it is divided
            assert!((read(text) - exact).abs() < 3e-16, "{text}: {}", read(text));
        }
    }

    #[test]
    fn angles_of_a_calibrated_arm_and_of_no_decimals_stay() {
        for text in [
            "1.5704391",
            "1.57",
            "3.14",
            "0",
            "0.000",
            "-0.0001",
            "1.5707",
            "1.570800",
            "3",
            "0.3",
            "1.5708001",
            "nan",
            "inf",
            "1e300",
        ] {
            let value: f64 = text.parse().unwrap();
            assert_eq!(read(text).to_bits(), value.to_bits(), "{text}");
        }
    }

    #[test]
    fn unit_vectors_at_multiples_of_15_degrees_are_exact() {
        let read = |text: [&str; 3]| {
            let value = text.map(|t| t.parse().unwrap());
            FileChanges::default().axis(value, text, "axis")
        };
        let (root, side) = (0.5f64.sqrt(), 0.75f64.sqrt());
        for (text, exact) in [
            (["0.7071", "0", "-0.7071"], [root, 0.0, -root]),
            (["0", "0.866", "0.5"], [0.0, side, 0.5]),
            (["-0.866025", "0.500", "0.0"], [-side, 0.5, 0.0]),
            (["0.5", "0.5", "0.7071"], [0.5, 0.5, root]),
        ] {
            for (found, exact) in read(text).iter().zip(exact) {
                assert!((found - exact).abs() < 1e-15, "{text:?}: {found}");
            }
        }
        for text in [
            ["0", "0", "1"],
            ["0.577", "0.577", "0.577"],
            ["0.866", "0.866", "0"],
            ["0.7", "0.7", "0"],
            ["0.0003", "0.9999", "0"],
        ] {
            assert_eq!(
                read(text),
                text.map(|t| t.parse::<f64>().unwrap()),
                "{text:?}"
            );
        }
    }

    #[test]
    fn one_sentence_tells_of_all_changes_and_none_where_nothing_moved() {
        let mut changes = FileChanges::default();
        let mut read = |text: &str, place| changes.angle(text.parse().unwrap(), text, place);
        read("1.57079632679", "rpy of joint a");
        assert_eq!(changes.in_words("r.urdf"), None);
        let mut read = |text: &str, place| changes.angle(text.parse().unwrap(), text, place);
        read("1.5708", "rpy of joint a");
        read("-2.356", "rpy of joint b");
        let shown = changes.in_words("r.urdf").unwrap();
        assert!(
            shown.contains("rpy of joint a 1.5708 as pi/2 and 1 more;"),
            "{shown}"
        );
        assert_eq!(in_words(-2.356), "-3 pi/4");
        assert_eq!(in_words(PI), "pi");
        assert_eq!(in_words(PI / 12.0), "pi/12");
    }
}
