//! Courses that are followed together: their innovations, made white over time and among each other.

use nalgebra::DMatrix;

use super::local_level::InnovationGains;
use super::walk::{WalkSizes, median};

/// Estimates of one parameter of those that are followed together.
#[derive(Debug)]
pub(super) struct Signal {
    pub values: Vec<f64>,
    /// Infinite where a log says nothing, or stands alone.
    pub variances: Vec<f64>,
    /// Logs that stand alone.
    pub outliers: Vec<usize>,
}

impl Signal {
    /// Values of this course with 0 where no log determines it.
    pub(super) fn determined(&self, values: &[f64]) -> Vec<f64> {
        let pairs = values.iter().zip(&self.variances);
        pairs
            .map(|(x, r)| if r.is_finite() { *x } else { 0.0 })
            .collect()
    }
}

/// What is known of courses.
#[derive(Debug, Clone, Copy)]
pub(super) struct CourseSignals<'a> {
    pub members: &'a [Signal],
    /// Spacings of the logs over the usual one.
    pub spacings: &'a [f64],
    pub times: &'a [f64],
    /// Correlation of the errors of one log's estimates, row by row, where their fits say it.
    pub correlation: Option<&'a [f64]>,
}

/// What is estimated of each parameter besides the changes: level, walk and scatter.
const OTHERS: usize = 3;

impl CourseSignals<'_> {
    /// Estimates that say something, less what is estimated from them with so many changes.
    pub(super) fn freedom(&self, changes: usize) -> usize {
        let all = self.members.iter().flat_map(|member| &member.variances);
        let shown = all.filter(|r| r.is_finite()).count();
        shown.saturating_sub(self.members.len() * (OTHERS + changes))
    }

    /// Logs that say something.
    pub(super) fn shown(&self) -> Vec<usize> {
        (0..self.times.len())
            .filter(|k| self.members.iter().any(|m| m.variances[*k].is_finite()))
            .collect()
    }
}

/// Logs that the correlation by the fits counts for, beside those that are seen.
const FITS_COUNT: f64 = 10.0;
/// Innovations count up to so many of their deviations where their correlation is estimated.
const CLIPPED: f64 = 2.5;
/// Most that two are taken to go together.
const MOST_CORRELATED: f64 = 0.9;

/// What makes signals of all courses white.
pub(super) struct CourseWhitener<'a> {
    about: CourseSignals<'a>,
    whiteners: Vec<InnovationGains>,
    /// Lower Cholesky factor of the correlation of the innovations.
    factors: Vec<(u64, DMatrix<f64>)>,
}

impl<'a> CourseWhitener<'a> {
    /// By the sizes of walk and scatter; `rests` are signals without changes, whose innovations show how they go
    /// together.
    pub(super) fn new(about: CourseSignals<'a>, sizes: &[WalkSizes], rests: &[Vec<f64>]) -> Self {
        let members = about.members.iter().zip(sizes);
        let whiteners: Vec<InnovationGains> = members
            .map(|(m, own)| InnovationGains::new(&own.variances(&m.variances, about.spacings)))
            .collect();
        let correlation = match whiteners.len() {
            1 => DMatrix::identity(1, 1),
            _ => correlation(&whiteners, rests, about.correlation),
        };
        let mut masks: Vec<u64> = (0..about.times.len())
            .map(|k| mask(&whiteners, k))
            .collect();
        masks.sort_unstable();
        masks.dedup();
        let factor = |mask: u64| {
            let shown: Vec<usize> = members_of(mask, whiteners.len()).collect();
            let own = correlation.select_rows(&shown).select_columns(&shown);
            let size = shown.len();
            let factor = own.cholesky().map(|c| c.l());
            (mask, factor.unwrap_or(DMatrix::identity(size, size)))
        };
        CourseWhitener {
            factors: masks.into_iter().map(factor).collect(),
            about,
            whiteners,
        }
    }

    /// All courses' signals, white, one after the other log by log.
    pub(super) fn signals(&self) -> Vec<f64> {
        let pairs = self.whiteners.iter().zip(self.about.members);
        let apart: Vec<Vec<f64>> = pairs.map(|(own, m)| own.apply(&m.values)).collect();
        self.mixed(&apart)
    }

