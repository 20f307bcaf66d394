use cft_ident::friction::{estimate::*, motions::motions, prepare};
use cft_ident::motion::Settings as MS;
use cft_ident::robot::Robot;
use cft_ident::robot::cft::actuation;
use cft_ident::robot::cft::{Setup, Structure};
use cft_ident::simulate::cft_experiment::*;
use cft_ident::simulate::*;
fn main() {
    let seeds: u64 = std::env::args()
        .nth(1)
        .and_then(|s| s.parse().ok())
        .unwrap_or(5);
    let only: Option<usize> = std::env::args().nth(2).and_then(|s| s.parse().ok());
    let robot = Robot::cft(Setup::Tuedacs, Structure::Printed12);
    for joint in 0..4usize {
        if only.is_some_and(|o| o != joint) {
            continue;
        }
        let (mut within, mut cover, mut total, mut errs) = ([0usize; 5], 0usize, 0usize, vec![]);
        let mut rel: Vec<Vec<f64>> = vec![vec![]; 5];
        for seed in 0..seeds {
            let truth = CftTruth::synthetic(Setup::Tuedacs)
                .varied(0.15, seed)
                .unwrap();
            let r = OneJointMove::new(joint, 20.0, Some(seed))
                .reference(Setup::Tuedacs)
                .unwrap();
            let mut s = Settings::new(20.0);
            s.seed = seed;
            s.sensors.torque_noise = Noise::Relative(0.01);
            let c0 = std::time::Instant::now();
            let rec = follow(&truth, &[], r, &s).unwrap();
            let tsim = c0.elapsed().as_secs_f64();
            let (q, tau): (Vec<f64>, Vec<f64>) = (rec.q.concat(), rec.torque.concat());
            let ms = MS {
                cutoff_hz: 20.0,
                q_order: std::env::var("QO")
                    .ok()
                    .and_then(|s| s.parse().ok())
                    .unwrap_or(4),
                q_cutoff_hz: Some(
                    std::env::var("QC")
                        .ok()
                        .and_then(|s| s.parse().ok())
                        .unwrap_or(100.0),
                ),
                ..MS::default()
            };
            let m = motions(&rec.t, &q, &tau, 4, &ms).unwrap();
            let var = |q: &[f64]| {
                actuation::joint_covariance(
                    q.try_into().unwrap(),
                    &actuation::quantisation_variance(),
                )
                .map_or(1e-10, |c| c[joint][joint])
            };
            let c1 = std::time::Instant::now();
            let p = prepare::prepare(
                &robot,
                joint,
                &m,
                &prepare::Sensors {
                    variance: &var,
                    held: true,
                },
            )
            .unwrap();
            let tprep = c1.elapsed().as_secs_f64();
            let names: Vec<String> = robot
                .parameters()
                .iter()
                .map(|p| p.name.to_string())
                .collect();
            let e = match estimate("q", &names, &p, &Options::default()) {
                Ok(e) => e,
                Err(e) => {
                    println!("{seed} {e}");
                    continue;
                }
            };
            let test = c1.elapsed().as_secs_f64() - tprep;
            let law0 = truth.friction[joint];
            let t0 = law0.parameters();
            let mut line = String::new();
            for i in 0..5 {
                let est = e.law.parameters()[i];
                let std = e.covariance[i][i].sqrt();
                let z = (est - t0[i]) / std;
                within[i] += usize::from(z.abs() < 3.0);
                rel[i].push((est / t0[i] - 1.0).abs());
                line += &format!(" {:.3}({:+.1})", est / t0[i], z);
            }
            let (mut a, mut b) = (0.0, 0.0);
            for (k, c) in e.curve.iter().enumerate() {
                let f = law0.torque(c.v);
                a += (c.torque - f).powi(2);
                b += f * f;
                if k % 5 == 2 {
                    total += 1;
                    cover += usize::from((c.torque - f).abs() < 1.96 * c.std);
                }
            }
            errs.push((a / b).sqrt());
            if seed < 12 {
                println!(
                    "q{joint} {seed} {:?} err {:.3}% nis {:.3} in {:.3} tn {:.3}/{:.3} rf {:.2} wid {:.2} ne {} pl {} sim {:.2} prep {:.2} est {:.2} sp {:.3?} {line}",
                    e.ending,
                    100.0 * (a / b).sqrt(),
                    e.nis.mean,
                    e.nis.share_inside,
                    e.torque_noise,
                    rec.torque_noise[joint],
                    e.position_factor,
                    e.widening,
                    p.problem.nuisance,
                    e.plateaus.len(),
                    tsim,
                    tprep,
                    test,
                    e.speeds.covered
                );
            }
        }
        errs.sort_by(f64::total_cmp);
        let med: Vec<String> = rel
            .iter_mut()
            .map(|r| {
                r.sort_by(f64::total_cmp);
                format!("{:.2}%", 100.0 * r[r.len() / 2])
            })
            .collect();
        println!(
            "JOINT {joint}: within3 {within:?} of {seeds}, cover {:.3}, err med {:.3}% p95 {:.3}% max {:.3}%, med param {med:?}",
            cover as f64 / total as f64,
            errs[errs.len() / 2] * 100.0,
            errs[errs.len() * 95 / 100] * 100.0,
            errs.last().unwrap() * 100.0
        );
    }
}
