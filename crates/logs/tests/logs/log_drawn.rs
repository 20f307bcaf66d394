//! Logs drawn by chance over containers, clocks, names, what surrounds the table, and faults: each is read exactly,
//! or refused with a remedy that does it.

use crate::log_support;

use std::io::Write;
use std::path::{Path, PathBuf};

use cft_ident_core::robot::JointKind;
use cft_ident_logs::log::{Block, Layout, LogError, LogSpec, Reader};
use cft_ident_logs::mapping::{ClockSource, LogHints, Mapping, UrdfJoint, look};
use log_support::recording::{JointState, Recording};
use mcap::WriteOptions;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub(crate) const JOINTS: [&str; 3] = ["base_turn", "joint_2", "Z"];
pub(crate) const ROWS: usize = 400;
/// Logs that are drawn of each kind; `DRAWN_LOGS` says another number.
pub(crate) fn drawn() -> u64 {
    let asked = std::env::var("DRAWN_LOGS").ok();
    asked.and_then(|number| number.parse().ok()).unwrap_or(24)
}

/// Says how many logs of a kind were read at once, and how many by the remedy of the message that refused them.
pub(crate) fn shown(kind: &str, cured: u64) {
    let (logs, read) = (drawn(), drawn() - cured);
    println!(
        "drawn: {{\"logs\": \"{kind}\", \"drawn\": {logs}, \"read exactly\": {read}, \"refused, and read by the remedy\": {cured}}}"
    );
}

/// What a log holds.
pub(crate) struct Motion {
    pub(crate) t: Vec<f64>,
    pub(crate) q: Vec<[f64; 3]>,
    pub(crate) tau: Vec<[f64; 3]>,
}

impl Motion {
    pub(crate) fn drawn(rng: &mut ChaCha8Rng) -> Self {
        let w: [f64; 3] = std::array::from_fn(|_| rng.random_range(1.0..3.0));
        let t: Vec<f64> = (0..ROWS).map(|k| k as f64 / 100.0).collect();
        let q = t.iter().map(|t| w.map(|w| (w * t).sin()));
        let tau = t.iter().map(|t| w.map(|w| 5.0 * (w * t).cos() + 0.01));
        Self {
            q: q.collect(),
            tau: tau.collect(),
            t,
        }
    }
}

fn known() -> Vec<UrdfJoint> {
    let kind = |name: &str| match name {
        "Z" => JointKind::Prismatic,
        _ => JointKind::Revolute,
    };
    let one = |name: &str| UrdfJoint {
        name: name.to_owned(),
        kind: kind(name),
        torque: None,
        position: None,
    };
    JOINTS.map(one).to_vec()
}

/// The layout that a look at the log gives.
pub(crate) fn mapped(path: &Path) -> Layout {
    let spec = LogSpec::whole(path);
    let asked = LogHints::default();
    let seen = look(&spec, &asked, Some(3), &|| false).unwrap();
    let mapping = Mapping::of(Some(&known()), Some(&seen));
    let mut layout = Layout::joint_columns(&JOINTS);
    layout.time.unit = String::new();
    layout.section.time_unit = None;
    match &seen.clock {
        ClockSource::Column { name, seconds, .. } => {
            layout.time.column.clone_from(name);
            layout.time.factor = *seconds;
        }
        ClockSource::Rate { hz, .. } => layout.section.rate_hz = Some(*hz),
        ClockSource::Messages => {}
    }
    for (k, joint) in mapping.joints.iter().enumerate() {
        if seen.is_recording() {
            continue;
        }
        let named = |column: &Option<String>| match column {
            Some(column) => column.clone(),
            None => panic!("{}: {:?}", joint.joint, seen.columns),
        };
        layout.positions[k].column = named(&joint.position);
        layout.torques[k].column = named(&joint.torque);
        layout.positions[k].factor = match joint.position_unit {
            Some("deg") => std::f64::consts::PI / 180.0,
            Some("mm") => 1e-3,
            _ => 1.0,
        };
    }
    layout.velocities.clear();
    layout
}

