//! One-joint experiments for the friction law: the speeds of the ladder, and the slowness of its
//! reversals, that leave the least expected error of its slopes w1 and w2.
//!
//! Where a law bends, at speeds of about 1/w1 and 1/w2, is not known to the usual ladder, whose
//! speeds stand in equal ratios and whose reversals take the same time everywhere. The value of a log of either is the information of the law's five
//! derivatives, less what inertia, gravity and a constant torque could take their place with.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::simulate::reference::TURN;
use crate::simulate::{OneJointMove, Path, Reference};
use cft_ident_core::math::minimise::nelder_mead;
use cft_ident_core::math::rank;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::identified::friction_unit;
use cft_ident_files::config::trajectory::{SingleJointMove, Trajectory};

use super::ExciteError;
use super::foresee::{ExpectedEstimate, scaled_to_one};
use super::from_files::place_of;
use super::limits::{BoundedQuantity, Quantity};
use super::machine::ForeseenRobot;
use super::motion::{Motion, differentiated};
use super::series::MAX_COORDINATES;
use super::usage::{ChannelUse, most_broken};

/// Samples per second at which information is gathered: a bend is passed in tens of milliseconds.
const SAMPLES_PER_SECOND: f64 = 250.0;
/// Numbers of speeds that are tried.
const COUNTS: [usize; 4] = [4, 6, 8, 10];
/// Evaluations of each.
const EVALUATIONS: u64 = 250;
/// First steps of the logarithm of a speed, and of the time of a reversal.
const SPREAD: f64 = 0.35;
const SLOWER: f64 = 0.5;
/// Shortest and longest time from zero speed to a slow plateau \[s\].
const TURNS: [f64; 2] = [0.1, 5.0];
/// Weight of the variances of the law's other parameters beside those of its slopes.
const OTHERS: f64 = 0.1;
/// A speed that is nearer to its limit than this share stands at it.
const AT_LIMIT: f64 = 1e-6;
/// Ratio by which a top speed is lowered whose strokes leave the range.
const SLOWER_TOP: f64 = 0.85;
/// Parts of the travel that are tried, one after the other, until the drives keep their limits.
const PARTS: [f64; 6] = [1.0, 0.8, 0.6, 0.4, 0.2, 0.1];
/// Directions of the nuisance below this share of the largest carry nothing.
const NOTHING: f64 = 1e-10;

/// What is to be designed.
#[derive(Debug, Clone)]
pub struct LadderTask {
    pub joint: String,
    /// Duration of the experiment \[s\].
    pub seconds: f64,
    /// Shuffles the order of the strokes.
    pub seed: u64,
    /// Rate of the log \[Hz\].
    pub rate_hz: f64,
    /// Share of the drive's limit that is left free.
    pub reserve: f64,
    /// Middle part of the travel that it keeps to, 1 for all of it; narrower where the drive's limit asks for it.
    pub part: f64,
}

/// A ladder, and what it is expected to teach.
#[derive(Debug, Clone)]
pub struct DesignedLadder {
    pub file: SingleJointMove,
    /// The law's parameters, as a log of the design is expected to give them.
    pub expected: Vec<ExpectedEstimate>,
    /// Relative standard deviations from the usual ladder, in the same order.
    pub usual: Vec<Option<f64>>,
    pub evaluations: u64,
}

