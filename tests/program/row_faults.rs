//! Faults in the rows of logs, put into measured logs and simulated arms: each is named with its joint
//! and its place, and mended or left out; on the logs as they were measured nothing is.

mod sound;

use crate::altered_log;
use crate::measured_support;

use std::path::Path;
use std::sync::Arc;

use altered_log::Log;
use cft_ident::inspect::{
    FaultKind, InspectedChannel, InspectionDepth, InspectionGate, LogFault, LogFindings, LogJudge,
};
use cft_ident::log::{Block, Layout, LogArrays, LogSpec, Reader, RowFault};
use cft_ident::simulate::Experiment;
use measured_support::{run, shared};

/// Kinds of faults that this file is about.
const OF_ROWS: [FaultKind; 5] = [
    FaultKind::PositionStep,
    FaultKind::WrappedEncoder,
    FaultKind::SampleAndHold,
    FaultKind::Stall,
    FaultKind::StuckChannel,
];

/// Times, positions and torques of a log in memory.
#[derive(Debug, Clone)]
struct Rows {
    name: String,
    t: Vec<f64>,
    /// One list per joint.
    q: Vec<Vec<f64>>,
    tau: Vec<Vec<f64>>,
    /// Radians or metres per unit of its positions.
    unit: f64,
}

impl Rows {
    fn measured(file: &str, q: &[String], tau: &[String], unit: f64) -> Option<Self> {
        let text = std::fs::read_to_string(shared(file)?).unwrap();
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().unwrap().split(',').collect();
        let rows: Vec<Vec<f64>> = lines
            .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
            .collect();
        let column = |name: &String| -> Vec<f64> {
            let place = names.iter().position(|known| known == name).expect(name);
            rows.iter().map(|row| row[place]).collect()
        };
        Some(Self {
            name: file.to_owned(),
            t: rows.iter().map(|row| row[0]).collect(),
            q: q.iter().map(column).collect(),
            tau: tau.iter().map(column).collect(),
            unit,
        })
    }

    fn simulated(experiment: Experiment) -> Self {
        let mut log = Log::simulated(experiment, 20.0);
        let joints = ["q1", "q2", "q4", "q5"];
        let t = log.column("t").clone();
        let mut columns = |kind: &str| {
            let each = joints.iter();
            each.map(|joint| log.column(&format!("{kind}_{joint}")).clone())
                .collect()
        };
        Self {
            name: "simulated".to_owned(),
            t,
            q: columns("q"),
            tau: columns("tau"),
            unit: 1.0,
        }
    }

    fn joints(&self) -> usize {
        self.q.len()
    }

    fn middle(&self) -> usize {
        self.t.len() / 2
    }

    /// What the detectors say of it.
    fn judged(&self, depth: InspectionDepth) -> LogFindings {
        let names = (0..self.joints()).map(|j| format!("q_{j}"));
        let names = names.chain((0..self.joints()).map(|j| format!("tau_{j}")));
        let channels = names.map(|name| InspectedChannel::guessed(&name)).collect();
        let mut judge = LogJudge::new(channels, depth);
        for from in (0..self.t.len()).step_by(4096) {
            let rows = from..(from + 4096).min(self.t.len());
            let columns = self.q.iter().chain(&self.tau);
            let columns: Vec<&[f64]> = columns.map(|column| &column[rows.clone()]).collect();
            judge.take(&self.t[rows.clone()], &columns);
        }
        judge.finish()
    }

    /// The same as a log in memory.
    fn arrays(&self) -> (Arc<LogArrays>, Layout) {
        let by_rows = |columns: &[Vec<f64>]| -> Vec<f64> {
            let rows = 0..self.t.len();
            rows.flat_map(|k| columns.iter().map(move |column| column[k]))
                .collect()
        };
        let (q, tau) = (by_rows(&self.q), by_rows(&self.tau));
        let arrays = LogArrays::new(&self.name, self.t.clone(), q, tau).unwrap();
        let joints: Vec<String> = (0..self.joints()).map(|j| j.to_string()).collect();
        (Arc::new(arrays), Layout::joint_columns(&joints))
    }

    fn gate(&self, keep: &[RowFault]) -> InspectionGate {
        let (arrays, layout) = self.arrays();
        let open = || Reader::of_arrays(&arrays, layout.clone());
        let found = InspectionGate::look(&open, keep, &|| false, &mut |_, _| {});
        found.unwrap().unwrap()
    }

