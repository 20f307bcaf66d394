//! Filtered rows in which a body on the last link is looked for.

use nalgebra::DMatrix;

use super::payload_result::{CarriedSpan, TouchedSpan};
use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::in_memory::InMemory;
use crate::input::robot_setup::RobotSetup;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::{ParallelFilters, Stretch, rest};
use cft_ident_core::robot::friction::sign;
use cft_ident_core::robot::standard::STANDARD;

/// Entries of a row: ten of the body, viscous and Coulomb friction, offset.
pub(super) const OWN: usize = STANDARD + 3;
/// Where rows have the torque of the model, what it leaves, and their weight.
pub(super) const HAT: usize = OWN;
pub(super) const LEFT: usize = OWN + 1;
const WEIGHT: usize = OWN + 2;
/// Duration of a block of scores \[s\].
pub(super) const BLOCK_S: f64 = 0.25;
/// A filtered row of one joint.
#[derive(Clone)]
pub(super) struct PayloadRow {
    /// Its entries.
    pub numbers: [f64; OWN + 3],
    pub block: usize,
    /// Time since the begin of its log \[s\].
    pub t: f64,
}

/// A block of rows.
pub(super) struct PayloadBlock {
    pub stretch: usize,
    pub log: usize,
    /// Times since the begin of its log \[s\].
    pub begin: f64,
    pub end: f64,
}

/// Filtered rows of every joint, and the sums that say what the model's own parameters do to a fit of them.
pub(super) struct Rows {
    /// Rows joint by joint.
    pub joints: Vec<Vec<PayloadRow>>,
    pub blocks: Vec<PayloadBlock>,
    /// Filtered columns of the model's inertial parameters beside the entries, joint by joint: `OWN + 1` x p sums.
    pub beside: Vec<DMatrix<f64>>,
}

/// Places of the unknowns of joint `j`: the body, its friction and offset, and its gain.
pub(super) fn places(j: usize, n: usize, gains: bool) -> Vec<usize> {
    let own = (0..3).map(|k| STANDARD + 3 * j + k);
    let gain = gains.then_some(STANDARD + 3 * n + j);
    (0..STANDARD).chain(own).chain(gain).collect()
}

/// What acts on the arm, and when.
#[derive(Clone, Copy)]
pub(super) struct LoadParts<'a> {
    /// Parts in which the body acts; throughout where there are none.
    pub carried: &'a [CarriedSpan],
    /// Parts that are left out.
    pub touched: &'a [TouchedSpan],
    /// Time within which filters mix both sides of an end \[s\]: its rows are left out.
    pub smear_s: f64,
}

impl LoadParts<'_> {
    /// Part of the body that acts at a time of a log, 0 or 1, and whether that row is left out.
    fn at(&self, log: usize, t: f64) -> (f64, bool) {
        let each = (self.carried.iter()).map(|span| span.holds(log, t, self.smear_s));
        let (inside, near) = each.fold((self.carried.is_empty(), false), |(a, b), (c, d)| {
            (a || c, b || d)
        });
        let touched = self.touched.iter().any(|span| {
            span.place == log && (span.from_s - self.smear_s..span.to_s + self.smear_s).contains(&t)
        });
        (f64::from(u8::from(inside)), near || touched)
    }
}

/// Filters what a model leaves of every joint beside the body's own columns.
pub(super) fn rows(
    setup: &RobotSetup,
    model: &AugmentedModel,
    whole: &InMemory,
    name: &str,
    parts: LoadParts,
    control: &Control,
) -> Result<Rows, IdentifyError> {
    let (n, p) = (setup.robot.joints(), model.model.theta.len());
    let failed = |error| IdentifyError::motion(name, error);
    let filters = ParallelFilters::design(&setup.settings(), &whole.stretches).map_err(failed)?;
    let mut out = Rows {
        joints: vec![Vec::new(); n],
        blocks: Vec::new(),
        beside: vec![DMatrix::zeros(OWN + 1, p); n],
    };
    for (number, stretch) in whole.stretches.iter().enumerate() {
        control.check()?;
        let filter = filters.of(stretch);
        if filter.rows(stretch.len()) < 2 {
            continue;
        }
        let first = out.blocks.len();
        let seconds = stretch.dt * stretch.len() as f64;
        let count = (seconds / BLOCK_S).ceil().max(1.0) as usize;
        let end = stretch.began + seconds;
        out.blocks.extend((0..count).map(|k| PayloadBlock {
            stretch: number,
            log: stretch.log,
            begin: stretch.began + BLOCK_S * k as f64,
            end: end.min(stretch.began + BLOCK_S * (k + 1) as f64),
        }));
        let carries = |t: f64| parts.at(stretch.log, t);
        let hat = model.reconstruct(stretch);
        for (j, hat) in hat.iter().enumerate() {
            // a joint that rests takes any torque up to its Coulomb level
            let weights = filter.weights(stretch, j, whole.rest_speed[j]);
            let channels = channels(setup, model, stretch, (j, hat), (&weights, &carries));
            let channels: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
            let filtered = filter.run(&channels).map_err(failed)?;
            let kept = 0..filter.rows(stretch.len());
            for i in kept.filter(|i| !rest::rests(filtered[WEIGHT][*i])) {
                let row: [f64; OWN + 3] = std::array::from_fn(|k| filtered[k][i]);
                let since = filter.sample_of(i) as f64 * stretch.dt;
                let (at, t) = ((since / BLOCK_S) as usize, stretch.began + since);
                if carries(t).1 {
                    continue;
                }
                for (c, x) in row[..=HAT].iter().enumerate() {
                    for k in 0..p {
                        out.beside[j][(c, k)] += x * filtered[OWN + 3 + k][i];
                    }
                }
                out.joints[j].push(PayloadRow {
                    numbers: row,
                    block: first + at.min(count - 1),
                    t,
                });
            }
        }
    }
    Ok(out)
}

/// Channels of one joint along a stretch: entries, model, what it leaves, weight, then the regressor.
fn channels(
    setup: &RobotSetup,
    model: &AugmentedModel,
    stretch: &Stretch,
    (j, hat): (usize, &[f64]),
    (weights, carries): (&[f64], &dyn Fn(f64) -> (f64, bool)),
) -> Vec<Vec<f64>> {
    let (n, p) = (setup.robot.joints(), model.model.theta.len());
    let mut out = vec![Vec::with_capacity(stretch.len()); OWN + 3 + p];
    let mut regressor = vec![0.0; n * p];
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for (k, hat) in hat.iter().enumerate() {
        stretch.at(k, &mut q, &mut v, &mut a);
        model.model.robot.regressor(&q, &v, &a, &mut regressor);
        let weight = weights[k];
        let (carried, _) = carries(stretch.began + stretch.dt * k as f64);
        let body = setup.robot.tool_row(j, &q, &v, &a).map(|x| carried * x);
        let own = [v[j], sign(v[j]), 1.0, *hat, stretch.tau[j][k] - hat];
        let all = body.into_iter().chain(own).map(|x| weight * x);
        let rest = regressor[j * p..(j + 1) * p].iter().map(|x| weight * x);
        let all = all.chain([weight]).chain(rest);
        out.iter_mut().zip(all).for_each(|(out, x)| out.push(x));
    }
    out
}