/// Designs the ladder of one joint.
///
/// # Errors
/// [`ExciteError::NoLaw`] where the joint has no friction to identify, others where the machine has no such
/// joint or its travel is not known.
pub fn design_ladder(
    machine: &ForeseenRobot,
    task: &LadderTask,
) -> Result<DesignedLadder, ExciteError> {
    let bench = LadderBench::of(machine, task)?;
    if bench.law().parameters() == 0 {
        return Err(bench.no_law());
    }
    let (usual, before) = bench.widest()?;
    let (slowest, fastest) = ends(&usual.speeds);
    let value = |rungs: &LadderDesign| match bench.expectation(rungs) {
        Ok(expected) => bench.score(&expected),
        Err(_) => f64::INFINITY,
    };
    let search = |count: usize| {
        let ratio = |k: usize| k as f64 / (count - 1) as f64;
        let spread = |k| (slowest.ln() + ratio(k) * (fastest / slowest).ln()).min(fastest.ln());
        let start: Vec<f64> = (0..count).map(spread).chain([TURN.ln()]).collect();
        let rungs = |x: &[f64]| -> LadderDesign {
            let within = |x: &f64| x.exp().clamp(0.2 * slowest, fastest);
            let mut speeds: Vec<f64> = x[..count].iter().map(within).collect();
            speeds.sort_by(f64::total_cmp);
            LadderDesign {
                range: usual.range,
                speeds,
                turn: x[count].exp().clamp(TURNS[0], TURNS[1]),
            }
        };
        let mut f = |x: &[f64]| value(&rungs(x));
        // outwards steps would leave the motors' range at the top
        let step = |k| match SPREAD * (1.0 - 2.0 * ratio(k)) {
            step if step.abs() < 0.1 => 0.1,
            step => step,
        };
        let steps: Vec<f64> = (0..count).map(step).chain([SLOWER]).collect();
        let best = nelder_mead(&mut f, &start, &steps, 1e-4, EVALUATIONS);
        (best.value, rungs(&best.x), best.evaluations)
    };
    let found: Vec<(f64, LadderDesign, u64)> = COUNTS.into_par_iter().map(search).collect();
    let evaluations = found.iter().map(|f| f.2).sum();
    let best = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let at_start = bench.score(&before);
    // figures that a person can read
    let rounded = |mut rungs: LadderDesign| {
        for number in rungs.speeds.iter_mut().chain([&mut rungs.turn]) {
            *number = three_digits(*number);
        }
        rungs
    };
    let best = best.filter(|(value, ..)| *value < at_start);
    let mut rungs = rounded(best.map_or_else(|| usual.clone(), |(_, rungs, _)| rungs));
    if bench.most_broken(&rungs)?.is_some() {
        rungs = rounded(usual);
    }
    Ok(DesignedLadder {
        expected: bench.expectation(&rungs)?,
        file: bench.move_of(&rungs),
        usual: before.iter().map(|e| e.relative_std).collect(),
        evaluations,
    })
}

/// What a log of a one-joint move says about the joint's friction law.
pub fn foresee_ladder(
    machine: &ForeseenRobot,
    task: &LadderTask,
    file: &SingleJointMove,
) -> Result<Vec<ExpectedEstimate>, ExciteError> {
    let bench = LadderBench::of(machine, task)?;
    bench.expected(file).map(|(expected, _)| expected)
}

/// What a design turns.
#[derive(Debug, Clone)]
struct LadderDesign {
    /// m or rad; what the limits leave where absent.
    range: Option<[f64; 2]>,
    /// m/s or rad/s.
    speeds: Vec<f64>,
    /// Time from zero speed to a slow plateau \[s\].
    turn: f64,
}

impl LadderDesign {
    /// Lowers the top speed; not below the others.
    fn slow_down(&mut self) -> bool {
        let Some(top) = self.speeds.last().map(|top| SLOWER_TOP * top) else {
            return false;
        };
        self.speeds.iter_mut().for_each(|v| *v = v.min(top));
        self.speeds.dedup();
        self.speeds.len() > 2
    }
}

/// Three significant digits, rounded down so that a top speed stays one.
fn three_digits(v: f64) -> f64 {
    let scale = 10f64.powf(2.0 - v.log10().floor());
    // whole numbers over a power of ten print short
    (v * scale + 1e-9).floor() / scale
}

fn six_decimals(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

fn ends(speeds: &[f64]) -> (f64, f64) {
    let slowest = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let fastest = speeds.iter().copied().fold(0.0, f64::max);
    (slowest, fastest)
}

/// A machine, what is asked of it and the joint that it is asked of.
#[derive(Clone, Copy)]
struct LadderBench<'a> {
    machine: &'a ForeseenRobot,
    task: &'a LadderTask,
    joint: usize,
}

impl<'a> LadderBench<'a> {
    fn of(machine: &'a ForeseenRobot, task: &'a LadderTask) -> Result<Self, ExciteError> {
        Ok(Self {
            machine,
            task,
            joint: place_of(machine.model.robot.joint_names(), &task.joint)?,
        })
    }

