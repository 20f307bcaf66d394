//! Numbers that cannot be worked with are refused where they stand.

use crate::bench::{Bench, slide_log};

/// `text` with the number behind the first `key = ` replaced.
fn with_value(text: &str, key: &str, number: &str) -> String {
    let at = text.find(key).unwrap() + key.len();
    let end = at + text[at..].find(['\n', ',', ']']).unwrap();
    format!("{}{number}{}", &text[..at], &text[end..])
}

#[test]
fn a_log_with_numbers_beyond_the_range_is_refused_with_its_line() {
    let bench = Bench::new();
    type Edit = fn(u32, &mut f64, &mut f64);
    let edits: [(Edit, &str); 4] = [
        (
            |k, _, tau| *tau = if k == 700 { 1e308 } else { *tau },
            "bad.csv:702: column `tau_slide`",
        ),
        (|_, q, _| *q *= 1e200, "bad.csv:3: column `q_slide`"),
        (|_, _, tau| *tau *= 1e200, "bad.csv:2: column `tau_slide`"),
        (
            |k, q, _| *q = if k == 3 { -1e31 } else { *q },
            "bad.csv:5: column `q_slide`",
        ),
    ];
    for (edit, place) in edits {
        bench.file("bad.csv", slide_log(2000, edit));
        for line in [
            "diagnose bad.csv -m model.toml -o out.toml",
            "diagnose good.csv -m model.toml --holdout bad.csv",
            "lsq bad.csv -r slide.toml -o out.toml",
            "friction bad.csv -r slide.toml -o out.toml",
            "validate bad.csv -m model.toml -o out.csv",
            "compare model.toml model.toml bad.csv",
            "torque bad.csv -m model.toml -o out.csv",
        ] {
            if !(line.starts_with("torque") && place.contains("tau")) {
                bench.refuses(line, 3, &[place, "beyond 1e30", "delete the rows"]);
            }
        }
    }
}

#[test]
fn numbers_that_are_read_pass_through_every_stage_without_a_panic() {
    let bench = Bench::new();
    // The ends of what is read: squares and fourth powers of it are still numbers.
    for (position, torque) in [
        (1e29, 1.0),
        (1.0, 1e29),
        (1e29, 1e29),
        (1e-200, 1.0),
        (1.0, 1e-200),
    ] {
        let scaled = |_: u32, q: &mut f64, tau: &mut f64| {
            *q *= position;
            *tau *= torque;
        };
        bench.file("scaled.csv", slide_log(2000, scaled));
        for line in [
            "diagnose scaled.csv -m model.toml",
            "lsq scaled.csv -r slide.toml -o out.toml",
            "friction scaled.csv -r slide.toml -o out.toml",
            "validate scaled.csv -m model.toml",
            "torque scaled.csv -m model.toml -o out.csv",
            "inspect scaled.csv -r slide.toml",
        ] {
            let ended = bench.run(line);
            let status = ended.status;
            assert!(
                matches!(status, Some(0 | 3 | 4)),
                "{line} {position} {torque}: {ended:?}"
            );
            assert!(
                !ended.stderr.contains("panicked"),
                "{line}: {}",
                ended.stderr
            );
        }
    }
}

#[test]
fn a_joint_that_stands_still_all_the_time_is_reported_and_ends_no_command_in_a_panic() {
    let bench = Bench::new();
    bench.file("still.csv", slide_log(2000, |_, q, _| *q = 0.1));
    for line in [
        "diagnose still.csv -m model.toml",
        "diagnose good.csv -m model.toml --holdout still.csv",
        "diagnose still.csv -m model.toml --keep",
        "lsq still.csv -r slide.toml -o out.toml",
        "lsq still.csv -r slide.toml -o out.toml --estimator irls",
        "friction still.csv -r slide.toml -o out.toml",
        "validate still.csv -m model.toml",
    ] {
        let ended = bench.run(line);
        assert!(matches!(ended.status, Some(0 | 3 | 4)), "{line}: {ended:?}");
        assert!(
            !ended.stderr.contains("panicked"),
            "{line}: {}",
            ended.stderr
        );
        assert!(
            ended.status == Some(0) || ended.stderr.contains("\nhint: "),
            "{line}: {ended:?}"
        );
    }
}

#[test]
fn every_number_of_a_file_has_a_range_and_its_line_is_reported() {
    let bench = Bench::new();
    let model = bench.text("model.toml");
    for (key, number) in [
        ("\nvalue = ", "1e308"),
        ("\nstd = ", "1e308"),
        ("matrix = [\n  [", "1e308"),
        ("\nslide = ", "1e308"),
        ("\nvalue = ", "nan"),
        ("\nstd = ", "inf"),
    ] {
        let text = with_value(&model, key, number);
        let line = 1 + text[..text.find(number).unwrap()].matches('\n').count();
        bench.file("bad.toml", &text);
        for command in [
            "diagnose good.csv -m bad.toml",
            "validate good.csv -m bad.toml",
            "torque good.csv -m bad.toml -o out.csv",
            "export -m bad.toml --c out.h",
            "simulate -r slide.toml -m bad.toml -o out.csv",
            "compare model.toml bad.toml",
        ] {
            let place = format!("bad.toml:{line}: ");
            bench.refuses(
                command,
                3,
                &[
                    &place,
                    &number.replace("nan", "NaN"),
                    "finite numbers of at most 1e30",
                ],
            );
        }
    }
    let robot = bench
        .text("slide.toml")
        .replace("speed = 2.0", "speed = 1e308");
    let line = 1 + robot[..robot.find("speed").unwrap()].matches('\n').count();
    bench.file("bad.toml", robot);
    bench.refuses(
        "simulate -r bad.toml -o out.csv",
        3,
        &[&format!("bad.toml:{line}: `limits.slide.speed`"), "1e30"],
    );
    let tiny = bench.text("bad.toml").replace("1e308", "1e-300");
    bench.file("bad.toml", tiny);
    bench.refuses(
        "simulate -r bad.toml -o out.csv",
        3,
        &[&format!("bad.toml:{line}"), "at least 1e-30"],
    );
    // a variance may be the square
    let text = with_value(&model, "matrix = [\n  [", "1e40");
    bench.file("wide.toml", text);
    assert_eq!(bench.run("validate good.csv -m wide.toml").status, Some(0));
}

#[test]
fn numbers_of_the_command_line_have_the_same_range() {
    let bench = Bench::new();
    for line in [
        "excite -r configs/cft.toml -o out.toml --frequency 1e300",
        "excite -r configs/cft.toml -o out.toml --frequency 1e-300",
        "simulate -r slide.toml --seconds 1e300 -o out.csv",
        "simulate -r slide.toml --position 1e308 -o out.csv",
        "validate good.csv -m model.toml --max-relative-error 1e-200",
    ] {
        let ended = bench.run(line);
        assert_eq!(ended.status, Some(2), "{line}: {ended:?}");
        assert!(
            ended.stderr.contains("1e30") || ended.stderr.contains("1e-30"),
            "{ended:?}"
        );
    }
}
