//! The loop: fit what is declared, one pass over the rows with every candidate, choose, ask the parts, look at held-out
//! data.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidates::{Candidate, NotTried, candidates, is_friction_law};
use super::change::friction_changes;
use super::error::DiagnoseError;
use super::held_out::HeldOut;
use super::memory::memory_s;
use super::orders;
use super::outcome::{Diagnosis, FoundEffect, LeftCandidate, SplitErrors};
use super::problem::case::Case;
use super::problem::data_split::{DataSplit, LogRole, Piece};
use super::problem::fit::{Declared, Fitted, determines_some, fit};
use super::problem::pass::{Data, Layout, pass};
use super::problem::unknowns::{Unknowns, step};
use super::search::{Chosen, Field, Looked};
use super::steps::{Judged, judge};
use super::unexplained::dependence::{Left, dependences};
use super::unexplained::errors::{self, Counted, Errors};
use super::unexplained::{noise, part_unexplained, unexplained};
use super::watch::Watch;
use crate::effect::{Added, AugmentedModel, Cover, Search, Torques};
use crate::judge::{Block, BlockSums, Blocks, LeftOut, Numbers, Terms, compare, divide};
use crate::motion::{MotionError, Stretch};
use crate::robot::model::JointFriction;

/// Diagnoses; `watch` hears of every step and is asked now and then whether to stop.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(case: &Case, watch: Watch) -> Result<Diagnosis, DiagnoseError> {
    let robot = &case.given.model.robot;
    let split = DataSplit::of(
        robot,
        &case.stretches,
        &case.roles,
        &case.filters,
        case.cutoff_hz,
    );
    check(case, &split)?;
    let prepared = Prepared::of(case, &split)?;
    unless_stopped(watch)?;
    let searched = prepared.search(watch)?;
    unless_stopped(watch)?;
    let judged = judge(&prepared, &searched)?;
    unless_stopped(watch)?;
    prepared.evaluate(searched, judged)
}

fn unless_stopped(watch: Watch) -> Result<(), DiagnoseError> {
    match (watch.stop)() {
        true => Err(DiagnoseError::Interrupted),
        false => Ok(()),
    }
}

/// Refuses what cannot be fitted.
fn check(case: &Case, split: &DataSplit) -> Result<(), DiagnoseError> {
    let unknowns = Unknowns::of(&case.given, &case.open, case.keep).len();
    let rows = split.rows_of(LogRole::Train);
    if rows < 10 * unknowns {
        return Err(DiagnoseError::TooFewRows { rows, unknowns });
    }
    for (j, joint) in case.given.model.robot.joint_names().iter().enumerate() {
        let silent = |s: &Stretch| s.tau[j].iter().all(|x| *x == 0.0);
        if case.stretches.iter().all(silent) {
            return Err(DiagnoseError::NoTorque {
                joint: joint.clone(),
            });
        }
    }
    Ok(())
}

/// The declared model fitted, and the data divided.
pub struct Prepared<'a> {
    pub case: &'a Case,
    pub split: &'a DataSplit,
    pub data: Data<'a>,
    pub declared: Declared<'a>,
    pub unknowns: Unknowns,
    pub fitted: Fitted,
    pub cover: Cover,
    /// Blocks that are fitted.
    pub blocks: Blocks,
    /// These, then those that only judge.
    pub all_blocks: Vec<Block>,
    /// Neighbouring pieces of the split that a bootstrap draws together.
    pub together: usize,
}

/// What the search came to.
pub struct Searched {
    pub candidates: Vec<Candidate>,
    pub not_tried: Vec<NotTried>,
    pub layout: Layout,
    pub sums: BlockSums,
    pub chosen: Vec<Chosen>,
    pub looked: Vec<Looked>,
    /// Squared error of blocks left out by all that was chosen, in the weights of the joints.
    pub error: f64,
    /// Whether the declared model explains more of blocks left out than no torque does.
    pub determined: bool,
}

