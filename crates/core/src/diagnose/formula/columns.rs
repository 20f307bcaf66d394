//! Columns of terms along a scene: every factor once, then their products; and rows of a joint with them.

use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::term::{Factor, FormulaTerm, Function, Source};
use crate::diagnose::prepared::PreparedCase;
use crate::diagnose::problem::pass::{EffectCandidate, LANES, Window, in_window, windows};
use crate::effect::{AugmentedModel, EffectScene, shifted};
use crate::motion::MotionError;

/// What the columns of terms are products of.
#[derive(Default)]
pub struct Columns {
    factors: Vec<Factor>,
    /// A wave's source, number and whether it is the cosine.
    waves: Vec<(Source, f64, bool)>,
    /// Places of each column's factors among the series.
    of: Vec<Vec<usize>>,
}

impl Columns {
    pub fn of(terms: &[FormulaTerm]) -> Self {
        let mut all = Columns::default();
        for factor in terms.iter().flat_map(|t| &t.factors) {
            place(&mut all.factors, *factor);
        }
        let first = all.factors.len();
        for term in terms {
            let own = term.factors.iter();
            let own: Vec<usize> = own.map(|f| place(&mut all.factors, *f)).collect();
            let Some((source, n)) = term.wave else {
                all.of.push(own);
                continue;
            };
            for cosine in [false, true] {
                let wave = first + place(&mut all.waves, (source, n, cosine));
                all.of.push([own.as_slice(), &[wave]].concat());
            }
        }
        all
    }

    pub fn count(&self) -> usize {
        self.of.len()
    }

    pub fn series(&self, scene: &EffectScene) -> Vec<Vec<f64>> {
        let factors = self.factors.iter().map(|f| f.series(scene));
        let waves = self.waves.iter().map(|(source, n, cosine)| {
            let mut x = Factor::of(Function::Plain, *source).series(scene);
            x.iter_mut().for_each(|x| {
                let (sin, cos) = (n * *x).sin_cos();
                *x = if *cosine { cos } else { sin };
            });
            x
        });
        factors.chain(waves).collect()
    }

    pub fn column(&self, series: &[Vec<f64>], i: usize) -> Vec<f64> {
        let mut factors = self.of[i].iter().map(|k| &series[*k]);
        let mut out = factors.next().cloned().unwrap_or_default();
        for factor in factors {
            out.iter_mut().zip(factor).for_each(|(x, y)| *x *= y);
        }
        out
    }
}

/// Place of what is in a list, where it is put if it is not there.
fn place<T: PartialEq>(list: &mut Vec<T>, own: T) -> usize {
    let known = list.iter().position(|x| *x == own);
    known.unwrap_or_else(|| {
        list.push(own);
        list.len() - 1
    })
}

pub struct RowsOfJoint {
    /// Of unknowns, of candidates, the torque and the residual.
    pub declared: DMatrix<f64>,
    pub more: DMatrix<f64>,
    pub blocks: Vec<Range<usize>>,
}

impl PreparedCase<'_> {
    /// About as many rows of a joint as are searched, with the columns of candidates and of terms.
    pub fn joint_rows(
        &self,
        about: &AugmentedModel,
        candidates: &[EffectCandidate],
        terms: &[FormulaTerm],
        j: usize,
    ) -> Result<RowsOfJoint, MotionError> {
        let (data, blocks) = (&self.data, &self.blocks.list);
        let unknowns = &self.unknowns.without_held();
        let columns = Columns::of(terms);
        let moving = |s: usize| !data.split.is_stationary(s, j);
        let pieces = blocks.iter().flat_map(|b| &b.pieces);
        let pieces = pieces.filter(|(s, _)| moving(*s));
        let all: usize = pieces.map(|(_, rows)| rows.len()).sum();
        let every = all.div_ceil(self.case.formula.rows).max(1);
        // of each block: its rows, piece by piece
        let mut found: Vec<Vec<Vec<f64>>> = vec![Vec::new(); blocks.len()];
        let windows = windows(data, blocks).into_iter();
        for (stretch, range) in windows.filter(|(s, _)| moving(*s)) {
            let window = Window::of(about, data, stretch, &range);
            let own = window.rows_of(j, unknowns, candidates)?;
            let made = columns.rows(&window, j)?;
            for (block, out) in blocks.iter().zip(&mut found) {
                let rows = in_window(block, (stretch, &range), every);
                for k in rows.flat_map(|rows| rows.step_by(every)) {
                    let made = made.iter().map(|column| column[k]);
                    out.push(own.row(k).iter().copied().chain(made).collect());
                }
            }
        }
        let mut end = 0;
        let of_block = |rows: &Vec<Vec<f64>>| {
            end += rows.len();
            end - rows.len()..end
        };
        let blocks = found.iter().map(of_block).collect();
        let rows = found.concat();
        let width = rows.first().map_or(0, Vec::len);
        let first = width.saturating_sub(columns.count());
        Ok(RowsOfJoint {
            declared: DMatrix::from_fn(rows.len(), first, |i, c| rows[i][c]),
            more: DMatrix::from_fn(rows.len(), width - first, |i, c| rows[i][first + c]),
            blocks,
        })
    }
}

impl Columns {
    fn rows(&self, window: &Window, j: usize) -> Result<Vec<Vec<f64>>, MotionError> {
        let series = self.series(&window.scene());
        let (weights, late) = (window.weights(j), window.late(j));
        let groups: Vec<usize> = (0..self.count()).step_by(LANES).collect();
        let rows = groups.into_par_iter().map(|first| {
            let own = first..(first + LANES).min(self.count());
            let mut raw: Vec<Vec<f64>> = own.map(|i| self.column(&series, i)).collect();
            raw.iter_mut().for_each(|column| shifted(column, late));
            window.kept(&mut raw, &weights)
        });
        Ok(rows.collect::<Result<Vec<_>, _>>()?.concat())
    }
}
