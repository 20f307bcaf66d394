//! What a position cut-off costs the friction of a joint that reverses.
//!
//! Friction F(v) is steep where v changes sign. A narrow position filter rounds off the corner that v has there
//! (bias), a wide one passes the rounding of the encoder into v (errors in variables; Fuller, Measurement Error
//! Models, 1987). Both are seen in F(v) itself, without the measured torque: the first by a narrower filter, the
//! second by adding noise of the positions' own level (SIMEX: Cook and Stefanski, J. Am. Stat. Assoc. 89, 1994). What
//! the parallel filter leaves of either is what the rows hold.
//!
//! A corner of v is rounded off in proportion to the width of the filter's response, 1 / cut-off; of a friction that
//! turns more slowly the filter takes less, as a higher power of it. At 0.6 of the cut-off the change is 0.7 times
//! what the filter itself took for the first power and 1.8 times for the second: about the smear, in either case. The
//! same filter a second time would not show it, for its pass band is flat and its edge steep.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::added_noise::middle_roughness;
use super::position_filter::HIGHEST_SHARE;
use super::settings::{FilterDesign, FilterSettings};
use super::stretch::Stretch;
use super::{MotionError, rest};
use crate::math::zero_phase::run_each;
use crate::robot::friction::{DoubleTanh, sign};

/// Cut-offs that are tried, over that of the parallel filter; a lower one would take from the band that is kept.
const TRIED: [f64; 7] = [4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0];
/// Cut-off of the filter by which the smear is seen, over the one that is tried.
const NARROWER: f64 = 0.6;
/// Time constants of the position filter within which it has not settled.
const SETTLING_TIME_CONSTANTS: f64 = 10.0;

/// What a cut-off costs the friction of one joint: root mean squares over filtered rows in which it moves, in the
/// unit of the friction law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CutoffCost {
    /// \[Hz\]
    pub cutoff_hz: f64,
    /// By the reversals that the filter rounds off.
    pub smear: f64,
    /// By the noise of the positions that it lets through.
    pub noise: f64,
    /// Interval over which that noise is even, as the rounding of an encoder of such steps \[m or rad\].
    #[serde(default)]
    pub step: f64,
    /// Share of the mean square of the filtered acceleration that it makes.
    #[serde(default)]
    pub share: f64,
}

impl CutoffCost {
    /// Both together.
    pub fn total(&self) -> f64 {
        self.smear.hypot(self.noise)
    }
}

/// Cut-offs to try at a sampling rate \[Hz\], narrowest first, and a declared one among them.
pub fn candidates(settings: &FilterSettings, rate_hz: f64) -> Vec<f64> {
    let highest = HIGHEST_SHARE * rate_hz;
    let tried = TRIED.map(|share| share * settings.cutoff_hz);
    let mut found: Vec<f64> = tried.into_iter().filter(|hz| *hz < highest).collect();
    found.extend(settings.q_cutoff_hz);
    if found.is_empty() {
        found.push(highest);
    }
    found.sort_by(f64::total_cmp);
    found.dedup();
    found
}

/// The friction of a joint where it reverses; what is linear in the velocity counts for nothing.
#[derive(Debug, Clone, Copy)]
pub enum ReversalFriction {
    /// Coulomb friction of this level \[N or N m\].
    Jump(f64),
    Smooth(DoubleTanh),
}

impl ReversalFriction {
    #[inline]
    fn torque(&self, v: f64) -> f64 {
        match self {
            Self::Jump(level) => level * sign(v),
            Self::Smooth(law) => law.torque(v),
        }
    }
}

/// Squares of one joint under one cut-off.
#[derive(Debug, Clone, Copy, Default)]
struct CutoffSquares {
    /// By the narrower filter, which takes noise too.
    change: f64,
    noise: f64,
    /// Of the noise's interval, of the acceleration that it makes and of the whole.
    step: f64,
    shaken: f64,
    acceleration: f64,
    rows: usize,
}

