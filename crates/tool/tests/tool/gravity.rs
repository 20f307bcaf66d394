//! Gravity from held poses of a planar arm whose torques are made by hand.

use cft_ident_files::config::RobotFile;
use cft_ident_tool::held::{
    GravityFit, GravityNumber, HeldError, HeldLog, HeldPose, fit_gravity, gravity_in_python,
    read_held,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ARM: &str = "\
[robot]
model = \"serial\"
drive_inertia = false
[[robot.link]]
name = \"upper\"
joint = \"shoulder\"
rpy = [1.5707963267948966, 0.0, 0.0]
[[robot.link]]
name = \"fore\"
joint = \"elbow\"
xyz = [0.3, 0.0, 0.0]
[friction]
law = \"viscous-coulomb\"
fitted_with_inertias = true
";

/// Mass times distance of the whole upper link with the fore link at its end, and of the fore link \[kg m\].
const MOMENTS: [f64; 2] = [0.9, 0.2];
const STICTION: [f64; 2] = [0.8, 0.3];

fn robot(log: &str) -> RobotFile {
    RobotFile::parse("arm.toml", &format!("{ARM}{log}")).unwrap()
}

fn weights(q: &[f64]) -> [f64; 2] {
    let elbow = 9.81 * MOMENTS[1] * (q[0] + q[1]).cos();
    [9.81 * MOMENTS[0] * q[0].cos() + elbow, elbow]
}

/// Poses from both sides; friction stays between `least` of its size and all of it.
fn held(seed: u64, poses: usize, noise: f64, least: f64) -> HeldLog {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut out = HeldLog::default();
    for k in 0..poses {
        let mut angle = |most: f64| most * (2.0 * random.random::<f64>() - 1.0);
        let q = vec![angle(1.5), angle(2.0)];
        for side in [1.0, -1.0] {
            let own = weights(&q);
            let tau = own.iter().zip(STICTION).map(|(w, f)| {
                let left = least + (1.0 - least) * random.random::<f64>();
                let normal: f64 = StandardNormal.sample(&mut random);
                w + side * left * f + noise * normal
            });
            out.poses.push(HeldPose {
                number: out.poses.len() + 1,
                t: k as f64,
                rows: 10,
                tau: tau.collect(),
                q: q.clone(),
                side: vec![side; 2],
            });
        }
    }
    out.unsigned = vec![false; 2];
    out
}

/// Numbers that are in use, with what they are in truth.
fn truth(found: &GravityFit) -> Vec<([f64; 2], f64)> {
    let by_name = |name: &str| {
        let of = found.parameters.iter().find(|p| p.name == name);
        of.unwrap_or_else(|| panic!("{name}: {:?}", found.parameters))
            .interval_95
            .unwrap()
    };
    let stiction = |j: usize| found.joints[j].stiction.interval_95.unwrap();
    vec![
        (by_name("mx1"), MOMENTS[0]),
        (by_name("mx2"), MOMENTS[1]),
        (stiction(0), STICTION[0]),
        (stiction(1), STICTION[1]),
    ]
}

#[test]
fn intervals_of_gravity_and_of_friction_at_rest_hold_the_truth() {
    let file = robot("");
    let mut inside = [0; 4];
    for seed in 0..100 {
        let found = fit_gravity(&held(seed, 24, 0.05, 1.0), &file, "arm").unwrap();
        for (k, ([low, high], truth)) in truth(&found).into_iter().enumerate() {
            inside[k] += u32::from(low <= truth && truth <= high);
        }
    }
    assert!(
        inside.iter().all(|count| (88..=100).contains(count)),
        "{inside:?}"
    );
}

#[test]
fn touched_poses_are_named_and_left_out_and_a_log_whose_poses_all_disagree_is_not_cured() {
    let file = robot("");
    let width = |all: &[GravityNumber], name: &str| {
        let of = all.iter().find(|p| p.name == name).unwrap();
        of.interval_95.map(|[low, high]| high - low).unwrap()
    };
    for seed in 0..30 {
        let clean = held(seed, 12, 0.05, 0.8);
        let found = fit_gravity(&clean, &file, "arm").unwrap();
        assert!(found.touched.is_empty(), "{seed}: {:?}", found.touched);
        // somebody leans on the fore link in the poses 7 and 8, and on the upper one in the 15th
        let mut touched = clean.clone();
        for (pose, tau) in [(6, [3.0, 2.0]), (7, [3.0, 2.0]), (14, [-4.0, 0.0])] {
            (0..2).for_each(|j| touched.poses[pose].tau[j] += tau[j]);
        }
        let found = fit_gravity(&touched, &file, "arm").unwrap();
        let numbers: Vec<usize> = found.touched.iter().map(|of| of.pose).collect();
        assert_eq!(numbers, [7, 8, 15], "{seed}");
        let off = found.touched[0].off.iter().map(|of| of.off);
        for (off, truth) in off.zip([3.0, 2.0]) {
            assert!((off - truth).abs() < 0.6, "{seed}: {off} {truth}");
        }
        assert_eq!(found.poses, 21);
        for name in ["mx1", "mx2"] {
            let [with, without] =
                [&found.with_touched, &found.parameters].map(|all| width(all, name));
            assert!(without < 0.5 * with, "{seed} {name}: {without} {with}");
        }
        for (interval, truth) in truth(&found).into_iter().take(2) {
            let [low, high] = interval;
            let room = high - low;
            assert!(
                low - room < truth && truth < high + room,
                "{interval:?} {truth}"
            );
        }
        // every second pose is another story, and so is each of them
        let mut all = clean.clone();
        for (k, pose) in all.poses.iter_mut().enumerate() {
            pose.tau[1] += 0.3 * ((k * k) as f64).sin();
            pose.tau[0] += if k % 3 == 0 { 3.0 } else { 0.0 };
        }
        let found = fit_gravity(&all, &file, "arm").unwrap();
        assert!(found.touched.is_empty(), "{seed}: {:?}", found.touched);
    }
}

#[test]
fn held_poses_stand_within_what_the_check_says() {
    let file = robot("");
    let log = held(7, 24, 0.02, 0.6);
    let found = fit_gravity(&log, &file, "arm").unwrap();
    assert!(!found.checks.is_empty());
    for of in found.checks.iter().flat_map(|check| &check.joints) {
        assert!((of.measured - of.expected).abs() <= of.within, "{of:?}");
        let own = weights(&log.poses[found.checks[0].pose - 1].q);
        assert!(own.iter().all(|w| w.abs() < 20.0));
    }
}

#[test]
fn one_side_alone_says_nothing_of_friction_at_rest() {
    let file = robot("");
    let mut log = held(3, 24, 0.02, 1.0);
    log.poses.retain(|pose| pose.side[0] > 0.0);
    let found = fit_gravity(&log, &file, "arm").unwrap();
    assert!(
        found
            .joints
            .iter()
            .all(|joint| joint.stiction.value.is_none())
    );
}

#[test]
fn a_log_of_sizes_is_read_with_the_signs_of_the_sides_on_which_joints_hang() {
    let log = "\
[log]
sign = \"hang\"
[log.joint]
shoulder = { reference = \"cmd_shoulder\" }
elbow = { reference = \"cmd_elbow\" }
";
    let mut text =
        String::from("t,q_shoulder,q_elbow,cmd_shoulder,cmd_elbow,tau_shoulder,tau_elbow\n");
    let mut row = 0;
    let mut from = [0.0, 0.0];
    let source = held(5, 24, 0.0, 1.0);
    for pose in &source.poses {
        let begin = [0, 1].map(|j| pose.q[j] - 0.15 * pose.side[j]);
        let goal = [pose.q[0], pose.q[1]];
        for (a, b, rows) in [(from, begin, 15), (begin, goal, 15), (goal, goal, 40)] {
            for k in 0..rows {
                let part = f64::from(k) / f64::from(rows);
                let q = [0, 1].map(|j| a[j] + part * (b[j] - a[j]));
                let tau = &pose.tau;
                text += &format!(
                    "{:.2},{:.6},{:.6},{:.6},{:.6},{:.5},{:.5}\n",
                    0.02 * f64::from(row),
                    q[0],
                    q[1],
                    q[0] + tau[0] / 50.0,
                    q[1] + tau[1] / 50.0,
                    tau[0].abs(),
                    tau[1].abs()
                );
                row += 1;
            }
        }
        from = goal;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("holds.csv");
    std::fs::write(&path, text).unwrap();
    let spec = path.to_string_lossy().parse().unwrap();
    let file = robot(log);
    let (read, _) = read_held(&[spec], &file).unwrap();
    assert_eq!(read.poses.len(), source.poses.len());
    let found = fit_gravity(&read, &file, "arm").unwrap();
    for ([low, high], truth) in truth(&found) {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        assert!(
            (middle - truth).abs() < 0.02 + half,
            "{low} {high}: {truth}"
        );
    }
}

#[test]
fn a_sign_by_the_side_needs_the_command() {
    let file = robot("[log]\nsign = \"hang\"\n");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(
        &path,
        "t,q_shoulder,q_elbow,tau_shoulder,tau_elbow\n0,0,0,1,1\n1,1,0,1,1\n",
    )
    .unwrap();
    let spec = path.to_string_lossy().parse().unwrap();
    let error = read_held(&[spec], &file).unwrap_err();
    assert!(matches!(error, HeldError::NoCommand { .. }), "{error}");
    assert!(error.to_string().contains("reference"), "{error}");
}

#[test]
fn torques_that_are_not_of_gravity_are_refused() {
    let file = robot("");
    let mut log = held(1, 24, 0.02, 1.0);
    for (k, pose) in log.poses.iter_mut().enumerate() {
        pose.tau = vec![9.0 * (2.7 * k as f64).sin(), 2.0 * (1.9 * k as f64).cos()];
    }
    let error = fit_gravity(&log, &file, "arm").unwrap_err();
    assert!(matches!(error, HeldError::NotGravity { .. }), "{error}");
}

#[test]
fn gravity_in_python_is_that_of_the_links() {
    let file = robot("");
    let found = fit_gravity(&held(2, 24, 0.0, 1.0), &file, "arm").unwrap();
    let text = gravity_in_python(&file.robot(), &found.theta, &[]).unwrap();
    let q = [0.4, -0.9];
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gravity.py"), text).unwrap();
    let ask = format!(
        "from gravity import gravity; print(*gravity([{}, {}]))",
        q[0], q[1]
    );
    let run = std::process::Command::new("python3")
        .current_dir(folder.path())
        .args(["-c", &ask])
        .output();
    let Ok(run) = run else {
        println!("SKIPPED: no python3");
        return;
    };
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    let tau: Vec<f64> = said
        .split_whitespace()
        .map(|x| x.parse().unwrap())
        .collect();
    assert_eq!(
        tau.len(),
        2,
        "{said} {}",
        String::from_utf8_lossy(&run.stderr)
    );
    for (a, b) in tau.iter().zip(weights(&q)) {
        assert!((a - b).abs() < 1e-6, "{tau:?}");
    }
}
