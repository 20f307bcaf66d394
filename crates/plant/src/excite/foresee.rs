//! What a motion will tell, before the robot moves: expected standard deviations, the weakest
//! direction, the pair that it confounds.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;

use super::ExciteError;
use super::information::{InformationFactors, normalised};
use super::machine::ForeseenRobot;
use super::motion::Motion;
use cft_ident_core::inertia::columns::JointTerm;
use cft_ident_core::math::rank;

/// Samples of a period at which condition and determinant are taken.
const SAMPLES: usize = 250;
/// Samples per second of a motion that is no series.
const RATE: f64 = 200.0;
/// Share of the largest singular value (columns scaled) below which a direction is not excited.
const NOTHING: f64 = 1e-8;
/// The same of G, which holds squares, where rounding leaves less.
const NOTHING_OF_SQUARES: f64 = 1e-13;
/// Share of an unknown in a direction that is not excited from which on it counts as open.
const OPEN_SHARE: f64 = 1e-3;

/// Expected deviations together with what is given besides.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GivenTogether {
    pub parameters: Vec<ExpectedEstimate>,
    pub confounded: Option<CorrelatedPair>,
}

/// Condition numbers of the unweighted stacked regressor; null where its rank is short.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Condition {
    pub raw: Option<f64>,
    pub normalised: Option<f64>,
}

/// An unknown as a log of the motion is expected to give it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Expected")]
pub struct ExpectedEstimate {
    pub name: String,
    pub unit: String,
    /// Value in the model that the motion was judged with; null where torques are not foreseen.
    pub value: Option<f64>,
    /// Expected standard deviation; null where the motion does not excite it.
    pub std: Option<f64>,
    /// Over the value's modulus.
    pub relative_std: Option<f64>,
}

impl ExpectedEstimate {
    pub(super) fn new(name: &str, unit: String, value: Option<f64>, std: Option<f64>) -> Self {
        let size = value.map(f64::abs).filter(|size| *size > 0.0);
        Self {
            name: name.to_owned(),
            unit,
            value,
            std,
            relative_std: std.zip(size).map(|(std, size)| std / size),
        }
    }
}

/// Part of an unknown in a direction; columns are scaled to norm 1.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UnknownShare {
    pub parameter: String,
    pub weight: f64,
}

/// The two unknowns whose expected errors are most correlated.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Pair")]
pub struct CorrelatedPair {
    pub first: String,
    pub second: String,
    /// Correlation of their expected errors.
    pub correlation: f64,
}

/// What a motion says, however long its log.
pub(super) struct MotionForesight {
    pub condition: Condition,
    pub rank: usize,
    /// log det(F'F) of the information's rows, unweighted; none where the rank is short.
    pub log_det: Option<f64>,
    /// Largest parts first.
    pub weakest_direction: Vec<UnknownShare>,
}

/// Information of the motion: of one period of a series, else of the whole motion; and the number
/// of rows per joint that a log of it holds at the rate given \[Hz\] (whole periods alone; `seconds`
/// long where the motion does not end by itself).
///
/// # Errors
/// [`ExciteError::Robot`] where the machine cannot follow.
pub fn information(
    machine: &ForeseenRobot,
    motion: &Motion,
    rate_hz: f64,
    seconds: f64,
) -> Result<(InformationFactors, f64), ExciteError> {
    match motion {
        Motion::Periodic { series, blend } => {
            let whole = blend.periods.map(|n| series.period() * f64::from(n));
            let information = InformationFactors::of_period(machine, series, SAMPLES)?;
            Ok((information, rate_hz * whole.unwrap_or(seconds)))
        }
        Motion::Path { at, seconds } => {
            let samples = (RATE * seconds).ceil().max(2.0) as usize;
            let step = seconds / samples as f64;
            let at = |m: usize| at(step * (m as f64 + 0.5));
            let information = InformationFactors::of_path(machine, samples, &at)?;
            Ok((information, rate_hz * seconds))
        }
    }
}

/// Foresees what the rows themselves distinguish.
pub(super) fn foresee(
    machine: &ForeseenRobot,
    information: &InformationFactors,
) -> Result<MotionForesight, ExciteError> {
    let plain = information.stacked(&vec![1.0; machine.coordinates()]);
    let scaled = normalised(&plain)?;
    let largest = scaled.s.iter().copied().next().unwrap_or(0.0);
    let rank = scaled.s.iter().filter(|s| **s > NOTHING * largest).count();
    let full = rank == machine.unknowns() && largest > 0.0;
    let singular = rank::svd(&plain)?.s;
    let weakest = scaled.v.column(machine.unknowns() - 1);
    let mut weakest: Vec<(String, f64)> = (machine.unknown_names().into_iter())
        .zip(weakest.iter().copied())
        .collect();
    weakest.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    // the same direction whatever the sign of the decomposition
    let turned = weakest.first().is_some_and(|part| part.1 < 0.0);
    let part = |(parameter, weight): (String, f64)| UnknownShare {
        parameter,
        weight: if turned { -weight } else { weight },
    };
    Ok(MotionForesight {
        condition: Condition {
            raw: full.then(|| rank::condition(&singular)),
            normalised: full.then(|| rank::condition(&scaled.s)),
        },
        rank,
        log_det: full.then(|| 2.0 * singular.iter().map(|s| s.ln()).sum::<f64>()),
        weakest_direction: weakest.into_iter().map(part).collect(),
    })
}

