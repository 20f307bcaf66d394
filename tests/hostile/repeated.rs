//! One log given twice: refused where it decides something, named where it is only looked at.

use std::fs;

use crate::bench::Bench;

#[test]
fn a_log_that_is_given_twice_is_refused_by_everything_that_fits() {
    let bench = Bench::new();
    fs::copy(bench.path("good.csv"), bench.path("copy.csv")).unwrap();
    for line in [
        "lsq good.csv good.csv -r slide.toml -o out.toml",
        "lsq good.csv copy.csv -r slide.toml -o out.toml",
        "lsq good.csv@0..70% copy.csv@50..100% -r slide.toml -o out.toml",
        "lsq good.csv@0..70% good.csv@1..2s -r slide.toml -o out.toml",
        "friction good.csv ./good.csv -r slide.toml -o out.toml",
        "diagnose good.csv good.csv -m model.toml -o out.toml",
        "diagnose good.csv -m model.toml --holdout copy.csv",
        "diagnose good.csv@0..60% -m model.toml --holdout good.csv@50..100%",
        "diagnose good.csv@0..60% -m model.toml --holdout good.csv@60..80% --holdout good.csv@70..100%",
        "diagnose good.csv -m model.toml --holdout other.csv --holdout other.csv",
    ] {
        bench.refuses(line, 3, &["holds rows that", "give each row once"]);
    }
    for line in [
        "lsq good.csv@0..50% copy.csv@50..100% -r slide.toml -o parts.toml",
        "lsq good.csv@0..60% -r slide.toml -o part.toml",
        "diagnose good.csv@0..60% -m part.toml --holdout good.csv@60..80% --holdout good.csv@80..100%",
    ] {
        let ended = bench.run(line);
        assert_eq!(ended.status, Some(0), "{line}: {}", ended.stderr);
    }
}

#[test]
fn a_campaign_with_a_log_in_two_roles_is_refused_and_friction_may_share_its_logs() {
    let bench = Bench::new();
    let campaign = |friction: &str, identification: &str, validation: &str| {
        format!(
            "robot = \"slide.toml\"\n[logs]\nfriction = [{friction}]\nidentification = [{identification}]\n\
             validation = [{validation}]\n"
        )
    };
    for (friction, identification, validation) in [
        ("", "\"good.csv\", \"good.csv\"", ""),
        ("", "\"good.csv\"", "\"good.csv\""),
        ("", "\"good.csv@0..70%\"", "\"good.csv@60..100%\""),
    ] {
        bench.file(
            "campaign.toml",
            campaign(friction, identification, validation),
        );
        bench.refuses(
            "identify campaign.toml -o run",
            3,
            &["holds rows that", "give each row once"],
        );
    }
}

#[test]
fn commands_that_only_look_warn_of_a_log_that_is_given_twice() {
    let bench = Bench::new();
    fs::copy(bench.path("good.csv"), bench.path("copy.csv")).unwrap();
    for line in [
        "validate good.csv copy.csv -m model.toml --json -",
        "compare model.toml model.toml good.csv copy.csv --json -",
        "inspect good.csv copy.csv --json -",
        "inspect good.csv copy.csv -r slide.toml --json -",
    ] {
        let ended = bench.run(line);
        assert_eq!(ended.status, Some(0), "{line}: {}", ended.stderr);
        let document: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
        let warnings = document["warnings"].as_array().unwrap();
        let shown = |w: &serde_json::Value| {
            w == "copy.csv holds rows that good.csv holds: they count twice"
        };
        assert_eq!(
            warnings.iter().filter(|w| shown(w)).count(),
            1,
            "{line}: {warnings:?}"
        );
    }
}
