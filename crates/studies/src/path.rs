//! Motions that laboratories make: sums of sines, point to point, ladders of speeds, and paths as a hand would lead.

use std::f64::consts::TAU;

use serde::Serialize;

use crate::chain::{JOINTS, Joints};
use crate::chance::Chance;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// 0.1 to 0.6 Hz.
    SlowSines,
    /// 0.4 to 1.6 Hz.
    FastSines,
    PointToPoint,
    Ladder,
    /// Replayed from a path that a hand led, with rests.
    HandLed,
}

pub const MOTIONS: [Motion; 5] = [
    Motion::SlowSines,
    Motion::FastSines,
    Motion::PointToPoint,
    Motion::Ladder,
    Motion::HandLed,
];

/// Where a joint may go, and how fast.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Range {
    pub centre: f64,
    pub half: f64,
    pub speed: f64,
}

/// Position, speed and acceleration.
pub type Point = (f64, f64, f64);

enum OfJoint {
    Sines {
        base: f64,
        centre: f64,
        parts: Vec<(f64, f64)>,
    },
    Pieces(Vec<Piece>),
    /// Points of a file, so far apart [s].
    Points(Vec<Point>, f64),
}

/// A polynomial of the fifth degree from `begin` for `length` seconds.
struct Piece {
    begin: f64,
    length: f64,
    c: [f64; 6],
}

/// The reference of all joints.
pub struct Path {
    joints: Vec<OfJoint>,
    pub seconds: f64,
    /// A joint that goes with another, and by which factor.
    pub tied: Option<(usize, usize, f64)>,
}

impl Path {
    pub fn new(motion: Motion, ranges: &[Range], seconds: f64, chance: &mut Chance) -> Self {
        let one = |range: &Range| match motion {
            Motion::SlowSines => sines(range, 0.1, 6, chance),
            Motion::FastSines => sines(range, 0.4, 4, chance),
            Motion::PointToPoint => OfJoint::Pieces(moves(range, seconds, chance)),
            Motion::Ladder => OfJoint::Pieces(ladder(range, seconds, chance)),
            Motion::HandLed => OfJoint::Pieces(led(range, seconds, chance)),
        };
        Self {
            joints: ranges.iter().map(one).collect(),
            seconds,
            tied: None,
        }
    }

    /// The motion of a file: by joint its points, so far apart [s].
    pub fn of_points(joints: Vec<Vec<Point>>, step: f64) -> Self {
        let rows = joints.first().map_or(0, Vec::len);
        Self {
            joints: joints
                .into_iter()
                .map(|p| OfJoint::Points(p, step))
                .collect(),
            seconds: step * rows.saturating_sub(1) as f64,
            tied: None,
        }
    }

    pub fn at(&self, t: f64) -> (Joints, Joints, Joints) {
        let (mut q, mut v, mut a) = ([0.0; JOINTS], [0.0; JOINTS], [0.0; JOINTS]);
        for (i, joint) in self.joints.iter().enumerate() {
            (q[i], v[i], a[i]) = joint.at(t);
        }
        if let Some((joint, with, factor)) = self.tied {
            for values in [&mut q, &mut v, &mut a] {
                values[joint] = factor * values[with];
            }
        }
        (q, v, a)
    }
}

impl OfJoint {
    fn at(&self, t: f64) -> Point {
        match self {
            Self::Sines {
                base,
                centre,
                parts,
            } => {
                let mut out = (*centre, 0.0, 0.0);
                for (k, (a, b)) in parts.iter().enumerate() {
                    let w = base * (k + 1) as f64;
                    let (s, c) = (w * t).sin_cos();
                    out.0 += a * s + b * c;
                    out.1 += w * (a * c - b * s);
                    out.2 -= w * w * (a * s + b * c);
                }
                out
            }
            Self::Pieces(pieces) => {
                let after = pieces.partition_point(|piece| piece.begin <= t);
                pieces[after.saturating_sub(1)].at(t)
            }
            Self::Points(points, step) => {
                let at = (t / step).clamp(0.0, points.len().saturating_sub(1) as f64);
                let (k, part) = (at.floor() as usize, at.fract());
                let (a, b) = (points[k], points[(k + 1).min(points.len() - 1)]);
                let between = |a: f64, b: f64| a + part * (b - a);
                (between(a.0, b.0), between(a.1, b.1), between(a.2, b.2))
            }
        }
    }
}

impl Piece {
    /// From one position and speed to another, without acceleration at both ends.
    fn between(begin: f64, length: f64, from: (f64, f64), to: (f64, f64)) -> Self {
        let t = length;
        let rest = to.0 - from.0 - from.1 * t;
        let gain = (to.1 - from.1) * t;
        let c3 = (10.0 * rest - 4.0 * gain) / t.powi(3);
        let c4 = (-15.0 * rest + 7.0 * gain) / t.powi(4);
        let c5 = (6.0 * rest - 3.0 * gain) / t.powi(5);
        Self {
            begin,
            length,
            c: [from.0, from.1, 0.0, c3, c4, c5],
        }
    }

    fn at(&self, t: f64) -> Point {
        let s = (t - self.begin).clamp(0.0, self.length);
        let c = &self.c;
        let q = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))));
        let v = c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * 5.0 * c[5])));
        let a = 2.0 * c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * 20.0 * c[5]));
        (q, v, a)
    }
}

