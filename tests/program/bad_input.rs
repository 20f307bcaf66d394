//! Input that cannot be used, at the boundary of the process: the status, a message with file, line
//! and remedy, and no output left behind. (What happens at Ctrl-C is in `interrupted.rs`.)

use std::fmt::Write;
use std::fs;
use std::path::Path;

use assert_cmd::Command;

/// A folder with a robot file, a good log and a model fitted to it.
struct Bench(tempfile::TempDir);

const SLIDE: &str = include_str!("../../fixtures/robots/slide.toml");

/// What a slide of 10 kg logs in 2 s at 1 kHz, `edit` applied to the lines.
fn log(edit: impl FnOnce(&mut Vec<String>)) -> String {
    let mut lines = vec!["t,q_slide,tau_slide".to_owned()];
    lines.extend((0..2000).map(|k| {
        let t = f64::from(k) / 1000.0;
        let (q, v) = (0.1 * (6.0 * t).sin(), 0.6 * (6.0 * t).cos());
        format!(
            "{t:.3},{q:.9},{:.6}",
            -360.0 * q + 5.0 * v + 3.0 * v.signum()
        )
    }));
    edit(&mut lines);
    lines.iter().fold(String::new(), |mut text, line| {
        let _ = writeln!(text, "{line}");
        text
    })
}

impl Bench {
    fn new() -> Self {
        let bench = Bench(tempfile::tempdir().unwrap());
        bench.file("slide.toml", SLIDE);
        bench.file("good.csv", &log(|_| {}));
        bench
    }

    /// A bench with `model.toml` on it, as `lsq` writes it.
    fn with_model() -> Self {
        let bench = Self::new();
        bench
            .tool("lsq good.csv -r slide.toml -o model.toml")
            .assert()
            .code(0);
        bench
    }

    fn file(&self, name: &str, text: &str) {
        fs::write(self.0.path().join(name), text).unwrap();
    }

    fn tool(&self, line: &str) -> Command {
        let mut command = Command::cargo_bin("cft-ident").unwrap();
        command
            .current_dir(self.0.path())
            .args(line.split_whitespace());
        command
    }

    /// Names and contents.
    fn files(&self) -> Vec<(String, Vec<u8>)> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut files: Vec<_> = entries
            .map(|entry| entry.unwrap())
            .map(|entry| {
                let name = entry.file_name().into_string().unwrap();
                (name, fs::read(entry.path()).unwrap_or_default())
            })
            .collect();
        files.sort();
        files
    }

    /// Runs `line`, which must end with `status`, say every one of `words` and a way out, and leave
    /// every file as it was.
    #[track_caller]
    fn refuses(&self, line: &str, status: i32, words: &[&str]) {
        let before = self.files();
        let output = self.tool(line).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{line}: {message}");
        assert!(output.stdout.is_empty(), "{line}");
        for word in words.iter().chain(&["error: ", "\nhint: "]) {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
        assert!(!message.contains(".part"), "a temporary name in: {message}");
        assert!(!message.contains("panicked"), "{message}");
        let names = |files: &[(String, Vec<u8>)]| -> Vec<String> {
            files.iter().map(|(name, _)| name.clone()).collect()
        };
        let after = self.files();
        assert_eq!(names(&before), names(&after), "{line}");
        assert!(before == after, "{line} changed a file");
    }

    /// Every command that reads logs refuses this one, with status 3.
    #[track_caller]
    fn refuses_log(&self, edit: impl FnOnce(&mut Vec<String>), words: &[&str]) {
        self.file("bad.csv", &log(edit));
        for line in [
            "lsq bad.csv -r slide.toml -o out.toml --json out.json",
            "lsq good.csv bad.csv -r slide.toml -o out.toml",
            "friction bad.csv -r slide.toml -o out.toml --plot out.svg",
            "validate bad.csv -m model.toml -o out.csv --plot out.svg --json -",
        ] {
            self.refuses(line, 3, words);
        }
    }
}

#[test]
fn a_missing_column_is_refused_with_the_key_that_maps_another() {
    Bench::with_model().refuses_log(
        |lines| lines[0] = "t,q_slide,torque".into(),
        &["bad.csv:1", "`tau_slide`", "[log", "t, q_slide, torque"],
    );
}

#[test]
fn an_empty_file_is_refused() {
    Bench::with_model().refuses_log(Vec::clear, &["bad.csv", "is empty", "record again"]);
}

