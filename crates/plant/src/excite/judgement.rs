//! The judgement of a motion before the robot moves: what a log of it will tell, and how near it
//! comes to each limit.

use schemars::JsonSchema;
use serde::Serialize;

use super::foresee::{
    Condition, CorrelatedPair, ExpectedEstimate, GivenTogether, UnknownShare, expected, foresee,
    information,
};
use super::limits::{BoundedQuantity, Quantity};
use super::machine::{ForeseenRobot, NoiseSource};
use super::motion::{spectrum, torque_band};
use super::series::Series;
use super::strokes::EffectSeparation;
use super::usage::{ChannelUse, along_period, along_way};
use super::{ExciteError, GivenInformation, Motion};
use cft_ident_core::number;

/// Share of the torque's power that its band holds.
const BAND_POWER_SHARE: f64 = 0.99;
/// Correlation of expected errors from which on two parameters count as confounded.
const ALIKE: f64 = 0.95;

/// What there is to say about a motion.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Judgement")]
pub struct MotionJudgement {
    /// Of the unweighted stacked regressor, along a period of a series.
    pub condition: Condition,
    /// log det(F'F) of `samples_per_period` rows per joint, unweighted; null where the rank is short.
    pub log_det: Option<f64>,
    /// Directions of the parameters that the motion excites.
    pub rank: usize,
    /// Rows per joint in condition and determinant.
    pub samples_per_period: u64,
    /// Share of its limits that each designed coordinate takes.
    pub limits_used: Vec<LimitsUsed>,
    /// Every limit along the motion.
    pub limits: Vec<LimitUse>,
    /// Every limit on the straight way from the given pose to the first point, `t` as a share of the way; null
    /// where no pose is given.
    pub way: Option<Vec<LimitUse>>,
    /// With what torques are foreseen, in one sentence.
    pub torques: String,
    /// Whether they are foreseen at all; where not, no limit of torque was checked.
    pub torques_foreseen: bool,
    /// That sentence comes before all others.
    #[serde(skip)]
    pub torques_first: bool,
    /// What nobody looked at, in one sentence.
    pub not_checked: String,
    /// Viscous and Coulomb friction are fitted with the inertial parameters; else friction is known.
    pub friction_fitted: bool,
    /// Expected deviations.
    pub parameters: Vec<ExpectedEstimate>,
    /// The combination of columns, scaled to norm 1, that is least certain; largest parts first.
    pub weakest_direction: Vec<UnknownShare>,
    pub confounded: Option<CorrelatedPair>,
    /// The same with what is given besides.
    pub together: Option<GivenTogether>,
    /// Of a one-joint move: what it says about the joint's friction.
    pub friction: Option<LawForeseen>,
    /// The noise that deviations are expected from.
    pub noise: Vec<TorqueNoise>,
    /// Where that noise is from.
    pub noise_source: NoiseSource,
    /// What those limits cost that the logs of the model set, where the robot file gives none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lifted: Option<LiftedLimits>,
    /// Rows per joint that the deviations stand for.
    pub rows: f64,
    /// Rate of the log that is foreseen \[Hz\].
    pub rate_hz: f64,
    /// Of a series alone.
    pub spectrum: Option<Vec<SpeedAmplitudes>>,
    /// Of a series alone, where torques are foreseen.
    pub band: Option<Vec<PowerBand>>,
    /// Duration of the motion \[s\].
    pub seconds: f64,
    /// Whole periods between the ends, of a series.
    pub periods: Option<u32>,
    /// What the design made small.
    pub criterion: String,
    /// Seed of the design.
    pub seed: u64,
    /// Evaluations that the design took; null for a motion that was there.
    pub evaluations: Option<u64>,
    /// Of strokes that tell an effect from its like.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separates: Option<EffectSeparation>,
    /// What a reader should know.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

/// Share of a coordinate's limits that a motion takes: 1 at a limit; null where there is none.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LimitsUsed {
    pub coordinate: String,
    pub position: Option<f64>,
    pub speed: Option<f64>,
    pub acceleration: Option<f64>,
    pub volts: Option<f64>,
}

