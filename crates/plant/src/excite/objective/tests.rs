use super::*;
use crate::excite::from_files::machine;
use crate::excite::start::random_motion;
use cft_ident_files::config::RobotFile;
use std::f64::consts::TAU;

fn built(file: &str) -> ForeseenRobot {
    let robot = RobotFile::parse("robot.toml", file).expect("a robot file");
    machine(&robot, None).expect("a machine")
}

/// Limits that random motions press against, on every quantity.
const CFT: &str = "[robot]\nmodel = \"cft\"\nsetup = \"dspace\"\n\
    [limits.q4]\ntorque = 35.0\nspeed = 3.0\nacceleration = 12.0\nposition = [-1.2, -0.2]\n\
    [limits.x_c3]\nacceleration = 3.0\n[limits.q2]\ntorque = 30.0\n";
const ONE: &str = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"prismatic\"\n\
    [friction]\nfitted_with_inertias = true\noffset = true\n\
    [friction.joint.q1]\nviscous = 0.3\ncoulomb = 0.5\n\
    [limits.q1]\nposition = [-0.1, 0.2]\nspeed = 0.5\ntorque = 2.0\n";

/// Relative differences of the derivative and of central differences of the value.
fn compare(
    machine: &ForeseenRobot,
    criterion: &Criterion,
    prior: Option<&PriorInformation>,
    step: f64,
) -> f64 {
    let n = machine.coordinates();
    let free = (0..n).map(|i| (i == 2).then_some(1.7)).collect();
    let variables = DesignVariables::new(&machine.channels, TAU * 0.4, 5, free);
    // motions fill twice the room that the objective allows, so that penalties press
    let tight: Vec<BoundedQuantity> = machine.channels.iter().map(|c| c.reserved(0.5)).collect();
    let objective = Objective::new(machine, criterion, &tight, variables, prior, 60);
    let mut work = objective.work();
    let mut worst = 0.0_f64;
    for number in 0..3 {
        let motion = random_motion(machine, &machine.channels, &objective.variables, 5, number);
        let z = objective.variables.of(&motion);
        let mut multipliers = LagrangeMultipliers::new(objective.constraints(), 3.0);
        for (k, lambda) in multipliers.lambda.iter_mut().enumerate() {
            *lambda = 1e-3 * (k % 7) as f64;
        }
        let mut gradient = vec![0.0; z.len()];
        let mut at = |z: &[f64], gradient: &mut [f64]| {
            objective
                .evaluate(z, 20.0, &multipliers, &mut work, gradient)
                .expect("a value")
        };
        at(&z, &mut gradient);
        let mut rest = vec![0.0; z.len()];
        let differences: Vec<f64> = (0..z.len())
            .map(|k| {
                let mut shifted = |h: f64| {
                    let mut z = z.clone();
                    z[k] += h;
                    at(&z, &mut rest)
                };
                let near = shifted(step) - shifted(-step);
                let far = shifted(2.0 * step) - shifted(-2.0 * step);
                (8.0 * near - far) / (12.0 * step)
            })
            .collect();
        let size = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        let off = gradient.iter().zip(&differences);
        let off = off.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        assert!(size > 1e-3 && size.is_finite(), "{size}");
        worst = worst.max(off / size);
    }
    worst
}

#[test]
fn derivatives_of_every_criterion_and_limit_are_those_of_the_value() {
    let machine = built(CFT);
    let factors = (0..12).map(|k| 1.0 / (1.0 + f64::from(k))).collect();
    let all = [
        Criterion::Condition,
        Criterion::ConditionNormalised,
        Criterion::DOptimal,
        Criterion::AOptimal(factors),
    ];
    for criterion in all {
        let off = compare(&machine, &criterion, None, 1e-3);
        assert!(off < 2e-7, "{criterion:?}: {off:e}");
    }
}

#[test]
fn derivatives_hold_with_information_that_is_given() {
    let machine = built(CFT);
    let information = DMatrix::from_fn(12, 12, |i, j| if i == j { 30.0 } else { 1.0 });
    let prior = PriorInformation {
        information,
        rows: 500.0,
    };
    let off = compare(&machine, &Criterion::Condition, Some(&prior), 1e-4);
    assert!(off < 2e-7, "{off:e}");
}

#[test]
fn derivatives_hold_for_the_full_chain_and_for_one_joint() {
    let full = CFT.replace("[limits.q4]", "parameters = 22\n[limits.q4]");
    // short of such a motion, G of 22 parameters has the condition 1e13: differences of its
    // value are all rounding, so that something is given besides
    let prior = PriorInformation {
        information: DMatrix::identity(22, 22),
        rows: 60.0,
    };
    let normalised = Criterion::ConditionNormalised;
    let off = compare(&built(&full), &normalised, Some(&prior), 1e-4);
    assert!(off < 1e-6, "22 parameters: {off:e}");
    // the sign in its Coulomb column turns round within a hundredth of the speed limit
    let off = compare(&built(ONE), &Criterion::ConditionNormalised, None, 1e-5);
    assert!(off < 1e-6, "one joint: {off:e}");
}