fn sines(range: &Range, base_hz: f64, harmonics: usize, chance: &mut Chance) -> OfJoint {
    let base = TAU * base_hz;
    let mut parts: Vec<(f64, f64)> = (1..=harmonics)
        .map(|k| {
            let (angle, size) = (chance.between(0.0, TAU), chance.between(0.5, 1.0));
            let size = size / (k as f64).sqrt();
            (size * angle.sin(), size * angle.cos())
        })
        .collect();
    let shape = |parts: Vec<(f64, f64)>| OfJoint::Sines {
        base,
        centre: 0.0,
        parts,
    };
    let trial = shape(parts.clone());
    let period = 1.0 / base_hz;
    let points: Vec<Point> = (0..400)
        .map(|k| trial.at(period * f64::from(k) / 400.0))
        .collect();
    let most = |of: fn(&Point) -> f64| points.iter().map(|p| of(p).abs()).fold(0.0, f64::max);
    let scale = (range.half / most(|p| p.0)).min(range.speed / most(|p| p.1));
    for part in &mut parts {
        *part = (part.0 * scale, part.1 * scale);
    }
    OfJoint::Sines {
        base,
        centre: range.centre,
        parts,
    }
}

/// Moves from rest to rest, each as fast as the joint may, with rests between.
fn moves(range: &Range, seconds: f64, chance: &mut Chance) -> Vec<Piece> {
    let (mut t, mut at) = (0.0, range.centre + chance.between(-0.5, 0.5) * range.half);
    let mut pieces = Vec::new();
    while t < seconds {
        let to = range.centre + chance.between(-1.0, 1.0) * range.half;
        let speed = range.speed * chance.between(0.3, 1.0);
        let length = (1.875 * (to - at).abs() / speed).max(0.25);
        pieces.push(Piece::between(t, length, (at, 0.0), (to, 0.0)));
        t += length;
        let rest = chance.between(0.1, 0.6);
        pieces.push(Piece::between(t, rest, (to, 0.0), (to, 0.0)));
        t += rest;
        at = to;
    }
    pieces
}

/// Constant speeds both ways, from a fiftieth of the top speed up, with ramps.
fn ladder(range: &Range, seconds: f64, chance: &mut Chance) -> Vec<Piece> {
    const RAMP_S: f64 = 0.15;
    let (mut t, mut at, mut speed) = (0.0, range.centre, 0.0);
    let mut pieces = Vec::new();
    let mut way = chance.sign();
    let steps = (seconds / 2.6).floor().max(6.0);
    let mut k = 0.0;
    while t < seconds {
        let size = range.speed * 50_f64.powf(((k / 2.0_f64).floor() * 2.0 / steps).min(1.0) - 1.0);
        let next = way * size;
        let ramp = 0.5 * (speed + next) * RAMP_S;
        pieces.push(Piece::between(t, RAMP_S, (at, speed), (at + ramp, next)));
        (t, at, speed) = (t + RAMP_S, at + ramp, next);
        // as long as the joint has room, and a second and a half at most
        let room = range.half - way * (at - range.centre);
        let length = (0.95 * room / size).clamp(0.05, 1.15);
        pieces.push(Piece::between(
            t,
            length,
            (at, speed),
            (at + length * speed, speed),
        ));
        (t, at) = (t + length, at + length * speed);
        way = -way;
        k += 1.0;
    }
    pieces
}

/// Smooth pieces between points at uneven times, sometimes at rest.
fn led(range: &Range, seconds: f64, chance: &mut Chance) -> Vec<Piece> {
    let (mut t, mut at) = (0.0, (range.centre, 0.0));
    let mut pieces = Vec::new();
    while t < seconds {
        let length = chance.between(0.4, 1.3);
        let reach = 0.5 * range.speed * length;
        let aim = range.centre + chance.between(-0.9, 0.9) * range.half;
        let way = (aim - at.0).clamp(-reach, reach);
        let speed = if chance.between(0.0, 1.0) < 0.3 {
            0.0
        } else {
            chance.between(0.1, 0.5) * way / length
        };
        let to = (at.0 + way, speed);
        pieces.push(Piece::between(t, length, at, to));
        t += length;
        at = to;
        if speed == 0.0 {
            let rest = chance.between(0.1, 0.8);
            pieces.push(Piece::between(t, rest, at, at));
            t += rest;
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_motion_is_smooth_and_stays_near_its_range() {
        let range = Range {
            centre: 0.2,
            half: 0.8,
            speed: 2.0,
        };
        for motion in MOTIONS {
            for seed in 0..10 {
                let path = Path::new(motion, &[range], 20.0, &mut Chance::of("path", seed));
                let h = 1e-4;
                let mut fastest: f64 = 0.0;
                for k in 1..4000 {
                    let t = f64::from(k) * 5e-3;
                    let (before, now, after) = (path.at(t - h), path.at(t), path.at(t + h));
                    let slope = (after.0[0] - before.0[0]) / (2.0 * h);
                    assert!((slope - now.1[0]).abs() < 0.01, "{motion:?} at {t}");
                    assert!(
                        (now.0[0] - range.centre).abs() < 1.3 * range.half,
                        "{motion:?} {}",
                        now.0[0]
                    );
                    fastest = fastest.max(now.1[0].abs());
                }
                assert!(
                    fastest > 0.3 * range.speed && fastest < 1.6 * range.speed,
                    "{motion:?} {fastest}"
                );
            }
        }
    }
}
