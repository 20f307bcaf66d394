//! The plan of the house, read from its sources: imports run one way, each large dependency has one
//! door, rooms do not print, files stay small.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms in pipeline order, each with the rooms that it may import. A new room gets a line here.
const ROOMS: &[(&str, &[&str])] = &[
    ("math", &[]),
    ("verdict", &[]),
    ("number", &[]),
    ("robot", &["math"]),
    ("log", &["math", "robot"]),
    ("config", &["robot", "log", "verdict"]),
    ("output", &["log"]),
    ("export", &["robot", "config"]),
    ("motion", &["math", "robot", "log"]),
    ("effect", &["math", "robot", "motion"]),
    ("friction", &["math", "robot", "log", "motion", "verdict"]),
    ("inertia", &["math", "robot", "log", "motion", "verdict"]),
    ("diagnose", &["math", "robot", "log", "motion", "effect"]),
    ("validate", &["math", "robot", "log", "motion", "verdict"]),
    ("inspect", &["math", "log"]),
    ("simulate", &["math", "robot", "log", "config"]),
    (
        "excite",
        &["math", "number", "robot", "config", "inertia", "simulate"],
    ),
    (
        "compare",
        &["robot", "config", "motion", "effect", "verdict"],
    ),
    (
        "identify",
        &[
            "math", "verdict", "number", "robot", "log", "config", "motion", "effect", "friction",
            "inertia", "diagnose", "validate", "inspect", "compare",
        ],
    ),
    (
        "report",
        &[
            "log", "verdict", "number", "config", "motion", "friction", "inertia", "validate",
            "inspect", "excite",
        ],
    ),
    (
        "cli",
        &[
            "math", "verdict", "number", "robot", "log", "config", "output", "motion", "effect",
            "friction", "inertia", "diagnose", "validate", "inspect", "simulate", "excite",
            "compare", "identify", "report", "export",
        ],
    ),
];

/// Dependencies that are used behind one door.
const DOORS: &[(&str, &str)] = &[
    ("faer", "math/rank.rs"),
    ("argmin", "math/minimise.rs"),
    ("clap", "cli/"),
    ("clap_complete", "cli/completions.rs"),
    ("clap_mangen", "cli/man.rs"),
    ("indicatif", "cli/context.rs"),
    ("ctrlc", "cli/mod.rs"),
    ("csv", "log/text/csv.rs"),
    // one to read, one to write
    ("mcap", "log/recording/format/mcap.rs|output/mcap.rs"),
    ("rusqlite", "log/recording/format/bag.rs"),
    ("flate2", "log/content.rs|output/log.rs"),
    ("zstd", "log/content.rs|output/log.rs"),
    ("resvg", "report/figure/png.rs"),
    ("sha2", "log/source.rs"),
    ("quick_xml", "config/urdf/xml.rs"),
];

/// Every source file with its path below `src`.
fn sources() -> Vec<(String, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|end| end == "rs") {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    walk(&root, &mut paths);
    paths.sort();
    paths
        .iter()
        .map(|path| {
            let name = path.strip_prefix(&root).unwrap().to_string_lossy();
            (name.replace('\\', "/"), fs::read_to_string(path).unwrap())
        })
        .collect()
}

/// The text without comments.
fn code(text: &str) -> String {
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or(""));
    lines.collect::<Vec<_>>().join("\n")
}

/// The room of a file; `None` for `lib.rs` and `main.rs`, which name every room.
fn room(file: &str) -> Option<&str> {
    let first = file.split('/').next().unwrap();
    let room = first.strip_suffix(".rs").unwrap_or(first);
    (room != "lib" && room != "main").then_some(room)
}

