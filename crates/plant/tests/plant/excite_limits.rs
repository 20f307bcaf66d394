//! Designed motions keep every limit, between samples and in their blends, and the simulated robot
//! follows them.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use cft_ident_files::config::{RobotFile, Trajectory};
use cft_ident_plant::excite::blend::TimeScaling;
use cft_ident_plant::excite::limits::BoundedQuantity;
use cft_ident_plant::excite::machine::ForeseenRobot;
use cft_ident_plant::excite::search::{DesignTask, design};
use cft_ident_plant::excite::series::{Kinematics, Series};
use cft_ident_plant::excite::usage::{along_blend, along_period, worst};
use cft_ident_plant::excite::{Criterion, Motion, machine, trajectory};
use cft_ident_plant::simulate::{self, Order};
use rayon::prelude::*;

fn robot(name: &str) -> RobotFile {
    RobotFile::load(Path::new(name)).expect("embedded")
}

fn built(file: &str) -> ForeseenRobot {
    machine(&robot(file), None).expect("a machine")
}

/// A design of few evaluations: what matters here is that it keeps the limits.
fn quick(machine: &ForeseenRobot, seed: u64, evaluations: u64) -> Series {
    let criteria = [
        Criterion::Condition,
        Criterion::ConditionNormalised,
        Criterion::DOptimal,
        Criterion::AOptimal(vec![1.0; 12]),
    ];
    let task = DesignTask {
        criterion: criteria[seed as usize % 4].clone(),
        fundamental_hz: [0.4, 0.25, 0.8][seed as usize % 3],
        harmonics: 1 + seed as usize % 6,
        offsets: vec![None; 4],
        reserve: 0.0,
        prior: None,
        starts: 1,
        evaluations: Some(evaluations),
        seed,
    };
    let found = design(machine, &task, &|_| {}, &AtomicBool::new(false));
    found.expect("a design").series
}

/// The largest share of a limit on equal steps.
fn on_a_grid(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    steps: usize,
    at: &dyn Fn(usize) -> Kinematics,
) -> f64 {
    let mut most = 0.0_f64;
    for m in 0..steps {
        let state = machine.state(&at(m)).expect("reachable");
        let quantities = machine.quantities(&state);
        for channel in channels {
            most = most.max(channel.used(quantities.of(channel)));
        }
    }
    most
}

#[test]
fn two_hundred_designs_keep_every_limit_on_a_fine_grid() {
    let machines = [built("configs/cft.toml"), built("configs/cft-dspace.toml")];
    let worst_share = (0..200u64)
        .into_par_iter()
        .map(|seed| {
            let machine = &machines[seed as usize % 2];
            let series = quick(machine, seed, 25);
            let step = series.period() / 8000.0;
            let at = |m: usize| series.at(step * m as f64);
            let share = on_a_grid(machine, &machine.channels, 8000, &at);
            let said = worst(&along_period(machine, &machine.channels, &series));
            // what is said of a motion is not less than what a grid finds, and hardly more
            assert!(
                said >= share - 1e-9 && said <= share + 2e-3,
                "{seed}: {said} {share}"
            );
            share
        })
        .reduce(|| 0.0, f64::max);
    assert!((0.999..=1.0).contains(&worst_share), "{worst_share}");
}

#[test]
fn blends_keep_every_limit_and_begin_and_end_at_rest() {
    let machine = built("configs/cft-dspace.toml");
    for seed in [3, 9, 14] {
        let series = quick(&machine, seed, 60);
        let reserved: Vec<BoundedQuantity> =
            machine.channels.iter().map(|c| c.reserved(-0.02)).collect();
        let blend = TimeScaling::within(&machine, &reserved, &series, 2, None).expect("a blend");
        let end = blend.duration(series.period());
        let step = end / 40_000.0;
        let at = |m: usize| blend.at(&series, step * m as f64);
        let share = on_a_grid(&machine, &machine.channels, 40_001, &at);
        let said = worst(&along_blend(&machine, &machine.channels, &series, &blend))
            .max(worst(&along_period(&machine, &machine.channels, &series)));
        assert!(share <= 1.02 + 1e-9 && said >= share - 1e-9);
        for t in [0.0, end] {
            let k = blend.at(&series, t);
            assert_eq!((k.xd, k.xdd), (Kinematics::REST.xd, Kinematics::REST.xdd));
        }
    }
}

