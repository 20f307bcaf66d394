//! What the first bytes of a file show: its format, comment sign, delimiter and header.

use std::path::Path;

use super::cells;
use super::header::HeaderLines;
use super::line::{FieldParting, Line, lines_of};
use super::listed::echo_names;
use super::table::{self, TextTable};
use crate::log::content::{DOCUMENT, HEAD};
use crate::log::layout::Layout;
use crate::log::{LogError, source};

/// What the first lines of a text log say of the others.
pub(super) struct TextHead {
    pub(super) comment: u8,
    pub(super) table: TextTable,
    /// Column names that stand in a comment line, as numpy writes them, or in several lines above the numbers.
    pub(super) names: Option<Vec<String>>,
    /// Fields of the first row below them.
    pub(super) first_row: Vec<String>,
    /// Columns of times that must be alike, one for each channel.
    pub(super) clocks: Vec<usize>,
    /// Numbers have commas for points.
    pub(super) commas: bool,
    pub(super) header_line: u64,
    /// The first line holds numbers, and columns are given by number.
    pub(super) headerless: bool,
    /// Bytes and lines before the table.
    pub(super) before: (u64, u64),
}

/// The way out of an HDF5 file or of one of numpy's kinds: every array, by its name.
const HDF5: &str = "write its arrays for numpy: `python -c \"import h5py, numpy; a = {}; h5py.File('IN').visititems(lambda k, v: a.update({k.replace('/', '_'): v[()]} if hasattr(v, 'shape') else {})); numpy.savez('OUT.npz', **a)\"`";
/// Formats that are not read: how a file begins, what it is, and the way out.
const OTHERS: &[(&[&[u8]], &str, &str)] = &[
    (
        &[b"\xff\xfe", b"\xfe\xff"],
        "UTF-16 text",
        "save it as UTF-8: `iconv -f UTF-16 -t UTF-8 IN > OUT`",
    ),
    (
        &[DOCUMENT],
        "a JSON document of this program",
        "give the log that it is of",
    ),
    (
        &[b"#ROSBAG V1"],
        "a bag of ROS 1 before 2010",
        "bring it up to date: `rosbag fix IN.bag OUT.bag`",
    ),
    (
        &[b"\x89HDF\r\n\x1a\n"],
        "an HDF5 file (.h5, or .mat of MATLAB 7.3)",
        HDF5,
    ),
    (
        &[b"MATLAB 7.3 MAT-file"],
        "a MAT-file of MATLAB 7.3, which is HDF5",
        "save it as an earlier one in MATLAB: `save('OUT.mat', '-v7')`; or write its arrays for numpy: `python -c \"import h5py, numpy; a = {}; h5py.File('IN').visititems(lambda k, v: a.update({k.replace('/', '_'): numpy.transpose(v[()])} if hasattr(v, 'shape') and v.dtype.kind in 'iuf' and k[0] != '#' else {})); numpy.savez('OUT.npz', **a)\"`",
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
        &[
            b"<Rob", b"<?xml", b"<root", b"<data", b"<log", b"<Log", b"<Sen",
        ],
        "XML",
        "write it as a table: `python -c \"import csv, re; rows = [{e + '.' + k: v for e, a in re.findall('<(\\w+)([^<>]*)/>', line) for k, v in re.findall('(\\w+)=.([^=]*?).(?= |$|/)', a)} | dict(re.findall('<(\\w+)>([-+.0-9eE]+)</', line)) for line in open('IN') if '<' in line]; w = csv.DictWriter(open('OUT.csv', 'w'), max(rows, key=len)); w.writeheader(); w.writerows(r for r in rows if len(r) > 1)\"`",
    ),
    (
        &[b"\xed\xa1\xda\x01"],
        "a log of LCM",
        "write its channel as CSV with the types of your messages: `lcm-logger` logs are read by `python -c \"import lcm; print(sorted({e.channel for e in lcm.EventLog('IN')}))\"`, which lists the channels",
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
    // a map or a list of few entries, then a text or a map
    let msgpack = matches!(
        head,
        [
            0x81..=0x8f | 0x92..=0x9f | 0xdc..=0xdf,
            0xa1..=0xbf | 0x81..=0x8f | 0xd9 | 0x00,
            ..,
        ]
    ) && std::str::from_utf8(&head[..head.len().min(1024)]).is_err();
    let (kind, remedy) = match known {
        Some((_, kind, remedy)) => (*kind, *remedy),
        None if msgpack => (
            "MessagePack",
            "write it as JSON lines: `python -c \"import json, msgpack; [print(json.dumps(o)) for o in msgpack.Unpacker(open('IN', 'rb'))]\" > OUT.json`",
        ),
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

pub(super) fn look_at(path: &Path, head: &[u8], layout: &Layout) -> Result<TextHead, LogError> {
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
    let rows: Vec<usize> = (first..lines.len())
        .filter(|k| {
            let text = lines[*k].text.trim();
            !text.is_empty() && !text.starts_with(char::from(comment))
        })
        .collect();
    let table = table::find(&lines, (first, comment), &layout.section);
    if layout.section.header_line.is_none() {
        let made = of_several_lines(&lines, &rows, &table, comment, layout);
        let echoed = || of_echo(&lines, &rows, comment).filter(|_| comments.is_empty());
        if let Some(head) = made.or_else(echoed) {
            return Ok(head);
        }
    }
    let (at, parting) = (table.at, table.parting);
    let (line, number) = (&lines[at].text, lines[at].number);
    let fields = parting.split(line);
    let mut out = TextHead {
        comment,
        table,
        names: None,
        first_row: Vec::new(),
        clocks: Vec::new(),
        commas: has_commas(&lines, &rows, parting),
        header_line: number,
        headerless: false,
        before: match at > first || layout.section.header_line.is_some() {
            true => (lines[at].begins, number - 1),
            false => (0, 0),
        },
    };
    let numbers = fields.iter().all(|field| table::is_datum(field));
    if numbers || is_row(&fields, &lines, &rows, (at, parting)) {
        // numpy.savetxt puts the names into a comment, `rostopic echo -p` does beside columns of text
        let of = |k: &usize| {
            let names = parting.split(&lines[*k].text[1..]);
            (names.len() == fields.len()).then_some((*k, names))
        };
        let all: Vec<(usize, Vec<&str>)> = comments.iter().filter_map(of).collect();
        let is_units = |(_, names): &&(usize, Vec<&str>)| table::are_units(names);
        let named = all.iter().rfind(|one| !is_units(one)).or(all.last());
        match named {
            Some((k, _)) => {
                let names = parting.split(&lines[*k].text[1..]).into_iter();
                out.names = Some(names.map(str::to_owned).collect());
                out.header_line = lines[*k].number;
                let below = all.iter().find(|one| one.0 > *k && is_units(one));
                if let Some((k, found)) = below {
                    out.table.units = found.iter().map(|unit| (*unit).to_owned()).collect();
                    let note = format!("units are those of line {}", lines[*k].number);
                    out.table.notes.push(note);
                }
            }
            None if !numbers => {}
            None if layout.by_number() => out.headerless = true,
            None => {
                let at = format!("{}:{number}", file());
                return Err(LogError::NoHeader { at });
            }
        }
    }
    let below = match out.names.is_some() {
        true => 0,
        false => 1 + usize::from(out.table.second_row),
    };
    let row = rows.iter().position(|row| *row == at);
    let row = row.and_then(|row| rows.get(row + below));
    let fields = row
        .map(|row| parting.split(&lines[*row].text))
        .unwrap_or_default();
    if out.names.is_none() && !out.headerless {
        let header: Vec<String> = parting
            .split(&lines[at].text)
            .iter()
            .map(|name| name.trim_matches('"').to_owned())
            .collect();
        let below: Vec<usize> = rows.iter().copied().skip_while(|row| *row <= at).collect();
        cells::check(&file(), &header, &lines, &below, parting)?;
    }
    out.first_row = fields.into_iter().map(str::to_owned).collect();
    Ok(out)
}

/// Whether the first line has its numbers where the next row has them, as another row has.
fn is_row(
    fields: &[&str],
    lines: &[Line<'_>],
    rows: &[usize],
    (at, parting): (usize, FieldParting),
) -> bool {
    let numbers = |fields: &[&str]| -> Vec<bool> {
        fields.iter().map(|field| table::is_datum(field)).collect()
    };
    let own = numbers(fields);
    let next = rows.iter().find(|row| **row > at);
    let next = next.map(|row| numbers(&parting.split(&lines[*row].text)));
    own.contains(&true) && next.as_ref() == Some(&own)
}

/// Whether numbers have commas for points, and none has a point.
fn has_commas(lines: &[Line<'_>], rows: &[usize], parting: FieldParting) -> bool {
    if parting.sign == b',' {
        return false;
    }
    let mut any = false;
    // of a few rows at both ends; a preamble may hold versions and dates
    for row in rows.iter().rev().take(200) {
        for field in parting.split(&lines[*row].text) {
            if field.contains('.') && table::is_datum(field) {
                return false;
            }
            let comma = field.matches(',').count() == 1;
            any |= comma && !table::is_datum(field) && table::is_datum(&field.replace(',', "."));
        }
    }
    any
}

fn owned(fields: Vec<&str>) -> Vec<String> {
    fields.into_iter().map(str::to_owned).collect()
}

/// Names in several lines above the numbers.
fn of_several_lines(
    lines: &[Line<'_>],
    rows: &[usize],
    table: &TextTable,
    comment: u8,
    layout: &Layout,
) -> Option<TextHead> {
    let asked = layout.section.delimiter;
    let found = HeaderLines::find(lines, rows, table.at, asked)?;
    let parting = FieldParting::of(&lines[*rows.last()?].text, asked);
    let data = &lines[found.data];
    Some(TextHead {
        comment,
        table: TextTable {
            at: found.line,
            parting,
            second_row: false,
            units: found.units,
            notes: vec![found.note],
        },
        first_row: owned(parting.split(&data.text)),
        names: Some(found.names),
        clocks: found.clocks,
        commas: has_commas(lines, rows, parting),
        header_line: lines[found.line].number,
        headerless: false,
        before: (data.begins, data.number - 1),
    })
}

/// Lines of `ros2 topic echo --csv`, which prints no names.
fn of_echo(lines: &[Line<'_>], rows: &[usize], comment: u8) -> Option<TextHead> {
    let parting = FieldParting {
        sign: b',',
        runs: false,
    };
    let split = |row: &usize| parting.split(&lines[*row].text);
    let all: Vec<Vec<&str>> = rows.iter().map(split).collect();
    let names = echo_names(&all)?;
    let first = &lines[rows[0]];
    Some(TextHead {
        comment,
        table: TextTable {
            at: rows[0],
            parting,
            second_row: false,
            units: Vec::new(),
            notes: vec!["the lines are those of `ros2 topic echo --csv`".to_owned()],
        },
        names: Some(names),
        first_row: owned(all[0].clone()),
        clocks: Vec::new(),
        commas: false,
        header_line: first.number,
        headerless: false,
        before: (first.begins, first.number - 1),
    })
}
