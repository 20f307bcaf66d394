//! The motion that a model makes of measured torques.

use crate::report::table::{CellAlignment, Columns};
use crate::report::{Writer, words};
use cft_ident_core::number;
use cft_ident_stages::open_loop::{FreeRun, PositionErrorChange};

/// The errors of a free run, where there is one; a sentence alone where every window went astray.
pub fn section(writer: &mut Writer, found: Option<&FreeRun>) {
    let Some(found) = found else {
        return;
    };
    writer.line("");
    if found.astray == found.windows {
        writer.paragraph("No motion follows from this model: its inertia matrix is not that of bodies that can exist.");
        return;
    }
    let caption = format!(
        "simulated position error: rms of the positions that the model makes of the measured torques, {} windows of {} s",
        found.windows,
        number::significant(found.window_s, 2)
    );
    let mut table = Columns::new(&caption, &found.joints).words("joint", |j| &j.joint);
    if found.joints.iter().any(|joint| joint.after.is_some()) {
        // two models beside each other
        let shown = |rms| words::significant(rms, 3);
        let interval =
            |c: &PositionErrorChange| c.interval_95.map(|x| number::significant(x, 2)).join("..");
        table = table
            .numbers("as given", |j| shown(Some(j.given.rms)))
            .numbers("after", |j| shown(j.after.as_ref().map(|after| after.rms)))
            .column(CellAlignment::Right, "95 % CI of the change", |j| {
                j.change.as_ref().map_or(number::ABSENT.into(), interval)
            })
            .words("unit", |j| j.unit)
            .words("change", |j| j.change.as_ref().map_or("", direction));
    } else {
        // how the error grows in a window
        let growth = found.joints.first().map_or(&[][..], |j| &j.given.growth);
        for (k, at) in growth.iter().enumerate() {
            let head = format!("at {:.2} s", at.after_s);
            table = table.digits(&head, 3, |j| j.given.growth.get(k).map(|at| at.rms));
        }
        table = table
            .percent("share of travel", |j| j.given.relative)
            .words("unit", |j| j.unit);
    }
    writer.table(table);
    if found.astray > 0 {
        writer.paragraph(&format!(
            "{} of {} windows went astray and are not counted.",
            found.astray, found.windows
        ));
    }
}

/// Which way a change goes, where its interval leaves out 0.
fn direction(change: &PositionErrorChange) -> &'static str {
    match change.interval_95 {
        [low, _] if low > 0.0 => "worse",
        [_, high] if high < 0.0 => "better",
        _ => "",
    }
}
