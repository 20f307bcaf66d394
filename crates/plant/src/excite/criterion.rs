//! What a design makes small, as a function of the information matrix G = F'F, with its derivative.
//!
//! Every criterion depends on the motion through G alone, so that its derivative by the motion is
//! that of the regressor times one symmetric matrix S = df/dG: df = 2 sum (F S) . dF. For the
//! condition number this is the singular vector formula d sigma = u' dF v.

use nalgebra::{DMatrix, DVector};

use cft_ident_core::math::{MathError, rank};

/// What is made small.
#[derive(Debug, Clone, PartialEq)]
pub enum Criterion {
    /// J_k: condition number of the stacked regressor.
    Condition,
    /// J_k with the columns scaled to norm 1.
    ConditionNormalised,
    /// -J_d = -log det(F'F).
    DOptimal,
    /// Sum of the variances of the unknowns times these factors, rows weighted by each joint's
    /// noise.
    AOptimal(Vec<f64>),
}

/// Value of a criterion and S = df/dG.
#[derive(Debug, Clone)]
pub struct Slope {
    /// log of the condition number, -log det / p, or log of the weighted trace.
    pub value: f64,
    /// Symmetric p x p.
    pub matrix: DMatrix<f64>,
}

impl Criterion {
    /// Whether rows count by their joint's noise.
    pub fn weighted(&self) -> bool {
        matches!(self, Self::AOptimal(_))
    }

    /// Value and slope at the information matrix G (p x p, positive definite).
    ///
    /// Extreme singular values cross where a condition number is smallest, and there it has a
    /// kink. `sharpness` s makes it smooth: largest and smallest are taken as
    /// (sum sigma^s)^(1/s) and (sum sigma^-s)^(-1/s), exact as s goes to infinity (also the value
    /// for `f64::INFINITY`), and at most p^(2/s) times too large.
    ///
    /// # Errors
    /// [`MathError`] where G is not finite or not decomposable.
    pub fn slope(&self, g: &DMatrix<f64>, sharpness: f64) -> Result<Slope, MathError> {
        match self {
            Self::Condition => condition(g, sharpness),
            Self::ConditionNormalised => normalised(g, sharpness),
            Self::DOptimal => determinant(g),
            Self::AOptimal(factors) => trace(g, factors),
        }
    }
}

/// Eigenvalues (falling, at least a rounding above 0) and eigenvectors of G.
fn eigen(g: &DMatrix<f64>) -> Result<(DVector<f64>, DMatrix<f64>), MathError> {
    let svd = rank::svd(g)?;
    let floor = svd.s[0].max(f64::MIN_POSITIVE) * 1e-15;
    Ok((svd.s.map(|s| s.max(floor)), svd.v))
}

/// V diag(d) V'.
fn compose(v: &DMatrix<f64>, d: impl Fn(usize) -> f64) -> DMatrix<f64> {
    let mut scaled = v.clone();
    for (k, mut column) in scaled.column_iter_mut().enumerate() {
        column *= d(k);
    }
    scaled * v.transpose()
}

fn condition(g: &DMatrix<f64>, sharpness: f64) -> Result<Slope, MathError> {
    let (lambda, v) = eigen(g)?;
    let logs: Vec<f64> = lambda.iter().map(|l| 0.5 * l.ln()).collect();
    let (top, up) = soft_max(&logs, sharpness);
    let negative: Vec<f64> = logs.iter().map(|l| -l).collect();
    let (bottom, down) = soft_max(&negative, sharpness);
    Ok(Slope {
        value: top + bottom,
        matrix: compose(&v, |k| 0.5 * (up[k] - down[k]) / lambda[k]),
    })
}

/// log of the s-norm of exp(x), and its weights (which sum to 1).
fn soft_max(x: &[f64], s: f64) -> (f64, Vec<f64>) {
    let most = x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if s.is_infinite() {
        let first = x.iter().position(|v| *v == most).unwrap_or(0);
        let mut weights = vec![0.0; x.len()];
        weights[first] = 1.0;
        return (most, weights);
    }
    let parts: Vec<f64> = x.iter().map(|v| (s * (v - most)).exp()).collect();
    let sum: f64 = parts.iter().sum();
    let weights = parts.iter().map(|part| part / sum);
    (most + sum.ln() / s, weights.collect())
}

