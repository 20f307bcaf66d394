//! What a motion must keep, all along: one channel per bounded quantity.

use schemars::JsonSchema;
use serde::Serialize;

/// What is bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Of a designed coordinate \[m or rad\].
    Position,
    /// \[m/s or rad/s\]
    Speed,
    /// \[m/s^2 or rad/s^2\]
    Acceleration,
    /// Volts, or the torque where the motors are at the joints.
    Drive,
    /// Of a joint \[N or N m\].
    Torque,
    /// \[m or rad\]
    JointPosition,
    /// \[m/s or rad/s\]
    JointSpeed,
    /// \[m/s^2 or rad/s^2\]
    JointAcceleration,
    /// sin q5 of the CFT robot, which vanishes where links 4 and 5 are in line; 1 elsewhere.
    Clearance,
    /// Of a point along an axis of the base \[m\]; the index is three times the point's, and the axis.
    PointPosition,
    /// Of a point above the floor \[m\].
    Height,
    /// Of the capsules of two links \[m\].
    Distance,
}

impl Quantity {
    /// Which derivative of a coordinate it is; of these all are linear in the coefficients of the series.
    #[inline]
    pub(super) fn derivative(self) -> Option<usize> {
        let all = [Self::Position, Self::Speed, Self::Acceleration];
        all.into_iter().position(|of| of == self)
    }

    pub(super) fn is_linear(self) -> bool {
        self.derivative().is_some()
    }

    /// Whether it takes the masses of the links to foresee it.
    pub(super) fn is_of_torque(self) -> bool {
        matches!(self, Self::Drive | Self::Torque)
    }

    /// Whether it says where links are, and so bounds no coordinate alone.
    pub(super) fn is_of_places(self) -> bool {
        matches!(
            self,
            Self::Clearance | Self::PointPosition | Self::Height | Self::Distance
        )
    }

    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Position | Self::JointPosition | Self::PointPosition => "position",
            Self::Speed | Self::JointSpeed => "speed",
            Self::Acceleration | Self::JointAcceleration => "acceleration",
            Self::Drive => "volts",
            Self::Torque => "torque",
            Self::Clearance => "sin q5",
            Self::Height => "height",
            Self::Distance => "distance",
        }
    }

    /// The word where the unit is known: what a drive takes is called by it.
    pub fn called(self, unit: &str) -> &'static str {
        match self {
            Self::Drive if unit != "V" => "torque",
            quantity => quantity.name(),
        }
    }
}

/// One bounded quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundedQuantity {
    pub quantity: Quantity,
    /// Coordinate or joint, from 0.
    pub index: usize,
    /// Its name.
    pub name: String,
    pub unit: String,
    /// The least that is allowed; negative infinity where nothing bounds it.
    pub lower: f64,
    /// The most that is allowed.
    pub upper: f64,
    /// The robot file gives none: it is what the logs of the model reached.
    pub from_logs: bool,
}

impl BoundedQuantity {
    /// A channel bounded to `-most..=most`.
    pub fn symmetric(quantity: Quantity, index: usize, name: &str, unit: &str, most: f64) -> Self {
        Self::between(quantity, index, name, unit, [-most, most])
    }

    pub(super) fn between(
        quantity: Quantity,
        index: usize,
        name: &str,
        unit: &str,
        [lower, upper]: [f64; 2],
    ) -> Self {
        Self {
            quantity,
            index,
            name: name.to_owned(),
            unit: unit.to_owned(),
            lower,
            upper,
            from_logs: false,
        }
    }

    /// The channel of a quantity of a coordinate or joint.
    pub(super) fn find(all: &[Self], quantity: Quantity, index: usize) -> Option<&Self> {
        all.iter()
            .find(|c| c.quantity == quantity && c.index == index)
    }

    pub(super) fn middle(&self) -> f64 {
        0.5 * (self.upper + self.lower)
    }

    /// What a share of 1 stands for.
    pub(super) fn room(&self) -> f64 {
        match self.upper.is_finite() {
            true => 0.5 * (self.upper - self.lower),
            false => self.lower,
        }
    }

    /// The same with `share` of the room taken away at each side: of half the span, or of the
    /// least where nothing bounds it above.
    pub fn reserved(&self, share: f64) -> Self {
        let mut out = self.clone();
        if self.upper.is_finite() {
            out.lower += share * self.room();
            out.upper -= share * self.room();
        } else {
            out.lower *= 1.0 + share;
        }
        out
    }

    /// How much of what is allowed the value takes: 1 at a limit, above 1 beyond it.
    #[inline]
    pub fn used(&self, value: f64) -> f64 {
        if self.upper.is_finite() {
            (value - self.middle()).abs() / self.room()
        } else if value > 0.0 {
            self.lower / value
        } else {
            f64::INFINITY
        }
    }

    /// The constraints g <= 0 of a value as pairs (g, dg/dvalue): one for each bounded side.
    #[inline]
    pub(super) fn constraints(&self, value: f64) -> [(f64, f64); 2] {
        if self.upper.is_finite() {
            let half = self.room();
            let g = (value - self.middle()) / half;
            [(g - 1.0, 1.0 / half), (-g - 1.0, -1.0 / half)]
        } else {
            let slope = 1.0 / self.lower;
            [(1.0 - value * slope, -slope), (f64::NEG_INFINITY, 0.0)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn position() -> BoundedQuantity {
        BoundedQuantity::between(Quantity::Position, 0, "x_c4", "m", [-0.1, 0.5])
    }

    #[test]
    fn use_of_a_limit_is_one_at_the_limit_on_either_side() {
        let channel = position();
        for (value, used) in [(-0.1, 1.0), (0.5, 1.0), (0.2, 0.0)] {
            assert!((channel.used(value) - used).abs() < 1e-12, "{value}");
        }
        let reserved = channel.reserved(0.1);
        assert!((reserved.lower + 0.07).abs() < 1e-12 && (reserved.upper - 0.47).abs() < 1e-12);
        let open = [0.2, f64::INFINITY];
        let clearance = BoundedQuantity::between(Quantity::Clearance, 0, "q5", "", open);
        let used = [0.2, 0.4, -0.1].map(|value| clearance.used(value));
        assert_eq!(used, [1.0, 0.5, f64::INFINITY]);
        assert!(clearance.reserved(0.1).lower > 0.2);
    }

    #[test]
    fn constraints_change_sign_at_the_limit_and_know_their_slope() {
        for value in [-0.2, 0.1, 0.55] {
            let here = position().constraints(value);
            let there = position().constraints(value + 1e-6);
            for (a, b) in here.iter().zip(there) {
                assert!(((b.0 - a.0) / 1e-6 - a.1).abs() < 1e-6);
            }
            let most = here[0].0.max(here[1].0);
            assert!((most - (position().used(value) - 1.0)).abs() < 1e-12);
        }
    }
}
