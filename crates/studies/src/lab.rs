//! A laboratory: a machine under one controller with one set of sensors, and the files that it keeps.

use std::path::Path as File;

use serde_json::Value;

use crate::chance::Chance;
use crate::drive::{Controller, Course, Run, Sensing};
use crate::files;
use crate::friction::Law;
use crate::machine::{Drive, Kind, LawKind, Machine};
use crate::path::{Motion, Path};
use crate::study::StudyError;
use crate::tool::{Answer, Tool};

pub struct Lab {
    pub machine: Machine,
    pub controller: Controller,
    pub sensing: Sensing,
}

impl Lab {
    /// Fine sensors: 16 bits, 500 or 1000 Hz, white torque noise of 1 %; coarse ones: 13 bits, 200 or 250 Hz, noise of
    /// 2.5 % half of which forgets in 30 ms.
    pub fn new(machine: Machine, controller: Controller, fine: bool, chance: &mut Chance) -> Self {
        let rates: [f64; 2] = if fine {
            [500.0, 1000.0]
        } else {
            [200.0, 250.0]
        };
        let sensing = Sensing {
            rate_hz: chance.pick(&rates),
            noise: if fine { 0.01 } else { 0.025 },
            memory_s: (!fine).then_some(0.03),
            counts: if fine { 65_536.0 } else { 8192.0 },
            delay_s: 0.0,
        };
        Self {
            machine,
            controller,
            sensing,
        }
    }

    /// One that effects are put into: direct drives with the declared friction, computed torque, fine sensors at 500 Hz.
    pub fn for_an_effect(kind: Kind, chance: &mut Chance) -> Self {
        let machine = Machine::draw(kind, Drive::Direct, LawKind::Coulomb, 0.0, chance);
        let mut lab = Self::new(machine, Controller::FeedForward, true, chance);
        lab.sensing.rate_hz = 500.0;
        lab
    }

    /// Writes robot file, URDF and, in a file of its own, the truth.
    pub fn lay_out(&self, folder: &File) -> Result<(), StudyError> {
        let robot = files::robot_text(&self.machine, self.sensing.rate_hz, "arm.urdf", "");
        files::write(&folder.join("robot.toml"), &robot)?;
        if let Some(urdf) = files::urdf_text(&self.machine) {
            files::write(&folder.join("arm.urdf"), &urdf)?;
        }
        let truth = files::truth(&self.machine);
        files::write(&folder.join("truth.json"), &format!("{truth:#}\n"))
    }

    pub fn course(&self, motion: Motion, chance: &mut Chance) -> Course {
        let seconds = if motion == Motion::Ladder { 40.0 } else { 20.0 };
        let path = Path::new(motion, &self.machine.ranges, seconds, chance);
        Course::of(&self.machine, &path, self.controller, self.sensing.counts)
    }

    /// Takes out what was planted: the machine has the declared law alone.
    pub fn take_out(&mut self) {
        self.machine.plant.added.clear();
        self.sensing.delay_s = 0.0;
        for friction in &mut self.machine.plant.friction {
            friction.law = Law::Coulomb;
        }
    }

    /// What the true parameters of the declared model leave of `log`: the least that can be asked for.
    pub fn errors_of_truth(
        &self,
        tool: &Tool,
        folder: &File,
        log: &str,
    ) -> Result<Vec<f64>, StudyError> {
        let model = files::read(&folder.join("model.toml"))?;
        files::write(
            &folder.join("true.toml"),
            &files::with_truth(&self.machine, &model),
        )?;
        errors(tool, folder, log, "true.toml")
    }

    /// Drives the machine, and writes its log.
    pub fn record(
        &self,
        folder: &File,
        name: &str,
        motion: Motion,
        chance: &mut Chance,
    ) -> Result<Run, StudyError> {
        let course = self.course(motion, chance);
        let run = course.logged(&self.machine, &self.sensing, chance);
        files::write(&folder.join(name), &files::log_text(&self.machine, &run))?;
        Ok(run)
    }
}

/// Errors by joint of a model on a log, where the joint moves: at rest static friction takes any torque.
pub fn errors(tool: &Tool, folder: &File, log: &str, model: &str) -> Result<Vec<f64>, StudyError> {
    let answer: Answer = tool.run(folder, &["validate", log, "-m", model])?;
    let of = |joint: &Value| {
        let error = |key: &str| joint[key].as_f64();
        error("relative_error_moving")
            .or_else(|| error("relative_error"))
            .unwrap_or(f64::NAN)
    };
    Ok(answer.list("joints").iter().map(of).collect())
}
