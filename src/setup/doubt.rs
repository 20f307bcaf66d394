//! Is there anything to look for? A right set-up is to cost little: few rows, and no trial of every hypothesis.
//!
//! Signs, order and scales of torques are quadratic forms of one set of normal equations; zeros are looked
//! for along their derivative at the set-up as it is; of the positions only signs and neighbours are tried.

use std::cell::OnceCell;
use std::f64::consts::FRAC_PI_2;

use nalgebra::DMatrix;

use super::channels::{Carried, Drive};
use super::confirm;
use super::correction::{Change, Correction};
use super::finding::ChannelKind::{Both, Position};
use super::fit::Fit;
use super::hypotheses;
use super::normal::{Normal, Problem, own_column};
use super::physics::{Positive, credit, positives};
use super::trial::Trial;
use crate::robot::JointKind;

/// A robot of so few joints has all hypotheses tried: that costs little.
const SMALL: usize = 3;
/// Gain of log-likelihood, by few rows that are nearly independent, beyond which all is looked for.
const GAIN: f64 = 6.0;
/// Deviations below zero at which a quantity that must be positive is looked into.
const BELOW: f64 = -3.0;
/// A joint whose relative error is larger ..
const LARGE: f64 = 0.25;
/// .. though its own rows alone leave less than this share of it, contradicts the others.
const ALONE: f64 = 0.6;
/// Zeros that would be moved by less are no fault \[rad\].
const MOVED: f64 = 0.02;
/// A zero is not told by its derivative beyond this \[rad\].
const FAR: f64 = 0.5;
/// An error that a zero moves by less than this ratio is not told in the end.
const SHIFTED: f64 = 1.1;
/// Rows that positions are tried on.
const FEWER: usize = 100;
/// .. and rows on which those that do well there are tried again.
const MORE: usize = 500;
/// Blocks of time of these.
const BLOCKS: usize = 12;
/// Log-likelihood that a right change may lose by few rows.
const PROMISING: f64 = -5.0;
/// A joint that is slower by this stands still on purpose.
const SLOW: f64 = 3e-3;
/// Step of differences \[rad\].
const STEP: f64 = 1e-4;
/// A motion in turns or in thousandths is looked into \[rad\].
const PLAUSIBLE: [f64; 2] = [0.05, 14.0];

/// Whether the declared set-up, fitted to few rows, gives any reason to try all hypotheses.
pub(super) fn doubtful(
    problem: &Problem,
    declared: &Trial,
    positives: &[Positive],
    rows: &[usize],
    moving: &[usize],
) -> bool {
    problem.robot.joints() <= SMALL
        || positives.iter().any(|p| p.told && p.deviations() < BELOW)
        || implausible(problem, moving)
        || contradicts(declared)
        || torques(problem, declared, credit(positives), rows, moving)
        || zeros(problem, declared, rows)
        || positions(problem, &declared.by, moving)
}

/// Whether a joint moves farther, or less, than a log that excites it can.
fn implausible(problem: &Problem, moving: &[usize]) -> bool {
    let speeds = problem.sample.rms(&problem.sample.v);
    let fastest = speeds.iter().copied().fold(0.0, f64::max);
    moving.len() > 1
        && moving.iter().any(|&j| {
            let sample = &problem.sample;
            let q = sample.q.iter().skip(j).step_by(sample.joints);
            let ends = |(l, h): (f64, f64), q: &f64| (l.min(*q), h.max(*q));
            let (low, high) = q.fold((f64::INFINITY, f64::NEG_INFINITY), ends);
            let turns = problem.robot.joint_kind(j) == JointKind::Revolute;
            turns
                && speeds[j] > SLOW * fastest
                && !(PLAUSIBLE[0]..PLAUSIBLE[1]).contains(&(high - low))
        })
}

/// Whether a joint's error is large though its own rows alone would leave little.
fn contradicts(declared: &Trial) -> bool {
    let (normal, fit) = (&declared.normal, &declared.fit);
    (0..normal.joints).any(|j| {
        let c = normal.places[j].len();
        if c == 0 || fit.left[j] < LARGE * LARGE || normal.rows <= c + 8 {
            return false;
        }
        let gram = &normal.total[j];
        let target = &fit.targets[j];
        let h = gram.view((0, 0), (c, c)).into_owned();
        let g = gram.view((0, c), (c, target.len())) * target;
        let Some(theta) = super::fit::solved(h, &g) else {
            return false;
        };
        let k = gram.view((c, c), (target.len(), target.len())) * target;
        let alone = (target.dot(&k) - g.dot(&theta)).max(0.0) / declared.power[j];
        // as many unknowns as there are take their share of the rows
        let rows = normal.rows as f64;
        let fair = alone * rows / (rows - c as f64);
        fair < ALONE * ALONE * fit.left[j]
    })
}

