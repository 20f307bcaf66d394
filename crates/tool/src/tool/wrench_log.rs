//! Wrenches with the orientations at which they were measured, and the ways in which a log of them can be meant.

use cft_ident_core::robot::tree::space::{Rotation, UNTURNED, Vector, product};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One row: where the sensor was, and what it measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchSample {
    /// Time \[s\], or number of the row where there is no clock.
    pub t: f64,
    /// Quaternion as it was logged, of length one; of another orientation as the first of [`WrenchLog::orientations`]
    /// has it.
    pub quaternion: [f64; 4],
    /// Origin of the sensor in the base frame \[m\].
    pub position: Option<Vector>,
    /// Force \[N\].
    pub force: Vector,
    /// Moment about the sensor's origin \[Nm\].
    pub moment: Vector,
}

/// The rows of one or several logs, in their order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WrenchLog {
    pub samples: Vec<WrenchSample>,
    /// Whether `t` is a time.
    pub has_clock: bool,
    /// Whether names or the robot say what the quaternion's numbers are: x y z w of the sensor in the base.
    pub orientation_is_named: bool,
    /// Every way to read orientations that are no quaternions: x y z w of the sensor in the base, one for each sample.
    pub orientations: Vec<(OrientationIs, Vec<[f64; 4]>)>,
    /// Whether a unit of the forces is stated.
    pub unit_is_stated: bool,
    /// What was chosen on the way, one sentence each.
    pub notes: Vec<String>,
}

/// The frame along whose axes wrenches are logged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WrenchFrame {
    /// The sensor's own.
    Sensor,
    /// That of the base of the robot.
    Base,
}

impl WrenchFrame {
    pub fn word(self) -> &'static str {
        match self {
            Self::Sensor => "the sensor's own frame",
            Self::Base => "the base frame",
        }
    }
}

/// What the numbers of an orientation are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrientationIs {
    /// x y z w of the sensor in the base frame.
    Xyzw,
    /// w x y z of the same.
    Wxyz,
    /// x y z w of the base in the sensor's frame.
    InverseXyzw,
    /// w x y z of that.
    InverseWxyz,
    /// A vector along the axis, as long as the angle.
    RotationVector,
    /// The same of the base in the sensor's frame.
    InverseRotationVector,
    /// Angles about the fixed axes x, y, z, one after the other.
    RollPitchYaw,
    /// Angles about z, then y, then x as they were turned: A B C.
    AboutZyx,
    /// Angles about x, then y, then z as they were turned.
    AboutXyz,
    /// Angles about z, then y, then z as they were turned.
    AboutZyz,
    /// A matrix, column after column.
    MatrixByColumns,
    /// A matrix, row after row.
    MatrixByRows,
}

impl OrientationIs {
    /// The ways that are asked for, those as named first.
    pub const ALL: [Self; 4] = [Self::Xyzw, Self::Wxyz, Self::InverseXyzw, Self::InverseWxyz];

    /// What three numbers may be, the likeliest first.
    pub(super) const OF_THREE: [Self; 6] = [
        Self::RotationVector,
        Self::RollPitchYaw,
        Self::AboutZyx,
        Self::AboutXyz,
        Self::AboutZyz,
        Self::InverseRotationVector,
    ];

    pub fn words(self) -> &'static str {
        match self {
            Self::RotationVector => "a rotation vector of the sensor in the base frame",
            Self::InverseRotationVector => "a rotation vector of the base in the sensor's frame",
            Self::RollPitchYaw => "roll, pitch and yaw about fixed x, y, z",
            Self::AboutZyx => "angles about z, y', x'' (A B C)",
            Self::AboutXyz => "angles about x, y', z''",
            Self::AboutZyz => "angles about z, y', z''",
            Self::MatrixByColumns => "a matrix by columns",
            Self::MatrixByRows => "a matrix by rows",
            Self::Xyzw => "x y z w of the sensor in the base frame",
            Self::Wxyz => "w x y z of the sensor in the base frame",
            Self::InverseXyzw => "x y z w of the base in the sensor's frame",
            Self::InverseWxyz => "w x y z of the base in the sensor's frame",
        }
    }

    /// Axes of the sensor in the base frame, as columns.
    fn rotation(self, numbers: &[f64; 4]) -> Rotation {
        let [a, b, c, d] = *numbers;
        let rotation = of_quaternion(match self {
            Self::Wxyz | Self::InverseWxyz => [b, c, d, a],
            _ => [a, b, c, d],
        });
        match self {
            Self::InverseXyzw | Self::InverseWxyz => transposed(&rotation),
            _ => rotation,
        }
    }
}

/// A way to understand a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct WrenchReading {
    /// Frame of the wrenches.
    pub frame: WrenchFrame,
    /// What orientations are.
    pub orientation: OrientationIs,
}

impl WrenchLog {
    /// Appends the readings of one more log, of which `before` samples stood before; an error where they are of other
    /// kinds than those before them.
    pub(super) fn add_readings(
        &mut self,
        readings: Vec<(OrientationIs, Vec<[f64; 4]>)>,
        before: usize,
    ) -> Result<(), ()> {
        if before == 0 {
            self.orientations = readings;
            return Ok(());
        }
        let kinds = |all: &[(OrientationIs, Vec<[f64; 4]>)]| -> Vec<OrientationIs> {
            all.iter().map(|(is, _)| *is).collect()
        };
        if kinds(&self.orientations) != kinds(&readings) {
            return Err(());
        }
        for ((_, all), (_, more)) in self.orientations.iter_mut().zip(readings) {
            all.extend(more);
        }
        Ok(())
    }
}

