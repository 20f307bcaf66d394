//! `drive-efficiency`: a loss in proportion to the load while the motor drives it, k tau_l H(tau_l v).

use super::entry::{Entry, Family, Key};
use super::law::Law;
use super::unit::Unit;

pub static ENTRY: Entry = Entry {
    name: "drive-efficiency",
    families: &[Family::Load],
    keys: &[Key::size("k", Unit::One).within(
        -0.9,
        9.0,
        "must lie in -0.9..9 (k = 1/efficiency - 1)",
    )],
    separate_by: "lift and lower a known payload at the same speeds",
    formula: "k tau_l H(tau_l v)",
    source: "a gear or screw that loses part of the power while it drives the load",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    starts: |cover, place| {
        if cover.at(place).both_ways() {
            Ok(vec![Vec::new()])
        } else {
            Err("the joint moves in one direction only: move it both ways".into())
        }
    },
    ..Law::linear(&ENTRY, &["k"], |scene, place, _, _, out| {
        let Some(j) = place.joint() else { return };
        for (k, (v, load)) in scene.stretch.v[j].iter().zip(&scene.load[j]).enumerate() {
            if load * v > 0.0 {
                out[0][k] = *load;
            }
        }
    })
};