/// Costs of cut-offs, summed over stretches of logs.
pub struct CutoffTrial<'a> {
    settings: &'a FilterSettings,
    cutoffs_hz: Vec<f64>,
    laws: Vec<ReversalFriction>,
    /// Speed up to which each joint rests [m/s or rad/s].
    rest_speed: &'a [f64],
    /// `[cut-off][joint]`
    squares: Vec<Vec<CutoffSquares>>,
}

impl<'a> CutoffTrial<'a> {
    /// Nothing yet.
    pub fn new(
        settings: &'a FilterSettings,
        cutoffs_hz: Vec<f64>,
        laws: Vec<ReversalFriction>,
        rest_speed: &'a [f64],
    ) -> Self {
        CutoffTrial {
            settings,
            squares: vec![vec![CutoffSquares::default(); laws.len()]; cutoffs_hz.len()],
            cutoffs_hz,
            laws,
            rest_speed,
        }
    }

    /// Adds a stretch whose positions came through no filter. One that is too short for the filters counts for
    /// nothing.
    ///
    /// # Errors
    /// [`MotionError`] for a cut-off that its sampling rate does not carry.
    pub fn add(&mut self, stretch: &Stretch) -> Result<(), MotionError> {
        let design = |cutoff: f64| {
            let settings = self.settings.with_one_position_filter(cutoff);
            FilterDesign::design(&settings, stretch.dt)
        };
        let pair = |hz: &f64| Ok([design(*hz)?, design(NARROWER * hz)?]);
        let designs = self.cutoffs_hz.iter().map(pair);
        let designs = designs.collect::<Result<Vec<_>, MotionError>>()?;
        let edge = designs.iter().flatten().filter_map(FilterDesign::unsettled);
        let edge = edge.max().unwrap_or(0);
        let kept = stretch.len().saturating_sub(2 * edge);
        // the edges of the stretch are left off already
        let shortest = |d: &FilterDesign| d.shortest - 2 * d.edge;
        if designs.iter().flatten().any(|d| kept < shortest(d)) {
            return Ok(());
        }
        let Some([first, _]) = designs.first() else {
            return Ok(());
        };
        let joints = JointsAbreast::new((&self.laws, self.rest_speed), stretch, edge);
        let moves = joints.moves(first)?;
        let of_design =
            |(design, sums): (_, &mut Vec<CutoffSquares>)| joints.add(design, &moves, sums);
        let pairs = designs.par_iter().zip(&mut self.squares);
        pairs.try_for_each(of_design)
    }

    /// The cut-off that costs each joint least \[Hz\]; `plain` where the logs determine none.
    pub fn chosen(&self, plain: f64) -> Vec<f64> {
        let hz = |costs: &Vec<CutoffCost>| least(costs).map_or(plain, |cost| cost.cutoff_hz);
        self.costs().iter().map(hz).collect()
    }

    /// What each cut-off costs each joint, `[joint][cut-off]`; nothing for a joint that never moves.
    pub fn costs(&self) -> Vec<Vec<CutoffCost>> {
        let cost = |(cutoff_hz, s): (&f64, &CutoffSquares)| CutoffCost {
            cutoff_hz: *cutoff_hz,
            smear: ((s.change - s.noise).max(0.0) / s.rows as f64).sqrt(),
            noise: (s.noise / s.rows as f64).sqrt(),
            step: (s.step / s.rows as f64).sqrt(),
            share: match s.acceleration > 0.0 {
                true => s.shaken / s.acceleration,
                false => 0.0,
            },
        };
        let of_joint = |j: usize| {
            let pairs = self.cutoffs_hz.iter().zip(&self.squares);
            let pairs = pairs.map(|(hz, squares)| (hz, &squares[j]));
            pairs.filter(|(_, s)| s.rows > 0).map(cost).collect()
        };
        (0..self.laws.len()).map(of_joint).collect()
    }
}

