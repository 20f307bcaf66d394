//! What the study puts into its plants: every effect that has a joint to sit on, at two places; on the
//! CFT robot, or on single drives where its declared friction law leaves no place for the effect.

use crate::drive::{SLIDE, WHEEL};

/// An effect at its places: its fixed keys, and the keys that carry its size.
pub struct Kind {
    pub name: &'static str,
    pub family: &'static str,
    /// Joints, screws or drives; empty for the robot as a whole.
    pub places: [&'static str; 2],
    pub shape: &'static [(&'static str, f64)],
    pub size: &'static [(&'static str, f64)],
    /// Found with the model held only: it is identified on logs without the effect.
    pub kept: bool,
}

const fn kind(
    name: &'static str,
    family: &'static str,
    places: [&'static str; 2],
    shape: &'static [(&'static str, f64)],
    size: &'static [(&'static str, f64)],
) -> Kind {
    Kind {
        name,
        family,
        places,
        shape,
        size,
        kept: false,
    }
}

const fn kept(kind: Kind) -> Kind {
    Kind { kept: true, ..kind }
}

/// All effects of the study. Sizes of one place are in proportion to the numbers here.
pub const KINDS: &[Kind] = &[
    kind("torque-offset", "offset", ["q1", "q2"], &[], &[("c", 1.0)]),
    kind(
        "asymmetric-friction",
        "velocity",
        ["q1", "q2"],
        &[],
        &[("coulomb", 1.0), ("viscous", 1.0)],
    ),
    kind("stribeck", "velocity", [SLIDE, WHEEL], &[], &[]),
    kind(
        "nonlinear-viscous",
        "velocity",
        ["q1", "q2"],
        &[("p", 2.0)],
        &[("c", 1.0)],
    ),
    kind(
        "actuator-friction",
        "velocity",
        ["x_r", "y_r"],
        &[("slope", 200.0)],
        &[("viscous", 1.0), ("coulomb", 0.3)],
    ),
    kind(
        "load-friction",
        "load",
        ["q4", "q5"],
        &[("w", 100.0)],
        &[("mu_c", 1.0), ("mu_v", 0.0)],
    ),
    kind("drive-efficiency", "load", ["q4", "q5"], &[], &[("k", 1.0)]),
    kept(kind("gain", "load", ["q1", "q4"], &[], &[("k", 1.0)])),
    kind(
        "position-friction",
        "position",
        ["q1", "q2"],
        &[("order", 10.0)],
        &[("sin", 1.0), ("cos", 0.5)],
    ),
    kind(
        "ripple",
        "position",
        ["q1", "q2"],
        &[("order", 14.0)],
        &[("sin", 1.0), ("cos", 0.5)],
    ),
    kind(
        "spring",
        "position",
        ["q1", "q2"],
        &[("q0", 0.4)],
        &[("k", 1.0), ("k3", 0.0)],
    ),
    kind(
        "counterbalance",
        "position",
        ["q2", "q5"],
        &[],
        &[("stiffness", 1e3)],
    ),
    kind(
        "backlash",
        "memory",
        ["q1", "q2"],
        &[("gap", 0.01)],
        &[("c", 1.0)],
    ),
    kind("presliding", "memory", [SLIDE, WHEEL], &[], &[]),
    kind("delay", "timing", ["q1", "q2"], &[], &[("d", 1.0)]),
    kind("elasticity", "timing", [SLIDE, WHEEL], &[], &[]),
    kind(
        "rotor-inertia",
        "inertia",
        ["x_r", "y_r"],
        &[],
        &[("J", 1.0)],
    ),
    kind(
        "rigid-body-terms",
        "inertia",
        ["", ""],
        &[],
        &[("AC", 1.0), ("OB", 0.5), ("BE", -0.5)],
    ),
    kept(kind(
        "payload",
        "inertia",
        ["", ""],
        &[],
        &[("mass", 1.0), ("mx", 0.4), ("my", 0.0), ("mz", 0.0)],
    )),
    kind(
        "gravity-tilt",
        "offset",
        ["", ""],
        &[],
        &[("gx", 1.0), ("gy", 0.5)],
    ),
    kind(
        "coupling",
        "cross",
        ["q1", "q2"],
        &[("from", 3.0), ("r", 1.0)],
        &[("viscous", 1.0), ("coulomb", 0.0), ("inertia", 0.0)],
    ),
    kind(
        "warm-up",
        "slow",
        ["q1", "q2"],
        &[("T", 8.0)],
        &[("k", -1.0)],
    ),
    kind("drift", "slow", ["q1", "q4"], &[], &[("c", 1.0)]),
    kind(
        "disturbance",
        "event",
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
    pub kind: &'static Kind,
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
        let places = KINDS.iter().flat_map(|kind| {
            // the robot as a whole is one place
            let count = if kind.places[0].is_empty() { 1 } else { 2 };
            kind.places.into_iter().take(count).map(move |p| (kind, p))
        });
        places.map(move |(kind, place)| setting("one", vec![Put { kind, place, size }], false))
    };
    let mut out: Vec<Setting> = single(SIZES[0]).collect();
    out.extend(PAIRS.iter().map(|pair| {
        let put = pair.map(|(name, place)| Put {
            kind: KINDS.iter().find(|k| k.name == name).expect("a kind"),
            place,
            size: TOGETHER,
        });
        setting("two", put.to_vec(), false)
    }));
    // what is held, and what is cut out, is no candidate to withhold
    let candidates = KINDS.iter().filter(|k| !k.kept && k.name != "disturbance");
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
