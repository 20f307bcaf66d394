//! What a person or a script sees of a result: one [`Report`] as terminal text and as a page, SVG
//! figures, JSON documents and their schemas.
//!
//! Everything here is a function of plain data and writes nowhere by itself; the same data give the
//! same bytes.

mod encode;
pub mod figure;
pub mod json;
mod page;
pub mod sections;
pub mod stages;
pub mod summary;
pub mod table;
mod text;
mod traces;
pub mod usual;
mod value;

pub use traces::{Trace, TraceLine, TracePanel, TraceStyle, Traces};
pub use value::{Detail, Part, Report, Shown, Writer};
