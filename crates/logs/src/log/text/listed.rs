//! Columns of text that list joints, `name.0`, `name.1`, ..: they say whose the columns beside them are, row by row.
//!
//! `position.0` is then `position.elbow` wherever elbow stands, in this file or in another.

use super::table::is_datum;

/// Names in columns of text, and the columns that are in their order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ListedJoints {
    /// Columns of the names, and the names in the first row.
    pub(super) columns: Vec<usize>,
    pub(super) names: Vec<String>,
    /// Columns of each quantity, one for each name.
    pub(super) groups: Vec<Vec<usize>>,
}

/// A name without the number that it ends with, `position` of `position.2`, `position2` and `position[2]`.
fn stem_and_number(name: &str) -> Option<(&str, usize)> {
    let bare = name.trim().trim_end_matches(']');
    let stem = bare.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = bare[stem.len()..].parse().ok()?;
    Some((stem.trim_end_matches(['.', '_', '[', ' ', '/']), number))
}

fn bare(field: &str) -> &str {
    field.trim().trim_matches(['"', '\'', ' '])
}

impl ListedJoints {
    /// The names that the first row lists, where it does, and new names of the columns beside them.
    pub(super) fn find(header: &[String], row: &[&str]) -> Option<(Self, Vec<String>)> {
        let mut groups: Vec<(&str, Vec<usize>)> = Vec::new();
        for (at, name) in header.iter().enumerate() {
            let Some((stem, number)) = stem_and_number(name) else {
                continue;
            };
            match groups.iter_mut().find(|(known, _)| *known == stem) {
                Some((_, all)) if all.len() == number => all.push(at),
                None if number == 0 => groups.push((stem, vec![at])),
                _ => {}
            }
        }
        let field = |at: usize| bare(row.get(at).copied().unwrap_or_default());
        let is_text = |all: &[usize]| {
            let words = all.iter().map(|at| field(*at));
            words
                .clone()
                .all(|word| !word.is_empty() && !is_datum(word))
                && words
                    .clone()
                    .all(|word| words.clone().filter(|w| *w == word).count() == 1)
        };
        let mut texts = groups
            .iter()
            .filter(|(_, all)| all.len() > 1 && is_text(all));
        let (_, columns) = texts.next()?;
        if texts.next().is_some() {
            return None;
        }
        let names: Vec<String> = columns.iter().map(|at| field(*at).to_owned()).collect();
        let mut header = header.to_vec();
        let mut beside = Vec::new();
        for (stem, all) in &groups {
            if all == columns || all.len() != columns.len() {
                continue;
            }
            for (at, name) in all.iter().zip(&names) {
                header[*at] = format!("{stem}.{name}");
            }
            beside.push(all.clone());
        }
        let out = Self {
            columns: columns.clone(),
            names,
            groups: beside,
        };
        (!out.groups.is_empty()).then_some((out, header))
    }

    /// The place of the number of each column in a row that lists other names; `None` where a name is missing.
    pub(super) fn places(&self, width: usize, row: &[&str]) -> Option<Vec<usize>> {
        let is = |at: &usize, name: &String| row.get(*at).is_some_and(|own| bare(own) == name);
        let place = |name: &String| self.columns.iter().position(|at| is(at, name));
        let order: Vec<usize> = self.names.iter().map(place).collect::<Option<_>>()?;
        let mut places: Vec<usize> = (0..width).collect();
        for group in &self.groups {
            for (at, from) in group.iter().zip(&order) {
                places[*at] = group[*from];
            }
        }
        Some(places)
    }
}

