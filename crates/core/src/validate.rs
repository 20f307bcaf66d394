//! Torque reconstruction on a log that was not used (Figures 7 and 8 of the report).
//!
//! Measured and reconstructed torque run through the model's declared parallel filter alike; the
//! errors of every filtered, decimated row and of every raw sample are summed as they pass.

mod sums;
mod traces;

use schemars::JsonSchema;
use serde::Serialize;

use self::sums::{ErrorSums, ratio};
use self::traces::append;
use crate::block::Block;
use crate::motion::{self, FilterDesign, FilterSettings, Stretch, Summary, rest};
use crate::robot::model::{JointFriction, Model};

/// Errors of one joint.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointError {
    pub joint: String,
    /// "N" or "Nm".
    pub unit: &'static str,
    /// Root mean square of measured less reconstructed torque, filtered.
    pub rmse: f64,
    /// norm(tau - tau_hat) / norm(tau), filtered and decimated.
    pub relative_error: f64,
    /// The same of the rows in which the joint moves, weighed as a fit does: samples where it turns or stands count
    /// less; null where there are none.
    pub relative_error_moving: Option<f64>,
    /// The same times the root mean square of the torque of these rows \[unit\].
    pub rmse_moving: Option<f64>,
    /// The same of the rows in which it rests.
    pub relative_error_rest: Option<f64>,
    /// The same of every raw sample.
    pub relative_error_raw: f64,
    /// Largest filtered error.
    pub max_abs: f64,
    /// 1 - residual variance / variance of the measured torque, filtered.
    pub r2: f64,
    /// Share of the raw samples that the 95 % band holds; absent without a band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage_95: Option<f64>,
    /// Mean half width of the band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_width: Option<f64>,
    /// Filtered, decimated rows.
    pub samples: u64,
    /// Those in which it rests.
    #[serde(skip)]
    pub resting: u64,
}

/// Errors over all joints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Overall")]
pub struct OverallTorqueErrors {
    /// Stacked norms over all joints; none where their units differ.
    pub relative_error: Option<f64>,
    /// The same of the rows in which each joint moves.
    pub relative_error_moving: Option<f64>,
    /// The same of the rows in which each joint rests.
    pub relative_error_rest: Option<f64>,
    /// Root mean square of the relative errors of the joints that move.
    pub mean_relative_error: f64,
    /// The same of the rows in which each joint moves: the headline.
    pub mean_relative_error_moving: f64,
}

impl JointError {
    /// The error that is spoken of: of the rows in which the joint moves, of all where it never does.
    pub fn headline(&self) -> f64 {
        self.relative_error_moving.unwrap_or(self.relative_error)
    }

    /// Whether it moves at all: the torque of a joint that stands still is any that friction takes.
    pub fn moves(&self) -> bool {
        self.resting < self.samples
    }
}

/// Errors joint by joint, and over the joints.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TorqueErrors {
    pub joints: Vec<JointError>,
    pub overall: OverallTorqueErrors,
}

/// Reconstructed logs.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "Validation")]
pub struct TorqueValidation {
    /// Over all logs.
    #[serde(flatten)]
    pub errors: TorqueErrors,
    #[serde(rename = "processing")]
    pub summary: Summary,
    #[serde(skip)]
    pub traces: TorqueTraces,
}

/// Filtered torques over time for the figure, thinned to a bounded number of points so that every
/// extreme survives.
#[derive(Debug, Clone, Default)]
pub struct TorqueTraces {
    /// Time of each point [s].
    pub t: Vec<f64>,
    /// First point of each uninterrupted stretch.
    pub breaks: Vec<usize>,
    /// Measured and reconstructed torque, points x joints, row-major.
    pub measured: Vec<f64>,
    pub reconstructed: Vec<f64>,
}

/// One row of raw torques, handed to the caller for a residual file.
#[derive(Debug, Clone, Copy)]
pub struct ReconstructedRow<'a> {
    pub t: f64,
    /// Positions [m or rad] and velocities [m/s or rad/s].
    pub q: &'a [f64],
    pub v: &'a [f64],
    /// Unfiltered torque as logged and as reconstructed, n numbers each.
    pub measured: &'a [f64],
    pub reconstructed: &'a [f64],
    /// Movement of each joint: 1 in motion, 0 at rest or at a reversal.
    pub moving: &'a [f64],
    /// Half the width of the 95 % band; 0 without one.
    pub half_width: &'a [f64],
}

/// Half the widths of a band from q, v, a, and the model's torque.
pub type HalfWidths<'a> = &'a (dyn Fn([&[f64]; 3], &[f64], &mut [f64]) + Sync);

