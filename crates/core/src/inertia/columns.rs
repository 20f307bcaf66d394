//! Which columns a joint's rows have: shared inertial parameters, its own linear terms, the
//! gradient of its known friction, and the target.

use crate::math::hyperbolic::tanh;
use nalgebra::DVector;

use crate::motion::{FilterSettings, MotionSample, rest};
use crate::robot::Robot;
use crate::robot::friction::{DoubleTanh, sign};
use crate::robot::model::JointFriction;

/// A linear term that belongs to one joint and is fitted with the inertias.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointTerm {
    /// Fv v.
    Viscous,
    /// Fc sgn(v).
    Coulomb,
    /// A constant torque.
    Offset,
    /// Fc tanh(w v) with w known [s/m or s/rad]: one of several by which a law (18) is begun.
    Saturating(f64),
    /// Change of the parameter of this index of a friction law (order of [`DoubleTanh::NAMES`]);
    /// the law's gradient is its column.
    Law(usize),
    /// What the torque changes over a sample: a torque that is logged late or early, in samples.
    TorqueRate,
    /// What that rate changes over a sample: a drive that gives way under its torque, in samples squared.
    TorqueBend,
}

impl JointTerm {
    /// Name in results and files.
    pub fn name(self) -> &'static str {
        match self {
            JointTerm::Viscous => "viscous",
            JointTerm::Coulomb | JointTerm::Saturating(_) => "coulomb",
            JointTerm::Offset => "offset",
            JointTerm::Law(k) => DoubleTanh::NAMES[k],
            JointTerm::TorqueRate => "torque rate",
            JointTerm::TorqueBend => "torque bend",
        }
    }

    /// Its column at velocity v; 0 for a law's, which [`RegressorColumns::fill`] writes by its gradient.
    #[inline]
    pub fn column(self, v: f64) -> f64 {
        match self {
            JointTerm::Viscous => v,
            JointTerm::Coulomb => sign(v),
            JointTerm::Offset => 1.0,
            JointTerm::Saturating(slope) => tanh(slope * v),
            JointTerm::Law(_) | JointTerm::TorqueRate | JointTerm::TorqueBend => 0.0,
        }
    }
}

/// What is known of a joint's friction before the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownFriction {
    pub law: DoubleTanh,
    /// Covariance of (Bv, Bf1, Bf2, w1, w2), row-major 5 x 5; zero where it is taken as exact.
    pub covariance: [[f64; 5]; 5],
    /// Which of them a refinement leaves where they are.
    pub held: [bool; GRADIENT],
}

impl KnownFriction {
    /// The same law with its deviations so much wider that rows which tell it decide alone.
    pub fn doubted(mut self) -> Self {
        const WIDER: f64 = 1e3;
        let covariance = self.covariance.iter_mut().flatten();
        covariance.for_each(|x| *x *= WIDER * WIDER);
        self
    }

    /// Whether a refinement moves any of its parameters.
    pub fn moves(&self) -> bool {
        self.held.contains(&false)
    }
}

/// Columns of the rows of every joint.
#[derive(Debug, Clone)]
pub struct RegressorColumns {
    /// Number of joints n.
    pub joints: usize,
    /// Number of shared inertial parameters p.
    pub shared: usize,
    /// Own linear terms per joint.
    pub own: Vec<Vec<JointTerm>>,
    /// Known friction per joint; its gradient takes five columns.
    pub known: Vec<Option<KnownFriction>>,
    /// Speed up to which each joint rests [m/s or rad/s]: static friction takes any torque there, and its
    /// rows inform no parameter. Below 0 of a joint whose rows always count; empty where all do.
    pub rest_speed: Vec<f64>,
}

/// Columns that the gradient of a known friction law takes.
pub const GRADIENT: usize = 5;

impl RegressorColumns {
    /// The friction of each joint; none where it is not known.
    pub fn known_laws(&self) -> Vec<Option<JointFriction>> {
        let law = |known: &KnownFriction| JointFriction::DoubleTanh(known.law);
        self.known
            .iter()
            .map(|known| known.as_ref().map(law))
            .collect()
    }

    /// Rows in which a joint with friction rests, by the speed up to which it does [m/s or rad/s], inform no
    /// parameter; joints without friction never rest.
    pub fn rest_at(&mut self, speeds: Vec<f64>) {
        self.rest_speed = speeds;
        for (j, speed) in self.rest_speed.iter_mut().enumerate() {
            let mut own = self.own[j].iter();
            if self.known[j].is_none() && own.all(|own| *own == JointTerm::Offset) {
                *speed = -1.0;
            }
        }
    }

