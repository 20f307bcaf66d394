//! Columns of laws against torques that are written out here: least squares beside the declared columns gives back
//! what was put in.

use nalgebra::{DMatrix, DVector};

use super::{EffectPlace, EffectScene, LAWS, Law, ModelEffect};
use crate::motion::Stretch;
use crate::robot::double_pendulum::double_pendulum;
use crate::robot::friction::ViscousCoulomb;
use crate::robot::model::JointFriction;
use crate::robot::{JointKind, Robot};

const DT: f64 = 0.002;
const ROWS: usize = 10_000;
const INERTIA: f64 = 0.032;
const FRICTION: ViscousCoulomb = ViscousCoulomb {
    viscous: 0.25,
    coulomb: 0.5,
};

/// One joint of two, whose motions are sums of waves of other periods.
struct TwoJointBench {
    robot: Robot,
    stretch: Stretch,
    load: Vec<Vec<f64>>,
    hat: Vec<Vec<f64>>,
}

fn motion(waves: &[[f64; 2]]) -> [Vec<f64>; 3] {
    let at = |t: f64| {
        waves.iter().fold([0.0; 3], |[q, v, a], [size, w]| {
            let (sin, cos) = (w * t + size).sin_cos();
            [q + size * sin, v + size * w * cos, a - size * w * w * sin]
        })
    };
    let rows: Vec<[f64; 3]> = (0..ROWS).map(|k| at(DT * k as f64)).collect();
    [0, 1, 2].map(|i| rows.iter().map(|row| row[i]).collect())
}

impl TwoJointBench {
    fn new() -> Self {
        let own = motion(&[[0.5, 1.7], [0.2, 4.1], [0.05, 9.3]]);
        let other = motion(&[[0.6, 1.1], [0.15, 5.3]]);
        let both = |i: usize| vec![own[i].clone(), other[i].clone()];
        let load: Vec<f64> = own[2].iter().map(|a| INERTIA * a).collect();
        let law = |v: &f64| FRICTION.viscous * v + FRICTION.coulomb * v.signum();
        let hat = load.iter().zip(&own[1]).map(|(load, v)| load + law(v));
        let hat: Vec<f64> = hat.collect();
        Self {
            robot: double_pendulum([0.0; 3], false),
            stretch: Stretch {
                dt: DT,
                t: (0..ROWS).map(|k| DT * k as f64).collect(),
                q: both(0),
                v: both(1),
                a: both(2),
                tau: vec![hat.clone(), vec![0.0; ROWS]],
                ..Stretch::default()
            },
            load: vec![load, vec![0.0; ROWS]],
            hat: vec![hat, vec![0.0; ROWS]],
        }
    }

    /// Coefficients of a law in a shape, where `added` is what it adds at each sample; and the part of the squares left.
    fn found(
        &self,
        (name, place): (&str, EffectPlace),
        shape: &[f64],
        added: &[f64],
    ) -> (Vec<f64>, f64) {
        let law: &'static Law = LAWS.iter().find(|law| law.entry.name == name).unwrap();
        let laws = [JointFriction::ViscousCoulomb(FRICTION); 2];
        let nothing = vec![Vec::new(); 2];
        let scene = EffectScene {
            robot: &self.robot,
            theta: &[INERTIA],
            laws: &laws,
            stretch: &self.stretch,
            hat: &self.hat,
            load: &self.load,
            direction: &nothing,
            tilt: None,
        };
        let effect = ModelEffect::new(law, place, shape.to_vec(), vec![1.0; law.linear.len()]);
        let mut columns = effect.columns(&scene, 0);
        let own = columns.len();
        let v = &self.stretch.v[0];
        columns.extend([
            self.stretch.a[0].clone(),
            v.clone(),
            v.iter().map(|v| v.signum()).collect(),
            vec![1.0; ROWS],
        ]);
        let columns: Vec<DVector<f64>> = columns.into_iter().map(DVector::from_vec).collect();
        let matrix = DMatrix::from_columns(&columns);
        let torque = added.iter().zip(&self.hat[0]).map(|(x, y)| x + y);
        let torque = DVector::from_iterator(ROWS, torque);
        let x = matrix
            .clone()
            .svd(true, true)
            .solve(&torque, 1e-12)
            .unwrap();
        let left = (&torque - matrix * &x).norm() / DVector::from_column_slice(added).norm();
        (x.as_slice()[..own].to_vec(), left)
    }