/// One limit along a motion.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LimitUse {
    /// Coordinate or joint.
    pub name: String,
    pub quantity: Quantity,
    pub unit: String,
    /// The least that is allowed \[unit\].
    pub lower: f64,
    /// The most that is allowed \[unit\]; null where nothing bounds it.
    pub upper: f64,
    /// Least along the motion \[unit\].
    pub least: f64,
    /// Most along the motion \[unit\].
    pub most: f64,
    /// Share of the limit: 1 at it; null where the machine cannot follow.
    pub used: f64,
    /// Time at which it comes nearest \[s\]; a share of the way on one.
    pub t: f64,
    pub broken: bool,
    /// The robot file gives none: it is what the logs of the model reached.
    pub from_logs: bool,
}

/// Expected deviations of a friction law.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LawForeseen {
    pub joint: String,
    pub parameters: Vec<ExpectedEstimate>,
    /// Relative deviations from the usual ladder, in the same order.
    pub usual_relative_std: Option<Vec<Option<f64>>>,
}

/// The same path, faster, as far as the limits of the robot file alone allow.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LiftedLimits {
    /// How many times as fast.
    pub pace: f64,
    /// How many times as narrow the expected deviations are: least, median and most of the parameters.
    pub narrower: [f64; 3],
}

/// Noise of a joint's torque.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TorqueNoise {
    pub joint: String,
    /// Standard deviation, sample by sample \[N or N m\].
    pub torque_std: f64,
}

/// Amplitudes of a coordinate's speed.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Amplitudes")]
pub struct SpeedAmplitudes {
    pub coordinate: String,
    /// "m/s" or "rad/s".
    pub unit: String,
    /// By harmonic, from the first \[unit\].
    pub speed_amplitudes: Vec<f64>,
}

/// Where the power of a joint's torque lies.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PowerBand {
    pub joint: String,
    /// Frequency below which 99 % of it lies \[Hz\].
    pub torque_power_99_below_hz: f64,
}

/// Judgements of several motions, each designed to complement those before it: the last one's fields,
/// and all of them where there are several.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Judgements")]
pub struct MotionJudgements {
    #[serde(flatten)]
    pub last: MotionJudgement,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub trajectories: Vec<MotionJudgement>,
}

impl MotionJudgements {
    /// None where there is none.
    pub fn of(mut trajectories: Vec<MotionJudgement>) -> Option<Self> {
        let last = trajectories.last()?.clone();
        if trajectories.len() == 1 {
            trajectories.clear();
        }
        Some(MotionJudgements { last, trajectories })
    }
}

/// How a motion is to be judged.
#[derive(Debug, Clone)]
pub struct MotionTerms<'a> {
    /// Limits that are looked at.
    pub channels: &'a [BoundedQuantity],
    /// What is used together with the motion.
    pub given: Option<&'a GivenInformation>,
    /// Of a one-joint move.
    pub friction: Option<LawForeseen>,
    /// Pose from which the robot goes to the first point, in the designed coordinates \[m or rad\].
    pub from: Option<&'a [f64]>,
    /// Rate of the log that is foreseen \[Hz\].
    pub rate_hz: f64,
    /// Its duration where the motion does not end by itself \[s\].
    pub seconds: f64,
    /// What the design made small, and its seed.
    pub criterion: &'a str,
    pub seed: u64,
}

/// Judges a motion.
///
/// # Errors
/// [`ExciteError::Robot`] where the machine cannot follow.
pub fn judge(
    machine: &ForeseenRobot,
    motion: &Motion,
    terms: MotionTerms,
) -> Result<MotionJudgement, ExciteError> {
    let uses = motion.usage(machine, terms.channels);
    let first = motion.at(0.0);
    let way = (terms.from).map(|from| along_way(machine, terms.channels, from, &first));
    let (information, rows) = information(machine, motion, terms.rate_hz, terms.seconds)?;
    let foresight = foresee(machine, &information)?;
    let GivenTogether {
        parameters,
        confounded,
    } = expected(machine, &information, rows, None)?;
    let with = |given: &GivenInformation| {
        let before = given.weighted(&machine.weights());
        expected(machine, &information, rows, Some(&before))
    };
    let names = machine.coordinate_names();
    let (spectrum, band, periods) = match motion {
        Motion::Periodic { series, blend } => {
            let spectrum = amplitudes(machine, &names, series);
            (Some(spectrum), band(machine, series)?, blend.periods)
        }
        Motion::Path { .. } => (None, None, None),
    };
    // a one-joint move is not meant to separate the inertias
    let warnings = match terms.friction {
        None => cautions(confounded.as_ref(), foresight.rank, machine.unknowns()),
        Some(_) => Vec::new(),
    };
    let noise = machine.model.robot.joint_names().iter().zip(&machine.noise);
    let noise = noise.map(|(joint, std)| TorqueNoise {
        joint: joint.clone(),
        torque_std: *std,
    });
    Ok(MotionJudgement {
        condition: foresight.condition,
        log_det: foresight.log_det,
        rank: foresight.rank,
        samples_per_period: information.rows,
        limits_used: limits_used(&names, &uses),
        limits: uses.iter().map(LimitUse::of).collect(),
        torques: machine.source.sentence(),
        torques_foreseen: machine.source.known(),
        torques_first: machine.source.caution().is_some(),
        friction_fitted: machine.columns.own.iter().any(|own| !own.is_empty()),
        not_checked: machine.space.not_checked(way.is_some()),
        way: way.map(|way| way.iter().map(LimitUse::of).collect()),
        parameters,
        weakest_direction: foresight.weakest_direction,
        confounded,
        together: terms.given.map(with).transpose()?,
        friction: terms.friction,
        noise: noise.collect(),
        noise_source: machine.noise_source,
        lifted: None,
        rows,
        rate_hz: terms.rate_hz,
        spectrum,
        band,
        seconds: motion.seconds(),
        periods,
        criterion: terms.criterion.to_owned(),
        seed: terms.seed,
        evaluations: None,
        separates: None,
        warnings,
    })
}

