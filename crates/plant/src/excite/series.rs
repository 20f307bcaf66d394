//! Finite Fourier series (43) of n coordinates, sampled over one period.

use std::f64::consts::TAU;

/// x_i(t) = offset_i + sum_l a_il/(l w) sin(l w t) - b_il/(l w) cos(l w t), eq. (43).
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// w, the fundamental angular frequency \[rad/s\].
    pub fundamental: f64,
    /// q_i0 per coordinate \[m or rad\].
    pub offset: Vec<f64>,
    /// a_il, one row of N amplitudes of the velocity per coordinate \[m/s or rad/s\].
    pub a: Vec<Vec<f64>>,
    /// b_il, as `a`.
    pub b: Vec<Vec<f64>>,
}

/// Position, velocity and acceleration of every coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// \[m or rad\]
    pub x: [f64; MAX_COORDINATES],
    /// \[m/s or rad/s\]
    pub xd: [f64; MAX_COORDINATES],
    /// \[m/s^2 or rad/s^2\]
    pub xdd: [f64; MAX_COORDINATES],
}

/// Most coordinates of a robot.
pub const MAX_COORDINATES: usize = cft_ident_core::robot::tree::MOST_JOINTS;

impl Kinematics {
    /// At rest in the origin.
    pub const REST: Self = Self {
        x: [0.0; MAX_COORDINATES],
        xd: [0.0; MAX_COORDINATES],
        xdd: [0.0; MAX_COORDINATES],
    };
}

impl Series {
    /// A series of `n` coordinates and `harmonics` terms that stands still at the origin.
    pub fn still(fundamental: f64, n: usize, harmonics: usize) -> Self {
        Self {
            fundamental,
            offset: vec![0.0; n],
            a: vec![vec![0.0; harmonics]; n],
            b: vec![vec![0.0; harmonics]; n],
        }
    }

    /// Number of coordinates n.
    pub fn coordinates(&self) -> usize {
        self.offset.len()
    }

    /// Number of terms N of each kind.
    pub fn harmonics(&self) -> usize {
        self.a.first().map_or(0, Vec::len)
    }

    /// T = 2 pi / w \[s\].
    pub fn period(&self) -> f64 {
        TAU / self.fundamental
    }

    /// All coordinates at the time t \[s\] of the series' own clock.
    pub fn at(&self, t: f64) -> Kinematics {
        let mut k = Kinematics::REST;
        for i in 0..self.coordinates() {
            [k.x[i], k.xd[i], k.xdd[i]] = self.one(i, t);
        }
        k
    }

    /// Position, velocity and acceleration of coordinate i at t.
    pub fn one(&self, i: usize, t: f64) -> [f64; 3] {
        self.sum(i, |_, lw| (lw * t).sin_cos())
    }

    /// [`Self::one`] with the sine and cosine of harmonic l, of the frequency lw.
    #[inline]
    fn sum(&self, i: usize, sin_cos: impl Fn(usize, f64) -> (f64, f64)) -> [f64; 3] {
        let mut out = [self.offset[i], 0.0, 0.0];
        for (l, (a, b)) in self.a[i].iter().zip(&self.b[i]).enumerate() {
            let lw = (l + 1) as f64 * self.fundamental;
            let (s, c) = sin_cos(l, lw);
            out[0] += (a * s - b * c) / lw;
            out[1] += a * c + b * s;
            out[2] += (b * c - a * s) * lw;
        }
        out
    }

    /// Bound of the k-th time derivative of coordinate i without its offset: the sum of its terms' amplitudes.
    pub(super) fn derivative_bound(&self, i: usize, k: i32) -> f64 {
        let terms = self.a[i].iter().zip(&self.b[i]).enumerate();
        let amplitude =
            |l: usize, a: f64, b: f64| ((l + 1) as f64 * self.fundamental).powi(k - 1) * a.hypot(b);
        terms.map(|(l, (a, b))| amplitude(l, *a, *b)).sum()
    }

    /// The same motion with the amplitudes of coordinate i times `factor`, about its offset.
    pub fn scale(&mut self, i: usize, factor: f64) {
        for x in self.a[i].iter_mut().chain(&mut self.b[i]) {
            *x *= factor;
        }
    }

    /// The same path so many times as fast.
    pub fn at_pace(&self, pace: f64) -> Self {
        Series {
            fundamental: pace * self.fundamental,
            ..self.scaled(pace)
        }
    }

    /// The amplitudes of every coordinate times `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut out = self.clone();
        for i in 0..out.coordinates() {
            out.scale(i, factor);
        }
        out
    }
}

