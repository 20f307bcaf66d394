//! `elasticity`: a spring between motor, where the encoder sits, and link. The deflection z, motor less
//! link, is an oscillator that the load torque drives,
//! d2z/dt2 + 2 damping w dz/dt + w^2 z = tau_l/M_jj, w = 2 pi frequency, and the link's inertia feels that
//! much less acceleration: -inertia d2z/dt2 is added. The stiffness is inertia w^2. Far below w this is
//! the second derivative of the torque, -(inertia/w^2) d2(tau_l/M_jj)/dt2, the first term of the flexible
//! joint's expansion (Spong 1987).

use super::law_text::exact;
use nalgebra::Matrix4;

use super::entry::{Entry, Family, Key, Search};
use super::law::{KeyValue, Law, Memory, Reparametrisation};
use super::physics::{Limit, Number, Rule};
use super::scene::Scene;
use super::unit::Unit;

pub static ENTRY: Entry = Entry {
    name: "elasticity",
    families: &[Family::Timing],
    keys: &[
        Key::size("stiffness", Unit::Stiffness).above_zero("must be above 0"),
        Key::shape("inertia", Unit::Inertia).above_zero(
            "must be below the joint's, and leave the motor less than the joint's least",
        ),
        Key::shape("damping", Unit::One).within(0.0, f64::INFINITY, "must not be below 0"),
    ],
    search: Search::Refined,
    must: &[
        Rule::not_negative("inertia", "a body behind a spring has mass"),
        Rule::not_negative("stiffness", "a spring pushes back"),
        Rule::at_most(
            Number::Key("damping"),
            Limit::Is(0.5),
            "a gear, belt or shaft rings: its damping ratio is below 0.5",
        ),
        Rule::at_least(
            Number::Ratio("stiffness", "inertia"),
            Limit::MotionSquared(4.0),
            "its frequency lies within the motion's band, where a delay or a coupling does the same",
        ),
    ],
    separate_by: "log reversals with high jerk at two poses of different inertia (the ringing keeps its \
                  frequency at any speed)",
    formula: "a spring between motor and link of that inertia, four fifths of the joint's by \
                default; encoder and friction on the motor's side; damping ratio of the link on it",
    source: "harmonic drives, belts and long shafts (Spong 1987)",
    said: |f| format!("elastic drive of {}, {} stiff", f.at, f.size("stiffness")),
    remedy: "keep `cutoff_hz` and the motion below the resonance, or log positions on both sides of the gear",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["frequency", "damping"],
    starts: |cover, _| {
        let starts = [0.5, 1.0, 2.0, 4.0].map(|times| vec![times * cover.cutoff_hz, DAMPING]);
        let seen = starts.into_iter().filter(|s| s[0] < highest(cover.dt));
        Ok(seen.collect())
    },
    limits: |cover, _| vec![[0.1 * cover.cutoff_hz, highest(cover.dt)], [1e-3, 1.0]],
    // stiffness = inertia (2 pi frequency)^2
    reparametrised: Some(Reparametrisation {
        of_keys: |values| {
            let (stiffness, inertia) = (values.get("stiffness")?, values.get("inertia")?);
            let square = stiffness / inertia;
            if square.is_nan() || square <= 0.0 {
                return Err(values.unusable("stiffness", stiffness));
            }
            let frequency = square.sqrt() / std::f64::consts::TAU;
            Ok([vec![frequency, values.get("damping")?], vec![inertia]])
        },
        to_keys: |shape, linear| {
            let (frequency, inertia) = (shape[0], linear[0]);
            let square = (std::f64::consts::TAU * frequency).powi(2);
            let stiffness = square * inertia;
            vec![
                KeyValue {
                    key: "stiffness",
                    value: stiffness,
                    slopes: vec![2.0 * stiffness / frequency, 0.0, square],
                },
                KeyValue::plain("inertia", inertia, 2, 3),
                KeyValue::plain("damping", shape[1], 1, 3),
            ]
        },
    }),
    // the inertia is that of the first sample: later ones are not known yet
    memory: Some(Memory {
        size: 4,
        step: |scene, place, shape, _, kept, out| {
            let Some(j) = place.joint() else { return };
            let w = std::f64::consts::TAU * shape[0];
            let begins = kept[0].is_nan();
            if begins {
                kept[0] = inertia(scene, j);
            }
            if kept[0] <= 0.0 {
                return;
            }
            let pull = scene.load[j][0] / kept[0];
            let z = match begins {
                true => [pull / (w * w), 0.0],
                false => Oscillator::new(w, shape[1], scene.stretch.dt).next(
                    [kept[1], kept[2]],
                    kept[3],
                    pull,
                ),
            };
            kept[1..].copy_from_slice(&[z[0], z[1], pull]);
            out[0] = -(pull - 2.0 * shape[1] * w * z[1] - w * w * z[0]);
        },
    }),
    code: Some(|to| {
        let (q, load) = (to.q(), to.load());
        let own = to.remember("elastic", Some(OF_CODE), "0.0", &q);
        let rate = exact(std::f64::consts::TAU * to.shape()[0]);
        to.step(format!(
            "{} * $elastic({rate}, {}, dt, {load}, &{own})",
            to.x(0),
            to.s(1)
        ));
        to.elastic();
    }),
    ..Law::linear(&ENTRY, &["inertia"], |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let inertia = inertia(scene, j);
        if inertia <= 0.0 {
            return;
        }
        let w = std::f64::consts::TAU * shape[0];
        let step = Oscillator::new(w, shape[1], scene.stretch.dt);
        let pull = |k: usize| scene.load[j][k] / inertia;
        // at rest on the spring
        let mut z = [pull(0) / (w * w), 0.0];
        for (k, column) in out[0].iter_mut().enumerate() {
            if k > 0 {
                z = step.next(z, pull(k - 1), pull(k));
            }
            *column = -(pull(k) - 2.0 * shape[1] * w * z[1] - w * w * z[0]);
        }
    })
};

