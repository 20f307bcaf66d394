//! Joints that are swapped or have the other sign, by a model of the robot.
//!
//! The torque that a model gives for the motion as logged is compared with the torque as logged, and
//! again with each joint turned, and each two joints exchanged, in the positions, in the torques
//! and in both. Where one such change explains what was not explained without it, it is reported.

use super::draft::seconds;
use super::fault::{FaultKind, LogFault, Severity};
use super::lag::{MIN_DELAY_ROWS, REMEDY};
use crate::log::escape;

/// A model that is off by less, as a share of the torque's power, is not doubted.
const MIN_MODEL_ERROR_SHARE: f64 = 0.04;
/// A change must leave at most this share of what is left without it...
const MAX_SHARE_LEFT: f64 = 0.25;
/// ... and explain more than half of the torque's power.
const MIN_EXPLAINED_SHARE: f64 = 0.5;
/// A delay that explains a smaller share of what the model leaves is none.
const MIN_SHARE_BY_DELAY: f64 = 0.5;

/// What may be wrong with the order and signs of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderFault {
    /// Nothing.
    None,
    /// A joint has the other sign.
    Turn(usize),
    /// Two joints are exchanged.
    Exchange(usize, usize),
}

impl OrderFault {
    /// Makes the change in a list with one number for each joint.
    pub fn apply(self, x: &mut [f64]) {
        match self {
            Self::Turn(joint) if joint < x.len() => x[joint] = -x[joint],
            Self::Exchange(a, b) if a.max(b) < x.len() => x.swap(a, b),
            _ => {}
        }
    }
}

/// Compares torques as logged with those that a model gives under each change of the positions.
#[derive(Debug, Clone)]
pub struct OrderComparison {
    joints: usize,
    changes: Vec<OrderFault>,
    /// For each change of the positions, joint of the model and joint of the log: sum of products.
    products: Vec<f64>,
    /// For each change and joint: power of the model's torque.
    modelled: Vec<f64>,
    /// For each joint: power of the logged torque.
    logged: Vec<f64>,
    /// The last two rows, as logged: stretch, time, model's torque, logged torque.
    last: [Option<LastRow>; 2],
    /// For each joint the sums of r p', p' p' and r r: model's torque p, what it leaves r.
    slopes: Vec<[f64; 3]>,
}

/// The row before, with its torques by the model and as they were logged.
#[derive(Debug, Clone)]
struct LastRow {
    segment: usize,
    t: f64,
    modelled: Vec<f64>,
    logged: Vec<f64>,
}

impl OrderComparison {
    /// For a robot of `joints` joints.
    pub fn new(joints: usize) -> Self {
        let mut changes = vec![OrderFault::None];
        changes.extend((0..joints).map(OrderFault::Turn));
        for a in 0..joints {
            changes.extend((a + 1..joints).map(|b| OrderFault::Exchange(a, b)));
        }
        Self {
            products: vec![0.0; changes.len() * joints * joints],
            modelled: vec![0.0; changes.len() * joints],
            logged: vec![0.0; joints],
            last: [None, None],
            slopes: vec![[0.0; 3]; joints],
            changes,
            joints,
        }
    }

    /// Changes of the positions for which the model's torque is asked, in order.
    pub fn changes(&self) -> &[OrderFault] {
        &self.changes
    }

    /// Numbers that [`Self::add`] takes: the model's torques for each change, then the logged ones.
    pub fn channels(&self) -> usize {
        (self.changes.len() + 1) * self.joints
    }

    /// Adds a row: the stretch of the log that it belongs to, its time [s], and its numbers.
    pub fn add(&mut self, segment: usize, t: f64, row: &[f64]) {
        let n = self.joints;
        if row.len() != self.channels() {
            return;
        }
        let (modelled, logged) = row.split_at(n * self.changes.len());
        let powers = self.modelled.iter_mut().chain(&mut self.logged);
        for (sum, x) in powers.zip(row) {
            *sum += x * x;
        }
        for (sums, x) in self.products.chunks_exact_mut(n).zip(modelled) {
            for (sum, y) in sums.iter_mut().zip(logged) {
                *sum += x * y;
            }
        }
        self.follow(LastRow {
            segment,
            t,
            modelled: modelled[..n].to_vec(),
            logged: logged.to_vec(),
        });
    }

