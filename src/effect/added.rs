//! An effect with its numbers, as it stands in a model.

use std::collections::BTreeMap;

use super::{Family, Kind, Place, Role, Scene, Unit, kind_on};
use crate::robot::Robot;

/// Why an effect of a model file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    #[error("effect `{name}` is not known; known are {known}")]
    Unknown { name: String, known: String },
    #[error("effect `{name}`: this robot has no joint `{joint}`; it has {known}")]
    Joint {
        name: String,
        joint: String,
        known: String,
    },
    #[error("effect `{name}` cannot sit there on this robot")]
    Place { name: String },
    #[error("effect `{name}` lacks its parameter `{key}`; it takes {known}")]
    Key {
        name: String,
        key: String,
        known: String,
    },
    #[error("effect `{name}`: `{key}` = {value} is not a usable number")]
    Value {
        name: String,
        key: String,
        value: f64,
    },
}

/// One parameter of an effect as it is told: key, value, standard deviation, unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Told {
    pub key: String,
    pub value: f64,
    pub std: Option<f64>,
    pub unit: String,
}

/// An effect in a model.
#[derive(Debug, Clone)]
pub struct Added {
    pub kind: &'static Kind,
    pub place: Place,
    pub shape: Vec<f64>,
    pub linear: Vec<f64>,
}

impl PartialEq for Added {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name
            && self.place == other.place
            && self.shape == other.shape
            && self.linear == other.linear
    }
}