/// Damping ratio to begin with.
const DAMPING: f64 = 0.05;

/// Highest frequency that samples `dt` apart still follow \[Hz\].
fn highest(dt: f64) -> f64 {
    0.2 / dt
}

/// One step of z'' + 2 d w z' + w^2 z = u, exact for u that runs straight between samples.
struct Oscillator {
    /// Of z and z' on themselves.
    own: [[f64; 2]; 2],
    /// Of u before and after.
    pull: [[f64; 2]; 2],
}

impl Oscillator {
    /// For a step of `dt` seconds; the series of the exponential at an eighth of the step, squared thrice.
    fn new(w: f64, damping: f64, dt: f64) -> Self {
        // states z, z', u, and du/dt of the step
        let rates = Matrix4::new(
            0.0,
            1.0,
            0.0,
            0.0, //
            -w * w,
            -2.0 * damping * w,
            1.0,
            0.0, //
            0.0,
            0.0,
            0.0,
            1.0, //
            0.0,
            0.0,
            0.0,
            0.0,
        );
        let small = rates * (dt / 8.0);
        let (mut term, mut sum) = (Matrix4::identity(), Matrix4::identity());
        for n in 1..=14 {
            term = term * small / f64::from(n);
            sum += term;
        }
        let mut over = sum;
        for _ in 0..3 {
            over = over * over;
        }
        let own = [[over[(0, 0)], over[(0, 1)]], [over[(1, 0)], over[(1, 1)]]];
        let pull = [0, 1].map(|i| {
            let slope = over[(i, 3)] / dt;
            [over[(i, 2)] - slope, slope]
        });
        Oscillator { own, pull }
    }

    fn next(&self, z: [f64; 2], before: f64, after: f64) -> [f64; 2] {
        [0, 1].map(|i| {
            let (own, pull) = (self.own[i], self.pull[i]);
            own[0] * z[0] + own[1] * z[1] + pull[0] * before + pull[1] * after
        })
    }
}

/// M_jj in the middle of the stretch: the column of a unit acceleration less that of none.
fn inertia(scene: &Scene, j: usize) -> f64 {
    let n = scene.robot.joints();
    let p = scene.theta.len();
    let k = scene.len() / 2;
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    scene.stretch.at(k, &mut q, &mut v, &mut a);
    v.fill(0.0);
    a.fill(0.0);
    let mut y = vec![0.0; n * p];
    let mut torque = |a: &[f64]| {
        scene.robot.regressor(&q, &v, a, &mut y);
        let row = &y[j * p..(j + 1) * p];
        row.iter().zip(scene.theta).map(|(y, t)| y * t).sum::<f64>()
    };
    let rest = torque(&a);
    a[j] = 1.0;
    torque(&a) - rest
}

/// Length of its state in generated code: the step, its four and four factors, the inertia, deflection and its
/// rate, the pull before, and whether it has begun.
const OF_CODE: usize = 14;

#[cfg(test)]
mod tests {
    use super::Oscillator;

    #[test]
    fn a_step_of_the_oscillator_is_that_of_its_closed_solution() {
        // pulled by a constant from rest: z = u/w^2 (1 - e^(-dwt) (cos pt + dw/p sin pt))
        let (w, d, dt, u) = (180.0, 0.07, 1e-3, 3.0);
        let step = Oscillator::new(w, d, dt);
        let mut z = [0.0, 0.0];
        for k in 1..=500 {
            z = step.next(z, u, u);
            let t = f64::from(k) * dt;
            let p = w * (1.0f64 - d * d).sqrt();
            let swing = (p * t).cos() + d * w / p * (p * t).sin();
            let wanted = u / (w * w) * (1.0 - (-d * w * t).exp() * swing);
            assert!((z[0] - wanted).abs() < 1e-12 * u / (w * w) * 1e3, "{k}");
        }
    }
}