/// sin and cos of every harmonic at equal steps of one period.
#[derive(Debug, Clone)]
pub(super) struct HarmonicBasis {
    pub samples: usize,
    pub harmonics: usize,
    /// (sin, cos) of (l+1) 2 pi m / samples at entry m N + l.
    table: Vec<(f64, f64)>,
}

impl HarmonicBasis {
    pub fn new(samples: usize, harmonics: usize) -> Self {
        // whole turns taken off, so that large angles lose nothing
        let turns = |m: usize, l: usize| (m * l % samples) as f64 / samples as f64;
        let row = |m| (1..=harmonics).map(move |l| (TAU * turns(m, l)).sin_cos());
        Self {
            samples,
            harmonics,
            table: (0..samples).flat_map(row).collect(),
        }
    }

    /// Coordinate i of the series at sample m.
    #[inline]
    pub fn at(&self, series: &Series, i: usize, m: usize) -> [f64; 3] {
        let row = &self.table[m * self.harmonics..(m + 1) * self.harmonics];
        series.sum(i, |l, _| row[l])
    }

    /// [`Self::pull_back`] for every coordinate, whose derivatives stand one after the other in `out`.
    #[inline]
    pub(super) fn pull_back_all(
        &self,
        fundamental: f64,
        m: usize,
        by: &[[f64; 3]; MAX_COORDINATES],
        out: &mut [f64],
    ) {
        let width = 1 + 2 * self.harmonics;
        for (row, g) in out.chunks_exact_mut(width).zip(by) {
            self.pull_back(fundamental, m, *g, row);
        }
    }

    /// Adds derivatives `g` by (x, xd, xdd) of a coordinate at sample m to those by its (offset, a, b).
    #[inline]
    pub(super) fn pull_back(&self, fundamental: f64, m: usize, g: [f64; 3], out: &mut [f64]) {
        let n = self.harmonics;
        let row = &self.table[m * n..(m + 1) * n];
        let (offset, rest) = out.split_at_mut(1);
        let (a, b) = rest.split_at_mut(n);
        offset[0] += g[0];
        for (l, (s, c)) in row.iter().enumerate() {
            let lw = (l + 1) as f64 * fundamental;
            let along = g[0] / lw - g[2] * lw;
            a[l] += along * s + g[1] * c;
            b[l] += g[1] * s - along * c;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series() -> Series {
        Series {
            fundamental: TAU * 0.4,
            offset: vec![-0.1, 0.3],
            a: vec![vec![0.2, -0.1, 0.05], vec![0.1, 0.3, -0.2]],
            b: vec![vec![-0.3, 0.1, 0.02], vec![0.0, 0.2, 0.1]],
        }
    }

    #[test]
    fn velocity_and_acceleration_are_derivatives_of_the_position() {
        let (series, h) = (series(), 1e-5);
        for k in 0..50 {
            let t = 0.05 * f64::from(k);
            for i in 0..2 {
                let [before, here, after] = [t - h, t, t + h].map(|t| series.one(i, t));
                for d in 0..2 {
                    let slope = (after[d] - before[d]) / (2.0 * h);
                    assert!((slope - here[d + 1]).abs() < 1e-8 * (1.0 + slope.abs()));
                }
            }
        }
    }

    #[test]
    fn a_table_of_the_period_gives_the_series_and_its_adjoint() {
        let series = series();
        let basis = HarmonicBasis::new(20, 3);
        for m in 0..20 {
            let t = series.period() * m as f64 / 20.0;
            for i in 0..2 {
                let (there, here) = (series.one(i, t), basis.at(&series, i, m));
                for d in 0..3 {
                    assert!((there[d] - here[d]).abs() < 1e-12);
                }
                // g . x(c) is linear in c but for the offset's place: the adjoint gives g . x back.
                let g = [0.7, -0.4, 0.2];
                let mut out = [0.0; 7];
                basis.pull_back(series.fundamental, m, g, &mut out);
                let c = [&[series.offset[i]], &series.a[i][..], &series.b[i]].concat();
                let back: f64 = out.iter().zip(&c).map(|(g, c)| g * c).sum();
                let direct: f64 = (0..3).map(|d| g[d] * here[d]).sum();
                assert!((back - direct).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn bounds_of_derivatives_hold() {
        let series = series();
        for m in 0..200 {
            let [x, xd, xdd] = series.one(1, series.period() * f64::from(m) / 200.0);
            assert!((x - series.offset[1]).abs() <= series.derivative_bound(1, 0));
            assert!(xd.abs() <= series.derivative_bound(1, 1));
            assert!(xdd.abs() <= series.derivative_bound(1, 2));
        }
    }
}
