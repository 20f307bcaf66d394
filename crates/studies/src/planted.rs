//! Is what was planted named, is nothing else written, and does the model then predict as well as the truth?
//!
//! One effect in one joint at 2, 6 and 20 times the noise: rms of its torque over the noise's, both in the band that the
//! fit keeps. Unseen motion of another kind is judged against the error
//! that the true parameters leave along the same motion without the effect.

use std::path::Path as File;

use serde_json::{Value, json};

use crate::added::{Added, Shape};
use crate::campaign::{Campaign, is_done};
use crate::chance::Chance;
use crate::clean::worst;
use crate::drive::Run;
use crate::friction::Law;
use crate::judge::{LIMITS, Share};
use crate::lab::Lab;
use crate::machine::Kind;
use crate::path::Motion;
use crate::signal::{beside, low_passed, rms};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

pub const SIZES: [f64; 3] = [2.0, 6.0, 20.0];
pub const USUAL_RUNS: u64 = 20;
/// Cut-off of the robot files here [Hz].
const BAND_HZ: f64 = 20.0;

/// What is planted, the family it belongs to, and the machine and joint that have it.
#[derive(Clone, Copy)]
pub struct Member {
    pub name: &'static str,
    family: &'static str,
    pub kind: Kind,
    joint: usize,
    what: What,
}

#[derive(Clone, Copy)]
enum What {
    /// A torque whose size is drawn to the noise.
    Torque(Shape),
    Delay,
    /// Dahl's bristle in place of the ideal stick.
    Presliding,
}

pub fn members() -> Vec<Member> {
    use Shape::*;
    let of = |name, family, kind, joint, what| Member {
        name,
        family,
        kind,
        joint,
        what,
    };
    let one = |name, family, shape| of(name, family, Kind::Single, 0, What::Torque(shape));
    let arm = |name, family, joint, shape| of(name, family, Kind::Arm3, joint, What::Torque(shape));
    vec![
        one("stribeck", "velocity", Stribeck { vs: 0.15 }),
        one("nonlinear-viscous", "velocity", Quadratic),
        one("asymmetric-friction", "offset", Asymmetric),
        one(
            "ripple",
            "position",
            Ripple {
                order: 24.0,
                phase: 0.7,
            },
        ),
        one(
            "position-friction",
            "position",
            PositionFriction {
                order: 6.0,
                phase: 0.4,
            },
        ),
        one("spring", "position", Spring { zero: 0.1 }),
        one("warm-up", "slow", WarmUp { time_s: 12.0 }),
        one("drift", "slow", Drift),
        one("(in no catalogue)", "", Stray),
        of("delay", "timing", Kind::Single, 0, What::Delay),
        of("presliding", "memory", Kind::Single, 0, What::Presliding),
        arm("stribeck", "velocity", 0, Stribeck { vs: 0.15 }),
        arm(
            "ripple",
            "position",
            1,
            Ripple {
                order: 24.0,
                phase: 0.7,
            },
        ),
        arm("load-friction", "load", 1, LoadFriction),
        arm("drive-efficiency", "load", 1, Efficiency),
        arm("coupling", "cross", 2, Coupling { other: 1 }),
        arm(
            "position-friction",
            "position",
            2,
            PositionFriction {
                order: 6.0,
                phase: 0.4,
            },
        ),
    ]
}

/// Name of the cell of what is put into a machine at a size over the noise.
pub fn sized(name: &str, kind: Kind, size: f64) -> String {
    format!("{name} / {} / {size}", crate::coverage::word(kind))
}

impl Member {
    pub fn cell(&self, size: f64) -> String {
        sized(self.name, self.kind, size)
    }

