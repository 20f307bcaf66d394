//! Measured machines: their logs fitted and diagnosed once, then made anew with an effect in them.

use cft_ident::config::ModelFile;
use cft_ident::diagnose::Candidate;
use cft_ident::effect::{AugmentedModel, Cover, Place, Torques};
use cft_ident::identify::{
    Control, DiagnoseEnd, DiagnoseLogs, DiagnoseSettings, Diagnosed, Log, LoggedRobot, LsqSettings,
    diagnose, lsq, refined,
};
use cft_ident::log::{Block, LogSpec};
use cft_ident::motion::{ParallelFilters, Stretch};
use cft_ident::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident::robot::model::{JointFriction, Model};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::effects::{Kind, Planted};

/// Blocks of a log whose residual keeps its sign.
const BLOCKS: usize = 40;
/// Rms of what the declared model leaves of an effect, over its own, below which it is not put in.
const LEAST_SHARE: f64 = 0.05;
/// How much of a column the others must leave so that it counts as one more.
const NEW: f64 = 1e-6;

/// A machine's robot file and log.
pub struct Source {
    pub name: &'static str,
    robot: &'static str,
    log: &'static str,
}

const fn source(name: &'static str, robot: &'static str, log: &'static str) -> Source {
    Source { name, robot, log }
}

pub const ALL: [Source; 6] = [
    source("EMPS", "configs/emps-symmetric.toml", "emps/emps_id.csv"),
    source("Panda", "configs/panda.toml", "panda/panda_exciting.csv"),
    source("TX40", "configs/tx40.toml", "tx40/tx40_joint.csv"),
    source("UR10", "configs/ur10.toml", "ur10/ur10_exciting.csv"),
    source("KR300", "configs/kr300.toml", "kr300/A.csv"),
    source(
        "motor",
        "configs/bldc.toml",
        "bldc-cogging/speed_test1.txt@0.5..10s",
    ),
];

/// A machine with the model that lacks nothing of its log.
pub struct Machine {
    robot: LoggedRobot,
    file: ModelFile,
    model: AugmentedModel,
    /// What the first diagnosis added.
    declared: Vec<String>,
    filters: ParallelFilters,
    cover: Cover,
    parts: Vec<Part>,
    /// Rms of the filtered residual per joint, in the rows in which it moves.
    residual_rms: Vec<f64>,
    /// Orthonormal columns of what the model can fit, all joints' rows behind each other, in residuals' rms.
    basis: Vec<Vec<f64>>,
}

/// A stretch of the log.
struct Part {
    stretch: Stretch,
    torques: Torques,
    /// Reconstructed torque with its delays, and what it leaves, `[joint][sample]`.
    hat: Vec<Vec<f64>>,
    residual: Vec<Vec<f64>>,
    /// Positions as logged, row after row.
    q: Vec<f64>,
    /// Whether each joint moves in each row that the filter keeps, `[joint][row]`.
    moving: Vec<Vec<bool>>,
}

fn diagnosed(robot: &LoggedRobot, file: &ModelFile, log: &Log) -> Result<Box<Diagnosed>, String> {
    let logs = DiagnoseLogs {
        train: std::slice::from_ref(log),
        ..DiagnoseLogs::default()
    };
    let settings = DiagnoseSettings::default();
    match diagnose(
        robot,
        ("model", file),
        &logs,
        &settings,
        &Control::default(),
    ) {
        Ok(DiagnoseEnd::Diagnosed(found)) => Ok(found),
        Ok(DiagnoseEnd::DataFault(fault)) => Err(fault.effect),
        Err(error) => Err(error.to_string()),
    }
}

impl Machine {
    /// Fits and diagnoses the log; none, said aloud, where it is not there.
    pub fn new(source: &Source) -> Option<Self> {
        let spec: LogSpec = format!("../shared/data/{}", source.log)
            .parse()
            .expect("a span");
        if !spec.path.exists() {
            eprintln!("{}: no data, skipped", source.name);
            return None;
        }
        let (log, control) = (Log::from(spec), Control::default());
        let robot = LoggedRobot::load(source.robot).expect("a robot file");
        let logs = std::slice::from_ref(&log);
        let fitted = lsq(&robot, logs, &LsqSettings::default(), &control).expect("a fit");
        let first = fitted.model(&robot, None);
        let found = diagnosed(&robot, &first, &log).expect("a diagnosis");
        let file = found.model(&robot, &first);
        let model = refined(&file, "model").expect("a model");
        let raw = raw(&robot, &log, &control);
        let stretches = &found.in_memory.stretches;
        let cover = Cover::of(&robot.robot, stretches, found.cutoff_hz);
        let rest = &found.in_memory.rest_speed;
        let parts: Vec<Part> = (stretches.iter())
            .map(|stretch| Part::of(stretch, &model, (&found.filters, rest), &raw))
            .collect();
        let mut machine = Machine {
            declared: (model.effects.iter())
                .map(|e| e.title(&robot.robot))
                .collect(),
            filters: found.filters.clone(),
            residual_rms: vec![1.0; robot.robot.joints()],
            basis: Vec::new(),
            robot,
            file,
            model,
            cover,
            parts,
        };
        let residual: Vec<&Vec<Vec<f64>>> = machine.parts.iter().map(|p| &p.residual).collect();
        let rows = machine.rows(&residual);
        machine.residual_rms = rows.iter().map(|rows| rms(rows)).collect();
        machine.basis = machine.fitted();
        eprintln!(
            "{}: {} unknowns, declared {:?}",
            source.name,
            machine.basis.len(),
            machine.declared
        );
        Some(machine)
    }

