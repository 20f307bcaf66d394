//! Logs that are written are read back bit for bit, in every form and through every conversion.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use cft_ident::config::RobotFile;
use cft_ident::log::{Block, Instant, RawBlock, RawReader, Reader};
use cft_ident::output::LogWriter;
use proptest::prelude::*;
use serde_json::Value;

const FORMS: [&str; 6] = ["csv", "csv.gz", "csv.zst", "mcap", "mcap.gz", "mcap.zst"];

/// A log as columns; the time is the first.
#[derive(Debug, Clone)]
struct Log {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
    origin_ns: i64,
}

impl Log {
    fn write(&self, path: &Path) {
        let mut log = LogWriter::create(path, &self.names).unwrap();
        if self.origin_ns != 0 {
            log.set_origin(Instant::from_ns(self.origin_ns));
        }
        for row in &self.rows {
            log.row(row.iter().copied()).unwrap();
        }
        log.commit().unwrap();
    }

    fn read(path: &Path) -> Self {
        let spec = path.to_string_lossy().parse().unwrap();
        let mut table = RawReader::open(&spec, None).unwrap();
        table.set_time(0, 1.0);
        let mut block = RawBlock::default();
        let mut rows = Vec::new();
        while table.read(&mut block).unwrap() {
            for (k, t) in block.t.iter().enumerate() {
                let others = block.columns[1..].iter().map(|column| column[k]);
                rows.push(std::iter::once(*t).chain(others).collect());
            }
        }
        let origin = table.origin().nanoseconds();
        Self {
            names: table.names().to_vec(),
            rows,
            origin_ns: origin.try_into().unwrap(),
        }
    }

    /// The column of this name, bit for bit.
    fn bits(&self, name: &str) -> Vec<u64> {
        let index = self.names.iter().position(|known| known == name);
        let index = index.unwrap_or_else(|| panic!("{name} of {:?}", self.names));
        let bits = |x: f64| {
            if x.is_nan() {
                f64::NAN.to_bits()
            } else {
                x.to_bits()
            }
        };
        self.rows.iter().map(|row| bits(row[index])).collect()
    }

    fn assert_equals(&self, other: &Self, what: &str) {
        assert_eq!(self.origin_ns, other.origin_ns, "{what}");
        assert_eq!(
            self.names.len(),
            other.names.len(),
            "{what}: {:?}",
            other.names
        );
        for name in &self.names {
            assert_eq!(self.bits(name), other.bits(name), "{what}: {name}");
        }
    }
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -100.0..100.0f64,
        2 => proptest::num::f64::ANY,
        1 => Just(f64::NAN),
        1 => Just(-0.0),
        1 => Just(f64::INFINITY),
    ]
}

