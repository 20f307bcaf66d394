//! Units of positions and torques: one table of how headers and robot files spell them, with their factors.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::{Serialize, Serializer};

/// What a unit counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitKind {
    Length,
    Angle,
    /// Of an encoder or a drive.
    Counts,
    Force,
    Moment,
    Current,
    Voltage,
    /// Of a drive's rated torque or current.
    Share,
}

use UnitKind::{Angle, Counts, Current, Force, Length, Moment, Share, Voltage};

/// A unit: how it is written in files, and how much of its quantity's own unit (m, rad, N, Nm, A, V, %) it is.
#[derive(Debug, PartialEq)]
pub struct KnownUnit {
    pub label: &'static str,
    pub of: UnitKind,
    pub size: f64,
    /// How names spell it, small letters without signs between them.
    words: &'static str,
    /// Further spellings that are units in brackets alone: in a name they are labels, or parts of a robot.
    in_brackets: &'static str,
}

const fn unit(
    (label, of, size): (&'static str, UnitKind, f64),
    words: &'static str,
    in_brackets: &'static str,
) -> KnownUnit {
    KnownUnit {
        label,
        of,
        size,
        words,
        in_brackets,
    }
}

/// Standard gravity \[m/s^2\], a pound and an ounce of force \[N\], an inch \[m\].
const G: f64 = 9.80665;
const LBF: f64 = 4.448_221_615_260_5;
const OZF: f64 = LBF / 16.0;
const INCH: f64 = 0.0254;

static UNITS: [KnownUnit; 48] = [
    unit(("m", Length, 1.0), "meter meters metre metres", "m"),
    unit(("cm", Length, 1e-2), "cm", ""),
    unit(("mm", Length, 1e-3), "mm millimeter millimetre", ""),
    unit(("um", Length, 1e-6), "um micron microns micrometer", ""),
    unit(("in", Length, INCH), "inch inches", "in \""),
    unit(("ft", Length, 12.0 * INCH), "foot feet", "ft"),
    unit(("rad", Angle, 1.0), "rad rads radian radians", ""),
    unit(("mrad", Angle, 1e-3), "mrad milliradian milliradians", ""),
    unit(("urad", Angle, 1e-6), "urad microradian microradians", ""),
    unit(("deg", Angle, PI / 180.0), "deg degs degree degrees °", ""),
    unit(
        ("cdeg", Angle, PI / 18e3),
        "cdeg centidegree centidegrees",
        "",
    ),
    unit(
        ("mdeg", Angle, PI / 180e3),
        "mdeg millidegree millidegrees",
        "",
    ),
    unit(
        ("grad", Angle, PI / 200.0),
        "gon gons gradian gradians",
        "grad grads",
    ),
    unit(
        ("arcmin", Angle, PI / 10_800.0),
        "arcmin arcminute arcminutes",
        "",
    ),
    unit(
        ("arcsec", Angle, PI / 648e3),
        "arcsec arcsecond arcseconds",
        "",
    ),
    unit(
        ("turns", Angle, TAU),
        "turns rev revs revolution revolutions",
        "turn r rot",
    ),
    unit(
        ("counts", Counts, 1.0),
        "counts ticks increments pulses",
        "count tick inc incs pulse lsb digits cts qc step steps",
    ),
    unit(("N", Force, 1.0), "newton newtons", "n"),
    unit(("mN", Force, 1e-3), "", "mn"),
    unit(("kN", Force, 1e3), "kn", ""),
    unit(("daN", Force, 10.0), "dan", ""),
    unit(("lbf", Force, LBF), "lbf", "lb lbs pound pounds"),
    unit(("ozf", Force, OZF), "ozf", "oz"),
    unit(("kgf", Force, G), "kgf", "kg kp"),
    unit(("gf", Force, 1e-3 * G), "gf", "g"),
    unit(
        ("Nm", Moment, 1.0),
        "nm newtonmeter newtonmeters newtonmetre newtonmetres",
        "",
    ),
    unit(("mNm", Moment, 1e-3), "mnm nmm millinewtonmeter", ""),
    unit(("uNm", Moment, 1e-6), "unm", ""),
    unit(("kNm", Moment, 1e3), "knm", ""),
    unit(("Ncm", Moment, 1e-2), "ncm cnm", ""),
    unit(("dNm", Moment, 0.1), "dnm ndm", ""),
    unit(("daNm", Moment, 10.0), "danm", ""),
    unit(
        ("lbf.ft", Moment, 12.0 * INCH * LBF),
        "lbfft lbft lbsft ftlb ftlbf ftlbs poundfoot poundfeet footpound footpounds",
        "",
    ),
    unit(
        ("lbf.in", Moment, INCH * LBF),
        "lbfin lbin lbsin inlb inlbf inlbs poundinch inchpound inchpounds",
        "",
    ),
    unit(
        ("ozf.in", Moment, INCH * OZF),
        "ozfin ozin inoz inozf ounceinch ounceinches inchounce",
        "",
    ),
    unit(("kgf.m", Moment, G), "kgfm kgm mkgf mkp kpm mkg", ""),
    unit(
        ("kgf.cm", Moment, 1e-2 * G),
        "kgfcm kgcm cmkgf cmkg kpcm",
        "",
    ),
    unit(("kgf.mm", Moment, 1e-3 * G), "kgfmm kgmm", ""),
    unit(("gf.cm", Moment, 1e-5 * G), "gfcm gcm", ""),
    unit(
        ("A", Current, 1.0),
        "amp amps ampere amperes",
        "a arms apk apeak aeff",
    ),
    unit(
        ("mA", Current, 1e-3),
        "milliamp milliamps milliampere milliamperes",
        "ma marms mapk",
    ),
    unit(("uA", Current, 1e-6), "microamp microamps", "ua"),
    unit(("V", Voltage, 1.0), "volt volts", "v"),
    unit(("mV", Voltage, 1e-3), "millivolt millivolts", "mv"),
    unit(("%", Share, 1.0), "percent pct % utilization", "load"),
    unit(("permille", Share, 0.1), "permille permil promille ‰", ""),
    unit(("bp", Share, 0.01), "", "bp"),
    unit(("pu", Share, 100.0), "perunit", "pu"),
];

/// A unit as a header states it: `deg`, `0.01 deg`, `deg/s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedUnit {
    pub unit: &'static KnownUnit,
    /// What of it one number counts.
    pub times: f64,
    /// It is a unit a second.
    pub rate: bool,
}

