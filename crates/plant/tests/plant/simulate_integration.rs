//! The integration against the equations: reference states, energy, tolerance, a second integrator.

use cft_ident_core::robot::cft::geometry::{GRAVITY, L4, L6, U};
use cft_ident_core::robot::cft::{LaboratorySetup, ReportCoefficients, dynamics};
use cft_ident_core::robot::friction::DoubleTanh;
use cft_ident_plant::simulate::cft::{excitation, follow, mechanism};
use cft_ident_plant::simulate::integrate::{DormandPrince, OdeSystem, StepTolerance};
use cft_ident_plant::simulate::moving::MovingPlant;
use cft_ident_plant::simulate::{
    CftTruth, OneJointMove, Plant, PlantEffects, PlantSensors, Settings, SimulatedRun,
};
use serde_json::Value;

const FREE: DoubleTanh = DoubleTanh {
    viscous: 0.0,
    coulomb_1: 0.0,
    coulomb_2: 0.0,
    slope_1: 1.0,
    slope_2: 1.0,
};

fn moving(plant: &Plant<4>, volts: [f64; 4]) -> MovingPlant<'_, 4> {
    MovingPlant {
        plant,
        effects: PlantEffects::default(),
        volts,
    }
}

fn four(value: &Value) -> [f64; 4] {
    std::array::from_fn(|i| value[i].as_f64().expect("a number"))
}

#[test]
fn plant_accelerates_as_the_reference_states_say() {
    let file = std::path::Path::new(cft_ident_support::ROOT).join("fixtures/oracle/reference.json");
    let text = std::fs::read_to_string(file).expect("fixture");
    let oracle: Value = serde_json::from_str(&text).expect("JSON");
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    for (k, number) in truth
        .printed()
        .iter()
        .chain(&truth.friction_theta())
        .enumerate()
    {
        assert_eq!(
            Some(*number),
            oracle["theta"][k].as_f64(),
            "theta_{}",
            k + 1
        );
    }
    let plant = truth.plant().expect("a pose");
    let states = oracle["states"].as_array().expect("states");
    assert_eq!(states.len(), 40);
    for state in states {
        let (q, v, a) = (four(&state["q"]), four(&state["v"]), four(&state["a"]));
        let moving = moving(&plant, four(&state["volts_tuedacs"]));
        let mut y = [0.0; 8];
        y[..4].copy_from_slice(&q);
        y[4..].copy_from_slice(&v);
        let mut rates = [0.0; 8];
        moving.rates(0.0, &y, &mut rates);
        for i in 0..4 {
            assert_eq!(rates[i], v[i]);
            // The volts are rounded in the file, so a is met to its own scale.
            assert!(
                (rates[4 + i] - a[i]).abs() < 1e-9 * (1.0 + a[i].abs()),
                "{rates:?} for {a:?}"
            );
        }
    }
}

/// Kinetic plus potential energy of the frictionless robot; the potential's gradient is G of eq. (17).
fn energy(q: &[f64; 4], v: &[f64; 4], theta: &[f64; 12]) -> f64 {
    let mass = dynamics::inertia(q, &ReportCoefficients::from_theta12(theta));
    let kinetic: f64 = (0..4)
        .flat_map(|i| (0..4).map(move |j| (i, j)))
        .map(|(i, j)| 0.5 * v[i] * mass[i][j] * v[j])
        .sum();
    let [_, _, _, _, t5, t6, t7, t8, t9, t10, t11, t12] = *theta;
    let mr = t11 + t12;
    let (a, b) = (-(t5 + t7 + L6 * t12), -(t9 + U * mr));
    let (c, e) = (-(t6 + t8), -t10);
    let (s4, c4) = q[2].sin_cos();
    let (s, cos) = (q[2] + q[3]).sin_cos();
    kinetic + GRAVITY * ((L4 * mr - a) * c4 + (L4 * mr - b) * cos + c * s4 + e * s)
}

#[test]
fn energy_is_conserved_without_friction_and_volts() {
    let mut truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    truth.friction = [FREE; 4];
    let plant = truth.plant().expect("a pose");
    let mut system = moving(&plant, [0.0; 4]);
    let theta = truth.printed();
    let mut y = [0.4, 0.3, -0.9, 1.9, 0.3, 1.0, 0.5, -0.4];
    let split = |y: &[f64; 8]| -> ([f64; 4], [f64; 4]) {
        (
            std::array::from_fn(|i| y[i]),
            std::array::from_fn(|i| y[4 + i]),
        )
    };
    let (q, v) = split(&y);
    let start = energy(&q, &v, &theta);
    let mut integrator = DormandPrince::new(StepTolerance::default());
    let mut exchanged: f64 = 0.0;
    for k in 0..5000 {
        let t = 1e-3 * f64::from(k);
        integrator
            .advance(&mut system, t, t + 1e-3, &mut y)
            .expect("smooth");
        let (q, v) = split(&y);
        let now = energy(&q, &v, &theta);
        exchanged = exchanged.max((now - energy(&q, &[0.0; 4], &theta)).abs());
        assert!(
            (now / start - 1.0).abs() < 1e-8,
            "{now} J of {start} J at {t} s"
        );
    }
    assert!(
        exchanged > 0.1 * start.abs(),
        "the test moves energy about: {exchanged} J"
    );
}