impl<'a> Prepared<'a> {
    fn of(case: &'a Case, split: &'a DataSplit) -> Result<Self, DiagnoseError> {
        let numbers = &case.numbers;
        let declared = Declared {
            open: &case.open,
            prior: &case.prior,
            keep: case.keep,
            ridge: numbers.ridge,
        };
        let data = Data {
            stretches: &case.stretches,
            filters: &case.filters,
            split,
            rest_speed: &case.rest_speed,
        };
        let logs = split.logs(&case.stretches, LogRole::Train);
        let whole = divide(&logs, f64::INFINITY, numbers).list;
        let fitted = fit(&case.given, declared, (&data, &whole), None)?;
        let train = case.stretches_of(LogRole::Train);
        let unknowns = Unknowns::of(&case.given, &case.open, case.keep);
        let mut cover = Cover::of(&case.given.model.robot, &train, case.cutoff_hz);
        let raw = residuals(&fitted.model, &train);
        orders::find(&mut cover, &raw, &train, &case.filters)?;
        drop(raw);
        let residual = filtered(&fitted.model, &data)?;
        let memory = memory_s(&residual, &logs, split);
        let reach = |s: &Stretch| case.filters.of(s).trim as f64 * s.dt;
        let reach = case.stretches.iter().map(reach).fold(0.0, f64::max);
        let least = (numbers.memory_times * memory).max(reach);
        let blocks = divide(&logs, least, numbers);
        let judging = divide(&split.logs(&case.stretches, LogRole::Veto), least, numbers);
        let all_blocks = [blocks.list.as_slice(), &judging.list].concat();
        let rows = |p: &Piece| p.rows.len() as f64 * split.step_s[p.stretch];
        let lengths: Vec<f64> = split.pieces.iter().map(rows).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        Ok(Prepared {
            together: (least / mean).ceil().max(1.0) as usize,
            case,
            split,
            data,
            declared,
            unknowns,
            fitted,
            cover,
            blocks,
            all_blocks,
        })
    }

    /// Blocks that only judge.
    pub fn judging(&self) -> usize {
        self.all_blocks.len() - self.blocks.list.len()
    }

    fn sums(
        &self,
        candidates: &[Candidate],
        layout: &Layout,
        model: &AugmentedModel,
    ) -> Result<BlockSums, MotionError> {
        let columns = (&self.unknowns, candidates);
        pass(model, columns, layout, &self.data, &self.all_blocks)
    }

