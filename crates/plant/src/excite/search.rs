//! Many starts, repaired, searched in parallel, the best kept: the design of one motion.

use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use super::ExciteError;
use super::criterion::Criterion;
use super::information::InformationFactors;
use super::lagrangian::{LagrangianRound, LagrangianSearch};
use super::limits::{BoundedQuantity, Quantity};
use super::machine::ForeseenRobot;
use super::objective::{Objective, PriorInformation};
use super::repair::repaired;
use super::series::Series;
use super::start::random_motion;
use super::usage::{ChannelUse, ScanEffort, along_period, most_broken, worst};
use super::variables::DesignVariables;

/// What is to be designed, and how hard to look.
#[derive(Debug, Clone)]
pub struct DesignTask {
    pub criterion: Criterion,
    /// Fundamental frequency \[Hz\].
    pub fundamental_hz: f64,
    /// Harmonics N.
    pub harmonics: usize,
    /// Offset per coordinate that must be kept; the search chooses the others.
    pub offsets: Vec<Option<f64>>,
    /// Share of every limit that is kept free, for what a controller strays from the path.
    pub reserve: f64,
    /// Information that is there already.
    pub prior: Option<PriorInformation>,
    /// Random starts.
    pub starts: usize,
    /// Evaluations that each start may take; as many as its rounds have where absent.
    pub evaluations: Option<u64>,
    pub seed: u64,
}

/// What a search found.
#[derive(Debug, Clone)]
pub struct FoundMotion {
    pub series: Series,
    /// Evaluations of the criterion with its derivative, over all starts.
    pub evaluations: u64,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// What a start has given: the criterion and the motion within the limits.
type BestTrial = Option<(f64, Series)>;

/// Rounds that every start gets.
const FIRST: [LagrangianRound; 3] = [(6.0, 60), (8.0, 40), (12.0, 40)];
/// Rounds that the best of them get on top.
const SECOND: [LagrangianRound; 8] = [
    (16.0, 100),
    (24.0, 100),
    (32.0, 100),
    (48.0, 100),
    (64.0, 100),
    (96.0, 100),
    (128.0, 100),
    (192.0, 100),
];
/// Rounds after torques and volts have been looked at between the samples.
const LAST: [LagrangianRound; 3] = [(128.0, 80), (192.0, 80), (256.0, 80)];
/// Excess between samples, as a share of the limit, that is left to the repair.
const MAX_EXCESS_SHARE: f64 = 2e-3;
/// One start in so many gets the second part.
const FINALISTS: usize = 4;
/// Samples of the period per harmonic in the search.
const SAMPLES_PER_HARMONIC: usize = 12;

impl DesignTask {
    /// Evaluations that the search will take at most.
    pub fn most_evaluations(&self) -> u64 {
        let sum = |rounds: &[LagrangianRound]| rounds.iter().map(|round| round.1).sum::<u64>();
        let most = self.evaluations.unwrap_or(u64::MAX);
        let first = sum(&FIRST).min(most);
        let last = (sum(&SECOND) + sum(&LAST)).min(most - first);
        self.starts as u64 * first + self.finalists() as u64 * last
    }

    fn finalists(&self) -> usize {
        self.starts.div_ceil(FINALISTS).max(2).min(self.starts)
    }
}

/// Designs one motion of the machine.
///
/// `progress` receives the evaluations of each step; when `stop` becomes true the search ends with
/// the best motion that it has. The result does not depend on the number of threads.
///
/// # Errors
/// [`ExciteError`] where limits are missing or contradict each other, and where no start could be
/// repaired.
pub fn design(
    machine: &ForeseenRobot,
    task: &DesignTask,
    progress: &(dyn Fn(u64) + Sync),
    stop: &AtomicBool,
) -> Result<FoundMotion, ExciteError> {
    let reserved = machine.channels.iter().map(|c| c.reserved(task.reserve));
    let channels: Vec<BoundedQuantity> = reserved.collect();
    check(machine, task, &channels)?;
    let (w, offsets) = (TAU * task.fundamental_hz, task.offsets.clone());
    let variables = DesignVariables::new(&channels, w, task.harmonics, offsets);
    let samples = (SAMPLES_PER_HARMONIC * task.harmonics).max(25);
    let prior = task.prior.as_ref();
    let criterion = &task.criterion;
    let objective = Objective::new(machine, criterion, &channels, variables, prior, samples);
    let effort = SearchBudget {
        most: task.evaluations.unwrap_or(u64::MAX),
        spent: AtomicU64::new(0),
        progress,
        stop,
    };
    let finish = |search: &LagrangianSearch| {
        let mut series = objective.work().series;
        objective.variables.series(&search.z, &mut series);
        let series = repaired(
            machine,
            &channels,
            &series,
            &task.offsets,
            ScanEffort::Thorough,
        )?;
        let series = rounded(machine, &channels, series);
        let value = value(machine, task, &series)?;
        Some((value, series))
    };
    let mut searches: Vec<(usize, LagrangianSearch, BestTrial)> = (0..task.starts)
        .into_par_iter()
        .filter_map(|start| {
            // one start is looked through whatever happens
            if start > 0 && effort.stopped() {
                return None;
            }
            let motion = random_motion(machine, &channels, &objective.variables, task.seed, start);
            let z = objective.variables.of(&motion);
            let mut search = LagrangianSearch::new(&objective, z);
            effort.step(&objective, &mut search, &FIRST);
            let found = finish(&search);
            Some((start, search, found))
        })
        .collect();
    searches.sort_by(|a, b| order(&a.2, &b.2).then(a.0.cmp(&b.0)));
    let last = task.finalists().min(searches.len());
    searches[..last]
        .par_iter_mut()
        .for_each(|(_, search, found)| {
            let mut keep_better = |search: &LagrangianSearch| {
                let after = finish(search);
                if order(&after, found).is_lt() {
                    *found = after;
                }
            };
            effort.step(&objective, search, &SECOND);
            keep_better(search);
            if let Some(tightened) = objective.tightened(&search.z, MAX_EXCESS_SHARE) {
                effort.step(&tightened, search, &LAST);
                keep_better(search);
            }
        });
    searches.sort_by(|a, b| order(&a.2, &b.2).then(a.0.cmp(&b.0)));
    match searches.into_iter().next() {
        Some((_, _, Some((_, series)))) => Ok(FoundMotion {
            series,
            stopped: effort.stopped(),
            evaluations: effort.spent.into_inner(),
        }),
        _ => Err(nothing_fits(machine, &channels, &objective.variables, task)),
    }
}

/// Which of two starts has given more; one without a motion comes last.
fn order(a: &BestTrial, b: &BestTrial) -> std::cmp::Ordering {
    let of = |x: &BestTrial| x.as_ref().map_or(f64::INFINITY, |x| x.0);
    of(a).total_cmp(&of(b))
}

/// What a design may take, and has taken.
struct SearchBudget<'a> {
    /// Evaluations of each start.
    most: u64,
    /// Those of all starts so far.
    spent: AtomicU64,
    progress: &'a (dyn Fn(u64) + Sync),
    stop: &'a AtomicBool,
}

