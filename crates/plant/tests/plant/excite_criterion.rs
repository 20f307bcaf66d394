//! What a design makes small: condition numbers of known motions, and what designs reach.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use cft_ident_files::config::{RobotFile, Trajectory};
use cft_ident_plant::excite::information::InformationFactors;
use cft_ident_plant::excite::machine::ForeseenRobot;
use cft_ident_plant::excite::search::{DesignTask, FoundMotion, design};
use cft_ident_plant::excite::series::Series;
use cft_ident_plant::excite::usage::{along_period, worst};
use cft_ident_plant::excite::{
    Criterion, GivenInformation, PriorInformation, machine, series_of, trajectory,
};

fn built(robot: &str) -> ForeseenRobot {
    let robot = RobotFile::load(Path::new(robot)).expect("embedded");
    machine(&robot, None).expect("a machine")
}

fn table_3(machine: &ForeseenRobot) -> Series {
    let file = Trajectory::load(Path::new("configs/table3.toml")).expect("embedded");
    let Trajectory::Fourier(file) = file else {
        panic!("a Fourier series");
    };
    series_of(machine, &file).expect("fits the machine")
}

fn task(criterion: Criterion) -> DesignTask {
    DesignTask {
        criterion,
        fundamental_hz: 0.4,
        harmonics: 4,
        offsets: vec![None; 4],
        reserve: 0.05,
        prior: None,
        starts: 6,
        evaluations: None,
        seed: 1,
    }
}

fn found(machine: &ForeseenRobot, task: &DesignTask) -> FoundMotion {
    design(machine, task, &|_| {}, &AtomicBool::new(false)).expect("a design")
}

fn condition(machine: &ForeseenRobot, series: &Series) -> [f64; 2] {
    let information = InformationFactors::of_period(machine, series, 250).expect("reachable");
    [Criterion::Condition, Criterion::ConditionNormalised]
        .map(|c| information.value(machine, &c, None).expect("finite"))
}

fn keeps_limits(machine: &ForeseenRobot, series: &Series) -> bool {
    worst(&along_period(machine, &machine.channels, series)) <= 1.0
}

#[test]
fn table_3_has_condition_159_07_raw_and_91_73_normalised() {
    let machine = built("configs/cft.toml");
    let series = table_3(&machine);
    for samples in [25, 48, 250] {
        let information =
            InformationFactors::of_period(&machine, &series, samples).expect("reachable");
        let value = |c| information.value(&machine, &c, None).expect("finite");
        assert!((value(Criterion::Condition) - 159.07).abs() < 0.005);
        assert!((value(Criterion::ConditionNormalised) - 91.73).abs() < 0.005);
    }
}

#[test]
fn designs_reach_15_raw_and_9_normalised_within_every_limit() {
    let machine = built("configs/cft.toml");
    let raw = found(&machine, &task(Criterion::Condition)).series;
    let normalised = found(&machine, &task(Criterion::ConditionNormalised)).series;
    assert!(condition(&machine, &raw)[0] < 15.0);
    assert!(condition(&machine, &normalised)[1] < 9.0);
    for series in [&raw, &normalised] {
        assert!(keeps_limits(&machine, series));
    }
}

#[test]
fn given_offsets_are_kept_and_dspace_volts_bind() {
    let machine = built("configs/cft-dspace.toml");
    let offsets = [None, Some(0.2766), Some(2.4), Some(-0.2)];
    let task = DesignTask {
        offsets: offsets.to_vec(),
        starts: 3,
        ..task(Criterion::ConditionNormalised)
    };
    let series = found(&machine, &task).series;
    for (offset, kept) in offsets.iter().zip(&series.offset) {
        assert!(offset.is_none_or(|offset| offset == *kept));
    }
    assert!(keeps_limits(&machine, &series));
    let uses = along_period(&machine, &machine.channels, &series);
    let most = uses
        .iter()
        .filter(|u| u.channel.unit == "V")
        .map(|u| u.share)
        .fold(0.0, f64::max);
    assert!((0.9..=0.95).contains(&most), "{most}");
}

