//! Text logs in every dress that is read, and what is written is read back.

use std::path::Path;

use cft_ident_core::robot::cft::actuation::ENCODER_SCALE;
use cft_ident_core::robot::cft::{LaboratorySetup, pantograph};
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{Block, DeclaredChannels, Layout, LogSpec, Reader, TimeUnit};
use cft_ident_logs::output::LogWriter;
use proptest::prelude::*;

use crate::log_support::{finite, says};

fn read(path: &Path, layout: &Layout) -> (Block, Reader) {
    crate::log_support::read(&path.to_string_lossy(), layout)
}

fn read_text(text: &str, layout: &Layout) -> Block {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    read(&path, layout).0
}

#[test]
fn every_delimiter_line_ending_comment_and_quote_gives_the_same_rows() {
    let layout = Layout::joint_columns(&["q1"]);
    let plain = read_text("t,q_q1,tau_q1\n0,1.5,-2\n0.5,2,1e-3\n", &layout);
    assert_eq!(
        (&plain.t[..], &plain.q[..], &plain.tau[..]),
        (&[0.0, 0.5][..], &[1.5, 2.0][..], &[-2.0, 1e-3][..])
    );
    for text in [
        "t;q_q1;tau_q1\n0;1.5;-2\n0.5;2;1e-3\n",
        "t\tq_q1\ttau_q1\n0\t1.5\t-2\n0.5\t2\t1e-3\n",
        "t q_q1 tau_q1\n0 1.5 -2\n0.5 2 1e-3\n",
        "  t    q_q1   tau_q1\n  0    1.5    -2\n  0.5  2      1e-3  \n",
        "t,q_q1,tau_q1\r\n0,1.5,-2\r\n0.5,2,1e-3\r\n",
        "t,q_q1,tau_q1\r0,1.5,-2\r0.5,2,1e-3\r",
        "\u{feff}t,q_q1,tau_q1\n0,1.5,-2\n0.5,2,1e-3",
        "# a comment, with commas; and more\nt,q_q1,tau_q1\n# 1,2,3\n0,1.5,-2\n\n0.5,2,1e-3\n",
        "% matlab\nt, q_q1, tau_q1\n0, 1.5, -2\n0.5, 2, 1e-3\n",
        "# t q_q1 tau_q1\n0 1.5 -2\n0.5 2 1e-3\n",
        "\"t\",\"q_q1\",\"tau_q1\"\n\"0\",\"1.5\",\"-2\"\n\"0.5\",2,1e-3\n",
        "tau_q1,note,q_q1,t\n-2,\"held; at, rest\",1.5,0\n1e-3,,2,0.5\n",
        "t [s],q_q1 [m],tau_q1 (N)\n0,1.5,-2\n0.5,2,1e-3\n",
    ] {
        let block = read_text(text, &layout);
        assert_eq!(
            (&block.t, &block.q, &block.tau),
            (&plain.t, &plain.q, &plain.tau),
            "{text:?}"
        );
    }
}

#[test]
fn units_signs_scales_and_offsets_of_the_robot_file_are_applied() {
    let robot = RobotFile::parse(
        "arm.toml",
        r#"
        [robot]
        model = "single-joint"
        joint = "arm"
        kind = "revolute"
        [log]
        time = "stamp"
        time_unit = "ms"
        delimiter = "semicolon"
        torque_is = "motor"
        [log.joint.arm]
        position = "angle"
        position_unit = "deg"
        position_sign = -1
        position_offset = 0.5
        velocity = "rate"
        torque = "motor torque"
        torque_scale = 50
        torque_sign = -1
        torque_offset = 0.25
        "#,
    )
    .unwrap();
    let block = read_text(
        "stamp;angle;rate;motor torque\n1000;90;180;2\n1500;180;0;4\n",
        &robot.layout(),
    );
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_eq!(block.t, [1.0, 1.5]);
    assert_eq!(block.q, [0.5 - quarter, 0.5 - 2.0 * quarter]);
    assert_eq!(block.dq, [-2.0 * quarter, 0.0]);
    assert_eq!(block.tau, [0.25 - 100.0, 0.25 - 200.0]);
}

