//! Robot, model, trajectory and campaign files.
//!
//! [`config::RobotFile`] says what a robot and its logs are, [`config::ModelFile`] holds what was identified,
//! [`config::Trajectory`] a motion and [`config::CampaignFile`] which logs serve for what. Each is read by `parse`, whose
//! error names file, line and key.
//!
//! ```
//! use cft_ident_files::config::RobotFile;
//!
//! let arm = "robot.model = \"serial\"\n[[robot.link]]\njoint = \"hip\"\n[[robot.link]]\njoint = \"knee\"\nxyz = [0.4, 0, 0]\n";
//! let arm = RobotFile::parse("leg.toml", arm)?;
//! assert_eq!(arm.joint_names(), ["hip", "knee"]);
//!
//! let wrong = RobotFile::parse("leg.toml", "robot.modell = \"serial\"").unwrap_err();
//! assert!(wrong.to_string().contains("leg.toml"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod config;
