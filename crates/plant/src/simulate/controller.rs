//! Cartesian controller of the report's section 4.2.1: proportional on each motor coordinate, with an
//! optional derivative part on the encoder signal.
//!
//! u_i = kp_i (x_d - x) + kd_i (v_d - v), where v is the encoder signal differenced over one sample and
//! passed through a first-order filter. The result is limited to the amplifiers' range and kept until
//! the next sample (zero-order hold).

use super::SimulateError;
use super::reference::Target;

/// Gains and limits of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerSettings<const J: usize> {
    /// Proportional gains, V/m or V/rad.
    pub proportional: [f64; J],
    /// Derivative gains, V s/m or V s/rad; all zero gives the report's P controller.
    pub derivative: [f64; J],
    /// Corner frequency of the derivative's filter \[Hz\].
    pub filter_hz: f64,
}

impl<const J: usize> ControllerSettings<J> {
    /// # Errors
    /// [`SimulateError::Parameter`] when a gain is negative or not finite, or all of kp are zero.
    pub fn check(&self) -> Result<(), SimulateError> {
        let above = |x: f64| x > 0.0 && x.is_finite();
        for gain in self.proportional {
            SimulateError::require(above(gain), "proportional gain kp", gain, "must be above 0")?;
        }
        for gain in self.derivative {
            let good = gain == 0.0 || above(gain);
            SimulateError::require(good, "derivative gain kd", gain, "must be 0 or more")?;
        }
        let (name, corner) = ("corner frequency of the derivative", self.filter_hz);
        SimulateError::require(above(corner), name, corner, "must be above 0 Hz")
    }
}

/// The last sample of the controller, and the filtered speeds; none before the first.
pub(super) type ControllerMemory<const J: usize> = Option<(f64, [f64; J], [f64; J])>;

impl<const J: usize> ControllerSettings<J> {
    /// Volts, not yet limited, at time t for the measured coordinates x and what is wanted.
    pub(super) fn volts(
        &self,
        memory: &mut ControllerMemory<J>,
        t: f64,
        x: &[f64; J],
        target: &Target<J>,
    ) -> [f64; J] {
        let (position, velocity) = (&target.position, &target.velocity);
        // Nothing to difference at first: the robot is taken to move as wanted.
        let mut speed = *velocity;
        if let Some((before, last, known)) = *memory {
            let step = t - before;
            let share = -(-std::f64::consts::TAU * self.filter_hz * step).exp_m1();
            speed =
                std::array::from_fn(|i| known[i] + share * ((x[i] - last[i]) / step - known[i]));
        }
        *memory = Some((t, *x, speed));
        std::array::from_fn(|i| {
            self.proportional[i] * (position[i] - x[i])
                + self.derivative[i] * (velocity[i] - speed[i])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTROL: ControllerSettings<2> = ControllerSettings {
        proportional: [100.0, 50.0],
        derivative: [2.0, 0.0],
        filter_hz: 100.0,
    };

    fn target(position: [f64; 2], velocity: [f64; 2]) -> Target<2> {
        Target { position, velocity }
    }

    #[test]
    fn proportional_part_is_gain_times_error() {
        let wanted = target([0.13, 0.2], [0.0; 2]);
        let u = CONTROL.volts(&mut None, 0.0, &[0.1, 0.2], &wanted);
        assert!((u[0] - 3.0).abs() < 1e-12 && u[1] == 0.0);
    }

    #[test]
    fn derivative_part_settles_on_gain_times_speed_error() {
        let (mut memory, mut u) = (None, [0.0; 2]);
        for k in 0..200 {
            let t = 1e-3 * f64::from(k);
            let x = [0.3 * t, 0.0];
            u = CONTROL.volts(&mut memory, t, &x, &target(x, [0.5, 0.0]));
        }
        assert!((u[0] - 2.0 * (0.5 - 0.3)).abs() < 1e-9, "{}", u[0]);
    }

    #[test]
    fn unusable_gains_are_refused() {
        let refuse = |change: fn(&mut ControllerSettings<2>)| {
            let mut control = CONTROL;
            change(&mut control);
            control.check().is_err()
        };
        assert!(CONTROL.check().is_ok());
        assert!(refuse(|c| c.proportional[1] = 0.0));
        assert!(refuse(|c| c.derivative[0] = f64::NAN));
        assert!(refuse(|c| c.filter_hz = -1.0));
    }
}
