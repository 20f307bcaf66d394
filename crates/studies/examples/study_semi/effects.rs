//! What is put in: the simulator's effects along a measured motion.

use std::collections::BTreeMap;

use cft_ident::effect::{
    self, AugmentedModel, Cover, Entry, Place, Places, Role, Scene, Seen, Torques,
};
use cft_ident::motion::Stretch;
use cft_ident::robot::JointKind;
use cft_ident::robot::drive::JointDrive;
use cft_ident::robot::model::JointFriction;
use cft_ident::simulate::effects::{
    Beginning, Built, Effect, LAWS, LoggedChannels, PlantLaw, PlantRobot, PlantState, Site,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Steps of an effect's own states between two samples.
const STEPS: usize = 40;
/// Speed at which the sign of a speed is all but one, over the joint's rms speed.
const SIGN: f64 = 0.01;
/// What the simulator turns an inertia and a friction into a slope with \[1/s\].
const SIGN_RATE: f64 = 1e4;

/// An effect of the simulator.
pub struct Kind {
    law: &'static PlantLaw,
}

/// All that a free fit can find, in the order of the simulator.
pub fn kinds() -> &'static [Kind] {
    static KINDS: std::sync::OnceLock<Vec<Kind>> = std::sync::OnceLock::new();
    KINDS.get_or_init(|| {
        let found = LAWS.iter().filter(|law| {
            // what the CFT robot alone has stays with its own study
            let elsewhere = ["actuator-friction", "rigid-body-terms"];
            matches!(law.entry.role, Role::Columns | Role::Shift)
                && !elsewhere.contains(&law.entry.name)
        });
        found.map(|law| Kind { law }).collect()
    })
}

/// An effect at a place, ready to be scaled.
pub struct Planted {
    pub kind: &'static Kind,
    pub place: Place,
    pub joint: usize,
    site: Site,
    /// Keys at scale one.
    values: BTreeMap<String, f64>,
}

impl Kind {
    pub fn name(&self) -> &'static str {
        self.law.entry.name
    }

    pub fn entry(&self) -> &'static Entry {
        self.law.entry
    }

    /// Places on a robot that moves so, where the model has no such effect yet.
    pub fn places(&self, model: &AugmentedModel, cover: &Cover) -> Vec<Place> {
        let plain = &model.model;
        let Some(law) = effect::law(&plain.robot, self.name()) else {
            return Vec::new();
        };
        let mut places = law.places(&plain.robot, &plain.friction);
        places.retain(|place| {
            let moves = |j: usize| !cover.joints[j].stationary;
            let known = |e: &effect::Added| e.name() == self.name() && e.place == *place;
            let here = match place {
                Place::Joint(j) | Place::Pair { on: j, .. } => moves(*j),
                Place::All => self.entry().places == Places::Whole,
                _ => false,
            };
            here && place.from().is_none_or(moves) && !model.effects.iter().any(known)
        });
        places
    }

    /// The effect at a place of its own size, its shape by chance.
    pub fn at(
        &'static self,
        place: Place,
        model: &AugmentedModel,
        cover: &Cover,
        chance: &mut ChaCha8Rng,
    ) -> Planted {
        let joint = place.joint().unwrap_or(0);
        let site = site(place, joint, model, cover);
        let mut values: BTreeMap<String, f64> = (self.entry().keys.iter())
            .zip((self.law.defaults)(&site))
            .map(|(key, value)| (key.name.to_owned(), value))
            .collect();
        let turns = site.turns;
        let travel = site.travel.1 - site.travel.0;
        // waves along the travel as whole numbers a turn, or a metre
        let mut order = |least: f64, most: f64| {
            let waves = chance.random_range(least..most);
            let turn = if turns { std::f64::consts::TAU } else { 1.0 };
            (waves * turn / travel).round().max(1.0)
        };
        let shape = match self.name() {
            "ripple" => Some(("order", order(4.0, 12.0))),
            "position-friction" => Some(("order", order(2.0, 5.0))),
            _ => None,
        };
        let phase: f64 = chance.random_range(0.0..std::f64::consts::TAU);
        let sign = if chance.random::<bool>() { 1.0 } else { -1.0 };
        let mut set = |key: &str, value: f64| values.insert(key.to_owned(), value);
        if let Some((key, order)) = shape {
            set(key, order);
            set("sin", 0.1 * site.scale * phase.sin());
            set("cos", 0.1 * site.scale * phase.cos());
        }
        let fastest = cover.joints[joint].fastest();
        match self.name() {
            "torque-offset" | "drift" => drop(set("c", sign * 0.1 * site.scale)),
            "asymmetric-friction" => {
                set("coulomb", sign * 0.1 * site.scale);
                set("viscous", sign * 0.1 * site.scale / site.speed);
            }
            "delay" => drop(set("d", sign * 0.005)),
            "stribeck" => drop(set("vs", 0.1 * fastest)),
            "backlash" => {
                let most = if turns { 0.01 } else { 1e-3 };
                set("gap", most * chance.random_range(0.3..1.0));
            }
            "presliding" => drop(set("sigma1", 0.0)),
            "warm-up" => drop(set("T", (cover.duration_s / 3.0).max(5.0))),
            "coupling" => {
                let from = place.from().map_or(1, |j| j + 1);
                set("from", from as f64);
            }
            _ => {}
        }
        Planted {
            kind: self,
            place,
            joint,
            site,
            values,
        }
    }
}

