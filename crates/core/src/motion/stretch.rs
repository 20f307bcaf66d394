//! Uninterrupted stretches of a log at full rate, for searches that go over the same samples many
//! times: whole in memory, 8 bytes x 4 channels x joints a sample.

use super::run::{RunError, Summary, run};
use super::settings::{FilterDesign, FilterSettings};
use super::{MotionError, rest};
use crate::block::Block;
use crate::math::kept::{KeptRows, KeptWork};

/// One uninterrupted stretch, smoothed and differentiated; every channel `[joint][sample]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stretch {
    /// Index of its log among those of one call.
    pub log: usize,
    /// Sampling step \[s\].
    pub dt: f64,
    /// Time of the first sample since the begin of its log \[s\].
    pub began: f64,
    /// Time stamps of its log \[s\].
    pub t: Vec<f64>,
    /// Time by the log's own clock where its time stamps are 0 \[s\]: other than 0 for clocks far from
    /// zero.
    pub zero: f64,
    /// Positions [m or rad].
    pub q: Vec<Vec<f64>>,
    /// Velocities [m/s or rad/s].
    pub v: Vec<Vec<f64>>,
    /// Accelerations [m/s2 or rad/s2].
    pub a: Vec<Vec<f64>>,
    /// Torques, unfiltered [N or Nm].
    pub tau: Vec<Vec<f64>>,
    /// Temperatures as logged \[degC\]; empty of joints without one, and of all where no log has any.
    pub temperature: Vec<Vec<f64>>,
}

impl Stretch {
    pub fn len(&self) -> usize {
        self.t.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Time of a sample by the log's own clock \[s\].
    pub fn own_time(&self, sample: usize) -> f64 {
        self.zero + self.t.first().copied().unwrap_or(0.0) + self.dt * sample as f64
    }

    /// The part of this stretch that lies beside another of the same log, sample by sample; none where it does not
    /// reach as far.
    pub fn beside(&self, other: &Stretch) -> Option<Stretch> {
        let (first, own) = (other.t.first()?, self.t.first()?);
        let from = ((first - own) / self.dt).round();
        let to = from + other.len() as f64;
        if !alike(self.dt, other.dt) || from < 0.0 || to > self.len() as f64 {
            return None;
        }
        Some(Stretch {
            began: other.began,
            ..self.part(from as usize, to as usize)
        })
    }

    /// Samples `from..until`; of a channel that is not there nothing.
    pub fn part(&self, from: usize, until: usize) -> Stretch {
        let of = |channels: &[Vec<f64>]| -> Vec<Vec<f64>> {
            let part = |x: &Vec<f64>| x.get(from..until).unwrap_or_default().to_vec();
            channels.iter().map(part).collect()
        };
        Stretch {
            began: self.began + self.dt * from as f64,
            t: self.t[from..until].to_vec(),
            q: of(&self.q),
            v: of(&self.v),
            a: of(&self.a),
            tau: of(&self.tau),
            temperature: of(&self.temperature),
            ..*self
        }
    }

    /// Whether it has the temperature of a joint.
    pub fn has_temperature(&self, joint: usize) -> bool {
        self.temperature.get(joint).is_some_and(|x| !x.is_empty())
    }

    pub fn joints(&self) -> usize {
        self.q.len()
    }

    /// Position, velocity and acceleration of every joint at sample k.
    pub fn at(&self, k: usize, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        for j in 0..self.q.len() {
            q[j] = self.q[j][k];
            v[j] = self.v[j][k];
            a[j] = self.a[j][k];
        }
    }
}

/// Reads one log into stretches. They end where the parallel filter begins: what it leaves off at
/// the ends is [`FilterDesign::trim`].
pub fn stretches<E>(
    log: usize,
    joints: usize,
    settings: &FilterSettings,
    source: &mut dyn FnMut(&mut Block) -> Result<bool, E>,
) -> Result<(Vec<Stretch>, Summary), RunError<E>> {
    let every = FilterSettings {
        decimation: Some(1),
        trim_s: Some(0.0),
        ..settings.clone()
    };
    let mut found: Vec<Stretch> = Vec::new();
    let mut segment = None;
    let mut first = None;
    let mut read = |block: &mut Block| {
        let more = source(block)?;
        if first.is_none() {
            first = block.t.first().copied();
        }
        Ok(more)
    };
    let summary = run(
        &mut read,
        joints,
        &every,
        None,
        joints,
        &|sample, out| out.copy_from_slice(sample.tau),
        &mut |row| {
            if segment != Some(row.segment) {
                segment = Some(row.segment);
                found.push(Stretch {
                    log,
                    began: row.t,
                    q: vec![Vec::new(); joints],
                    v: vec![Vec::new(); joints],
                    a: vec![Vec::new(); joints],
                    tau: vec![Vec::new(); joints],
                    ..Stretch::default()
                });
            }
            let Some(stretch) = found.last_mut() else {
                return;
            };
            stretch.t.push(row.t);
            for j in 0..joints {
                stretch.q[j].push(row.q[j]);
                stretch.v[j].push(row.v[j]);
                stretch.a[j].push(row.a[j]);
                stretch.tau[j].push(row.raw[j]);
            }
        },
    )?;
    for stretch in &mut found {
        stretch.dt = summary.dt;
        stretch.began -= first.unwrap_or(0.0);
    }
    // what was done to the log is reported with its own decimation
    let decimation = FilterDesign::design(settings, summary.dt)?.decimation;
    let summary = Summary {
        decimation,
        ..summary
    };
    Ok((found, summary))
}

impl FilterDesign {
    /// What each sample of a joint weighs that rests up to `rest_speed`, as in [`MotionSample`](super::MotionSample).
    pub fn weights(&self, stretch: &Stretch, joint: usize, rest_speed: f64) -> Vec<f64> {
        let cutoff = self.position.as_ref().map(|f| f.cutoff_hz(joint));
        let reach = rest::response(cutoff, stretch.dt, self.differences.reach());
        let mut out = vec![0.0; stretch.len()];
        rest::weigh(&stretch.v[joint], (1, 0), rest_speed, reach, &mut out);
        out
    }

