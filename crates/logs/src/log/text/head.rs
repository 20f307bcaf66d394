//! What the first bytes of a file show: its format, comment sign, delimiter and header.

use std::path::Path;

use super::line::{Line, lines_of};
use super::table::{self, Found};
use crate::log::content::HEAD;
use crate::log::layout::Layout;
use crate::log::{LogError, source};

pub(super) struct Head {
    pub(super) comment: u8,
    pub(super) table: Found,
    /// Column names that stand in a comment line, as numpy writes them.
    pub(super) header_in_comment: Option<String>,
    pub(super) header_line: u64,
    /// The first line holds numbers, and columns are given by number.
    pub(super) headerless: bool,
    /// Bytes and lines before the table.
    pub(super) before: (u64, u64),
}

/// The way out of an HDF5 file or of one of numpy's kinds: every array, by its name.
const HDF5: &str = "write its arrays for numpy: `python -c \"import h5py, numpy; a = {}; h5py.File('IN').visititems(lambda k, v: a.update({k.replace('/', '_'): v[()]} if hasattr(v, 'shape') else {})); numpy.savez('OUT.npz', **a)\"`";
/// Formats that are not read: how a file begins, what it is, and the way out.
const OTHERS: [(&[&[u8]], &str, &str); 15] = [
    (
        &[b"\xff\xfe", b"\xfe\xff"],
        "UTF-16 text",
        "save it as UTF-8: `iconv -f UTF-16 -t UTF-8 IN > OUT`",
    ),
    (
        &[b"#ROSBAG V"],
        "a bag of ROS 1",
        "convert it: `mcap convert IN.bag OUT.mcap`, or `rosbags-convert --src IN.bag --dst OUT`",
    ),
    (
        &[b"\x89HDF\r\n\x1a\n"],
        "an HDF5 file (.h5, or .mat of MATLAB 7.3)",
        HDF5,
    ),
    (
        &[b"MATLAB 5.0 MAT-file"],
        "a MAT-file",
        "write its arrays for numpy: `python -c \"import numpy, scipy.io; numpy.savez('OUT.npz', **{k: v for k, v in scipy.io.loadmat('IN', squeeze_me=True).items() if k[0] != '_'})\"`; or write a table from MATLAB: `writetable(T, 'OUT.csv')`",
    ),
    (
        &[b"PAR1"],
        "a Parquet file, which this program was built without (feature `parquet`)",
        "write it as CSV: `python -c \"import pandas; pandas.read_parquet('IN').to_csv('OUT.csv', index=False)\"`",
    ),
    (
        &[b"ARROW1"],
        "an Arrow file",
        "write it as Parquet: `python -c \"import pandas; pandas.read_feather('IN').to_parquet('OUT.parquet')\"`",
    ),
    (
        &[b"\x80\x04\x95", b"\x80\x05\x95"],
        "a pickle of Python",
        "write its table as CSV: `python -c \"import pandas; pandas.read_pickle('IN').to_csv('OUT.csv', index=False)\"`",
    ),
    (
        &[b"ULog\x01\x12\x35"],
        "a ULog of PX4",
        "write its topics as CSV: `ulog2csv IN.ulg`",
    ),
    (
        &[b"MDF  "],
        "an ASAM MDF file",
        "write it as CSV: `python -c \"import asammdf; asammdf.MDF('IN').to_dataframe(time_from_zero=True).to_csv('OUT.csv')\"`",
    ),
    (
        &[b"TDSm"],
        "a TDMS file of LabVIEW",
        "write it as CSV: `python -c \"import nptdms; nptdms.TdmsFile.read('IN').as_dataframe().to_csv('OUT.csv', index=False)\"`",
    ),
    (
        &[b"RRF"],
        "a recording of Rerun",
        "give the MCAP or CSV that it was made from",
    ),
    (&[b"GIF8", b"\x89PNG"], "a picture", "give the log itself"),
    (&[b"%PDF"], "a PDF document", "give the log itself"),
    (
        &[b"BZh"],
        "compressed with bzip2",
        "unpack it first: `bunzip2 IN.bz2`",
    ),
    (
        &[b"header:\n", b"---\nheader:\n"],
        "what `ros2 topic echo` prints",
        "record the topic instead, `ros2 bag record /joint_states`; or print a table, `ros2 topic echo --csv`",
    ),
];

