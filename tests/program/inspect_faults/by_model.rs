//! What a model shows of the channels of a log.

use super::*;

#[test]
fn torques_that_are_late_are_reported_and_with_a_model_precisely() {
    let late = |rows: usize| {
        let mut log = all_move();
        for name in ["tau_q1", "tau_q2", "tau_q4", "tau_q5"] {
            let torque = log.column(name);
            let first = torque[0];
            torque.rotate_right(rows);
            torque[..rows].fill(first);
        }
        log
    };
    let found = faults(&late(20).inspected(CFT));
    assert!(
        found.len() == 1 && found[0].1 == "delay" && found[0].0 == "warning",
        "{found:?}"
    );
    let model = identified();
    let shown = |rows: usize| -> Option<f64> {
        let found = late(rows).inspected_by(&model.path().join("model.toml"));
        let all = found["faults"].as_array().unwrap();
        let delay = all.iter().find(|fault| fault["kind"] == "delay")?;
        let words = delay["effect"].as_str().unwrap().split(' ');
        words.filter_map(|word| word.parse().ok()).next()
    };
    assert_eq!(shown(0), None);
    let ms = shown(5).unwrap();
    assert!((ms - 5.0).abs() < 0.5, "{ms}");
}

#[test]
fn joints_that_are_turned_or_exchanged_are_shown_by_a_model() {
    let model = identified();
    let shown = |alter: &dyn Fn(&mut Log)| -> Option<String> {
        let mut log = all_move();
        alter(&mut log);
        let found = log.inspected_by(&model.path().join("model.toml"));
        let all = found["faults"].as_array().unwrap();
        let wrong = all.iter().find(|f| f["kind"] == "wrong-sign-or-order")?;
        assert_eq!(wrong["severity"], "error");
        let effect = wrong["effect"].as_str().unwrap();
        Some(effect.split(':').next().unwrap().to_owned())
    };
    let turn = |log: &mut Log, name: &str| log.column(name).iter_mut().for_each(|x| *x = -*x);
    let swap = |log: &mut Log, a: &str, b: &str| {
        let first = log.column(a).clone();
        let second = std::mem::replace(log.column(b), first);
        *log.column(a) = second;
    };
    assert_eq!(shown(&|_| {}), None);
    assert_eq!(
        shown(&|log| turn(log, "tau_q2")).as_deref(),
        Some("torques of q2 have the other sign")
    );
    assert_eq!(
        shown(&|log| turn(log, "q_q1")).as_deref(),
        Some("positions of q1 have the other sign")
    );
    assert_eq!(
        shown(&|log| swap(log, "tau_q4", "tau_q5")).as_deref(),
        Some("torques of q4 and q5 are exchanged")
    );
    assert_eq!(
        shown(&|log| {
            swap(log, "q_q2", "q_q5");
            swap(log, "tau_q2", "tau_q5");
        })
        .as_deref(),
        Some("positions and torques of q2 and q5 are exchanged")
    );
}

/// A folder with a model of the robot, the one that is simulated.
fn identified() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    altered_log::write_model(&folder.path().join("model.toml"));
    folder
}
