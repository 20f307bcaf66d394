//! Sizes of a machine's numbers, and values from which a fit begins.

use super::chain::RobotChains;
use super::fit::DriveProblem;
use super::law::DriveLawKind;
use super::track::median;
use super::track::{DriveLoad, DriveLog, JointTrack};
use super::unknown::{DriveQuantity, DriveUnknown, JointSizes};

/// Starts that are fitted, best first.
const TRIED: usize = 3;

/// Logs that choose among the starts, spread over all.
const LOGS: usize = 8;

/// Part of the samples below a size.
fn quantile(mut x: Vec<f64>, part: f64) -> f64 {
    if x.is_empty() {
        return 0.0;
    }
    let at = ((x.len() - 1) as f64 * part) as usize;
    *x.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Speeds of a track over spans of some 25 ms.
fn speeds(t: &[f64], q: &[f64]) -> Vec<f64> {
    let dt = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
    let wide = ((0.025 / dt).round() as usize).clamp(1, t.len() - 1);
    (wide..t.len())
        .map(|k| ((q[k] - q[k - wide]) / (t[k] - t[k - wide])).abs())
        .collect()
}

/// Sizes of every joint over logs.
pub fn sizes(
    logs: &[&DriveLog],
    kind: DriveLawKind,
    chains: Option<&RobotChains>,
) -> Vec<JointSizes> {
    let joints = logs.first().map_or(0, |log| log.joints.len());
    let links = chains.map(RobotChains::usual_inertia);
    (0..joints)
        .map(|j| {
            let tracks = || logs.iter().map(move |log| (log, &log.joints[j]));
            let moving = |(log, track): (&&DriveLog, &JointTrack)| speeds(&log.t, &track.position);
            let speed = quantile(tracks().flat_map(moving).collect(), 0.99).max(1e-3);
            let off = |(_, track): (&&DriveLog, &JointTrack)| {
                let pairs = track.command.iter().zip(&track.position);
                pairs.map(|(c, q)| (c - q).abs()).collect::<Vec<f64>>()
            };
            let off: Vec<f64> = tracks().flat_map(off).collect();
            let square = off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64;
            let error = square.sqrt().max(1e-4);
            let gains: Vec<f64> = tracks().map(|(_, track)| track.kp).collect();
            let kp = median(gains).max(1e-9);
            let (inertia, gravity) = match logs[0].load {
                DriveLoad::PendulumRig(_) => {
                    let rigs = logs.iter().filter_map(|log| match log.load {
                        DriveLoad::PendulumRig(rig) => Some(rig),
                        _ => None,
                    });
                    let all: Vec<_> = rigs.collect();
                    let inertia = median(all.iter().map(|rig| rig.inertia()).collect());
                    (
                        inertia,
                        median(all.iter().map(|rig| rig.gravity()).collect()),
                    )
                }
                DriveLoad::Unknown => (1.0, 0.0),
                DriveLoad::Robot => (links.as_ref().map_or(1.0, |links| links[j]), 0.0),
            };
            let torque = match (kind, logs[0].load) {
                (DriveLawKind::Torque, DriveLoad::Robot) => kp * error,
                _ => gravity.max(inertia * speed * speed / error),
            };
            JointSizes {
                inertia,
                torque,
                speed,
                error,
                farthest: quantile(off, 0.99).max(error),
            }
        })
        .collect()
}

/// The unknowns that every drive has.
pub fn declared(logs: &[&DriveLog], kind: DriveLawKind) -> Vec<DriveUnknown> {
    let joints = logs.first().map_or(0, |log| log.joints.len());
    let mut out = Vec::new();
    for j in 0..joints {
        let volts = matches!(kind, DriveLawKind::Volts(_));
        let off = logs.iter().any(|log| log.joints[j].on.iter().any(|on| !on));
        let mut add = |quantity| out.push(DriveUnknown::of(quantity, j));
        if volts {
            add(DriveQuantity::Stiffness);
        }
        match volts && off {
            true => {
                add(DriveQuantity::BackEmf);
                add(DriveQuantity::Viscous);
            }
            false => add(DriveQuantity::Damping),
        }
        add(DriveQuantity::Coulomb);
        if volts && !kind.limit_is_declared() {
            add(DriveQuantity::TorqueLimit);
        }
        match logs[0].load {
            // gravity of links that nobody knows is a constant at best
            DriveLoad::Unknown => add(DriveQuantity::Offset),
            DriveLoad::PendulumRig(_) | DriveLoad::Robot => add(DriveQuantity::Armature),
        }
    }
    out
}

/// Values of the declared unknowns from which fits begin, the likeliest first.
pub fn starts(problem: &DriveProblem, unknowns: &[DriveUnknown]) -> Vec<Vec<f64>> {
    let logs = problem.logs;
    let stride = logs.len().div_ceil(LOGS);
    let some: Vec<&DriveLog> = logs.iter().step_by(stride).copied().collect();
    let few = DriveProblem {
        logs: &some,
        frame: problem.frame.clone(),
        sizes: problem.sizes.clone(),
        pieces: Vec::new(),
        blocks: 0,
        chains: problem.chains,
    };
    let mut tried = Vec::new();
    let volts = matches!(problem.frame.kind, DriveLawKind::Volts(_));
    let rates: &[f64] = if volts {
        &[3.0, 6.0, 12.0, 25.0, 50.0, 100.0]
    } else {
        &[0.0]
    };
    for rate in rates {
        for damped in [0.3, 1.0, 3.0] {
            for dry in [0.02, 0.15] {
                for (armature, limited) in [(0.3, 0.2), (0.3, 0.7), (2.0, 0.2), (2.0, 0.7)] {
                    let value = |unknown: &DriveUnknown| {
                        let j = unknown.joint.unwrap_or(0);
                        let sizes = &problem.sizes[j];
                        let own = unknowns.contains(&DriveUnknown::of(DriveQuantity::Armature, j));
                        let inertia = sizes.inertia * (1.0 + if own { armature } else { 0.0 });
                        let kp = median(logs.iter().map(|log| log.joints[j].kp).collect());
                        let damping = match volts {
                            true => 2.0 * damped * rate * inertia,
                            false => 0.1 * damped * sizes.torque / sizes.speed,
                        };
                        match unknown.quantity {
                            DriveQuantity::Stiffness => rate * rate * inertia / kp,
                            DriveQuantity::Damping | DriveQuantity::BackEmf => damping,
                            DriveQuantity::Viscous => 0.1 * damping,
                            DriveQuantity::Coulomb => dry * sizes.torque,
                            DriveQuantity::Armature => armature * sizes.inertia,
                            // where it acts, or its slope is zero
                            DriveQuantity::TorqueLimit => {
                                let most = rate * rate * inertia * sizes.farthest;
                                1.0 / (limited * most)
                            }
                            _ => 0.0,
                        }
                    };
                    let values: Vec<f64> = unknowns.iter().map(value).collect();
                    let losses = few.losses_by_joint(unknowns, &values);
                    tried.push((values, losses));
                }
            }
        }
    }
    // joints choose their starts one by one
    let joints = problem.frame.joints;
    (0..TRIED)
        .map(|rank| {
            let mut out = vec![0.0; unknowns.len()];
            for j in 0..joints {
                let mut order: Vec<usize> = (0..tried.len()).collect();
                order.sort_by(|a, b| f64::total_cmp(&tried[*a].1[j], &tried[*b].1[j]));
                let best = &tried[order[rank.min(order.len() - 1)]].0;
                for (i, unknown) in unknowns.iter().enumerate() {
                    if unknown.joint == Some(j) {
                        out[i] = best[i];
                    }
                }
            }
            out
        })
        .collect()
}
