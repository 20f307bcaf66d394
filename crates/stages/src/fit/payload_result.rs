//! What `payload` found, what it says of a body, and the model with it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::note::StageNote;
use cft_ident_core::robot::standard::{Body, STANDARD};
use cft_ident_core::verdict::TorqueOff;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::{EffectParameter, EffectSection};
use cft_ident_logs::log::Provenance;

/// Times the usual error of a model from which on its absence explains nothing: other logs of a machine leave twice as
/// much. Half: no log of another day is without a payload; twice: a load of a tenth of the arm passes for none.
pub(super) const UNUSUAL: f64 = 4.0;
/// Times the deviation of the other reading from which on a number is not determined.
const OPEN: f64 = 1000.0;

/// A part of a log in which the load is carried.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CarriedSpan {
    /// Name of the log.
    pub log: String,
    /// From its first row on \[s\]; null where it is there from the beginning.
    pub from_s: Option<f64>,
    /// The same; null where it stays to the end.
    pub to_s: Option<f64>,
    /// Place of the log among those that are read.
    #[serde(skip)]
    pub place: usize,
}

impl CarriedSpan {
    /// Whether a time of a log is in it, and whether it is so near to an end that filters mix both sides: `room` \[s\].
    pub(super) fn holds(&self, log: usize, t: f64, room: f64) -> (bool, bool) {
        if log != self.place {
            return (false, false);
        }
        let (from, to) = (
            self.from_s.unwrap_or(f64::NEG_INFINITY),
            self.to_s.unwrap_or(f64::INFINITY),
        );
        let near = (t - from).abs() < room || (t - to).abs() < room;
        (from <= t && t < to, near)
    }
}

/// A part of a log in which something else acts on the arm than in the rest.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TouchedSpan {
    /// Name of the log.
    pub log: String,
    /// Its ends, from the first row of the log on \[s\].
    pub from_s: f64,
    pub to_s: f64,
    pub off: Vec<TorqueOff>,
    /// Place of the log among those that are read.
    #[serde(skip)]
    pub place: usize,
}

/// What a log says of the mass on the last link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PayloadVerdict {
    /// The interval lies above zero, whatever the gains of the torques are.
    Seen,
    /// It does with the gains of the model; with a gain error of each joint it holds both that mass and zero.
    NotApartFromGains,
    /// It does with the gains of the model; with a gain error of each joint the two intervals do not meet.
    GainsContradict,
    /// The interval holds zero with the gains of the model.
    NoneSeen,
    /// The interval holds zero, and the model leaves many times its usual error: something else is on the arm or acts on
    /// it.
    Unexplained,
    /// The log holds nothing on the mass.
    NotDetermined,
}

/// A number with its 95 % confidence interval; null where the log does not determine it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Number95")]
pub struct IntervalNumber {
    pub value: Option<f64>,
    pub std: Option<f64>,
    pub interval_95: Option<[f64; 2]>,
    pub unit: String,
}

/// A gain error of a joint's torque channel: what was logged over what the model's channel would show, less 1.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct GainOff {
    pub joint: String,
    pub error: IntervalNumber,
}

/// The torque error of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LeftOfJoint {
    pub joint: String,
    /// Relative error of the model as given.
    pub before: f64,
    /// The same with body, friction and offset (and gains) of this reading.
    pub after: f64,
    /// What is left then, root mean square \[N or Nm\].
    #[serde(skip)]
    pub rmse: f64,
    /// Whether the body that suits all joints together makes this joint's error larger than chance does.
    pub worse: bool,
}

/// The body by one reading of the torque channels.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PayloadReading {
    /// Whether gain errors were free.
    pub gains_free: bool,
    pub mass: IntervalNumber,
    /// Centre of gravity in the frame of the link \[m\].
    pub centre: [IntervalNumber; 3],
    /// Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the centre of gravity \[kg m^2\].
    pub inertia: [IntervalNumber; 6],
    pub gains: Vec<GainOff>,
    pub joints: Vec<LeftOfJoint>,
    /// Standard parameters of the body.
    #[serde(skip)]
    pub body: [f64; STANDARD],
}