    /// What is searched, by sums of products.
    pub fn field<'b>(
        &'b self,
        (candidates, layout): (&'b [Candidate], &'b Layout),
        sums: &'b BlockSums,
        watch: Watch<'b>,
    ) -> Field<'b> {
        Field {
            candidates,
            terms: &layout.candidates,
            sums,
            judging: self.judging(),
            numbers: &self.case.numbers,
            watch,
        }
    }

    /// The declared terms about the fitted model.
    pub fn terms(&self, layout: &Layout) -> Terms {
        let mut terms = (self.declared).terms(&self.unknowns, layout, &self.fitted.model);
        terms.weights.clone_from(&self.fitted.weights);
        terms
    }

    /// The friction law of every joint first, as the shape of what is declared; then all the rest.
    fn search(&self, watch: Watch) -> Result<Searched, DiagnoseError> {
        let (candidates, not_tried) = candidates(&self.fitted.model, self.case, &self.cover);
        let layout = Layout::of(&self.unknowns, &candidates);
        let mut model = self.fitted.model.clone();
        let mut sums = self.sums(&candidates, &layout, &model)?;
        let declared = self.terms(&layout);
        let nothing = DiagnoseError::NothingDetermined {
            unknowns: self.unknowns.len(),
        };
        if !determines_some(&sums, &declared) && !self.case.keep {
            return Err(nothing);
        }
        let numbers = &self.case.numbers;
        let parts = (&candidates[..], &layout);
        let Some(alone) = LeftOut::new(&sums, self.judging(), &declared) else {
            return Err(nothing);
        };
        let errors = alone.errors();
        let determined = compare(&torque_squares(&sums, &layout), &errors, &declared.weights)
            .is_beyond(numbers.screen, None);
        let mut chosen = Vec::new();
        let joints = self.case.given.model.robot.joints();
        let looked = match self.blocks.parts >= numbers.parts {
            false => Some(Vec::new()),
            true => self.field(parts, &sums, watch).search(
                &declared,
                &mut chosen,
                (&is_friction_law, joints),
            ),
        };
        if looked.is_none() {
            return Err(nothing);
        }
        // what goes by a joint's direction goes by its friction law
        let smooth = chosen.iter().map(|c| &candidates[c.candidate].0);
        let smooth: Vec<_> = smooth
            .filter(|e| e.law.direction.is_some())
            .cloned()
            .collect();
        if !smooth.is_empty() {
            model.effects.extend(smooth);
            sums = self.sums(&candidates, &layout, &model)?;
        }
        let others = |effect: &Added| !is_friction_law(effect);
        let looked = match self.blocks.parts >= numbers.parts {
            false => Some(Vec::new()),
            true => self.field(parts, &sums, watch).search(
                &declared,
                &mut chosen,
                (&others, numbers.effects),
            ),
        };
        let looked = looked.ok_or(nothing)?;
        let error = errors.iter().flat_map(|e| e.iter().zip(&declared.weights));
        Ok(Searched {
            error: error.map(|(e, w)| e * w).sum(),
            determined,
            candidates,
            not_tried,
            layout,
            sums,
            chosen,
            looked,
        })
    }

    /// The declared model fitted anew beside effects that are held.
    pub fn refit(&self, start: &AugmentedModel) -> Result<AugmentedModel, MotionError> {
        let data = (&self.data, self.blocks.list.as_slice());
        Ok(fit(start, self.declared, data, Some(&self.fitted.weights))?.model)
    }

    pub fn held_out(&self, role: LogRole) -> HeldOut<'_> {
        HeldOut {
            case: self.case,
            split: self.split,
            role,
            together: self.together,
        }
    }

    fn split_errors(&self, model: &AugmentedModel) -> Result<SplitErrors, DiagnoseError> {
        let train = self.held_out(LogRole::Train).errors(model)?;
        let holdout = self.held_out(LogRole::Holdout).errors(model)?;
        Ok(SplitErrors {
            train: train.ok_or(DiagnoseError::TooFewRows {
                rows: 0,
                unknowns: self.unknowns.len(),
            })?,
            holdout,
        })
    }

    fn moving(&self, model: &AugmentedModel, role: LogRole) -> Result<Option<Errors>, MotionError> {
        let case = self.case;
        let counted = match case.given.model.friction.iter().any(JointFriction::jumps) {
            true => Counted::Moving,
            false => Counted::All,
        };
        let pieces = errors::pieces(
            model,
            &case.stretches,
            (&case.filters, &case.rest_speed),
            self.split,
            (role, counted),
        )?;
        Ok(errors::summed(model, &case.units, (&pieces, self.together)))
    }

    fn evaluate(self, searched: Searched, judged: Judged) -> Result<Diagnosis, DiagnoseError> {
        let case = self.case;
        let before = self.split_errors(&case.given)?;
        let refitted = self.split_errors(&self.fitted.model)?.train;
        let after = self.split_errors(&judged.judge)?;
        let had_a_say = judged.steps.iter().any(FoundEffect::vetoed);
        let selected = match had_a_say {
            true => Some(self.split_errors(&judged.written)?),
            false => None,
        };
        // what is left is looked at with the numbers refitted: those that other logs gave are no missing physics
        let last = match judged.written.effects.len() > case.given.effects.len() {
            true => &judged.written,
            false => &self.fitted.model,
        };
        let floor_of = |role| -> Result<Option<Vec<f64>>, MotionError> {
            let own = case.stretches_of(role);
            match own.is_empty() {
                true => Ok(None),
                false => noise(&residuals(last, &own), case, &own).map(Some),
            }
        };
        let floor = floor_of(LogRole::Train)?.unwrap_or_default();
        let floor_unseen = floor_of(LogRole::Holdout)?;
        let found = self.moving(last, LogRole::Train)?;
        let given = self.moving(&case.given, LogRole::Train)?;
        let (found, given) = found
            .zip(given)
            .unwrap_or((refitted.clone(), refitted.clone()));
        let unseen = self.moving(last, LogRole::Holdout)?;
        let left = unexplained(&found, &floor, unseen.as_ref().zip(floor_unseen));
        let structured = left.iter().enumerate().filter(|(_, l)| l.is_structure());
        let structured: Vec<usize> = structured.map(|(j, _)| j).collect();
        let residual = filtered(last, &self.data)?;
        let torques: Vec<Torques> = case.stretches.par_iter().map(|s| last.torques(s)).collect();
        let left_of = Left {
            data: &self.data,
            residual: &residual,
            torques: &torques,
        };
        let numbers = &case.numbers;
        Ok(Diagnosis {
            dependence: dependences(&left_of, &structured, self.together),
            part_unexplained: part_unexplained(&floor, &given, &found),
            unexplained: left,
            changes: friction_changes(&self, &searched),
            candidates: left_candidates(&searched, numbers),
            determined: searched.determined,
            model: judged.written,
            estimates: judged.estimates,
            covariance: judged.covariance,
            steps: judged.steps,
            unknowns: self.unknowns.list.clone(),
            before,
            refitted,
            after,
            selected,
            set_aside: self.split.set_aside.clone(),
            residual_std: rms_of(&residual, self.split),
            fitted_logs: case.roles.iter().filter(|r| **r == LogRole::Train).count(),
            parts: self.blocks.parts,
            block_s: self.blocks.least_s,
            parts_needed: numbers.parts,
        })
    }
}

