//! `asymmetric-friction`: more friction in one direction, (coulomb + viscous v) H(v).

use super::{Entry, Family, Key, Law, SpeedLadder, Unit};

pub static ENTRY: Entry = Entry {
    name: "asymmetric-friction",
    families: &[Family::Velocity, Family::Offset],
    keys: &[Key::torque("coulomb"), Key::size("viscous", Unit::Viscous)],
    ladder: Some(SpeedLadder::USUAL),
    friction: true,
    separate_by: "move the joint both ways at three or more constant speeds and hold it still \
                  between them: an offset holds at standstill, friction does not",
    formula: "(coulomb + viscous v) H(v)",
    source: "gears and seals that run differently in the two directions",
    said: |f| {
        let way = |key: &str| match f.value(key) < 0.0 {
            true => "backward",
            false => "forward",
        };
        // the two halves are found apart, and either may be nothing
        let part = |key: &str| format!("{} higher {}", f.size(key), way(key));
        match ["coulomb", "viscous"].map(|key| f.value(key) == 0.0) {
            [true, _] => format!("viscous friction of {} that is {}", f.at, part("viscous")),
            [_, true] => format!("friction of {} that is {}", f.at, part("coulomb")),
            _ => format!(
                "friction of {} that differs by direction (Coulomb {}, viscous {})",
                f.at,
                part("coulomb"),
                part("viscous")
            ),
        }
    },
    remedy: "look for a seal, a brake or a gear that rubs in one direction; the refined model compensates it",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    starts: |cover, place| cover.both_ways(place).map(|_| vec![Vec::new()]),
    code: Some(|to| {
        let (v, direction) = (to.v(), to.direction());
        to.friction(format!(
            "0.5 * (1.0 + {direction}) * ({} + {} * {v})",
            to.x(0),
            to.x(1)
        ));
    }),
    ..Law::linear(&ENTRY, &["coulomb", "viscous"], |at, _, out| {
        // half at standstill, where neither direction has it; between as smooth as the joint's own law
        let forward = 0.5 * (1.0 + at.direction());
        out[0] = forward;
        out[1] = forward * at.v();
    })
};
