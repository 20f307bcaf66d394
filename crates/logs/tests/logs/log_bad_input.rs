//! Every log that cannot be used is answered with file, line, what is wrong and what to do.

use std::path::PathBuf;

use crate::log_support;

use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{Block, Layout, LogError, LogSpec, Provenance, Reader};

/// Reads a log to its end.
fn read(spec: &str, layout: &Layout) -> Result<Vec<Block>, LogError> {
    let mut reader = Reader::open(&spec.parse::<LogSpec>()?, layout)?;
    let mut blocks = Vec::new();
    let mut block = Block::default();
    while reader.read(&mut block)? {
        blocks.push(block.clone());
    }
    assert!(
        !reader.read(&mut block)?,
        "a finished reader stays finished"
    );
    Ok(blocks)
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join("log.csv");
        std::fs::write(&path, content).unwrap();
        path
    }
}

fn layout() -> Layout {
    Layout::joint_columns(&["q1"])
}

#[test]
fn a_log_is_parsed_no_further_where_reading_is_to_end() {
    let folder = Folder::new();
    let rows = (0..20_000).map(|k| format!("{},{k},1\n", f64::from(k) / 100.0));
    let path = folder.file(format!("t,q_q1,tau_q1\n{}", rows.collect::<String>()));
    let spec = path.to_string_lossy().parse::<LogSpec>().unwrap();
    let ended = Reader::open_until(&spec, &layout(), &|| true);
    assert!(matches!(ended, Err(LogError::Interrupted)));
    assert!(Reader::open_until(&spec, &layout(), &|| false).is_ok());
}

#[track_caller]
fn refused(spec: &str, layout: &Layout, words: &[&str]) {
    log_support::says(&read(spec, layout).unwrap_err().to_string(), words);
}

/// The message for a log of joint q1 with this content.
fn message(content: impl AsRef<[u8]>) -> String {
    let folder = Folder::new();
    let path = folder.file(content);
    let error = read(&path.to_string_lossy(), &layout()).expect_err("the log cannot be used");
    let text = error.to_string();
    assert!(text.contains("log.csv"), "the file is named: {text}");
    assert!(
        !text.chars().any(char::is_control),
        "one clean line: {text:?}"
    );
    text
}

#[track_caller]
fn says(content: impl AsRef<[u8]>, words: &[&str]) {
    log_support::says(&message(content), words);
}

#[test]
fn a_missing_column_is_named_with_its_nearest_name_and_the_key_that_maps_it() {
    says(
        "t,q_q1,tau1\n0,1,2\n1,2,3\n",
        &["log.csv:1", "`tau_q1`", "torque of q1", "`tau1`", "[log]"],
    );
    says(
        "# made by hand\n\nt,q,tau\n0,1,2\n",
        &["log.csv:3", "`q_q1`", "t, q, tau"],
    );
}

#[test]
fn an_empty_file_a_lone_header_and_one_row_are_distinguished() {
    says("", &["is empty"]);
    says("\n\n \n", &["is empty"]);
    says("# nothing but a comment\n", &["0 row(s)"]);
    says("t,q_q1,tau_q1\n", &["0 row(s)"]);
    says("t,q_q1,tau_q1\n0,1,2\n", &["1 row(s)", "two at least"]);
}

#[test]
fn a_file_without_a_header_is_asked_to_get_one() {
    says(
        "0,1,2\n1,2,3\n",
        &["log.csv:1", "no header", "t,q_q1,tau_q1"],
    );
}

#[test]
fn nan_infinity_and_text_in_a_number_are_reported_with_line_and_column() {
    says(
        "t,q_q1,tau_q1\n0,1,2\n1,NaN,3\n",
        &["log.csv:3", "`q_q1`", "NaN", "delete the rows"],
    );
    says(
        "t,q_q1,tau_q1\n0,1,inf\n1,2,3\n",
        &["log.csv:2", "`tau_q1`", "inf"],
    );
    says(
        "t,q_q1,tau_q1\n0,1,2\n1,oops,3\n",
        &["log.csv:3", "`q_q1`", "`oops`", "no number"],
    );
    says(
        "t,q_q1,tau_q1\n0,1,2\n1,,3\n",
        &["log.csv:3", "`q_q1`", "without a measurement"],
    );
}

