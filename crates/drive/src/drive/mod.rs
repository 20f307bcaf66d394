//! Drives: what a servo or a leg is, from commanded and measured positions.
//!
//! ```text
//! files -> DriveLog                     read      plain numbers, joint by joint
//!       -> checked                      check     units, rest, stops
//!       -> roll-outs                    roll_out  one axis; chain: arms and legs
//!       -> fitted law                   fit       output error, Gauss-Newton with bounds
//!       -> LawEstimate                  estimate  with deviations, with one effect more or less
//!       -> steps, judged                search    candidate effects, jackknife in judge; held_out: what other logs say
//!       -> Drives                       outcome   names, units, verdicts; drive_file: TOML
//! ```

pub mod blocks;
pub mod candidate;
pub mod chain;
pub mod check;
pub mod drive_file;
pub mod error;
pub mod estimate;
pub mod export;
pub mod fit;
pub mod held_out;
pub mod identify;
pub mod judge;
pub mod law;
mod made;
mod numbers;
pub mod outcome;
pub mod read;
pub mod roll_out;
pub mod search;
pub mod set_point;
pub mod start;
pub mod track;
pub mod unknown;
