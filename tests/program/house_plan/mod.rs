//! What imports what, read from the sources: `use` and every path that begins with `crate`, `self`
//! or `super`, followed to the file that defines its end, through `pub use` of modules on the way.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A source file: `log/csv.rs` is the module `log`, `csv`, and so is `log/csv/mod.rs`.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Source {
    /// Its path below the `src` of its crate.
    pub file: String,
    pub path: PathBuf,
    pub text: String,
    pub module: Vec<String>,
}

impl Source {
    fn new(file: String, path: PathBuf, text: String) -> Self {
        let stem = file.strip_suffix(".rs").unwrap_or(&file);
        let stem = stem.strip_suffix("/mod").unwrap_or(stem);
        let module = match stem {
            "lib" => Vec::new(),
            stem => stem.split('/').map(str::to_owned).collect(),
        };
        Self {
            file,
            path,
            text,
            module,
        }
    }

    /// The room that it belongs to; `None` for `lib.rs` and `main.rs`.
    pub fn room(&self) -> Option<&str> {
        let first = self.module.first()?;
        (first != "main").then_some(first)
    }
}

/// Every source file.
pub fn sources() -> Vec<Source> {
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
    let root = Path::new(cft_ident_support::ROOT);
    let mut folders = vec![root.join("src")];
    for entry in fs::read_dir(root.join("crates")).unwrap() {
        folders.push(entry.unwrap().path().join("src"));
    }
    let of_tests = ["support", "studies"].map(|name| root.join("crates").join(name).join("src"));
    folders.retain(|folder| !of_tests.contains(folder));
    folders.sort();
    let mut found = Vec::new();
    for folder in folders {
        let mut paths = Vec::new();
        walk(&folder, &mut paths);
        paths.retain(|path| *path != folder.join("lib.rs"));
        paths.sort();
        found.extend(paths.into_iter().map(|path| {
            let name = path.strip_prefix(&folder).unwrap().to_string_lossy();
            let text = fs::read_to_string(&path).unwrap();
            Source::new(name.replace('\\', "/"), path.clone(), of_one_crate(&text))
        }));
    }
    found
}

/// Paths into another crate as if all were one: the rooms have names of their own.
fn of_one_crate(text: &str) -> String {
    let mut parts = text.split("cft_ident_");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part
            .find(|c: char| !c.is_alphanumeric())
            .unwrap_or(part.len());
        // the derive is no room
        let import = part[end..].starts_with("::") && &part[..end] != "derive";
        out.push_str(if import { "crate" } else { "cft_ident_" });
        out.push_str(if import { &part[end..] } else { part });
    }
    out
}

/// A text without comments and without what stands between quotes.
pub fn code(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let end =
            |from: usize, what: &str| rest[from..].find(what).map(|at| from + at + what.len());
        let hashes = rest[1.min(rest.len())..]
            .chars()
            .take_while(|c| *c == '#')
            .count();
        let word = out.ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let passed = if rest.starts_with("//") {
            rest.find('\n')
        } else if rest.starts_with("/*") {
            end(2, "*/")
        } else if c == 'r' && !word && rest[1 + hashes..].starts_with('"') {
            out.push_str("\"\"");
            end(hashes + 2, &format!("\"{}", "#".repeat(hashes)))
        } else if c == '"' {
            out.push_str("\"\"");
            let mut escaped = false;
            let closes = |c: char| {
                let closes = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                closes
            };
            rest[1..].find(closes).map(|at| at + 2)
        } else if rest.starts_with("'\\") {
            end(3, "'")
        } else if c == '\'' && rest.chars().nth(2) == Some('\'') {
            end(1 + rest[1..].chars().next().map_or(0, char::len_utf8), "'")
        } else {
            out.push(c);
            Some(c.len_utf8())
        };
        rest = &rest[passed.unwrap_or(rest.len())..];
    }
    out
}