    /// What a delay d would explain: tau(t) = p(t - d) leaves r = -d p'.
    fn follow(&mut self, next: LastRow) {
        if let [Some(before), Some(row)] = &self.last
            && before.segment == next.segment
            && next.t > before.t
        {
            let ends = before.modelled.iter().zip(&next.modelled);
            let own = row.modelled.iter().zip(&row.logged);
            for (sums, ((a, b), (p, tau))) in self.slopes.iter_mut().zip(ends.zip(own)) {
                let (slope, left) = ((b - a) / (next.t - before.t), tau - p);
                sums[0] += left * slope;
                sums[1] += slope * slope;
                sums[2] += left * left;
            }
        }
        let [_, last] = std::mem::take(&mut self.last);
        self.last = [last, Some(next)];
    }

    /// The delay of the torques behind the positions, where it explains what the model leaves;
    /// `dt` is the log's step [s].
    pub fn delay(&self, dt: f64, rows: u64, duration_s: f64) -> Option<LogFault> {
        let mut known = self.slopes.clone();
        known.retain(|[_, slope, left]| *slope > 0.0 && *left > 0.0);
        // Each joint counts as much as it is sure.
        let (mut top, mut bottom) = (0.0, 0.0);
        for [product, slope, left] in &known {
            top -= product / left;
            bottom += slope / left;
        }
        let delay = if bottom > 0.0 { top / bottom } else { 0.0 };
        let (mut explained, all) = (0.0, known.len() as f64);
        for [product, slope, left] in &known {
            // |r + d p'|^2 is less than |r|^2 by this share
            explained += -(2.0 * delay * product + delay * delay * slope) / left;
        }
        if delay.abs() < MIN_DELAY_ROWS * dt || explained < MIN_SHARE_BY_DELAY * all {
            return None;
        }
        let side = if delay > 0.0 { "behind" } else { "ahead of" };
        let effect = format!(
            "torques are {} {side} the positions, by the model: inertia and viscous friction are mixed up, the more the faster the motion",
            seconds(delay.abs())
        );
        let kind = FaultKind::Delay;
        let fault = LogFault::whole(Severity::Warning, kind, duration_s, effect, REMEDY);
        Some(LogFault { rows, ..fault })
    }

