//! The motion that a model makes of measured torques.

use crate::report::Writer;
use crate::report::table::{Align, Table};
use cft_ident_core::number;
use cft_ident_stages::open_loop::{FreeRun, PositionError, PositionErrorChange};

/// What a free run found, where there is one; nothing where every window went astray, but for a sentence.
pub fn section(writer: &mut Writer, found: Option<&FreeRun>) {
    let Some(found) = found else {
        return;
    };
    writer.line("");
    if found.astray == found.windows {
        writer.paragraph("No motion follows from this model: its inertia matrix is not that of bodies that can exist.");
        return;
    }
    match found.joints.iter().any(|joint| joint.after.is_some()) {
        true => writer.table(compared(found)),
        false => writer.table(growing(found)),
    }
    if found.astray > 0 {
        writer.paragraph(&format!(
            "{} of {} windows went astray and are not counted.",
            found.astray, found.windows
        ));
    }
}

fn caption(found: &FreeRun) -> String {
    format!(
        "free run: rms error of the positions that the model makes of the measured torques, {} windows of {} s",
        found.windows,
        number::significant(found.window_s, 2)
    )
}

/// How the error grows in a window.
fn growing(found: &FreeRun) -> Table {
    let growth = found.joints.first().map_or(&[][..], |j| &j.given.growth);
    let heads = growth.iter().map(|at| format!("at {:.2} s", at.after_s));
    let heads: Vec<String> = heads.collect();
    let mut columns = vec![("joint", Align::Left)];
    columns.extend(heads.iter().map(|head| (head.as_str(), Align::Decimal)));
    columns.extend([("of the way", Align::Decimal), ("unit", Align::Left)]);
    let mut table = Table::new(&columns).caption(&caption(found));
    for joint in &found.joints {
        let mut row = vec![joint.joint.clone()];
        let growth = joint.given.growth.iter();
        row.extend(growth.map(|at| number::significant(at.rms, 3)));
        row.push(number::percent(joint.given.relative));
        row.push(joint.unit.to_owned());
        table.row(row);
    }
    table
}

/// Two models beside each other.
fn compared(found: &FreeRun) -> Table {
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("as given", Align::Decimal),
        ("after", Align::Decimal),
        ("95 % CI of the change", Align::Right),
        ("unit", Align::Left),
        ("change", Align::Left),
    ])
    .caption(&caption(found));
    let rms = |error: &PositionError| number::significant(error.rms, 3);
    let interval = |c: &PositionErrorChange| {
        let [low, high] = c.interval_95.map(|x| number::significant(x, 2));
        format!("{low}..{high}")
    };
    for joint in &found.joints {
        let after = joint.after.as_ref().map(rms);
        let change = joint.change.as_ref().map(interval);
        table.row([
            joint.joint.as_str(),
            &rms(&joint.given),
            after.as_deref().unwrap_or(number::ABSENT),
            change.as_deref().unwrap_or(number::ABSENT),
            joint.unit,
            joint.change.as_ref().map_or("", direction),
        ]);
    }
    table
}

/// Which way a change goes, where its interval leaves out 0.
fn direction(change: &PositionErrorChange) -> &'static str {
    match change.interval_95 {
        [low, _] if low > 0.0 => "worse",
        [_, high] if high < 0.0 => "better",
        _ => "",
    }
}
