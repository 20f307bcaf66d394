//! What a log holds beside a measured motion of one robot: torques that a controller computed, a load that comes and goes.

use std::fmt::Write;

use cft_ident::config::RobotFile;
use cft_ident::robot::standard::Body;
use serde_json::Value;

use crate::log_folder::{ARM, run_line};

/// What the torques are made of.
struct Plant {
    /// Viscous and Coulomb friction of both joints.
    friction: [f64; 2],
    noise: f64,
    /// Mass at the end of the last link \[kg\], and from when to when \[s\].
    load: (f64, [f64; 2]),
    /// Torque with which somebody leans on both joints \[Nm\], and from when to when \[s\].
    touch: (f64, [f64; 2]),
    /// Part of the torque of the links that the controller feeds forward.
    fed_forward: f64,
    /// When the arm begins to stop, for a second, and rests from then on \[s\].
    stops: f64,
}

const FREE: Plant = Plant {
    friction: [0.0; 2],
    noise: 0.0,
    load: (0.0, [0.0; 2]),
    touch: (0.0, [0.0; 2]),
    fed_forward: 0.5,
    stops: 99.0,
};

/// A drive that was measured.
const REAL: Plant = Plant {
    friction: [0.4, 0.8],
    noise: 0.1,
    ..FREE
};

/// Phase of the motion, its rate and acceleration by the time: the time, until the arm stops.
fn phase(t: f64, stops: f64) -> [f64; 3] {
    use std::f64::consts::PI;
    match t - stops {
        since if since < 0.0 => [t, 1.0, 0.0],
        since if since < 1.0 => [
            stops + 0.5 * since + (PI * since).sin() / (2.0 * PI),
            0.5 * (1.0 + (PI * since).cos()),
            -0.5 * PI * (PI * since).sin(),
        ],
        _ => [stops + 0.5, 0.0, 0.0],
    }
}

/// A log of 24 s at 100 Hz: position, velocity, torque, and a part of the torque called feed-forward.
fn log(plant: &Plant) -> String {
    let robot = RobotFile::parse("arm.toml", ARM).unwrap().robot();
    let body = |mass: f64, x: f64| Body {
        mass,
        centre: [x, 0.02, 0.0],
        inertia: [0.01, 0.0, 0.0, 0.03, 0.0, 0.03],
    };
    let of = |load: f64| {
        let mut standard = vec![0.0; robot.standard_parameters()];
        standard[..10].copy_from_slice(&body(4.0, 0.2).standard());
        let own = body(2.0, 0.15).standard();
        let carried = Body {
            mass: load,
            centre: [0.3, 0.0, 0.0],
            inertia: [0.0; 6],
        };
        let carried = carried.standard();
        for (k, to) in standard[10..20].iter_mut().enumerate() {
            *to = own[k] + carried[k];
        }
        robot.base_of(&standard)
    };
    let thetas = [of(0.0), of(plant.load.0)];
    let waves = [[(0.8, 1.7), (0.3, 4.3)], [(0.7, 2.3), (0.35, 5.1)]];
    let mut text =
        "t,q_a,q_b,dq_a,dq_b,q_des_a,q_des_b,dq_des_a,dq_des_b,tau_a,tau_b,tau_ff_a,tau_ff_b\n"
            .to_owned();
    let mut chance = 1u64;
    for k in 0..2400 {
        let t = 0.01 * f64::from(k);
        let sum = |of: &dyn Fn(f64, f64) -> f64| {
            waves.map(|w| w.iter().map(|(a, w)| of(*a, *w)).sum::<f64>())
        };
        let [s, ds, dds] = phase(t, plant.stops);
        let q = sum(&|a, w| a * (w * s).sin());
        let v = sum(&|a, w| a * w * (w * s).cos() * ds);
        let a = sum(&|a, w| a * w * ((w * s).cos() * dds - w * (w * s).sin() * ds * ds));
        let [from, to] = plant.load.1;
        let theta = &thetas[usize::from(from <= t && t < to)];
        let mut tau = [0.0; 2];
        robot.torque(theta, &q, &v, &a, &mut tau);
        let mut noise = || {
            chance = chance
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            plant.noise * ((chance >> 33) as f64 / f64::from(1u32 << 31) - 0.5)
        };
        let [from, to] = plant.touch.1;
        let leans = f64::from(u8::from(from <= t && t < to)) * plant.touch.0;
        let ff = tau.map(|x| plant.fed_forward * x);
        let [viscous, coulomb] = plant.friction;
        let tau: [f64; 2] = std::array::from_fn(|j| {
            tau[j] + viscous * v[j] + coulomb * (200.0 * v[j]).tanh() + leans + noise()
        });
        // the drive is asked for kp (q_des - q) + kd (dq_des - dq) + tau_ff
        let dq_des = v.map(|v| 0.9 * v);
        let q_des: [f64; 2] =
            std::array::from_fn(|j| q[j] + (tau[j] - ff[j] - 3.0 * (dq_des[j] - v[j])) / 80.0);
        let all = [q, v, q_des, dq_des, tau, ff];
        let row: Vec<String> = all
            .as_flattened()
            .iter()
            .map(|x| format!("{x:.6}"))
            .collect();
        writeln!(text, "{t:.2},{}", row.join(",")).unwrap();
    }
    text
}

