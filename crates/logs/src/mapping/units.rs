//! Units that the names of columns state, or that their numbers suggest.

use std::f64::consts::TAU;

use super::column::LogColumn;
use crate::inspect::words::{NamedDrive, drive, lists, words};
use crate::log::escape;
use cft_ident_core::robot::JointKind;

/// Largest position that a joint in radians has where it does not turn on and on.
const MAX_POSITION_RAD: f64 = 1.2 * TAU;
/// Longest travel of a joint that slides \[m\].
const MAX_TRAVEL_M: f64 = 20.0;
/// Largest torque of a joint \[Nm\]: the largest arms stay below it.
const MAX_TORQUE_NM: f64 = 2e4;

/// A unit, as the keys of a joint in `[log.joint]` say it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unit {
    /// `position_unit` or `torque_unit`.
    pub unit: Option<&'static str>,
    /// `position_scale` or `torque_scale`.
    pub scale: Option<f64>,
    /// The numbers suggest it and no name states it, or it is not enough: what to look at.
    pub check: Option<String>,
    /// It is a current or a voltage, not a torque.
    pub drive: bool,
}

/// Words that name a unit of positions and nothing else, and the unit; `m` and `rad` are the tool's own.
const POSITIONS: [(&str, &str); 7] = [
    ("deg", "deg degs degree degrees °"),
    ("mm", "mm millimeter millimetre"),
    ("cm", "cm centimeter centimetre"),
    ("turns", "turn turns rev revs revolutions"),
    ("counts", "counts count ticks tick inc increments pulses"),
    ("rad", "rad rads radian radians"),
    ("m", "meter meters metre metres"),
];
/// The same of torques, currents and voltages.
const TORQUES: [(&str, &str); 10] = [
    ("mNm", "mnm nmm"),
    ("kNm", "knm"),
    ("Ncm", "ncm"),
    ("kN", "kn"),
    ("%", "percent pct % load utilization"),
    ("Nm", "nm n·m n*m n.m"),
    ("N", "newton newtons"),
    ("mA", "milliamps"),
    ("A", "amp amps ampere amperes"),
    ("V", "volt volts"),
];
/// Units of one letter, or of two that mean something else too: in brackets they are units, in a name labels of axes.
const SHORT_UNITS: [(&str, &str); 5] =
    [("m", "m"), ("n", "N"), ("a", "A"), ("v", "V"), ("ma", "mA")];

/// Words that name parts of robots too: units in brackets alone.
const AMBIGUOUS: &str = "turn load count inc tick";