/// Where the effect sits, with the scales that the simulator takes its own from.
fn site(place: Place, joint: usize, model: &AugmentedModel, cover: &Cover) -> Site {
    let plain = &model.model;
    let of = &cover.joints[joint];
    let (coulomb, viscous) = match plain.friction[joint] {
        JointFriction::None => (0.0, 0.0),
        JointFriction::DoubleTanh(law) => (law.coulomb_1 + law.coulomb_2, law.viscous),
        JointFriction::ViscousCoulomb(law) => (law.coulomb, law.viscous),
    };
    let speed = of.speed_rms;
    let scale = (coulomb + viscous * speed).abs().max(1e-6);
    let inertia = scale / (SIGN * speed) / SIGN_RATE;
    Site {
        place,
        name: place.name(&plain.robot).unwrap_or_default(),
        turns: plain.robot.joint_kind(joint) == JointKind::Revolute,
        scale,
        speed,
        inertia,
        least_inertia: inertia,
        travel: (of.position[0], of.position[1]),
        coulomb: coulomb.max(0.0),
        viscous: viscous.max(0.0),
    }
}

impl Planted {
    /// Its keys at a scale.
    pub fn values(&self, scale: f64) -> BTreeMap<String, f64> {
        let mut values = self.values.clone();
        let mut times = |key: &str, factor: f64| {
            if let Some(value) = values.get_mut(key) {
                *value *= factor;
            }
        };
        match self.kind.name() {
            // the level is the joint's own: what grows is where it sets in
            "smooth-coulomb" => times("vs", scale),
            "presliding" => times("sigma0", 1.0 / scale),
            "elasticity" => times("stiffness", 1.0 / scale),
            _ => {
                let keys = self.kind.entry().keys.iter();
                keys.filter(|key| key.size)
                    .for_each(|key| times(key.name, scale));
            }
        }
        values
    }

    /// Whether its torque is in proportion to its scale.
    pub fn is_linear(&self) -> bool {
        !["smooth-coulomb", "presliding", "elasticity", "delay"].contains(&self.kind.name())
    }

    /// None for the robot as a whole.
    fn joint_name(&self) -> Option<&str> {
        (self.place != Place::All).then_some(self.site.name.as_str())
    }

    /// Why no machine has such numbers; none where one may.
    pub fn broken(&self, scale: f64, model: &AugmentedModel, cover: &Cover) -> Option<String> {
        let values = self.values(scale);
        for key in self.kind.entry().keys {
            let within = |range: &effect::Range| range.holds(values[key.name]);
            if let Some(range) = key.range.as_ref().filter(|range| !within(range)) {
                return Some(format!("{} {}", key.name, range.rule));
            }
        }
        let robot = &model.model.robot;
        let added = effect::read(robot, self.kind.name(), self.joint_name(), &values).ok()?;
        let seen = Seen {
            cover: &cover.joints[self.joint],
            duration_s: cover.duration_s,
            kind: robot.joint_kind(self.joint),
            friction: &model.model.friction[self.joint],
            drive: &JointDrive::default(),
            weight: cover.joints[self.joint].weight,
        };
        added.broken(&seen, &|_| false).map(|(_, why)| why)
    }

