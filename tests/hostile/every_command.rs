//! Every command on every kind of bad file: a status, a message that names the file, no panic, no file left that
//! was not asked for, and all of it within bounded memory. The files are made from good ones by a seeded generator.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::bench::{Bench, Ended, slide_log};

/// What a command takes a file as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Log,
    Recording,
    Robot,
    Model,
    Trajectory,
    Campaign,
    Urdf,
    Stl,
    StlText,
}

/// Lines, `{}` where the bad file stands. What they write begins with `out`.
const LINES: &[(Kind, &str)] = &[
    (
        Kind::Log,
        "lsq {} -r slide.toml -o out.toml --json out.json",
    ),
    (Kind::Log, "lsq good.csv {} -r slide.toml -o out.toml"),
    (
        Kind::Log,
        "friction {} -r slide.toml -o out.toml --plot out.svg",
    ),
    (
        Kind::Log,
        "validate {} -m model.toml -o out.csv --report out.html",
    ),
    (Kind::Log, "diagnose {} -m model.toml -o out.toml"),
    (
        Kind::Log,
        "diagnose good.csv -m model.toml --holdout {} -o out.toml",
    ),
    (Kind::Log, "torque {} -m model.toml -o out.csv"),
    (Kind::Log, "compare model.toml model.toml {} --plot out.svg"),
    (Kind::Log, "inspect {}"),
    (Kind::Log, "inspect {} -r slide.toml --json out.json"),
    (Kind::Log, "convert {} out.mcap"),
    (Kind::Log, "convert {} out.csv -r slide.toml"),
    (Kind::Log, "new out --log {}"),
    (
        Kind::Log,
        "excite -r slide.toml -m model.toml --joint slide --seconds 5 -o out.toml --with {}",
    ),
    (Kind::Recording, "lsq {} -r slide.toml -o out.toml"),
    (Kind::Recording, "validate {} -m model.toml -o out.csv"),
    (Kind::Recording, "inspect {}"),
    (Kind::Recording, "inspect {} -r slide.toml"),
    (Kind::Recording, "convert {} out.csv"),
    (Kind::Recording, "convert {} out.csv -r slide.toml"),
    (Kind::Recording, "new out --log {}"),
    (Kind::Recording, "torque {} -m model.toml -o out.mcap"),
    (Kind::Robot, "lsq good.csv -r {} -o out.toml"),
    (Kind::Robot, "friction good.csv -r {} -o out.toml"),
    (Kind::Robot, "inspect good.csv -r {}"),
    (Kind::Robot, "convert good.csv out.mcap -r {}"),
    (
        Kind::Robot,
        "simulate -r {} -m model.toml --seconds 6 -o out.csv",
    ),
    (Kind::Model, "validate good.csv -m {} -o out.csv"),
    (Kind::Model, "diagnose good.csv -m {} -o out.toml"),
    (Kind::Model, "torque good.csv -m {} -o out.csv"),
    (Kind::Model, "export -m {} --c out.h --rust out.rs"),
    (Kind::Model, "compare {} model.toml --report out.html"),
    (Kind::Model, "compare model.toml {} good.csv"),
    (
        Kind::Model,
        "simulate -r slide.toml -m {} --seconds 6 -o out.csv",
    ),
    (
        Kind::Model,
        "friction good.csv -r slide.toml -m {} -o out.toml",
    ),
    (
        Kind::Trajectory,
        "simulate -r slide.toml -m model.toml --reference {} --seconds 1 -o out.csv",
    ),
    (
        Kind::Trajectory,
        "excite -r slide.toml -m model.toml --check {} --samples out.csv",
    ),
    (Kind::Campaign, "identify {} -o out-run"),
    (Kind::Urdf, "new out --urdf {}"),
    // their URDF names the mesh
    (Kind::Stl, "new out --urdf of_stl.urdf"),
    (Kind::StlText, "new out --urdf of_stl.urdf"),
];

const TRAJECTORY: &str = "kind = \"points\"\ncoordinates = \"joint\"\n\n[[point]]\nt = 0.0\nposition = [0.0]\n\n\
    [[point]]\nt = 0.5\nposition = [0.1]\n\n[[point]]\nt = 1.0\nposition = [0.0]\n";

const CAMPAIGN: &str = "robot = \"slide.toml\"\n\n[logs]\nfriction = []\nidentification = [\"good.csv\"]\n\
    validation = [\"other.csv@0..40%\"]\n";

