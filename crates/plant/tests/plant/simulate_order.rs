//! Simulations as they are ordered: from robot, model and trajectory files to a log that can be read.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

use cft_ident_files::config::model_file::Parameter;
use cft_ident_files::config::{RobotFile, Trajectory};
use cft_ident_logs::log::{Block, LogSpec, Reader};
use cft_ident_plant::simulate::{
    Experiment, InitialConditions, Order, Rows, RunEnding, SimulateError, SimulatedLog, TruthFile,
    simulate, simulate_from, simulate_rows,
};

use crate::simulate_effects::orders::model;

fn robot(name: &str) -> RobotFile {
    RobotFile::load(Path::new(name)).expect("embedded")
}

fn order<'a>(robot: &'a RobotFile, experiment: Experiment<'a>) -> Order<'a> {
    Order {
        robot,
        model: None,
        experiment,
        seconds: Some(20.0),
        effects: Vec::new(),
        seed: 1,
    }
}

fn trajectory(text: &str) -> Trajectory {
    Trajectory::parse("t.toml", text).expect("trajectory")
}

fn column(log: &SimulatedLog, name: &str) -> Vec<f64> {
    let place = log.header.iter().position(|h| h == name).expect(name);
    log.rows().map(|row| row[place]).collect()
}

fn span(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
    high - low
}

/// Reads the log back as the robot file says.
fn read_back(robot: &RobotFile, log: &SimulatedLog) -> Block {
    let mut file = tempfile::Builder::new()
        .suffix(".csv")
        .tempfile()
        .expect("a file");
    writeln!(file, "{}", log.header.join(",")).expect("written");
    for row in log.rows() {
        let row: Vec<String> = row.iter().map(f64::to_string).collect();
        writeln!(file, "{}", row.join(",")).expect("written");
    }
    file.flush().expect("written");
    let mut reader = Reader::open(&LogSpec::whole(file.path()), &robot.layout()).expect("opens");
    let (mut all, mut block) = (Block::default(), Block::default());
    while reader.read(&mut block).expect("reads") {
        all.t.extend(&block.t);
        all.q.extend(&block.q);
        all.tau.extend(&block.tau);
    }
    all
}

#[test]
fn cft_log_is_read_back_by_the_robot_file_that_ordered_it() {
    let robot = robot("configs/cft.toml");
    let mut order = order(&robot, Experiment::Usual);
    order.seconds = Some(2.0);
    let log = simulate(&order).expect("runs");
    assert_eq!(log.header.len(), 1 + 4 * 4 + 4);
    let block = read_back(&robot, &log);
    assert_eq!(block.t, column(&log, "t"));
    for (i, joint) in ["q1", "q2", "q4", "q5"].iter().enumerate() {
        let q = column(&log, &format!("q_{joint}"));
        let tau = column(&log, &format!("tau_{joint}"));
        assert!((0..q.len()).all(|k| block.q[4 * k + i] == q[k] && block.tau[4 * k + i] == tau[k]));
    }
    assert_eq!(log.ending, RunEnding::Completed);
    assert!(log.truth.torque_noise.iter().all(|std| *std > 0.0));
}

#[test]
fn every_embedded_cft_robot_simulates_its_moves_without_reaching_a_limit() {
    for name in ["configs/cft.toml", "configs/cft-dspace.toml"] {
        let robot = robot(name);
        for mover in ["q1", "q2", "q4", "q5", "x_c1", "x_c2", "x_c3", "x_c4"] {
            let log = simulate(&order(&robot, Experiment::of_joint(mover))).expect(mover);
            assert_eq!(
                log.ending,
                RunEnding::Completed,
                "{name} {mover}: {:?}",
                log.limits
            );
            assert_eq!(log.rows().len(), 20_000);
            assert!(
                log.saturated.iter().all(|(_, share)| *share == 0.0),
                "{name} {mover}: {:?}",
                log.saturated
            );
        }
    }
}

#[test]
fn motor_moves_move_one_coordinate_and_hold_the_others() {
    let robot = robot("configs/cft.toml");
    let log = simulate(&order(&robot, Experiment::of_joint("x_c2"))).expect("runs");
    assert!(span(&column(&log, "x_c2")) > 0.5);
    for (name, most) in [("x_c1", 0.006), ("x_c3", 0.005), ("x_c4", 0.002)] {
        let moved = span(&column(&log, name));
        assert!(moved < most, "{name}: {moved}");
    }
}

