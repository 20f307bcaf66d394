//! `elasticity`: a spring between motor, where the encoder sits, and link. The deflection z, motor less
//! link, is an oscillator that the load torque drives,
//! d2z/dt2 + 2 damping w dz/dt + w^2 z = tau_l/M_jj, w = 2 pi frequency, and the link's inertia feels that
//! much less acceleration: -inertia d2z/dt2 is added. The stiffness is inertia w^2. Far below w this is
//! the second derivative of the torque, -(inertia/w^2) d2(tau_l/M_jj)/dt2, the first term of the flexible
//! joint's expansion (Spong 1987).

use nalgebra::Matrix4;

use super::{
    EffectReparametrisation, EffectScene, Entry, Family, Key, KeyValue, Law, Limit, LimitedNumber,
    Rule, ShapeSearch, ShapeSpan, Unit, exact,
};

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
    search: ShapeSearch::Refined,
    must: &[
        Rule::not_negative("inertia", "a body behind a spring has mass"),
        Rule::not_negative("stiffness", "a spring pushes back"),
        Rule::at_most(
            LimitedNumber::Key("damping"),
            Limit::Is(0.5),
            "a gear, belt or shaft rings: its damping ratio is below 0.5",
        ),
        Rule::at_least(
            LimitedNumber::Ratio("stiffness", "inertia"),
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
    limits: |cover, _, _| {
        let frequency = ShapeSpan::of(0.1 * cover.cutoff_hz, highest(cover.dt));
        vec![frequency, ShapeSpan::of(1e-3, 1.0).open_below()]
    },
    // stiffness = inertia (2 pi frequency)^2
    reparametrised: Some(EffectReparametrisation {
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
    // inertia, deflection, its rate, pull, and the eight shares of a step
    memory: Some(12),
    code: Some(|to| {
        let (q, load) = (to.q(), to.load());
        let own = to.remember("elastic", Some(OF_CODE), "0.0", &q);
        let rate = exact(std::f64::consts::TAU * to.shape[0]);
        to.step(format!(
            "{} * $elastic({rate}, {}, dt, {load}, &{own})",
            to.x(0),
            to.s(1)
        ));
        to.elastic();
    }),
    ..Law::linear(&ENTRY, &["inertia"], |at, kept, out| {
        let (w, damping) = (std::f64::consts::TAU * at.shape[0], at.shape[1]);
        let begins = kept[0].is_nan();
        let (state, step) = kept.split_at_mut(4);
        if begins {
            state[0] = inertia(at.scene, at.joint);
            step.copy_from_slice(step_of(w, damping, at.scene.stretch.dt).as_flattened());
        }
        let &mut [inertia, z, rate, before] = state else {
            return;
        };
        if inertia <= 0.0 {
            return;
        }
        let pull = at.load() / inertia;
        let z = match begins {
            // at rest on the spring
            true => [pull / (w * w), 0.0],
            false => next(step, [z, rate], before, pull),
        };
        state[1..].copy_from_slice(&[z[0], z[1], pull]);
        out[0] = -(pull - 2.0 * damping * w * z[1] - w * w * z[0]);
    })
};

/// Damping ratio to begin with.
const DAMPING: f64 = 0.05;

/// Highest frequency that samples `dt` apart still follow \[Hz\].
fn highest(dt: f64) -> f64 {
    0.2 / dt
}

/// Step of z'' + 2 d w z' + w^2 z = u for u that runs straight: shares of z, z', u before and after in z and in z'.
fn step_of(w: f64, damping: f64, dt: f64) -> [[f64; 4]; 2] {
    // states z, z', u, and du/dt of the step
    let mut rates = Matrix4::zeros();
    rates[(0, 1)] = 1.0;
    (rates[(1, 0)], rates[(1, 1)], rates[(1, 2)]) = (-w * w, -2.0 * damping * w, 1.0);
    rates[(2, 3)] = 1.0;
    let small = rates * (dt / 8.0);
    let (mut term, mut over) = (Matrix4::identity(), Matrix4::identity());
    for n in 1..=14 {
        term = term * small / f64::from(n);
        over += term;
    }
    for _ in 0..3 {
        over = over * over;
    }
    [0, 1].map(|i| {
        let slope = over[(i, 3)] / dt;
        [over[(i, 0)], over[(i, 1)], over[(i, 2)] - slope, slope]
    })
}

/// z and z' at the end of a step.
fn next(step: &[f64], z: [f64; 2], before: f64, after: f64) -> [f64; 2] {
    [0, 4].map(|i| step[i] * z[0] + step[i + 1] * z[1] + step[i + 2] * before + step[i + 3] * after)
}

/// M_jj in the middle of the stretch: the column of a unit acceleration less that of none.
pub(super) fn inertia(scene: &EffectScene, j: usize) -> f64 {
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

/// State in generated code: step, its eight factors, inertia, deflection, its rate, pull before, whether it has begun.
const OF_CODE: usize = 14;

#[cfg(test)]
mod tests {
    use super::{next, step_of};

    #[test]
    fn a_step_of_the_oscillator_is_that_of_its_closed_solution() {
        // pulled by a constant from rest: z = u/w^2 (1 - e^(-dwt) (cos pt + dw/p sin pt))
        let (w, d, dt, u) = (180.0, 0.07, 1e-3, 3.0);
        let step = step_of(w, d, dt);
        let mut z = [0.0, 0.0];
        for k in 1..=500 {
            z = next(step.as_flattened(), z, u, u);
            let t = f64::from(k) * dt;
            let p = w * (1.0f64 - d * d).sqrt();
            let swing = (p * t).cos() + d * w / p * (p * t).sin();
            let wanted = u / (w * w) * (1.0 - (-d * w * t).exp() * swing);
            assert!((z[0] - wanted).abs() < 1e-12 * u / (w * w) * 1e3, "{k}");
        }
    }
}