/// First names of the paths that follow `prefix`: of `crate::{a::b, c}` both `a` and `c`.
fn names_after(code: &str, prefix: &str) -> BTreeSet<String> {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices(prefix) {
        if code[..at].ends_with(word) {
            continue;
        }
        let rest = &code[at + prefix.len()..];
        let Some(list) = rest.strip_prefix('{') else {
            found.insert(rest.chars().take_while(|c| word(*c)).collect());
            continue;
        };
        let mut depth = 0;
        let mut name = String::new();
        for c in list.chars() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    found.insert(std::mem::take(&mut name));
                }
                c if depth == 0 => name.push(c),
                _ => {}
            }
        }
        found.insert(name);
    }
    let first = |name: &String| name.trim().chars().take_while(|c| word(*c)).collect();
    found
        .iter()
        .map(first)
        .filter(|name: &String| !name.is_empty())
        .collect()
}

/// Rooms that a file imports, by `crate::` or by climbing up with `super::`.
fn imports(file: &str, text: &str) -> BTreeSet<String> {
    let code = code(text);
    let mut found = names_after(&code, "crate::");
    // a module of depth d reaches the crate by d times `super::` (one more inside its tests)
    let depth = file.split('/').count() - usize::from(file.ends_with("/mod.rs"));
    for climb in [depth, depth + 1] {
        let names = names_after(&code, &"super::".repeat(climb));
        let is_room = |name: &String| ROOMS.iter().any(|(room, _)| room == name);
        found.extend(names.into_iter().filter(is_room));
    }
    found
}

#[test]
fn imports_run_one_way() {
    let allowed: BTreeMap<&str, &[&str]> = ROOMS.iter().copied().collect();
    let mut wrong = Vec::new();
    for (file, text) in sources() {
        let Some(room) = room(&file) else { continue };
        let Some(may) = allowed.get(room) else {
            wrong.push(format!("{file}: room `{room}` has no line in ROOMS"));
            continue;
        };
        for import in imports(&file, &text) {
            if import != room && !may.contains(&import.as_str()) {
                wrong.push(format!("{file}: `{room}` may not import `{import}`"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_plan_itself_has_no_way_back() {
    for (at, (room, may)) in ROOMS.iter().enumerate() {
        for import in *may {
            let earlier = ROOMS[..at].iter().any(|(name, _)| name == import);
            assert!(earlier, "`{room}` imports `{import}`, which comes later");
        }
    }
}

#[test]
fn estimators_know_nothing_of_the_simulator() {
    for room in [
        "motion", "friction", "inertia", "validate", "inspect", "log", "report",
    ] {
        let (_, may) = ROOMS.iter().find(|(name, _)| *name == room).unwrap();
        assert!(!may.contains(&"simulate"), "{room}");
    }
}

#[test]
fn each_large_dependency_has_one_door() {
    let mut wrong = Vec::new();
    for (file, text) in sources() {
        let code = code(&text);
        for (name, door) in DOORS {
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
    for (file, text) in sources() {
        let code = code(&text);
        let shipped = code.split("#[cfg(test)]").next().unwrap();
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

#[test]
fn files_stay_below_600_lines() {
    for (file, text) in sources() {
        let lines = text.lines().count();
        assert!(lines <= 600, "{file} has {lines} lines: that is two ideas");
    }
}

#[test]
fn no_file_is_a_drawer_for_everything() {
    for (file, _) in sources() {
        let stem = Path::new(&file).file_stem().unwrap().to_string_lossy();
        for name in [
            "utils", "util", "helpers", "common", "misc", "prelude", "manager",
        ] {
            assert_ne!(stem, name, "{file}");
        }
    }
}

#[test]
fn the_reading_of_imports_sees_what_it_should() {
    let text = "use crate::{log::Block, motion::{self, Row}, robot};\n\
                use super::super::simulate::run;\n\
                fn f() { crate::report::json::x(); } // crate::cli::nothing\n";
    let found: Vec<String> = imports("friction/filter.rs", text).into_iter().collect();
    assert_eq!(found, ["log", "motion", "report", "robot", "simulate"]);
}
