//! `stuck-channel`: a channel shows its last value from the time `at` on for `seconds`.

use super::{Built, Fault, Key, Kind, Log, Places, Unit};

pub const KIND: Kind = Kind {
    name: "stuck-channel",
    family: "data",
    places: Places::Joints,
    keys: &[
        Key::shape("at", Unit::Fixed("s"), |_| 5.0),
        Key::shape("seconds", Unit::Fixed("s"), |_| 1.0),
        // 1 the torque, 0 the position.
        Key::shape("torque", Unit::Fixed("1"), |_| 1.0),
    ],
    build: |site, _, values| {
        Built::log(StuckChannel {
            joint: site.joint(),
            from: values[0],
            to: values[0] + values[1],
            torque: values[2] != 0.0,
        })
    },
};

#[derive(Debug)]
struct StuckChannel {
    joint: usize,
    from: f64,
    to: f64,
    torque: bool,
}

impl Fault for StuckChannel {
    fn apply(&self, log: &mut Log) {
        let mut last = None;
        for (t, value) in log.channel(self.joint, self.torque) {
            match last {
                Some(last) if (self.from..self.to).contains(&t) => *value = last,
                _ => last = Some(*value),
            }
        }
    }
}
