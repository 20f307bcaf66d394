//! Which faults each machine is given.

use super::faults::{Fault, Side};
use super::machines::Machine;
use super::names::STYLES;
use super::rows::Epoch;

/// Factors between what is logged and what is declared: degrees, thousandths, thousands, a gear ratio.
const FACTORS: [f64; 4] = [57.295_779_513_082_32, 1000.0, 0.001, 101.0];

/// Steps of a position [m or rad].
const STEPS: [f64; 3] = [0.001, 0.01, 0.1];

/// A case of the bench.
#[derive(Debug, Clone)]
pub enum Case {
    Fault(Fault),
    /// Column names in one of [`STYLES`].
    Names(usize),
    /// Nothing is wrong: a share of the log.
    Clean(f64, f64),
    /// Nothing is wrong: the one-joint experiment of a joint.
    CleanJoint(usize),
}

impl Case {
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Fault(fault) => fault.kind(),
            Self::Names(_) => "column names",
            Self::Clean(..) | Self::CleanJoint(_) => "clean",
        }
    }

    pub fn name(&self, machine: &Machine) -> String {
        match self {
            Self::Fault(fault) => fault.name(machine),
            Self::Names(style) => format!("names {}", STYLES[*style].position),
            Self::Clean(from, to) => format!("clean {:.0}..{:.0} %", 100.0 * from, 100.0 * to),
            Self::CleanJoint(joint) => format!("clean {} alone", machine.joints[*joint].name),
        }
    }
}

/// Shares of a log that are right as the whole is.
const SPANS: [(f64, f64); 7] = [
    (0.0, 1.0),
    (0.0, 0.5),
    (0.5, 1.0),
    (0.2, 0.8),
    (0.0, 0.3),
    (0.4, 0.7),
    (0.7, 1.0),
];

/// All cases of a machine.
pub fn cases(machine: &Machine) -> Vec<Case> {
    let mut out: Vec<Case> = SPANS.iter().map(|(a, b)| Case::Clean(*a, *b)).collect();
    if machine.name == "cft" {
        out.extend((0..machine.joints.len()).map(Case::CleanJoint));
    }
    out.extend(faults(machine).into_iter().map(Case::Fault));
    if machine.serial() {
        out.extend((0..STYLES.len()).map(Case::Names));
    }
    out
}

fn faults(machine: &Machine) -> Vec<Fault> {
    let n = machine.joints.len();
    let all: Vec<usize> = (0..n).collect();
    let mut out = Vec::new();
    for side in [Side::Torque, Side::Position] {
        out.extend(all.iter().map(|j| Fault::Sign(side, vec![*j])));
        if n > 1 {
            out.push(Fault::Sign(side, all.clone()));
        }
    }
    for side in Side::ALL {
        out.extend(
            all.windows(2)
                .map(|pair| Fault::Exchange(side, pair[0], pair[1])),
        );
    }
    if n > 2 {
        out.push(Fault::Reverse);
    }
    for side in [Side::Torque, Side::Position] {
        for (k, factor) in FACTORS.into_iter().enumerate() {
            // each joint has two of the factors in its torque and the other two in its position
            let other = usize::from(side == Side::Position);
            let turn = |j: &&usize| n == 1 || (**j + k + other).is_multiple_of(2);
            let of = all.iter().filter(turn);
            out.extend(of.map(|j| Fault::Scale(side, vec![*j], factor)));
            if n > 1 {
                out.push(Fault::Scale(side, all.clone(), factor));
            }
        }
    }
    if !machine.of_motors() {
        let turning = all.iter().filter(|j| machine.joints[**j].turn.is_some());
        for j in turning {
            out.extend([90.0, -90.0, 180.0, 5.0].map(|degrees| Fault::Zero(*j, degrees)));
        }
    }
    if machine.serial() {
        out.extend(directions().map(Fault::Gravity));
        out.push(Fault::Gains);
        for decimals in [3, 4] {
            out.extend([
                Fault::Rounded(decimals, true),
                Fault::Rounded(decimals, false),
            ]);
        }
    }
    let turning = all.iter().filter(|j| machine.joints[**j].turn.is_some());
    out.extend(turning.map(|j| Fault::Wrap(*j)));
    for (k, size) in STEPS.into_iter().enumerate() {
        let turn = |j: &&usize| n < 3 || (**j + k).is_multiple_of(3);
        out.extend(all.iter().filter(turn).map(|j| Fault::Step(*j, size)));
    }
    out.extend((2..=5).map(Fault::Hold));
    // a model whose torque at rest is known is needed
    if !machine.of_motors() && machine.name != "bldc" {
        out.extend([5, 10, 20, 30].map(Fault::Rest));
    }
    out.extend([1, 5].map(Fault::Dropped));
    out.extend(Epoch::ALL.map(Fault::Epoch));
    out
}

/// The 25 directions to corners, edges and faces of a cube in which gravity does not point.
fn directions() -> impl Iterator<Item = [f64; 3]> {
    let ends = [-1.0, 0.0, 1.0];
    let all = ends.into_iter().flat_map(move |x| {
        ends.into_iter()
            .flat_map(move |y| ends.map(move |z| [x, y, z]))
    });
    all.filter_map(|g: [f64; 3]| {
        let size = g.iter().map(|x| x * x).sum::<f64>().sqrt();
        let truth = g == [0.0, 0.0, -1.0];
        (size > 0.0 && !truth).then(|| g.map(|x| 9.81 * x / size))
    })
}
