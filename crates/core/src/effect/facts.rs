//! What an effect that was found is called by a person who knows machines: `ripple of q1, 2.5 mm pitch`.

use super::CurveSignal;
use crate::number;
use crate::robot::JointKind;

/// An effect with its numbers, for the words of its entry.
#[derive(Debug, Clone)]
pub struct EffectFacts {
    /// Joint or screw that it sits at; `all joints`.
    pub at: String,
    /// The other joint, whose motion counts too.
    pub with: String,
    pub kind: JointKind,
    /// Key, value and unit of its numbers.
    pub numbers: Vec<(String, f64, String)>,
    /// The signal that a curve is drawn over, and its peak.
    pub curve: Option<(CurveSignal, f64)>,
    /// Unit of the torque.
    pub torque: String,
}

impl EffectFacts {
    /// The number of a key; not a number where there is none.
    pub fn value(&self, key: &str) -> f64 {
        let found = self.numbers.iter().find(|(k, _, _)| k == key);
        found.map_or(f64::NAN, |(_, value, _)| *value)
    }

    /// The number of a key with its unit, without its sign.
    pub fn size(&self, key: &str) -> String {
        let found = self.numbers.iter().find(|(k, _, _)| k == key);
        let unit = found.map_or("", |(_, _, unit)| unit.as_str());
        with_unit(self.value(key).abs(), unit)
    }

    /// Two numbers of one unit together, as one with that unit.
    pub(crate) fn sum(&self, one: &str, other: &str) -> String {
        let found = self.numbers.iter().find(|(k, _, _)| k == one);
        let unit = found.map_or("", |(_, _, unit)| unit.as_str());
        with_unit((self.value(one) + self.value(other)).abs(), unit)
    }

    /// The amplitude of a wave with its unit.
    pub(crate) fn amplitude(&self) -> String {
        with_unit(self.value("sin").hypot(self.value("cos")), &self.torque)
    }

    /// How often a wave repeats: `2.5 mm pitch`, `18 waves a turn`.
    pub(crate) fn wave(&self) -> String {
        let order = self.value("order");
        match self.kind {
            JointKind::Prismatic => format!("{} pitch", length(1.0 / order)),
            JointKind::Revolute => {
                let order = number::significant(order, 3);
                let whole = order.strip_suffix(".0").unwrap_or(&order);
                format!("{whole} waves a turn")
            }
        }
    }
}

fn with_unit(value: f64, unit: &str) -> String {
    let value = number::significant(value, 3);
    format!("{value} {unit}").trim_end().to_owned()
}

/// A length \[m\] in the unit that a workshop has for it.
fn length(metres: f64) -> String {
    match metres.abs() < 1.0 {
        true => format!("{} mm", number::significant(1e3 * metres, 3)),
        false => format!("{} m", number::significant(metres, 3)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_is_named_by_its_pitch_on_a_slide_and_by_its_number_on_a_turning_joint() {
        let number = |key: &str, value| (key.to_owned(), value, "N".to_owned());
        let mut facts = EffectFacts {
            at: "q1".into(),
            with: String::new(),
            kind: JointKind::Prismatic,
            numbers: vec![
                number("order", 400.0),
                number("sin", -3.0),
                number("cos", 4.0),
            ],
            curve: None,
            torque: "N".into(),
        };
        assert_eq!(facts.wave(), "2.50 mm pitch");
        assert_eq!(facts.amplitude(), "5.00 N");
        assert_eq!(facts.size("sin"), "3.00 N");
        facts.kind = JointKind::Revolute;
        facts.numbers[0].1 = 18.0;
        assert_eq!(facts.wave(), "18 waves a turn");
    }
}
