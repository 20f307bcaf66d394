//! What the numbers of an effect must satisfy to bear its name: limits of physics, as data of the catalogue.
//! A fit that passes every test and breaks one of them has found something else.

use super::JointCover;
use crate::robot::JointKind;
use crate::robot::drive::JointDrive;
use crate::robot::model::JointFriction;

/// One thing that must hold.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    pub of: LimitedNumber,
    pub least: Limit,
    pub most: Limit,
    /// Why, in words: `a worn gear has up to 0.03 rad or 2 mm`.
    pub why: &'static str,
}

/// A number of an effect that is looked at.
#[derive(Debug, Clone, Copy)]
pub enum LimitedNumber {
    /// That of a key.
    Key(&'static str),
    /// Its size.
    Size(&'static str),
    /// One key over another.
    Ratio(&'static str, &'static str),
    /// Root of the squares of two keys.
    Amplitude(&'static str, &'static str),
    /// One key and the joint's top speed in the logs times another.
    AtTopSpeed(&'static str, &'static str),
    /// 1 where gravity acts on the joint, else 0.
    Weight,
}

/// What it is held against.
#[derive(Debug, Clone, Copy)]
pub enum Limit {
    None,
    Is(f64),
    /// Times the joint's top speed in the logs.
    TopSpeed(f64),
    /// Times the longest log.
    Duration(f64),
    /// Times the joint's Coulomb friction.
    Coulomb(f64),
    /// Times the square of the motion's own angular frequency, its rms acceleration over its rms speed.
    MotionSquared(f64),
    /// The play that the joint's drive can have.
    Backlash,
    /// The presliding displacement that it can have.
    Presliding,
}

/// What limits refer to: a joint, what it did, and what is declared of it.
#[derive(Debug, Clone, Copy)]
pub struct LimitContext<'a> {
    pub cover: &'a JointCover,
    /// Longest log \[s\].
    pub duration_s: f64,
    pub kind: JointKind,
    pub friction: &'a JointFriction,
    pub drive: &'a JointDrive,
    /// Gravity acts on it, as far as the model knows.
    pub weight: bool,
}

impl Rule {
    const USUAL: Rule = Rule {
        of: LimitedNumber::Weight,
        least: Limit::None,
        most: Limit::None,
        why: "",
    };

    /// A number at most as large.
    pub(crate) const fn at_most(of: LimitedNumber, most: Limit, why: &'static str) -> Rule {
        Rule {
            of,
            most,
            why,
            ..Rule::USUAL
        }
    }

    /// A number at least as large.
    pub(crate) const fn at_least(of: LimitedNumber, least: Limit, why: &'static str) -> Rule {
        Rule {
            of,
            least,
            why,
            ..Rule::USUAL
        }
    }

    /// A key that is not negative.
    pub(crate) const fn not_negative(key: &'static str, why: &'static str) -> Rule {
        Rule::at_least(LimitedNumber::Key(key), Limit::Is(0.0), why)
    }

    /// What it says of an effect's keys, where they break it: the number in words and why it cannot be.
    pub fn broken(
        &self,
        value: &dyn Fn(&str) -> Option<f64>,
        seen: &LimitContext,
    ) -> Option<String> {
        let number = self.of.value(value, seen)?;
        let below = self.least.value(seen).filter(|least| number < *least);
        let above = self.most.value(seen).filter(|most| number > *most);
        let held = match (below, above) {
            (Some(least), _) => format!("is below {}", short(least)),
            (_, Some(most)) => format!("is above {}", short(most)),
            (None, None) => return None,
        };
        let name = match self.of {
            LimitedNumber::Key(name) => name.to_owned(),
            LimitedNumber::Size(name) => format!("|{name}|"),
            LimitedNumber::Ratio(a, b) => format!("{a}/{b}"),
            LimitedNumber::Amplitude(a, b) => format!("the amplitude of {a} and {b}"),
            LimitedNumber::AtTopSpeed(a, b) => format!("{a} + {b} |v| at top speed"),
            LimitedNumber::Weight => return Some(self.why.to_owned()),
        };
        Some(format!("{name} = {} {held}: {}", short(number), self.why))
    }

