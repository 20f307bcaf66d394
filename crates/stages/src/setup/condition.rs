//! The conditions under which a reading of a set-up is sure, each with the numbers that it compares.

use schemars::JsonSchema;
use serde::Serialize;

use super::LIMITS;
use cft_ident_core::judge::NUMBERS;
use cft_ident_core::number::{percent, significant};

/// What is asked of a reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SetupCriterion {
    /// A joint misses more of its torque than a machine does.
    Missed,
    /// With the reading it misses as little as sound machines do.
    Repaired,
    /// Joints that are driven by their friction, or have an inertia below zero, as declared.
    Driven,
    /// With the reading no joint is.
    NotDriven,
    /// The parts of the logs agree on what it takes off.
    PartsAgree,
    /// Readings of other channels that fit alike.
    NoOther,
    /// A value on no list that fits as well, in another place.
    NoValueBeside,
    /// Joints of the reading that move in proportion to others.
    MovesApart,
    /// A line of the robot file mends it.
    HasALine,
}

/// One condition of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetupCondition {
    pub criterion: SetupCriterion,
    /// Joint that it is about; none for all of them.
    pub joint: Option<usize>,
    /// What was found: an error as a share of the torque, an agreement 0..1, or a number of readings or joints.
    pub value: f64,
    /// What it is held against.
    pub limit: f64,
    pub holds: bool,
}

/// The same as it is reported.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DecidedBy {
    pub criterion: SetupCriterion,
    /// Null for all joints.
    pub joint: Option<String>,
    /// Null where it could not be computed.
    pub value: Option<f64>,
    pub limit: f64,
    pub holds: bool,
    /// The same in words.
    pub text: String,
}

impl SetupCondition {
    pub(super) fn new(
        criterion: SetupCriterion,
        joint: Option<usize>,
        [value, limit]: [f64; 2],
        holds: bool,
    ) -> Self {
        Self {
            criterion,
            joint,
            value,
            limit,
            holds,
        }
    }

    /// Of each joint that misses too much as declared: that it does, and what it misses with the reading.
    pub(super) fn of_errors(absurd: &[usize], [before, after]: [&[f64]; 2]) -> Vec<Self> {
        let of_joint = |j: &usize| {
            let joint = Some(*j);
            let missed = [before[*j], LIMITS.unexplained];
            let repaired = [after[*j], LIMITS.sound];
            [
                Self::new(SetupCriterion::Missed, joint, missed, true),
                Self::new(
                    SetupCriterion::Repaired,
                    joint,
                    repaired,
                    after[*j] <= LIMITS.sound,
                ),
            ]
        };
        absurd.iter().flat_map(of_joint).collect()
    }

    /// That as many as there are of something are none.
    pub(super) fn none_of(criterion: SetupCriterion, joint: Option<usize>, count: usize) -> Self {
        Self::new(criterion, joint, [count as f64, 0.0], count == 0)
    }

    /// That the parts of the logs agree.
    pub(super) fn agreement(agreed: f64) -> Self {
        let holds = agreed >= NUMBERS.confirmed;
        Self::new(
            SetupCriterion::PartsAgree,
            None,
            [agreed, NUMBERS.confirmed],
            holds,
        )
    }

    /// Whether all of these hold.
    pub(super) fn all_hold(conditions: &[Self]) -> bool {
        conditions.iter().all(|condition| condition.holds)
    }

    fn text(&self, name: &str) -> String {
        let [value, limit] = [self.value, self.limit].map(percent);
        let counted = |one: &str, many: &str| match self.value {
            1.0 => one.to_owned(),
            x => format!("{x} {many}"),
        };
        match (self.criterion, self.holds) {
            (SetupCriterion::Missed, _) if !self.value.is_finite() => {
                format!("{name} has positions that belong to no pose")
            }
            (SetupCriterion::Missed, _) => format!("{name} {value} > {limit}"),
            (SetupCriterion::Repaired, true) => format!("after the repair {value} <= {limit}"),
            (SetupCriterion::Repaired, false) => {
                format!("after the repair still {value} > {limit}")
            }
            (SetupCriterion::Driven, true) => "some friction or inertia cannot be".to_owned(),
            (SetupCriterion::Driven, false) => "all friction and inertia can be".to_owned(),
            (SetupCriterion::NotDriven, true) => {
                "after the repair all friction and inertia can be".to_owned()
            }
            (SetupCriterion::NotDriven, false) => {
                "after the repair some friction or inertia still cannot be".to_owned()
            }
            (SetupCriterion::PartsAgree, true) => "parts agree".to_owned(),
            (SetupCriterion::PartsAgree, false) => {
                let [s, least] = [self.value, self.limit].map(|x| significant(x, 2));
                format!("parts do not agree ({s} < {least})")
            }
            (SetupCriterion::NoOther, true) => "no other reading fits alike".to_owned(),
            (SetupCriterion::NoOther, false) => {
                counted("another reading fits alike", "other readings fit alike")
            }
            (SetupCriterion::NoValueBeside, true) => "no other value fits as well".to_owned(),
            (SetupCriterion::NoValueBeside, false) => "a value on no list fits as well".to_owned(),
            (SetupCriterion::MovesApart, true) => "the joints move apart".to_owned(),
            (SetupCriterion::MovesApart, false) => {
                format!("{name} moves in proportion to another joint")
            }
            (SetupCriterion::HasALine, true) => "a line of the robot file mends it".to_owned(),
            (SetupCriterion::HasALine, false) => "no line of the robot file mends it".to_owned(),
        }
    }

    /// As it is reported, `name` that of its joint.
    pub fn reported(&self, names: &[String]) -> DecidedBy {
        let joint = self.joint.and_then(|j| names.get(j));
        DecidedBy {
            criterion: self.criterion,
            value: self.value.is_finite().then_some(self.value),
            limit: self.limit,
            holds: self.holds,
            text: self.text(joint.map_or("", String::as_str)),
            joint: joint.cloned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_name_the_numbers_that_decide() {
        let names = ["q1", "q2"].map(str::to_owned);
        let mut all = SetupCondition::of_errors(&[1], [&[0.1, 0.66], &[0.1, 0.045]]);
        all.push(SetupCondition::agreement(0.9));
        let text = |all: &[SetupCondition]| -> Vec<String> {
            all.iter().map(|c| c.reported(&names).text).collect()
        };
        let expected = [
            "q2 66.0 % > 50.0 %",
            "after the repair 4.50 % <= 25.0 %",
            "parts agree",
        ];
        assert_eq!(text(&all), expected);
        assert!(SetupCondition::all_hold(&all));
        all.push(SetupCondition::none_of(SetupCriterion::NoOther, None, 2));
        assert_eq!(text(&all)[3], "2 other readings fit alike");
        assert!(!SetupCondition::all_hold(&all));
        let unknown = SetupCondition::of_errors(&[0], [&[f64::NAN, 0.0], &[0.3, 0.0]]);
        assert_eq!(unknown[0].reported(&names).value, None);
        assert!(!SetupCondition::all_hold(&unknown));
    }
}
