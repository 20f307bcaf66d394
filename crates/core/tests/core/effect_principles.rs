//! What holds for every effect of the catalogue: linear in its coefficients, the same sample by sample, the same after a
//! file, nothing on joints that it does not touch.

use std::collections::BTreeMap;

use cft_ident_core::effect::{
    AugmentedModel, EffectScene, ModelEffect, Role, SampledModel, read_as,
};

use crate::diagnosis_bench::DT;
use crate::effect_bench::machines;

const SECONDS: f64 = 4.0;

fn most(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |top, x| top.max(x.abs()))
}

/// Calls with every machine, its effects, and what each adds to each joint.
fn each(mut call: impl FnMut(&crate::effect_bench::Machine, &ModelEffect, &EffectScene)) {
    for machine in machines() {
        let stretch = machine.stretch(SECONDS);
        let plain = AugmentedModel::plain(machine.model.clone()).torques(&stretch);
        let scene = EffectScene {
            robot: &machine.model.robot,
            theta: &machine.model.theta,
            laws: &machine.model.friction,
            stretch: &stretch,
            hat: &plain.hat,
            load: &plain.load,
            direction: &plain.direction,
            tilt: Some(&plain.tilt),
        };
        for effect in machine.effects(&stretch) {
            call(&machine, &effect, &scene);
        }
    }
}

#[test]
fn an_effect_is_the_sum_of_its_columns_and_touches_no_other_joint() {
    let mut seen = 0;
    each(|machine, effect, scene| {
        let title = effect.title(scene.robot);
        let mut some = false;
        for j in 0..scene.robot.joints() {
            let mut torque = vec![f64::NAN; scene.len()];
            effect.torque(scene, j, &mut torque);
            let columns = effect.columns(scene, j);
            assert!(columns.iter().flatten().all(|x| x.is_finite()), "{title}");
            let touched = columns.iter().flatten().any(|x| *x != 0.0);
            assert!(
                !touched || effect.place.touches(j),
                "{} {title} {j}",
                machine.name
            );
            some |= touched;
            if effect.law.entry.role == Role::Shift {
                assert!(torque.iter().all(|x| *x == 0.0), "{title}");
                continue;
            }
            for k in 0..scene.len() {
                let sum: f64 = columns
                    .iter()
                    .zip(&effect.linear)
                    .map(|(x, c)| c * x[k])
                    .sum();
                assert!(
                    (torque[k] - sum).abs() <= 1e-12 * most(&torque).max(1e-9),
                    "{title}"
                );
            }
        }
        // a load behind a play flies only where its torque changes its sign
        let may_rest = effect.law.entry.role == Role::Shift || effect.name() == "backlash-impact";
        assert!(some || may_rest, "{} {title} does nothing", machine.name);
        seen += 1;
    });
    assert!(seen > 100, "{seen}");
}

#[test]
fn samples_that_come_one_by_one_give_the_torques_of_the_whole_log() {
    each(|machine, effect, scene| {
        let model = machine.with(effect);
        let whole = model.torques(scene.stretch).hat;
        let mut sampled = SampledModel::new(model, DT);
        sampled.begin();
        let n = scene.robot.joints();
        let mut tau = vec![0.0; n];
        for k in 0..scene.len() {
            let of = |x: &[Vec<f64>]| x.iter().map(|x| x[k]).collect::<Vec<f64>>();
            let s = scene.stretch;
            let since = s.began + s.dt * k as f64;
            sampled.torque(since, [&of(&s.q), &of(&s.v), &of(&s.a)], &mut tau);
            for (j, tau) in tau.iter().enumerate() {
                let off = (tau - whole[j][k]).abs();
                let size = most(&whole[j]).max(1.0);
                // a load behind a spring or a play has the inertia of a pose: the first here, and the middle one there
                let behind = ["elasticity", "backlash-impact"].contains(&effect.name());
                let pose = behind && scene.robot.joints() > 1;
                assert!(
                    off < 1e-10 * size || pose,
                    "{} {} {j} {k}: {off}",
                    machine.name,
                    effect.title(scene.robot)
                );
            }
        }
    });
}

#[test]
fn an_effect_that_is_written_by_its_keys_is_read_as_the_same() {
    each(|machine, effect, scene| {
        let robot = scene.robot;
        let title = effect.title(robot);
        let numbers = effect.numbers(robot, "Nm", None);
        let keys: BTreeMap<String, f64> =
            numbers.iter().map(|n| (n.key.clone(), n.value)).collect();
        let joint = effect.place.name(robot);
        let back = read_as(effect.law, robot, joint.as_deref(), &keys);
        let back = back.unwrap_or_else(|error| panic!("{} {title}: {error}", machine.name));
        assert_eq!(back.place, effect.place, "{title}");
        for (a, b) in [(&back.shape, &effect.shape), (&back.linear, &effect.linear)] {
            assert_eq!(a.len(), b.len());
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{title}: {a} {b}");
            }
        }
        // a key that is missing, or no number, is refused; one that may be left out is zero
        for number in &numbers {
            let mut without = keys.clone();
            without.remove(&number.key);
            if let Ok(back) = read_as(effect.law, robot, joint.as_deref(), &without) {
                let left = back.numbers(robot, "Nm", None);
                let value = left
                    .iter()
                    .find(|n| n.key == number.key)
                    .map_or(0.0, |n| n.value);
                assert!(
                    value == 0.0 || number.key == "both",
                    "{title} {}",
                    number.key
                );
            }
            let mut wrong = keys.clone();
            wrong.insert(number.key.clone(), f64::NAN);
            let refused = read_as(effect.law, robot, joint.as_deref(), &wrong).is_err();
            assert!(refused || number.key == "both", "{title} {}", number.key);
        }
    });
}

#[test]
fn deviations_of_the_keys_are_slopes_times_those_of_shape_and_coefficients() {
    each(|machine, effect, scene| {
        let count = effect.parameters();
        let value = |effect: &ModelEffect| -> Vec<f64> {
            let numbers = effect.numbers(scene.robot, "Nm", None);
            numbers.iter().map(|n| n.value).collect()
        };
        let at = value(effect);
        for i in 0..count {
            let mut covariance = vec![0.0; count * count];
            covariance[i * count + i] = 1.0;
            let moved = |by: f64| {
                let mut moved = effect.clone();
                match i.checked_sub(effect.shape.len()) {
                    Some(k) => moved.linear[k] += by,
                    None => moved.shape[i] += by,
                }
                value(&moved)
            };
            let here = effect
                .shape
                .iter()
                .chain(&effect.linear)
                .nth(i)
                .map_or(1.0, |x| x.abs());
            let by = 1e-4 * here.max(1e-3);
            let (more, less) = (moved(by), moved(-by));
            let numbers = effect.numbers(scene.robot, "Nm", Some(&covariance));
            for (k, number) in numbers.iter().enumerate() {
                let slope = ((more[k] - less[k]) / (2.0 * by)).abs();
                let std = number.std.unwrap_or(0.0);
                let size = slope.max(1e-6 * at[k].abs()).max(1e-9);
                assert!(
                    (std - slope).abs() < 1e-4 * size,
                    "{} {} {}: {std} {slope}",
                    machine.name,
                    effect.title(scene.robot),
                    number.key
                );
            }
        }
    });
}
