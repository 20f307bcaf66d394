//! The HTML reports as the command line writes them: whole, small, the same bytes again, and nothing
//! in them that a file's name could turn into markup.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

/// Runs the tool in `folder`.
fn run(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
        .args(arguments)
        .arg("-q")
        .current_dir(folder)
        .output()
        .unwrap();
    let shown = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {shown}");
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// A log to fit, a minute to validate on at 1 kHz, and a model with friction fitted along.
fn campaign() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let robot = include_str!("../../configs/cft.toml").replace(
            "law = \"double-tanh\"",
            "law = \"viscous-coulomb\"\nfitted_with_inertias = true",
        );
        assert!(robot.contains("fitted_with_inertias"));
        std::fs::write(at.join("robot.toml"), robot).unwrap();
        let simulate = |motion: &str, seconds: &str, log: &str| {
            run(
                at,
                &[
                    "simulate",
                    "-r",
                    "configs/cft.toml",
                    "--reference",
                    motion,
                    "--seconds",
                    seconds,
                    "-o",
                    log,
                ],
            );
        };
        simulate("configs/cft-excitation.toml", "12", "id.csv");
        simulate("configs/cft-validation.toml", "60", "unseen.csv");
        run(
            at,
            &[
                "lsq",
                "id.csv",
                "-r",
                "robot.toml",
                "-o",
                "model.toml",
                "--report",
                "lsq.html",
            ],
        );
        folder
    });
    folder.path()
}

/// What every report keeps.
fn is_sound(html: &str) {
    assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n"));
    assert!(html.len() < 5_000_000, "{} bytes", html.len());
    let own = html.replace("http://www.w3.org/2000/svg", "");
    for word in ["http:", "https:", "src=", "href=\"/", "@import", "url("] {
        assert!(!own.contains(word), "{word}");
    }
    let folder = campaign().to_string_lossy();
    assert!(!html.contains(&*folder), "an absolute path");
    // base64 may spell anything
    let seen: String = html
        .split("<script")
        .map(|part| part.split_once("</script>").map_or(part, |(_, rest)| rest))
        .collect();
    assert!(!seen.contains("NaN") && !seen.contains("inf "));
    for id in html
        .match_indices("href=\"#")
        .map(|(at, m)| &html[at + m.len()..])
    {
        let id = &id[..id.find('"').unwrap()];
        assert_eq!(html.matches(&format!("id=\"{id}\"")).count(), 1, "{id}");
    }
}

/// Headings in their order.
fn headings(html: &str) -> Vec<&str> {
    let all = html.match_indices("<h2 id=").map(|(at, _)| {
        let rest = &html[at..];
        let from = rest.find('>').unwrap() + 1;
        &rest[from..rest.find("</h2>").unwrap()]
    });
    all.collect()
}

fn validate(folder: &Path, log: &str, threads: &str) -> String {
    let model = campaign().join("model.toml");
    let page = folder.join("page.html");
    run(
        campaign(),
        &[
            "validate",
            log,
            "-m",
            &model.to_string_lossy(),
            "--threads",
            threads,
            "--report",
            &page.to_string_lossy(),
        ],
    );
    read(&page)
}

#[test]
fn the_report_of_a_minute_is_whole_small_and_the_same_again() {
    let [a, b] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let page = validate(a.path(), "unseen.csv", "1");
    is_sound(&page);
    assert_eq!(page, validate(b.path(), "unseen.csv", "2"));
    assert_eq!(
        headings(&page),
        [
            "Parameters",
            "The robot in motion",
            "Friction",
            "Torque, measured and reconstructed",
            "The residual and its spectra",
            "Correlated parameters",
            "Data quality",
            "Where it came from"
        ]
    );
    // bars, and correlations; cards of the parameters, of the sketch, of friction, and of the residual joint by joint
    assert_eq!(page.matches("<figure>").count(), 2);
    assert_eq!(page.matches("<figure class=\"card").count(), 3 + 4);
    assert_eq!(page.matches("class=\"traces\">").count(), 1);
    let verdict = page.find("class=\"headline").unwrap();
    let table = page.find("<table").unwrap();
    assert!(verdict < table && table < page.find("<h2").unwrap());
    // words are kept whole by spans
    let plain = page.replace("<span>", "").replace("</span>", "");
    assert!(plain.contains("cft-ident validate unseen.csv -m model.toml</pre>"));
    println!("{} bytes", page.len());
}

