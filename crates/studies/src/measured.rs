//! The measured logs beside the repository: which machine, which robot file, and how its logs are divided.

use std::path::{Path, PathBuf};

use crate::study::StudyError;

/// A machine, its robot file under `configs`, and its recordings under `../shared/data`.
pub struct Measured {
    pub name: &'static str,
    pub robot: &'static str,
    pub logs: &'static [&'static str],
}

pub const MACHINES: [Measured; 7] = [
    Measured {
        name: "TX40",
        robot: "tx40.toml",
        logs: &["tx40/tx40_joint.csv"],
    },
    Measured {
        name: "Panda",
        robot: "panda.toml",
        logs: &["panda/panda_exciting.csv"],
    },
    Measured {
        name: "UR10",
        robot: "ur10.toml",
        logs: &["ur10/ur10_exciting.csv"],
    },
    Measured {
        name: "KR300",
        robot: "kr300.toml",
        logs: &["kr300/A.csv", "kr300/B.csv", "kr300/C.csv"],
    },
    Measured {
        name: "EMPS",
        robot: "emps-symmetric.toml",
        logs: &["emps/emps_id.csv", "emps/emps_pulses_val.csv"],
    },
    Measured {
        name: "pendulum",
        robot: "pendulum.toml",
        logs: &[
            "pendulum/055032.csv",
            "pendulum/055640.csv",
            "pendulum/055903.csv",
        ],
    },
    Measured {
        name: "motor",
        robot: "bldc.toml",
        logs: &["bldc-cogging/speed_test1.txt"],
    },
];

impl Measured {
    pub fn robot_path(&self) -> Result<PathBuf, StudyError> {
        absolute(&Path::new("configs").join(self.robot))
    }

    /// A recording, with a span behind it where one is given.
    pub fn log(&self, number: usize, span: &str) -> Result<String, StudyError> {
        let path = absolute(&Path::new("../shared/data").join(self.logs[number]))?;
        Ok(format!("{}{span}", path.display()))
    }
}

/// The program runs in a folder of its own.
fn absolute(path: &Path) -> Result<PathBuf, StudyError> {
    path.canonicalize().map_err(|source| StudyError::File {
        path: path.to_owned(),
        source,
    })
}