pub(crate) fn read(path: &Path, layout: &Layout) -> Result<Block, LogError> {
    let mut reader = Reader::open(&LogSpec::whole(path), layout)?;
    let (mut block, mut all) = (Block::default(), Block::default());
    while reader.read(&mut block)? {
        all.t.extend(&block.t);
        all.q.extend(&block.q);
        all.tau.extend(&block.tau);
    }
    Ok(all)
}

#[track_caller]
pub(crate) fn same(found: &Block, motion: &Motion, seed: u64) {
    let flat = |rows: &[[f64; 3]]| rows.concat();
    assert_eq!(found.t.len(), ROWS, "seed {seed}");
    assert_eq!(found.tau, flat(&motion.tau), "seed {seed}");
    let off = found
        .q
        .iter()
        .zip(flat(&motion.q))
        .map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 1e-12, "seed {seed}");
    let steps = found.t.windows(2).map(|p| (p[1] - p[0] - 0.01).abs());
    assert!(steps.fold(0.0, f64::max) < 1e-7, "seed {seed}");
}

/// Names of the positions and torques, and what the positions are multiplied with.
pub(crate) fn names(style: u32) -> ([String; 3], [String; 3], [f64; 3]) {
    let each = |of: &dyn Fn(usize) -> String| std::array::from_fn(of);
    let degrees = 180.0 / std::f64::consts::PI;
    match style {
        0 => (
            each(&|k| format!("q_{}", JOINTS[k])),
            each(&|k| format!("tau_{}", JOINTS[k])),
            [1.0; 3],
        ),
        1 => (
            each(&|k| format!("Position_A{}", k + 1)),
            each(&|k| format!("Torque_A{}", k + 1)),
            [1.0; 3],
        ),
        2 => (
            each(&|k| format!("qpos_{k}")),
            each(&|k| format!("qfrc_actuator_{k}")),
            [1.0; 3],
        ),
        3 => (
            each(&|k| format!("{}_pos_{}", JOINTS[k], ["deg", "deg", "mm"][k])),
            each(&|k| format!("{}_{}", JOINTS[k], ["torque_Nm", "torque_Nm", "force_N"][k])),
            [degrees, degrees, 1e3],
        ),
        _ => (
            each(&|k| format!("qIn_{k}")),
            each(&|k| format!("tauIn_{k}")),
            [1.0; 3],
        ),
    }
}

/// A text log, and the seconds between its rows where its clock is too coarse.
fn text_log(rng: &mut ChaCha8Rng, motion: &Motion, folder: &Path) -> (PathBuf, String, bool) {
    let style = rng.random_range(0..5);
    let (q, tau, scale) = names(style);
    let sign = [",", ";", "\t"][rng.random_range(0..3)];
    let clock = rng.random_range(0..5);
    let times: Vec<&str> = match clock {
        0 => vec!["t"],
        1 => vec!["time_ms"],
        2 => vec!["sec", "nanosec"],
        3 => vec!["Time [s]"],
        _ => vec!["t"],
    };
    let columns: Vec<String> = times
        .iter()
        .map(|time| (*time).to_owned())
        .chain(q)
        .chain(tau)
        .collect();
    let surround = rng.random_range(0..5);
    let mut text = match surround {
        1 => format!("sep={sign}\n"),
        2 => format!("Station{sign}bench 2\nOperator{sign}x\n***End***\n\n"),
        3 => "// arm 3\n// 100 Hz\n".to_owned(),
        _ => String::new(),
    };
    text += &columns.join(sign);
    text.push('\n');
    let units = surround == 4 && style < 3 && clock != 3;
    if units {
        let of_time: Vec<&str> = match clock {
            1 => vec!["ms"],
            2 => vec!["s", "ns"],
            _ => vec!["s"],
        };
        let of_motion = ["rad", "rad", "m", "Nm", "Nm", "N"];
        text += &[&of_time[..], &of_motion].concat().join(sign);
        text.push('\n');
    }
    for k in 0..ROWS {
        let t = motion.t[k];
        let time = match clock {
            1 => format!("{}", (t * 1e3).round()),
            2 => format!(
                "{}{sign}{}",
                1_750_000_000 + k / 100,
                (k % 100) * 10_000_000
            ),
            4 => format!("{}", 2000.0 + (t * 10.0).floor() / 10.0),
            _ => format!("{t}"),
        };
        let q = motion.q[k]
            .iter()
            .zip(scale)
            .map(|(q, scale)| (q * scale).to_string());
        let tau = motion.tau[k].iter().map(f64::to_string);
        let fields: Vec<String> = std::iter::once(time).chain(q).chain(tau).collect();
        text += &fields.join(sign);
        text.push('\n');
    }
    if rng.random_bool(0.5) {
        let blank = format!("{}\n", sign.repeat(columns.len() - 1));
        text += &blank.repeat(3);
    }
    let path = folder.join("log.csv");
    std::fs::write(&path, encoded(&text, rng.random_range(0..5))).unwrap();
    (
        path,
        text.lines().take(6).collect::<Vec<_>>().join("\n"),
        clock == 4,
    )
}

