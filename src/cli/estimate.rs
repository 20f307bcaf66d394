//! The estimators of `lsq` on logs that are read once per pass.

use nalgebra::DVector;
use serde_json::{Value, json};

use super::context::Progress;
use super::machine::{Machine, narrowed, run_error, summary_warnings};
use super::{CliError, Context};
use crate::inertia::accumulate::BlockFactors;
use crate::inertia::closed_loop::Gains;
use crate::inertia::columns::RegressorColumns;
use crate::inertia::encoder::{GRIDS, accumulate_shifted, add_scatter};
use crate::inertia::feasible::nearest;
use crate::inertia::instruments::{self, Instrumental, ReferenceSource};
use crate::inertia::refine::{self, RefinedFit};
use crate::inertia::robust::{self, Robust, Status, Weigher};
use crate::inertia::solve::{self, Fit, FitError, fit};
use crate::inertia::{accumulate_weighted, add_processing};
use crate::log::{Block, LogSpec, Provenance};
use crate::motion::{FilterSettings, Summary};
use crate::number;

/// How parameters are estimated from the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Estimator {
    /// Rows weighted by each joint's noise, in two steps
    Wls,
    /// All rows alike
    Ols,
    /// Rows with large residuals count less: Huber's loss, then Tukey's bisquare
    Irls,
    /// Instrumental variables: the regressor along simulated positions, blind to their noise
    Iv,
    /// All parameters at once, the slopes of the friction law among them
    Oe,
}

impl Estimator {
    /// As the command line spells it.
    pub fn name(self) -> &'static str {
        match self {
            Estimator::Wls => "wls",
            Estimator::Ols => "ols",
            Estimator::Irls => "irls",
            Estimator::Iv => "iv",
            Estimator::Oe => "oe",
        }
    }
}

impl From<FitError> for CliError {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Math(_) | FitError::Prior { .. } => CliError::input(error),
            FitError::TooFewRows { .. } | FitError::NothingExcited => CliError::undetermined(error),
        }
    }
}

/// What an estimator says of its own work.
#[derive(Debug, Clone, PartialEq)]
pub struct Account {
    pub estimator: Estimator,
    /// The estimator that was asked for cannot do without the refinement of the friction law.
    pub law_refined: bool,
    pub status: Status,
    /// Passes over the logs; 1 for least squares.
    pub iterations: usize,
    /// Per joint: scale of the residual [N or Nm] and share of rows of less than half weight.
    pub down_weighted: Option<Vec<(f64, f64)>>,
    /// Relative residual per joint before a refinement.
    pub before: Option<Vec<f64>>,
    /// The loop that was simulated.
    pub simulated: Option<Simulated>,
}

/// The loop by which instruments were simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    pub gains: Gains,
    pub reference: ReferenceSource,
    /// Share of the steps at which the simulation failed a joint.
    pub indefinite: f64,
}

impl Account {
    fn of(estimator: Estimator) -> Self {
        Account {
            estimator,
            law_refined: false,
            status: Status::Converged,
            iterations: 1,
            down_weighted: None,
            before: None,
            simulated: None,
        }
    }

    /// The field `estimator` of the document.
    pub fn json(&self, machine: &Machine) -> Value {
        let names = machine.robot.joint_names();
        let mut out = json!({
            "name": self.estimator.name(),
            "law_refined": self.law_refined,
            "status": self.status,
            "iterations": self.iterations,
        });
        if let Some(down) = &self.down_weighted {
            let of = |(joint, (scale, share)): (&String, &(f64, f64))| json!({ "joint": joint, "scale": scale, "down_weighted": share });
            out["joints"] = names.iter().zip(down).map(of).collect();
        }
        if let Some(simulated) = &self.simulated {
            out["reference"] = match simulated.reference {
                ReferenceSource::Logged => json!("logged"),
                ReferenceSource::Smoothed => json!("smoothed"),
            };
            out["loop_frequency"] = json!(simulated.gains.frequency);
            out["failed_steps_share"] = json!(simulated.indefinite);
            let gains = simulated
                .gains
                .proportional
                .iter()
                .zip(&simulated.gains.derivative);
            let of = |(joint, (k, d)): (&String, (&f64, &f64))| json!({ "joint": joint, "proportional": k, "derivative": d });
            out["joints"] = names.iter().zip(gains).map(of).collect();
        }
        if let Some(before) = &self.before {
            let of = |(joint, error): (&String, &f64)| json!({ "joint": joint, "relative_error_before": error });
            out["joints"] = names.iter().zip(before).map(of).collect();
        }
        out
    }