/// The cut-off that costs a joint least; none where the logs determine none.
pub fn least(costs: &[CutoffCost]) -> Option<CutoffCost> {
    let order = |a: &&CutoffCost, b: &&CutoffCost| a.total().total_cmp(&b.total());
    let found = costs.iter().min_by(order).copied();
    found.filter(|cost| cost.total() > 0.0)
}

/// Channels of each joint in the rows of a trial: what the narrower filter changes in its friction, what more noise
/// changes in it with either sign, the acceleration that the noise makes, and the whole acceleration.
const CHANNELS: usize = 5;

/// All joints of a stretch side by side, `samples x joints`: a filter takes as long for one as for all.
struct JointsAbreast<'a> {
    laws: &'a [ReversalFriction],
    rest_speed: &'a [f64],
    dt: f64,
    /// Samples at each end in which the narrowest filter has not settled.
    edge: usize,
    /// Positions through no filter.
    q: Vec<f64>,
    /// White noise of positions, even over an interval of 1.
    noise: Vec<f64>,
}

impl<'a> JointsAbreast<'a> {
    fn new(
        (laws, rest_speed): (&'a [ReversalFriction], &'a [f64]),
        stretch: &Stretch,
        edge: usize,
    ) -> Self {
        let (n, samples) = (laws.len(), stretch.len());
        let [mut q, mut noise] = [(); 2].map(|()| vec![0.0; n * samples]);
        for j in 0..n {
            let mut chance = ChaCha8Rng::seed_from_u64(j as u64);
            let rows = q.chunks_exact_mut(n).zip(noise.chunks_exact_mut(n));
            for ((q, noise), x) in rows.zip(&stretch.q[j]) {
                q[j] = *x;
                noise[j] = chance.random::<f64>() - 0.5;
            }
        }
        Self {
            laws,
            rest_speed,
            dt: stretch.dt,
            edge,
            q,
            noise,
        }
    }

    /// Velocity and acceleration of positions through the position filter of a design.
    fn motion(&self, design: &FilterDesign, q: &[f64]) -> Result<[Vec<f64>; 2], MotionError> {
        let n = self.laws.len();
        let mut q = q.to_vec();
        if let Some(filter) = &design.position {
            run_each(|j| filter.of(j), &mut q, n)?;
        }
        let [mut v, mut a] = [(); 2].map(|()| vec![0.0; q.len()]);
        (design.differences).apply(&q, n, self.dt, &mut v, &mut a);
        Ok([v, a])
    }

    /// Filtered rows of channels, without the edges; `fill` writes those of a sample.
    fn rows(
        &self,
        design: &FilterDesign,
        channels: usize,
        fill: impl Fn(usize, &mut [f64]),
    ) -> Result<Vec<f64>, MotionError> {
        let samples = self.q.len() / self.laws.len() - 2 * self.edge;
        let mut fill = |k: usize, row: &mut [f64]| fill(k + self.edge, row);
        design.run_rows([samples, channels], &mut fill)
    }

    /// Whether each joint moves in each row, row by row.
    fn moves(&self, design: &FilterDesign) -> Result<Vec<bool>, MotionError> {
        let n = self.laws.len();
        let [v, _] = self.motion(design, &self.q)?;
        let rows = self.rows(design, n, |k, row| {
            let speeds = v[k * n..].iter().zip(self.rest_speed);
            for (to, (v, rest_speed)) in row.iter_mut().zip(speeds) {
                *to = rest::movement(*v, *rest_speed);
            }
        })?;
        Ok(rows.iter().map(|m| !rest::rests(*m)).collect())
    }

    /// Level of each joint's noise by its acceleration, beside that of white noise of interval 1.
    fn noise_levels(&self, design: &FilterDesign, [a, noise]: [&[f64]; 2]) -> Vec<f64> {
        let n = self.laws.len();
        let level = |j: usize| {
            let lag = design.rough_lag(j, self.dt);
            let [a, noise] = [a, noise].map(|x| {
                let inner = &x[self.edge * n..x.len() - self.edge * n];
                let own: Vec<f64> = inner.iter().skip(j).step_by(n).copied().collect();
                middle_roughness(&own, lag)
            });
            let level = a / noise;
            if level.is_finite() { level } else { 0.0 }
        };
        (0..n).map(level).collect()
    }

