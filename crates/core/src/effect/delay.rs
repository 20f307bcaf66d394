//! `delay`: the logged torque is late by d (early where d is negative), on one joint or on all.

use super::{Entry, Family, Key, Law, Limit, LimitedNumber, PlaceRule, Role, Rule, Unit};
use crate::number;

pub static ENTRY: Entry = Entry {
    name: "delay",
    families: &[Family::Timing],
    keys: &[Key::size("d", Unit::Fixed("s"))],
    places: PlaceRule::JointsOrAll,
    role: Role::Shift,
    must: &[Rule::at_most(
        LimitedNumber::Size("d"),
        Limit::Is(0.1),
        "clocks and filters of drives differ by less than 0.1 s",
    )],
    separate_by: "log one signal twice, once beside the positions and once beside the torques",
    formula: "none; the log shows the torque of d before",
    source: "torques and positions stamped by two clocks, or a filter in the drive",
    said: |f| {
        let d = f.value("d");
        let way = if d < 0.0 { "ahead of" } else { "behind" };
        let ms = number::significant(1e3 * d.abs(), 3);
        format!("torque {ms} ms {way} position on {}", f.at)
    },
    remedy: "log torques and positions with one clock and no filter between them, or shift the torque by this time",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    code: Some(|to| to.late()),
    ..Law::linear(&ENTRY, &["d"], |at, _, out| {
        // tau(t - d) = tau - d dtau/dt + ..
        let (hat, k) = (&at.scene.hat[at.joint], at.k);
        if k > 0 && k + 1 < hat.len() {
            out[0] = -(hat[k + 1] - hat[k - 1]) / (2.0 * at.scene.stretch.dt);
        }
    })
};
