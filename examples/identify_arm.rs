//! Identifies an arm: fits 70 % of a log, judges the model on the rest, and looks for effects that it lacks.
//!
//! ```text
//! cft-ident example ur10
//! cargo run --release --example identify_arm -- ur10/ur10.toml ur10/ur10.csv refined.toml
//! ```

use std::error::Error;

use cft_ident::identify::{
    Control, DiagnoseEnd, DiagnoseLogs, DiagnoseSettings, Log, LoggedRobot, LsqSettings,
    check_setup, diagnose, lsq, refined, validate,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [robot, log, output] = &arguments[..] else {
        return Err("give ROBOT.toml LOG OUTPUT.toml".into());
    };
    let arm = LoggedRobot::load(robot)?;
    let control = Control::default();
    let fitted = [Log::File(format!("{log}@0..70%").parse()?)];
    let held_out = [Log::File(format!("{log}@70..100%").parse()?)];

    // signs, units and zeros of the robot file against the torques
    let setup = check_setup(&arm, &fitted, &control)?;
    for finding in setup.report.refusals() {
        eprintln!("{robot}: {}", finding.in_words());
    }

    let settings = LsqSettings {
        consistent: true, // links that can exist, beside the plain fit
        ..LsqSettings::default()
    };
    let fit = lsq(&arm, &fitted, &settings, &control)?;
    let model = fit.model(&arm, None);
    let used = refined(&model, "model")?;
    let judged = validate(
        &arm,
        (&used, Some(&model)),
        &held_out,
        &control,
        &mut |_, _| {},
    )?;
    for joint in &judged.validation.errors.joints {
        println!(
            "{}: misses {:.1} % of its torque",
            joint.joint,
            100.0 * joint.relative_error
        );
    }

    let logs = DiagnoseLogs {
        train: &fitted,
        veto: &[],
        holdout: &held_out,
    };
    let settings = DiagnoseSettings::default();
    let DiagnoseEnd::Diagnosed(found) =
        diagnose(&arm, ("model", &model), &logs, &settings, &control)?
    else {
        return Err("the log has a fault: see `cft-ident inspect`".into());
    };
    for step in found.result(&arm).steps.iter().filter(|step| step.written) {
        println!(
            "missing: {} of {}",
            step.effect,
            step.joint.as_deref().unwrap_or("all joints")
        );
    }
    std::fs::write(output, found.model(&arm, &model).to_toml()?)?;
    Ok(())
}