#[test]
fn positions_and_torques_in_rows_of_their_own_are_told_from_single_empty_cells() {
    let table = |row: &dyn Fn(u32) -> String| -> String {
        let rows = (0..12).map(|k| format!("{}{}\n", f64::from(k) / 8.0, row(k)));
        ["t,q_q1,tau_q1\n".to_owned()]
            .into_iter()
            .chain(rows)
            .collect()
    };
    let turns = table(&|k| [",1,", ",,2"][k as usize % 2].to_owned());
    let words = ["log.csv:2", "`tau_q1`", "rows of their own", "d['q_q1']"];
    says(turns, &words);
    // some rows hold both, where the two clocks meet
    let some = table(&|k| [",1,2", ",,2", ",1,"][k as usize % 3].to_owned());
    says(some, &["log.csv:3", "`q_q1`", "rows of their own"]);
    let single = table(&|k| match k {
        5 => ",,2".to_owned(),
        8 => ",1,".to_owned(),
        _ => ",1,2".to_owned(),
    });
    says(single, &["log.csv:7", "`q_q1`", "without a measurement"]);
    // torques at half the rate of the positions have no clock of their own
    let half = table(&|k| [",1,2", ",1,"][k as usize % 2].to_owned());
    says(half, &["log.csv:3", "`tau_q1`", "without a measurement"]);
}

#[test]
fn a_decimal_comma_among_points_and_half_a_clock_time_are_recognised() {
    says(
        "t;q_q1;tau_q1\n0;1,5;2.5\n1;2;3\n",
        &["log.csv:2", "`1,5`", "decimal points"],
    );
    says(
        "t,q_q1,tau_q1\n10:00,1,2\n10:01,1,2\n",
        &["log.csv:2", "`t`", "seconds from the start", "2024-05-01T"],
    );
}

#[test]
fn lines_are_counted_through_comments_blank_lines_and_carriage_returns() {
    for end in ["\n", "\r\n"] {
        let lines = [
            "# comment",
            "t,q_q1,tau_q1",
            "",
            "0,1,2",
            "# another",
            "",
            "1,x,3",
        ];
        says(lines.join(end), &["log.csv:7", "`x`"]);
    }
}

#[test]
fn time_that_stands_still_runs_backwards_or_repeats_a_row_is_distinguished() {
    says(
        "t,q_q1,tau_q1\n0,1,2\n1,2,3\n1,2,4\n",
        &["log.csv:4", "stands still", "1 s"],
    );
    says(
        "t,q_q1,tau_q1\n0,1,2\n1,2,3\n0.5,2,4\n",
        &["log.csv:4", "backwards", "from 1 s to 0.5 s"],
    );
    says(
        "t,q_q1,tau_q1\n0,1,2\n1,2,3\n1,2,3\n",
        &["log.csv:4", "repeats the row before", "delete duplicate"],
    );
}

#[test]
fn time_is_checked_from_one_block_to_the_next() {
    let mut text = String::from("t,q_q1,tau_q1\n");
    for row in 0..Block::ROWS {
        text.push_str(&format!("{row},1,{row}\n"));
    }
    text.push_str("3,1,2\n");
    says(
        text,
        &[&format!("log.csv:{}", Block::ROWS + 2), "backwards"],
    );
}

#[test]
fn a_column_that_is_named_twice_is_refused() {
    says(
        "t,q_q1,tau_q1,q_q1\n0,1,2,3\n",
        &["log.csv:1", "`q_q1`", "2 times"],
    );
}

#[test]
fn a_header_in_degrees_is_refused_until_the_robot_file_says_degrees() {
    let folder = Folder::new();
    let path = folder.file("t,q_arm [deg],tau_arm [Nm]\n0,180,2\n1,90,3\n");
    let spec = path.to_string_lossy();
    let head = "[robot]\nmodel = \"single-joint\"\njoint = \"arm\"\nkind = \"revolute\"\n";
    let robot = RobotFile::parse("arm.toml", head).unwrap();
    let words = ["log.csv:1", "in deg", "read in rad", "\"deg\""];
    refused(&spec, &robot.layout(), &words);
    let robot = RobotFile::parse(
        "arm.toml",
        &format!("{head}[log.joint.arm]\nposition_unit = \"deg\"\n"),
    )
    .unwrap();
    let blocks = read(&spec, &robot.layout()).unwrap();
    assert_eq!(
        blocks[0].q,
        [std::f64::consts::PI, std::f64::consts::FRAC_PI_2]
    );
}

#[test]
fn a_row_of_another_width_is_refused_but_not_a_trailing_comma() {
    says(
        "t,q_q1,tau_q1\n0,1\n1,2,3\n",
        &["log.csv:2", "2 fields", "names 3"],
    );
    says(
        "t,q_q1,tau_q1\n0,1,2\n1,2,3,4\n",
        &["log.csv:3", "4 fields", "names 3"],
    );
    let folder = Folder::new();
    let path = folder.file("t,q_q1,tau_q1,\n0,1,2,\n1,2,3, \n");
    assert_eq!(
        read(&path.to_string_lossy(), &layout()).unwrap()[0].len(),
        2
    );
}

