//! The numbers of a model that a fit moves, as one vector.

use nalgebra::DMatrix;

use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::math::rank_revealing::RankRevealingInverse;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_core::robot::model::JointFriction;

/// A difference of a number makes this share of the torque's rms.
const STEP_TORQUE_SHARE: f64 = 1e-3;
/// Samples along which columns of torque are looked at.
const MAX_SAMPLES: usize = 4000;

/// Inertial parameters, viscous and Coulomb friction, offsets, then shape and coefficients of each effect.
pub(super) fn numbers(model: &AugmentedModel) -> Vec<f64> {
    let mut x = model.model.theta.clone();
    for law in &model.model.friction {
        if let JointFriction::ViscousCoulomb(law) = law {
            x.extend([law.viscous, law.coulomb]);
        }
    }
    x.extend(&model.model.offset);
    for effect in &model.effects {
        x.extend(effect.shape.iter().chain(&effect.linear));
    }
    x
}

/// The model with other [`numbers`].
pub(super) fn with_numbers(model: &AugmentedModel, x: &[f64]) -> AugmentedModel {
    let mut model = model.clone();
    let mut next = x.iter().copied();
    let mut fill = |out: &mut [f64]| out.iter_mut().zip(&mut next).for_each(|(o, x)| *o = x);
    fill(&mut model.model.theta);
    for law in &mut model.model.friction {
        if let JointFriction::ViscousCoulomb(law) = law {
            let mut of_law = [0.0; 2];
            fill(&mut of_law);
            let [viscous, coulomb] = of_law;
            *law = ViscousCoulomb { viscous, coulomb };
        }
    }
    fill(&mut model.model.offset);
    for effect in &mut model.effects {
        fill(&mut effect.shape);
        fill(&mut effect.linear);
    }
    model
}

/// What the torques along measured motion say of each number.
pub(super) struct Columns {
    /// Which numbers a fit may move: none whose torque those before it make as well.
    pub free: Vec<usize>,
    /// Difference of each number that makes a small part of the torque.
    pub steps: Vec<f64>,
    /// Share of the torque's square that is left when all free numbers are fitted to it.
    pub left: f64,
}

/// Looks at the torque that each number makes along stretches of one axis; `held` are numbers not to be moved.
pub(super) fn columns(model: &AugmentedModel, stretches: &[Stretch], held: &[bool]) -> Columns {
    let x = numbers(model);
    let total: usize = stretches.iter().map(Stretch::len).sum();
    let every = total.div_ceil(MAX_SAMPLES).max(1);
    let along = |x: &[f64]| -> Vec<f64> {
        let model = with_numbers(model, x);
        let torques = stretches.iter().map(|s| model.torques(s).hat);
        let kept =
            torques.flat_map(|hat| hat[0].iter().copied().step_by(every).collect::<Vec<_>>());
        kept.collect()
    };
    let measured = stretches
        .iter()
        .flat_map(|s| s.tau[0].iter().copied().step_by(every));
    let at = along(&x);
    let residual = measured.clone().zip(&at).map(|(tau, hat)| tau - hat);
    let residual: Vec<f64> = residual.collect();
    let power: f64 = measured.map(|tau| tau * tau).sum();
    let mut steps = vec![0.0; x.len()];
    let mut table = DMatrix::zeros(at.len(), x.len() + 1);
    for i in 0..x.len() {
        let difference = 1e-4 * x[i].abs().max(1e-2);
        let mut beside = x.clone();
        beside[i] += difference;
        let column = along(&beside).into_iter().zip(&at);
        let column: Vec<f64> = column.map(|(b, a)| (b - a) / difference).collect();
        let own: f64 = column.iter().map(|c| c * c).sum();
        if own > 0.0 && !held[i] {
            steps[i] = STEP_TORQUE_SHARE * (power / own).sqrt();
            table.column_mut(i).copy_from_slice(&column);
        }
    }
    table.column_mut(x.len()).copy_from_slice(&residual);
    let normal = table.tr_mul(&table);
    let inverse = RankRevealingInverse::of(&normal.view((0, 0), (x.len(), x.len())).into_owned());
    let target = normal.column(x.len()).rows(0, x.len()).into_owned();
    let explained = target.dot(&inverse.solve(&target));
    Columns {
        free: (0..x.len())
            .filter(|i| steps[*i] > 0.0 && !inverse.redundant(*i))
            .collect(),
        steps,
        left: (normal[(x.len(), x.len())] - explained) / power,
    }
}
