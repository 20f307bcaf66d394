//! One stroke between two turning points: a ramp up, a plateau, a ramp down, in closed form.

/// How a stroke's speed meets zero: at rest, or on its way to the next stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum StrokeJunction {
    /// v (10 x^3 - 15 x^4 + 6 x^5): no acceleration at zero speed.
    Rest,
    /// v (15 x - 10 x^3 + 3 x^5)/8: the acceleration is largest at zero speed and the next stroke
    /// starts with the same.
    Turn,
}

/// Peak slope of both ramps, in units of speed over ramp time.
pub(super) const PEAK: f64 = 1.875;

impl StrokeJunction {
    /// Speed at the fraction x of the ramp, over the plateau speed.
    pub(super) fn speed(self, x: f64) -> f64 {
        let x2 = x * x;
        match self {
            Self::Rest => x2 * x * (10.0 - 15.0 * x + 6.0 * x2),
            Self::Turn => x * (15.0 - 10.0 * x2 + 3.0 * x2 * x2) / 8.0,
        }
    }

    /// Distance at the fraction x of the ramp, over plateau speed times ramp time.
    pub(super) fn distance(self, x: f64) -> f64 {
        let x2 = x * x;
        match self {
            Self::Rest => x2 * x2 * (2.5 - 3.0 * x + x2),
            Self::Turn => x2 * (7.5 - 2.5 * x2 + 0.5 * x2 * x2) / 8.0,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct SpeedStroke {
    pub(super) start: f64,
    pub(super) from: f64,
    pub(super) direction: f64,
    pub(super) speed: f64,
    /// Way in: how it begins and how long the ramp takes.
    pub(super) rise: (StrokeJunction, f64),
    pub(super) plateau: f64,
    /// Way out, as the way in.
    pub(super) fall: (StrokeJunction, f64),
}

impl SpeedStroke {
    pub(super) fn ramps(&self) -> f64 {
        self.speed
            * (self.rise.0.distance(1.0) * self.rise.1 + self.fall.0.distance(1.0) * self.fall.1)
    }

    pub(super) fn duration(&self) -> f64 {
        self.rise.1 + self.plateau + self.fall.1
    }

    pub(super) fn length(&self) -> f64 {
        self.ramps() + self.speed * self.plateau
    }

    /// Way covered and speed at a time after the start.
    pub(super) fn at(&self, elapsed: f64) -> (f64, f64) {
        let (rise, rise_time) = self.rise;
        let (fall, fall_time) = self.fall;
        if elapsed < rise_time {
            let x = elapsed / rise_time;
            return (
                self.speed * rise_time * rise.distance(x),
                self.speed * rise.speed(x),
            );
        }
        if elapsed < rise_time + self.plateau {
            let way = rise_time * rise.distance(1.0) + elapsed - rise_time;
            return (self.speed * way, self.speed);
        }
        let x = ((self.duration() - elapsed) / fall_time).clamp(0.0, 1.0);
        (
            self.length() - self.speed * fall_time * fall.distance(x),
            self.speed * fall.speed(x),
        )
    }
}
