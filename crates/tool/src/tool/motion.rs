//! Velocity and acceleration of the sensor, where it moves: a parabola through the rows around each row, and the
//! wrench through the same (Savitzky and Golay 1964), so that both are smoothed alike.

use cft_ident_core::robot::tree::space::{Vector, dot};
use nalgebra::{DMatrix, DVector, Matrix3};

use super::NUMBERS;
use super::wrench_log::{PoseRow, turn_between};

/// Value, slope and curvature at 0 of the parabola through points (t, x).
fn parabola(points: &[(f64, Vector)]) -> Option<[Vector; 3]> {
    let mut normal: Matrix3<f64> = Matrix3::zeros();
    for (t, _) in points {
        let powers = [1.0, *t, t * t];
        for (i, a) in powers.iter().enumerate() {
            for (j, b) in powers.iter().enumerate() {
                normal[(i, j)] += a * b;
            }
        }
    }
    let inverse = normal.try_inverse()?;
    let mut out = [[0.0; 3]; 3];
    for axis in 0..3 {
        let mut right = [0.0; 3];
        for (t, x) in points {
            right[0] += x[axis];
            right[1] += t * x[axis];
            right[2] += t * t * x[axis];
        }
        for (k, of) in out.iter_mut().enumerate() {
            of[axis] = (0..3).map(|j| inverse[(k, j)] * right[j]).sum();
        }
    }
    out[2] = out[2].map(|x| 2.0 * x);
    Some(out)
}

/// Rows with the motion around them, where it is more than that of held poses; none else.
pub(super) fn moving(rows: &[PoseRow]) -> Option<Vec<PoseRow>> {
    let reach = NUMBERS.motion_window_s / 2.0;
    let mut out = Vec::with_capacity(rows.len());
    let (mut from, mut to) = (0, 0);
    let mut squares = 0.0;
    for row in rows {
        while rows[from].t < row.t - reach {
            from += 1;
        }
        while to < rows.len() && rows[to].t <= row.t + reach {
            to += 1;
        }
        let around = &rows[from..to];
        // at the ends there is no row on one side
        let whole = row.t - reach >= rows[0].t && row.t + reach <= rows[rows.len() - 1].t;
        if !whole || around.len() < NUMBERS.motion_rows {
            continue;
        }
        let at = |x: &dyn Fn(&PoseRow) -> Vector| {
            let points: Vec<(f64, Vector)> = around
                .iter()
                .map(|other| (other.t - row.t, x(other)))
                .collect();
            parabola(&points)
        };
        let turn = at(&|other| turn_between(&row.rotation, &other.rotation))?;
        let place = at(&|other| other.position.unwrap_or_default())?;
        let smooth = PoseRow {
            force: at(&|other| other.force)?[0],
            moment: at(&|other| other.moment)?[0],
            acceleration: place[2],
            turning: [turn[1], turn[2]],
            ..*row
        };
        let [omega, alpha] = smooth.turning;
        squares += dot(&place[2], &place[2])
            + NUMBERS.lever_m.powi(2) * (dot(&alpha, &alpha) + dot(&omega, &omega).powi(2));
        out.push(smooth);
    }
    let moves = (squares / out.len().max(1) as f64).sqrt() > NUMBERS.motion;
    (moves && out.len() * 2 > rows.len()).then_some(out)
}

/// The rows at which the sensor rests, where a log holds enough of them: a wrench that comes late is right there.
pub(super) fn at_rest(rows: &[PoseRow]) -> Option<Vec<PoseRow>> {
    let rests = |k: usize| {
        let (before, after) = (
            &rows[k.saturating_sub(1)],
            &rows[(k + 1).min(rows.len() - 1)],
        );
        let turn = turn_between(&before.rotation, &after.rotation);
        dot(&turn, &turn).sqrt() <= NUMBERS.rest_speed * (after.t - before.t)
    };
    let rest: Vec<PoseRow> = (0..rows.len())
        .filter(|k| rests(*k))
        .map(|k| rows[k])
        .collect();
    (rest.len() >= NUMBERS.rest_rows).then_some(rest)
}

/// The columns of [`DMatrix`] that a motion determines are many where it turns about all axes: nothing is asked of
/// one that does not.
pub(super) fn turns_enough(rows: &[PoseRow]) -> bool {
    let sum = |of: &dyn Fn(&PoseRow) -> Vector| {
        let mut all = DMatrix::zeros(3, 3);
        for row in rows {
            let x = DVector::from_row_slice(&of(row));
            all.ger(1.0, &x, &x, 1.0);
        }
        all / rows.len().max(1) as f64
    };
    let alpha = sum(&|row| row.turning[1]);
    alpha.symmetric_eigenvalues().min().max(0.0).sqrt() * NUMBERS.lever_m > NUMBERS.motion
}
