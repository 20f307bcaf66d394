//! One coordinate runs back and forth over its range at a ladder of speeds.
//!
//! What such a log must show is the friction curve: plateaus at speeds spread evenly in the logarithm,
//! each in both directions, and reversals that pass zero speed without a dwell, slowly next to slow
//! plateaus, so that even a slope of 200 s/m has many samples inside it. Fast strokes sweep the whole
//! range (there gravity and inertia show their dependence on position); slow strokes are inserted in
//! pairs behind them and take the time that is left.

use cft_ident_core::explain::ErrorText;
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::stroke::{PEAK, SpeedStroke, StrokeJunction};
use crate::simulate::SimulateError;
use crate::simulate::chance::{ChancePurpose, stream};

/// What the ladder has to do.
#[derive(Debug, Clone, PartialEq)]
pub struct LadderPlan {
    /// Lower and upper end of the motion, m or rad.
    pub range: (f64, f64),
    /// Speeds of the plateaus, m/s or rad/s; each occurs in both directions.
    pub speeds: Vec<f64>,
    /// Largest acceleration, m/s^2 or rad/s^2.
    pub acceleration: f64,
    /// Time from zero speed to the plateau where the acceleration does not need more \[s\].
    pub turn: f64,
    /// Duration of the whole motion \[s\].
    pub seconds: f64,
}

/// The motion: strokes between turning points, in time order.
#[derive(Debug, Clone, PartialEq)]
pub struct LadderReference {
    strokes: Vec<SpeedStroke>,
    end: f64,
    seconds: f64,
}

/// A sweep must have at least this share of the range at its plateau speed.
const PLATEAU_SHARE: f64 = 0.25;
/// Share of the range by which a motion may pass its ends: half of what usual ranges leave to the limits.
const BEYOND_RANGE_SHARE: f64 = 0.02;
/// Speeds of the usual ladder.
const SPEEDS: usize = 10;
/// Time from zero speed to a slow plateau of the usual ladder \[s\].
pub const TURN: f64 = 0.3;
/// Duration of one pass through all speeds, the longest \[s\].
const PASS: f64 = 20.0;

/// A plateau in the order of the motion: its speed, and whether it goes to the end of the range.
#[derive(Debug, Clone, Copy)]
struct LadderRung {
    speed: f64,
    sweeps: bool,
}

impl LadderPlan {
    /// Speeds in equal ratios from `top` down to `lowest`, where `top` is lowered as far as the range
    /// demands at the given acceleration.
    pub fn geometric(
        range: (f64, f64),
        lowest: f64,
        top: f64,
        count: usize,
        acceleration: f64,
    ) -> Vec<f64> {
        let top = top.min(Self::fastest(range, acceleration)).max(lowest);
        let steps = count.max(2) - 1;
        let speed = |k| top * (lowest / top).powf(k as f64 / steps as f64);
        (0..=steps).map(speed).collect()
    }

    /// Largest plateau speed whose ramps leave [`PLATEAU_SHARE`] of the range.
    pub(crate) fn fastest((low, high): (f64, f64), acceleration: f64) -> f64 {
        let ramps = 2.0 * PEAK * StrokeJunction::Turn.distance(1.0);
        ((1.0 - PLATEAU_SHARE) * (high - low) * acceleration / ramps).sqrt()
    }

    /// Ladder of ten speeds in equal ratios from `top` (as far as the range lets it) to `lowest`, or of as
    /// many as the time suffices for.
    pub fn usual(
        range: (f64, f64),
        (lowest, top): (f64, f64),
        acceleration: f64,
        seconds: f64,
        seed: Option<u64>,
    ) -> Result<LadderReference, SimulateError> {
        let build = |count: usize| {
            let plan = Self {
                range,
                speeds: Self::geometric(range, lowest, top, count, acceleration),
                acceleration,
                turn: TURN,
                seconds,
            };
            plan.build_seeded(seed)
        };
        let fewer = |outcome: Result<_, _>, count| outcome.or_else(|_| build(count));
        (2..SPEEDS).rev().fold(build(SPEEDS), fewer)
    }

    /// [`LadderPlan::build`] with the chance of a seed, or without.
    pub(crate) fn build_seeded(&self, seed: Option<u64>) -> Result<LadderReference, SimulateError> {
        let mut chance = seed.map(|seed| stream(seed, ChancePurpose::Reference));
        self.build(chance.as_mut())
    }