impl Added {
    /// The effect of a model file.
    ///
    /// # Errors
    /// [`EffectError`] for a name, joint or key that does not fit.
    pub fn of_keys(
        robot: &Robot,
        name: &str,
        joint: Option<&str>,
        values: &BTreeMap<String, f64>,
    ) -> Result<Self, EffectError> {
        let kind = kind_on(robot, name).ok_or_else(|| EffectError::Unknown {
            name: name.to_owned(),
            known: list(super::names()),
        })?;
        let keys = kind.shape.iter().chain(kind.linear).map(|k| k.name);
        let get = |key: &str| -> Result<f64, EffectError> {
            let value = values.get(key).copied().ok_or_else(|| EffectError::Key {
                name: name.to_owned(),
                key: key.to_owned(),
                known: list(keys.clone()),
            })?;
            if value.is_finite() {
                Ok(value)
            } else {
                Err(EffectError::Value {
                    name: name.to_owned(),
                    key: key.to_owned(),
                    value,
                })
            }
        };
        let place = place(robot, name, joint, &get)?;
        let numbers = |keys: &[super::Key]| {
            keys.iter()
                .map(|k| get(k.name))
                .collect::<Result<Vec<f64>, _>>()
        };
        let (shape, linear): (Vec<f64>, Vec<f64>) = match name {
            "presliding" => {
                let (sigma0, fc) = (get("sigma0")?, get("fc")?);
                if (sigma0 / fc).partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
                    return Err(EffectError::Value {
                        name: name.to_owned(),
                        key: "sigma0".to_owned(),
                        value: sigma0,
                    });
                }
                (vec![sigma0 / fc], vec![fc, get("sigma1")?])
            }
            "elasticity" => {
                let (stiffness, inertia) = (get("stiffness")?, get("inertia")?);
                let square = stiffness / inertia;
                if square.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
                    return Err(EffectError::Value {
                        name: name.to_owned(),
                        key: "stiffness".to_owned(),
                        value: stiffness,
                    });
                }
                let frequency = square.sqrt() / std::f64::consts::TAU;
                (vec![frequency, get("damping")?], vec![inertia])
            }
            "payload" if !kind.shape.is_empty() => {
                let mass = get("mass")?;
                if mass == 0.0 {
                    return Err(EffectError::Value {
                        name: name.to_owned(),
                        key: "mass".to_owned(),
                        value: mass,
                    });
                }
                let own = values.get("inertia").map_or(Ok(0.0), |_| get("inertia"))?;
                let centre = ["mx", "my", "mz"].map(|key| get(key).map(|moment| moment / mass));
                (
                    centre.into_iter().collect::<Result<_, _>>()?,
                    vec![mass, own],
                )
            }
            "payload" => {
                let [mass, mx, my, mz] = [get("mass")?, get("mx")?, get("my")?, get("mz")?];
                // a point where nothing is said of its extent
                let own = values.get("inertia").map_or(Ok(0.0), |_| get("inertia"))?;
                (
                    Vec::new(),
                    vec![mass, mx, my, mz, own + (mx * mx + mz * mz) / mass],
                )
            }
            _ => (numbers(kind.shape)?, numbers(kind.linear)?),
        };
        Ok(Added {
            kind,
            place,
            shape,
            linear,
        })
    }

    /// What the effect adds to joint `joint` along a scene, into `out` (zeroed before); nothing for
    /// effects that shift the torque.
    pub fn torque(&self, scene: &Scene, joint: usize, out: &mut [f64]) {
        out.fill(0.0);
        if self.kind.role == Role::Shift || !self.place.touches(joint) {
            return;
        }
        let columns = self.columns(scene, joint);
        for (column, c) in columns.iter().zip(&self.linear) {
            for (x, y) in out.iter_mut().zip(column) {
                *x += c * y;
            }
        }
    }

    /// Its columns in the rows of joint `joint`.
    pub fn columns(&self, scene: &Scene, joint: usize) -> Vec<Vec<f64>> {
        let mut out = vec![vec![0.0; scene.len()]; self.kind.linear.len()];
        if self.place.touches(joint) {
            (self.kind.columns)(scene, self.place, &self.shape, joint, &mut out);
        }
        out
    }

    /// Time by which it shifts the torque of joint `joint` \[s\].
    pub fn shift(&self, joint: usize) -> f64 {
        if self.kind.role == Role::Shift && self.place.touches(joint) {
            self.linear[0]
        } else {
            0.0
        }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.shape.len() + self.linear.len()
    }

    /// Family.
    pub fn family(&self) -> Family {
        self.kind.family
    }

    /// Name, or name and place: `ripple of q4`.
    pub fn title(&self, robot: &Robot) -> String {
        match (self.place, self.place.name(robot)) {
            (Place::Pair { of, .. }, Some(on)) => {
                format!(
                    "{} of {on} with {}",
                    self.kind.name,
                    robot.joint_names()[of]
                )
            }
            (Place::Geared { other, .. }, Some(motor)) => {
                format!(
                    "{} of {motor} and {}",
                    self.kind.name,
                    robot.joint_names()[other]
                )
            }
            (_, Some(place)) => format!("{} of {place}", self.kind.name),
            (_, None) => self.kind.name.to_owned(),
        }
    }

    /// Parameters as files and tables name them. `covariance` is that of (shape, linear), row-major;
    /// a shape that these data leave open has infinite variance there. `torque` is the torque's unit.
    pub fn told(&self, robot: &Robot, torque: &str, covariance: Option<&[f64]>) -> Vec<Told> {
        let kind = self.place.kind(robot);
        let k = self.parameters();
        let std = |gradient: &[f64]| {
            let c = covariance?;
            let mut variance = 0.0;
            for a in 0..k {
                for b in 0..k {
                    if gradient[a] != 0.0 && gradient[b] != 0.0 {
                        variance += gradient[a] * gradient[b] * c[a * k + b];
                    }
                }
            }
            // rounding may leave nothing below nothing; what is not a number is no deviation
            let std = if variance < 0.0 { 0.0 } else { variance.sqrt() };
            std.is_finite().then_some(std)
        };
        let unit_vector = |i: usize| {
            let mut g = vec![0.0; k];
            g[i] = 1.0;
            g
        };
        let told = |key: &str, value: f64, gradient: Vec<f64>, unit: Unit| Told {
            key: key.to_owned(),
            value,
            std: std(&gradient),
            unit: unit.text(kind, torque),
        };
        let mut out = Vec::with_capacity(k + 1);
        match self.kind.name {
            "presliding" => {
                let (rate, fc) = (self.shape[0], self.linear[0]);
                out.push(told(
                    "sigma0",
                    fc * rate,
                    vec![fc, rate, 0.0],
                    Unit::Stiffness,
                ));
                out.push(told(
                    "sigma1",
                    self.linear[1],
                    unit_vector(2),
                    Unit::Viscous,
                ));
                out.push(told("fc", fc, unit_vector(1), Unit::Torque));
            }
            "elasticity" => {
                let (frequency, inertia) = (self.shape[0], self.linear[0]);
                let square = (std::f64::consts::TAU * frequency).powi(2);
                let stiffness = square * inertia;
                out.push(told(
                    "stiffness",
                    stiffness,
                    vec![2.0 * stiffness / frequency, 0.0, square],
                    Unit::Stiffness,
                ));
                out.push(told("inertia", inertia, unit_vector(2), Unit::Inertia));
                out.push(told(
                    "damping",
                    self.shape[1],
                    unit_vector(1),
                    Unit::Text(""),
                ));
            }
            "payload" if !self.shape.is_empty() => {
                let mass = self.linear[0];
                out.push(told("mass", mass, unit_vector(3), Unit::Text("kg")));
                for (i, key) in ["mx", "my", "mz"].into_iter().enumerate() {
                    let mut slopes = unit_vector(i);
                    slopes[i] = mass;
                    slopes[3] = self.shape[i];
                    out.push(told(key, mass * self.shape[i], slopes, Unit::Text("kg m")));
                }
                let unit = Unit::Text("kg m^2");
                out.push(told("inertia", self.linear[1], unit_vector(4), unit));
            }
            "payload" => {
                let [mass, mx, _, mz, second] = [0, 1, 2, 3, 4].map(|i| self.linear[i]);
                for (i, key) in self.kind.linear.iter().take(4).enumerate() {
                    out.push(told(key.name, self.linear[i], unit_vector(i), key.unit));
                }
                let far = (mx * mx + mz * mz) / mass;
                let slopes = vec![far / mass, -2.0 * mx / mass, 0.0, -2.0 * mz / mass, 1.0];
                let unit = Unit::Text("kg m^2");
                // robots whose columns have no second moment leave it at rest
                if second != 0.0 {
                    out.push(told("inertia", second - far, slopes, unit));
                }
            }
            _ => {
                let keys = self.kind.shape.iter().chain(self.kind.linear);
                let values = self.shape.iter().chain(&self.linear);
                for (i, (key, value)) in keys.zip(values).enumerate() {
                    out.push(told(key.name, *value, unit_vector(i), key.unit));
                }
            }
        }
        let mut place = |key: &str, value: usize| {
            out.push(Told {
                key: key.to_owned(),
                value: value as f64,
                std: None,
                unit: String::new(),
            });
        };
        match self.place {
            Place::Pair { of, .. } => place("from", of + 1),
            Place::Geared { other, .. } => {
                place("from", other + 1);
                place("both", 1);
            }
            _ => {}
        }
        out
    }
}

