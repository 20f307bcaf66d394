//! The integration with effects, whose torques bend and jump, against itself at tighter tolerances.

use cft_ident_core::robot::cft::LaboratorySetup;
use cft_ident_plant::simulate::cft::{follow, mechanism};
use cft_ident_plant::simulate::integrate::StepTolerance;
use cft_ident_plant::simulate::{CftTruth, OneJointMove, SimulatedRun};

use super::missing::{perfect, specs};

/// A ladder of q4 that turns at both ends, slow plateaus included.
fn ladder(text: &str, tolerance: StepTolerance) -> SimulatedRun<4> {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let reference = OneJointMove::new(2, 10.0, None)
        .reference(&mechanism(truth.setup).expect("four joints"))
        .expect("fits");
    let mut settings = perfect(10.0);
    settings.tolerance = tolerance;
    follow(&truth, &specs(&[text]), reference, &settings).expect("runs")
}

#[test]
fn tighter_tolerances_move_nothing_that_an_encoder_could_see() {
    for text in [
        "asymmetric-friction:q4:coulomb=2",
        "stribeck:q4:c=3,vs=0.02",
        "nonlinear-viscous:q4:c=2,p=0.3",
        "load-friction:q4:mu_c=0.2,w=400",
        "drive-efficiency:q4:k=0.4",
        "position-friction:q4:order=20",
        "actuator-friction",
        "backlash:q4:c=3",
        "presliding:q4",
        "elasticity:q4",
        "backlash-impact:q4",
        "torque-ripple:q4:order=30,sin=0.1",
        "gain-change:q4:signal=2,scale=2,k=0.3",
        "pose-friction:q4:from=4,sin=1",
        "coupling:q5:from=3,coulomb=2,inertia=0.05",
        "disturbance:q4:at=3.33333,seconds=0.55555,c=5",
        "drift:q4:walk=2",
    ] {
        let usual = ladder(text, StepTolerance::default());
        let tight = ladder(text, StepTolerance::default().scaled(1e-2));
        let pairs = usual.actual.q.iter().zip(&tight.actual.q);
        let apart = pairs
            .flat_map(|(a, b)| (0..4).map(move |i| (a[i] - b[i]).abs()))
            .fold(0.0_f64, f64::max);
        println!("{text}: {apart:.1e}");
        assert!(apart < 1e-7, "{text}: {apart}");
    }
}
