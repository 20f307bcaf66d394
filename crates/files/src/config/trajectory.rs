//! Trajectory files: a Fourier series (43), a single-joint ladder of speeds, or a list of points.

use std::fmt::Write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::document::TomlDocument;
use cft_ident_logs::log::is_hidden;

/// In which coordinates a trajectory is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Coordinates")]
pub enum TrajectoryCoordinates {
    /// Actuator coordinates x_c1..x_c4 of the CFT robot [m, m, rad, m].
    Cartesian,
    /// Joint coordinates of the robot [m or rad].
    Joint,
}

/// One coordinate of a Fourier series, eq. (43).
///
/// `x(t) = offset + sum_l a_l/(l w) sin(l w t) - b_l/(l w) cos(l w t)`, `w = 2 pi fundamental_hz`;
/// so a and b are amplitudes of the velocity [m/s or rad/s].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FourierCoordinate {
    /// Coordinate: `x_c1`..`x_c4`, or a joint name.
    pub name: String,
    /// q_i0 [m or rad].
    pub offset: f64,
    /// a_{i,1}.. [m/s or rad/s].
    pub a: Vec<f64>,
    /// b_{i,1}.. [m/s or rad/s], as many as `a`.
    pub b: Vec<f64>,
}

/// A finite Fourier series in every coordinate, eq. (43).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FourierSection {
    /// Which coordinates the series is in.
    pub coordinates: TrajectoryCoordinates,
    /// Fundamental frequency [Hz]; omega_f = 2 pi times it.
    pub fundamental_hz: f64,
    /// Where in its period the motion begins [s]; 0 where absent.
    pub start_s: Option<f64>,
    /// Time within which the motion goes from rest to full speed, and back [s]; the simulator's own
    /// where absent.
    pub blend_s: Option<f64>,
    /// Whole periods between the blends; the motion does not end by itself where absent.
    pub periods: Option<u32>,
    /// One series per coordinate, in the file's order.
    #[serde(rename = "coordinate")]
    pub series: Vec<FourierCoordinate>,
}

/// One joint (or actuator) runs back and forth over its range at a ladder of speeds, the others are held.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SingleJointMove {
    pub joint: String,
    /// Speeds of the ladder, each run in both directions [m/s or rad/s].
    pub speeds: Vec<f64>,
    /// Range [m or rad]; the robot's own limits with a margin where absent.
    pub range: Option<[f64; 2]>,
    /// Acceleration at the reversals [m/s^2 or rad/s^2]; chosen from the range where absent.
    pub acceleration: Option<f64>,
    /// Time from zero speed to a slow plateau [s]: long ones pass slowly where friction bends; the
    /// simulator's own where absent.
    pub turn_s: Option<f64>,
}

/// A pose at a time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Time [s], increasing along the list.
    pub t: f64,
    /// Position in each coordinate [m or rad].
    pub position: Vec<f64>,
}

/// A list of poses at times.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointsSection {
    /// Which coordinates the poses are in.
    pub coordinates: TrajectoryCoordinates,
    /// The poses, at least two.
    #[serde(rename = "point")]
    pub points: Vec<Point>,
}

/// A checked trajectory file.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Trajectory {
    Fourier(FourierSection),
    SingleJoint(SingleJointMove),
    Points(PointsSection),
}

/// Names of the actuator coordinates of the CFT robot.
pub(crate) const CARTESIAN: [&str; 4] = ["x_c1", "x_c2", "x_c3", "x_c4"];

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Kind")]
enum TrajectoryKind {
    Fourier,
    SingleJoint,
    Points,
}

/// The file as it is written: one flat table, so that errors keep their line.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TrajectoryToml {
    kind: TrajectoryKind,
    coordinates: Option<TrajectoryCoordinates>,
    fundamental_hz: Option<f64>,
    start_s: Option<f64>,
    blend_s: Option<f64>,
    periods: Option<u32>,
    #[serde(default)]
    coordinate: Vec<FourierCoordinate>,
    joint: Option<String>,
    #[serde(default)]
    speeds: Vec<f64>,
    range: Option<[f64; 2]>,
    acceleration: Option<f64>,
    turn_s: Option<f64>,
    #[serde(default)]
    point: Vec<Point>,
}

impl Trajectory {
    /// Reads a trajectory from TOML text; `file` names it in errors.
    pub fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        let document = TomlDocument::new(file, text);
        let raw: TrajectoryToml = document.read()?;
        foreign_keys(&document, &raw)?;
        match raw.kind {
            TrajectoryKind::Fourier => fourier(&document, raw).map(Self::Fourier),
            TrajectoryKind::SingleJoint => single_joint(&document, raw).map(Self::SingleJoint),
            TrajectoryKind::Points => points(&document, raw).map(Self::Points),
        }
    }

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

