//! What is logged: counts, seeds, noise, torques by (66), lost and uneven samples.

use cft_ident_core::robot::cft::actuation::ENCODER_SCALE;
use cft_ident_core::robot::cft::{LaboratorySetup, pantograph};
use cft_ident_plant::simulate::cft::{excitation, follow};
use cft_ident_plant::simulate::{CftTruth, Noise, PlantSensors, Settings, SimulatedRun};

fn run(sensors: PlantSensors<4>, seed: u64, effects: &[&str]) -> SimulatedRun<4> {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let effects: Vec<_> = effects
        .iter()
        .map(|text| text.parse().expect("effect"))
        .collect();
    let settings = Settings {
        sensors,
        seed,
        ..Settings::new(4.0)
    };
    follow(&truth, &effects, excitation(truth.setup), &settings).expect("runs")
}

fn noisy() -> PlantSensors<4> {
    PlantSensors {
        volt_noise: Noise::Absolute([1e-3, 2e-3, 3e-3, 4e-3]),
        torque_noise: Noise::Relative(0.01),
        ..PlantSensors::default()
    }
}

#[test]
fn logged_coordinates_are_whole_counts_and_joints_are_their_image() {
    let recording = run(PlantSensors::default(), 0, &[]);
    for (x, q) in recording.x.iter().zip(&recording.q) {
        for (x, scale) in x.iter().zip(ENCODER_SCALE) {
            let counts = x / scale;
            assert!((counts - counts.round()).abs() < 1e-6);
        }
        assert_eq!(*q, pantograph::joints(x).expect("inside"));
    }
    for (x, q) in recording.x.iter().zip(&recording.actual.q) {
        let true_x = pantograph::cartesian(q);
        for i in 0..4 {
            assert!((x[i] - true_x[i]).abs() <= 0.5 * ENCODER_SCALE[i] * (1.0 + 1e-6));
        }
    }
}

#[test]
fn logged_torques_are_the_logged_volts_by_equation_66() {
    let recording = run(
        PlantSensors {
            torque_noise: Noise::None,
            ..noisy()
        },
        1,
        &[],
    );
    for k in 0..recording.rows() {
        let torque =
            LaboratorySetup::Tuedacs.volts_to_torques(&recording.q[k], &recording.volts[k]);
        assert_eq!(recording.torque[k], torque);
    }
}

#[test]
fn one_seed_repeats_the_log_bit_for_bit_and_another_does_not() {
    let sensors = PlantSensors {
        jitter: 0.1,
        dropouts: 0.05,
        ..noisy()
    };
    let log = run(sensors, 7, &[]);
    assert_eq!(log, run(sensors, 7, &[]));
    let other = run(sensors, 8, &[]);
    assert_ne!(log.torque, other.torque);
    assert_ne!(log.t, other.t);
}

#[test]
fn noise_changes_the_log_and_not_the_motion() {
    let (clean, noisy) = (run(PlantSensors::default(), 7, &[]), run(noisy(), 7, &[]));
    assert_eq!(clean.actual, noisy.actual);
    assert_eq!(clean.q, noisy.q);
    assert_ne!(clean.torque, noisy.torque);
}

#[test]
fn noise_is_the_same_with_effects_on_and_off() {
    let sensors = PlantSensors {
        volt_noise: Noise::Absolute([1e-3; 4]),
        torque_noise: Noise::Absolute([0.5, 0.1, 0.1, 0.1]),
        dropouts: 0.02,
        jitter: 0.05,
        ..PlantSensors::default()
    };
    let quiet = PlantSensors {
        volt_noise: Noise::None,
        torque_noise: Noise::None,
        ..sensors
    };
    let noise = |effects: &[&str]| {
        let (with, without) = (run(sensors, 3, effects), run(quiet, 3, effects));
        assert_eq!(with.t, without.t);
        // The torque's own noise: what is left over (66) of the logged volts.
        let own: Vec<f64> = (0..with.rows())
            .flat_map(|k| {
                let by_volts =
                    LaboratorySetup::Tuedacs.volts_to_torques(&with.q[k], &with.volts[k]);
                std::array::from_fn::<f64, 4, _>(|i| with.torque[k][i] - by_volts[i])
            })
            .collect();
        let volts: Vec<f64> = with
            .volts
            .as_flattened()
            .iter()
            .zip(without.volts.as_flattened())
            .map(|(a, b)| a - b)
            .collect();
        (with.t, own, volts)
    };
    let (t_off, own_off, volts_off) = noise(&[]);
    let (t_on, own_on, volts_on) = noise(&["torque-offset:q4:c=1.5", "ripple:q2"]);
    assert_eq!(t_off, t_on);
    for (off, on) in own_off
        .iter()
        .chain(&volts_off)
        .zip(own_on.iter().chain(&volts_on))
    {
        // Adding and subtracting the clean value costs rounding only.
        assert!((off - on).abs() < 1e-12, "{off} against {on}");
    }
}

#[test]
fn relative_torque_noise_is_sized_by_each_joint() {
    let recording = run(noisy(), 2, &[]);
    let clean = run(PlantSensors::default(), 2, &[]);
    for i in 0..4 {
        let mean: f64 = clean.torque.iter().map(|tau| tau[i] * tau[i]).sum();
        let rms = (mean / clean.rows() as f64).sqrt();
        assert!((recording.torque_noise[i] / rms - 0.01).abs() < 1e-12);
    }
}

#[test]
fn lost_rows_and_uneven_instants_leave_times_that_are_true() {
    let sensors = PlantSensors {
        quantisation: false,
        jitter: 0.2,
        dropouts: 0.1,
        ..PlantSensors::default()
    };
    let recording = run(sensors, 5, &[]);
    assert!(
        (3500..3700).contains(&recording.rows()),
        "{}",
        recording.rows()
    );
    assert!(recording.t.windows(2).all(|t| t[1] > t[0]));
    assert_eq!(recording.actual.q.len(), recording.rows());
    assert_eq!(recording.status.len(), recording.rows());
    // Positions belong to the times that are logged: speeds by differences over the uneven steps agree
    // with the true speeds up to the acceleration within a step.
    for k in 1..recording.rows() {
        let step = recording.t[k] - recording.t[k - 1];
        let speed = (recording.q[k][1] - recording.q[k - 1][1]) / step;
        let mean = 0.5 * (recording.actual.v[k][1] + recording.actual.v[k - 1][1]);
        assert!(
            (speed - mean).abs() < 0.5 * step,
            "{speed} for {mean} at {} s",
            recording.t[k]
        );
    }
}
