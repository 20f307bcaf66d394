//! What a person sees on a terminal: tables of 80 columns, colour that is never needed, examples that
//! work, and the nearest spelling of what is not known.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::OnceLock;

use assert_cmd::Command;
use cft_ident::cli::CommandLine;
use clap::{CommandFactory, Parser};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

fn tool(folder: &Path, line: &str) -> Command {
    let mut tool = Command::cargo_bin("cft-ident").unwrap();
    tool.current_dir(folder).args(line.split_whitespace());
    for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "TERM"] {
        tool.env_remove(name);
    }
    tool
}

/// What a command that succeeds prints.
fn printed(folder: &Path, line: &str) -> String {
    let run = tool(folder, line).assert().code(0);
    String::from_utf8(run.get_output().stdout.clone()).unwrap()
}

/// What the built-in campaign leaves and says; run once for all tests.
fn campaign() -> (&'static Path, &'static str) {
    static RUN: OnceLock<(tempfile::TempDir, String)> = OnceLock::new();
    let (folder, said) = RUN.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let done = tool(folder.path(), "identify --verbose -o run")
            .assert()
            .code(0);
        let said = String::from_utf8(done.get_output().stdout.clone()).unwrap();
        (folder, said)
    });
    static AT: OnceLock<std::path::PathBuf> = OnceLock::new();
    (AT.get_or_init(|| folder.path().join("run")), said)
}

/// A copy of what the campaign leaves, to be written into.
fn copy() -> tempfile::TempDir {
    let copy = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(campaign().0).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), copy.path().join(entry.file_name())).unwrap();
    }
    copy
}

#[track_caller]
fn assert_fits(line: &str, said: &str) {
    assert!(!said.is_empty(), "{line} says nothing");
    for row in said.lines() {
        assert!(row.chars().count() <= 80, "{line}: too long: {row}");
        let first = row.split_whitespace().next().unwrap_or("");
        let alone = [
            "%", "±", "=", "N", "Nm", "rad", "rad/s", "s", "Hz", "m", "m/s",
        ];
        assert!(
            !alone.contains(&first),
            "{line}: parted from its number: {row}"
        );
    }
}

#[test]
fn what_the_commands_print_fits_80_columns_and_parts_no_number_from_its_unit() {
    let folder = copy();
    assert_fits("identify", campaign().1);
    for line in [
        "friction q1.csv q2.csv -r configs/cft.toml -o f.toml",
        "lsq identification.csv -r configs/cft.toml -m friction.toml -o m.toml",
        "validate unseen.csv -m model.toml",
        "diagnose identification.csv -m model.toml --holdout unseen.csv",
        "compare model.toml refined.toml unseen.csv",
        "torque unseen.csv -m model.toml -o t.csv",
        "simulate -r configs/cft.toml --seconds 2 -o s.csv",
        "inspect unseen.csv",
        "inspect unseen.csv -r configs/cft.toml",
        "convert unseen.csv u.mcap",
        "excite --check configs/cft-excitation.toml",
        "export -m model.toml --c model.h --rust model.rs",
        "new mine --log q1.csv",
        "example",
        "example bldc",
    ] {
        let done = tool(folder.path(), line).arg("--verbose").assert().code(0);
        let said = String::from_utf8(done.get_output().stdout.clone()).unwrap();
        assert_fits(line, &said);
    }
}

#[test]
fn the_diagnosis_says_per_cent_once_and_lines_its_numbers_up_at_the_right() {
    let said = campaign().1;
    let from = said.find("relative torque error [%]").unwrap();
    // the caption may have lines of its own
    let below = said[from..].lines().skip_while(|l| !l.starts_with("joint"));
    let table: Vec<&str> = below.take(6).collect();
    assert!(!table[2..].concat().contains('%'), "{table:#?}");
    let end = table[0].find("95 % CI").unwrap() + "95 % CI".len();
    for row in &table[2..] {
        let interval = row[..end].rsplit(' ').next().unwrap();
        let (low, high) = interval.split_once("..").unwrap();
        assert!(low.parse::<f64>().unwrap() < high.parse::<f64>().unwrap());
    }
}

/// Without the escape sequences of colours.
fn plain(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap().to_owned();
    parts.fold(first, |all, part| {
        all + &part[part.find('m').unwrap() + 1..]
    })
}

#[test]
fn colour_is_for_terminals_and_says_nothing_that_the_words_do_not() {
    let folder = tempfile::tempdir().unwrap();
    for line in ["lsq --help", "--help", "validat", "lsq --nothing"] {
        let both = |name: &str, value: &str| {
            let run = tool(folder.path(), line).env(name, value).output().unwrap();
            String::from_utf8([run.stdout, run.stderr].concat()).unwrap()
        };
        let piped = both("TERM", "xterm-256color");
        assert!(!piped.contains('\u{1b}'), "{line}: {piped:?}");
        let forced = both("CLICOLOR_FORCE", "1");
        assert!(forced.contains('\u{1b}'), "{line}: {forced:?}");
        assert_eq!(plain(&forced), piped);
        let refused = tool(folder.path(), line)
            .envs([("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")])
            .output()
            .unwrap();
        let refused = String::from_utf8([refused.stdout, refused.stderr].concat()).unwrap();
        assert_eq!(refused, piped);
    }
}