    pub fn run(
        &self,
        tool: &Tool,
        folder: &File,
        size: f64,
        number: u64,
    ) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("planted {}", self.cell(size)), number);
        let (mut lab, own_share) = self.lab(size, &mut chance);
        lab.lay_out(folder)?;
        for log in ["a.csv", "b.csv", "held.csv"] {
            lab.record(folder, log, Motion::SlowSines, &mut chance)?;
        }
        let along = &mut chance.clone();
        lab.record(folder, "unseen.csv", Motion::PointToPoint, &mut chance)?;
        let mut row = Campaign::simulated().diagnosed(tool, folder)?;
        row["own_share"] = json!(own_share);
        row["joint"] = json!(lab.machine.names[self.joint]);
        if row["unseen_before"].is_array() {
            lab.take_out();
            lab.record(folder, "without.csv", Motion::PointToPoint, along)?;
            row["unseen_truth"] = json!(lab.errors_of_truth(tool, folder, "without.csv")?);
        }
        Ok(row)
    }

    /// A machine with the effect in it, and the share of its torque that is beside the declared columns.
    pub fn lab(&self, size: f64, chance: &mut Chance) -> (Lab, Option<f64>) {
        let mut lab = Lab::for_an_effect(self.kind, chance);
        let own_share = self.plant(&mut lab, size, chance);
        (lab, own_share)
    }

    /// Puts the effect in at a size over the noise; gives the share of its torque that is beside the declared columns.
    fn plant(&self, lab: &mut Lab, size: f64, chance: &mut Chance) -> Option<f64> {
        let joint = self.joint;
        let course = lab.course(Motion::SlowSines, chance);
        let run = course.logged(&lab.machine, &lab.sensing, chance);
        let noise = band(&run, |r, k| r.tau[k][joint] - r.clean[k][joint]);
        match self.what {
            What::Torque(shape) => {
                let (with, effect) = put_in(lab, (joint, shape), size, &noise, chance);
                (self.kind == Kind::Single)
                    .then(|| rms(&beside(&effect, &declared(&with))) / rms(&effect))
            }
            What::Delay => {
                let torque = band(&run, |r, k| r.clean[k][joint]);
                let slope: Vec<f64> = torque
                    .windows(2)
                    .map(|w| (w[1] - w[0]) * lab.sensing.rate_hz)
                    .collect();
                lab.sensing.delay_s = (size * rms(&noise) / rms(&slope)).min(0.05);
                None
            }
            What::Presliding => {
                // the way on which the bristle yields, by bisection of its logarithm; beside the same machine with an
                // ideal stick on the same course
                let along = |lab: &Lab| {
                    let seed = &mut Chance::of("presliding", 1);
                    let course = lab.course(Motion::SlowSines, seed);
                    band(&course.logged(&lab.machine, &lab.sensing, seed), |r, k| {
                        r.clean[k][joint]
                    })
                };
                let ideal = along(lab);
                // below the first the plant's step is too long for a bristle
                let (mut low, mut high) = (1e-4_f64, 0.1_f64);
                for _ in 0..9 {
                    let way = (low * high).sqrt();
                    let friction = &mut lab.machine.plant.friction[joint];
                    let stiffness = friction.coulomb / way;
                    friction.law = Law::Presliding {
                        stiffness,
                        damping: 0.0,
                    };
                    let left: Vec<f64> =
                        along(lab).iter().zip(&ideal).map(|(a, b)| a - b).collect();
                    if rms(&left) > size * rms(&noise) {
                        high = way
                    } else {
                        low = way
                    }
                }
                None
            }
        }
    }
}

/// Adds a torque of a size over the noise to a machine; gives a log of it that is small, and its torque there.
pub fn put_in(
    lab: &mut Lab,
    (joint, shape): (usize, Shape),
    size: f64,
    noise: &[f64],
    chance: &mut Chance,
) -> (Run, Vec<f64>) {
    // so small that it does not change the motion
    let unit = 1e-6;
    let added = |size| vec![Added { joint, shape, size }];
    lab.machine.plant.added = added(unit);
    let with = lab
        .course(Motion::SlowSines, chance)
        .logged(&lab.machine, &lab.sensing, chance);
    let effect = band(&with, |r, k| r.planted[k][joint]);
    lab.machine.plant.added = added(unit * size * rms(noise) / rms(&effect));
    (with, effect)
}

/// A series of the log through the low-pass.
pub fn band(run: &Run, of: impl Fn(&Run, usize) -> f64) -> Vec<f64> {
    let rate = 1.0 / (run.t[1] - run.t[0]);
    let series: Vec<f64> = (0..run.t.len()).map(|k| of(run, k)).collect();
    low_passed(&series, BAND_HZ, rate)
}

/// Columns of one joint's declared law.
fn declared(run: &Run) -> Vec<Vec<f64>> {
    let rate = 1.0 / (run.t[1] - run.t[0]);
    let last = run.t.len() - 1;
    let v = |k: usize| run.speed[k][0];
    let acceleration = |_: &Run, k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        (v(b) - v(a)) * rate / (b - a) as f64
    };
    vec![
        band(run, acceleration),
        band(run, |_, k| v(k)),
        band(run, |_, k| if v(k) == 0.0 { 0.0 } else { v(k).signum() }),
        vec![1.0; run.t.len()],
    ]
}

