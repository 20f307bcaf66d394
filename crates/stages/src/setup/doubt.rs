//! Is there anything to look for? A right set-up is to cost little: few rows, and no trial of every hypothesis.
//!
//! Signs, order and scales of torques are quadratic forms of one set of normal equations; zeros are looked
//! for along their derivative at the set-up as it is; of the positions only signs and neighbours are tried, of
//! gravity the axes of the base.

use std::cell::OnceCell;
use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::DMatrix;

use super::channels::{Carried, Drive};
use super::confirm;
use super::correction::{Change, Correction};
use super::finding::ChannelKind::{Both, Position};
use super::fit::Fit;
use super::fitted::CALIBRATION;
use super::hypotheses;
use super::normal::{Normal, Problem, own_column};
use super::physics::{Positive, credit, positives};
use super::sizes::sizes;
use super::trial::Trial;
use cft_ident_core::robot::JointKind;

/// A robot of so few joints has all hypotheses tried: that costs little.
const SMALL: usize = 3;
/// Gain of log-likelihood, by few rows that are nearly independent, beyond which all is looked for.
pub(super) const GAIN: f64 = 6.0;
/// Deviations below zero at which a quantity that must be positive is looked into.
const BELOW: f64 = -3.0;
/// A joint whose relative error is larger ..
const LARGE: f64 = 0.25;
/// .. though its own rows alone leave less than this share of it, contradicts the others.
const ALONE: f64 = 0.6;
/// Zeros that would be moved by less are calibration and not told in the end \[rad\].
const MOVED: f64 = 0.9 * CALIBRATION;
/// A zero is not told by its derivative beyond this \[rad\].
const FAR: f64 = 0.5;
/// An error that a zero moves by less than this ratio is not told in the end.
const SHIFTED: f64 = 1.1;
/// Rows that positions are tried on first, at least, and for each unknown of a joint ..
const FIRST: [usize; 2] = [40, 3];
/// .. rows on which those that do well there are tried again ..
const FEWER: usize = 100;
/// .. and those that do well there too.
pub(super) const MORE: usize = 500;
/// Difference of scores below which a zero is a turned axis of the link's own description.
const SAME: f64 = 1e-3;
/// Ratio of factors that leave a joint to itself where both gain as much.
const FLATTER: f64 = 10.0;
/// Log-likelihood within which they do.
const AS_MUCH: f64 = 3.0;
/// Blocks of time of these.
const BLOCKS: usize = 12;
/// Log-likelihood that a right change may lose by few rows.
const PROMISING: f64 = -5.0;
/// A joint that is slower by this stands still on purpose.
const SLOW: f64 = 3e-3;
/// Step of differences \[rad\].
const STEP: f64 = 1e-4;
/// Log-probability of sizes below which they are looked into.
const UNUSUAL: f64 = -1.0;
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
        || problem.channels.drive == Drive::Motors
        || positives.iter().any(|p| p.told && p.deviations() < BELOW)
        || implausible(problem, moving)
        || sizes(problem, &declared.by) < UNUSUAL
        || contradicts(declared)
        || torques(problem, declared, credit(positives), rows, moving)
        || {
            let race = Race::new(problem, &declared.by);
            zeros(problem, declared, rows, race.as_ref())
                || race.is_some_and(|race| positions(problem, &race, moving))
        }
}

