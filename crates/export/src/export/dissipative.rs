//! Friction as simulators take it: coefficients that are not below zero, and what that leaves out.
//!
//! A coefficient of a fitted law may be negative where its terms together take power over the speeds of
//! the logs; damping below zero alone drives a simulated joint away, and formats do not allow it.

use nalgebra::{DMatrix, DVector};

use super::error::ExportError;
use cft_ident_core::effect::as_code::EffectsCode;
use cft_ident_core::effect::{AugmentedModel, EffectScene, StretchTorques};
use cft_ident_core::motion::Stretch;
use cft_ident_core::number;
use cft_ident_core::robot::friction::{ViscousCoulomb, sign};
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_files::config::ModelFile;

/// Viscous friction and its level while the joint moves fast \[N s/m or Nm s/rad, N or Nm\].
pub(super) fn damping_and_friction(law: &JointFriction) -> [f64; 2] {
    match law {
        JointFriction::None => [0.0; 2],
        JointFriction::ViscousCoulomb(law) => [law.viscous, law.coulomb],
        JointFriction::DoubleTanh(law) => [law.viscous, law.coulomb_1 + law.coulomb_2],
    }
}

/// The curves of the speed that files of links have words for: viscous and Coulomb friction, and of MuJoCo alone damping by the
/// speed times its size and by its cube.
pub(super) const CURVES: [fn(f64) -> f64; 4] = [|v| v, sign, |v| v * v.abs(), |v| v * v * v];

/// Speeds of joint `j` along a motion; evenly up to that which its fit has `seen` where there is no motion.
pub(super) fn speeds(j: usize, along: &[Stretch], seen: Option<f64>) -> Vec<f64> {
    let speeds = along.iter().flat_map(|s| s.v[j].iter().copied());
    let speeds: Vec<f64> = speeds.collect();
    match seen.filter(|top| speeds.is_empty() && top.is_finite()) {
        Some(top) => (1..=STEPS)
            .map(|k| top * f64::from(k) / f64::from(STEPS))
            .collect(),
        None => speeds,
    }
}

/// Speeds at which a law is looked at where no motion says which.
const STEPS: u32 = 100;

/// Sizes of `curves`, none below zero, whose sum is nearest to the friction at these speeds; none where they do not tell.
pub(super) fn nearest_sizes(
    friction: &[f64],
    curves: &[fn(f64) -> f64],
    speeds: &[f64],
) -> Option<Vec<f64>> {
    let n = curves.len();
    let (mut square, mut with) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for (v, friction) in speeds.iter().zip(friction) {
        let row = DVector::from_iterator(n, curves.iter().map(|curve| curve(*v)));
        square += &row * row.transpose();
        with += row * *friction;
    }
    // of few curves each subset is tried: the best of those whose sizes are not below zero is the nearest
    let subsets = (1..1_usize << n).map(|bits| (0..n).filter(|k| bits >> k & 1 == 1).collect());
    let solved = subsets.filter_map(|some: Vec<usize>| {
        let part = square.select_rows(&some).select_columns(&some);
        let right = with.select_rows(&some);
        let sizes = part.cholesky()?.solve(&right);
        let explained = sizes.dot(&right);
        let mut all = vec![0.0; n];
        some.iter()
            .zip(&sizes)
            .for_each(|(k, size)| all[*k] = *size);
        let allowed = sizes.iter().all(|size| *size >= 0.0 && size.is_finite());
        allowed.then_some((explained, all))
    });
    let best = solved.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.map(|(_, sizes)| sizes)
}

/// Speeds at which friction is looked at: so many in each decade of these \[m/s or rad/s\].
const PER_DECADE: i32 = 20;
const DECADES: [i32; 2] = [-6, 2];

/// Friction of each joint at its speeds `v`, with its effects among those of a speed alone (`of_friction`).
pub(super) fn friction_at(
    refined: &AugmentedModel,
    of_friction: &[usize],
    v: Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    let law = |(law, speeds): (&JointFriction, &Vec<f64>)| -> Vec<f64> {
        speeds.iter().map(|v| law.torque(*v)).collect()
    };
    let laws = &refined.model.friction;
    if of_friction.is_empty() {
        return laws.iter().zip(&v).map(law).collect();
    }
    let rows = v.first().map_or(0, Vec::len);
    let rest = || vec![vec![0.0; rows]; v.len()];
    let along = Stretch {
        dt: 1.0,
        t: (0..rows).map(|k| k as f64).collect(),
        q: rest(),
        a: rest(),
        tau: rest(),
        v,
        ..Stretch::default()
    };
    let torques = refined.torques(&along);
    let scene = scene(&refined.model, &along, &torques);
    let mut of_effect = vec![0.0; rows];
    let each = laws.iter().zip(&along.v).map(law).enumerate();
    each.map(|(j, mut friction)| {
        for effect in of_friction.iter().filter_map(|i| refined.effects.get(*i)) {
            effect.torque(&scene, j, &mut of_effect);
            for (sum, x) in friction.iter_mut().zip(&of_effect) {
                *sum += x;
            }
        }
        friction
    })
    .collect()
}

