//! Few terms of many: the greatest gain on blocks left out, term by term, each asked again whether another serves
//! better in its place, and whether it is needed at all.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::columns::RowsOfJoint;
use super::term::{FormulaTerm, TermNames};
use crate::diagnose::problem::formula_numbers::FormulaNumbers;
use crate::judge::{BlockSums, BlocksLeftOut, Bound, ErrorGain, Numbers, Term, Terms};

/// Terms with sums of products of their columns, the declared ones and the residual.
pub struct TermProducts<'a> {
    pub terms: &'a [FormulaTerm],
    columns: Vec<Range<usize>>,
    /// Names and values of the shapes of each.
    shapes: Vec<Vec<String>>,
    more: &'a DMatrix<f64>,
    blocks: Vec<BlockProducts>,
    /// Of more columns beside the declared ones, over all blocks.
    beside: DMatrix<f64>,
    /// Declared columns solved for those.
    through: DMatrix<f64>,
    /// Part of each column's own square that is beside the declared ones.
    share: Vec<f64>,
}

/// Products of the rows of a block.
struct BlockProducts {
    rows: Range<usize>,
    /// Declared by declared, more by declared, and both by the residual.
    declared: DMatrix<f64>,
    across: DMatrix<f64>,
    right: [DVector<f64>; 2],
    square: f64,
}

/// Terms that were chosen, with what they gain and what they leave.
#[derive(Debug, Clone)]
pub struct SelectedTerms {
    pub terms: Vec<usize>,
    pub gain: ErrorGain,
    /// Squared error of blocks left out without any, and of each block with them.
    pub error: f64,
    pub left: Vec<Vec<f64>>,
    /// Part of the error of each block that they take off, -1 to 1, its mean: every block counts the same.
    pub even: f64,
    /// Square of what each term adds beside the declared columns.
    pub squares: Vec<f64>,
}

