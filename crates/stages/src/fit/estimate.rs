//! The estimators of `lsq` on logs that are read once per pass.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::instrumental::{SimulatedLoop, fold_instruments};
use super::known_friction::{of_joint, of_refinement, with_friction};
use crate::input::error::IdentifyError;
use crate::input::lsq_rows::{LsqRows, PositionReading};
use crate::input::robot_setup::RobotSetup;
use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::add_processing;
use cft_ident_core::inertia::columns::{GRADIENT, KnownFriction, RegressorColumns};
use cft_ident_core::inertia::departure;
use cft_ident_core::inertia::encoder::{add_scatter, bias};
use cft_ident_core::inertia::feasible::nearest;
use cft_ident_core::inertia::instruments::{self, InstrumentalFit};
use cft_ident_core::inertia::late;
use cft_ident_core::inertia::law_start;
use cft_ident_core::inertia::left_out::FitParts;
use cft_ident_core::inertia::refine::{self, RefinedFit};
use cft_ident_core::inertia::robust::{self, RobustFit, RowWeigher};
use cft_ident_core::inertia::solution::FitError;
use cft_ident_core::inertia::solve::{self, Fit, fit};
use cft_ident_core::inertia::standstill;
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_files::config::campaign::EstimatorKind;

/// What an estimator says of its own work.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Account")]
pub struct EstimatorAccount {
    #[serde(rename = "name")]
    pub estimator: EstimatorKind,
    /// The estimator that was asked for cannot do without the refinement of the friction law.
    pub law_refined: bool,
    pub status: IterationEnding,
    /// Passes over the logs; 1 for least squares.
    pub iterations: usize,
    /// Joint by joint; nothing for least squares.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<JointAccount>,
    /// The loop that was simulated.
    #[serde(flatten)]
    pub simulated: Option<SimulatedLoop>,
}

/// The same of one joint, as far as the estimator has it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct JointAccount {
    pub joint: String,
    /// Scale of the residual [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Share of the rows of less than half weight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub down_weighted: Option<f64>,
    /// Gain on the position in the loop that was simulated [N/m or Nm/rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proportional: Option<f64>,
    /// Gain on the velocity [N s/m or Nm s/rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivative: Option<f64>,
    /// Relative residual before a refinement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_error_before: Option<f64>,
}

impl EstimatorAccount {
    fn of(estimator: EstimatorKind) -> Self {
        EstimatorAccount {
            estimator,
            law_refined: false,
            status: IterationEnding::Converged,
            iterations: 1,
            joints: Vec::new(),
            simulated: None,
        }
    }

    /// Says something of every joint.
    fn record(&mut self, setup: &RobotSetup, of: impl Fn(usize) -> JointAccount) {
        let names = setup.robot.joint_names().iter().enumerate();
        self.joints = names
            .map(|(j, joint)| JointAccount {
                joint: joint.clone(),
                ..of(j)
            })
            .collect();
    }
}

/// A fit, the columns that its unknowns belong to, and how it came about.
pub struct InertialEstimate {
    pub columns: RegressorColumns,
    pub fit: Fit,
    /// Covariance of the unknowns and of the known friction of each joint, in this order.
    pub covariance: DMatrix<f64>,
    /// Joints whose known friction the rows contradict, and which is no prior there.
    pub contradicted: Vec<usize>,
    /// What noise of the positions makes of the unknowns, where that is known.
    pub bias: Option<DVector<f64>>,
    pub basis: FitRows,
    pub account: EstimatorAccount,
}

/// The rows that the fit is about, reduced.
pub struct FitRows {
    pub sums: BlockFactors,
    /// The same in parts that can be left out; none where the fit is not linear in its rows.
    pub parts: FitParts,
    /// What their solution lacks to the fit's parameters: a law that they are linear about.
    pub shift: DVector<f64>,
    /// The same in one block a log.
    pub by_log: BlockFactors,
}

impl FitRows {
    /// Rows that no law shifts, of so many unknowns.
    fn in_one_block(sums: &BlockFactors, unknowns: usize) -> Self {
        FitRows {
            by_log: sums.in_logs(),
            sums: sums.in_one_block(),
            parts: FitParts::default(),
            shift: DVector::zeros(unknowns),
        }
    }
}