fn normalised(g: &DMatrix<f64>, sharpness: f64) -> Result<Slope, MathError> {
    let p = g.nrows();
    let size = |i: usize| g[(i, i)].max(f64::MIN_POSITIVE);
    let scale: Vec<f64> = (0..p).map(|i| size(i).sqrt().recip()).collect();
    let scaled = DMatrix::from_fn(p, p, |i, j| g[(i, j)] * scale[i] * scale[j]);
    let inner = condition(&scaled, sharpness)?;
    // The scales themselves depend on the diagonal of G.
    let rows = inner.matrix.component_mul(&scaled);
    let matrix = DMatrix::from_fn(p, p, |i, j| {
        let through = if i == j {
            rows.row(i).sum() / size(i)
        } else {
            0.0
        };
        inner.matrix[(i, j)] * scale[i] * scale[j] - through
    });
    let value = inner.value;
    Ok(Slope { value, matrix })
}

fn determinant(g: &DMatrix<f64>) -> Result<Slope, MathError> {
    let (lambda, v) = eigen(g)?;
    let p = g.nrows() as f64;
    Ok(Slope {
        value: -lambda.iter().map(|l| l.ln()).sum::<f64>() / p,
        matrix: compose(&v, |k| -1.0 / (p * lambda[k])),
    })
}

fn trace(g: &DMatrix<f64>, factors: &[f64]) -> Result<Slope, MathError> {
    let (lambda, v) = eigen(g)?;
    let inverse = compose(&v, |k| 1.0 / lambda[k]);
    let mut weighted = inverse.clone();
    for (i, mut column) in weighted.column_iter_mut().enumerate() {
        column *= factors.get(i).copied().unwrap_or(0.0);
    }
    let sum = weighted.trace().max(f64::MIN_POSITIVE);
    Ok(Slope {
        value: sum.ln(),
        matrix: -(weighted * inverse) / sum,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn information() -> DMatrix<f64> {
        let f = DMatrix::from_fn(30, 5, |i, j| {
            ((i + 1) as f64 * (j + 2) as f64).sqrt().sin() * 3f64.powi(j as i32 - 2)
        });
        f.tr_mul(&f)
    }

    #[test]
    fn slopes_are_derivatives_of_the_values() {
        let g = information();
        let all = [
            Criterion::Condition,
            Criterion::ConditionNormalised,
            Criterion::DOptimal,
            Criterion::AOptimal(vec![1.0, 0.0, 2.0, 0.5, 0.0]),
        ];
        for criterion in all {
            for sharpness in [4.0, 30.0, f64::INFINITY] {
                let at = |g: &DMatrix<f64>| criterion.slope(g, sharpness).expect("finite");
                let here = at(&g);
                for (i, j) in [(0, 0), (1, 1), (4, 4), (0, 1), (2, 4), (1, 3)] {
                    let h = 1e-6 * g[(i, i)].min(g[(j, j)]);
                    let shifted = |h: f64| {
                        let mut g = g.clone();
                        g[(i, j)] += h;
                        if i != j {
                            g[(j, i)] += h;
                        }
                        at(&g).value
                    };
                    let slope = (shifted(h) - shifted(-h)) / (2.0 * h);
                    let twice = if i == j { 1.0 } else { 2.0 };
                    let formula = twice * here.matrix[(i, j)];
                    let allowed = 1e-5 * slope.abs().max(1e-8 / h);
                    let what = format!("{criterion:?}, {sharpness}, ({i}, {j})");
                    let off = (slope - formula).abs();
                    assert!(off < allowed, "{what}: {slope} against {formula}");
                }
            }
        }
    }

    #[test]
    fn a_sharp_condition_number_is_that_of_the_singular_values() {
        let g = information();
        let s = rank::svd(&g).expect("finite").s;
        let exact = 0.5 * rank::condition(&s).ln();
        let slope = |sharpness| Criterion::Condition.slope(&g, sharpness);
        let at = |sharpness| slope(sharpness).expect("finite").value;
        assert!((at(f64::INFINITY) - exact).abs() < 1e-12);
        for sharpness in [8.0, 64.0, 512.0] {
            let above = at(sharpness) - exact;
            assert!((0.0..=2.0 * 5f64.ln() / sharpness).contains(&above));
        }
    }

    #[test]
    fn normalised_condition_numbers_do_not_see_units() {
        let g = information();
        let units = [1.0, 1e3, 0.2, 5.0, 1e-2];
        let scaled = DMatrix::from_fn(5, 5, |i, j| g[(i, j)] * units[i] * units[j]);
        let value = |g: &DMatrix<f64>| {
            let slope = Criterion::ConditionNormalised.slope(g, f64::INFINITY);
            slope.expect("finite").value
        };
        assert!((value(&g) - value(&scaled)).abs() < 1e-10);
    }
}
