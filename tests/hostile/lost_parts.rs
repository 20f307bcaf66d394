//! A model file that lost a part is noticed, whatever the part.

use crate::bench::Bench;

#[test]
fn a_model_file_that_is_cut_off_anywhere_is_refused_or_says_what_it_says_whole() {
    let bench = Bench::new();
    let whole = bench.text("model.toml");
    let said = bench.run("validate good.csv -m model.toml").stdout;
    let ends: Vec<usize> = whole.match_indices('\n').map(|(at, _)| at + 1).collect();
    let provenance = whole.find("[[provenance.inputs]]").unwrap();
    let (mut refused, mut read) = (0, 0);
    for end in ends {
        bench.file("cut.toml", &whole[..end]);
        let ended = bench.run("validate good.csv -m cut.toml");
        match ended.status {
            // the end of the last input: the model is whole
            Some(0) if end > provenance => {
                let said = String::from_utf8_lossy(&said).replace("model.toml", "cut.toml");
                assert_eq!(String::from_utf8_lossy(&ended.stdout), said);
                read += 1;
            }
            Some(3) => {
                assert!(
                    ended.stderr.contains("error: cut.toml:"),
                    "{}",
                    ended.stderr
                );
                refused += 1;
            }
            other => panic!("{other:?} after {end} bytes: {}", ended.stderr),
        }
    }
    assert!(refused > 50 && read > 0, "{refused} {read}");
}

#[test]
fn every_table_that_is_taken_out_of_a_model_file_is_missed_by_every_command() {
    let bench = Bench::new();
    let whole = bench.text("model.toml");
    let parts: Vec<&str> = whole.split_inclusive("\n\n").collect();
    let mut tables = 0;
    for lost in 0..parts.len() {
        let is_table =
            parts[lost].contains("[[parameter]]") || parts[lost].contains("[covariance]");
        if !is_table && !parts[lost].contains("[residual_std]") {
            continue;
        }
        tables += 1;
        let kept = (0..parts.len())
            .filter(|at| *at != lost)
            .map(|at| parts[at]);
        bench.file("lost.toml", kept.collect::<String>());
        for line in [
            "validate good.csv -m lost.toml",
            "diagnose good.csv -m lost.toml -o out.toml",
            "torque good.csv -m lost.toml -o out.csv",
            "export -m lost.toml --c out.h",
            "compare model.toml lost.toml",
            "simulate -r slide.toml -m lost.toml -o out.csv",
        ] {
            bench.refuses(
                line,
                3,
                &["lost.toml:", "contents.", "a part of the file was lost"],
            );
        }
    }
    assert!(tables >= 6, "{tables}");
}

#[test]
fn a_model_file_of_version_0_1_is_read_with_a_warning_and_checked_by_its_robot() {
    let bench = Bench::new();
    let whole = bench.text("model.toml");
    let begin = whole.find("[contents]").unwrap();
    let end = whole.find("[robot]").unwrap();
    let old = format!("{}{}", &whole[..begin], &whole[end..]);
    bench.file("old.toml", &old);
    let ended = bench.run("validate good.csv -m old.toml --json -");
    assert_eq!(ended.status, Some(0), "{}", ended.stderr);
    assert!(
        ended
            .stderr
            .contains("warning: old.toml: has no [contents]"),
        "{}",
        ended.stderr
    );
    let document: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    let warnings = document["warnings"].as_array().unwrap();
    let shown = |w: &serde_json::Value| w.as_str().is_some_and(|w| w.contains("no [contents]"));
    assert_eq!(warnings.iter().filter(|w| shown(w)).count(), 1);
    // cut where the table of the offset begins: the robot file asks for one
    let offset = old.find("name = \"offset\"").unwrap();
    let cut = old[..offset].rfind("[[parameter]]").unwrap();
    bench.file("old.toml", &old[..cut]);
    for line in [
        "validate good.csv -m old.toml",
        "diagnose good.csv -m old.toml",
        "torque good.csv -m old.toml -o out.csv",
        "export -m old.toml --c out.h",
    ] {
        bench.refuses(line, 3, &["old.toml", "`offset:slide` is missing"]);
    }
}

#[test]
fn values_may_be_edited_and_tables_added_by_hand() {
    let bench = Bench::new();
    let whole = bench.text("model.toml");
    let at = whole.find("\nvalue = ").unwrap() + 9;
    let end = at + whole[at..].find('\n').unwrap();
    let effect = "\n[[effect]]\nname = \"ripple\"\njoint = \"slide\"\n[effect.parameters]\n\
                  order = { value = 20.0 }\nsin = { value = 0.1 }\ncos = { value = 0.0 }\n";
    let edited = format!("{}12.5{}{effect}", &whole[..at], &whole[end..]);
    bench.file("edited.toml", edited);
    let ended = bench.run("validate good.csv -m edited.toml");
    assert_eq!(ended.status, Some(0), "{}", ended.stderr);
    assert!(!ended.stderr.contains("contents"), "{}", ended.stderr);
}