    /// The processing of rows in which joints rest as these columns say.
    pub(super) fn with_rests(&self, settings: &FilterSettings) -> FilterSettings {
        FilterSettings {
            rest_speed: match settings.weighs_rests {
                true => self.rest_speed.clone(),
                false => Vec::new(),
            },
            ..settings.clone()
        }
    }

    /// Whether no weighted row jumps: friction does where samples weigh nothing, and is no steep law.
    pub(super) fn are_smooth(&self) -> bool {
        let jumps = |(j, own): (usize, &Vec<JointTerm>)| {
            let rests = self.rest_speed.get(j).is_some_and(|speed| *speed >= 0.0);
            let any = |of: &dyn Fn(&JointTerm) -> bool| own.iter().any(of);
            !rests && any(&|own| *own == JointTerm::Coulomb)
                || any(&|own| matches!(own, JointTerm::Law(_) | JointTerm::Saturating(_)))
        };
        let laws = self.known.iter().any(Option::is_some);
        !laws && !self.own.iter().enumerate().any(jumps)
    }

    /// Number of unknowns: shared ones first, then each joint's own in turn.
    pub fn unknowns(&self) -> usize {
        self.shared + self.own.iter().map(Vec::len).sum::<usize>()
    }

    /// Index of the first own unknown of joint j.
    pub fn first_own(&self, j: usize) -> usize {
        self.shared + self.own[..j].iter().map(Vec::len).sum::<usize>()
    }

    /// Number of unknowns in the rows of joint j.
    pub fn unknowns_of(&self, j: usize) -> usize {
        self.shared + self.own[j].len()
    }

    /// Width of one row of joint j: unknowns, gradient, target b = tau - F(v).
    pub fn row_width(&self, j: usize) -> usize {
        self.unknowns_of(j) + self.gradient(j) + 1
    }

    /// Gradient columns of joint j.
    pub fn gradient(&self, j: usize) -> usize {
        if self.known[j].is_some() { GRADIENT } else { 0 }
    }

    /// Index of the global unknown that column c of joint j's unknowns stands for.
    pub fn unknown(&self, j: usize, c: usize) -> usize {
        if c < self.shared {
            c
        } else {
            self.first_own(j) + c - self.shared
        }
    }

    /// Where joint j's columns begin in a row of all channels; after all joints' columns stand the
    /// n measured torques.
    pub fn offset(&self, j: usize) -> usize {
        (0..j).map(|i| self.row_width(i)).sum()
    }

    /// Channels per sample over all joints: their rows and measured torques; where joints rest, each times the joint's
    /// weight, then 1 or 0 for each joint that moves or rests, and rows and torques without a weight.
    pub fn channels(&self) -> usize {
        let plain = self.offset(self.joints) + self.joints;
        match self.rest_speed.is_empty() {
            true => plain,
            false => 2 * plain + self.joints,
        }
    }

    /// Whether joint j rests in a row of filtered channels.
    #[inline]
    pub(crate) fn rests(&self, channels: &[f64], j: usize) -> bool {
        let moving = self.offset(self.joints) + self.joints + j;
        !self.rest_speed.is_empty() && rest::rests(channels[moving])
    }

    /// Where rows and torques without a weight begin among the channels.
    pub(super) fn unweighted(&self) -> usize {
        self.offset(self.joints) + 2 * self.joints
    }

    /// The same columns with the parameters of the known friction among the unknowns, but for those that are
    /// held: their gradient, which stands after the own terms, becomes own terms.
    pub fn with_free_friction(&self) -> RegressorColumns {
        let mut columns = self.clone();
        for (own, known) in columns.own.iter_mut().zip(&mut columns.known) {
            if let Some(known) = known.take() {
                let free = (0..GRADIENT).filter(|k| !known.held[*k]);
                own.extend(free.map(JointTerm::Law));
            }
        }
        columns
    }

    /// Places of each joint's own terms that are to be kept.
    pub(super) fn places(&self, keep: impl Fn(&JointTerm) -> bool) -> Vec<Vec<usize>> {
        let kept = |own: &Vec<JointTerm>| (0..own.len()).filter(|k| keep(&own[*k])).collect();
        self.own.iter().map(kept).collect()
    }