    /// The same for a person; nothing for least squares.
    pub fn text(&self, machine: &Machine) -> String {
        let names = machine.robot.joint_names();
        let ended = match self.status {
            Status::Converged => "converged",
            Status::IterationLimit => "stopped at the limit of iterations",
        };
        let mut out = String::new();
        if self.iterations > 1 {
            out += &format!(
                "{}: {ended} after {} passes over the logs\n",
                self.estimator.name(),
                self.iterations
            );
        }
        if let Some(down) = &self.down_weighted {
            let each: Vec<String> = names
                .iter()
                .zip(down)
                .map(|(joint, (_, share))| format!("{joint} {}", number::percent(*share)))
                .collect();
            out += &format!("rows of less than half weight: {}\n", each.join(", "));
        }
        if let Some(simulated) = &self.simulated {
            let each: Vec<String> = names
                .iter()
                .enumerate()
                .filter_map(|(j, joint)| {
                    let k = simulated.gains.proportional.get(j)?;
                    let d = simulated.gains.derivative.get(j)?;
                    Some(format!(
                        "{joint} {} and {}",
                        number::significant(*k, 3),
                        number::significant(*d, 3)
                    ))
                })
                .collect();
            out += &format!(
                "simulated in closed loop at {} rad/s, gains on position and velocity: {}\n",
                number::significant(simulated.gains.frequency, 3),
                each.join(", ")
            );
        }
        if let Some(before) = &self.before {
            let each: Vec<String> = names
                .iter()
                .zip(before)
                .map(|(joint, error)| format!("{joint} {}", number::percent(*error)))
                .collect();
            out += &format!("residual before the refinement: {}\n", each.join(", "));
        }
        out
    }
}

/// Readings of the same logs, one after the other.
pub struct Passes<'a> {
    machine: &'a Machine,
    logs: &'a [LogSpec],
    context: &'a Context,
    bar: Progress,
    pub inputs: Vec<Provenance>,
    pub warnings: Vec<String>,
    /// Of the first log, by the first reading.
    pub summary: Option<Summary>,
}

impl<'a> Passes<'a> {
    pub fn new(machine: &'a Machine, logs: &'a [LogSpec], context: &'a Context) -> Self {
        Passes {
            machine,
            logs,
            context,
            bar: context.progress("least squares", None),
            inputs: Vec::new(),
            warnings: Vec::new(),
            summary: None,
        }
    }

    fn read(
        &mut self,
        settings: &FilterSettings,
        columns: &RegressorColumns,
        mut weigher: Option<&mut Weigher>,
    ) -> Result<BlockFactors, CliError> {
        let first = self.summary.is_none();
        let mut total: Option<BlockFactors> = None;
        for spec in self.logs {
            let mut log = self.machine.open(spec, self.context)?;
            let (sums, summary) = accumulate_weighted(
                &self.machine.robot,
                columns,
                weigher.as_deref_mut(),
                settings,
                &mut |block| log.read(block),
            )
            .map_err(|e| run_error(spec, e))?;
            if first {
                self.warnings.extend(log.warnings());
                self.warnings.extend(summary_warnings(spec, &summary));
                self.inputs.push(log.provenance()?);
                self.summary.get_or_insert(summary);
            }
            match &mut total {
                None => total = Some(sums),
                Some(total) => total.merge(sums),
            }
            self.bar.advance(1);
        }
        total.ok_or_else(|| CliError::usage("no log is given"))
    }

