//! Dormand-Prince 5(4) with error control on a state of fixed size.
//!
//! Friction is stiff near zero speed: with slopes of 60 s/rad on an effective inertia of 0.1 kg m^2
//! the fastest mode decays within 0.2 ms. An explicit step that is too long does not blow up there,
//! because tanh saturates: it chatters silently. The step is therefore chosen by the embedded
//! fourth-order error estimate, with the proportional-integral rule that keeps steps smooth where
//! stability and not accuracy bounds them (Dormand and Prince 1980; Gustafsson 1991; Hairer,
//! Norsett and Wanner 1993, section II.4 and IV.2).
//!
//! Nothing is allocated. Held inputs change at every control sample, so [`DormandPrince::advance`] is
//! called from sample to sample: it starts afresh each time but keeps the step length that it learnt.

use super::SimulateError;

/// First-order differential equation with a state of N numbers.
pub trait OdeSystem<const N: usize> {
    /// Time derivative of the state at time `t` \[s\].
    fn rates(&self, t: f64, y: &[f64; N], dydt: &mut [f64; N]);

    /// Called after each accepted step: `true` where memory that it updates changes the rates at this very point.
    fn accepted(&mut self, _t: f64, _y: &[f64; N]) -> bool {
        false
    }
}

/// Tolerances of one step, the same for all components: error <= absolute + relative |y|.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepTolerance {
    /// In the unit of the component (m, rad, m/s, rad/s).
    pub absolute: f64,
    /// Fraction of the component.
    pub relative: f64,
}

impl Default for StepTolerance {
    /// Three orders below the encoders' resolution; halving it moves positions by less than 1e-10
    /// over 20 s (tests/simulate_integration.rs).
    fn default() -> Self {
        Self {
            absolute: 1e-8,
            relative: 1e-8,
        }
    }
}

impl StepTolerance {
    /// Both tolerances times `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            absolute: self.absolute * factor,
            relative: self.relative * factor,
        }
    }
}

/// The integrator: tolerances and the step length that it carries from call to call.
#[derive(Debug, Clone)]
pub struct DormandPrince {
    tolerance: StepTolerance,
    step: f64,
    previous_error: f64,
}

// Dormand-Prince coefficients: nodes, stage weights, the fifth-order solution (equal to the last
// stage, so that a step's last rates are the next step's first) and the error weights b5 - b4.
const C: [f64; 5] = [1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0];
const A2: [f64; 1] = [1.0 / 5.0];
const A3: [f64; 2] = [3.0 / 40.0, 9.0 / 40.0];
const A4: [f64; 3] = [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0];
const A5: [f64; 4] = [
    19372.0 / 6561.0,
    -25360.0 / 2187.0,
    64448.0 / 6561.0,
    -212.0 / 729.0,
];
const A6: [f64; 5] = [
    9017.0 / 3168.0,
    -355.0 / 33.0,
    46732.0 / 5247.0,
    49.0 / 176.0,
    -5103.0 / 18656.0,
];
const B: [f64; 6] = [
    35.0 / 384.0,
    0.0,
    500.0 / 1113.0,
    125.0 / 192.0,
    -2187.0 / 6784.0,
    11.0 / 84.0,
];
const ERROR: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

const SAFETY: f64 = 0.9;
const INTEGRAL: f64 = 0.04;
const PROPORTIONAL: f64 = 0.2 - 0.75 * INTEGRAL;
const SHRINK_AT_MOST: f64 = 0.2;
const GROW_AT_MOST: f64 = 5.0;
/// A step shorter than this fraction of the interval means a discontinuity or divergence.
const MIN_STEP_SHARE: f64 = 1e-9;
/// More trial steps than this within one interval mean the same.
const MOST_STEPS: u64 = 200_000;

impl DormandPrince {
    /// Integrator with the given tolerances; the first step length is found by trial.
    pub fn new(tolerance: StepTolerance) -> Self {
        Self {
            tolerance,
            step: f64::INFINITY,
            previous_error: 1e-4,
        }
    }

    /// Carries `y` from time `from` to time `to` \[s\].
    ///
    /// # Errors
    /// [`SimulateError::Diverged`] when no step is short enough, or 200 000 do not reach the end.
    pub fn advance<const N: usize, S: OdeSystem<N>>(
        &mut self,
        system: &mut S,
        from: f64,
        to: f64,
        y: &mut [f64; N],
    ) -> Result<(), SimulateError> {
        let mut k = [[0.0; N]; 7];
        let mut t = from;
        let span = to - from;
        let mut rates_known = false;
        let mut trials = 0;
        while t < to {
            if !rates_known {
                system.rates(t, y, &mut k[0]);
                rates_known = true;
            }
            // Equal steps up to the end of the interval waste less than one long and one short step.
            let remaining = to - t;
            let pieces = (remaining / self.step).ceil().max(1.0);
            let last = pieces <= 1.0;
            let h = if last { remaining } else { remaining / pieces };
            trials += 1;
            if h < MIN_STEP_SHARE * span || trials > MOST_STEPS {
                return Err(SimulateError::Diverged { t });
            }
            let (next, error) = self.attempt(system, t, h, y, &mut k);
            let error = error.max(1e-10);
            let shrink = error.powf(PROPORTIONAL);
            if error <= 1.0 {
                let factor = SAFETY * self.previous_error.powf(INTEGRAL) / shrink;
                self.step = h * factor.clamp(SHRINK_AT_MOST, GROW_AT_MOST);
                self.previous_error = error.max(1e-4);
                *y = next;
                t = if last { to } else { t + h };
                k[0] = k[6];
                rates_known = !system.accepted(t, y);
            } else {
                self.step = h * (SAFETY / shrink).max(SHRINK_AT_MOST);
            }
        }
        Ok(())
    }

