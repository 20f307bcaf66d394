//! Parts of the logs in which something acts on the arm that is no body on its last link: somebody leans on it.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::carried::{DividedRows, carried_spans};
use super::payload_result::{CarriedSpan, TouchedSpan};
use super::payload_rows::{LEFT, LoadParts, OWN, Rows, places, rows};
use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::in_memory::InMemory;
use crate::input::robot_setup::RobotSetup;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::judge::{GroupError, kept_groups};
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_core::verdict::TorqueOff;
use cft_ident_files::config::held_out::HeldOut;

/// Part of a column's square that is added to its diagonal.
const RIDGE: f64 = 1e-9;

/// The rows in which a body is looked for, and the parts of the logs in which it acts, or something else does.
pub(super) struct LoadRows {
    pub rows: Rows,
    pub carried: Vec<CarriedSpan>,
    pub touched: Vec<TouchedSpan>,
    /// The rows with those that are touched; none where there are none.
    pub with_touched: Option<Rows>,
}

/// Filters the rows of logs, and finds out when the body acts and which parts are to be left out: what is off by more than
/// the model's band, which `held_out` data gave.
pub(super) fn rows_of_load(
    setup: &RobotSetup,
    (model, held_out): (&AugmentedModel, &[HeldOut]),
    whole: &InMemory,
    (name, logs): (&str, &[String]),
    control: &Control,
) -> Result<LoadRows, IdentifyError> {
    let of = |carried: &[CarriedSpan], touched: &[TouchedSpan]| {
        let parts = LoadParts {
            carried,
            touched,
            smear_s: setup.settings().cutoff_hz.recip(),
        };
        rows(setup, model, whole, name, parts, control)
    };
    let touched_in = |rows: &Rows| {
        let mut spans = touched_spans(rows, logs, setup);
        spans.retain(|span| is_beyond_band(span, held_out));
        spans
    };
    let plain = of(&[], &[])?;
    let mut carried = carried_spans(&plain, logs);
    let mut touched = touched_in(&plain);
    let mut all = plain;
    if !carried.is_empty() {
        all = of(&carried, &[])?;
        let beside = touched_in(&all);
        if touched.is_empty() || beside.is_empty() {
            // a body that comes and goes explains what looks like a touch
            touched = beside;
        } else {
            // no body explains it, and a load that comes and goes is looked for without it
            carried = carried_spans(&of(&[], &touched)?, logs);
            all = of(&carried, &[])?;
        }
    }
    if touched.is_empty() {
        return Ok(LoadRows {
            rows: all,
            carried,
            touched,
            with_touched: None,
        });
    }
    Ok(LoadRows {
        rows: of(&carried, &touched)?,
        carried,
        touched,
        with_touched: Some(all),
    })
}

/// Whether a joint's torque is off by more than the model's 95 % band is wide anywhere: what the model lacks is no touch.
fn is_beyond_band(span: &TouchedSpan, held_out: &[HeldOut]) -> bool {
    let is_off = |off: &TorqueOff| {
        let of_joint = held_out.iter().find(|held| held.joint == off.joint)?;
        let widths = of_joint.half_width_95.iter().flatten();
        Some(off.off > widths.copied().fold(0.0, f64::max))
    };
    span.off.iter().any(|off| is_off(off).unwrap_or(false))
}

/// Sums of the rows of each unit, joint by joint: entries of the body, friction and offset, and what the model leaves.
struct UnitSums {
    joints: usize,
    of: Vec<Vec<JointSums>>,
    /// Weight of each joint: one over the deviation that is left of it.
    weights: Vec<f64>,
}

#[derive(Clone)]
struct JointSums {
    products: DMatrix<f64>,
    rows: f64,
}

impl UnitSums {
    fn new(rows: &Rows, divided: &DividedRows) -> Self {
        let joints = rows.joints.len();
        let none = JointSums {
            products: DMatrix::zeros(OWN + 1, OWN + 1),
            rows: 0.0,
        };
        let mut of = vec![vec![none; joints]; divided.units.len()];
        for (j, rows) in rows.joints.iter().enumerate() {
            for row in rows {
                let sums = &mut of[divided.of_block[row.block]][j];
                let x =
                    DVector::from_fn(OWN + 1, |c, _| row.numbers[if c < OWN { c } else { LEFT }]);
                sums.products.ger(1.0, &x, &x, 1.0);
                sums.rows += 1.0;
            }
        }
        let mut sums = Self {
            joints,
            of,
            weights: vec![1.0; joints],
        };
        // by what the model leaves, then by what a body that acts throughout leaves
        for _ in 0..2 {
            let kept = vec![true; sums.of.len()];
            let theta = sums.fitted(&kept).unwrap_or_default();
            let weight = |j: usize| {
                let each = sums.of.iter().map(|unit| sums.error(&unit[j], j, &theta));
                let (square, rows) = each.fold((0.0, 0.0), |(square, rows), error| {
                    (square + error.square, rows + error.expected)
                });
                (rows / square.max(f64::MIN_POSITIVE)).sqrt()
            };
            sums.weights = (0..joints).map(weight).collect();
        }
        sums
    }