impl WrenchReading {
    /// The ways that a log may be meant.
    pub fn of(log: &WrenchLog) -> Vec<Self> {
        let others: Vec<OrientationIs> = log.orientations.iter().map(|(is, _)| *is).collect();
        let orientations = match log.orientation_is_named {
            _ if !others.is_empty() => &others,
            true => &OrientationIs::ALL[..1],
            false => &OrientationIs::ALL[..],
        };
        let frames = [WrenchFrame::Sensor, WrenchFrame::Base];
        let both = |orientation: &OrientationIs| {
            frames.map(|frame| Self {
                frame,
                orientation: *orientation,
            })
        };
        orientations.iter().flat_map(both).collect()
    }

    /// Rows with the wrench along the sensor's axes.
    pub fn rows(self, log: &WrenchLog) -> Vec<PoseRow> {
        let places: Vec<Vector> = log.samples.iter().filter_map(|s| s.position).collect();
        let middle = |k: usize| places.iter().map(|x| x[k]).sum::<f64>() / places.len() as f64;
        let middle: Vector = std::array::from_fn(middle);
        let own = log
            .orientations
            .iter()
            .find(|(is, _)| *is == self.orientation);
        let of = |(number, sample): (usize, &WrenchSample)| {
            let logged = own.map_or(&sample.quaternion, |(_, all)| &all[number]);
            let rotation = self.orientation.rotation(logged);
            let own = |x: &Vector| match self.frame {
                WrenchFrame::Sensor => *x,
                WrenchFrame::Base => turned_back(&rotation, x),
            };
            PoseRow {
                number,
                t: sample.t,
                rotation,
                position: sample.position,
                away: sample
                    .position
                    .map(|x| std::array::from_fn(|k| x[k] - middle[k])),
                force: own(&sample.force),
                moment: own(&sample.moment),
                acceleration: [0.0; 3],
                turning: [[0.0; 3]; 2],
            }
        };
        log.samples.iter().enumerate().map(of).collect()
    }
}

/// A row in the sensor's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRow {
    /// Its number in the log.
    pub number: usize,
    /// Time \[s\] or number of the row.
    pub t: f64,
    /// Axes of the sensor in the base frame, as columns.
    pub rotation: Rotation,
    /// Origin of the sensor in the base frame \[m\].
    pub position: Option<Vector>,
    /// The same from the middle of all \[m\].
    pub away: Option<Vector>,
    /// Force along the sensor's axes \[N\].
    pub force: Vector,
    /// Moment about its origin \[Nm\].
    pub moment: Vector,
    /// Acceleration of its origin in the base frame \[m/s^2\]; 0 of a pose that is held.
    pub acceleration: Vector,
    /// Angular velocity \[rad/s\] and acceleration \[rad/s^2\] along the sensor's axes.
    pub turning: [Vector; 2],
}

/// R' a.
pub(crate) fn turned_back(r: &Rotation, a: &Vector) -> Vector {
    std::array::from_fn(|j| (0..3).map(|i| r[i][j] * a[i]).sum())
}

pub(crate) fn transposed(r: &Rotation) -> Rotation {
    std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]))
}

/// Rotation of a quaternion x y z w of length one.
pub(crate) fn of_quaternion([x, y, z, w]: [f64; 4]) -> Rotation {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// Quaternion x y z w of a rotation, w not below zero (Shepperd 1978).
pub(crate) fn quaternion_of(r: &Rotation) -> [f64; 4] {
    let trace = r[0][0] + r[1][1] + r[2][2];
    let of = [r[0][0], r[1][1], r[2][2], trace];
    let most = (0..4).fold(3, |best, k| if of[k] > of[best] { k } else { best });
    let mut q = [0.0; 4];
    if most == 3 {
        q[3] = 1.0 + trace;
        for (i, x) in q.iter_mut().take(3).enumerate() {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            *x = r[k][j] - r[j][k];
        }
    } else {
        let (i, j, k) = (most, (most + 1) % 3, (most + 2) % 3);
        q[i] = 1.0 + r[i][i] - r[j][j] - r[k][k];
        q[j] = r[i][j] + r[j][i];
        q[k] = r[i][k] + r[k][i];
        q[3] = r[k][j] - r[j][k];
    }
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
    q.map(|x| sign * x / length)
}

/// Rotation by a vector: its length is the angle \[rad\].
pub(crate) fn of_turn(turn: &Vector) -> Rotation {
    let angle = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
    match angle > 0.0 {
        true => cft_ident_core::robot::tree::space::about(&turn.map(|x| x / angle), angle),
        false => UNTURNED,
    }
}

/// The vector of a rotation.
pub(crate) fn turn_of(r: &Rotation) -> Vector {
    let [x, y, z, w] = quaternion_of(r);
    let sine = (x * x + y * y + z * z).sqrt();
    let scale = match sine > 1e-12 {
        true => 2.0 * sine.atan2(w) / sine,
        false => 2.0,
    };
    [x, y, z].map(|x| scale * x)
}

/// Turn from one orientation to another, along the axes of the first \[rad\].
pub(crate) fn turn_between(from: &Rotation, to: &Rotation) -> Vector {
    turn_of(&product(&transposed(from), to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_rotations_and_turns_say_the_same() {
        for turn in [
            [0.3, -0.2, 0.9],
            [3.0, 0.1, -0.2],
            [0.0; 3],
            [0.0, 3.1, 0.0],
            [-2.2, 1.9, 0.4],
        ] {
            let r = of_turn(&turn);
            let again = of_quaternion(quaternion_of(&r));
            for (a, b) in r.iter().flatten().zip(again.iter().flatten()) {
                assert!((a - b).abs() < 1e-12);
            }
            for (a, b) in turn.iter().zip(turn_of(&r)) {
                assert!((a - b).abs() < 1e-9, "{turn:?}");
            }
        }
    }
}
