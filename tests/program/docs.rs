//! The documents say what the results say, and point to what is there.

#[path = "../../crates/studies/examples/docs_tables/arms.rs"]
mod arms;
#[path = "../../crates/studies/examples/docs_tables/blocks.rs"]
mod blocks;
#[path = "../../crates/studies/examples/docs_tables/drives.rs"]
mod drives;
#[path = "../../crates/studies/examples/docs_tables/formulas.rs"]
mod formulas;
#[path = "../../crates/studies/examples/docs_tables/simulators.rs"]
mod simulators;
#[path = "../../crates/studies/examples/docs_tables/tables.rs"]
mod tables;

use std::fs;
use std::path::Path;

fn root() -> &'static Path {
    Path::new(cft_ident_support::ROOT)
}

#[test]
fn every_table_is_that_of_its_result() {
    for path in blocks::documents(root()) {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.strip_prefix(root()).unwrap().display();
        let anew = blocks::rewritten(&text, &tables::render)
            .unwrap_or_else(|problem| panic!("{name}: {problem}"));
        assert!(
            anew == text,
            "{name} is not that of docs/results: cargo run -p cft-ident-studies --example docs_tables"
        );
    }
}

#[test]
fn every_result_stands_in_a_document() {
    let texts: String = blocks::documents(root())
        .iter()
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    let blocks: Vec<&str> = texts
        .lines()
        .filter(|line| line.starts_with("<!-- table: "))
        .collect();
    for entry in fs::read_dir(root().join("docs/results")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy();
        // the pages that show results, and those of measured machines
        if path.extension().is_some_and(|e| e == "md") || name == "measured" {
            continue;
        }
        // the page of independent studies is made from their lines alone, and crates/studies holds it to them
        if let Some(study) = name.strip_prefix("independent_") {
            let mark = format!("<!-- study: {study} -->");
            assert!(texts.contains(&mark), "{name}");
            continue;
        }
        // the lines of a study stand beside the table that is made from them
        if path.extension().is_some_and(|e| e == "jsonl") {
            let table = name.strip_suffix("_rows").expect("lines are called so");
            assert!(
                path.with_file_name(format!("{table}.json")).exists(),
                "{name}"
            );
            continue;
        }
        // a file, or a file and the title of its line
        let file = |word: &str| word.split(':').next() == Some(&*name);
        let shown = |line: &&&str| line.split_whitespace().any(file);
        assert!(
            blocks.iter().find(shown).is_some(),
            "{name} is shown nowhere"
        );
    }
}

/// Targets of `[text](target)` and `![text](target)`.
fn links(text: &str) -> Vec<&str> {
    let after = text.split("](").skip(1);
    after.filter_map(|rest| rest.split(')').next()).collect()
}

#[test]
fn the_page_has_every_effect_whose_numbers_have_a_range() {
    let page = fs::read_to_string(root().join("docs/developers/diagnosis.md")).unwrap();
    let (_, rest) = page.split_once("## What a name must satisfy").unwrap();
    let (section, _) = rest.split_once("\n## ").unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| "));
    let names = rows
        .skip(2)
        .flat_map(|row| row.split('|').nth(1).unwrap().split(','));
    let named: Vec<&str> = names.map(str::trim).collect();
    let mut held: Vec<&str> = cft_ident::effect::LAWS
        .iter()
        .filter(|law| !law.entry.must.is_empty())
        .map(|law| law.entry.name)
        .collect();
    held.dedup();
    for name in &held {
        assert!(named.contains(name), "{name} is not mentioned");
    }
    assert_eq!(named.len(), held.len(), "{named:?}");
}

#[test]
fn every_link_inside_the_repository_leads_somewhere() {
    for path in blocks::documents(root()) {
        let text = fs::read_to_string(&path).unwrap();
        for link in links(&text) {
            let target = link.split('#').next().unwrap();
            if target.is_empty() || target.contains("://") {
                continue;
            }
            let there = path.parent().unwrap().join(target);
            assert!(there.exists(), "{}: {link}", path.display());
        }
    }
}

/// The anchor of a heading, as GitHub and mdbook make it.
fn anchor(heading: &str) -> String {
    let plain = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = plain.chars().filter_map(|c| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    });
    kept.collect()
}

