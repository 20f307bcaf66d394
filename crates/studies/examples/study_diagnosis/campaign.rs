//! One campaign: plant, effect of a known size, logs, the model that a lab would declare, and what
//! the diagnosis makes of it.

use std::collections::BTreeMap;

use cft_ident::diagnose::{
    Candidate, Case, Diagnosis, FreeParameters, Heard, LogRole, ParameterPrior, SelectionLimits,
    UNWATCHED, WIDE_TIMES, Watch, WideMotion, diagnose,
};
use cft_ident::effect::{self, Added, AugmentedModel};
use cft_ident::inertia::accumulate;
use cft_ident::inertia::columns::{KnownFriction, RegressorColumns};
use cft_ident::inertia::solve::{Weighting, fit};
use cft_ident::log::Block;
use cft_ident::motion::{
    FilterSettings as Processing, Parallel, ParallelFilters, Stretch, ZeroOrderHold, stretches,
};
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{Setup, Structure};
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::simulate::cft::{follow, mechanism};
use cft_ident::simulate::{CftTruth, EffectSpec, OneJointMove, Reference, SimulatedRun};
use nalgebra::DMatrix;
use serde_json::{Value, json};

use crate::catalogue::{Planted, Put, Setting};
use crate::drive;
use crate::study::{JOINTS, along, block, estimated, noisy, processing, series, source};

pub const SECONDS: f64 = 20.0;
const MOTION: &str = "configs/cft-excitation.toml";
const UNSEEN: &str = "configs/cft-validation.toml";
/// Standard deviation of the torque's noise over the torque's rms.
pub const NOISE: f64 = 0.01;

/// What a plant's campaigns share.
pub struct Lab {
    pub robot: Robot,
    pub processing: Processing,
    pub parallel: Parallel,
}

/// An effect as it was put in: for the estimator where it knows it so, and for the simulator.
pub struct Truth {
    pub added: Option<Added>,
    pub spec: EffectSpec,
}

/// Runs one case; `seed` makes plant, noise and the order of the ladders' speeds.
pub fn case(setting: &Setting, seed: u64, aloud: bool) -> Value {
    let (lab, put, campaign) = match setting.drive() {
        Some(name) => on_drive(setting, name, seed),
        None => on_arm(setting, seed),
    };

    let without = match setting.withheld {
        true => setting.put.iter().map(|p| p.kind.name.to_owned()).collect(),
        false => Vec::new(),
    };
    let nothing = SelectionLimits {
        steps: 0,
        deviations: aloud,
        ..SelectionLimits::default()
    };
    let run = |given: AugmentedModel, limits: SelectionLimits, without: Vec<String>| {
        let case = campaign.case(&lab, given, limits, without);
        let tell = |heard: Heard| {
            if let (true, Heard::Said(text)) = (aloud, heard) {
                eprintln!("  {text}");
            }
        };
        let watch = Watch {
            tell: &tell,
            ..UNWATCHED
        };
        diagnose(&case, watch)
    };
    let result = match run(
        campaign.declared.clone(),
        SelectionLimits::default(),
        without,
    ) {
        Ok(result) => result,
        Err(error) => return refused(setting, seed, &put, &error.to_string()),
    };
    if aloud {
        show(&lab.robot, &result);
    }
    // the oracle knows the effects and fits their numbers; the plain fit knows of none
    let known: Option<Vec<Added>> = put.iter().map(|t| t.added.clone()).collect();
    let oracle = known.filter(|k| !k.is_empty()).and_then(|known| {
        let mut given = campaign.declared.clone();
        given.effects.extend(known);
        // a log may hold rows enough for the declared model and not for the effects beside it
        let fitted = run(given, nothing, Vec::new()).ok()?;
        if aloud {
            numbers(&lab.robot, "effect known", &fitted);
        }
        Some(fitted)
    });
    let shown = oracle.as_ref().map(|oracle| {
        (0..lab.robot.joints())
            .map(|j| {
                let plain = result.refitted.joints[j].rmse.powi(2);
                let known = oracle.after.train.joints[j].rmse.powi(2);
                (plain - known) * oracle.unexplained[j].over_floor.unwrap_or(0.0) / known
            })
            .fold(0.0, f64::max)
    });
    let unseen = |d: &Diagnosis, after: bool| {
        let pair = if after { &d.after } else { &d.before };
        pair.holdout.as_ref().map(|e| e.overall.mean_relative_error)
    };
    let robot = &lab.robot;
    let steps: Vec<Value> = (0..result.steps.len())
        .map(|s| step(robot, &result, s, &put))
        .collect();
    let put = put_in(setting, &put);
    json!({
        "case": setting.name(),
        "study": setting.study,
        "seed": seed,
        "put": put,
        "steps": steps,
        "cut": result.disturbances.iter().map(|e| json!({
            "place": robot.joint_names()[e.joint], "from_s": e.from_s, "to_s": e.to_s,
        })).collect::<Vec<_>>(),
        "structured": result.structured(),
        "remainder": result.remainder().map(|c| c.effect.title(robot)).collect::<Vec<_>>(),
        // structure left per joint: over what was there before, power over the noise's, share of the torque's
        "left": result.unexplained.iter().zip(&result.part_unexplained).map(|(left, part)| {
            [Some(*part), left.over_floor, Some(left.share)]
        }).collect::<Vec<_>>(),
        "shown": shown,
        "before": unseen(&result, false),
        "after": unseen(&result, true),
        "oracle": oracle.as_ref().map(|d| unseen(d, true)),
    })
}

