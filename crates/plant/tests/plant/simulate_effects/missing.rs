//! Logs of robots with effects, and the torque that the declared model misses in them at the true motion.

use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::{LaboratorySetup, ReportCoefficients, dynamics};
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_plant::simulate::cft::{excitation, follow};
use cft_ident_plant::simulate::single_joint::{self, SingleJointTruth};
use cft_ident_plant::simulate::{
    CftTruth, EffectSpec, MotionStart, MotorInput, Noise, PlantSensors, Settings, SimulateError,
    SimulatedRun, SmoothFriction, VoltSeries, run,
};

pub fn specs(texts: &[&str]) -> Vec<EffectSpec> {
    texts.iter().map(|t| t.parse().expect("read")).collect()
}

pub fn perfect<const J: usize>(seconds: f64) -> Settings<J> {
    Settings {
        sensors: PlantSensors::perfect(),
        seed: 7,
        ..Settings::new(seconds)
    }
}

/// Table 3 on the synthetic robot: all joints move and turn round.
pub fn table_3(texts: &[&str]) -> SimulatedRun<4> {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    follow(
        &truth,
        &specs(texts),
        excitation(LaboratorySetup::Tuedacs),
        &perfect(5.0),
    )
    .expect("runs")
}

/// The same with encoder counts and noise, and a seed.
pub fn noisy(texts: &[&str], seed: u64) -> SimulatedRun<4> {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let mut settings = perfect(3.0);
    settings.seed = seed;
    settings.sensors = PlantSensors {
        torque_noise: Noise::Relative(0.01),
        ..PlantSensors::default()
    };
    follow(
        &truth,
        &specs(texts),
        excitation(LaboratorySetup::Tuedacs),
        &settings,
    )
    .expect("runs")
}

/// State of one row: positions, speeds, accelerations.
pub type Row = ([f64; 4], [f64; 4], [f64; 4]);

pub fn row(recording: &SimulatedRun<4>, k: usize) -> Row {
    let actual = &recording.actual;
    (actual.q[k], actual.v[k], actual.a[k])
}

/// M a + C v + G of the declared model.
pub fn rigid((q, v, a): &Row) -> [f64; 4] {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    dynamics::inverse_dynamics(q, v, a, &ReportCoefficients::from_theta12(&truth.printed()))
}

/// Friction of the declared model.
pub fn friction(v: &[f64; 4]) -> [f64; 4] {
    let laws = CftTruth::synthetic(LaboratorySetup::Tuedacs).friction;
    std::array::from_fn(|i| laws[i].torque(v[i]))
}

/// Torque at row k that the declared model does not have.
pub fn missing(recording: &SimulatedRun<4>, k: usize) -> [f64; 4] {
    let state = row(recording, k);
    let (rigid, friction) = (rigid(&state), friction(&state.1));
    std::array::from_fn(|i| recording.actual.torque[k][i] - rigid[i] - friction[i])
}

/// Holds the missing torque of Table 3 against a formula of (t, q, v, a), at all rows where every speed is
/// above `slowest`; the tolerance is a fraction of the formula's largest value.
pub fn assert_missing(
    text: &str,
    slowest: f64,
    tolerance: f64,
    formula: impl Fn(f64, &Row) -> [f64; 4],
) {
    let recording = table_3(&[text]);
    assert_eq!(recording.rows(), 5000, "{text}");
    let (mut largest, mut worst, mut rows) = (0.0_f64, 0.0_f64, 0);
    for k in 0..recording.rows() {
        let state = row(&recording, k);
        if state.1.iter().any(|v| v.abs() < slowest) {
            continue;
        }
        rows += 1;
        let expected = formula(recording.t[k], &state);
        for (found, expected) in missing(&recording, k).into_iter().zip(expected) {
            largest = largest.max(expected.abs());
            worst = worst.max((found - expected).abs());
        }
    }
    println!("{text}: {worst:.1e} of {largest:.3} over {rows} rows");
    assert!(rows > 1000, "{text}: {rows} rows");
    assert!(largest > 0.05, "{text} adds {largest}");
    assert!(
        worst < tolerance * largest + 1e-9,
        "{text}: {worst} off, {largest} added"
    );
}

/// A sliding joint like that of a ball-screw axis.
pub fn axis() -> SingleJointTruth {
    let law = ViscousCoulomb {
        viscous: 200.0,
        coulomb: 20.0,
    };
    SingleJointTruth {
        name: "q1".to_owned(),
        kind: JointKind::Prismatic,
        inertia: 95.0,
        friction: SmoothFriction::viscous_coulomb(law, 95.0),
        offset: -3.0,
        gain: 35.0,
        resolution: 0.0,
        limits: (-5.0, 5.0),
    }
}

/// The axis is pushed to and fro by volts that are held over a fifth of a second.
pub fn pushed(
    truth: &SingleJointTruth,
    texts: &[&str],
) -> Result<(SimulatedRun<1>, Vec<f64>), SimulateError> {
    let (effects, _) = single_joint::effects(truth, &specs(texts))?;
    let times: Vec<f64> = (0..40).map(|k| 0.2 * f64::from(k)).collect();
    let volts: Vec<[f64; 1]> = times
        .iter()
        .map(|t| [2.0 * (1.7 * t).sin() + 0.7 * (5.1 * t).cos()])
        .collect();
    let start = MotionStart::State {
        position: [0.0],
        speed: [0.0],
    };
    let drive = MotorInput::Volts(VoltSeries::new(times, volts).expect("a series"));
    let recording = run(&truth.plant()?, effects, &start, &drive, &perfect(8.0))?;
    let actual = &recording.actual;
    let missing = (0..recording.rows()).map(|k| {
        let (v, a) = (actual.v[k][0], actual.a[k][0]);
        actual.torque[k][0] - truth.inertia * a - truth.friction.torque(v) - truth.offset
    });
    let missing = missing.collect();
    Ok((recording, missing))
}