impl StatedUnit {
    /// As it is to be shown.
    pub fn shown(&self) -> String {
        let times = match self.times {
            1.0 => String::new(),
            times => format!("{times} "),
        };
        let rate = if self.rate { "/s" } else { "" };
        format!("{times}{}{rate}", self.unit.label)
    }
}

/// Small letters without the signs that stand between the parts of a unit.
fn plain(text: &str) -> String {
    let kept = text
        .chars()
        .filter(|c| !(c.is_whitespace() || ".*·⋅∙×-_^".contains(*c)));
    let one = |c: char| if matches!(c, 'µ' | 'μ') { 'u' } else { c };
    kept.map(one).collect::<String>().to_lowercase()
}

fn has(list: &str, word: &str) -> bool {
    list.split_whitespace().any(|known| known == word)
}

/// The number that a text begins with, `0.01` or `1/100`, and what follows it.
fn number_before(text: &str) -> (f64, &str) {
    let digits = |text: &str| {
        text.find(|c: char| !(c.is_ascii_digit() || ".,".contains(c)))
            .unwrap_or(text.len())
    };
    let (first, rest) = text.split_at(digits(text));
    let Ok(number) = first.replace(',', ".").parse::<f64>() else {
        return (1.0, text);
    };
    if let Some(below) = rest.strip_prefix('/') {
        let (below, rest) = below.split_at(digits(below));
        return match below.parse::<f64>() {
            Ok(below) if below > 0.0 => (number / below, rest),
            _ => (1.0, text),
        };
    }
    let exponent = rest.strip_prefix(['e', 'E']).and_then(|tail| {
        let end = tail.find(|c: char| !(c.is_ascii_digit() || c == '-'));
        let (power, rest) = tail.split_at(end.unwrap_or(tail.len()));
        Some((power.parse::<i32>().ok()?, rest))
    });
    match exponent {
        Some((power, rest)) => (number * 10_f64.powi(power), rest),
        None => (number, rest),
    }
}

/// The unit that a text in brackets, or in a row of units, is; one of these quantities where it may be either.
pub(crate) fn stated(text: &str, wanted: &[UnitKind]) -> Option<StatedUnit> {
    let text = text.trim();
    let (times, rest) = number_before(text);
    let whole = rest.trim();
    let (rest, rate) = ["/s", "/sec", "/second", " per s", " per second", "s^-1"]
        .iter()
        .find_map(|per| whole.strip_suffix(per))
        .map_or((whole, false), |rest| (rest.trim(), true));
    // German for degrees has a capital, the new degree has none
    if rest.is_empty() || times <= 0.0 || rest.starts_with("Grad") {
        return None;
    }
    let spelled = plain(rest);
    let is = |unit: &&KnownUnit| has(unit.words, &spelled) || has(unit.in_brackets, &spelled);
    let mut all = UNITS.iter().filter(is);
    let first = all.next()?;
    let unit = std::iter::once(first)
        .chain(all)
        .find(|unit| wanted.contains(&unit.of));
    Some(StatedUnit {
        unit: unit.unwrap_or(first),
        times,
        rate,
    })
}

