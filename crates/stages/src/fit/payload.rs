//! The body on the last link of an arm, by least squares of what a model of the arm without it leaves.
//!
//! Rows of all joints are filtered as the model's own; friction and offset of each joint are free, for a load and a
//! day change them. The body is one that can exist. It is found twice: with the gains of the torque channels as the
//! model has them, and with one gain error a joint free. Deviations hold the correlation of residuals (Newey and West
//! 1987) and the covariance of the model's own parameters.

use nalgebra::{DMatrix, DVector};

use super::gains::LSQ_WITH_GAINS;
use super::payload_result::{
    CarriedSpan, GainOff, IntervalNumber, LeftOfJoint, Payload, PayloadReading, PayloadVerdict,
    UNUSUAL,
};
use super::payload_rows::{BLOCK_S, HAT, LEFT, OWN, Rows, places};
use super::touched::{LoadRows, rows_of_load};
use crate::band::NORMAL_95;
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::in_memory::read_whole;
use crate::input::log_data::LogData;
use crate::input::robot_setup::RobotSetup;
use crate::note::{ModelNote, StageNote};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::inertia::bandwidth;
use cft_ident_core::inertia::feasible::{ConsistencyProblem, feasible};
use cft_ident_core::judge::NUMBERS;
use cft_ident_core::math::long_run::long_run;
use cft_ident_core::math::rank::svd;
use cft_ident_core::math::rfactor::RFactor;
use cft_ident_core::robot::bodies::StandardMap;
use cft_ident_core::robot::standard::{Body, STANDARD};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::TorqueIs;

/// Rounds of the joints' weights and of the gains, which multiply the body too.
const ROUNDS: usize = 4;
/// Share of the largest singular value (columns scaled) below which a direction is not excited.
const UNEXCITED_SHARE: f64 = 1e-7;
/// Share of a number in a direction that is not excited from which on it is open.
const OPEN_PART: f64 = 1e-3;

/// Relative deviation of the gains of currents where none were fitted to this robot, one for all joints: published ones
/// are off by up to 8 %. Half: weighed loads lie outside; twice: the interval says nothing of a load.
const GAIN_DEVIATION: f64 = 0.04;

/// Finds the body.
///
/// # Errors
/// Logs that cannot be used, and a robot whose last link has no place for a body.
pub fn payload(
    data: &Dataset,
    given: &GivenModel,
    control: &Control,
) -> Result<Payload, IdentifyError> {
    data.check_rows()?;
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    let (name, file, model) = (given.name.as_str(), &given.file, &given.numbers()?);
    let robot = &setup.robot;
    if robot.tool_stays_level() {
        return Err(IdentifyError::NoPayload {
            model: name.to_owned(),
        });
    }
    let whole = read_whole(setup, logs, control)?;
    setup.check_temperatures(model, logs, &whole.stretches)?;
    let work = control.begin("payload", None);
    let names: Vec<String> = logs.iter().map(LogData::name).collect();
    let LoadRows {
        rows,
        carried,
        touched,
        with_touched,
    } = rows_of_load(
        setup,
        (model, &file.held_out),
        &whole,
        (name, &names),
        control,
    )?;
    let covariance = inertial_covariance(file, model);
    let declared = has_declared_gains(file);
    let common = if declared { GAIN_DEVIATION } else { 0.0 };
    let readings = [false, true].map(|gains| reading(setup, &rows, &covariance, (gains, common)));
    let mut readings = readings.into_iter().collect::<Result<Vec<_>, _>>()?;
    if let [held, free] = &mut readings[..] {
        free.forget_undetermined(held);
    }
    let unusual = unusual(&rows, &readings, file);
    let with_touched = with_touched
        .map(|all| reading(setup, &all, &covariance, (false, common)))
        .transpose()?;
    drop(work);
    control.check()?;
    let mut notes = whole.notes;
    if declared {
        notes.push(StageNote::Model(ModelNote::DeclaredGains {
            interval: NORMAL_95 * GAIN_DEVIATION,
        }));
    }
    let links = robot.tree().links();
    Ok(Payload {
        verdict: PayloadVerdict::of(&readings, unusual),
        unusual,
        carried,
        touched,
        mass_with_touched: with_touched.map(|all| all.mass),
        link: links.last().map_or(String::new(), |link| link.name.clone()),
        readings,
        samples: rows.joints.iter().map(|rows| rows.len() as u64).sum(),
        inputs: whole.inputs,
        notes,
    })
}

