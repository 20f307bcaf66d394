//! Positive definite pseudo-inertias and positive numbers: where they are, how far each is from its prior, and Newton's steps.
//!
//! The distance of a pseudo-inertia J from its prior J0 is the divergence of the log-determinant,
//! D = tr(J J0^-1) - ln det(J J0^-1) - 4 (Lee, Wensing and Park 2020), which is convex in J and infinite on the border of
//! what a body can have: a barrier and a prior in one. That of a positive number is the same in one dimension.

use nalgebra::{DMatrix, DVector, DVectorView, Matrix4};

use crate::robot::standard::{Body, STANDARD, WRITTEN, pseudo_inertia, standard_of};

/// Part of the way to the border that a step may go.
const INSIDE: f64 = 0.9;

/// Priors of links and of positive numbers: what the search begins from and is drawn to.
pub(super) struct ConePrior {
    /// Pseudo-inertia of each link.
    pub links: Vec<Matrix4<f64>>,
    pub numbers: Vec<f64>,
}

/// A point inside the cone of consistent parameters: inertias of links, positive numbers, and their factors.
#[derive(Clone)]
pub(super) struct InteriorPoint {
    pub links: Vec<Matrix4<f64>>,
    pub numbers: Vec<f64>,
    /// Lower Cholesky factors of the links.
    factors: Vec<Matrix4<f64>>,
}

/// The symmetric matrix of ten coordinates, whose squares sum to that of the entries.
fn symmetric(x: &DVectorView<f64>) -> Matrix4<f64> {
    let mut out = Matrix4::zeros();
    let mut k = 0;
    for r in 0..4 {
        for c in r..4 {
            let value = if r == c {
                x[k]
            } else {
                x[k] * std::f64::consts::FRAC_1_SQRT_2
            };
            out[(r, c)] = value;
            out[(c, r)] = value;
            k += 1;
        }
    }
    out
}

/// The ten coordinates of a symmetric matrix.
fn coordinates(x: &Matrix4<f64>) -> [f64; STANDARD] {
    let mut out = [0.0; STANDARD];
    let mut k = 0;
    for r in 0..4 {
        for c in r..4 {
            out[k] = if r == c {
                x[(r, c)]
            } else {
                x[(r, c)] * std::f64::consts::SQRT_2
            };
            k += 1;
        }
    }
    out
}

impl InteriorPoint {
    /// The point, where every link is positive definite and every number above zero.
    pub fn new(links: Vec<Matrix4<f64>>, numbers: Vec<f64>) -> Option<Self> {
        let of = |j: &Matrix4<f64>| j.cholesky().map(|factor| factor.l());
        let factors = links.iter().map(of).collect::<Option<_>>()?;
        let positive = numbers.iter().all(|x| *x > 0.0 && x.is_finite());
        positive.then_some(InteriorPoint {
            links,
            numbers,
            factors,
        })
    }

    /// Standard parameters of the links, ten each, then the numbers.
    pub fn standard(&self) -> DVector<f64> {
        let links = self.links.iter().flat_map(standard_of);
        DVector::from_vec(links.chain(self.numbers.iter().copied()).collect())
    }

    /// `rows` of standard parameters and numbers as those of the coordinates in which the barrier is round here:
    /// J + dJ = L (I + X) L', and x + dx = x (1 + dx).
    pub fn in_own_coordinates(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        let mut out = rows.clone();
        for (i, l) in self.factors.iter().enumerate() {
            let own = rows.columns(STANDARD * i, STANDARD);
            for k in 0..STANDARD {
                let unit = DVector::from_fn(STANDARD, |r, _| f64::from(u8::from(r == k)));
                let change = l * symmetric(&unit.as_view()) * l.transpose();
                let change = DVector::from_row_slice(&standard_of(&change));
                let mut column = out.column_mut(STANDARD * i + k);
                own.mul_to(&change, &mut column);
            }
        }
        let first = STANDARD * self.links.len();
        for (k, x) in self.numbers.iter().enumerate() {
            out.column_mut(first + k).scale_mut(*x);
        }
        out
    }

    /// Where a step in the own coordinates leads, `part` of it.
    pub fn after(&self, step: &DVector<f64>, part: f64) -> Option<Self> {
        let link = |(i, l): (usize, &Matrix4<f64>)| {
            let x = symmetric(&step.rows(STANDARD * i, STANDARD)) * part;
            let moved = l * (Matrix4::identity() + x) * l.transpose();
            0.5 * (moved + moved.transpose())
        };
        let first = STANDARD * self.links.len();
        let numbers = self.numbers.iter().enumerate();
        let numbers = numbers.map(|(k, x)| x * (1.0 + part * step[first + k]));
        let links = self.factors.iter().enumerate().map(link);
        InteriorPoint::new(links.collect(), numbers.collect())
    }

