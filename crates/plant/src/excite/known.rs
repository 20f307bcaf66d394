//! What an identified model knows of the unknowns of a design, and which of them are still weak.

use nalgebra::DMatrix;

use cft_ident_core::math::covariance::information_rows;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;

use super::ExciteError;
use super::foresee::inverse;
use super::information::InformationFactors;
use super::machine::ForeseenRobot;

/// What is known from the logs of a model.
#[derive(Debug, Clone)]
pub struct InformationBefore {
    /// Inverse covariance of the unknowns (p x p); 0 of what the model knows no deviation of.
    pub information: DMatrix<f64>,
    /// Variance of each unknown.
    variances: Vec<Option<f64>>,
    /// Unknowns that are not identified.
    pub weak: Vec<usize>,
}

impl InformationBefore {
    /// Of the unknowns of a design.
    pub fn of(machine: &ForeseenRobot, file: &ModelFile) -> Self {
        let names = machine.unknown_names();
        let p = names.len();
        let covariance = file.estimated_covariance_of(&names);
        let found = |name: &String| file.parameters.iter().find(|q| q.key() == *name);
        let open =
            |q: &Parameter| matches!(q.verdict, Some(Verdict::Weak | Verdict::NotIdentifiable));
        let rows = information_rows(&covariance, p);
        let weak = names.iter().enumerate();
        let weak = weak.filter(|(_, name)| found(name).is_some_and(open));
        let variance = |i: usize| Some(covariance[i * p + i]).filter(|x| *x > 0.0);
        InformationBefore {
            weak: weak.map(|(i, _)| i).collect(),
            information: rows.tr_mul(&rows),
            variances: (0..p).map(variance).collect(),
        }
    }

    /// Factors of the variances of weak unknowns by which each counts as the share of its variance that a motion
    /// leaves; an unknown without one counts against what a usual motion, `usual` of so many rows, would leave.
    ///
    /// # Errors
    /// [`ExciteError`] where a number is not finite.
    pub fn factors(
        &self,
        machine: &ForeseenRobot,
        (usual, rows): (&InformationFactors, f64),
    ) -> Result<Vec<f64>, ExciteError> {
        let r = usual.stacked(&machine.weights());
        let g = r.tr_mul(&r) * (rows / usual.rows as f64) + &self.information;
        let (after, _) = inverse(&g)?;
        let mut factors = vec![0.0; self.variances.len()];
        for i in &self.weak {
            let variance = self.variances[*i].unwrap_or(after[(*i, *i)]);
            if variance > 0.0 {
                factors[*i] = 1.0 / variance;
            }
        }
        Ok(factors)
    }
}