/// Whether other signs, orders or scales of the torques gain.
fn torques(
    problem: &Problem,
    declared: &Trial,
    credit: f64,
    rows: &[usize],
    moving: &[usize],
) -> bool {
    let gains = |change: &Change| {
        let by = declared.by.with(change);
        let trial = Trial::new(problem, by, rows, 1, Some(declared));
        trial.is_some_and(|trial| gained(problem, &trial, declared, credit))
    };
    // sets of signs are tried by their members, and all together
    let simple = |change: &Change| match change {
        Change::Sign(_, joints) => joints.len() == 1 || joints.len() == moving.len(),
        _ => true,
    };
    let mut changes = hypotheses::of_torques(problem, moving);
    changes.retain(simple);
    let known = problem.columns.known.iter().any(Option::is_some);
    if problem.channels.drive != Drive::Joints || known {
        return changes.iter().filter(|c| c.joints().len() < 2).any(gains);
    }
    // friction is each joint's own whatever the weights are: without its columns a fit is small
    let Some(shared) = declared.normal.shared(problem.robot.parameters().len()) else {
        return changes.iter().any(gains);
    };
    let score = |by: &Correction| {
        let mix = problem.channels.mix(by);
        let targets = mix.iter().map(|mix| Normal::target(mix, 1.0)).collect();
        let power = super::trial::power(problem, by, &declared.normal, &mix, rows);
        Fit::new(&shared, targets, &power).map_or(f64::NEG_INFINITY, |fit| fit.score)
    };
    let before = score(&declared.by);
    changes
        .iter()
        .any(|change| score(&declared.by.with(change)) > before + GAIN && gains(change))
}

/// Whether a joint's zero elsewhere gains, by the derivative of the torques with it.
fn zeros(problem: &Problem, declared: &Trial, rows: &[usize]) -> bool {
    let Trial {
        robot,
        by,
        normal,
        fit,
        ..
    } = declared;
    let (n, p) = (robot.joints(), robot.parameters().len());
    if !robot.knows_links() || n < 2 || problem.channels.drive == Drive::Motors {
        return false;
    }
    let theta: Vec<f64> = fit.theta.iter().take(p).copied().collect();
    let mut carried = Carried::new(n);
    let mut y = vec![0.0; n * p];
    let (mut tau, mut side) = (vec![0.0; n], vec![0.0; n]);
    // of each zero: products with the unknowns' columns, with the residual, with itself
    let mut with_unknowns = DMatrix::zeros(normal.unknowns, n);
    let (mut with_residual, mut with_itself) = (vec![0.0; n], vec![0.0; n]);
    for &k in rows {
        if !problem
            .channels
            .carry(robot, problem.sample.row(k), by, &mut carried)
        {
            continue;
        }
        robot.regressor(&carried.q, &carried.v, &carried.a, &mut y);
        robot.torque(&theta, &carried.q, &carried.v, &carried.a, &mut tau);
        let residual: Vec<f64> = (0..n)
            .map(|j| confirm::left(problem, robot, fit, &carried, j) - tau[j])
            .collect();
        for z in (0..n).filter(|z| robot.joint_kind(*z) == JointKind::Revolute) {
            carried.q[z] += STEP;
            robot.torque(&theta, &carried.q, &carried.v, &carried.a, &mut side);
            carried.q[z] -= STEP;
            for j in (0..n).filter(|j| fit.weights[*j] > 0.0) {
                let slope = (side[j] - tau[j]) / STEP;
                let weighted = fit.weights[j] * slope;
                with_itself[z] += weighted * slope;
                with_residual[z] += weighted * residual[j];
                let shared = normal.places[j].iter().take_while(|c| **c < p);
                for c in shared {
                    with_unknowns[(*c, z)] += weighted * y[j * p + c];
                }
                for (i, own) in problem.columns.own[j].iter().enumerate() {
                    let at = problem.first_own(robot, j) + i;
                    with_unknowns[(at, z)] += weighted * own_column(*own, &carried, j);
                }
            }
        }
    }
    let solved = fit.solve(&with_unknowns);
    (0..n).any(|z| {
        let own = with_itself[z] - with_unknowns.column(z).dot(&solved.column(z));
        // nothing of it is left where the parameters take it
        if own <= 1e-6 * with_itself[z] || own <= 0.0 {
            return false;
        }
        let moved = with_residual[z] / own;
        if 0.5 * with_residual[z] * moved < GAIN || moved.abs() < MOVED {
            return false;
        }
        // far away the derivative tells no more than that something is wrong
        if moved.abs() > FAR {
            return true;
        }
        let there = by.with(&Change::Zero(z, moved));
        let trial = Trial::new(problem, there, rows, 1, Some(declared));
        trial.is_some_and(|trial| {
            let ratios = fit
                .left
                .iter()
                .zip(&trial.fit.left)
                .filter(|(_, a)| **a > 0.0);
            ratios.map(|(b, a)| (b / a).sqrt()).fold(0.0, f64::max) > SHIFTED
        })
    })
}