#[test]
fn every_link_to_a_section_finds_its_heading() {
    let mut seen = 0;
    for path in blocks::documents(root()) {
        let text = fs::read_to_string(&path).unwrap();
        for link in links(&text) {
            let Some((target, section)) = link.split_once('#') else {
                continue;
            };
            if target.contains("://") {
                continue;
            }
            let page = match target {
                "" => text.clone(),
                file => fs::read_to_string(path.parent().unwrap().join(file)).unwrap(),
            };
            let mut headings = page.lines().filter(|line| line.starts_with('#'));
            let found = headings.any(|line| anchor(line) == section);
            assert!(found, "{}: {link}", path.display());
            seen += 1;
        }
    }
    assert!(seen >= 3, "{seen}");
}

#[test]
fn every_page_of_the_manual_stands_in_its_summary() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let listed = links(&summary);
    for path in blocks::documents(root()) {
        let Ok(page) = path.strip_prefix(root().join("docs")) else {
            continue;
        };
        let page = page.to_string_lossy();
        let itself = page == "SUMMARY.md";
        assert!(
            itself || listed.contains(&&*page),
            "{page} is not in docs/SUMMARY.md"
        );
    }
}

#[test]
fn every_figure_stands_in_a_document_and_is_the_tools_own() {
    let texts: Vec<String> = blocks::documents(root())
        .iter()
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    for entry in fs::read_dir(root().join("docs/figures")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy();
        assert!(name.ends_with(".svg") || name.ends_with(".png"), "{name}");
        let shown = texts
            .iter()
            .any(|text| links(text).iter().any(|l| l.ends_with(&*name)));
        assert!(shown, "{name} is shown nowhere");
    }
}

#[test]
fn a_block_is_replaced_and_the_rest_is_kept() {
    let text = "a\n<!-- table: kind file -->\nold\n<!-- end of table -->\nb\n";
    let anew = blocks::rewritten(text, &|words| Ok(words.join("+"))).unwrap();
    assert_eq!(
        anew,
        "a\n<!-- table: kind file -->\n\nkind+file\n\n<!-- end of table -->\nb\n"
    );
    let unknown = blocks::rewritten(text, &tables::render);
    assert!(unknown.unwrap_err().contains("no known kind"));
    let open = "<!-- table: kind file -->\nold\n";
    assert!(blocks::rewritten(open, &|_| Ok(String::new())).is_err());
}

/// Words of two texts; numbers may differ in what the table rounds away, or by a little noise.
fn same_but_for_rounding(committed: &str, fresh: &str) -> Result<(), String> {
    let lines = |text: &str| -> Vec<String> { text.lines().map(str::to_owned).collect() };
    let (a, b) = (lines(committed), lines(fresh));
    if a.len() != b.len() {
        return Err(format!("{} lines, now {}", a.len(), b.len()));
    }
    for (a, b) in a.iter().zip(&b) {
        let words = |line: &str| -> Vec<String> {
            let trim = |word: &str| word.trim_matches(['(', ')', ',', ';']).to_owned();
            // rules are as long as the longest number is
            let no_rule = |word: &&str| !word.starts_with("--");
            line.split_whitespace().filter(no_rule).map(trim).collect()
        };
        let near = |a: &String, b: &String| match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => (a - b).abs() <= 0.05 * a.abs().max(b.abs()) + 0.11,
            _ => a == b,
        };
        let (x, y) = (words(a), words(b));
        if x.len() != y.len() || !x.iter().zip(&y).all(|(x, y)| near(x, y)) {
            return Err(format!("committed: {a}\nnow:       {b}"));
        }
    }
    Ok(())
}

#[test]
fn the_readme_shows_what_identify_prints() {
    let folder = tempfile::tempdir().unwrap();
    let run = assert_cmd::Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder.path())
        .args(["identify", "--verbose"])
        .assert()
        .code(0);
    let fresh = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    let committed = fs::read_to_string(root().join("docs/results/identify.txt")).unwrap();
    let same = same_but_for_rounding(&committed, &fresh);
    assert!(same.is_ok(), "{}\nrun docs/generate", same.unwrap_err());
}