    /// The motion; `chance` shuffles the order of the strokes and the end at which it starts.
    ///
    /// # Errors
    /// [`SimulateError::Reference`] when the range is empty, a speed does not fit into it, or the time
    /// does not suffice for one pass.
    pub fn build(
        &self,
        mut chance: Option<&mut ChaCha8Rng>,
    ) -> Result<LadderReference, SimulateError> {
        self.check()?;
        let mut speeds = self.speeds.clone();
        speeds.sort_by(|a, b| b.total_cmp(a));
        let passes = (self.seconds / PASS).round().max(1.0) as usize;
        let pass = self.seconds / passes as f64;
        let sweeping = self.sweeping(&speeds, pass);
        let mut order = Vec::with_capacity(2 * speeds.len() * passes);
        let turned = chance.as_deref_mut().map(|chance| chance.random_bool(0.5));
        let mirrored = turned.unwrap_or(false);
        for _ in 0..passes {
            let (mut fast, mut slow) = (speeds[..sweeping].to_vec(), speeds[sweeping..].to_vec());
            if let Some(chance) = chance.as_deref_mut() {
                fast.shuffle(chance);
                slow.shuffle(chance);
            }
            interleave(&fast, &slow, &mut order);
        }
        // The plateau time of the slow strokes fills what the sweeps leave.
        let shortest = self.lay_out(&order, 0.0, mirrored);
        if shortest.end > self.seconds {
            let needed = shortest.end / passes as f64;
            let text = format!(
                "the ladder of {} speeds needs at least {needed:.1} s in each pass and has {pass:.1} s",
                speeds.len()
            );
            let remedy = "give more seconds, fewer speeds or a smaller range";
            return Err(SimulateError::reference(
                ErrorText::new(text).remedy(remedy),
            ));
        }
        let (mut low, mut high) = (0.0, self.seconds);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let long = self.lay_out(&order, middle, mirrored).end > self.seconds;
            *(if long { &mut high } else { &mut low }) = middle;
        }
        Ok(self.lay_out(&order, low, mirrored))
    }

    /// Refuses a motion whose reversals are so slow that they take it out of the range.
    pub(crate) fn within_range(
        &self,
        ladder: LadderReference,
    ) -> Result<LadderReference, SimulateError> {
        let (low, high) = self.range;
        // pairs of slow strokes between sweeps of two speeds do not end just where they began
        let hardly = BEYOND_RANGE_SHARE * (high - low);
        let leaves = |stroke: &&SpeedStroke| {
            let to = stroke.from + stroke.direction * stroke.length();
            !(low - hardly..=high + hardly).contains(&to)
        };
        let Some(stroke) = ladder.strokes.iter().find(leaves) else {
            return Ok(ladder);
        };
        let text = format!(
            "the stroke at {} with a turn of {} s is {:.4} long and leaves the range [{low}, {high}]",
            stroke.speed,
            self.turn,
            stroke.length()
        );
        let remedy = "give a shorter turn, a lower speed or a wider range";
        Err(SimulateError::reference(
            ErrorText::new(text).remedy(remedy),
        ))
    }

    fn check(&self) -> Result<(), SimulateError> {
        let reject = |what: String| Err(SimulateError::reference(what));
        let ((low, high), acceleration) = (self.range, self.acceleration);
        let (turn, seconds) = (self.turn, self.seconds);
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !(low.is_finite() && high.is_finite() && high > low) {
            return reject(format!("the range [{low}, {high}] of the ladder is empty"));
        }
        if ![acceleration, turn, seconds].into_iter().all(positive) {
            return reject(format!(
                "acceleration {acceleration}, turn time {turn} s and duration {seconds} s must be positive"
            ));
        }
        if self.speeds.is_empty() {
            let none = ErrorText::new("the ladder has no speeds");
            return Err(SimulateError::reference(none.remedy("give at least one")));
        }
        let fastest = Self::fastest(self.range, acceleration);
        let fits = |speed: f64| positive(speed) && speed <= fastest * (1.0 + 1e-9);
        match self.speeds.iter().find(|speed| !fits(**speed)) {
            None => Ok(()),
            Some(speed) => reject(format!(
                "the speed {speed} does not fit: over the range [{low}, {high}] at an acceleration of {acceleration} \
                 the ladder reaches {fastest:.4}"
            )),
        }
    }

    /// How many of the (descending) speeds sweep the whole range: as many as fit into half the time.
    fn sweeping(&self, speeds: &[f64], seconds: f64) -> usize {
        let range = self.range.1 - self.range.0;
        let mut spent = 0.0;
        let mut count = 0;
        for &speed in speeds {
            spent += 2.0 * (range / speed + speed / self.acceleration);
            if count > 0 && spent > 0.5 * seconds {
                break;
            }
            count += 1;
        }
        count
    }

    /// Acceleration where a stroke of one speed meets one of another.
    fn meeting(&self, before: f64, after: f64) -> f64 {
        (PEAK * before.max(after) / self.turn).min(self.acceleration)
    }

    /// The strokes in order, the slow ones with that time at their speed.
    fn lay_out(&self, order: &[LadderRung], plateau: f64, mirrored: bool) -> LadderReference {
        let (low, high) = self.range;
        let mut strokes = Vec::with_capacity(order.len());
        let (mut position, mut direction) = if mirrored { (high, -1.0) } else { (low, 1.0) };
        let mut start = 0.0;
        for (k, rung) in order.iter().enumerate() {
            let before = k.checked_sub(1).map(|k| order[k].speed);
            let after = order.get(k + 1).map(|r| r.speed);
            let ramp = |neighbour: Option<f64>| {
                let meeting = neighbour.map_or(StrokeJunction::Rest, |_| StrokeJunction::Turn);
                let acceleration = self.meeting(rung.speed, neighbour.unwrap_or(0.0));
                (meeting, PEAK * rung.speed / acceleration)
            };
            let mut stroke = SpeedStroke {
                start,
                from: position,
                direction,
                speed: rung.speed,
                rise: ramp(before),
                plateau,
                fall: ramp(after),
            };
            let room = match direction > 0.0 {
                true => high - position,
                false => position - low,
            };
            let longest = ((room - stroke.ramps()) / rung.speed).max(0.0);
            if rung.sweeps || plateau > longest {
                stroke.plateau = longest;
            }
            position += direction * stroke.length();
            start += stroke.duration();
            direction = -direction;
            strokes.push(stroke);
        }
        LadderReference {
            strokes,
            end: start,
            seconds: self.seconds,
        }
    }
}