/// Squared torque of every block, `[block][joint]`.
fn torque_squares(sums: &BlockSums, layout: &Layout) -> Vec<Vec<f64>> {
    let of_block = |joints: &Vec<DMatrix<f64>>| {
        let each = joints.iter().enumerate();
        let square = |(j, s): (usize, &DMatrix<f64>)| s[(layout.torque(j), layout.torque(j))];
        each.map(square).collect()
    };
    sums.blocks.iter().map(of_block).collect()
}

/// Root mean square of each joint's residual over the fitted rows.
fn rms_of(residual: &[Vec<Vec<f64>>], split: &DataSplit) -> Vec<f64> {
    let joints = residual.first().map_or(0, Vec::len);
    let of_joint = |j: usize| {
        let train = split.pieces.iter().filter(|p| p.role == LogRole::Train);
        let own = train.filter(|p| !split.is_stationary(p.stretch, j));
        let rows = own.flat_map(|p| &residual[p.stretch][j][p.rows.clone()]);
        let (sum, count) = rows.fold((0.0, 0.0), |(s, n), e| (s + e * e, n + 1.0));
        (sum / f64::max(count, 1.0)).sqrt()
    };
    (0..joints).map(of_joint).collect()
}

/// Raw residuals along stretches, `[stretch][joint][sample]`.
fn residuals(model: &AugmentedModel, stretches: &[Stretch]) -> Vec<Vec<Vec<f64>>> {
    let of = |s: &Stretch| model.residual(s, &model.torques(s));
    stretches.par_iter().map(of).collect()
}

/// Filtered residuals along all stretches, `[stretch][joint][row]`.
fn filtered(model: &AugmentedModel, data: &Data) -> Result<Vec<Vec<Vec<f64>>>, MotionError> {
    let of = |stretch: &Stretch| {
        let raw = model.residual(stretch, &model.torques(stretch));
        let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
        data.filters.of(stretch).run(&channels)
    };
    data.stretches.par_iter().map(of).collect()
}

/// The best shape of every law and place that was not chosen, with why.
fn left_candidates(searched: &Searched, numbers: &Numbers) -> Vec<LeftCandidate> {
    let mut out: Vec<LeftCandidate> = Vec::new();
    let effect = |i: usize| &searched.candidates[i].0;
    let chosen: Vec<_> = searched
        .chosen
        .iter()
        .map(|c| effect(c.candidate))
        .collect();
    for l in &searched.looked {
        let own = effect(l.candidate);
        let score = l.gain.value / searched.error.max(f64::MIN_POSITIVE);
        let waves = own.law.entry.search == Search::Orders;
        let same = |c: &LeftCandidate| c.law.entry.name == own.name() && c.place == own.place;
        let known = chosen
            .iter()
            .any(|c| c.name() == own.name() && c.place == own.place);
        if known && !waves {
            continue;
        }
        let reason = match l.gain.value > 0.0 {
            false => "no gain on blocks left out".to_owned(),
            true => format!(
                "gain of {:.1} standard errors on blocks left out, {} are needed",
                l.gain.value / l.gain.se.max(f64::MIN_POSITIVE),
                numbers.screen
            ),
        };
        match out.iter_mut().find(|c| same(c)) {
            Some(best) if best.score.is_some_and(|s| s >= score) => {}
            Some(best) => {
                (best.effect, best.score, best.reason) = (Some(own.clone()), Some(score), reason)
            }
            None => out.push(LeftCandidate {
                law: own.law,
                place: own.place,
                effect: Some(own.clone()),
                score: Some(score),
                reason,
            }),
        }
    }
    let not_tried = searched.not_tried.iter();
    out.extend(not_tried.map(|n| LeftCandidate {
        law: n.law,
        place: n.place,
        effect: None,
        score: None,
        reason: n.lacking.clone(),
    }));
    out
}

/// A model about the fitted one, its unknowns moved.
pub fn moved(
    fitted: &AugmentedModel,
    unknowns: &Unknowns,
    values: &DVector<f64>,
) -> AugmentedModel {
    let mut model = fitted.clone();
    step(&mut model, unknowns, &values.as_slice()[..unknowns.len()]);
    model
}
