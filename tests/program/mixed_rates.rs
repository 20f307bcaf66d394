//! Logs of one robot at several sampling rates, together in one stage.

use cft_ident::config::RobotFile;
use cft_ident::identify::{
    Control, Dataset, DiagnoseEnd, DiagnoseSettings, GivenModel, Log, LsqSettings, RobotSetup,
    ValidateSettings, compare, diagnose, lsq, validate,
};

const MASS: f64 = 12.0;
const VISCOUS: f64 = 30.0;
const COULOMB: f64 = 8.0;
/// What the robot file does not declare.
const OFFSET: f64 = 4.0;

/// Normal noise that needs no crate.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// A slide that moves for 30 s, sampled at `rate` [Hz].
fn slide(name: &str, rate: f64, seed: u64) -> Log {
    let mut chance = Chance(seed * 0x9e37_79b9 + 1);
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    let waves = [(0.11, 1.9), (0.05, 4.7), (0.02, 9.1)];
    let phase = seed as f64;
    for k in 0..(30.0 * rate) as usize {
        let now = k as f64 / rate;
        let sum = |of: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
        let v = sum(&|a, w| a * w * (w * now + phase).cos());
        let a = sum(&|a, w| -a * w * w * (w * now + phase).sin());
        t.push(now);
        q.push(sum(&|a, w| a * (w * now + phase).sin()));
        tau.push(MASS * a + VISCOUS * v + COULOMB * v.signum() + OFFSET + 0.3 * chance.next());
    }
    Log::of_rows(name, &t, &q, &tau).unwrap()
}

fn robot() -> RobotSetup {
    let text = r#"
        robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
        friction = { law = "viscous-coulomb", fitted_with_inertias = true }
        filter = { cutoff_hz = 20.0, position_cutoff_hz = 80.0 }
    "#;
    RobotSetup::new("slide.toml", RobotFile::parse("slide.toml", text).unwrap())
}

#[test]
fn logs_of_three_rates_are_fitted_diagnosed_validated_and_compared_together() {
    let robot = robot();
    let control = Control::default();
    let train = [slide("fast", 1000.0, 1), slide("slow", 400.0, 2)];
    let held_out = [slide("slowest", 250.0, 3)];
    let found = lsq(
        &Dataset::read(&robot, &train, &Control::default()).unwrap(),
        &LsqSettings::default(),
        &control,
    )
    .unwrap();
    let mass = &found.unknowns[0];
    assert!((mass.fitted - MASS).abs() < 0.02 * MASS, "{mass:?}");
    let file = found.model(&robot, None);

    let given = GivenModel::new("slide.toml", file);
    let data = Dataset::read(&robot, &train, &Control::default())
        .unwrap()
        .holding_out(&held_out, &Control::default())
        .unwrap();
    let end = diagnose(&data, &DiagnoseSettings::of(&given), &control).unwrap();
    let DiagnoseEnd::Diagnosed(end) = end else {
        panic!("no fault of the data is there");
    };
    let names: Vec<&str> = end
        .diagnosis
        .steps
        .iter()
        .map(|s| s.estimate.name())
        .collect();
    assert_eq!(names, ["torque-offset"]);
    let holdout = |errors: &cft_ident::diagnose::SplitErrors| {
        errors.holdout.as_ref().unwrap().overall.mean_relative_error
    };
    let (before, after) = (
        holdout(&end.diagnosis.before),
        holdout(&end.diagnosis.after),
    );
    assert!(after < 0.1 * before, "{before} {after}");
    // rows of the three logs at ten a period of 20 Hz: 200, 200 and 250 a second
    let rows = end.diagnosis.after.holdout.as_ref().unwrap().joints[0].samples;
    assert!((7000..7500).contains(&rows), "{rows}");

    let settings = ValidateSettings::of(&given);
    let all = [train.as_slice(), &held_out].concat();
    let apart = |log: &Log| {
        let one = std::slice::from_ref(log);
        let found = validate(
            &Dataset::read(&robot, one, &Control::default()).unwrap(),
            &settings,
            &control,
            &mut |_, _| {},
        )
        .unwrap();
        found.validation.errors.joints[0].clone()
    };
    let each: Vec<_> = all.iter().map(apart).collect();
    let data = Dataset::read(&robot, &all, &Control::default()).unwrap();
    let together = validate(&data, &settings, &control, &mut |_, _| {}).unwrap();
    let together = &together.validation.errors.joints[0];
    assert_eq!(
        together.samples,
        each.iter().map(|e| e.samples).sum::<u64>()
    );
    let squares: f64 = each.iter().map(|e| e.rmse.powi(2) * e.samples as f64).sum();
    let pooled = (squares / together.samples as f64).sqrt();
    assert!((together.rmse / pooled - 1.0).abs() < 1e-9);

    let compared = compare([given.clone(), given], &all, &control).unwrap();
    assert!(compared.tried.is_some());
}
