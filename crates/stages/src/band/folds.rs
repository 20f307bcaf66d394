//! Blocks of logs, and the model without each of them.

use nalgebra::{DMatrix, DVector};

use cft_ident_core::effect::{AugmentedModel, EffectScene, ModelEffect, Role};
use cft_ident_core::math::gram::{gram, stride};
use cft_ident_core::motion::{MotionError, ParallelFilters, Stretch, rest};
use cft_ident_core::robot::model::JointFriction;

/// Samples that are looked at together, and the fewest where a robot has many columns.
const PIECE: [usize; 2] = [16_384, 2_048];
/// Numbers of a piece: 64 MB. Arms of seven joints have a quarter.
const PIECE_NUMBERS: usize = 8 << 20;
/// Share of all blocks' information that holds a model to itself: without a block no direction is left free.
const HOLD_SHARE: f64 = 0.01;

/// Blocks of the same number of samples, one behind the other through all logs.
#[derive(Debug, Clone, PartialEq)]
pub struct Folds {
    /// Log and time of the first sample of each.
    begins: Vec<(usize, f64)>,
}

impl Folds {
    /// So many blocks of these stretches, which stand in the order of their logs.
    pub fn of(stretches: &[Stretch], count: usize) -> Self {
        let samples: usize = stretches.iter().map(Stretch::len).sum();
        let begin = |fold: usize| {
            let mut at = fold * samples / count;
            for s in stretches {
                if at < s.len() {
                    return (s.log, s.t[at]);
                }
                at -= s.len();
            }
            (usize::MAX, f64::INFINITY)
        };
        Self {
            begins: (0..count).map(begin).collect(),
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.begins.len()
    }

    /// The block of a time in a log.
    pub fn of_time(&self, log: usize, t: f64) -> usize {
        let later = |(of, begin): &&(usize, f64)| *of < log || (*of == log && *begin <= t);
        self.begins.iter().take_while(later).count().max(1) - 1
    }
}

/// Which columns the logs determined beside the inertial parameters and the effects.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeColumns {
    pub friction: Vec<bool>,
    pub offset: Vec<bool>,
}

/// Linear parameters of a model in one row: inertial, friction of each joint, offsets, effects.
struct Layout {
    theta: usize,
    /// First place and number of each joint's friction.
    friction: Vec<(usize, usize)>,
    offset: Vec<Option<usize>>,
    effects: Vec<usize>,
    count: usize,
}

impl Layout {
    fn of(model: &AugmentedModel, free: &FreeColumns) -> Self {
        let theta = model.model.theta.len();
        let mut count = theta;
        let mut take = |k: usize| {
            count += k;
            count - k
        };
        let friction = model.model.friction.iter().zip(&free.friction);
        let friction = friction
            .map(|(law, free)| {
                let k = if *free { linear_of(law) } else { 0 };
                (take(k), k)
            })
            .collect();
        let offset = free.offset.iter().map(|free| free.then(|| take(1)));
        let offset = offset.collect();
        let effects = model.effects.iter().map(|e| take(e.linear.len())).collect();
        Layout {
            theta,
            friction,
            offset,
            effects,
            count,
        }
    }
}

/// Parameters that a law is linear in: they come first among its own.
fn linear_of(law: &JointFriction) -> usize {
    match law {
        JointFriction::None => 0,
        JointFriction::DoubleTanh(_) => 3,
        JointFriction::ViscousCoulomb(_) => 2,
    }
}

/// The model that all blocks but one give: a weighted step of least squares from it, rows at rest left out.
pub fn without_each(
    model: &AugmentedModel,
    free: &FreeColumns,
    stretches: &[Stretch],
    filters: &ParallelFilters,
    rest_speed: &[f64],
    folds: &Folds,
) -> Result<Vec<AugmentedModel>, MotionError> {
    let layout = Layout::of(model, free);
    let (n, u) = (model.model.robot.joints(), layout.count);
    let mut sums = vec![vec![JointProducts::default(); n]; folds.count()];
    for stretch in stretches {
        let into = (folds, &mut sums[..]);
        add(model, &layout, stretch, filters, rest_speed, into)?;
    }
    // one weight a joint, that of its residual in all blocks
    let weight = |j: usize| {
        let (square, rows) = sums.iter().fold((0.0, 0.0), |(s, r), fold| {
            (s + fold[j].residual_square(), r + fold[j].rows)
        });
        if square > 0.0 { rows / square } else { 0.0 }
    };
    let weights: Vec<f64> = (0..n).map(weight).collect();
    let joined = |fold: &Vec<JointProducts>| {
        let mut h = DMatrix::zeros(u, u);
        let mut g = DVector::zeros(u);
        for (sums, w) in fold.iter().zip(&weights) {
            sums.add_to(*w, &mut h, &mut g);
        }
        (h, g)
    };
    let each: Vec<(DMatrix<f64>, DVector<f64>)> = sums.iter().map(joined).collect();
    let (mut h, mut g) = (DMatrix::zeros(u, u), DVector::zeros(u));
    for (of_h, of_g) in &each {
        h += of_h;
        g += of_g;
    }
    let scale = DVector::from_fn(u, |i, _| {
        let d: f64 = h[(i, i)];
        if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 }
    });
    let solve = |h: &DMatrix<f64>, g: &DVector<f64>| -> DVector<f64> {
        let scaled = DMatrix::from_fn(u, u, |i, k| {
            let x = h[(i, k)] * scale[i] * scale[k];
            // what no row determines stays as it is
            if i == k { x.max(1e-12) + 1e-9 } else { x }
        });
        match scaled.cholesky() {
            Some(factor) => factor.solve(&g.component_mul(&scale)).component_mul(&scale),
            None => DVector::zeros(u),
        }
    };
    let all = solve(&(&h * (1.0 + HOLD_SHARE)), &g);
    let models = each.iter().map(|(of_h, of_g)| {
        let step = solve(&(&h * (1.0 + HOLD_SHARE) - of_h), &(&g - of_g)) - &all;
        moved(model, &layout, &step)
    });
    Ok(models.collect())
}