/// Where an effect of a file sits.
fn place(
    robot: &Robot,
    name: &str,
    joint: Option<&str>,
    get: &dyn Fn(&str) -> Result<f64, EffectError>,
) -> Result<Place, EffectError> {
    let nowhere = || EffectError::Place {
        name: name.to_owned(),
    };
    let Some(joint) = joint else {
        return match name {
            "delay" | "gravity-tilt" | "payload" | "rigid-body-terms" => Ok(Place::All),
            _ => Err(nowhere()),
        };
    };
    let mut screws = robot.transmission().screws().iter();
    if matches!(name, "actuator-friction" | "rotor-inertia")
        && let Some(screw) = screws.position(|screw| *screw == joint)
    {
        return Ok(Place::Actuator(screw));
    }
    let names = robot.joint_names();
    let on = names
        .iter()
        .position(|n| n == joint)
        .ok_or_else(|| EffectError::Joint {
            name: name.to_owned(),
            joint: joint.escape_debug().to_string(),
            known: list(names.iter().map(String::as_str)),
        })?;
    match name {
        "coupling" => {
            let of = get("from")?;
            let at = of as usize;
            if of.fract() != 0.0 || at < 1 || at > names.len() || at - 1 == on {
                return Err(EffectError::Value {
                    name: name.to_owned(),
                    key: "from".to_owned(),
                    value: of,
                });
            }
            let both = get("both").is_ok_and(|both| both != 0.0);
            Ok(match both {
                true => Place::Geared {
                    motor: on,
                    other: at - 1,
                },
                false => Place::Pair { on, of: at - 1 },
            })
        }
        "gravity-tilt" | "payload" | "rigid-body-terms" | "actuator-friction" => Err(nowhere()),
        _ => Ok(Place::Joint(on)),
    }
}

fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}