#[test]
fn a_design_after_another_tells_what_the_first_leaves_open() {
    let mut machine = built("configs/cft.toml");
    machine.noise = vec![2.0, 0.3, 0.2, 0.3];
    let first = table_3(&machine);
    let information = InformationFactors::of_period(&machine, &first, 250).expect("reachable");
    let mut given = GivenInformation::nothing(&machine);
    given.add_motion(&information, 2500.0);
    let weights: Vec<f64> = machine.noise.iter().map(|s| 1.0 / s).collect();
    let criterion = Criterion::AOptimal(vec![1.0; 12]);
    let prior = PriorInformation {
        information: given.weighted(&weights),
        rows: 2500.0,
    };
    let task = DesignTask {
        starts: 3,
        evaluations: Some(400),
        ..task(criterion.clone())
    };
    let alone = found(&machine, &task).series;
    let together = DesignTask {
        prior: Some(prior.clone()),
        ..task
    };
    let complement = found(&machine, &together).series;
    let value = |series: &Series| {
        let information = InformationFactors::of_period(&machine, series, 250).expect("reachable");
        let value = information.value(&machine, &criterion, Some(&prior));
        value.expect("finite")
    };
    // the trace with the first motion: repeated, beside the best alone, beside its complement
    assert!(value(&alone) < value(&first) - 1.0);
    assert!(value(&complement) <= value(&alone) + 1e-3);
}

#[test]
fn chosen_parameters_become_surer_than_by_any_other_criterion() {
    let machine = built("configs/cft.toml");
    let mut factors = vec![0.0; 12];
    factors[5] = 1.0;
    let chosen = Criterion::AOptimal(factors);
    let quick = |criterion| DesignTask {
        starts: 3,
        evaluations: Some(500),
        ..task(criterion)
    };
    let value = |series: &Series| {
        let information = InformationFactors::of_period(&machine, series, 250).expect("reachable");
        information.value(&machine, &chosen, None).expect("finite")
    };
    let own = value(&found(&machine, &quick(chosen.clone())).series);
    for other in [Criterion::Condition, Criterion::DOptimal] {
        assert!(own < value(&found(&machine, &quick(other)).series));
    }
}

#[test]
fn single_joints_are_designed_with_their_linear_friction() {
    let robot = RobotFile::load(Path::new("configs/emps.toml")).expect("embedded");
    let text = "[limits.q1]\nposition = [0.0, 0.25]\nspeed = 0.15\nacceleration = 1.0\n";
    let whole = format!(
        "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"prismatic\"\n[friction]\nfitted_with_inertias = true\noffset = true\n{text}"
    );
    let bounded = RobotFile::parse("one.toml", &whole).expect("a robot file");
    let machine = machine(&bounded, None).expect("a machine");
    let task = DesignTask {
        offsets: vec![None],
        starts: 4,
        ..task(Criterion::ConditionNormalised)
    };
    let series = found(&machine, &task).series;
    assert!(keeps_limits(&machine, &series));
    // acceleration, speed, sign and constant: the sign is never far from the speed
    assert!(condition(&machine, &series)[1] < 4.0);
    let unbounded = cft_ident_plant::excite::machine(&robot, None).expect("a machine");
    let error = design(&unbounded, &task, &|_| {}, &AtomicBool::new(false));
    let message = error.expect_err("no travel").to_string();
    assert!(message.contains("[limits.q1] position"), "{message}");
}

#[test]
fn a_design_reads_back_from_its_file_to_the_same_series() {
    let machine = built("configs/cft.toml");
    let task = DesignTask {
        starts: 2,
        evaluations: Some(60),
        ..task(Criterion::DOptimal)
    };
    let series = found(&machine, &task).series;
    let file = Trajectory::Fourier(trajectory(&machine, &series));
    let text = file.to_toml("");
    let back = Trajectory::parse("t.toml", &text).expect("readable");
    assert_eq!(back, file);
    let Trajectory::Fourier(back) = back else {
        panic!("a Fourier series");
    };
    let back = series_of(&machine, &back).expect("fits");
    assert_eq!(
        (back.offset, back.a, back.b),
        (series.offset, series.a, series.b)
    );
}

#[test]
fn a_stopped_search_gives_what_it_has() {
    let machine = built("configs/cft.toml");
    let stopped = design(
        &machine,
        &task(Criterion::Condition),
        &|_| {},
        &AtomicBool::new(true),
    );
    let stopped = stopped.expect("the repaired starts");
    assert!(stopped.stopped && stopped.evaluations == 0);
    assert!(keeps_limits(&machine, &stopped.series));
}

#[test]
fn designs_do_not_depend_on_the_number_of_threads() {
    let machine = built("configs/cft.toml");
    let task = DesignTask {
        starts: 5,
        evaluations: Some(120),
        ..task(Criterion::Condition)
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a pool").install(|| found(&machine, &task))
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.series, three.series);
    assert_eq!(one.evaluations, three.evaluations);
}
