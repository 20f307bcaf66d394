//! What the tests of logs share; not each of them needs all of it.
#![allow(dead_code)]

pub mod recording;

use std::path::{Path, PathBuf};

use cft_ident_logs::log::{Block, Layout, LogSpec, Reader};
use proptest::prelude::*;

/// A file of the folder with measured logs that lies beside the repository; said aloud where absent.
pub fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new(cft_ident_support::ROOT)
        .join("../shared/data")
        .join(file);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is absent", path.display());
    None
}

/// A file of `fixtures/logs`.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(cft_ident_support::ROOT)
        .join("fixtures/logs")
        .join(name)
}

/// Whether a text holds all of these words.
#[track_caller]
pub fn says(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

/// Numbers of every size that a log may hold.
pub fn finite() -> impl Strategy<Value = f64> {
    let finite = any::<u64>().prop_map(f64::from_bits);
    let finite = finite.prop_filter("finite", |value| value.is_finite());
    finite.prop_map(|value| match value.abs() > 1e30 {
        true => 1.0 / value,
        false => value,
    })
}

/// Reads a whole log into one block.
#[track_caller]
pub fn read(spec: &str, layout: &Layout) -> (Block, Reader) {
    let mut reader = Reader::open(&spec.parse::<LogSpec>().unwrap(), layout).unwrap();
    let (mut block, mut all) = (Block::default(), Block::default());
    while reader.read(&mut block).unwrap() {
        assert!(block.len() <= Block::ROWS);
        if all.is_empty() {
            all.line0 = block.line0;
        }
        all.t.extend(&block.t);
        all.q.extend(&block.q);
        all.tau.extend(&block.tau);
        all.dq.extend(&block.dq);
    }
    (all, reader)
}