/// The effects that were put in.
fn put_in(setting: &Setting, put: &[Truth]) -> Vec<Value> {
    let pairs = setting.put.iter().zip(put);
    pairs
        .map(|(p, truth)| {
            json!({
                "effect": p.kind.name, "family": p.kind.entry().family().name(), "place": p.place, "size": p.size,
                "values": truth.spec.values,
            })
        })
        .collect()
}

/// A campaign that is no basis for a diagnosis: nothing was said of it.
fn refused(setting: &Setting, seed: u64, put: &[Truth], why: &str) -> Value {
    json!({
        "case": setting.name(),
        "study": setting.study,
        "seed": seed,
        "put": put_in(setting, put),
        "refused": why,
        "steps": [], "cut": [], "structured": false, "remainder": [], "left": [],
        "shown": null, "before": null, "after": null, "oracle": null,
    })
}

fn on_arm(setting: &Setting, seed: u64) -> (Lab, Vec<Truth>, Campaign) {
    let lab = Lab {
        robot: Robot::cft(Setup::Tuedacs, Structure::Printed12),
        processing: processing(),
        parallel: Parallel::design(&processing(), 1e-3).expect("a filter"),
    };
    let truth = CftTruth::synthetic(Setup::Tuedacs)
        .varied(0.15, seed)
        .expect("a plant");
    let clean = lab.run(&truth, &[], motion(seed), 10 * seed + 5);
    let clean = arm(0, &clean);
    let put: Vec<Truth> = setting
        .put
        .iter()
        .map(|p| lab.truth_of(&truth, p, &clean[0], seed))
        .collect();
    let specs: Vec<EffectSpec> = put.iter().map(|t| t.spec.clone()).collect();
    let keep = setting.put.iter().any(|p| p.kind.kept());
    let campaign = Campaign::made(&lab, &truth, &specs, &motion, (seed, keep));
    (lab, put, campaign)
}

