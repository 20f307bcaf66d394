//! A joint that rests for a part of the time: static friction takes any torque up to its Coulomb level, and says
//! nothing of Coulomb and viscous friction.

use cft_ident::config::RobotFile;
use cft_ident::identify::{
    Control, Dataset, FitNote, GivenModel, Log, LsqSettings, RobotSetup, StageNote,
    ValidateSettings, lsq, read_whole, validate,
};

const MASS: f64 = 12.0;
const VISCOUS: f64 = 30.0;
const COULOMB: f64 = 20.0;
const OFFSET: f64 = 4.0;

/// Uniform in 0..1.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Moves of 2 s of fifth order there and back, each followed by a rest of `rest` seconds with any torque
/// that static friction takes.
fn slide(name: &str, rest: f64, seed: u64) -> Log {
    let rate = 500.0;
    let mut chance = Chance(seed * 0x9e37_79b9 + 1);
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    let (mut now, mut at) = (0.0, 0.0);
    for k in 0..16 {
        let to: f64 = if k % 2 == 0 {
            0.1 + 0.3 * chance.next()
        } else {
            -0.05
        };
        let (travel, lasts) = (to - at, 1.2 + chance.next());
        let static_friction = COULOMB * (2.0 * chance.next() - 1.0);
        for i in 0..((lasts + rest) * rate) as usize {
            let s = (i as f64 / rate / lasts).min(1.0);
            let position = s.powi(3) * (10.0 + s * (6.0 * s - 15.0));
            let speed = 30.0 * s * s * (1.0 - s).powi(2) / lasts;
            let acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (lasts * lasts);
            let (v, a) = (travel * speed, travel * acceleration);
            let friction = match s > 0.0 && s < 1.0 {
                true => VISCOUS * v + COULOMB * travel.signum(),
                false => static_friction,
            };
            let noise = 0.4 * (chance.next() + chance.next() - 1.0);
            t.push(now);
            // an encoder of a micrometre
            q.push(((at + travel * position) * 1e6).round() * 1e-6);
            tau.push(MASS * a + friction + OFFSET + noise);
            now += 1.0 / rate;
        }
        at = to;
    }
    Log::of_rows(name, &t, &q, &tau).unwrap()
}

fn robot() -> RobotSetup {
    let text = r#"
        robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
        friction = { law = "viscous-coulomb", fitted_with_inertias = true, offset = true }
        filter = { cutoff_hz = 20.0 }
    "#;
    RobotSetup::new("slide.toml", RobotFile::parse("slide.toml", text).unwrap())
}

#[test]
fn rests_do_not_move_the_friction_and_are_distinguished_in_the_errors() {
    let robot = robot();
    let control = Control::default();
    let log = [slide("resting", 1.0, 3)];
    let found = lsq(
        &Dataset::read(&robot, &log, &Control::default()).unwrap(),
        &LsqSettings::default(),
        &control,
    )
    .unwrap();
    for (u, truth) in found.unknowns.iter().zip([MASS, VISCOUS, COULOMB, OFFSET]) {
        let off = (u.fitted - truth).abs();
        assert!(
            off < 0.03 * truth,
            "{}: {} +- {}",
            u.key,
            u.fitted,
            u.fitted_std
        );
    }
    let shown = |note: &StageNote| {
        let text = note.to_string();
        text.contains("at a reversal were ignored: slide")
    };
    assert!(found.notes.iter().any(shown), "{:?}", found.notes);
    let fitted = &found.joints[0];
    let (moving, rest) = (fitted.relative_error_moving, fitted.relative_error_rest);
    assert!(moving.unwrap() < 0.05, "{fitted:?}");
    assert!(rest.unwrap() > 0.5, "{fitted:?}");
    assert!(fitted.relative_error > moving.unwrap() && fitted.relative_error < rest.unwrap());

    let model = GivenModel::new("slide.toml", found.model(&robot, None));
    let unseen = [slide("unseen", 0.6, 8)];
    let data = Dataset::read(&robot, &unseen, &Control::default()).unwrap();
    let settings = ValidateSettings::of(&model);
    let all = validate(&data, &settings, &control, &mut |_, _| {}).unwrap();
    let e = &all.validation.errors.joints[0];
    assert!(e.relative_error_moving.unwrap() < 0.06, "{e:?}");
    assert!(e.relative_error_rest.unwrap() > 0.5, "{e:?}");
    let share = e.resting as f64 / e.samples as f64;
    // 0.6 s of rest after each move of 1.2 to 2.2 s
    assert!((0.15..0.35).contains(&share), "{share}");
    // squares of both parts make those of the whole
    let overall = &all.validation.errors.overall;
    assert_eq!(overall.relative_error_moving, e.relative_error_moving);
    assert_eq!(overall.relative_error_rest, e.relative_error_rest);
    let resting = read_whole(&robot, &data.logs, &control).unwrap().rest_speed[0];
    assert!((1e-4..1e-2).contains(&resting), "{resting}");
}

#[test]
fn a_log_without_rests_has_no_error_at_rest() {
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    let waves = [(0.11, 1.9), (0.05, 4.7), (0.02, 9.1)];
    for k in 0..15_000 {
        let now = k as f64 * 0.002;
        let sum = |of: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
        let v = sum(&|a, w| a * w * (w * now).cos());
        t.push(now);
        q.push(sum(&|a, w| a * (w * now).sin()));
        tau.push(
            MASS * sum(&|a, w| -a * w * w * (w * now).sin())
                + VISCOUS * v
                + COULOMB * v.signum()
                + OFFSET,
        );
    }
    let log = Log::of_rows("moving", &t, &q, &tau).unwrap();
    let settings = LsqSettings::default();
    let found = lsq(
        &Dataset::read(&robot(), &[log], &Control::default()).unwrap(),
        &settings,
        &Control::default(),
    )
    .unwrap();
    assert_eq!(found.joints[0].relative_error_rest, None);
    // all rows that are fitted are such that move; a validation counts those about reversals in full
    let fitted = &found.fit.relative_error[0];
    assert_eq!(fitted.rest, None);
    assert_eq!(fitted.moving, Some(fitted.all));
    let rests = |note: &StageNote| matches!(note, StageNote::Fit(FitNote::AtRest { .. }));
    assert!(!found.notes.iter().any(rests));
}
