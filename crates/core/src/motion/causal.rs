//! Position, velocity and acceleration sample by sample, from rows as they arrive: nothing looks ahead.
//!
//! Positions and torques of all joints run forward through one filter, the narrowest of theirs, so that all
//! are late alike, and positions are differentiated by five points about the third newest: what comes out with a sample belongs
//! [`CausalMotion::delay_s`] before it.

use super::position_filter::{HIGHEST_SHARE, PositionFilter};
use super::settings::FilterSettings;
use super::time_base::{Event, SampleClock, TimeBase};
use super::{MotionError, MotionSample};
use crate::block::Block;
use crate::math::causal::{CausalSections, delay_samples};
use crate::math::sos::SosFilter;

/// Rows from which the sampling step is found.
const CLOCK_ROWS: usize = 256;
/// Samples by which the differences are late.
const LATE_SAMPLES: usize = 2;
/// Samples that they are formed from.
const POINTS: usize = 2 * LATE_SAMPLES + 1;
/// Time constants after which a filter has forgotten its start.
const SETTLING_TIME_CONSTANTS: f64 = 8.0;

/// Turns rows into samples that are smoothed and differentiated.
pub struct CausalMotion {
    joints: usize,
    settings: FilterSettings,
    base: TimeBase,
    /// Times of the first rows, until the step is known.
    first: Vec<f64>,
    chain: Option<Chain>,
}

/// The filter of positions and torques for one sampling step.
pub struct CausalFilter {
    /// None where raw positions are differentiated.
    pub sos: Option<SosFilter>,
    /// Rows before the first sample.
    pub settle: usize,
    /// Time by which samples are late, the differences' own included \[s\].
    pub delay_s: f64,
}

impl CausalFilter {
    /// The narrowest position filter of `settings` for rows `dt` seconds apart.
    ///
    /// # Errors
    /// [`MotionError`] for a filter that the sampling rate does not carry.
    pub fn design(settings: &FilterSettings, dt: f64) -> Result<Self, MotionError> {
        let rate = 1.0 / dt;
        let mut cutoffs = settings.position_cutoffs_hz(rate);
        // one that was found at another rate
        let most = HIGHEST_SHARE * rate;
        cutoffs.iter_mut().for_each(|hz| *hz = hz.min(most));
        let filter = PositionFilter::design(settings.q_order, cutoffs, rate)?;
        let sos = filter.map(|f| f.narrowest().sos().clone());
        let late = sos.as_ref().map_or(0.0, delay_samples) + LATE_SAMPLES as f64;
        let settle = |sos: &SosFilter| sos.settle_samples(SETTLING_TIME_CONSTANTS);
        Ok(Self {
            settle: sos.as_ref().map_or(0, settle) + POINTS,
            delay_s: late * dt,
            sos,
        })
    }
}

/// The filters for one sampling step.
struct Chain {
    dt: f64,
    delay_s: f64,
    settle: usize,
    /// Of positions and torques of all joints alike, or they would not belong together.
    filter: CausalSections,
    /// Filtered positions, then torques, of the newest samples, the newest at `at`.
    ring: Vec<f64>,
    at: usize,
    /// Samples since the stretch began.
    count: usize,
    v: Vec<f64>,
    a: Vec<f64>,
    /// No row rests before it is filtered.
    weight: Vec<f64>,
    rests: Vec<bool>,
}

/// A sample, and whether a stretch begins with it.
pub struct CausalSample<'a> {
    /// Its time is that of the newest row that it knows.
    pub motion: MotionSample<'a>,
    /// The sample before it, if any, lies on the other side of a gap.
    pub begins: bool,
}

impl CausalMotion {
    /// For logs of so many joints, by the position filter of `settings`.
    pub fn new(joints: usize, settings: &FilterSettings) -> Result<Self, MotionError> {
        Ok(Self {
            joints,
            settings: settings.clone(),
            base: TimeBase::new(joints, settings, None)?,
            first: Vec::with_capacity(CLOCK_ROWS),
            chain: None,
        })
    }

    /// Sampling step, once known \[s\].
    pub fn step_s(&self) -> Option<f64> {
        self.chain.as_ref().map(|chain| chain.dt)
    }

    /// Time by which samples are late, once the step is known \[s\].
    pub fn delay_s(&self) -> Option<f64> {
        self.chain.as_ref().map(|chain| chain.delay_s)
    }

    /// Takes rows and hands out the sampling step \[s\] and the samples that they determine; none before the first 256 rows have given the
    /// sampling step. With `last`, all that is left.
    ///
    /// # Errors
    /// [`MotionError`] for time that does not increase and filters that the sampling rate does not carry.
    pub fn push(
        &mut self,
        rows: &Block,
        last: bool,
        out: &mut dyn FnMut(f64, &CausalSample),
    ) -> Result<(), MotionError> {
        self.base.push(rows)?;
        if self.chain.is_none() {
            let room = CLOCK_ROWS - self.first.len();
            self.first.extend(rows.t.iter().take(room));
            if self.first.len() < CLOCK_ROWS && (!last || self.first.len() < 2) {
                return Ok(());
            }
            let clock = SampleClock::of(&self.first)?;
            self.base.use_clock(clock);
            self.chain = Some(Chain::design(self.joints, &self.settings, clock.dt)?);
        }
        let Some(chain) = &mut self.chain else {
            return Ok(());
        };
        self.base.drain(last, &mut |event| match event {
            Event::Sample { t, q, tau } => chain.take(t, q, tau, out),
            Event::End => chain.reset(),
        })
    }
}