/// [`code`] without the tests in it.
pub fn shipped(text: &str) -> String {
    const TESTS: &str = "#[cfg(test)]";
    let code = code(text);
    let mut parts = code.split(TESTS);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        // the item that follows ends with its body, or where it has none
        let mut depth = 0;
        let end = part.char_indices().find(|(_, c)| {
            depth += i32::from(*c == '{') - i32::from(*c == '}');
            depth == 0 && matches!(c, '}' | ';')
        });
        out.push_str(end.map_or("", |(at, c)| &part[at + c.len_utf8()..]));
    }
    out
}

/// Words, `::` and every other sign of a code.
fn tokens(code: &str) -> Vec<&str> {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = Vec::new();
    let mut rest = code.trim_start();
    while let Some(c) = rest.chars().next() {
        let length = match c {
            c if word(c) => rest.find(|c| !word(c)).unwrap_or(rest.len()),
            ':' if rest.starts_with("::") => 2,
            c => c.len_utf8(),
        };
        out.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    out
}

type Module = Vec<String>;

/// The paths that one file names.
#[derive(Default)]
struct Named {
    /// From the crate's root.
    paths: BTreeSet<Module>,
    /// What its `use` gives a name in the file's own module: the name and the path.
    given: BTreeMap<String, Module>,
}

/// A reader of one file's tokens.
struct Reading<'t> {
    tokens: Vec<&'t str>,
    at: usize,
    /// The module whose text this is, those inside the file included, each with the depth of braces
    /// at which it began.
    module: Module,
    inner: Vec<usize>,
    modules: &'t BTreeSet<Module>,
    named: Named,
}

impl<'t> Reading<'t> {
    fn next(&mut self) -> &'t str {
        self.at += 1;
        self.peek(-1)
    }

    fn peek(&self, by: isize) -> &'t str {
        let at = self.at.checked_add_signed(by);
        at.and_then(|at| self.tokens.get(at).copied()).unwrap_or("")
    }

    fn file(mut self) -> Named {
        let mut depth = 0;
        while self.at < self.tokens.len() {
            match self.next() {
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    if self.inner.last() == Some(&depth) {
                        self.inner.pop();
                        self.module.pop();
                    }
                }
                "mod" if self.peek(1) == "{" => {
                    let name = self.next().to_owned();
                    self.module.push(name);
                    self.inner.push(depth);
                }
                // not that of `impl Trait + use<'a>`
                "use" if self.peek(0) != "<" => self.tree(&[]),
                // not the place in `pub(in crate::log)`
                "in" if self.peek(-2) == "(" && self.peek(-3) == "pub" => {
                    self.next();
                }
                first @ ("crate" | "self" | "super")
                    if self.peek(0) == "::" && self.peek(-2) != "::" =>
                {
                    let mut path = vec![first];
                    while self.peek(0) == "::"
                        && self
                            .peek(1)
                            .starts_with(|c: char| c.is_alphabetic() || c == '_')
                    {
                        self.next();
                        path.push(self.next());
                    }
                    self.named.paths.extend(self.rooted(&path));
                }
                _ => {}
            }
        }
        self.named
    }

    /// A tree of `use`: `a::{b, c as d}`, behind `before`.
    fn tree(&mut self, before: &[&'t str]) {
        let mut path = before.to_vec();
        loop {
            match self.next() {
                "{" => {
                    while !matches!(self.peek(0), "}" | "") {
                        self.tree(&path);
                        if self.peek(0) == "," {
                            self.next();
                        }
                    }
                    self.next();
                    return;
                }
                "::" => continue,
                "*" => break,
                "" => return,
                word => path.push(word),
            }
            if self.peek(0) != "::" {
                break;
            }
        }
        if path.last() == Some(&"self") && path.len() > 1 {
            path.pop();
        }
        let mut name = path.last().copied().unwrap_or_default();
        if self.peek(0) == "as" {
            self.next();
            name = self.next();
        }
        if let Some(path) = self.rooted(&path) {
            if self.inner.is_empty() {
                self.named.given.insert(name.to_owned(), path.clone());
            }
            self.named.paths.insert(path);
        }
    }

    /// A path from the crate's root; `None` for one of another crate.
    fn rooted(&self, path: &[&str]) -> Option<Module> {
        let mut module = self.module.clone();
        let mut rest = path;
        match *path.first()? {
            "crate" => module.clear(),
            "self" | "super" => {}
            first => {
                module.push(first.to_owned());
                if !self.modules.contains(&module) {
                    return None;
                }
                module.pop();
            }
        }
        while let [first @ ("crate" | "self" | "super"), tail @ ..] = rest {
            if *first == "super" {
                module.pop();
            }
            rest = tail;
        }
        module.extend(rest.iter().map(|&word| word.to_owned()));
        Some(module)
    }
}