    /// Adds what a cut-off costs each joint in the rows in which it moves.
    fn add(
        &self,
        [design, narrower]: &[FilterDesign; 2],
        moves: &[bool],
        sums: &mut [CutoffSquares],
    ) -> Result<(), MotionError> {
        let n = self.laws.len();
        let [v, a] = self.motion(design, &self.q)?;
        let mut again = v.clone();
        if let Some(filter) = &narrower.position {
            run_each(|j| filter.of(j), &mut again, n)?;
        }
        let [noise_v, noise_a] = self.motion(design, &self.noise)?;
        let levels = self.noise_levels(design, [&a, &noise_a]);
        let rows = self.rows(design, CHANNELS * n, |k, row| {
            for (j, to) in row.chunks_exact_mut(CHANNELS).enumerate() {
                let (i, law) = (k * n + j, &self.laws[j]);
                let shake = levels[j] * noise_v[i];
                let here = law.torque(v[i]);
                to.copy_from_slice(&[
                    here - law.torque(again[i]),
                    law.torque(v[i] + shake) - here,
                    law.torque(v[i] - shake) - here,
                    levels[j] * noise_a[i],
                    a[i],
                ]);
            }
        })?;
        for (row, moves) in rows.chunks_exact(CHANNELS * n).zip(moves.chunks_exact(n)) {
            let joints = row.chunks_exact(CHANNELS).zip(moves).enumerate();
            for (j, (row, _)) in joints.filter(|(_, (_, moves))| **moves) {
                let sum = &mut sums[j];
                sum.change += row[0].powi(2);
                sum.noise += 0.5 * (row[1].powi(2) + row[2].powi(2));
                sum.step += levels[j] * levels[j];
                sum.shaken += row[3].powi(2);
                sum.acceleration += row[4].powi(2);
                sum.rows += 1;
            }
        }
        Ok(())
    }
}

