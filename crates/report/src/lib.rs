//! One value (verdict, tables, figures, notes) as terminal text, page and JSON.

#![forbid(unsafe_code)]

pub mod report;