#[test]
fn verdicts_have_colour_where_it_is_taken_and_the_words_are_the_same_without() {
    let folder = copy();
    let line = "validate unseen.csv -m model.toml --max-relative-error 0.001";
    let said = |set: &[(&str, &str)]| {
        let mut tool = tool(folder.path(), line);
        let run = tool.envs(set.iter().copied()).assert().code(1);
        String::from_utf8(run.get_output().stdout.clone()).unwrap()
    };
    let piped = said(&[]);
    assert!(!piped.contains('\u{1b}'), "{piped:?}");
    let forced = said(&[("CLICOLOR_FORCE", "1")]);
    assert!(forced.starts_with("\u{1b}[1;31m"), "{forced:?}");
    assert_eq!(plain(&forced), piped);
    assert_eq!(said(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]), piped);
}

#[test]
fn the_verdict_comes_first_quiet_says_it_alone_and_verbose_says_more() {
    let folder = copy();
    let lines = [
        "lsq identification.csv -r configs/cft.toml -m friction.toml -o m.toml",
        "validate unseen.csv -m model.toml",
        "friction q1.csv q2.csv q4.csv -r configs/cft.toml -o f.toml",
        "compare model.toml refined.toml unseen.csv",
        "diagnose identification.csv -m model.toml --holdout unseen.csv -o r.toml --report r.html",
    ];
    for line in lines {
        let said = |detail: &str| printed(folder.path(), &format!("{line} {detail}"));
        let (quiet, usual, verbose) = (said("-q"), said(""), said("--verbose"));
        assert!(usual.starts_with(quiet.trim_end()), "{line}:\n{usual}");
        assert!(quiet.lines().count() < usual.lines().count(), "{line}");
        assert!(
            usual.lines().count() <= 25,
            "{line}: more than a screen:\n{usual}"
        );
        // the line that says there is more is not in it
        let left = usual.replace("--verbose shows more\n", "");
        let page = "report: r.html\n";
        assert_eq!(usual.ends_with(page), line.contains("--report"), "{line}");
        assert!(verbose.lines().count() >= left.lines().count(), "{line}");
    }
}

#[test]
fn quiet_prints_a_line_or_two_of_every_result() {
    let folder = copy();
    let lines = [
        "inspect unseen.csv",
        "convert unseen.csv other.csv",
        "torque unseen.csv -m model.toml -o torque.csv",
        "reduce identification.csv -r configs/cft.toml -m friction.toml -o part.cfi",
        "excite --check configs/table3.toml",
        "export -m model.toml --c tau.h",
        "simulate -r configs/cft.toml --move q4 --seconds 20 -o moved.csv",
    ];
    for line in lines {
        let said = |detail: &str| printed(folder.path(), &format!("{line} {detail}"));
        let (quiet, usual) = (said("-q"), said(""));
        let lines = |text: &str| text.lines().count();
        assert!((1..=4).contains(&lines(&quiet)), "{line}:\n{quiet}");
        assert!(lines(&quiet) < lines(&usual), "{line}:\n{usual}");
    }
}

#[cfg(unix)]
#[test]
fn open_shows_the_report_in_the_browser_that_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = copy();
    let browser = folder.path().join("browser");
    std::fs::write(&browser, "#!/bin/sh\necho \"$1\" > opened\n").unwrap();
    std::fs::set_permissions(&browser, std::fs::Permissions::from_mode(0o755)).unwrap();
    let line = "validate unseen.csv -m model.toml --report page.html --open -q";
    tool(folder.path(), line)
        .env("BROWSER", &browser)
        .assert()
        .code(0);
    let opened = folder.path().join("opened");
    let came = || std::fs::read_to_string(&opened).unwrap_or_default();
    // the browser is not waited for
    for _ in 0..200 {
        if !came().is_empty() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(25));
    }
    assert_eq!(came().trim(), "page.html");
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(!page.contains("--open"));
}

#[test]
fn a_held_out_log_did_not_make_the_model_and_a_fitted_one_did() {
    let folder = copy();
    let said = |log: &str| {
        let line = format!("validate {log} -m refined.toml");
        let run = tool(folder.path(), &line).assert().code(0);
        String::from_utf8(run.get_output().stdout.clone()).unwrap()
    };
    let used = "was used to make this model";
    assert!(!said("unseen.csv").contains(used));
    assert!(said("identification.csv").contains(used));
    let model = std::fs::read_to_string(folder.path().join("refined.toml")).unwrap();
    assert!(model.contains("role = \"held-out\"") && model.contains("role = \"fitted\""));
}

