//! A base that is turned so that gravity is along -z: readers skip what a file says of gravity.

use cft_ident_core::number;
use cft_ident_core::robot::tree::space::{Rotation, UNTURNED, Vector, about, cross, dot, times};

use super::arm::{Arm, FormatSupport};

/// Acceleration of free fall that readers take where they skip what the file says \[m/s^2\].
pub(super) const EARTH: f64 = 9.81;

/// The rotation that takes free fall along `gravity` to -z; none where it falls so already, or not at all.
pub(super) fn turned_base(gravity: &Vector) -> Option<Rotation> {
    let axis = cross(gravity, &[0.0, 0.0, -1.0]);
    let sine = size(&axis);
    match (sine > 0.0, gravity[2] > 0.0) {
        (true, _) => Some(about(&times(1.0 / sine, &axis), sine.atan2(-gravity[2]))),
        // it hangs from a ceiling
        (false, true) => Some([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
        (false, false) => None,
    }
}

fn size(gravity: &Vector) -> f64 {
    dot(gravity, gravity).sqrt()
}

impl Arm {
    /// How the base stands in the world of the file.
    pub(super) fn standing(&self) -> Rotation {
        self.turn.unwrap_or(UNTURNED)
    }

    /// Free fall in the world of the file \[m/s^2\].
    pub fn world_gravity(&self) -> Vector {
        match self.turn {
            Some(_) => [0.0, 0.0, -size(&self.gravity)],
            None => self.gravity,
        }
    }

    /// Free fall in the frame of the base less that which readers take who skip what a file says; none where it is one.
    pub(super) fn gravity_skipped(&self) -> Option<Vector> {
        let [x, y, z] = self.gravity;
        let taken = match self.turn {
            Some(_) => times(EARTH / size(&self.gravity), &self.gravity),
            None => [0.0, 0.0, -EARTH],
        };
        let off = [x - taken[0], y - taken[1], z - taken[2]];
        // gravity of sixteen digits is that of the earth
        (size(&off) > 1e-12 * EARTH).then_some(off)
    }

    /// What is said of it where a format's readers skip it.
    pub(super) fn gravity_said(&self, says: FormatSupport) -> Option<(String, Vector)> {
        let (who, off) = says.gravity_skipped_by.zip(self.gravity_skipped())?;
        let [x, y, z] = self.world_gravity().map(|x| number::significant(x, 6));
        Some((
            format!(
                "gravity along ({x}, {y}, {z}) m/s^2, for which {who} (0, 0, -9.81): set it there"
            ),
            off,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_core::robot::tree::space::turn;

    #[test]
    fn free_fall_is_turned_to_minus_z_from_wherever_it_points() {
        for gravity in [
            [-9.81, 0.0, 0.0],
            [0.0, 0.0, 9.81],
            [-6.0, 2.0, -7.5],
            [1e-9, 0.0, 1.62],
            [0.1, 0.0, -9.81],
        ] {
            let turned = turn(&turned_base(&gravity).unwrap(), &gravity);
            let wanted = [0.0, 0.0, -size(&gravity)];
            let off = (0..3)
                .map(|k| (turned[k] - wanted[k]).abs())
                .fold(0.0, f64::max);
            assert!(off < 1e-14, "{gravity:?}: {turned:?}");
        }
        assert_eq!(turned_base(&[0.0, 0.0, -9.81]), None);
        assert_eq!(turned_base(&[0.0; 3]), None);
    }
}