/// Parts of logs in which a body is carried that explains what the model leaves of all joints there; nothing where a body
/// is carried throughout, or none.
pub(crate) fn carried_in(
    setup: &RobotSetup,
    logs: &[LogData],
    given: &GivenModel,
    control: &Control,
) -> Result<Vec<CarriedSpan>, IdentifyError> {
    let (file, model) = (&given.file, &given.numbers()?);
    let whole = read_whole(setup, logs, control)?;
    setup.check_temperatures(model, logs, &whole.stretches)?;
    let names: Vec<String> = logs.iter().map(LogData::name).collect();
    let LoadRows { rows, carried, .. } = rows_of_load(
        setup,
        (model, &file.held_out),
        &whole,
        (&given.name, &names),
        control,
    )?;
    if carried.is_empty() {
        return Ok(carried);
    }
    let held = reading(
        setup,
        &rows,
        &inertial_covariance(file, model),
        (false, 0.0),
    )?;
    let is_body = held.mass.is_above_zero();
    let unusual = unusual(&rows, &[held], file);
    let explains = is_body && unusual.is_none_or(|times| times <= UNUSUAL);
    Ok(if explains { carried } else { Vec::new() })
}

/// Whether torques are currents whose gains the robot file declares, and no known load.
fn has_declared_gains(file: &ModelFile) -> bool {
    let currents = file.robot.log.torque_is == Some(TorqueIs::Current);
    currents && file.provenance.command != LSQ_WITH_GAINS
}

/// How many times the usual error of the model is left of the joint of which most is, with the body.
fn unusual(rows: &Rows, readings: &[PayloadReading], file: &ModelFile) -> Option<f64> {
    let left = readings.first()?.joints.iter().zip(&rows.joints);
    let over = left.filter_map(|(left, rows)| {
        let usual = file
            .residual_std
            .get(&left.joint)
            .filter(|usual| **usual > 0.0)?;
        (!rows.is_empty()).then(|| left.rmse / usual)
    });
    over.reduce(f64::max)
}

/// Covariance of the model's inertial parameters, zeros where it is not known.
fn inertial_covariance(file: &ModelFile, model: &AugmentedModel) -> DMatrix<f64> {
    let (u, p) = (model.model.parameters(), model.model.theta.len());
    let whole = DMatrix::from_row_slice(u, u, &file.model_covariance(&model.model));
    whole.view((0, 0), (p, p)).into_owned()
}

/// Where a fit stands: gain errors multiply the body, so that its columns depend on both.
struct Point {
    body: DVector<f64>,
    /// Gain error of each joint, 0 where gains are held.
    gains: Vec<f64>,
}

impl Point {
    fn of(theta: &DVector<f64>, n: usize, gains: bool) -> Self {
        let gain = |j: usize| {
            if gains {
                theta[STANDARD + 3 * n + j]
            } else {
                0.0
            }
        };
        Self {
            body: theta.rows(0, STANDARD).into_owned(),
            gains: (0..n).map(gain).collect(),
        }
    }

    fn carried(&self, row: &[f64; OWN + 3]) -> f64 {
        let each = row[..STANDARD].iter().zip(self.body.iter());
        each.map(|(y, x)| y * x).sum()
    }

    /// Columns of a row and their target: the torque (1 + gain) (body + model) less the model, linear about this point.
    fn linear(&self, j: usize, row: &[f64; OWN + 3], gains: bool) -> (Vec<f64>, f64) {
        let (gain, carried) = (self.gains[j], self.carried(row));
        let of_body = row[..STANDARD].iter().map(|y| (1.0 + gain) * y);
        let of_gain = gains.then_some(row[HAT] + carried);
        let columns = of_body.chain(row[STANDARD..OWN].iter().copied());
        (columns.chain(of_gain).collect(), row[LEFT] + gain * carried)
    }
}