impl<'a> TermProducts<'a> {
    /// None where the declared columns have no factor.
    pub fn of(
        terms: &'a [FormulaTerm],
        (rows, gram, kept): (&'a RowsOfJoint, &DMatrix<f64>, &[usize]),
        names: &TermNames,
        ridge: f64,
    ) -> Option<Self> {
        let mut next = 0;
        let place = |term: &FormulaTerm| {
            let first = next;
            next += term.count();
            first..next
        };
        let columns: Vec<Range<usize>> = terms.iter().map(place).collect();
        // the residual stands last
        let left = rows.declared.column(rows.declared.ncols().checked_sub(1)?);
        let own = rows.declared.select_columns(kept);
        let of_block = |block: &Range<usize>| {
            let (from, count) = (block.start, block.len());
            let (own, more) = (own.rows(from, count), rows.more.rows(from, count));
            let left = left.rows(from, count);
            BlockProducts {
                rows: block.clone(),
                declared: own.transpose() * own,
                across: more.transpose() * own,
                right: [own.tr_mul(&left), more.tr_mul(&left)],
                square: left.norm_squared(),
            }
        };
        let blocks: Vec<BlockProducts> = rows.blocks.iter().map(of_block).collect();
        let mut normal: DMatrix<f64> = blocks.iter().map(|b| &b.declared).sum();
        for i in 0..kept.len() {
            normal[(i, i)] += (ridge * normal[(i, i)]).max(1e-300);
        }
        let across: DMatrix<f64> = blocks.iter().map(|b| &b.across).sum();
        let through = normal.cholesky()?.solve(&across.transpose());
        let beside = gram - across * &through;
        let part = |c: usize| beside[(c, c)] / gram[(c, c)].max(1e-300);
        Some(TermProducts {
            terms,
            columns,
            shapes: terms.iter().map(|t| shapes_of(t, names)).collect(),
            more: &rows.more,
            blocks,
            share: (0..gram.ncols()).map(part).collect(),
            beside,
            through,
        })
    }

    /// Chooses terms, the residual of each block with a sign.
    pub fn select(
        &self,
        signs: &[f64],
        (formula, judge): (&FormulaNumbers, &Numbers),
    ) -> Option<SelectedTerms> {
        let pull = self.pull(signs);
        let asked = SelectionTask {
            of: self,
            signs,
            pull: &pull,
            formula,
            judge,
        };
        let mut chosen: Vec<usize> = Vec::new();
        let none = asked.with_left_out((&[], &[]), |none, _| none.errors())?;
        let error: f64 = none.iter().flatten().sum();
        while chosen.len() < formula.terms {
            let Some((best, gain)) = asked.best(&chosen, None) else {
                break;
            };
            if gain.value < formula.least_share * error {
                break;
            }
            chosen.push(best);
            asked.exchange(&mut chosen);
        }
        asked.prune(&mut chosen);
        if chosen.is_empty() {
            return None;
        }
        let left = asked.with_left_out((&chosen, &[]), |left_out, _| left_out.errors())?;
        Some(SelectedTerms {
            gain: asked.gain(&[], &chosen)?,
            even: evenly(&none, &left),
            left,
            squares: asked.squares(&chosen)?,
            terms: chosen,
            error,
        })
    }

    /// Products of more columns with the residual, beside the declared ones.
    fn pull(&self, signs: &[f64]) -> DVector<f64> {
        let [own, more] = [0, 1].map(|k| {
            let parts = self.blocks.iter().zip(signs);
            let parts = parts.map(|(block, sign)| &block.right[k] * *sign);
            parts.sum::<DVector<f64>>()
        });
        more - self.through.tr_mul(&own)
    }

    fn columns_of(&self, terms: &[usize]) -> Vec<usize> {
        let columns = terms.iter().flat_map(|t| self.columns[*t].clone());
        columns.collect()
    }
}

/// Mean part of the error of a block that is taken off.
fn evenly(before: &[Vec<f64>], after: &[Vec<f64>]) -> f64 {
    let of_block = |(before, after): (&Vec<f64>, &Vec<f64>)| {
        let [before, after] = [before, after].map(|e| e.iter().sum::<f64>());
        match before > 0.0 {
            true => (1.0 - after / before).max(-1.0),
            false => 0.0,
        }
    };
    let parts = before.iter().zip(after).map(of_block);
    parts.sum::<f64>() / before.len().max(1) as f64
}

/// Products of all columns with one another, some columns at a time.
pub fn gram(more: &DMatrix<f64>) -> DMatrix<f64> {
    let turned = more.transpose();
    let firsts: Vec<usize> = (0..more.ncols()).step_by(SIDE_BY_SIDE).collect();
    let parts = firsts.into_par_iter().map(|first| {
        let count = SIDE_BY_SIDE.min(more.ncols() - first);
        Vec::from((&turned * more.columns(first, count)).data)
    });
    let parts: Vec<Vec<f64>> = parts.collect();
    DMatrix::from_vec(more.ncols(), more.ncols(), parts.concat())
}

/// Columns of a product that one thread makes.
const SIDE_BY_SIDE: usize = 128;

fn shapes_of(term: &FormulaTerm, names: &TermNames) -> Vec<String> {
    let of = |s: super::term::ShapeNumber| format!("{} {:?}", s.name, s.value);
    term.shapes(names).into_iter().map(of).collect()
}

/// What is chosen for: a residual with signs.
struct SelectionTask<'a> {
    of: &'a TermProducts<'a>,
    signs: &'a [f64],
    pull: &'a DVector<f64>,
    formula: &'a FormulaNumbers,
    judge: &'a Numbers,
}

