//! The CFT arm as a serial chain whose pantograph and tool guide are dependent joints (Table 2,
//! eq. (54), (56)): the same 22 parameters, the same torques as the report's closed form.

use crate::robot_oracle;

use cft_ident::config::RobotFile;
use cft_ident::robot::Robot;
use cft_ident::robot::cft::links::{PseudoInertia, base_parameters};
use cft_ident::robot::cft::{LaboratorySetup, ParameterStructure};
use robot_oracle::{Draw, Oracle};

/// Frames 8 of Table 2 carry the tool; gravity acts along -z0.
const ARM: &str = include_str!("../../fixtures/robots/cft-chain.toml");

fn arm() -> Robot {
    RobotFile::parse("cft-chain.toml", ARM).unwrap().robot()
}

/// Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the frame's origin, first moments and mass of a
/// pseudo-inertia: I = trace(J) 1 - J.
fn standard(links: &[[[f64; 4]; 4]; 8]) -> Vec<f64> {
    let mut out = Vec::new();
    for j in links {
        let trace = j[0][0] + j[1][1] + j[2][2];
        out.extend([
            trace - j[0][0],
            -j[0][1],
            -j[0][2],
            trace - j[1][1],
            -j[1][2],
            trace - j[2][2],
            j[0][3],
            j[1][3],
            j[2][3],
            j[3][3],
        ]);
    }
    out
}

fn torque(robot: &Robot, theta: &[f64], q: &[f64], v: &[f64], a: &[f64]) -> Vec<f64> {
    let p = theta.len();
    let mut y = vec![0.0; 4 * p];
    robot.regressor(q, v, a, &mut y);
    y.chunks(p)
        .map(|row| row.iter().zip(theta).map(|(y, t)| y * t).sum())
        .collect()
}

#[test]
fn the_arm_has_22_base_parameters() {
    let robot = arm();
    assert_eq!(robot.tree().links().len(), 8);
    assert_eq!(robot.parameters().len(), 22);
}

#[test]
fn the_chain_gives_the_general_links_of_the_reference() {
    let robot = arm();
    for g in &Oracle::load().general {
        let theta = robot.base_of(&standard(&g.links));
        let got = torque(&robot, &theta, &g.q, &g.v, &g.a);
        for (i, got) in got.iter().enumerate() {
            let inertial: f64 = (0..4).map(|j| g.m[i][j] * g.a[j]).sum();
            let want = inertial + g.cv[i] + g.g[i];
            let size = (0..4).map(|j| (g.m[i][j] * g.a[j]).abs()).sum::<f64>() + g.g[i].abs();
            assert!((got - want).abs() < 1e-10 * size, "{got} and not {want}");
        }
    }
}

#[test]
fn its_regressor_has_rank_22_and_spans_the_closed_form() {
    let chain = arm();
    let closed = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Full22);
    let mut draw = Draw::new(22);
    let states = 60;
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..states {
        let (q, v, a) = draw.state();
        for (robot, rows) in [(&chain, &mut ours), (&closed, &mut theirs)] {
            let mut y = vec![0.0; 4 * 22];
            robot.regressor(&q, &v, &a, &mut y);
            rows.extend(y);
        }
    }
    let matrix = |rows: &[f64]| nalgebra::DMatrix::from_row_slice(4 * states, 22, rows);
    let (ours, theirs) = (matrix(&ours), matrix(&theirs));
    let svd = ours.clone().svd(true, true);
    let ratio = svd.singular_values.min() / svd.singular_values.max();
    assert!(ratio > 1e-6, "{ratio:e}");
    // every column of the closed form is a combination of the chain's
    let x = svd.solve(&theirs, 0.0).unwrap();
    let rest = (&ours * x - &theirs).amax() / theirs.amax();
    assert!(rest < 1e-10, "{rest:e}");
}

#[test]
fn torques_agree_with_the_closed_form_on_random_links() {
    let chain = arm();
    let closed = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Full22);
    let mut draw = Draw::new(7);
    for g in &Oracle::load().general {
        let ours = chain.base_of(&standard(&g.links));
        let theirs = base_parameters(&g.links.map(PseudoInertia));
        for _ in 0..20 {
            let (q, v, a) = draw.state();
            let got = torque(&chain, &ours, &q, &v, &a);
            let want = torque(&closed, &theirs, &q, &v, &a);
            let size = want.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (got, want) in got.iter().zip(&want) {
                assert!((got - want).abs() < 1e-12 * size, "{got} and not {want}");
            }
        }
    }
}