impl FilterDesign {
    /// Samples at a stretch's end in which the position filter has not settled.
    fn unsettled(&self) -> Option<usize> {
        let filter = self.position.as_ref()?;
        let settled = filter
            .narrowest()
            .sos()
            .settle_samples(SETTLING_TIME_CONSTANTS);
        Some(settled + self.differences.reach())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1e-3;
    const COUNT: f64 = 2e-5;
    const SLOPE: f64 = 60.0;

    /// A joint that swings to and fro in `period` seconds, slower to speed up than to slow down; and its encoder.
    fn swing(period: f64, amplitude: f64) -> [Vec<f64>; 3] {
        let samples = 40_000;
        let w = std::f64::consts::TAU / period;
        let (mut q, mut v) = (amplitude, 0.0);
        let mut out = [Vec::new(), Vec::new(), Vec::new()];
        for _ in 0..samples {
            out[0].push((q / COUNT).round() * COUNT);
            out[1].push(v);
            out[2].push(q);
            // ten steps a sample
            for _ in 0..10 {
                let a = -w * w * q - 0.3 * w * w * amplitude * (SLOPE * v).tanh()
                    + 0.5 * w * w * amplitude * (SLOPE * v).tanh() * f64::from(v * q < 0.0);
                v += 0.1 * DT * a;
                q += 0.1 * DT * v;
            }
        }
        out
    }

    fn costs(q: &[f64]) -> Vec<CutoffCost> {
        costs_of_each(&[q]).remove(0)
    }

    fn costs_of_each(q: &[&[f64]]) -> Vec<Vec<CutoffCost>> {
        let settings = FilterSettings::default();
        let friction = ReversalFriction::Smooth(DoubleTanh {
            viscous: 0.0,
            coulomb_1: 1.0,
            coulomb_2: 0.0,
            slope_1: SLOPE,
            slope_2: 1.0,
        });
        let tried = candidates(&settings, 1.0 / DT);
        let rest = vec![1e-3; q.len()];
        let mut trial = CutoffTrial::new(&settings, tried, vec![friction; q.len()], &rest);
        let stretch = Stretch {
            dt: DT,
            t: (0..q[0].len()).map(|k| k as f64 * DT).collect(),
            q: q.iter().map(|q| q.to_vec()).collect(),
            ..Stretch::default()
        };
        trial.add(&stretch).unwrap();
        trial.costs()
    }

    #[test]
    fn quick_reversals_call_for_a_wider_filter_than_slow_ones() {
        let [slow, _, _] = swing(6.0, 0.3);
        let [quick, _, _] = swing(1.2, 0.3);
        let (slow, quick) = (
            least(&costs(&slow)).unwrap(),
            least(&costs(&quick)).unwrap(),
        );
        assert!(
            quick.cutoff_hz > slow.cutoff_hz,
            "{quick:?} is not above {slow:?}"
        );
    }

    #[test]
    fn a_finer_encoder_lets_the_filter_be_wider_and_costs_less() {
        let [coarse, _, fine] = swing(2.0, 0.3);
        let (coarse, fine) = (
            least(&costs(&coarse)).unwrap(),
            least(&costs(&fine)).unwrap(),
        );
        assert!(fine.cutoff_hz > coarse.cutoff_hz, "{fine:?} {coarse:?}");
        assert!(fine.total() < 0.5 * coarse.total(), "{fine:?} {coarse:?}");
    }

    #[test]
    fn the_cut_off_found_is_as_good_as_the_best_one_along_the_true_motion() {
        for period in [1.2, 2.0, 6.0] {
            let [read, v, _] = swing(period, 0.3);
            let found = costs(&read);
            // what each cut-off really costs
            let true_cost = |cutoff: f64| -> f64 {
                let settings = FilterSettings {
                    q_cutoff_hz: Some(cutoff),
                    ..FilterSettings::default()
                };
                let t: Vec<f64> = (0..read.len()).map(|k| k as f64 * DT).collect();
                let smooth = crate::motion::full_rate(&t, &read, 1, &settings).unwrap();
                let f = |v: f64| (SLOPE * v).tanh();
                let off: Vec<f64> = (smooth.v.iter().zip(&v))
                    .map(|(s, v)| f(*s) - f(*v))
                    .collect();
                let parallel = FilterDesign::design(&settings, DT).unwrap();
                let rows = parallel.run(&[&off[500..off.len() - 500]]).unwrap();
                (rows[0].iter().map(|x| x * x).sum::<f64>() / rows[0].len() as f64).sqrt()
            };
            let chosen = true_cost(least(&found).unwrap().cutoff_hz);
            let each = found.iter().map(|c| true_cost(c.cutoff_hz));
            let least = each.fold(f64::INFINITY, f64::min);
            assert!(chosen < 1.6 * least, "{period}: {chosen} {least}");
        }
    }

    #[test]
    fn a_joint_beside_others_costs_what_it_costs_alone_and_one_at_rest_nothing() {
        let [slow, _, _] = swing(6.0, 0.3);
        let [quick, _, _] = swing(1.2, 0.3);
        let alone = costs(&slow);
        let still = vec![0.1; slow.len()];
        let all = costs_of_each(&[&slow, &quick, &still]);
        assert_eq!(all[0], alone);
        assert!(least(&all[1]).unwrap().cutoff_hz > least(&all[0]).unwrap().cutoff_hz);
        assert!(all[2].is_empty(), "{:?}", all[2]);
    }

    #[test]
    fn a_declared_cut_off_is_tried_beside_the_others() {
        let settings = FilterSettings {
            q_cutoff_hz: Some(63.0),
            ..FilterSettings::default()
        };
        let tried = candidates(&settings, 250.0);
        assert!(tried.contains(&63.0));
        assert!(tried.is_sorted());
        assert!(tried.iter().all(|hz| *hz < 100.0), "{tried:?}");
    }
}