/// Foresees a fit to `rows` rows per joint with their noise, friction known, and what is given besides by its noise.
pub(super) fn expected(
    machine: &ForeseenRobot,
    information: &InformationFactors,
    rows: f64,
    given: Option<&DMatrix<f64>>,
) -> Result<GivenTogether, ExciteError> {
    let names = machine.unknown_names();
    let weighted = information.stacked(&machine.weights());
    let mut g = weighted.tr_mul(&weighted) * (rows / information.rows as f64);
    if let Some(given) = given {
        g += given;
    }
    let (covariance, determined) = inverse(&g)?;
    let values = machine.unknown_values();
    let parameters = names.iter().enumerate().map(|(i, name)| {
        let std = determined[i].then(|| covariance[(i, i)].sqrt());
        let value = machine.source.known().then_some(values[i]);
        ExpectedEstimate::new(name, unit(machine, i), value, std)
    });
    Ok(GivenTogether {
        parameters: parameters.collect(),
        confounded: confounded(&covariance, &determined, &names),
    })
}

/// A matrix of squares and products with a diagonal of ones, and the factors; 0 for what is not there.
pub(super) fn scaled_to_one(g: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let factor = |size: f64| if size > 0.0 { 1.0 / size } else { 0.0 };
    let scale: Vec<f64> = g.diagonal().iter().map(|x| factor(x.sqrt())).collect();
    let (n, m) = g.shape();
    let scaled = DMatrix::from_fn(n, m, |i, j| g[(i, j)] * scale[i] * scale[j]);
    (scaled, scale)
}

/// Inverse of G on the directions that are excited, and which unknowns have no part in the others.
pub(super) fn inverse(g: &DMatrix<f64>) -> Result<(DMatrix<f64>, Vec<bool>), ExciteError> {
    let p = g.nrows();
    let (scaled, scale) = scaled_to_one(g);
    let svd = rank::svd(&scaled)?;
    let mut determined: Vec<bool> = scale.iter().map(|s| *s > 0.0).collect();
    let mut inverse = DMatrix::zeros(p, p);
    for k in 0..p {
        let v = svd.v.column(k);
        if svd.s[k] > NOTHING_OF_SQUARES * svd.s[0] {
            inverse += v * v.transpose() / svd.s[k];
        } else {
            for (open, part) in determined.iter_mut().zip(v.iter()) {
                *open &= part.abs() <= OPEN_SHARE;
            }
        }
    }
    let covariance = DMatrix::from_fn(p, p, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    Ok((covariance, determined))
}

/// The pair of unknowns whose errors are most correlated.
fn confounded(
    covariance: &DMatrix<f64>,
    determined: &[bool],
    names: &[String],
) -> Option<CorrelatedPair> {
    let p = names.len();
    let mut most: Option<(f64, usize, usize)> = None;
    let open = |i: usize| !determined[i];
    for j in 0..p {
        for i in (0..j).filter(|i| !(open(*i) || open(j))) {
            let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            let correlation = covariance[(i, j)] / scale;
            if correlation.is_finite() && most.is_none_or(|(c, ..)| correlation.abs() > c.abs()) {
                most = Some((correlation, i, j));
            }
        }
    }
    most.map(|(correlation, i, j)| CorrelatedPair {
        first: names[i].clone(),
        second: names[j].clone(),
        correlation,
    })
}

/// Unit of unknown i.
fn unit(machine: &ForeseenRobot, i: usize) -> String {
    let robot = &machine.model.robot;
    if let Some(info) = robot.parameters().get(i) {
        return info.unit.to_string();
    }
    for (j, own) in machine.columns.own.iter().enumerate() {
        let first = machine.columns.first_own(j);
        if let Some(own) = i.checked_sub(first).and_then(|k| own.get(k)) {
            let kind = robot.joint_kind(j);
            return match own {
                JointTerm::Viscous => format!("{} s/{}", kind.torque_unit(), kind.position_unit()),
                _ => kind.torque_unit().to_owned(),
            };
        }
    }
    String::new()
}