/// Which file imports which.
pub struct Imports<'s> {
    sources: &'s [Source],
    /// Indices of the one that imports and of the one that is imported.
    between: BTreeSet<(usize, usize)>,
}

/// What ties two children of a folder: the imports of the first from the second.
type Ties<'a> = BTreeMap<(&'a str, &'a str), Vec<String>>;

impl<'s> Imports<'s> {
    /// Reads what `part` leaves of each text: [`code`] or [`shipped`].
    pub fn read(sources: &'s [Source], part: fn(&str) -> String) -> Self {
        let modules: BTreeSet<Module> = sources.iter().map(|s| s.module.clone()).collect();
        let texts: Vec<String> = sources.iter().map(|s| part(&s.text)).collect();
        let named = |(source, text): (&Source, &String)| {
            Reading {
                tokens: tokens(text),
                at: 0,
                module: source.module.clone(),
                inner: Vec::new(),
                modules: &modules,
                named: Named::default(),
            }
            .file()
        };
        let named: Vec<Named> = sources.iter().zip(&texts).map(named).collect();
        let place: BTreeMap<&[String], usize> = sources
            .iter()
            .enumerate()
            .map(|(index, source)| (&source.module[..], index))
            .collect();
        let mut between = BTreeSet::new();
        for (from, file) in named.iter().enumerate() {
            for path in &file.paths {
                let to = home(path, &place, &named);
                between.extend((to != from).then_some((from, to)));
            }
        }
        Self { sources, between }
    }

    /// Pairs of the file that imports and the one that is imported.
    pub fn between_files(&self) -> impl Iterator<Item = (&Source, &Source)> {
        let source = |index: usize| &self.sources[index];
        self.between
            .iter()
            .map(move |(from, to)| (source(*from), source(*to)))
    }

    /// Circles among the files and folders of each folder, each with the imports that tie it. What
    /// a `mod.rs` and the files below it import of each other is none.
    pub fn circles(&self) -> Vec<(String, Vec<String>)> {
        // of each folder, which of its files and folders imports which, by what
        let mut folders: BTreeMap<&[String], Ties> = BTreeMap::new();
        for (from, to) in self.between_files() {
            let same = from
                .module
                .iter()
                .zip(&to.module)
                .take_while(|(a, b)| a == b);
            let depth = same.count();
            if let (Some(a), Some(b)) = (from.module.get(depth), to.module.get(depth)) {
                let ties = folders.entry(&from.module[..depth]).or_default();
                let ties = ties.entry((a, b)).or_default();
                ties.push(format!("{} -> {}", from.file, to.file));
            }
        }
        let mut circles = Vec::new();
        for (folder, ties) in folders {
            let mut left: BTreeSet<&str> = ties.keys().map(|(from, _)| *from).collect();
            while let Some(first) = left.pop_first() {
                let there = reached(first, &ties);
                let mut circle: BTreeSet<&str> = there
                    .into_iter()
                    .filter(|name| *name != first && reached(name, &ties).contains(first))
                    .collect();
                if circle.is_empty() {
                    continue;
                }
                circle.insert(first);
                left.retain(|name| !circle.contains(name));
                let names: Vec<&str> = circle.iter().copied().collect();
                let tying = ties
                    .iter()
                    .filter(|((from, to), _)| circle.contains(from) && circle.contains(to));
                let name = format!("{}: {}", folder.join("/"), names.join(", "));
                circles.push((name, tying.flat_map(|(_, files)| files.clone()).collect()));
            }
        }
        circles
    }
}