const URDF: &str = "<robot name=\"arm\">\n<link name=\"base\"/>\n<link name=\"upper\">\n<inertial><mass value=\"2.0\"/>\
    <inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial>\n</link>\n\
    <joint name=\"shoulder\" type=\"revolute\">\n<parent link=\"base\"/>\n<child link=\"upper\"/>\n\
    <axis xyz=\"0 0 1\"/>\n<limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"2\"/>\n</joint>\n</robot>\n";

const STL: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0.5\nendloop\n\
    endfacet\nendsolid s\n";

/// A binary STL file of one triangle.
fn binary_stl() -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out.extend(1_u32.to_le_bytes());
    let numbers = [
        0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5,
    ];
    out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    out.extend([0; 2]);
    out
}

/// Numbers of a fixed series (Knuth's multiplier for 64 bits).
struct Series(u64);

impl Series {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % most.max(1)
    }
}

/// Words that stand in the place of a number or of a text.
const WORDS: [&str; 16] = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "1e31",
    "-1e200",
    "1e-320",
    "0",
    "-1",
    "\"\"",
    "[]",
    "{}",
    "true",
    "99999999999999999999",
    "\u{202e}",
    "\u{0}",
];

/// Bad files made of a good one.
fn spoiled(good: &[u8], seed: u64) -> Vec<Vec<u8>> {
    let mut chance = Series(seed);
    let mut out: Vec<Vec<u8>> = vec![
        Vec::new(),
        b"\n".to_vec(),
        vec![0; 5000],
        vec![0xff; 300],
        [b"\xef\xbb\xbf".as_slice(), good].concat(),
        [good, good].concat(),
        [b"[".repeat(3000), b"]".repeat(3000)].concat(),
        [b"<a>".repeat(3000), b"</a>".repeat(3000)].concat(),
        good.iter().rev().copied().collect(),
        [&good[..good.len() / 2], &[0; 64], &good[good.len() / 2..]].concat(),
    ];
    for _ in 0..12 {
        out.push(good[..chance.below(good.len())].to_vec());
    }
    for _ in 0..14 {
        let mut bytes = good.to_vec();
        for _ in 0..1 + chance.below(4) {
            let at = chance.below(bytes.len());
            bytes[at] ^= 1 << chance.below(8);
        }
        out.push(bytes);
    }
    // a word for another
    let ends = |byte: &u8| b" ,=\n[]\"<>".contains(byte);
    for word in &WORDS {
        let from = chance.below(good.len());
        let from = good[from..]
            .iter()
            .position(ends)
            .map_or(0, |at| from + at + 1);
        let to = good[from..]
            .iter()
            .position(ends)
            .map_or(good.len(), |at| from + at);
        out.push([&good[..from], word.as_bytes(), &good[to..]].concat());
    }
    // lines lost, twice, exchanged
    let lines: Vec<&[u8]> = good.split_inclusive(|byte| *byte == b'\n').collect();
    for k in 0..12 {
        let mut lines = lines.clone();
        let (i, j) = (chance.below(lines.len()), chance.below(lines.len()));
        match k % 3 {
            0 => drop(lines.remove(i)),
            1 => lines.insert(i, lines[i]),
            _ => lines.swap(i, j),
        }
        out.push(lines.concat());
    }
    out
}

/// What stands under the name `bad`, other than a file of bytes.
fn odd(bench: &Bench, which: usize, name: &str) -> bool {
    let path = bench.path(name);
    match which {
        0 => fs::create_dir(path).unwrap(),
        1 => symlink("nowhere", path).unwrap(),
        2 => symlink(name, path).unwrap(),
        3 => symlink("/dev/null", path).unwrap(),
        4 => {}
        5 => drop(fs::copy(bench.path("slide.toml"), path).unwrap()),
        6 => drop(fs::copy(bench.path("good.mcap"), path).unwrap()),
        _ => return false,
    }
    true
}

/// What is wrong with how a run ended.
fn complaint(line: &str, name: &str, ended: &Ended) -> Option<String> {
    let status = match ended.status {
        Some(status) if [0, 1, 3, 4].contains(&status) => status,
        // an effect, a joint or a name that is no longer there is a matter of usage
        Some(2) => 2,
        other => return Some(format!("status {other:?}")),
    };
    let said = &ended.stderr;
    if said.contains("panicked") || said.contains("memory allocation") {
        return Some("a panic".to_owned());
    }
    if said.contains(|c: char| (c.is_control() && c != '\n') || c == '\u{202e}') {
        return Some("a control character".to_owned());
    }
    if status >= 2 && !said.contains("error: ") {
        return Some("no error is shown".to_owned());
    }
    let fault = said
        .lines()
        .filter(|shown| !shown.starts_with("warning"))
        .collect::<String>();
    // a robot or model that can be read may ask a good log for what it lacks
    // of a motion, or have no motion at all
    let named = [name, "good.csv", "the reference cannot be used"];
    let named = named.iter().any(|name| fault.contains(name));
    if status == 3 && !named && !line.starts_with("identify") {
        return Some("the file is not named".to_owned());
    }
    if status == 3 && !fault.contains("hint: ") {
        return Some("no way out is shown".to_owned());
    }
    None
}

