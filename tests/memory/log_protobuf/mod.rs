//! Recordings in protobuf whose definitions and messages are damaged or made to do harm: read or
//! refused, soon and within bounded memory.
//!
//! The crate prost-reflect 0.16.5 was tried on the same 10 000 mutations: of 234 it ended in a panic
//! (an index into the places of a definition that it refuses) or overflowed the stack (a file that
//! imports itself publicly). One of each is kept under `fuzz/seeds/mcap`.

use crate::memory;
mod mutations;

use std::borrow::Cow;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use cft_ident::log::{Block, Layout, LogError, LogSpec, Reader};
use mcap::{Channel, Message, MessageStream, Schema, WriteOptions};

const ROOT: &str = cft_ident_support::ROOT;

/// The definition and the first messages of the recording of the fixtures.
fn recorded() -> (Vec<u8>, Vec<Vec<u8>>) {
    let file = std::fs::read(Path::new(ROOT).join("fixtures/logs/protobuf.mcap")).unwrap();
    let messages: Vec<Message> = MessageStream::new(&file)
        .unwrap()
        .take(3)
        .map(Result::unwrap)
        .collect();
    let set = messages[0].channel.schema.as_ref().unwrap().data.to_vec();
    (set, messages.iter().map(|m| m.data.to_vec()).collect())
}

/// A recording of messages `lab.Arm`, neither compressed nor in chunks.
fn recording(set: &[u8], messages: &[Vec<u8>]) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let options = WriteOptions::new().compression(None).use_chunks(false);
    let mut writer = options.create(&mut out).unwrap();
    let channel = Arc::new(Channel {
        id: 1,
        topic: "/arm".to_owned(),
        schema: Some(Arc::new(Schema {
            id: 1,
            name: "lab.Arm".to_owned(),
            encoding: "protobuf".to_owned(),
            data: Cow::Owned(set.to_vec()),
        })),
        message_encoding: "protobuf".to_owned(),
        metadata: Default::default(),
    });
    for (index, data) in messages.iter().enumerate() {
        let message = Message {
            channel: channel.clone(),
            sequence: 0,
            log_time: index as u64,
            publish_time: index as u64,
            data: Cow::Borrowed(data),
        };
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

fn layout() -> Layout {
    let mut layout = Layout::joint_columns(&["q1", "q2", "q4", "q5"]);
    for (index, joint) in ["q1", "q2", "q4", "q5"].iter().enumerate() {
        layout.positions[index].column = format!("joints[name={joint}].q");
        layout.velocities[index].column = format!("speeds[{index}]");
        layout.torques[index].column = format!("/torques/{index}");
    }
    layout
}

/// Reads a file to its end or its first error; its rows.
fn read(path: &Path) -> Result<usize, LogError> {
    let mut reader = Reader::open(&LogSpec::whole(path), &layout())?;
    let (mut block, mut rows) = (Block::default(), 0);
    while reader.read(&mut block)? {
        rows += block.len();
    }
    Ok(rows)
}

#[test]
fn recordings_that_harm_another_decoder_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["imports-itself", "unknown-syntax"] {
        let seed = Path::new(ROOT).join("fuzz/seeds/mcap").join(name);
        // the first byte chooses how the fuzz target reads the rest
        let bytes = std::fs::read(seed).unwrap();
        let path = folder.path().join("seed.mcap");
        std::fs::write(&path, &bytes[1..]).unwrap();
        assert_eq!(read(&path).unwrap(), 3, "{name}");
    }
}

/// Mutations that are tried; `PROTOBUF_MUTATIONS` in the environment asks for more.
#[test]
fn no_mutation_of_a_recording_panics_or_takes_seconds_or_memory() {
    let _one = memory::ONE.lock().unwrap_or_else(|e| e.into_inner());
    let asked = std::env::var("PROTOBUF_MUTATIONS").ok();
    let count: u64 = asked.and_then(|n| n.parse().ok()).unwrap_or(500);
    let (set, messages) = recorded();
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("mutated.mcap");
    let (mut whole, mut slowest, mut largest) = (0, Duration::ZERO, 0);
    for seed in 0..count {
        let mut messages = messages.clone();
        let (set, first) = mutations::mutated(seed, &set, &messages[0]);
        messages[0] = first;
        std::fs::write(&path, recording(&set, &messages)).unwrap();
        let start = Instant::now();
        let (outcome, most) = memory::most_while(|| std::panic::catch_unwind(|| read(&path)));
        let outcome = outcome.unwrap_or_else(|_| panic!("mutation {seed} panics"));
        if let Err(error) = &outcome {
            let message = error.to_string();
            assert!(
                !message.chars().any(char::is_control),
                "{seed}: {message:?}"
            );
            assert!(message.len() < 2000, "{seed}: {message}");
        }
        whole += u64::from(outcome.is_ok_and(|rows| rows == 3));
        slowest = slowest.max(start.elapsed());
        largest = largest.max(most);
        assert!(slowest < Duration::from_secs(2), "{seed}: {slowest:?}");
        assert!(most < 64 << 20, "{seed}: {most} bytes");
    }
    eprintln!("{whole} of {count} are read whole; at most {slowest:?} and {largest} bytes");
    assert!(whole > count / 10 && whole < count, "{whole} of {count}");
}
