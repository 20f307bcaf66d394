//! Recordings of messages: MCAP files and rosbag2 databases, CDR, JSON and protobuf.
//!
//! Files become one sequence of messages ([`container`]), in which the topics that hold the robot's
//! channels are looked for ([`survey`]); their messages become rows ([`rows`]).

mod bag;
mod cdr;
mod container;
mod cursor;
mod decode;
mod delay;
mod descriptor;
mod fields;
mod joint_states;
mod json;
mod mcap;
mod msg;
mod pairing;
mod path;
mod plan;
mod proto;
mod record;
mod rows;
mod survey;
mod value;
mod wire;

pub(super) use joint_states::JointStates;
pub(super) use rows::MessageRows;

pub use cdr::CdrReader;
pub use cursor::Malformed;
pub use delay::{Delay, Estimate as DelayEstimate};
pub use msg::DefinitionError;
pub use value::Value;
