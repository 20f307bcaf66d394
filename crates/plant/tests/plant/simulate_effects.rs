//! Effects: what they add to the torque, and the mechanism for states, memory and inertia.

mod accuracy;
mod data;
mod load_and_memory;
pub mod missing;
pub mod orders;
mod serial;
mod static_torques;

use cft_ident_core::robot::cft::pantograph::reference_jacobian;
use cft_ident_core::robot::cft::{LaboratorySetup, ReportCoefficients, dynamics};
use cft_ident_plant::simulate::cft::{effects, excitation, follow};
use cft_ident_plant::simulate::effects::{Effect, LAWS, PlantState};
use cft_ident_plant::simulate::moving::MovingPlant;
use cft_ident_plant::simulate::{
    CftTruth, EffectSpec, MotionStart, MotorInput, PlantEffects, PlantSensors, Settings,
    SimulateError, VoltSeries, run,
};
use cft_ident_plant::simulate::{SingleJointTruth, SmoothFriction};

fn truth() -> CftTruth {
    CftTruth::synthetic(LaboratorySetup::Tuedacs)
}

fn build(texts: &[&str]) -> Result<PlantEffects, SimulateError> {
    let specs: Result<Vec<EffectSpec>, _> = texts.iter().map(|text| text.parse()).collect();
    Ok(effects(&truth(), &specs?)?.0)
}

/// Torque that the effects take from the motors at a state.
fn added(effects: PlantEffects, q: [f64; 4], v: [f64; 4]) -> [f64; 4] {
    let plant = truth().plant().expect("a pose");
    let with = MovingPlant {
        plant: &plant,
        effects,
        volts: [0.0; 4],
    };
    let torque = with.holding_torque(0.0, &q, &v, &[]);
    let (_, own) = plant.dynamics(&q, &v);
    std::array::from_fn(|i| torque[i] - own[i])
}

const Q: [f64; 4] = [0.4, 0.3, -0.9, 1.9];
const V: [f64; 4] = [0.1, -0.2, 0.3, -0.4];

#[test]
fn torque_offset_is_the_same_constant_at_every_state() {
    for (q, v) in [(Q, V), ([0.1; 4], [0.0; 4])] {
        let torque = added(build(&["torque-offset:q4:c=1.5"]).expect("known"), q, v);
        for (i, expected) in [0.0, 0.0, 1.5, 0.0].into_iter().enumerate() {
            assert!((torque[i] - expected).abs() < 1e-12, "{torque:?}");
        }
    }
}

#[test]
fn ripple_follows_position_and_not_speed() {
    let text = "ripple:q5:order=7,sin=0.3,cos=0.2,sin2=0.1";
    let expected =
        |q5: f64| 0.3 * (7.0 * q5).sin() + 0.2 * (7.0 * q5).cos() + 0.1 * (14.0 * q5).sin();
    for v in [V, V.map(|v| -v)] {
        let torque = added(build(&[text]).expect("known"), Q, v);
        assert!((torque[3] - expected(Q[3])).abs() < 1e-12);
        assert_eq!(&torque[..3], &[0.0; 3]);
    }
}

#[test]
fn effects_without_a_joint_act_on_all_in_proportion_to_their_friction() {
    let torque = added(build(&["torque-offset"]).expect("known"), Q, V);
    let law = truth().friction;
    for (i, speed) in [0.2, 0.5, 0.5, 0.5].into_iter().enumerate() {
        assert!(
            (torque[i] / (0.1 * law[i].torque(speed)) - 1.0).abs() < 1e-9,
            "{torque:?}"
        );
    }
}

#[test]
fn unknown_effects_keys_and_joints_are_refused_with_what_is_known() {
    let text = |specs: &[&str]| build(specs).expect_err("refused").to_string();
    assert!(text(&["stiction"]).contains("torque-offset, asymmetric-friction"));
    assert!(text(&["ripple:q3"]).contains("q1, q2, q4, q5"));
    assert!(text(&["torque-offset:q4:d=1"]).contains("its keys are c"));
    assert!(text(&["ripple:q4:order"]).contains("cannot read `order`"));
}

#[test]
fn resolved_effects_name_every_value_with_its_unit() {
    let specs = ["ripple:q1:order=20".parse().expect("read")];
    let (_, values) = effects(&truth(), &specs).expect("known");
    assert_eq!(values.len(), 1);
    let ripple = &values[0];
    assert_eq!(
        (ripple.effect.as_str(), ripple.joint.as_deref()),
        ("ripple", Some("q1"))
    );
    assert_eq!(ripple.parameters["order"].unit, "1/m");
    assert_eq!(ripple.parameters["order"].value, 20.0);
    assert_eq!(ripple.parameters["sin"].unit, "N");
    assert_eq!(ripple.parameters.len(), 7);
}