/// What effects see of a model along a stretch.
pub(super) fn scene<'a>(
    model: &'a Model,
    stretch: &'a Stretch,
    torques: &'a StretchTorques,
) -> EffectScene<'a> {
    EffectScene {
        robot: &model.robot,
        theta: &model.theta,
        laws: &model.friction,
        stretch,
        hat: &torques.hat,
        load: &torques.load,
        direction: &torques.direction,
        tilt: Some(&torques.tilt),
    }
}

/// Friction of each joint as exported code has it: the law with the effects of the speed alone, and none where it would
/// drive.
#[derive(Debug, Clone)]
pub struct DissipativeFriction {
    of_friction: Vec<usize>,
    /// Joints whose friction would drive at some speed.
    drives: Vec<bool>,
}

impl DissipativeFriction {
    /// That of a model.
    ///
    /// # Errors
    /// An effect that has no code.
    pub fn new(refined: &AugmentedModel) -> Result<Self, ExportError> {
        let of_friction = EffectsCode::of(refined)?.of_friction;
        let drives = driving(refined, &of_friction);
        Ok(Self {
            drives: drives.iter().map(Option::is_some).collect(),
            of_friction,
        })
    }

    /// Friction of that model at speeds `v` \[N or Nm\], both `[joint][row]`.
    pub fn torques(&self, refined: &AugmentedModel, v: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let mut out = friction_at(refined, &self.of_friction, v.clone());
        for ((friction, v), _) in (out.iter_mut().zip(&v).zip(&self.drives)).filter(|x| *x.1) {
            for (x, v) in friction.iter_mut().zip(v) {
                *x = if *x * v > 0.0 { *x } else { 0.0 };
            }
        }
        out
    }
}

/// Speeds from and to which the friction of each joint drives it, its effects among those of a speed alone included.
pub(super) fn driving(refined: &AugmentedModel, of_friction: &[usize]) -> Vec<Option<[f64; 2]>> {
    let [first, last] = DECADES.map(|decade| decade * PER_DECADE);
    let speeds = (first..=last).map(|k| 10f64.powf(f64::from(k) / f64::from(PER_DECADE)));
    let speeds: Vec<f64> = speeds.flat_map(|v| [v, -v]).collect();
    let all = vec![speeds.clone(); refined.model.robot.joints()];
    let each = friction_at(refined, of_friction, all).into_iter();
    each.map(|friction| {
        // what is the same both ways is a constant torque, and no friction
        let pairs = friction.chunks_exact(2).zip(speeds.chunks_exact(2));
        let drives = pairs.filter(|(f, _)| f[0] - f[1] < 0.0);
        drives.map(|(_, v)| v[0]).fold(None, |range, v| {
            let [low, high] = range.unwrap_or([v, v]);
            Some([f64::min(low, v), f64::max(high, v)])
        })
    })
    .collect()
}

/// What a file of links cannot say truly, as sentences: friction and drive inertias below zero.
pub fn below_zero(file: &ModelFile, model: &Model) -> Vec<String> {
    let names = model.robot.joint_names();
    let shown = |name: &str, joint: Option<&str>, value: f64| {
        let parameter = file.find(name, joint);
        let std = parameter.and_then(|p| p.std).unwrap_or(f64::NAN);
        let (value, std) = number::value_and_std(value, std);
        let unit = parameter.map_or("", |p| p.unit.as_str());
        format!("{value} +- {std} {unit}")
    };
    let mut out = Vec::new();
    for (joint, law) in names.iter().zip(&model.friction) {
        let JointFriction::ViscousCoulomb(law) = law else {
            continue;
        };
        for (name, value) in ViscousCoulomb::NAMES.iter().zip([law.viscous, law.coulomb]) {
            if value < 0.0 {
                out.push(format!(
                    "the {name} friction of {joint} is {}, which would drive it: the file has 0",
                    shown(name, Some(joint), value)
                ));
            }
        }
    }
    for j in model.robot.standard_map().drives {
        let name = format!("Ia{}", j + 1);
        let found = file.find(&name, None).filter(|p| p.in_use() < 0.0);
        if let (Some(p), Some(joint)) = (found, names.get(j)) {
            out.push(format!(
                "the drive inertia of {joint} is {}, and no drive has one below zero: fit without --unconstrained",
                shown(&name, None, p.value)
            ));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_the_nearest_of_those_that_are_not_below_zero() {
        let speeds: Vec<f64> = (-50..=50).map(|k| 0.04 * f64::from(k)).collect();
        let law = |v: &f64| 0.7 * v + 2.0 * sign(*v) + 0.3 * v * v * v;
        let friction: Vec<f64> = speeds.iter().map(law).collect();
        let all = nearest_sizes(&friction, &CURVES, &speeds).unwrap();
        for (size, wanted) in all.iter().zip([0.7, 2.0, 0.0, 0.3]) {
            assert!((size - wanted).abs() < 1e-9, "{all:?}");
        }
        // a fall with speed is none, and its level the mean
        let law = |v: &f64| sign(*v) * (2.0 - 0.3 * v.abs());
        let friction: Vec<f64> = speeds.iter().map(law).collect();
        let falling = nearest_sizes(&friction, &CURVES[..2], &speeds).unwrap();
        assert_eq!(falling[0], 0.0);
        assert!(
            (falling[1] - (2.0 - 0.3 * 1.02)).abs() < 1e-9,
            "{falling:?}"
        );
        assert_eq!(nearest_sizes(&[], &CURVES, &[]), None);
    }
}