    /// Filtered rows of each joint, those in which it moves, of torques `[part][joint][sample]`.
    fn rows(&self, torques: &[&Vec<Vec<f64>>]) -> Vec<Vec<f64>> {
        let mut out = vec![Vec::new(); self.residual_rms.len()];
        for (part, torques) in self.parts.iter().zip(torques) {
            let views: Vec<&[f64]> = torques.iter().map(Vec::as_slice).collect();
            let rows = self.filters.of(&part.stretch).run(&views);
            for (j, rows) in rows.expect("a long stretch").into_iter().enumerate() {
                let kept = rows.into_iter().zip(&part.moving[j]);
                out[j].extend(kept.filter(|(_, moves)| **moves).map(|(x, _)| x));
            }
        }
        out
    }

    /// The same in residuals' rms, one behind the other.
    fn weighted(&self, torques: &[&Vec<Vec<f64>>]) -> Vec<f64> {
        let rows = self.rows(torques);
        let of_joints = rows.iter().zip(&self.residual_rms);
        of_joints
            .flat_map(|(rows, rms)| rows.iter().map(move |x| x / rms))
            .collect()
    }

    /// What the declared model can fit: its torque by each number, as orthonormal columns.
    fn fitted(&self) -> Vec<Vec<f64>> {
        let offset = self.robot.file.friction.offset;
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for changed in neighbours(&self.model, offset) {
            let change: Vec<Vec<Vec<f64>>> = (self.parts.iter())
                .map(|part| {
                    let mut hat = changed.reconstruct(&part.stretch);
                    for (hat, own) in hat.iter_mut().zip(&part.hat) {
                        hat.iter_mut().zip(own).for_each(|(x, own)| *x -= own);
                    }
                    hat
                })
                .collect();
            let mut column = self.weighted(&change.iter().collect::<Vec<_>>());
            if !normalise(&mut column, 0.0) {
                continue;
            }
            // twice is enough
            for _ in 0..2 {
                project(&mut column, &basis);
            }
            if normalise(&mut column, NEW) {
                basis.push(column);
            }
        }
        basis
    }

    /// Largest rms over the joints of what the declared model leaves of a torque, in residuals' rms; and that over the
    /// torque's own.
    fn left(&self, torque: &[Vec<Vec<f64>>]) -> (f64, f64) {
        let all: Vec<&Vec<Vec<f64>>> = torque.iter().collect();
        let own = self.weighted(&all);
        let mut left = own.clone();
        project(&mut left, &self.basis);
        let mut from = 0;
        let lengths = self.rows(&all).into_iter().map(|rows| rows.len());
        let largest = lengths.map(|length| {
            from += length;
            rms(&left[from - length..from])
        });
        (largest.fold(0.0, f64::max), rms(&left) / rms(&own))
    }

    fn torque(&self, planted: &Planted, scale: f64) -> Option<Vec<Vec<Vec<f64>>>> {
        let along = |part: &Part| {
            let scene = (&part.stretch, &part.torques);
            planted.torque(scale, &self.model, scene, self.cover.duration_s)
        };
        self.parts.iter().map(along).collect()
    }