#[test]
fn a_dead_torque_channel_of_a_joint_that_moves_is_refused() {
    says(
        "t,q_q1,tau_q1\n0,1,0\n1,2,0\n2,3,0\n",
        &["`tau_q1`", "0 in all 3 rows", "q1 moves"],
    );
    let folder = Folder::new();
    let still = folder.file("t,q_q1,tau_q1\n0,1,0\n1,1,0\n");
    assert_eq!(
        read(&still.to_string_lossy(), &layout()).unwrap()[0].tau,
        [0.0, 0.0]
    );
}

#[test]
fn a_span_without_two_rows_says_how_long_the_log_is() {
    let folder = Folder::new();
    let path = folder.file("t,q_q1,tau_q1\n0,1,2\n1,2,3\n4,2,3\n");
    let spec = format!("{}@5..9s", path.display());
    refused(&spec, &layout(), &["@5..9s", "0 row(s)", "lasts 4 s"]);
}

#[test]
fn files_of_other_kinds_are_named_for_what_they_are() {
    says(b"\xff\xfet\0,\0q\0".as_slice(), &["UTF-16", "UTF-8"]);
    says(b"t,q\0\0\0".as_slice(), &["binary", ".mcap", ".db3"]);
    says(b"\x89MCAP0\r\n".as_slice(), &["holds no message", "byte 8"]);
    says(
        b"SQLite format 3\0".as_slice(),
        &["no rosbag2 database", "ros2 bag info"],
    );
    says(b"\x28\xb5\x2f\xfd....".as_slice(), &["cannot be read"]);
    says(b"\x1f\x8b....".as_slice(), &["cannot be read"]);
}

#[test]
fn a_missing_file_and_a_folder_are_read_errors_with_a_remedy() {
    let folder = Folder::new();
    let missing = folder.0.path().join("none.csv");
    let words = ["none.csv", "check the path"];
    refused(&missing.to_string_lossy(), &layout(), &words);
    let folder = folder.0.path().to_string_lossy();
    refused(&folder, &layout(), &["name a file inside"]);
}

#[test]
fn a_line_or_a_quote_that_never_ends_is_refused_before_it_fills_the_memory() {
    let mut text = String::from("t,q_q1,tau_q1\n0,1,2\n1,\"");
    text.push_str(&"7\n".repeat(2 << 20));
    says(text, &["longer than 1048576 bytes", "quote"]);
    let mut text = String::from("t,q_q1,tau_q1\n0,1,2\n1,");
    text.push_str(&"7".repeat(3 << 20));
    says(text, &["log.csv:3", "longer than 1048576 bytes"]);
}

#[test]
fn control_characters_in_names_and_fields_are_escaped_in_messages() {
    says("t,q\u{1b}[31m,tau_q1\n0,1,2\n", &["\\u{1b}[31m"]);
    says("t,q_q1,tau_q1\n0,\u{7}bell,2\n", &["\\u{7}bell"]);
    says(
        b"t,q_q1,tau_q1\n0,\xff\xfe,2\n".as_slice(),
        &["log.csv:2", "no number"],
    );
}

#[test]
fn a_long_path_is_shown_whole_and_a_long_name_is_cut() {
    let folder = Folder::new();
    let deep = folder.0.path().join("a".repeat(150));
    refused(&deep.to_string_lossy(), &layout(), &[&"a".repeat(150)]);
    let text = message(format!("t,{},tau_q1\n0,1,2\n", "b".repeat(5000)));
    assert!(text.len() < 600, "{text}");
}

#[test]
fn raw_channels_that_belong_to_no_pose_are_reported_with_their_line() {
    let robot = RobotFile::load("configs/cft.toml".as_ref()).unwrap();
    let folder = Folder::new();
    let path = folder.file("t,x_c1,x_c2,x_c3,x_c4,u_1,u_2,u_3,u_4\n0,-0.1343,0.2766,2.4,0.0869,1,1,1,1\n1,-0.1343,27.66,2.4,0.0869,1,1,1,1\n");
    let words = ["log.csv:3", "27.66", "[log.actuator]"];
    refused(&path.to_string_lossy(), &robot.layout(), &words);
}

#[test]
fn the_provenance_names_the_file_without_its_folder() {
    let folder = Folder::new();
    let path = folder.file("abc");
    assert_eq!(Provenance::of_file(&path).unwrap().name, "log.csv");
}