fn reading(
    setup: &RobotSetup,
    rows: &Rows,
    covariance: &DMatrix<f64>,
    (gains, common): (bool, f64),
) -> Result<PayloadReading, IdentifyError> {
    let n = setup.robot.joints();
    let u = STANDARD + 3 * n + if gains { n } else { 0 };
    let mut weights = vec![1.0; n];
    let mut theta = DVector::zeros(u);
    let mut normal = DMatrix::zeros(u, u);
    for _ in 0..ROUNDS {
        let mut factor = RFactor::new(u + 1);
        let mut whole = vec![0.0; u + 1];
        let point = Point::of(&theta, n, gains);
        for (j, of) in rows.joints.iter().enumerate() {
            let places = places(j, n, gains);
            for row in of {
                whole.fill(0.0);
                let (columns, left) = point.linear(j, &row.numbers, gains);
                for (at, x) in places.iter().zip(columns) {
                    whole[*at] = weights[j] * x;
                }
                whole[u] = weights[j] * left;
                factor.fold(&whole);
            }
        }
        let r = factor.r();
        normal = r.columns(0, u).tr_mul(&r.columns(0, u));
        theta = bounded(&r, rows, u)?;
        for (j, weight) in weights.iter_mut().enumerate() {
            let square: f64 = errors(rows, j, n, &theta, gains).map(|e| e * e).sum();
            *weight = (rows.joints[j].len().max(1) as f64 / square.max(f64::MIN_POSITIVE)).sqrt();
        }
    }
    let (inverse, open) = inverse(&normal)?;
    let point = Point::of(&theta, n, gains);
    let mut scores = vec![DVector::zeros(u); rows.blocks.len()];
    let mut by_model = DMatrix::zeros(u, covariance.nrows());
    for (j, of) in rows.joints.iter().enumerate() {
        let places = places(j, n, gains);
        let square = weights[j] * weights[j];
        for (row, error) in of.iter().zip(errors(rows, j, n, &theta, gains)) {
            for (at, x) in places.iter().zip(point.linear(j, &row.numbers, gains).0) {
                scores[row.block][*at] += square * x * error;
            }
        }
        // an error of the model is scaled as the model is
        let gain = 1.0 + point.gains[j];
        let beside = &rows.beside[j];
        let carried = beside.rows(0, STANDARD).tr_mul(&point.body);
        for (c, at) in places.iter().enumerate() {
            for k in 0..by_model.ncols() {
                let column = match c {
                    0..STANDARD => gain * beside[(c, k)],
                    HAT => beside[(c, k)] + carried[k],
                    _ => beside[(c, k)],
                };
                by_model[(*at, k)] += square * gain * column;
            }
        }
    }
    let stretches = rows.blocks.iter().map(|block| block.stretch);
    let scores: Vec<(usize, DVector<f64>)> = stretches.zip(scores).collect();
    let lag = bandwidth(&scores, u, BLOCK_S);
    let middle = long_run(&scores, u, lag) + &by_model * covariance * by_model.transpose();
    let mut spread = &inverse * middle * &inverse;
    // one error of all gains scales the body, and no torque contradicts it
    let body = spread.view((0, 0), (STANDARD, STANDARD))
        + &point.body * point.body.transpose() * (common * common);
    spread
        .view_mut((0, 0), (STANDARD, STANDARD))
        .copy_from(&body);
    Ok(payload_of(setup, rows, &theta, &spread, &open, gains))
}

/// What a joint's rows leave.
fn errors<'a>(
    rows: &'a Rows,
    j: usize,
    n: usize,
    theta: &'a DVector<f64>,
    gains: bool,
) -> impl Iterator<Item = f64> + 'a {
    let (places, point) = (places(j, n, gains), Point::of(theta, n, gains));
    rows.joints[j].iter().map(move |row| {
        let (columns, left) = point.linear(j, &row.numbers, gains);
        let fitted = places.iter().zip(columns).map(|(at, x)| theta[*at] * x);
        left - fitted.sum::<f64>()
    })
}

/// Whether the errors of a joint are above those of the model as given, by more than chance does to their blocks.
fn is_worse(rows: &Rows, j: usize, errors: impl Iterator<Item = f64>) -> bool {
    let mut scores: Vec<(usize, DVector<f64>)> = (rows
        .blocks
        .iter()
        .map(|block| (block.stretch, DVector::zeros(1))))
    .collect();
    for (row, error) in rows.joints[j].iter().zip(errors) {
        scores[row.block].1[0] += error * error - row.numbers[LEFT].powi(2);
    }
    let more: f64 = scores.iter().map(|(_, score)| score[0]).sum();
    let mean = more / scores.len().max(1) as f64;
    scores.iter_mut().for_each(|(_, score)| score[0] -= mean);
    let lag = bandwidth(&scores, 1, BLOCK_S);
    more > NUMBERS.screen * long_run(&scores, 1, lag)[(0, 0)].max(0.0).sqrt()
}

/// Least squares over bodies that can exist.
fn bounded(factor: &DMatrix<f64>, rows: &Rows, u: usize) -> Result<DVector<f64>, IdentifyError> {
    let map = StandardMap {
        links: vec!["payload".to_owned()],
        drives: Vec::new(),
        matrix: DMatrix::identity(STANDARD, STANDARD),
    };
    let count: usize = rows.joints.iter().map(Vec::len).sum();
    let found = feasible(&ConsistencyProblem {
        map: &map,
        bodies: &[None],
        factor,
        // rows are few enough to be counted by their blocks
        effective: (rows.blocks.len() as f64 / count.max(1) as f64).min(1.0),
        friction: &[],
    })?;
    Ok(found.theta.rows(0, u).into_owned())
}