/// Columns of `ros2 topic echo --csv` of joint states, whose first rows these are: seconds, nanoseconds, frame, names,
/// then positions, velocities, efforts of as many.
pub(super) fn echo_names(rows: &[Vec<&str>]) -> Option<Vec<String>> {
    let first = rows.first()?;
    let whole = |at: usize| bare(first.get(at)?).parse::<u64>().ok();
    whole(0)?;
    whole(1).filter(|ns| *ns < 1_000_000_000)?;
    let is_number = |at: &usize| is_datum(bare(first[*at]));
    let begins = (3..first.len()).find(is_number)?;
    let joints = begins.checked_sub(3).filter(|joints| *joints > 0)?;
    let numbers = first.len() - begins;
    let quantities = numbers / joints;
    let whole = numbers % joints == 0 && (1..=3).contains(&quantities);
    let alike = |row: &Vec<&str>| {
        let texts = 2..begins;
        row.len() == first.len()
            && texts.clone().all(|at| !is_datum(bare(row[at])))
            && (begins..row.len()).all(|at| is_datum(bare(row[at])))
    };
    if !whole || rows.len() < 3 || !rows.iter().all(alike) {
        return None;
    }
    let second = match quantities {
        2 if !is_rate(rows, begins, joints) => ["position", "effort", ""],
        _ => ["position", "velocity", "effort"],
    };
    let mut names = vec![
        "sec".to_owned(),
        "nanosec".to_owned(),
        "frame_id".to_owned(),
    ];
    for kind in ["name"]
        .into_iter()
        .chain(second.into_iter().take(quantities))
    {
        names.extend((0..joints).map(|k| format!("{kind}.{k}")));
    }
    Some(names)
}

/// Whether what follows the positions changes with their differences, as velocities do.
fn is_rate(rows: &[Vec<&str>], begins: usize, joints: usize) -> bool {
    let number = |row: &[&str], at: usize| bare(row[at]).parse::<f64>().unwrap_or(0.0);
    let mut products = [0.0; 3];
    for pair in rows.windows(3) {
        for at in begins..begins + joints {
            let step = number(&pair[2], at) - number(&pair[0], at);
            let other = number(&pair[1], at + joints);
            for (sum, product) in
                products
                    .iter_mut()
                    .zip([step * step, other * other, step * other])
            {
                *sum += product;
            }
        }
    }
    let [a, b, ab] = products;
    ab > 0.9 * (a * b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owned(names: &str) -> Vec<String> {
        names.split(',').map(str::to_owned).collect()
    }

    #[test]
    fn columns_have_the_names_that_the_row_lists_whatever_their_order() {
        for header in [
            "t,name.0,name.1,position.0,position.1,x.0",
            "t,field.name0,field.name1,field.position0,field.position1,x",
            "t,name[0],name[1],position[0],position[1],x",
        ] {
            let header = owned(header);
            let row = ["0.1", "wrist", "\"elbow\"", "1.5", "2.5", "7"];
            let (listed, names) = ListedJoints::find(&header, &row).unwrap();
            assert!(names[3].ends_with("position.wrist") && names[4].ends_with("position.elbow"));
            assert_eq!(names[5], header[5]);
            let places = listed.places(6, &["0.2", "elbow", "wrist", "2.5", "1.5", "7"]);
            assert_eq!(places, Some(vec![0, 1, 2, 4, 3, 5]));
            let other = listed.places(6, &["0.2", "elbow", "hand", "2.5", "1.5", "7"]);
            assert_eq!(other, None);
        }
        let header = owned("t,name.0,name.1,position.0,position.1");
        assert_eq!(
            ListedJoints::find(&header, &["0", "a", "a", "1", "2"]),
            None
        );
    }

    #[test]
    fn lines_of_an_echoed_joint_state_have_its_columns() {
        let text =
            "17,0,,a,b,0.1,0.2,1,2,3,4\n17,10,,a,b,0.2,0.3,1,2,3,4\n17,20,,a,b,0.3,0.4,1,2,3,4";
        let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        let names = echo_names(&rows).unwrap().join(" ");
        let expected = "sec nanosec frame_id name.0 name.1 position.0 position.1 velocity.0 velocity.1 effort.0 effort.1";
        assert_eq!(names, expected);
        assert_eq!(echo_names(&rows[..2]), None);
    }
}