/// The unit of these quantities that words of a name spell, one by one or two together: `tau_lb_ft_1`.
pub(crate) fn spoken(words: &[&str], wanted: &[UnitKind]) -> Option<&'static KnownUnit> {
    let of = |word: &str| {
        let mut all = UNITS.iter().filter(|unit| wanted.contains(&unit.of));
        all.find(|unit| has(unit.words, word))
    };
    let pairs = || words.windows(2).map(|pair| pair.concat());
    let compound = |word: String| of(&word).filter(|unit| unit.of == Moment);
    pairs()
        .find_map(compound)
        .or_else(|| words.iter().find_map(|word| of(word)))
}

/// The labels of some quantities' units, for the user to choose from.
pub(crate) fn labels(of: &[UnitKind]) -> Vec<&'static str> {
    let all = UNITS.iter().filter(|unit| of.contains(&unit.of));
    all.map(|unit| unit.label).collect()
}

pub(crate) const POSITIONS: [UnitKind; 3] = [Length, Angle, Counts];
pub(crate) const TORQUES: [UnitKind; 6] = [Force, Moment, Current, Voltage, Counts, Share];

static POSITION_LABELS: LazyLock<Vec<&'static str>> = LazyLock::new(|| labels(&POSITIONS));
static TORQUE_LABELS: LazyLock<Vec<&'static str>> = LazyLock::new(|| labels(&TORQUES));

/// The unit of a label or of another spelling without a number before it.
fn of_file(text: &str, wanted: &[UnitKind]) -> Option<&'static KnownUnit> {
    let mut labelled = UNITS.iter();
    let labelled = labelled.find(|unit| unit.label == text && wanted.contains(&unit.of));
    labelled.or_else(|| {
        let stated = stated(text, wanted)?;
        let plain = stated.times == 1.0 && !stated.rate && wanted.contains(&stated.unit.of);
        plain.then_some(stated.unit)
    })
}

/// Unit of a logged position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionUnit(&'static KnownUnit);

/// Unit of a logged torque or force, or of what drives a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueUnit(&'static KnownUnit);

impl PositionUnit {
    pub const METRE: Self = Self(&UNITS[0]);
    pub const MILLIMETRE: Self = Self(&UNITS[2]);
    pub const RADIAN: Self = Self(&UNITS[6]);
    pub const DEGREE: Self = Self(&UNITS[9]);
    pub const TURN: Self = Self(&UNITS[15]);
    /// Encoder counts: those of the CFT robot's actuators by Table 5, of a joint by `position_scale`.
    pub const COUNTS: Self = Self(&UNITS[16]);

    /// As it is written in files.
    pub const fn label(self) -> &'static str {
        self.0.label
    }

    /// Whether it is a length.
    pub fn is_length(self) -> bool {
        self.0.of == Length
    }

    /// Whether it is an angle.
    pub fn is_angle(self) -> bool {
        self.0.of == Angle
    }

    /// SI units in one of it; 1 for counts, whose size depends on the coordinate.
    pub const fn in_si(self) -> f64 {
        self.0.size
    }
}

impl TorqueUnit {
    /// As it is written in files.
    pub const fn label(self) -> &'static str {
        self.0.label
    }

    /// Unit of a model that is fitted to it, where no gain takes it to a torque.
    pub fn kept_label(self) -> &'static str {
        match self.0.of {
            Current => "A",
            Voltage => "V",
            Share => "%",
            _ => self.0.label,
        }
    }

    /// Whether it is a unit of force or torque, and not one that a gain takes to them.
    pub fn is_torque(self) -> bool {
        self.is_force() || self.is_moment()
    }

    /// Whether it is a unit of force.
    pub fn is_force(self) -> bool {
        self.0.of == Force
    }

    /// Whether it is a unit of torque.
    pub fn is_moment(self) -> bool {
        self.0.of == Moment
    }

    /// N, Nm, A, V or % in one of it.
    pub const fn in_si(self) -> f64 {
        self.0.size
    }
}

