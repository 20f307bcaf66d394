use cft_ident::inertia::{accumulate, columns::*, solve::*, verdict::verdict};
use cft_ident::log::Block;
use cft_ident::motion::{HeldForces, Settings as MS};
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{Setup, Structure};
use cft_ident::robot::model::*;
use cft_ident::simulate::cft_experiment::*;
use cft_ident::simulate::reference::Fourier;
use cft_ident::simulate::*;
use cft_ident::validate::Reconstruction;
fn block(r: &Recording<4>) -> Block {
    let mut b = Block {
        t: r.t.clone(),
        q: r.q.concat(),
        tau: r.torque.concat(),
        ..Block::default()
    };
    HeldForces::new(4).centre(&Robot::cft(Setup::Tuedacs, Structure::Printed12), &mut b);
    b
}
fn src(b: &Block) -> impl FnMut(&mut Block) -> Result<bool, std::io::Error> + '_ {
    move |o| {
        o.t.extend_from_slice(&b.t);
        o.q.extend_from_slice(&b.q);
        o.tau.extend_from_slice(&b.tau);
        Ok(false)
    }
}
fn env(n: &str, d: f64) -> f64 {
    std::env::var(n)
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(d)
}
fn big(phase: f64) -> Fourier<4> {
    let mut f = Fourier::table_3();
    f.start = phase;
    f.a = vec![
        [0.18, 0.35, 1.6, 0.30],
        [0.10, -0.2, 0.5, -0.2],
        [-0.15, 0.25, -0.6, 0.2],
        [0.1, -0.2, 0.5, 0.15],
    ];
    f.b = vec![
        [0.05, 0.1, -0.4, -0.15],
        [-0.12, 0.15, 0.6, 0.2],
        [0.06, -0.2, 0.3, 0.15],
        [-0.12, 0.15, -0.4, -0.2],
    ];
    f.offset = [-0.1343, 0.2766, 2.79, 0.2369];
    f
}
fn main() {
    let seeds: u64 = std::env::args()
        .nth(1)
        .and_then(|s| s.parse().ok())
        .unwrap_or(3);
    let secs = env("SECS", 30.0);
    let robot = Robot::cft(Setup::Tuedacs, Structure::Printed12);
    let ms = MS {
        cutoff_hz: env("FC", 10.0),
        q_cutoff_hz: Some(env("QC", 60.0)),
        ..MS::default()
    };
    let mut within = [0usize; 12];
    let mut ident = [0usize; 12];
    let mut w95 = [0usize; 12];
    for seed in 0..seeds {
        let truth = if env("VARY", 1.0) > 0.0 {
            CftTruth::synthetic(Setup::Tuedacs)
                .varied(0.15, seed)
                .unwrap()
        } else {
            CftTruth::synthetic(Setup::Tuedacs)
        };
        let run1 = |series: Fourier<4>, seed: u64, noise: bool, secs: f64| {
            let mut s = Settings::new(secs);
            s.seed = seed;
            if noise {
                s.sensors.torque_noise = Noise::Relative(0.01);
            } else if env("CLEANQ", 0.0) == 0.0 {
                s.sensors = Sensors::perfect();
            }
            let r = follow(
                &truth,
                &[],
                Reference {
                    frame: Frame::Motors,
                    path: Path::Fourier(series),
                },
                &s,
            )
            .unwrap();
            if !r.limits.is_empty() {
                println!("LIMIT {:?}", r.limits[0]);
            }
            let m = r.volts.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
            (block(&r), m)
        };
        let table3 = env("T3", 1.0) > 0.0;
        let series = |phase: f64| {
            if table3 {
                let mut f = Fourier::table_3();
                f.start = phase;
                f
            } else {
                big(phase)
            }
        };
        let noise = env("NOISE", 1.0) > 0.0;
        let (id, vmax) = run1(series(0.1 * seed as f64), 100 + seed, noise, secs);
        let (va, _) = run1(
            {
                let mut f = Fourier::table_3();
                f.start = 1.3;
                f.fundamental *= 1.1;
                f
            },
            200 + seed,
            env("VNOISE", 0.0) > 0.0,
            15.0,
        );
        let c = Columns {
            joints: 4,
            shared: 12,
            own: vec![vec![]; 4],
            known: truth
                .friction
                .iter()
                .map(|l| {
                    Some(KnownFriction {
                        law: *l,
                        covariance: [[0.0; 5]; 5],
                    })
                })
                .collect(),
        };
        let clock = std::time::Instant::now();
        let (sums, sm) = accumulate(&robot, &c, &ms, &mut src(&id)).unwrap();
        let f = fit(&sums, Estimator::Wls).unwrap();
        let el = clock.elapsed().as_secs_f64();
        let t0 = truth.printed();
        let mut line = String::new();
        for i in 0..12 {
            let std = f.covariance[(i, i)].sqrt();
            let z = (f.theta[i] - t0[i]) / std;
            let share = (0..4)
                .map(|j| 2.0 * std * f.column_rms[(j, i)] / f.torque_rms[j])
                .fold(0.0, f64::max);
            let (v, n) = verdict(f.theta[i], std, f.determined[i], share);
            within[i] += usize::from(z.abs() < 3.0);
            w95[i] += usize::from(z.abs() < 1.96);
            ident[i] += usize::from(v == cft_ident::verdict::Verdict::Identified);
            line += &format!(
                "\n   t{} {:.5}/{:.5} = {:.4} z {:+.1} rs {:.3} {:?} {}",
                i + 1,
                f.theta[i],
                t0[i],
                f.theta[i] / t0[i],
                z,
                std / f.theta[i].abs(),
                v,
                n
            );
        }
        let m = |theta: Vec<f64>| Model {
            robot: robot.clone(),
            theta,
            friction: truth
                .friction
                .iter()
                .map(|l| JointFriction::DoubleTanh(*l))
                .collect(),
            offset: vec![0.0; 4],
        };
        let errs = |theta: Vec<f64>| {
            let m = m(theta);
            let mut r = Reconstruction::new(&m);
            let s = r.add(&ms, &mut src(&va), &mut |_| {}).unwrap();
            r.finish(s)
                .joints
                .iter()
                .map(|j| j.relative_error * 100.0)
                .collect::<Vec<_>>()
        };
        let e1 = errs(f.theta.as_slice().to_vec());
        let e0 = errs(t0.to_vec());
        if seed < 3 {
            println!(
                "seed {seed} vmax {vmax:.2} cond {:?} rel {:.4?} eff {:.0}/{} t {el:.2} seg {} {line}",
                f.condition, f.relative_error, f.effective_rows, f.rows, sm.segments
            );
        }
        println!("val est {e1:.3?} true {e0:.3?}");
    }
    println!("within3 {within:?} within95 {w95:?} ident {ident:?} of {seeds}");
}
