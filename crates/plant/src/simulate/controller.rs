//! Cartesian controller of the report's section 4.2.1: proportional on each motor coordinate, with an
//! optional derivative part on the encoder signal.
//!
//! u_i = kp_i (x_d - x) + kd_i (v_d - v), where v is the encoder signal differenced over one sample and
//! passed through a first-order filter. The result is limited to the amplifiers' range and kept until
//! the next sample (zero-order hold).

use super::SimulateError;

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
        let usable = |x: f64| x >= 0.0 && x.is_finite();
        for &gain in &self.proportional {
            if !(usable(gain) && gain > 0.0) {
                return Err(SimulateError::Parameter {
                    name: "proportional gain kp",
                    value: gain,
                    rule: "must be above 0",
                });
            }
        }
        for &gain in &self.derivative {
            if !usable(gain) {
                return Err(SimulateError::Parameter {
                    name: "derivative gain kd",
                    value: gain,
                    rule: "must be 0 or more",
                });
            }
        }
        if !(usable(self.filter_hz) && self.filter_hz > 0.0) {
            return Err(SimulateError::Parameter {
                name: "corner frequency of the derivative",
                value: self.filter_hz,
                rule: "must be above 0 Hz",
            });
        }
        Ok(())
    }
}

/// The controller with its memory.
#[derive(Debug, Clone)]
pub struct Controller<const J: usize> {
    control: ControllerSettings<J>,
    last: Option<(f64, [f64; J])>,
    speed: [f64; J],
}

impl<const J: usize> Controller<J> {
    /// Controller before its first sample.
    pub fn new(control: ControllerSettings<J>) -> Self {
        Self {
            control,
            last: None,
            speed: [0.0; J],
        }
    }

    /// Volts, not yet limited, at time t for the measured coordinates x and the wanted position and
    /// velocity.
    pub fn volts(
        &mut self,
        t: f64,
        x: &[f64; J],
        position: &[f64; J],
        velocity: &[f64; J],
    ) -> [f64; J] {
        match self.last {
            // Nothing to difference yet: the robot is taken to move as wanted.
            None => self.speed = *velocity,
            Some((before, last)) => {
                let step = t - before;
                let share = -(-std::f64::consts::TAU * self.control.filter_hz * step).exp_m1();
                for i in 0..J {
                    self.speed[i] += share * ((x[i] - last[i]) / step - self.speed[i]);
                }
            }
        }
        self.last = Some((t, *x));
        std::array::from_fn(|i| {
            self.control.proportional[i] * (position[i] - x[i])
                + self.control.derivative[i] * (velocity[i] - self.speed[i])
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

    #[test]
    fn proportional_part_is_gain_times_error() {
        let mut controller = Controller::new(CONTROL);
        let u = controller.volts(0.0, &[0.1, 0.2], &[0.13, 0.2], &[0.0, 0.0]);
        assert!((u[0] - 3.0).abs() < 1e-12 && u[1] == 0.0);
    }

    #[test]
    fn derivative_part_settles_on_gain_times_speed_error() {
        let mut controller = Controller::new(CONTROL);
        let mut u = [0.0; 2];
        for k in 0..200 {
            let t = 1e-3 * f64::from(k);
            let x = [0.3 * t, 0.0];
            u = controller.volts(t, &x, &x, &[0.5, 0.0]);
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
