//! Tables whose rows or cells hold more than one number a column: a row for each joint, lists in cells.

use super::line::{FieldParting, Line};
use super::number;
use super::table::is_datum;
use crate::log::time::Instant;
use crate::log::{LogError, escape};

/// Rows that are looked at.
const ROWS: usize = 400;

/// Fields of a line; what stands in quotes is one.
fn fields(line: &str, parting: FieldParting) -> Vec<&str> {
    let (mut out, mut quoted, mut from) = (Vec::new(), false, 0);
    for (at, byte) in line.bytes().enumerate() {
        quoted ^= byte == b'"';
        if byte == parting.sign && !quoted {
            out.push(&line[from..at]);
            from = at + 1;
        }
    }
    out.push(&line[from..]);
    out.into_iter()
        .map(|field| field.trim().trim_matches('"').trim())
        .collect()
}

fn is_list(field: &str) -> bool {
    let inner = field
        .strip_prefix(['[', '('])
        .and_then(|rest| rest.strip_suffix([']', ')']));
    inner.is_some_and(|inner| inner.contains([',', ' ']) && !inner.is_empty())
}

/// A name in Python's quotes, inside of a shell's.
fn python(name: &str) -> String {
    format!(
        "'{}'",
        escape(name).replace(['\'', '"', '\\', '`', '$'], "_")
    )
}

/// Whether a field is a later time than another one: a greater number or a later date.
fn is_later(field: &str, before: &str) -> bool {
    let [field, before] = [field, before].map(str::as_bytes);
    let numbers = number::parse(field).zip(number::parse(before));
    let dates = || Instant::parse_iso(field).zip(Instant::parse_iso(before));
    numbers.map_or_else(
        || dates().is_some_and(|(date, before)| date > before),
        |(number, before)| number > before,
    )
}

