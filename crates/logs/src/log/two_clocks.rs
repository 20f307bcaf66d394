//! A clock in two columns: whole seconds, and what is beyond them.

use super::columns::name_and_unit;

/// Endings of a column of whole seconds.
const SECONDS: [&str; 5] = ["seconds", "second", "secs", "sec", "s"];
/// Endings of a column of the rest, and the power of ten of a second that it counts.
const PARTS: [(&str, i32); 16] = [
    ("nanoseconds", -9),
    ("nanosecs", -9),
    ("nanosec", -9),
    ("nsecs", -9),
    ("nsec", -9),
    ("nanos", -9),
    ("ns", -9),
    ("microseconds", -6),
    ("microsec", -6),
    ("usecs", -6),
    ("usec", -6),
    ("us", -6),
    ("milliseconds", -3),
    ("millisec", -3),
    ("msec", -3),
    ("ms", -3),
];

/// A name without its ending, the last of `endings` that it has as a word or with a capital.
fn without<'n>(name: &'n str, ending: &str) -> Option<&'n str> {
    let name = name_and_unit(name).0;
    let at = name.len().checked_sub(ending.len())?;
    let (head, tail) = name.split_at_checked(at)?;
    let whole = head.is_empty()
        || !head.ends_with(|c: char| c.is_alphanumeric())
        || tail.starts_with(char::is_uppercase);
    (tail.eq_ignore_ascii_case(ending) && whole)
        .then(|| head.trim_end_matches(|c: char| !c.is_alphanumeric()))
}

/// The column that goes on where a column of whole seconds ends, and the power of ten of a second that it counts.
pub(super) fn rest_of(names: &[String], seconds: usize) -> Option<(usize, i32)> {
    let name = names.get(seconds)?;
    let stem = SECONDS.iter().find_map(|ending| without(name, ending));
    // `ZeitInNanoSec` ends with seconds too
    let is_rest = |name: &str| PARTS.iter().any(|(end, _)| without(name, end).is_some());
    let stem = stem.filter(|_| !is_rest(name))?;
    PARTS.iter().find_map(|(ending, power)| {
        let of = |name: &String| without(name, ending) == Some(stem);
        Some((names.iter().position(of)?, *power))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_and_their_parts_are_found_by_their_names() {
        for (names, found) in [
            ("sec,nanosec,q", Some((1, -9))),
            ("secs,nsecs", Some((1, -9))),
            ("Time_sec,Time_nsec", Some((1, -9))),
            ("ZeitInSec,ZeitInNanoSec", Some((1, -9))),
            ("header.stamp.sec,header.stamp.nanosec", Some((1, -9))),
            ("sec,msec", Some((1, -3))),
            ("t,q", None),
            ("sec,q_sensors", None),
            ("a.sec,b.nanosec", None),
        ] {
            let names: Vec<String> = names.split(',').map(str::to_owned).collect();
            assert_eq!(rest_of(&names, 0), found, "{names:?}");
        }
        let reversed = ["nanosec".to_owned(), "sec".to_owned()];
        assert_eq!(rest_of(&reversed, 1), Some((0, -9)));
        assert_eq!(rest_of(&reversed, 0), None);
    }
}
