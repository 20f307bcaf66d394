//! Starts, limits, saturation, rest, open loop: the behaviour of the report's simulation block.

use cft_ident_core::robot::RobotError;
use cft_ident_core::robot::cft::{LaboratorySetup, pantograph};
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_plant::simulate::cft::{excitation, follow, mechanism};
use cft_ident_plant::simulate::{
    CftTruth, MotionStart, MotorInput, MotorStatus, Path, PlantEffects, PlantSensors, Reference,
    ReferenceFrame, RunEnding, Settings, SimulateError, SimulatedRun, VoltSeries, run,
};
use cft_ident_plant::simulate::{OneJointMove, SingleJointTruth, SmoothFriction};

use crate::simulate_effects::missing::axis;

fn truth() -> CftTruth {
    CftTruth::synthetic(LaboratorySetup::Tuedacs)
}

fn constant(volts: [f64; 4]) -> MotorInput<4> {
    MotorInput::Volts(VoltSeries::new(vec![0.0, 1e3], vec![volts, volts]).expect("a series"))
}

fn perfect(seconds: f64) -> Settings<4> {
    Settings {
        sensors: PlantSensors::perfect(),
        ..Settings::new(seconds)
    }
}

fn at_rest(position: [f64; 4]) -> MotionStart<4> {
    MotionStart::State {
        position,
        speed: [0.0; 4],
    }
}

fn play(
    start: &MotionStart<4>,
    drive: &MotorInput<4>,
    settings: &Settings<4>,
) -> Result<SimulatedRun<4>, SimulateError> {
    run(
        &truth().plant().expect("a pose"),
        PlantEffects::default(),
        start,
        drive,
        settings,
    )
}

#[test]
fn eight_initial_conditions_come_back_in_the_first_row() {
    let position = [-0.2, 0.15, 1.3, 0.4];
    let speed = [0.02, -0.03, 0.4, -0.1];
    let start = MotionStart::State { position, speed };
    let recording = play(&start, &constant([0.0; 4]), &perfect(0.01)).expect("runs");
    let (q, v) = (recording.actual.q[0], recording.actual.v[0]);
    for i in 0..4 {
        assert!((recording.x[0][i] - position[i]).abs() < 1e-15);
        assert!((pantograph::cartesian(&q)[i] - position[i]).abs() < 1e-15);
        let back = pantograph::cartesian_velocities(&q, &v);
        assert!((back[i] - speed[i]).abs() < 1e-14);
    }
    // And the motion goes on from them.
    let step = recording.t[1];
    for (i, speed) in speed.iter().enumerate() {
        let moved = (recording.x[1][i] - recording.x[0][i]) / step;
        assert!((moved - speed).abs() < 0.02, "{moved} for {speed}");
    }
}

#[test]
fn robot_at_rest_without_gravity_load_and_volts_stays_at_rest() {
    // Gravity is linear in theta: without the arm's moments nothing pulls.
    let mut truth = truth();
    for i in [4, 6, 8, 9, 5, 7] {
        truth.theta[i] = 0.0;
    }
    truth.theta[10] = 0.0;
    truth.theta[11] = 0.0;
    // Inertia that has no weight keeps M regular: BB and CC of the full chain.
    truth.theta[12] = 1.0;
    truth.theta[14] = 1.0;
    truth.theta[13] = 1.0;
    let plant = truth.plant().expect("a pose");
    let start = at_rest([-0.13, 0.27, 2.8, 0.2]);
    let recording = run(
        &plant,
        PlantEffects::default(),
        &start,
        &constant([0.0; 4]),
        &perfect(1.0),
    )
    .expect("runs");
    assert_eq!(recording.actual.v.last(), Some(&[0.0; 4]));
    assert_eq!(recording.actual.q.first(), recording.actual.q.last());
}

#[test]
fn gravity_pulls_the_arm_down_and_balancing_volts_hold_it() {
    let plant = truth().plant().expect("a pose");
    let start = at_rest([-0.1343, 0.2766, 2.8, 0.2]);
    let recording = play(&start, &constant([0.0; 4]), &perfect(0.2)).expect("runs");
    let down = recording.x.last().expect("rows")[0] - recording.x[0][0];
    assert!(down > 1e-3, "{down} m");
    let q = recording.actual.q[0];
    let (_, load) = plant.dynamics(&q, &[0.0; 4]);
    let volts = plant.mechanism.volts(&q, &load).expect("regular");
    assert!(
        (volts[0] + 0.66).abs() < 0.01 && (volts[1] - 0.16).abs() < 0.01,
        "{volts:?}"
    );
    let held = play(&start, &constant(volts), &perfect(1.0)).expect("runs");
    for (end, begin) in held.x.last().expect("rows").iter().zip(held.x[0]) {
        assert!((end - begin).abs() < 1e-12);
    }
}

