//! The lines that controllers of robots take: mass and centre of gravity of what the flange carries.

use super::tool_file::ToolFile;
use super::wrench_log::WrenchFrame;

/// A controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotController {
    /// Universal Robots: URScript.
    Ur,
    /// Franka: libfranka.
    Franka,
    /// UFACTORY xArm: its Python SDK.
    Xarm,
    /// ROS 2: control_filters and the broadcaster of the sensor.
    Ros2,
}

/// A body as controllers are told it: mass \[kg\], centre \[m\] in the flange, inertia about the centre \[kg m^2\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarriedBody {
    pub mass: f64,
    pub centre: [f64; 3],
    /// Ixx Ixy Ixz Iyy Iyz Izz, where it is known.
    pub inertia: Option<[f64; 6]>,
}

fn list(numbers: &[f64], decimals: usize) -> String {
    let all: Vec<String> = numbers.iter().map(|x| format!("{x:.decimals$}")).collect();
    all.join(", ")
}

impl RobotController {
    pub const ALL: [Self; 4] = [Self::Ur, Self::Franka, Self::Xarm, Self::Ros2];

    /// Name, as it is chosen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ur => "ur",
            Self::Franka => "franka",
            Self::Xarm => "xarm",
            Self::Ros2 => "ros2",
        }
    }

    /// What starts a comment.
    pub fn comment(self) -> &'static str {
        match self {
            Self::Franka => "//",
            _ => "#",
        }
    }

    /// The line of a body.
    pub fn body(self, body: &CarriedBody) -> String {
        let (m, c) = (body.mass, list(&body.centre, 4));
        match (self, body.inertia) {
            (Self::Ur, None) => format!("set_target_payload({m:.3}, [{c}])"),
            (Self::Ur, Some([xx, xy, xz, yy, yz, zz])) => {
                // URScript: Ixx, Iyy, Izz, Ixy, Ixz, Iyz
                let inertia = list(&[xx, yy, zz, xy, xz, yz], 5);
                format!("set_target_payload({m:.3}, [{c}], [{inertia}])")
            }
            (Self::Franka, inertia) => {
                let [xx, xy, xz, yy, yz, zz] = inertia.unwrap_or_default();
                let columns = list(&[xx, xy, xz, xy, yy, yz, xz, yz, zz], 5);
                format!("robot.setLoad({m:.3}, {{{{{c}}}}}, {{{{{columns}}}}});")
            }
            (Self::Xarm, _) => {
                let c = list(&body.centre.map(|x| 1e3 * x), 1);
                format!("arm.set_tcp_load({m:.3}, [{c}])")
            }
            (Self::Ros2, _) => format!(
                "gravity_compensation:\n  type: control_filters/GravityCompensationWrench\n  params:\n    tool:\n      mass: {m:.3}\n      CoG: [{c}]\n      gravity_field: [0.0, 0.0, -9.81]"
            ),
        }
    }

    /// The lines of a tool, with the bias where the controller takes one; none where its body is not determined.
    pub fn lines(self, file: &ToolFile) -> Option<String> {
        let (mass, centre) = file.body()?;
        let body = CarriedBody {
            mass,
            centre,
            inertia: file.inertia(),
        };
        let of = self.comment();
        let mut out = format!(
            "{of} mass [kg] and centre of gravity in the frame of the sensor [m{}]\n{of} where the flange has other axes or another origin, move the centre into it first\n{}\n",
            if self == Self::Xarm { "m" } else { "" },
            self.body(&body)
        );
        if self == Self::Ros2 {
            let [fx, fy, fz, tx, ty, tz] = file.last_bias;
            let turned = match file.tool.frame {
                WrenchFrame::Sensor => "",
                WrenchFrame::Base => {
                    "# the log was along the axes of the base: the bias is the sensor's own\n"
                }
            };
            out += &format!(
                "{turned}force_torque_sensor_broadcaster:\n  ros__parameters:\n    offset:\n      force: {{x: {:.4}, y: {:.4}, z: {:.4}}}\n      torque: {{x: {:.5}, y: {:.5}, z: {:.5}}}\n",
                -fx, -fy, -fz, -tx, -ty, -tz
            );
        }
        Some(out)
    }
}
