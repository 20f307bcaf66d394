//! Files that lie about themselves, and files of random bytes: refused or read, within bounded memory.

use std::path::{Path, PathBuf};

use crate::memory::{ONE, most_while};
use cft_ident::log::{Block, Layout, LogError, LogSpec, Reader};
use proptest::prelude::*;

fn layout() -> Layout {
    Layout::joint_columns(&["q1", "q2", "q4", "q5"])
}

/// Reads a file to its end or its first error; rows, and bytes that were allocated at most.
fn read(path: &Path, layout: &Layout) -> (Result<usize, LogError>, usize) {
    let read = |mut reader: Reader| {
        let mut block = Block::default();
        let (mut rows, mut last) = (0, f64::NEG_INFINITY);
        while reader.read(&mut block)? {
            rows += block.len();
            for t in &block.t {
                assert!(*t > last);
                last = *t;
            }
            let numbers = block.q.iter().chain(&block.tau);
            assert!(numbers.into_iter().all(|value| value.is_finite()));
            // velocities that a log does not know are no numbers
            assert!(block.dq.iter().all(|value| !value.is_infinite()));
        }
        reader.warnings();
        Ok(rows)
    };
    most_while(|| Reader::open(&LogSpec::whole(path), layout).and_then(read))
}

fn file(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn fixture(name: &str) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/logs");
    std::fs::read(Path::new(folder).join(name)).unwrap()
}

/// An MCAP record.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    let mut out = vec![opcode];
    out.extend((body.len() as u64).to_le_bytes());
    out.extend(body);
    out
}

fn text(text: &str) -> Vec<u8> {
    let mut out = (text.len() as u32).to_le_bytes().to_vec();
    out.extend(text.as_bytes());
    out
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Header, schema and channel of a joint state topic.
fn beginning() -> Vec<u8> {
    let header = [text("ros2"), text("")].concat();
    let schema = [
        1u16.to_le_bytes().to_vec(),
        text("sensor_msgs/msg/JointState"),
        text("ros2msg"),
        text(""),
    ];
    let channel = [
        1u16.to_le_bytes().to_vec(),
        1u16.to_le_bytes().to_vec(),
        text("/joint_states"),
        text("cdr"),
        0u32.to_le_bytes().to_vec(),
    ];
    [
        MAGIC.to_vec(),
        record(1, &header),
        record(3, &schema.concat()),
        record(4, &channel.concat()),
    ]
    .concat()
}

fn chunk(compression: &str, uncompressed: u64, compressed: u64, records: &[u8]) -> Vec<u8> {
    let body = [
        0u64.to_le_bytes().to_vec(),
        0u64.to_le_bytes().to_vec(),
        uncompressed.to_le_bytes().to_vec(),
        0u32.to_le_bytes().to_vec(),
        text(compression),
        compressed.to_le_bytes().to_vec(),
        records.to_vec(),
    ];
    record(6, &body.concat())
}

fn message(data: &[u8]) -> Vec<u8> {
    let body = [
        1u16.to_le_bytes().to_vec(),
        0u32.to_le_bytes().to_vec(),
        5u64.to_le_bytes().to_vec(),
        5u64.to_le_bytes().to_vec(),
        data.to_vec(),
    ];
    record(5, &body.concat())
}

#[test]
fn a_small_file_that_declares_gigabytes_is_read_within_its_own_size() {
    let _one = ONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let four_gb = 4u64 << 30;
    let lie = |opcode: u8| [&[opcode][..], &four_gb.to_le_bytes(), &[0; 40]].concat();
    // A joint state whose array of positions says that it has 4e9 elements.
    let mut cdr = vec![0, 1, 0, 0];
    cdr.extend([0; 12]);
    cdr.extend(1u32.to_le_bytes());
    cdr.extend(3u32.to_le_bytes());
    cdr.extend(b"q1\0\0");
    cdr.extend(u32::MAX.to_le_bytes());
    let zstd = zstd::encode_all(&[7u8; 100_000][..], 3).unwrap();
    let lying_record = lie(5);
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("message", [beginning(), lie(5)].concat()),
        ("schema", [MAGIC.to_vec(), lie(3)].concat()),
        (
            "name of a schema",
            [
                MAGIC.to_vec(),
                record(3, &[&[1, 0][..], &[0xff; 4]].concat()),
            ]
            .concat(),
        ),
        (
            "topic",
            [
                beginning(),
                record(4, &[&[9, 0, 1, 0][..], &[0xff; 4]].concat()),
            ]
            .concat(),
        ),
        ("attachment", [beginning(), lie(9)].concat()),
        (
            "short attachment",
            [beginning(), record(9, &[0; 3])].concat(),
        ),
        ("footer", [beginning(), record(2, &[0; 3])].concat()),
        ("data end", [beginning(), record(15, &[])].concat()),
        ("chunk", [beginning(), lie(6)].concat()),
        (
            "chunk of records that are longer than it",
            [
                beginning(),
                chunk("", 20, lying_record.len() as u64, &lying_record),
                message(&cdr),
            ]
            .concat(),
        ),
        (
            "uncompressed chunk whose record ends behind it",
            [
                beginning(),
                chunk("", 31, 31, &message(&cdr)),
                message(&cdr),
            ]
            .concat(),
        ),
        (
            "zstd chunk that says 4 GB",
            [
                beginning(),
                chunk("zstd", four_gb, zstd.len() as u64, &zstd),
            ]
            .concat(),
        ),
        (
            "lz4 chunk of rubbish",
            [beginning(), chunk("lz4", four_gb, 50, &[9; 50])].concat(),
        ),
        (
            "unknown compression",
            [beginning(), chunk("brotli", 50, 50, &[9; 50])].concat(),
        ),
        ("cdr", [beginning(), message(&cdr), message(&cdr)].concat()),
    ];
    for (name, bytes) in cases {
        let path = file(&folder, "lie.mcap", &bytes);
        let (outcome, most) = read(&path, &layout());
        let message = outcome.expect_err(name).to_string();
        assert!(message.contains("lie.mcap"), "{name}: {message}");
        assert!(
            !message.chars().any(char::is_control),
            "{name}: {message:?}"
        );
        assert!(most < 8 << 20, "{name}: {most} bytes");
    }
}

