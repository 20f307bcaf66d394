//! The bench: logs of measured and simulated machines with one fault in their set-up each, and what
//! the tool makes of them. It knows the truth because it made the fault; it alters files by itself and
//! calls nothing of the tool but its commands.
//!
//! | file | what |
//! |---|---|
//! | `table` | a log as columns |
//! | `machines` | the machines, their logs and robot files |
//! | `robot_text` | changes of a robot file; a URDF from its links |
//! | `faults` | the faults and how they are made |
//! | `rows` | those that are in the rows of a log |
//! | `cases` | which fault on which machine |
//! | `tool` | the commands that are run |
//! | `fit` | parameters, errors and physics of a fit |
//! | `judge` | what was right of what the tool said |
#![allow(dead_code)] // the study and the test use their share

pub mod cases;
pub mod faults;
pub mod fit;
pub mod judge;
pub mod machines;
pub mod names;
pub mod robot_text;
pub mod rows;
pub mod table;
pub mod tool;
