//! Rows that lie evenly though their stamps do not: each gets the time of its place on an even clock.

/// An even clock, as stamps and positions show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvenSpacing {
    /// Time between two rows \[s\].
    pub step_s: f64,
    /// Time of the first row \[s\].
    pub first_s: f64,
    /// How much later than its place a stamp may be before a row is taken for lost \[steps\].
    pub late_steps: f64,
}

/// A stamp that is later than this share of a step has a lost row before it, where stamps jitter by less.
pub(crate) const LOST_FROM: f64 = 0.75;
/// Share of a stamp's lateness by which the clock follows it: the rate is known to some parts in 1e5.
const FOLLOWED: f64 = 1e-3;

/// Puts stamps onto an even clock, one after the other.
#[derive(Debug, Clone)]
pub(crate) struct EvenClock {
    even: EvenSpacing,
    last: Option<f64>,
}

impl EvenClock {
    pub(crate) fn new(even: EvenSpacing) -> Self {
        Self { even, last: None }
    }

    /// The time on the even clock of the row with the next stamp \[s\].
    pub(crate) fn take(&mut self, stamp: f64) -> f64 {
        if !stamp.is_finite() {
            return stamp;
        }
        let EvenSpacing {
            step_s,
            first_s,
            late_steps,
        } = self.even;
        let place = self.last.map_or(first_s, |last| last + step_s);
        let late = (stamp - place) / step_s;
        // stamps that are late by themselves make up their own share of it: no more rows are lost than what is left
        let own = late_steps - LOST_FROM;
        let lost = if late > late_steps {
            (late - own).round()
        } else {
            0.0
        };
        let follow = FOLLOWED / late_steps.max(1.0);
        let t = place + step_s * (lost + follow * (late - lost));
        self.last = Some(t);
        t
    }
}

/// Counts the rows of stamps that jitter, lost ones too, and finds the even clock that fits them best.
#[derive(Debug, Clone, Default)]
pub(crate) struct EvenFit {
    /// Step, and time of the last row's place \[s\]; followed, so that a first guess may be off.
    step: f64,
    last: f64,
    first: f64,
    /// Place of the last row, rows, and sums of places and times for a straight line.
    place: f64,
    pub(crate) rows: f64,
    sums: [f64; 4],
    /// Sum of squares by which stamps are off the places that those before them show \[s^2\].
    off: f64,
}

/// How fast place and step are followed: over some twenty rows.
const GAINS: [f64; 2] = [0.05, 1e-3];

impl EvenFit {
    /// Takes the next stamp; `step` is a first guess.
    pub(crate) fn take(&mut self, stamp: f64, step: f64) {
        if self.rows == 0.0 {
            (self.step, self.first, self.last) = (step, stamp, stamp);
        } else if self.step > 0.0 {
            let late = (stamp - self.last - self.step) / self.step;
            let lost = if late > LOST_FROM { late.round() } else { 0.0 };
            let rest = (late - lost) * self.step;
            self.last += (1.0 + lost) * self.step + GAINS[0] * rest;
            if lost == 0.0 {
                self.step += GAINS[1] * rest;
            }
            self.place += 1.0 + lost;
            self.off += rest * rest;
        }
        self.rows += 1.0;
        let (k, s) = (self.place, stamp - self.first);
        for (sum, x) in self.sums.iter_mut().zip([k, s, k * k, k * s]) {
            *sum += x;
        }
    }

    /// Whether no stamp is so late that a row may be lost before it.
    pub(crate) fn is_whole(&self) -> bool {
        self.place + 1.0 == self.rows
    }

    /// The clock, and the root mean square by which stamps are off it \[s\].
    pub(crate) fn clock(&self) -> Option<(EvenSpacing, f64)> {
        let n = self.rows;
        let [k, s, kk, ks] = self.sums.map(|sum| sum / n);
        let (kk, ks) = (kk - k * k, ks - k * s);
        if n < 3.0 || kk <= 0.0 {
            return None;
        }
        let step_s = ks / kk;
        let off = (self.off / n).sqrt();
        let even = EvenSpacing {
            step_s,
            first_s: self.first + s - step_s * k,
            late_steps: LOST_FROM,
        };
        (step_s > 0.0).then_some((even, off))
    }
}