#[test]
fn friction_and_volts_change_the_energy_by_their_work() {
    struct Powered<'a>(MovingPlant<'a, 4>, [DoubleTanh; 4]);
    impl OdeSystem<16> for Powered<'_> {
        fn rates(&self, t: f64, y: &[f64; 16], dydt: &mut [f64; 16]) {
            self.0.rates(t, y, dydt);
            let q = std::array::from_fn(|i| y[i]);
            let torque = self.0.plant.mechanism.torque(&q, &self.0.volts);
            let power = |i: usize| (torque[i] - self.1[i].torque(y[4 + i])) * y[4 + i];
            dydt[8] = (0..4).map(power).sum();
        }
    }
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let plant = truth.plant().expect("a pose");
    let volts = [-0.9, 0.3, 0.5, 2.0];
    let mut system = Powered(moving(&plant, volts), truth.friction);
    let mut y = [0.0; 16];
    y[..8].copy_from_slice(&[0.1, 0.3, -0.9, 1.9, 0.2, 0.5, 0.1, -0.1]);
    let theta = truth.printed();
    let at = |y: &[f64; 16]| {
        energy(
            &std::array::from_fn(|i| y[i]),
            &std::array::from_fn(|i| y[4 + i]),
            &theta,
        )
    };
    let start = at(&y);
    let mut integrator = DormandPrince::new(StepTolerance::default());
    integrator
        .advance(&mut system, 0.0, 0.5, &mut y)
        .expect("smooth");
    let change = at(&y) - start;
    assert!(change.abs() > 1.0, "{change} J");
    assert!(
        (change / y[8] - 1.0).abs() < 1e-7,
        "{change} J for work of {} J",
        y[8]
    );
}

/// Largest difference of joint positions and speeds between two runs.
fn difference(a: &SimulatedRun<4>, b: &SimulatedRun<4>) -> (f64, f64) {
    let worst = |a: &[[f64; 4]], b: &[[f64; 4]]| {
        let pairs = a.as_flattened().iter().zip(b.as_flattened());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert_eq!(a.rows(), b.rows());
    (
        worst(&a.actual.q, &b.actual.q),
        worst(&a.actual.v, &b.actual.v),
    )
}

#[test]
fn halving_the_tolerance_moves_nothing_that_an_encoder_could_see() {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    for number in 0..5 {
        let with = |tolerance: StepTolerance| {
            let reference = if number < 4 {
                OneJointMove::new(number, 20.0, None)
                    .reference(&mechanism(truth.setup).expect("four joints"))
                    .expect("fits")
            } else {
                excitation(truth.setup)
            };
            // Without quantisation: a count that tips over elsewhere is no error of integration.
            let settings = Settings {
                tolerance,
                sensors: PlantSensors::perfect(),
                ..Settings::new(20.0)
            };
            follow(&truth, &[], reference, &settings).expect("runs")
        };
        let normal = with(StepTolerance::default());
        let (q, v) = difference(&normal, &with(StepTolerance::default().scaled(0.5)));
        println!("experiment {number}: q {q:.1e}, v {v:.1e}");
        assert!(
            q < 1e-9 && v < 1e-7,
            "halved tolerance, experiment {number}: q {q}, v {v}"
        );
        let (q, v) = difference(&normal, &with(StepTolerance::default().scaled(1e-3)));
        println!("experiment {number}: q {q:.1e}, v {v:.1e} to the thousandth of it");
        assert!(
            q < 2e-9 && v < 2e-7,
            "tight tolerance, experiment {number}: q {q}, v {v}"
        );
    }
}

#[test]
fn runge_kutta_with_a_bounded_step_agrees_through_the_stiff_reversal() {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let plant = truth.plant().expect("a pose");
    // Every joint is braked through zero speed by friction and volts.
    let start = [0.2, 0.3, -0.9, 1.9, 0.02, 0.1, 0.1, -0.1];
    let mut system = moving(&plant, [-0.5, 0.0, -0.2, -0.9]);
    let mut adaptive = start;
    let mut integrator = DormandPrince::new(StepTolerance::default());
    for k in 0..300 {
        let t = 1e-3 * f64::from(k);
        integrator
            .advance(&mut system, t, t + 1e-3, &mut adaptive)
            .expect("smooth");
    }
    // Fastest rate: friction slope at rest over the smallest eigenvalue of M, here below 1e4/s; 5 us is
    // forty steps within it.
    let (steps, h) = (60_000, 5e-6);
    let mut y = start;
    let rates = |y: &[f64; 8]| {
        let mut dydt = [0.0; 8];
        system.rates(0.0, y, &mut dydt);
        dydt
    };
    let along = |y: &[f64; 8], k: &[f64; 8], h: f64| -> [f64; 8] {
        std::array::from_fn(|i| y[i] + h * k[i])
    };
    for _ in 0..steps {
        let k1 = rates(&y);
        let k2 = rates(&along(&y, &k1, 0.5 * h));
        let k3 = rates(&along(&y, &k2, 0.5 * h));
        let k4 = rates(&along(&y, &k3, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
    for i in 0..8 {
        assert!(
            (y[i] - adaptive[i]).abs() < 2e-9,
            "{i}: {} against {}",
            y[i],
            adaptive[i]
        );
    }
    assert!(
        (0..4).any(|i| start[4 + i] * y[4 + i] < 0.0),
        "no joint reversed: {y:?}"
    );
}
