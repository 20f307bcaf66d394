//! Speed of reading logs, each beside a plain way that skips every check: text with short and with
//! full-length numbers, recordings of joint states. `cargo bench --bench logs`.
//!
//! On Linux times are those of the processor, so that a busy machine changes them little.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::hint::black_box;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use cft_ident::log::{Block, Layout, LogSpec, Reader};
use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mcap::{Channel, Compression, Message, MessageStream, WriteOptions};
use tempfile::TempDir;

const ROWS: usize = 50_000;
const JOINTS: [&str; 6] = ["q1", "q2", "q3", "q4", "q5", "q6"];

/// Time that this thread was on a processor; the wall clock where the system does not tell.
struct ProcessorTime;

impl ProcessorTime {
    fn now() -> Duration {
        static START: LazyLock<Instant> = LazyLock::new(Instant::now);
        let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
        let first = told.and_then(|text| text.split(' ').next()?.parse().ok());
        first.map_or_else(|| START.elapsed(), Duration::from_nanos)
    }
}

impl Measurement for ProcessorTime {
    type Intermediate = Duration;
    type Value = Duration;

    fn start(&self) -> Duration {
        Self::now()
    }

    fn end(&self, start: Duration) -> Duration {
        Self::now().saturating_sub(start)
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

/// Time, positions and torques of one row.
fn row(k: usize) -> (f64, [f64; 6], [f64; 6]) {
    let channel = |j: usize| (k as f64 * 1e-3 * (j + 1) as f64).sin() * 3.0;
    let q = std::array::from_fn(channel);
    let tau = std::array::from_fn(|j| channel(j + 6) * 40.0);
    (k as f64 * 2e-4, q, tau)
}

/// A text log of 13 columns; numbers with `decimals`, or as many digits as they have.
fn text_log(folder: &TempDir, decimals: Option<usize>) -> PathBuf {
    let path = folder.path().join("log.csv");
    let columns = ["q", "tau"].map(|kind| JOINTS.map(|joint| format!("{kind}_{joint}")).join(","));
    let mut text = format!("t,{}\n", columns.join(","));
    for k in 0..ROWS {
        let (t, q, tau) = row(k);
        text += &format!("{t}");
        for number in q.iter().chain(&tau) {
            let _ = match decimals {
                Some(decimals) => write!(text, ",{number:.decimals$}"),
                None => write!(text, ",{number}"),
            };
        }
        text.push('\n');
    }
    std::fs::write(&path, text).expect("the log is written");
    path
}

/// A joint state in CDR, little endian.
fn joint_state(ns: u64, q: &[f64], tau: &[f64]) -> Vec<u8> {
    let mut out = vec![0, 1, 0, 0];
    let align = |out: &mut Vec<u8>, size: usize| {
        let length = (out.len() - 4).next_multiple_of(size) + 4;
        out.resize(length, 0);
    };
    let whole = |out: &mut Vec<u8>, number: usize| {
        align(out, 4);
        out.extend((number as u32).to_le_bytes());
    };
    whole(&mut out, (ns / 1_000_000_000) as usize);
    whole(&mut out, (ns % 1_000_000_000) as usize);
    let text = |out: &mut Vec<u8>, text: &str| {
        whole(out, text.len() + 1);
        out.extend(text.as_bytes());
        out.push(0);
    };
    text(&mut out, "base");
    whole(&mut out, JOINTS.len());
    for joint in JOINTS {
        text(&mut out, joint);
    }
    for numbers in [q, &[][..], tau] {
        whole(&mut out, numbers.len());
        for number in numbers {
            align(&mut out, 8);
            out.extend(number.to_le_bytes());
        }
    }
    out
}

/// A recording of joint states at 5 kHz.
fn recording(folder: &TempDir, compression: Option<Compression>) -> PathBuf {
    let path = folder.path().join("log.mcap");
    let file = BufWriter::new(File::create(&path).expect("the log is made"));
    let mut writer = WriteOptions::new()
        .compression(compression)
        .profile("ros2")
        .create(file)
        .expect("the recording begins");
    let channel = Arc::new(Channel {
        id: 1,
        topic: "/joint_states".to_owned(),
        schema: Some(Arc::new(mcap::Schema {
            id: 1,
            name: "sensor_msgs/msg/JointState".to_owned(),
            encoding: "ros2msg".to_owned(),
            data: Cow::Borrowed(b""),
        })),
        message_encoding: "cdr".to_owned(),
        metadata: BTreeMap::new(),
    });
    for k in 0..ROWS {
        let (_, q, tau) = row(k);
        let ns = 1_700_000_000_000_000_000 + k as u64 * 200_000;
        let message = Message {
            channel: channel.clone(),
            sequence: k as u32,
            log_time: ns,
            publish_time: ns,
            data: Cow::Owned(joint_state(ns, &q, &tau)),
        };
        writer.write(&message).expect("a message is written");
    }
    writer.finish().expect("the recording ends");
    writer.into_inner().flush().expect("the recording is whole");
    path
}

/// Reads a log that nobody holds: who holds one goes along the rows that were read before.
fn read(path: &Path, layout: &Layout, block: &mut Block) {
    let mut reader = Reader::open(&LogSpec::whole(path), layout).expect("the log opens");
    let mut rows = 0;
    while reader.read(block).expect("the log is whole") {
        rows += block.len();
    }
    assert_eq!(rows, ROWS);
}

fn throughput(file: &Path) -> Throughput {
    let length = std::fs::metadata(file).expect("the log is there").len();
    Throughput::ElementsAndBytes {
        elements: ROWS as u64,
        bytes: length,
    }
}

fn text(c: &mut Criterion<ProcessorTime>) {
    let layout = Layout::joint_columns(&JOINTS);
    for (name, decimals) in [
        ("text of 13 columns, 7 decimals", Some(7)),
        ("text of 13 columns, 17 digits", None),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = text_log(&folder, decimals);
        let mut group = c.benchmark_group(name);
        group.throughput(throughput(&path)).sample_size(20);
        let mut block = Block::default();
        group.bench_function("reader", |b| b.iter(|| read(&path, &layout, &mut block)));
        group.bench_function("plain: lines, split, parse", |b| {
            b.iter(|| {
                let text = std::fs::read_to_string(&path).expect("the file is there");
                let sum: f64 = text
                    .lines()
                    .skip(1)
                    .flat_map(|l| l.split(','))
                    .map(|x| x.parse::<f64>().expect("a number"))
                    .sum();
                black_box(sum)
            });
        });
        group.finish();
    }
}

/// Numbers of the three arrays of a joint state whose names all have two letters: no check, no
/// search, no definition.
fn plain_joint_state(data: &[u8], sum: &mut f64) {
    let frame = 4 + 8 + 4 + 5_usize;
    let mut at = frame.next_multiple_of(4) + 4 + JOINTS.len() * 8;
    for _ in 0..3 {
        let count = data[at..at + 4]
            .first_chunk()
            .map(|n| u32::from_le_bytes(*n));
        at += 4;
        for _ in 0..count.unwrap_or(0) {
            at = (at - 4).next_multiple_of(8) + 4;
            let number = data[at..at + 8]
                .first_chunk()
                .map(|n| f64::from_le_bytes(*n));
            *sum += number.unwrap_or(0.0);
            at += 8;
        }
    }
}

fn messages(c: &mut Criterion<ProcessorTime>) {
    let layout = Layout::joint_columns(&JOINTS);
    for (name, compression) in [
        ("recording of joint states, lz4", Some(Compression::Lz4)),
        ("recording of joint states, zstd", Some(Compression::Zstd)),
        ("recording of joint states, not compressed", None),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = recording(&folder, compression);
        let mut group = c.benchmark_group(name);
        group.throughput(throughput(&path)).sample_size(20);
        let mut block = Block::default();
        group.bench_function("reader", |b| b.iter(|| read(&path, &layout, &mut block)));
        group.bench_function("plain: the crate's messages, fields at fixed places", |b| {
            b.iter(|| {
                let bytes = std::fs::read(&path).expect("the file is there");
                let mut sum = 0.0;
                for message in MessageStream::new(&bytes).expect("a recording") {
                    plain_joint_state(&message.expect("a message").data, &mut sum);
                }
                black_box(sum)
            });
        });
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(ProcessorTime);
    targets = text, messages
}
criterion_main!(benches);
