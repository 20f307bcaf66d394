//! Summaries.
use serde_json::Value;
pub fn write(_rows: &[Value], _folder: &std::path::Path) {}