#[test]
fn raw_channels_are_written_as_the_log_section_reads_them() {
    let mut robot = robot("configs/cft.toml");
    let plain = simulate(&Order {
        seconds: Some(1.0),
        ..order(&robot, Experiment::Usual)
    })
    .expect("runs");
    let text = "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n[log]\nchannels = \"actuator\"\n[log.actuator.x_c1]\nposition = \"enc1\"\n\
                position_unit = \"counts\"\nhome = -0.1\nposition_sign = -1.0\n[sensors]\ntorque_noise_relative = 0.01\n";
    robot.log = RobotFile::parse("robot.toml", text)
        .expect("robot file")
        .log;
    let counted = simulate(&Order {
        seconds: Some(1.0),
        ..order(&robot, Experiment::Usual)
    })
    .expect("runs");
    assert!(
        counted.header.contains(&"enc1".to_owned()) && !counted.header.contains(&"q_q1".to_owned())
    );
    let (counts, x) = (column(&counted, "enc1"), column(&plain, "x_c1"));
    for (count, x) in counts.iter().zip(&x) {
        assert!((-8.7989e-6 * count - 0.1 - x).abs() < 1e-12);
    }
    let block = read_back(&robot, &counted);
    let q = column(&plain, "q_q4");
    assert!((0..q.len()).all(|k| (block.q[4 * k + 2] - q[k]).abs() < 1e-9));
}

#[test]
fn trajectory_files_of_every_kind_are_followed() {
    let robot = robot("configs/cft.toml");
    let table = Trajectory::load(Path::new("configs/table3.toml")).expect("embedded");
    let by_file = simulate(&order(&robot, Experiment::Trajectory(&table))).expect("runs");
    let usual = simulate(&order(&robot, Experiment::Usual)).expect("runs");
    assert_eq!(by_file.values, usual.values, "Table 3 is the usual motion");

    let one = trajectory(
        "kind = \"fourier\"\ncoordinates = \"joint\"\nfundamental_hz = 0.5\n[[coordinate]]\nname = \"q2\"\noffset = 0.2\na = [0.6]\nb = [0.0]\n",
    );
    let log = simulate(&order(&robot, Experiment::Trajectory(&one))).expect("runs");
    let expected = 2.0 * 0.6 / std::f64::consts::PI;
    assert!((span(&column(&log, "q_q2")) / expected - 1.0).abs() < 0.05);
    assert!(span(&column(&log, "q_q1")) < 0.01);

    let ladder = trajectory(
        "kind = \"single-joint\"\njoint = \"q5\"\nspeeds = [0.5, 0.05]\nrange = [1.6, 2.2]\nacceleration = 5.0\n",
    );
    let log = simulate(&order(&robot, Experiment::Trajectory(&ladder))).expect("runs");
    assert!((span(&column(&log, "q_q5")) - 0.6).abs() < 0.02);

    let list = trajectory(
        "kind = \"points\"\ncoordinates = \"cartesian\"\n\
         [[point]]\nt = 1.0\nposition = [-0.1, 0.2, 2.0, 0.1]\n\
         [[point]]\nt = 3.0\nposition = [-0.2, 0.3, 2.5, 0.3]\n\
         [[point]]\nt = 4.0\nposition = [-0.2, 0.3, 2.5, 0.3]\n",
    );
    let mut request = order(&robot, Experiment::Trajectory(&list));
    request.seconds = None;
    let log = simulate(&request).expect("runs");
    assert_eq!(log.rows().len(), 3000, "the list's own duration");
    let x = column(&log, "x_c4");
    assert!((x[x.len() - 1] - 0.3).abs() < 0.002, "{}", x[x.len() - 1]);
}

#[test]
fn logged_volts_of_one_run_drive_another() {
    let mut robot = robot("configs/cft.toml");
    robot.sensors.quantisation = Some(false);
    let first = simulate(&Order {
        seconds: Some(2.0),
        ..order(&robot, Experiment::Usual)
    })
    .expect("runs");
    let times = column(&first, "t");
    let columns: Vec<Vec<f64>> = (1..=4).map(|i| column(&first, &format!("u_{i}"))).collect();
    let volts: Vec<f64> = (0..times.len())
        .flat_map(|k| [0, 1, 2, 3].map(|i| columns[i][k]))
        .collect();
    let replayed = simulate(&Order {
        seconds: None,
        ..order(
            &robot,
            Experiment::Volts {
                times: &times,
                volts: &volts,
            },
        )
    })
    .expect("runs");
    assert_eq!(replayed.rows().len(), 2000, "as long as the volts");
    for i in 1..=4 {
        let name = format!("u_{i}");
        assert_eq!(column(&replayed, &name), column(&first, &name));
    }
}

