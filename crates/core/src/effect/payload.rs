//! `payload` of the CFT robot and of a single joint: a body on the last link: mass, first moments, and its
//! second moment about the vertical axis of the link's frame, about which alone a tool that stays level
//! turns. A fit whose logs carried it absorbs it: it is looked for only with the model kept.

use super::{
    EffectError, EffectReparametrisation, EffectValues, Entry, Family, Key, KeyValue, Law,
    PlaceRule, Role, Rule, ShapeSearch, Unit,
};
use crate::robot::tree::MOST_JOINTS;

pub static ENTRY: Entry = Entry {
    name: "payload",
    families: &[Family::Inertia],
    keys: &[
        Key::size("mass", Unit::Fixed("kg")).above_zero("must be above 0"),
        Key::size("mx", Unit::Fixed("kg m")),
        Key::size("my", Unit::Fixed("kg m")),
        Key::size("mz", Unit::Fixed("kg m")),
        Key::size("inertia", Unit::Fixed("kg m^2")),
    ],
    places: PlaceRule::Whole,
    role: Role::Kept,
    search: ShapeSearch::Refined,
    must: &[
        Rule::not_negative("mass", BODY),
        Rule::not_negative("inertia", BODY),
    ],
    separate_by: "identify unloaded, then diagnose loaded logs with --keep",
    formula: "a body with its centre at (mx, my, mz)/mass in the frame of the last link, and its \
                inertia about that centre: about the vertical axis, on a serial robot the same \
                about every axis",
    source: "a tool or a load that the model was not identified with",
    at_rest: true,
    said: |f| format!("payload of {}", f.size("mass")),
    remedy: "take the load off, or use the refined model with it",
    measurable: true,
    ..Entry::USUAL
};

/// Why its numbers are not negative.
const BODY: &str = "a body has mass and inertia";

pub static LAW: Law = Law {
    fits: |robot, _, _| robot.tool_stays_level(),
    // files have the inertia about the body's own centre; a point where nothing is said of its extent
    reparametrised: Some(EffectReparametrisation {
        of_keys: |values| {
            let [mass, mx, my, mz] = body(values)?;
            let second = values.get_or("inertia", 0.0)? + (mx * mx + mz * mz) / mass;
            Ok([Vec::new(), vec![mass, mx, my, mz, second]])
        },
        to_keys: |_, linear| {
            let [mass, mx, _, mz, second] = [0, 1, 2, 3, 4].map(|i| linear[i]);
            let keys = ["mass", "mx", "my", "mz"].into_iter().enumerate();
            let mut out: Vec<KeyValue> = keys
                .map(|(i, key)| KeyValue::plain(key, linear[i], i, 5))
                .collect();
            let far = (mx * mx + mz * mz) / mass;
            // robots whose columns have no second moment leave it at rest
            if second != 0.0 {
                out.push(KeyValue {
                    key: "inertia",
                    value: second - far,
                    slopes: vec![far / mass, -2.0 * mx / mass, 0.0, -2.0 * mz / mass, 1.0],
                });
            }
            out
        },
    }),
    code: Some(|to| {
        if let &[mass, mx, my, mz, second] = to.linear {
            to.bodies(to.model.robot.level_tool_links([mass, mx, my, mz, second]));
        }
    }),
    ..Law::linear(
        &ENTRY,
        &["mass", "mx", "my", "mz", "second"],
        |at, _, out| {
            let (robot, state) = (at.scene.robot, at.state::<MOST_JOINTS>());
            let [q, v, a] = state.each_ref().map(|x| &x[..robot.joints()]);
            out.copy_from_slice(&robot.level_tool_row(at.joint, q, v, a));
        },
    )
};

/// Mass and first moments of a body in a file.
pub(super) fn body(values: &EffectValues) -> Result<[f64; 4], EffectError> {
    let mass = values.get("mass")?;
    if mass == 0.0 {
        return Err(values.unusable("mass", mass));
    }
    let [mx, my, mz] = ["mx", "my", "mz"].map(|key| values.get(key));
    Ok([mass, mx?, my?, mz?])
}
