//! How far the torques of a model may be off by the covariance of its parameters.

use std::borrow::Cow;
use std::cell::RefCell;

use super::model::Model;
use crate::math::lanes::{LaneWork, Simd, widest};

/// Deviations that 95 % of a normal law lie within.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Deviations of a model's torque that come from its parameters.
#[derive(Debug, Clone)]
pub struct Deviation<'a> {
    model: Cow<'a, Model>,
    joints: Vec<OfJoint>,
}

/// What the torque of a joint holds.
#[derive(Debug, Clone)]
struct OfJoint {
    theta: Vec<usize>,
    /// Covariance of those, the joint's friction and its offset, row-major.
    covariance: Vec<f64>,
}

thread_local! {
    /// Regressor, gradient and what is worked out with them, kept from sample to sample.
    static SCRATCH: RefCell<[Vec<f64>; 3]> = const { RefCell::new([const { Vec::new() }; 3]) };
}

impl<'a> Deviation<'a> {
    /// Those of a model whose inertial parameters, friction of each joint and offsets, in this order, have the
    /// covariance given, row-major.
    pub fn new(covariance: &[f64], model: &'a Model) -> Self {
        Self::of(covariance, Cow::Borrowed(model))
    }

    /// The same with a model of its own.
    pub fn owned(covariance: &[f64], model: Model) -> Deviation<'static> {
        Deviation::of(covariance, Cow::Owned(model))
    }

    fn of(covariance: &[f64], model: Cow<'a, Model>) -> Self {
        let u = model.parameters();
        let (mut friction, offset) = (model.theta.len(), u - model.offset.len());
        let mut joints = Vec::new();
        for (j, theta) in model.robot.parameters_by_joint().into_iter().enumerate() {
            let own = friction..friction + model.friction[j].parameters();
            friction = own.end;
            let places: Vec<usize> = theta
                .iter()
                .copied()
                .chain(own)
                .chain([offset + j])
                .collect();
            let entries = places
                .iter()
                .flat_map(|i| places.iter().map(move |k| i * u + k));
            let covariance = entries.map(|at| covariance[at]).collect();
            joints.push(OfJoint { theta, covariance });
        }
        Self { model, joints }
    }

    /// Variance of the torque of every joint at a position, velocity and acceleration \[N^2 or Nm^2\].
    pub fn variances(&self, [q, v, a]: [&[f64]; 3], out: &mut [f64]) {
        let p = self.model.theta.len();
        SCRATCH.with_borrow_mut(|[regressor, gradient, product]| {
            regressor.resize(p * self.joints.len(), 0.0);
            self.model.robot.regressor(q, v, a, regressor);
            for (j, (out, of)) in out.iter_mut().zip(&self.joints).enumerate() {
                let friction = &self.model.friction[j];
                let mut slopes = [0.0; 5];
                friction.gradient(v[j], &mut slopes);
                gradient.clear();
                gradient.extend(of.theta.iter().map(|i| regressor[j * p + i]));
                gradient.extend(&slopes[..friction.parameters()]);
                gradient.push(1.0);
                *out = quadratic(&of.covariance, gradient, product);
            }
        });
    }
}

/// g' C g for a row-major symmetric C, never negative; `product` is what it is worked out in.
fn quadratic(covariance: &[f64], g: &[f64], product: &mut Vec<f64>) -> f64 {
    product.clear();
    product.resize(g.len(), 0.0);
    widest(HalfProduct {
        covariance,
        g,
        product,
    });
    let sum: f64 = product.iter().zip(g).map(|(y, x)| y * x).sum();
    (2.0 * sum).max(0.0)
}

/// (C - diag(C) / 2) g of the lower triangle of C.
struct HalfProduct<'a> {
    covariance: &'a [f64],
    g: &'a [f64],
    product: &'a mut [f64],
}

impl LaneWork for HalfProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let rows = self.covariance.chunks_exact(self.g.len()).enumerate();
        for ((i, row), x) in rows.zip(self.g) {
            self.product[i] += 0.5 * row[i] * x;
            for (y, c) in self.product[..i].iter_mut().zip(row) {
                *y += c * x;
            }
        }
    }
}
