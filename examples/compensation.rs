//! Compensation in a control loop: a PD controller alone, and with the torque of the model along the desired motion.
//! The robot is a simulation by the same model; in its place stands the driver of yours.
//!
//! ```text
//! cft-ident example ur10
//! cft-ident lsq ur10/ur10.csv -r ur10/ur10.toml -o model.toml
//! cargo run --release --example compensation -- model.toml
//! ```
//!
//! `cft-ident export --c` writes the same torque, with effects that remember the motion too, for a real-time controller.

use std::error::Error;
use std::path::Path;

use cft_ident::config::ModelFile;
use cft_ident::identify::refined;
use cft_ident::robot::model::Model;
use nalgebra::{DMatrix, DVector};

/// Period of the controller, and steps of the simulated robot in it.
const PERIOD_S: f64 = 1e-3;
const STEPS: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).ok_or("give MODEL.toml")?;
    let file = ModelFile::load(Path::new(&name))?;
    let model = refined(&file, &name)?.model;
    for compensated in [false, true] {
        let error = 1e3 * tracking_error(&model, compensated)?;
        println!("compensation {compensated}: rms tracking error {error:.2} mrad or mm");
    }
    Ok(())
}

/// Torque of the model.
fn torque(model: &Model, q: &[f64], v: &[f64], a: &[f64]) -> DVector<f64> {
    let mut tau = DVector::zeros(q.len());
    model.torque(q, v, a, tau.as_mut_slice());
    tau
}

/// Column i is the torque of a unit acceleration of joint i.
fn mass_matrix(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let rest = vec![0.0; q.len()];
    let still = torque(model, q, &rest, &rest);
    let columns: Vec<DVector<f64>> = (0..q.len())
        .map(|i| {
            let mut a = rest.clone();
            a[i] = 1.0;
            torque(model, q, &rest, &a) - &still
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// Root mean square of the position error along ten seconds of a sine on every joint.
fn tracking_error(model: &Model, compensated: bool) -> Result<f64, Box<dyn Error>> {
    let n = model.friction.len();
    let rest = vec![0.0; n];
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    let inertia = mass_matrix(model, &q).diagonal();
    let (mut sum, periods) = (0.0, 10_000);
    for k in 0..periods {
        let (amplitude, w, t) = (0.3, 2.0, k as f64 * PERIOD_S);
        let desired = vec![amplitude * (1.0 - (w * t).cos()); n];
        let speed = vec![amplitude * w * (w * t).sin(); n];
        let acceleration = vec![amplitude * w * w * (w * t).cos(); n];

        // the controller: gravity always, the rest of the model where it is asked for
        let mut command = match compensated {
            true => torque(model, &desired, &speed, &acceleration),
            false => torque(model, &desired, &rest, &rest),
        };
        for j in 0..n {
            let bandwidth: f64 = 15.0;
            let pull =
                bandwidth.powi(2) * (desired[j] - q[j]) + 2.0 * bandwidth * (speed[j] - v[j]);
            command[j] += inertia[j] * pull;
            sum += (desired[j] - q[j]).powi(2);
        }

        // the robot
        for _ in 0..STEPS {
            let left = &command - torque(model, &q, &v, &rest);
            let mass = mass_matrix(model, &q)
                .cholesky()
                .ok_or("the links of this model cannot exist")?;
            let a = mass.solve(&left);
            for j in 0..n {
                v[j] += a[j] * PERIOD_S / STEPS as f64;
                q[j] += v[j] * PERIOD_S / STEPS as f64;
            }
        }
    }
    Ok((sum / (n * periods) as f64).sqrt())
}