fn with_log(plant: &Plant, head: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("log.csv", &log(plant));
    write("arm.toml", &format!("{ARM}\n[log]\n{head}\n"));
    folder
}

/// A folder with the log of an arm and the model `m.toml` of it.
fn fitted(plant: &Plant) -> tempfile::TempDir {
    let folder = with_log(plant, MEASURED);
    let (code, _, said) = run_line(folder.path(), "lsq log.csv -r arm.toml -o m.toml");
    assert_eq!(code, 0, "{said}");
    folder
}

/// A parameter of a fit.
fn value(found: &Value, key: &str, joint: &str) -> f64 {
    let all = found["parameters"].as_array().unwrap();
    let is = |p: &&Value| p["key"] == key && p["joint"] == joint;
    all.iter().find(is).unwrap()["value"].as_f64().unwrap()
}

/// The words of a warning that doubts torques by their data.
const NO_DRIVE: &str = "no drive was ever measured so";
/// And by their names.
const BY_NAME: &str = "by its name a controller computed";
const MEASURED: &str = "torque_is = \"joint\"";
const FED_FORWARD: &str = "torque_is = \"commanded\"\n[log.joint]\na = { torque = \"tau_ff_a\" }\nb = { torque = \"tau_ff_b\" }";

#[test]
fn a_torque_that_no_drive_gives_is_doubted_by_data_and_by_name_and_fitted_all_the_same() {
    let real = |friction, noise| Plant {
        friction: [0.5 * friction, friction],
        noise,
        ..FREE
    };
    for (plant, head, by_data, by_name) in [
        (FREE, MEASURED, true, false),
        (FREE, FED_FORWARD, true, true),
        (real(0.8, 0.0), MEASURED, false, false),
        (real(0.0, 0.6), MEASURED, false, false),
        (real(0.8, 0.2), MEASURED, false, false),
        (real(0.8, 0.2), FED_FORWARD, true, true),
    ] {
        let folder = with_log(&plant, head);
        let (code, found, said) = run_line(folder.path(), "lsq log.csv -r arm.toml -o m.toml -v");
        assert_eq!(code, 0, "{said}");
        assert_eq!(said.contains(NO_DRIVE), by_data, "{head}: {said}");
        assert_eq!(said.contains(BY_NAME), by_name, "{head}: {said}");
        assert!(!found["parameters"].as_array().unwrap().is_empty());
    }
}

