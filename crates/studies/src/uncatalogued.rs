//! Laws that stand in no catalogue of the tool: what a search for a formula is judged by. The first ten were fixed
//! before the search was judged on any; the second ten too, from what machines are known to do; the third ten after a first
//! run of some of the others, from a list of causes and not from the terms of the search; the last ten are those of a
//! reviewer who had not seen the search. Their signals are what a formula must be in, whatever its form.

use serde::Serialize;

use crate::added::Share;
use crate::chain::Joints;

/// A law; `other` is the joint that has a part in it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum Uncatalogued {
    /// Drag by the product of two speeds.
    SpeedProduct { other: usize },
    /// Friction that another joint's position sets.
    FrictionByOther { other: usize },
    /// A hose over two joints.
    Hose { other: usize },
    /// A cam: periodic, and no sine.
    Cam,
    /// Cogging whose size follows the load.
    LoadCogging,
    /// Three elements that slip one after the other (Iwan 1966).
    MaxwellSlip,
    /// Friction by a temperature that is logged.
    ThermalFriction,
    /// A magnet's hysteresis, stronger where the poles stand.
    MagneticHysteresis,
    /// Friction that is higher after a reversal and forgets that in time.
    DwellFriction,
    /// Drag that another joint's pose exposes to the air.
    DragByPose { other: usize },
    /// A seal that another joint's speed presses.
    SealBySpeed { other: usize },
    /// Friction by load on an eccentric gear.
    EccentricLoad,
    /// A spring between two joints.
    SpringBetween { other: usize },
    /// A cable that is wound up by two joints.
    Cable { other: usize },
    /// Viscous friction that a film loses at speed.
    FilmLoss,
    /// Viscosity by a temperature that is logged.
    ThermalViscosity,
    /// An eddy-current brake whose magnets stand at poles.
    EddyPoles,
    /// Friction by the magnitude of the acceleration: a bearing under the drive's own force.
    FrictionByAcceleration,
    /// A body that sloshes: inertia by the position.
    InertiaByPosition,
    /// Hysteresis of a gear, wider under load.
    LoadedHysteresis,
    /// A wheel that another joint spins: its torque turns with the pose.
    SpunWheel { other: usize },
    /// Friction that grows as another joint leaves the pose it was aligned in.
    FrictionOffPose { other: usize },
    /// A hose over two joints that pulls only where it is taut.
    TautHose { other: usize },
    /// A lobe on a cam, away from zero.
    CamLobe,
    /// Cogging that the size of the load deepens, either way it pushes.
    CoggingByLoadSize,
    /// Two elements that slip, one much stiffer than the other.
    UnevenSlip,
    /// A spring whose rate a logged temperature sets.
    WarmSpring,
    /// A magnet's hysteresis that changes its sign from pole to pole.
    PoleHysteresis,
    /// Friction that grows with the logarithm of speed: creep of the asperities.
    CreepFriction,
    /// A toothed belt between two joints.
    BeltBetween { other: usize },
    /// A body that the drawing lacks, thrown out by another joint's turning.
    ThrownBody { other: usize },
    /// A motor whose iron saturates.
    SaturatingMotor,
    /// A worn spot of the guide.
    WornSpot,
    /// A damper on a crank.
    CrankDamper,
    /// Cogging of magnets that a logged temperature changes.
    WarmCogging,
    /// Hysteresis of a seal that a logged temperature softens.
    WarmHysteresis,
    /// An energy chain that lies on its rail beyond the middle.
    EnergyChain,
    /// Tooth error of a differential, by the sum of two joints.
    DifferentialTeeth { other: usize },
    /// Air that a link's turning in space moves.
    Fan { other: usize },
    /// Oil that the gear churns above a speed.
    Churning,
}

/// Remembered by the plant for each joint.
#[derive(Debug, Clone, Copy, Default)]
pub struct Memory {
    /// Far sides of three plays.
    pub slips: [f64; 3],
    /// Dahl's bristle, -1 to 1.
    pub bristle: f64,
    /// Time since the last reversal [s], and the direction since then.
    pub since: f64,
    direction: f64,
}

/// Widths of the plays, and the way of the bristle [rad].
const WIDTHS: [f64; 3] = [0.02, 0.08, 0.25];
const WAY: f64 = 0.15;

impl Memory {
    pub fn at(q: f64) -> Self {
        Self {
            slips: [q; 3],
            ..Self::default()
        }
    }

    /// After a step from one position to another.
    pub fn goes(&mut self, from: f64, to: f64, h: f64) {
        for (slip, width) in self.slips.iter_mut().zip(WIDTHS) {
            *slip = slip.clamp(to - 0.5 * width, to + 0.5 * width);
        }
        let way = to - from;
        if way != 0.0 {
            let end = way.signum();
            self.bristle = end + (self.bristle - end) * (-way.abs() / WAY).exp();
            if end * self.direction < 0.0 {
                self.since = 0.0;
            }
            self.direction = end;
        }
        self.since += h;
    }

    fn slip(&self, q: f64) -> f64 {
        let of = |(slip, width): (&f64, f64)| (q - slip) / (0.5 * width);
        self.slips.iter().zip(WIDTHS).map(of).sum::<f64>() / 3.0
    }

    fn uneven_slip(&self, q: f64) -> f64 {
        let of = |i: usize| (q - self.slips[i]) / (0.5 * WIDTHS[i]);
        0.8 * of(0) + 0.2 * of(2)
    }
}