/// Refuses a table that must be brought into another form, with the line that does it.
pub(super) fn check(
    file: &str,
    header: &[String],
    lines: &[Line<'_>],
    rows: &[usize],
    parting: FieldParting,
) -> Result<(), LogError> {
    let all = rows
        .iter()
        .take(ROWS)
        .map(|row| fields(&lines[*row].text, parting));
    let all: Vec<Vec<&str>> = all.filter(|row| row.len() == header.len()).collect();
    lists(file, header, &all).map_or(Ok(()), Err)?;
    row_of_each_joint(file, header, &all).map_or(Ok(()), Err)
}

/// Lists in cells.
fn lists(file: &str, header: &[String], rows: &[Vec<&str>]) -> Option<LogError> {
    let first = rows.first()?;
    let with: Vec<usize> = (0..header.len())
        .filter(|at| rows.iter().all(|row| is_list(row[*at])))
        .collect();
    let is_text = |at: &usize| first[*at].contains(['\'', '"']);
    let (names, numbers): (Vec<usize>, Vec<usize>) = with.into_iter().partition(is_text);
    let column = *numbers.first()?;
    let plain = (0..header.len())
        .filter(|at| is_datum(first[*at]))
        .map(|at| python(&header[at]));
    let plain: Vec<String> = plain.collect();
    let numbers: Vec<String> = numbers.iter().map(|at| python(&header[*at])).collect();
    // `[1. 2.]` as numpy prints it has no commas
    let read = "lambda s: s if isinstance(s, list) else ast.literal_eval(re.sub(r'(?<=[^,\\s\\[(])\\s+(?=[^,\\s\\])])', ',', str(s)))";
    let named = match names.first() {
        Some(at) => format!("f(d[{}][0])", python(&header[*at])),
        None => format!("range(len(f(d[{}][0])))", numbers[0]),
    };
    Some(LogError::Cells {
        at: file.to_owned(),
        column: escape(&header[column]),
        what: "lists",
        remedy: format!(
            "write a column for each of their numbers: `python -c \"import ast, pandas, re; f = {read}; d = pandas.read_csv('IN'); o = d[[{}]].copy(); n = list({named}); [o.insert(len(o.columns), f'{{c}}_{{j}}', [f(s)[k] for s in d[c]]) for c in [{}] for k, j in enumerate(n)]; o.to_csv('OUT.csv', index=False)\"`",
            plain.join(", "),
            numbers.join(", ")
        ),
    })
}

/// A row for each joint: a column of words goes through the same names over and over, at one time each.
fn row_of_each_joint(file: &str, header: &[String], rows: &[Vec<&str>]) -> Option<LogError> {
    let first = rows.first()?;
    let text = (0..header.len())
        .find(|at| !first[*at].is_empty() && !is_datum(first[*at]) && !is_list(first[*at]))?;
    let count = rows
        .iter()
        .skip(1)
        .position(|row| row[text] == first[text])?
        + 1;
    let apart = |row: usize| rows[row][text] != rows[row + 1][text];
    if count < 2 || rows.len() < 3 * count || !(0..count - 1).all(apart) {
        return None;
    }
    // the time is the first column of numbers that all rows of a round share, and that increases from round to round
    let rounds = || rows.chunks_exact(count).take(20);
    let shared = |at: &usize| {
        is_datum(first[*at])
            && rounds().all(|round| round.iter().all(|row| row[*at] == round[0][*at]))
            && rounds()
                .zip(rounds().skip(1))
                .all(|(round, next)| is_later(next[0][*at], round[0][*at]))
    };
    let same_names = rounds().all(|round| round.iter().zip(rows).all(|(a, b)| a[text] == b[text]));
    let time = (0..header.len()).find(shared).filter(|_| same_names)?;
    let others = (0..header.len()).filter(|at| *at != time && *at != text && is_datum(first[*at]));
    let numbers = others.map(|at| python(&header[at])).collect::<Vec<_>>();
    let numbers = match &numbers[..] {
        [] => return None,
        [only] => only.clone(),
        several => format!("[{}]", several.join(", ")),
    };
    let named = match numbers.starts_with('[') {
        true => "['_'.join(c) for c in p.columns]".to_owned(),
        false => format!("[{numbers} + '_' + c for c in p.columns]"),
    };
    Some(LogError::Cells {
        at: file.to_owned(),
        column: escape(&header[text]),
        what: "the joint of its row: there is a row for each joint",
        remedy: format!(
            "write a column for each joint: `python -c \"import pandas; d = pandas.read_csv('IN'); p = d.pivot_table(index={}, columns={}, values={numbers}); p.columns = {named}; p.to_csv('OUT.csv')\"`",
            python(&header[time]),
            python(&header[text])
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::super::line::lines_of;
    use super::*;

    fn refused(text: &str) -> Option<String> {
        let lines = lines_of(text.as_bytes());
        let header: Vec<String> = lines[0].text.split(',').map(str::to_owned).collect();
        let rows: Vec<usize> = (1..lines.len() - 1).collect();
        let parting = FieldParting {
            sign: b',',
            runs: false,
        };
        check("a.csv", &header, &lines, &rows, parting)
            .err()
            .map(|error| error.to_string())
    }

    #[test]
    fn a_row_for_each_joint_and_lists_in_cells_are_known_and_words_beside_numbers_are_neither() {
        let long: String = (0..9)
            .map(|k| format!("{},{},1.5\n", k / 3, ["a", "b", "c"][k % 3]))
            .collect();
        let found = refused(&format!("t,joint,q\n{long}")).unwrap();
        assert!(
            found.contains("`joint`")
                && found.contains("pivot_table(index='t', columns='joint', values='q')"),
            "{found}"
        );
        let found =
            refused("t,n,q\n0,\"['a', 'b']\",\"(1.0, 2.0)\"\n1,\"['a', 'b']\",\"(1.0, 2.0)\"\n")
                .unwrap();
        assert!(found.contains("`q` holds lists"), "{found}");
        let words: String = (0..9)
            .map(|k| format!("{k},{},1.5\n", ["a", "b", "c"][k % 3]))
            .collect();
        assert_eq!(refused(&format!("t,state,q\n{words}")), None);
        // nor is a table whose only times are those of each row, beside a number that stands still or goes back and forth
        let words: String = (0..9)
            .map(|k| format!("{},{k},{}\n", ["a", "b", "c"][k % 3], k / 3 % 2))
            .collect();
        assert_eq!(refused(&format!("state,t,q\n{words}")), None);
    }
}