/// What a campaign came to.
#[derive(Default)]
struct Tally {
    campaigns: usize,
    done: usize,
    named: usize,
    false_free: usize,
    ratios: Vec<f64>,
    /// Where it is known.
    own_share: Option<f64>,
}

fn tally(member: &Member, rows: &[&Value]) -> Tally {
    let mut all = Tally {
        campaigns: rows.len(),
        ..Tally::default()
    };
    for row in rows {
        let share = row["own_share"].as_f64();
        all.own_share = share.map(|s| all.own_share.unwrap_or(0.0) + s / rows.len() as f64);
        let Some(written) = row["written"].as_array().filter(|_| is_done(row)) else {
            continue;
        };
        all.done += 1;
        let steps = row["steps"].as_array().cloned().unwrap_or_default();
        let right = |s: &&Value| {
            let named = s[1] == member.family || s[0] == member.name;
            named && (s[2] == row["joint"] || s[2].is_null())
        };
        let is_right = |effect: &Value| steps.iter().filter(right).any(|s| &s[0] == effect);
        all.named += usize::from(written.iter().any(|w| is_right(&w[0])));
        all.false_free += usize::from(written.iter().all(|w| is_right(&w[0])));
        all.ratios
            .extend(worst(row, "unseen_after", "unseen_truth"));
    }
    all.ratios.sort_by(f64::total_cmp);
    all
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| planted / machine / times the noise | build | campaigns | not done | own share | family written | \
         nothing false written | error on unseen motion over that of the true law, median | |\n\
         | :-- | :-- | --: | --: | --: | --: | --: | --: | :-- |\n",
    );
    for member in members() {
        for size in SIZES {
            let cell = member.cell(size);
            for tool in rows.tools() {
                let own: Vec<&Value> = rows.of(&tool, &cell).collect();
                if own.is_empty() {
                    continue;
                }
                let t = tally(&member, &own);
                let median = t.ratios.get(t.ratios.len() / 2).copied();
                let shown = t.own_share.is_none_or(|s| s >= LIMITS.own_share);
                text += &format!(
                    "| {cell} | {tool} | {} | {} | {} | {} | {} | {} | {} |\n",
                    t.campaigns,
                    t.campaigns - t.done,
                    t.own_share.map_or("-".to_owned(), |s| format!("{s:.2}")),
                    percent(t.named, t.done),
                    percent(t.false_free, t.done),
                    median.map_or("-".to_owned(), |m| format!("{m:.2}")),
                    if !shown {
                        "cannot tell"
                    } else if size < 6.0 {
                        "reported"
                    } else {
                        ""
                    },
                );
            }
        }
    }
    let heads = rows.tools().into_iter().map(|tool| head(rows, &tool));
    format!("{}\n\n{text}", heads.collect::<Vec<_>>().join("\n"))
}

/// The three figures of a binary at 6 and 20 times the noise.
fn head(rows: &Rows, tool: &str) -> String {
    let (mut named, mut tellable, mut clean, mut done) = (0, 0, 0, 0);
    let mut ratios = Vec::new();
    for member in members() {
        for size in SIZES.iter().filter(|s| **s >= 6.0) {
            let cell = member.cell(*size);
            let own: Vec<&Value> = rows.of(tool, &cell).collect();
            let t = tally(&member, &own);
            done += t.done;
            clean += t.false_free;
            if t.own_share.is_none_or(|s| s >= LIMITS.own_share) && !member.family.is_empty() {
                (named, tellable) = (named + t.named, tellable + t.done);
                ratios.extend(t.ratios);
            }
        }
    }
    let near = ratios.iter().filter(|r| **r <= LIMITS.over_truth).count();
    let said = |hits: usize, of: usize, aim: f64| {
        let (low, high) = Share::of(hits, of).interval(LIMITS.confidence);
        format!(
            "{hits} of {of} ({:.0}..{:.0} %, aim {:.0} %)",
            100.0 * low,
            100.0 * high,
            100.0 * aim
        )
    };
    format!(
        "- {tool}, at 6 and 20 times the noise: family written {}; nothing false written {}; error on unseen motion within \
         {} times that of the true law on every joint in {near} of {}.",
        said(named, tellable, LIMITS.family_named),
        said(clean, done, LIMITS.no_false),
        LIMITS.over_truth,
        ratios.len()
    )
}

fn percent(hits: usize, of: usize) -> String {
    if of == 0 {
        "-".to_owned()
    } else {
        format!("{hits} of {of}")
    }
}
