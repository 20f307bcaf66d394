//! Monte Carlo study of the diagnosis: campaigns of the simulated CFT robot with one effect in them
//! that the declared model lacks, of a known size, and clean ones. Plants vary by 15 %; logs of 20 s
//! with encoder quantisation and torque noise; friction from one-joint logs that carry the effect
//! too, inertias by least squares, as a lab would have them.
//!
//! The size of an effect is the rms of its torque over that of the noise, both in the band that the
//! parallel filter keeps.
//!
//! `cargo run --release --example study_diagnosis -- [CASES] [FOLDER]` writes one line per case to
//! target/study_diagnosis.jsonl as it goes and, at the end, into FOLDER the summary that
//! docs/closing-the-loop.md is generated from. A round of all effects, joints and sizes, with one
//! clean campaign for every two of them, is done before the next seed begins.

mod study;

use std::collections::BTreeMap;
use std::path::Path;

use cft_ident::diagnose::{Case, Diagnosis, Limits, LogRole, Open, Prior, diagnose};
use cft_ident::effect::{Added, Refined};
use cft_ident::inertia::accumulate;
use cft_ident::inertia::columns::{Columns, KnownFriction};
use cft_ident::inertia::solve::{Estimator, fit};
use cft_ident::log::Block;
use cft_ident::motion::{HeldForces, Parallel, Stretch, stretches};
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{Setup, Structure};
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::simulate::cft_experiment::{OneJointMove, excitation_at_random_phase, follow};
use cft_ident::simulate::{CftTruth, EffectSpec, Recording, Reference};
use nalgebra::DMatrix;
use serde_json::{Value, json};
use study::{
    JOINTS, along, block, estimated, noisy, percent, processing, quantile, series, source, study,
    write_summary,
};

const SECONDS: f64 = 20.0;
const SIZES: [f64; 2] = [2.0, 6.0];
const UNSEEN: &str = "configs/cft-validation.toml";

/// An effect at two places: its name, the places, its fixed keys, and the keys that carry its size.
struct Kind {
    name: &'static str,
    places: [&'static str; 2],
    shape: &'static [(&'static str, f64)],
    size: &'static [(&'static str, f64)],
}

const KINDS: &[Kind] = &[
    kind("torque-offset", ["q1", "q4"], &[], &[("c", 1.0)]),
    kind(
        "asymmetric-friction",
        ["q1", "q2"],
        &[],
        &[("coulomb", 1.0), ("viscous", 1.0)],
    ),
    kind(
        "nonlinear-viscous",
        ["q1", "q2"],
        &[("p", 2.0)],
        &[("c", 1.0)],
    ),
    kind(
        "load-friction",
        ["q4", "q5"],
        &[("w", 100.0)],
        &[("mu_c", 1.0), ("mu_v", 0.0)],
    ),
    kind("drive-efficiency", ["q4", "q5"], &[], &[("k", 1.0)]),
    kind(
        "actuator-friction",
        ["x_r", "y_r"],
        &[("slope", 200.0)],
        &[("viscous", 1.0), ("coulomb", 0.3)],
    ),
    kind("rotor-inertia", ["x_r", "y_r"], &[], &[("J", 1.0)]),
    kind(
        "ripple",
        ["q1", "q2"],
        &[("order", 14.0)],
        &[("sin", 1.0), ("cos", 0.5)],
    ),
    kind(
        "position-friction",
        ["q1", "q2"],
        &[("order", 10.0)],
        &[("sin", 1.0), ("cos", 0.5)],
    ),
    kind(
        "spring",
        ["q1", "q2"],
        &[("q0", 0.4)],
        &[("k", 1.0), ("k3", 0.0)],
    ),
    kind("delay", ["q1", "q2"], &[], &[("d", 1.0)]),
    kind("warm-up", ["q1", "q2"], &[("T", 8.0)], &[("k", -1.0)]),
    kind("drift", ["q1", "q4"], &[], &[("c", 1.0)]),
];

