//! Noise-free motion gives back the parameters that made it.

use std::convert::Infallible;

use cft_ident_core::block::Block;
use cft_ident_core::math::rfactor::RFactor;
use cft_ident_core::motion::{self, FilterSettings, FilteredRow, MotionSample, TorqueTiming};

const INERTIA: f64 = 0.35;
const VISCOUS: f64 = 1.7;
const STIFFNESS: f64 = 12.0;

/// One joint `J a + B v + K q = tau`, torque held over each sample, integrated exactly but for
/// steps of `dt / 200` by a fourth-order method.
struct Joint {
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
}

fn acceleration(q: f64, v: f64, tau: f64) -> f64 {
    (tau - VISCOUS * v - STIFFNESS * q) / INERTIA
}

fn simulate(seconds: f64, dt: f64, held: bool) -> Joint {
    let samples = (seconds / dt) as usize;
    let command = |t: f64| {
        3.0 * (2.0 * t).sin()
            + 2.0 * (2.0 * std::f64::consts::PI * 1.3 * t).cos()
            + 4.0 * (2.0 * std::f64::consts::PI * 4.0 * t).sin()
    };
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    let (mut x, mut v) = (0.1, 0.0);
    let steps = 20;
    let h = dt / f64::from(steps);
    for k in 0..samples {
        let now = k as f64 * dt;
        t.push(now);
        q.push(x);
        tau.push(command(now));
        for i in 0..steps {
            let at = |part: f64| {
                if held {
                    command(now)
                } else {
                    command(now + (f64::from(i) + part) * h)
                }
            };
            let (v1, a1) = (v, acceleration(x, v, at(0.0)));
            let (v2, a2) = (
                v + 0.5 * h * a1,
                acceleration(x + 0.5 * h * v1, v + 0.5 * h * a1, at(0.5)),
            );
            let (v3, a3) = (
                v + 0.5 * h * a2,
                acceleration(x + 0.5 * h * v2, v + 0.5 * h * a2, at(0.5)),
            );
            let (v4, a4) = (v + h * a3, acceleration(x + h * v3, v + h * a3, at(1.0)));
            x += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
    }
    Joint { t, q, tau }
}

fn estimate(joint: &Joint, settings: &FilterSettings) -> [f64; 3] {
    let mut factor = RFactor::new(4);
    let mut read = false;
    motion::run::<Infallible>(
        &mut |block: &mut Block| {
            if !read {
                block.t.clone_from(&joint.t);
                block.q.clone_from(&joint.q);
                block.tau.clone_from(&joint.tau);
            }
            Ok(!std::mem::replace(&mut read, true))
        },
        1,
        settings,
        None,
        4,
        &|s: &MotionSample<'_>, y: &mut [f64]| {
            y.copy_from_slice(&[s.a[0], s.v[0], s.q[0], s.tau[0]])
        },
        &mut |row: &FilteredRow<'_>| factor.fold(row.filtered),
    )
    .expect("a log that can be filtered");
    let r = factor.r();
    let theta = r
        .view((0, 0), (3, 3))
        .solve_upper_triangular(&r.view((0, 3), (3, 1)))
        .expect("full rank");
    [
        theta[0] / INERTIA - 1.0,
        theta[1] / VISCOUS - 1.0,
        theta[2] / STIFFNESS - 1.0,
    ]
}

fn worst(errors: [f64; 3]) -> f64 {
    errors.iter().fold(0.0, |m: f64, e| m.max(e.abs()))
}

#[test]
fn torque_sampled_with_the_position_biases_nothing() {
    let joint = simulate(20.0, 1e-3, false);
    let errors = estimate(&joint, &FilterSettings::default());
    assert!(worst(errors) < 1e-6, "{errors:?}");
}

#[test]
fn torque_held_over_the_sample_biases_nothing() {
    let joint = simulate(20.0, 1e-3, true);
    let settings = FilterSettings {
        torque: TorqueTiming::ZeroOrderHold,
        ..FilterSettings::default()
    };
    let errors = estimate(&joint, &settings);
    assert!(worst(errors) < 1e-6, "{errors:?}");
    // Half a sample of delay is what the setting takes away.
    let errors = estimate(&joint, &FilterSettings::default());
    assert!(worst(errors) > 1e-3, "{errors:?}");
}