/// Names a file that is no plain text, by its first bytes.
pub(super) fn refuse_other_formats(path: &Path, head: &[u8]) -> Result<(), LogError> {
    let begins = |begins: &&[u8]| head.starts_with(begins);
    let known = OTHERS.iter().find(|(all, ..)| all.iter().any(begins));
    let (kind, remedy) = match known {
        Some((_, kind, remedy)) => (*kind, *remedy),
        None if head.iter().take(4096).any(|byte| *byte == 0) => (
            "binary, and neither an MCAP recording nor a rosbag2 database",
            "give a text log with a header line, a .mcap or a .db3 file",
        ),
        None => return Ok(()),
    };
    Err(LogError::Format {
        file: source::shown(path),
        kind,
        remedy,
    })
}

pub(super) fn look_at(path: &Path, head: &[u8], layout: &Layout) -> Result<Head, LogError> {
    let file = || source::shown(path);
    let lines = lines_of(head);
    let (mut comment, mut comments) = (None, Vec::new());
    let mut begins = |(at, line): (usize, &Line<'_>)| match line.text.bytes().next() {
        Some(sign @ (b'#' | b'%')) if comment.is_none_or(|known| known == sign) => {
            comment = Some(sign);
            comments.push(at);
            None
        }
        _ => (!line.text.trim().is_empty()).then_some(at),
    };
    let Some(first) = lines.iter().enumerate().find_map(&mut begins) else {
        return Err(match comments.last() {
            Some(_) => LogError::TooFewRows {
                file: file(),
                rows: 0,
            },
            None if head.len() == HEAD => LogError::LongLine {
                at: format!("{}:1", file()),
                limit: HEAD,
            },
            None => LogError::Empty { file: file() },
        });
    };
    let comment = comment.unwrap_or(b'#');
    let table = table::find(&lines, (first, comment), &layout.section);
    let (at, parting) = (table.at, table.parting);
    let (line, number) = (&lines[at].text, lines[at].number);
    let fields = parting.split(line);
    let mut out = Head {
        comment,
        table,
        header_in_comment: None,
        header_line: number,
        headerless: false,
        before: match at > first || layout.section.header_line.is_some() {
            true => (lines[at].begins, number - 1),
            false => (0, 0),
        },
    };
    if fields.iter().all(|field| table::is_datum(field)) {
        // numpy.savetxt puts the names into a comment.
        let of = |k: &usize| {
            let names = parting.split(&lines[*k].text[1..]);
            (names.len() == fields.len()).then_some((*k, names))
        };
        let all: Vec<(usize, Vec<&str>)> = comments.iter().filter_map(of).collect();
        let is_units = |(_, names): &&(usize, Vec<&str>)| table::are_units(names);
        let named = all.iter().rfind(|one| !is_units(one)).or(all.last());
        match named {
            Some((k, _)) => {
                out.header_in_comment = Some(lines[*k].text[1..].to_owned());
                out.header_line = lines[*k].number;
                let below = all.iter().find(|one| one.0 > *k && is_units(one));
                if let Some((k, found)) = below {
                    out.table.units = found.iter().map(|unit| (*unit).to_owned()).collect();
                    let note = format!("units are those of line {}", lines[*k].number);
                    out.table.notes.push(note);
                }
            }
            None if layout.by_number() => out.headerless = true,
            None => {
                let at = format!("{}:{number}", file());
                return Err(LogError::NoHeader { at });
            }
        }
    }
    Ok(out)
}
