//! Dimensions of the CFT robot (Table 1), in metres.

/// Length of link 2, height of frame 0' above the rails: L2.
pub(crate) const L2: f64 = 0.25;
/// Length of link 4, the short crank of the pantograph: L4.
pub const L4: f64 = 0.05;
/// Length of link 5: L5 = L4 + L6.
pub const L5: f64 = 0.35;
/// Length of link 6: L6.
pub const L6: f64 = 0.30;
/// Height of the tool under the wrist: L7.
pub const L7: f64 = 0.08;
/// Reach of the tool from the wrist: L8.
pub const L8: f64 = 0.48;
/// Sideways offset of link 6: d6 = -d7.
pub(crate) const D6: f64 = 0.04;
/// Distance between the origins of frames 1 and e: ds.
pub(crate) const DS: f64 = 0.185;
/// Distance between the origins of frames 2 and 0': d.
pub const D: f64 = 0.0916;
/// u = L5 - L4, equal to L6: the point that closes the pantograph.
pub const U: f64 = L5 - L4;
/// Encoder alignment of the base rotation: x_c3 at which the arm lies along x0, in rad.
pub(crate) const BASE_ANGLE: f64 = 0.8292;
/// x_c1 at which the wrist is level with frame 0', in m (the 0.25 of eq. (44)).
pub(crate) const LEVEL: f64 = 0.25;
/// Acceleration of gravity g, in m/s^2.
pub const GRAVITY: f64 = 9.81;