/// The units that the names of columns of one kind state: in words where all do; in `q_base_turn` it is the joint's.
fn stated_by_all(
    columns: &[&LogColumn],
    alike: &dyn Fn(usize, usize) -> bool,
    known: &[(&'static str, &str)],
) -> Vec<Option<&'static str>> {
    let each: Vec<_> = columns.iter().map(|column| stated(column, known)).collect();
    let all = |k: usize| {
        let mut others = (0..each.len()).filter(|other| alike(k, *other));
        others.all(|other| each[other].is_some())
    };
    let holds = |k: usize| columns[k].unit.is_some() || all(k);
    let kept = (0..each.len()).map(|k| each[k].filter(|_| holds(k)));
    kept.collect()
}

/// The unit that the name of a column states: in brackets, or in a word that means nothing else.
fn stated(column: &LogColumn, known: &[(&'static str, &str)]) -> Option<&'static str> {
    let of = |word: &str| {
        let mut all = known.iter();
        Some(all.find(|(_, words)| lists(words, word))?.0)
    };
    let bracket = column.unit.as_deref().unwrap_or_default().to_lowercase();
    let short = SHORT_UNITS.iter().find(|(short, _)| *short == bracket);
    let short = short.filter(|(_, unit)| known.iter().any(|(own, _)| own == unit));
    let spoken = words(&column.name);
    // `current_mA` ends with it; in `MACur` it is the motor's actual one
    let last = spoken.iter().rfind(|word| word.number().is_none());
    let milli = last.filter(|word| word.text == "ma" && spoken.len() > 1);
    of(&bracket)
        .or(short.map(|(_, unit)| *unit))
        .or_else(|| {
            let mut sure = spoken.iter().filter(|word| !lists(AMBIGUOUS, &word.text));
            sure.find_map(|word| of(&word.text))
        })
        .or_else(|| milli.and_then(|_| of("milliamps")))
}

/// The unit that the name of a position states.
pub(super) fn stated_position(column: &LogColumn) -> Option<&'static str> {
    stated(column, &POSITIONS)
}

/// The unit that the name of a torque states.
pub(super) fn stated_torque(column: &LogColumn) -> Option<&'static str> {
    stated(column, &TORQUES)
}

/// Whether a velocity is said to be in a unit that the position's does not go with.
pub(super) fn other_velocity(velocity: &LogColumn, position: Option<&'static str>) -> bool {
    let rpm = words(&velocity.name).iter().any(|word| word.text == "rpm");
    let stated = stated_position(velocity).filter(|unit| *unit != "rad" && *unit != "m");
    rpm || stated != position.filter(|unit| *unit != "rad" && *unit != "m")
}

/// The units of the positions of all joints.
pub(super) fn of_positions(columns: &[&LogColumn], kinds: &[JointKind]) -> Vec<Unit> {
    let stated = stated_by_all(columns, &|a, b| kinds[a] == kinds[b], &POSITIONS);
    let of = |kind: JointKind| {
        let plain = (0..columns.len()).filter(|k| kinds[*k] == kind && stated[*k].is_none());
        plain.map(|k| columns[k].largest()).fold(0.0, f64::max)
    };
    let (turned, slid) = (of(JointKind::Revolute), of(JointKind::Prismatic));
    let plain = columns.iter().zip(&stated);
    let plain = plain
        .filter(|(_, unit)| unit.is_none())
        .map(|(column, _)| column);
    let whole = plain.clone().all(|c| c.whole) && turned.max(slid) > 400.0;
    let first = plain.clone().next().map(|column| &column.name);
    let guessed = |kind: JointKind, column: &LogColumn| {
        let (unit, check) = match kind {
            _ if whole => (
                "counts",
                format!(
                    "whole numbers up to {}: counts? then give position_scale, rad or m per count",
                    turned.max(slid)
                ),
            ),
            JointKind::Revolute if turned > MAX_POSITION_RAD => (
                "deg",
                format!(
                    "deg is guessed: positions go to {turned:.0}, and no joint turns that far in rad"
                ),
            ),
            JointKind::Prismatic if slid > MAX_TRAVEL_M => (
                "mm",
                format!(
                    "mm is guessed: positions go to {slid:.0}, and no joint slides that far in m"
                ),
            ),
            _ => return Unit::default(),
        };
        // one sentence for all of them
        let check = Some(check).filter(|_| first == Some(&column.name));
        Unit {
            check,
            ..Unit::of(unit)
        }
    };
    let each = columns.iter().zip(kinds).zip(&stated);
    each.map(|((column, kind), stated)| match *stated {
        None => guessed(*kind, column),
        Some("rad" | "m") => Unit::default(),
        Some("counts") => Unit {
            check: Some("counts: give position_scale, rad or m per count".to_owned()),
            ..Unit::of("counts")
        },
        Some(unit) if matches!(unit, "mm" | "cm") == (*kind == JointKind::Prismatic) => {
            Unit::of(unit)
        }
        Some(unit) => Unit {
            check: Some(format!(
                "`{}` is in {unit}, which does not go with the kind of its joint",
                escape(&column.name)
            )),
            ..Unit::default()
        },
    })
    .collect()
}

/// The units of the torques of all joints; `limits` are those of the robot [Nm or N], where known.
pub(super) fn of_torques(columns: &[&LogColumn], limits: &[Option<f64>]) -> Vec<Unit> {
    let guessed = guessed_torque(columns, limits);
    let stated = stated_by_all(columns, &|_, _| true, &TORQUES);
    let of = |(k, column): (usize, &&LogColumn)| {
        match (stated[k], drive(&words(&column.name))) {
        (Some("mA"), _) => Unit {
            scale: Some(1e-3),
            check: Some("currents in mA, which the scale makes A: give torque constant times gear ratio times 0.001 for Nm".to_owned()),
            ..driving("A")
        },
        (Some("A"), _) | (None, NamedDrive::Current) => driving("A"),
        (Some("V"), _) | (None, NamedDrive::Voltage) => driving("V"),
        (Some("%"), _) => rated("percent of a rated torque", "100"),
        (Some("Nm" | "N"), _) => Unit::default(),
        (Some(unit), _) => Unit::of(unit),
        // one sentence for all of them
        (None, _) => Unit {
            check: guessed.check.clone().filter(|_| k == 0),
            ..guessed.clone()
        },
    }
    };
    columns.iter().enumerate().map(of).collect()
}

impl Unit {
    fn of(unit: &'static str) -> Self {
        Self {
            unit: Some(unit),
            ..Self::default()
        }
    }
}

fn driving(unit: &'static str) -> Unit {
    Unit {
        drive: true,
        ..Unit::of(unit)
    }
}

fn rated(what: &str, part: &str) -> Unit {
    Unit {
        check: Some(format!(
            "{what}: give torque_scale, the rated torque of the joint over {part}"
        )),
        ..Unit::default()
    }
}

/// What the sizes of torques suggest, where no name says a unit.
fn guessed_torque(columns: &[&LogColumn], limits: &[Option<f64>]) -> Unit {
    let largest: Vec<f64> = columns.iter().map(|c| c.largest()).collect();
    let most = largest.iter().copied().fold(0.0, f64::max);
    let known: Vec<f64> = (largest.iter().zip(limits))
        .filter_map(|(largest, limit)| limit.map(|limit| largest / limit))
        .collect();
    // by the limits of the robot where it has some: no joint gives thirty times its largest torque
    let beyond = match known.is_empty() {
        true => most > MAX_TORQUE_NM,
        false => known.iter().any(|ratio| *ratio > 30.0),
    };
    let whole = columns.iter().all(|c| c.whole);
    if whole && most <= 300.0 {
        return rated(&format!("whole numbers up to {most}: percent?"), "100");
    }
    if whole && most <= 3000.0 && known.iter().all(|ratio| *ratio > 1.5) {
        let what = format!("whole numbers up to {most}: thousandths of a rated torque?");
        return rated(&what, "1000");
    }
    if beyond {
        return Unit {
            scale: Some(1e-3),
            check: Some(format!(
                "mNm is guessed: torques go to {most:.0}, and no joint gives that much in Nm"
            )),
            ..Unit::default()
        };
    }
    Unit::default()
}

/// The range after which a position begins anew, where single steps of nearly that size stand among small ones.
pub(super) fn wrap_of(numbers: &[f64]) -> Option<f64> {
    let finite = || numbers.iter().copied().filter(|x| x.is_finite());
    let (low, high) = finite().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let span = high - low;
    let mut steps: Vec<f64> = numbers.windows(2).map(|p| (p[1] - p[0]).abs()).collect();
    steps.retain(|step| step.is_finite());
    let leaps = steps.iter().filter(|step| **step > 0.75 * span).count();
    if steps.len() < 100 || leaps == 0 || leaps * 20 > steps.len() {
        return None;
    }
    steps.sort_by(f64::total_cmp);
    let usual = steps[steps.len() * 9 / 10];
    let near =
        |range: f64| span <= range * 1.0001 && range - span <= (3.0 * usual).max(0.001 * range);
    let powers = (8..=32).map(|power| f64::from(power).exp2());
    let mut known = [TAU, 360.0].into_iter().chain(powers);
    let found = known.find(|range| near(*range));
    found.filter(|range| usual < 0.1 * range)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, largest: f64, whole: bool) -> LogColumn {
        LogColumn {
            range: [-largest, 0.9 * largest],
            whole,
            ..LogColumn::named(name)
        }
    }

    fn one(all: Vec<Unit>) -> Unit {
        all.into_iter().next().unwrap()
    }

    #[test]
    fn names_state_units_and_else_sizes_suggest_them() {
        let revolute = JointKind::Revolute;
        let position = |name: &str, largest, whole, kind| {
            one(of_positions(&[&column(name, largest, whole)], &[kind]))
        };
        let deg = position("act_pos_mot_deg_1", 2.0, false, revolute);
        assert_eq!((deg.unit, deg.check), (Some("deg"), None));
        assert_eq!(position("q1", 3.1, false, revolute), Unit::default());
        let guessed = position("q1", 170.0, false, revolute);
        assert!(guessed.unit == Some("deg") && guessed.check.is_some());
        let slide = position("q1", 400.5, false, JointKind::Prismatic);
        assert_eq!(slide.unit, Some("mm"));
        let counts = position("q1", 90_000.0, true, revolute);
        assert_eq!(counts.unit, Some("counts"));
        // a word that is a joint's, or a part's
        for names in [["q_base_turn", "q_upper"], ["q_rev_deg", "q_count"]] {
            let both = names.map(|name| column(name, 1.0, false));
            let found = of_positions(&[&both[0], &both[1]], &[revolute; 2]);
            assert_eq!(found, vec![Unit::default(); 2]);
        }
        let torque =
            |name: &str, largest, whole| one(of_torques(&[&column(name, largest, whole)], &[None]));
        for (name, largest, whole) in [
            ("load_torque_1", 2.5, false),
            ("Torque_A1", 2.5, false),
            ("torque_V1", 2.5, false),
            ("torque_nm_1", 2e3, true),
            ("tau_1", 150.3, false),
        ] {
            assert_eq!(torque(name, largest, whole), Unit::default(), "{name}");
        }
        assert_eq!(torque("tau_mnm_1", 2e3, false).unit, Some("mNm"));
        assert_eq!(torque("force_kN", 2.5, false).unit, Some("kN"));
        for (name, largest, whole) in [("tau_1", 87.0, true), ("load_percent_1", 8.3, false)] {
            let check = torque(name, largest, whole).check.unwrap();
            assert!(check.contains("percent"), "{check}");
        }
        assert_eq!(torque("tau_1", 150_300.5, false).scale, Some(1e-3));
        assert!(torque("actual_current_0", 4.0, false).drive);
        // beside the limits of the robot
        let tau = column("tau_1", 9000.5, false);
        let small = one(of_torques(&[&tau], &[Some(12.0)]));
        assert_eq!(small.scale, Some(1e-3));
    }

    #[test]
    fn an_encoder_of_one_turn_is_seen_to_begin_anew() {
        let motion = |k: u32| 5.0 * (f64::from(k) * 0.004).sin();
        let wrapped: Vec<f64> = (0..4000).map(|k| motion(k).rem_euclid(TAU)).collect();
        assert_eq!(wrap_of(&wrapped), Some(TAU));
        let degrees: Vec<f64> = wrapped.iter().map(|q| q.to_degrees() - 180.0).collect();
        assert_eq!(wrap_of(&degrees), Some(360.0));
        let plain: Vec<f64> = (0..4000).map(motion).collect();
        assert_eq!(wrap_of(&plain), None);
        let noise: Vec<f64> = (0..4000u32).map(|k| f64::from(k * 7919 % 1000)).collect();
        assert_eq!(wrap_of(&noise), None);
    }
}