    /// Rows with instruments from the loop under `theta`.
    fn read_instruments(
        &mut self,
        settings: &FilterSettings,
        columns: &RegressorColumns,
        theta: &DVector<f64>,
    ) -> Result<(BlockFactors, Simulated), CliError> {
        let step = self.summary.as_ref().map_or(1e-3, |s| s.dt);
        let mut total: Option<(BlockFactors, Simulated)> = None;
        for spec in self.logs {
            let mut log = self.machine.open(spec, self.context)?;
            let mut logged = self.machine.open_reference(spec)?;
            let reference = match logged {
                Some(_) => ReferenceSource::Logged,
                None => ReferenceSource::Smoothed,
            };
            let mut source = |block: &mut Block| {
                let more = log.read(block)?;
                if let Some(logged) = &mut logged {
                    logged.widen(block)?;
                }
                Ok(more)
            };
            let robot = &self.machine.robot;
            let read = instruments::accumulate(
                robot,
                columns,
                theta,
                reference,
                settings,
                step,
                &mut source,
            )
            .map_err(|e| run_error(spec, e))?;
            match &mut total {
                None => {
                    let simulated = Simulated {
                        gains: read.gains,
                        reference,
                        indefinite: read.indefinite,
                    };
                    total = Some((read.factors, simulated));
                }
                Some((sums, simulated)) => {
                    sums.merge(read.factors);
                    simulated.indefinite = simulated.indefinite.max(read.indefinite);
                }
            }
            self.bar.advance(1);
        }
        total.ok_or_else(|| CliError::usage("no log is given"))
    }

    /// Positions rounded anew on a shifted grid of the encoders.
    fn read_shifted(
        &mut self,
        settings: &FilterSettings,
        columns: &RegressorColumns,
        grid: u32,
        mut weigher: Option<&mut Weigher>,
    ) -> Result<Option<BlockFactors>, CliError> {
        let mut total: Option<BlockFactors> = None;
        for spec in self.logs {
            let mut log = self.machine.open(spec, self.context)?;
            let sums = accumulate_shifted(
                &self.machine.robot,
                columns,
                weigher.as_deref_mut(),
                settings,
                grid,
                &mut |block| log.read(block),
            )
            .map_err(|e| run_error(spec, e))?;
            match (&mut total, sums) {
                (Some(total), Some(sums)) => total.merge(sums),
                (none, sums) => *none = sums,
            }
            self.bar.advance(1);
        }
        Ok(total)
    }
}

/// A fit, the columns that its unknowns belong to, and how it came about.
pub struct Estimated {
    pub columns: RegressorColumns,
    pub fit: Fit,
    pub basis: Basis,
    pub account: Account,
}

/// The rows that the fit is about, reduced.
pub struct Basis {
    pub sums: BlockFactors,
    /// What their solution lacks to the fit's parameters: a law that they are linear about.
    pub shift: DVector<f64>,
}

/// What turns other readings of the logs into a fit of the same kind.
enum Solver {
    Linear(solve::Weighting),
    Robust(Box<Weigher>),
    Refined(Box<RefinedFit>),
    /// The fit, and the parameters that were simulated.
    Instrumental(Box<(Fit, DVector<f64>)>),
}

impl Solver {
    /// RegressorColumns of the rows.
    fn columns<'a>(&'a self, linear: &'a RegressorColumns) -> &'a RegressorColumns {
        match self {
            Solver::Refined(refined) => &refined.columns,
            _ => linear,
        }
    }

    fn weigher(&self) -> Option<Weigher> {
        match self {
            Solver::Robust(weigher) => Some(weigher.afresh()),
            _ => None,
        }
    }

    fn solve(&self, sums: BlockFactors, weigher: Option<&Weigher>) -> Result<Fit, FitError> {
        match self {
            Solver::Refined(refined) => refined.solve(sums),
            Solver::Robust(own) => weigher.unwrap_or(own).solve(&sums),
            Solver::Linear(estimator) => fit(&sums, *estimator),
            // rows without instruments: what moves the plain fit moves this one
            Solver::Instrumental(_) => fit(&sums, solve::Weighting::Wls),
        }
    }
}