/// Temperature of every drive [degC]: it warms up, and the hall breathes.
pub fn temperature(t: f64) -> f64 {
    24.0 + 16.0 * (1.0 - (-t / 9.0).exp()) + 6.0 * (0.45 * t).sin()
}

/// What a law sees of a joint.
pub struct Seen<'a> {
    pub t: f64,
    pub q: &'a Joints,
    pub v: &'a Joints,
    /// Acceleration of the joint a step before.
    pub a: f64,
    pub load: f64,
    /// Torque that the drive is told to give.
    pub drive: f64,
    pub memory: &'a Memory,
}

impl Uncatalogued {
    /// Whether it hangs on a temperature.
    pub fn is_warm(self) -> bool {
        matches!(
            self,
            Self::ThermalFriction
                | Self::ThermalViscosity
                | Self::WarmSpring
                | Self::WarmCogging
                | Self::WarmHysteresis
        )
    }

    /// What the law makes of a joint, `k` large.
    pub fn share(self, k: f64, joint: usize, seen: &Seen) -> Share {
        let (q, v) = (seen.q[joint], seen.v[joint]);
        let torque = |torque: f64| Share { torque, level: 0.0 };
        let level = |level: f64| Share { torque: 0.0, level };
        let at = |other: usize| (seen.q[other], seen.v[other]);
        let warm = temperature(seen.t);
        match self {
            Self::SpeedProduct { other } => torque(k * v * at(other).1),
            Self::FrictionByOther { other } => level(k * (1.0 + (2.0 * at(other).0).sin())),
            Self::Hose { other } => torque(k * (1.3 * (q + at(other).0) + 0.4).sin()),
            Self::Cam => torque(k * (2.0 * (3.0 * q).cos()).exp()),
            Self::LoadCogging => torque(k * seen.load * (9.0 * q + 0.7).sin()),
            Self::MaxwellSlip => torque(k * seen.memory.slip(q)),
            Self::ThermalFriction => level(k * (-(warm - 20.0) / 12.0).exp()),
            Self::MagneticHysteresis => {
                torque(k * seen.memory.bristle * (1.0 + 0.5 * (2.0 * q).cos()))
            }
            Self::DwellFriction => level(k * (-seen.memory.since / 0.15).exp()),
            Self::DragByPose { other } => torque(k * v * v.abs() * 0.5 * (1.0 + at(other).0.cos())),
            Self::SealBySpeed { other } => level(k * at(other).1.abs()),
            Self::EccentricLoad => level(k * seen.load.abs() * 0.5 * (1.0 + (2.0 * q).cos())),
            Self::SpringBetween { other } => torque(k * q * at(other).0),
            Self::Cable { other } => torque(k * (q + at(other).0).powi(3)),
            Self::FilmLoss => torque(k * v * (-v.abs() / 0.6).exp()),
            Self::ThermalViscosity => torque(k * v * (-(warm - 20.0) / 20.0).exp()),
            Self::EddyPoles => torque(k * v * (2.0 * q).cos().powi(2)),
            Self::FrictionByAcceleration => level(k * seen.a.abs()),
            Self::InertiaByPosition => torque(k * seen.a * (2.0 * q).sin()),
            Self::LoadedHysteresis => torque(k * seen.memory.slip(q) * seen.load.abs()),
            Self::SpunWheel { other } => torque(k * at(other).1 * q.sin()),
            Self::FrictionOffPose { other } => level(k * (at(other).0 - 0.4).powi(2)),
            Self::TautHose { other } => torque(k * (q + at(other).0 - 0.3).max(0.0)),
            Self::CamLobe => torque(k * (-((q - 0.3) / 0.2).powi(2)).exp()),
            Self::CoggingByLoadSize => torque(k * seen.load.abs() * (7.0 * q).sin()),
            Self::UnevenSlip => torque(k * seen.memory.uneven_slip(q)),
            Self::WarmSpring => torque(k * q * (warm - 30.0) / 10.0),
            Self::PoleHysteresis => torque(k * seen.memory.bristle * (5.0 * q).sin()),
            Self::CreepFriction => level(k * (v.abs() / 0.1).ln_1p()),
            Self::BeltBetween { other } => torque(k * (4.0 * (q - at(other).0)).sin()),
            Self::ThrownBody { other } => torque(k * at(other).1.powi(2) * (2.0 * q).sin()),
            Self::SaturatingMotor => torque(k * seen.load * seen.load.abs()),
            Self::WornSpot => level(k * (-((q + 0.2) / 0.25).powi(2)).exp()),
            Self::CrankDamper => torque(k * v * v.abs() * q.cos().powi(2)),
            Self::WarmCogging => torque(k * (warm - 30.0) / 10.0 * (6.0 * q).sin()),
            Self::WarmHysteresis => torque(k * seen.memory.bristle * (-(warm - 20.0) / 15.0).exp()),
            Self::EnergyChain => level(k * 0.5 * (1.0 + (3.0 * q).tanh())),
            Self::DifferentialTeeth { other } => torque(k * (8.0 * (q + at(other).0)).sin()),
            Self::Fan { other } => {
                let v = v + at(other).1;
                torque(k * v * v.abs())
            }
            Self::Churning => level(k * (v.abs() - 0.3).max(0.0)),
        }
    }
}