#[test]
fn raw_channels_of_the_cft_robot_come_out_as_joint_positions_and_torques() {
    let robot = RobotFile::load("configs/cft.toml".as_ref()).unwrap();
    let rows = [
        [-0.1343, 0.2766, 2.4, 0.0869, 0.5, -0.25, 0.1, 1.0],
        [-0.1, 0.3, 2.5, 0.1, -0.5, 0.75, 0.2, -1.0],
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("raw.csv");
    let names = [
        "t", "x_c1", "x_c2", "x_c3", "x_c4", "u_1", "u_2", "u_3", "u_4",
    ];
    let mut log = LogWriter::create(&path, &names).unwrap();
    for (index, row) in rows.iter().enumerate() {
        log.row(std::iter::once(index as f64 * 1e-3).chain(*row))
            .unwrap();
    }
    log.commit().unwrap();
    let (block, reader) = read(&path, &robot.layout());
    assert_eq!(reader.layout().channels, DeclaredChannels::Actuator);
    assert!(robot.zero_order_hold(reader.layout().channels));
    for (index, row) in rows.iter().enumerate() {
        let q = pantograph::joints(&[row[0], row[1], row[2], row[3]]).unwrap();
        let tau = LaboratorySetup::Tuedacs.volts_to_torques(&q, &[row[4], row[5], row[6], row[7]]);
        assert_eq!(block.q[4 * index..][..4], q);
        assert_eq!(block.tau[4 * index..][..4], tau);
    }
    let (volts, _) = read(&path, &robot.volts_layout());
    assert!(volts.q.is_empty());
    assert_eq!(volts.tau[..4], rows[0][4..]);
    let (still, _) = read(&path, &robot.layout().without_torques());
    assert_eq!((&still.q, still.tau.len()), (&block.q, 0));
}

#[test]
fn encoder_counts_with_a_homing_offset_are_scaled_by_table_5() {
    let text = std::fs::read_to_string(Path::new(cft_ident_support::ROOT).join("configs/cft.toml"))
        .unwrap();
    let mut counts = text.replace(
        "[control]",
        "[log.actuator.x_c4]\nposition_unit = \"counts\"\nhome = 0.05\n[control]",
    );
    counts.push_str("[log.actuator.x_c3]\nposition = \"enc3\"\nposition_unit = \"counts\"\nposition_sign = -1\nhome = 2.4\n");
    let robot = RobotFile::parse("counts.toml", &counts).unwrap();
    let log = "t,x_c1,x_c2,enc3,x_c4,u_1,u_2,u_3,u_4\n0,-0.13,0.27,1000,2000,1,1,1,1\n1,-0.13,0.27,0,0,1,1,1,1\n";
    let block = read_text(log, &robot.layout());
    let first = pantograph::joints(&[
        -0.13,
        0.27,
        2.4 - 1000.0 * ENCODER_SCALE[2],
        0.05 + 2000.0 * ENCODER_SCALE[3],
    ])
    .unwrap();
    let second = pantograph::joints(&[-0.13, 0.27, 2.4, 0.05]).unwrap();
    for (found, expected) in block.q.iter().zip(first.iter().chain(&second)) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }
}

