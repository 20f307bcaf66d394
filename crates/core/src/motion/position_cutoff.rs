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

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::added_noise::middle_roughness;
use super::position_filter::HIGHEST_SHARE;
use super::settings::{FilterDesign, FilterSettings};
use super::stretch::Stretch;
use super::{MotionError, rest};

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
    /// Friction of a joint at a velocity; only what is not linear in it counts.
    friction: &'a (dyn Fn(usize, f64) -> f64 + Sync),
    /// Speed up to which each joint rests [m/s or rad/s].
    rest_speed: &'a [f64],
    /// `[joint][cut-off]`
    squares: Vec<Vec<CutoffSquares>>,
}

impl<'a> CutoffTrial<'a> {
    /// Nothing yet.
    pub fn new(
        settings: &'a FilterSettings,
        cutoffs_hz: Vec<f64>,
        friction: &'a (dyn Fn(usize, f64) -> f64 + Sync),
        rest_speed: &'a [f64],
    ) -> Self {
        CutoffTrial {
            settings,
            squares: vec![vec![CutoffSquares::default(); cutoffs_hz.len()]; rest_speed.len()],
            cutoffs_hz,
            friction,
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
        let (friction, rest_speed) = (self.friction, self.rest_speed);
        self.squares
            .par_iter_mut()
            .enumerate()
            .try_for_each(|(joint, squares)| {
                let one = OneJoint {
                    joint,
                    stretch,
                    edge,
                    friction: &|v| friction(joint, v),
                    rest_speed: rest_speed[joint],
                };
                let Some([first, _]) = designs.first() else {
                    return Ok(());
                };
                let moves = one.moves(first)?;
                for (design, sum) in designs.iter().zip(squares) {
                    one.add(design, &moves, sum)?;
                }
                Ok(())
            })
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
        let of_joint = |squares: &Vec<CutoffSquares>| {
            let pairs = self.cutoffs_hz.iter().zip(squares);
            pairs.filter(|(_, s)| s.rows > 0).map(cost).collect()
        };
        self.squares.iter().map(of_joint).collect()
    }
}

/// The cut-off that costs a joint least; none where the logs determine none.
pub fn least(costs: &[CutoffCost]) -> Option<CutoffCost> {
    let order = |a: &&CutoffCost, b: &&CutoffCost| a.total().total_cmp(&b.total());
    let found = costs.iter().min_by(order).copied();
    found.filter(|cost| cost.total() > 0.0)
}

/// One joint of a stretch.
struct OneJoint<'a> {
    joint: usize,
    stretch: &'a Stretch,
    /// Samples at each end in which the narrowest filter has not settled.
    edge: usize,
    friction: &'a (dyn Fn(f64) -> f64 + Sync),
    rest_speed: f64,
}

impl OneJoint<'_> {
    fn inner<'x>(&self, channel: &'x [f64]) -> &'x [f64] {
        &channel[self.edge..channel.len() - self.edge]
    }

    /// Velocity and acceleration through the position filter of a design.
    fn smoothed(&self, design: &FilterDesign) -> Result<[Vec<f64>; 2], MotionError> {
        let q = self.stretch.q[self.joint].clone();
        let [_, v, a] = design.motion_of(self.joint, q, self.stretch.dt)?;
        Ok([v, a])
    }

    /// Whether the joint moves in each row.
    fn moves(&self, design: &FilterDesign) -> Result<Vec<bool>, MotionError> {
        let [v, _] = self.smoothed(design)?;
        let speeds = self.inner(&v).iter();
        let moving: Vec<f64> = speeds
            .map(|v| rest::movement(*v, self.rest_speed))
            .collect();
        let rows = design.run(&[&moving])?;
        Ok(rows[0].iter().map(|m| !rest::rests(*m)).collect())
    }

    fn add(
        &self,
        [design, narrower]: &[FilterDesign; 2],
        moves: &[bool],
        sum: &mut CutoffSquares,
    ) -> Result<(), MotionError> {
        let [v, a] = self.smoothed(design)?;
        let mut again = v.clone();
        if let Some(filter) = &narrower.position {
            filter.of(self.joint).run(&mut again, 1)?;
        }
        let mut chance = ChaCha8Rng::seed_from_u64(self.joint as u64);
        let [_, noise_v, noise_a] =
            design.motion_of_noise(self.joint, self.stretch, &mut chance)?;
        let lag = design.rough_lag(self.joint, self.stretch.dt);
        let level =
            middle_roughness(self.inner(&a), lag) / middle_roughness(self.inner(&noise_a), lag);
        let level = if level.is_finite() { level } else { 0.0 };
        let f = self.friction;
        let channel = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (self.edge..v.len() - self.edge).map(of).collect()
        };
        let here: Vec<f64> = v.iter().map(|v| f(*v)).collect();
        let smear = channel(&|k| here[k] - f(again[k]));
        let more = channel(&|k| f(v[k] + level * noise_v[k]) - here[k]);
        let less = channel(&|k| f(v[k] - level * noise_v[k]) - here[k]);
        let shaken = channel(&|k| level * noise_a[k]);
        let acceleration = channel(&|k| a[k]);
        let rows = design.run(&[&smear, &more, &less, &shaken, &acceleration])?;
        for (row, _) in moves.iter().enumerate().filter(|(_, moves)| **moves) {
            sum.change += rows[0][row].powi(2);
            sum.noise += 0.5 * (rows[1][row].powi(2) + rows[2][row].powi(2));
            sum.step += level * level;
            sum.shaken += rows[3][row].powi(2);
            sum.acceleration += rows[4][row].powi(2);
            sum.rows += 1;
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
        let settings = FilterSettings::default();
        let friction = |_: usize, v: f64| (SLOPE * v).tanh();
        let tried = candidates(&settings, 1.0 / DT);
        let mut trial = CutoffTrial::new(&settings, tried, &friction, &[1e-3]);
        let stretch = Stretch {
            dt: DT,
            t: (0..q.len()).map(|k| k as f64 * DT).collect(),
            q: vec![q.to_vec()],
            ..Stretch::default()
        };
        trial.add(&stretch).unwrap();
        trial.costs().remove(0)
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