/// What turns other readings of the logs into a fit of the same kind.
enum Solver {
    Linear(solve::RowWeighting),
    Robust(Box<RowWeigher>),
    Refined(Box<RefinedFit>),
    /// The fit, and the parameters that were simulated.
    Instrumental(Box<(Fit, DVector<f64>)>),
}

impl Solver {
    /// Columns of the rows.
    fn columns<'a>(&'a self, linear: &'a RegressorColumns) -> &'a RegressorColumns {
        match self {
            Solver::Refined(refined) => &refined.columns,
            _ => linear,
        }
    }

    fn weigher(&self) -> Option<RowWeigher> {
        match self {
            Solver::Robust(weigher) => Some(weigher.afresh()),
            _ => None,
        }
    }

    fn solve(&self, sums: BlockFactors, weigher: Option<&RowWeigher>) -> Result<Fit, FitError> {
        match self {
            Solver::Refined(refined) => refined.solve(sums),
            Solver::Robust(own) => weigher.unwrap_or(own).solve(&sums),
            Solver::Linear(estimator) => fit(&sums, *estimator),
            // rows without instruments: what moves the plain fit moves this one
            Solver::Instrumental(_) => fit(&sums, solve::RowWeighting::Wls),
        }
    }
}

/// A fit before its uncertainty is widened, its rows, and what makes fits of the same kind of other readings.
type PlainEstimate = (Fit, FitRows, Solver);

/// Fits the unknowns of `columns`. With `law`, viscous and Coulomb terms only begin the law of
/// (18), which is then refined.
pub fn estimate(
    rows: &mut LsqRows,
    columns: RegressorColumns,
    estimator: EstimatorKind,
    law: bool,
) -> Result<InertialEstimate, IdentifyError> {
    let mut account = EstimatorAccount::of(estimator);
    let shown = &mut account;
    let moves = columns.known.iter().flatten().any(KnownFriction::moves);
    let holds = !moves && columns.known.iter().any(Option::is_some);
    let (mut columns, mut contradicted) = (columns, Vec::new());
    if moves && estimator != EstimatorKind::Oe {
        let found = with_known_friction(rows, columns, shown)?;
        if estimator == EstimatorKind::Wls {
            return Ok(InertialEstimate { account, ..found });
        }
        // rows weighted otherwise inform the inertias alone; the friction stays as it was refined
        (columns, contradicted) = (found.columns, found.contradicted);
    }
    let (mut fit, mut basis, solver) = match estimator {
        // nothing of a law that is held is left to search: its fit is linear
        EstimatorKind::Oe if holds => linear(rows, &columns, solve::RowWeighting::Wls)?,
        EstimatorKind::Oe => refined(rows, &columns, law, shown)?,
        EstimatorKind::Wls if law => refined(rows, &columns, law, shown)?,
        EstimatorKind::Irls => {
            first_reading(rows, &columns)?;
            robust_regression(rows, &columns, shown)?
        }
        EstimatorKind::Iv => {
            first_reading(rows, &columns)?;
            instrumental(rows, &columns, shown)?
        }
        EstimatorKind::Ols => linear(rows, &columns, solve::RowWeighting::Ols)?,
        EstimatorKind::Wls => linear(rows, &columns, solve::RowWeighting::Wls)?,
    };
    let bias = widen(rows, &columns, &solver, &mut fit)?;
    departure::widen_by_departure(&basis.sums, &mut fit);
    let columns = match &solver {
        Solver::Refined(refined) => {
            basis.shift = refined.shift();
            refined.columns.with_free_friction()
        }
        _ => columns,
    };
    Ok(InertialEstimate {
        covariance: with_friction(&columns, &fit),
        columns,
        fit,
        contradicted,
        bias,
        basis,
        account,
    })
}