#[test]
fn one_row_is_refused() {
    let words = ["bad.csv", "1 row(s)", "two at least"];
    Bench::with_model().refuses_log(|lines| lines.truncate(2), &words);
}

#[test]
fn nan_in_a_row_is_refused_with_its_line_and_column() {
    Bench::with_model().refuses_log(
        |lines| lines[999] = "0.998,NaN,1".into(),
        &["bad.csv:1000", "`q_slide`", "NaN", "delete the rows"],
    );
}

#[test]
fn text_in_a_number_is_refused_with_its_line_and_column() {
    Bench::with_model().refuses_log(
        |lines| lines[1500] = "1.499,0.1,12..5".into(),
        &[
            "bad.csv:1501",
            "`tau_slide`",
            "`12..5`",
            "correct the field",
        ],
    );
}

#[test]
fn time_that_stands_still_is_refused() {
    Bench::with_model().refuses_log(
        |lines| lines[100] = "0.098,0.05,1".into(),
        &["bad.csv:101", "stands still", "`t`", "clock"],
    );
}

#[test]
fn time_that_runs_backwards_is_refused() {
    Bench::with_model().refuses_log(
        |lines| lines[100] = "0.05,0.05,1".into(),
        &[
            "bad.csv:101",
            "backwards",
            "from 0.098 s to 0.05 s",
            "sort the rows",
        ],
    );
}

#[test]
fn duplicate_rows_are_refused() {
    Bench::with_model().refuses_log(
        |lines| lines.insert(100, lines[100].clone()),
        &[
            "bad.csv:102",
            "repeats the row before",
            "delete duplicate rows",
        ],
    );
}

#[test]
fn a_torque_channel_that_is_all_zero_is_refused() {
    Bench::with_model().refuses_log(
        |lines| {
            for line in &mut lines[1..] {
                let end = line.rfind(',').unwrap();
                line.replace_range(end.., ",0");
            }
        },
        &[
            "bad.csv",
            "`tau_slide`",
            "2000 rows",
            "slide moves",
            "check the channel",
        ],
    );
}

#[test]
fn a_joint_that_a_log_names_twice_is_refused() {
    Bench::with_model().refuses_log(
        |lines| {
            lines[0] = "t,q_slide,tau_slide,q_slide".into();
            lines[1..].iter_mut().for_each(|line| line.push_str(",0.5"));
        },
        &["bad.csv:1", "`q_slide`", "2 times", "delete all but one"],
    );
}

#[test]
fn a_joint_that_a_robot_file_names_twice_is_refused() {
    let bench = Bench::new();
    let twice = "\n[log.joint.slide]\nposition = \"a\"\n[log.joint.slide]\nposition = \"b\"\n";
    bench.file("bad.toml", &format!("{SLIDE}{twice}"));
    let words = ["bad.toml:13", "`slide`", "keep one"];
    bench.refuses("lsq good.csv -r bad.toml -o out.toml", 3, &words);
    let both =
        "[log]\ntorque_is = \"joint\"\n[log.joint.slide]\nposition = \"x\"\ntorque = \"x\"\n";
    bench.file("bad.toml", &format!("{SLIDE}{both}"));
    let words = ["bad.toml:14", "log.joint.slide.torque", "its own column"];
    bench.refuses("lsq good.csv -r bad.toml -o out.toml", 3, &words);
}

#[test]
fn degrees_in_a_header_are_refused_until_the_robot_file_declares_them() {
    let bench = Bench::new();
    let arm = SLIDE
        .replace("slide", "arm")
        .replace("prismatic", "revolute");
    bench.file("arm.toml", &arm);
    bench.file(
        "arm.csv",
        &log(|lines| lines[0] = "t,q_arm [deg],tau_arm".into()),
    );
    let words = [
        "arm.csv:1",
        "`q_arm [deg]`",
        "in deg",
        "read in rad",
        "[log.joint.arm]",
    ];
    bench.refuses("lsq arm.csv -r arm.toml -o out.toml", 3, &words);

    let declared = format!("{arm}\n[log.joint.arm]\nposition_unit = \"deg\"\n");
    bench.file("declared.toml", &declared);
    let run = bench
        .tool("lsq arm.csv -r declared.toml -o out.toml --json -")
        .assert()
        .code(0);
    let result: serde_json::Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    let inertia = result["parameters"][0]["value"].as_f64().unwrap();
    // 10 per degree and second squared
    assert!(
        (inertia / 10.0_f64.to_degrees() - 1.0).abs() < 1e-6,
        "{inertia}"
    );
    assert_eq!(result["parameters"][0]["unit"], "kg m^2");
}