/// Files that a reader has and the built-in campaign has not.
const READERS_OWN: [&str; 15] = [
    "tool.toml",
    "rig/*.json",
    "walk.csv",
    "arm/*/",
    "wrist.csv",
    "run.mcap",
    "poses.csv",
    "motion.toml",
    "arm.toml",
    "bag_0.mcap",
    "emps_id.csv",
    "loaded.csv",
    "run.csv",
    "myarm.urdf",
    "myarm-model.toml",
];

/// The examples at the end of a command's help, continued lines as one, without where the output goes.
fn examples(command: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let done = tool(folder.path(), &format!("{command} --help"))
        .assert()
        .code(0);
    let help = String::from_utf8(done.get_output().stdout.clone()).unwrap();
    let (_, examples) = help.split_once("Example:\n").expect(command);
    let whole = examples.replace("\\\n", " ");
    whole
        .lines()
        .map(|line| line.split(" > ").next().unwrap().trim().to_owned())
        .collect()
}

#[test]
fn the_examples_of_every_help_work_where_the_campaign_was_run() {
    let folder = copy();
    for run in ["before", "after"] {
        let line = format!("validate unseen.csv -m model.toml --json {run}.json");
        tool(folder.path(), &line).assert().code(0);
    }
    let (mut run, mut parsed) = (0, BTreeSet::new());
    for command in CommandLine::command().get_subcommands() {
        for example in examples(command.get_name()) {
            let words: Vec<&str> = example.split_whitespace().collect();
            let found = CommandLine::try_parse_from(&words);
            assert!(found.is_ok(), "{example}: {}", found.unwrap_err());
            let own = |word: &&str| READERS_OWN.contains(word) || word.starts_with('~');
            // the campaign itself is what the others run on
            if words.iter().any(own) || words[1] == "identify" {
                parsed.insert(words[1].to_owned());
                continue;
            }
            tool(folder.path(), &words[1..].join(" ")).assert().code(0);
            run += 1;
        }
    }
    assert!(run >= 18, "{run}");
    let without_run = [
        "convert", "diagnose", "drive", "export", "excite", "identify", "lsq", "generate", "new",
        "payload", "tool", "torque",
    ];
    assert!(
        parsed.iter().all(|c| without_run.contains(&c.as_str())),
        "{parsed:?}"
    );
}

#[test]
fn what_is_not_known_is_reported_with_its_nearest_spelling() {
    let folder = copy();
    let change = |from: &str, to: &str, pattern: &str, with: &str| {
        let text = std::fs::read_to_string(folder.path().join(from)).unwrap();
        assert!(text.contains(pattern), "{from} has no {pattern}");
        std::fs::write(folder.path().join(to), text.replace(pattern, with)).unwrap();
    };
    change("robot.toml", "key.toml", "cutoff_hz", "cutof_hz");
    change("robot.toml", "value.toml", "\"cft\"", "\"ctf\"");
    change("refined.toml", "effect.toml", "\"ripple\"", "\"riple\"");
    change("campaign.toml", "logs.toml", "validation =", "validaton =");
    std::fs::write(folder.path().join("emps.csv"), "t,q1,tau_1\n0,0,0\n").unwrap();
    for (line, near) in [
        (
            "inspect unseen.csv -r key.toml",
            "did you mean `cutoff_hz`?",
        ),
        ("inspect unseen.csv -r value.toml", "did you mean `cft`?"),
        ("identify logs.toml -o again", "did you mean `validation`?"),
        (
            "validate unseen.csv -m effect.toml",
            "did you mean `ripple`?",
        ),
        (
            "lsq emps.csv -r configs/emps.toml -o m.toml",
            "the nearest is `tau_1`",
        ),
        (
            "inspect unseen.csv -r configs/ctf.toml",
            "did you mean `configs/cft.toml`?",
        ),
        (
            "friction q1.csv -r configs/cft.toml --joint q11 -o f.toml",
            "did you mean `q1`?",
        ),
        (
            "simulate -r configs/cft.toml --move x_c11 -o a.csv",
            "did you mean `x_c1`?",
        ),
        (
            "simulate -r configs/cft.toml --effect ripple:qq5 -o a.csv",
            "did you mean `q5`?",
        ),
        (
            "simulate -r configs/cft.toml --effect paylod -o a.csv",
            "did you mean `payload`?",
        ),
        (
            "simulate -r configs/cft.toml --effect payload:mas=1 -o a.csv",
            "did you mean `mass`?",
        ),
        (
            "excite -r configs/cft.toml --joint q44 -o a.toml",
            "did you mean `q4`?",
        ),
        (
            "validat unseen.csv",
            "similar subcommand exists: 'validate'",
        ),
        (
            "validate unseen.csv --modl model.toml",
            "similar argument exists: '--model'",
        ),
        (
            "lsq a.csv -r r.toml -o m.toml --estimator irl",
            "similar value exists: 'irls'",
        ),
        ("generate schema compar", "similar value exists: 'compare'"),
    ] {
        tool(folder.path(), line)
            .assert()
            .failure()
            .stderr(contains(near).and(contains("panicked").not()));
    }
}