    /// The body, and friction and offset of the joints, by the units that are kept; none where these do not suffice.
    fn fitted(&self, kept: &[bool]) -> Option<Vec<f64>> {
        let u = STANDARD + 3 * self.joints;
        let mut normal = DMatrix::<f64>::zeros(u, u);
        let mut right = DVector::<f64>::zeros(u);
        let units = self.of.iter().zip(kept).filter(|(_, kept)| **kept);
        for (j, sums) in units.flat_map(|(unit, _)| unit.iter().enumerate()) {
            let square = self.weights[j] * self.weights[j];
            let places = places(j, self.joints, false);
            for (a, to) in places.iter().enumerate() {
                for (b, beside) in places.iter().enumerate() {
                    normal[(*to, *beside)] += square * sums.products[(a, b)];
                }
                right[*to] += square * sums.products[(a, OWN)];
            }
        }
        for i in 0..u {
            // directions that no motion excites stay 0
            let own = normal[(i, i)];
            normal[(i, i)] = if own > 0.0 { own * (1.0 + RIDGE) } else { 1.0 };
        }
        let factor = Cholesky::new(normal)?;
        Some(factor.solve(&right).iter().copied().collect())
    }

    /// What a fit leaves of a joint in a unit.
    fn error(&self, sums: &JointSums, j: usize, theta: &[f64]) -> GroupError {
        let own = places(j, self.joints, false).into_iter();
        let own = own.map(|at| theta.get(at).copied().unwrap_or_default());
        let x = DVector::from_iterator(OWN + 1, own.chain([-1.0]));
        GroupError {
            square: (x.transpose() * &sums.products * &x)[(0, 0)].max(0.0),
            expected: sums.rows,
        }
    }

    /// What the fit to the units that are kept leaves of each unit, joint by joint.
    fn left_by(&self, kept: &[bool]) -> Option<Vec<Vec<GroupError>>> {
        let theta = self.fitted(kept)?;
        let joint = |(j, sums): (usize, &JointSums)| self.error(sums, j, &theta);
        let unit = |unit: &Vec<JointSums>| unit.iter().enumerate().map(joint).collect();
        Some(self.of.iter().map(unit).collect())
    }
}

/// The parts in which a body that acts in all rows leaves far more of a joint than elsewhere; none where that is more than
/// a fifth of the time, and where it is as much everywhere.
fn touched_spans(rows: &Rows, names: &[String], setup: &RobotSetup) -> Vec<TouchedSpan> {
    let divided = DividedRows::new(rows);
    let sums = UnitSums::new(rows, &divided);
    let units = &divided.units;
    let kept = kept_groups(units.len(), |kept| sums.left_by(kept));
    let Some((kept, errors)) = kept.and_then(|kept| sums.left_by(&kept).map(|e| (kept, e))) else {
        return Vec::new();
    };
    let mut out: Vec<TouchedSpan> = Vec::new();
    let mut k = 0;
    while k < units.len() {
        let goes_on = |to: usize| !kept[to] && units[to].log == units[k].log;
        let end = (k..units.len()).find(|to| !goes_on(*to));
        let end = end.unwrap_or(units.len());
        if end > k {
            out.push(TouchedSpan {
                log: names.get(units[k].log).cloned().unwrap_or_default(),
                from_s: units[k].begin,
                to_s: units[end - 1].end,
                off: torques_off(&errors[k..end], setup),
                place: units[k].log,
            });
        }
        k = end.max(k + 1);
    }
    out
}

/// Root mean square of what is left of each joint in a run of units.
fn torques_off(errors: &[Vec<GroupError>], setup: &RobotSetup) -> Vec<TorqueOff> {
    let of_joint = |(j, joint): (usize, &String)| {
        let sum =
            |of: &dyn Fn(&GroupError) -> f64| errors.iter().map(|unit| of(&unit[j])).sum::<f64>();
        TorqueOff {
            joint: joint.clone(),
            off: (sum(&|of| of.square) / sum(&|of| of.expected).max(1.0)).sqrt(),
            unit: setup.file.torque_unit(j).to_owned(),
        }
    };
    let names = setup.robot.joint_names().iter().enumerate();
    names.map(of_joint).collect()
}