/// The bytes of a text, as recorders and spreadsheets write it.
fn encoded(text: &str, encoding: u32) -> Vec<u8> {
    match encoding {
        0 => text.replace('\n', "\r\n").into_bytes(),
        1 => format!("\u{feff}{text}").into_bytes(),
        2 => {
            let mut encoder =
                flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(text.as_bytes()).unwrap();
            encoder.finish().unwrap()
        }
        3 => {
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            units.flat_map(u16::to_le_bytes).collect()
        }
        _ => text.as_bytes().to_vec(),
    }
}

/// A text in UTF-16 is refused with the way to another, which is gone here; whether it was one.
fn save_as_utf8(path: &Path) -> bool {
    let bytes = std::fs::read(path).unwrap();
    if !bytes.starts_with(&[0xff, 0xfe]) {
        return false;
    }
    let error = look(&LogSpec::whole(path), &LogHints::default(), None, &|| false).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("iconv -f UTF-16 -t UTF-8"), "{text}");
    let units: Vec<u16> = bytes[2..]
        .chunks_exact(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    std::fs::write(path, String::from_utf16(&units).unwrap()).unwrap();
    true
}

#[test]
fn text_logs_are_read_whatever_surrounds_the_table_and_a_coarse_clock_names_its_rate() {
    let mut cured = 0;
    for seed in 0..drawn() {
        let folder = tempfile::tempdir().unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let motion = Motion::drawn(&mut rng);
        let (path, head, coarse) = text_log(&mut rng, &motion, folder.path());
        cured += u64::from(save_as_utf8(&path) || coarse);
        let mut layout = mapped(&path);
        // the message names the rate that a look finds
        let even = layout.section.rate_hz.take();
        assert_eq!(even.is_some(), coarse, "seed {seed}");
        let found = match (read(&path, &layout), coarse) {
            (Ok(found), _) => found,
            (Err(error), false) => panic!("seed {seed}: {error}\n{head}"),
            (Err(error), true) => {
                let text = error.to_string();
                let rate = text
                    .split("rate_hz = ")
                    .nth(1)
                    .unwrap_or_else(|| panic!("{text}"));
                let rate: f64 = rate.split('`').next().unwrap().parse().unwrap();
                assert_eq!(Some(rate), even, "seed {seed}");
                layout.section.rate_hz = even;
                read(&path, &layout).unwrap()
            }
        };
        same(&found, &motion, seed);
    }
    shown("text", cured);
}