impl Chain {
    fn design(joints: usize, settings: &FilterSettings, dt: f64) -> Result<Self, MotionError> {
        let of = CausalFilter::design(settings, dt)?;
        Ok(Self {
            dt,
            delay_s: of.delay_s,
            settle: of.settle,
            filter: CausalSections::new(of.sos.as_ref(), 2 * joints),
            ring: vec![0.0; 2 * joints * POINTS],
            at: 0,
            count: 0,
            v: vec![0.0; joints],
            a: vec![0.0; joints],
            weight: vec![1.0; joints],
            rests: vec![false; joints],
        })
    }

    fn reset(&mut self) {
        self.count = 0;
        self.filter.reset();
    }

    fn take(&mut self, t: f64, q: &[f64], tau: &[f64], out: &mut dyn FnMut(f64, &CausalSample)) {
        let n = q.len();
        self.at = (self.at + 1) % POINTS;
        let newest = &mut self.ring[self.at * 2 * n..(self.at + 1) * 2 * n];
        newest[..n].copy_from_slice(q);
        newest[n..].copy_from_slice(tau);
        self.filter.step(newest);
        self.count += 1;
        if self.count <= self.settle {
            return;
        }
        // five points about the third newest: exact for polynomials of degree 4
        let back = |m: usize| (self.at + POINTS - m) % POINTS * 2 * n;
        let middle = back(LATE_SAMPLES);
        for j in 0..n {
            let at = |m: usize| self.ring[back(m) + j];
            let [ahead2, ahead, here, behind, behind2] = [0, 1, 2, 3, 4].map(at);
            self.v[j] = (8.0 * (ahead - behind) - (ahead2 - behind2)) / (12.0 * self.dt);
            let near = (ahead - here) - (here - behind);
            let far = (ahead2 - here) - (here - behind2);
            self.a[j] = (16.0 * near - far) / (12.0 * self.dt * self.dt);
        }
        let sample = CausalSample {
            motion: MotionSample {
                weight: &self.weight,
                rests: &self.rests,
                t,
                q: &self.ring[middle..middle + n],
                v: &self.v,
                a: &self.a,
                tau: &self.ring[middle + n..middle + 2 * n],
                tau_beside: [&self.ring[middle + n..middle + 2 * n]; 2],
            },
            begins: self.count == self.settle + 1,
        };
        out(self.dt, &sample);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(rows: usize) -> Block {
        let mut block = Block::default();
        for k in 0..rows {
            let t = k as f64 * 1e-3;
            let x = std::f64::consts::TAU * t;
            block.t.push(t);
            block.q.extend([0.5 * x.sin(), 0.1 * (3.0 * x).cos()]);
            block.tau.extend([0.5 * x.sin(), 0.1 * (3.0 * x).cos()]);
        }
        block
    }

    #[test]
    fn torques_are_late_as_positions_are_and_derivatives_are_those_of_a_sine() {
        let settings = FilterSettings::default();
        let mut motion = CausalMotion::new(2, &settings).unwrap();
        let mut rows = Vec::new();
        let mut take = |_: f64, s: &CausalSample| {
            assert_eq!(s.begins, rows.is_empty());
            let m = &s.motion;
            rows.push([m.t, m.q[0], m.v[0], m.a[0], m.q[1], m.tau[1]]);
        };
        motion.push(&sine(3000), true, &mut take).unwrap();
        let late = motion.delay_s().unwrap();
        assert!((0.007..0.012).contains(&late), "{late}");
        let w = std::f64::consts::TAU;
        for [t, q, v, a, q2, tau2] in rows {
            let t = t - late;
            if t < 0.5 {
                continue;
            }
            assert!((q - 0.5 * (w * t).sin()).abs() < 1e-4, "{t} {q}");
            assert!((v - 0.5 * w * (w * t).cos()).abs() < 1e-3, "{t} {v}");
            assert!((a + 0.5 * w * w * (w * t).sin()).abs() < 1e-2, "{t} {a}");
            assert_eq!(q2, tau2);
        }
    }

    #[test]
    fn rows_one_by_one_and_all_at_once_give_the_same_samples() {
        let whole = sine(1200);
        let run = |sizes: usize| {
            let mut motion = CausalMotion::new(2, &FilterSettings::default()).unwrap();
            let mut out = Vec::new();
            let mut block = Block::default();
            for k in 0..whole.t.len() {
                // a gap, behind which filters begin anew
                let t = whole.t[k] + if k > 700 { 1.0 } else { 0.0 };
                block.t.push(t);
                block.q.extend_from_slice(&whole.q[2 * k..2 * k + 2]);
                block.tau.extend_from_slice(&whole.tau[2 * k..2 * k + 2]);
                let last = k + 1 == whole.t.len();
                if block.t.len() == sizes || last {
                    let mut take = |_: f64, s: &CausalSample| {
                        out.push((s.motion.t, s.motion.v[0], s.motion.tau[1], s.begins));
                    };
                    motion.push(&block, last, &mut take).unwrap();
                    block.clear();
                }
            }
            out
        };
        let one = run(1);
        assert_eq!(one, run(1200));
        assert_eq!(one.iter().filter(|row| row.3).count(), 2);
    }
}