    /// Mean share of the joints' power that is left under change `index` of the positions and one of the torques.
    fn left(&self, index: usize, of_torques: OrderFault) -> f64 {
        let n = self.joints;
        let (mut sum, mut count) = (0.0, 0.0);
        for j in 0..n {
            // Which logged torque stands for the joint, and its sign.
            let (from, sign) = match of_torques {
                OrderFault::Turn(joint) if joint == j => (j, -1.0),
                OrderFault::Exchange(a, b) if a == j => (b, 1.0),
                OrderFault::Exchange(a, b) if b == j => (a, 1.0),
                _ => (j, 1.0),
            };
            let power = self.logged[from];
            if power > 0.0 {
                let product = sign * self.products[(index * n + j) * n + from];
                sum += (power - 2.0 * product + self.modelled[index * n + j]) / power;
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }

    /// What is wrong with order and signs, where a single change explains it.
    pub fn fault(&self, joints: &[String], rows: u64, duration_s: f64) -> Option<LogFault> {
        let as_logged = self.left(0, OrderFault::None);
        let mut best = (as_logged, OrderFault::None, "");
        for (index, change) in self.changes.iter().enumerate().skip(1) {
            for (of_torques, at, what) in [
                (OrderFault::None, index, "positions"),
                (*change, 0, "torques"),
                (*change, index, "positions and torques"),
            ] {
                let left = self.left(at, of_torques);
                if left < best.0 {
                    best = (left, *change, what);
                }
            }
        }
        let (left, change, what) = best;
        if as_logged < MIN_MODEL_ERROR_SHARE
            || left > MAX_SHARE_LEFT * as_logged
            || left > MIN_EXPLAINED_SHARE
        {
            return None;
        }
        let name = |joint: usize| joints.get(joint).map_or(String::new(), |name| escape(name));
        let (problem, remedy) = match change {
            OrderFault::None => return None,
            OrderFault::Turn(joint) => (
                format!("{what} of {} have the other sign", name(joint)),
                "turn the sign of this joint in the [log] section of the robot file",
            ),
            OrderFault::Exchange(a, b) => (
                format!("{what} of {} and {} are exchanged", name(a), name(b)),
                "exchange the columns of the two joints in the [log] section of the robot file",
            ),
        };
        let share = |left: f64| 100.0 * left.max(0.0).sqrt();
        let effect = format!(
            "{problem}: as logged the model is off by {:.0} % of the torque, with that put right by {:.0} %; a fit gives parameters of no robot",
            share(as_logged),
            share(left)
        );
        let kind = FaultKind::WrongSignOrOrder;
        let fault = LogFault::whole(Severity::Error, kind, duration_s, effect, remedy);
        Some(LogFault { rows, ..fault })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two joints that pull at each other, driven by different motions.
    fn torque([q, v, a]: [[f64; 2]; 3]) -> [f64; 2] {
        [
            2.0 * a[0] + 0.3 * a[1] + v[0] + 5.0 * q[0].sin(),
            0.3 * a[0] + 0.5 * a[1] + 3.0 * v[1] + 2.0 * q[1].cos(),
        ]
    }

    fn motion(t: f64) -> [[f64; 2]; 3] {
        let (w, u) = (1.3, 2.9);
        let q = [(w * t).sin(), 0.6 * (u * t).cos()];
        let v = [w * (w * t).cos(), -0.6 * u * (u * t).sin()];
        [q, v, [-w * w * q[0], -u * u * q[1]]]
    }

    fn compared(positions: OrderFault, torques: OrderFault, late: f64) -> OrderComparison {
        let mut comparison = OrderComparison::new(2);
        let changes = comparison.changes().to_vec();
        for k in 0..5000 {
            let t = f64::from(k) * 0.01;
            let mut logged = torque(motion(t - late));
            logged[0] += 0.1 * (31.0 * t).sin();
            torques.apply(&mut logged);
            // The log has the wrong positions; the model is asked for what it would make of them.
            let mut row = Vec::new();
            for change in &changes {
                row.extend(torque(motion(t).map(|mut x| {
                    positions.apply(&mut x);
                    change.apply(&mut x);
                    x
                })));
            }
            row.extend(logged);
            comparison.add(0, t, &row);
        }
        comparison
    }

    fn in_words(positions: OrderFault, torques: OrderFault) -> Option<String> {
        let comparison = compared(positions, torques, 0.0);
        let names = ["a".to_owned(), "b".to_owned()];
        let fault = comparison.fault(&names, 5000, 50.0)?;
        Some(fault.effect.split(':').next().unwrap().to_owned())
    }

    #[test]
    fn each_single_change_is_named_and_a_right_log_is_not_doubted() {
        use OrderFault::{Exchange, None, Turn};
        assert_eq!(in_words(None, None), Option::None);
        for (positions, torques, expected) in [
            (Turn(0), None, "positions of a have the other sign"),
            (None, Turn(1), "torques of b have the other sign"),
            (Exchange(0, 1), None, "positions of a and b are exchanged"),
            (None, Exchange(0, 1), "torques of a and b are exchanged"),
            (
                Exchange(0, 1),
                Exchange(0, 1),
                "positions and torques of a and b are exchanged",
            ),
        ] {
            assert_eq!(in_words(positions, torques).as_deref(), Some(expected));
        }
    }

    #[test]
    fn a_delay_is_reported_with_its_size_and_a_log_without_one_has_none() {
        let delay =
            |late| compared(OrderFault::None, OrderFault::None, late).delay(0.01, 5000, 50.0);
        assert_eq!(delay(0.0), None);
        let late = delay(0.03).unwrap().effect;
        let number: f64 = late.split(' ').nth(2).unwrap().parse().unwrap();
        let near = (number - 30.0).abs() < 2.0;
        assert!(near && late.contains("behind"), "{late}");
        assert!(delay(-0.03).unwrap().effect.contains("ahead of"));
    }
}
