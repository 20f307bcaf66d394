//! The CFT transposer robot of Rodriguez-Angeles, Lizarraga, Nijmeijer and van Essen (2002, report
//! WFW 2002.52), with the report's slips put right.
//!
//! | file | what | source |
//! |---|---|---|
//! | [`geometry`] | dimensions | Table 1 |
//! | [`pantograph`] | x_c1..x_c4 to q1, q2, q4, q5 and back | (45)-(57), (62) |
//! | [`dynamics`] | M, C, G | Appendix B |
//! | [`regressor`] | Y, 12 or 22 parameters | (26), (39) |
//! | [`links`] | link masses to theta | Table 4, (5)-(9) |
//! | [`linkage`] | the arm as a chain of general links | Table 2, (54), (56) |
//! | [`actuation`] | volts, motor forces, counts, limits | (63)-(66), Tables 5 and 6 |
//! | [`practice`] | how it is run, numbers of a synthetic one | Table 3 |

pub mod actuation;
pub mod dynamics;
pub mod geometry;
pub mod linkage;
pub mod links;
pub mod pantograph;
pub mod practice;
pub mod regressor;

mod parameters;

pub use actuation::{ActuationLimits, LaboratorySetup};
pub use dynamics::ReportCoefficients;
pub use parameters::{EXTENDED, PRINTED, UNPRINTED};

/// Joint names in the order of all vectors.
pub const JOINTS: [&str; 4] = ["q1", "q2", "q4", "q5"];
/// Names of the Cartesian coordinates in the order of all vectors.
pub const COORDINATES: [&str; 4] = ["x_c1", "x_c2", "x_c3", "x_c4"];

/// How many inertial parameters the model carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ParameterStructure {
    /// theta_1..theta_12, the report's structure.
    #[default]
    Printed12,
    /// The 22 base parameters of a chain of eight general rigid links on these joints.
    Full22,
}