/// A recording with faults that are mended, and whether its efforts are one too few.
fn recording(rng: &mut ChaCha8Rng, motion: &Motion, path: &Path) -> bool {
    const EPOCH: u64 = 30_000_000_000;
    let mut out = Recording::create(path, WriteOptions::new());
    let (json, swapped) = (rng.random_bool(0.3), rng.random_bool(0.4));
    let (unstamped, second) = (rng.random_bool(0.4), rng.random_bool(0.4));
    let (still, short) = (rng.random_bool(0.4), rng.random_bool(0.2));
    // efforts of the other publisher would be whole
    let second = second && !short;
    let names = |order: [usize; 4]| -> Vec<String> {
        let all = ["gripper", JOINTS[0], JOINTS[1], JOINTS[2]];
        order.map(|k| all[k].to_owned()).to_vec()
    };
    let state = |k: usize, stamp_ns: u64| {
        let with = |first: f64, x: &[f64; 3]| [&[first], &x[..]].concat();
        JointState {
            stamp_ns,
            names: names([0, 1, 2, 3]),
            q: with(0.0, &motion.q[k]),
            dq: match still {
                true => vec![f64::NAN; 4],
                false => with(0.0, &motion.q[k]),
            },
            tau: match short {
                true => motion.tau[k].to_vec(),
                false => with(f64::NAN, &motion.tau[k]),
            },
            ..JointState::default()
        }
    };
    let write = |out: &mut Recording, log_ns: u64, state: &JointState| match json {
        false => out.joint_state("/joint_states", log_ns, state),
        true => {
            let numbers = |x: &[f64]| {
                let all: Vec<String> = x.iter().map(f64::to_string).collect();
                format!("[{}]", all.join(","))
            };
            let (sec, nanosec) = (
                state.stamp_ns / 1_000_000_000,
                state.stamp_ns % 1_000_000_000,
            );
            let text = format!(
                "{{\"header\":{{\"stamp\":{{\"sec\":{sec},\"nanosec\":{nanosec}}}}},\"name\":{:?},\"position\":{},\"velocity\":{},\"effort\":{}}}",
                state.names,
                numbers(&state.q),
                numbers(&state.dq),
                numbers(&state.tau)
            );
            out.json("/joint_states", log_ns, &text);
        }
    };
    let ns = |k: usize| EPOCH + k as u64 * 10_000_000;
    if unstamped {
        for k in 0..5 {
            write(&mut out, ns(0) - (5 - k) * 10_000_000, &state(0, 0));
        }
    }
    let mut order: Vec<usize> = (0..ROWS).collect();
    if swapped {
        for at in [17, 200, 311] {
            order.swap(at, at + 1);
        }
    }
    for k in order {
        write(&mut out, ns(k), &state(k, ns(k)));
        // names tell publishers apart in CDR, and there is one channel
        if second && !json && k % 50 == 25 {
            let other = JointState {
                stamp_ns: ns(k) + 3_000_000,
                names: names([3, 2, 1, 0]),
                q: vec![0.0; 4],
                dq: vec![0.0; 4],
                tau: vec![0.0; 4],
                ..JointState::default()
            };
            out.joint_state("/joint_states", ns(k) + 3_000_000, &other);
        }
    }
    out.finish();
    short
}

#[test]
fn recordings_are_read_in_the_order_of_their_times_without_what_is_of_no_joint() {
    let mut cured = 0;
    for seed in 1000..1000 + drawn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let motion = Motion::drawn(&mut rng);
        let short = recording(&mut rng, &motion, &path);
        cured += u64::from(short);
        let mut layout = Layout::joint_columns(&JOINTS);
        let found = match (read(&path, &layout), short) {
            (Ok(found), false) => found,
            (Ok(_), true) => panic!("seed {seed}: efforts were given to joints at random"),
            (Err(error), false) => panic!("seed {seed}: {error}"),
            (Err(error), true) => {
                let text = error.to_string();
                assert!(text.contains("holds 3 numbers for 4 names"), "{text}");
                assert!(text.contains("`torque = \"effort[0]\"`"), "{text}");
                for (k, torque) in layout.torques.iter_mut().enumerate() {
                    torque.column = format!("effort[{k}]");
                }
                read(&path, &layout).unwrap()
            }
        };
        same(&found, &motion, seed);
    }
    shown("recordings of joint states", cured);
}
