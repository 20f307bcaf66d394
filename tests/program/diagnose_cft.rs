//! `diagnose` on the CFT robot, identified unloaded through the command line: what `--keep` finds on
//! loaded logs, and what a one-joint log may be asked.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

const JOINTS: [&str; 4] = ["q1", "q2", "q4", "q5"];
const ROBOT: &str = "configs/cft.toml";
const MOTION: &str = "configs/cft-excitation.toml";

/// Runs the tool in a folder and returns its JSON document.
fn run(folder: &Path, arguments: &str) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
        .current_dir(folder)
        .args(arguments.split(' '))
        .args(["--json", "-", "-q"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments}: {said}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A folder with one-joint logs and `model.toml`, identified without a load.
fn unloaded() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        for (seed, joint) in JOINTS.iter().enumerate() {
            let seed = 40 + seed;
            run(
                at,
                &format!(
                    "simulate -r {ROBOT} --move {joint} --seconds 20 --seed {seed} -o {joint}.csv"
                ),
            );
        }
        run(
            at,
            &format!("simulate -r {ROBOT} --reference {MOTION} --seconds 20 --seed 8 -o id.csv"),
        );
        run(
            at,
            &format!("friction q1.csv q2.csv q4.csv q5.csv -r {ROBOT} -o friction.toml"),
        );
        run(
            at,
            &format!("lsq id.csv -r {ROBOT} -m friction.toml -o model.toml"),
        );
        folder
    });
    folder.path()
}

/// A log of the robot with an effect.
fn loaded(log: &str, effect: &str) {
    let simulate = format!(
        "simulate -r {ROBOT} --reference {MOTION} --seconds 40 --seed 9 --effect {effect} -o {log}"
    );
    run(unloaded(), &simulate);
}

/// Steps that the written model has.
fn written(document: &Value) -> Vec<&Value> {
    let steps = document["steps"].as_array().unwrap().iter();
    steps.filter(|s| s["written"] == true).collect()
}

fn effects(document: &Value) -> Vec<&str> {
    let steps = written(document).into_iter();
    steps.map(|s| s["effect"].as_str().unwrap()).collect()
}

/// Value and standard deviation of the parameter of the first effect that is written.
fn number(document: &Value, key: &str) -> (f64, f64) {
    let p = &written(document)[0]["parameters"][key];
    (p["value"].as_f64().unwrap(), p["std"].as_f64().unwrap())
}

#[test]
fn a_payload_is_found_with_its_mass_where_the_unloaded_model_is_held() {
    loaded("payload.csv", "payload:mass=0.5,mx=0.2");
    let found = run(unloaded(), "diagnose payload.csv -m model.toml --keep");
    assert_eq!(effects(&found), ["payload"]);
    for (key, truth) in [("mass", 0.5), ("mx", 0.2), ("mz", 0.0), ("inertia", 0.0)] {
        let (value, std) = number(&found, key);
        assert!((value - truth).abs() < 4.0 * std, "{key}: {value} +- {std}");
    }
    assert!((number(&found, "mass").0 - 0.5).abs() < 0.01);
    // a free fit takes it up, and does not call it a payload
    let free = run(unloaded(), "diagnose payload.csv -m model.toml");
    assert!(!effects(&free).contains(&"payload"));
}

#[test]
fn a_gain_is_found_with_its_factor_where_the_model_is_held() {
    loaded("gain.csv", "gain:q4:k=0.03");
    let found = run(unloaded(), "diagnose gain.csv -m model.toml --keep");
    assert_eq!(effects(&found), ["gain"]);
    let step = written(&found)[0];
    assert_eq!(step["joint"], "q4");
    // held-out data confirm it joint by joint, and only the joint that it sits on gains by more than a hundredth
    let joints = step["joints"].as_array().unwrap();
    let names: Vec<&str> = joints
        .iter()
        .map(|j| j["joint"].as_str().unwrap())
        .collect();
    assert_eq!(names, JOINTS);
    for joint in joints {
        let high = joint["interval_95"][1].as_f64().unwrap();
        let small = 0.01 * joint["before"].as_f64().unwrap();
        assert_eq!(high < -small, joint["joint"] == "q4", "{joint}");
        assert_eq!(joint["worsened"], false, "{joint}");
    }
    let (value, std) = number(&found, "k");
    assert!(
        (value - 0.03).abs() < 4.0 * std && std < 0.001,
        "{value} +- {std}"
    );
}