    /// One trial step: the fifth-order solution and its error over the tolerance (root mean square).
    #[inline]
    fn attempt<const N: usize, S: OdeSystem<N>>(
        &self,
        system: &S,
        t: f64,
        h: f64,
        y: &[f64; N],
        k: &mut [[f64; N]; 7],
    ) -> ([f64; N], f64) {
        stage(system, t + C[0] * h, h, y, k, &A2);
        stage(system, t + C[1] * h, h, y, k, &A3);
        stage(system, t + C[2] * h, h, y, k, &A4);
        stage(system, t + C[3] * h, h, y, k, &A5);
        stage(system, t + C[4] * h, h, y, k, &A6);
        let next = stage(system, t + h, h, y, k, &B);
        let mut sum = 0.0;
        for i in 0..N {
            let mut e = 0.0;
            for (weight, rate) in ERROR.iter().zip(k.iter()) {
                e += weight * rate[i];
            }
            let allowed =
                self.tolerance.absolute + self.tolerance.relative * y[i].abs().max(next[i].abs());
            sum += (h * e / allowed).powi(2);
        }
        let error = (sum / N as f64).sqrt();
        // an error that is not a number is refused as any large one
        (next, if error.is_nan() { f64::INFINITY } else { error })
    }
}

/// State y + h sum(weights k) at the given node, with its rates stored behind the stages used.
#[inline(always)]
fn stage<const N: usize, const S: usize, T: OdeSystem<N>>(
    system: &T,
    t: f64,
    h: f64,
    y: &[f64; N],
    k: &mut [[f64; N]; 7],
    weights: &[f64; S],
) -> [f64; N] {
    let mut point = *y;
    for i in 0..N {
        let mut slope = 0.0;
        for (weight, rate) in weights.iter().zip(k.iter()) {
            slope += weight * rate[i];
        }
        point[i] += h * slope;
    }
    system.rates(t, &point, &mut k[S]);
    point
}

#[cfg(test)]
mod tests {
    use super::*;

    impl<const N: usize, F: Fn(&[f64; N]) -> [f64; N]> OdeSystem<N> for F {
        fn rates(&self, _t: f64, y: &[f64; N], dydt: &mut [f64; N]) {
            *dydt = self(y);
        }
    }

    fn oscillator(y: &[f64; 2]) -> [f64; 2] {
        [y[1], -y[0]]
    }

    /// Rate one, jumping to two once the memory says that y passed one half.
    struct Latch {
        passed: bool,
    }

    impl OdeSystem<1> for Latch {
        fn rates(&self, _t: f64, _y: &[f64; 1], dydt: &mut [f64; 1]) {
            dydt[0] = if self.passed { 2.0 } else { 1.0 };
        }

        fn accepted(&mut self, _t: f64, y: &[f64; 1]) -> bool {
            let passes = !self.passed && y[0] > 0.5;
            self.passed |= passes;
            passes
        }
    }

    fn oscillate(tolerance: StepTolerance) -> f64 {
        let mut integrator = DormandPrince::new(tolerance);
        let mut y = [1.0, 0.0];
        for k in 0..10 {
            let from = f64::from(k);
            let advanced = integrator.advance(&mut oscillator, from, from + 1.0, &mut y);
            advanced.expect("smooth");
        }
        (y[0] - 10f64.cos()).hypot(y[1] + 10f64.sin())
    }

    #[test]
    fn oscillator_error_follows_the_tolerance() {
        let loose = StepTolerance {
            absolute: 1e-6,
            relative: 0.0,
        };
        let (e_loose, e_tight) = (oscillate(loose), oscillate(loose.scaled(1e-4)));
        assert!(e_loose < 1e-5 && e_tight < 1e-9, "{e_loose} {e_tight}");
    }

    #[test]
    fn fifth_order_shows_when_the_step_is_halved() {
        let step = |h: f64| {
            let integrator = DormandPrince::new(StepTolerance::default());
            let mut k = [[0.0; 2]; 7];
            let y = [1.0, 0.0];
            k[0] = oscillator(&y);
            let (next, _) = integrator.attempt(&oscillator, 0.0, h, &y, &mut k);
            (next[0] - h.cos()).hypot(next[1] + h.sin())
        };
        let order = (step(0.2) / step(0.1)).log2();
        assert!((order - 6.0).abs() < 0.1, "local order {order}");
    }

    #[test]
    fn memory_that_changes_the_rates_is_seen_by_the_next_step() {
        let mut integrator = DormandPrince::new(StepTolerance::default());
        let mut latch = Latch { passed: false };
        let mut y = [0.0];
        for k in 0..10 {
            let t = 0.1 * f64::from(k);
            let advanced = integrator.advance(&mut latch, t, t + 0.1, &mut y);
            advanced.expect("bounded");
        }
        assert!(latch.passed && (y[0] - 1.4).abs() < 1e-9, "{}", y[0]);
    }

    #[test]
    fn finite_time_explosion_is_an_error_and_not_a_hang() {
        let mut integrator = DormandPrince::new(StepTolerance::default());
        let mut explosion = |y: &[f64; 1]| [y[0] * y[0]];
        let outcome = integrator.advance(&mut explosion, 0.0, 2.0, &mut [1.0]);
        let Err(SimulateError::Diverged { t }) = outcome else {
            panic!("{outcome:?}");
        };
        assert!((t - 1.0).abs() < 1e-6, "{t}");
    }
}