impl SearchBudget<'_> {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Takes a search through some rounds.
    fn step(
        &self,
        objective: &Objective,
        search: &mut LagrangianSearch,
        rounds: &[LagrangianRound],
    ) {
        let mut work = objective.work();
        let before = search.evaluations;
        search.run(objective, rounds, self.most, &mut work, &|| self.stopped());
        let more = search.evaluations - before;
        self.spent.fetch_add(more, Ordering::Relaxed);
        (self.progress)(more);
    }
}

/// The criterion as it is, smaller is better.
fn value(machine: &ForeseenRobot, task: &DesignTask, series: &Series) -> Option<f64> {
    let information = InformationFactors::of_period(machine, series, 40 * task.harmonics).ok()?;
    let value = information.value(machine, &task.criterion, task.prior.as_ref());
    value.ok().filter(|value| value.is_finite())
}

/// The series with its coefficients at six decimals, where it keeps the channels so too.
fn rounded(machine: &ForeseenRobot, channels: &[BoundedQuantity], series: Series) -> Series {
    const DECIMALS: f64 = 1e6;
    // what rounding moves, taken off the amplitudes first
    let mut out = series.scaled(1.0 - 1e-5);
    let numbers = out.a.iter_mut().chain(&mut out.b).flatten();
    for x in numbers.chain(&mut out.offset) {
        // adding 0 takes the sign of a zero away
        *x = (*x * DECIMALS).round() / DECIMALS + 0.0;
    }
    match worst(&along_period(machine, channels, &out)) <= 1.0 {
        true => out,
        false => series,
    }
}

/// Refuses what no search can mend.
fn check(
    machine: &ForeseenRobot,
    task: &DesignTask,
    channels: &[BoundedQuantity],
) -> Result<(), ExciteError> {
    let names = machine.coordinate_names();
    for (i, name) in names.iter().enumerate() {
        let Some(position) = BoundedQuantity::find(channels, Quantity::Position, i) else {
            return Err(ExciteError::NoTravel {
                coordinate: name.clone(),
            });
        };
        let bounded = machine.channels.iter().any(|c| {
            c.index == i && c.quantity != Quantity::Position && !c.quantity.is_of_places()
        });
        if !bounded {
            return Err(ExciteError::NoSpeed {
                coordinate: name.clone(),
            });
        }
        if let Some(offset) = task.offsets[i]
            && !(position.lower..=position.upper).contains(&offset)
        {
            return Err(ExciteError::OffsetOutside {
                coordinate: name.clone(),
                offset,
                lower: position.lower,
                upper: position.upper,
            });
        }
    }
    Ok(())
}

/// Names the limit that standing still breaks, or says that nothing is excited.
fn nothing_fits(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    variables: &DesignVariables,
    task: &DesignTask,
) -> ExciteError {
    let rest = random_motion(machine, channels, variables, task.seed, 0).scaled(0.0);
    let uses = along_period(machine, channels, &rest);
    let Some(ChannelUse { channel, range, .. }) = most_broken(uses) else {
        return ExciteError::NothingExcited {
            unknowns: machine.unknowns(),
            starts: task.starts,
        };
    };
    let [least, most] = range;
    ExciteError::CannotRest {
        quantity: channel.quantity.called(&channel.unit),
        value: if most.abs() > least.abs() {
            most
        } else {
            least
        },
        lower: channel.lower,
        upper: channel.upper,
        channel: channel.name,
    }
}
