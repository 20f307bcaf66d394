//! Agreement of an amplitude between parts of the data: a statistic that no search has seen.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::sums::{BlockSums, Terms};
use super::{Blocks, Numbers};

/// What parts of the data ask for.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    /// Scatter that the amplitude has over that which the parts have: F with k and k (P - 1) degrees of freedom.
    pub z: f64,
    /// Factor of the amplitude in predictions, 0..1.
    pub s: f64,
    /// Amplitudes by part, those of parts in which its torque is next to nothing left out.
    pub parts: Vec<Vec<f64>>,
    /// The amplitude of all parts, and their information on it.
    whole: (DVector<f64>, DMatrix<f64>),
}

impl Agreement {
    /// The part that a change is of the amplitude, along it.
    pub(crate) fn part(&self, change: &DVector<f64>) -> f64 {
        let (amplitude, information) = &self.whole;
        let along = information * amplitude;
        let size = amplitude.dot(&along);
        match size > 0.0 {
            true => change.dot(&along) / size,
            false => 0.0,
        }
    }

    /// Counts an error of this part of the amplitude, which all parts of the data share, to their scatter.
    pub(crate) fn doubt(&mut self, part: f64, numbers: &Numbers) {
        let shape = (self.parts.len(), self.whole.0.len());
        if self.z > 0.0 && part != 0.0 {
            self.z = 1.0 / (1.0 / self.z + shape.0 as f64 * part * part);
            self.s = factor(self.z, shape, numbers);
        }
    }
}

/// s of parts that agree so well on k numbers.
fn factor(z: f64, (parts, k): (usize, usize), numbers: &Numbers) -> f64 {
    doubt(parts, k, numbers).map_or(0.0, |doubt| (1.0 - doubt / z).max(0.0))
}

/// Least number of parts that have a deviation of their own.
pub const LEAST_PARTS: usize = 3;
/// No agreement is as good as this.
const MOST_DOUBT: f64 = 1e6;
/// Part of the mean information below which a part says nothing.
const SILENT: f64 = 1e-3;

/// Whether the parts agree on the terms `effect` of a fit: terms of several joints are held at `values`, those that
/// only one joint has are fitted in each part anew.
pub fn agreement(
    sums: &BlockSums,
    blocks: &Blocks,
    terms: &Terms,
    (effect, values): (&[usize], &DVector<f64>),
    numbers: &Numbers,
) -> Agreement {
    let joints = terms.weights.len();
    let touched: Vec<usize> = (0..joints)
        .filter(|j| effect.iter().any(|i| terms.list[*i].column(*j).is_some()))
        .collect();
    let k = effect.len();
    let mut found: Vec<(DMatrix<f64>, DVector<f64>)> = Vec::new();
    for part in 0..blocks.parts {
        let own = (0..blocks.list.len()).filter(|b| blocks.list[*b].part == part);
        let sums = sums.over(own);
        let (mut s, mut r) = (DMatrix::zeros(k, k), DVector::zeros(k));
        for j in &touched {
            reduced(&sums[*j], terms, *j, (effect, values), (&mut s, &mut r));
        }
        found.push((s, r));
    }
    judged(found, numbers)
}

/// Whether the parts agree on the share of the squared error that another hypothesis takes off: errors
/// `[block][joint]` of blocks that neither was fitted to, each joint in its weight.
pub fn agreement_on_share(
    (before, after): (&[Vec<f64>], &[Vec<f64>]),
    weights: &[f64],
    blocks: &Blocks,
    numbers: &Numbers,
) -> Agreement {
    let sum = |errors: &[f64]| errors.iter().zip(weights).map(|(e, w)| e * w).sum::<f64>();
    let mut found = vec![(DMatrix::zeros(1, 1), DVector::zeros(1)); blocks.parts];
    for ((before, after), block) in before.iter().zip(after).zip(&blocks.list) {
        let (s, r) = &mut found[block.part];
        s[(0, 0)] += sum(before);
        r[0] += sum(before) - sum(after);
    }
    judged(found, numbers)
}

/// What parts say together that each give the information on an amplitude and its pull.
fn judged(mut found: Vec<(DMatrix<f64>, DVector<f64>)>, numbers: &Numbers) -> Agreement {
    let k = found.first().map_or(0, |(_, r)| r.len());
    let total = found.iter().fold(DMatrix::zeros(k, k), |t, (s, _)| t + s);
    // what says nothing of the amplitude is no part that agrees
    let mean = total.trace() / found.len().max(1) as f64;
    found.retain(|(s, _)| s.trace() > SILENT * mean);
    let firm = |m: &DMatrix<f64>, by: &DMatrix<f64>| {
        let mut m = m.clone();
        for i in 0..k {
            m[(i, i)] += numbers.ridge * by[(i, i)].max(1e-200);
        }
        m
    };
    let right = found.iter().fold(DVector::zeros(k), |t, (_, r)| t + r);
    let count = found.len();
    let none = Agreement {
        z: 0.0,
        s: 0.0,
        parts: Vec::new(),
        whole: (DVector::zeros(k), DMatrix::zeros(k, k)),
    };
    let Some(all) = firm(&total, &total).cholesky() else {
        return none;
    };
    let amplitude = all.solve(&right);
    let mut scatter = 0.0;
    let mut parts = Vec::new();
    for (s, r) in &found {
        let Some(own) = firm(s, &total).cholesky() else {
            return none;
        };
        let off = own.solve(&(r - s * &amplitude));
        scatter += off.dot(&(s * &off));
        parts.push((&amplitude + off).iter().copied().collect());
    }
    let size = amplitude.dot(&(&total * &amplitude));
    let p = count as f64;
    let z = match scatter > 0.0 {
        true => size * (p - 1.0) / (p * scatter),
        false => 0.0,
    };
    Agreement {
        z,
        s: factor(z, (count, k), numbers),
        parts,
        whole: (amplitude, total),
    }
}

