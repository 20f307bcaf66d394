//! Filtered, decimated rows of every joint, and their sums over pieces.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::plan::{Plan, Role};
use super::unknowns::{Unknown, Unknowns};
use crate::effect::{AugmentedModel, Scene, Torques, shifted};
use crate::motion::{MotionError, Parallel, Stretch};
use crate::robot::Robot;
use crate::robot::model::JointFriction;

/// Derivative columns and residual of one stretch, `[joint][column][row]`.
pub struct Filtered {
    pub columns: Vec<Vec<Vec<f64>>>,
    pub residual: Vec<Vec<f64>>,
}

/// Filtered regressor of the inertial parameters along one stretch, `[joint][parameter][row]`; nothing of
/// joints that are held. It is the same for every model that is tried on the motion, but for one that is
/// late.
pub type Inertial = Vec<Vec<Vec<f64>>>;

/// The filtered regressor of a robot along one stretch.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn inertial(
    robot: &Robot,
    stretch: &Stretch,
    parallel: &Parallel,
    held: &dyn Fn(usize) -> bool,
) -> Result<Inertial, MotionError> {
    let n = robot.joints();
    let mut out = vec![Vec::new(); n];
    if (0..n).all(held) {
        return Ok(out);
    }
    let raw = regressor(robot, stretch);
    for (j, out) in out.iter_mut().enumerate().filter(|(j, _)| !held(*j)) {
        let channels: Vec<&[f64]> = raw[j].iter().map(Vec::as_slice).collect();
        *out = parallel.run(&channels)?;
    }
    Ok(out)
}

/// Regressor of the inertial parameters along a stretch, `[joint][parameter][sample]`.
fn regressor(robot: &Robot, stretch: &Stretch) -> Vec<Vec<Vec<f64>>> {
    let (n, p) = (robot.joints(), robot.parameters().len());
    let samples = stretch.len();
    let mut out = vec![vec![vec![0.0; samples]; p]; n];
    let mut y = vec![0.0; n * p];
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 0..samples {
        stretch.at(k, &mut q, &mut v, &mut a);
        robot.regressor(&q, &v, &a, &mut y);
        for (j, columns) in out.iter_mut().enumerate() {
            for (c, column) in columns.iter_mut().enumerate() {
                column[k] = y[j * p + c];
            }
        }
    }
    out
}

/// Columns of all unknowns and the residual along one stretch; zeros for joints that are held.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn filtered(
    model: &AugmentedModel,
    unknowns: &Unknowns,
    (stretch, inertial): (&Stretch, &Inertial),
    parallel: &Parallel,
    held: &dyn Fn(usize) -> bool,
) -> Result<Filtered, MotionError> {
    let plain = &model.model;
    let n = plain.robot.joints();
    let samples = stretch.len();
    if (0..n).all(held) {
        let rows = parallel.rows(samples);
        let columns = unknowns
            .columns
            .iter()
            .map(|c| vec![vec![0.0; rows]; c.len()]);
        return Ok(Filtered {
            columns: columns.collect(),
            residual: vec![vec![0.0; rows]; n],
        });
    }
    let torques = model.torques(stretch);
    let scene = scene(model, stretch, &torques);
    let late = |j: usize| model.shift(j) / stretch.dt;
    let mut of_late = match (0..n).any(|j| !held(j) && late(j) != 0.0) {
        true => regressor(&plain.robot, stretch),
        false => Vec::new(),
    };
    let mut out = Filtered {
        columns: Vec::with_capacity(n),
        residual: Vec::with_capacity(n),
    };
    for j in 0..n {
        if held(j) {
            let rows = parallel.rows(samples);
            out.columns
                .push(vec![vec![0.0; rows]; unknowns.columns[j].len()]);
            out.residual.push(vec![0.0; rows]);
            continue;
        }
        let late = late(j);
        let mut raw: Vec<Vec<f64>> = Vec::with_capacity(unknowns.columns[j].len() + 1);
        let mut effect_columns: Vec<Option<Vec<Vec<f64>>>> = vec![None; model.effects.len()];
        let mut friction = friction_columns(&plain.friction[j], &stretch.v[j]);
        for &i in &unknowns.columns[j] {
            let mut column = match unknowns.list[i] {
                Unknown::Theta(_) if late == 0.0 => continue,
                Unknown::Theta(c) => std::mem::take(&mut of_late[j][c]),
                Unknown::Friction { k, .. } => std::mem::take(&mut friction[k]),
                Unknown::Offset(_) => vec![1.0; samples],
                Unknown::Linear { effect, k } => {
                    let columns = effect_columns[effect]
                        .get_or_insert_with(|| model.effects[effect].columns(&scene, j));
                    std::mem::take(&mut columns[k])
                }
                Unknown::Shape { effect, k } => shape_derivative(model, &scene, effect, k, j),
            };
            shifted(&mut column, late);
            raw.push(column);
        }
        let mut hat = torques.hat[j].clone();
        shifted(&mut hat, late);
        for (hat, tau) in hat.iter_mut().zip(&stretch.tau[j]) {
            *hat = tau - *hat;
        }
        raw.push(hat);
        let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
        let mut rows = parallel.run(&channels)?.into_iter();
        let known = |i: usize| match unknowns.list[i] {
            Unknown::Theta(c) if late == 0.0 => Some(inertial[j][c].clone()),
            _ => None,
        };
        let of = unknowns.columns[j].iter();
        let mut columns: Vec<Vec<f64>> = of
            .filter_map(|&i| known(i).or_else(|| rows.next()))
            .collect();
        columns.extend(rows);
        let still = standing(model, stretch, parallel, j);
        columns.iter_mut().for_each(|column| clear(column, &still));
        out.residual.push(columns.pop().unwrap_or_default());
        out.columns.push(columns);
    }
    Ok(out)
}