/// Whether turned positions, joints in each other's place, or zeros a quarter turn away gain.
fn positions(problem: &Problem, by: &Correction, moving: &[usize]) -> bool {
    if moving.len() < 2 {
        return false;
    }
    let mut changes: Vec<Change> = moving
        .iter()
        .map(|j| Change::Sign(Position, vec![*j]))
        .collect();
    if moving.len() == problem.robot.joints() {
        changes.push(Change::Reverse);
    }
    for pair in moving.windows(2) {
        changes.push(Change::Exchange(Both, pair[0], pair[1]));
        changes.push(Change::Exchange(Position, pair[0], pair[1]));
    }
    // quarter turns, where the derivative tells nothing
    let quarter = |change: &Change| match change {
        Change::Zero(_, angle) => (angle / FRAC_PI_2).fract() == 0.0,
        _ => false,
    };
    changes.extend(hypotheses::of_zeros(problem).into_iter().filter(quarter));
    Race::new(problem, by).is_some_and(|race| changes.iter().any(|change| race.won(change)))
}

/// Rows of the second look at what a first one on few rows does not refuse.
struct Race<'a> {
    problem: &'a Problem<'a>,
    by: &'a Correction,
    few: (Vec<usize>, Trial),
    more: OnceCell<Option<SecondLook>>,
}

/// Rows, the declared set-up's trial on them, its credit by physics, and the share of the rows that counts.
type SecondLook = (Vec<usize>, Trial, f64, f64);

impl<'a> Race<'a> {
    fn new(problem: &'a Problem<'a>, by: &'a Correction) -> Option<Self> {
        let few = problem.sample.spread(FEWER);
        let declared = Trial::new(problem, by.clone(), &few, 1, None)?;
        Some(Self {
            problem,
            by,
            few: (few, declared),
            more: OnceCell::new(),
        })
    }

    fn more(&self) -> Option<&SecondLook> {
        let begin = || {
            let rows = self.problem.sample.spread(MORE);
            let trial = Trial::new(self.problem, self.by.clone(), &rows, BLOCKS, None)?;
            let before = credit(&of(self.problem, &trial));
            // as many of them as the few are nearly independent
            let share = (FEWER as f64 / rows.len() as f64).min(1.0);
            Some((rows, trial, before, share))
        };
        self.more.get_or_init(begin).as_ref()
    }

    /// Whether a change gains on few rows, then on more, where physics has its say.
    fn won(&self, change: &Change) -> bool {
        let by = self.by.with(change);
        let (rows, declared) = &self.few;
        let Some(trial) = Trial::new(self.problem, by.clone(), rows, 1, Some(declared)) else {
            return false;
        };
        let first = trial.fit.score - declared.fit.score;
        if first < PROMISING {
            return false;
        }
        let Some((rows, declared, before, share)) = self.more() else {
            return true;
        };
        let Some(trial) = Trial::new(self.problem, by, rows, BLOCKS, Some(declared)) else {
            return false;
        };
        let gain = share * (trial.fit.score - declared.fit.score);
        let after = credit(&of(self.problem, &trial));
        gain.min(gain + after - before) > GAIN
    }
}

fn of(problem: &Problem, trial: &Trial) -> Vec<Positive> {
    positives(problem, &trial.robot, &trial.by, &trial.normal, &trial.fit)
}

/// Whether a trial is likelier than the set-up as it is, whose physics has this credit.
fn gained(problem: &Problem, trial: &Trial, declared: &Trial, before: f64) -> bool {
    let gain = trial.fit.score - declared.fit.score;
    gain > GAIN && gain + credit(&of(problem, trial)) - before > GAIN
}