#[test]
fn a_bomb_of_compressed_text_is_not_kept_in_memory() {
    let _one = ONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    let mut rows = String::from("t,q_q1,q_q2,q_q4,q_q5,tau_q1,tau_q2,tau_q4,tau_q5\n");
    let start = rows.len();
    for row in 0..100_000 {
        rows.push_str(&format!("{row:06},1,1,1,1,1,1,1,1\n"));
    }
    assert!(rows.len() - start > 2_000_000);
    let whole = zstd::encode_all(rows.as_bytes(), 3).unwrap();
    let (outcome, most) = read(&file(&folder, "bomb.csv.zst", &whole), &layout());
    assert_eq!(outcome.unwrap(), 100_000);
    assert!(most < 3 << 20, "{most} bytes");
    // One line of 64 MiB from a few kB.
    let line = [&rows.as_bytes()[..start], &vec![b'1'; 64 << 20]].concat();
    let line = zstd::encode_all(&line[..], 3).unwrap();
    let (outcome, most) = read(&file(&folder, "line.csv.zst", &line), &layout());
    let message = outcome.unwrap_err().to_string();
    assert!(message.contains("longer than"), "{message}");
    assert!(most < 8 << 20, "{most} bytes");
    // A compressed log that is cut off.
    let cut = &whole[..whole.len() / 2];
    let (outcome, _) = read(&file(&folder, "cut.csv.zst", cut), &layout());
    let message = outcome.unwrap_err().to_string();
    assert!(message.contains("cut off"), "{message}");
}

/// Changes some bytes of a file.
fn mutated(name: &'static str) -> impl Strategy<Value = Vec<u8>> {
    let whole = fixture(name);
    let length = whole.len();
    let changes = prop::collection::vec((0..length, any::<u8>()), 0..12);
    (changes, prop_oneof![Just(length), 0..length]).prop_map(move |(changes, end)| {
        let mut bytes = whole.clone();
        for (at, value) in changes {
            bytes[at] = value;
        }
        bytes.truncate(end);
        bytes
    })
}

fn any_file() -> impl Strategy<Value = Vec<u8>> {
    let random = prop::collection::vec(any::<u8>(), 0..300);
    prop_oneof![
        mutated("unindexed.mcap"),
        mutated("big-endian.mcap"),
        mutated("arm.mcap"),
        mutated("shuffled.mcap"),
        mutated("json.mcap"),
        mutated("protobuf.mcap"),
        mutated("arm.db3"),
        mutated("compressed.db3"),
        mutated("arm.csv.gz"),
        mutated("arm.csv.zst"),
        mutated("arm.csv"),
        random.clone().prop_map(|tail| [MAGIC, &tail].concat()),
        random.clone().prop_map(|tail| [beginning(), tail].concat()),
        random.prop_map(|data| [beginning(), message(&data), message(&data)].concat()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_file_makes_the_reader_panic_or_take_more_memory_than_files_need(bytes in any_file()) {
        let _one = ONE.lock().unwrap_or_else(|e| e.into_inner());
        let folder = tempfile::tempdir().unwrap();
        let path = file(&folder, "any", &bytes);
        let mut by_path = layout();
        for (index, channel) in by_path.positions.iter_mut().enumerate() {
            channel.column = format!("joints[{index}].q");
        }
        for (index, channel) in by_path.torques.iter_mut().enumerate() {
            channel.column = format!("/torques/{index}");
        }
        for layout in [layout(), by_path] {
            let (outcome, most) = read(&path, &layout);
            if let Err(error) = outcome {
                let message = error.to_string();
                prop_assert!(!message.chars().any(char::is_control), "{message:?}");
            }
            prop_assert!(most < 64 << 20, "{most} bytes");
        }
    }
}