    fn law(&self) -> &'a JointFriction {
        &self.machine.model.friction[self.joint]
    }

    fn no_law(&self) -> ExciteError {
        ExciteError::NoLaw {
            joint: self.task.joint.clone(),
        }
    }

    /// The usual ladder over the widest part of the travel at which the drives keep their limits, and what it says.
    fn widest(&self) -> Result<(LadderDesign, Vec<ExpectedEstimate>), ExciteError> {
        let mut refused = None;
        for part in PARTS.map(|part| part * self.task.part) {
            let mut usual = self.usual(part)?;
            self.keep_speed_limit(&mut usual.speeds);
            let mut expected = self.expectation(&usual);
            // strokes that leave the range with their turns
            while matches!(expected, Err(ExciteError::Reference(_))) && usual.slow_down() {
                expected = self.expectation(&usual);
            }
            match expected {
                Ok(before) => match self.most_broken(&usual)? {
                    None => return Ok((usual, before)),
                    Some(broken) => refused = Some(self.beyond(broken.channel.name, broken.share)),
                },
                Err(error @ ExciteError::BeyondDrive { .. }) => refused = Some(error),
                Err(error) => return Err(error),
            }
        }
        Err(refused.unwrap_or_else(|| self.no_law()))
    }

    /// The acceleration that a ladder may take where the motors are the joints and something bounds it.
    fn acceleration(&self) -> Option<f64> {
        let channels = &self.machine.channels;
        let limit = BoundedQuantity::find(channels, Quantity::Acceleration, self.joint);
        let limit = limit.filter(|_| self.machine.mechanism.motors_at_joints())?;
        Some(three_digits((1.0 - self.task.reserve) * limit.upper))
    }

    fn move_of(&self, rungs: &LadderDesign) -> SingleJointMove {
        SingleJointMove {
            joint: self.task.joint.clone(),
            speeds: rungs.speeds.clone(),
            range: rungs.range,
            acceleration: self.acceleration(),
            turn_s: Some(rungs.turn),
        }
    }

    /// The ladder that the simulator runs where no file says otherwise, over a part of the travel.
    fn usual(&self, part: f64) -> Result<LadderDesign, ExciteError> {
        let mechanism = &self.machine.mechanism;
        let mut mover = OneJointMove::new(self.joint, self.task.seconds, Some(self.task.seed));
        mover.acceleration = self.acceleration();
        mover.part = part;
        if part < 1.0 {
            let (low, high) = mover.travel(mechanism)?;
            mover.range = Some((six_decimals(low), six_decimals(high)));
        }
        let mut speeds = Vec::new();
        if let Path::Ladder { ladder, .. } = mover.reference(mechanism)?.path {
            speeds.extend(ladder.plateaus().map(|(v, _)| v.abs()));
        }
        speeds.sort_by(f64::total_cmp);
        speeds.dedup();
        Ok(LadderDesign {
            range: mover.range.map(|(low, high)| [low, high]),
            speeds,
            turn: TURN,
        })
    }

    /// Brings speeds that would stand at the joint's limit, or beyond it, below it by the reserve.
    fn keep_speed_limit(&self, speeds: &mut Vec<f64>) {
        let quantity = match self.machine.mechanism.motors_at_joints() {
            true => Quantity::Speed,
            false => Quantity::JointSpeed,
        };
        let limit = BoundedQuantity::find(&self.machine.channels, quantity, self.joint);
        let Some(limit) = limit.map(|c| c.upper) else {
            return;
        };
        for speed in speeds.iter_mut().filter(|v| **v > limit * (1.0 - AT_LIMIT)) {
            *speed = limit * (1.0 - self.task.reserve);
        }
        speeds.dedup();
    }

    /// Expected deviations of a ladder of these rungs, refused where the drive would be beyond its limit.
    fn expectation(&self, rungs: &LadderDesign) -> Result<Vec<ExpectedEstimate>, ExciteError> {
        let (expected, (used, drive)) = self.expected(&self.move_of(rungs))?;
        if used > 1.0 - self.task.reserve {
            return Err(self.beyond(self.machine.coordinate_names().swap_remove(drive), used));
        }
        Ok(expected)
    }

    fn beyond(&self, drive: String, used: f64) -> ExciteError {
        ExciteError::BeyondDrive {
            joint: self.task.joint.clone(),
            drive,
            used,
            free: self.task.reserve,
        }
    }

    /// The limit that a ladder breaks most, as its motion will be judged: torques with the 95 % band of the model.
    fn most_broken(&self, rungs: &LadderDesign) -> Result<Option<ChannelUse>, ExciteError> {
        let file = Trajectory::SingleJoint(self.move_of(rungs));
        let (machine, task) = (self.machine, self.task);
        let motion = Motion::of_file(machine, &file, task.seconds, task.seed)?;
        Ok(most_broken(motion.usage(machine, &machine.channels)))
    }

    /// Sum of the logs of the slopes' relative variances, with a little of the others': the worst does not hide the rest.
    fn score(&self, expected: &[ExpectedEstimate]) -> f64 {
        let slopes = matches!(self.law(), JointFriction::DoubleTanh(_));
        let one = |e: &ExpectedEstimate| {
            let relative = e.relative_std.unwrap_or(f64::INFINITY);
            let weight = match slopes && !e.name.starts_with("slope") {
                true => OTHERS,
                false => 1.0,
            };
            weight * 2.0 * relative.ln()
        };
        expected.iter().map(one).sum()
    }

    /// Expected deviations along a move, the largest share of a drive's limit, and which drive it is.
    fn expected(
        &self,
        file: &SingleJointMove,
    ) -> Result<(Vec<ExpectedEstimate>, (f64, usize)), ExciteError> {
        let (machine, task, joint) = (self.machine, self.task, self.joint);
        let (model, mechanism) = (&machine.model, &machine.mechanism);
        let ladder = OneJointMove::of(file, &mechanism.robot, task.seconds, task.seed)?;
        let (mut g, used) = self.information(&ladder.reference(mechanism)?)?;
        g *= task.rate_hz / SAMPLES_PER_SECOND / (machine.noise[joint] * machine.noise[joint]);
        let (names, values): (&[&str], Vec<f64>) = match self.law() {
            JointFriction::DoubleTanh(law) => (&DoubleTanh::NAMES, law.parameters().to_vec()),
            JointFriction::ViscousCoulomb(law) => {
                (&ViscousCoulomb::NAMES, vec![law.viscous, law.coulomb])
            }
            JointFriction::None => (&[], Vec::new()),
        };
        let variances = variances(&g, model.theta.len() + 1)?;
        let torque = model.robot.joint_unit(joint);
        let rows = names.iter().zip(values).zip(variances);
        let expected = rows.map(|((name, value), variance)| {
            let unit = friction_unit(&model.robot, joint, name, torque);
            ExpectedEstimate::new(name, unit, Some(value), variance.map(f64::sqrt))
        });
        Ok((expected.collect(), used))
    }

    /// F'F of the joint's rows for inertia, a constant torque and friction; the largest share of a drive's limit, and whose.
    fn information(
        &self,
        along: &Reference<MAX_COORDINATES>,
    ) -> Result<(DMatrix<f64>, (f64, usize)), ExciteError> {
        let (machine, joint, law) = (self.machine, self.joint, self.law());
        let model = &machine.model;
        let (n, p) = (machine.coordinates(), model.theta.len());
        let width = p + 1 + law.parameters();
        let (mut y, mut tau, mut row) = (vec![0.0; n * p], vec![0.0; n], vec![0.0; width]);
        let mut g = DMatrix::<f64>::zeros(width, width);
        let mut used = (0.0_f64, 0);
        let drives = machine.channels.iter();
        let drives: Vec<_> = drives.filter(|c| c.quantity == Quantity::Drive).collect();
        for m in 0..(self.task.seconds * SAMPLES_PER_SECOND).ceil() as usize {
            let k = differentiated(along, (m as f64 + 0.5) / SAMPLES_PER_SECOND);
            let (q, v, a) = (&k.x[..n], &k.xd[..n], &k.xdd[..n]);
            model.robot.regressor(q, v, a, &mut y);
            row[..p].copy_from_slice(&y[joint * p..(joint + 1) * p]);
            row[p] = 1.0;
            law.gradient(v[joint], &mut row[p + 1..]);
            for j in 0..width {
                for i in 0..=j {
                    g[(i, j)] += row[i] * row[j];
                }
            }
            for (j, tau) in tau.iter_mut().enumerate() {
                let inertial = machine.inertial(&y[j * p..(j + 1) * p]);
                *tau = inertial + model.friction[j].torque(v[j]) + model.offset[j];
            }
            let drive = machine.drives(q, &tau)?;
            for channel in &drives {
                let share = channel.used(drive[channel.index]);
                if share > used.0 {
                    used = (share, channel.index);
                }
            }
        }
        g.fill_lower_triangle_with_upper_triangle();
        Ok((g, used))
    }
}