#[test]
fn ordered_initial_conditions_are_where_the_log_begins() {
    let robot = robot("configs/cft.toml");
    let (times, volts) = ([0.0, 0.01], [0.0; 8]);
    let motion = Experiment::Volts {
        times: &times,
        volts: &volts,
    };
    let request = Order {
        seconds: Some(0.02),
        ..order(&robot, motion)
    };
    let mut initial = InitialConditions {
        position: vec![-0.1, 0.2, 1.5, 0.3],
        speed: vec![0.0, 0.0, 0.0, 0.1],
    };
    let log = simulate_from(&request, Some(&initial)).expect("runs");
    for (name, position) in ["x_c1", "x_c2", "x_c3", "x_c4"]
        .iter()
        .zip(&initial.position)
    {
        assert!((column(&log, name)[0] - position).abs() < 1e-5);
    }
    let q1 = column(&log, "q_q1");
    assert!(((q1[5] - q1[0]) / 5e-3 - 0.1).abs() < 0.01);
    initial.speed.pop();
    assert!(simulate_from(&request, Some(&initial)).is_err());
}

#[test]
fn truth_of_a_model_is_the_model_and_effects_are_added_to_it() {
    let robot = robot("configs/cft.toml");
    let synthetic = simulate(&Order {
        seconds: Some(1.0),
        ..order(&robot, Experiment::Usual)
    })
    .expect("runs");
    let mut parameters = synthetic.truth.parameters.clone();
    parameters[0].value = 130.0;
    let model = model(&robot, parameters, Vec::new());
    let heavy = simulate(&Order {
        seconds: Some(1.0),
        model: Some(("model.toml", &model)),
        effects: vec!["torque-offset:q4:c=1.0".parse().expect("read")],
        ..order(&robot, Experiment::Usual)
    })
    .expect("runs");
    assert_eq!(heavy.truth.parameters, model.parameters);
    assert_eq!(heavy.truth.effects.len(), 1);
    assert_ne!(heavy.values, synthetic.values);
    let text = heavy.truth.to_toml().expect("written");
    assert_eq!(TruthFile::parse(&text).expect("read"), heavy.truth);
    let value: toml::Table = text.parse().expect("TOML");
    assert_eq!(value["seed"].as_integer(), Some(1));
    assert_eq!(value["parameter"][0]["value"].as_float(), Some(130.0));
    assert_eq!(
        value["effect"][0]["parameters"]["c"]["value"].as_float(),
        Some(1.0)
    );

    let mut short = model.clone();
    short.parameters.truncate(5);
    let outcome = simulate(&Order {
        model: Some(("model.toml", &short)),
        ..order(&robot, Experiment::Usual)
    });
    assert!(matches!(outcome, Err(SimulateError::Config(_))));
}

