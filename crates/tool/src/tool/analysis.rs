//! The whole way from a log of wrenches to what hangs on the sensor.

use super::effect::WrenchEffect;
use super::equations::LinearisedAt;
use super::error::ToolError;
use super::fit::{WrenchFit, WrenchProblem, held_out_blocks, mean_norms};
use super::motion::{at_rest, moving, turns_enough};
use super::next_pose::{next_pose, undetermined};
use super::physics::{BaseColumns, felt};
use super::result::{
    ForceMoment, ToolErrors, ToolForecast, ToolNumber, ToolResult, ToolStep, ToolVerdict,
    TriedReading,
};
use super::search::{FoundEffects, JudgedEffect, fitted, nearest_turn, turn_in_numbers};
use super::touch::{TouchedRows, search_without_touches};
use super::wrench_log::{PoseRow, WrenchLog, WrenchReading};
use super::{GRAVITY, NUMBERS};
use cft_ident_core::judge::{NUMBERS as JUDGE, jackknife, width_95};
use cft_ident_core::number;
use cft_ident_core::robot::tree::space::UNTURNED;
use nalgebra::DMatrix;
use nalgebra::DVector;

/// A number of the fit; `known` where the data determine it, `worth` what it is compared with beside its own size.
fn numbered(
    name: &str,
    unit: &str,
    [value, std, width]: [f64; 3],
    known: bool,
    worth: f64,
) -> ToolNumber {
    let known = known && std.is_finite();
    let verdict = match std / value.abs().max(worth) {
        _ if !known => "not-identifiable",
        part if part <= 0.1 => "identified",
        part if part <= 0.5 => "weak",
        _ => "not-identifiable",
    };
    let half = width * std;
    ToolNumber {
        name: name.to_owned(),
        value: known.then_some(value),
        std: known.then_some(std),
        interval_95: known.then_some([value - half, value + half]),
        unit: unit.to_owned(),
        verdict,
    }
}

/// A problem with its reading and the model without effects.
struct ReadProblem {
    problem: WrenchProblem,
    reading: WrenchReading,
    fit: WrenchFit,
    error: f64,
}

/// Directions of gravity in the sensor: their spread \[rad\].
fn turning(rows: &[PoseRow]) -> f64 {
    let at = LinearisedAt {
        mass: 0.0,
        first_moment: [0.0; 3],
        turn: UNTURNED,
        lean: [0.0; 2],
    };
    let n = rows.len().max(1) as f64;
    let held = |row: &PoseRow| PoseRow {
        acceleration: [0.0; 3],
        ..*row
    };
    let all: Vec<[f64; 3]> = rows.iter().map(|row| felt(&held(row), &at)).collect();
    let mean: [f64; 3] = std::array::from_fn(|k| all.iter().map(|u| u[k]).sum::<f64>() / n);
    let off = |u: &[f64; 3]| (0..3).map(|k| (u[k] - mean[k]).powi(2)).sum::<f64>();
    (all.iter().map(off).sum::<f64>() / n).sqrt() / GRAVITY
}

/// Rows that a fit takes: all, or of a long log every so many.
const MOST_ROWS: usize = 6000;

fn read(log: &WrenchLog, reading: WrenchReading) -> ReadProblem {
    let rows = reading.rows(log);
    // how the sensor's place moves is known by its place alone, and poses that are held need not know it
    let rest = at_rest(&rows).filter(|rest| log.has_clock && turning(rest) >= NUMBERS.least_turn);
    let placed = rows.iter().any(|row| row.position.is_some());
    let held = rest
        .as_ref()
        .is_some_and(|rest| !placed || 2 * rest.len() >= rows.len());
    let moved = (log.has_clock && !held).then(|| moving(&rows)).flatten();
    let inertia = moved.as_ref().is_some_and(|rows| turns_enough(rows));
    let rows = moved.or(rest).unwrap_or(rows);
    let every = rows.len().div_ceil(MOST_ROWS);
    let rows = rows.into_iter().step_by(every.max(1)).collect();
    let problem = WrenchProblem::new(rows, inertia);
    let fit = problem.fit(&[], &held_out_blocks(problem.rows.len()));
    let error = mean_norms(&fit.held_out)[0];
    ReadProblem {
        problem,
        reading,
        fit,
        error,
    }
}

