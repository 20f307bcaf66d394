//! One value (verdict, tables, figures, notes) as terminal text, page and JSON.
//!
//! A [`report::Report`] is filled by [`report::Writer`]s, which say where a part is shown; [`report::table::Table`] is
//! a table of it, [`report::stages`] makes the report of each stage.
//!
//! ```
//! use cft_ident_report::report::Report;
//!
//! let mut report = Report::new("Fit of monday.csv");
//! report.everywhere().verdict("The model leaves 4.1 % of the torque.", true);
//! report.detail().paragraph("12 of 12 parameters are determined.");
//! assert!(report.text().contains("4.1 %"));
//! ```

#![forbid(unsafe_code)]

pub mod report;
