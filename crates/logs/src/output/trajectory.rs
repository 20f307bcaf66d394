//! A motion as controllers take it: `trajectory_msgs/msg/JointTrajectory` of ROS 2 as YAML and as a message in
//! MCAP, and a program in URScript.

use std::fmt::Write;
use std::io;

use super::mcap::{cdr_names, doubles, plain, single_message};

/// `trajectory_msgs/msg/JointTrajectory` with what it is made of, as ROS 2 defines them.
const DEFINITION: &str = "\
std_msgs/Header header
string[] joint_names
JointTrajectoryPoint[] points
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
";

/// Topic of the message, as the controller of ros2_control has it.
const TOPIC: &str = "/joint_trajectory_controller/joint_trajectory";

/// A motion of joints at a constant rate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointTrajectory {
    /// Names of the joints, as their controller has them.
    pub names: Vec<String>,
    /// What is to be known of it, line by line.
    pub notes: Vec<String>,
    /// Points a second \[Hz\].
    pub rate_hz: f64,
    /// Positions, velocities and accelerations of every joint, point by point \[m or rad, per s, per s^2\].
    pub points: Vec<[Vec<f64>; 3]>,
}

fn list(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    format!("[{}]", all.join(", "))
}

impl JointTrajectory {
    /// Seconds and nanoseconds of point k.
    fn time(&self, k: usize) -> [u64; 2] {
        let ns = (1e9 * k as f64 / self.rate_hz).round() as u64;
        [ns / 1_000_000_000, ns % 1_000_000_000]
    }

    fn comments(&self) -> String {
        self.notes
            .iter()
            .map(|line| format!("# {line}\n"))
            .collect()
    }

    /// The message as YAML, as `ros2 topic pub` takes it.
    pub fn yaml(&self) -> String {
        let mut out = self.comments();
        out.push_str("header:\n  stamp: {sec: 0, nanosec: 0}\n  frame_id: ''\njoint_names:\n");
        for name in &self.names {
            // a text between double quotes is the same in JSON and YAML
            let _ = writeln!(out, "  - {}", serde_json::Value::from(name.as_str()));
        }
        out.push_str("points:\n");
        for (k, [q, v, a]) in self.points.iter().enumerate() {
            let [sec, nanosec] = self.time(k);
            let _ = write!(
                out,
                "  - positions: {}\n    velocities: {}\n    accelerations: {}\n    \
                 time_from_start: {{sec: {sec}, nanosec: {nanosec}}}\n",
                list(q),
                list(v),
                list(a)
            );
        }
        out
    }

    /// A recording of the one message; the notes are in its metadata.
    ///
    /// # Errors
    /// None that is known: it is written into memory.
    pub fn mcap(&self) -> io::Result<Vec<u8>> {
        // header without stamp and frame, then names and points as little-endian CDR
        let mut body = vec![0, 1, 0, 0];
        body.extend([0; 8]);
        body.extend([1, 0, 0, 0, 0, 0, 0, 0]);
        body.extend(cdr_names(&self.names));
        body.extend((self.points.len() as u32).to_le_bytes());
        for (k, point) in self.points.iter().enumerate() {
            for values in point {
                doubles(&mut body, values.iter().copied());
            }
            // no efforts
            body.extend(0u32.to_le_bytes());
            let [sec, nanosec] = self.time(k);
            body.extend(i32::try_from(sec).unwrap_or(i32::MAX).to_le_bytes());
            body.extend((nanosec as u32).to_le_bytes());
        }
        let kind = "trajectory_msgs/msg/JointTrajectory";
        single_message(TOPIC, kind, DEFINITION, &body, &self.notes).map_err(plain)
    }

    /// A program in URScript: a slow move to the first point, then a target for each sample.
    pub fn urscript(&self) -> String {
        let mut out = self.comments();
        out.push_str("def cft_ident_motion():\n");
        if let Some([first, ..]) = self.points.first() {
            let _ = writeln!(out, "  movej({}, a=0.5, v=0.3)", list(first));
        }
        let step = format!("{:?}", 1.0 / self.rate_hz);
        for [q, ..] in &self.points {
            let q = list(q);
            let _ = writeln!(
                out,
                "  servoj({q}, t={step}, lookahead_time=0.03, gain=500)"
            );
        }
        out.push_str("  stopj(1.0)\nend\n\ncft_ident_motion()\n");
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> JointTrajectory {
        JointTrajectory {
            names: vec!["a".to_owned(), "elbow \"2\"".to_owned()],
            notes: vec!["not checked: all".to_owned()],
            rate_hz: 125.0,
            points: (0..3)
                .map(|k| [vec![0.1 * f64::from(k), -1.0], vec![0.5, 0.0], vec![0.0; 2]])
                .collect(),
        }
    }

    #[test]
    fn yaml_has_names_points_and_times() {
        let text = two().yaml();
        assert!(text.starts_with("# not checked: all\nheader:\n"), "{text}");
        assert!(text.contains("  - \"elbow \\\"2\\\"\"\n"), "{text}");
        assert!(text.contains("  - positions: [0.2, -1.0]\n    velocities: [0.5, 0.0]\n"));
        assert!(text.contains("time_from_start: {sec: 0, nanosec: 16000000}"));
    }

    #[test]
    fn a_program_moves_slowly_to_the_first_point_and_ends_at_rest() {
        let text = two().urscript();
        let first = "  movej([0.0, -1.0], a=0.5, v=0.3)\n";
        assert!(text.contains(first), "{text}");
        assert_eq!(text.matches("servoj(").count(), 3);
        assert!(text.contains("t=0.008,"));
        assert!(text.contains("  stopj(1.0)\nend\n"));
    }

    #[test]
    fn the_message_has_the_length_that_cdr_asks_for() {
        let [bytes, again] = [two(), two()].map(|motion| motion.mcap().unwrap());
        assert_eq!(bytes, again, "the same motion gives the same bytes");
        assert_eq!(&bytes[..5], b"\x89MCAP");
    }
}