#[test]
fn single_joint_robot_runs_a_ladder_over_its_declared_travel() {
    let mut robot = robot("configs/emps.toml");
    let parse = |text: &str| RobotFile::parse("robot.toml", text).expect("robot file");
    let extra = parse(
        "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"prismatic\"\n[limits.q1]\nposition = [0.0, 0.25]\n\
         [noise.joint.q1]\nposition_resolution = 1e-6\n[sensors]\ntorque_noise_relative = 0.01\n",
    );
    robot.limits = extra.limits;
    robot.noise = extra.noise;
    robot.sensors = extra.sensors;
    let refused = simulate(&order(&robot, Experiment::Usual)).expect_err("no parameters");
    assert!(refused.to_string().contains("-m"), "{refused}");
    let parameter = |name: &str, joint: Option<&str>, value: f64| Parameter {
        name: name.to_owned(),
        theta: None,
        joint: joint.map(str::to_owned),
        value,
        consistent: None,
        std: None,
        unit: String::new(),
        meaning: String::new(),
        verdict: None,
    };
    let parameters = vec![
        parameter("inertia", None, 95.1089),
        parameter("viscous", Some("q1"), 203.5034),
        parameter("coulomb", Some("q1"), 20.3935),
        parameter("offset", Some("q1"), -3.1648),
    ];
    let model = model(&robot, parameters, Vec::new());
    let ordered = Order {
        model: Some(("emps-model.toml", &model)),
        ..order(&robot, Experiment::of_joint("q1"))
    };
    let log = simulate(&ordered).expect("runs");
    assert_eq!(log.header, ["t", "q1", "tau1"], "named as [log] reads them");
    assert_eq!(log.ending, RunEnding::Completed);
    assert!((span(&column(&log, "q1")) - 0.225).abs() < 0.005);
    let values = |parameters: &[Parameter]| -> Vec<(String, f64)> {
        parameters.iter().map(|p| (p.key(), p.value)).collect()
    };
    assert_eq!(values(&log.truth.parameters), values(&model.parameters));
    let other = simulate(&Order {
        experiment: Experiment::of_joint("q9"),
        ..ordered
    });
    assert!(matches!(other, Err(SimulateError::UnknownJoint { .. })));
}

#[test]
fn orders_that_name_what_is_not_there_are_refused() {
    let robot = robot("configs/cft.toml");
    let text = |motion| {
        simulate(&order(&robot, motion))
            .expect_err("refused")
            .to_string()
    };
    assert!(text(Experiment::of_joint("q3")).contains("q1, q2, q4, q5, x_c1"));
    let other = trajectory(
        "kind = \"points\"\ncoordinates = \"joint\"\n[[point]]\nt = 0.0\nposition = [0.1]\n[[point]]\nt = 1.0\nposition = [0.2]\n",
    );
    assert!(text(Experiment::Trajectory(&other)).contains("has 1 coordinates and the robot has 4"));
    let mut dspace = robot.clone();
    dspace.robot.setup = Some(cft_ident_core::robot::cft::LaboratorySetup::Dspace);
    let table = Trajectory::load(Path::new("configs/table3.toml")).expect("embedded");
    let refused = simulate(&order(&dspace, Experiment::Trajectory(&table))).expect_err("outside");
    assert!(refused.to_string().contains("x_c4"), "{refused}");
}

/// Rows as they were handed on, and how many came at once at most.
#[derive(Default)]
struct Taken {
    header: Vec<String>,
    values: Vec<f64>,
    most: usize,
    calls_left: Option<usize>,
}

impl Rows for Taken {
    fn take(&mut self, header: &[String], values: &[f64]) -> ControlFlow<()> {
        self.header = header.to_vec();
        self.values.extend_from_slice(values);
        self.most = self.most.max(values.len() / header.len());
        match &mut self.calls_left {
            Some(0) => ControlFlow::Break(()),
            Some(left) => {
                *left -= 1;
                ControlFlow::Continue(())
            }
            None => ControlFlow::Continue(()),
        }
    }
}

#[test]
fn rows_that_are_handed_on_block_by_block_are_those_of_the_log_in_memory() {
    // noise that is a share of the run's own, jitter and lost rows: what a block alone does not know
    let mut text = cft_ident_files::config::text("configs/cft.toml".as_ref()).unwrap();
    text = text.replace("[sensors]\n", "[sensors]\njitter = 0.01\ndropouts = 0.05\n");
    let robot = RobotFile::parse("noisy.toml", &text).expect("robot");
    let order = order(&robot, Experiment::Usual);
    let whole = simulate(&order).expect("runs");
    let mut taken = Taken::default();
    let known = simulate_rows(&order, None, &mut taken).expect("runs");
    assert_eq!(taken.header, whole.header);
    assert_eq!(taken.values, whole.values);
    assert_eq!(known.truth, whole.truth);
    assert_eq!(known.limits, whole.limits);
    assert_eq!(known.saturated, whole.saturated);
    assert!(
        taken.most <= 4096 && whole.rows().len() > 4 * 4096,
        "{}",
        taken.most
    );

    let mut stopped = Taken {
        calls_left: Some(1),
        ..Taken::default()
    };
    let error = simulate_rows(&order, None, &mut stopped).expect_err("stops");
    assert!(matches!(error, SimulateError::Stopped));
    assert!(stopped.values.len() < whole.values.len() / 2);
}
