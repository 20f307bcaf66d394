//! What held poses do not determine of the body, and the pose that would.

use nalgebra::{DMatrix, SymmetricEigen};
use schemars::JsonSchema;
use serde::Serialize;

use super::equations::{LinearisedAt, RowEquations};
use super::fit::WrenchProblem;
use super::physics::columns;
use super::wrench_log::{PoseRow, of_turn, quaternion_of, turned_back};
use super::{GRAVITY, NUMBERS};
use cft_ident_core::robot::tree::space::{UNTURNED, Vector, cross, dot};

/// A pose that would tell most beside those that are there.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NextPose {
    /// Direction in which gravity is to point, along the sensor's axes.
    pub gravity_along: [f64; 3],
    /// Such an orientation of the sensor in the base frame: x y z w.
    pub quaternion: [f64; 4],
    /// What the variance of the least known number falls to, as a part.
    pub variance_left: f64,
}

/// Directions that are tried: those with whole numbers -1, 0 and 1.
fn directions() -> impl Iterator<Item = Vector> {
    let one = [-1.0, 0.0, 1.0];
    let all = one.into_iter().flat_map(move |x| {
        one.into_iter()
            .flat_map(move |y| one.into_iter().map(move |z| [x, y, z]))
    });
    all.filter_map(|d| {
        let length = dot(&d, &d).sqrt();
        (length > 0.0).then(|| d.map(|x| x / length))
    })
}

/// Orientation of a sensor that gravity passes along `direction`, turned as little as can be.
fn orientation(direction: &Vector) -> [f64; 4] {
    // R direction = -z: turn about the axis between both
    let down = [0.0, 0.0, -1.0];
    let axis = cross(direction, &down);
    let (sine, cosine) = (dot(&axis, &axis).sqrt(), dot(direction, &down));
    let turn = match (sine > 1e-9, cosine > 0.0) {
        (true, _) => axis.map(|x| x / sine * sine.atan2(cosine)),
        (false, true) => [0.0; 3],
        (false, false) => [std::f64::consts::PI, 0.0, 0.0],
    };
    quaternion_of(&of_turn(&turn))
}

/// Information about the body, the bias being unknown: Schur complement of its part of the normal matrix.
fn of_body(normal: &DMatrix<f64>, bias: usize) -> DMatrix<f64> {
    let body = super::search::BODY;
    let b = body.len();
    let own = normal.view((0, 0), (b, b)).into_owned();
    let cross = normal.view((0, bias), (b, 6)).into_owned();
    let of_bias = normal.view((bias, bias), (6, 6)).into_owned();
    match of_bias.try_inverse() {
        Some(inverse) => own - &cross * inverse * cross.transpose(),
        None => own,
    }
}

/// Unit in which a number of the body is counted beside others: a kilogram, and a kilogram at the lever.
fn scaled(information: &DMatrix<f64>) -> DMatrix<f64> {
    let unit = |k: usize| if k == 0 { 1.0 } else { NUMBERS.lever_m };
    DMatrix::from_fn(4, 4, |i, j| unit(i) * unit(j) * information[(i, j)])
}

/// Names of what the poses leave open; empty where they determine all. `normal` is that of the model without effects.
pub(super) fn undetermined(normal: &DMatrix<f64>, bias: usize, rows: usize) -> Vec<String> {
    let eigen = SymmetricEigen::new(scaled(&of_body(normal, bias)));
    // a number is open where poses spread less than those that are called alike
    let per_row = (GRAVITY * NUMBERS.least_turn).powi(2) * rows as f64;
    let weight = normal[(bias, bias)] / rows.max(1) as f64;
    let weight_moment = normal[(bias + 3, bias + 3)] / rows.max(1) as f64;
    let mut open = Vec::new();
    for k in 0..4 {
        let along = eigen.eigenvectors.column(k);
        let of_mass = along[0].abs() > 0.7;
        let least = match of_mass {
            true => weight * per_row,
            false => weight_moment * per_row * NUMBERS.lever_m.powi(2),
        };
        if eigen.eigenvalues[k] >= least {
            continue;
        }
        open.push(match of_mass {
            true => "mass".to_owned(),
            false => {
                let part = |i: usize| along[1 + i];
                let main = (0..3).filter(|i| part(*i).abs() > 0.1);
                let sign = if (0..3).map(part).sum::<f64>() < 0.0 {
                    -1.0
                } else {
                    1.0
                };
                let words: Vec<String> = main
                    .map(|i| format!("{:+.1} {}", sign * part(i), ["x", "y", "z"][i]))
                    .collect();
                match words.len() {
                    1 => format!("centre along {}", &words[0][words[0].len() - 1..]),
                    _ => format!("centre along {}", words.join(" ")),
                }
            }
        });
    }
    open
}

/// The pose that tells most of what is known least.
pub(super) fn next_pose(problem: &WrenchProblem, normal: &DMatrix<f64>) -> Option<NextPose> {
    let bias = problem.base.bias();
    let [wf, wt] = problem.weights;
    let p = problem.base.len();
    let least = |normal: &DMatrix<f64>| {
        let eigen = SymmetricEigen::new(scaled(&of_body(normal, bias)));
        eigen.eigenvalues.min().max(f64::MIN_POSITIVE)
    };
    let now = least(&normal.view((0, 0), (p, p)).into_owned());
    let at = LinearisedAt {
        mass: 0.0,
        first_moment: [0.0; 3],
        turn: UNTURNED,
        lean: [0.0; 2],
    };
    let with = |direction: Vector| {
        let quaternion = orientation(&direction);
        let row = PoseRow {
            number: 0,
            t: 0.0,
            rotation: super::wrench_log::of_quaternion(quaternion),
            position: None,
            away: None,
            force: [0.0; 3],
            moment: [0.0; 3],
            acceleration: [0.0; 3],
            turning: [[0.0; 3]; 2],
        };
        let mut numbers = vec![0.0; 6 * p];
        let mut out = RowEquations {
            p,
            numbers: &mut numbers,
        };
        columns(&row, 0.0, problem.base, &[], &at, &mut out);
        let weight = |i: usize| if i < 3 { wf } else { wt };
        let a = DMatrix::from_fn(6, p, |i, j| weight(i) * numbers[i * p + j]);
        let after = least(&(normal.view((0, 0), (p, p)).into_owned() + a.tr_mul(&a)));
        NextPose {
            gravity_along: turned_back(&row.rotation, &[0.0, 0.0, -1.0]),
            quaternion,
            variance_left: now / after,
        }
    };
    let all = directions().map(with);
    let best = all.min_by(|a, b| a.variance_left.total_cmp(&b.variance_left))?;
    (best.variance_left < 1.0).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_passes_a_sensor_as_the_next_pose_says() {
        for direction in directions() {
            let r = super::super::wrench_log::of_quaternion(orientation(&direction));
            let found = turned_back(&r, &[0.0, 0.0, -1.0]);
            for (a, b) in found.iter().zip(direction) {
                assert!((a - b).abs() < 1e-9, "{direction:?}: {found:?}");
            }
        }
    }
}
