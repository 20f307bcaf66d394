//! A base that is turned so that gravity is along -z: readers skip what a file says of gravity.

use cft_ident_core::robot::tree::space::{Rotation, Vector, about, cross, dot, times};

/// The rotation that takes free fall along `gravity` to -z; none where it falls so already, or not at all.
pub(super) fn turned_base(gravity: &Vector) -> Option<Rotation> {
    let axis = cross(gravity, &[0.0, 0.0, -1.0]);
    let sine = length(&axis);
    match (sine > 0.0, gravity[2] > 0.0) {
        (true, _) => Some(about(&times(1.0 / sine, &axis), sine.atan2(-gravity[2]))),
        // it hangs from a ceiling
        (false, true) => Some([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
        (false, false) => None,
    }
}

/// Of a vector.
pub(super) fn length(gravity: &Vector) -> f64 {
    dot(gravity, gravity).sqrt()
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
            let wanted = [0.0, 0.0, -length(&gravity)];
            let off = (0..3)
                .map(|k| (turned[k] - wanted[k]).abs())
                .fold(0.0, f64::max);
            assert!(off < 1e-14, "{gravity:?}: {turned:?}");
        }
        assert_eq!(turned_base(&[0.0, 0.0, -9.81]), None);
        assert_eq!(turned_base(&[0.0; 3]), None);
    }
}
