//! Over all measured logs: what `diagnose` adds does not make the torque of unseen data worse than the
//! declared model by more than its interval. A further set is one line in [`SETS`].

mod measured_support;

use measured_support::{run, shared};
use serde_json::Value;

/// A measured set: robot file, logs that are fitted, logs that decide nothing; paths below
/// ../shared/data, with their spans.
struct Set {
    robot: &'static str,
    fitted: &'static [&'static str],
    unseen: &'static [&'static str],
}

const SETS: &[Set] = &[
    set(
        "configs/emps-symmetric.toml",
        &["emps/emps_id.csv"],
        &["emps/emps_pulses_val.csv"],
    ),
    set(
        "configs/emps.toml",
        &["emps/emps_id.csv"],
        &["emps/emps_pulses_val.csv"],
    ),
    // the other way round: fitted on pulses
    set(
        "configs/emps.toml",
        &["emps/emps_pulses_val.csv"],
        &["emps/emps_id.csv"],
    ),
    set(
        "configs/bldc.toml",
        &["bldc-cogging/speed_test1.txt@15.2..23s"],
        &["bldc-cogging/speed_test1.txt@23..29.5s"],
    ),
    set(
        "configs/bldc.toml",
        &["bldc-cogging/speed_test1.txt@0.5..10s"],
        &["bldc-cogging/speed_test1.txt@10..14.5s"],
    ),
];

const fn set(
    robot: &'static str,
    fitted: &'static [&'static str],
    unseen: &'static [&'static str],
) -> Set {
    Set {
        robot,
        fitted,
        unseen,
    }
}

/// Paths of the logs; none, said aloud, where one is not there.
fn logs(names: &[&str]) -> Option<Vec<String>> {
    let path = |name: &&str| Some(shared(name)?.to_string_lossy().into_owned());
    names.iter().map(path).collect()
}

#[test]
fn the_final_model_is_no_worse_on_unseen_data_than_the_declared_one() {
    for set in SETS {
        let (Some(fitted), Some(unseen)) = (logs(set.fitted), logs(set.unseen)) else {
            continue;
        };
        let folder = tempfile::tempdir().unwrap();
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let lsq = [
            words("lsq"),
            fitted.clone(),
            words("-o model.toml -r"),
            words(set.robot),
        ];
        run(folder.path(), &lsq.concat());
        let mut diagnose = [words("diagnose"), fitted, words("-m model.toml")].concat();
        for log in unseen {
            diagnose.extend(["--holdout".to_owned(), log]);
        }
        let found = run(folder.path(), &diagnose);
        let joints = |when: &str| found[when]["holdout"]["joints"].as_array().unwrap().clone();
        for (before, after) in joints("before").iter().zip(&joints("after")) {
            let error = |j: &Value| j["relative_error"].as_f64().unwrap();
            // not worse: the interval of the error after reaches down to the error before
            let low = after["interval_95"][0].as_f64().unwrap();
            println!(
                "{} {:?}: {} -> {}",
                set.robot,
                set.fitted,
                error(before),
                error(after)
            );
            assert!(low <= error(before), "{}: {before} {after}", set.robot);
        }
    }
}