/// What `payload` found.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Payload {
    /// Link that carries the body, in whose frame it is reported.
    pub link: String,
    pub verdict: PayloadVerdict,
    /// With the gains of the model, then with free ones.
    pub readings: Vec<PayloadReading>,
    /// Parts of the logs in which it is carried; empty where it is throughout.
    pub carried: Vec<CarriedSpan>,
    /// Parts of the logs that are left out, for what is left there is far from what is left of all other rows.
    pub touched: Vec<TouchedSpan>,
    /// The mass with them, gains as in the model; null where there are none.
    pub mass_with_touched: Option<IntervalNumber>,
    /// How many times the usual error of the model is left of the joint of which most is; null where the model file does
    /// not say what is usual.
    pub unusual: Option<f64>,
    pub samples: u64,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub notes: Vec<StageNote>,
}

impl IntervalNumber {
    /// Whether the interval lies above zero; false where there is none.
    pub(super) fn is_above_zero(&self) -> bool {
        self.interval_95.is_some_and(|[low, _]| low > 0.0)
    }

    /// Whether both intervals have numbers in common; one that is not known holds any.
    fn meets(&self, other: &Self) -> bool {
        let both = self.interval_95.zip(other.interval_95);
        both.is_none_or(|(a, b)| a[0] <= b[1] && b[0] <= a[1])
    }
}

impl PayloadVerdict {
    /// `unusual`: how many times the usual error of the model is left.
    pub(crate) fn of(readings: &[PayloadReading], unusual: Option<f64>) -> Self {
        let [held, free] = readings else {
            return Self::NotDetermined;
        };
        match held.mass.value {
            None => Self::NotDetermined,
            Some(_) if !held.mass.is_above_zero() => match unusual {
                Some(times) if times > UNUSUAL => Self::Unexplained,
                _ => Self::NoneSeen,
            },
            Some(_) if !free.mass.meets(&held.mass) => Self::GainsContradict,
            Some(_) if free.mass.is_above_zero() => Self::Seen,
            Some(_) => Self::NotApartFromGains,
        }
    }
}

impl PayloadReading {
    /// Takes numbers for what they are where they are known so much worse than in another reading that they say nothing:
    /// where the mass is one of them, so is all that is made with it.
    pub(super) fn forget_undetermined(&mut self, other: &Self) {
        let is_open = |own: &IntervalNumber, other: &IntervalNumber| {
            own.std > other.std.map(|std| OPEN * std)
        };
        let no_mass = is_open(&self.mass, &other.mass);
        let own = std::iter::once(&mut self.mass)
            .chain(&mut self.centre)
            .chain(&mut self.inertia);
        let others = std::iter::once(&other.mass)
            .chain(&other.centre)
            .chain(&other.inertia);
        for (own, other) in own.zip(others) {
            if no_mass || is_open(own, other) {
                (own.value, own.std, own.interval_95) = (None, None, None);
            }
        }
    }

    /// Joints whose error this reading makes larger.
    pub fn worse(&self) -> impl Iterator<Item = &LeftOfJoint> {
        self.joints.iter().filter(|joint| joint.worse)
    }

    /// The body as an effect of a model: its inertia is the same about every axis there.
    fn effect(&self) -> EffectSection {
        let body = Body::of(&self.body);
        let parameter = |value: f64, std: Option<f64>, unit: &str| EffectParameter {
            value,
            std,
            unit: unit.to_owned(),
            bound: false,
        };
        let [xx, _, _, yy, _, zz] = body.inertia;
        let mut parameters = BTreeMap::from([
            ("mass".to_owned(), parameter(body.mass, self.mass.std, "kg")),
            (
                "inertia".to_owned(),
                parameter((xx + yy + zz) / 3.0, None, "kg m^2"),
            ),
        ]);
        for (i, key) in ["mx", "my", "mz"].into_iter().enumerate() {
            parameters.insert(key.to_owned(), parameter(self.body[6 + i], None, "kg m"));
        }
        EffectSection {
            shrinkage: None,
            accepted_by_user: false,
            prediction_only: false,
            name: cft_ident_core::effect::payload::ENTRY.name.to_owned(),
            joint: None,
            parameters,
        }
    }
}

impl Payload {
    /// The model with the body of the reading without gain errors, as an effect; none where no body is seen, where free
    /// gains contradict it, or where it makes the error of a joint larger.
    pub fn loaded(&self, file: &ModelFile) -> Option<ModelFile> {
        use PayloadVerdict::{NotApartFromGains, Seen};
        let reading = self.readings.first()?;
        if !matches!(self.verdict, Seen | NotApartFromGains) || reading.worse().next().is_some() {
            return None;
        }
        let mut model = file.clone();
        model.effects.push(reading.effect());
        model.provenance.command = "payload".to_owned();
        model.provenance.inputs.extend(self.inputs.iter().cloned());
        Some(model)
    }
}