/// Each fast speed sweeps there and back; the slow ones follow in pairs, spread evenly behind the sweeps.
fn interleave(fast: &[f64], slow: &[f64], order: &mut Vec<LadderRung>) {
    let slots = 2 * fast.len();
    let rung = |speed, sweeps| LadderRung { speed, sweeps };
    for slot in 0..slots {
        order.push(rung(fast[slot / 2], true));
        for &speed in &slow[slot * slow.len() / slots..(slot + 1) * slow.len() / slots] {
            order.extend([rung(speed, false); 2]);
        }
    }
}

impl LadderReference {
    /// Duration that was asked for \[s\]; after the last stroke the coordinate rests.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Plateau speeds with their durations \[s\], in time order; negative in the downward direction.
    pub fn plateaus(&self) -> impl Iterator<Item = (f64, f64)> {
        let each = self.strokes.iter();
        each.map(|s| (s.direction * s.speed, s.plateau))
    }

    /// Position and velocity at time t \[s\].
    pub fn at(&self, t: f64) -> (f64, f64) {
        let after = self.strokes.partition_point(|s| s.start <= t);
        let Some(stroke) = self.strokes.get(after.saturating_sub(1)) else {
            return (0.0, 0.0);
        };
        let elapsed = (t - stroke.start).clamp(0.0, stroke.duration());
        let (way, speed) = stroke.at(elapsed);
        (
            stroke.from + stroke.direction * way,
            stroke.direction * speed,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> LadderPlan {
        let range = (0.2, 0.7);
        LadderPlan {
            range,
            speeds: LadderPlan::geometric(range, 0.0015, 0.633, 10, 3.0),
            acceleration: 3.0,
            turn: 0.3,
            seconds: 20.0,
        }
    }

    #[test]
    fn ladder_fills_its_time_and_stays_inside_its_range() {
        for seed in 0..50 {
            let ladder = plan().build_seeded(Some(seed)).expect("feasible");
            assert!(ladder.end > 19.0 && ladder.end <= 20.0, "{}", ladder.end);
            for k in 0..=20_000 {
                let (x, v) = ladder.at(1e-3 * f64::from(k));
                assert!((0.2 - 1e-12..=0.7 + 1e-12).contains(&x), "{x}");
                assert!(v.abs() <= 0.633 + 1e-12);
            }
        }
    }

    #[test]
    fn every_speed_has_a_plateau_in_both_directions() {
        let ladder = plan().build(None).expect("feasible");
        for speed in plan().speeds {
            for sign in [1.0, -1.0] {
                let near = |v: f64| (v / (sign * speed) - 1.0).abs() < 1e-9;
                let own = ladder.plateaus().filter(|(v, _)| near(*v));
                let longest = own.fold(0.0, |longest, (_, seconds)| seconds.max(longest));
                assert!(longest > 0.15, "{} m/s: {longest} s", sign * speed);
            }
        }
    }

    #[test]
    fn velocity_is_the_derivative_and_acceleration_is_bounded() {
        let ladder = plan().build(None).expect("feasible");
        let h = 1e-5;
        for k in 1..19_999 {
            let t = 1e-3 * f64::from(k);
            let [(x0, v0), (_, v), (x1, v1)] = [t - h, t, t + h].map(|t| ladder.at(t));
            assert!(((x1 - x0) / (2.0 * h) - v).abs() < 1e-6, "at {t} s");
            assert!((v1 - v0).abs() / (2.0 * h) < 3.0 + 1e-6, "at {t} s");
        }
    }

    #[test]
    fn reversals_dwell_nowhere_but_pass_zero_slowly_enough_for_the_steep_slope() {
        let ladder = plan().build(None).expect("feasible");
        let inside = (0..20_000).filter(|&k| {
            let v = ladder.at(1e-3 * f64::from(k)).1.abs();
            (0.5 / 200.0..2.0 / 200.0).contains(&v)
        });
        assert!(inside.count() > 2000);
        let still = |k: i32| ladder.at(1e-3 * f64::from(k)).1 == 0.0;
        assert!(!(1..19_000).any(|k| still(k) && still(k + 1)));
    }

    #[test]
    fn short_ladders_have_fewer_speeds_and_still_both_ends_of_the_range_of_speeds() {
        let usual = |seconds| LadderPlan::usual((0.2, 0.7), (0.0015, 0.633), 3.0, seconds, None);
        for seconds in [4.0, 6.0, 10.0, 15.0] {
            let ladder = usual(seconds).expect("fits");
            let end = ladder.end;
            assert!(end <= seconds && end > 0.9 * seconds, "{end}");
            let speeds = ladder.plateaus().map(|(v, _)| v.abs());
            let (low, high) = speeds.fold((f64::MAX, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
            assert!((low - 0.0015).abs() < 1e-12, "{low}");
            assert!((high - 0.633).abs() < 0.03, "{high}");
        }
        assert!(usual(1.0).is_err());
    }

    #[test]
    fn seeds_change_the_order_and_repeat_it_and_long_ladders_repeat_their_passes() {
        let build = |seed| plan().build_seeded(Some(seed)).expect("feasible");
        assert_eq!(build(3), build(3));
        assert_ne!(build(3), build(4));
        let mut long = plan();
        long.seconds = 100.0;
        let ladder = long.build(None).expect("feasible");
        assert!(ladder.strokes.len() == 100 && ladder.end > 95.0);
    }

    #[test]
    fn impossible_ladders_are_refused_with_the_way_out() {
        let refuse = |change: fn(&mut LadderPlan)| {
            let mut plan = plan();
            change(&mut plan);
            match plan.build(None).and_then(|built| plan.within_range(built)) {
                Err(SimulateError::Reference { what }) => what.to_string(),
                other => panic!("{other:?}"),
            }
        };
        assert!(refuse(|p| p.seconds = 1.0).contains("more seconds"));
        assert!(refuse(|p| p.speeds = vec![2.0]).contains("does not fit"));
        assert!(refuse(|p| p.range = (0.7, 0.2)).contains("empty"));
        assert!(refuse(|p| p.speeds.clear()).contains("at least one"));
        // 0.6 m/s that is reached within 1.5 s alone takes about a metre
        let slow = |p: &mut LadderPlan| (p.turn, p.speeds) = (1.5, vec![0.3, 0.6]);
        assert!(refuse(slow).contains("shorter turn"));
    }
}