#[test]
fn torques_that_a_program_played_in_logs_of_other_motions_are_no_measurement() {
    let plant = |noise| Plant { noise, ..REAL };
    let folder = with_log(&plant(0.1), MEASURED);
    let words = "equal to the last digit";
    let lsq = || {
        run_line(
            folder.path(),
            "lsq log.csv other.csv -r arm.toml -o m.toml -v",
        )
    };
    let write = |text: &str| std::fs::write(folder.path().join("other.csv"), text).unwrap();
    // a motion that follows the same torques otherwise
    let moved = |text: &str| {
        let shifted = |line: &str| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if let Ok(q) = cells[1].parse::<f64>() {
                cells[1] = format!("{:.6}", q + 0.002 * (7.0 * q).sin());
            }
            cells.join(",")
        };
        text.lines().map(shifted).collect::<Vec<_>>().join("\n")
    };
    write(&moved(&log(&plant(0.1))));
    let (code, _, said) = lsq();
    assert!(code == 0 && said.contains(words), "{said}");
    write(&moved(&log(&plant(0.2))));
    let (code, _, said) = lsq();
    assert!(code == 0 && !said.contains(words), "{said}");
}

#[test]
fn the_law_of_a_drive_takes_all_that_it_is_asked_for_and_columns_that_it_leaves_out_are_named() {
    let law = |more: &str| {
        let law = format!("torque = {{ pd = [80.0, 3.0], command = \"q_des_{{joint}}\"{more} }}");
        let folder = with_log(&REAL, &law);
        run_line(folder.path(), "lsq log.csv -r arm.toml -o m.toml -v")
    };
    let (code, found, said) =
        law(", velocity_command = \"dq_des_{joint}\", feed_forward = [\"tau_ff_a\", \"tau_ff_b\"]");
    assert_eq!(code, 0, "{said}");
    assert!((value(&found, "viscous", "a") - 0.4).abs() < 0.05);
    assert!((value(&found, "coulomb", "b") - 0.8).abs() < 0.1);
    assert!(!said.contains("leaves out columns"), "{said}");
    let (code, _, said) = law("");
    assert_eq!(code, 0, "{said}");
    for words in ["velocity_command", "feed_forward", "dq_des_a", "tau_ff_b"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!said.contains("gravity is not in these torques"), "{said}");
    let (code, _, said) = law(", feed_forward = \"tau_ff_a\"");
    assert!(
        code == 3 && said.contains("a column for each joint"),
        "{said}"
    );
}

#[test]
fn a_feed_forward_that_is_0_throughout_raises_no_doubt_named_or_not() {
    let plant = Plant {
        fed_forward: 0.0,
        ..REAL
    };
    let speed = ", velocity_command = \"dq_des_{joint}\"";
    let named = ", feed_forward = \"tau_ff_{joint}\"";
    for more in [speed.to_owned(), format!("{speed}{named}")] {
        let law = format!("torque = {{ pd = [80.0, 3.0], command = \"q_des_{{joint}}\"{more} }}");
        let folder = with_log(&plant, &law);
        let (code, found, said) = run_line(folder.path(), "lsq log.csv -r arm.toml -o m.toml -v");
        assert_eq!(code, 0, "{said}");
        let viscous = value(&found, "viscous", "a");
        assert!((viscous - 0.4).abs() < 0.05, "{viscous}");
        assert!(!said.contains("feed_forward"), "{said}");
        assert!(!said.contains("tau_ff"), "{said}");
        let (code, found, said) = run_line(folder.path(), "inspect log.csv -r arm.toml -v");
        assert_eq!(code, 0, "{said}");
        let faults = found["faults"].as_array().unwrap();
        assert!(faults.is_empty(), "{faults:?}");
    }
    // one that is 0 until the last second is no such column
    let law = format!("torque = {{ pd = [80.0, 3.0], command = \"q_des_{{joint}}\"{speed} }}");
    let folder = with_log(&plant, &law);
    let path = folder.path().join("log.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let last = |line: &str| match line.starts_with("23.5") {
        true => format!("{},0.3,0.2", line.rsplitn(3, ',').last().unwrap()),
        false => line.to_owned(),
    };
    let text: Vec<String> = text.lines().map(last).collect();
    std::fs::write(&path, text.join("\n")).unwrap();
    let (code, _, said) = run_line(folder.path(), "lsq log.csv -r arm.toml -o m.toml -v");
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("tau_ff_a, tau_ff_b"), "{said}");
}