#[test]
fn settled_start_needs_no_transient() {
    let pose = [-0.1, 0.3, 2.0, 0.1];
    let reference = Reference {
        frame: ReferenceFrame::Motors,
        path: Path::Hold(pose),
    };
    let settings = perfect(2.0);
    let recording = follow(&truth(), &[], reference, &settings).expect("runs");
    for (end, begin) in recording.x.last().expect("rows").iter().zip(recording.x[0]) {
        assert!((end - begin).abs() < 1e-9, "{end} from {begin}");
    }
    // The distance to the target is what the P controller needs to carry the arm.
    let sag = recording.x[0][0] - pose[0];
    assert!(
        (sag - recording.volts[0][0] / -270.0).abs() < 1e-9 && sag > 1e-3,
        "{sag}"
    );
}

#[test]
fn limit_stops_the_run_and_says_which_coordinate_and_when() {
    let start = at_rest([-0.1343, 0.2766, 2.8, 0.4]);
    // Down and along the rails: x_c1 is reached first.
    let settings = perfect(20.0);
    let recording = play(&start, &constant([0.0, 0.16, 0.0, 1.5]), &settings).expect("runs");
    assert_eq!(recording.ending, RunEnding::StoppedAtLimit);
    let event = recording.limits.first().expect("a limit");
    assert_eq!(recording.limits.len(), 1);
    let last = recording.rows() - 1;
    let place = recording
        .coordinates
        .iter()
        .position(|c| *c == event.coordinate);
    let place = place.expect("a coordinate");
    assert_eq!(recording.status[last][place], MotorStatus::LimitReached);
    assert_eq!(event.t, recording.t[last]);
    let upper = LaboratorySetup::Tuedacs.limits().upper[place];
    assert!(
        event.value > upper && event.value < upper + 1e-2,
        "{event:?}"
    );
    assert!(recording.x[last - 1][place] <= upper);
    assert!(recording.t[last] < 20.0);
}

#[test]
fn saturation_cuts_the_volts_and_marks_the_channel() {
    let reference = Reference {
        frame: ReferenceFrame::Motors,
        path: Path::Hold([-0.1343, 0.2766, 2.8, 0.2]),
    };
    let drive = MotorInput::Follow {
        reference,
        control: truth().plant().expect("a pose").control(),
    };
    // 10 cm off on x_c4: the controller asks for 240 V.
    let start = at_rest([-0.1343, 0.2766, 2.8, 0.1]);
    let recording = play(&start, &drive, &perfect(1.0)).expect("runs");
    assert_eq!(recording.volts[0][3], 10.0);
    assert_eq!(recording.status[0][3], MotorStatus::Saturated);
    assert_eq!(recording.status[0][2], MotorStatus::Running);
    assert!(recording.volts.iter().flatten().all(|u| u.abs() <= 10.0));
    assert_eq!(recording.status.last(), Some(&[MotorStatus::Running; 4]));
    let other = Settings {
        saturation: 2.5,
        ..perfect(1.0)
    };
    let recording = play(&start, &drive, &other).expect("runs");
    assert_eq!(recording.volts[0][3], 2.5);
}

#[test]
fn logged_volts_played_back_repeat_the_motion() {
    let settings = perfect(3.0);
    let first = follow(
        &truth(),
        &[],
        excitation(LaboratorySetup::Tuedacs),
        &settings,
    )
    .expect("runs");
    let series = VoltSeries::new(first.t.clone(), first.volts.clone()).expect("a series");
    let start = MotionStart::State {
        position: first.x[0],
        speed: [0.0; 4],
    };
    let second = play(&start, &MotorInput::Volts(series), &settings).expect("runs");
    assert_eq!(first.volts, second.volts);
    for (a, b) in first.actual.q.iter().zip(&second.actual.q) {
        for i in 0..4 {
            assert!((a[i] - b[i]).abs() < 1e-9, "{} against {}", a[i], b[i]);
        }
    }
}

#[test]
fn unusable_starts_settings_and_volts_are_errors_with_the_way_out() {
    let outside = play(
        &at_rest([-0.1, 0.2, 2.0, 0.9]),
        &constant([0.0; 4]),
        &perfect(1.0),
    );
    let text = outside.expect_err("outside").to_string();
    assert!(
        text.contains("x_c4 = 0.9") && text.contains("0.5344"),
        "{text}"
    );
    let unreachable = play(
        &at_rest([-5.0, 0.2, 2.0, 0.1]),
        &constant([0.0; 4]),
        &perfect(1.0),
    );
    assert!(matches!(
        unreachable,
        Err(SimulateError::Robot(RobotError::OutOfReach { .. }))
    ));
    let rest = at_rest([-0.1, 0.2, 2.0, 0.1]);
    for change in [
        (|s| s.seconds = 0.0) as fn(&mut Settings<4>),
        |s| s.rate_hz = f64::NAN,
        |s| s.saturation = -1.0,
        |s| s.tolerance.relative = 0.0,
        |s| s.sensors.jitter = 2.0,
    ] {
        let mut settings = perfect(1.0);
        change(&mut settings);
        let outcome = play(&rest, &constant([0.0; 4]), &settings);
        assert!(matches!(outcome, Err(SimulateError::Parameter { .. })));
    }
    for (times, volts) in [
        (vec![], vec![]),
        (vec![0.0, 0.0], vec![[0.0]; 2]),
        (vec![0.0], vec![[f64::NAN]]),
        (vec![0.0, 1.0], vec![[0.0]]),
    ] {
        assert!(matches!(
            VoltSeries::new(times, volts),
            Err(SimulateError::Volts { .. })
        ));
    }
    let wild = MotionStart::State {
        position: [-0.1, 0.2, 2.0, 0.1],
        speed: [1e9, 0.0, 0.0, 0.0],
    };
    let outcome = play(&wild, &constant([0.0; 4]), &perfect(1.0));
    assert!(
        !matches!(
            outcome,
            Ok(SimulatedRun {
                ending: RunEnding::Completed,
                ..
            })
        ),
        "a speed of 1e9 m/s does not end well"
    );
}

