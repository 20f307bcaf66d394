//! Units that the names of columns state, or that their numbers suggest.

use std::f64::consts::TAU;

use super::column::LogColumn;
use super::urdf_joint::UrdfJoint;
use crate::inspect::words::{NamedDrive, drive, lists, words};
use crate::log::{POSITIONS, TORQUES, UnitKind, escape, is_label, spoken_unit, stated_unit};
use cft_ident_core::robot::JointKind;

/// Largest position that a joint in radians has where it does not turn on and on.
const MAX_POSITION_RAD: f64 = 1.2 * TAU;
/// Longest travel of a joint that slides \[m\].
const MAX_TRAVEL_M: f64 = 20.0;
/// Largest torque of a joint \[Nm\]: the largest arms stay below it.
const MAX_TORQUE_NM: f64 = 2e4;

/// Range of a number of 16 bits.
const WORD: f64 = 65_536.0;

/// A unit, as the keys of a joint in `[log.joint]` say it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unit {
    /// `position_unit` or `torque_unit`.
    pub unit: Option<&'static str>,
    /// `position_scale` or `torque_scale`.
    pub scale: Option<f64>,
    /// `position_offset`.
    pub offset: Option<f64>,
    /// The numbers suggest it and no name states it, or it is not enough: what to look at.
    pub check: Option<String>,
    /// It is a current or a voltage, not a torque.
    pub drive: bool,
}

/// A unit as a name states it, and what of it one number counts; or a text in brackets that is none.
#[derive(Debug, Clone, PartialEq)]
enum SaidUnit {
    Unit(&'static str, f64),
    Unknown(String),
}

/// Words that name parts of robots too: units in brackets alone.
const AMBIGUOUS: &str = "turn load count inc tick foot feet";

/// The units that the names of columns of one kind state: in words where all do; in `q_base_turn` it is the joint's.
fn stated_by_all(
    columns: &[&LogColumn],
    alike: &dyn Fn(usize, usize) -> bool,
    of: &[UnitKind],
) -> Vec<Option<SaidUnit>> {
    let each: Vec<_> = columns.iter().map(|column| said(column, of)).collect();
    let all = |k: usize| {
        let mut others = (0..each.len()).filter(|other| alike(k, *other));
        others.all(|other| each[other].is_some())
    };
    // what stands in brackets, is no unit and differs from joint to joint names them
    let same = |k: usize| {
        let mut others = (0..each.len()).filter(|other| *other != k);
        each.len() < 2 || others.any(|other| columns[other].unit == columns[k].unit)
    };
    let holds = |k: usize| match &each[k] {
        Some(SaidUnit::Unknown(_)) => same(k),
        _ => columns[k].unit.is_some() || all(k),
    };
    (0..each.len())
        .map(|k| each[k].clone().filter(|_| holds(k)))
        .collect()
}

/// What the name of a column says of its unit: in brackets, or in words that mean nothing else.
fn said(column: &LogColumn, of: &[UnitKind]) -> Option<SaidUnit> {
    let spoken = words(&column.name);
    if let Some(bracket) = column.unit.as_deref() {
        return match stated_unit(bracket, of) {
            Some(found) if of.contains(&found.unit.of) && !found.rate => {
                Some(SaidUnit::Unit(found.unit.label, found.times))
            }
            Some(found) => Some(SaidUnit::Unknown(found.shown())),
            None if is_label(bracket, &column.joint) => None,
            None => Some(SaidUnit::Unknown(bracket.to_owned())),
        };
    }
    let sure: Vec<&str> = spoken.iter().map(|word| word.text.as_str()).collect();
    let sure: Vec<&str> = sure
        .into_iter()
        .filter(|word| !lists(AMBIGUOUS, word))
        .collect();
    if sure.contains(&"grad") && of.contains(&UnitKind::Angle) {
        return Some(SaidUnit::Unknown("grad".to_owned()));
    }
    if let Some(unit) = spoken_unit(&sure, of) {
        return Some(SaidUnit::Unit(unit.label, 1.0));
    }
    // `current_mA` ends with it; in `MACur` it is the motor's actual one
    let last = spoken.iter().rfind(|word| word.number().is_none());
    let milli = last.is_some_and(|word| word.text == "ma" && spoken.len() > 1);
    (milli && of.contains(&UnitKind::Current)).then_some(SaidUnit::Unit("mA", 1.0))
}

fn stated(column: &LogColumn, of: &[UnitKind]) -> Option<&'static str> {
    match said(column, of)? {
        SaidUnit::Unit(unit, _) => Some(unit),
        SaidUnit::Unknown(_) => None,
    }
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
    let of_rate = |text: &str| Some(stated_unit(text, &POSITIONS)?.unit.label);
    let stated = match velocity.unit.as_deref() {
        Some(bracket) => of_rate(bracket),
        None => stated_position(velocity),
    };
    let stated = stated.filter(|unit| *unit != "rad" && *unit != "m");
    rpm || stated != position.filter(|unit| *unit != "rad" && *unit != "m")
}