/// Whether a joint moves farther, or less, than a log that excites it can.
fn implausible(problem: &Problem, moving: &[usize]) -> bool {
    let speeds = problem.sample.rms(&problem.sample.v);
    let fastest = speeds.iter().copied().fold(0.0, f64::max);
    moving.len() > 1
        && moving.iter().any(|&j| {
            let turns = problem.robot.joint_kind(j) == JointKind::Revolute;
            turns
                && speeds[j] > SLOW * fastest
                && !(PLAUSIBLE[0]..PLAUSIBLE[1]).contains(&problem.sample.travel(j))
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
        let alone = (target.dot(&k) - g.dot(&theta)).max(0.0) / declared.power.joints[j];
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
        let simple = |c: &&Change| c.joints().len() < 2 || matches!(c, Change::Scale(..));
        return changes.iter().filter(simple).any(gains);
    }
    // friction is each joint's own whatever the weights are: without its columns a fit is small
    let Some(shared) = declared.normal.shared(problem.robot.parameters().len()) else {
        return changes.iter().any(gains);
    };
    let score = |by: &Correction| {
        let mix = problem.channels.mix(by);
        let targets = mix.iter().map(|mix| Normal::target(mix, 1.0)).collect();
        let robot = &declared.robot;
        let power = super::trial::power(problem, robot, by, &declared.normal, &mix, rows);
        Fit::new(&shared, targets, &power).map_or(f64::NEG_INFINITY, |fit| fit.score)
    };
    let before = score(&declared.by);
    let better = |change: &Change| {
        let after = score(&declared.by.with(change));
        after > before + GAIN
            && !flat(change, after, &|c| score(&declared.by.with(c)))
            && gains(change)
    };
    changes.iter().any(better)
}

/// Whether a factor does no better than one ten times as far from 1: it only takes the joint's torque out of the fit
/// of the others, and the truth would not.
fn flat(change: &Change, score: f64, score_of: &dyn Fn(&Change) -> f64) -> bool {
    let Change::Scale(channel, joints, factor) = change else {
        return false;
    };
    let far = if *factor > 1.0 {
        FLATTER
    } else {
        FLATTER.recip()
    };
    score_of(&Change::Scale(*channel, joints.clone(), factor * far)) > score - AS_MUCH
}

/// Whether a joint's zero elsewhere gains, by the derivative of the torques with it: on few rows, then on more.
fn zeros(problem: &Problem, declared: &Trial, rows: &[usize], race: Option<&Race>) -> bool {
    let robot = problem.robot;
    if !robot.knows_links()
        || robot.joints() < 2
        || problem.channels.drive == Drive::Motors
        || !zero_gains(problem, declared, rows, 1.0)
    {
        return false;
    }
    race.and_then(Race::more).is_none_or(|more| {
        // as many of them as the few are nearly independent
        let share = rows.len() as f64 / more.rows.len() as f64;
        zero_gains(problem, &more.declared, &more.rows, share.min(1.0))
    })
}

fn zero_gains(problem: &Problem, declared: &Trial, rows: &[usize], share: f64) -> bool {
    let fit = &declared.fit;
    slopes(problem, declared, rows)
        .into_iter()
        .any(|(z, moved, gain)| {
            if share * gain < GAIN || moved.abs() < MOVED {
                return false;
            }
            // far away the derivative tells no more than that something is wrong
            if moved.abs() > FAR {
                return true;
            }
            let there = declared.by.with(&Change::Zero(z, moved));
            let trial = Trial::new(problem, there, rows, 1, Some(declared));
            trial.is_some_and(|trial| {
                let pairs = fit.left.iter().zip(&trial.fit.left);
                let ratios = pairs.filter(|(_, a)| **a > 0.0);
                ratios.map(|(b, a)| (b / a).sqrt()).fold(0.0, f64::max) > SHIFTED
            })
        })
}

/// Of each joint whose zero leaves a trace, how far it is moved by these rows and the log-likelihood that this
/// gains, to first order.
fn slopes(problem: &Problem, declared: &Trial, rows: &[usize]) -> Vec<(usize, f64, f64)> {
    let Trial {
        robot,
        by,
        normal,
        fit,
        ..
    } = declared;
    let (n, p) = (robot.joints(), robot.parameters().len());
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
    let of = |z: usize| {
        let own = with_itself[z] - with_unknowns.column(z).dot(&solved.column(z));
        // nothing of it is left where the parameters take it, or where no turn of it moves a torque
        let told = own > 1e-6 * with_itself[z] && 0.5 * own * PI * PI > GAIN;
        told.then(|| {
            (
                z,
                with_residual[z] / own,
                0.5 * with_residual[z].powi(2) / own,
            )
        })
    };
    (0..n).filter_map(of).collect()
}

/// Whether turned positions, joints in each other's place, zeros a quarter turn away, or gravity along another axis
/// gain.
fn positions(problem: &Problem, race: &Race, moving: &[usize]) -> bool {
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
    let axis = |change: &Change| match change {
        Change::Gravity(g) => g.iter().filter(|x| **x != 0.0).count() == 1,
        _ => false,
    };
    let gravity = hypotheses::of_gravity(problem, race.by);
    changes.extend(gravity.into_iter().filter(axis));
    changes.iter().any(|change| race.won(change))
}

/// Rows and the declared set-up's trial on them.
struct Heat {
    rows: Vec<usize>,
    declared: Trial,
    /// Of the declared set-up's physics; where it has a say.
    credit: f64,
}

/// Hypotheses are tried on few rows, and those that do well there on more.
struct Race<'a> {
    problem: &'a Problem<'a>,
    by: &'a Correction,
    few: [Heat; 2],
    more: OnceCell<Option<Heat>>,
}

impl Heat {
    fn new(problem: &Problem, by: &Correction, rows: usize, blocks: usize) -> Option<Self> {
        let rows = problem.sample.spread(rows);
        let declared = Trial::new(problem, by.clone(), &rows, blocks, None)?;
        Some(Self {
            rows,
            declared,
            credit: 0.0,
        })
    }

    /// The trial of a change and what it gains.
    fn of(&self, problem: &Problem, by: &Correction, blocks: usize) -> Option<(Trial, f64)> {
        let trial = Trial::new(
            problem,
            by.clone(),
            &self.rows,
            blocks,
            Some(&self.declared),
        )?;
        let gain = trial.fit.score - self.declared.fit.score;
        Some((trial, gain))
    }
}

impl<'a> Race<'a> {
    fn new(problem: &'a Problem<'a>, by: &'a Correction) -> Option<Self> {
        let n = problem.robot.joints();
        let first = FIRST[0].max(FIRST[1] * problem.first_own(problem.robot, n) / n);
        Some(Self {
            problem,
            by,
            few: [
                Heat::new(problem, by, first.min(FEWER), 1)?,
                Heat::new(problem, by, FEWER, 1)?,
            ],
            more: OnceCell::new(),
        })
    }

    fn more(&self) -> Option<&Heat> {
        let begin = || {
            let mut heat = Heat::new(self.problem, self.by, MORE, BLOCKS)?;
            heat.credit = credit(&of(self.problem, &heat.declared));
            Some(heat)
        };
        self.more.get_or_init(begin).as_ref()
    }

    /// Whether a change gains on few rows, then on more, where physics has its say.
    fn won(&self, change: &Change) -> bool {
        let (problem, by) = (self.problem, self.by.with(change));
        for heat in &self.few {
            let Some((_, gain)) = heat.of(problem, &by, 1) else {
                return false;
            };
            // a zero that parameters take is no other set-up
            let same = matches!(change, Change::Zero(..)) && gain.abs() < SAME;
            if gain < PROMISING || same {
                return false;
            }
        }
        let Some(more) = self.more() else {
            return true;
        };
        let Some((trial, gain)) = more.of(problem, &by, BLOCKS) else {
            return false;
        };
        // as many of them as the few are nearly independent
        let share = (FEWER as f64 / more.rows.len() as f64).min(1.0);
        let gain = share * gain;
        gain > GAIN && gain + credit(&of(problem, &trial)) - more.credit > GAIN
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
