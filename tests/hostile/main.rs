//! Numbers, files and lengths that nobody should give: every command ends with a status, a message and
//! bounded memory, and leaves no half file. Data are generated and seeded.
#![cfg(unix)]

mod bench;
mod extremes;
mod lost_parts;
mod numbers;
mod outputs;
mod sizes;
