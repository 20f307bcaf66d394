//! All outputs of a command, or none; and what a name on the disk may do to a terminal.

use std::fs;
use std::os::unix::fs::symlink;

use crate::bench::Bench;

#[test]
fn one_output_that_cannot_be_written_leaves_none() {
    let bench = Bench::new();
    bench.file("old.toml", "old");
    bench.file("old.svg", "old");
    symlink("/dev/full", bench.path("full.html")).unwrap();
    for line in [
        "lsq good.csv -r slide.toml -o old.toml --json /dev/full",
        "lsq good.csv -r slide.toml -o new.toml --report full.html",
        "diagnose good.csv -m model.toml -o old.toml --plot old.svg --json /dev/full",
        "friction good.csv -r slide.toml -o old.toml --plot old.svg --json /dev/full",
        "validate good.csv -m model.toml -o new.csv --plot old.svg --json /dev/full",
        "torque good.csv -m model.toml -o new.csv --json /dev/full",
        "convert good.csv new.mcap --json /dev/full",
        "export -m model.toml --c new.h --rust new.rs --json /dev/full",
        "compare model.toml model.toml good.csv --plot old.svg --json /dev/full",
        "simulate -r configs/cft.toml --seconds 1 -o new.csv --json /dev/full",
        "excite --check configs/table3.toml --plot old.svg --json /dev/full",
        "new arm --json /dev/full",
    ] {
        bench.refuses(line, 5, &["full"]);
    }
}

#[test]
fn a_campaign_that_fails_leaves_no_folder() {
    let bench = Bench::new();
    bench.file("bad.csv", "t,q_slide,tau_slide\n0,0,0\n");
    let campaign = |log: &str| {
        format!("robot = \"slide.toml\"\n[logs]\nfriction = []\nidentification = [\"{log}\"]\n")
    };
    bench.file("campaign.toml", campaign("bad.csv"));
    bench.refuses("identify campaign.toml -o runs/monday", 3, &["bad.csv"]);
    // a folder of the user stays, with what is in it
    fs::create_dir(bench.path("mine")).unwrap();
    bench.refuses("identify campaign.toml -o mine", 3, &["bad.csv"]);
    bench.file("campaign.toml", campaign("good.csv"));
    let ended = bench.run("identify campaign.toml -o runs/monday");
    assert_eq!(ended.status, Some(0), "{}", ended.stderr);
    assert!(bench.path("runs/monday/model.toml").is_file());
}

#[test]
fn a_name_that_would_turn_the_line_around_is_shown_by_its_code() {
    let bench = Bench::new();
    let turned = "gpj.\u{202e}lmot.csv";
    fs::copy(bench.path("good.csv"), bench.path(turned)).unwrap();
    let model = "m\u{202e}lmot.toml";
    for words in [
        vec!["inspect", turned],
        vec!["lsq", turned, "-r", "slide.toml", "-o", model],
        vec!["validate", turned, "-m", model],
        vec!["validate", "good.csv", "-m", "no\u{2067}ne.toml"],
        vec!["convert", turned, "x\u{202e}.csv"],
        vec![
            "lsq",
            "no\u{202e}ne.csv",
            "-r",
            "slide.toml",
            "-o",
            "x.toml",
        ],
    ] {
        let ended = bench.run_words(&words);
        let said = String::from_utf8_lossy(&ended.stdout).into_owned() + &ended.stderr;
        assert!(said.contains("\\u{20"), "{words:?}: {said}");
        let raw = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        assert!(!said.contains(raw), "{words:?}: {said:?}");
    }
}
