//! Triangles as bytes: columns and rows that hold nothing are left out, every other number is there bit for bit.
//!
//! Little-endian: rows and columns as `u16`, a bit per column that holds something, then for each row the first
//! such column at which it holds something as `u16`, and its numbers from there.

use nalgebra::DMatrix;

/// Appends a matrix.
pub(super) fn write(out: &mut Vec<u8>, matrix: &DMatrix<f64>) {
    let holds = |x: f64| x.to_bits() != 0;
    let kept: Vec<bool> = matrix
        .column_iter()
        .map(|column| column.iter().any(|x| holds(*x)))
        .collect();
    let small = |count: usize| u16::try_from(count).unwrap_or(u16::MAX).to_le_bytes();
    out.extend(small(matrix.nrows()));
    out.extend(small(matrix.ncols()));
    for eight in kept.chunks(8) {
        let bits = eight.iter().enumerate();
        out.push(bits.fold(0, |byte, (k, kept)| byte | u8::from(*kept) << k));
    }
    for row in matrix.row_iter() {
        let values = row.iter().zip(&kept).filter(|(_, kept)| **kept);
        let values: Vec<f64> = values.map(|(x, _)| *x).collect();
        let first = values
            .iter()
            .position(|x| holds(*x))
            .unwrap_or(values.len());
        out.extend(small(first));
        values[first..]
            .iter()
            .for_each(|x| out.extend(x.to_le_bytes()));
    }
}

/// Takes a matrix from the front of `bytes`; none where they hold no matrix of finite numbers.
pub(super) fn read(bytes: &mut &[u8]) -> Option<DMatrix<f64>> {
    let rows = usize::from(small(bytes)?);
    let columns = usize::from(small(bytes)?);
    let bits = take(bytes, columns.div_ceil(8))?;
    let kept: Vec<usize> = (0..columns)
        .filter(|c| bits[c / 8] >> (c % 8) & 1 == 1)
        .collect();
    // a row takes two bytes at least
    if rows > bytes.len() / 2 {
        return None;
    }
    let mut matrix = DMatrix::zeros(rows, columns);
    for row in 0..rows {
        let first = usize::from(small(bytes)?);
        for column in kept.get(first..)? {
            let value = f64::from_le_bytes(take(bytes, 8)?.try_into().ok()?);
            if !value.is_finite() {
                return None;
            }
            matrix[(row, *column)] = value;
        }
    }
    Some(matrix)
}

fn take<'a>(bytes: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (taken, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(taken)
}

fn small(bytes: &mut &[u8]) -> Option<u16> {
    Some(u16::from_le_bytes(take(bytes, 2)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_come_back_bit_for_bit_without_the_bytes_of_what_is_zero() {
        let mut triangle = DMatrix::from_fn(9, 9, |r, c| match c >= r && c != 3 && r != 3 {
            true => 1.0 / (1.0 + r as f64 + 10.0 * c as f64),
            false => 0.0,
        });
        triangle[(0, 1)] = -0.0;
        let few = DMatrix::from_fn(2, 12, |r, c| (r as f64 - c as f64).sin());
        let none = DMatrix::zeros(4, 4);
        let mut bytes = Vec::new();
        for matrix in [&triangle, &few, &none] {
            write(&mut bytes, matrix);
        }
        assert!(bytes.len() < 8 * (36 + 24) + 60, "{}", bytes.len());
        let mut rest = bytes.as_slice();
        for matrix in [&triangle, &few, &none] {
            let found = read(&mut rest).unwrap();
            let bits = |m: &DMatrix<f64>| m.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&found), bits(matrix));
            assert_eq!(found.shape(), matrix.shape());
        }
        assert!(rest.is_empty());
    }

    #[test]
    fn bytes_that_end_early_or_hold_what_is_not_finite_are_no_matrix() {
        let mut bytes = Vec::new();
        write(&mut bytes, &DMatrix::from_element(2, 2, 1.5));
        for end in 0..bytes.len() {
            assert_eq!(read(&mut &bytes[..end]), None, "{end}");
        }
        let mut nan = Vec::new();
        write(&mut nan, &DMatrix::from_element(1, 1, f64::NAN));
        assert_eq!(read(&mut nan.as_slice()), None);
    }
}
