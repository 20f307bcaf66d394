//! Marked blocks in Markdown, and the documents that have them.

use std::path::{Path, PathBuf};

const BEGIN: &str = "<!-- table: ";
const CLOSE: &str = " -->";
const END: &str = "<!-- end of table -->";

/// README.md and the pages of docs, in the order of their names.
pub fn documents(root: &Path) -> Vec<PathBuf> {
    let mut found = vec![root.join("README.md")];
    for folder in [
        "docs",
        "docs/developers",
        "docs/results",
        "docs/results/measured",
    ] {
        let entries = std::fs::read_dir(root.join(folder)).into_iter().flatten();
        let markdown = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.extension().is_some_and(|end| end == "md"));
        found.extend(markdown);
    }
    found.sort();
    found
}

/// The text with every block rendered anew from its words: the kind, then its files.
pub fn rewritten(
    text: &str,
    render: &dyn Fn(&[&str]) -> Result<String, String>,
) -> Result<String, String> {
    let mut out = String::with_capacity(text.len());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        out.push_str(line);
        out.push('\n');
        let Some(words) = line.strip_prefix(BEGIN).and_then(|l| l.strip_suffix(CLOSE)) else {
            continue;
        };
        if !lines.any(|line| line == END) {
            return Err(format!("`{line}` has no `{END}`"));
        }
        let words: Vec<&str> = words.split_whitespace().collect();
        let block = render(&words).map_err(|problem| format!("`{line}`: {problem}"))?;
        out.push_str(&format!("\n{}\n\n{END}\n", block.trim_end()));
    }
    Ok(out)
}