    /// The longest part of a step that stays well inside, at most 1.
    pub fn longest(&self, step: &DVector<f64>) -> f64 {
        let links = (0..self.links.len()).map(|i| {
            let x = symmetric(&step.rows(STANDARD * i, STANDARD));
            x.symmetric_eigenvalues().min()
        });
        let first = STANDARD * self.links.len();
        let least = links.chain(step.iter().skip(first).copied());
        let least = least.fold(0.0, f64::min);
        match least < 0.0 {
            true => (-INSIDE / least).min(1.0),
            false => 1.0,
        }
    }
}

impl ConePrior {
    pub fn start(&self) -> Option<InteriorPoint> {
        InteriorPoint::new(self.links.clone(), self.numbers.clone())
    }

    /// Sum of the distances from the priors.
    pub fn distance(&self, at: &InteriorPoint) -> f64 {
        let mut sum = 0.0;
        for ((j, l), prior) in at.links.iter().zip(&at.factors).zip(&self.links) {
            let Some(prior) = prior.cholesky() else {
                return f64::INFINITY;
            };
            let logs = |l: &Matrix4<f64>| 2.0 * (0..4).map(|k| l[(k, k)].ln()).sum::<f64>();
            sum += prior.solve(j).trace() - logs(l) + logs(&prior.l()) - 4.0;
        }
        for (x, prior) in at.numbers.iter().zip(&self.numbers) {
            sum += x / prior - (x / prior).ln() - 1.0;
        }
        sum
    }

    /// What pulls to the priors alone, without the barrier, in the own coordinates of a point: J0^-1 in them.
    pub fn pull(&self, at: &InteriorPoint) -> DVector<f64> {
        let mut out = Vec::new();
        for (l, prior) in at.factors.iter().zip(&self.links) {
            let inverse = prior
                .cholesky()
                .map_or_else(Matrix4::zeros, |prior| prior.inverse());
            out.extend(coordinates(&(l.transpose() * inverse * l)));
        }
        let numbers = at.numbers.iter().zip(&self.numbers);
        out.extend(numbers.map(|(x, prior)| x / prior));
        DVector::from_vec(out)
    }

    /// The unit of every link and number in own coordinates: the barrier's gradient is its negative.
    pub fn unit(&self) -> DVector<f64> {
        let links = self.links.iter();
        let links = links.flat_map(|_| coordinates(&Matrix4::identity()));
        DVector::from_vec(links.chain(self.numbers.iter().map(|_| 1.0)).collect())
    }
}

/// The pseudo-inertia of a body as a robot file writes it, where it is one that can exist and has an extent.
pub(super) fn prior_of(body: &Body) -> Option<Matrix4<f64>> {
    let body = body.physical(WRITTEN).filter(|body| !body.is_point())?;
    Some(pseudo_inertia(&body.standard()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cone() -> ConePrior {
        let prior = [0.05, 0.001, -0.002, 0.06, 0.003, 0.04, 0.1, -0.05, 0.2, 2.0];
        ConePrior {
            links: vec![prior_of(&Body::of(&prior)).unwrap()],
            numbers: vec![0.3],
        }
    }

    /// A point away from the priors, and a step.
    fn moved(cone: &ConePrior) -> (InteriorPoint, DVector<f64>) {
        let step = DVector::from_fn(STANDARD + 1, |k, _| 0.05 * (k as f64 * 1.7).sin());
        let at = cone.start().unwrap().after(&(3.0 * &step), 1.0).unwrap();
        (at, step)
    }

    #[test]
    fn the_slope_of_the_distance_is_that_of_differences() {
        let cone = cone();
        let (at, step) = moved(&cone);
        let slope = (cone.pull(&at) - cone.unit()).dot(&step);
        let side = |part: f64| cone.distance(&at.after(&step, part).unwrap());
        let difference = (side(1e-5) - side(-1e-5)) / 2e-5;
        assert!((slope - difference).abs() < 1e-7, "{slope} {difference}");
        assert!(cone.distance(&cone.start().unwrap()).abs() < 1e-12);
        // the barrier's curvature is the unit matrix
        let second = (side(1e-3) - 2.0 * side(0.0) + side(-1e-3)) / 1e-6;
        assert!((second / step.norm_squared() - 1.0).abs() < 1e-4);
    }

    #[test]
    fn rows_in_own_coordinates_give_what_the_step_changes() {
        let cone = cone();
        let (at, step) = moved(&cone);
        let rows = DMatrix::from_fn(3, STANDARD + 1, |r, c| (r as f64 + 0.3 * c as f64).cos());
        let change = &rows * (at.after(&step, 1.0).unwrap().standard() - at.standard());
        assert!((at.in_own_coordinates(&rows) * &step - change).amax() < 1e-12);
    }

    #[test]
    fn a_step_over_the_border_is_cut_short() {
        let cone = cone();
        let at = cone.start().unwrap();
        let mut step = DVector::zeros(STANDARD + 1);
        step[0] = -5.0;
        let part = at.longest(&step);
        assert!((part - 0.18).abs() < 1e-9, "{part}");
        assert!(at.after(&step, part).is_some() && at.after(&step, 0.21).is_none());
        let longer = Body::of(&[0.1, 0.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        assert!(prior_of(&longer).is_none());
    }
}
