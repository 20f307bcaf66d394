//! What an interrupted run leaves behind. One test in a process of its own: afterwards no file can be begun.

use std::io::Write;

use cft_ident::output::{AtomicFile, remove_unfinished};

#[test]
fn an_interruption_removes_what_is_not_finished_and_keeps_what_is() {
    let folder = tempfile::tempdir().unwrap();
    let mut finished = AtomicFile::create(&folder.path().join("a.csv")).unwrap();
    finished.write_all(b"whole").unwrap();
    finished.commit().unwrap();
    let mut half = AtomicFile::create(&folder.path().join("b.csv")).unwrap();
    half.write_all(b"half").unwrap();
    remove_unfinished();
    let entries = std::fs::read_dir(folder.path()).unwrap();
    let names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["a.csv"]);
    // As when the process ends: the unfinished file is never dropped.
    std::mem::forget(half);
}