/// Gradient of a friction law along a motion, `[parameter][sample]`.
fn friction_columns(law: &JointFriction, v: &[f64]) -> Vec<Vec<f64>> {
    let mut columns = vec![vec![0.0; v.len()]; law.parameters()];
    let mut gradient = [0.0; 5];
    for (i, v) in v.iter().enumerate() {
        law.gradient(*v, &mut gradient);
        for (column, g) in columns.iter_mut().zip(&gradient) {
            column[i] = *g;
        }
    }
    columns
}

/// Speed below which a joint counts as standing, over its rms speed.
const STANDING: f64 = 0.01;

/// Rows in which a joint with a jump in its friction law stands still for as long as the filter
/// remembers: static friction takes any torque up to its limit there, and no law of v says which.
pub fn standing(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &Parallel,
    j: usize,
) -> Vec<usize> {
    if !model.model.friction[j].jumps() {
        return Vec::new();
    }
    let v = &stretch.v[j];
    let slow = slow(v);
    // samples since the joint last moved, and until it moves again
    let mut since = vec![0usize; v.len()];
    let mut count = usize::MAX / 2;
    for (k, v) in v.iter().enumerate() {
        count = if v.abs() > slow { 0 } else { count + 1 };
        since[k] = count;
    }
    count = usize::MAX / 2;
    for (k, v) in v.iter().enumerate().rev() {
        count = if v.abs() > slow { 0 } else { count + 1 };
        since[k] = since[k].min(count);
    }
    (0..parallel.rows(stretch.len()))
        .filter(|i| since[parallel.sample_of(*i)] > parallel.decimation)
        .collect()
}

/// Speed below which a joint counts as standing.
fn slow(v: &[f64]) -> f64 {
    let square = v.iter().map(|v| v * v).sum::<f64>() / v.len().max(1) as f64;
    STANDING * square.sqrt()
}

/// Periods of the parallel filter's cut-off over which it carries what happens at a rest.
const REACH: f64 = 1.0;

/// Which rows are within the filter's reach of a sample at which a joint with a jump in its friction law stands or
/// turns: the law says more of friction there than friction does.
pub fn near_rests(
    model: &AugmentedModel,
    stretch: &Stretch,
    parallel: &Parallel,
    cutoff_hz: f64,
    j: usize,
) -> Vec<bool> {
    let mut near = vec![false; parallel.rows(stretch.len())];
    if !model.model.friction[j].jumps() {
        return near;
    }
    let v = &stretch.v[j];
    let slow = slow(v);
    let reach = (REACH / (cutoff_hz * stretch.dt)) as usize;
    // the last sample before each row's end of reach at which it stood or turned
    let mut last = None;
    let mut k = 0;
    for (i, near) in near.iter_mut().enumerate() {
        let centre = parallel.sample_of(i);
        while k < v.len() && k <= centre + reach {
            if v[k].abs() <= slow || (k > 0 && v[k] * v[k - 1] < 0.0) {
                last = Some(k);
            }
            k += 1;
        }
        *near = last.is_some_and(|l| l + reach >= centre);
    }
    near
}