const fn kind(
    name: &'static str,
    places: [&'static str; 2],
    shape: &'static [(&'static str, f64)],
    size: &'static [(&'static str, f64)],
) -> Kind {
    Kind {
        name,
        places,
        shape,
        size,
    }
}

/// Cases of one seed: every effect at two places in every size, and clean ones.
const EFFECTS: usize = KINDS.len() * 2 * SIZES.len();
const ROUND: usize = EFFECTS + EFFECTS / 2;

fn main() {
    let (rows, folder) = study("study_diagnosis", 2 * ROUND as u64, case);
    summarise(&rows, &folder);
}

/// One log, its torques at the time and pose of their rows, and the stretches of it.
fn log(robot: &Robot, recording: &Recording<4>) -> Block {
    let mut log = block(recording);
    HeldForces::new(4).centre(robot, &mut log);
    log
}

fn held(index: usize, log: &Block) -> Vec<Stretch> {
    stretches(index, 4, &processing(), &mut source(log))
        .expect("a log")
        .0
}

/// What is put into the plant of a case: the effect's name, place and values; none for a clean one.
fn effect(
    which: usize,
    robot: &Robot,
    truth: &CftTruth,
    clean: &Stretch,
    parallel: &Parallel,
) -> Option<(Added, EffectSpec, f64)> {
    let kind = KINDS.get(which / (2 * SIZES.len()))?;
    let place = kind.places[which / SIZES.len() % 2];
    let size = SIZES[which % SIZES.len()];
    let build = |scale: f64| {
        let scaled = kind.size.iter().map(|(key, x)| (*key, scale * x));
        let values: BTreeMap<String, f64> = kind
            .shape
            .iter()
            .copied()
            .chain(scaled)
            .map(|(k, x)| (k.to_owned(), x))
            .collect();
        Added::of_keys(robot, kind.name, Some(place), &values).expect("the keys are the effect's")
    };
    // rms of the filtered torque of a unit effect, over that of the noise, on the joint it shows most
    let model = |effects| Refined {
        model: Model {
            robot: robot.clone(),
            theta: truth.printed().to_vec(),
            friction: truth.friction.map(JointFriction::DoubleTanh).to_vec(),
            offset: vec![0.0; 4],
        },
        effects,
    };
    let scale = 1e-3;
    let (with, without) = (
        model(vec![build(scale)]).reconstruct(clean),
        model(Vec::new()).reconstruct(clean),
    );
    let mut impulse = vec![0.0; 4001];
    impulse[2000] = 1.0;
    parallel.smooth(&mut impulse).expect("long enough");
    let passed = impulse.iter().map(|x| x * x).sum::<f64>().sqrt();
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let unit = (0..4)
        .map(|j| {
            let mut torque: Vec<f64> = with[j]
                .iter()
                .zip(&without[j])
                .map(|(a, b)| a - b)
                .collect();
            parallel.smooth(&mut torque).expect("long enough");
            rms(&torque) / (0.01 * rms(&clean.tau[j]) * passed)
        })
        .fold(0.0, f64::max);
    let effect = build(scale * size / unit);
    let told = effect.told(robot, "", None);
    let spec = EffectSpec {
        name: kind.name.to_owned(),
        joint: Some(place.to_owned()),
        values: told.into_iter().map(|t| (t.key, t.value)).collect(),
    };
    Some((effect, spec, size))
}

