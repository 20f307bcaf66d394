//! What the study puts into its plants: every effect that has a joint to sit on, at two places; on the
//! CFT robot, or on single drives where its declared friction law leaves no place for the effect.

use std::collections::BTreeMap;

use cft_ident::effect::{self, Entry, Role};
use cft_ident::simulate::SingleJointTruth;

use crate::drive::{self, SLIDE, WHEEL};

/// An effect at its places: its fixed keys, and the keys that carry its size.
pub struct Planted {
    pub name: &'static str,
    /// Joints, screws or drives; empty for the robot as a whole.
    pub places: [&'static str; 2],
    pub shape: &'static [(&'static str, f64)],
    pub size: &'static [(&'static str, f64)],
    /// On single drives, the keys at a scale.
    pub on_drive: Option<OnDrive>,
}

/// Keys of an effect on a single drive that do not grow in proportion to its size.
#[derive(Clone, Copy)]
pub struct OnDrive {
    pub values: fn(&SingleJointTruth, f64) -> BTreeMap<String, f64>,
    /// Whether the scale is its size; else that of its torque.
    pub as_given: bool,
}

impl Planted {
    /// What the program knows of it.
    pub fn entry(&self) -> &'static Entry {
        effect::entry(self.name).expect("an effect")
    }

    /// Found with the model fixed only: it is identified on logs without the effect.
    pub fn kept(&self) -> bool {
        self.entry().role == Role::Kept
    }
}

const fn planted(
    name: &'static str,
    places: [&'static str; 2],
    shape: &'static [(&'static str, f64)],
    size: &'static [(&'static str, f64)],
) -> Planted {
    Planted {
        name,
        places,
        shape,
        size,
        on_drive: None,
    }
}

const fn on_drives(
    name: &'static str,
    as_given: bool,
    values: fn(&SingleJointTruth, f64) -> BTreeMap<String, f64>,
) -> Planted {
    Planted {
        on_drive: Some(OnDrive { values, as_given }),
        ..planted(name, [SLIDE, WHEEL], &[], &[])
    }
}

/// All effects of the study. Sizes of one place are in proportion to the numbers here.
pub const PLANTED: &[Planted] = &[
    planted("torque-offset", ["q1", "q2"], &[], &[("c", 1.0)]),
    planted(
        "asymmetric-friction",
        ["q1", "q2"],
        &[],
        &[("coulomb", 1.0), ("viscous", 1.0)],
    ),
    on_drives("stribeck", false, drive::hump),
    planted(
        "nonlinear-viscous",
        ["q1", "q2"],
        &[("p", 2.0)],
        &[("c", 1.0)],
    ),
    planted(
        "actuator-friction",
        ["x_r", "y_r"],
        &[("slope", 200.0)],
        &[("viscous", 1.0), ("coulomb", 0.3)],
    ),
    planted(
        "load-friction",
        ["q4", "q5"],
        &[("w", 100.0)],
        &[("mu_c", 1.0), ("mu_v", 0.0)],
    ),
    planted("drive-efficiency", ["q4", "q5"], &[], &[("k", 1.0)]),
    planted("gain", ["q1", "q4"], &[], &[("k", 1.0)]),
    planted(
        "position-friction",
        ["q1", "q2"],
        &[("order", 10.0)],
        &[("sin", 1.0), ("cos", 0.5)],
    ),
    planted(
        "ripple",
        ["q1", "q2"],
        &[("order", 14.0)],
        &[("sin", 1.0), ("cos", 0.5)],
    ),
    planted(
        "spring",
        ["q1", "q2"],
        &[("q0", 0.4)],
        &[("k", 1.0), ("k3", 0.0)],
    ),
    planted("counterbalance", ["q2", "q5"], &[], &[("stiffness", 1e3)]),
    planted("backlash", ["q1", "q2"], &[("gap", 0.01)], &[("c", 1.0)]),
    // the bend of bristles has no size without the motion at rest: thousandths of the travel
    on_drives("presliding", true, drive::bristles),
    planted("delay", ["q1", "q2"], &[], &[("d", 1.0)]),
    on_drives("elasticity", false, drive::soft),
    planted("rotor-inertia", ["x_r", "y_r"], &[], &[("J", 1.0)]),
    planted(
        "rigid-body-terms",
        ["", ""],
        &[],
        &[("AC", 1.0), ("OB", 0.5), ("BE", -0.5)],
    ),
    planted(
        "payload",
        ["", ""],
        &[],
        &[("mass", 1.0), ("mx", 0.4), ("my", 0.0), ("mz", 0.0)],
    ),
    planted("gravity-tilt", ["", ""], &[], &[("gx", 1.0), ("gy", 0.5)]),
    planted(
        "coupling",
        ["q1", "q2"],
        &[("from", 3.0), ("r", 1.0)],
        &[("viscous", 1.0), ("coulomb", 0.0), ("inertia", 0.0)],
    ),
    planted("warm-up", ["q1", "q2"], &[("T", 8.0)], &[("k", -1.0)]),
    planted("drift", ["q1", "q4"], &[], &[("c", 1.0)]),
    planted(
        "disturbance",
        ["q1", "q4"],
        &[("at", 8.0), ("seconds", 0.3)],
        &[("c", 1.0)],
    ),
];

