//! Each effect that is planted is named and no other; a clean log shows none.

use crate::sensor::Sensor;
use cft_ident_tool::tool::{ToolNumber, ToolResult, WrenchFrame, analyse};

fn confirmed(found: &ToolResult) -> Vec<&str> {
    let stands = found.steps.iter().filter(|step| step.status == "confirmed");
    stands.map(|step| step.effect.as_str()).collect()
}

#[test]
fn what_is_planted_is_named_and_nothing_else() {
    let clean = Sensor::default();
    for (name, sensor) in [
        (
            "bias-drift",
            Sensor {
                drift: [1.0, -0.6, 0.4],
                ..clean.clone()
            },
        ),
        (
            "taring",
            Sensor {
                tared: [2.0, -1.0, 0.5],
                ..clean.clone()
            },
        ),
        (
            "turned-sensor",
            Sensor {
                turned: 0.12,
                ..clean.clone()
            },
        ),
        (
            "turned-sensor",
            Sensor {
                turned: 0.785,
                ..clean.clone()
            },
        ),
        (
            "gains",
            Sensor {
                gains: [1.06, 0.97, 1.0],
                ..clean.clone()
            },
        ),
        (
            "cable-force",
            Sensor {
                cable: [3.0, 2.0, -2.0],
                ..clean.clone()
            },
        ),
        (
            "leaning-base",
            Sensor {
                down: [0.08, -0.05, -0.99555],
                ..clean.clone()
            },
        ),
    ] {
        let found = analyse(&sensor.log(3), None).unwrap();
        assert_eq!(confirmed(&found), [name], "{:?}", found.steps);
        assert!(found.touches.is_empty(), "{name}: {:?}", found.touches);
        let [before, after] = [found.before, found.after].map(|e| e.holdout.force_error);
        assert!(
            after < 0.8 * before && after < 0.1,
            "{name}: {before} {after}"
        );
        let mass = found.number("mass").unwrap();
        assert!((mass - sensor.mass).abs() < 0.03, "{name}: {mass}");
    }
}

#[test]
fn a_clean_log_has_no_effect_and_says_in_which_frame_it_is() {
    for (in_base, frame) in [(false, WrenchFrame::Sensor), (true, WrenchFrame::Base)] {
        for seed in 0..20 {
            let log = Sensor {
                in_base,
                ..Sensor::default()
            }
            .log(seed);
            let found = analyse(&log, None).unwrap();
            assert_eq!(found.reading.frame, frame);
            assert!(!found.reading_is_open);
            assert_eq!(
                confirmed(&found),
                Vec::<&str>::new(),
                "{seed}: {:?}",
                found.steps
            );
            assert!(found.undetermined.is_empty(), "{:?}", found.undetermined);
        }
    }
}

#[test]
fn a_size_is_that_of_what_was_planted() {
    let sensor = Sensor {
        turned: 0.2,
        ..Sensor::default()
    };
    let found = analyse(&sensor.log(5), None).unwrap();
    assert!(
        (found.steps[0].size - 0.2).abs() < 0.01,
        "{:?}",
        found.steps
    );
    let drifting = Sensor {
        drift: [1.0, 0.0, 0.0],
        ..Sensor::default()
    };
    let found = analyse(&drifting.log(5), None).unwrap();
    assert!(
        (found.steps[0].size - 1.0).abs() < 0.15,
        "{:?}",
        found.steps
    );
    assert!(found.forecast.is_some());
}

#[test]
fn poses_about_one_axis_leave_a_part_of_the_centre_open_and_the_next_pose_tells_it() {
    let sensor = Sensor::default();
    let mut log = sensor.log(2);
    // turned about the sensor's x alone: the weight passes y and z
    for (k, sample) in log.samples.iter_mut().enumerate() {
        let angle = 0.06 * k as f64;
        let (s, c) = (angle / 2.0).sin_cos();
        sample.quaternion = [s, 0.0, 0.0, c];
        let w = 9.81 * sensor.mass;
        let f = [0.0, -w * angle.sin(), -w * angle.cos()];
        let [x, y, z] = sensor.centre;
        let t = [
            y * f[2] - z * f[1],
            z * f[0] - x * f[2],
            x * f[1] - y * f[0],
        ];
        let wave = |i: usize| 0.01 * (7.3 * k as f64 + 2.1 * i as f64).sin();
        sample.force = [0, 1, 2].map(|i| f[i] + sensor.bias[i] + wave(i));
        sample.moment = [0, 1, 2].map(|i| t[i] + sensor.bias[3 + i] + 0.1 * wave(i + 3));
    }
    let found = analyse(&log, None).unwrap();
    // h x u with u in the plane of y and z: all of h shows
    assert!(found.undetermined.is_empty(), "{:?}", found.undetermined);
    // swung a little about one axis: u moves along y alone, and h along y does not show
    let mut little = log.clone();
    for (k, sample) in little.samples.iter_mut().enumerate() {
        let angle = 0.15 * (0.4 * k as f64).sin();
        let (s, c) = (angle / 2.0).sin_cos();
        sample.quaternion = [s, 0.0, 0.0, c];
        let w = 9.81 * sensor.mass;
        let f = [0.0, -w * angle.sin(), -w * angle.cos()];
        let [x, y, z] = sensor.centre;
        let t = [
            y * f[2] - z * f[1],
            z * f[0] - x * f[2],
            x * f[1] - y * f[0],
        ];
        let wave = |i: usize| 0.01 * (7.3 * k as f64 + 2.1 * i as f64).sin();
        sample.force = [0, 1, 2].map(|i| f[i] + sensor.bias[i] + wave(i));
        sample.moment = [0, 1, 2].map(|i| t[i] + sensor.bias[3 + i] + 0.1 * wave(i + 3));
    }
    let found = analyse(&little, None).unwrap();
    assert_eq!(found.undetermined, ["centre along y"]);
    let next = found.next_pose.unwrap();
    assert!(next.variance_left < 0.2, "{next:?}");
}

#[test]
fn rows_in_which_somebody_leans_on_the_tool_are_named_and_left_out() {
    for poses in [40, 100] {
        let sensor = Sensor {
            poses,
            ..Sensor::default()
        };
        let mut log = sensor.log(3);
        let touched = 20..20 + poses / 20;
        for k in touched.clone() {
            let (sin, cos) = (k as f64).sin_cos();
            log.samples[k].force[0] += 6.0 * sin;
            log.samples[k].force[1] += 6.0 * cos;
        }
        let found = analyse(&log, None).unwrap();
        let [touch] = &found.touches[..] else {
            panic!("{:?}", found.touches);
        };
        assert_eq!(touch.span, [20.0, (touched.end - 1) as f64]);
        assert!(
            (touch.force - 6.0).abs() < 0.5 && touch.at_origin,
            "{touch:?}"
        );
        let mass = found.number("mass").unwrap();
        assert!((mass - sensor.mass).abs() < 0.005, "{mass}");
        let mut with_touches = found.with_touches.iter();
        let all = with_touches.find(|p| p.name == "mass").unwrap();
        assert!((all.value.unwrap() - sensor.mass).abs() > 0.005);
        let width = |name: &str, of: &[ToolNumber]| of.iter().find(|p| p.name == name).unwrap().std;
        assert!(width("mass", &found.with_touches) > width("mass", &found.parameters));
        assert!(confirmed(&found).is_empty());
    }
}
