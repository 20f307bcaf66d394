//! Results as a person or a script sees them: one [`Report`] as terminal text and as a page, SVG
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
mod summary;
pub mod table;
pub mod text;
mod traces;
pub mod usual;
mod value;
mod words;

pub use value::{
    FigureTone, FoundLine, Report, ReportDetail, TerminalScreen, VerdictFigure, VerdictHeadline,
    Writer,
};
pub use words::torques_off;