/// Where the thinning of a log's rows stands.
#[derive(Default)]
struct ThinningState {
    stretch: Option<usize>,
    count: usize,
    began: f64,
    every: usize,
}

impl ThinningState {
    /// Whether the next row, at `t` of `stretch`, is kept; and whether a stretch begins with it.
    fn keeps(&mut self, settings: &FilterSettings, stretch: usize, t: f64) -> (bool, bool) {
        let begins = self.stretch != Some(stretch);
        if begins {
            (self.stretch, self.count, self.began) = (Some(stretch), 0, t);
        } else if self.count == 1 {
            // rows come at full rate: two of them give the step
            self.every = settings.decimation_at(t - self.began);
        }
        let keeps = self.count.is_multiple_of(self.every) || begins;
        self.count += 1;
        (keeps, begins)
    }
}

/// Errors of several logs and joints, summed log after log.
pub struct TorqueReconstruction<'a> {
    model: &'a Model,
    /// Speed up to which each joint rests [m/s or rad/s]; below 0 where its rows always count.
    rest_speed: Vec<f64>,
    band: Option<HalfWidths<'a>>,
    /// Of the present log, joint by joint, and of those before it.
    sums: Vec<ErrorSums>,
    before: Vec<Vec<ErrorSums>>,
    traces: TorqueTraces,
    /// Time of the log's own clock where the times of its rows are 0 [s].
    zero: f64,
    /// Rows of which sums alone are known: nothing is reported then of single ones.
    summed: bool,
}

/// Squares of one joint over filtered, decimated rows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SummedRows {
    /// Squared error [N^2 or N^2 m^2], of the rows in which the joint moves and of those in which it rests.
    pub error: [f64; 2],
    /// Squared measured torque of both.
    pub torque: [f64; 2],
    /// Number of both.
    pub rows: [u64; 2],
}

impl<'a> TorqueReconstruction<'a> {
    /// Nothing yet. `rest_speed`: the speed up to which each joint rests [m/s or rad/s], none where rests are
    /// not reported; joints without friction never rest. `band` is that of the model, where it has one.
    pub fn new(model: &'a Model, rest_speed: &[f64], band: Option<HalfWidths<'a>>) -> Self {
        let speed = |(j, law): (usize, &JointFriction)| match (law, rest_speed.get(j)) {
            (JointFriction::None, _) | (_, None) => -1.0,
            (_, Some(speed)) => *speed,
        };
        TorqueReconstruction {
            model,
            rest_speed: model.friction.iter().enumerate().map(speed).collect(),
            band,
            sums: vec![ErrorSums::default(); model.robot.joints()],
            before: Vec::new(),
            traces: TorqueTraces::default(),
            zero: 0.0,
            summed: false,
        }
    }

    /// Says from where the times of the log are counted, by its own clock [s]: traces have that clock's times.
    pub fn count_from(&mut self, zero: f64) {
        self.zero = zero;
    }

    /// Ends a log: what is added from here on is of another one.
    pub fn end_log(&mut self) {
        let next = vec![ErrorSums::default(); self.sums.len()];
        self.before.push(std::mem::replace(&mut self.sums, next));
    }

    /// Errors over those of the logs that were ended, in their order, of which `wanted` is true.
    pub fn errors_of(&self, wanted: impl Fn(usize) -> bool) -> TorqueErrors {
        let logs = self.before.iter().enumerate();
        self.errors(logs.filter(|(log, _)| wanted(*log)).map(|(_, sums)| sums))
    }

    /// Runs one log through with the processing that the model declares. `row` gets every raw
    /// sample.
    pub fn add<E>(
        &mut self,
        settings: &FilterSettings,
        source: &mut dyn FnMut(&mut Block) -> Result<bool, E>,
        row: &mut dyn FnMut(&ReconstructedRow),
    ) -> Result<Summary, motion::RunError<E>> {
        let n = self.model.robot.joints();
        let (model, rest_speed, band) = (self.model, self.rest_speed.clone(), self.band);
        let mut full = settings.clone();
        full.rest_speed.clone_from(&self.rest_speed);
        // every raw sample counts, so rows are thinned here and not by the pipeline
        full.decimation = Some(1);
        let mut taken = ThinningState::default();
        let summary = motion::run(
            source,
            n,
            &full,
            None,
            6 * n,
            &|sample, out| {
                out[..n].copy_from_slice(sample.tau);
                model.torque(sample.q, sample.v, sample.a, &mut out[n..2 * n]);
                if let Some(band) = band {
                    let (tau, widths) = out[n..].split_at_mut(2 * n);
                    band([sample.q, sample.v, sample.a], &tau[..n], &mut widths[..n]);
                }
                for (j, weight) in sample.weight[..n].iter().enumerate() {
                    out[2 * n + j] = rest::movement(sample.v[j], rest_speed[j]);
                    out[4 * n + j] = weight * out[j];
                    out[5 * n + j] = weight * out[n + j];
                }
            },
            &mut |r| {
                let channels = [r.raw, r.filtered];
                let (taken, at) = ((settings, &mut taken), (r.segment, r.t));
                self.take(taken, at, [r.q, r.v], channels, row);
            },
        )?;
        Ok(Summary {
            decimation: settings.decimation_at(summary.dt),
            ..summary
        })
    }

