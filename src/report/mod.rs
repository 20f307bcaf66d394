//! What a person or a script sees of a result: plain-text tables, SVG figures, JSON documents.
//!
//! Everything here is a function of plain data and writes nowhere by itself; the same data give the
//! same bytes.

pub mod figure;
pub mod json;
pub mod number;
pub mod page;
pub mod summary;
pub mod table;