/// The file that defines the end of a path: the last module on its way, and on from there where that
/// only passes the name on.
fn home(path: &[String], place: &BTreeMap<&[String], usize>, named: &[Named]) -> usize {
    let mut path = path.to_vec();
    // a name that is passed on in a circle does not compile
    loop {
        let modules = (0..=path.len()).rev();
        let (depth, file) = modules
            .filter_map(|depth| Some((depth, *place.get(&path[..depth])?)))
            .next()
            .expect("lib.rs is the root of every path");
        let passed_on = path.get(depth).and_then(|name| named[file].given.get(name));
        match passed_on {
            Some(target) if *target != path[..=depth] => {
                path = [&target[..], &path[depth + 1..]].concat();
            }
            _ => return file,
        }
    }
}

/// What can be reached from a name.
fn reached<'n>(
    name: &'n str,
    ties: &BTreeMap<(&'n str, &'n str), Vec<String>>,
) -> BTreeSet<&'n str> {
    let mut found = BTreeSet::new();
    let mut open = vec![name];
    while let Some(name) = open.pop() {
        for (_, to) in ties.keys().filter(|(from, _)| *from == name) {
            if found.insert(*to) {
                open.push(to);
            }
        }
    }
    found
}

#[test]
fn the_reading_of_imports_sees_what_it_should() {
    let source =
        |file: &str, text: &str| Source::new(file.to_owned(), PathBuf::new(), text.to_owned());
    let sources = [
        source("lib.rs", "pub mod friction; pub mod log;"),
        source(
            "friction/filter.rs",
            "use crate::{log::Block, motion::{self, Row as R}, robot};\n\
             use std::fmt; /* use crate::cli; */\n\
             const TEXT: &str = \"crate::cli\"; const RAW: &str = r#\"use \"crate::cli\";\"#;\n\
             pub(in crate::friction) fn f<'a>(c: char) { c == '\"'; super::super::simulate::run(); } // crate::cli::x\n\
             mod inner { use super::super::start; fn g() { crate::report::json::x::<super::T>(); } }\n\
             #[cfg(test)]\nmod tests { use super::*; use crate::compare; }",
        ),
        source("friction/mod.rs", "mod filter; mod start;"),
        source("friction/start.rs", "use super::filter::Filter;"),
        source("log/mod.rs", "mod block; pub use block::Block;"),
        source("log/block.rs", "pub struct Block;"),
        source("motion.rs", "pub struct Row;"),
        source("robot.rs", ""),
        source("report/json.rs", ""),
        source("report/mod.rs", ""),
        source("simulate/mod.rs", "pub fn run() {}"),
        source("compare.rs", ""),
        source("cli.rs", ""),
    ];
    let imports = Imports::read(&sources, shipped);
    let of = |imports: &Imports, file: &str| -> Vec<String> {
        let pairs = imports.between_files();
        let found = pairs.filter(|(from, _)| from.file == file);
        found.map(|(_, to)| to.file.clone()).collect()
    };
    let expected = [
        "friction/start.rs",
        "log/block.rs",
        "motion.rs",
        "robot.rs",
        "report/json.rs",
        "simulate/mod.rs",
    ];
    assert_eq!(of(&imports, "friction/filter.rs"), expected);
    let circles: Vec<String> = imports
        .circles()
        .into_iter()
        .map(|(name, _)| name)
        .collect();
    assert_eq!(circles, ["friction: filter, start"]);
    let with_tests = Imports::read(&sources, code);
    assert!(of(&with_tests, "friction/filter.rs").contains(&"compare.rs".to_owned()));
}
