//! The wrench that a body on the sensor makes, as columns of a linear problem.
//!
//! With u = R'(g - a), R the axes of the sensor in the base, all along the sensor's axes and about its origin,
//! h = m c:
//! ```text
//! f = m u - (alpha x h + omega x (omega x h)) + b_f
//! t = h x u - (I alpha + omega x I omega) + b_t
//! ```
//! (Atkeson, An and Hollerbach 1986, eq. 12 to 14.) 10 unknowns where the sensor is held, 16 where it moves.

use cft_ident_core::robot::tree::space::{Vector, add, cross, product, times};

use super::GRAVITY;
use super::effect::WrenchEffect;
use super::equations::{AXES, LinearisedAt, RowEquations};
use super::wrench_log::{PoseRow, turned_back};

/// Unknowns that every model has: mass, first moment, inertia where the sensor moves, bias.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BaseColumns {
    pub inertia: bool,
}

impl BaseColumns {
    pub const MASS: usize = 0;
    pub const FIRST_MOMENT: usize = 1;
    pub const INERTIA: usize = 4;

    pub fn bias(self) -> usize {
        if self.inertia { 10 } else { 4 }
    }

    pub fn len(self) -> usize {
        self.bias() + 6
    }
}

/// Places of Ixx Ixy Ixz Iyy Iyz Izz.
const INERTIA: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Gravity less acceleration along the sensor's axes \[m/s^2\].
pub(super) fn felt(row: &PoseRow, at: &LinearisedAt) -> Vector {
    let axes = product(&row.rotation, &at.turn);
    let down = [
        GRAVITY * at.lean[0],
        GRAVITY * at.lean[1],
        -GRAVITY
            * (1.0 - at.lean[0].powi(2) - at.lean[1].powi(2))
                .max(0.0)
                .sqrt(),
    ];
    turned_back(&axes, &add(&down, &times(-1.0, &row.acceleration)))
}

/// Writes the columns of one row.
pub(super) fn columns(
    row: &PoseRow,
    s: f64,
    base: BaseColumns,
    effects: &[WrenchEffect],
    at: &LinearisedAt,
    out: &mut RowEquations,
) {
    let u = felt(row, at);
    let [omega, alpha] = row.turning.map(|x| turned_back(&at.turn, &x));
    out.wrench(BaseColumns::MASS, &u, &[0.0; 3]);
    for (k, axis) in AXES.iter().enumerate() {
        let swing = add(&cross(&alpha, axis), &cross(&omega, &cross(&omega, axis)));
        out.wrench(
            BaseColumns::FIRST_MOMENT + k,
            &times(-1.0, &swing),
            &cross(axis, &u),
        );
        out.wrench(base.bias() + k, axis, &[0.0; 3]);
        out.wrench(base.bias() + 3 + k, &[0.0; 3], axis);
    }
    if base.inertia {
        for (k, (i, j)) in INERTIA.into_iter().enumerate() {
            let times_inertia = |x: &Vector| {
                let mut y = [0.0; 3];
                y[i] = x[j];
                y[j] = x[i];
                y
            };
            let (turning, swinging) = (times_inertia(&alpha), times_inertia(&omega));
            let moment = add(&turning, &cross(&omega, &swinging));
            out.wrench(BaseColumns::INERTIA + k, &[0.0; 3], &times(-1.0, &moment));
        }
    }
    let mut column = base.len();
    for effect in effects {
        effect.columns(row, s, at, &u, column, out);
        column += effect.numbers();
    }
}
