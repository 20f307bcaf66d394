//! Columns of terms along a scene: every factor once, then their products.

use super::term::{Factor, FormulaTerm, Function, Source};
use crate::effect::Scene;

/// What the columns of terms are products of.
pub struct Columns {
    factors: Vec<Factor>,
    /// A wave's source, number and whether it is the cosine.
    waves: Vec<(Source, f64, bool)>,
    /// Places of each column's factors among the series.
    of: Vec<Vec<usize>>,
}

impl Columns {
    pub fn of(terms: &[FormulaTerm]) -> Self {
        let mut all = Columns {
            factors: Vec::new(),
            waves: Vec::new(),
            of: Vec::new(),
        };
        for factor in terms.iter().flat_map(|t| &t.factors) {
            place(&mut all.factors, *factor);
        }
        let first = all.factors.len();
        for term in terms {
            let own: Vec<usize> = term
                .factors
                .iter()
                .map(|f| place(&mut all.factors, *f))
                .collect();
            match term.wave {
                None => all.of.push(own),
                Some((source, n)) => {
                    for cosine in [false, true] {
                        let wave = first + place(&mut all.waves, (source, n, cosine));
                        all.of.push([own.as_slice(), &[wave]].concat());
                    }
                }
            }
        }
        all
    }

    pub fn count(&self) -> usize {
        self.of.len()
    }

    pub fn series(&self, scene: &Scene) -> Vec<Vec<f64>> {
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
