//! The numbers that a search turns: offsets and coefficients, scaled to about 1.

use super::limits::{BoundedQuantity, Quantity};
use super::series::Series;

/// Length of one unit of a search variable, in half spans and speed limits: the first step is one unit at most.
const UNIT_OF_SPAN: f64 = 0.05;

/// A map from search variables to a series: per coordinate a free offset in half spans, then a and b in speed limits.
#[derive(Debug, Clone)]
pub(super) struct DesignVariables {
    pub fundamental: f64,
    pub harmonics: usize,
    /// Offset per coordinate that the search must keep.
    pub fixed: Vec<Option<f64>>,
    /// Middle and half span of each coordinate.
    pub span: Vec<(f64, f64)>,
    /// Unit of the a and b of each coordinate.
    pub speed: Vec<f64>,
}

impl DesignVariables {
    /// Scales from limits; without one of speed, that which crosses the span within a period of the highest harmonic.
    pub fn new(
        channels: &[BoundedQuantity],
        fundamental: f64,
        harmonics: usize,
        fixed: Vec<Option<f64>>,
    ) -> Self {
        let of = |quantity, i| BoundedQuantity::find(channels, quantity, i);
        let span = |i| of(Quantity::Position, i).map_or((0.0, 1.0), |c| (c.middle(), c.room()));
        let span: Vec<(f64, f64)> = (0..fixed.len()).map(span).collect();
        let speed = |(i, span): (usize, &(f64, f64))| {
            let natural = fundamental * harmonics as f64 * span.1;
            of(Quantity::Speed, i).map_or(natural, |c| c.upper.min(natural))
        };
        let speed = span.iter().enumerate().map(speed).collect();
        Self {
            fundamental,
            harmonics,
            fixed,
            span,
            speed,
        }
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.span.len()
    }

    /// Number of search variables.
    pub fn len(&self) -> usize {
        let free = self.fixed.iter().filter(|o| o.is_none()).count();
        free + 2 * self.harmonics * self.coordinates()
    }

    /// Writes the series of z.
    pub fn series(&self, z: &[f64], out: &mut Series) {
        let mut z = z.iter();
        let mut next = || z.next().copied().unwrap_or(0.0);
        for i in 0..self.coordinates() {
            let (middle, half) = self.span[i];
            out.offset[i] = self.fixed[i].unwrap_or_else(|| middle + UNIT_OF_SPAN * half * next());
            for x in out.a[i].iter_mut().chain(&mut out.b[i]) {
                *x = UNIT_OF_SPAN * self.speed[i] * next();
            }
        }
    }

    /// The z of a series: the inverse of [`Self::series`] but for offsets that are given.
    pub fn of(&self, series: &Series) -> Vec<f64> {
        let mut z = Vec::with_capacity(self.len());
        for i in 0..self.coordinates() {
            let (middle, half) = self.span[i];
            if self.fixed[i].is_none() {
                z.push((series.offset[i] - middle) / (UNIT_OF_SPAN * half));
            }
            let speed = UNIT_OF_SPAN * self.speed[i];
            z.extend(series.a[i].iter().chain(&series.b[i]).map(|x| x / speed));
        }
        z
    }

    /// Derivatives by z from those by (offset, a, b), coordinate after coordinate.
    pub fn pull_back(&self, by_coefficients: &[f64], out: &mut [f64]) {
        let mut at = 0;
        let rows = by_coefficients.chunks_exact(1 + 2 * self.harmonics);
        for (i, row) in rows.enumerate() {
            if self.fixed[i].is_none() {
                out[at] = UNIT_OF_SPAN * row[0] * self.span[i].1;
                at += 1;
            }
            for g in &row[1..] {
                out[at] = UNIT_OF_SPAN * g * self.speed[i];
                at += 1;
            }
        }
    }
}