fn on_drive(setting: &Setting, name: &str, seed: u64) -> (Lab, Vec<Truth>, Campaign) {
    let truth = drive::truth(name, seed);
    let processing = drive::settings();
    let lab = Lab {
        robot: Robot::single_joint(name, truth.kind),
        parallel: Parallel::design(&processing, 1e-3).expect("a filter"),
        processing,
    };
    let quiet = drive::log(&truth, &[], 0.0, 10 * seed);
    let quiet = held(0, 1, &lab.processing, &quiet).swap_remove(0);
    let put = setting.put.iter().map(|p| {
        let values = |scale: f64| match p.kind.on_drive {
            Some(own) => (own.values)(&truth, scale),
            None => values_of(p.kind, scale),
        };
        if p.kind.on_drive.is_some_and(|own| own.as_given) {
            let values = values(p.size);
            return Truth {
                added: lab.added(p.kind, p.place, &values),
                spec: spec(p, &values),
            };
        }
        lab.sized(p, values, &|values| {
            if let Some(added) = lab.added(p.kind, p.place, values) {
                return lab.of_columns(&drive::plain(&truth), &added, &quiet);
            }
            let spec = spec(p, values);
            let with = drive::log(&truth, &[spec], 0.0, 10 * seed);
            let with = held(0, 1, &lab.processing, &with).swap_remove(0);
            lab.over_noise(&with.tau, &quiet.tau, &quiet)
        })
    });
    let put: Vec<Truth> = put.collect();
    let specs: Vec<EffectSpec> = put.iter().map(|t| t.spec.clone()).collect();
    let campaign = drive::campaign(&truth, &specs, seed);
    (lab, put, campaign)
}

fn spec(put: &Put, values: &BTreeMap<String, f64>) -> EffectSpec {
    EffectSpec {
        own: None,
        name: put.kind.name.to_owned(),
        joint: (!put.place.is_empty()).then(|| put.place.to_owned()),
        values: values.clone().into_iter().collect(),
    }
}

/// An accepted step, with how far its numbers are from the truth in their standard deviations.
fn step(robot: &Robot, result: &Diagnosis, s: usize, put: &[Truth]) -> Value {
    let step = &result.steps[s];
    let effect = &result.model.effects[step.effect];
    let place = effect.place.name(robot).unwrap_or_default();
    let alike: Vec<&str> = step.alternatives.iter().map(|c| c.effect.name()).collect();
    let covariance = result.covariance_of(step.effect);
    let told = effect.numbers(robot, "", Some(&covariance));
    let of = |t: &&Truth| {
        t.spec.name == effect.name() && t.spec.joint.clone().unwrap_or_default() == place
    };
    let truth = put.iter().find(of);
    let known = told.iter().filter_map(|told| {
        let truth = truth?.spec.values.iter().find(|(k, _)| *k == told.key)?.1;
        let std = told.std.filter(|s| *s > 0.0)?;
        Some((told.key.clone(), [(told.value - truth) / std, std]))
    });
    let known: BTreeMap<String, [f64; 2]> = known.collect();
    let each = |which: usize| -> BTreeMap<&String, f64> {
        known.iter().map(|(key, of)| (key, of[which])).collect()
    };
    json!({
        "effect": effect.name(),
        "family": effect.family().name(),
        "place": place,
        "alternatives": alike,
        "assured": result.assured(),
        "explained": result.explained(step),
        "off": each(0),
        "std": each(1),
    })
}

/// The effects of a model with their standard deviations, and the error that it was fitted to.
fn numbers(robot: &Robot, what: &str, result: &Diagnosis) {
    for (i, effect) in result.model.effects.iter().enumerate() {
        let told = effect.numbers(robot, "", Some(&result.covariance_of(i)));
        let told = told.iter().map(|t| match t.std {
            Some(std) => format!("{} {:.6} +- {:.6}", t.key, t.value, std),
            None => format!("{} {:.6}", t.key, t.value),
        });
        let told: Vec<String> = told.collect();
        eprintln!("  {what}: {} {}", effect.title(robot), told.join(", "));
    }
    let rms: Vec<f64> = result.after.train.joints.iter().map(|e| e.rmse).collect();
    eprintln!("  {what}: fitted to {rms:?}");
}