fn case(number: u64) -> Value {
    let which = number as usize % ROUND;
    let seed = 1000 + number;
    let robot = Robot::cft(Setup::Tuedacs, Structure::Printed12);
    let truth = CftTruth::synthetic(Setup::Tuedacs)
        .varied(0.15, seed)
        .expect("a plant");
    let parallel = Parallel::design(&processing(), 1e-3).expect("a filter");
    let run = |specs: &[EffectSpec], motion: Reference<4>, noise: u64| {
        log(
            &robot,
            &follow(&truth, specs, motion, &noisy(SECONDS, 10 * seed + noise)).expect("a run"),
        )
    };
    let excitation = || excitation_at_random_phase(Setup::Tuedacs, seed);
    let clean = held(0, &run(&[], excitation(), 5));
    let put = effect(which, &robot, &truth, &clean[0], &parallel);
    let specs: Vec<EffectSpec> = put.iter().map(|(_, spec, _)| spec.clone()).collect();

    // the declared model, as a lab has it
    let infos = robot.parameters();
    let names: Vec<String> = infos.iter().map(|p| p.name.to_string()).collect();
    let mut known = Vec::new();
    for j in 0..JOINTS.len() {
        let motion = OneJointMove::new(j, SECONDS, Some(seed))
            .reference(Setup::Tuedacs)
            .expect("a ladder");
        let recording = follow(
            &truth,
            &specs,
            motion,
            &noisy(SECONDS, 10 * seed + j as u64),
        )
        .expect("a run");
        let (_, e) = estimated(&robot, j, &names, &block(&recording));
        known.push(Some(KnownFriction {
            law: e.law,
            covariance: e.covariance,
        }));
    }
    let columns = Columns {
        joints: 4,
        shared: 12,
        own: vec![Vec::new(); 4],
        known: known.clone(),
    };
    let training = run(&specs, excitation(), 5);
    let found = accumulate(&robot, &columns, &processing(), &mut source(&training)).expect("a log");
    let theta = fit(&found.0, Estimator::Wls).expect("a fit").theta;
    let declared = Refined::plain(Model {
        robot: robot.clone(),
        theta: theta.iter().copied().collect(),
        friction: known
            .iter()
            .flatten()
            .map(|k| JointFriction::DoubleTanh(k.law))
            .collect(),
        offset: vec![0.0; 4],
    });
    let mut all = held(0, &training);
    all.extend(held(1, &run(&specs, along(series(UNSEEN)), 6)));
    let case = |given: Refined, limits: Limits| Case {
        prior: prior(&given, &known),
        given,
        open: Open {
            offset: vec![false; 4],
            friction: vec![vec![true; 5]; 4],
        },
        stretches: all.clone(),
        roles: vec![LogRole::Train, LogRole::Holdout],
        parallel: parallel.clone(),
        cutoff_hz: processing().cutoff_hz,
        units: (0..4).map(|j| robot.joint_unit(j).to_owned()).collect(),
        averaged: true,
        keep: false,
        limits,
    };
    let diagnosed = |case: &Case| diagnose(case, &mut |_| {}, &|| false).expect("a diagnosis");
    let result = diagnosed(&case(declared.clone(), Limits::default()));
    let unseen = |d: &Diagnosis, after: bool| {
        let pair = if after { &d.after } else { &d.before };
        pair.holdout.as_ref().map(|e| e.overall.mean_relative_error)
    };
    // the oracle knows the effect and fits its numbers; nothing can be added to it
    let oracle = put.as_ref().map(|(added, ..)| {
        let mut given = declared;
        given.effects.push(added.clone());
        let nothing = Limits {
            false_alarm: 0.0,
            ..Limits::default()
        };
        unseen(&diagnosed(&case(given, nothing)), true)
    });
    let steps: Vec<Value> = result
        .steps
        .iter()
        .map(|s| {
            let e = &result.model.effects[s.effect];
            let alike: Vec<&str> = s.alternatives.iter().map(|c| c.effect.kind.name).collect();
            json!({
                "effect": e.kind.name,
                "family": e.family().name(),
                "place": e.place.name(&robot),
                "alternatives": alike,
            })
        })
        .collect();
    json!({
        "seed": number,
        "effect": put.as_ref().map_or("none", |(e, ..)| e.kind.name),
        "family": put.as_ref().map_or("none", |(e, ..)| e.family().name()),
        "place": put.as_ref().and_then(|(e, ..)| e.place.name(&robot)),
        "size": put.as_ref().map_or(0.0, |(.., size)| *size),
        "steps": steps,
        "structured": result.structured(),
        "before": unseen(&result, false),
        "after": unseen(&result, true),
        "oracle": oracle,
    })
}

