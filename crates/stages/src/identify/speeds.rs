//! How fast the joints of a log move, by which a rest is distinguished from a slow motion.

use cft_ident_logs::log::{Block, Conversion};

/// Time over which a speed is formed [s]: long against the steps of an encoder, short against a motion.
const SPACING_S: f64 = 0.02;
/// Share of a time that is as good as all of it.
const ROUNDED: f64 = 0.999;
/// Speed up to which a joint rests, over its rms speed.
const RESTING: f64 = 0.01;

/// Root mean square of every joint's speed, from positions as logged.
pub(super) struct SpeedMeter {
    last: Option<f64>,
    before: Vec<f64>,
    now: Vec<f64>,
    squares: Vec<f64>,
    fastest: Vec<f64>,
    seconds: f64,
    bounds: Option<[f64; 2]>,
}

impl SpeedMeter {
    pub(super) fn new() -> Self {
        SpeedMeter {
            last: None,
            before: Vec::new(),
            now: Vec::new(),
            squares: Vec::new(),
            fastest: Vec::new(),
            seconds: 0.0,
            bounds: None,
        }
    }

    /// Takes a block of what was logged; `conversion` makes joint positions of it.
    pub(super) fn take(&mut self, block: &Block, conversion: Option<&Conversion>) {
        let n = block.joints();
        if n == 0 {
            return;
        }
        if let (Some(first), Some(last)) = (block.t.first(), block.t.last()) {
            self.bounds = Some([self.bounds.map_or(*first, |[first, _]| first), *last]);
        }
        self.squares.resize(n, 0.0);
        self.fastest.resize(n, 0.0);
        for (t, q) in block.t.iter().zip(block.q.chunks_exact(n)) {
            let step = self.last.map_or(f64::INFINITY, |last| t - last);
            // times are rounded, and otherwise where the clock's zero lies
            let short = ROUNDED * SPACING_S;
            // a step back is a fault of the clock, and another begin
            if (0.0..short).contains(&step) {
                continue;
            }
            self.now.clear();
            self.now.extend_from_slice(q);
            let known = match conversion {
                Some(conversion) => conversion.apply(&mut self.now, &mut [], &mut []),
                None => true,
            };
            let known = known && self.now.iter().all(|q| q.is_finite());
            if known && step.is_finite() && step > 0.0 {
                let moved = self.now.iter().zip(&self.before);
                let sums = self.squares.iter_mut().zip(&mut self.fastest);
                for ((now, before), (square, fastest)) in moved.zip(sums) {
                    *square += (now - before).powi(2) / step;
                    *fastest = fastest.max((now - before).abs() / step);
                }
                self.seconds += step;
            }
            self.last = known.then_some(*t);
            std::mem::swap(&mut self.now, &mut self.before);
        }
    }

    /// First and last time [s].
    pub(super) fn bounds(&self) -> [f64; 2] {
        self.bounds.unwrap_or_default()
    }

    /// Greatest speed of each joint [m/s or rad/s].
    pub(super) fn fastest(&self) -> Vec<f64> {
        self.fastest.clone()
    }

    /// Speed up to which each joint rests [m/s or rad/s].
    pub(super) fn resting(&self) -> Vec<f64> {
        let rms = |square: &f64| match self.seconds > 0.0 {
            true => (square / self.seconds).sqrt(),
            false => 0.0,
        };
        self.squares.iter().map(|s| RESTING * rms(s)).collect()
    }
}