/// Takes rows out of a column.
pub fn clear(column: &mut [f64], rows: &[usize]) {
    for i in rows {
        column[*i] = 0.0;
    }
}

/// The scene of a model along a stretch.
pub fn scene<'a>(
    model: &'a AugmentedModel,
    stretch: &'a Stretch,
    torques: &'a Torques,
) -> Scene<'a> {
    Scene {
        robot: &model.model.robot,
        theta: &model.model.theta,
        laws: &model.model.friction,
        stretch,
        hat: &torques.hat,
        load: &torques.load,
    }
}

/// d(torque of an effect)/d(shape k), by central differences.
fn shape_derivative(
    model: &AugmentedModel,
    scene: &Scene,
    effect: usize,
    k: usize,
    j: usize,
) -> Vec<f64> {
    let added = &model.effects[effect];
    let step = 1e-4 * added.shape[k].abs().max(1e-6);
    let torque = |by: f64| {
        let mut moved = added.clone();
        moved.shape[k] += by;
        let mut out = vec![0.0; scene.len()];
        moved.torque(scene, j, &mut out);
        out
    };
    let (up, down) = (torque(step), torque(-step));
    up.iter()
        .zip(&down)
        .map(|(u, d)| (u - d) / (2.0 * step))
        .collect()
}

/// Sums of one joint over one piece: columns and residual.
#[derive(Debug, Clone)]
pub struct PieceSums {
    /// X'X of the joint's own columns.
    pub normal: DMatrix<f64>,
    /// X'e.
    pub score: DVector<f64>,
    /// e'e.
    pub square: f64,
}

/// All rows of the base model, reduced to pieces; the rows themselves stay for candidates.
pub struct Base {
    pub unknowns: Unknowns,
    pub stretches: Vec<Filtered>,
    /// `[piece][joint]`.
    pub sums: Vec<Vec<PieceSums>>,
}

impl Base {
    /// Filters every stretch and sums over the pieces.
    ///
    /// # Errors
    /// [`MotionError`] of the filter.
    pub fn of(
        model: &AugmentedModel,
        unknowns: Unknowns,
        (stretches, inertial): (&[Stretch], &[Inertial]),
        parallel: &Parallel,
        plan: &Plan,
    ) -> Result<Self, MotionError> {
        let filtered = stretches
            .par_iter()
            .zip(inertial)
            .enumerate()
            .map(|(i, motion)| filtered(model, &unknowns, motion, parallel, &|j| plan.holds(i, j)))
            .collect::<Result<Vec<_>, _>>()?;
        let sums = plan
            .pieces
            .par_iter()
            .map(|piece| {
                let rows = &filtered[piece.stretch];
                let joints = rows.columns.iter().zip(&rows.residual);
                let of_joint = |(j, (columns, residual)): (usize, (&Vec<Vec<f64>>, &Vec<f64>))| {
                    let range = piece.rows.clone();
                    let e = &residual[range.clone()];
                    let c = columns.len();
                    if plan.holds(piece.stretch, j) {
                        return PieceSums {
                            normal: DMatrix::zeros(c, c),
                            score: DVector::zeros(c),
                            square: 0.0,
                        };
                    }
                    let mut normal = DMatrix::zeros(c, c);
                    for a in 0..c {
                        for b in 0..=a {
                            let x = dot(&columns[a][range.clone()], &columns[b][range.clone()]);
                            normal[(a, b)] = x;
                            normal[(b, a)] = x;
                        }
                    }
                    let score = columns.iter().map(|x| dot(&x[range.clone()], e));
                    PieceSums {
                        normal,
                        score: DVector::from_iterator(c, score),
                        square: dot(e, e),
                    }
                };
                joints.enumerate().map(of_joint).collect()
            })
            .collect();
        Ok(Base {
            unknowns,
            stretches: filtered,
            sums,
        })
    }

