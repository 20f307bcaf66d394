//! `gain`: torque constant or gear off by a factor, k tau on one joint. A fit that was free while
//! carrying it absorbs it: it is looked for only with the model kept.

use super::{Entry, Family, Key, Law, Role, Unit};
use crate::number;

pub static ENTRY: Entry = Entry {
    name: "gain",
    families: &[Family::Load],
    keys: &[Key::size("k", Unit::One).within(-0.9, 9.0, "must lie in -0.9..9")],
    role: Role::Kept,
    separate_by: "log a known payload and diagnose with --keep",
    formula: "k times the acting torque: logged is (1 + k) times that",
    source: "a wrong torque constant or gear ratio",
    at_rest: true,
    said: |f| {
        let k = f.value("k");
        let way = if k < 0.0 { "low" } else { "high" };
        format!(
            "torque of {} logged {} too {way}",
            f.at,
            number::percent(k.abs())
        )
    },
    remedy: "check torque constant and gear ratio, and correct `torque_scale` in [log]",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    code: Some(|to| {
        let load = to.load();
        to.added(format!(
            "{} * ({load} + ({} + {}))",
            to.x(0),
            to.law(),
            to.offset()
        ));
    }),
    ..Law::linear(&ENTRY, &["k"], |at, _, out| {
        out[0] = at.scene.hat[at.joint][at.k]
    })
};