/// Root mean square change of the forces about their mean, norm of the three \[N\].
fn change_of_forces(log: &WrenchLog) -> f64 {
    let n = log.samples.len().max(1) as f64;
    let mean: [f64; 3] =
        std::array::from_fn(|k| log.samples.iter().map(|s| s.force[k]).sum::<f64>() / n);
    let off = |f: &[f64; 3]| (0..3).map(|k| (f[k] - mean[k]).powi(2)).sum::<f64>().sqrt();
    log.samples.iter().map(|s| off(&s.force)).sum::<f64>() / n
}

/// Whether a way to read the log is better than another one by more than chance.
fn is_better(a: &ReadProblem, b: &ReadProblem) -> bool {
    let squares = |of: &ReadProblem| {
        let norm = |e: &[f64; 6]| e[..3].iter().map(|x| x * x).sum::<f64>();
        let blocks = of.fit.blocks.iter();
        let sum = |block: &std::ops::Range<usize>| {
            of.fit.held_out[block.clone()].iter().map(norm).sum::<f64>()
        };
        blocks.map(sum).collect::<Vec<f64>>()
    };
    let d: Vec<f64> = squares(b)
        .iter()
        .zip(squares(a))
        .map(|(x, y)| x - y)
        .collect();
    let n = d.len() as f64;
    let mean = d.iter().sum::<f64>() / n;
    let scatter = d.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    n * mean > NUMBERS.screen * (scatter * n).sqrt()
}

/// What hangs on the sensor, by a log; its error on `held_out`, or on blocks of neighbours left out.
///
/// # Errors
/// Too few rows, poses that are all alike without a drift to be told, forces that no weight explains, units that
/// cannot be.
pub fn analyse(log: &WrenchLog, held_out: Option<&WrenchLog>) -> Result<ToolResult, ToolError> {
    let unknowns = BaseColumns { inertia: false }.len();
    if 6 * log.samples.len() < 2 * unknowns {
        return Err(ToolError::TooFew {
            rows: log.samples.len(),
            unknowns,
        });
    }
    let mut all: Vec<ReadProblem> = WrenchReading::of(log)
        .into_iter()
        .map(|reading| read(log, reading))
        .collect();
    let readings = all.iter().map(|of| TriedReading {
        reading: of.reading,
        force_error: of.error,
    });
    let readings: Vec<TriedReading> = readings.collect();
    let spreads = all.iter().map(|of| turning(&of.problem.rows));
    let spread = spreads.fold(0.0, f64::max);
    let alike = spread < NUMBERS.least_turn;
    let best = (0..all.len()).fold(0, |best, k| match is_better(&all[k], &all[best]) {
        true => k,
        false => best,
    });
    let best = all.swap_remove(best);
    let reading_is_open = all.iter().any(|of| !is_better(&best, of));
    let ReadProblem {
        mut problem,
        reading,
        fit,
        error,
    } = best;
    let reaction = fit.x[BaseColumns::MASS] < 0.0 && !alike;
    if reaction {
        for row in &mut problem.rows {
            row.force = row.force.map(|x| -x);
            row.moment = row.moment.map(|x| -x);
        }
    }
    let (problem, found, touches) = search_without_touches(problem.weighted(), alike);
    let left_out = held_out_blocks(problem.rows.len());
    let plain = problem.fit(&[], &left_out);
    if alike && found.fit.effects.is_empty() {
        return Err(ToolError::Alike {
            degrees: spread.to_degrees(),
        });
    }
    let change = change_of_forces(log);
    let after = mean_norms(&fitted(&problem, &found.fit.effects, &left_out).held_out)[0];
    if !alike && after.min(error) > NUMBERS.explained * change {
        let of = |tried: &TriedReading| {
            let left = number::percent(tried.force_error / change);
            format!("{} {left}", tried.reading.frame.word())
        };
        let turn = turn_in_numbers(&nearest_turn(&problem));
        let turned = turn.iter().map(|x| x * x).sum::<f64>().sqrt().to_degrees();
        let mut shown: Vec<String> = readings.iter().take(2).map(of).collect();
        shown.push(format!(
            "nearest with the sensor turned by {turned:.0} degrees"
        ));
        return Err(ToolError::Frames {
            left: number::percent(after.min(error) / change),
            readings: shown.join(", "),
        });
    }
    let result = ResultParts {
        log,
        problem: &problem,
        plain: &plain,
        found: &found,
        alike,
        held_out,
        reading,
        reaction,
        touches,
    };
    result.made(readings, reading_is_open)
}