/// The friction stage's covariance, its standard deviations taken three times as large.
fn prior(centre: &Refined, known: &[Option<KnownFriction>]) -> Prior {
    let mut information = DMatrix::zeros(36, 36);
    for (j, known) in known.iter().flatten().enumerate() {
        let c = DMatrix::from_fn(5, 5, |a, b| 9.0 * known.covariance[a][b]);
        if let Some(inverse) = c.try_inverse() {
            information
                .view_mut((12 + 5 * j, 12 + 5 * j), (5, 5))
                .copy_from(&inverse);
        }
    }
    Prior {
        centre: centre.clone(),
        information,
        rows_per_independent: 5.0,
    }
}

fn summarise(rows: &[Value], folder: &Path) {
    let text = |v: &Value| v.as_str().unwrap_or("").to_owned();
    let steps = |r: &Value| r["steps"].as_array().cloned().unwrap_or_default();
    let share = |hits: usize, of: usize| format!("{hits} of {of}");
    let mut lines = Vec::new();
    for name in std::iter::once("none").chain(KINDS.iter().map(|k| k.name)) {
        for size in if name == "none" {
            &[0.0][..]
        } else {
            &SIZES[..]
        } {
            let own: Vec<&Value> = rows
                .iter()
                .filter(|r| r["effect"] == name && r["size"] == *size)
                .collect();
            if own.is_empty() {
                continue;
            }
            let alone = |r: &Value| steps(r).len() == 1;
            let family = own
                .iter()
                .filter(|r| match name {
                    "none" => steps(r).is_empty(),
                    _ => alone(r) && steps(r)[0]["family"] == r["family"],
                })
                .count();
            let member = own
                .iter()
                .filter(|r| {
                    let s = steps(r);
                    let named = |s: &Value| {
                        let alike = s["alternatives"].as_array().cloned().unwrap_or_default();
                        s["effect"] == name || alike.iter().any(|a| a == name)
                    };
                    if name == "none" {
                        s.is_empty()
                    } else {
                        alone(r) && named(&s[0])
                    }
                })
                .count();
            let mut said: BTreeMap<String, usize> = BTreeMap::new();
            for r in &own {
                let names: Vec<String> = steps(r).iter().map(|s| text(&s["effect"])).collect();
                let said_of = if names.is_empty() {
                    "nothing".into()
                } else {
                    names.join(" + ")
                };
                *said.entry(said_of).or_default() += 1;
            }
            let mut said: Vec<(String, usize)> = said.into_iter().collect();
            said.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
            let said: Vec<String> = said.iter().map(|(s, n)| format!("{s} ({n})")).collect();
            let median = |key: &str| {
                let x: Vec<f64> = own.iter().filter_map(|r| r[key].as_f64()).collect();
                if x.is_empty() {
                    "-".to_owned()
                } else {
                    percent(quantile(x, 0.5))
                }
            };
            lines.push(json!({
                "effect put in": if name == "none" { "nothing" } else { name },
                "size": if name == "none" { "-".to_owned() } else { format!("{size}") },
                "right family, nothing else": share(family, own.len()),
                "right member or among the alternatives": share(member, own.len()),
                "unseen error before": median("before"),
                "after": median("after"),
                "effect known": median("oracle"),
                "said": said.join(", "),
            }));
        }
    }
    write_summary(
        folder,
        "study_diagnosis",
        "effects put into simulated campaigns, and what the diagnosis said",
        "study_diagnosis",
        rows.len(),
        lines,
    );
}
