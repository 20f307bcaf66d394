//! Tables of docs/results/simulators.md.

use super::tables::{number, rows, table, text};
use cft_ident::number::significant;
use serde_json::Value;

/// What a file of a simulator cannot say.
pub fn left_out(result: &Value) -> String {
    let each = rows(&result["left_out"]).iter().map(|part| {
        let percent = significant(number(&part["percent_of_torque"]), 3);
        vec![text(&part["what"]).to_owned(), format!("{percent} %")]
    });
    table(
        &["<not in the file", "of the torque"],
        &each.collect::<Vec<_>>(),
    )
}

/// What each reader takes of the numbers of joints.
pub fn readers(result: &Value) -> String {
    let facts = rows(&result["facts"]);
    let mut places: Vec<[&str; 2]> = facts
        .iter()
        .map(|of| [text(&of["reader"]), text(&of["format"])])
        .collect();
    places.dedup();
    let numbers = ["damping", "friction", "armature", "effort"];
    let each = places.iter().map(|[reader, format]| {
        let arrives = |number: &&str| {
            let mut facts = facts.iter();
            let found = facts.find(|of| {
                [
                    text(&of["reader"]),
                    text(&of["format"]),
                    text(&of["number"]),
                ] == [*reader, *format, *number]
            });
            found.map_or("-", |of| text(&of["arrives"])).to_owned()
        };
        let head = [(*reader).to_owned(), (*format).to_owned()];
        head.into_iter()
            .chain(numbers.iter().map(arrives))
            .collect()
    });
    let versions = result["versions"].as_object().into_iter().flatten();
    let versions: Vec<String> = versions
        .map(|(name, of)| format!("{name} {}", text(of)))
        .collect();
    let columns = [
        "<reader",
        "<format",
        "<damping",
        "<friction",
        "<armature",
        "<effort limit",
    ];
    let table = table(&columns, &each.collect::<Vec<_>>());
    format!(
        "{}, {}\n\n{table}",
        versions.join(", "),
        text(&result["date"])
    )
}

/// What readers make of small files, a column a reader.
pub fn probes(result: &Value) -> String {
    let lines = rows(&result["probes"]);
    let readers = ["mujoco", "pinocchio", "drake", "newton", "bullet"];
    let mut places: Vec<[&str; 2]> = lines
        .iter()
        .map(|of| [text(&of["format"]), text(&of["what"])])
        .collect();
    let mut seen = std::collections::BTreeSet::new();
    places.retain(|place| seen.insert(*place));
    let each = places.iter().map(|[format, what]| {
        let becomes = |reader: &&str| {
            let mut lines = lines.iter();
            let found = lines.find(|of| {
                [text(&of["reader"]), text(&of["format"]), text(&of["what"])]
                    == [*reader, *format, *what]
            });
            found.map_or("-", |of| text(&of["becomes"])).to_owned()
        };
        let head = [(*format).to_owned(), (*what).to_owned()];
        head.into_iter()
            .chain(readers.iter().map(becomes))
            .collect()
    });
    let columns = [
        "<format",
        "<in the file",
        "<MuJoCo",
        "<Pinocchio",
        "<Drake",
        "<newton",
        "<PyBullet",
    ];
    table(&columns, &each.collect::<Vec<_>>())
}

/// The largest difference of torque of each robot in each format and reader, over the joint's torque; of newton over the
/// largest joint's.
pub fn same_robot(result: &Value) -> String {
    let all = rows(&result["rows"]);
    let of = |row: &Value, keys: &[&str]| -> Vec<String> {
        keys.iter().map(|key| text(&row[key]).to_owned()).collect()
    };
    let mut places: Vec<Vec<String>> = Vec::new();
    let mut robots: Vec<&str> = Vec::new();
    for row in all {
        let (robot, place) = (text(&row["robot"]), of(row, &["format", "reader"]));
        if !robots.contains(&robot) {
            robots.push(robot);
        }
        if place[1] != "export" && !places.contains(&place) {
            places.push(place);
        }
    }
    places.sort();
    let cell = |robot: &str, place: &[String]| {
        let mut of_robot = all.iter().filter(|row| text(&row["robot"]) == robot);
        let found = of_robot
            .clone()
            .find(|row| of(row, &["format", "reader"]) == place);
        let Some(row) = found else {
            let refused =
                of_robot.any(|row| of(row, &["format", "reader"]) == [&place[0], "export"]);
            return if refused { "no export" } else { "-" }.to_owned();
        };
        let key = if place[1] == "newton" {
            "largest"
        } else {
            "joint"
        };
        match row[key].as_f64() {
            Some(size) => format!("{size:.0e}"),
            None if text(&row["said"]).starts_with("the source alone") => {
                "source refused".to_owned()
            }
            None => "refused".to_owned(),
        }
    };
    let each = robots.iter().map(|robot| {
        let cells = places.iter().map(|place| cell(robot, place));
        [(*robot).to_owned()].into_iter().chain(cells).collect()
    });
    let columns: Vec<String> = places.iter().map(|place| place.join(" ")).collect();
    let columns = ["<robot"]
        .into_iter()
        .chain(columns.iter().map(String::as_str));
    table(&columns.collect::<Vec<_>>(), &each.collect::<Vec<_>>())
}

/// Errors of windows that were replayed in a simulator.
pub fn replay(result: &Value) -> String {
    let degrees = |value: &Value| format!("{}°", significant(number(value), 3));
    let each = rows(&result["errors"]).iter().map(|line| {
        vec![
            text(&line["machine"]).to_owned(),
            text(&line["joint"]).to_owned(),
            format!("{} s", number(&line["seconds"])),
            number(&line["windows"]).to_string(),
            degrees(&line["before_deg"]),
            degrees(&line["after_deg"]),
            degrees(&line["after_offsets_deg"]),
        ]
    });
    let columns = [
        "<machine",
        "<joint",
        "window",
        "windows",
        "before",
        "after",
        "after, offsets taken off",
    ];
    table(&columns, &each.collect::<Vec<_>>())
}
