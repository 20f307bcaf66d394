use super::*;
use crate::robot::cft::{LaboratorySetup, ParameterStructure};
use crate::robot::standard::pseudo_inertia;
use crate::robot::tree::{Coordinate, Link, Tree};
use crate::robot::{JointKind, Robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Three turning links of which the second hangs across, at an exact right angle: where an angle is off by a thousandth,
/// the links' weight shows a little of masses that torques are not to determine.
fn arm() -> Robot {
    let joints = ["q1", "q2", "q3"];
    let link = |i: usize, alpha: f64, a: f64| {
        let (rotation, origin) = Link::of_row(a, alpha, 0.1 * i as f64, 0.0);
        Link {
            name: format!("link_{}", i + 1),
            parent: i.checked_sub(1),
            rotation,
            origin,
            axis: [0.0, 0.0, 1.0],
            kind: JointKind::Revolute,
            coordinate: Coordinate::Joint(i),
        }
    };
    let links = vec![
        link(0, 0.0, 0.0),
        link(1, -std::f64::consts::FRAC_PI_2, 0.1),
        link(2, 0.0, 0.4),
    ];
    let chain = Tree::new(links, 3, [0.0, 0.0, -9.81]).unwrap();
    let names = joints.map(str::to_owned).to_vec();
    Robot::of_tree(chain, names, true, Vec::new())
}

fn draw(chance: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0
}

/// R factor of rows at random states with this noise, for shared parameters `theta` and an offset of 0.5.
fn factor(robot: &Robot, theta: &DVector<f64>, rows: usize, noise: f64) -> DMatrix<f64> {
    let mut chance = ChaCha8Rng::seed_from_u64(21);
    let (n, p) = (robot.joints(), theta.len());
    let mut all = RFactor::new(p + 2);
    let mut y = vec![0.0; n * p];
    for _ in 0..rows {
        let mut state =
            |scale: f64| -> Vec<f64> { (0..n).map(|_| scale * draw(&mut chance)).collect() };
        let (q, v, a) = (state(0.4), state(1.0), state(3.0));
        robot.regressor(&q, &v, &a, &mut y);
        for j in 0..n {
            let mut row = y[j * p..(j + 1) * p].to_vec();
            let tau: f64 = row.iter().zip(theta.iter()).map(|(y, t)| y * t).sum();
            row.push(1.0);
            row.push(tau + 0.5 + noise * draw(&mut chance));
            row.iter_mut().for_each(|x| *x /= noise.max(1e-3));
            all.fold(&row);
        }
    }
    all.r()
}

fn cost(factor: &DMatrix<f64>, theta: &DVector<f64>) -> f64 {
    let u = theta.len();
    (factor.column(u) - factor.columns(0, u) * theta).norm_squared()
}

fn bodies(count: usize) -> DVector<f64> {
    let body = |i: usize| Body {
        mass: 4.0 - 0.3 * i as f64,
        centre: [0.05, -0.02 * i as f64, 0.08],
        inertia: [0.03, 0.001, -0.002, 0.04, 0.003, 0.02],
    };
    DVector::from_vec((0..count).flat_map(|i| body(i).standard()).collect())
}

fn all_consistent(found: &FeasibleParameters) -> bool {
    let consistent = |s: &[f64; STANDARD]| pseudo_inertia(s).symmetric_eigenvalues().min() > 0.0;
    found.links.iter().all(consistent) && found.drives.iter().all(|d| *d > 0.0)
}

fn without_priors(map: &StandardMap, factor: &DMatrix<f64>) -> FeasibleParameters {
    let bodies = vec![None; map.links.len()];
    let task = ConsistencyProblem {
        map,
        bodies: &bodies,
        factor,
        effective: 1.0,
        friction: &[],
    };
    feasible(&task).unwrap()
}

/// Free fit and feasible fit of some rows: their costs and the latter.
fn both(
    robot: &Robot,
    truth: &DVector<f64>,
    rows: usize,
    noise: f64,
) -> (f64, f64, FeasibleParameters, DVector<f64>) {
    let map = robot.standard_map();
    let factor = factor(robot, truth, rows, noise);
    let u = truth.len() + 1;
    let square = factor.view((0, 0), (u, u)).into_owned();
    let free = square
        .solve_upper_triangular(&factor.column(u).rows(0, u).into_owned())
        .unwrap();
    let found = without_priors(&map, &factor);
    let [before, after] = [&free, &found.theta].map(|theta| cost(&factor, theta));
    (before, after, found, free)
}

/// Nearest squared distance of parameters to physically consistent ones, without a prior to speak of.
fn beyond(robot: &Robot, free: &DVector<f64>) -> f64 {
    let p = robot.parameters().len();
    let mut factor = DMatrix::zeros(p + 1, p + 1);
    for i in 0..p {
        factor[(i, i)] = 1e4;
        factor[(i, p)] = 1e4 * free[i];
    }
    let map = robot.standard_map();
    let found = without_priors(&map, &factor);
    (found.theta - free.rows(0, p)).norm()
}

#[test]
fn where_the_truth_is_consistent_the_fit_hardly_suffers() {
    for robot in [
        arm(),
        Robot::cft(LaboratorySetup::default(), ParameterStructure::Full22),
        Robot::cft(LaboratorySetup::default(), ParameterStructure::Printed12),
    ] {
        let map = robot.standard_map();
        let mut standard = bodies(map.links.len());
        standard.extend(map.drives.iter().map(|_| 0.2));
        let truth = &map.matrix * standard;
        let (before, after, found, _) = both(&robot, &truth, 400, 0.5);
        assert!(all_consistent(&found));
        // 22 parameters that are fitted freely save about 22 of the noise's own 1200 or more
        assert!(after < before + 30.0, "{before} {after}");
        let own = truth.len();
        assert!((found.theta[own] - 0.5).abs() < 0.1, "{}", found.theta[own]);
    }
}

#[test]
fn rows_whose_free_fit_is_inconsistent_give_links_that_are_not() {
    for robot in [
        arm(),
        Robot::cft(LaboratorySetup::default(), ParameterStructure::Full22),
    ] {
        let map = robot.standard_map();
        let mut standard = bodies(map.links.len());
        standard.extend(map.drives.iter().map(|_| 0.01));
        let truth = &map.matrix * standard;
        // few rows and much noise: some moment of inertia comes out below zero
        let (before, after, found, free) = both(&robot, &truth, 12, 8.0);
        assert!(beyond(&robot, &free) > 0.01, "{}", beyond(&robot, &free));
        assert!(all_consistent(&found));
        assert!(after > before && after < before + 60.0, "{before} {after}");
    }
}

#[test]
fn a_prior_fills_in_where_torques_determine_nothing() {
    let robot = arm();
    let map = robot.standard_map();
    let mut standard = bodies(3);
    standard.extend([PLAIN_DRIVE; 3]);
    let truth = &map.matrix * &standard;
    let factor = factor(&robot, &truth, 400, 1e-3);
    let body = |i: usize| Body::of(&std::array::from_fn(|k| standard[STANDARD * i + k]));
    let given: Vec<Option<Body>> = (0..3).map(|i| Some(body(i))).collect();
    let task = ConsistencyProblem {
        map: &map,
        bodies: &given,
        factor: &factor,
        effective: 1.0,
        friction: &[],
    };
    let found = feasible(&task).unwrap();
    // the same torques with another prior are those of other masses
    let plain = without_priors(&map, &factor);
    for (i, (link, other)) in found.links.iter().zip(&plain.links).enumerate() {
        let mass = standard[STANDARD * i + 9];
        assert!((link[9] / mass - 1.0).abs() < 1e-3, "{} {mass}", link[9]);
        assert!((other[9] / mass - 1.0).abs() > 0.03, "{} {mass}", other[9]);
    }
    let [given, plain] = [&found, &plain].map(|found| cost(&factor, &found.theta));
    assert!((given - plain).abs() < 1.0, "{given} {plain}");
    let wrong = Body {
        inertia: [1.0, 0.0, 0.0, 0.1, 0.0, 0.1],
        ..PLAIN
    };
    let wrong = vec![Some(wrong); 3];
    let task = ConsistencyProblem {
        bodies: &wrong,
        ..task
    };
    // what no body can have is no prior
    let found = feasible(&task).unwrap();
    assert_eq!(found.given, [false; 3]);
}
