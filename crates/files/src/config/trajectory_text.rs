//! Trajectory files as text, written to be read by people.

use std::fmt::Write;

use super::trajectory::Trajectory;
use cft_ident_logs::log::is_hidden;

impl Trajectory {
    /// The file's text, which [`Trajectory::parse`] reads back to the same numbers. `head` is put
    /// before it as a comment, line by line.
    pub fn to_toml(&self, head: &str) -> String {
        let mut text = String::new();
        for line in head.lines() {
            let _ = writeln!(text, "# {}", printable(line));
        }
        if !head.is_empty() {
            text.push('\n');
        }
        text + &toml::to_string(self).expect("names and numbers are TOML")
    }
}

/// A comment must not contain control characters, and none that forges what it says.
fn printable(line: &str) -> String {
    line.chars().filter(|c| !is_hidden(*c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::trajectory::{
        Coordinates, FourierCoordinate, FourierSection, Point, PointsSection, SingleJointMove,
    };

    #[test]
    fn every_kind_reads_back_as_it_was() {
        let all = [
            Trajectory::Fourier(FourierSection {
                coordinates: Coordinates::Cartesian,
                fundamental_hz: 0.4,
                start_s: Some(0.1 + 0.2),
                blend_s: Some(2.0),
                periods: Some(14),
                series: vec![FourierCoordinate {
                    name: "x_c1".into(),
                    offset: -0.1343,
                    a: vec![1e-9, -3.0],
                    b: vec![0.1 / 3.0, 1e20],
                }],
            }),
            Trajectory::SingleJoint(SingleJointMove {
                joint: "q\"4\\".into(),
                speeds: vec![0.005, 1.0],
                range: Some([-0.5, 0.25]),
                acceleration: Some(3.0),
                turn_s: Some(0.7),
            }),
            Trajectory::Points(PointsSection {
                coordinates: Coordinates::Joint,
                points: (0..3)
                    .map(|k| Point {
                        t: f64::from(k),
                        position: vec![0.1 * f64::from(k), -0.2],
                    })
                    .collect(),
            }),
        ];
        for trajectory in all {
            let text = trajectory.to_toml("a comment\nof two lines \u{7}");
            assert!(text.starts_with("# a comment\n# of two lines \n\nkind"));
            let back = Trajectory::parse("t.toml", &text).expect("readable");
            assert_eq!(back, trajectory, "{text}");
        }
    }
}