/// Whether a derivative that is so many times its velocity is one of a part of a degree beside the same part of a radian.
pub(super) fn in_degrees(ratio: f64) -> bool {
    let power = (ratio.abs() / 1f64.to_degrees()).log10();
    (power - power.round()).abs() < 0.01
}

/// The part of a degree that whole numbers count, where the velocities beside them are in the same part of a radian: the
/// largest one by which every joint stays within its limits.
fn part_of_degree(columns: &[&LogColumn], joints: &[&UrdfJoint]) -> Option<&'static str> {
    let by_speed = |column: &&LogColumn| column.per_velocity.is_some_and(in_degrees);
    let other = |column: &&LogColumn| column.per_velocity.is_some_and(|ratio| !in_degrees(ratio));
    if !columns.iter().any(by_speed) || columns.iter().any(other) {
        return None;
    }
    let mut limited = columns.iter().zip(joints).filter_map(|(column, joint)| {
        let [low, high] = joint.position?;
        Some(column.span() / (high - low))
    });
    let first = limited.next()?;
    let most = limited.fold(first, f64::max);
    let parts = ["deg", "cdeg", "mdeg"].into_iter();
    let mut within = parts.filter(|unit| {
        let size = stated_unit(unit, &POSITIONS).map_or(1.0, |found| found.unit.size);
        most * size <= 1.0
    });
    within.next()
}

