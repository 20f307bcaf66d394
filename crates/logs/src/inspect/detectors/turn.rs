//! Positions that begin anew after their range: encoders of one turn, counters that overflow.

/// Share of the travel from which a step may go through the end of the range.
const LONG_STEP_SHARE: f64 = 0.5;
/// Long steps that are kept.
const MAX_LONG_STEPS: usize = 1024;
/// Usual steps that a range is longer than.
const MIN_STEPS_PER_RANGE: f64 = 16.0;
/// By how much the ranges by several steps may differ, as a share.
const RANGE_AGREEMENT: f64 = 0.02;
/// By how much a range may be off one that is usual, as a share.
const USUAL_RANGE_TOLERANCE: f64 = 0.02;

/// A step that is long against the travel so far.
#[derive(Debug, Clone, Copy)]
struct LongStep {
    t: f64,
    step: f64,
    /// What is left of the step when those before and after it are taken off on average.
    range: f64,
}

/// Finds the long steps of a position that begins anew after its range, row after row.
#[derive(Debug, Clone)]
pub(crate) struct TurnDetector {
    low: f64,
    high: f64,
    /// Position of the row before, and the step to it; NaN where there is none.
    last: Option<[f64; 2]>,
    /// The long step that waits for the next row.
    waiting: Option<LongStep>,
    long: Vec<LongStep>,
    full: bool,
}

impl Default for TurnDetector {
    fn default() -> Self {
        Self {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            last: None,
            waiting: None,
            long: Vec::new(),
            full: false,
        }
    }
}

/// A position that begins anew after its range, and how often it did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WrappedPosition {
    pub(crate) range: f64,
    pub(crate) times: u64,
    /// Times of the first and the last [s].
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl TurnDetector {
    #[inline]
    pub(crate) fn take(&mut self, t: f64, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
        let Some([last, before]) = self.last else {
            self.last = Some([value, f64::NAN]);
            return;
        };
        let step = value - last;
        if let Some(mut waiting) = self.waiting.take()
            && step.abs() < LONG_STEP_SHARE * waiting.step.abs()
        {
            waiting.range -= 0.5 * step;
            self.keep(waiting);
        }
        // A spike goes and comes back: the motion before a turn's end is no leap.
        let alone = before.abs() < LONG_STEP_SHARE * step.abs();
        if alone && step.abs() > LONG_STEP_SHARE * (self.high - self.low) {
            let range = step - 0.5 * before;
            self.waiting = Some(LongStep { t, step, range });
        }
        self.last = Some([value, step]);
    }

    #[cold]
    fn keep(&mut self, step: LongStep) {
        let least = LONG_STEP_SHARE * (self.high - self.low);
        if self.long.len() == MAX_LONG_STEPS {
            self.long.retain(|long| long.step.abs() > least);
            self.full |= self.long.len() == MAX_LONG_STEPS;
        }
        if !self.full {
            self.long.push(step);
        }
    }

    pub(crate) fn part(&mut self) {
        self.last = None;
        self.waiting = None;
    }

    /// The range, where the position goes through its end, by ranges that encoders have and a `usual` step from row to row.
    pub(crate) fn wrapped(&self, usual: &[f64], step: f64) -> Option<WrappedPosition> {
        // All long steps must show the same range, and everything must lie within it. One or two alone are believed
        // of a usual range only: a reference that was set anew leaps once, too.
        let travel = self.high - self.low;
        let mut long: Vec<&LongStep> = self.long.iter().collect();
        long.retain(|long| long.step.abs() > LONG_STEP_SHARE * travel);
        let (first, last) = (long.first()?, long.last()?);
        let mut ranges: Vec<f64> = long.iter().map(|long| long.range.abs()).collect();
        ranges.sort_by(f64::total_cmp);
        let median = ranges[ranges.len() / 2];
        let spread = ranges[ranges.len() - 1] - ranges[0];
        let near = |range: &&f64| (median / **range - 1.0).abs() < USUAL_RANGE_TOLERANCE;
        let known = usual.iter().find(near);
        let range = known.copied().unwrap_or(median);
        let fits = spread <= RANGE_AGREEMENT * median && travel <= (1.0 + RANGE_AGREEMENT) * range;
        let sure = known.is_some() || ranges.len() >= 3;
        // A joint at rest goes to and fro between two counts.
        (fits && sure && range > MIN_STEPS_PER_RANGE * step).then_some(WrappedPosition {
            range,
            times: ranges.len() as u64,
            from: first.t,
            to: last.t,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURN: [f64; 2] = [std::f64::consts::TAU, 360.0];

    fn watched(q: impl Fn(f64) -> f64) -> TurnDetector {
        let mut turns = TurnDetector::default();
        for k in 0..20_000 {
            let t = f64::from(k) * 1e-3;
            turns.take(t, q(t));
        }
        turns
    }

    #[test]
    fn a_position_that_begins_anew_is_known_by_its_range() {
        for range in [360.0, std::f64::consts::TAU, 4096.0, 1.3] {
            let motion = move |t: f64| range * (1.2 * t.sin() + 0.1 * t);
            let turns = watched(move |t| motion(t).rem_euclid(range) - 0.3 * range);
            let found = turns.wrapped(&TURN, 1e-3).unwrap();
            assert!((found.range / range - 1.0).abs() < 1e-3, "{found:?}");
            assert!(found.times > 5 && found.from > 0.0 && found.to > found.from);
        }
        // once through the end of a turn
        let once = watched(|t| (3.0 + 0.02 * t).rem_euclid(TURN[0]));
        assert_eq!(once.wrapped(&TURN, 1e-3), None);
        let once = watched(|t| (6.1 + 0.02 * t).rem_euclid(TURN[0]));
        assert_eq!(once.wrapped(&TURN, 1e-3).unwrap().times, 1);
    }

    #[test]
    fn leaps_of_other_sizes_and_plain_motions_do_not_begin_anew() {
        type Motion = fn(f64) -> f64;
        let motions: [(Motion, f64); 4] = [
            (|t| 3.0 * t.sin(), 1e-3),
            (|t| 0.1 * t.sin() + if t < 9.0 { 0.0 } else { 2.0 }, 1e-3),
            (|t| if t < 9.0 { 0.5 } else { 0.6 }, 1e-3),
            (|t| 1e-4 * f64::from((3.0 * t).sin() > 0.0), 1e-4),
        ];
        for (motion, step) in motions {
            assert_eq!(watched(motion).wrapped(&TURN, step), None);
        }
    }
}
