//! Measured and reconstructed torque over time.

use super::LogReplay;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::MotionError;

/// The torque of one joint along a log [Nm or N].
#[derive(Debug, Clone, Default)]
pub struct JointSeries {
    pub measured: Vec<f64>,
    /// Of each model.
    pub reconstructed: Vec<Vec<f64>>,
    /// Of the last model: rms of its residual over that of the measured torque, and [Nm or N].
    pub relative_error: f64,
    pub rmse: f64,
}

/// The torques of one log.
#[derive(Debug, Clone)]
pub struct TorqueSeries {
    /// Name of the log.
    pub log: String,
    /// Cut-off of the parallel filter \[Hz\]; none for the torque as it was logged.
    pub cutoff_hz: Option<f64>,
    /// Time \[s\], rising.
    pub t: Vec<f64>,
    /// First samples of stretches that no line joins with what is before.
    pub breaks: Vec<usize>,
    pub joints: Vec<JointSeries>,
}

/// The torques of `logs`, each as it was filtered, which the errors are of, and as it was logged.
pub(super) fn torque(
    replay: &LogReplay,
    logs: &[usize],
    models: &[&AugmentedModel],
) -> Result<Vec<TorqueSeries>, MotionError> {
    let mut all = Vec::new();
    for &log in logs {
        let mut smooth = Series::new(replay, models.len());
        let mut plain = Series::new(replay, models.len());
        for stretch in replay.of_log(log) {
            let hats = models.iter().map(|model| model.reconstruct(stretch));
            let hats: Vec<Vec<Vec<f64>>> = hats.collect();
            let channels = stretch.tau.iter().chain(hats.iter().flatten());
            let channels: Vec<&[f64]> = channels.map(Vec::as_slice).collect();
            plain.add(&stretch.t, &channels);
            let filter = replay.filters.of(stretch);
            let rows = filter.run(&channels)?;
            let at = |i| stretch.t.get(filter.sample_of(i)).copied();
            let times: Vec<f64> = (0..filter.rows(stretch.len())).filter_map(at).collect();
            let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
            smooth.add(&times, &rows);
        }
        let name = replay.names.get(log).cloned().unwrap_or_default();
        all.push(smooth.finish(name.clone(), Some(replay.cutoff_hz)));
        all.push(plain.finish(name, None));
    }
    Ok(all)
}

/// Torques of one log, stretch after stretch.
struct Series {
    joints: usize,
    t: Vec<f64>,
    breaks: Vec<usize>,
    /// Measured, then of each model, joint by joint.
    channels: Vec<Vec<f64>>,
}

impl Series {
    fn new(replay: &LogReplay, models: usize) -> Self {
        let joints = replay.setup.robot.joints();
        Series {
            joints,
            t: Vec::new(),
            breaks: Vec::new(),
            channels: vec![Vec::new(); joints * (1 + models)],
        }
    }

    fn add(&mut self, t: &[f64], channels: &[&[f64]]) {
        self.breaks.push(self.t.len());
        self.t.extend_from_slice(t);
        for (all, channel) in self.channels.iter_mut().zip(channels) {
            all.extend_from_slice(&channel[..t.len().min(channel.len())]);
        }
    }

    fn finish(self, log: String, cutoff_hz: Option<f64>) -> TorqueSeries {
        let mut joints = vec![JointSeries::default(); self.joints];
        for (k, channel) in self.channels.into_iter().enumerate() {
            let joint = &mut joints[k % self.joints];
            match k < self.joints {
                true => joint.measured = channel,
                false => joint.reconstructed.push(channel),
            }
        }
        joints.iter_mut().for_each(JointSeries::judge);
        TorqueSeries {
            log,
            cutoff_hz,
            t: self.t,
            breaks: self.breaks,
            joints,
        }
    }
}

impl JointSeries {
    fn judge(&mut self) {
        let Some(hat) = self.reconstructed.last() else {
            return;
        };
        let square = |x: &mut dyn Iterator<Item = f64>| x.map(|v| v * v).sum::<f64>();
        let error = square(&mut self.measured.iter().zip(hat).map(|(a, b)| a - b));
        let torque = square(&mut self.measured.iter().copied());
        self.relative_error = (error / torque).sqrt();
        self.rmse = (error / self.measured.len() as f64).sqrt();
    }
}