    /// The scale at which the declared model leaves so much of an effect.
    ///
    /// # Errors
    /// Why it is not put in.
    fn scale(&self, planted: &Planted, size: f64) -> Result<f64, String> {
        let left = |scale: f64| {
            let torque = self.torque(planted, scale).ok_or("cannot be built")?;
            Ok::<_, String>(self.left(&torque))
        };
        let scale = if planted.is_linear() {
            size / left(1.0)?.0
        } else {
            // the first scale that is large enough, then halves of the logarithm: beyond it less may be left again
            let mut high = 1e-5;
            while left(high)?.0 < size {
                high *= 2.0;
                if high > 1e5 {
                    return Err("no scale has this size".to_owned());
                }
            }
            let mut low = 0.5 * high;
            for _ in 0..12 {
                let middle = (low * high).sqrt();
                match left(middle)?.0 < size {
                    true => low = middle,
                    // what overflows is too large
                    false => high = middle,
                }
            }
            (low * high).sqrt()
        };
        let (found, share) = left(scale)?;
        if share.is_nan() || share < LEAST_SHARE {
            return Err(format!("the model explains all but {:.1} %", 100.0 * share));
        }
        let off = (found / size - 1.0).abs();
        if off.is_nan() || off > 0.05 {
            return Err("no scale has this size".to_owned());
        }
        match planted.broken(scale, &self.model, &self.cover) {
            Some(why) => Err(why),
            None => Ok(scale),
        }
    }

