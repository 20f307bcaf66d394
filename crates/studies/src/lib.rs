//! Plants of another make than `simulate`, and studies that judge the `cft-ident` binary by what it writes.
//!
//! Nothing here uses code of `cft-ident`: bodies ([`chain`]), friction with an ideal stick ([`plant`]), drives and
//! controllers ([`drive`]), motions ([`path`]) and sensors are the studies' own. (The programs under `examples` are
//! studies of the library, and do.) A study writes logs and robot files as a laboratory would have them
//! ([`files`]), runs the binary on them ([`tool`]), and compares its documents with the truth, which no estimator sees.
//!
//! | study | asks |
//! |---|---|
//! | [`coverage`] | do 95 % intervals hold the truth, where the verdict is "identified"? |
//! | [`clean`] | is an effect written where nothing is missing? |
//! | [`planted`] | is what was planted named, and does the model predict as well as the truth? |
//! | [`kinds`] | is each kind of effect found with its size on machines that have it, and on none without? |
//! | [`formula`] | is the formula of a law found that stands in no catalogue? |
//! | [`next_motion`] | what is the motion worth that `lsq` proposes to record next? |
//! | [`nulls`] | is an effect written where the torque is the model's and noise, along measured motions? |
//! | [`rotations`] | what does a diagnosis do to measured data that nobody used? |
//! | [`payload`] | is a load found, and do its intervals hold it? |
//! | [`setup`] | is a right robot file left in peace, and a mistake named? |

#![forbid(unsafe_code)]

pub mod added;
pub mod arms;
pub mod campaign;
pub mod cft;
pub mod chain;
pub mod chance;
pub mod clean;
pub mod cover;
pub mod coverage;
pub mod drive;
pub mod files;
pub mod formula;
pub mod friction;
pub mod judge;
pub mod kinds;
pub mod lab;
pub mod machine;
pub mod measured;
pub mod model;
pub mod next_motion;
pub mod nulls;
pub mod page;
pub mod path;
pub mod payload;
pub mod plant;
pub mod planted;
pub mod rotations;
pub mod setup;
pub mod signal;
pub mod space;
pub mod study;
pub mod tool;
pub mod uncatalogued;
