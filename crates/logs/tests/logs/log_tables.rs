//! Arrays and Parquet files, as numpy and pyarrow write them (fixtures/tables/make.py) and as they are drawn here.

use std::io::Write;
use std::path::{Path, PathBuf};

use cft_ident_logs::log::{Block, Channel, Layout, LogSpec, RawReader, Reader};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::log_drawn::{Motion, ROWS, drawn, mapped, names, read, same, shown};

fn fixture(name: &str) -> PathBuf {
    let folder = Path::new(cft_ident_support::ROOT).join("fixtures/tables");
    folder.join(name)
}

fn layout(positions: [&str; 3], torques: [&str; 3], time: &str) -> Layout {
    let mut layout = Layout::joint_columns(&["a", "b", "c"]);
    let named = |channels: &mut Vec<Channel>, columns: [&str; 3]| {
        for (channel, column) in channels.iter_mut().zip(columns) {
            column.clone_into(&mut channel.column);
        }
    };
    named(&mut layout.positions, positions);
    named(&mut layout.torques, torques);
    layout.velocities.clear();
    in_time(layout, time)
}

/// The layout with times of this column, which may be in nanoseconds.
fn in_time(mut layout: Layout, column: &str) -> Layout {
    column.clone_into(&mut layout.time.column);
    if column.ends_with("[ns]") {
        "ns".clone_into(&mut layout.time.unit);
        layout.time.factor = 1e-9;
    }
    layout
}

#[track_caller]
fn holds_all(path: &Path, layout: &Layout) -> (Block, Reader) {
    let mut reader = Reader::open(&LogSpec::whole(path), layout).unwrap();
    let (mut block, mut all) = (Block::default(), Block::default());
    while reader.read(&mut block).unwrap() {
        all.t.extend(&block.t);
        all.q.extend(&block.q);
        all.tau.extend(&block.tau);
    }
    assert_eq!(all.t.len(), 60);
    for k in 0..60 {
        for j in 0..3 {
            let at = 3 * k + j;
            let (k, j) = (k as f64, j as f64);
            assert_eq!(all.q[at], k / 64.0 + j, "{}, row {k}", path.display());
            assert_eq!(all.tau[at], j - k / 32.0, "{}, row {k}", path.display());
        }
    }
    (all, reader)
}

const Q: [&str; 3] = ["q_0", "q_1", "q_2"];
const TAU: [&str; 3] = ["tau_0", "tau_1", "tau_2"];

