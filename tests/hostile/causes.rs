//! The true cause of what is wrong, and the right word for what is not known.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::bench::Bench;

#[test]
fn a_damaged_recording_is_reported_as_damaged_without_a_robot_file_too() {
    let bench = Bench::new();
    let converted = bench.run("convert good.csv good.mcap -r slide.toml");
    assert_eq!(converted.status, Some(0), "{}", converted.stderr);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/logs");
    let files = [
        bench.path("good.mcap"),
        fixtures.join("unindexed.mcap"),
        fixtures.join("arm.mcap"),
    ];
    let mut damaged = 0;
    for file in files {
        let whole = fs::read(file).unwrap();
        for part in 1..40 {
            bench.file("bad.mcap", &whole[..whole.len() * part / 40]);
            for line in ["inspect bad.mcap", "convert bad.mcap out.csv"] {
                let ended = bench.run(line);
                if ended.status == Some(0) {
                    continue;
                }
                assert_eq!(ended.status, Some(3), "{line}, {part}: {}", ended.stderr);
                let shown = &ended.stderr;
                assert!(
                    !shown.contains("no topic holds sensor_msgs"),
                    "{line}, {part}: {shown}"
                );
                assert!(
                    shown.contains("bad.mcap") && shown.contains("hint: "),
                    "{shown}"
                );
                damaged += 1;
            }
        }
    }
    assert!(damaged > 20, "{damaged}");
}

#[test]
fn a_parameter_without_a_torque_worth_mentioning_is_negligible_and_not_counted_as_identified() {
    let bench = Bench::new();
    // so slow that 10 kg take a thousandth of the torque
    let mut text = "t,q_slide,tau_slide\n".to_owned();
    for k in 0..30_000u32 {
        let t = f64::from(k) / 100.0;
        let (q, v) = (0.1 * (0.05 * t).sin(), 0.005 * (0.05 * t).cos());
        let noise = f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5;
        let _ = writeln!(
            text,
            "{t:.2},{q:.9},{:.6}",
            500.0 * v + 3.0 * v.signum() + 0.3 * noise
        );
    }
    bench.file("slow.csv", text);
    let ended =
        bench.run("lsq slow.csv -r slide.toml -o slow.toml --json slow.json --report slow.html");
    assert_eq!(ended.status, Some(0), "{}", ended.stderr);
    let document: serde_json::Value = serde_json::from_str(&bench.text("slow.json")).unwrap();
    let all = document["parameters"].as_array().unwrap();
    let inertia = all.iter().find(|p| p["name"] == "inertia").unwrap();
    assert_eq!(inertia["negligible"], true, "{inertia}");
    assert_eq!(inertia["verdict"], "identified", "{inertia}");
    assert!(inertia["relative_std"].as_f64().unwrap() > 0.1, "{inertia}");
    let terminal = String::from_utf8(ended.stdout).unwrap();
    let row = terminal
        .lines()
        .find(|line| line.contains("inertia"))
        .unwrap();
    assert!(
        row.contains("negligible") && !row.contains("identified"),
        "{row}"
    );
    let page = bench.text("slow.html");
    let uncertain = |p: &&serde_json::Value| p["relative_std"].as_f64().is_none_or(|r| r > 0.1);
    let rated = |p: &&serde_json::Value| p["verdict"] == "identified";
    let negligible = all.iter().filter(rated).filter(uncertain).count();
    let certain = all.iter().filter(rated).count() - negligible;
    let shown = format!(
        "{certain} of {} parameters are identified, {negligible} negligible",
        all.len()
    );
    assert!(page.contains(&shown), "no `{shown}`");
}
