//! What is known of a robot beside its file: numbers that stand for it, and how it is run.

use super::friction::DoubleTanh;

/// Numbers that stand for a robot that no model is given for.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalModel {
    /// Inertial parameters, in the order of the regressor's columns.
    pub theta: Vec<f64>,
    pub friction: Vec<DoubleTanh>,
}

/// How a robot is run where nothing says otherwise; motors in the order of their coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatingDefaults {
    /// Largest voltage of the amplifiers \[V\].
    pub volts: f64,
    /// Top speed of each motor's coordinate \[m/s or rad/s\].
    pub speeds: Vec<f64>,
    /// Proportional gains \[V/m, V/rad\] and derivative ones \[V s/m, V s/rad\] of each motor's coordinate.
    pub control: [Vec<f64>; 2],
    /// Slowest plateau \[m/s, rad/s\] and acceleration \[m/s^2, rad/s^2\] of one-joint experiments.
    pub joint_ladders: Vec<[f64; 2]>,
    /// The same where a motor's coordinate runs the ladder.
    pub coordinate_ladders: Vec<[f64; 2]>,
    pub excitation: Excitation,
    /// Least clearance of a designed motion, see [`super::Transmission::clearance`], and the joint on which
    /// it depends.
    pub clearance: (usize, f64),
    /// Coordinate on whose position no torque depends.
    pub uniform: usize,
}

/// A finite Fourier series of eq. (43), one row for each harmonic.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Middle of each coordinate \[m or rad\].
    pub offset: Vec<f64>,
    /// Amplitudes of the velocity \[m/s or rad/s\].
    pub a: Vec<Vec<f64>>,
    pub b: Vec<Vec<f64>>,
    /// Fundamental \[Hz\].
    pub fundamental_hz: f64,
}