fn ending(kind: Kind) -> &'static str {
    match kind {
        Kind::Log => "csv",
        Kind::Recording => "mcap",
        Kind::Urdf => "urdf",
        Kind::Stl | Kind::StlText => "stl",
        _ => "toml",
    }
}

#[test]
fn every_command_ends_well_on_every_kind_of_bad_file() {
    let next = AtomicUsize::new(0);
    let (cases, faults) = (AtomicUsize::new(0), Mutex::new(BTreeSet::new()));
    let worker = || {
        let bench = Bench::new();
        bench.file("good.csv", slide_log(500, |_, _, _| {}));
        bench.file("other.csv", slide_log(400, |_, q, _| *q += 1e-4));
        let converted = bench.run("convert good.csv good.mcap -r slide.toml");
        assert_eq!(converted.status, Some(0), "{}", converted.stderr);
        let shape = "<link name=\"upper\"><collision><geometry><mesh filename=\"bad.stl\"/></geometry></collision>";
        let urdf = URDF.replace("<link name=\"upper\">", shape);
        bench.file("of_stl.urdf", urdf);
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some((kind, line)) = LINES.get(at) else {
                break;
            };
            let good = match kind {
                Kind::Log => fs::read(bench.path("good.csv")).unwrap(),
                Kind::Recording => fs::read(bench.path("good.mcap")).unwrap(),
                Kind::Robot => fs::read(bench.path("slide.toml")).unwrap(),
                Kind::Model => fs::read(bench.path("model.toml")).unwrap(),
                Kind::Trajectory => TRAJECTORY.as_bytes().to_vec(),
                Kind::Campaign => CAMPAIGN.as_bytes().to_vec(),
                Kind::Urdf => URDF.as_bytes().to_vec(),
                Kind::Stl => binary_stl(),
                Kind::StlText => STL.as_bytes().to_vec(),
            };
            let name = format!("bad.{}", ending(*kind));
            let files = spoiled(&good, 1 + at as u64);
            let before = bench.files();
            for case in 0..files.len() + 7 {
                match files.get(case) {
                    Some(bytes) => bench.file(&name, bytes),
                    None => assert!(odd(&bench, case - files.len(), &name)),
                }
                let ended = bench.run(&line.replace("{}", &name));
                cases.fetch_add(1, Ordering::Relaxed);
                let mut complaint = complaint(line, &name, &ended);
                // a mesh that cannot be read spoils no robot file
                if line.contains("urdf of_") && ended.status != Some(0) {
                    complaint = Some(format!("status {:?}", ended.status));
                }
                let path = bench.path(&name);
                match fs::symlink_metadata(&path) {
                    Ok(about) if about.is_dir() => fs::remove_dir(&path).unwrap(),
                    Ok(_) => fs::remove_file(&path).unwrap(),
                    Err(_) => {}
                }
                let mut after = bench.files();
                if matches!(ended.status, Some(0 | 1)) {
                    after.retain(|name, _| !name.starts_with("out"));
                }
                if after != before {
                    complaint = Some(format!("files {:?}", after.keys().collect::<Vec<_>>()));
                }
                if let Some(complaint) = complaint {
                    let shown = ended.stderr.lines().take(3).collect::<Vec<_>>().join(" | ");
                    let shown = format!("{line}, case {case}: {complaint}: {shown}");
                    faults.lock().unwrap().insert(shown);
                }
                for left in fs::read_dir(bench.folder()).unwrap().map(Result::unwrap) {
                    if left.file_name().to_string_lossy().starts_with("out") {
                        let path = left.path();
                        match path.is_dir() {
                            true => fs::remove_dir_all(path).unwrap(),
                            false => fs::remove_file(path).unwrap(),
                        }
                    }
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(worker);
        }
    });
    let faults = faults.into_inner().unwrap();
    let shown: Vec<&String> = faults.iter().take(60).collect();
    assert!(faults.is_empty(), "{} faults:\n{shown:#?}", faults.len());
    assert!(cases.into_inner() >= 2000);
}