    /// The least that it allows.
    pub(crate) fn least_of(&self, seen: &LimitContext) -> Option<f64> {
        self.least.value(seen)
    }

    /// The most that it allows.
    pub(crate) fn most_of(&self, seen: &LimitContext) -> Option<f64> {
        self.most.value(seen)
    }

    /// The key that it looks at, where it is one.
    pub fn key(&self) -> Option<&'static str> {
        match self.of {
            LimitedNumber::Key(key) => Some(key),
            _ => None,
        }
    }
}

impl LimitedNumber {
    fn value(self, key: &dyn Fn(&str) -> Option<f64>, seen: &LimitContext) -> Option<f64> {
        match self {
            LimitedNumber::Key(name) => key(name),
            LimitedNumber::Size(name) => key(name).map(f64::abs),
            LimitedNumber::Ratio(a, b) => Some(key(a)? / key(b)?),
            LimitedNumber::Amplitude(a, b) => Some(key(a)?.hypot(key(b)?)),
            LimitedNumber::AtTopSpeed(a, b) => Some(key(a)? + seen.cover.fastest() * key(b)?),
            LimitedNumber::Weight => Some(f64::from(u8::from(seen.weight))),
        }
    }
}

impl Limit {
    /// In the unit of the number; none where there is none.
    fn value(self, seen: &LimitContext) -> Option<f64> {
        match self {
            Limit::None => None,
            Limit::Is(x) => Some(x),
            Limit::TopSpeed(share) => Some(share * seen.cover.fastest()),
            Limit::Duration(share) => Some(share * seen.duration_s),
            // where there is none, something else was found in its place
            Limit::Coulomb(share) => {
                let level = seen.friction.coulomb().filter(|level| *level > 0.0);
                level.map(|level| share * level)
            }
            Limit::MotionSquared(share) => {
                let frequency = seen.cover.acceleration_rms / seen.cover.speed_rms;
                (seen.cover.speed_rms > 0.0).then(|| share * frequency.powi(2))
            }
            Limit::Backlash => Some(seen.drive.backlash(seen.kind)),
            Limit::Presliding => Some(seen.drive.presliding(seen.kind)),
        }
    }
}

