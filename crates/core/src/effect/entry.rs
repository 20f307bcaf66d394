//! What is known of an effect, whoever models it. The estimator and the simulator read the same entries and
//! have laws of their own, so that each checks the other.

use super::{CurveSignal, EffectFacts, PlaceRule, Rule, Unit};

/// Families of effects that look alike: named first, the member only where the data separate it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    Offset,
    Velocity,
    Cross,
    Load,
    Position,
    Memory,
    Timing,
    Inertia,
    Slow,
    Event,
    Data,
    /// A formula of the user's own.
    Own,
}

impl Family {
    /// Name in results and files.
    pub const fn name(self) -> &'static str {
        match self {
            Family::Offset => "offset",
            Family::Velocity => "velocity",
            Family::Cross => "cross",
            Family::Load => "load",
            Family::Position => "position",
            Family::Memory => "memory",
            Family::Timing => "timing",
            Family::Inertia => "inertia",
            Family::Slow => "slow",
            Family::Event => "event",
            Family::Data => "data",
            Family::Own => "own",
        }
    }
}

/// How an effect's coefficients are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Columns that are added to the torque.
    Columns,
    /// Shifts the whole torque of its joints in time; its column is the derivative by the shift.
    Shift,
    /// Cannot be found by a fit that was free while carrying it: only with the model fixed.
    Kept,
    /// The data are cut or refused where it shows: no parameter is found.
    Fault,
    /// Takes the place of what breaks a range, and is not looked for by itself.
    StandIn,
}

/// What the search does with the parameters that shape an effect's columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShapeSearch {
    /// There are none.
    Linear,
    /// The best of a few is taken as it is.
    Grid,
    /// The best of a few is refined: by the simplex method, then by its derivatives with all other unknowns;
    /// its deviation is that of the profile.
    Refined,
    /// The effect repeats with position: orders from the peaks of the residual's spectrum, refined likewise. Each
    /// order is an effect of its own, so that it may come more than once.
    Orders,
}

impl ShapeSearch {
    /// Whether shapes are refined, and not only chosen.
    pub fn refines(self) -> bool {
        matches!(self, ShapeSearch::Refined | ShapeSearch::Orders)
    }
}

/// A motion of one joint alone, both ways at ten speeds over its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLadder {
    /// Duration \[s\].
    pub seconds: u32,
    /// Share of the range, where it is not the whole.
    pub travel: Option<f64>,
}

impl SpeedLadder {
    /// As long as a person waits for.
    pub const USUAL: SpeedLadder = SpeedLadder {
        seconds: 60,
        travel: None,
    };
    /// Beside logs over the whole range: a gap keeps its width, a loop shrinks with the amplitude.
    pub(crate) const NARROW: SpeedLadder = SpeedLadder {
        travel: Some(0.1),
        ..SpeedLadder::USUAL
    };
    /// Long enough for friction to warm up.
    pub const LONG: SpeedLadder = SpeedLadder {
        seconds: 600,
        ..SpeedLadder::USUAL
    };
}

/// One number of an effect, as files, results and the command line name it.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    pub name: &'static str,
    pub unit: Unit,
    /// Whether the key is a size of the effect. Where one size is given the other sizes are zero, and where none
    /// is they take their defaults; every other key takes its own default.
    pub size: bool,
    /// What a machine can have.
    pub range: Option<Range>,
    /// Whether a model file may leave it out, as those that are older than the key do: it is 0 there.
    pub optional: bool,
}

/// Values that a key can have.
#[derive(Debug, Clone, Copy)]
pub struct Range {
    pub least: f64,
    pub most: f64,
    /// Whether the least is none of them.
    pub open: bool,
    /// In words: `must be above 0`.
    pub rule: &'static str,
}

impl Key {
    /// A size of the effect.
    pub const fn size(name: &'static str, unit: Unit) -> Self {
        Self {
            name,
            unit,
            size: true,
            range: None,
            optional: false,
        }
    }

    /// A size that is a torque.
    pub(super) const fn torque(name: &'static str) -> Self {
        Self::size(name, Unit::Torque)
    }

    /// A number that shapes the effect.
    pub const fn shape(name: &'static str, unit: Unit) -> Self {
        Self {
            size: false,
            ..Self::size(name, unit)
        }
    }

    /// The key that files may leave out, 0 there.
    pub(super) const fn or_zero(self) -> Self {
        Self {
            optional: true,
            ..self
        }
    }

    /// The key with numbers from `least` to `most` alone.
    pub const fn within(self, least: f64, most: f64, rule: &'static str) -> Self {
        let range = Some(Range {
            least,
            most,
            open: false,
            rule,
        });
        Self { range, ..self }
    }

    /// The key with numbers above zero alone.
    pub(crate) const fn above_zero(self, rule: &'static str) -> Self {
        let range = Some(Range {
            least: 0.0,
            most: f64::INFINITY,
            open: true,
            rule,
        });
        Self { range, ..self }
    }
}

impl Range {
    /// Whether a number is one of them.
    pub fn holds(&self, value: f64) -> bool {
        let low = value > self.least || (!self.open && value == self.least);
        low && value <= self.most
    }
}

/// An effect.
#[derive(Debug)]
pub struct Entry {
    /// As results, files and the command line name it.
    pub name: &'static str,
    /// That which results name, then others that it looks like.
    pub families: &'static [Family],
    pub keys: &'static [Key],
    pub places: PlaceRule,
    pub role: Role,
    pub search: ShapeSearch,
    /// Whether its torque is the same while its joint rests. Friction takes any torque there.
    pub at_rest: bool,
    /// Whether it is friction: with all other friction of its joints it takes power.
    pub friction: bool,
    /// Whether every machine is expected to have it: a shape that the declared law leaves open.
    pub expected: bool,
    /// Whether a person can measure its size: it is known or it is not, and never taken in part.
    pub measurable: bool,
    /// What its numbers must satisfy to bear its name.
    pub must: &'static [Rule],
    /// The signal over which a curve takes its place where they do not.
    pub otherwise: Option<CurveSignal>,
    /// The motion that separates it from its like; none where it takes a payload, a standstill or other sensors.
    pub ladder: Option<SpeedLadder>,
    /// The experiment that separates it, as what to do.
    pub separate_by: &'static str,
    /// Torque that it adds, or what it does to a log.
    pub formula: &'static str,
    /// Where it comes from in a machine, and who wrote of it.
    pub source: &'static str,
    /// What it is called where it was found, with the numbers that a person asks for; nothing for a fault.
    pub said: fn(&EffectFacts) -> String,
    /// What to do about it.
    pub remedy: &'static str,
    /// Why it is no torque that a controller could send, where it is none.
    pub no_torque: Option<&'static str>,
}

impl Entry {
    /// What most have: columns without a shape, at any joint.
    pub const USUAL: Entry = Entry {
        name: "",
        families: &[],
        keys: &[],
        places: PlaceRule::Joints,
        role: Role::Columns,
        search: ShapeSearch::Linear,
        at_rest: false,
        friction: false,
        expected: false,
        measurable: false,
        must: &[],
        otherwise: None,
        ladder: None,
        separate_by: "",
        formula: "",
        source: "",
        said: |_| String::new(),
        remedy: "",
        no_torque: None,
    };

    /// The family that results name.
    pub fn family(&self) -> Family {
        self.families[0]
    }

    /// The key of a name.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }
}