#[test]
fn a_load_that_is_carried_to_the_end_has_no_end_though_the_arm_rests_there() {
    let plant = |load| Plant {
        load,
        stops: 19.0,
        ..REAL
    };
    let folder = fitted(&plant((0.0, [0.0; 2])));
    let path = folder.path();
    std::fs::write(path.join("loaded.csv"), log(&plant((0.8, [9.0, 99.0])))).unwrap();
    let (code, found, said) = run_line(path, "payload loaded.csv -m m.toml");
    assert_eq!(code, 0, "{said}");
    let spans = found["carried"].as_array().unwrap();
    let [span] = spans.as_slice() else {
        panic!("{spans:?}");
    };
    let from = span["from_s"].as_f64().unwrap();
    assert!((from - 9.0).abs() < 0.2 && span["to_s"].is_null(), "{span}");
    let mass = found["readings"][0]["mass"]["value"].as_f64().unwrap();
    assert!((mass - 0.8).abs() < 0.03, "{mass}");
}

#[test]
fn a_load_that_comes_and_goes_within_a_log_is_found_with_its_times() {
    let plant = |load| Plant { load, ..REAL };
    let folder = fitted(&REAL);
    let path = folder.path();
    for (load, from, to) in [
        ((0.8, [8.0, 16.0]), Some(8.0), Some(16.0)),
        ((0.8, [9.0, 99.0]), Some(9.0), None),
        ((0.8, [-1.0, 15.0]), None, Some(15.0)),
        ((0.8, [-1.0, 99.0]), None, None),
        ((0.0, [0.0; 2]), None, None),
    ] {
        std::fs::write(path.join("loaded.csv"), log(&plant(load))).unwrap();
        let (code, found, said) = run_line(path, "payload loaded.csv -m m.toml");
        assert_eq!(code, 0, "{said}");
        let spans = found["carried"].as_array().unwrap();
        let near = |x: &Value, t: Option<f64>| match t {
            Some(t) => x.as_f64().is_some_and(|x| (x - t).abs() < 0.2),
            None => x.is_null(),
        };
        let throughout = from.is_none() && to.is_none();
        assert_eq!(spans.is_empty(), throughout, "{load:?}: {spans:?}");
        for span in spans {
            assert!(near(&span["from_s"], from), "{load:?}: {span}");
            assert!(near(&span["to_s"], to), "{load:?}: {span}");
        }
        let mass = &found["readings"][0]["mass"];
        let (value, std) = (&mass["value"], mass["std"].as_f64().unwrap());
        let off = value.as_f64().unwrap() - load.0;
        assert!(off.abs() < 0.03 && std < 0.02, "{load:?}: {mass}");
        let verdict = if load.0 > 0.0 { "" } else { "none-seen" };
        assert!(
            found["verdict"].as_str().unwrap().contains(verdict),
            "{said}"
        );
    }
}

#[test]
fn a_part_in_which_somebody_leans_on_the_arm_is_no_part_of_its_load() {
    let folder = fitted(&REAL);
    let path = folder.path();
    for (load, touch, named) in [
        ((0.8, [-1.0, 99.0]), (6.0, [8.0, 9.5]), true),
        ((0.8, [10.0, 99.0]), (6.0, [4.0, 5.0]), true),
        ((0.0, [0.0; 2]), (6.0, [15.0, 17.0]), true),
        // half of the log is another story, and none of them is known to be right
        ((0.8, [-1.0, 99.0]), (6.0, [4.0, 16.0]), false),
    ] {
        let plant = Plant {
            load,
            touch,
            ..REAL
        };
        std::fs::write(path.join("loaded.csv"), log(&plant)).unwrap();
        let (code, found, said) = run_line(path, "payload loaded.csv -m m.toml");
        assert_eq!(code, 0, "{said}");
        let spans = found["touched"].as_array().unwrap();
        assert_eq!(
            spans.len(),
            usize::from(named),
            "{load:?} {touch:?}: {spans:?}"
        );
        let [from, to] = touch.1;
        for span in spans {
            let ends = [&span["from_s"], &span["to_s"]].map(|t| t.as_f64().unwrap());
            assert!(
                (ends[0] - from).abs() < 0.5 && (ends[1] - to).abs() < 0.5,
                "{span}"
            );
            assert!(span["off"][0]["off"].as_f64().unwrap() > 2.0, "{span}");
            let mass = &found["readings"][0]["mass"];
            let (value, std) = (
                mass["value"].as_f64().unwrap(),
                mass["std"].as_f64().unwrap(),
            );
            assert!(
                (value - load.0).abs() < 0.03 && std < 0.02,
                "{load:?}: {mass}"
            );
            let with_it = found["mass_with_touched"]["std"].as_f64().unwrap();
            assert!(with_it > 2.0 * std, "{with_it} {std}");
        }
    }
}

