//! The only readers of recordings: from a file to blocks of t, q, tau in SI units.
//!
//! A [`LogSpec`] says which part of which file, a [`Layout`] which columns or message fields are which
//! channels; a [`Reader`] hands out [`Block`]s of at most [`Block::ROWS`] rows, so that memory does not
//! grow with the log. What comes out is finite, in strictly increasing time, and in SI.
//!
//! Text logs, MCAP recordings and rosbag2 databases, each also compressed with gzip or zstd, are distinguished
//! by their first bytes; logs in memory, as [`LogArrays`], are read alike.

mod arrays;
mod columns;
mod content;
mod delayed;
mod error;
mod even;
mod json_text;
mod layout;
mod mend;
mod messages;
mod names;
mod open;
mod open_file;
mod pass;
mod raw;
mod reader;
mod row_store;
mod rows;
mod section;
mod shared;
mod source;
mod spec;
mod stale;
mod stream;
mod table;
mod temperatures;
mod text;
mod time;
mod time_unit;
mod torn;
mod two_clocks;
mod unit;

pub use arrays::LogArrays;
pub use cft_ident_core::block::Block;
pub use content::{DOCUMENT, REDUCED};
pub use error::LogError;
pub use even::EvenSpacing;
pub use layout::{Channel, DeclaredChannels, Layout, RowConversion};
pub use mend::{BridgedSample, MendingSettings};
pub use messages::{CdrReader, StateGroup, TopicFacts, Value};
pub use names::{escape, escape_whole, nearest};
pub use raw::{RawBlock, RawReader, listing, topics};
pub use reader::Reader;
pub use section::{
    ActuatorChannels, ChannelChoice, ColumnDelimiter, ColumnName, ColumnsOfJoints, ControllerGains,
    ControllerTorque, FurtherCommand, JointChannels, LogSection, RowFault, StampSource, TimeUnit,
    TorqueIs, TorqueSign,
};
pub use shared::shares_rows;
pub use source::{DataRole, Provenance, begins_with, sha256};
pub use spec::{LogSpec, Span};
pub use temperatures::JointTemperatures;
pub use time::Instant;
pub use unit::{PositionUnit, TorqueUnit};

pub(crate) use columns::is_label;
pub use columns::unit_of;
pub use content::unpacked;
pub(crate) use even::{EvenClock, EvenFit};
pub use layout::channel;
pub(crate) use mend::{PositionUnwrap, longest_hold, signed};
pub(crate) use messages::{DelayEstimate, DelayEstimator};
pub use names::{did_you_mean, is_hidden, list};
pub(crate) use pass::round_within;
pub(crate) use row_store::RowStore;
pub use source::{bytes, named_beside, named_beside_of, remedy, sha256_of_bytes, shown};
pub(crate) use unit::{POSITIONS, TORQUES, UnitKind, spoken as spoken_unit, stated as stated_unit};
