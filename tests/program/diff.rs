//! Two runs beside each other, by the documents that the commands wrote.

use crate::measured_support;

use assert_cmd::Command;
use measured_support::run;
use predicates::str::contains;

#[test]
fn a_fit_on_half_of_a_log_is_distinguished_from_the_fit_on_all_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    run(at, &["example", "ur10"]);
    for (log, name) in [("ur10/ur10.csv", "a"), ("ur10/ur10.csv@0..50%", "b")] {
        let model = format!("{name}.toml");
        let found = run(at, &["lsq", log, "-r", "ur10/ur10.toml", "-o", &model]);
        let text = serde_json::to_string(&found).unwrap();
        std::fs::write(at.join(format!("{name}.json")), text).unwrap();
    }
    let found = run(at, &["compare", "a.json", "b.json"]);
    assert_eq!(found["command"], "lsq");
    let parameters = found["parameters"].as_array().unwrap();
    assert!(parameters.len() > 20, "{}", parameters.len());
    for p in parameters {
        let [a, b] = ["a", "b"].map(|side| p[side]["value"].as_f64().unwrap());
        assert_eq!(p["difference"].as_f64().unwrap(), b - a);
    }
    let errors = found["errors"].as_array().unwrap();
    assert_eq!(errors.len(), 6);
    assert!(errors.iter().all(|e| e["a"] != e["b"]));
    // half of the log leaves parameters undetermined that the whole determines
    assert!(!found["verdicts"].as_array().unwrap().is_empty());
    let spans = found["changed_inputs"].as_array().unwrap();
    assert!(spans.iter().any(|input| input["span"] == "0..50%"));

    let same = run(at, &["compare", "a.json", "a.json"]);
    assert!(same["verdicts"].as_array().unwrap().is_empty());
    let zero = |p: &serde_json::Value| p["difference"].as_f64() == Some(0.0);
    assert!(same["parameters"].as_array().unwrap().iter().all(zero));
}

#[test]
fn files_that_are_no_documents_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("text.json", "{\n  no json\n}\n");
    write("other.json", "{\"a\": 1}\n");
    for (line, said) in [
        ("compare text.json other.json", "text.json:2: no JSON"),
        ("compare other.json other.json", "--json FILE"),
        ("compare none.json other.json", "none.json"),
    ] {
        Command::cargo_bin("cft-ident")
            .unwrap()
            .current_dir(folder.path())
            .args(line.split(' '))
            .assert()
            .code(3)
            .stderr(contains(said));
    }
}
