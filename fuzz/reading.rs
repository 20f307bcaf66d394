//! Reads bytes as a log, to its end or its first error.

use std::path::PathBuf;
use std::sync::OnceLock;

use cft_ident::log::{Block, Layout, LogSpec, Reader};

/// Writes the bytes to a file of this process and reads it.
pub fn read(target: &str, bytes: &[u8], span: &str, layout: &Layout) {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    let path = PATH.get_or_init(|| {
        let folder = PathBuf::from("/dev/shm");
        let folder = if folder.is_dir() { folder } else { std::env::temp_dir() };
        folder.join(format!("cft-ident-fuzz-{target}-{}", std::process::id()))
    });
    std::fs::write(path, bytes).expect("the temporary file can be written");
    let spec: LogSpec = format!("{}{span}", path.display()).parse().expect("the span is right");
    let Ok(mut reader) = Reader::open(&spec, layout) else {
        return;
    };
    let (mut block, mut last) = (Block::default(), f64::NEG_INFINITY);
    while let Ok(true) = reader.read(&mut block) {
        for t in &block.t {
            assert!(*t > last, "times increase");
            last = *t;
        }
        let mut numbers = block.q.iter().chain(&block.tau).chain(&block.dq);
        assert!(numbers.all(|value| value.is_finite()), "numbers are finite");
    }
    reader.warnings();
}