/// Refines the known friction with the inertias, drawn to it by its covariance but where the rows contradict it; the fit
/// left is of the inertias.
fn with_known_friction(
    rows: &mut LsqRows,
    mut columns: RegressorColumns,
    account: &mut EstimatorAccount,
) -> Result<InertialEstimate, IdentifyError> {
    let mut refined = refinement(rows, columns.clone(), account)?;
    let contradicted = refined.contradicted(&columns)?;
    if !contradicted.is_empty() {
        for j in &contradicted {
            let (known, found) = (&mut columns.known[*j], &refined.columns.known[*j]);
            *known = found.clone().map(KnownFriction::doubted);
        }
        let first = account.clone();
        refined = refinement(rows, columns.clone(), account)?;
        account.iterations += first.iterations;
        account.joints = first.joints;
    }
    let (mut fit, sums) = refined.without_laws()?;
    let (laws, free) = (
        refined.columns.known.clone(),
        refined.columns.with_free_friction(),
    );
    let mut whole = refined.fit.clone();
    widen(
        rows,
        &columns,
        &Solver::Refined(Box::new(refined)),
        &mut whole,
    )?;
    let covariance = of_refinement(&columns, &free, &whole.covariance, &columns.known);
    let u = fit.theta.len();
    fit.covariance = covariance.view((0, 0), (u, u)).into_owned();
    let known = columns.known.iter_mut().flatten();
    for (place, (known, law)) in known.zip(laws.into_iter().flatten()).enumerate() {
        *known = KnownFriction {
            law: law.law,
            covariance: of_joint(&covariance, u + GRADIENT * place),
            held: [true; GRADIENT],
        };
    }
    Ok(InertialEstimate {
        columns,
        fit,
        covariance,
        contradicted,
        bias: None,
        basis: FitRows::in_one_block(&sums, u),
        account: account.clone(),
    })
}

/// Linear least squares, rows weighted or alike.
fn linear(
    rows: &mut LsqRows,
    columns: &RegressorColumns,
    estimator: solve::RowWeighting,
) -> Result<PlainEstimate, IdentifyError> {
    let sums = first_reading(rows, columns)?;
    let found = fit(&sums, estimator)?;
    let basis = FitRows {
        parts: sums.in_parts(),
        ..FitRows::in_one_block(&sums, found.theta.len())
    };
    Ok((found, basis, Solver::Linear(estimator)))
}

/// Rows as the robot file says, with samples at standstill where they count.
fn first_reading(
    rows: &mut LsqRows,
    columns: &RegressorColumns,
) -> Result<BlockFactors, IdentifyError> {
    let sums = rows.fold(PositionReading::Declared, columns, None)?;
    if !rows.weighs_rests {
        return Ok(sums);
    }
    let without = fit(&sums, solve::RowWeighting::Wls)?;
    let open = standstill::open_joints(columns, &without);
    if open.is_empty() || !rows.count_rests(&open) {
        return Ok(sums);
    }
    let all = rows.fold(PositionReading::Declared, columns, None)?;
    let with = fit(&all, solve::RowWeighting::Wls)?;
    let counted = standstill::counted(columns, open.clone(), [&without, &with]);
    rows.count_rests(&counted);
    match counted.len() {
        0 => Ok(sums),
        n if n == open.len() => Ok(all),
        _ => rows.fold(PositionReading::Declared, columns, None),
    }
}

/// The slopes of the friction law with all else.
fn refined(
    rows: &mut LsqRows,
    columns: &RegressorColumns,
    law: bool,
    account: &mut EstimatorAccount,
) -> Result<PlainEstimate, IdentifyError> {
    let start = match law {
        true => law_start::begin(columns, &mut |columns| {
            rows.fold(PositionReading::Declared, columns, None)
        })?,
        false => columns.clone(),
    };
    let refined = refinement(rows, start, account)?;
    let basis = FitRows::in_one_block(&refined.factors, refined.fit.theta.len());
    Ok((
        refined.fit.clone(),
        basis,
        Solver::Refined(Box::new(refined)),
    ))
}

/// The refinement from a law of every joint.
fn refinement(
    rows: &mut LsqRows,
    start: RegressorColumns,
    account: &mut EstimatorAccount,
) -> Result<RefinedFit, IdentifyError> {
    rows.work.doing("friction law");
    let refined = refine::refine(start, &mut |columns| {
        rows.fold(PositionReading::Declared, columns, None)
    })?;
    account.law_refined = refined.columns.known.iter().any(Option::is_some);
    account.status = refined.ending;
    account.iterations = refined.iterations;
    account.record(rows.setup, |j| JointAccount {
        relative_error_before: Some(refined.before[j].all),
        ..JointAccount::default()
    });
    Ok(refined)
}