#[test]
fn arrays_that_numpy_wrote_are_read_whichever_way_they_lie() {
    let (plain, reader) = holds_all(&fixture("arrays.npz"), &layout(Q, TAU, "t"));
    assert!((plain.t[59] - 0.59).abs() < 1e-12);
    let shown = reader.warnings().join("\n");
    assert!(
        shown.contains("array `fs` is left out") && shown.contains("array `names`"),
        "{shown}"
    );
    holds_all(&fixture("turned.npz"), &layout(Q, TAU, "time"));
    holds_all(&fixture("records.npy"), &layout(Q, TAU, "t"));
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_files_that_pyarrow_wrote_and_a_dataset_of_episodes_are_read() {
    holds_all(&fixture("flat.parquet"), &layout(Q, TAU, "t"));
    let (_, reader) = holds_all(&fixture("stamped.parquet"), &layout(Q, TAU, "t [ns]"));
    assert!(reader.warnings().join("\n").contains("left out: note"));
    let names = |kind: &str, tail: &str| {
        ["a", "b", "c"].map(|joint| format!("observation.{kind}.{joint}{tail}"))
    };
    let (q, tau) = (names("state", ".pos"), names("effort", ""));
    let [q, tau] = [&q, &tau].map(|all| [&*all[0], &*all[1], &*all[2]]);
    let (rows, _) = holds_all(&fixture("dataset"), &layout(q, tau, "time"));
    let step = |k: usize| rows.t[k + 1] - rows.t[k];
    assert!((step(28) - 0.01).abs() < 1e-9 && (step(29) - 10.0).abs() < 1e-9);
}

/// Bytes of an array: its head, then its numbers.
fn npy(described: &str, by_columns: bool, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let order = if by_columns { "True" } else { "False" };
    let mut head =
        format!("{{'descr': {described}, 'fortran_order': {order}, 'shape': {shape}, }}");
    while (head.len() + 11) % 64 != 0 {
        head.push(' ');
    }
    head.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((head.len() as u16).to_le_bytes());
    out.extend(head.as_bytes());
    out.extend(numbers);
    out
}

/// A zip archive of these files.
fn archive(files: &[(String, Vec<u8>)], packed: bool) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, data) in files {
        let mut sum = flate2::Crc::new();
        sum.update(data);
        let body = match packed {
            false => data.clone(),
            true => {
                let mut encoder =
                    flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::fast());
                encoder.write_all(data).unwrap();
                encoder.finish().unwrap()
            }
        };
        let mut about = vec![20, 0, 0, 0];
        about.extend((if packed { 8_u16 } else { 0 }).to_le_bytes());
        about.extend([0; 4]);
        about.extend(sum.sum().to_le_bytes());
        about.extend((body.len() as u32).to_le_bytes());
        about.extend((data.len() as u32).to_le_bytes());
        about.extend((name.len() as u16).to_le_bytes());
        about.extend([0, 0]);
        let begins = out.len() as u32;
        out.extend(b"PK\x03\x04");
        out.extend(&about);
        out.extend(name.as_bytes());
        out.extend(&body);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&about);
        directory.extend([0; 10]);
        directory.extend(begins.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let begins = out.len() as u32;
    out.extend(&directory);
    out.extend(b"PK\x05\x06\x00\x00\x00\x00");
    out.extend([(files.len() as u16).to_le_bytes(); 2].concat());
    out.extend((directory.len() as u32).to_le_bytes());
    out.extend(begins.to_le_bytes());
    out.extend([0, 0]);
    out
}

/// Numbers as they lie in an array of doubles.
fn doubles(numbers: impl Iterator<Item = f64>, big_endian: bool) -> Vec<u8> {
    let bytes = |x: f64| {
        if big_endian {
            x.to_be_bytes()
        } else {
            x.to_le_bytes()
        }
    };
    numbers.flat_map(bytes).collect()
}

/// The arrays of a motion.
fn arrays(rng: &mut ChaCha8Rng, motion: &Motion) -> Vec<(String, Vec<u8>)> {
    let big_endian = rng.random_bool(0.3);
    let float = if big_endian { "'>f8'" } else { "'<f8'" };
    let mut out: Vec<(String, Vec<u8>)> = Vec::new();
    let (time, described, numbers): (_, _, Vec<u8>) = match rng.random_range(0..4) {
        0 => ("t", float, doubles(motion.t.iter().copied(), big_endian)),
        1 => {
            let ms = motion.t.iter().map(|t| (t * 1e3).round() as i64);
            ("time_ms", "'<i8'", ms.flat_map(i64::to_le_bytes).collect())
        }
        2 => {
            let ns = motion
                .t
                .iter()
                .map(|t| 1_750_000_000_000_000_000 + (t * 1e9).round() as i64);
            (
                "stamp",
                "'<M8[ns]'",
                ns.flat_map(i64::to_le_bytes).collect(),
            )
        }
        _ => ("time", float, doubles(motion.t.iter().copied(), big_endian)),
    };
    let rows = format!("({ROWS},)");
    out.push((
        format!("{time}.npy"),
        npy(described, false, &rows, &numbers),
    ));
    let style = rng.random_range(0..6);
    if style < 5 {
        // a column for each joint
        let (q, tau, scale) = names(style);
        for j in 0..3 {
            let q_j = doubles(motion.q.iter().map(|q| q[j] * scale[j]), big_endian);
            let tau_j = doubles(motion.tau.iter().map(|tau| tau[j]), big_endian);
            out.push((format!("{}.npy", q[j]), npy(float, false, &rows, &q_j)));
            out.push((format!("{}.npy", tau[j]), npy(float, false, &rows, &tau_j)));
        }
    } else {
        for (name, numbers) in [("q", &motion.q), ("tau", &motion.tau)] {
            let by_rows = || doubles(numbers.iter().flatten().copied(), big_endian);
            let by_columns = || {
                doubles(
                    (0..3).flat_map(|j| numbers.iter().map(move |x| x[j])),
                    big_endian,
                )
            };
            let array = match rng.random_range(0..4) {
                0 => npy(float, false, &format!("({ROWS}, 3)"), &by_rows()),
                1 => npy(float, true, &format!("({ROWS}, 3)"), &by_columns()),
                2 => npy(float, false, &format!("(3, {ROWS})"), &by_columns()),
                _ => npy(float, false, &format!("({ROWS}, 3, 1)"), &by_rows()),
            };
            out.push((format!("{name}.npy"), array));
        }
    }
    if rng.random_bool(0.5) {
        out.insert(
            0,
            (
                "fs.npy".to_owned(),
                npy("'<f8'", false, "()", &100_f64.to_le_bytes()),
            ),
        );
        out.push((
            "note.npy".to_owned(),
            npy("'<U1'", false, "(1,)", &[65, 0, 0, 0]),
        ));
    }
    out
}