    /// Puts an effect of a size in, and diagnoses.
    pub fn case(&self, put: Option<(&'static Kind, f64)>, draw: u64) -> Value {
        let mut chance = ChaCha8Rng::seed_from_u64(draw);
        let signs: Vec<f64> = (0..BLOCKS)
            .map(|_| if chance.random::<bool>() { 1.0 } else { -1.0 })
            .collect();
        let mut row = json!({
            "machine": ALL.iter().find(|s| s.robot == self.robot.name).map(|s| s.name),
            "draw": draw,
            "declared": self.declared,
        });
        let Some((kind, size)) = put else {
            let made = self.log(&signs, None);
            return self.judged(row, &made, None);
        };
        row["effect"] = kind.name().into();
        row["family"] = kind.entry().family().name().into();
        row["size"] = size.into();
        let mut places = kind.places(&self.model, &self.cover);
        // the same places for both sizes
        places.shuffle(&mut chance);
        let mut reasons = Vec::new();
        for place in places {
            let planted = kind.at(place, &self.model, &self.cover, &mut chance);
            match self.scale(&planted, size) {
                Ok(scale) => {
                    let torque = self.torque(&planted, scale).expect("it was built");
                    row["values"] = json!(planted.values(scale));
                    row["share"] = self.left(&torque).1.into();
                    let made = self.log(&signs, Some(&torque));
                    return self.judged(row, &made, Some(&planted));
                }
                Err(why) => {
                    let at = place.name(&self.robot.robot).unwrap_or_default();
                    reasons.push(format!("{at}: {why}"));
                }
            }
        }
        row["absent"] = json!(reasons);
        row
    }

    /// The log with the residual's blocks by these signs, and with a torque.
    fn log(&self, signs: &[f64], torque: Option<&[Vec<Vec<f64>>]>) -> Log {
        let n = self.residual_rms.len();
        let samples: usize = self.parts.iter().map(|p| p.stretch.len()).sum();
        let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
        for (i, part) in self.parts.iter().enumerate() {
            for k in 0..part.stretch.len() {
                let sign = signs[t.len() * BLOCKS / samples];
                t.push(part.stretch.t[k]);
                q.extend_from_slice(&part.q[n * k..n * (k + 1)]);
                for j in 0..n {
                    let more = torque.map_or(0.0, |torque| torque[i][j][k]);
                    tau.push(part.hat[j][k] + sign * part.residual[j][k] + more);
                }
            }
        }
        Log::of_rows("semi-synthetic", &t, &q, &tau).expect("rows of one log")
    }

    /// What the diagnosis says of it.
    fn judged(&self, mut row: Value, log: &Log, put: Option<&Planted>) -> Value {
        let found = match diagnosed(&self.robot, &self.file, log) {
            Ok(found) => found.diagnosis,
            Err(error) => {
                row["error"] = error.into();
                return row;
            }
        };
        let robot = &self.robot.robot;
        if let Some(planted) = put {
            row["place"] = planted.place.name(robot).into();
        }
        let mut hit: Option<(usize, bool)> = None;
        let mut steps = Vec::new();
        for (s, step) in found.steps.iter().enumerate() {
            let effect = &found.model.effects[step.effect];
            let alike: Vec<&str> = step.alternatives.iter().map(|c| c.effect.name()).collect();
            steps.push(json!({
                "effect": effect.title(robot),
                "family": effect.family().name(),
                "alternatives": alike,
            }));
            let Some(planted) = put else { continue };
            let families = planted.kind.entry().families;
            let here = match effect.place {
                Place::All => planted.place == Place::All || self.residual_rms.len() == 1,
                place => place.touches(planted.joint),
            };
            let name = planted.kind.name();
            let member = here && (effect.name() == name || alike.contains(&name));
            let family = member || here && families.contains(&effect.family());
            let better = hit.is_none_or(|(_, was)| member && !was);
            if family && better {
                hit = Some((s, member));
            }
        }
        if let (Some(planted), None) = (put, hit) {
            let own = |c: &&Candidate| {
                c.effect.name() == planted.kind.name() && c.effect.place == planted.place
            };
            let refused = found.candidates.iter().find(own);
            row["refused because"] = refused.map(|c| c.reason.as_str()).into();
        }
        row["right family"] = hit.is_some().into();
        row["right member"] = hit.is_some_and(|(_, member)| member).into();
        row["false"] = (steps.len() - usize::from(hit.is_some())).into();
        row["steps"] = steps.into();
        row["left"] = json!(found.structured());
        row
    }
}

impl Part {
    fn of(
        stretch: &Stretch,
        model: &AugmentedModel,
        (filters, rest): (&ParallelFilters, &[f64]),
        raw: &Block,
    ) -> Self {
        let torques = model.torques(stretch);
        let n = stretch.joints();
        let mut q = Vec::with_capacity(n * stretch.len());
        for t in &stretch.t {
            let after = raw.t.partition_point(|x| x < t).min(raw.t.len() - 1);
            let before = after.saturating_sub(1);
            let nearer = (raw.t[before] - t).abs() < (raw.t[after] - t).abs();
            let k = if nearer { before } else { after };
            q.extend_from_slice(&raw.q[n * k..n * (k + 1)]);
        }
        let filter = filters.of(stretch);
        let moves = |j: usize| {
            let row = |i: usize| stretch.v[j][filter.sample_of(i)].abs() > rest[j];
            (0..filter.rows(stretch.len())).map(row).collect()
        };
        Part {
            hat: model.reconstruct(stretch),
            residual: model.residual(stretch, &torques),
            torques,
            q,
            moving: (0..n).map(moves).collect(),
            stretch: stretch.clone(),
        }
    }
}

/// A log's rows as a fit gets them.
fn raw(robot: &LoggedRobot, log: &Log, control: &Control) -> Block {
    let mut open = robot.open(log, control).expect("a log");
    let (mut all, mut block) = (Block::default(), Block::default());
    loop {
        block.clear();
        let more = open.read(&mut block).expect("a log");
        all.t.extend_from_slice(&block.t);
        all.q.extend_from_slice(&block.q);
        if !more {
            return all;
        }
    }
}

/// Models that differ from one by each of its numbers.
fn neighbours(model: &AugmentedModel, offset: bool) -> Vec<AugmentedModel> {
    let mut out = Vec::new();
    let mut change = |how: &dyn Fn(&mut AugmentedModel)| {
        let mut changed = model.clone();
        how(&mut changed);
        out.push(changed);
    };
    let slight = |x: f64| x + 1e-4 * x.abs().max(1e-6);
    let Model {
        theta, friction, ..
    } = &model.model;
    for k in 0..theta.len() {
        change(&|m| m.model.theta[k] += 1.0);
    }
    for (j, law) in friction.iter().enumerate() {
        if offset {
            change(&|m| m.model.offset[j] += 1.0);
        }
        match *law {
            JointFriction::None => {}
            JointFriction::DoubleTanh(law) => (0..5).for_each(|k| {
                let mut numbers = law.parameters();
                numbers[k] = slight(numbers[k]);
                let law = DoubleTanh::from_parameters(numbers);
                change(&|m| m.model.friction[j] = JointFriction::DoubleTanh(law));
            }),
            JointFriction::ViscousCoulomb(law) => {
                for (viscous, coulomb) in [(1.0, 0.0), (0.0, 1.0)] {
                    let law = ViscousCoulomb {
                        viscous: law.viscous + viscous,
                        coulomb: law.coulomb + coulomb,
                    };
                    change(&|m| m.model.friction[j] = JointFriction::ViscousCoulomb(law));
                }
            }
        }
    }
    for (e, effect) in model.effects.iter().enumerate() {
        let shapes = effect.shape.len();
        for k in 0..effect.parameters() {
            if effect.held[k] {
                continue;
            }
            change(&|m| match k < shapes {
                true => m.effects[e].shape[k] = slight(m.effects[e].shape[k]),
                false => m.effects[e].linear[k - shapes] = slight(m.effects[e].linear[k - shapes]),
            });
        }
    }
    out
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Makes a column's norm one; false where it is at most `least`.
fn normalise(x: &mut [f64], least: f64) -> bool {
    let norm = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    x.iter_mut().for_each(|x| *x /= norm);
    norm.is_finite() && norm > least
}

/// Takes out of `x` what orthonormal columns explain.
fn project(x: &mut [f64], basis: &[Vec<f64>]) {
    for column in basis {
        let part: f64 = x.iter().zip(column).map(|(a, b)| a * b).sum();
        x.iter_mut().zip(column).for_each(|(a, b)| *a -= part * b);
    }
}