    /// Rows that a stretch of `samples` gives.
    pub fn rows(&self, samples: usize) -> usize {
        if samples <= 2 * self.trim {
            return 0;
        }
        (samples - 2 * self.trim).div_ceil(self.decimation)
    }

    /// Index within the stretch of row `i`.
    pub fn sample_of(&self, i: usize) -> usize {
        self.trim + i * self.decimation
    }

    /// Filters one channel of a stretch at full rate, in place.
    ///
    /// # Errors
    /// [`MotionError`] where the stretch is too short for the filter.
    pub fn smooth(&self, channel: &mut [f64]) -> Result<(), MotionError> {
        Ok(self.parallel.run(channel, 1)?)
    }

    /// The same of so many samples and channels row by row; `fill` writes the channels of a sample, in the order of time.
    ///
    /// # Errors
    /// [`MotionError`] where there are too few samples for the filter.
    pub fn run_rows(
        &self,
        [samples, channels]: [usize; 2],
        fill: &mut dyn FnMut(usize, &mut [f64]),
    ) -> Result<Vec<f64>, MotionError> {
        let rows = KeptRows {
            samples,
            channels,
            first: self.trim,
            kept: self.rows(samples),
        };
        Ok(self.kept.run(rows, &mut KeptWork::default(), fill)?)
    }

    /// Filters channels of a stretch and keeps every `decimation`-th sample.
    ///
    /// # Errors
    /// [`MotionError`] where the stretch is too short for the filter.
    pub fn run(&self, channels: &[&[f64]]) -> Result<Vec<Vec<f64>>, MotionError> {
        let samples = channels.first().map_or(0, |c| c.len());
        let mut out = Vec::with_capacity(channels.len());
        // few are read side by side
        for group in channels.chunks(8) {
            let filtered = self.run_rows([samples, group.len()], &mut |k, row| {
                row.iter_mut()
                    .zip(group)
                    .for_each(|(x, channel)| *x = channel[k]);
            })?;
            let own = |l: usize| filtered.iter().skip(l).step_by(group.len());
            let of_channel = |l: usize| own(l).copied().collect();
            out.extend((0..group.len()).map(of_channel));
        }
        Ok(out)
    }
}

/// Steps that differ by less than this share are one: clocks of the same rate.
const ALIKE: f64 = 0.02;

/// The declared parallel filter for stretches of logs that may be sampled at several rates.
#[derive(Debug, Clone)]
pub struct ParallelFilters {
    /// Sampling step \[s\] and the filter for it.
    designs: Vec<(f64, FilterDesign)>,
}

impl ParallelFilters {
    /// The filters for the steps of these stretches.
    ///
    /// # Errors
    /// [`MotionError`] for settings that one of the sampling rates does not carry.
    pub fn design(settings: &FilterSettings, stretches: &[Stretch]) -> Result<Self, MotionError> {
        let mut designs: Vec<(f64, FilterDesign)> = Vec::new();
        for dt in stretches.iter().rev().map(|s| s.dt) {
            if !designs.iter().any(|(known, _)| alike(*known, dt)) {
                designs.push((dt, FilterDesign::design(settings, dt)?));
            }
        }
        if designs.is_empty() {
            return Err(MotionError::TooFewSamples { samples: 0 });
        }
        Ok(ParallelFilters { designs })
    }

    /// Which of the rates a stretch has.
    pub(crate) fn rate_of(&self, stretch: &Stretch) -> usize {
        let off = |dt: f64| (dt / stretch.dt).ln().abs();
        let steps = self.designs.iter().enumerate();
        steps
            .min_by(|(_, a), (_, b)| off(a.0).total_cmp(&off(b.0)))
            .map_or(0, |(i, _)| i)
    }

    /// The filter for a stretch.
    pub fn of(&self, stretch: &Stretch) -> &FilterDesign {
        &self.designs[self.rate_of(stretch)].1
    }

    /// Sampling step \[s\] and filter of each rate.
    pub(crate) fn designs(&self) -> &[(f64, FilterDesign)] {
        &self.designs
    }

    /// Rows per second where most are kept \[Hz\].
    pub fn row_rate_hz(&self) -> f64 {
        let rate = |(dt, filter): &(f64, FilterDesign)| 1.0 / (dt * filter.decimation as f64);
        self.designs.iter().map(rate).fold(0.0, f64::max)
    }
}

/// Whether two sampling steps are of one rate.
pub(crate) fn alike(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() <= ALIKE
}