/// Two general logs of the robot with effects, along two motions, diagnosed together.
fn two_logs(name: &str, effects: &str) -> Value {
    loaded(&format!("{name}.csv"), effects);
    let simulate = format!(
        "simulate -r {ROBOT} --reference configs/cft-validation.toml --seconds 20 --seed 10 --effect {effects} \
         -o {name}-2.csv"
    );
    run(unloaded(), &simulate);
    run(
        unloaded(),
        &format!("diagnose {name}.csv {name}-2.csv -m model.toml"),
    )
}

#[test]
fn asymmetric_friction_is_one_effect_and_no_offset_beside_it() {
    let found = two_logs("asymmetric", "asymmetric-friction:q1:coulomb=2,viscous=3");
    assert_eq!(effects(&found), ["asymmetric-friction"]);
    assert_eq!(written(&found)[0]["joint"], "q1");
}

/// One rotor explains little without the other, ten terms of the links explain both, and one number says it.
#[test]
fn rotors_on_both_screws_are_one_number_and_not_terms_of_the_links() {
    let found = two_logs(
        "rotors",
        "rotor-inertia:x_r:J=10 --effect rotor-inertia:y_r:J=10",
    );
    assert_eq!(effects(&found), ["rotor-inertia"]);
    let (value, std) = number(&found, "J");
    assert!((value - 10.0).abs() < 4.0 * std, "{value} +- {std}");
}

/// A filter of the positions that is too narrow for a fast motion smears its reversals, and what that leaves in the
/// residual looks like friction with a memory.
#[test]
fn what_a_narrow_position_filter_makes_is_no_effect() {
    let at = unloaded();
    let here = Path::new(cft_ident_support::ROOT);
    let robot = std::fs::read_to_string(here.join(ROBOT)).unwrap();
    let narrow = robot.replacen("[filter]", "[filter]\nposition_cutoff_hz = 50.0", 1);
    assert_ne!(robot, narrow);
    std::fs::write(at.join("narrow.toml"), narrow).unwrap();
    let motion = here.join("crates/studies/examples/study_rows/designed.toml");
    let motion = motion.to_string_lossy();
    run(
        at,
        &format!("simulate -r {ROBOT} --reference {motion} --seconds 20 --seed 2 -o fast.csv"),
    );
    run(
        at,
        "friction q1.csv q2.csv q4.csv q5.csv -r narrow.toml -o narrow-friction.toml",
    );
    run(
        at,
        "lsq fast.csv -r narrow.toml -m narrow-friction.toml -o narrow-model.toml",
    );
    let found = run(at, "diagnose fast.csv -m narrow-model.toml");
    assert_eq!(effects(&found), [""; 0]);
}

#[test]
fn joints_that_are_held_are_no_candidates_and_have_no_error() {
    let found = run(unloaded(), "diagnose q1.csv -m model.toml -o same.toml");
    // no effect, no new model
    let text = |name: &str| std::fs::read_to_string(unloaded().join(name)).unwrap();
    assert_eq!(text("same.toml"), text("model.toml"));
    assert_eq!(found["before"], found["after"]);
    let candidates = found["candidates"].as_array().unwrap();
    let mut held = 0;
    for c in candidates {
        if matches!(
            c["joint"].as_str(),
            Some("q2" | "q4" | "q5" | "x_r" | "y_r")
        ) {
            assert_eq!(c["accepted"], false);
            let reason = c["reason"].as_str().unwrap();
            held += usize::from(reason.contains("held in these logs"));
        }
    }
    assert!(held > 30, "{held}");
    for (j, joint) in found["after"]["train"]["joints"]
        .as_array()
        .unwrap()
        .iter()
        .enumerate()
    {
        assert_eq!(joint["relative_error"].is_null(), j > 0, "{joint}");
    }
}
