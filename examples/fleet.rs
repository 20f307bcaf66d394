//! Many logs of robots: each log is reduced once, then parameters are followed from log to log.
//!
//! ```text
//! cft-ident example ur10
//! cargo run --release --example fleet -- ur10/ur10.toml ur10/ur10.csv@0..50% ur10/ur10.csv@50..100%
//! ```
//!
//! A change needs six logs before it and six after.

use std::error::Error;

use cft_ident::identify::{
    Control, Dataset, Log, RobotSetup, RobotSources, TrackSource, reduce, track,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [robot, logs @ ..] = &arguments[..] else {
        return Err("give ROBOT.toml LOG...".into());
    };
    let machine = RobotSetup::load(robot)?;
    let control = Control::default();

    let mut sources = Vec::new();
    for (file, log) in logs.iter().enumerate() {
        let reduced = reduce(
            &Dataset::read(&machine, &[Log::File(log.parse()?)], &Control::default())?,
            None,
            &control,
        )?;
        println!("{log}: {} bytes", reduced.to_bytes()?.len());
        let parts = reduced.logs().iter().cloned();
        sources.extend(parts.map(|log| TrackSource::Part { log, file }));
    }
    let robots = [RobotSources {
        name: robot.clone(),
        sources,
    }];
    let followed = track(&robots, &control)?;
    for robot in &followed.robots {
        for parameter in robot.parameters.iter().filter(|p| p.name == "viscous") {
            let course = parameter.values.iter();
            let course = course.map(|value| value.map_or("-".to_owned(), |v| format!("{v:.2}")));
            let course: Vec<String> = course.collect();
            let joint = parameter.joint.as_deref().unwrap_or_default();
            println!(
                "viscous of {joint} [{}]: {}",
                parameter.unit,
                course.join(" ")
            );
        }
        for change in &robot.changes {
            let joint = change.joint.as_deref().unwrap_or_default();
            println!(
                "{} of {joint} changed by {:.3} {} at {}",
                change.parameter, change.size, change.unit, robot.logs[change.log]
            );
        }
    }
    Ok(())
}