fn show(robot: &Robot, result: &Diagnosis) {
    numbers(robot, "found", result);
    for s in &result.steps {
        let e = &result.model.effects[s.effect];
        let score = |c: &Candidate| match &c.score {
            Some(s) => format!(
                "{:?} cv {:.4}+-{:.4} own {:.4}",
                c.effect.shape, s.cv_gain, s.cv_std, s.unique_share
            ),
            None => String::new(),
        };
        eprintln!(
            "  step {} {:?} {:?} {}",
            e.title(robot),
            e.shape,
            e.linear,
            score(&s.candidate)
        );
        for a in &s.alternatives {
            eprintln!("      or {} {}", a.effect.title(robot), score(a));
        }
        if let Some(h) = s.holdout {
            eprintln!("      unseen {:.5} {:.5}", h[0], h[1]);
        }
    }
    let mut left: Vec<_> = result
        .candidates
        .iter()
        .filter(|c| c.score.is_some())
        .collect();
    left.sort_by(|a, b| {
        let g = |c: &Candidate| c.score.as_ref().map_or(0.0, |s| s.cv_gain);
        g(b).total_cmp(&g(a))
    });
    for c in left.iter().take(8) {
        let s = c.score.as_ref().expect("scored");
        eprintln!(
            "  left {} {:?} gain {:.4} cv {:.4}+-{:.4} own {:.4} p {:.1e} bic {:.1} n {:.0}: {}",
            c.effect.title(robot),
            c.effect.shape,
            s.gain,
            s.cv_gain,
            s.cv_std,
            s.unique_share,
            s.p_value,
            s.delta_bic,
            s.effective_rows,
            c.reason
        );
    }
    let over: Vec<String> = result
        .unexplained
        .iter()
        .map(|l| format!("{:.2}", l.over_floor.unwrap_or(f64::NAN)))
        .collect();
    eprintln!("  over floor {over:?}");
}

fn motion(seed: u64) -> Reference<4> {
    along(series(MOTION).at_random_phase(seed))
}

impl Lab {
    /// One log of the plant, its torques at the time and pose of their rows.
    fn run(&self, truth: &CftTruth, specs: &[EffectSpec], to: Reference<4>, noise: u64) -> Block {
        let mut settings = noisy(SECONDS, noise);
        settings.sensors.torque_noise = cft_ident::simulate::Noise::Relative(NOISE);
        self.log(&follow(truth, specs, to, &settings).expect("a run"))
    }

    fn log(&self, recording: &SimulatedRun<4>) -> Block {
        let mut log = block(recording);
        ZeroOrderHold::new(4).centre(&self.robot, &mut log);
        log
    }

    /// An effect in its size: the rms of its torque over that of the noise, both in the band that the
    /// filter keeps, on the joint where it shows most, along the motion of the training log.
    fn truth_of(&self, truth: &CftTruth, put: &Put, clean: &Stretch, seed: u64) -> Truth {
        self.sized(
            put,
            |scale| values_of(put.kind, scale),
            &|values| match self.added(put.kind, put.place, values) {
                Some(added) => {
                    let plain = Model {
                        robot: self.robot.clone(),
                        theta: truth.printed().to_vec(),
                        friction: truth.friction.map(JointFriction::DoubleTanh).to_vec(),
                        offset: vec![0.0; 4],
                    };
                    self.of_columns(&plain, &added, clean)
                }
                None => self.of_a_run(truth, &spec(put, values), clean, seed),
            },
        )
    }

    /// The effect at the scale at which it has its size. Most are linear in it; where one is not, the
    /// secant on logarithms converges in a few turns.
    pub fn sized(
        &self,
        put: &Put,
        values_at: impl Fn(f64) -> BTreeMap<String, f64>,
        size: &dyn Fn(&BTreeMap<String, f64>) -> f64,
    ) -> Truth {
        let mut scale = 1.0;
        let mut values = values_at(scale);
        for _ in 0..12 {
            let ratio = put.size / size(&values).max(1e-12);
            if (ratio - 1.0).abs() < 1e-3 {
                break;
            }
            scale *= ratio;
            values = values_at(scale);
        }
        Truth {
            added: self.added(put.kind, put.place, &values),
            spec: spec(put, &values),
        }
    }

    fn added(&self, kind: &Planted, place: &str, values: &BTreeMap<String, f64>) -> Option<Added> {
        let mut values = values.clone();
        // where one size is given the others are zero
        for key in kind.entry().keys.iter().filter(|key| key.size) {
            values.entry(key.name.to_owned()).or_insert(0.0);
        }
        let place = (!place.is_empty()).then_some(place);
        effect::read(&self.robot, kind.name, place, &values).ok()
    }