/// Products of the rows of one joint in one block: of its own columns, and of its residual behind them.
#[derive(Clone, Default)]
struct JointProducts {
    /// Where its columns stand among all unknowns.
    places: Vec<usize>,
    /// `(columns + 1) x (columns + 1)`; empty where there are no rows.
    gram: DMatrix<f64>,
    rows: f64,
}

impl JointProducts {
    /// Adds rows as [`gram`] takes them.
    fn add(&mut self, places: &[usize], rows: &[f64]) {
        let columns = places.len() + 1;
        let more = gram(rows, columns);
        self.rows += (rows.len() / stride(columns)) as f64;
        match self.gram.is_empty() {
            true => (self.places, self.gram) = (places.to_vec(), more),
            false => self.gram += more,
        }
    }

    fn residual_square(&self) -> f64 {
        let last = self.places.len();
        self.gram.get((last, last)).copied().unwrap_or(0.0)
    }

    /// Adds them, weighed, to the normal equations of all unknowns.
    fn add_to(&self, weight: f64, h: &mut DMatrix<f64>, g: &mut DVector<f64>) {
        let last = self.places.len();
        for (b, k) in self.places.iter().enumerate() {
            g[*k] += weight * self.gram[(b, last)];
            let mut to = h.column_mut(*k);
            for (a, i) in self.places.iter().enumerate() {
                to[*i] += weight * self.gram[(a, b)];
            }
        }
    }
}