/// The units of the positions of all joints.
pub(super) fn of_positions(columns: &[&LogColumn], joints: &[&UrdfJoint]) -> Vec<Unit> {
    let kinds: Vec<JointKind> = joints.iter().map(|joint| joint.kind).collect();
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
        let part = part_of_degree(columns, joints);
        let (unit, check) = match (kind, part) {
            (JointKind::Revolute, Some(unit)) if whole => (
                unit,
                format!(
                    "{unit} is taken: whole numbers up to {turned} whose derivative is that of degrees beside velocities in radians, and {unit} is the largest unit in which every joint stays within its limits"
                ),
            ),
            _ if whole => (
                "counts",
                format!(
                    "whole numbers up to {}: counts? then give position_scale, rad or m per count",
                    turned.max(slid)
                ),
            ),
            (JointKind::Revolute, _) if turned > MAX_POSITION_RAD => (
                "deg",
                format!(
                    "deg is guessed: positions go to {turned:.0}, and no joint turns that far in rad"
                ),
            ),
            (JointKind::Prismatic, _) if slid > MAX_TRAVEL_M => (
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
    let each = columns.iter().zip(&kinds).zip(&stated);
    let length = |unit: &str| {
        stated_unit(unit, &POSITIONS).is_some_and(|found| found.unit.of == UnitKind::Length)
    };
    each.map(|((column, kind), stated)| match stated {
        None => guessed(*kind, column),
        Some(SaidUnit::Unknown(unit)) => Unit::unknown(column, unit, "position"),
        Some(SaidUnit::Unit("counts", _)) => Unit {
            check: Some("counts: give position_scale, rad or m per count".to_owned()),
            ..Unit::of("counts")
        },
        Some(SaidUnit::Unit(unit, times)) if length(unit) == (*kind == JointKind::Prismatic) => {
            Unit::times(unit, *times)
        }
        Some(SaidUnit::Unit(unit, _)) => Unit {
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
    let current = guessed_current(columns);
    let stated = stated_by_all(columns, &|_, _| true, &TORQUES);
    let of = |(k, column): (usize, &&LogColumn)| match (&stated[k], drive(&words(&column.name))) {
        (Some(SaidUnit::Unknown(unit)), _) => Unit::unknown(column, unit, "torque"),
        (Some(SaidUnit::Unit(unit, times)), _) => {
            let found = stated_unit(unit, &TORQUES).map(|found| found.unit.of);
            let check = match found {
                Some(UnitKind::Share) => Some("percent of a rated torque or current: give torque_scale of each joint, its rated torque [N or Nm] over 100".to_owned()),
                Some(UnitKind::Counts) => Some("counts of a drive: give torque_scale of each joint, N or Nm per count".to_owned()),
                _ => None,
            };
            let drive = matches!(
                found,
                Some(UnitKind::Current | UnitKind::Voltage | UnitKind::Share | UnitKind::Counts)
            );
            Unit {
                drive,
                check,
                ..Unit::times(unit, *times)
            }
        }
        (None, NamedDrive::Current) => current.clone(),
        (None, NamedDrive::Voltage) => driving("V"),
        // one sentence for all of them
        (None, _) => Unit {
            check: guessed.check.clone().filter(|_| k == 0),
            ..guessed.clone()
        },
    };
    columns.iter().enumerate().map(of).collect()
}

impl Unit {
    pub(super) fn of(unit: &'static str) -> Self {
        Self {
            unit: Some(unit),
            ..Self::default()
        }
    }

    /// A unit of which one number counts so much; SI units need no key.
    fn times(unit: &'static str, times: f64) -> Self {
        let plain = ["rad", "m", "N", "Nm"].contains(&unit);
        Self {
            unit: Some(unit).filter(|_| !plain),
            scale: Some(times).filter(|times| *times != 1.0),
            ..Self::default()
        }
    }

    fn unknown(column: &LogColumn, unit: &str, what: &str) -> Self {
        let name = escape(&column.name);
        let unit = escape(unit);
        let text = match &*unit {
            "grad" => format!(
                "`{name}` says grad, which is {what}_unit = \"grad\" (400 a turn) or, in German, \"deg\""
            ),
            _ => format!(
                "`{name}` is in {unit}, which is no {what} unit that is known: give {what}_scale, what one of it is in SI units"
            ),
        };
        Self {
            check: Some(text),
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

fn rated(what: &str, unit: &'static str, part: &str) -> Unit {
    Unit {
        check: Some(format!(
            "{what} then give torque_scale of each joint, its rated torque [N or Nm] over {part}; where they are Nm, torque_unit = \"Nm\""
        )),
        ..driving(unit)
    }
}

/// What the numbers of currents suggest, where no name says a unit.
fn guessed_current(columns: &[&LogColumn]) -> Unit {
    if !columns.iter().all(|column| column.whole) {
        return driving("A");
    }
    let most = columns.iter().map(|c| c.largest()).fold(0.0, f64::max);
    Unit {
        check: Some(format!(
            "whole numbers up to {most} that are called currents, and no name says amperes: counts of a drive? then give torque_scale of each joint, N or Nm per count; where they are milliamperes, torque_unit = \"mA\""
        )),
        ..driving("counts")
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
    if whole && most <= 3000.0 && columns.iter().any(|c| c.torque_wrap == Some(WORD)) {
        let what = format!(
            "whole numbers of 16 bits up to {most}: permille, as drives by CiA 402 give a torque?"
        );
        return rated(&what, "permille", "100");
    }
    if whole && most <= 300.0 {
        return rated(&format!("whole numbers up to {most}: percent?"), "%", "100");
    }
    if whole && most <= 3000.0 && known.iter().all(|ratio| *ratio > 1.5) {
        let what = format!("whole numbers up to {most}: thousandths of a rated torque?");
        return rated(&what, "permille", "100");
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

    fn joint(kind: JointKind) -> UrdfJoint {
        UrdfJoint {
            name: "a".to_owned(),
            kind,
            torque: None,
            position: Some([-2.6, 2.6]),
        }
    }

    fn one(all: Vec<Unit>) -> Unit {
        all.into_iter().next().unwrap()
    }

    #[test]
    fn names_state_units_and_else_sizes_suggest_them() {
        let revolute = JointKind::Revolute;
        let position = |name: &str, largest, whole, kind| {
            one(of_positions(
                &[&column(name, largest, whole)],
                &[&joint(kind)],
            ))
        };
        let deg = position("act_pos_mot_deg_1", 2.0, false, revolute);
        assert_eq!((deg.unit, deg.check), (Some("deg"), None));
        assert_eq!(position("q1", 3.1, false, revolute), Unit::default());
        let guessed = position("q1", 170.0, false, revolute);
        assert!(guessed.unit == Some("deg") && guessed.check.is_some());
        let slide = position("q1", 400.5, false, JointKind::Prismatic);
        assert_eq!(slide.unit, Some("mm"));
        let counts = position("q1", 90_000.0, true, revolute);
        assert_eq!((counts.unit, counts.scale), (Some("counts"), None));
        let by_speed = LogColumn {
            per_velocity: Some(57.31),
            ..column("q1", 90_000.0, true)
        };
        let found = one(of_positions(&[&by_speed], &[&joint(revolute)]));
        assert_eq!(found.unit, Some("mdeg"));
        // a word that is a joint's, or a part's
        for names in [["q_base_turn", "q_upper"], ["q_rev_deg", "q_count"]] {
            let both = names.map(|name| column(name, 1.0, false));
            let found = of_positions(&[&both[0], &both[1]], &[&joint(revolute); 2]);
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
        assert_eq!(torque("actual_current_0", 4.0, false), driving("A"));
        assert_eq!(torque("present_current", 137.0, true).unit, Some("counts"));
        let word = LogColumn {
            torque_wrap: Some(WORD),
            ..column("actual_torque", 164.0, true)
        };
        let permille = one(of_torques(&[&word], &[None]));
        assert_eq!(permille.unit, Some("permille"));
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