/// The even clock of so many hertz for stamps that come in bursts or jitter, and how late they may be by that.
#[derive(Debug, Clone, Default)]
pub(crate) struct DeclaredEven {
    first: Option<f64>,
    rows: f64,
    /// Least and largest lateness of the rows of each window \[steps\], and of the one that is being filled.
    spreads: Vec<f64>,
    now: Option<[f64; 2]>,
    /// Middle of the first window \[steps\].
    middle: f64,
}

/// Rows of a window: longer than a burst.
const WINDOW: f64 = 100.0;
/// Windows that are kept.
const WINDOWS: usize = 1 << 14;

impl DeclaredEven {
    pub(crate) fn take(&mut self, stamp: f64, rate_hz: f64) {
        let first = *self.first.get_or_insert(stamp);
        let late = (stamp - first) * rate_hz - self.rows;
        let [low, high] = self.now.unwrap_or([late; 2]);
        let [low, high] = [low.min(late), high.max(late)];
        self.now = Some([low, high]);
        self.rows += 1.0;
        if self.rows <= WINDOW {
            self.middle = 0.5 * (low + high);
        }
        if self.rows % WINDOW == 0.0 && self.spreads.len() < WINDOWS {
            self.spreads.push(high - low);
            self.now = None;
        }
    }

    /// The clock, where there were rows.
    pub(crate) fn clock(mut self, rate_hz: f64) -> Option<EvenSpacing> {
        let rest = self.now.map(|[low, high]| high - low);
        self.spreads
            .extend(rest.filter(|_| self.spreads.is_empty()));
        self.spreads.sort_by(f64::total_cmp);
        let spread = *self.spreads.get(self.spreads.len() / 2)?;
        Some(EvenSpacing {
            step_s: 1.0 / rate_hz,
            first_s: self.first? + self.middle / rate_hz,
            // half of it early, half of it late, and as much as a lost row makes
            late_steps: 0.5 * spread + LOST_FROM,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: u32) -> f64 {
        f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5
    }

    #[test]
    fn stamps_that_jitter_lie_evenly_again_and_lost_rows_stay_lost() {
        let step = 0.01;
        let lost = |k: &u32| (400..403).contains(k) || *k == 1000;
        let places: Vec<u32> = (0..3000).filter(|k| !lost(k)).collect();
        let stamps: Vec<f64> = places
            .iter()
            .map(|k| 5.0 + step * f64::from(*k) + 0.4 * step * noise(*k))
            .collect();
        let mut fit = EvenFit::default();
        for stamp in &stamps {
            fit.take(*stamp, 0.0102);
        }
        let (even, off) = fit.clock().unwrap();
        assert!((even.step_s / step - 1.0).abs() < 1e-5, "{even:?}");
        assert!((0.0005..0.002).contains(&off), "{off}");
        let mut clock = EvenClock::new(even);
        for (k, stamp) in places.iter().zip(&stamps) {
            let t = clock.take(*stamp);
            assert!(
                (t - 5.0 - step * f64::from(*k)).abs() < 0.02 * step,
                "{k}: {t}"
            );
        }
    }

    #[test]
    fn bursts_lie_evenly_at_the_declared_rate_and_a_lost_burst_stays_lost() {
        let stamps: Vec<(u32, f64)> = (0..2000)
            .filter(|k| !(800..810).contains(k) && *k != 1504)
            .map(|k: u32| (k, 0.1 * f64::from(k / 10 + 1) + 1e-5 * f64::from(k % 10)))
            .collect();
        let mut declared = DeclaredEven::default();
        stamps
            .iter()
            .for_each(|(_, stamp)| declared.take(*stamp, 100.0));
        let mut clock = EvenClock::new(declared.clock(100.0).unwrap());
        let mut before = 0.0;
        for (k, stamp) in stamps {
            let t = clock.take(stamp);
            // a message that is lost within a burst shows with the next one
            let steps = match k {
                810 => 11.0,
                1510 => 2.0,
                _ => 1.0,
            };
            assert!(
                k == 0 || (t - before - 0.01 * steps).abs() < 0.001,
                "{k}: {}",
                t - before
            );
            before = t;
        }
    }
}