/// Inverse of the normal matrix on the directions that are excited, and which unknowns have a part in others.
fn inverse(normal: &DMatrix<f64>) -> Result<(DMatrix<f64>, Vec<bool>), IdentifyError> {
    let u = normal.nrows();
    let size = |i: usize| normal[(i, i)].sqrt();
    let scale: Vec<f64> = (0..u)
        .map(|i| if size(i) > 0.0 { 1.0 / size(i) } else { 0.0 })
        .collect();
    let scaled = DMatrix::from_fn(u, u, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    let parts = svd(&scaled).map_err(cft_ident_core::inertia::solution::FitError::from)?;
    let mut open: Vec<bool> = scale.iter().map(|s| *s == 0.0).collect();
    let mut out = DMatrix::zeros(u, u);
    for k in 0..u {
        let v = parts.v.column(k);
        if parts.s[k] > UNEXCITED_SHARE * UNEXCITED_SHARE * parts.s[0] {
            out += v * v.transpose() / parts.s[k];
        } else {
            for (open, part) in open.iter_mut().zip(v.iter()) {
                *open |= part.abs() > OPEN_PART;
            }
        }
    }
    Ok((
        DMatrix::from_fn(u, u, |i, j| out[(i, j)] * scale[i] * scale[j]),
        open,
    ))
}

fn interval(value: f64, variance: f64, open: bool, unit: &str) -> IntervalNumber {
    let std = variance.max(0.0).sqrt();
    let known = !open && std.is_finite();
    IntervalNumber {
        value: known.then_some(value),
        std: known.then_some(std),
        interval_95: known.then_some([value - NORMAL_95 * std, value + NORMAL_95 * std]),
        unit: unit.to_owned(),
    }
}

fn payload_of(
    setup: &RobotSetup,
    rows: &Rows,
    theta: &DVector<f64>,
    spread: &DMatrix<f64>,
    open: &[bool],
    gains: bool,
) -> PayloadReading {
    let n = setup.robot.joints();
    let standard: [f64; STANDARD] = std::array::from_fn(|i| theta[i]);
    let body = Body::of(&standard);
    // slopes of centre and inertia by the standard parameters, differenced: they are smooth where there is a mass
    let number = |of: &dyn Fn(&Body) -> f64, takes: &[usize], unit: &str| {
        let mut slopes = DVector::zeros(STANDARD);
        for k in 0..STANDARD {
            let step = 1e-6 * (1e-3 + standard[k].abs());
            let at = |sign: f64| {
                let mut moved = standard;
                moved[k] += sign * step;
                of(&Body::of(&moved))
            };
            slopes[k] = (at(1.0) - at(-1.0)) / (2.0 * step);
        }
        let own = spread.view((0, 0), (STANDARD, STANDARD));
        let variance = (slopes.transpose() * own * &slopes)[(0, 0)];
        interval(of(&body), variance, takes.iter().any(|k| open[*k]), unit)
    };
    let centre = std::array::from_fn(|i| number(&|b| b.centre[i], &[6 + i, 9], "m"));
    let inertia = std::array::from_fn(|i| number(&|b| b.inertia[i], &[i, 6, 7, 8, 9], "kg m^2"));
    let names = setup.robot.joint_names();
    let gain = |j: usize| {
        let at = STANDARD + 3 * n + j;
        GainOff {
            joint: names[j].clone(),
            error: interval(theta[at], spread[(at, at)], open[at], ""),
        }
    };
    let of_joint = |j: usize| {
        let torque: f64 = rows.joints[j]
            .iter()
            .map(|row| (row.numbers[HAT] + row.numbers[LEFT]).powi(2))
            .sum();
        let before: f64 = rows.joints[j]
            .iter()
            .map(|row| row.numbers[LEFT].powi(2))
            .sum();
        let after: f64 = errors(rows, j, n, theta, gains).map(|e| e * e).sum();
        let errors = errors(rows, j, n, theta, gains);
        LeftOfJoint {
            worse: is_worse(rows, j, errors),
            joint: names[j].clone(),
            before: (before / torque).sqrt(),
            after: (after / torque).sqrt(),
            rmse: (after / rows.joints[j].len().max(1) as f64).sqrt(),
        }
    };
    PayloadReading {
        gains_free: gains,
        mass: interval(body.mass, spread[(9, 9)], open[9], "kg"),
        centre,
        inertia,
        gains: if gains {
            (0..n).map(gain).collect()
        } else {
            Vec::new()
        },
        joints: (0..n).map(of_joint).collect(),
        body: standard,
    }
}