#[test]
fn a_load_that_is_picked_up_is_no_course_over_time_to_a_diagnosis() {
    let plant = |load| Plant { load, ..REAL };
    let folder = fitted(&REAL);
    let path = folder.path();
    let words = "carries a load";
    for (load, from) in [
        ((0.8, [10.0, 99.0]), Some("from 10.0")),
        ((0.0, [0.0; 2]), None),
    ] {
        std::fs::write(path.join("loaded.csv"), log(&plant(load))).unwrap();
        let (code, found, said) =
            run_line(path, "diagnose loaded.csv -m m.toml --keep -o d.toml -v");
        assert_eq!(code, 0, "{said}");
        assert_eq!(said.contains(words), from.is_some(), "{said}");
        assert!(from.is_none_or(|from| said.contains(from)), "{said}");
        assert!(!said.contains("contact?"), "{said}");
        let steps = found["steps"].as_array().unwrap();
        let named = steps.iter().filter(|step| step["effect"] == "gain-change");
        assert_eq!(named.count(), 0, "{steps:?}");
    }
}

#[test]
fn what_is_held_out_is_a_part_that_the_filter_can_use() {
    let folder = with_log(&REAL, MEASURED);
    let path = folder.path().join("log.csv");
    let whole = std::fs::read_to_string(&path).unwrap();
    // the last quarter holds short tests alone
    let kept = |line: &&str| {
        let t: f64 = line.split(',').next().unwrap().parse().unwrap_or(0.0);
        t < 17.0 || (18.5..19.2).contains(&t) || (20.5..21.2).contains(&t) || t > 23.4
    };
    let text: Vec<&str> = whole.lines().filter(kept).collect();
    std::fs::write(&path, text.join("\n")).unwrap();
    let (code, _, said) = run_line(folder.path(), "identify log.csv arm.toml -o run");
    assert_eq!(code, 0, "{said}");
    let result = std::fs::read_to_string(folder.path().join("run/result.json")).unwrap();
    let result: Value = serde_json::from_str(&result).unwrap();
    assert!(!result["validate"].is_null(), "{said}");
}

#[test]
fn the_smallest_force_that_shows_is_one_number_in_show_and_in_watch() {
    let folder = fitted(&REAL);
    let path = folder.path();
    std::fs::write(
        path.join("other.csv"),
        log(&Plant {
            stops: 20.0,
            ..REAL
        }),
    )
    .unwrap();
    let (code, shown, said) = run_line(path, "show m.toml");
    assert_eq!(code, 0, "{said}");
    let (code, watched, said) = run_line(path, "watch other.csv -m m.toml");
    assert_eq!(code, 0, "{said}");
    let forces = |all: &Value, key: &str| -> Vec<Option<f64>> {
        let all = all.as_array().unwrap().iter();
        all.map(|joint| joint[key].as_f64()).collect()
    };
    let forces = [
        forces(&shown["in_use"], "hidden_force_n"),
        forces(&watched["joints"], "force_n"),
    ];
    assert!(forces[0][0].is_some_and(|force| force > 0.0), "{forces:?}");
    assert_eq!(forces[0], forces[1]);
    // 24 s without an alarm leave three of them possible
    let proven = watched["proven_per_hour"].as_f64().unwrap();
    let observed = watched["calibrated_s"].as_f64().unwrap();
    assert!((proven * observed / 3600.0 - 3.0).abs() < 1e-9 && observed < 24.0);
    assert!(said.contains("prove"), "{said}");
    let (_, hourly, said) = run_line(path, "watch other.csv -m m.toml --false-alarms 600");
    assert_eq!(hourly["proven_per_hour"].as_f64(), Some(600.0));
    assert!(!said.contains("prove"), "{said}");
}