    /// Adds one stretch of a log in memory with its reconstructed torque, `[joint][sample]`: for
    /// models whose effects remember. `segment` counts the stretches of all logs.
    ///
    /// # Errors
    /// [`MotionError`](motion::MotionError) of the filter.
    pub fn add_stretch(
        &mut self,
        settings: &FilterSettings,
        segment: usize,
        stretch: &Stretch,
        reconstructed: &[Vec<f64>],
        row: &mut dyn FnMut(&ReconstructedRow),
    ) -> Result<(), motion::MotionError> {
        let n = self.model.robot.joints();
        let mut full = settings.clone();
        full.decimation = Some(1);
        let parallel = FilterDesign::design(&full, stretch.dt)?;
        let speeds = || self.rest_speed.iter().enumerate();
        let movement = |(j, speed): (usize, &f64)| {
            let v = stretch.v[j].iter();
            v.map(|v| rest::movement(*v, *speed)).collect()
        };
        let moving: Vec<Vec<f64>> = speeds().map(movement).collect();
        let weights = speeds().map(|(j, speed)| parallel.weights(stretch, j, *speed));
        let weights: Vec<Vec<f64>> = weights.collect();
        let weighted = |(x, w): (&Vec<f64>, &Vec<f64>)| {
            let pairs = x.iter().zip(w);
            pairs.map(|(x, w)| x * w).collect()
        };
        let torques = stretch.tau.iter().chain(reconstructed);
        let by_weight = torques.clone().zip(weights.iter().cycle());
        let by_weight: Vec<Vec<f64>> = by_weight.map(weighted).collect();
        let mut widths = vec![vec![0.0; stretch.len()]; n];
        if let Some(band) = self.band {
            let [mut q, mut v, mut a, mut tau, mut width] = [(); 5].map(|()| vec![0.0; n]);
            for k in 0..stretch.len() {
                stretch.at(k, &mut q, &mut v, &mut a);
                for (tau, hat) in tau.iter_mut().zip(reconstructed) {
                    *tau = hat[k];
                }
                band([&q, &v, &a], &tau, &mut width);
                for (channel, width) in widths.iter_mut().zip(&width) {
                    channel[k] = *width;
                }
            }
        }
        let channels = torques.chain(&moving).chain(&widths).chain(&by_weight);
        let channels: Vec<&[f64]> = channels.map(Vec::as_slice).collect();
        let rows = parallel.run(&channels)?;
        let mut taken = ThinningState::default();
        let (mut raw, mut filtered) = (vec![0.0; 6 * n], vec![0.0; 6 * n]);
        let count = parallel.rows(stretch.len());
        let [mut q, mut v, mut a] = [(); 3].map(|()| vec![0.0; n]);
        for (i, k) in (0..count).map(|i| (i, parallel.sample_of(i))) {
            stretch.at(k, &mut q, &mut v, &mut a);
            for c in 0..6 * n {
                raw[c] = channels[c][k];
                filtered[c] = rows[c][i];
            }
            let at = (segment, stretch.t[k]);
            let taken = (settings, &mut taken);
            self.take(taken, at, [&q, &v], [&raw, &filtered], row);
        }
        Ok(())
    }

    /// Adds rows of one joint of which the sums are known, and nothing else: of the errors of single rows and of the
    /// raw samples nothing is known then. Rows of movement stand as a fit weighs them, in the error of all rows too.
    pub fn add_sums(&mut self, joint: usize, rows: &SummedRows) {
        self.summed = true;
        let sums = &mut self.sums[joint];
        sums.error += rows.error[0] + rows.error[1];
        sums.torque += rows.torque[0] + rows.torque[1];
        sums.moving[0] += rows.error[0];
        sums.moving[1] += rows.torque[0];
        sums.rest[0] += rows.error[1];
        sums.rest[1] += rows.torque[1];
        sums.rows += rows.rows[0] + rows.rows[1];
        sums.resting += rows.rows[1];
    }

