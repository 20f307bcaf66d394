//! Orientations that are no quaternions: rotation vectors, three angles, matrices. Which of them the numbers are is asked
//! of the data, as the order of a quaternion is.

use cft_ident_core::robot::tree::space::{Rotation, Vector, about, product};

use super::NUMBERS;
use super::table::WrenchTable;
use super::wrench_log::{OrientationIs, of_turn, quaternion_of, transposed};

/// Columns of an orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum OrientationColumns {
    /// A vector or three angles, in the order of the columns.
    Three([usize; 3]),
    /// Nine numbers of a matrix, column after column.
    Nine([usize; 9]),
}

/// Largest angle in radians: beyond, angles are in degrees. One of all the way round and a little more is none.
const MOST_RAD: f64 = 6.5;

const X: Vector = [1.0, 0.0, 0.0];
const Y: Vector = [0.0, 1.0, 0.0];
const Z: Vector = [0.0, 0.0, 1.0];

/// Turns about axes, one after the other, each about the axes as the one before left them.
fn turned(axes: [&Vector; 3], angles: [f64; 3]) -> Rotation {
    let [a, b, c]: [Rotation; 3] = std::array::from_fn(|k| about(axes[k], angles[k]));
    product(&product(&a, &b), &c)
}

/// The rotation of three numbers \[rad\].
fn of_three(is: OrientationIs, [a, b, c]: [f64; 3]) -> Rotation {
    match is {
        OrientationIs::InverseRotationVector => of_turn(&[-a, -b, -c]),
        OrientationIs::RollPitchYaw => turned([&Z, &Y, &X], [c, b, a]),
        OrientationIs::AboutZyx => turned([&Z, &Y, &X], [a, b, c]),
        OrientationIs::AboutXyz => turned([&X, &Y, &Z], [a, b, c]),
        OrientationIs::AboutZyz => turned([&Z, &Y, &Z], [a, b, c]),
        _ => of_turn(&[a, b, c]),
    }
}

impl OrientationColumns {
    /// Every way to read them, as quaternions x y z w of the sensor in the base frame; `None` where a row holds no number
    /// or no rotation.
    pub fn readings(&self, table: &WrenchTable) -> Option<Vec<(OrientationIs, Vec<[f64; 4]>)>> {
        let rows = 0..table.rows();
        let at = |column: usize, row: usize| table.columns[column][row];
        match self {
            Self::Three(of) => {
                let all = || of.iter().flat_map(|column| &table.columns[*column]);
                if !all().all(|x| x.is_finite()) {
                    return None;
                }
                let most = all().fold(0.0_f64, |most, x| most.max(x.abs()));
                let unit = if most > MOST_RAD {
                    1f64.to_radians()
                } else {
                    1.0
                };
                let reading = |is: &OrientationIs| {
                    let row = |row| quaternion_of(&of_three(*is, of.map(|k| unit * at(k, row))));
                    (*is, rows.clone().map(row).collect())
                };
                Some(OrientationIs::OF_THREE.iter().map(reading).collect())
            }
            Self::Nine(of) => {
                let by_columns = |row: usize| -> Rotation {
                    std::array::from_fn(|i| std::array::from_fn(|j| at(of[3 * j + i], row)))
                };
                if !rows.clone().all(|row| is_rotation(&by_columns(row))) {
                    return None;
                }
                let columns = rows.clone().map(|row| quaternion_of(&by_columns(row)));
                let lines = rows.map(|row| quaternion_of(&transposed(&by_columns(row))));
                Some(vec![
                    (OrientationIs::MatrixByColumns, columns.collect()),
                    (OrientationIs::MatrixByRows, lines.collect()),
                ])
            }
        }
    }
}

/// Whether the axes of a matrix are of length one, at right angles, and right-handed.
fn is_rotation(r: &Rotation) -> bool {
    let product = product(r, &transposed(r));
    let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
    let square = (0..9)
        .all(|k| (product[k / 3][k % 3] - unit(k / 3, k % 3)).abs() < 2.0 * NUMBERS.quaternion);
    let [a, b, c] = r;
    let volume = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    square && volume > 0.0
}

/// A name without the number at its end, and that number: `actual_TCP_pose_3`, `O_T_EE[12]`.
fn numbered(name: &str) -> Option<(&str, usize)> {
    let bare = name.strip_suffix(']').unwrap_or(name);
    let digits = bare.bytes().rev().take_while(u8::is_ascii_digit).count();
    let (head, number) = bare.split_at(bare.len() - digits);
    Some((
        head.trim_end_matches(['[', '_', '.', ' ']),
        number.parse().ok()?,
    ))
}

/// Columns that one name has in common with numbers behind it, in the order of the numbers.
pub(super) fn families(names: &[String]) -> Vec<(String, Vec<usize>)> {
    let mut out: Vec<(String, Vec<(usize, usize)>)> = Vec::new();
    for (column, name) in names.iter().enumerate() {
        let Some((head, number)) = numbered(name).filter(|(head, _)| !head.is_empty()) else {
            continue;
        };
        match out.iter_mut().find(|(known, _)| known == head) {
            Some((_, all)) => all.push((number, column)),
            None => out.push((head.to_owned(), vec![(number, column)])),
        }
    }
    let in_order = |(head, mut all): (String, Vec<(usize, usize)>)| {
        all.sort_unstable();
        (head, all.into_iter().map(|(_, column)| column).collect())
    };
    out.into_iter().map(in_order).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_angles_are_what_makers_define_them_as() {
        let quarter = std::f64::consts::FRAC_PI_2;
        // a yaw alone turns x to y, by every definition that ends or begins with it
        for (is, angles) in [
            (OrientationIs::RollPitchYaw, [0.0, 0.0, quarter]),
            (OrientationIs::AboutZyx, [quarter, 0.0, 0.0]),
            (OrientationIs::AboutXyz, [0.0, 0.0, quarter]),
            (OrientationIs::AboutZyz, [quarter, 0.0, 0.0]),
            (OrientationIs::RotationVector, [0.0, 0.0, quarter]),
        ] {
            let r = of_three(is, angles);
            assert!((r[1][0] - 1.0).abs() < 1e-12, "{is:?} {r:?}");
        }
        let [a, b, c] = [0.3, -0.4, 1.1];
        let fixed = of_three(OrientationIs::RollPitchYaw, [c, b, a]);
        assert_eq!(fixed, of_three(OrientationIs::AboutZyx, [a, b, c]));
    }

    #[test]
    fn columns_with_numbers_at_their_ends_are_families() {
        let names = ["t", "pose_1", "pose_0", "T[0]", "T[1]"].map(str::to_owned);
        let found = families(&names);
        assert_eq!(found[0], ("pose".to_owned(), vec![2, 1]));
        assert_eq!(found[1], ("T".to_owned(), vec![3, 4]));
    }
}
