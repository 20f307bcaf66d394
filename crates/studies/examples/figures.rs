//! Draws figures from made-up numbers, to be looked at: `cargo run -p cft-ident-studies --example figures -- DIR`.

use std::path::PathBuf;

use cft_ident::friction::estimate::FrictionCurvePoint;
use cft_ident::report::figure::{
    FrictionFigure, FrictionPanel, JointTorque, MapFigure, TorqueFigure,
};

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    std::fs::create_dir_all(&folder)?;
    std::fs::write(
        folder.join("torque.svg"),
        torque(&["q1", "q2", "q4", "q5"], 20.0).svg(),
    )?;
    std::fs::write(
        folder.join("torque-one.svg"),
        torque(&["slide"], 25.0).svg(),
    )?;
    for (k, picture) in map().cells(Vec::new()).pictures.iter().enumerate() {
        std::fs::write(folder.join(format!("left-{k}.svg")), picture)?;
    }
    std::fs::write(folder.join("friction.svg"), friction(4).svg())?;
    std::fs::write(folder.join("friction-one.svg"), friction(1).svg())
}

/// What is left of a joint that lacks a term of two signals.
fn map() -> MapFigure {
    let at = |k: usize| -1.0 + 2.0 * (k as f64 + 0.5) / 20.0;
    let left = |x: f64, y: f64| 3.0 * (2.0 * x).sin() * y;
    let cell = |b: usize, a: usize| {
        let (x, y) = (at(a), at(b));
        (x * x + y * y < 1.3).then(|| left(x, y) + 0.1 * noise(20 * b + a))
    };
    MapFigure {
        title: "what is left of q2".into(),
        description: "made-up numbers".into(),
        over: [
            ("position".into(), "rad".into()),
            ("speed of q3".into(), "rad/s".into()),
        ],
        unit: "Nm".into(),
        ends: [[-1.0, 1.0]; 2],
        cells: (0..20)
            .map(|b| (0..20).map(|a| cell(b, a)).collect())
            .collect(),
        curve: (0..24)
            .map(|k| -1.0 + 2.0 * f64::from(k) / 23.0)
            .map(|x| [x, left(x, 0.3), 0.15])
            .collect(),
    }
}

/// Numbers that look like noise and are the same in every run.
fn noise(k: usize) -> f64 {
    let x = (k as f64 * 12.9898).sin() * 43758.5453;
    2.0 * (x - x.floor()) - 1.0
}

fn torque(names: &[&str], seconds: f64) -> TorqueFigure {
    let joints = names
        .iter()
        .enumerate()
        .map(|(j, name)| {
            let size = [180.0, 45.0, 9.0, 0.012][j % 4];
            let samples = (seconds * 250.0) as usize;
            let t: Vec<f64> = (0..samples).map(|k| k as f64 / 250.0).collect();
            let smooth = |t: f64| {
                let v = (1.3 * t + j as f64).cos() + 0.4 * (3.1 * t).cos();
                let a = -(1.3 * t + j as f64).sin() - 1.2 * (3.1 * t).sin();
                size * (0.5 * (40.0 * v).tanh() + 0.3 * v + 0.35 * a)
            };
            let mut reconstructed: Vec<f64> = t.iter().map(|&t| smooth(t)).collect();
            let mut measured: Vec<f64> = t
                .iter()
                .enumerate()
                .map(|(k, &t)| smooth(t) * 1.015 + 0.02 * size * noise(7 * k + j))
                .collect();
            if j == 1 {
                // A gap, and a spike of one sample.
                for k in 2000..2150.min(samples) {
                    measured[k] = f64::NAN;
                    reconstructed[k] = f64::NAN;
                }
                measured[3111] += 0.4 * size;
            }
            JointTorque {
                joint: name.to_string(),
                unit: if j < 2 { "N" } else { "Nm" }.into(),
                t,
                measured,
                reconstructed,
                relative_error: 0.0183 / (j + 1) as f64,
                rmse: 0.0183 * size,
            }
        })
        .collect();
    TorqueFigure {
        title: "Torque reconstruction, unseen.csv".into(),
        joints,
    }
}

fn friction(count: usize) -> FrictionFigure {
    let panels = (0..count)
        .map(|j| {
            let size = [32.0, 14.0, 2.1, 0.031][j];
            let top = [0.31, 0.25, 1.9, 2.4][j];
            let law = |v: f64| {
                let x = v / top;
                size * (0.5 * x + 0.5 * (60.0 * x).tanh() - 0.18 * (9.0 * x).tanh())
            };
            let curve = (-120..=120)
                .map(|k| {
                    let v = 1.25 * top * k as f64 / 120.0;
                    let beyond = (v.abs() / top - 1.0).max(0.0);
                    let std = size * (0.008 + 0.6 * beyond);
                    FrictionCurvePoint {
                        v,
                        torque: law(v) * 1.01,
                        std,
                    }
                })
                .collect();
            let plateaus = (1..=7)
                .flat_map(|k| [-1.0, 1.0].map(|side| (k, side * top * k as f64 / 7.2)))
                .map(|(k, v)| {
                    let std = size * 0.012;
                    FrictionCurvePoint {
                        v,
                        torque: law(v) + std * noise(k + 31 * j),
                        std,
                    }
                })
                .collect();
            FrictionPanel {
                joint: ["q1", "q2", "q4", "q5"][j].into(),
                note: if j == 2 {
                    "slope_1 is a lower bound"
                } else {
                    ""
                }
                .into(),
                speed_unit: if j < 2 { "m/s" } else { "rad/s" }.into(),
                torque_unit: if j < 2 { "N" } else { "Nm" }.into(),
                curve,
                covered: vec![[-top, -0.02 * top], [0.02 * top, top]],
                plateaus,
                cloud: Vec::new(),
                beyond_curve: false,
                truth: (-60..=60)
                    .map(|k| top * k as f64 / 60.0)
                    .map(|v| [v, law(v)])
                    .collect(),
            }
        })
        .collect();
    FrictionFigure {
        title: "Friction of the CFT robot".into(),
        panels,
    }
}