/// Least gain of pace that is worth a word.
const WORTH_A_WORD: f64 = 1.1;
/// Pace from which on nothing bounds a motion.
const MOST_PACE: f64 = 64.0;
/// Halvings of the interval of paces.
const HALVINGS: usize = 12;

/// What limits cost that are those of the logs: none where there are none, or the others allow hardly more.
///
/// # Errors
/// [`ExciteError::Robot`] where the machine cannot follow.
pub fn lifted(
    machine: &ForeseenRobot,
    motion: &Motion,
    terms: &MotionTerms,
) -> Result<Option<LiftedLimits>, ExciteError> {
    let declared = terms.channels.iter().filter(|c| !c.from_logs);
    let declared: Vec<BoundedQuantity> = declared.cloned().collect();
    let Motion::Periodic { series, blend } = motion else {
        return Ok(None);
    };
    if declared.len() == terms.channels.len() {
        return Ok(None);
    }
    let keeps = |pace: f64| {
        let uses = along_period(machine, &declared, &series.at_pace(pace));
        uses.iter().all(|of| of.share <= 1.0)
    };
    // nothing else bounds it
    if keeps(MOST_PACE) {
        return Ok(None);
    }
    let (mut kept, mut broken) = (1.0, MOST_PACE);
    for _ in 0..HALVINGS {
        let middle = (kept * broken).sqrt();
        match keeps(middle) {
            true => kept = middle,
            false => broken = middle,
        }
    }
    if kept < WORTH_A_WORD {
        return Ok(None);
    }
    let expected_at = |pace: f64| {
        let faster = Motion::Periodic {
            series: series.at_pace(pace),
            blend: *blend,
        };
        let (information, _) = information(machine, &faster, terms.rate_hz, terms.seconds)?;
        expected(machine, &information, terms.rate_hz, None)
    };
    let [now, then] = [expected_at(1.0)?, expected_at(kept)?].map(|of| of.parameters);
    let ratio = |(a, b): (&ExpectedEstimate, &ExpectedEstimate)| Some(a.std? / b.std?);
    let mut ratios: Vec<f64> = now.iter().zip(&then).filter_map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let all = ratios.first().zip(ratios.last());
    Ok(all.map(|(least, most)| LiftedLimits {
        pace: kept,
        narrower: [*least, ratios[ratios.len() / 2], *most],
    }))
}

/// Amplitudes of a series, coordinate after coordinate.
fn amplitudes(machine: &ForeseenRobot, names: &[String], series: &Series) -> Vec<SpeedAmplitudes> {
    let rows = names.iter().zip(spectrum(series)).enumerate();
    rows.map(|(i, (coordinate, speed_amplitudes))| SpeedAmplitudes {
        coordinate: coordinate.clone(),
        unit: format!("{}/s", machine.coordinate_unit(i)),
        speed_amplitudes,
    })
    .collect()
}

