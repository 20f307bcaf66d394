//! Identifies an arm: fits 70 % of a log, judges the model on the rest, and looks for effects that it lacks.
//!
//! ```text
//! cft-ident example ur10
//! cargo run --release --example identify_arm -- ur10/ur10.toml ur10/ur10.csv refined.toml
//! ```

use std::error::Error;

use cft_ident::identify::{
    Control, Dataset, DiagnoseEnd, DiagnoseSettings, GivenModel, Log, LsqSettings, RobotSetup,
    ValidateSettings, check_setup, diagnose, lsq, validate,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [robot, log, output] = &arguments[..] else {
        return Err("give ROBOT.toml LOG OUTPUT.toml".into());
    };
    let arm = RobotSetup::load(robot)?;
    let control = Control::default();
    let fitted = [Log::File(format!("{log}@0..70%").parse()?)];
    let held_out = [Log::File(format!("{log}@70..100%").parse()?)];

    // signs, units and zeros of the robot file against the torques
    let data = Dataset::read(&arm, &fitted, &Control::default())?
        .holding_out(&held_out, &Control::default())?;
    let setup = check_setup(&data, &control)?;
    for finding in setup.report.refusals() {
        eprintln!("{robot}: {}", finding.in_words());
    }

    let settings = LsqSettings {
        consistent: true, // links that can exist, beside the plain fit
        ..LsqSettings::default()
    };
    let fit = lsq(&data, &settings, &control)?;
    let model = GivenModel::new("model", fit.model(&arm, None));
    let unseen = Dataset::read(&arm, &held_out, &Control::default())?;
    let settings = ValidateSettings::of(&model);
    let judged = validate(&unseen, &settings, &control, &mut |_, _| {})?;
    for joint in &judged.validation.errors.joints {
        println!(
            "{}: misses {:.1} % of its torque",
            joint.joint,
            100.0 * joint.relative_error
        );
    }

    let settings = DiagnoseSettings::of(&model);
    let DiagnoseEnd::Diagnosed(found) = diagnose(&data, &settings, &control)? else {
        return Err("the log has a fault: see `cft-ident inspect`".into());
    };
    for step in found.result(&arm).steps.iter().filter(|step| step.written) {
        println!(
            "missing: {} of {}",
            step.effect,
            step.joint.as_deref().unwrap_or("all joints")
        );
    }
    std::fs::write(output, found.model(&arm, &model.file).to_toml()?)?;
    Ok(())
}