#[test]
fn an_unknown_key_is_refused_in_every_kind_of_configuration() {
    let bench = Bench::with_model();
    bench.file("bad.toml", &SLIDE.replace("offset", "ofset"));
    let words = ["bad.toml:9", "`ofset`", "did you mean `offset`?"];
    bench.refuses("lsq good.csv -r bad.toml -o out.toml", 3, &words);
    bench.refuses("simulate -r bad.toml -o out.csv", 3, &words);

    let model = fs::read_to_string(bench.0.path().join("model.toml")).unwrap();
    bench.file("bad.toml", &model.replacen("verdict =", "verdic =", 1));
    let line = 1 + model
        .lines()
        .take_while(|l| !l.starts_with("verdict"))
        .count();
    let words = [
        &format!("bad.toml:{line}"),
        "`verdic`",
        "did you mean `verdict`?",
    ];
    bench.refuses("validate good.csv -m bad.toml -o out.csv", 3, &words);
    bench.refuses("torque good.csv -m bad.toml -o out.csv", 3, &words);

    bench.file(
        "bad.toml",
        "robot = \"slide.toml\"\n[logs]\nidentifcation = [\"good.csv\"]\n",
    );
    let words = [
        "bad.toml:3",
        "`identifcation`",
        "did you mean `identification`?",
    ];
    bench.refuses("identify bad.toml -o out", 3, &words);

    bench.file("bad.toml", "kindd = \"fourier\"\n");
    let line = "simulate -r configs/cft.toml --reference bad.toml -o out.csv";
    bench.refuses(line, 3, &["bad.toml:", "kindd"]);
}

#[test]
fn a_model_of_another_robot_is_refused() {
    let bench = Bench::with_model();
    let words = [
        "model.toml",
        "another robot",
        "single-joint slide",
        "cft",
        "give the model",
    ];
    let line = "lsq good.csv -r configs/cft.toml -m model.toml -o out.toml";
    bench.refuses(line, 3, &words);
    let line = "friction good.csv -r configs/cft.toml -m model.toml --joint q4 -o out.toml";
    bench.refuses(line, 3, &words);
    bench.refuses(
        "simulate -r configs/cft.toml -m model.toml -o out.csv",
        3,
        &words,
    );
    // a model brings its robot, and with it the columns that it wants
    bench.file("other.csv", "t,q_q1,tau_q1\n0,1,2\n1,2,3\n");
    let words = ["other.csv:1", "`q_slide`", "t, q_q1, tau_q1"];
    bench.refuses("validate other.csv -m model.toml -o out.csv", 3, &words);
}

#[test]
fn files_that_are_not_there_are_refused_with_their_names() {
    let bench = Bench::with_model();
    let words = ["none.csv", "check the path"];
    bench.refuses("lsq none.csv -r slide.toml -o out.toml", 3, &words);
    bench.refuses("lsq good.csv -r none.toml -o out.toml", 3, &["none.toml"]);
    bench.refuses(
        "validate good.csv -m none.toml -o out.csv",
        3,
        &["none.toml"],
    );
}

