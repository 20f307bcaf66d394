//! The CFT robot by the channels of its motors.

use super::*;

const MOTORS: [(&str, f64, [&str; 4]); 2] = [
    (
        "x_c2",
        -1.0,
        ["sign", "position", "x_c2", "position_sign = -1"],
    ),
    (
        "x_c1",
        1000.0,
        ["scale", "position", "x_c1", "position_unit = \"mm\""],
    ),
];

#[test]
fn motors_whose_positions_are_no_poses_or_in_other_units_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let words = "simulate -r configs/cft.toml --seconds 20 --seed 5 -o made.csv";
    run(folder.path(), &words.split(' ').collect::<Vec<_>>());
    let made = folder.path().join("made.csv");
    let motors = |log: &mut Log| {
        let of_motor =
            |name: &String| name == "t" || name.starts_with("x_c") || name.starts_with("u_");
        let kept: Vec<usize> = (0..log.names.len())
            .filter(|i| of_motor(&log.names[*i]))
            .collect();
        log.names = kept.iter().map(|i| log.names[*i].clone()).collect();
        for row in &mut log.rows {
            *row = kept.iter().map(|i| row[*i]).collect();
        }
    };
    assert!(
        Altered::new(&made, "configs/cft.toml", motors)
            .findings()
            .is_empty()
    );
    for (column, factor, [kind, channel, joint, remedy]) in MOTORS {
        let altered = Altered::new(&made, "configs/cft.toml", |log| {
            motors(log);
            log.map(column, |x| x * factor);
        });
        let findings = altered.findings();
        let entry = findings.first().expect("something is said");
        let of = ["kind", "channel", "joint"].map(|key| entry[key].as_str());
        assert_eq!(of, [kind, channel, joint].map(Some), "{entry}");
        assert!(
            entry["remedy"].as_str().unwrap().contains(remedy),
            "{entry}"
        );
    }
    // whose factor these data do not tell: three times as much fits as well
    let altered = Altered::new(&made, "configs/cft.toml", |log| {
        motors(log);
        log.map("x_c4", |x| x * 1000.0);
    });
    let findings = altered.findings();
    assert!(
        findings.iter().all(|entry| entry["joint"] == "x_c4"),
        "{findings:?}"
    );
}