/// Refuses a key of another kind of trajectory, which would silently do nothing.
fn foreign_keys(document: &TomlDocument, raw: &TrajectoryToml) -> Result<(), ConfigError> {
    use TrajectoryKind::{Fourier, Points, SingleJoint};
    let keys: [(&str, bool, &[TrajectoryKind]); 12] = [
        ("coordinates", raw.coordinates.is_some(), &[Fourier, Points]),
        ("fundamental_hz", raw.fundamental_hz.is_some(), &[Fourier]),
        ("start_s", raw.start_s.is_some(), &[Fourier]),
        ("blend_s", raw.blend_s.is_some(), &[Fourier]),
        ("periods", raw.periods.is_some(), &[Fourier]),
        ("coordinate", !raw.coordinate.is_empty(), &[Fourier]),
        ("joint", raw.joint.is_some(), &[SingleJoint]),
        ("speeds", !raw.speeds.is_empty(), &[SingleJoint]),
        ("range", raw.range.is_some(), &[SingleJoint]),
        ("acceleration", raw.acceleration.is_some(), &[SingleJoint]),
        ("turn_s", raw.turn_s.is_some(), &[SingleJoint]),
        ("point", !raw.point.is_empty(), &[Points]),
    ];
    let foreign =
        |(_, given, kinds): &&(&str, bool, &[TrajectoryKind])| *given && !kinds.contains(&raw.kind);
    let Some((key, ..)) = keys.iter().find(foreign) else {
        return Ok(());
    };
    let problem = "does not belong to this kind of trajectory";
    Err(document.value(&[key], problem, "delete it, or choose the right `kind`"))
}

fn coordinates(
    document: &TomlDocument,
    raw: &TrajectoryToml,
) -> Result<TrajectoryCoordinates, ConfigError> {
    raw.coordinates.ok_or_else(|| {
        document.missing(
            &["coordinates"],
            "`coordinates = \"cartesian\"` or `\"joint\"`",
        )
    })
}

fn fourier(document: &TomlDocument, raw: TrajectoryToml) -> Result<FourierSection, ConfigError> {
    let coordinates = coordinates(document, &raw)?;
    let Some(fundamental_hz) = raw.fundamental_hz else {
        return Err(document.missing(&["fundamental_hz"], "the fundamental frequency in Hz"));
    };
    document.positive(&["fundamental_hz"], fundamental_hz)?;
    document.not_negative(&["blend_s"], raw.blend_s)?;
    if raw.coordinate.is_empty() {
        let remedy = "a `[[coordinate]]` table for each coordinate";
        return Err(document.missing(&["coordinate"], remedy));
    }
    for (index, coordinate) in raw.coordinate.iter().enumerate() {
        let index = index.to_string();
        let at = ["coordinate", index.as_str(), "name"];
        let mut others = raw.coordinate.iter().filter(|c| c.name == coordinate.name);
        if others.nth(1).is_some() {
            return Err(document.value(&at, "is named twice", "give each coordinate one table"));
        }
        if coordinates == TrajectoryCoordinates::Cartesian
            && !CARTESIAN.contains(&coordinate.name.as_str())
        {
            return Err(document.value(
                &at,
                "is no actuator coordinate",
                "name x_c1, x_c2, x_c3 or x_c4, or set `coordinates = \"joint\"`",
            ));
        }
        if coordinate.a.len() != coordinate.b.len() || coordinate.a.is_empty() {
            return Err(document.value(
                &["coordinate", &index, "b"],
                "does not have as many numbers as `a`",
                "give a_l and b_l for the same l = 1..N, at least one",
            ));
        }
    }
    Ok(FourierSection {
        coordinates,
        fundamental_hz,
        start_s: raw.start_s,
        blend_s: raw.blend_s,
        periods: raw.periods,
        series: raw.coordinate,
    })
}

fn single_joint(
    document: &TomlDocument,
    raw: TrajectoryToml,
) -> Result<SingleJointMove, ConfigError> {
    let joint = raw
        .joint
        .ok_or_else(|| document.missing(&["joint"], "the joint that moves"))?;
    if raw.speeds.is_empty() {
        let remedy = "the ladder of speeds, e.g. `speeds = [0.02, 0.1, 0.4]`";
        return Err(document.missing(&["speeds"], remedy));
    }
    for &speed in &raw.speeds {
        document.positive(&["speeds"], speed)?;
    }
    if let Some([low, high]) = raw.range
        && low >= high
    {
        return Err(document.value(&["range"], "is empty", "write the lower end first"));
    }
    document.positive(&["acceleration"], raw.acceleration)?;
    document.positive(&["turn_s"], raw.turn_s)?;
    Ok(SingleJointMove {
        joint,
        speeds: raw.speeds,
        range: raw.range,
        acceleration: raw.acceleration,
        turn_s: raw.turn_s,
    })
}

fn points(document: &TomlDocument, raw: TrajectoryToml) -> Result<PointsSection, ConfigError> {
    let coordinates = coordinates(document, &raw)?;
    if raw.point.len() < 2 {
        let remedy = "at least two `[[point]]` tables with `t` and `position`";
        return Err(document.missing(&["point"], remedy));
    }
    for (index, pair) in raw.point.windows(2).enumerate() {
        let index = (index + 1).to_string();
        if pair[1].t <= pair[0].t {
            return Err(document.value(
                &["point", &index, "t"],
                "does not lie after the time before it",
                "sort the points by increasing time",
            ));
        }
        if pair[1].position.len() != pair[0].position.len() {
            return Err(document.value(
                &["point", &index, "position"],
                "has another number of coordinates than the point before",
                "give every coordinate in every point",
            ));
        }
    }
    Ok(PointsSection {
        coordinates,
        points: raw.point,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_reads_back_as_it_was() {
        let all = [
            Trajectory::Fourier(FourierSection {
                coordinates: TrajectoryCoordinates::Cartesian,
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
                coordinates: TrajectoryCoordinates::Joint,
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