    /// Squared residual of each joint over the fitted rows.
    pub fn residual_squares(&self, plan: &Plan) -> Vec<f64> {
        let joints = self.unknowns.columns.len();
        let of_joint = |j: usize| {
            let pieces = plan.pieces.iter().zip(&self.sums);
            let fitted = pieces.filter(|(p, _)| p.role.fitted());
            fitted.map(|(_, s)| s[j].square).sum()
        };
        (0..joints).map(of_joint).collect()
    }

    /// Root mean square of each joint's residual over the fitted rows.
    pub fn residual_rms(&self, plan: &Plan) -> Vec<f64> {
        let squares = self.residual_squares(plan);
        let rows = |j| plan.fitted_rows_of(j).max(1) as f64;
        let joints = squares.iter().enumerate();
        joints.map(|(j, s)| (s / rows(j)).sqrt()).collect()
    }

    /// Weighted normal matrix, score and squared residual over the pieces whose role is wanted.
    pub fn total(&self, plan: &Plan, weights: &[f64], wanted: &dyn Fn(Role) -> bool) -> Total {
        let u = self.unknowns.len();
        let mut total = Total::none(u);
        for (piece, sums) in plan.pieces.iter().zip(&self.sums) {
            if wanted(piece.role) {
                self.add(sums, weights, &mut total);
            }
        }
        total
    }

    /// The same of every such piece by itself.
    pub fn each(&self, plan: &Plan, weights: &[f64], wanted: &dyn Fn(Role) -> bool) -> Vec<Total> {
        let pieces = plan.pieces.iter().zip(&self.sums);
        let wanted = pieces.filter(|(p, _)| wanted(p.role));
        wanted.map(|(_, sums)| self.sum_of(sums, weights)).collect()
    }

    /// The same of one piece.
    pub fn sum_of(&self, sums: &[PieceSums], weights: &[f64]) -> Total {
        let mut total = Total::none(self.unknowns.len());
        self.add(sums, weights, &mut total);
        total
    }

    /// Adds one piece.
    fn add(&self, sums: &[PieceSums], weights: &[f64], total: &mut Total) {
        for (j, s) in sums.iter().enumerate() {
            let w = weights[j] * weights[j];
            let columns = &self.unknowns.columns[j];
            for (a, &i) in columns.iter().enumerate() {
                total.score[i] += w * s.score[a];
                for (b, &l) in columns.iter().enumerate() {
                    total.normal[(i, l)] += w * s.normal[(a, b)];
                }
            }
            total.square += w * s.square;
        }
    }
}

/// Weighted sums over pieces.
#[derive(Debug, Clone)]
pub struct Total {
    pub normal: DMatrix<f64>,
    pub score: DVector<f64>,
    pub square: f64,
}

impl Total {
    fn none(u: usize) -> Self {
        Total {
            normal: DMatrix::zeros(u, u),
            score: DVector::zeros(u),
            square: 0.0,
        }
    }
}

