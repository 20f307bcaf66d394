//! Whether two logs that are given hold the same rows: a file twice, a copy of it, spans that overlap.

use std::fs::Metadata;
use std::path::PathBuf;

use super::source::sha256_of;
use super::{Layout, LogError, LogSpec, Provenance, RawBlock, RawReader, Span};

/// Whether rows of one log are rows of the other, by the bytes of their files and by their spans; `layout` says
/// the time column where a robot is known. Files that cannot be read share nothing: their reader says why.
pub fn shares_rows(a: &LogSpec, b: &LogSpec, layout: Option<&Layout>) -> bool {
    let same = |(a, b): (Vec<PathBuf>, Vec<PathBuf>)| same_bytes(&a, &b);
    let files = a.files().ok().zip(b.files().ok());
    // a folder that is no recording is known by its name alone
    let one_path = a.path.canonicalize().is_ok_and(|path| {
        let other = b.path.canonicalize();
        other.is_ok_and(|other| other == path)
    });
    (one_path || files.is_some_and(same)) && overlap(a, b, layout)
}

impl Provenance {
    /// Whether both are rows of one log and have some in common, by checksum and span.
    pub fn shares_rows(&self, other: &Self) -> bool {
        let span = |of: &Self| of.span.as_deref().map_or(Span::Whole, Span::read);
        self.sha256 == other.sha256 && span(self).meets(span(other))
    }
}

/// Whether files hold the same bytes. Only those of the same lengths are read for it.
fn same_bytes(a: &[PathBuf], b: &[PathBuf]) -> bool {
    let names = |files: &[PathBuf]| files.iter().map(|file| file.canonicalize().ok()).collect();
    let (of_a, of_b): (Vec<_>, Vec<_>) = (names(a), names(b));
    if of_a == of_b && of_a.iter().all(Option::is_some) {
        return true;
    }
    // what is no file, a pipe, can be read but once
    let length = |file: &PathBuf| {
        let about = file.metadata().ok().filter(Metadata::is_file);
        about.map(|about| about.len())
    };
    let lengths = |files: &[PathBuf]| files.iter().map(length).collect::<Option<Vec<u64>>>();
    let of_a = lengths(a);
    of_a.is_some()
        && of_a == lengths(b)
        && sha256_of(a).is_ok_and(|sum| sha256_of(b).is_ok_and(|other| sum == other))
}

/// Whether the spans of one log have rows in common; both are half open.
fn overlap(a: &LogSpec, b: &LogSpec, layout: Option<&Layout>) -> bool {
    use Span::{Percent, Seconds};
    match (a.span, b.span) {
        (Percent { from, to }, seconds @ Seconds { .. })
        | (seconds @ Seconds { .. }, Percent { from, to }) => {
            duration_s(a, layout).is_ok_and(|all| {
                let [from, to] = [from, to].map(|percent| all * percent / 100.0);
                Seconds { from, to }.meets(seconds)
            })
        }
        (a, b) => a.meets(b),
    }
}

/// Time from the first to the last row of the whole log [s].
fn duration_s(log: &LogSpec, layout: Option<&Layout>) -> Result<f64, LogError> {
    let mut reader = RawReader::open(&LogSpec::whole(&log.path), layout)?;
    let mut block = RawBlock::default();
    while reader.read(&mut block)? {}
    Ok(reader.duration_s())
}

#[cfg(test)]
mod tests {
    use super::super::DataRole;
    use super::*;

    fn specs(folder: &std::path::Path, a: &str, b: &str) -> [LogSpec; 2] {
        [a, b].map(|name| folder.join(name).display().to_string().parse().unwrap())
    }

    #[test]
    fn inputs_share_rows_where_their_spans_meet_and_a_held_out_one_made_nothing() {
        let input = |span: &str| Provenance {
            span: Some(span.to_owned()).filter(|span| !span.is_empty()),
            samples: 9,
            ..Provenance::of_text("a.csv", "rows")
        };
        let share = |a: &str, b: &str| input(a).shares_rows(&input(b));
        assert!(share("", "") && share("", "0..70%") && share("0..70%", "60..100%"));
        assert!(!share("0..70%", "70..100%") && !share("0..10s", "10..s"));
        // of other units nothing is known
        assert!(share("0..70%", "20..30s"));
        assert!(!input("").shares_rows(&Provenance::of_text("a.csv", "others")));
        assert!(input("").made() && input("").used_as(DataRole::Fitted).made());
        assert!(!input("").used_as(DataRole::HeldOut).made());
    }

    #[test]
    fn copies_and_overlapping_spans_share_rows_and_halves_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let rows = (0..1001).map(|k| format!("{},0\n", f64::from(k) / 100.0));
        let text = format!("t,q_a\n{}", rows.collect::<String>());
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("a.csv", &text);
        write("copy.csv", &text);
        write("other.csv", &text.replace("10,0", "10,1"));
        for (a, b, shared) in [
            ("a.csv", "a.csv", true),
            ("a.csv", "copy.csv", true),
            ("a.csv", "other.csv", false),
            ("a.csv", "none.csv", false),
            ("a.csv@0..70%", "a.csv@70..100%", false),
            ("a.csv@0..70%", "copy.csv@69..100%", true),
            ("a.csv@0..7s", "a.csv@7..s", false),
            ("a.csv@0..7s", "a.csv", true),
            ("a.csv@0..70%", "a.csv@7..s", false),
            ("a.csv@6.9..s", "copy.csv@0..70%", true),
        ] {
            let [first, second] = specs(folder.path(), a, b);
            assert_eq!(shares_rows(&first, &second, None), shared, "{a} {b}");
        }
    }
}
