//! Recordings of messages: MCAP files and rosbag2 databases, CDR, JSON and protobuf.
//!
//! Files ([`format`]) become one sequence of messages ([`parts`]), in which the topics that hold the
//! robot's channels are looked for ([`survey`]); their messages ([`encoding`]) become rows ([`rows`]).

mod delay;
mod encoding;
mod fields;
mod format;
mod joined;
mod joint_states;
mod listing;
mod message;
mod pairing;
mod parts;
mod path;
mod rows;
mod sources;
mod state_topics;
mod survey;
mod value;

pub(super) use format::{FORMATS, format_of};
pub(super) use joined::{JoinedTopics, of_joints, of_topics};
pub(super) use joint_states::{JointStates, has_none};
pub(super) use listing::listing;
pub(super) use rows::MessageRows;
pub(super) use state_topics::state_groups;

pub(crate) use delay::{DelayEstimate, DelayEstimator};
pub use encoding::CdrReader;
pub use listing::TopicFacts;
pub use state_topics::StateGroup;
pub use value::Value;
