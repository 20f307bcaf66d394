//! What the masses and limits of the robot file say of its torques.

use super::{SetupWords, hint};
use crate::setup::ChannelKind::Torque;
use crate::setup::{
    Change, Finding, FindingKind, FindingSeverity, LIMITS, Problem, Setting, Weight, WeightGain,
};
use cft_ident_core::number::significant;

impl SetupWords<'_> {
    /// What the file's own masses say of the torques, and whether they hold a weight at all.
    pub(super) fn weight(&self, all: &[Weight], without: Option<&[Vec<f64>; 2]>) -> Vec<Finding> {
        // a joint whose gain could be any says nothing
        let shows = |of: fn(&Weight) -> WeightGain, way: f64| {
            all.iter().any(|w| of(w).is_off(way)) && !all.iter().any(|w| of(w).is_not_off(way))
        };
        let off = |way: f64| shows(|w| w.weight, way);
        let moves = |way: f64| shows(|w| w.motion, way);
        let way = if off(-1.0) { -1.0 } else { 1.0 };
        let list = |of: fn(&Weight) -> WeightGain| -> String {
            let each = all.iter().map(|w| {
                let gain = of(w);
                let [low, high] = gain.interval_95.map(|x| significant(x, 3));
                let value = significant(gain.value, 3);
                format!(
                    "{} {value} times (95 % CI {low} to {high})",
                    self.joints[w.joint]
                )
            });
            each.collect::<Vec<_>>().join(", ")
        };
        let gravity = [self.gravity, [0.0; 3]].map(Setting::Vector);
        if off(way) && moves(way) {
            let meaning = format!(
                "the torques show another weight than the masses of the robot file: {}; is the channel a current, a percentage, the motor's side of a gear, or in another unit?",
                list(|w| w.weight)
            );
            let mean = all.iter().map(|w| w.weight.value).sum::<f64>() / all.len() as f64;
            let values = [1.0, mean].map(Setting::Number);
            return vec![Finding {
                channel: Some(Torque),
                severity: FindingSeverity::Warning,
                ..hint(FindingKind::Scale, None, values, meaning)
            }];
        }
        let some = self.some_off(all);
        if !some.is_empty() {
            return some;
        }
        let meaning = match (off(-1.0), without) {
            (true, _) => format!(
                "gravity is not in these torques, though the masses of the file ask for it: {}. A driver that takes it off (write `gravity = [0.0, 0.0, 0.0]`), or springs and counterweights that balance it? These data do not tell; the current of a pose that is held, as the drive measures it, does",
                list(|w| w.weight)
            ),
            (false, Some(_)) if all.is_empty() => "gravity hardly shows in these torques: balanced, or taken off by the driver; `gravity = [0.0, 0.0, 0.0]` fits as well with fewer parameters".to_owned(),
            _ => return Vec::new(),
        };
        let finding = hint(FindingKind::Gravity, None, gravity, meaning);
        vec![match without {
            Some(errors) => self.with_errors(errors, finding),
            None => finding,
        }]
    }

    /// Joints that show another weight than their masses, and what moves them likewise, beside others that do not.
    fn some_off(&self, all: &[Weight]) -> Vec<Finding> {
        let off = |w: &&Weight| {
            [-1.0, 1.0]
                .iter()
                .any(|way| w.weight.is_off(*way) && w.motion.is_off(*way))
        };
        let of = |w: &Weight| {
            let joint = self.joints[w.joint].clone();
            let [low, high] = w.weight.interval_95.map(|x| significant(x, 3));
            let gain = w.weight.value;
            let thousand = [1e-3, 1e3]
                .into_iter()
                .find(|f| (gain * f).ln().abs() < LIMITS.yardstick.ln() / 2.0);
            let meaning = format!(
                "the torque of {joint} shows {} times the weight of its masses in the robot file (95 % CI {low} to {high}), and those of other joints theirs: in another unit, or on the motor's side of a gear?",
                significant(gain, 3)
            );
            let found = thousand.unwrap_or(gain.recip());
            let plain = hint(
                FindingKind::Scale,
                Some(joint),
                [1.0, found].map(Setting::Number),
                meaning,
            );
            let plain = Finding {
                channel: Some(Torque),
                ..plain
            };
            match thousand {
                Some(f) => Finding {
                    severity: FindingSeverity::Warning,
                    remedy: self.remedy(&Change::Scale(Torque, vec![w.joint], f)),
                    ..plain
                },
                None => plain,
            }
        };
        all.iter().filter(off).map(of).collect()
    }

    /// Torques beyond what the file says the joints can have.
    pub(super) fn limits(&self, problem: &Problem) -> Option<Finding> {
        let rms = problem.sample.rms(|row| row.tau);
        let most = |j: usize| problem.known.torque.get(j).copied().flatten();
        let beyond = |j: &usize| most(*j).is_some_and(|most| rms[*j] > LIMITS.yardstick * most);
        let joints: Vec<usize> = (0..rms.len()).filter(beyond).collect();
        let first = *joints.first()?;
        let names: Vec<&str> = joints.iter().map(|j| self.names[*j].as_str()).collect();
        let meaning = format!(
            "the torque of {} is beyond its limit in the robot file ({}: {} on average, limit {}): another unit, such as mNm?",
            names.join(", "),
            names[0],
            significant(rms[first], 3),
            significant(most(first)?, 3)
        );
        let joint = (joints.len() == 1).then(|| names[0].to_owned());
        let values = [1.0, 1e-3].map(Setting::Number);
        Some(Finding {
            channel: Some(Torque),
            severity: FindingSeverity::Warning,
            remedy: self.remedy(&Change::Scale(Torque, joints, 1e-3)),
            ..hint(FindingKind::Scale, joint, values, meaning)
        })
    }
}
