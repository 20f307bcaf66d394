//! Friction of single joints, from logs in which one joint moves at a time.
//!
//! ```text
//! cft-ident example cft
//! cargo run --release --example joint_friction -- cft/robot.toml friction.toml cft/q4.csv cft/q5.csv
//! ```

use std::error::Error;

use cft_ident::identify::{Control, Dataset, FrictionSettings, Log, RobotSetup, friction};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [robot, output, logs @ ..] = &arguments[..] else {
        return Err("give ROBOT.toml FRICTION.toml LOG...".into());
    };
    let machine = RobotSetup::load(robot)?;
    let logs = logs.iter().map(|log| log.parse().map(Log::File));
    let logs: Vec<Log> = logs.collect::<Result<_, _>>()?;

    let found = friction(
        &Dataset::read(&machine, &logs, &Control::default())?,
        &FrictionSettings::default(),
        &Control::default(),
    )?;
    for note in &found.notes {
        eprintln!("{note}");
    }
    for joint in &found.joints {
        for (name, parameter) in joint.parameters.each() {
            // no value: these data do not determine it
            if let (Some(value), Some(std)) = (parameter.value, parameter.std) {
                println!(
                    "{}: {name} = {value:.3} ± {std:.3} {}",
                    joint.joint, parameter.unit
                );
            }
        }
    }
    // `lsq` takes this file as its friction
    std::fs::write(output, found.model(&machine, None).to_toml()?)?;
    Ok(())
}