/// A number in three digits.
fn short(x: f64) -> String {
    let size = x.abs();
    match size {
        0.0 => "0".to_owned(),
        s if !(1e-3..1e5).contains(&s) => format!("{x:.2e}"),
        s => format!("{x:.*}", (2 - s.log10().floor() as i32).max(0) as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{entry, law};
    use crate::robot::Robot;
    use crate::robot::drive::DriveKind;
    use crate::robot::friction::ViscousCoulomb;

    /// What a joint that turns at up to 2 rad/s for 60 s says of an effect and its keys, its drive declared so.
    fn said(effect: &str, drive: &JointDrive) -> Option<String> {
        let cover = JointCover {
            speed: [-2.0, 2.0],
            speed_rms: 1.0,
            acceleration_rms: 5.0,
            ..JointCover::default()
        };
        let friction = JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: 3.0,
            coulomb: 10.0,
        });
        let seen = LimitContext {
            cover: &cover,
            duration_s: 60.0,
            kind: JointKind::Revolute,
            friction: &friction,
            drive,
            weight: false,
        };
        let mut words = effect.split(' ');
        let mut rules = entry(words.next()?).unwrap().must.iter();
        let keys: Vec<(&str, &str)> = words.filter_map(|word| word.split_once('=')).collect();
        let value = |key: &str| {
            let found = keys.iter().find(|k| k.0 == key);
            found.map(|k| k.1.parse().unwrap())
        };
        rules.find_map(|rule| rule.broken(&value, &seen))
    }

    #[test]
    fn numbers_that_no_machine_has_are_not_the_effect_and_those_that_it_has_are() {
        let cases = [
            ("stribeck c=-9.5 vs=0.1", false),
            ("stribeck c=2.0 vs=0.1", true),
            ("stribeck c=2.0 vs=0.7", false),
            ("smooth-coulomb vs=0.1 fc=9.0", true),
            ("smooth-coulomb vs=0.1 fc=-9.0", false),
            ("smooth-coulomb vs=1.2 fc=9.0", false),
            ("load-friction mu_c=-0.044 mu_v=0.1 w=50.0", false),
            ("load-friction mu_c=0.05 mu_v=-0.01 w=50.0", true),
            ("load-friction mu_c=0.0 mu_v=-0.5 w=50.0", false),
            ("drive-efficiency k=0.2", true),
            ("drive-efficiency k=0.9", false),
            ("drive-efficiency k=-0.1", false),
            ("presliding sigma0=900.0 sigma1=1.0 fc=9.0", true),
            ("presliding sigma0=90.0 sigma1=1.0 fc=9.0", false),
            ("presliding sigma0=900.0 sigma1=-1.0 fc=9.0", false),
            ("backlash gap=0.45 c=5.0", false),
            ("backlash gap=0.01 c=5.0", true),
            ("elasticity stiffness=28.0 inertia=0.1 damping=1.0", false),
            ("elasticity stiffness=9e3 inertia=0.1 damping=0.05", true),
            // within the motion's own band
            ("elasticity stiffness=4.0 inertia=0.1 damping=0.05", false),
            ("delay d=0.026", true),
            ("delay d=-0.2", false),
            ("warm-up k=-0.15 T=0.42", false),
            ("warm-up k=-0.15 T=15.0", true),
            ("warm-up k=-0.15 T=400.0", false),
            ("position-friction sin=3.0 cos=4.0", true),
            ("position-friction sin=9.0 cos=9.0", false),
            ("counterbalance m_1=3.0", false),
            ("coupling viscous=0.1 coulomb=0.1 inertia=-2.0", false),
            ("rotor-inertia J=-0.1", false),
            ("payload mass=-0.1", false),
        ];
        for (effect, holds) in cases {
            let shown = said(effect, &JointDrive::default());
            assert_eq!(shown.is_none(), holds, "{effect}: {shown:?}");
            assert!(shown.is_none_or(|why| why.len() > 20), "{effect}");
        }
    }

    #[test]
    fn a_declared_drive_widens_and_narrows_what_a_joint_can_have() {
        let gap = |drive: JointDrive, gap: f64| said(&format!("backlash gap={gap}"), &drive);
        let of = |kind| JointDrive {
            kind: Some(kind),
            ..JointDrive::default()
        };
        assert!(gap(of(DriveKind::Geared), 0.01).is_none());
        assert!(gap(of(DriveKind::Harmonic), 0.01).is_some());
        assert!(gap(of(DriveKind::Direct), 1e-4).is_some());
        let declared = |most| JointDrive {
            backlash_max: Some(most),
            ..of(DriveKind::Harmonic)
        };
        assert!(gap(declared(0.02), 0.01).is_none());
        assert!(gap(declared(0.001), 0.01).is_some());
        let presliding = "presliding sigma0=90 sigma1=0 fc=9";
        let wide = JointDrive {
            presliding_max: Some(0.2),
            ..JointDrive::default()
        };
        assert!(said(presliding, &JointDrive::default()).is_some());
        assert!(said(presliding, &wide).is_none());
    }

    #[test]
    fn rules_look_at_keys_of_their_entry() {
        let robot = Robot::single_joint("q1", JointKind::Revolute);
        for name in crate::effect::names() {
            let entry = law(&robot, name).unwrap().entry;
            for rule in entry.must {
                let keys: &[&str] = match rule.of {
                    LimitedNumber::Key(a) | LimitedNumber::Size(a) => &[a],
                    LimitedNumber::Ratio(a, b)
                    | LimitedNumber::Amplitude(a, b)
                    | LimitedNumber::AtTopSpeed(a, b) => &[a, b],
                    LimitedNumber::Weight => &[],
                };
                assert!(keys.iter().all(|key| entry.key(key).is_some()), "{name}");
            }
        }
    }
}