    /// What a fit reads of it, and how many rows it leaves out.
    fn read(&self) -> (Block, u64) {
        let gate = self.gate(&[]);
        let (arrays, layout) = self.arrays();
        let mut reader = Reader::of_arrays(&arrays, layout).unwrap();
        reader.mend(gate.mending());
        let mut cutter = gate.cutter(&|dt| 2.5 * dt);
        let (mut all, mut block) = (Block::default(), Block::default());
        while reader.read(&mut block).unwrap() {
            cutter.cut(&mut block);
            all.t.extend(&block.t);
            all.q.extend(&block.q);
            all.tau.extend(&block.tau);
        }
        (all, cutter.removed())
    }
}

fn arm(file: &str, joints: usize, q: &str, tau: &str, unit: f64) -> Option<Rows> {
    let names = |kind: &str| {
        (1..=joints)
            .map(|j| format!("{kind}{j}"))
            .collect::<Vec<_>>()
    };
    Rows::measured(file, &names(q), &names(tau), unit)
}

/// The measured logs, as far as they are there, and simulated ones.
fn all() -> Vec<Rows> {
    let degree = std::f64::consts::PI / 180.0;
    let kr300 = |file| arm(file, 6, "act_pos_mot_deg_", "act_torque_abs_nm_", degree);
    let pendulum = |file: &str| arm(&format!("pendulum/{file}.csv"), 2, "pos", "tau", 1.0);
    let measured = [
        arm("emps/emps_id.csv", 1, "q", "tau", 1.0),
        arm("emps/emps_pulses_val.csv", 1, "q", "tau", 1.0),
        arm("tx40/tx40_joint.csv", 6, "q", "tau", 1.0),
        arm("panda/panda_exciting.csv", 7, "q", "tau", 1.0),
        arm("ur10/ur10_exciting.csv", 6, "q", "tau", 1.0),
        kr300("kr300/A.csv"),
        kr300("kr300/B.csv"),
        kr300("kr300/C.csv"),
        pendulum("055032"),
        pendulum("060143"),
        pendulum("060245"),
        pendulum("061157"),
        pendulum("061705"),
    ];
    let simulated = [Experiment::Usual, Experiment::of_joint("q4")].map(Rows::simulated);
    measured.into_iter().flatten().chain(simulated).collect()
}

fn of_kind(found: &LogFindings, kind: FaultKind) -> Vec<&LogFault> {
    found.faults.iter().filter(|f| f.kind == kind).collect()
}

#[test]
fn a_position_that_steps_is_named_with_its_joint_and_its_time_and_the_log_is_parted_there() {
    for log in all() {
        let plain = log.judged(InspectionDepth::Gate);
        for joint in 0..log.joints() {
            for size in [0.001f64, -0.01, 0.1] {
                // A clock that repeats samples, and coarse encoders, hide what is smaller: there one row
                // in a hundred leaps by 1.7, 2 and 0.2 mrad by itself.
                let hidden = match log.name.split('/').next() {
                    Some("panda" | "pendulum") => 0.05,
                    Some("tx40") => 0.005,
                    _ => 0.0,
                };
                if size.abs() < hidden {
                    continue;
                }
                let mut stepped = log.clone();
                let (row, height) = (log.middle(), size / log.unit);
                stepped.q[joint][row..]
                    .iter_mut()
                    .for_each(|q| *q += height);
                let found = stepped.judged(InspectionDepth::Gate);
                let what = format!("{} q_{joint} {size}", log.name);
                let steps = of_kind(&found, FaultKind::PositionStep);
                assert_eq!(steps.len(), 1, "{what}: {:?}", found.faults);
                let step = steps[0];
                assert_eq!(step.channel, Some(format!("q_{joint}")), "{what}");
                let near = log.t[row - 2]..log.t[row + 3];
                assert!(near.contains(&step.log_to_s), "{what}: {step:?}");
                let shown = step.size.unwrap();
                assert!((shown / height - 1.0).abs() < 0.2, "{what}: {shown}");
                let other = |f: &&LogFault| f.kind != FaultKind::PositionStep;
                let others = found.faults.iter().filter(other).count();
                assert_eq!(others, plain.faults.len(), "{what}: {:?}", found.faults);
                let cut = found
                    .cuts
                    .iter()
                    .any(|[from, to]| *from < log.t[row] && log.t[row] <= *to);
                assert!(cut, "{what}");
            }
        }
    }
}