fn any_log() -> impl Strategy<Value = Log> {
    let name = prop_oneof![
        3 => prop::sample::select(vec!["q_a", "q_b", "tau_a", "tau_b", "dq_a", "dq_b", "ddq_a", "tau_hat_a", "u_1", "q_ref_a", "word, with \"marks\"", "Größe", "#2"])
            .prop_map(str::to_owned),
        1 => "[a-zA-Z_/.=\\[\\] ]{1,12}".prop_map(|name| format!("c{}x", name)),
    ];
    let names = prop::collection::btree_set(name, 1..9);
    let steps = prop_oneof![Just(1e-3), Just(1.0 / 3000.0), 1e-6..10.0f64,];
    let origin = prop_oneof![Just(0), Just(1_714_566_896_123_456_789_i64)];
    (names, steps, 2usize..60, origin).prop_flat_map(|(names, step, rows, origin_ns)| {
        let names: Vec<String> = std::iter::once("t".to_owned()).chain(names).collect();
        let width = names.len() - 1;
        let numbers = prop::collection::vec(prop::collection::vec(any_number(), width), rows);
        (Just(names), numbers).prop_map(move |(names, numbers)| {
            let time = |k: usize| {
                let t = k as f64 * step;
                // seconds since 1970 are written to the nanosecond
                if origin_ns != 0 {
                    (t * 1e9).round() / 1e9
                } else {
                    t - 0.25
                }
            };
            let rows = numbers.iter().enumerate();
            let row = |(k, numbers): (usize, &Vec<f64>)| {
                std::iter::once(time(k))
                    .chain(numbers.iter().copied())
                    .collect()
            };
            Log {
                rows: rows.map(row).collect(),
                names,
                origin_ns,
            }
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_log_is_read_back_bit_for_bit_from_every_form(log in any_log()) {
        let folder = tempfile::tempdir().unwrap();
        for form in FORMS {
            let path = folder.path().join(format!("log.{form}"));
            log.write(&path);
            log.assert_equals(&Log::read(&path), form);
        }
    }
}

struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    fn tool(&self, line: &str) -> assert_cmd::assert::Assert {
        let mut command = Command::cargo_bin("cft-ident").unwrap();
        command.current_dir(self.0.path());
        command.args(line.split_whitespace()).assert()
    }

    fn json(&self, line: &str) -> Value {
        let run = self.tool(&format!("{line} --json -")).code(0);
        serde_json::from_slice(&run.get_output().stdout).unwrap()
    }
}

fn fixture(name: &str) -> String {
    let root = Path::new(cft_ident_support::ROOT).join("fixtures/logs");
    root.join(name).to_string_lossy().into_owned()
}

#[test]
fn a_simulated_log_survives_every_conversion_and_no_byte_depends_on_the_run() {
    let bench = Bench::new();
    let simulate = "simulate -r configs/cft.toml --seconds 2 --seed 5 -o";
    bench.tool(&format!("{simulate} a.csv")).code(0);
    bench.tool(&format!("{simulate} b.mcap")).code(0);
    bench
        .tool(&format!("{simulate} c.mcap --threads 1"))
        .code(0);
    bench.tool(&format!("{simulate} d.csv.zst")).code(0);
    assert_eq!(bench.bytes("b.mcap"), bench.bytes("c.mcap"));
    for name in ["a.truth.toml", "b.truth.toml", "d.truth.toml"] {
        assert_eq!(bench.bytes(name), bench.bytes("c.truth.toml"), "{name}");
    }
    let a = Log::read(&bench.path("a.csv"));
    a.assert_equals(&Log::read(&bench.path("b.mcap")), "b.mcap");
    a.assert_equals(&Log::read(&bench.path("d.csv.zst")), "d.csv.zst");
    let chain = [
        "a.csv",
        "1.mcap",
        "2.csv.gz",
        "3.mcap.zst",
        "4.csv.zst",
        "5.mcap.gz",
        "6.csv",
    ];
    for pair in chain.windows(2) {
        let found = bench.json(&format!("convert {} {}", pair[0], pair[1]));
        assert_eq!(found["samples"], 2000);
        assert_eq!(found["warnings"].as_array().unwrap().len(), 0, "{found}");
    }
    assert_eq!(bench.bytes("1.mcap"), bench.bytes("b.mcap"));
    assert!(bench.bytes("6.csv") == bench.bytes("a.csv"));
}

#[test]
fn a_fit_reads_the_same_from_either_form() {
    let bench = Bench::new();
    bench
        .tool("simulate -r configs/cft.toml --seconds 1 -o a.csv")
        .code(0);
    bench.tool("convert a.csv a.mcap").code(0);
    bench
        .tool("convert a.csv si.mcap.zst -r configs/cft.toml")
        .code(0);
    let layout = RobotFile::load(Path::new("configs/cft.toml"))
        .unwrap()
        .layout();
    let read = |name: &str| {
        let spec = bench.path(name).to_string_lossy().parse().unwrap();
        let mut reader = Reader::open(&spec, &layout).unwrap();
        let mut block = Block::default();
        assert!(reader.read(&mut block).unwrap());
        (block.t, block.q, block.tau)
    };
    let first = read("a.csv");
    assert_eq!(first.0.len(), 1000);
    assert_eq!(read("a.mcap"), first);
    assert_eq!(read("si.mcap.zst"), first);
}

#[test]
fn recordings_of_others_become_tables() {
    let bench = Bench::new();
    for (name, out) in [
        ("arm.mcap", "a.csv"),
        ("arm.db3", "b.csv"),
        ("shuffled.mcap", "c.csv"),
    ] {
        bench
            .tool(&format!("convert {} {out}", fixture(name)))
            .code(0);
    }
    let a = Log::read(&bench.path("a.csv"));
    assert!(a.names.len() > 3 && a.rows.len() > 10, "{:?}", a.names);
    assert_eq!(a.origin_ns, Log::read(&bench.path("b.csv")).origin_ns);
    a.assert_equals(&Log::read(&bench.path("b.csv")), "db3");
    let shuffled = Log::read(&bench.path("c.csv"));
    // Some of its messages have empty arrays: no numbers, and no wrong ones.
    let none = f64::NAN.to_bits();
    let positions = shuffled.bits("q_q1");
    for name in &a.names[1..] {
        let rows = shuffled.bits(name).into_iter().zip(&positions);
        let shown: Vec<u64> = rows
            .filter(|(_, position)| **position != none)
            .map(|(bits, _)| bits)
            .collect();
        let own = a.bits(name);
        assert_eq!(shown.len(), own.len(), "{name}");
        let equal = shown.iter().zip(&own).filter(|(x, own)| x == own).count();
        let missing = shown.iter().filter(|bits| **bits == none).count();
        assert_eq!(equal + missing, own.len(), "{name}");
        assert!(missing == 0 || name.starts_with("dq_"), "{name}");
    }
    let arm = bench.json(&format!("inspect {}", fixture("arm.mcap")));
    let channels = arm["channels"].as_array().unwrap();
    assert_eq!(channels.len() + 1, a.names.len());
    let killed = bench.json(&format!("inspect {}", fixture("killed.mcap")));
    assert!(
        killed["faults"]
            .as_array()
            .unwrap()
            .iter()
            .any(|f| f["kind"] == "incomplete-file"),
        "{killed}"
    );
}

#[test]
fn several_logs_become_one_in_the_order_of_time_or_are_refused() {
    let bench = Bench::new();
    let rows = |from: u32, to: u32| -> String {
        let rows = (from..to).map(|k| format!("{},{k}\n", f64::from(k) * 0.5));
        std::iter::once("t,q_a\n".to_owned()).chain(rows).collect()
    };
    fs::write(bench.path("a.csv"), rows(0, 10)).unwrap();
    fs::write(bench.path("b.csv"), rows(10, 20)).unwrap();
    fs::write(bench.path("other.csv"), "t,q_b\n100,1\n").unwrap();
    fs::write(bench.path("word.csv"), "t,q_a,state\n0,1,idle\n1,2,busy\n").unwrap();
    fs::write(bench.path("short.csv"), "t,q_a\n0,1\n1\n").unwrap();
    bench.tool("convert a.csv b.csv all.csv").code(0);
    assert_eq!(Log::read(&bench.path("all.csv")).rows.len(), 20);
    for (line, said) in [
        ("convert b.csv a.csv no.csv", "in the order of time"),
        ("convert a.csv other.csv no.mcap", "convert it by itself"),
        ("convert short.csv no.csv", "complete or delete these rows"),
    ] {
        let run = bench.tool(line).code(3);
        let text = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
        assert!(text.contains(said), "{line}: {text}");
    }
    assert!(!bench.path("no.csv").exists() && !bench.path("no.mcap").exists());
    let found = bench.json("convert word.csv word.mcap");
    let warnings = found["warnings"].to_string();
    assert!(
        warnings.contains("2 fields of `state` are words"),
        "{warnings}"
    );
    bench.tool("convert a.csv a.xlsx").code(2);
    bench.tool("convert a.csv").code(2);
}