#[test]
fn an_unwritable_output_is_reported_before_the_log_is_read() {
    let bench = Bench::with_model();
    bench.file("bad.csv", "");
    for (output, words) in [
        ("none/out.toml", ["none/out.toml", "mkdir -p none"]),
        (".", [".", "name a file inside"]),
    ] {
        let line = format!("lsq bad.csv -r slide.toml -o {output}");
        bench.refuses(&line, 5, &words);
        let line = format!("validate bad.csv -m model.toml --json {output}");
        bench.refuses(&line, 5, &words);
    }
    bench.file("kept.toml", "mine");
    let kept = bench.0.path().join("kept.toml");
    let mut permissions = fs::metadata(&kept).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&kept, permissions).unwrap();
    let line = "lsq good.csv -r slide.toml -o kept.toml";
    bench.refuses(line, 5, &["kept.toml", "may write"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_and_the_device_stays() {
    let bench = Bench::with_model();
    for line in [
        "lsq good.csv -r slide.toml -o /dev/full",
        "friction good.csv -r slide.toml -o /dev/full",
        "validate good.csv -m model.toml --json /dev/full",
        "torque good.csv -m model.toml -o out.csv --json /dev/full",
        "simulate -r configs/cft.toml --seconds 0.1 -o out.csv --json /dev/full",
    ] {
        let output = bench.tool(line).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(5), "{line}: {message}");
        for word in ["/dev/full", "No space left", "\nhint: free some space"] {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
        assert!(!fs::metadata("/dev/full").unwrap().is_file());
    }
}

/// A limit on the size of files stands for a disk that fills up half-way.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_half_way_leaves_no_half_file_and_keeps_the_old_one() {
    let bench = Bench::with_model();
    bench.file("out.csv", "old");
    let tool = assert_cmd::cargo::cargo_bin("cft-ident");
    for line in [
        "validate good.csv -m model.toml -o out.csv",
        "torque good.csv -m model.toml -o out.csv",
        "simulate -r configs/cft.toml --seconds 2 -o out.csv",
    ] {
        let before = bench.files();
        let limited = format!(
            "trap '' XFSZ; ulimit -f 32; exec '{}' {line}",
            Path::new(&tool).display()
        );
        let output = std::process::Command::new("sh")
            .args(["-c", &limited])
            .current_dir(bench.0.path())
            .output()
            .unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(5), "{line}: {message}");
        for word in ["out.csv", "File too large", "\nhint: free some space"] {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
        assert!(!message.contains(".part"), "{message}");
        assert!(before == bench.files(), "{line} left something");
    }
}

#[test]
fn data_that_determine_nothing_end_with_status_4_and_write_nothing() {
    let bench = Bench::new();
    bench.file(
        "still.csv",
        &log(|lines| {
            for (k, line) in lines.iter_mut().enumerate().skip(1) {
                *line = format!("{:.3},0.1,1.5", k as f64 / 1000.0);
            }
        }),
    );
    let words = ["still.csv", "move", "back and forth"];
    bench.refuses("friction still.csv -r slide.toml -o out.toml", 4, &words);
    let line = "friction still.csv -r slide.toml --joint slide -o out.toml";
    bench.refuses(line, 4, &words);
}

#[test]
fn a_one_joint_log_that_the_friction_filter_cannot_hold_is_refused_with_a_span_to_take() {
    let bench = Bench::new();
    let mut text = String::from("t,q_slide,tau_slide\n");
    for k in 0..2_000_001_u32 {
        let there = k % 2000;
        let q = if there < 1000 { there } else { 2000 - there };
        let tau = i64::from(7 * k % 1001) - 500;
        let _ = writeln!(text, "{}.{:03},{q},{tau}", k / 1000, k % 1000);
    }
    bench.file("long.csv", &text);
    let words = ["long.csv: more than 2000000 rows", "FILE@0..600s"];
    bench.refuses("friction long.csv -r slide.toml -o f.toml", 3, &words);
}

#[test]
fn names_with_a_semicolon_stand_whole_in_every_error() {
    let bench = Bench::with_model();
    bench.file("my; log.csv", "t,q_slide,tau_slide\n0,0,x\n1,2,3\n");
    bench.file("my; robot.toml", "[robot]\nmodl = 1\n");
    let lines: [&[&str]; 9] = [
        &["inspect", "my; none.csv"],
        &["inspect", "my; log.csv", "-r", "my; robot.toml"],
        &["lsq", "my; log.csv", "-r", "slide.toml", "-o", "m.toml"],
        &["lsq", "my; none.csv", "-r", "slide.toml", "-o", "m.toml"],
        &["lsq", "good.csv", "-r", "my; robot.toml", "-o", "m.toml"],
        &[
            "lsq",
            "good.csv",
            "-r",
            "slide.toml",
            "-o",
            "my; folder/m.toml",
        ],
        &["validate", "my; log.csv", "-m", "model.toml"],
        &["show", "my; none.toml"],
        &["compare", "my; none.json", "my; none.json"],
    ];
    for line in lines {
        let output = bench.tool("").args(line).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let first = said.lines().find(|l| l.starts_with("error: "));
        let whole = first.is_some_and(|l| l.contains("my; ") && l.contains('.'));
        assert!(whole && !output.status.success(), "{line:?}: {said}");
    }
}
