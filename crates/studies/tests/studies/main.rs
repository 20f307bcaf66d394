//! Tests of the plants, of their logs and of the page.

mod logs;
mod page;
mod plants;