    fn of_columns(&self, plain: &Model, added: &Added, clean: &Stretch) -> f64 {
        let model = |effects| AugmentedModel {
            model: plain.clone(),
            effects,
        };
        let with = model(vec![added.clone()]).reconstruct(clean);
        let without = model(Vec::new()).reconstruct(clean);
        self.over_noise(&with, &without, clean)
    }

    /// The same from two runs without noise, for what the estimator has no columns of.
    fn of_a_run(&self, truth: &CftTruth, spec: &EffectSpec, clean: &Stretch, seed: u64) -> f64 {
        let run = |specs: &[EffectSpec]| {
            let mut settings = noisy(SECONDS, 10 * seed + 5);
            settings.sensors.torque_noise = cft_ident::simulate::Noise::Relative(0.0);
            let recording = follow(truth, specs, motion(seed), &settings).expect("a run");
            arm(0, &self.log(&recording)).swap_remove(0).tau
        };
        self.over_noise(&run(std::slice::from_ref(spec)), &run(&[]), clean)
    }

    pub fn over_noise(&self, with: &[Vec<f64>], without: &[Vec<f64>], clean: &Stretch) -> f64 {
        let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
        let mut impulse = vec![0.0; 4001];
        impulse[2000] = 1.0;
        self.parallel.smooth(&mut impulse).expect("long enough");
        let passed = impulse.iter().map(|x| x * x).sum::<f64>().sqrt();
        let of_joint = |j: usize| {
            let pairs = with[j].iter().zip(&without[j]);
            let mut torque: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
            self.parallel.smooth(&mut torque).expect("long enough");
            rms(&torque) / (NOISE * rms(&clean.tau[j]) * passed)
        };
        (0..clean.joints()).map(of_joint).fold(0.0, f64::max)
    }
}

/// Values of an effect's keys at a scale.
fn values_of(kind: &Planted, scale: f64) -> BTreeMap<String, f64> {
    let shape = kind.shape.iter().copied();
    let sized = kind.size.iter().map(|(key, x)| (*key, 1e-3 * scale * x));
    let all = shape.chain(sized);
    all.map(|(key, x)| (key.to_owned(), x)).collect()
}

/// A log as stretches.
pub fn held(index: usize, joints: usize, settings: &Processing, log: &Block) -> Vec<Stretch> {
    let found = stretches(index, joints, settings, &mut source(log));
    found.expect("a log").0
}

fn arm(index: usize, log: &Block) -> Vec<Stretch> {
    held(index, 4, &processing(), log)
}

/// The same through a position filter so much wider as the diagnosis asks for.
pub fn wider(joints: usize, settings: &Processing, logs: &[Block]) -> Vec<Stretch> {
    let held = |(i, log): (usize, &Block)| {
        let wide = settings.widened(WIDE_TIMES, 1.0 / (log.t[1] - log.t[0]));
        held(i, joints, &wide, log)
    };
    logs.iter().enumerate().flat_map(held).collect()
}

/// The logs of a campaign and the declared model, as a lab has them.
pub struct Campaign {
    pub declared: AugmentedModel,
    pub prior: ParameterPrior,
    pub stretches: Vec<Stretch>,
    /// The same through a wider position filter.
    pub wide: Vec<Stretch>,
    pub roles: Vec<LogRole>,
    pub keep: bool,
}

