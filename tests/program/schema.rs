//! The schemas hold for the files that come with the tool and for its committed results, and for
//! nothing that its readers refuse.

use crate::schema_support;

use cft_ident::cli::generate::schema::{SchemaKind, schema};
use cft_ident::config::EMBEDDED;
use schema_support::wrong;
use serde_json::Value;
use std::path::Path;

fn judged(text: &str, kind: SchemaKind) -> Option<String> {
    let value: toml::Value = toml::from_str(text).unwrap();
    let value = serde_json::to_value(value).unwrap();
    let schema = schema(kind);
    wrong(&value, &schema, &schema, "")
}

#[test]
fn every_file_that_comes_with_the_tool_has_its_schema() {
    for (name, text) in EMBEDDED {
        let kind = match text {
            text if text.contains("[robot]") => SchemaKind::Robot,
            text if text.contains("kind = ") => SchemaKind::Trajectory,
            _ => SchemaKind::Campaign,
        };
        let found = judged(text, kind);
        assert_eq!(found, None, "{name} as {kind:?}");
    }
}

#[test]
fn what_the_reader_refuses_the_schema_refuses_too() {
    let head = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"revolute\"\n";
    assert_eq!(judged(head, SchemaKind::Robot), None);
    for more in [
        "colour = 1\n",
        "[filter]\ncutoff_hz = \"ten\"\n",
        "[filter]\nkind = \"magic\"\n",
        "[log.joint.q1]\nposition = true\n",
    ] {
        let found = judged(&format!("{head}{more}"), SchemaKind::Robot);
        assert!(found.is_some(), "{more}");
    }
    // a column by its number is right
    assert_eq!(
        judged(
            &format!("{head}[log.joint.q1]\nposition = 2\n"),
            SchemaKind::Robot
        ),
        None
    );
}

#[test]
fn committed_results_have_the_schema_of_their_command() {
    let folder = Path::new(cft_ident_support::ROOT).join("docs/results");
    let mut seen = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|end| end != "json") {
            continue;
        }
        let value: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let kind = match value["schema"].as_str() {
            Some("cft-ident/friction/1") => SchemaKind::Friction,
            Some("cft-ident/lsq/1") => SchemaKind::Lsq,
            Some("cft-ident/validate/1") => SchemaKind::Validate,
            Some("cft-ident/diagnose/4") => SchemaKind::Diagnose,
            Some("cft-ident/drive/1") => SchemaKind::Drive,
            Some(other) => panic!("{other}"),
            None => continue,
        };
        let schema = schema(kind);
        assert_eq!(
            wrong(&value, &schema, &schema, ""),
            None,
            "{}",
            path.display()
        );
        seen += 1;
    }
    assert!(seen >= 10, "{seen}");
}

#[test]
fn documents_of_cheap_commands_have_their_schema() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, line) in [
        (
            SchemaKind::Simulate,
            "simulate -r configs/cft.toml --move q4 --seconds 8 --seed 1 -o a.csv",
        ),
        (SchemaKind::Inspect, "inspect a.csv"),
        (SchemaKind::Convert, "convert a.csv a.mcap"),
        (
            SchemaKind::Excite,
            "excite --check configs/cft-excitation.toml -r configs/cft.toml",
        ),
        (SchemaKind::New, "new mine --log a.csv"),
        (
            SchemaKind::Friction,
            "friction a.csv -r configs/cft.toml -o one.toml",
        ),
    ] {
        let done = assert_cmd::Command::cargo_bin("cft-ident")
            .unwrap()
            .current_dir(folder.path())
            .args(line.split_whitespace())
            .args(["--json", "-"])
            .assert()
            .success();
        let value: Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
        let schema = schema(kind);
        assert_eq!(wrong(&value, &schema, &schema, ""), None, "{line}");
    }
}
