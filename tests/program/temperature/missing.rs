//! A temperature that is missing or is no number.

use super::*;

#[test]
fn a_temperature_that_is_missing_or_is_no_number_is_reported_with_log_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    axis(at);
    with_grease(at, "id.csv", &["--seconds", "20"]);
    let text = fs::read_to_string(at.join("id.csv")).unwrap();
    let renamed = text.replacen("motor_temperature", "motor_temp", 1);
    fs::write(at.join("renamed.csv"), renamed).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    let row = |(k, row): (usize, &&str)| match k {
        700 => format!("{},NaN", row.rsplit_once(',').unwrap().0),
        _ => (*row).to_owned(),
    };
    let broken: Vec<String> = rows.iter().enumerate().map(row).collect();
    fs::write(at.join("broken.csv"), broken.join("\n") + "\n").unwrap();
    let model = fs::read_to_string(at.join("truth.toml")).unwrap();
    let unnamed = model.replace("[log.joint.x]\ntemperature = \"motor_temperature\"\n", "");
    assert!(unnamed.len() < model.len());
    fs::write(at.join("unnamed.toml"), &unnamed).unwrap();
    let with = |model: &str| {
        format!(
            "{model}{GREASE}\n[[effect]]\nname = \"grease\"\njoint = \"x\"\n[effect.parameters]\n\
             c = {{ value = {SIZE:?}, unit = \"1\" }}\nk = {{ value = {FALL:?}, unit = \"1\" }}\n"
        )
    };
    fs::write(at.join("with.toml"), with(&model)).unwrap();
    fs::write(at.join("with_unnamed.toml"), with(&unnamed)).unwrap();
    let refused = |words: &str, says: &[&str]| {
        let words: Vec<&str> = words.split(' ').collect();
        let (status, message, _) = run(at, &words);
        assert_eq!(status, 3, "{words:?}: {message}");
        for says in says {
            assert!(message.contains(says), "{words:?}: {says}: {message}");
        }
    };
    let missing = [
        "renamed.csv: `grease",
        "takes the temperature of x",
        "column `motor_temperature`",
        "`motor_temp`",
        "[log.joint.x] temperature",
    ];
    let unnamed = [
        "id.csv: `grease",
        "takes the temperature of x",
        "[log.joint.x] temperature = \"COLUMN\"",
    ];
    let broken = ["broken.csv:701", "column `motor_temperature`", "NaN"];
    for (log, model, says) in [
        ("renamed.csv", "truth.toml", &missing[..]),
        ("id.csv", "unnamed.toml", &unnamed),
        ("broken.csv", "truth.toml", &broken),
    ] {
        refused(
            &format!("diagnose {log} -m {model} --candidates own.toml -o new.toml"),
            says,
        );
    }
    for (log, model, says) in [
        ("renamed.csv", "with.toml", &missing[..]),
        ("id.csv", "with_unnamed.toml", &unnamed),
        ("broken.csv", "with.toml", &broken),
    ] {
        for line in [
            format!("validate {log} -m {model}"),
            format!("validate --open-loop {log} -m {model}"),
            format!("torque {log} -m {model} -o new.csv"),
            format!("compare {model} {model} {log}"),
            format!("export {log} -m {model} --mjcf new.xml"),
        ] {
            refused(&line, says);
        }
    }
    for output in ["new.toml", "new.csv", "new.xml"] {
        assert!(!at.join(output).exists());
    }
    // what takes no temperature goes on without it, and says so
    let (status, message, _) = run(at, &["diagnose", "renamed.csv", "-m", "truth.toml"]);
    assert!(
        status == 0 && message.contains("no temperature of this log is used"),
        "{message}"
    );
    // the plant has no course of it
    let plant = unnamed_plant(at);
    assert!(
        plant.contains("takes the temperature of x") && plant.contains("[sensors.temperature.x]"),
        "{plant}"
    );
    let own = GREASE.replace("temperature", "temperature_y");
    fs::write(at.join("own.toml"), own).unwrap();
    refused(
        "diagnose id.csv -m truth.toml --candidates own.toml",
        &["`temperature_y` is not known"],
    );
}