/// The z at which so few parts agree on k numbers by a chance as small as that of [`Numbers::parts`] at [`Numbers::doubt`].
fn doubt(parts: usize, k: usize, numbers: &Numbers) -> Option<f64> {
    if parts >= numbers.parts {
        return Some(numbers.doubt);
    }
    // P z is F with k and k (P - 1) degrees of freedom
    let chance = |parts: usize, z: f64| {
        let (k, parts) = (k as f64, parts as f64);
        let distribution = FisherSnedecor::new(k, k * (parts - 1.0)).ok()?;
        Some(distribution.sf(parts * z))
    };
    let usual = chance(numbers.parts, numbers.doubt)?;
    let (mut low, mut high) = (numbers.doubt, MOST_DOUBT);
    if parts < LEAST_PARTS || chance(parts, high)? > usual {
        return None;
    }
    // halves of the logarithm: to a thousandth after thirty
    for _ in 0..30 {
        let middle = (low * high).sqrt();
        match chance(parts, middle)? > usual {
            true => low = middle,
            false => high = middle,
        }
    }
    Some(high)
}

/// Adds a joint's information on an effect in one part, its own other terms projected out.
fn reduced(
    sums: &DMatrix<f64>,
    terms: &Terms,
    j: usize,
    (effect, values): (&[usize], &DVector<f64>),
    (s, r): (&mut DMatrix<f64>, &mut DVector<f64>),
) {
    let tau = sums.nrows() - 1;
    let others = terms.own(j).into_iter();
    let others = others.filter(|(i, _)| !effect.contains(i));
    let (free, held): (Vec<_>, Vec<_>) = others.partition(|(i, _)| terms.list[*i].is_of(j));
    let target = |a: &usize| -> f64 {
        let column = sums.column(*a);
        let held = held.iter().map(|(i, b)| column[*b] * values[*i]);
        column[tau] - held.sum::<f64>()
    };
    let targets = |of: &[usize]| DVector::from_iterator(of.len(), of.iter().map(target));
    let own = effect.iter().enumerate();
    let own = own.filter_map(|(at, i)| Some((at, terms.list[*i].column(j)?)));
    let (places, columns): (Vec<usize>, Vec<usize>) = own.unzip();
    let o: Vec<usize> = free.iter().map(|(_, a)| *a).collect();
    let of = |rows: &[usize], columns: &[usize]| sums.select_rows(rows).select_columns(columns);
    let mut inner = of(&o, &o);
    for i in 0..o.len() {
        let x = inner[(i, i)];
        inner[(i, i)] = x * (1.0 + terms.ridge) + f64::MIN_POSITIVE.sqrt();
    }
    let across = of(&o, &columns);
    let mut own_part = of(&columns, &columns);
    let mut side = targets(&columns);
    if let (false, Some(factor)) = (o.is_empty(), inner.cholesky()) {
        let through = factor.solve(&across);
        own_part -= across.tr_mul(&through);
        side -= through.tr_mul(&targets(&o));
    }
    let w = terms.weights[j];
    for (x, i) in places.iter().enumerate() {
        r[*i] += w * side[x];
        for (y, l) in places.iter().enumerate() {
            s[(*i, *l)] += w * own_part[(x, y)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::NUMBERS;

    #[test]
    fn fewer_parts_must_agree_so_much_the_better_and_two_never_do() {
        let of = |parts, k| doubt(parts, k, &NUMBERS);
        for k in [1, 5] {
            assert_eq!([of(12, k), of(40, k)], [Some(4.0); 2]);
            assert_eq!(of(2, k), None);
            let fewer: Vec<f64> = (3..12).map(|parts| of(parts, k).unwrap()).collect();
            assert!(fewer.windows(2).all(|pair| pair[0] > pair[1]), "{fewer:?}");
        }
        // F(1, 7) and F(1, 4) at the chance of 2.5e-5 that F(1, 11) has beyond 48
        let [eight, five] = [8, 5].map(|parts| of(parts, 1).unwrap());
        assert!((10.0..14.0).contains(&eight), "{eight}");
        assert!((70.0..130.0).contains(&five), "{five}");
    }
}