/// What the result is made of.
struct ResultParts<'a> {
    log: &'a WrenchLog,
    problem: &'a WrenchProblem,
    plain: &'a WrenchFit,
    found: &'a FoundEffects,
    alike: bool,
    held_out: Option<&'a WrenchLog>,
    reading: WrenchReading,
    reaction: bool,
    touches: Option<TouchedRows>,
}

impl ResultParts<'_> {
    fn made(
        self,
        readings: Vec<TriedReading>,
        reading_is_open: bool,
    ) -> Result<ToolResult, ToolError> {
        let (problem, fit) = (self.problem, &self.found.fit);
        let n = problem.rows.len();
        let bias = problem.base.bias();
        let open = undetermined(&self.plain.normal, bias, n);
        let width = width_95(fit.blocks.len());
        let parameters = self.parameters(fit, &open);
        let centre = parameters
            .iter()
            .filter(|p| ["cx", "cy", "cz"].contains(&p.name.as_str()));
        let squares = centre.filter_map(|p| p.value).map(|x| x * x);
        let far = squares.sum::<f64>().sqrt();
        if !self.log.unit_is_stated && far > NUMBERS.farthest_m && !self.alike {
            return Err(ToolError::Units { centre_m: far });
        }
        let mass = &parameters[6];
        let in_newton = |x: f64| GRAVITY * x;
        let weight = ToolNumber {
            name: "weight".to_owned(),
            unit: "N".to_owned(),
            value: mass.value.map(in_newton),
            std: mass.std.map(in_newton),
            interval_95: mass.interval_95.map(|ends| ends.map(in_newton)),
            ..mass.clone()
        };
        let left_out = held_out_blocks(n);
        let after = fitted(problem, &fit.effects, &left_out);
        let set_aside = |fit: &WrenchFit| {
            self.held_out
                .map(|log| mean_norms(&problem.left_of(fit, &self.rows_of(log))))
        };
        let errors = |fit: &WrenchFit| ToolErrors {
            train: ForceMoment::of(mean_norms(&fit.residual)),
            holdout: ForceMoment::of(set_aside(fit).unwrap_or(mean_norms(&fit.held_out))),
        };
        let of_time = fit.effects.iter().any(WrenchEffect::is_of_time);
        let forecast = of_time.then(|| {
            let end = (NUMBERS.forecast * n as f64) as usize;
            let still = |e: &&WrenchEffect| !e.is_of_time();
            let without: Vec<WrenchEffect> = fit.effects.iter().filter(still).copied().collect();
            let ask = |effects: &[WrenchEffect]| {
                ForceMoment::of(problem.forecast(effects, 0..end, end..n))
            };
            ToolForecast {
                fitted: NUMBERS.forecast,
                without: ask(&without),
                with: ask(&fit.effects),
            }
        });
        let steps: Vec<ToolStep> = self
            .found
            .judged
            .iter()
            .map(|step| self.step(step, &after, width))
            .collect();
        let residuals = problem
            .rows
            .iter()
            .zip(&self.plain.residual)
            .zip(&after.residual);
        let mut result = ToolResult {
            verdict: ToolVerdict {
                kind: "determined",
                text: String::new(),
            },
            rows: n,
            motion: problem.base.inertia,
            reading: self.reading,
            reading_is_open,
            readings,
            reaction: self.reaction,
            weight,
            mass_by_differences: self.by_differences(),
            next_pose: next_pose(problem, &self.plain.normal),
            steps,
            before: errors(self.plain),
            after: errors(&after),
            forecast,
            last_bias: problem.last_bias(fit),
            with_touches: (self.touches.as_ref())
                .map_or(Vec::new(), |of| self.parameters(&of.with_all, &open)),
            touches: self
                .touches
                .as_ref()
                .map_or(Vec::new(), |of| of.touches.clone()),
            blocks: fit.blocks.len(),
            residuals: residuals.map(|((row, a), b)| (row.t, *a, *b)).collect(),
            has_clock: self.log.has_clock,
            undetermined: open,
            parameters,
        };
        result.verdict = super::words::verdict(&result);
        Ok(result)
    }

    fn rows_of(&self, log: &WrenchLog) -> Vec<PoseRow> {
        let mut rows = self.reading.rows(log);
        if let (true, Some(moved)) = (log.has_clock, moving(&rows)) {
            rows = moved;
        }
        let sign = if self.reaction { -1.0 } else { 1.0 };
        for row in &mut rows {
            row.force = row.force.map(|x| sign * x);
            row.moment = row.moment.map(|x| sign * x);
        }
        rows
    }

    /// Bias, mass, centre, and the inertia where the sensor moved.
    fn parameters(&self, fit: &WrenchFit, open: &[String]) -> Vec<ToolNumber> {
        let (problem, width) = (self.problem, width_95(fit.blocks.len()));
        let bias = problem.base.bias();
        let std = |k: usize| fit.covariance[(k, k)].sqrt();
        // bias and weight look the same where poses are alike
        let free = !self.alike;
        let span = |from: usize| {
            let all = problem.rows.iter().map(|row| match from {
                0 => row.force.iter().map(|x| x * x).sum::<f64>(),
                _ => row.moment.iter().map(|x| x * x).sum::<f64>(),
            });
            (all.sum::<f64>() / problem.rows.len().max(1) as f64).sqrt()
        };
        let mut out = Vec::new();
        for (k, name) in ["fx", "fy", "fz", "tx", "ty", "tz"].iter().enumerate() {
            let at = bias + k;
            let (unit, worth) = if k < 3 {
                ("N", span(0))
            } else {
                ("Nm", span(3))
            };
            let numbers = [fit.x[at], std(at), width];
            let name = format!("bias_{name}");
            out.push(numbered(&name, unit, numbers, free, worth));
        }
        let m = fit.x[BaseColumns::MASS];
        let known = free && !open.iter().any(|what| what == "mass");
        let numbers = [m, std(BaseColumns::MASS), width];
        out.push(numbered("mass", "kg", numbers, known, 0.0));
        for (k, name) in ["cx", "cy", "cz"].iter().enumerate() {
            let at = BaseColumns::FIRST_MOMENT + k;
            let c = fit.x[at] / m;
            // c = h / m
            let variance = (fit.covariance[(at, at)] - 2.0 * c * fit.covariance[(at, 0)]
                + c * c * fit.covariance[(0, 0)])
                / (m * m);
            let open = open
                .iter()
                .any(|what| what.starts_with("centre") && what.contains(&name[1..]));
            let numbers = [c, variance.max(0.0).sqrt(), width];
            out.push(numbered(name, "m", numbers, known && !open, 0.01));
        }
        if problem.base.inertia {
            let names = ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
            let largest = (0..6)
                .map(|k| fit.x[BaseColumns::INERTIA + k].abs())
                .fold(0.0, f64::max);
            for (k, name) in names.iter().enumerate() {
                let at = BaseColumns::INERTIA + k;
                out.push(numbered(
                    name,
                    "kg m^2",
                    [fit.x[at], std(at), width],
                    known,
                    largest,
                ));
            }
        }
        out
    }

    /// Mass by differences of neighbours that are far enough apart to differ.
    fn by_differences(&self) -> ToolNumber {
        let rows = &self.problem.rows;
        let at = LinearisedAt {
            mass: 0.0,
            first_moment: [0.0; 3],
            turn: UNTURNED,
            lean: [0.0; 2],
        };
        let apart = |lag: usize| {
            let mut sums = Vec::with_capacity(rows.len());
            for k in lag..rows.len() {
                let du: Vec<f64> = difference(&felt(&rows[k], &at), &felt(&rows[k - lag], &at));
                let df: Vec<f64> = difference(&rows[k].force, &rows[k - lag].force);
                let product =
                    |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
                sums.push([product(&du, &df), product(&du, &du)]);
            }
            sums
        };
        let spread = turning(rows) * GRAVITY;
        let mut lag = 1;
        let mut sums = apart(lag);
        while lag * 8 < rows.len() {
            let mean = sums.iter().map(|s| s[1]).sum::<f64>() / sums.len().max(1) as f64;
            // neighbours as different as any two
            if mean >= spread * spread {
                break;
            }
            lag *= 2;
            sums = apart(lag);
        }
        let blocks = held_out_blocks(sums.len());
        let total = |without: Option<&std::ops::Range<usize>>| {
            let mut all = [0.0; 2];
            for (k, s) in sums.iter().enumerate() {
                if !without.is_some_and(|block| block.contains(&k)) {
                    all[0] += s[0];
                    all[1] += s[1];
                }
            }
            DVector::from_element(1, all[0] / all[1].max(f64::MIN_POSITIVE))
        };
        let whole = total(None);
        let left: Vec<DVector<f64>> = blocks.iter().map(|block| total(Some(block))).collect();
        let v: DMatrix<f64> = jackknife(&whole, &left);
        let numbers = [whole[0], v[(0, 0)].sqrt(), width_95(blocks.len())];
        numbered("mass", "kg", numbers, !self.alike, 0.0)
    }

    fn step(&self, step: &JudgedEffect, after: &WrenchFit, width: f64) -> ToolStep {
        let fit = &self.found.fit;
        let place = fit.effects.iter().position(|e| *e == step.effect);
        let parameters = match place.filter(|_| step.written) {
            None => Vec::new(),
            Some(k) => {
                let of = fit.of_effect(k);
                let keys = step.effect.keys().into_iter().zip(of);
                keys.map(|((name, unit), at)| {
                    let numbers = [fit.x[at], fit.covariance[(at, at)].sqrt(), width];
                    let largest = fit.of_effect(k).map(|i| fit.x[i].abs()).fold(0.0, f64::max);
                    numbered(&name, unit, numbers, true, largest)
                })
                .collect()
            }
        };
        let [f, _] = step.statistic;
        let shrinkage = step.shrinkage();
        ToolStep {
            effect: step.effect.name().to_owned(),
            status: match (step.written, shrinkage > 0.0) {
                (true, _) => "confirmed",
                (false, true) => "indicated",
                (false, false) => "seen",
            },
            degree: match step.effect {
                WrenchEffect::BiasDrift { degree } => Some(degree),
                _ => None,
            },
            begins: self.problem.begins(step.effect),
            deviations: JUDGE.deviations * (f / step.statistic[1]).sqrt(),
            shrinkage,
            size: place.map_or(0.0, |k| self.problem.size(after, k)),
            parameters,
            before: ForceMoment::of(step.before),
            after: ForceMoment::of(step.after),
        }
    }
}

fn difference(a: &[f64; 3], b: &[f64; 3]) -> Vec<f64> {
    a.iter().zip(b).map(|(x, y)| x - y).collect()
}