    /// What a shape is in each of the courses.
    pub(super) fn columns(&self, shape: &[f64]) -> Vec<Vec<f64>> {
        let count = self.whiteners.len();
        let column = |i: usize| {
            let mut apart = vec![Vec::new(); count];
            apart[i] = self.whiteners[i].apply(shape);
            self.mixed(&apart)
        };
        (0..count).map(column).collect()
    }

    /// Innovations that were white over time alone; an empty one is 0.
    fn mixed(&self, apart: &[Vec<f64>]) -> Vec<f64> {
        let (count, logs) = (apart.len(), self.about.times.len());
        let mut out = vec![0.0; count * logs];
        for (k, out) in out.chunks_exact_mut(count).enumerate() {
            let mask = mask(&self.whiteners, k);
            let factor = self.factors.iter().find(|(of, _)| *of == mask);
            let Some((_, factor)) = factor else { continue };
            for (row, i) in members_of(mask, count).enumerate() {
                let own = apart[i].get(k).copied().unwrap_or_default();
                let known: f64 = (0..row).map(|c| factor[(row, c)] * out[c]).sum();
                out[row] = (own - known) / factor[(row, row)];
            }
        }
        out
    }
}

/// Courses with an innovation at a log, as bits.
fn mask(whiteners: &[InnovationGains], log: usize) -> u64 {
    let own = whiteners.iter().enumerate();
    own.map(|(i, w)| u64::from(w.is_informative(log)) << i)
        .sum()
}

fn members_of(mask: u64, count: usize) -> impl Iterator<Item = usize> {
    (0..count).filter(move |i| mask >> i & 1 == 1)
}

/// Correlation of innovations of the same log, those that are far out clipped; drawn to what the fits say.
fn correlation(
    whiteners: &[InnovationGains],
    rests: &[Vec<f64>],
    fits: Option<&[f64]>,
) -> DMatrix<f64> {
    let count = whiteners.len();
    let clipped = |(own, rest): (&InnovationGains, &Vec<f64>)| {
        let white = own.apply(rest);
        let known = white
            .iter()
            .enumerate()
            .filter(|(k, _)| own.is_informative(*k));
        let most = median(known.map(|(_, x)| x.abs())).unwrap_or_default();
        let most = (CLIPPED * 1.4826 * most).max(1e-12);
        white.iter().map(|x| x.clamp(-most, most)).collect()
    };
    let white: Vec<Vec<f64>> = whiteners.iter().zip(rests).map(clipped).collect();
    let of = |i: usize, j: usize| {
        if i == j {
            return 1.0;
        }
        let both = (0..white[i].len())
            .filter(|k| whiteners[i].is_informative(*k) && whiteners[j].is_informative(*k));
        let (mut n, mut product, mut squares) = (0.0, 0.0, [0.0; 2]);
        for k in both {
            let (x, y) = (white[i][k], white[j][k]);
            n += 1.0;
            product += x * y;
            squares[0] += x * x;
            squares[1] += y * y;
        }
        let norm = (squares[0] * squares[1]).sqrt();
        let seen = if norm > 0.0 { product / norm } else { 0.0 };
        let together = match fits {
            Some(fits) => (n * seen + FITS_COUNT * fits[i * count + j]) / (n + FITS_COUNT),
            None => seen,
        };
        together.clamp(-MOST_CORRELATED, MOST_CORRELATED)
    };
    DMatrix::from_fn(count, count, of)
}

/// A signal without its parts along orthonormal ones.
pub(super) fn without(signal: &[f64], known: &[Vec<f64>]) -> Vec<f64> {
    let mut rest = signal.to_vec();
    for unit in known {
        let part: f64 = rest.iter().zip(unit).map(|(x, u)| x * u).sum();
        rest.iter_mut().zip(unit).for_each(|(x, u)| *x -= part * u);
    }
    rest
}

/// Orthonormal signals that span the same.
pub(super) fn orthonormal<'a>(columns: impl Iterator<Item = &'a Vec<f64>>) -> Vec<Vec<f64>> {
    let mut units: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let rest = without(column, &units);
        let norm = rest.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 1e-9 {
            units.push(rest.iter().map(|x| x / norm).collect());
        }
    }
    units
}
