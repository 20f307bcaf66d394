//! `counterbalance`: a smooth moment over position, as of a spring or gas cylinder between two fixed
//! points, as a cubic B-spline over the travel that was seen; held at its end values beyond it.

use super::{Family, Key, Kind, Place, Role, Unit};
use crate::robot::JointKind;

/// Coefficients of the spline.
const COUNT: usize = 6;

pub const KIND: Kind = Kind {
    name: "counterbalance",
    family: Family::Position,
    role: Role::Columns,
    shape: &[
        Key::new("from", Unit::Position),
        Key::new("to", Unit::Position),
    ],
    linear: &[
        Key::new("m_1", Unit::Torque),
        Key::new("m_2", Unit::Torque),
        Key::new("m_3", Unit::Torque),
        Key::new("m_4", Unit::Torque),
        Key::new("m_5", Unit::Torque),
        Key::new("m_6", Unit::Torque),
    ],
    // a lever that turns
    places: |robot, _| {
        let turns = |j: &usize| robot.joint_kind(*j) == JointKind::Revolute;
        (0..robot.joints())
            .filter(turns)
            .map(Place::Joint)
            .collect()
    },
    starts: |cover, place| {
        let joint = cover.at(place);
        joint.is_wide()?;
        if joint.reversals < 4 {
            return Err("fewer than four sweeps over the travel".into());
        }
        Ok(vec![joint.position.to_vec()])
    },
    // the spline's ends are those of the travel: nothing to search
    limits: |cover, place| {
        let [low, high] = cover.at(place).position;
        vec![[low, low], [high, high]]
    },
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let width = (shape[1] - shape[0]).max(f64::MIN_POSITIVE);
        let pieces = (COUNT - 3) as f64;
        for (k, q) in scene.stretch.q[j].iter().enumerate() {
            let x = ((q - shape[0]) / width * pieces).clamp(0.0, pieces);
            let piece = (x as usize).min(COUNT - 4);
            for (i, b) in basis(x - piece as f64).into_iter().enumerate() {
                out[piece + i][k] = b;
            }
        }
    },
    separate_by: "a slow sweep over the whole travel, both ways, with two payloads",
};

/// The four uniform cubic B-splines on one piece, u in 0..1; they sum to 1.
fn basis(u: f64) -> [f64; 4] {
    let w = 1.0 - u;
    [
        w * w * w / 6.0,
        (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
        (3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0,
        u * u * u / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::basis;

    #[test]
    fn the_splines_share_out_one_and_join_smoothly() {
        for k in 0..=10 {
            let sum: f64 = basis(f64::from(k) / 10.0).iter().sum();
            assert!((sum - 1.0).abs() < 1e-15);
        }
        let (end, next) = (basis(1.0), basis(0.0));
        for i in 0..3 {
            assert!((end[i + 1] - next[i]).abs() < 1e-15);
        }
    }
}