impl Campaign {
    pub fn made(
        lab: &Lab,
        truth: &CftTruth,
        specs: &[EffectSpec],
        motion: &dyn Fn(u64) -> Reference<4>,
        (seed, keep): (u64, bool),
    ) -> Self {
        // with --keep the model comes from logs without the effect
        let before: &[EffectSpec] = if keep { &[] } else { specs };
        let robot = &lab.robot;
        let names: Vec<String> = robot
            .parameters()
            .iter()
            .map(|p| p.name.to_string())
            .collect();
        let ladder = |j: usize, specs: &[EffectSpec]| {
            let plan = OneJointMove::new(j, SECONDS, Some(seed));
            let reference = plan
                .reference(&mechanism(Setup::Tuedacs).expect("four joints"))
                .expect("a ladder");
            let settings = noisy(SECONDS, 10 * seed + j as u64);
            follow(truth, specs, reference, &settings).expect("a run")
        };
        let mut logs = Vec::new();
        let mut known = Vec::new();
        for j in 0..JOINTS.len() {
            let recording = ladder(j, before);
            // where all is refitted with the effects, the filter's law is a start and no more
            let (_, e) = estimated(robot, j, &names, &block(&recording), keep);
            known.push(Some(KnownFriction {
                law: e.law,
                covariance: e.covariance,
                held: [true; 5],
            }));
            if !keep {
                logs.push(lab.log(&recording));
            }
        }
        let columns = RegressorColumns {
            joints: 4,
            shared: 12,
            own: vec![Vec::new(); 4],
            known: known.clone(),
            rest_speed: Vec::new(),
        };
        let training = lab.run(truth, before, motion(seed), 10 * seed + 5);
        let sums = accumulate(robot, &columns, &processing(), &mut source(&training));
        let fitted = fit(&sums.expect("a log").0, Weighting::Wls).expect("a fit");
        let declared = AugmentedModel::plain(Model {
            robot: robot.clone(),
            theta: fitted.theta.iter().copied().collect(),
            friction: known
                .iter()
                .flatten()
                .map(|k| JointFriction::DoubleTanh(k.law))
                .collect(),
            offset: vec![0.0; 4],
        });
        let training = match keep {
            true => lab.run(truth, specs, motion(seed + 1), 10 * seed + 7),
            false => training,
        };
        logs.push(training);
        let mut roles = vec![LogRole::Train; logs.len()];
        logs.push(lab.run(truth, specs, along(series(UNSEEN)), 10 * seed + 6));
        roles.push(LogRole::Holdout);
        let stretches = logs.iter().enumerate().flat_map(|(i, log)| arm(i, log));
        let mut information = DMatrix::zeros(36, 36);
        if keep {
            let mut put = |at: usize, covariance: DMatrix<f64>| {
                if let Some(inverse) = covariance.try_inverse() {
                    let shape = inverse.shape();
                    information.view_mut((at, at), shape).copy_from(&inverse);
                }
            };
            put(0, fitted.covariance.clone());
            for (j, known) in known.iter().flatten().enumerate() {
                put(
                    12 + 5 * j,
                    DMatrix::from_fn(5, 5, |a, b| known.covariance[a][b]),
                );
            }
        }
        let prior = ParameterPrior {
            centre: declared.clone(),
            information,
            rows_per_independent: 5.0,
        };
        Campaign {
            declared,
            prior,
            stretches: stretches.collect(),
            wide: wider(4, &processing(), &logs),
            roles,
            keep,
        }
    }

    pub fn case(
        &self,
        lab: &Lab,
        given: AugmentedModel,
        limits: SelectionLimits,
        without: Vec<String>,
    ) -> Case {
        let joints = lab.robot.joints();
        Case {
            prior: self.prior.clone(),
            given,
            open: FreeParameters {
                offset: vec![false; joints],
                friction: vec![vec![true; 5]; joints],
            },
            stretches: self.stretches.clone(),
            wide: WideMotion::beside(
                &self.stretches,
                self.wide.clone(),
                &lab.processing
                    .widened(WIDE_TIMES, 1.0 / self.stretches[0].dt),
            )
            .ok(),
            roles: self.roles.clone(),
            filters: ParallelFilters::design(&lab.processing, &self.stretches).expect("a filter"),
            cutoff_hz: lab.processing.cutoff_hz,
            rest_speed: vec![-1.0; joints],
            drives: vec![Default::default(); joints],
            units: (0..joints)
                .map(|j| lab.robot.joint_unit(j).to_owned())
                .collect(),
            averaged: true,
            keep: self.keep,
            without,
            own: Vec::new(),
            limits,
        }
    }
}