    fn each(&self, torque: impl FnMut(usize) -> f64) -> Vec<f64> {
        (0..ROWS).map(torque).collect()
    }
}

const ALONE: EffectPlace = EffectPlace::Joint(0);
const WITH: EffectPlace = EffectPlace::Pair { on: 0, of: 1 };

fn assert_near(found: &[f64], wanted: &[f64], by: f64) {
    for (k, (x, wanted)) in found.iter().zip(wanted).enumerate() {
        assert!((x - wanted).abs() < by, "{k}: {found:?}");
    }
}

#[test]
fn each_of_the_frictions_of_a_coupling_is_told_from_the_other() {
    let b = TwoJointBench::new();
    let (v, w, a) = (&b.stretch.v[0], &b.stretch.v[1], &b.stretch.a[1]);
    for (planted, r) in [([0.4, 0.0, 0.1, 1.5], 1.0), ([0.2, 0.9, 0.0, 0.3], -1.0)] {
        let [viscous, coulomb, inertia, from] = planted;
        let torque = b.each(|k| {
            let beside = viscous * w[k] + from * w[k].signum() + inertia * a[k];
            r * beside + coulomb * (v[k] + r * w[k]).signum()
        });
        let (found, _) = b.found(("coupling", WITH), &[r], &torque);
        assert_near(&found, &planted, 1e-9);
    }
}

#[test]
fn drifts_and_gains_that_settle_are_told_by_their_time() {
    let b = TwoJointBench::new();
    let settled = |k: usize| 1.0 - (-DT * k as f64 / 6.0).exp();
    let drift = b.each(|k| 0.3 * settled(k));
    assert_near(
        &b.found(("settling-drift", ALONE), &[6.0], &drift).0,
        &[0.3],
        1e-9,
    );
    let gain = b.each(|k| -0.12 * settled(k) * b.hat[0][k]);
    assert_near(
        &b.found(("gain-change", ALONE), &[6.0, 1.0], &gain).0,
        &[-0.12],
        1e-9,
    );
    // another time leaves some of it
    assert!(b.found(("gain-change", ALONE), &[12.0, 1.0], &gain).1 > 0.02);
}

#[test]
fn a_gain_that_falls_with_the_current_is_told_from_one_that_falls_over_time() {
    let b = TwoJointBench::new();
    // a motor that gives less in proportion to what it gives: at its peak a tenth
    let acting = &b.hat[0];
    let peak = acting.iter().fold(0.0_f64, |top, x| top.max(x.abs()));
    let torque = b.each(|k| 0.1 * acting[k] * acting[k].abs() / peak);
    let (found, left) = b.found(("gain-change", ALONE), &[10.0 * peak, 2.0], &torque);
    let lost = found[0] * -(-0.1_f64).exp_m1();
    assert!(
        (lost / 0.1 - 1.0).abs() < 0.1 && left < 0.01,
        "{lost} {left}"
    );
    let over_time = b.found(("gain-change", ALONE), &[20.0, 1.0], &torque);
    assert!(over_time.1 > 5.0 * left, "{over_time:?}");
}

#[test]
fn ripple_in_proportion_to_the_torque_is_told_from_ripple_that_is_not() {
    let b = TwoJointBench::new();
    let q = &b.stretch.q[0];
    let torque = b.each(|k| b.hat[0][k] * 0.07 * (13.0 * q[k] + 0.6).sin());
    let wanted = [0.07 * 0.6_f64.cos(), 0.07 * 0.6_f64.sin()];
    assert_near(
        &b.found(("torque-ripple", ALONE), &[13.0], &torque).0,
        &wanted,
        1e-9,
    );
    assert!(b.found(("ripple", ALONE), &[13.0], &torque).1 > 0.5);
}