    /// Restriction of all unknowns to those of joint j.
    pub(super) fn own_unknowns(&self, theta: &DVector<f64>, j: usize) -> DVector<f64> {
        DVector::from_fn(self.unknowns_of(j), |c, _| theta[self.unknown(j, c)])
    }

    /// Adds numbers of joint j's unknowns, each so many times, to those of all.
    pub(super) fn add_own(&self, j: usize, times: f64, own: &DVector<f64>, all: &mut DVector<f64>) {
        for (c, x) in own.iter().enumerate() {
            all[self.unknown(j, c)] += times * x;
        }
    }

    /// Unknowns of joint j that are changes of its law, each with its place in the law.
    pub fn law_unknowns(&self, j: usize) -> impl Iterator<Item = (usize, usize)> {
        let first = self.first_own(j);
        let own = self.own[j].iter().enumerate();
        own.filter_map(move |(c, own)| match own {
            JointTerm::Law(k) => Some((first + c, *k)),
            _ => None,
        })
    }

    /// Fills the channels of one sample.
    pub fn fill(
        &self,
        robot: &Robot,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        tau: &[f64],
        out: &mut [f64],
    ) {
        let (n, p) = (self.joints, self.shared);
        robot.regressor(q, v, a, &mut out[..n * p]);
        let mut end = self.offset(n);
        out[end..end + n].copy_from_slice(tau);
        // from the last joint to the first: rows only move up
        for j in (0..n).rev() {
            let first = end - self.row_width(j);
            out.copy_within(j * p..(j + 1) * p, first);
            let mut at = first + p;
            for own in &self.own[j] {
                out[at] = own.column(v[j]);
                at += 1;
            }
            let mut b = tau[j];
            if let Some(known) = &self.known[j] {
                b -= known.law.torque(v[j]);
                out[at..at + GRADIENT].copy_from_slice(&known.law.gradient(v[j]));
                at += GRADIENT;
            }
            out[at] = b;
            end = first;
        }
    }

    /// The same columns with a torque's rate and its bend for each joint, the last two of its own terms.
    pub fn with_torque_rates(&self) -> RegressorColumns {
        let mut columns = self.clone();
        for own in &mut columns.own {
            own.extend([JointTerm::TorqueRate, JointTerm::TorqueBend]);
        }
        columns
    }

    /// Whether these are columns [`Self::with_torque_rates`].
    pub fn have_torque_rates(&self) -> bool {
        let mut own = self.own.iter();
        own.any(|own| own.last() == Some(&JointTerm::TorqueBend))
    }

    /// Fills in what the torques and their rates change over a sample.
    pub(super) fn fill_torque_rates(&self, sample: &MotionSample<'_>, out: &mut [f64]) {
        for (j, own) in self.own.iter().enumerate() {
            if own.last() == Some(&JointTerm::TorqueBend) {
                let [before, after] = sample.tau_beside.map(|tau| tau[j]);
                let end = self.offset(j) + self.unknowns_of(j);
                out[end - 2] = (after - before) / 2.0;
                out[end - 1] = after - 2.0 * sample.tau[j] + before;
            }
        }
    }

    /// Gives every joint's row and torque of one sample its weight. Without it they stay beside, of a joint that rests
    /// near the sample.
    pub fn weigh(&self, sample: &MotionSample<'_>, out: &mut [f64]) {
        if self.rest_speed.is_empty() {
            return;
        }
        let n = self.joints;
        let torques = self.offset(n);
        let (weighted, rest) = out.split_at_mut(torques + n);
        let (moving, plain) = rest.split_at_mut(n);
        let mut from = 0;
        for (j, moving) in moving.iter_mut().enumerate() {
            let (weight, rests) = (sample.weight[j], sample.rests[j]);
            *moving = rest::movement(sample.v[j], self.rest_speed[j]);
            let to = from + self.row_width(j);
            for place in (from..to).chain([torques + j]) {
                plain[place] = if rests { weighted[place] } else { 0.0 };
                weighted[place] *= weight;
            }
            from = to;
        }
    }
}

#[cfg(test)]
impl RegressorColumns {
    /// Those of a single joint whose rows always count.
    pub fn of_one(own: &[JointTerm], known: Option<KnownFriction>) -> Self {
        RegressorColumns {
            joints: 1,
            shared: 1,
            own: vec![own.to_vec()],
            known: vec![known],
            rest_speed: Vec::new(),
        }
    }
}
