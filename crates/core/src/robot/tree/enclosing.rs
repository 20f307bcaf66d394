//! A capsule that holds balls: points of a mesh, or the ends of other capsules.

use std::f64::consts::PI;

use nalgebra::Matrix3;

use super::space::{Vector, add, cross, dot, times};

/// Centre and radius \[m\] of a ball that holds points.
pub type BoundingBall = (Vector, f64);

/// Ends of the piece and radius \[m\] of a capsule.
pub type EnclosedPiece = ([Vector; 2], f64);

/// The smallest capsule that holds every ball among those along a direction of `axes`, unit vectors, or along a
/// principal axis of the centres: about the smallest circle that holds what is seen along it, no longer than the round
/// ends allow. `None` without balls.
pub fn enclosing(balls: &[BoundingBall], axes: &[Vector]) -> Option<EnclosedPiece> {
    let own = principal_axes(balls);
    let along = own.iter().chain(axes).map(|axis| of_axis(balls, axis));
    along
        .flatten()
        .min_by(|a, b| volume(a).total_cmp(&volume(b)))
}

/// \[m^3\]
pub fn volume((ends, radius): &EnclosedPiece) -> f64 {
    let along = add(&ends[1], &times(-1.0, &ends[0]));
    PI * radius * radius * (dot(&along, &along).sqrt() + 4.0 / 3.0 * radius)
}

/// Eigenvectors of the centres' covariance; none where they cannot be found.
fn principal_axes(balls: &[BoundingBall]) -> Vec<Vector> {
    let share = 1.0 / balls.len().max(1) as f64;
    let sum = |a: Vector, (centre, _): &BoundingBall| add(&a, &times(share, centre));
    let mean = balls.iter().fold([0.0; 3], sum);
    let mut covariance = Matrix3::zeros();
    for (centre, _) in balls {
        let d = nalgebra::Vector3::from(add(centre, &times(-1.0, &mean)));
        covariance += share * d * d.transpose();
    }
    let found = covariance.try_symmetric_eigen(f64::EPSILON, 1000);
    let axes = found
        .iter()
        .flat_map(|found| found.eigenvectors.column_iter());
    let axes = axes.filter_map(|axis| axis.try_normalize(0.0));
    axes.map(Into::into).collect()
}

/// The smallest capsule along one direction.
fn of_axis(balls: &[BoundingBall], axis: &Vector) -> Option<EnclosedPiece> {
    // the unit vector that lies most across, for directions across
    let least = (0..3).min_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs()))?;
    let mut unit = [0.0; 3];
    unit[least] = 1.0;
    let across = cross(axis, &unit);
    let e1 = times(1.0 / dot(&across, &across).sqrt(), &across);
    let e2 = cross(axis, &e1);
    let circles: Vec<BoundingCircle> = balls
        .iter()
        .map(|(centre, radius)| ([dot(centre, &e1), dot(centre, &e2)], *radius))
        .collect();
    let (middle, radius) = smallest_circle(&circles)?;
    // where the ends may lie at most and must lie at least
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for ((centre, own), (at, _)) in balls.iter().zip(&circles) {
        let along = dot(centre, axis);
        let off = (at[0] - middle[0]).hypot(at[1] - middle[1]);
        let round = ((radius - own).powi(2) - off * off).max(0.0).sqrt();
        low = low.min(along + round);
        high = high.max(along - round);
    }
    if low > high {
        // one ball holds all
        low = 0.5 * (low + high);
        high = low;
    }
    let foot = add(&times(middle[0], &e1), &times(middle[1], &e2));
    let end = |along: f64| add(&foot, &times(along, axis));
    Some(([end(low), end(high)], radius))
}

/// Centre and radius \[m\] of a circle in a plane.
type BoundingCircle = ([f64; 2], f64);

/// Rounds of the search for a smallest circle; few are needed, for each adds the farthest of all.
const ROUNDS: usize = 40;
/// Steps by which the middle of few circles is found: the radius is right to about one in so many.
const STEPS: usize = 1000;

