//! Which columns of a log that nobody has described are which joint, in which unit.
//!
//! | file | what |
//! |---|---|
//! | `column` | what one column is by its name |
//! | `clock` | the column of times, by its name or by how its numbers run |
//! | `look` | a log as its columns: names, roles, ranges, times, and the topic of a recording |
//! | `content` | roles of columns without names, by what they hold |
//! | `family` | columns whose names differ in a number or a joint's name alone, and how well they fit |
//! | `fitting` | the family that fits best, and columns whose names say nothing |
//! | `shown` | the joints of a URDF, or those that a log shows |
//! | `choose` | one family each for positions, velocities and torques |
//! | `recorder` | units that a recorder is known to write |
//! | `units` | units that names state, or that numbers suggest |
//!
//! A guess is a guess: each is reported in words, and what is not certain says `CHECK IT`.

mod choose;
mod clock;
mod column;
mod content;
mod error;
mod family;
mod fitting;
mod look;
mod recorder;
mod shown;
mod units;
mod urdf_joint;

pub use choose::{JointColumns, Mapping};
pub use clock::ClockColumn;
pub use column::LogColumn;
pub use error::MappingError;
pub use look::{ClockSource, LogHints, SeenColumns, look};
pub use urdf_joint::UrdfJoint;