#[test]
fn the_simulated_robot_follows_a_design_without_reaching_a_limit() {
    let file = robot("configs/cft.toml");
    let machine = built("configs/cft.toml");
    let task = DesignTask {
        criterion: Criterion::ConditionNormalised,
        fundamental_hz: 0.4,
        harmonics: 4,
        offsets: vec![None; 4],
        reserve: 0.05,
        prior: None,
        starts: 2,
        evaluations: Some(300),
        seed: 4,
    };
    let found = design(&machine, &task, &|_| {}, &AtomicBool::new(false)).expect("a design");
    let reserved: Vec<BoundedQuantity> =
        machine.channels.iter().map(|c| c.reserved(0.05)).collect();
    let blend = TimeScaling::within(&machine, &reserved, &found.series, 2, None).expect("a blend");
    let mut fourier = trajectory(&machine, &found.series);
    fourier.start_s = Some(blend.start);
    fourier.blend_s = Some(blend.seconds);
    fourier.periods = blend.periods;
    let written = Trajectory::Fourier(fourier);
    let log = simulate::simulate(&Order {
        robot: &file,
        model: None,
        experiment: simulate::Experiment::Trajectory(&written),
        seconds: None,
        effects: Vec::new(),
        seed: 1,
    })
    .expect("simulated");
    assert_eq!(log.ending, simulate::RunEnding::Completed);
    assert!(log.saturated.iter().all(|(_, share)| *share == 0.0));
    let motion = Motion::of_file(&machine, &written, 20.0, 1).expect("a motion");
    let rows: Vec<&[f64]> = log.rows().collect();
    let seconds = rows[rows.len() - 1][0];
    assert!((seconds - motion.seconds()).abs() < 2e-3, "{seconds}");
    let place = |name: &str| log.header.iter().position(|h| h == name).expect("a column");
    for (i, name) in ["x_c1", "x_c2", "x_c3", "x_c4"].iter().enumerate() {
        let column = place(name);
        for row in &rows {
            let wanted = motion.at(row[0]).x[i];
            assert!(
                (row[column] - wanted).abs() < 0.04,
                "{name} at {} s",
                row[0]
            );
        }
    }
}

#[test]
fn other_motions_are_judged_by_the_same_limits() {
    let machine = built("configs/cft.toml");
    let judged = |text: &str| {
        let trajectory = Trajectory::parse("t.toml", text).expect("a trajectory");
        let motion = Motion::of_file(&machine, &trajectory, 20.0, 1);
        worst(&motion.expect("a motion").usage(&machine, &machine.channels))
    };
    let move_of = "kind = \"single-joint\"\njoint = \"q4\"\nspeeds = [0.005, 0.02, 0.1, 0.5]\n";
    assert!((0.5..1.0).contains(&judged(move_of)));
    let points = |x: f64| {
        format!(
            "kind = \"points\"\ncoordinates = \"cartesian\"\n\
             [[point]]\nt = 0.0\nposition = [-0.13, 0.27, 2.4, 0.1]\n\
             [[point]]\nt = 2.0\nposition = [-0.13, 0.27, 2.4, {x}]\n"
        )
    };
    assert!(judged(&points(0.4)) < 1.0);
    assert!(judged(&points(0.54)) > 1.0);
    let joint = "kind = \"fourier\"\ncoordinates = \"joint\"\nfundamental_hz = 0.4\n\
                 [[coordinate]]\nname = \"q5\"\noffset = 1.6\na = [1.2]\nb = [0.0]\n";
    let share = judged(joint);
    assert!(share > 0.3 && share.is_finite(), "{share}");
    let far = joint.replace("offset = 1.6", "offset = 3.0");
    assert!(judged(&far) > 1.0);
}
