//! The CFT robot as the simulator runs it: equations, limits, saturation, start and rest.

use cft_ident_core::robot::cft::LaboratorySetup;
use cft_ident_plant::simulate::cft::{excitation, follow, mechanism};
use cft_ident_plant::simulate::reference::travel;
use cft_ident_plant::simulate::{CftTruth, MotorStatus, OneJointMove, RunEnding, Settings};

/// Runs one of the five standard experiments: ladders of q1, q2, q4, q5, then Table 3.
fn standard(
    setup: LaboratorySetup,
    number: usize,
    seed: u64,
) -> cft_ident_plant::simulate::SimulatedRun<4> {
    let truth = CftTruth::synthetic(setup);
    let reference = if number < 4 {
        OneJointMove::new(number, 20.0, Some(seed))
            .reference(&mechanism(setup).expect("four joints"))
            .expect("ladder fits")
    } else {
        excitation(setup)
    };
    follow(&truth, &[], reference, &Settings::new(20.0)).expect("runs")
}

#[test]
fn standard_experiments_stay_inside_every_limit_and_below_saturation() {
    for setup in [LaboratorySetup::Tuedacs, LaboratorySetup::Dspace] {
        for number in 0..5 {
            let recording = standard(setup, number, 3);
            assert_eq!(recording.ending, RunEnding::Completed, "{setup:?} {number}");
            assert_eq!(recording.rows(), 20_000);
            assert!(recording.limits.is_empty(), "{:?}", recording.limits);
            let all_running = recording
                .status
                .iter()
                .flatten()
                .all(|s| *s == MotorStatus::Running);
            assert!(all_running, "{setup:?} {number}");
        }
    }
}

#[test]
fn controller_tracks_within_millimetres_and_hundredths_of_a_radian() {
    for setup in [LaboratorySetup::Tuedacs, LaboratorySetup::Dspace] {
        let plant = CftTruth::synthetic(setup).plant().expect("a pose");
        for number in 0..5 {
            let actual = standard(setup, number, 1).actual;
            let mut worst = [0.0_f64; 4];
            for (q, target) in actual.q.iter().zip(&actual.target) {
                let x = plant.mechanism.coordinates(q);
                worst = std::array::from_fn(|i| worst[i].max((x[i] - target[i]).abs()));
            }
            for (i, bound) in [0.006, 0.003, 0.013, 0.002].into_iter().enumerate() {
                assert!(worst[i] < bound, "{setup:?} {number}: {worst:?}");
            }
        }
    }
}

#[test]
fn ladders_hold_the_other_joints_and_cover_their_own_range() {
    // Largest motion of any other joint, peak to peak, in m or rad.
    for (number, (least, most)) in [(0.5, 0.002), (5.5, 0.001), (1.75, 0.013), (1.1, 0.013)]
        .into_iter()
        .enumerate()
    {
        let recording = standard(LaboratorySetup::Tuedacs, number, 1);
        for joint in 0..4 {
            let values = recording.actual.q.iter().map(|q| q[joint]);
            let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            if joint == number {
                assert!(high - low > least, "joint {joint}: {}", high - low);
            } else {
                assert!(
                    high - low < most,
                    "joint {joint} in {number}: {}",
                    high - low
                );
            }
        }
    }
}

#[test]
fn travel_of_a_joint_ends_at_the_margin_of_a_limit() {
    let setup = LaboratorySetup::Tuedacs;
    let plant = CftTruth::synthetic(setup).plant().expect("a pose");
    let limits = setup.limits();
    let pose =
        cft_ident_core::robot::cft::pantograph::joints(&limits.middles()).expect("reachable");
    for joint in 0..4 {
        let room = travel(&plant.mechanism, &pose, joint, 0.05, &[1.0; 4]).expect("inside");
        for end in [room.range.0, room.range.1] {
            let mut q = pose;
            q[joint] = end;
            let x = cft_ident_core::robot::cft::pantograph::cartesian(&q);
            let gap = (0..4)
                .map(|i| {
                    let span = limits.spans()[i];
                    (x[i] - limits.lower[i]).min(limits.upper[i] - x[i]) / span
                })
                .fold(f64::MAX, f64::min);
            assert!((gap - 0.05).abs() < 1e-9, "joint {joint}: {gap}");
        }
    }
}