/// Adds filtered, decimated rows of a stretch to the sums of their block and joint, piece by piece.
fn add(
    model: &AugmentedModel,
    layout: &Layout,
    stretch: &Stretch,
    filters: &ParallelFilters,
    rest_speed: &[f64],
    (folds, sums): (&Folds, &mut [Vec<JointProducts>]),
) -> Result<(), MotionError> {
    let n = model.model.robot.joints();
    let filter = filters.of(stretch);
    let torques = model.torques(stretch);
    let residual = model.residual(stretch, &torques);
    // effects remember: their columns are those of the whole stretch
    let plain = (!model.effects.is_empty())
        .then(|| AugmentedModel::plain(model.model.clone()).torques(stretch));
    let scene = EffectScene {
        robot: &model.model.robot,
        theta: &model.model.theta,
        laws: &model.model.friction,
        stretch,
        hat: plain.as_ref().map_or(&torques.hat, |plain| &plain.hat),
        load: &torques.load,
        direction: &torques.direction,
        tilt: Some(&torques.tilt),
    };
    let own = model.model.robot.parameters_by_joint();
    let own = own.into_iter().enumerate();
    let joints: Vec<OfJoint> = own
        .map(|of| OfJoint::new(model, layout, &scene, of))
        .collect();
    let p = layout.theta;
    let speeds = rest_speed.iter().enumerate();
    let weights: Vec<Vec<f64>> = speeds
        .map(|(j, speed)| match model.model.friction[j].jumps() {
            true => filter.weights(stretch, j, *speed),
            false => vec![1.0; stretch.len()],
        })
        .collect();
    let mut regressor = vec![0.0; n * p];
    // of each joint its columns, its residual, and whether it moves
    let mut first = vec![0];
    first.extend(joints.iter().scan(0, |end, of| {
        *end += of.places.len() + 2;
        Some(*end)
    }));
    let width = first[n];
    let [usual, fewest] = PIECE;
    let together = (PIECE_NUMBERS / width.max(1)).clamp(fewest, usual);
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for from in (0..stretch.len()).step_by(together) {
        let piece = from..(from + together).min(stretch.len());
        let count = filter.rows(piece.len());
        if count < 2 {
            continue;
        }
        let mut fill = |k: usize, row: &mut [f64]| {
            let k = piece.start + k;
            stretch.at(k, &mut q, &mut v, &mut a);
            model.model.robot.regressor(&q, &v, &a, &mut regressor);
            for (j, of) in joints.iter().enumerate() {
                let mut entries = [0.0; 5];
                model.model.friction[j].gradient(v[j], &mut entries);
                let y = &regressor[j * p..(j + 1) * p];
                let theta = of.theta.iter().map(|i| y[*i]);
                let friction = entries[..of.friction].iter().copied();
                let offset = of.offset.then_some(1.0);
                let added = of.added.iter().map(|column| column[k]);
                let weight = weights[j][k];
                let last = [residual[j][k]];
                let all = theta.chain(friction).chain(offset).chain(added).chain(last);
                let moving = match model.model.friction[j].jumps() {
                    true => rest::movement(v[j], rest_speed[j]),
                    false => 1.0,
                };
                let all = all.map(|x| weight * x).chain([moving]);
                let own = &mut row[first[j]..first[j + 1]];
                own.iter_mut().zip(all).for_each(|(to, x)| *to = x);
            }
        };
        let rows = filter.run_rows([piece.len(), width], &mut fill)?;
        for (j, of) in joints.iter().enumerate() {
            let u = of.places.len();
            let row = |i: usize| &rows[i * width + first[j]..i * width + first[j + 1]];
            let moves = |i: &usize| !rest::rests(row(*i)[u + 1]);
            let moving: Vec<usize> = (0..count).filter(moves).collect();
            let fold = |i: usize| {
                let t = stretch.t[piece.start + filter.sample_of(i)];
                folds.of_time(stretch.log, t)
            };
            let mut data = Vec::new();
            for part in moving.chunk_by(|a, b| fold(*a) == fold(*b)) {
                data.clear();
                data.resize(part.len() * stride(u + 1), 0.0);
                for (to, i) in data.chunks_exact_mut(stride(u + 1)).zip(part) {
                    to[..=u].copy_from_slice(&row(*i)[..=u]);
                }
                sums[fold(part[0])][j].add(&of.places, &data);
            }
        }
    }
    Ok(())
}

/// The columns that a joint's rows have.
struct OfJoint {
    /// Inertial parameters that its torque holds.
    theta: Vec<usize>,
    /// Number of its friction's parameters.
    friction: usize,
    offset: bool,
    /// Columns of the effects, along the whole stretch.
    added: Vec<Vec<f64>>,
    /// Where all of them stand among the unknowns, in this order.
    places: Vec<usize>,
}

impl OfJoint {
    fn new(
        model: &AugmentedModel,
        layout: &Layout,
        scene: &EffectScene,
        (j, theta): (usize, Vec<usize>),
    ) -> Self {
        let mut places = theta.clone();
        let (first, friction) = layout.friction[j];
        places.extend(first..first + friction);
        places.extend(layout.offset[j]);
        let mut added = Vec::new();
        let here = |effect: &ModelEffect| is_linear(effect) && effect.place.touches(j);
        let effects = model.effects.iter().zip(&layout.effects);
        for (effect, first) in effects.filter(|(effect, _)| here(effect)) {
            let columns = effect.columns(scene, j);
            places.extend(*first..*first + columns.len());
            added.extend(columns);
        }
        OfJoint {
            theta,
            friction,
            offset: layout.offset[j].is_some(),
            added,
            places,
        }
    }
}

fn is_linear(effect: &ModelEffect) -> bool {
    effect.law.entry.role != Role::Shift
}

fn moved(model: &AugmentedModel, layout: &Layout, step: &DVector<f64>) -> AugmentedModel {
    let mut out = model.clone();
    let theta = out.model.theta.iter_mut();
    theta
        .zip(step.iter())
        .for_each(|(theta, step)| *theta += step);
    let friction = out.model.friction.iter_mut();
    for (law, (first, count)) in friction.zip(&layout.friction) {
        let by = |c: usize| if c < *count { step[first + c] } else { 0.0 };
        match law {
            JointFriction::None => {}
            JointFriction::DoubleTanh(law) => {
                law.viscous += by(0);
                law.coulomb_1 += by(1);
                law.coulomb_2 += by(2);
            }
            JointFriction::ViscousCoulomb(law) => {
                law.viscous += by(0);
                law.coulomb += by(1);
            }
        }
    }
    for (offset, place) in out.model.offset.iter_mut().zip(&layout.offset) {
        *offset += place.map_or(0.0, |place| step[place]);
    }
    for (effect, first) in out.effects.iter_mut().zip(&layout.effects) {
        if is_linear(effect) {
            for (c, x) in effect.linear.iter_mut().enumerate() {
                *x += step[first + c];
            }
        }
    }
    out
}