#[test]
fn names_of_effects_are_unique_and_their_keys_too() {
    for (i, law) in LAWS.iter().enumerate() {
        let (entry, before) = (law.entry, &LAWS[..i]);
        assert!(before.iter().all(|other| other.entry.name != entry.name));
        for (j, key) in entry.keys.iter().enumerate() {
            assert!(entry.keys[..j].iter().all(|other| other.name != key.name));
        }
    }
}

#[test]
fn logged_torque_of_a_robot_with_an_offset_is_that_much_larger() {
    let settings = Settings {
        sensors: PlantSensors::perfect(),
        ..Settings::new(6.0)
    };
    let run = |texts: &[&str]| {
        let specs: Vec<EffectSpec> = texts.iter().map(|t| t.parse().expect("read")).collect();
        follow(
            &truth(),
            &specs,
            excitation(LaboratorySetup::Tuedacs),
            &settings,
        )
        .expect("runs")
    };
    let offset = 2.0;
    let recording = run(&["torque-offset:q4:c=2"]);
    let coefficients = ReportCoefficients::from_theta12(&truth().printed());
    // Over whole periods the declared model's torque, by the true motion, misses the offset.
    let period = 2500;
    let (first, last) = (3000, 3000 + period);
    let mut missed = 0.0;
    for k in first..last {
        let (q, v) = (&recording.actual.q[k], &recording.actual.v[k]);
        let (before, after) = (recording.actual.v[k - 1], recording.actual.v[k + 1]);
        let a = std::array::from_fn(|i| (after[i] - before[i]) / 2e-3);
        let own = dynamics::inverse_dynamics(q, v, &a, &coefficients)[2];
        let held = 0.5 * (recording.actual.torque[k - 1][2] + recording.actual.torque[k][2]);
        missed += (held - own - truth().friction[2].torque(v[2])) / period as f64;
    }
    assert!((missed - offset).abs() < 0.01, "{missed}");
}

/// Dahl's friction: dz/dt = v - sigma |v| z/f, torque sigma z.
#[derive(Debug)]
struct Dahl {
    sigma: f64,
    force: f64,
}

impl Effect for Dahl {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        torque[0] += self.sigma * motion.z[0];
    }

    fn states(&self) -> usize {
        1
    }

    fn rates(&self, motion: &PlantState, dz: &mut [f64]) {
        let v = motion.v[0];
        dz[0] = v - self.sigma * v.abs() * motion.z[0] / self.force;
    }
}

/// Rotor inertia of a motor on x_r and y_r, mapped to the joints: J^T diag(m) J a + J^T diag(m) dJ/dt v.
#[derive(Debug)]
struct Rotor {
    mass: f64,
}

impl Effect for Rotor {
    fn torque(&self, _motion: &PlantState, _torque: &mut [f64]) {}

    fn inertia(&self, motion: &PlantState, mass: &mut [f64], torque: &mut [f64]) {
        let (q, v): ([f64; 4], [f64; 4]) = (
            std::array::from_fn(|i| motion.q[i]),
            std::array::from_fn(|i| motion.v[i]),
        );
        let jacobian = reference_jacobian(&q);
        let rate = cft_ident_core::robot::cft::pantograph::reference_jacobian_rate(&q, &v);
        for row in 0..2 {
            let drift = rate[row][0] * v[2] + rate[row][1] * v[3];
            for i in 0..2 {
                torque[2 + i] += self.mass * jacobian[row][i] * drift;
                for j in 0..2 {
                    mass[4 * (2 + i) + 2 + j] += self.mass * jacobian[row][i] * jacobian[row][j];
                }
            }
        }
    }
}

/// Play of a joint: the torque lags behind position by half a gap.
#[derive(Debug)]
struct Play {
    half: f64,
    stiffness: f64,
    centre: f64,
}

impl Effect for Play {
    fn torque(&self, _motion: &PlantState, torque: &mut [f64]) {
        torque[0] += self.stiffness * self.centre;
    }

    fn moved(&mut self, motion: &PlantState) -> bool {
        let before = self.centre;
        self.centre = self
            .centre
            .clamp(motion.q[0] - self.half, motion.q[0] + self.half);
        self.centre != before
    }
}

fn joint() -> SingleJointTruth {
    SingleJointTruth {
        name: "q".to_owned(),
        kind: cft_ident_core::robot::JointKind::Prismatic,
        inertia: 2.0,
        friction: SmoothFriction::DoubleTanh(cft_ident_core::robot::friction::DoubleTanh {
            viscous: 4.0,
            coulomb_1: 0.0,
            coulomb_2: 0.0,
            slope_1: 1.0,
            slope_2: 1.0,
        }),
        offset: 0.0,
        gain: 1.0,
        resolution: 0.0,
        limits: (-10.0, 10.0),
    }
}

fn pushed(effect: Box<dyn Effect>, volts: Vec<f64>) -> cft_ident_plant::simulate::SimulatedRun<1> {
    let mut effects = PlantEffects::default();
    effects.push(effect);
    let times = (0..volts.len()).map(|k| k as f64).collect();
    let seconds = volts.len() as f64;
    let series =
        VoltSeries::new(times, volts.into_iter().map(|u| [u]).collect()).expect("a series");
    let start = MotionStart::State {
        position: [0.0],
        speed: [0.0],
    };
    run(
        &joint().plant().expect("a joint"),
        effects,
        &start,
        &MotorInput::Volts(series),
        &Settings::new(seconds),
    )
    .expect("runs")
}