/// Two effects at once: an effect at a place and another at another, both of size 4.
pub const PAIRS: &[[(&str, &str); 2]] = &[
    [("ripple", "q1"), ("delay", "q2")],
    [("asymmetric-friction", "q1"), ("load-friction", "q4")],
    [("torque-offset", "q1"), ("ripple", "q2")],
    [("spring", "q2"), ("drift", "q1")],
    [("drive-efficiency", "q5"), ("position-friction", "q1")],
    [("rotor-inertia", "x_r"), ("ripple", "q1")],
    [("actuator-friction", "y_r"), ("warm-up", "q1")],
    [("nonlinear-viscous", "q1"), ("drift", "q4")],
    [("coupling", "q2"), ("delay", "q1")],
    [("asymmetric-friction", "q2"), ("ripple", "q2")],
];

/// The size of each of two effects at once, and of one that the catalogue is without.
pub const TOGETHER: f64 = 4.0;
/// The size of an effect that is withheld from the catalogue.
pub const WITHHELD: f64 = 6.0;
/// Sizes of single effects.
pub const SIZES: [f64; 3] = [6.0, 2.0, 0.5];

/// What is put into one campaign.
#[derive(Clone)]
pub struct Put {
    pub kind: &'static Planted,
    pub place: &'static str,
    pub size: f64,
}

/// One case of a seed.
#[derive(Clone)]
pub struct Setting {
    pub study: &'static str,
    pub put: Vec<Put>,
    /// The catalogue is without the effect.
    pub withheld: bool,
}

impl Setting {
    /// The drive that it runs on; none on the CFT robot.
    pub fn drive(&self) -> Option<&'static str> {
        let places = self.put.iter().map(|p| p.place);
        places.into_iter().find(|p| [SLIDE, WHEEL].contains(p))
    }

    /// Its name, by which a finished case is known again.
    pub fn name(&self) -> String {
        let put: Vec<String> = self
            .put
            .iter()
            .map(|p| format!("{}:{}:{}", p.kind.name, p.place, p.size))
            .collect();
        format!("{} {}", self.study, put.join("+"))
    }
}

/// All cases of one seed: the largest single effects, two at once, withheld ones, then the smaller
/// single effects; a clean campaign before every eighth.
pub fn settings() -> Vec<Setting> {
    let setting = |study, put, withheld| Setting {
        study,
        put,
        withheld,
    };
    let single = |size: f64| {
        let places = PLANTED.iter().flat_map(|kind| {
            // the robot as a whole is one place
            let count = if kind.places[0].is_empty() { 1 } else { 2 };
            kind.places.into_iter().take(count).map(move |p| (kind, p))
        });
        places.map(move |(kind, place)| setting("one", vec![Put { kind, place, size }], false))
    };
    let mut out: Vec<Setting> = single(SIZES[0]).collect();
    out.extend(PAIRS.iter().map(|pair| {
        let put = pair.map(|(name, place)| Put {
            kind: PLANTED.iter().find(|k| k.name == name).expect("a kind"),
            place,
            size: TOGETHER,
        });
        setting("two", put.to_vec(), false)
    }));
    // what is held, and what is cut out, is no candidate to withhold
    let candidates = PLANTED
        .iter()
        .filter(|k| !k.kept() && k.entry().role != Role::Fault);
    out.extend(candidates.map(|kind| {
        let put = Put {
            kind,
            place: kind.places[0],
            size: WITHHELD,
        };
        setting("withheld", vec![put], true)
    }));
    out.extend(SIZES[1..].iter().flat_map(|size| single(*size)));
    let mut all = Vec::with_capacity(out.len() * 9 / 8 + 1);
    for (i, one) in out.into_iter().enumerate() {
        if i % 8 == 0 {
            all.push(setting("clean", Vec::new(), false));
        }
        all.push(one);
    }
    all
}