/// Rows with large residuals count less.
fn robust_regression(
    rows: &mut LsqRows,
    columns: &RegressorColumns,
    account: &mut EstimatorAccount,
) -> Result<PlainEstimate, IdentifyError> {
    rows.work.doing("robust regression");
    let RobustFit {
        fit,
        factors: sums,
        weigher,
        ending: status,
        iterations,
        scale,
        down_weighted,
    } = robust::irls(&mut |weigher| rows.fold(PositionReading::Declared, columns, weigher))?;
    account.status = status;
    account.iterations = iterations;
    account.record(rows.setup, |j| JointAccount {
        scale: Some(scale[j]),
        down_weighted: Some(down_weighted[j]),
        ..JointAccount::default()
    });
    let basis = FitRows::in_one_block(&sums, fit.theta.len());
    Ok((fit, basis, Solver::Robust(Box::new(weigher))))
}

/// The regressor along simulated positions as instruments.
fn instrumental(
    rows: &mut LsqRows,
    columns: &RegressorColumns,
    account: &mut EstimatorAccount,
) -> Result<PlainEstimate, IdentifyError> {
    rows.work.doing("instrumental variables");
    let sums = rows.fold(PositionReading::Declared, columns, None)?;
    let plain = fit(&sums, solve::RowWeighting::Wls)?;
    let map = rows.setup.robot.standard_map();
    let whole = solve::factor(&sums, &solve::weights_of(&sums, &plain.residual_std))?;
    let effective = plain.effective_rows / plain.rows as f64;
    let mut simulate_by = plain.theta.clone();
    let InstrumentalFit {
        fit,
        ending: status,
        iterations,
    } = instruments::iterate(columns, &plain, &mut |theta| {
        simulate_by = nearest(&map, &whole, effective, theta)?;
        let (sums, simulated) =
            fold_instruments(rows, PositionReading::Declared, columns, &simulate_by)?;
        account.simulated = Some(simulated);
        Ok::<_, IdentifyError>(sums)
    })?;
    if let Some(SimulatedLoop { gains, .. }) = account.simulated.clone() {
        account.record(rows.setup, |j| JointAccount {
            proportional: gains.proportional.get(j).copied(),
            derivative: gains.derivative.get(j).copied(),
            ..JointAccount::default()
        });
    }
    account.status = status;
    account.iterations = iterations;
    let solver = Solver::Instrumental(Box::new((fit.clone(), simulate_by)));
    let basis = FitRows::in_one_block(&sums, fit.theta.len());
    Ok((fit, basis, solver))
}

/// Adds to the uncertainty of a fit what a narrower position filter and the encoders' grid move; and what noise of the
/// positions makes of it, where that is known.
fn widen(
    rows: &mut LsqRows,
    columns: &RegressorColumns,
    solver: &Solver,
    fit: &mut Fit,
) -> Result<Option<DVector<f64>>, IdentifyError> {
    rows.work.doing("uncertainty");
    let read = solver.columns(columns);
    let mut weigher = solver.weigher();
    let again = match solver {
        Solver::Instrumental(found) => {
            let (found, simulated) = &**found;
            let (sums, _) = fold_instruments(rows, PositionReading::Narrower, read, simulated)?;
            instruments::again(read, found, &sums)?
        }
        Solver::Linear(_) if rows.have_torque_rates() => {
            let rates = read.with_torque_rates();
            let sums = rows.fold(PositionReading::Narrower, &rates, None)?;
            late::widen_by_delay(&sums, rows.shortest_step(), fit);
            solver.solve(late::without_rates(&sums), None)?
        }
        _ => {
            let sums = rows.fold(PositionReading::Narrower, read, weigher.as_mut())?;
            solver.solve(sums, weigher.as_ref())?
        }
    };
    add_processing(fit, &again);
    let grids = rows.setup.robot.transmission().encoder_steps();
    let wls = matches!(solver, Solver::Linear(solve::RowWeighting::Wls));
    if grids.is_none() && !wls {
        return Ok(None);
    }
    let mut again = Vec::new();
    for grid in 0..rows.readings_again() {
        let mut weigher = solver.weigher();
        if let Some(sums) = rows.fold_again(grid, read, weigher.as_mut())? {
            again.push(solver.solve(sums, weigher.as_ref())?);
        }
    }
    if grids.is_none() {
        return Ok(bias(fit, &again));
    }
    add_scatter(fit, &again);
    Ok(None)
}
