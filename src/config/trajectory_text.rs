//! Trajectory files as text, written to be read by people.

use std::fmt::Write;

use super::trajectory::{Coordinates, Trajectory};

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
        let mut key = |name: &str, value: &str| {
            let _ = writeln!(text, "{name} = {value}");
        };
        match self {
            Self::Fourier(file) => {
                key("kind", "\"fourier\"");
                key("coordinates", name(file.coordinates));
                key("fundamental_hz", &number(file.fundamental_hz));
                if let Some(start) = file.start_s {
                    key("start_s", &number(start));
                }
                if let Some(blend) = file.blend_s {
                    key("blend_s", &number(blend));
                }
                if let Some(periods) = file.periods {
                    key("periods", &periods.to_string());
                }
                for coordinate in &file.series {
                    let _ = write!(
                        text,
                        "\n[[coordinate]]\nname = {}\noffset = {}\na = {}\nb = {}\n",
                        quoted(&coordinate.name),
                        number(coordinate.offset),
                        list(&coordinate.a),
                        list(&coordinate.b)
                    );
                }
            }
            Self::SingleJoint(file) => {
                key("kind", "\"single-joint\"");
                key("joint", &quoted(&file.joint));
                key("speeds", &list(&file.speeds));
                if let Some(range) = file.range {
                    key("range", &list(&range));
                }
                if let Some(acceleration) = file.acceleration {
                    key("acceleration", &number(acceleration));
                }
                if let Some(turn) = file.turn_s {
                    key("turn_s", &number(turn));
                }
            }
            Self::Points(file) => {
                key("kind", "\"points\"");
                key("coordinates", name(file.coordinates));
                for point in &file.points {
                    let _ = write!(
                        text,
                        "\n[[point]]\nt = {}\nposition = {}\n",
                        number(point.t),
                        list(&point.position)
                    );
                }
            }
        }
        text
    }
}

fn name(coordinates: Coordinates) -> &'static str {
    match coordinates {
        Coordinates::Cartesian => "\"cartesian\"",
        Coordinates::Joint => "\"joint\"",
    }
}

/// The shortest text that reads back to the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn list(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(|value| number(*value)).collect();
    format!("[{}]", texts.join(", "))
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A comment must not contain control characters.
fn printable(line: &str) -> String {
    line.chars().filter(|c| !c.is_control()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::trajectory::{Fourier, FourierCoordinate, Point, Points, SingleJointMove};

    #[test]
    fn every_kind_reads_back_as_it_was() {
        let all = [
            Trajectory::Fourier(Fourier {
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
            Trajectory::Points(Points {
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