#[test]
fn drawn_archives_of_arrays_are_read_exactly_and_cut_ones_are_refused() {
    for seed in 3000..3000 + drawn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.npz");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let motion = Motion::drawn(&mut rng);
        let files = arrays(&mut rng, &motion);
        let bytes = archive(&files, rng.random_bool(0.5));
        std::fs::write(&path, &bytes).unwrap();
        same(&read(&path, &mapped(&path)).unwrap(), &motion, seed);
        std::fs::write(
            &path,
            &bytes[..bytes.len() - rng.random_range(10..bytes.len() / 2)],
        )
        .unwrap();
        let error = RawReader::open(&LogSpec::whole(&path), None)
            .unwrap_err()
            .to_string();
        assert!(error.contains("cut off"), "seed {seed}: {error}");
    }
    shown("archives of numpy", 0);
}

/// Rows as JSON objects, flat, with lists or nested, a line each or in one list.
fn objects(rng: &mut ChaCha8Rng, motion: &Motion) -> String {
    let (q, tau, scale) = names(rng.random_range(0..5));
    let shape = rng.random_range(0..3);
    let row = |k: usize| {
        let t = motion.t[k];
        let pairs = |names: &[String; 3], x: [f64; 3]| -> String {
            let all = names
                .iter()
                .zip(x)
                .map(|(name, x)| format!("\"{name}\": {x}"));
            all.collect::<Vec<_>>().join(", ")
        };
        let scaled: [f64; 3] = std::array::from_fn(|j| motion.q[k][j] * scale[j]);
        match shape {
            0 => format!(
                "{{\"t\": {t}, {}, {}, \"spare\": NaN}}",
                pairs(&q, scaled),
                pairs(&tau, motion.tau[k])
            ),
            1 => format!(
                "{{\"tau\": {:?}, \"t\": {t}, \"q\": {:?}}}",
                motion.tau[k], motion.q[k]
            ),
            _ => format!(
                "{{\"time\": {t}, \"arm\": {{\"q\": {:?}, \"tau\": {:?}}}}}",
                motion.q[k], motion.tau[k]
            ),
        }
    };
    let rows: Vec<String> = (0..ROWS).map(row).collect();
    match rng.random_bool(0.5) {
        true => format!("[{}]\n", rows.join(",\n ")),
        false => rows.join("\n"),
    }
}

#[test]
fn drawn_objects_of_json_are_read_exactly() {
    for seed in 4000..4000 + drawn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.jsonl");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let motion = Motion::drawn(&mut rng);
        std::fs::write(&path, objects(&mut rng, &motion)).unwrap();
        same(&read(&path, &mapped(&path)).unwrap(), &motion, seed);
    }
    shown("objects of JSON", 0);
}

