//! The exit status and the two streams at the boundary of the process.

use assert_cmd::Command;
use clap::CommandFactory;
use predicates::prelude::*;
use predicates::str::{contains, is_empty, starts_with};

fn tool() -> Command {
    Command::cargo_bin("cft-ident").unwrap()
}

fn commands() -> Vec<String> {
    cft_ident::cli::CommandLine::command()
        .get_subcommands()
        .map(|command| command.get_name().to_owned())
        .collect()
}

#[test]
fn an_unknown_command_is_a_usage_error_on_standard_error() {
    tool()
        .arg("frobnicate")
        .assert()
        .code(2)
        .stdout(is_empty())
        .stderr(starts_with("error: "));
}

#[test]
fn no_command_at_all_is_a_usage_error() {
    tool().assert().code(2).stdout(is_empty());
}

#[test]
fn an_unknown_option_of_a_command_is_a_usage_error_that_leaves_standard_output_empty() {
    for command in commands() {
        tool()
            .args([&command, "--json", "-", "--frobnicate"])
            .assert()
            .code(2)
            .stdout(is_empty())
            .stderr(starts_with("error: "));
    }
}

#[test]
fn zero_threads_are_a_usage_error() {
    for command in commands() {
        tool()
            .args([&command, "--threads", "0"])
            .assert()
            .code(2)
            .stdout(is_empty());
    }
}

#[test]
fn version_and_help_go_to_standard_output_with_status_0() {
    tool()
        .arg("--version")
        .assert()
        .code(0)
        .stdout(concat!("cft-ident ", env!("CARGO_PKG_VERSION"), "\n"))
        .stderr(is_empty());
    tool()
        .arg("--help")
        .assert()
        .code(0)
        .stdout(contains("Usage: cft-ident"));
}

#[test]
fn the_help_of_every_command_fits_80_columns_and_ends_in_an_example() {
    for command in commands().iter().filter(|name| *name != "help") {
        let help = tool()
            .args([command, "--help"])
            .assert()
            .code(0)
            .stderr(is_empty());
        let text = String::from_utf8(help.get_output().stdout.clone()).unwrap();
        assert!(
            contains("Example").eval(&text),
            "{command} has no example:\n{text}"
        );
        assert!(
            contains(format!("cft-ident {command} ")).eval(&text),
            "{command}:\n{text}"
        );
        // The parser does not wrap the synopsis.
        for line in text.lines().filter(|line| !line.starts_with("Usage: ")) {
            assert!(line.chars().count() <= 80, "{command}: too long: {line}");
        }
    }
}

#[test]
fn a_json_file_that_cannot_be_written_is_reported_before_anything_else_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let lines = [
        "friction no.csv -r configs/cft.toml -o m.toml",
        "lsq no.csv -r configs/emps.toml -o m.toml",
        "validate no.csv -m no.toml",
        "reduce no.csv -r configs/emps.toml -o a.cfi",
        "track no.cfi",
        "watch no.csv -m no.toml",
        "diagnose no.csv -m no.toml",
        "compare no.toml no.toml",
        "payload no.csv -m no.toml",
        "show no.toml",
        "torque no.csv -m no.toml -o t.csv",
        "simulate -r configs/cft.toml --seconds 1 -o a.csv",
        "identify -o run",
        "inspect no.csv",
        "convert no.csv a.mcap",
        "excite -r configs/cft.toml -o e.toml",
        "export -m no.toml --c a.h",
        "new mine",
        "example ur10",
        "generate schema robot",
        "drive no.csv -o d.toml",
        "tool no.csv -o t.toml",
    ];
    assert_eq!(
        lines.len(),
        commands().iter().filter(|name| *name != "help").count()
    );
    for line in lines {
        tool()
            .current_dir(folder.path())
            .args(line.split(' '))
            .args(["--json", "none/result.json"])
            .assert()
            .code(5)
            .stdout(is_empty())
            .stderr(starts_with("error: ").and(contains("mkdir -p none")));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