/// Where the power of the torques lies; none where they are not foreseen.
fn band(machine: &ForeseenRobot, series: &Series) -> Result<Option<Vec<PowerBand>>, ExciteError> {
    if !machine.source.known() {
        return Ok(None);
    }
    let edges = torque_band(machine, series, BAND_POWER_SHARE)?;
    let joints = machine.model.robot.joint_names().iter().zip(edges);
    let of = |(joint, torque_power_99_below_hz): (&String, f64)| PowerBand {
        joint: joint.clone(),
        torque_power_99_below_hz,
    };
    Ok(Some(joints.map(of).collect()))
}

/// What the motion does not distinguish.
fn cautions(confounded: Option<&CorrelatedPair>, rank: usize, unknowns: usize) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(pair) = confounded
        && pair.correlation.abs() > ALIKE
    {
        warnings.push(format!(
            "this motion barely separates {} from {}: their errors correlate by {:.3}",
            pair.first, pair.second, pair.correlation
        ));
    }
    if rank < unknowns {
        warnings.push(format!(
            "this motion excites {rank} of {unknowns} directions of the parameters"
        ));
    }
    warnings
}

fn limits_used(names: &[String], uses: &[ChannelUse]) -> Vec<LimitsUsed> {
    let share = |quantity: Quantity, i: usize| {
        let of = |u: &&ChannelUse| u.channel.quantity == quantity && u.channel.index == i;
        uses.iter().find(of).map(|u| u.share)
    };
    let of = |(i, name): (usize, &String)| LimitsUsed {
        coordinate: name.clone(),
        position: share(Quantity::Position, i),
        speed: share(Quantity::Speed, i),
        acceleration: share(Quantity::Acceleration, i),
        volts: share(Quantity::Drive, i),
    };
    names.iter().enumerate().map(of).collect()
}

impl LimitUse {
    fn of(along: &ChannelUse) -> Self {
        let channel = &along.channel;
        LimitUse {
            name: channel.name.clone(),
            quantity: channel.quantity,
            unit: channel.unit.clone(),
            lower: channel.lower,
            upper: channel.upper,
            least: along.range[0],
            most: along.range[1],
            used: along.share,
            t: along.t,
            // beyond what logs reached a motion is no danger
            broken: along.share > 1.0 && !channel.from_logs,
            from_logs: channel.from_logs,
        }
    }

    /// One sentence of a limit that is broken, on the way to the motion or along it.
    fn sentence(&self, on_way: bool) -> String {
        let what = format!("{} of {}", self.quantity.called(&self.unit), self.name);
        let unit = match self.unit.as_str() {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        let percent = number::significant(100.0 * self.t, 3);
        let (on, at) = match on_way {
            true => (
                "on the way from the given pose ",
                format!("at {percent} % of it"),
            ),
            false => ("", format!("at t = {:.4} s", self.t)),
        };
        if self.used.is_infinite() && !self.most.is_finite() {
            return format!("{on}the robot cannot follow {at}, where {what} would be needed");
        }
        let value = |v: f64| number::significant(v, 5);
        let [lower, upper, least, most] =
            [self.lower, self.upper, self.least, self.most].map(value);
        let (allowed, nearest) = match self.upper.is_finite() {
            true => (format!("[{lower}, {upper}]"), "farthest"),
            false => (format!("at least {lower}"), "nearest"),
        };
        format!(
            "{on}{what} runs from {least} to {most}{unit}, allowed is {allowed}; {nearest} {at}"
        )
    }
}

impl MotionJudgement {
    /// With what torques are foreseen and what nobody looked at, the more urgent first.
    pub fn first_words(&self) -> [&str; 2] {
        let (torques, not_checked) = (self.torques.as_str(), self.not_checked.as_str());
        match self.torques_first {
            true => [torques, not_checked],
            false => [not_checked, torques],
        }
    }

    /// One sentence for each limit that the motion breaks.
    pub fn broken(&self) -> Vec<String> {
        let way = self.way.iter().flatten().map(|limit| (limit, true));
        let all = way.chain(self.limits.iter().map(|limit| (limit, false)));
        let broken = all.filter(|(limit, _)| limit.broken);
        let sentences = broken.map(|(limit, on_way)| limit.sentence(on_way));
        sentences.collect()
    }

    /// The limit of a coordinate, where it has one.
    pub fn limit(&self, coordinate: &str, quantity: Quantity) -> Option<&LimitUse> {
        let mut all = self.limits.iter();
        all.find(|limit| limit.quantity == quantity && limit.name == coordinate)
    }
}