#[cfg(feature = "parquet")]
#[test]
fn drawn_tables_of_parquet_are_read_exactly() {
    use cft_ident_logs::log::Instant;
    use cft_ident_logs::output::LogWriter;
    for seed in 5000..5000 + drawn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.parquet");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let motion = Motion::drawn(&mut rng);
        let (q, tau, scale) = names(rng.random_range(0..5));
        let time = ["t", "time", "Time [s]"][rng.random_range(0..3)];
        let columns: Vec<&str> = std::iter::once(time)
            .chain(q.iter().chain(&tau).map(String::as_str))
            .collect();
        let mut log = LogWriter::with_notes(&path, &columns, &[]).unwrap();
        log.set_origin(Instant::from_ns(
            [0_i64, 1_750_000_000_123_456_789][rng.random_range(0..2)],
        ));
        for k in 0..ROWS {
            let q = (0..3).map(|j| motion.q[k][j] * scale[j]);
            let values = std::iter::once(motion.t[k]).chain(q);
            log.row(values.chain(motion.tau[k])).unwrap();
        }
        log.commit().unwrap();
        same(&read(&path, &mapped(&path)).unwrap(), &motion, seed);
    }
    shown("tables of Parquet", 0);
}

/// Reads all rows of a file that may be damaged: an error is an answer.
fn tried(path: &Path) -> usize {
    let Ok(mut log) = RawReader::open(&LogSpec::whole(path), None) else {
        return 0;
    };
    let (mut block, mut rows) = (Default::default(), 0);
    while let Ok(true) = log.read(&mut block) {
        rows += block.t.len();
    }
    rows
}

#[test]
fn a_damaged_table_is_an_error_or_fewer_rows_and_never_a_panic() {
    let mut all = vec!["arrays.npz", "turned.npz", "records.npy"];
    if cfg!(feature = "parquet") {
        all.extend(["flat.parquet", "stamped.parquet"]);
    }
    let folder = tempfile::tempdir().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for name in all {
        let bytes = std::fs::read(fixture(name)).unwrap();
        let path = folder.path().join(name);
        for _ in 0..150 {
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..damaged.len());
                damaged[at] = rng.random();
            }
            if rng.random_bool(0.3) {
                damaged.truncate(rng.random_range(0..damaged.len()));
            }
            std::fs::write(&path, &damaged).unwrap();
            assert!(tried(&path) <= 1 << 20, "{name}");
        }
    }
}

#[cfg(feature = "parquet")]
#[test]
fn what_is_written_as_parquet_is_read_back_bit_for_bit() {
    use cft_ident_logs::log::Instant;
    use cft_ident_logs::output::LogWriter;
    let folder = tempfile::tempdir().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let motion = Motion::drawn(&mut rng);
    for (name, origin) in [("near", 0), ("far", 1_750_000_000_123_456_789_i64)] {
        let path = folder.path().join(name).with_extension("parquet");
        let (q, tau, _) = names(0);
        let columns: Vec<&str> = std::iter::once("t")
            .chain(q.iter().chain(&tau).map(String::as_str))
            .collect();
        let notes = ["a note".to_owned()];
        let mut log = LogWriter::with_notes(&path, &columns, &notes).unwrap();
        log.set_origin(Instant::from_ns(origin));
        for k in 0..ROWS {
            let values = motion.q[k].iter().chain(&motion.tau[k]);
            log.row(std::iter::once(motion.t[k]).chain(values.copied()))
                .unwrap();
        }
        log.commit().unwrap();
        let mut layout = Layout::joint_columns(&crate::log_drawn::JOINTS);
        layout.velocities.clear();
        let layout = in_time(layout, if origin == 0 { "t" } else { "t [ns]" });
        same(&read(&path, &layout).unwrap(), &motion, 11);
    }
}