#[test]
fn a_fit_tells_what_it_leaves_open_and_a_log_used_twice_is_no_test() {
    let page = read(&campaign().join("lsq.html"));
    is_sound(&page);
    assert!(headings(&page).contains(&"Condition and least certain combination"));
    assert!(page.contains("least certain combination"));
    let folder = tempfile::tempdir().unwrap();
    let page = validate(folder.path(), "id.csv", "2");
    assert!(page.contains("id.csv was used to make this model"));
}

#[test]
fn a_motion_is_reported_before_the_robot_moves() {
    let at = campaign();
    run(
        at,
        &[
            "excite",
            "--check",
            "configs/table3.toml",
            "--report",
            "motion.html",
        ],
    );
    let page = read(&at.join("motion.html"));
    is_sound(&page);
    assert!(page.contains("The motion keeps every limit."));
    assert_eq!(
        headings(&page),
        [
            "Expected parameters",
            "Positions, speeds and drives",
            "Spectrum",
            "Where it came from"
        ]
    );
    assert_eq!(page.matches("class=\"traces\">").count(), 1);
}

#[test]
fn a_diagnosis_shows_what_was_added_and_what_was_not() {
    let at = campaign();
    // a ripple that the parts of the data agree on, beside friction that the model declares without its saturating terms
    for (log, seconds, motion) in [
        ("rippled.csv", "12", "configs/cft-excitation.toml"),
        ("rippled-unseen.csv", "15", "configs/cft-validation.toml"),
    ] {
        let line = format!(
            "simulate -r configs/cft.toml --reference {motion} --seconds {seconds} \
             --effect ripple:q1:order=14,sin=15 -o {log}"
        );
        run(at, &line.split_whitespace().collect::<Vec<_>>());
    }
    for line in [
        "lsq rippled.csv -r robot.toml -o rippled.toml",
        "diagnose rippled.csv -m rippled.toml --holdout rippled-unseen.csv --report diagnosis.html",
    ] {
        run(at, &line.split_whitespace().collect::<Vec<_>>());
    }
    let page = read(&at.join("diagnosis.html"));
    is_sound(&page);
    let said = page.replace("<span>", "").replace("</span>", "");
    assert!(
        said.contains("error in motion, on held-out data") && said.contains("usual"),
        "{said}"
    );
    // the first screen: errors per joint as bars, and what to do next
    let first = &page[..page.find("<h2").unwrap()];
    assert!(first.contains("Relative torque error on held-out data"));
    assert!(first.contains("95 % confidence interval") && first.contains("Next: "));
    // a card per effect
    assert!(page.contains("residual without the effect"));
    assert!(page.contains("rms with this force left out"));
    let remedies = page.matches("<p>What to do: ").count();
    assert!(remedies > 0);
    let headings = headings(&page);
    for heading in [
        "What the model lacks",
        "What is left",
        "Candidates that were not chosen",
        "Data quality",
    ] {
        assert!(headings.contains(&heading), "{headings:?}");
    }
    // bars, and the intervals of the parameters; cards of each effect, of the sketch, of friction, of the joints with something left, of the correlations, and of the residual
    // joint by joint
    assert_eq!(page.matches("<figure>").count(), 2);
    let cards = page.matches("<figure class=\"card").count();
    let left = page.matches("<figcaption>What is left of").count();
    assert!(left > 0);
    assert_eq!(cards, remedies + 2 + left + 5);
}

#[cfg(unix)]
#[test]
fn the_name_of_a_log_never_becomes_markup() {
    let name = "<script>alert(1)&\"'.csv";
    let copy = campaign().join(name);
    std::fs::copy(campaign().join("id.csv"), &copy).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let page = validate(folder.path(), name, "2");
    is_sound(&page);
    // the data of the traces, and the viewer
    assert_eq!(page.matches("<script").count(), 2);
    assert_eq!(page.matches("</script").count(), 2);
    assert!(
        page.matches("&lt;script&gt;alert(1)&amp;&quot;&#39;.csv")
            .count()
            > 3
    );
}

#[test]
fn a_report_of_another_ending_is_a_usage_error() {
    let output = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
        .args(["validate", "a.csv", "-m", "m.toml", "--report", "a.pdf"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let shown = String::from_utf8_lossy(&output.stderr);
    assert!(shown.contains("must end in .html"), "{shown}");
}
