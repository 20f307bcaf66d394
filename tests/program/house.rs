//! The plan of the house, read from its sources: imports run one way and in no circle, each large
//! dependency has one door, rooms do not print, files stay small.

use crate::house_plan;

use house_plan::{Imports, Source, code, shipped, sources};
use std::collections::BTreeMap;
use std::path::Path;

/// Rooms in pipeline order, each with the rooms that it may import. A new room gets a line here.
const ROOMS: &[(&str, &str)] = &[
    ("explain", ""),
    ("math", "explain"),
    ("block", ""),
    ("verdict", ""),
    ("number", ""),
    ("robot", "explain math"),
    ("log", "explain math number robot block"),
    ("config", "explain number robot log verdict"),
    ("output", "explain log"),
    ("motion", "explain math robot block"),
    ("effect", "explain math number robot motion"),
    ("read_back", "config"),
    (
        "export",
        "explain number robot config motion effect read_back",
    ),
    ("band", "math number robot config motion effect"),
    (
        "observe",
        "math robot block log config motion effect band export",
    ),
    ("open_loop", "explain math number robot motion effect"),
    ("judge", "math"),
    ("drive", "explain number verdict robot judge log"),
    ("friction", "explain math robot block motion verdict"),
    ("inertia", "explain math robot block motion verdict judge"),
    (
        "diagnose",
        "explain math number robot block motion effect judge",
    ),
    ("validate", "math robot block motion verdict"),
    ("inspect", "math number block log"),
    ("recording", "robot block log motion inspect"),
    ("setup", "math number robot motion inertia judge"),
    ("mapping", "explain robot log inspect"),
    ("simulate", "explain math number robot log config effect"),
    (
        "excite",
        "effect explain math number verdict robot log config inertia simulate",
    ),
    ("compare", "explain math robot config motion effect verdict"),
    ("track", ""),
    ("tool", "explain number robot judge log config"),
    (
        "held",
        "explain number verdict robot block judge log config tool",
    ),
    ("note", "math number config friction inspect setup band"),
    (
        "input",
        "note explain math block verdict number robot log config motion effect friction inertia judge diagnose validate \
         inspect recording setup open_loop track",
    ),
    (
        "held_out",
        "note input explain math block verdict number robot log config motion effect friction inertia judge validate \
         inspect compare band observe open_loop",
    ),
    (
        "fit",
        "note input held_out explain math block verdict number robot log config motion effect friction inertia \
         judge diagnose validate inspect recording setup band open_loop",
    ),
    (
        "find",
        "note input held_out fit explain math block verdict number robot log config motion effect friction inertia \
         judge diagnose validate inspect setup open_loop",
    ),
    (
        "fleet",
        "note input fit explain math block verdict robot log config motion inertia track",
    ),
    (
        "watch",
        "note input held_out math block number robot log config motion effect export band observe",
    ),
    (
        "campaign",
        "note input held_out fit find explain math verdict robot log config effect diagnose",
    ),
    // the door of them all
    (
        "identify",
        "compare diagnose note input held_out fit find fleet watch campaign",
    ),
    (
        "replay",
        "robot log config motion effect friction diagnose input held_out find",
    ),
    (
        "report",
        "explain math verdict number robot log config motion effect friction inertia diagnose validate \
         inspect setup excite compare note input held_out fit find fleet watch campaign band observe open_loop track replay drive tool held",
    ),
    (
        "cli",
        "explain math block verdict number robot log config output motion effect friction inertia diagnose \
         validate inspect mapping setup simulate excite compare note input held_out fit find fleet watch campaign identify report export band \
         observe open_loop track replay drive tool held",
    ),
];

/// Dependencies that are used behind one door.
const DOORS: &[(&str, &str)] = &[
    ("faer", "math/rank.rs"),
    ("argmin", "math/minimise.rs"),
    ("clap", "cli/"),
    ("clap_complete", "cli/generate/completions.rs"),
    ("clap_mangen", "cli/generate/man.rs"),
    ("indicatif", "cli/context.rs"),
    ("terminal_size", "cli/window.rs"),
    ("ctrlc", "cli/mod.rs"),
    ("csv_core", "log/text/records.rs"),
    ("exmex", "math/formula.rs"),
    ("fast_float2", "log/text/number.rs"),
    // one to read, one to write
    ("mcap", "log/messages/format/mcap.rs|output/mcap.rs"),
    ("rusqlite", "log/messages/format/bag.rs"),
    (
        "flate2",
        "log/content.rs|log/table/zip.rs|log/table/mat.rs|output/log.rs|input/reduced/file.rs",
    ),
    ("parquet", "log/table/parquet.rs|output/parquet.rs"),
    ("zstd", "log/content.rs|output/log.rs"),
    ("lz4", "log/content.rs"),
    ("lzma_rs", "log/content.rs"),
    ("bzip2", "log/content.rs"),
    ("sha2", "log/source.rs"),
    ("roxmltree", "config/urdf/xml.rs"),
];