/// Fits the unknowns of `columns`. With `law`, viscous and Coulomb terms only begin the law of
/// (18), which is then refined.
///
/// # Errors
/// Every [`CliError`] of logs that are read, and of a fit.
pub fn estimate(
    passes: &mut Passes,
    columns: RegressorColumns,
    estimator: Estimator,
    law: bool,
) -> Result<Estimated, CliError> {
    let settings = passes.machine.settings();
    let mut account = Account::of(estimator);
    let (mut fit, sums, solver) = match estimator {
        Estimator::Oe | Estimator::Wls if law || estimator == Estimator::Oe => {
            passes.bar.label("friction law");
            let mut pass = |columns: &RegressorColumns| passes.read(&settings, columns, None);
            let start = match law {
                true => refine::begin(&columns, &mut pass)?,
                false => columns.clone(),
            };
            let refined = refine::refine(start, &mut pass)?;
            account.law_refined = refined.columns.known.iter().any(Option::is_some);
            account.status = refined.status;
            account.iterations = refined.iterations;
            account.before = Some(refined.before.clone());
            let sums = refined.factors.in_one_block();
            (
                refined.fit.clone(),
                sums,
                Solver::Refined(Box::new(refined)),
            )
        }
        Estimator::Irls => {
            passes.bar.label("robust regression");
            let Robust {
                fit,
                factors: sums,
                weigher,
                status,
                iterations,
                scale,
                down_weighted,
            } = robust::irls(&mut |weigher| passes.read(&settings, &columns, weigher))?;
            account.status = status;
            account.iterations = iterations;
            account.down_weighted = Some(scale.into_iter().zip(down_weighted).collect());
            (fit, sums.in_one_block(), Solver::Robust(Box::new(weigher)))
        }
        Estimator::Iv => {
            passes.bar.label("instrumental variables");
            let sums = passes.read(&settings, &columns, None)?;
            let plain = fit(&sums, solve::Weighting::Wls)?;
            let map = passes.machine.robot.standard_map();
            let whole = solve::factor(&sums, &solve::weights_of(&sums, &plain.residual_std))?;
            let effective = plain.effective_rows / plain.rows as f64;
            let mut simulate_by = plain.theta.clone();
            let Instrumental {
                fit,
                status,
                iterations,
            } = instruments::iterate(&columns, &plain, &mut |theta| {
                simulate_by = nearest(&map, &whole, effective, theta)?;
                let (sums, simulated) =
                    passes.read_instruments(&settings, &columns, &simulate_by)?;
                account.simulated = Some(simulated);
                Ok::<_, CliError>(sums)
            })?;
            account.status = status;
            account.iterations = iterations;
            let solver = Solver::Instrumental(Box::new((fit.clone(), simulate_by)));
            (fit, sums.in_one_block(), solver)
        }
        Estimator::Ols | Estimator::Wls | Estimator::Oe => {
            let estimator = match estimator {
                Estimator::Ols => solve::Weighting::Ols,
                _ => solve::Weighting::Wls,
            };
            let sums = passes.read(&settings, &columns, None)?;
            let found = fit(&sums, estimator)?;
            (found, sums.in_one_block(), Solver::Linear(estimator))
        }
    };
    // once more with a narrower position filter: what that moves is part of the uncertainty
    passes.bar.label("uncertainty");
    let read = solver.columns(&columns);
    let dt = passes.summary.as_ref().map_or(1e-3, |s| s.dt);
    let narrow = narrowed(&settings, 1.0 / dt);
    let mut weigher = solver.weigher();
    let again = match &solver {
        Solver::Instrumental(found) => {
            let (found, simulated) = &**found;
            let (sums, _) = passes.read_instruments(&narrow, read, simulated)?;
            instruments::again(read, found, &sums)?
        }
        _ => {
            let sums = passes.read(&narrow, read, weigher.as_mut())?;
            solver.solve(sums, weigher.as_ref())?
        }
    };
    add_processing(&mut fit, &again);
    if passes
        .machine
        .robot
        .transmission()
        .encoder_steps()
        .is_some()
    {
        let mut shifted = Vec::new();
        for grid in 0..GRIDS {
            let mut weigher = solver.weigher();
            if let Some(sums) = passes.read_shifted(&settings, read, grid, weigher.as_mut())? {
                shifted.push(solver.solve(sums, weigher.as_ref())?);
            }
        }
        add_scatter(&mut fit, &shifted);
    }
    let (columns, shift) = match &solver {
        Solver::Refined(refined) => (refined.columns.with_free_friction(), refined.shift()),
        _ => (columns, DVector::zeros(fit.theta.len())),
    };
    Ok(Estimated {
        columns,
        fit,
        basis: Basis { sums, shift },
        account,
    })
}