impl SelectionTask<'_> {
    /// The fit without each block, of the declared columns and some terms, with columns of more for a look.
    fn sums(&self, used: &[usize]) -> BlockSums {
        let p = self.of;
        let columns = p.columns_of(used);
        let d = p.through.nrows();
        let size = d + columns.len();
        let mut sums = BlockSums::zeros(p.blocks.len(), &[size]);
        for (b, (block, sign)) in p.blocks.iter().zip(self.signs).enumerate() {
            let out = &mut sums.blocks[b][0];
            out.view_mut((0, 0), (d, d)).copy_from(&block.declared);
            let mut put = |i: usize, k: usize, x: f64| {
                out[(i, k)] = x;
                out[(k, i)] = x;
            };
            let more = p.more.rows(block.rows.start, block.rows.len());
            (0..d).for_each(|l| put(l, size, sign * block.right[0][l]));
            for (i, c) in columns.iter().enumerate() {
                (0..d).for_each(|l| put(d + i, l, block.across[(*c, l)]));
                for (k, other) in columns.iter().enumerate().take(i + 1) {
                    put(d + i, d + k, more.column(*c).dot(&more.column(*other)));
                }
                put(d + i, size, sign * block.right[1][*c]);
            }
            put(size, size, block.square);
            sums.rows[b][0] = block.rows.len() as f64;
        }
        sums
    }

    /// Fits with each block left out: of the declared columns and `used`; the sums have those of `looked` too.
    fn with_left_out<T>(
        &self,
        (used, looked): (&[usize], &[usize]),
        of: impl FnOnce(&BlocksLeftOut, &[Vec<Term>]) -> T,
    ) -> Option<T> {
        let mut next = 0;
        let mut terms = |count: usize| -> Vec<Term> {
            let term = |column| Term {
                columns: vec![(0, column)],
                bound: Bound::NONE,
            };
            next += count;
            (next - count..next).map(term).collect()
        };
        let sums = self.sums(&[used, looked].concat());
        let in_use = Terms {
            list: terms(self.of.through.nrows() + self.of.columns_of(used).len()),
            weights: vec![1.0],
            prior: (DMatrix::zeros(0, 0), DVector::zeros(0)),
            ridge: self.judge.ridge,
        };
        let more = looked.iter().map(|t| terms(self.of.terms[*t].count()));
        let more: Vec<Vec<Term>> = more.collect();
        let left_out = BlocksLeftOut::new(&sums, 0, &in_use)?;
        Some(of(&left_out, &more))
    }

    /// Gain of terms together beside others.
    fn gain(&self, used: &[usize], more: &[usize]) -> Option<ErrorGain> {
        self.with_left_out((used, more), |left_out, terms| {
            left_out.gain(&terms.concat())
        })
    }

    /// Columns of terms, their products beside the declared ones, and those with the residual.
    fn beside(&self, terms: &[usize]) -> (Vec<usize>, DMatrix<f64>, DVector<f64>) {
        let own = self.of.columns_of(terms);
        let among = self.of.beside.select_columns(&own).select_rows(&own);
        let right = self.pull.select_rows(&own);
        (own, among, right)
    }

    /// Square of what each of these terms adds to the fit of all of them, beside the declared columns.
    fn squares(&self, used: &[usize]) -> Option<Vec<f64>> {
        let (_, among, right) = self.beside(used);
        let values = among.clone().cholesky()?.solve(&right);
        let mut first = 0;
        let of_term = |t: &usize| {
            let (at, k) = (first, self.of.columns[*t].len());
            first += k;
            let x = values.rows(at, k);
            x.dot(&(among.view((at, at), (k, k)) * x))
        };
        Some(used.iter().map(of_term).collect())
    }

    /// The term that gains most beside others, or what says the same and is shorter; `least` is asked too.
    fn best(&self, used: &[usize], least: Option<usize>) -> Option<(usize, ErrorGain)> {
        let mut short = self.shortlist(used);
        short.extend(least.filter(|own| !short.contains(own)));
        let gains = self.with_left_out((used, &short), |left_out, terms| {
            let gains = terms.iter().map(|own| left_out.gain(own));
            gains.collect::<Vec<ErrorGain>>()
        })?;
        let own = short.into_iter().zip(gains);
        let own = own.filter(|(_, g)| g.is_beyond(self.judge.screen, None));
        let open: Vec<(usize, ErrorGain)> = own.collect();
        let best = open.iter().max_by(|a, b| a.1.value.total_cmp(&b.1.value))?;
        let near = open.iter();
        let near = near.filter(|(_, g)| g.is_near(&best.1, self.judge.same));
        let near = near.chain([best]);
        let shortest = near.min_by_key(|(t, _)| self.length(*t, used))?;
        Some(shortest.clone())
    }

    /// How long a term is beside others: coefficients, what there is to read, and shapes that it brings.
    fn length(&self, term: usize, used: &[usize]) -> usize {
        let own = &self.of.terms[term];
        let known = |s: &&String| !used.iter().any(|u| self.of.shapes[*u].contains(*s));
        own.count() + own.length() + self.of.shapes[term].iter().filter(known).count()
    }

    /// Terms that take most off the squares of all blocks beside others.
    fn shortlist(&self, used: &[usize]) -> Vec<usize> {
        let p = self.of;
        let (own, among, right) = self.beside(used);
        let Some(factor) = among.cholesky() else {
            return Vec::new();
        };
        let solved = factor.solve(&right);
        let mut found: Vec<(f64, usize)> = Vec::new();
        for t in (0..p.terms.len()).filter(|t| !used.contains(t) && self.fits(*t, used)) {
            let columns = p.columns[t].clone();
            let (first, k) = (columns.start, columns.len());
            let with = DMatrix::from_fn(own.len(), k, |i, c| p.beside[(own[i], first + c)]);
            let mut normal = p.beside.view((first, first), (k, k)).into_owned();
            normal -= with.tr_mul(&factor.solve(&with));
            let silent = |c: usize| {
                let whole = p.beside[(first + c, first + c)] / p.share[first + c].max(1e-300);
                normal[(c, c)] < self.formula.own_share * whole
            };
            if (0..k).any(silent) {
                continue;
            }
            let right = self.pull.rows(first, k) - with.tr_mul(&solved);
            if let Some(own) = normal.clone().cholesky() {
                found.push((right.dot(&own.solve(&right)), t));
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        found.truncate(self.formula.shortlist);
        found.into_iter().map(|(_, t)| t).collect()
    }

    /// Whether there is room for the shapes of a term; a scale of a state has one value.
    fn fits(&self, term: usize, used: &[usize]) -> bool {
        let mut all: Vec<&String> = used.iter().flat_map(|u| &self.of.shapes[*u]).collect();
        all.extend(&self.of.shapes[term]);
        all.sort_unstable();
        all.dedup();
        let is_of = |s: &str, name: &str| s.split(' ').next() == Some(name);
        let one = |name: &str| all.iter().filter(|s| is_of(s, name)).count() <= 1;
        all.len() <= self.formula.shapes && one("width") && one("way")
    }

    /// Puts in the place of each term what gains more there, as long as something does.
    fn exchange(&self, chosen: &mut [usize]) {
        if chosen.len() < 2 {
            return;
        }
        for _ in 0..self.formula.terms {
            let mut changed = false;
            for i in 0..chosen.len() {
                let mut others = chosen.to_vec();
                let own = others.remove(i);
                if let Some((best, _)) = self.best(&others, Some(own))
                    && best != own
                {
                    chosen[i] = best;
                    changed = true;
                }
            }
            if !changed {
                return;
            }
        }
    }

    /// Takes out what is not needed beside the others.
    fn prune(&self, chosen: &mut Vec<usize>) {
        let mut i = 0;
        while chosen.len() > 1 && i < chosen.len() {
            let mut others = chosen.clone();
            let own = others.remove(i);
            let gain = self.gain(&others, &[own]);
            match gain.is_some_and(|g| g.is_beyond(self.judge.screen, None)) {
                true => i += 1,
                false => {
                    chosen.remove(i);
                    i = 0;
                }
            }
        }
    }
}