#[test]
fn what_the_robot_file_keeps_is_reported_but_not_acted_upon() {
    let mut log = Rows::simulated(Experiment::Usual);
    let row = log.middle();
    log.q[2][row..].iter_mut().for_each(|q| *q += 0.01);
    let costs = |gate: &InspectionGate| {
        gate.costs()
            .iter()
            .map(|cost| cost.kind)
            .collect::<Vec<_>>()
    };
    assert_eq!(costs(&log.gate(&[])), [FaultKind::PositionStep]);
    let kept = log.gate(&[RowFault::PositionStep]);
    assert!(costs(&kept).is_empty() && kept.warnings().is_empty());
}

#[test]
fn an_encoder_that_begins_anew_is_named_with_its_range_and_followed_through_its_turns() {
    for log in all() {
        let turn = std::f64::consts::TAU / log.unit;
        for joint in 0..log.joints() {
            let travel = |q: &[f64]| {
                let (low, high) = q
                    .iter()
                    .fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
                [low, high]
            };
            let [low, high] = travel(&log.q[joint]);
            // A joint of less than a degree may stop at the very end.
            if log.name.starts_with("emps") || high - low < 0.02 / log.unit {
                continue;
            }
            let mut wrapped = log.clone();
            let middle = 0.5 * (low + high);
            for q in &mut wrapped.q[joint] {
                *q = (*q - middle).rem_euclid(turn);
            }
            let found = wrapped.judged(InspectionDepth::Gate);
            let what = format!("{} q_{joint}", log.name);
            let shown = of_kind(&found, FaultKind::WrappedEncoder);
            assert_eq!(shown.len(), 1, "{what}: {:?}", found.faults);
            assert_eq!(shown[0].channel, Some(format!("q_{joint}")), "{what}");
            assert!((shown[0].size.unwrap() / turn - 1.0).abs() < 1e-9, "{what}");
            let (read, _) = wrapped.read();
            let (plain, _) = log.read();
            assert_eq!(read.t.len(), plain.t.len(), "{what}");
            let n = log.joints();
            let offsets = (0..read.t.len()).map(|k| read.q[k * n + joint] - plain.q[k * n + joint]);
            let [least, most] = travel(&offsets.collect::<Vec<_>>());
            assert!(most - least < 1e-9 * turn, "{what}: {}", most - least);
        }
    }
}

#[test]
fn a_counter_of_any_range_is_followed_where_the_robot_file_declares_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.csv");
    let motion = |k: u32| 700.0 * (f64::from(k) * 0.004).sin();
    let rows: String = (0..3000)
        .map(|k| {
            format!(
                "{},{},{}\n",
                f64::from(k) * 1e-3,
                motion(k).rem_euclid(321.0),
                k % 7
            )
        })
        .collect();
    std::fs::write(&path, format!("t,q_1,tau_1\n{rows}")).unwrap();
    let mut layout = Layout::joint_columns(&["1"]);
    layout.positions[0].wrap = Some(321.0);
    for span in ["", "@1.2..s"] {
        let spec: LogSpec = format!("{}{span}", path.display()).parse().unwrap();
        let mut reader = Reader::open(&spec, &layout).unwrap();
        let mut block = Block::default();
        reader.read(&mut block).unwrap();
        for (t, q) in block.t.iter().zip(&block.q) {
            let k = (t * 1e3).round() as u32;
            assert!((q - motion(k)).abs() < 1e-9, "{span} {t}: {q}");
        }
    }
}

#[test]
fn of_samples_that_are_held_only_fresh_rows_are_used() {
    for log in all()
        .into_iter()
        .filter(|log| !log.name.starts_with("panda"))
    {
        if log.t.len() < 2400 {
            continue;
        }
        for hold in 2..=5 {
            let mut held = log.clone();
            for column in held.q.iter_mut().chain(&mut held.tau) {
                for k in 0..column.len() {
                    column[k] = column[k - k % hold];
                }
            }
            let what = format!("{} held for {hold}", log.name);
            let found = held.judged(InspectionDepth::Whole);
            let shown = of_kind(&found, FaultKind::SampleAndHold);
            assert_eq!(shown.len(), 1, "{what}: {:?}", found.faults);
            let gate = held.gate(&[]);
            assert_eq!(gate.mending().held, Some(hold), "{what}");
            let (read, _) = held.read();
            let rows = log.t.len().div_ceil(hold);
            assert!(
                read.t.len().abs_diff(rows) <= rows / 50,
                "{what}: {}",
                read.t.len()
            );
        }
    }
}

