//! Measured logs of other groups, read where the folder with them lies beside the repository.

use crate::log_support;

use std::path::Path;

use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{Channel, Layout};
use log_support::{read, shared};

#[test]
fn the_emps_logs_are_read_with_the_robot_file_that_comes_with_the_tool() {
    let robot = RobotFile::load(Path::new("configs/emps.toml")).unwrap();
    for (file, first_q, first_tau) in [
        ("emps/emps_id.csv", 7.45e-06, 89.2344322112),
        ("emps/emps_pulses_val.csv", 7.67021588343e-06, 89.7474943891),
    ] {
        let Some(path) = shared(file) else { return };
        let (block, reader) = read(&path.to_string_lossy(), &robot.layout());
        assert_eq!(block.len(), 24841, "{file}");
        assert_eq!(
            (block.q[0], block.tau[0], block.line0),
            (first_q, first_tau, 2)
        );
        let provenance = reader.provenance().unwrap();
        assert_eq!(provenance.samples, 24841);
        assert!(
            (provenance.duration_s - 24.84).abs() < 0.01,
            "{provenance:?}"
        );
    }
}

#[test]
fn the_bldc_log_is_read_in_spans_that_share_no_row_and_leave_none_out() {
    let Some(path) = shared("bldc-cogging/speed_test1.txt") else {
        return;
    };
    let path = path.to_string_lossy();
    let robot = RobotFile::load(Path::new("configs/bldc.toml")).unwrap();
    assert_eq!(robot.torque_unit(0), "A");
    let layout = robot.layout();
    let (whole, reader) = read(&path, &layout);
    // 50 of the 30001 rows are stale: all that is measured stands still while the motor turns.
    assert_eq!(whole.len(), 30001 - 50);
    let warnings = reader.warnings();
    assert!(warnings[0].contains("; 50 of them"), "{warnings:?}");
    assert_eq!(
        (whole.t[2], whole.q[2], whole.tau[2]),
        (0.003, 0.02859, 0.14551)
    );
    for (first, second) in [("0..70%", "70..100%"), ("0..15.2s", "15.2..s")] {
        let (first, _) = read(&format!("{path}@{first}"), &layout);
        let (second, _) = read(&format!("{path}@{second}"), &layout);
        let joined: Vec<f64> = first.t.iter().chain(&second.t).copied().collect();
        assert!(joined.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(
            whole
                .t
                .iter()
                .all(|t| joined.binary_search_by(|x| x.total_cmp(t)).is_ok())
        );
        // A span that begins inside a motion has less by which to recognise stale rows.
        assert!(joined.len() - whole.len() < 10, "{}", joined.len());
    }
    let (part, reader) = read(&format!("{path}@15.2..23s"), &layout);
    assert!(part.t.iter().all(|t| (15.2..23.0).contains(t)));
    assert_eq!(
        reader.provenance().unwrap().span.as_deref(),
        Some("15.2..23s")
    );
}

#[test]
fn logs_of_six_and_seven_joints_are_read_with_velocities_where_they_have_them() {
    for (file, joints, rows, velocities) in [
        ("tx40/tx40_joint.csv", 6, 45000, false),
        // without the stale rows
        ("panda/panda_exciting.csv", 7, 20544 - 1172, true),
        ("ur10/ur10_exciting.csv", 6, 3441, true),
    ] {
        let Some(path) = shared(file) else { return };
        let names: Vec<String> = (1..=joints).map(|joint| joint.to_string()).collect();
        let mut layout = Layout::joint_columns(&names);
        for (index, name) in names.iter().enumerate() {
            layout.positions[index] = Channel::si(format!("q{name}"), "rad");
            layout.torques[index] = Channel::si(format!("tau{name}"), "Nm");
            layout.velocities[index] = Channel::si(format!("dq{name}"), "rad");
        }
        let (block, reader) = read(&path.to_string_lossy(), &layout);
        assert_eq!(
            (block.len(), block.joints(), reader.has_velocities()),
            (rows, joints, velocities),
            "{file}"
        );
        assert_eq!(block.dq.is_empty(), !velocities);
    }
}

#[test]
fn the_repeated_rows_of_the_panda_log_are_counted_and_those_in_motion_dropped() {
    let Some(path) = shared("panda/panda_exciting.csv") else {
        return;
    };
    let names: Vec<String> = (1..=7).map(|joint| joint.to_string()).collect();
    let mut layout = Layout::joint_columns(&names);
    for (index, name) in names.iter().enumerate() {
        layout.positions[index] = Channel::si(format!("q{name}"), "rad");
        layout.torques[index] = Channel::si(format!("tau{name}"), "Nm");
        layout.velocities[index] = Channel::si(format!("dq{name}"), "rad");
    }
    let (block, reader) = read(&path.to_string_lossy(), &layout);
    let warnings = reader.warnings();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    for word in ["panda_exciting.csv", "1255 rows repeat", "1172 of them"] {
        assert!(warnings[0].contains(word), "{word}: {}", warnings[0]);
    }
    assert_eq!(reader.samples(), block.len() as u64);
    // Without them, differences of the positions are nearer to the velocities that the robot logged.
    let mut sum = 0.0;
    for row in 1..block.len() - 1 {
        let dt = block.t[row + 1] - block.t[row - 1];
        for joint in 0..7 {
            let v = (block.q[(row + 1) * 7 + joint] - block.q[(row - 1) * 7 + joint]) / dt;
            sum += (v - block.dq[row * 7 + joint]).powi(2);
        }
    }
    let error = (sum / (7 * (block.len() - 2)) as f64).sqrt();
    // 0.165 rad/s with them
    assert!(error < 0.11, "{error}");
}
