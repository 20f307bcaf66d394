//! Where a frame of a URDF is, by joint angles.

use std::path::Path;

use cft_ident_core::robot::Robot;
use cft_ident_core::robot::tree::space::{Rotation, Vector, add, of_roll_pitch_yaw, product, turn};
use cft_ident_core::robot::tree::{pose::frames, space::UNTURNED};
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{escape, list, shown, unit_of};

use super::error::ToolError;
use super::table::WrenchTable;
use super::units;

/// A frame that moves with an arm.
#[derive(Debug, Clone)]
pub(super) struct MovingFrame {
    robot: Robot,
    names: Vec<String>,
    link: usize,
    placed: (Rotation, Vector),
}

impl MovingFrame {
    /// The link or fixed frame `name` of a URDF.
    pub fn load(urdf: &Path, name: &str) -> Result<Self, ToolError> {
        let file = shown(urdf);
        let own = urdf.file_name().unwrap_or_default().to_string_lossy();
        let section = toml::Value::from(own.as_ref());
        let text = format!("[robot]\nmodel = \"serial\"\nurdf = {section}\n");
        let robot = RobotFile::parse_in(&file, &text, urdf.parent())?;
        let arm = robot.robot();
        let tree = arm.tree();
        let of_link = |link: &str| tree.links().iter().position(|l| l.name == link);
        let fixed = robot.robot.frame.iter().find(|f| f.name == name);
        let placed = match (of_link(name), fixed) {
            (Some(link), _) => Some((link, (UNTURNED, [0.0; 3]))),
            (None, Some(f)) => {
                of_link(&f.link).map(|link| (link, (of_roll_pitch_yaw(&f.rpy), f.xyz)))
            }
            (None, None) => None,
        };
        let Some((link, placed)) = placed else {
            let links = tree.links().iter().map(|l| l.name.as_str());
            let all = links.chain(robot.robot.frame.iter().map(|f| f.name.as_str()));
            return Err(ToolError::Frame {
                file,
                frame: escape(name),
                known: list(all),
            });
        };
        Ok(Self {
            names: robot.joint_names(),
            robot: arm,
            link,
            placed,
        })
    }

    /// Orientation and place of the frame in every row of a table of joint angles.
    pub fn along(&self, table: &WrenchTable) -> Result<Vec<(Rotation, Vector)>, ToolError> {
        let columns: Vec<(usize, f64)> = self
            .names
            .iter()
            .map(|joint| self.column(table, joint))
            .collect::<Result<_, _>>()?;
        for row in 0..table.rows() {
            let bad = |(c, _): &&(usize, f64)| !table.columns[*c][row].is_finite();
            if let Some((column, _)) = columns.iter().find(bad) {
                return Err(ToolError::NoNumber {
                    file: table.file.clone(),
                    row: row + 1,
                    column: escape(&table.names[*column]),
                });
            }
        }
        let of = |row: usize| {
            let q: Vec<f64> = columns
                .iter()
                .map(|(c, factor)| factor * table.columns[*c][row])
                .collect();
            let (rotation, origin) = frames(self.robot.tree(), &q)[self.link];
            let at = add(&origin, &turn(&rotation, &self.placed.1));
            (product(&rotation, &self.placed.0), at)
        };
        Ok((0..table.rows()).map(of).collect())
    }

    /// The column of a joint's angle and its unit in rad.
    fn column(&self, table: &WrenchTable, joint: &str) -> Result<(usize, f64), ToolError> {
        let plain = |name: &str| {
            name.split(['[', '('])
                .next()
                .unwrap_or(name)
                .trim()
                .to_owned()
        };
        let wanted = [
            joint.to_owned(),
            format!("q_{joint}"),
            format!("position.{joint}"),
            format!("position_{joint}"),
        ];
        let is = |name: &String| {
            wanted.contains(&plain(name)) || name.contains(&format!("position[name={joint}]"))
        };
        let Some(column) = table.names.iter().position(is) else {
            return Err(ToolError::Joint {
                file: table.file.clone(),
                joint: escape(joint),
                found: list(table.names.iter().map(String::as_str)),
            });
        };
        let factor = match unit_of(&table.names[column]) {
            Some(unit) => {
                units::angle(unit)
                    .or(units::length(unit))
                    .ok_or_else(|| ToolError::Unit {
                        file: table.file.clone(),
                        column: escape(&table.names[column]),
                        unit: escape(unit),
                        kind: "an angle",
                        known: "rad or deg",
                    })?
            }
            None => 1.0,
        };
        Ok((column, factor))
    }
}