#[test]
fn effect_with_a_state_of_its_own_is_integrated_with_the_plant() {
    let recording = pushed(
        Box::new(Dahl {
            sigma: 500.0,
            force: 3.0,
        }),
        vec![8.0, 8.0, 8.0],
    );
    // At constant speed Dahl's friction is its full force: v = (8 - 3)/4.
    let v = recording.actual.v.last().expect("rows")[0];
    assert!((v - 1.25).abs() < 0.01, "{v}");
    // Below its force it is a spring: the joint rings, and comes to rest under load.
    let held = pushed(
        Box::new(Dahl {
            sigma: 500.0,
            force: 3.0,
        }),
        vec![1.0; 12],
    );
    let last = held.rows() - 1;
    assert!(
        held.actual.v[last][0].abs() < 1e-3,
        "{}",
        held.actual.v[last][0]
    );
    assert!(held.actual.q[last][0] < 0.01, "{}", held.actual.q[last][0]);
}

#[test]
fn effect_with_memory_lags_behind_a_reversal_by_its_gap() {
    let effect = Play {
        half: 0.1,
        stiffness: 5.0,
        centre: 0.0,
    };
    let recording = pushed(Box::new(effect), vec![6.0, 6.0, 6.0, -6.0, -6.0, -6.0]);
    // The torque that the effect takes is tau - m a - b v; compare it with the play operator run over the
    // recorded positions.
    let mut centre: f64 = 0.0;
    let mut worst: f64 = 0.0;
    for k in 1..recording.rows() - 1 {
        let (before, here, after) = (
            recording.actual.v[k - 1][0],
            recording.actual.v[k][0],
            recording.actual.v[k + 1][0],
        );
        let q = recording.actual.q[k][0];
        centre = centre.clamp(q - 0.1, q + 0.1);
        if k % 1000 < 2 || k % 1000 > 998 {
            continue;
        }
        let taken = recording.torque[k][0] - 2.0 * (after - before) / 2e-3 - 4.0 * here;
        worst = worst.max((taken - 5.0 * centre).abs());
    }
    assert!(
        centre.abs() > 0.05 && worst < 0.02,
        "{worst} N, centre {centre}"
    );
}

#[test]
fn effect_with_inertia_in_actuator_coordinates_adds_the_rotor_energy() {
    let mut truth = truth();
    truth.friction = [cft_ident_core::robot::friction::DoubleTanh {
        viscous: 0.0,
        coulomb_1: 0.0,
        coulomb_2: 0.0,
        slope_1: 1.0,
        slope_2: 1.0,
    }; 4];
    let plant = truth.plant().expect("a pose");
    let mass = 63.2;
    let mut effects = PlantEffects::default();
    effects.push(Box::new(Rotor { mass }));
    let start = MotionStart::State {
        position: [-0.1343, 0.2766, 2.8, 0.2],
        speed: [0.05, 0.1, 0.0, 0.0],
    };
    let drive = MotorInput::Volts(VoltSeries::new(vec![0.0], vec![[0.0; 4]]).expect("a series"));
    let settings = Settings {
        sensors: PlantSensors::perfect(),
        ..Settings::new(0.1)
    };
    let recording = run(&plant, effects, &start, &drive, &settings).expect("runs");
    // Power of gravity equals the change of kinetic energy, rotors included.
    let energy = |k: usize| {
        let (q, v) = (recording.actual.q[k], recording.actual.v[k]);
        let (m, _) = plant.dynamics(&q, &v);
        let links: f64 = (0..4)
            .flat_map(|i| (0..4).map(move |j| (i, j)))
            .map(|(i, j)| 0.5 * v[i] * m[i][j] * v[j])
            .sum();
        let [x, y] = reference_jacobian(&q).map(|row| row[0] * v[2] + row[1] * v[3]);
        links + 0.5 * mass * (x * x + y * y)
    };
    let power = |k: usize| {
        let (q, v) = (recording.actual.q[k], recording.actual.v[k]);
        let gravity =
            dynamics::gravity_torque(&q, &ReportCoefficients::from_theta12(&truth.printed()));
        -(0..4).map(|i| gravity[i] * v[i]).sum::<f64>()
    };
    let last = recording.rows() - 1;
    // Simpson's rule over an even number of steps.
    let even = last - last % 2;
    let work: f64 = (0..even)
        .step_by(2)
        .map(|k| (power(k) + 4.0 * power(k + 1) + power(k + 2)) * 1e-3 / 3.0)
        .sum();
    let change = energy(even) - energy(0);
    assert!(change.abs() > 0.1, "{change} J");
    assert!(
        (change / work - 1.0).abs() < 1e-6,
        "{change} J for {work} J"
    );
}