impl Serialize for PositionUnit {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.label())
    }
}

impl Serialize for TorqueUnit {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.label())
    }
}

impl<'de> Deserialize<'de> for PositionUnit {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = <Cow<'_, str>>::deserialize(from)?;
        let unit = of_file(&text, &POSITIONS);
        unit.map(Self)
            .ok_or_else(|| D::Error::unknown_variant(&text, &POSITION_LABELS))
    }
}

impl<'de> Deserialize<'de> for TorqueUnit {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = <Cow<'_, str>>::deserialize(from)?;
        let unit = of_file(&text, &TORQUES);
        unit.map(Self)
            .ok_or_else(|| D::Error::unknown_variant(&text, &TORQUE_LABELS))
    }
}

impl JsonSchema for PositionUnit {
    fn schema_name() -> Cow<'static, str> {
        "PositionUnit".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "enum": *POSITION_LABELS})
    }
}

impl JsonSchema for TorqueUnit {
    fn schema_name() -> Cow<'static, str> {
        "TorqueUnit".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "enum": *TORQUE_LABELS})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_have_the_factors_of_their_definitions_however_they_are_spelled() {
        let torque = |text: &str| {
            let found = stated(text, &TORQUES).unwrap();
            (found.unit.label, found.times * found.unit.size)
        };
        for (text, label, size) in [
            ("lb.ft", "lbf.ft", 1.355_817_948_331_4),
            ("lbf-ft", "lbf.ft", 1.355_817_948_331_4),
            ("ft·lb", "lbf.ft", 1.355_817_948_331_4),
            ("in-lb", "lbf.in", 0.112_984_829_027_616_7),
            ("oz-in", "ozf.in", 0.007_061_551_814_226),
            ("kgf.cm", "kgf.cm", 0.0980665),
            ("kg-cm", "kgf.cm", 0.0980665),
            ("N m", "Nm", 1.0),
            ("N*mm", "mNm", 1e-3),
            ("daNm", "daNm", 10.0),
            ("0.1 %", "%", 0.1),
            ("‰", "permille", 0.1),
            ("mA", "mA", 1e-3),
            ("A rms", "A", 1.0),
        ] {
            let (found, factor) = torque(text);
            assert_eq!(found, label, "{text}");
            assert!((factor / size - 1.0).abs() < 1e-12, "{text}: {factor}");
        }
        let position = |text: &str| {
            let found = stated(text, &POSITIONS).unwrap();
            found.times * found.unit.size
        };
        for (text, size) in [
            ("0.01deg", PI / 18_000.0),
            ("1/100 deg", PI / 18_000.0),
            ("1e-3 rad", 1e-3),
            ("gon", PI / 200.0),
            ("grad", PI / 200.0),
            ("mrad", 1e-3),
            ("°", PI / 180.0),
            ("in", 0.0254),
        ] {
            assert!((position(text) / size - 1.0).abs() < 1e-12, "{text}");
        }
        for text in ["foo", "Grad", "", "12", "deg x 100", "elbow"] {
            assert_eq!(stated(text, &POSITIONS), None, "{text}");
        }
        assert!(stated("deg/s", &POSITIONS).unwrap().rate);
    }

    #[test]
    fn every_label_is_read_back_as_itself() {
        for label in POSITION_LABELS.iter() {
            assert_eq!(of_file(label, &POSITIONS).unwrap().label, *label);
        }
        for label in TORQUE_LABELS.iter() {
            assert_eq!(of_file(label, &TORQUES).unwrap().label, *label);
        }
        let fixed = [
            (PositionUnit::METRE, "m"),
            (PositionUnit::MILLIMETRE, "mm"),
            (PositionUnit::RADIAN, "rad"),
            (PositionUnit::DEGREE, "deg"),
            (PositionUnit::TURN, "turns"),
            (PositionUnit::COUNTS, "counts"),
        ];
        assert!(fixed.iter().all(|(unit, label)| unit.label() == *label));
    }

    #[test]
    fn two_words_of_a_name_are_one_unit_and_parts_of_a_robot_are_none() {
        let torque = |words: &str| {
            let words: Vec<&str> = words.split(' ').collect();
            spoken(&words, &TORQUES).map(|unit| unit.label)
        };
        assert_eq!(torque("tau lb ft 1"), Some("lbf.ft"));
        assert_eq!(torque("tau kgf cm"), Some("kgf.cm"));
        assert_eq!(torque("torque a 1"), None);
        assert_eq!(torque("load torque"), None);
    }
}