/// Inner product, in a fixed order: eight sums side by side, for one would wait for itself.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    debug_assert_eq!(a.len(), b.len());
    let (blocks_a, rest_a) = a.as_chunks::<8>();
    let (blocks_b, rest_b) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in blocks_a.iter().zip(blocks_b) {
        for l in 0..8 {
            sums[l] += a[l] * b[l];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Cover;
    use crate::motion::FilterSettings;
    use crate::robot::cft::{Setup, Structure};
    use crate::robot::model::Model;
    use std::collections::BTreeMap;

    #[test]
    fn an_inner_product_counts_every_pair_whatever_their_number() {
        for n in [0, 1, 7, 8, 9, 16, 29] {
            let a: Vec<f64> = (0..n).map(|k| f64::from(k) - 3.0).collect();
            let b: Vec<f64> = (0..n).map(|k| 2.0 * f64::from(k) + 1.0).collect();
            let wanted: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
            assert_eq!(dot(&a, &b), wanted, "{n}");
        }
    }

    #[test]
    fn rows_near_a_rest_are_those_that_the_filter_reaches_from_it() {
        let settings = FilterSettings {
            cutoff_hz: 20.0,
            ..FilterSettings::default()
        };
        let (dt, n) = (1e-3, 4000);
        let parallel = Parallel::design(&settings, dt).unwrap();
        // one reversal, at 2 s
        let v: Vec<f64> = (0..n).map(|k| 2.0005 - k as f64 * dt).collect();
        let stretch = Stretch {
            dt,
            t: vec![0.0; n],
            q: vec![vec![0.0; n]],
            v: vec![v],
            a: vec![vec![-1.0; n]],
            tau: vec![vec![0.0; n]],
            ..Stretch::default()
        };
        let near = |law: JointFriction| {
            let robot = Robot::single_joint("slide", crate::robot::JointKind::Prismatic);
            let model = AugmentedModel::plain(Model {
                robot,
                theta: vec![1.0],
                friction: vec![law],
                offset: vec![0.0],
            });
            near_rests(&model, &stretch, &parallel, settings.cutoff_hz, 0)
        };
        let jumps = near(JointFriction::ViscousCoulomb(
            crate::robot::friction::ViscousCoulomb {
                viscous: 1.0,
                coulomb: 1.0,
            },
        ));
        // a hundredth of the rms speed of 1.15 m/s to each side of it, and 50 ms more
        for (i, near) in jumps.iter().enumerate() {
            let off = (parallel.sample_of(i) as f64 * dt - 2.0005).abs();
            assert_eq!(*near, off < 0.0115 + 0.05, "{off}");
        }
        assert!(near(JointFriction::None).iter().all(|near| !near));
    }

    /// What is kept from fit to fit is what a fit of a model that is late by nothing to speak of finds anew.
    #[test]
    fn kept_regressors_are_those_of_the_model_itself() {
        let robot = Robot::cft(Setup::Tuedacs, Structure::Printed12);
        let samples = 3000;
        let wave = |j: usize, order: i32| -> Vec<f64> {
            let w = 2.0 + 0.7 * j as f64;
            let at = |k: usize| {
                let phase = w * k as f64 * 1e-3 + 0.3 * j as f64;
                w.powi(order) * (phase + f64::from(order) * std::f64::consts::FRAC_PI_2).sin()
            };
            (0..samples).map(at).collect()
        };
        let stretch = Stretch {
            dt: 1e-3,
            t: (0..samples).map(|k| k as f64 * 1e-3).collect(),
            q: (0..4).map(|j| wave(j, 0)).collect(),
            v: (0..4).map(|j| wave(j, 1)).collect(),
            a: (0..4).map(|j| wave(j, 2)).collect(),
            tau: (0..4).map(|j| wave(3 - j, 0)).collect(),
            ..Stretch::default()
        };
        let parallel = Parallel::design(&FilterSettings::default(), stretch.dt).unwrap();
        let held = |j: usize| j == 1;
        let kept = inertial(&robot, &stretch, &parallel, &held).unwrap();
        let plain = AugmentedModel::plain(Model {
            theta: (0..12).map(|i| 1.0 + f64::from(i)).collect(),
            friction: vec![JointFriction::None; 4],
            offset: vec![0.0; 4],
            robot,
        });
        let late_by = |d: f64| {
            let values = BTreeMap::from([("d".to_owned(), d)]);
            let delay = crate::effect::read(&plain.model.robot, "delay", Some("q4"), &values);
            AugmentedModel {
                effects: vec![delay.unwrap()],
                ..plain.clone()
            }
        };
        let cover = Cover::of(&plain.model.robot, std::slice::from_ref(&stretch), 10.0);
        let open = crate::diagnose::problem::unknowns::Open {
            offset: vec![true; 4],
            friction: vec![Vec::new(); 4],
        };
        let rows = |model: &AugmentedModel| {
            let unknowns = Unknowns::of(model, &open, &cover);
            filtered(model, &unknowns, (&stretch, &kept), &parallel, &held).unwrap()
        };
        // q4 is reckoned anew where it is late; q1 and q5 are kept in both, q2 is held
        let (now, late) = (rows(&late_by(0.0)), rows(&late_by(1e-15)));
        for j in 0..4 {
            assert_eq!(now.columns[j].len(), late.columns[j].len());
            let largest = |x: &[f64]| x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let all = late.columns[j].iter().chain([&late.residual[j]]);
            let own = now.columns[j].iter().chain([&now.residual[j]]);
            for (c, (a, b)) in own.zip(all).enumerate() {
                let off: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
                assert!(largest(&off) <= 1e-9 * (1.0 + largest(b)), "{j} {c}");
            }
        }
        assert!(now.columns[1].iter().flatten().all(|x| *x == 0.0));
        assert!(now.columns[2][..12].iter().flatten().any(|x| *x != 0.0));
    }
}
