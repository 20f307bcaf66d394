//! Identification of robot dynamics from logged joint positions and torques.
//!
//! The model is `tau = Y(q, v, a) theta + F(v)`: a regressor `Y` that is linear in the inertial
//! parameters, and a friction law `F` per joint (eq. (60) and (18) of Rodriguez-Angeles et al. 2002).
//!
//! ```
//! use cft_ident::config::RobotFile;
//! use cft_ident::identify::{Dataset, Control, Log, RobotSetup, LsqSettings, lsq};
//!
//! let arm = r#"
//!     robot.model = "serial"
//!     friction = { law = "viscous-coulomb", fitted_with_inertias = true }
//!     [[robot.link]]
//!     joint = "shoulder"
//!     rpy = [1.5707963267948966, 0.0, 0.0] # its axis lies level
//!     [[robot.link]]
//!     joint = "elbow"
//!     xyz = [0.4, 0.0, 0.0]
//! "#;
//! let arm = RobotSetup::new("arm.toml", RobotFile::parse("arm.toml", arm)?);
//! # use cft_ident::robot::friction::ViscousCoulomb;
//! # use cft_ident::robot::model::{JointFriction, Model};
//! # let friction = JointFriction::ViscousCoulomb(ViscousCoulomb { viscous: 0.8, coulomb: 1.5 });
//! # let theta: Vec<f64> = (0..arm.robot.parameters().len()).map(|k| 1.0 + 0.5 * k as f64).collect();
//! # let truth = Model {
//! #     robot: arm.robot.clone(),
//! #     theta: theta.clone(),
//! #     friction: vec![friction; 2],
//! #     offset: vec![0.0; 2],
//! # };
//! # let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), vec![0.0; 2 * 5000]);
//! # for k in 0..5000 {
//! #     let now = 0.002 * k as f64;
//! #     let waves = [[(0.9, 1.7), (0.3, 5.3)], [(0.8, 2.3), (0.4, 6.1)]];
//! #     let sum = |of: &dyn Fn(f64, f64) -> f64| waves.map(|w| w.iter().map(|(a, b)| of(*a, *b)).sum::<f64>());
//! #     let at = sum(&|a, w| a * (w * now).sin());
//! #     let v = sum(&|a, w| a * w * (w * now).cos());
//! #     let a = sum(&|a, w| -a * w * w * (w * now).sin());
//! #     truth.torque(&at, &v, &a, &mut tau[2 * k..2 * k + 2]);
//! #     t.push(now);
//! #     q.extend(at);
//! # }
//! // t [s], q [rad] and tau [Nm] are slices, row after row; Log::from takes a file instead
//! let log = Log::of_rows("monday", &t, &q, &tau)?;
//! let found = lsq(&Dataset::read(&arm, &[log], &Control::default())?, &LsqSettings::default(), &Control::default())?;
//! for u in &found.unknowns {
//!     println!("{} = {:.3} +- {:.3} {}", u.key, u.fitted, u.fitted_std, u.unit);
//! }
//! # for (u, truth) in found.unknowns.iter().zip(&theta) {
//! #     assert!((u.fitted - truth).abs() < 0.01 * truth, "{u:?}: {truth}");
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | stage in [`identify`] | from | to | module | source |
//! |---|---|---|---|---|
//! | [`friction`](identify::friction()) | one-joint logs | theta 13..32 with covariance | [`friction`] | eq. (30)-(38) |
//! | [`lsq`](identify::lsq()) | logs of all joints, friction | theta 1..12, or base parameters of a tree | [`inertia`] | eq. (39)-(42) |
//! | [`diagnose`](identify::diagnose()) | model, logs | effects that the model lacks, refined model | [`diagnose`] | |
//! | [`validate`](identify::validate()) | model, logs that were not used | torque errors | [`validate`] | Figures 7 and 8 |
//! | [`compare`](identify::compare()) | two models, logs | differences of parameters and errors | [`compare`] | Kuensch 1989 |
//! | [`torque`](identify::torque()) | model, positions | feed-forward torque with its band | [`band`] | Lei et al. 2018 |
//! | [`watch`](identify::watch()) | model, rows as they come | external torques, alarms | [`observe`] | Pickands 1975 |
//! | [`identify`](identify::identify()) | logs by role | all of these | [`identify`] | |
//!
//! Below the stages: [`log`] reads text logs, MCAP and rosbag2 recordings and arrays in memory to
//! blocks of t, q and tau; [`inspect`] looks for faults in them, [`mapping`] for the joints in a log that nobody described; [`motion`] turns them into filtered
//! rows of q, v, a and tau; [`robot`] holds the physics, [`effect`] what a plain model lacks, [`math`]
//! what is small and general, [`config`] the files. Beside them: [`simulate`] is a plant to test
//! against, [`drive`] finds drives from commanded and measured positions, [`excite`] designs motions, [`export`] writes a model as C, Rust or URDF, [`replay`] runs
//! models along logs for the figures of a report, [`report`] writes results as text, page and JSON, and [`cli`] is the command line.

#![forbid(unsafe_code)]

pub use cft_ident_core::{
    block, diagnose, effect, friction, inertia, judge, math, motion, number, robot, validate,
    verdict,
};
pub use cft_ident_drive::drive;
pub use cft_ident_export::export;
pub use cft_ident_files::config;
pub use cft_ident_fleet::track;
pub use cft_ident_logs::{inspect, log, mapping, output};
pub use cft_ident_plant::{excite, simulate};
pub use cft_ident_report::report;
pub use cft_ident_stages::{band, compare, identify, observe, open_loop, replay, setup};

pub mod cli;