#[test]
fn table_3_with_the_printed_offsets_is_refused_on_dspace() {
    let truth = CftTruth::synthetic(LaboratorySetup::Dspace);
    let outcome = follow(
        &truth,
        &[],
        excitation(LaboratorySetup::Tuedacs),
        &perfect(1.0),
    );
    match outcome {
        Err(SimulateError::LimitAtStart { coordinate, .. }) => assert_eq!(coordinate, "x_c4"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn single_joint_follows_its_equation_exactly() {
    // Viscous friction alone under a constant force: v = (f/b)(1 - exp(-b t/m)).
    let law = ViscousCoulomb {
        viscous: 200.0,
        coulomb: 0.0,
    };
    let joint = SingleJointTruth {
        friction: SmoothFriction::viscous_coulomb(law, 95.0),
        limits: (f64::NEG_INFINITY, f64::INFINITY),
        ..axis()
    };
    let joint = joint.plant().expect("a joint");
    joint.check().expect("physical");
    let drive =
        MotorInput::Volts(VoltSeries::new(vec![0.0, 10.0], vec![[1.0]; 2]).expect("a series"));
    let start = MotionStart::State {
        position: [0.0],
        speed: [0.0],
    };
    let settings = Settings::new(2.0);
    let recording = run(&joint, PlantEffects::default(), &start, &drive, &settings).expect("runs");
    for (t, v) in recording.t.iter().zip(&recording.actual.v) {
        let exact = 38.0 / 200.0 * (1.0 - (-200.0 * t / 95.0).exp());
        assert!((v[0] - exact).abs() < 1e-9, "{} for {exact}", v[0]);
    }
    assert_eq!(recording.torque[5], [35.0]);
    assert_eq!(recording.joints, ["q1"]);
}

#[test]
fn dry_friction_holds_a_single_joint_below_its_breakaway() {
    let joint = SingleJointTruth {
        offset: 0.0,
        gain: 1.0,
        resolution: 1e-6,
        limits: (-1.0, 1.0),
        ..axis()
    };
    let joint = joint.plant().expect("a joint");
    let travelled = |force: f64| {
        let drive = MotorInput::Volts(
            VoltSeries::new(vec![0.0, 10.0], vec![[force]; 2]).expect("a series"),
        );
        let start = MotionStart::State {
            position: [0.0],
            speed: [0.0],
        };
        let settings = Settings {
            saturation: f64::INFINITY,
            ..Settings::new(1.0)
        };
        let recording =
            run(&joint, PlantEffects::default(), &start, &drive, &settings).expect("runs");
        recording.actual.q.last().expect("rows")[0]
    };
    assert!(travelled(15.0) < 2e-4, "{}", travelled(15.0));
    assert!(travelled(40.0) > 0.03, "{}", travelled(40.0));
}

#[test]
fn one_joint_moves_stay_inside_given_ranges_or_are_refused() {
    let plan = OneJointMove {
        range: Some((0.3, 0.5)),
        speeds: Some(vec![0.1, 0.01]),
        ..OneJointMove::new(0, 20.0, None)
    };
    let recording = follow(
        &truth(),
        &[],
        plan.reference(&mechanism(LaboratorySetup::Tuedacs).expect("four joints"))
            .expect("fits"),
        &perfect(20.0),
    )
    .expect("runs");
    assert!(
        recording
            .actual
            .q
            .iter()
            .all(|q| (0.297..0.503).contains(&q[0]))
    );
    let wide = OneJointMove {
        range: Some((0.0, 2.0)),
        ..plan
    };
    let text = wide
        .reference(&mechanism(LaboratorySetup::Tuedacs).expect("four joints"))
        .expect_err("too wide")
        .to_string();
    assert!(text.contains("q1 cannot move over [0, 2]"), "{text}");
    assert!(
        OneJointMove::new(9, 20.0, None)
            .reference(&mechanism(LaboratorySetup::Tuedacs).expect("four joints"))
            .is_err()
    );
}