/// Nouns of the field that name a type by themselves; any other type has two words.
const GLOSSARY: &str = "Arm Band Block Blocks Body Bound Capsule Chain Channel Channels Column Columns Condition Context \
     Control Coordinate Covariance Criterion Curve Dataset Deviation Diagnosis Difference Drive Effect \
     Element Encoding Entry Error Estimate Event Excitation Exit Experiment Factor Family Fault Field \
     Finding Fit Format Formula Frame Friction Function Gain Gap Gravity Header Histogram Inertia Input \
     Inspection Instant Joint Key Kinematics Law Layout Limit Limits Line Link Log Machine Mapping \
     Mechanism Message Model Motion Noise Note Objective Observer Order Outcome Parameter Parameters Path \
     Payload Piece Plant Point Pose Program Progress Provenance Quantity Range Reader Recording Reference \
     Report Residual Robot Role Rollout Rotation Row Rows Rule Sample Saturation Schema Section Sensor \
     Series Setting Settings Severity Signal Slope Solver Source Span State Step Stream Stretch Summary \
     Table Target Temperature Term Tool Topic Torque Trajectory Transmission Tree Trial Unit Unknown \
     Value Vector Velocity Verdict Weight Window Wrench Writer";

#[test]
fn imports_run_one_way() {
    let allowed: BTreeMap<&str, Vec<&str>> = (ROOMS.iter())
        .map(|(room, may)| (*room, may.split_whitespace().collect()))
        .collect();
    let sources = sources();
    let mut wrong = Vec::new();
    for (from, to) in Imports::read(&sources, code).between_files() {
        let (file, room) = (&from.file, from.room());
        // `lib.rs` and `main.rs` name every room
        let (Some(room), Some(import)) = (room, to.room()) else {
            continue;
        };
        let Some(may) = allowed.get(room) else {
            wrong.push(format!("{file}: room `{room}` has no line in ROOMS"));
            continue;
        };
        if import != room && !may.contains(&import) {
            wrong.push(format!("{file}: `{room}` may not import `{import}`"));
        }
    }
    let rooms = sources.iter().filter_map(Source::room);
    wrong.extend(
        rooms
            .filter(|room| !allowed.contains_key(room))
            .map(|room| format!("room `{room}` has no line in ROOMS")),
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_imports_go_in_a_circle() {
    let sources = sources();
    let circles = Imports::read(&sources, shipped).circles();
    let shown: Vec<String> = circles
        .iter()
        .map(|(circle, ties)| format!("{circle}\n  {}", ties.join("\n  ")))
        .collect();
    assert!(
        shown.is_empty(),
        "imports in a circle:\n{}",
        shown.join("\n")
    );
}

#[test]
fn the_plan_itself_has_no_way_back() {
    for (at, (room, may)) in ROOMS.iter().enumerate() {
        for import in may.split_whitespace() {
            let earlier = ROOMS[..at].iter().any(|(name, _)| *name == import);
            assert!(earlier, "`{room}` imports `{import}`, which comes later");
        }
    }
}

#[test]
fn estimators_know_nothing_of_the_simulator() {
    for room in [
        "motion",
        "effect",
        "friction",
        "inertia",
        "diagnose",
        "validate",
        "inspect",
        "log",
        "replay",
        "report",
        "band",
        "observe",
        "open_loop",
    ] {
        let (_, may) = ROOMS.iter().find(|(name, _)| *name == room).unwrap();
        let simulates = may.split_whitespace().any(|import| import == "simulate");
        assert!(!simulates, "{room}");
    }
}

#[test]
fn simulator_and_estimator_share_entries_of_effects_and_no_law() {
    let shared = [
        "Entry",
        "Key",
        "EffectPlace",
        "PlaceRule",
        "Range",
        "Role",
        "Unit",
    ];
    for source in sources() {
        if source.room() != Some("simulate") {
            continue;
        }
        for path in code(&source.text).split("crate::effect::").skip(1) {
            let path = path.split(';').next().unwrap();
            let names = path.split(|c: char| "{},".contains(c)).map(str::trim);
            for name in names.filter(|name| !name.is_empty()) {
                let entry = name.ends_with("::ENTRY") || shared.contains(&name);
                assert!(entry, "{}: {name}", source.file);
            }
        }
    }
}

#[test]
fn no_code_asks_for_an_effect_by_its_name() {
    let sources = sources();
    let effect = |source: &&Source| source.text.contains("static ENTRY");
    let files = sources.iter().filter(effect);
    let names = files.filter_map(|source| source.module.last().map(|name| name.replace('_', "-")));
    // of one word they name other things too
    let quoted = names.filter(|name| name.contains('-'));
    let quoted: Vec<String> = quoted.map(|name| format!("\"{name}\"")).collect();
    assert!(quoted.len() > 10);
    for source in &sources {
        let text = source.text.split("#[cfg(test)]").next().unwrap();
        let found = quoted.iter().find(|name| text.contains(*name));
        // the faults of a log, some of which the simulator makes
        // those of drives have a list of their own
        let own =
            matches!(source.room(), Some("effect" | "drive")) || source.file == "inspect/fault.rs";
        assert!(own || found.is_none(), "{}: {found:?}", source.file);
    }
}

#[test]
fn files_that_a_list_declares_are_formatted_too() {
    // rustfmt follows `mod`, and not what a macro makes of a list
    let listed = |source: &Source| {
        let [folder @ .., _] = source.module.as_slice() else {
            return false;
        };
        let folder = folder.join("/");
        ["effect", "simulate/effects"].contains(&folder.as_str())
            && !source.file.ends_with("/mod.rs")
    };
    let files = sources().into_iter().filter(listed);
    let files = files.map(|source| source.path);
    let mut rustfmt = std::process::Command::new("rustfmt");
    rustfmt.args(["--edition", "2024", "--check"]).args(files);
    // where there is no rustfmt nothing is written either
    if let Ok(done) = rustfmt.output() {
        let said = String::from_utf8_lossy(&done.stdout);
        assert!(done.status.success(), "{said}");
    }
}

#[test]
fn each_large_dependency_has_one_door() {
    let mut wrong = Vec::new();
    let sources = sources();
    for Source {
        file, text, module, ..
    } in &sources
    {
        let code = code(text);
        for (name, door) in DOORS {
            // not a module of that name beside the file
            let inner = [&module[..], &[(*name).to_owned()]].concat();
            if sources.iter().any(|source| source.module == inner) {
                continue;
            }
            let used = code.match_indices(&format!("{name}::")).any(|(at, _)| {
                !code[..at].ends_with(|c: char| c.is_alphanumeric() || "_:".contains(c))
            });
            if used && !door.split('|').any(|door| file.starts_with(door)) {
                wrong.push(format!("{file} uses {name}, whose door is {door}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_command_line_prints() {
    for Source { file, text, .. } in sources() {
        let shipped = shipped(&text);
        let prints = ["println!", "print!", "eprintln!", "eprint!", "dbg!"];
        let found = prints.iter().find(|name| shipped.contains(*name));
        assert!(
            found.is_none() || file.starts_with("cli/"),
            "{file}: {found:?}"
        );
        let streams = shipped.contains("stdout()") || shipped.contains("stderr()");
        assert!(!streams || file.starts_with("cli/"), "{file}");
    }
}

/// Arguments of a command are `Args` of its file: clap names them by the command.
#[test]
fn a_type_that_others_see_has_a_name_of_its_own() {
    let mut places: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let sources = sources();
    for source in &sources {
        for line in source.text.lines() {
            let declared = ["pub struct ", "pub enum ", "pub trait ", "pub type "];
            let Some(rest) = declared.iter().find_map(|of| line.strip_prefix(of)) else {
                continue;
            };
            let end = rest.find(|c: char| !c.is_alphanumeric());
            let name = &rest[..end.unwrap_or(rest.len())];
            if name != "Args" {
                places.entry(name).or_default().push(&source.file);
            }
        }
    }
    assert!(places.len() > 300, "{}", places.len());
    places.retain(|_, files| files.len() > 1);
    assert_eq!(places, BTreeMap::new());
}

/// Those that are older than this rule stand in a list, which grows no more.
#[test]
fn a_type_has_two_words_or_is_a_noun_of_the_field() {
    let older = include_str!("house_plan/one_word_types.txt");
    let known: Vec<&str> = (GLOSSARY.split_whitespace())
        .chain(older.split_whitespace())
        .collect();
    let (mut wrong, mut count) = (Vec::new(), 0);
    for Source { file, text, .. } in sources() {
        for line in text.split("#[cfg(test)]").next().unwrap().lines() {
            let line = line.strip_prefix("pub ").unwrap_or(line);
            let line = line.strip_prefix("pub(crate) ").unwrap_or(line);
            let line = line.strip_prefix("pub(super) ").unwrap_or(line);
            let declared = ["struct ", "enum ", "trait ", "type "];
            let Some(rest) = declared.iter().find_map(|of| line.strip_prefix(of)) else {
                continue;
            };
            let end = rest.find(|c: char| !c.is_alphanumeric());
            let name = &rest[..end.unwrap_or(rest.len())];
            let words = name.chars().filter(char::is_ascii_uppercase).count();
            count += 1;
            if words == 1 && !known.contains(&name) {
                wrong.push(format!("{file}: {name}"));
            }
        }
    }
    assert!(count > 900, "{count}");
    assert!(
        wrong.is_empty(),
        "two words, or a noun of the field with a place in GLOSSARY: {}",
        wrong.join(", ")
    );
}

#[test]
fn files_have_at_most_500_lines() {
    for Source { file, text, .. } in sources() {
        let lines = text.lines().count();
        assert!(lines <= 500, "{file} has {lines} lines: that is two ideas");
    }
}

#[test]
fn no_file_is_a_drawer_for_everything() {
    for Source { file, .. } in sources() {
        let stem = Path::new(&file).file_stem().unwrap().to_string_lossy();
        for name in [
            "utils", "util", "helpers", "common", "misc", "prelude", "manager",
        ] {
            assert_ne!(stem, name, "{file}");
        }
    }
}