#[test]
fn blocks_hold_at_most_4096_rows_and_know_their_first_line() {
    let mut text = String::from("t,q_q1,tau_q1\n");
    for row in 0..10_000 {
        text.push_str(&format!("{row},0,1\n"));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    // whole seconds are said to be seconds: a log whose times count 0, 1, 2, .. is one in milliseconds
    let mut layout = Layout::joint_columns(&["q1"]);
    layout.section.time_unit = Some(TimeUnit::Second);
    let mut reader = Reader::open(&LogSpec::whole(&path), &layout).unwrap();
    let mut block = Block::default();
    let mut found = Vec::new();
    while reader.read(&mut block).unwrap() {
        found.push((block.len(), block.line0, block.t[0]));
    }
    assert_eq!(
        found,
        [(4096, 2, 0.0), (4096, 4098, 4096.0), (1808, 8194, 8192.0)]
    );
    assert_eq!((reader.samples(), reader.duration_s()), (10_000, 9999.0));
}

fn single(log: &str) -> Layout {
    let head = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"revolute\"\n";
    RobotFile::parse("r.toml", &format!("{head}{log}"))
        .unwrap()
        .layout()
}

#[test]
fn a_log_without_a_header_is_read_by_the_numbers_of_its_columns() {
    let layout = single(
        "[log]\ntime = 2\ntorque_is = \"joint\"\n[log.joint.q1]\nposition = 3\ntorque = 1\nvelocity = 4\n",
    );
    for text in [
        "-2,0,1.5,7\n1e-3,0.5,2,8\n",
        "# a comment\n-2 0 1.5 7\n1e-3 0.5 2 8",
        "tau;t;q;dq\n-2;0;1.5;7\n1e-3;0.5;2;8\n",
        "a,a,a,a\n-2,0,1.5,7\n1e-3,0.5,2,8\n",
    ] {
        let block = read_text(text, &layout);
        assert_eq!(block.t, [0.0, 0.5], "{text:?}");
        assert_eq!((&block.q, &block.dq), (&vec![1.5, 2.0], &vec![7.0, 8.0]));
        assert_eq!(block.tau, [-2.0, 1e-3]);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, "1,2,3\n2,3,4\n").unwrap();
    let refused = Reader::open(&LogSpec::whole(&path), &layout).unwrap_err();
    says(&refused.to_string(), &["`#4`", "velocity"]);
}

#[test]
fn epoch_times_keep_their_nanoseconds_and_are_counted_from_the_first() {
    let steps = ["0.000000000", "0.000999999", "0.002000001"];
    let expected = [0.0, 0.000999999, 0.002000001];
    let log = |unit: &str| single(&format!("[log]\ntime_unit = \"{unit}\"\n"));
    let rows = |stamp: &dyn Fn(usize) -> String| {
        let rows = (0..3).map(|row| format!("{},{row},1\n", stamp(row)));
        format!("t,q_q1,tau_q1\n{}", rows.collect::<String>())
    };
    let seconds = rows(&|row| format!("1700000000{}", &steps[row][1..]));
    let ns = rows(&|row| format!("1700000000{}", &steps[row][2..]));
    let ms = rows(&|row| format!("1700000000{}.{}", &steps[row][2..5], &steps[row][5..]));
    let iso = rows(&|row| format!("2023-11-14T22:13:20{}Z", &steps[row][1..]));
    let zone = rows(&|row| format!("\"2023-11-14 23:13:20,{}+01:00\"", &steps[row][2..]));
    for (unit, text) in [
        ("s", seconds),
        ("ns", ns),
        ("ms", ms),
        ("s", iso),
        ("s", zone),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        std::fs::write(&path, &text).unwrap();
        let (block, reader) = read(&path, &log(unit));
        assert_eq!(block.t, expected, "{text}");
        assert_eq!(reader.origin().nanoseconds(), 1_700_000_000_000_000_000);
        let spec = format!("{}@0.000999999..s", path.display());
        let mut reader = Reader::open(&spec.parse().unwrap(), &log(unit)).unwrap();
        let mut block = Block::default();
        assert!(reader.read(&mut block).unwrap());
        assert_eq!(block.t, expected[1..]);
    }
    // Near zero, times are as the log has them.
    let near = read_text("t,q_q1,tau_q1\n0.3,1,1\n0.4,1,1\n", &log("s"));
    assert_eq!(near.t, [0.3, 0.4]);
}

#[test]
fn coupled_gears_take_the_motors_side_to_the_joints() {
    let robot = RobotFile::parse(
        "r.toml",
        r#"
        [robot]
        model = "cft"
        setup = "tuedacs"
        [log]
        torque_is = "motor"
        gears = [[32, 0, 0, 0], [0, 32, 0, 0], [0, 0, 45, 0], [0, 0, 32, -48]]
        [log.joint.q2]
        position_offset = 0.5
        "#,
    )
    .unwrap();
    let q = [0.25, -1.5, 2.0, 0.75];
    let gears = [
        [32.0, 0.0, 0.0, 0.0],
        [0.0, 32.0, 0.0, 0.0],
        [0.0, 0.0, 45.0, 0.0],
        [0.0, 0.0, 32.0, -48.0],
    ];
    let mut joint = q;
    joint[1] -= 0.5;
    let motor: Vec<f64> = gears
        .iter()
        .map(|row| row.iter().zip(&joint).map(|(r, q)| r * q).sum())
        .collect();
    let torque = [1.0, 2.0, 3.0, 4.0];
    let mut text =
        String::from("t,q_q1,q_q2,q_q4,q_q5,tau_q1,tau_q2,tau_q4,tau_q5,dq_q1,dq_q2,dq_q4,dq_q5\n");
    for row in 0..2 {
        let numbers = motor.iter().chain(&torque).chain(&motor);
        let numbers: Vec<String> = numbers.map(f64::to_string).collect();
        text.push_str(&format!("{row},{}\n", numbers.join(",")));
    }
    let block = read_text(&text, &robot.layout());
    for (index, expected) in q.into_iter().enumerate() {
        assert!((block.q[index] - expected).abs() < 1e-14);
        assert!((block.dq[index] - joint[index]).abs() < 1e-14);
    }
    assert_eq!(
        block.tau[..4],
        [32.0, 64.0, 45.0 * 3.0 + 32.0 * 4.0, -48.0 * 4.0]
    );
}

/// A log: joints, and rows of time, q, tau and one foreign column.
fn log() -> impl Strategy<Value = (usize, Vec<Vec<f64>>, String)> {
    (1usize..5).prop_flat_map(|joints| {
        let times = prop::collection::btree_set(-1_000_000i64..1_000_000, 2..60);
        let numbers = prop::collection::vec(finite(), 60 * (2 * joints + 1));
        (Just(joints), times, numbers, "\\PC{0,12}|[,;\"#% \n]{1,6}").prop_map(
            |(joints, times, numbers, name)| {
                let width = 2 * joints + 1;
                let rows = times.iter().zip(numbers.chunks(width));
                let rows = rows.map(|(t, numbers)| {
                    let mut row = vec![*t as f64 * 1.1e-3];
                    row.extend(numbers);
                    row
                });
                let mut rows: Vec<Vec<f64>> = rows.collect();
                // A torque channel may not be dead.
                rows[0][1 + joints..=2 * joints].fill(1.0);
                (joints, rows, format!("extra{name}"))
            },
        )
    })
}

proptest! {
    #[test]
    fn any_log_that_is_written_is_read_back_equal((joints, rows, extra) in log()) {
        let names: Vec<String> = (0..joints).map(|joint| format!("j{joint}")).collect();
        let mut columns = vec!["t".to_owned()];
        columns.extend(names.iter().map(|name| format!("q_{name}")));
        columns.extend(names.iter().map(|name| format!("tau_{name}")));
        columns.push(extra);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let mut log = LogWriter::create(&path, &columns).unwrap();
        for row in &rows {
            log.row(row.iter().copied()).unwrap();
        }
        log.commit().unwrap();
        let (block, reader) = read(&path, &Layout::joint_columns(&names));
        prop_assert_eq!(block.len(), rows.len());
        prop_assert_eq!(reader.samples(), rows.len() as u64);
        for (index, row) in rows.iter().enumerate() {
            prop_assert_eq!(block.t[index], row[0]);
            prop_assert_eq!(&block.q[index * joints..][..joints], &row[1..=joints]);
            prop_assert_eq!(&block.tau[index * joints..][..joints], &row[1 + joints..=2 * joints]);
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused_and_what_is_read_is_finite_and_in_order(
        head in prop::sample::select(vec!["", "t,q_q1,tau_q1\n", "t q_q1 tau_q1\n", "# t;q_q1;tau_q1\n", "t,q_q1,tau_q1\n0,1,2\n"]),
        body in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..400),
            "[-0-9.,; \"\n\rent#]{0,400}".prop_map(String::into_bytes),
        ],
        span in prop::sample::select(vec!["", "@0..50%", "@1..s"]),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        std::fs::write(&path, [head.as_bytes(), &body].concat()).unwrap();
        let spec: LogSpec = format!("{}{span}", path.display()).parse().unwrap();
        let Ok(mut reader) = Reader::open(&spec, &Layout::joint_columns(&["q1"])) else {
            return Ok(());
        };
        let mut block = Block::default();
        let mut last = f64::NEG_INFINITY;
        while let Ok(true) = reader.read(&mut block) {
            prop_assert_eq!(block.q.len(), block.len());
            prop_assert_eq!(block.tau.len(), block.len());
            prop_assert!(block.q.iter().chain(&block.tau).all(|value| value.is_finite()));
            for t in &block.t {
                prop_assert!(*t > last);
                last = *t;
            }
        }
    }
}