/// Variances of the unknowns behind the first `nuisance`; `None` where nothing distinguishes one from those.
fn variances(g: &DMatrix<f64>, nuisance: usize) -> Result<Vec<Option<f64>>, ExciteError> {
    let (scaled, scale) = scaled_to_one(g);
    let f = g.nrows() - nuisance;
    let mixed = scaled.view((0, nuisance), (nuisance, f));
    let taken = rank::svd(&scaled.view((0, 0), (nuisance, nuisance)).into_owned())?;
    let mut left = scaled.view((nuisance, nuisance), (f, f)).into_owned();
    for k in 0..nuisance {
        if taken.s[k] > NOTHING * taken.s[0] {
            let along = mixed.tr_mul(&taken.v.column(k));
            left -= &along * along.transpose() / taken.s[k];
        }
    }
    let svd = rank::svd(&left)?;
    let variance = |i: usize| {
        let mut variance = 0.0;
        for k in 0..f {
            let part = svd.v[(i, k)] * svd.v[(i, k)];
            if svd.s[k] > NOTHING * svd.s[0] {
                variance += part / svd.s[k];
            } else if part > NOTHING.sqrt() {
                return None;
            }
        }
        let unscale = scale[nuisance + i];
        (unscale > 0.0).then_some(variance * unscale * unscale)
    };
    Ok((0..f).map(variance).collect())
}