    /// Its torque along a stretch, `[joint][sample]`; none where the simulator cannot build it.
    pub fn torque(
        &self,
        scale: f64,
        model: &AugmentedModel,
        (stretch, torques): (&Stretch, &Torques),
        seconds: f64,
    ) -> Option<Vec<Vec<f64>>> {
        let values = self.values(scale);
        let plain = &model.model;
        if self.kind.name() == "elasticity" {
            let added =
                effect::read(&plain.robot, "elasticity", Some(&self.site.name), &values).ok()?;
            let scene = Scene {
                robot: &plain.robot,
                theta: &plain.theta,
                laws: &plain.friction,
                stretch,
                hat: &torques.hat,
                load: &torques.load,
                direction: &torques.direction,
                tilt: None,
            };
            let mut out = vec![vec![0.0; stretch.len()]; stretch.joints()];
            added.torque(&scene, self.joint, &mut out[self.joint]);
            return Some(out);
        }
        let keys = self.kind.entry().keys.iter();
        let numbers: Vec<f64> = keys.map(|key| values[key.name]).collect();
        let machine = PlantRobot {
            robot: &plain.robot,
            theta: &plain.theta,
        };
        match (self.kind.law.build)(&self.site, &machine, &numbers).ok()? {
            Built::Plant(mut effect) => {
                Some(along(effect.as_mut(), model, (stretch, torques), seconds))
            }
            Built::Log(fault) => {
                let n = stretch.joints();
                let hat = &torques.hat;
                let rows = |k: usize| (0..n).map(move |j| hat[j][k]);
                let mut torque: Vec<f64> = (0..stretch.len()).flat_map(rows).collect();
                fault.apply(&mut LoggedChannels {
                    t: &stretch.t,
                    q: &mut vec![0.0; torque.len()],
                    torque: &mut torque,
                    joints: n,
                });
                let change = |j: usize| {
                    let of = torque.iter().skip(j).step_by(n).zip(&hat[j]);
                    of.map(|(late, own)| late - own).collect()
                };
                Some((0..n).map(change).collect())
            }
        }
    }
}

/// The torque that motors supply because of an effect along a motion.
fn along(
    effect: &mut dyn Effect,
    model: &AugmentedModel,
    (stretch, torques): (&Stretch, &Torques),
    seconds: f64,
) -> Vec<Vec<f64>> {
    let n = stretch.joints();
    let at =
        |channels: &[Vec<f64>], k: usize| -> Vec<f64> { channels.iter().map(|c| c[k]).collect() };
    let laws = &model.model.friction;
    let mut z = vec![0.0; effect.states()];
    let beginning = Beginning {
        q: &at(&stretch.q, 0),
        load: &at(&torques.load, 0),
        seconds,
        seed: 1,
    };
    effect.begin(&beginning, &mut z);
    let mut out = vec![Vec::with_capacity(stretch.len()); n];
    let mut rates = vec![0.0; z.len()];
    for k in 0..stretch.len() {
        let (q, v, a) = (at(&stretch.q, k), at(&stretch.v, k), at(&stretch.a, k));
        let load = at(&torques.load, k);
        let friction: Vec<f64> = (0..n).map(|j| laws[j].torque(v[j])).collect();
        let state = PlantState {
            t: stretch.began + stretch.dt * k as f64,
            q: &q,
            v: &v,
            z: &z,
            friction: &friction,
            a: &a,
            net: &load,
            load: &load,
        };
        let mut torque = vec![0.0; n];
        let mut mass = vec![0.0; n * n];
        let mut share = vec![[0.0; 2]; n];
        effect.torque(&state, &mut torque);
        effect.inertia(&state, &mut mass, &mut torque);
        effect.load(&state, &mut share);
        for i in 0..n {
            let [positive, negative] = share[i];
            let beside = load[i] * if load[i] > 0.0 { positive } else { negative };
            let driven: f64 = (0..n).map(|j| mass[i * n + j] * a[j]).sum();
            out[i].push(torque[i] + beside + driven);
        }
        effect.moved(&state);
        if z.is_empty() || k + 1 == stretch.len() {
            continue;
        }
        let next = at(&stretch.v, k + 1);
        let h = stretch.dt / STEPS as f64;
        for step in 0..STEPS {
            let part = (step as f64 + 0.5) / STEPS as f64;
            let v: Vec<f64> = (v.iter().zip(&next))
                .map(|(a, b)| a + part * (b - a))
                .collect();
            let state = PlantState {
                v: &v,
                z: &z,
                q: &q,
                friction: &friction,
                a: &a,
                net: &load,
                load: &load,
                t: 0.0,
            };
            rates.fill(0.0);
            effect.rates(&state, &mut rates);
            z.iter_mut()
                .zip(&rates)
                .for_each(|(z, rate)| *z += h * rate);
        }
    }
    out
}
