//! Sums of products along an angle: waves of it, which a few angles determine.

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::rows::RowSums;

/// Sums of products as so many waves of an angle, by their values at angles evenly around.
pub(super) struct SumWaves(Vec<(f64, RowSums)>);

/// An angle \[rad\] that none of the others is near, by which it is checked that there are no more waves.
const CHECKED: f64 = 0.8;
/// Largest difference there, in parts of the greatest sum: rounding is a thousandth of it.
const ROUNDING: f64 = 1e-9;

impl SumWaves {
    /// So many waves by as many sums as determine them; none where one more says that there are others.
    pub fn new(waves: usize, sums: impl Fn(f64) -> Option<RowSums>) -> Option<Self> {
        let count = 2 * waves + 1;
        let angles = (0..count).map(|k| 2.0 * PI * k as f64 / count as f64 - PI);
        let known = angles.map(|x| Some((x, sums(x)?))).collect::<Option<_>>();
        let out = Self(known?);
        let sizes = |of: &RowSums| of.sums.iter().map(DMatrix::nrows).collect::<Vec<_>>();
        let there = sums(CHECKED)?;
        let alike = out.0.iter().all(|(_, of)| sizes(of) == sizes(&there));
        let near = |(a, b): (&DMatrix<f64>, &DMatrix<f64>)| {
            (a - b).iter().all(|d| d.abs() <= ROUNDING * b.amax())
        };
        let here = alike.then(|| out.at(CHECKED))?;
        here.sums.iter().zip(&there.sums).all(near).then_some(out)
    }

    /// Sums of products at an angle \[rad\].
    pub fn at(&self, angle: f64) -> RowSums {
        let count = self.0.len();
        let share = |node: f64| {
            let waves = (1..=count / 2).map(|m| 2.0 * (m as f64 * (angle - node)).cos());
            (1.0 + waves.sum::<f64>()) / count as f64
        };
        let first = &self.0[0].1;
        let zeros = |sums: &DMatrix<f64>| DMatrix::zeros(sums.nrows(), sums.ncols());
        let mut out = RowSums {
            terms: first.terms.clone(),
            sums: first.sums.iter().map(zeros).collect(),
        };
        for (node, of) in &self.0 {
            let share = share(*node);
            for (sum, own) in out.sums.iter_mut().zip(&of.sums) {
                sum.zip_apply(own, |sum, own| *sum += share * own);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products of the rows (1, cos(n x), 2 + sin x).
    fn products(x: f64, n: f64) -> Option<RowSums> {
        let row = DMatrix::from_row_slice(1, 3, &[1.0, (n * x).cos(), 2.0 + x.sin()]);
        Some(RowSums {
            terms: Vec::new(),
            sums: vec![row.tr_mul(&row)],
        })
    }

    #[test]
    fn sums_at_a_few_angles_give_those_at_every_other_and_more_waves_are_noticed() {
        let waves = SumWaves::new(4, |x| products(x, 2.0)).expect("products of waves of two");
        for k in 0..20 {
            let x = -3.0 + 0.3 * f64::from(k);
            let expected = products(x, 2.0).unwrap();
            let off = &waves.at(x).sums[0] - &expected.sums[0];
            assert!(off.amax() < 1e-12, "{x}: {off}");
        }
        assert!(SumWaves::new(4, |x| products(x, 3.0)).is_none());
        assert!(SumWaves::new(2, |x| products(x, 2.0)).is_none());
    }
}
