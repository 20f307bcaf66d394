//! Three arms: three joints, six, and a SCARA whose last joint slides. Every link's numbers are those of a body.

use std::f64::consts::FRAC_PI_2;

use crate::chain::{Chain, Link};
use crate::space::Vector;

const FALL: Vector = [0.0, 0.0, -9.81];

/// A link whose body is a rod of `half` lengths about its centre, with a little mass beside its axes.
fn link(xyz: Vector, rpy: Vector, mass: f64, centre: Vector, half: Vector, drive: f64) -> Link {
    let square = half.map(|h| mass * h * h / 3.0);
    let beside = 0.05 * mass * half[0] * half[1];
    Link {
        xyz,
        rpy,
        slides: false,
        mass,
        centre,
        inertia: [
            [square[1] + square[2], -beside, 0.0],
            [-beside, square[0] + square[2], 0.0],
            [0.0, 0.0, square[0] + square[1]],
        ],
        drive_inertia: drive,
    }
}

pub fn arm3() -> Chain {
    let up = [-FRAC_PI_2, 0.0, 0.0];
    Chain::new(
        vec![
            link(
                [0.0, 0.0, 0.3],
                [0.0; 3],
                6.0,
                [0.0, 0.02, -0.05],
                [0.07, 0.07, 0.12],
                0.30,
            ),
            link(
                [0.0, 0.06, 0.1],
                up,
                4.5,
                [0.17, 0.01, 0.03],
                [0.20, 0.05, 0.05],
                0.25,
            ),
            link(
                [0.38, 0.0, 0.0],
                [0.0; 3],
                2.2,
                [0.13, -0.015, 0.02],
                [0.16, 0.04, 0.04],
                0.08,
            ),
        ],
        FALL,
    )
}

pub fn arm6() -> Chain {
    let (up, down) = ([-FRAC_PI_2, 0.0, 0.0], [FRAC_PI_2, 0.0, 0.0]);
    Chain::new(
        vec![
            link(
                [0.0, 0.0, 0.32],
                [0.0; 3],
                9.0,
                [0.01, 0.03, -0.06],
                [0.09, 0.09, 0.15],
                0.45,
            ),
            link(
                [0.05, 0.0, 0.1],
                up,
                7.0,
                [0.19, 0.01, 0.04],
                [0.22, 0.06, 0.06],
                0.40,
            ),
            link(
                [0.42, 0.0, 0.0],
                [0.0; 3],
                4.0,
                [0.06, -0.03, 0.01],
                [0.10, 0.07, 0.06],
                0.20,
            ),
            link(
                [0.04, 0.2, 0.0],
                down,
                2.6,
                [0.0, 0.01, 0.12],
                [0.05, 0.05, 0.13],
                0.06,
            ),
            link(
                [0.0, 0.0, 0.2],
                up,
                1.4,
                [0.005, -0.03, 0.01],
                [0.04, 0.06, 0.04],
                0.05,
            ),
            link(
                [0.0, -0.08, 0.0],
                down,
                0.7,
                [0.02, 0.01, 0.05],
                [0.03, 0.03, 0.05],
                0.03,
            ),
        ],
        FALL,
    )
}

pub fn scara() -> Chain {
    let mut slide = link(
        [0.28, 0.0, 0.0],
        [0.0; 3],
        1.6,
        [0.03, 0.01, -0.06],
        [0.03, 0.03, 0.12],
        2.4,
    );
    slide.slides = true;
    Chain::new(
        vec![
            link(
                [0.0, 0.0, 0.4],
                [0.0; 3],
                7.0,
                [0.16, 0.01, 0.0],
                [0.20, 0.06, 0.04],
                0.30,
            ),
            link(
                [0.32, 0.0, 0.05],
                [0.0; 3],
                4.0,
                [0.12, -0.02, 0.01],
                [0.17, 0.05, 0.04],
                0.15,
            ),
            slide,
        ],
        FALL,
    )
}