#[test]
fn stretches_in_which_everything_is_frozen_are_stalls_and_left_out() {
    for log in all() {
        // The motors of these are off half of the time, or the robot rests there.
        if log.name.starts_with("pendulum/06") {
            continue;
        }
        let mut frozen = log.clone();
        let mut expected = Vec::new();
        for part in 1..=3 {
            // where the robot moves: at the fastest row about a quarter of the log
            let from = part * log.t.len() / 4;
            let speed = |k: usize| -> f64 {
                log.q
                    .iter()
                    .map(|q| ((q[k + 1] - q[k - 1]) / (q[k] - q[0]).abs().max(1e-3)).abs())
                    .sum()
            };
            let k = (from - 200..from + 200)
                .max_by(|a, b| speed(*a).total_cmp(&speed(*b)))
                .unwrap();
            let rows = 60;
            for column in frozen.q.iter_mut().chain(&mut frozen.tau) {
                let value = column[k];
                column[k..k + rows].fill(value);
            }
            expected.push((log.t[k], log.t[k + rows - 1]));
        }
        let found = frozen.judged(InspectionDepth::Gate);
        let shown: Vec<(f64, f64)> = of_kind(&found, FaultKind::Stall)
            .iter()
            .map(|f| (f.log_from_s, f.log_to_s))
            .collect();
        assert_eq!(shown.len(), 3, "{}: {:?}", log.name, found.faults);
        for ((from, to), (a, b)) in shown.iter().zip(&expected) {
            assert!(
                (from - a).abs() < 0.05 && (to - b).abs() < 0.05,
                "{}: {shown:?}",
                log.name
            );
        }
        let stuck = of_kind(&found, FaultKind::StuckChannel).len();
        let steps = of_kind(&found, FaultKind::PositionStep).len();
        assert_eq!((stuck, steps), (0, 0), "{}: {:?}", log.name, found.faults);
    }
}

#[test]
fn one_row_spikes_are_bridged_and_cost_no_row() {
    for log in all() {
        let n = log.joints();
        let (plain, before) = log.read();
        for joint in 0..n {
            let of =
                |most: fn(f64, f64) -> f64| log.tau[joint].iter().copied().reduce(most).unwrap();
            let range = of(f64::max) - of(f64::min);
            let mut spiky = log.clone();
            // Eight times what the channel does by itself within seven rows is far off; the torques of one
            // pendulum swing by their whole range there.
            let height = 8.0 * range;
            // fewer than one row in 200, for what 199 of them do is usual
            let rows: Vec<usize> = (1..=3).map(|k| k * log.t.len() / 4).collect();
            for row in &rows {
                spiky.tau[joint][*row] += height;
            }
            let (read, removed) = spiky.read();
            let what = format!("{} tau_{joint}", log.name);
            assert_eq!((removed, read.t.len()), (before, plain.t.len()), "{what}");
            for (k, (a, b)) in read.tau.iter().zip(&plain.tau).enumerate() {
                assert!(
                    (a - b).abs() < 0.5 * height,
                    "{what}, row {}: {a} {b}",
                    k / n
                );
            }
        }
    }
}

#[test]
fn nanoseconds_since_1970_in_t_are_no_seconds() {
    let Some(path) = shared("emps/emps_id.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let rest = |line: &str| line.split_once(',').unwrap().1.to_owned();
    let seconds = |line: &str| line.split(',').next().unwrap().parse::<f64>().unwrap();
    for (unit, size) in [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)] {
        let rows = text.lines().enumerate().map(|(k, line)| match k {
            0 => format!("{line}\n"),
            _ => {
                let since = (seconds(line) / size).round() as i128;
                let epoch = (1_713_000_000.0 / size) as i128;
                format!("{},{}\n", epoch + since, rest(line))
            }
        });
        let log = folder.path().join("epoch.csv");
        std::fs::write(&log, rows.collect::<String>()).unwrap();
        let robot = Path::new(cft_ident_support::ROOT).join("configs/emps.toml");
        let words = |log: &Path| {
            let path = |p: &Path| p.to_string_lossy().into_owned();
            vec![
                "lsq".to_owned(),
                path(log),
                "-r".to_owned(),
                path(&robot),
                "-o".to_owned(),
                "m.toml".to_owned(),
            ]
        };
        let (plain, epoch) = (
            run(folder.path(), &words(&path)),
            run(folder.path(), &words(&log)),
        );
        let values = |document: &serde_json::Value| -> Vec<f64> {
            let all = document["parameters"].as_array().unwrap().iter();
            all.map(|p| p["value"].as_f64().unwrap()).collect()
        };
        for (a, b) in values(&plain).iter().zip(values(&epoch)) {
            assert!((a / b - 1.0).abs() < 1e-3, "{unit}: {a} {b}");
        }
        let shown = epoch["warnings"].to_string();
        assert!(shown.contains(&format!("are taken as {unit}")), "{shown}");
    }
}