    /// Takes one row at full rate.
    fn take(
        &mut self,
        (settings, taken): (&FilterSettings, &mut ThinningState),
        (segment, t): (usize, f64),
        [q, v]: [&[f64]; 2],
        [raw, filtered]: [&[f64]; 2],
        row: &mut dyn FnMut(&ReconstructedRow),
    ) {
        let n = self.sums.len();
        let (keep, begins) = taken.keeps(settings, segment, t);
        if begins {
            self.traces.breaks.push(self.traces.t.len());
        }
        for (j, s) in self.sums.iter_mut().enumerate() {
            let width = match self.band {
                Some(_) => raw[3 * n + j],
                None => f64::NAN,
            };
            s.add_raw(raw[j], raw[n + j], width);
        }
        row(&ReconstructedRow {
            t,
            q,
            v,
            measured: &raw[..n],
            reconstructed: &raw[n..2 * n],
            moving: &raw[2 * n..3 * n],
            half_width: &raw[3 * n..4 * n],
        });
        if keep {
            for (j, s) in self.sums.iter_mut().enumerate() {
                let rests = rest::rests(filtered[2 * n + j]);
                let row = |first: usize| [filtered[first + j], filtered[first + n + j]];
                s.add(row(0), row(4 * n), rests);
            }
            append(&mut self.traces, self.zero + t, &filtered[..2 * n], n);
        }
    }

    /// Errors over all logs that were added, with the last log's summary.
    pub fn finish(self, summary: Summary) -> TorqueValidation {
        let all = self.before.iter().chain([&self.sums]);
        TorqueValidation {
            errors: self.errors(all),
            summary,
            traces: self.traces,
        }
    }

    fn errors<'s>(&self, logs: impl Iterator<Item = &'s Vec<ErrorSums>>) -> TorqueErrors {
        let mut all = vec![ErrorSums::default(); self.sums.len()];
        for log in logs {
            for (sum, of_log) in all.iter_mut().zip(log) {
                sum.merge(of_log);
            }
        }
        let robot = &self.model.robot;
        let has_band = self.band.is_some();
        let known = |x: Option<f64>| x.filter(|_| !self.summed).unwrap_or(f64::NAN);
        let joint = |(j, s): (usize, &ErrorSums)| JointError {
            joint: robot.joint_names()[j].clone(),
            unit: robot.joint_unit(j),
            rmse: (s.error / s.rows.max(1) as f64).sqrt(),
            relative_error: ratio([s.error, s.torque], 1).unwrap_or(f64::NAN),
            relative_error_moving: ratio(s.moving, s.rows - s.resting),
            rmse_moving: ratio(s.moving, s.rows - s.resting).map(|relative| {
                let square = (s.torque - s.rest[1]).max(0.0);
                relative * (square / (s.rows - s.resting).max(1) as f64).sqrt()
            }),
            relative_error_rest: ratio(s.rest, s.resting),
            relative_error_raw: known(ratio([s.raw_error, s.raw_torque], 1)),
            coverage_95: has_band.then(|| s.inside as f64 / s.raw_rows.max(1) as f64),
            half_width: has_band.then(|| s.widths / s.raw_rows.max(1) as f64),
            max_abs: known(Some(s.largest)),
            r2: match s.scatter > 0.0 && !self.summed {
                true => 1.0 - s.error / s.scatter,
                false => f64::NAN,
            },
            samples: s.rows,
            resting: s.resting,
        };
        let joints: Vec<JointError> = all.iter().enumerate().map(joint).collect();
        let one_unit = joints.iter().all(|e| e.unit == joints[0].unit);
        let mut pooled = ErrorSums::default();
        all.iter().for_each(|s| pooled.merge(s));
        let part = |[error, torque]: [f64; 2], rows: u64| {
            let of_all = ratio([error.max(0.0), torque], rows);
            of_all.filter(|_| one_unit)
        };
        let any = joints.iter().any(JointError::moves);
        let mean = |of: fn(&JointError) -> f64| {
            let counted = joints.iter().filter(|e| e.moves() || !any);
            let squares: Vec<f64> = counted.map(|e| of(e).powi(2)).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        TorqueErrors {
            overall: OverallTorqueErrors {
                relative_error: one_unit.then(|| (pooled.error / pooled.torque).sqrt()),
                relative_error_moving: part(pooled.moving, pooled.rows - pooled.resting),
                relative_error_rest: part(pooled.rest, pooled.resting),
                mean_relative_error: mean(|e| e.relative_error),
                mean_relative_error_moving: mean(JointError::headline),
            },
            joints,
        }
    }
}

#[cfg(test)]
mod tests;