/// About the smallest circle around all others (Badoiu, Clarkson 2003, Smaller core-sets for balls).
fn smallest_circle(circles: &[BoundingCircle]) -> Option<BoundingCircle> {
    let farthest = |among: &[BoundingCircle], middle: [f64; 2]| -> Option<(BoundingCircle, f64)> {
        let reach = |c: &BoundingCircle| (*c, (c.0[0] - middle[0]).hypot(c.0[1] - middle[1]) + c.1);
        let all = among.iter().map(reach);
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let mut few: Vec<BoundingCircle> = Vec::new();
    let mut middle = circles.first()?.0;
    let mut best = (middle, f64::INFINITY);
    for _ in 0..ROUNDS {
        let (outside, reach) = farthest(circles, middle)?;
        if reach < best.1 {
            best = (middle, reach);
        }
        if farthest(&few, middle).is_some_and(|(_, inner)| inner >= reach) {
            break;
        }
        few.push(outside);
        middle = few[0].0;
        for step in 1..=STEPS {
            let ((at, radius), reach) = farthest(&few, middle)?;
            // the far point of that circle
            let toward = match reach > radius {
                true => reach / (reach - radius),
                false => 0.0,
            };
            for (middle, at) in middle.iter_mut().zip(at) {
                *middle += toward * (at - *middle) / (step + 1) as f64;
            }
        }
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use super::super::capsule::of_pieces;
    use super::super::space::{UNTURNED, of_roll_pitch_yaw, turn};
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn holds(piece: &EnclosedPiece, ball: &BoundingBall) -> bool {
        let off = of_pieces(&piece.0, &[ball.0, ball.0]);
        off + ball.1 <= piece.1 + 1e-12
    }

    #[test]
    fn a_capsule_holds_every_ball_that_it_was_made_for() {
        let mut chance = ChaCha8Rng::seed_from_u64(7);
        for case in 0..200 {
            let mut number = |size: f64| -> f64 { size * chance.random_range(-1.0..1.0) };
            // clouds, plates, rods and points that are all one
            let sizes = [[1.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]][case % 4];
            let turned = of_roll_pitch_yaw(&std::array::from_fn(|_| number(3.0)));
            let count = [1, 2, 3, 50, 400][case % 5];
            let with_radius = case % 3 == 0;
            let balls: Vec<BoundingBall> = (0..count)
                .map(|_| {
                    let at = std::array::from_fn(|k| number(sizes[k]) + 3.0);
                    let radius = number(1.0).abs();
                    (turn(&turned, &at), if with_radius { radius } else { 0.0 })
                })
                .collect();
            let piece = enclosing(&balls, &UNTURNED).expect("there are balls");
            assert!(balls.iter().all(|ball| holds(&piece, ball)), "{case}");
        }
        assert_eq!(enclosing(&[], &UNTURNED), None);
    }

    #[test]
    fn a_turned_capsule_is_found_again_and_a_box_as_trigonometry_has_it() {
        let turned = of_roll_pitch_yaw(&[0.4, -1.1, 2.0]);
        let ends = [[0.1, -0.2, 0.3], [0.1, -0.2, 0.9]].map(|end| turn(&turned, &end));
        let balls: Vec<BoundingBall> = ends.iter().map(|end| (*end, 0.07)).collect();
        let (found, radius) = enclosing(&balls, &[]).expect("two balls");
        assert!((radius - 0.07).abs() < 1e-9, "{radius}");
        let near = |a: &Vector, b: &Vector| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-6);
        assert!(
            near(&found[0], &ends[0]) && near(&found[1], &ends[1])
                || near(&found[0], &ends[1]) && near(&found[1], &ends[0])
        );
        // corners of 0.06 by 0.08 by 0.5: half a diagonal of the section; a corner touches the round end
        let corner = |k: u32| -> BoundingBall {
            let side = |bit: u32, half: f64| if k & bit == 0 { -half } else { half };
            (
                turn(&turned, &[side(1, 0.03), side(2, 0.04), side(4, 0.25)]),
                0.0,
            )
        };
        let corners: Vec<BoundingBall> = (0..8).map(corner).collect();
        let (ends, radius) = enclosing(&corners, &[]).expect("eight corners");
        let length = of_pieces(&[ends[0]; 2], &[ends[1]; 2]);
        assert!(
            (radius - 0.05).abs() < 1e-4 && (length - 0.5).abs() < 0.01,
            "{radius} {length}"
        );
    }

    #[test]
    fn the_circle_about_points_is_within_a_thousandth_of_the_smallest() {
        let mut chance = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..50 {
            let mut number = || -> f64 { chance.random_range(-1.0..1.0) };
            let points: Vec<BoundingCircle> =
                (0..30).map(|_| ([number(), 0.3 * number()], 0.0)).collect();
            let (_, found) = smallest_circle(&points).expect("points");
            // the smallest is that of two or three of them which holds all
            let mut least = f64::INFINITY;
            for (i, a) in points.iter().enumerate() {
                for (j, b) in points.iter().enumerate().skip(i + 1) {
                    let two = [0.5 * (a.0[0] + b.0[0]), 0.5 * (a.0[1] + b.0[1])];
                    let three = points[j + 1..].iter().filter_map(|c| about(a.0, b.0, c.0));
                    for middle in three.chain([two]) {
                        let off =
                            |p: &BoundingCircle| (p.0[0] - middle[0]).hypot(p.0[1] - middle[1]);
                        least = least.min(points.iter().map(off).fold(0.0, f64::max));
                    }
                }
            }
            assert!(
                found >= least * (1.0 - 1e-12) && found < least * 1.002,
                "{found} {least}"
            );
        }
    }

    /// Middle of the circle through three points.
    fn about(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<[f64; 2]> {
        let [p, q] = [b, c].map(|to| [to[0] - a[0], to[1] - a[1]]);
        let area = 2.0 * (p[0] * q[1] - p[1] * q[0]);
        let [p2, q2] = [p, q].map(|d| d[0] * d[0] + d[1] * d[1]);
        let off = [
            (q[1] * p2 - p[1] * q2) / area,
            (p[0] * q2 - q[0] * p2) / area,
        ];
        (area != 0.0).then_some([a[0] + off[0], a[1] + off[1]])
    }
}