#[test]
fn friction_by_the_pose_of_another_joint_is_told_from_that_along_its_own_way() {
    let b = TwoJointBench::new();
    let (v, other) = (&b.stretch.v[0], &b.stretch.q[1]);
    let torque = b.each(|k| 0.2 * v[k].signum() * (other[k] - 0.5).cos());
    let wanted = [0.2 * 0.5_f64.sin(), 0.2 * 0.5_f64.cos()];
    assert_near(
        &b.found(("pose-friction", WITH), &[1.0], &torque).0,
        &wanted,
        1e-9,
    );
    assert!(b.found(("position-friction", ALONE), &[1.0], &torque).1 > 0.1);
}

#[test]
fn a_load_that_flies_across_its_play_is_found_with_its_inertia_and_the_width() {
    let b = TwoJointBench::new();
    let (q, v) = (&b.stretch.q[0], &b.stretch.v[0]);
    let (load, gap) = (0.02, 0.02);
    // by steps of a hundredth of a row: a load between two stiff, damped ends, integrated on its own
    let (stiffness, steps) = (load * 400.0_f64.powi(2), 100);
    let damping = 2.0 * 0.8 * (stiffness * load).sqrt();
    let h = DT / steps as f64;
    let side = b.stretch.a[0][0].signum();
    let (mut x, mut rate) = (q[0] - 0.5 * side * gap, v[0]);
    let torque = b.each(|k| {
        let next = (k + 1).min(ROWS - 1);
        let mut passed = 0.0;
        for i in 0..steps {
            let part = f64::from(i) / f64::from(steps);
            let motor = q[k] + part * (q[next] - q[k]);
            let speed = v[k] + part * (v[next] - v[k]);
            let off = motor - x;
            let within = off.clamp(-0.5 * gap, 0.5 * gap);
            let pull = stiffness * (off - within) + damping * (speed - rate);
            let push = match off - within {
                d if d > 0.0 => pull.max(0.0),
                d if d < 0.0 => pull.min(0.0),
                _ => 0.0,
            };
            rate += h * push / load;
            x += h * rate;
            passed += push / f64::from(steps);
        }
        passed - load * b.stretch.a[0][k]
    });
    // compared in the band that fits keep, some tens of hertz
    let smooth = |x: &[f64]| -> Vec<f64> {
        let half = 12;
        let mean = |k: usize| {
            let own = &x[k.saturating_sub(half)..(k + half + 1).min(x.len())];
            own.iter().sum::<f64>() / own.len() as f64
        };
        (0..x.len()).map(mean).collect()
    };
    let law: &'static Law = LAWS
        .iter()
        .find(|law| law.entry.name == "backlash-impact")
        .unwrap();
    let laws = [JointFriction::ViscousCoulomb(FRICTION); 2];
    let nothing = vec![Vec::new(); 2];
    let robot = Robot::single_joint("q1", JointKind::Revolute);
    let one = |channels: &Vec<Vec<f64>>| channels[..1].to_vec();
    let stretch = Stretch {
        dt: DT,
        t: b.stretch.t.clone(),
        q: one(&b.stretch.q),
        v: one(&b.stretch.v),
        a: one(&b.stretch.a),
        tau: one(&b.stretch.tau),
        ..Stretch::default()
    };
    let scene = EffectScene {
        robot: &robot,
        theta: &[INERTIA],
        laws: &laws,
        stretch: &stretch,
        hat: &b.hat,
        load: &b.load,
        direction: &nothing,
        tilt: None,
    };
    let wanted = smooth(&torque);
    let left = |gap: f64| {
        let effect = ModelEffect::new(law, ALONE, vec![gap], vec![1.0]);
        let column = smooth(&effect.columns(&scene, 0)[0]);
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let inertia = dot(&column, &wanted) / dot(&column, &column);
        let rest = dot(&wanted, &wanted) - inertia * dot(&column, &wanted);
        (rest / dot(&wanted, &wanted), inertia)
    };
    let widths = [0.005, 0.01, 0.015, 0.018, 0.02, 0.022, 0.025, 0.03];
    let best = widths
        .into_iter()
        .min_by(|a, b| left(*a).0.total_cmp(&left(*b).0));
    let all: Vec<_> = widths.iter().map(|gap| (gap, left(*gap))).collect();
    assert!((best.unwrap() - gap).abs() < 0.003, "{all:?}");
    let (rest, inertia) = left(best.unwrap());
    assert!((inertia / load - 1.0).abs() < 0.2 && rest < 0.3, "{all:?}");
}
