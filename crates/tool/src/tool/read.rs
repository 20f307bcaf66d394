//! Files into wrenches with orientations: one table, poses beside wrenches by clock or by order, recordings.

use std::path::PathBuf;

use cft_ident_core::number::is_usable;
use cft_ident_core::robot::tree::space::{Rotation, Vector};
use cft_ident_logs::log::{
    LogSection, LogSpec, Provenance, RawBlock, RawReader, TopicFacts, escape, list, listing,
};

use super::NUMBERS;
use super::channels::{WrenchColumns, first_is_clock, is_time};
use super::error::ToolError;
use super::joints::MovingFrame;
use super::table::WrenchTable;
use super::units::ForceUnit;
use super::wrench_log::{OrientationIs, WrenchLog, WrenchSample, quaternion_of};

/// What is asked of files.
#[derive(Debug, Clone, Default)]
pub struct WrenchRequest {
    /// Logs, one after the other.
    pub logs: Vec<LogSpec>,
    /// File of the wrenches beside the first log, or topic of a recording.
    pub wrench: Option<String>,
    /// URDF by whose joints the sensor is placed, and the frame that it is.
    pub urdf: Option<PathBuf>,
    pub frame: Option<String>,
    /// Unit of forces, where no header states it.
    pub force_unit: Option<ForceUnit>,
}

/// Reads a table; of a recording one topic.
fn table(
    spec: &LogSpec,
    topic: Option<&str>,
    inputs: &mut Vec<Provenance>,
) -> Result<WrenchTable, ToolError> {
    let section = LogSection {
        topic: topic.map(str::to_owned),
        ..LogSection::default()
    };
    let mut reader = RawReader::open_plain(spec, &section)?;
    let timed = reader.is_timed();
    let clock = (!timed)
        .then(|| reader.names().iter().position(|name| is_time(name)))
        .flatten();
    if let Some(column) = clock {
        reader.set_time_by_numbers(column)?;
    }
    let names = reader.names().to_vec();
    let mut columns = vec![Vec::new(); names.len()];
    let (mut t, mut block) = (Vec::new(), RawBlock::default());
    while reader.read(&mut block)? {
        t.extend(&block.t);
        for (column, more) in columns.iter_mut().zip(&block.columns) {
            column.extend(more);
        }
    }
    let provenance = reader.provenance()?;
    if !inputs
        .iter()
        .any(|known| known.sha256 == provenance.sha256 && known.span == provenance.span)
    {
        inputs.push(provenance);
    }
    let mut out = WrenchTable {
        file: match topic {
            Some(topic) => format!("{} {}", reader.log_name(), escape(topic)),
            None => reader.log_name(),
        },
        names,
        columns,
        t: (timed || clock.is_some()).then_some(t),
        origin_s: reader.origin().seconds(),
    };
    if out.t.is_none() && out.names.iter().all(|n| n.starts_with('#')) && first_is_clock(&out) {
        let columns = WrenchColumns::of(&out)?;
        let used = columns.force.iter().flatten().map(|(c, _)| *c);
        let used = used.chain(columns.quaternion.iter().flatten().copied());
        let first = used
            .chain(columns.position.iter().flatten().map(|(c, _)| *c))
            .min();
        if first == Some(1) {
            out.t = Some(out.columns[0].clone());
            out.origin_s = 0.0;
        }
    }
    Ok(out)
}

/// Topics of a recording: that of the wrenches, and that of the poses or joints.
fn topics(spec: &LogSpec, request: &WrenchRequest) -> Result<Option<[String; 2]>, ToolError> {
    let found = listing(spec)?;
    if found.is_empty() {
        return Ok(None);
    }
    let full = |topic: &&TopicFacts| topic.messages > 0;
    let is = |kind: &str, ends: &[&str]| ends.iter().any(|end| kind.ends_with(end));
    let all = || list(found.iter().map(|topic| topic.name.as_str()));
    let wrench = match &request.wrench {
        Some(asked) => found.iter().find(|topic| topic.name == *asked),
        None => found
            .iter()
            .filter(full)
            .find(|topic| is(&topic.kind, &["WrenchStamped", "Wrench"])),
    };
    let Some(wrench) = wrench else {
        return Err(ToolError::NoTopic {
            file: escape(&spec.name()),
            topics: all(),
        });
    };
    let poses: &[&str] = match request.urdf {
        Some(_) => &["JointState"],
        None => &[
            "PoseStamped",
            "TransformStamped",
            "Pose",
            "Transform",
            "Odometry",
        ],
    };
    let mut with_poses = found.iter().filter(full);
    let pose = with_poses.find(|topic| is(&topic.kind, poses));
    let Some(pose) = pose else {
        return Err(ToolError::NoOrientation {
            files: escape(&spec.name()),
            remedy: match request.urdf {
                Some(_) => "record a JointState beside the wrenches",
                None => {
                    "record a PoseStamped or a TransformStamped of the sensor beside the wrenches, or joint states, with --urdf ARM.urdf --frame tool0; a tree of frames (/tf) is not read"
                }
            },
        });
    };
    Ok(Some([wrench.name.clone(), pose.name.clone()]))
}

/// Orientations of a table, as logged or by the joints of a robot.
struct PosesOfTable {
    quaternions: Vec<[f64; 4]>,
    /// Every way to read what is no quaternion; the first are `quaternions`.
    readings: Vec<(OrientationIs, Vec<[f64; 4]>)>,
    places: Option<Vec<Vector>>,
    named: bool,
}

fn poses(
    table: &WrenchTable,
    columns: &WrenchColumns,
    frame: Option<&MovingFrame>,
) -> Result<Option<PosesOfTable>, ToolError> {
    if let Some(frame) = frame {
        let along = frame.along(table)?;
        let quaternion = |(r, _): &(Rotation, Vector)| quaternion_of(r);
        return Ok(Some(PosesOfTable {
            quaternions: along.iter().map(quaternion).collect(),
            readings: Vec::new(),
            places: Some(along.into_iter().map(|(_, place)| place).collect()),
            named: true,
        }));
    }
    let places = columns.position.map(|of| triples(table, &of)).transpose()?;
    let readings = columns.orientation.and_then(|of| of.readings(table));
    if let (None, Some(readings)) = (columns.quaternion, readings) {
        return Ok(Some(PosesOfTable {
            quaternions: readings[0].1.clone(),
            readings,
            places,
            named: columns.named,
        }));
    }
    let Some(of) = columns.quaternion else {
        return Ok(None);
    };
    let mut quaternions = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let four = of.map(|column| table.columns[column][row]);
        let length = four.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !length.is_finite() {
            return Err(no_number(table, row, &of));
        }
        if (length - 1.0).abs() > NUMBERS.quaternion {
            return Err(ToolError::Quaternion {
                file: table.file.clone(),
                row: row + 1,
                columns: list(of.iter().map(|column| table.names[*column].as_str())),
                length,
            });
        }
        quaternions.push(four.map(|x| x / length));
    }
    Ok(Some(PosesOfTable {
        quaternions,
        readings: Vec::new(),
        places,
        named: columns.named,
    }))
}

fn no_number(table: &WrenchTable, row: usize, columns: &[usize]) -> ToolError {
    let mut columns = columns.iter();
    let bad = columns.find(|column| !is_usable(table.columns[**column][row]));
    ToolError::NoNumber {
        file: table.file.clone(),
        row: row + 1,
        column: bad.map_or(String::new(), |column| escape(&table.names[*column])),
    }
}

fn triples(table: &WrenchTable, of: &[(usize, f64); 3]) -> Result<Vec<Vector>, ToolError> {
    let row = |row: usize| {
        let x = of.map(|(column, factor)| factor * table.columns[column][row]);
        match x.iter().all(|x| is_usable(*x)) {
            true => Ok(x),
            false => Err(no_number(table, row, &of.map(|(column, _)| column))),
        }
    };
    (0..table.rows()).map(row).collect()
}

/// Reads all that was asked for.
pub fn read_wrenches(request: &WrenchRequest) -> Result<(WrenchLog, Vec<Provenance>), ToolError> {
    let frame = match (&request.urdf, &request.frame) {
        (Some(urdf), Some(frame)) => Some(MovingFrame::load(urdf, frame)?),
        (Some(_), None) => return Err(ToolError::FrameNeeded),
        _ => None,
    };
    let mut inputs = Vec::new();
    let mut out = WrenchLog {
        has_clock: true,
        orientation_is_named: true,
        unit_is_stated: true,
        ..WrenchLog::default()
    };
    let mut alone: Vec<(WrenchTable, WrenchColumns)> = Vec::new();
    for (k, spec) in request.logs.iter().enumerate() {
        let (pose, wrench) = match topics(spec, request)? {
            Some([wrench, pose]) => {
                let wrenches = table(spec, Some(&wrench), &mut inputs)?;
                (table(spec, Some(&pose), &mut inputs)?, Some(wrenches))
            }
            None => {
                let beside = request.wrench.as_ref().filter(|_| k == 0);
                let beside = beside.map(|file| table(&LogSpec::whole(file), None, &mut inputs));
                (table(spec, None, &mut inputs)?, beside.transpose()?)
            }
        };
        let columns = WrenchColumns::of(&pose)?;
        match wrench {
            Some(wrenches) => {
                let of = WrenchColumns::of(&wrenches)?;
                joined(
                    &mut out,
                    (&pose, &columns),
                    (&wrenches, &of),
                    frame.as_ref(),
                    request,
                )?;
            }
            None if columns.has_wrench() && (columns.has_orientation() || frame.is_some()) => {
                let both = (&pose, &columns);
                joined(&mut out, both, both, frame.as_ref(), request)?;
            }
            None => alone.push((pose, columns)),
        }
    }
    match &alone[..] {
        [] => {}
        // poses and wrenches in files of their own, in either order
        [(a, of_a), (b, of_b)] if of_a.has_wrench() != of_b.has_wrench() => {
            let (pose, wrench) = match of_b.has_wrench() {
                true => ((a, of_a), (b, of_b)),
                false => ((b, of_b), (a, of_a)),
            };
            joined(&mut out, pose, wrench, frame.as_ref(), request)?;
        }
        [(table, of), ..] => return Err(incomplete(table, of)),
    }
    Ok((out, inputs))
}

/// What a table lacks.
fn incomplete(table: &WrenchTable, of: &WrenchColumns) -> ToolError {
    const QUATERNION: &str = "name them qx, qy, qz, qw, or rx, ry, rz (a rotation vector), or roll, pitch, yaw, or A, B, C, or R[0] .. R[8]; or give joint angles with --urdf ARM.urdf --frame tool0";
    let (missing, remedy) = match of.has_wrench() {
        true => ("an orientation", QUATERNION),
        false => (
            "a wrench",
            "name them fx, fy, fz, tx, ty, tz, or give their file with --wrench FILE",
        ),
    };
    ToolError::Columns {
        file: table.file.clone(),
        missing,
        found: table.named(),
        remedy,
    }
}

/// Adds the rows of poses beside wrenches: by their clocks, or one by one.
fn joined(
    out: &mut WrenchLog,
    (pose, of_pose): (&WrenchTable, &WrenchColumns),
    (wrench, of_wrench): (&WrenchTable, &WrenchColumns),
    frame: Option<&MovingFrame>,
    request: &WrenchRequest,
) -> Result<(), ToolError> {
    let Some((force, moment)) = of_wrench.force.zip(of_wrench.moment) else {
        return Err(incomplete(wrench, of_wrench));
    };
    let Some(poses) = poses(pose, of_pose, frame)? else {
        return Err(not_of_length_one(pose).unwrap_or_else(|| {
            incomplete(
                pose,
                &WrenchColumns {
                    force: Some(force),
                    moment: Some(moment),
                    ..WrenchColumns::default()
                },
            )
        }));
    };
    let newton = match of_wrench.unit_is_stated {
        true => 1.0,
        false => request.force_unit.map_or(1.0, |unit| unit.newton),
    };
    out.unit_is_stated &= of_wrench.unit_is_stated || request.force_unit.is_some();
    out.orientation_is_named &= poses.named;
    let scaled = |all: Vec<Vector>| all.into_iter().map(|x| x.map(|x| newton * x)).collect();
    let (forces, moments): (Vec<Vector>, Vec<Vector>) = (
        scaled(triples(wrench, &force)?),
        scaled(triples(wrench, &moment)?),
    );
    let constant = |k: usize| forces.iter().all(|force| force[k] == forces[0][k]);
    if forces.len() > 1 && (0..3).all(constant) {
        return Err(ToolError::Silent {
            file: wrench.file.clone(),
        });
    }
    let same = std::ptr::eq(pose, wrench);
    let clocks = pose.t.as_ref().zip(wrench.t.as_ref()).filter(|_| !same);
    // each counts from an instant of its own
    let later = wrench.origin_s - pose.origin_s;
    // logs follow each other
    let after = out.samples.last().map_or(0.0, |last| last.t + 1.0);
    let before = out.samples.len();
    let mut readings: Vec<(OrientationIs, Vec<[f64; 4]>)> = poses
        .readings
        .iter()
        .map(|(is, _)| (*is, Vec::new()))
        .collect();
    match clocks {
        Some((of_pose, of_wrench))
            if pose.rows() != wrench.rows() || of_pose != of_wrench || later != 0.0 =>
        {
            let longest = LONGEST_STEP * median_step(of_pose);
            let mut lost = 0;
            for (row, t) in of_wrench.iter().map(|t| t + later).enumerate() {
                let Some((k, part)) = between(of_pose, t) else {
                    continue;
                };
                let to = (k + 1).min(of_pose.len() - 1);
                if of_pose[to] - of_pose[k] > longest {
                    lost += 1;
                    continue;
                }
                let ends = [k, (k + 1).min(poses.quaternions.len() - 1)];
                for (reading, (_, all)) in readings.iter_mut().zip(&poses.readings) {
                    reading.1.push(midway(ends.map(|k| all[k]), part));
                }
                let position = poses.places.as_ref().map(|places| {
                    let [a, b] = ends.map(|k| places[k]);
                    std::array::from_fn(|i| a[i] + part * (b[i] - a[i]))
                });
                out.samples.push(WrenchSample {
                    t,
                    quaternion: midway(ends.map(|k| poses.quaternions[k]), part),
                    position,
                    force: forces[row],
                    moment: moments[row],
                });
            }
            if lost > 0 {
                out.notes.push(format!(
                    "{}: {lost} wrenches of {} lie in gaps of more than {LONGEST_STEP} usual steps of {} and are left out",
                    wrench.file,
                    wrench.rows(),
                    pose.file
                ));
            }
            if out.samples.len() == before {
                return Err(ToolError::ClocksApart {
                    poses: pose.file.clone(),
                    wrenches: wrench.file.clone(),
                });
            }
        }
        _ => {
            if pose.rows() != wrench.rows() {
                return Err(ToolError::RowsDiffer {
                    poses: pose.file.clone(),
                    pose_rows: pose.rows(),
                    wrenches: wrench.file.clone(),
                    wrench_rows: wrench.rows(),
                });
            }
            let clock = pose.t.as_ref().or(wrench.t.as_ref());
            let clock = clock.filter(|t| t.windows(2).all(|pair| pair[1] > pair[0]));
            out.has_clock &= clock.is_some();
            let samples = (0..pose.rows()).map(|row| WrenchSample {
                t: clock.map_or(row as f64, |t| t[row]),
                quaternion: poses.quaternions[row],
                position: poses.places.as_ref().map(|places| places[row]),
                force: forces[row],
                moment: moments[row],
            });
            out.samples.extend(samples);
            readings.clone_from(&poses.readings);
        }
    }
    out.add_readings(readings, before)
        .map_err(|()| ToolError::Mixed {
            file: pose.file.clone(),
        })?;
    if before > 0 {
        let first = out.samples[before].t;
        out.samples[before..]
            .iter_mut()
            .for_each(|sample| sample.t += after - first);
    }
    Ok(())
}

/// Of a table without names: the four columns nearest to a length of one, where they are not of it.
fn not_of_length_one(table: &WrenchTable) -> Option<ToolError> {
    let from = table.columns.len().checked_sub(4)?;
    let length = |row: usize| {
        let four = &table.columns[from..];
        four.iter()
            .map(|column| column[row].powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let row = (0..table.rows()).find(|row| (length(*row) - 1.0).abs() > NUMBERS.quaternion)?;
    Some(ToolError::Quaternion {
        file: table.file.clone(),
        row: row + 1,
        columns: list(table.names[from..].iter().map(String::as_str)),
        length: length(row),
    })
}

/// Usual steps of poses that a straight line bridges.
const LONGEST_STEP: f64 = 10.0;

/// The step in the middle of all.
fn median_step(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    match steps.is_empty() {
        true => f64::INFINITY,
        false => *steps.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// The row before a time, and the part of the way to the next.
fn between(times: &[f64], t: f64) -> Option<(usize, f64)> {
    let next = times.partition_point(|x| *x <= t);
    let k = next.checked_sub(1)?;
    match times.get(next) {
        Some(to) => Some((k, (t - times[k]) / (to - times[k]))),
        None => (times[k] == t).then_some((k, 0.0)),
    }
}

/// A quaternion between two near ones: their mean by weight, of length one.
fn midway([a, b]: [[f64; 4]; 2], part: f64) -> [f64; 4] {
    let same: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
    let sign = if same < 0.0 { -1.0 } else { 1.0 };
    let mean: [f64; 4] = std::array::from_fn(|k| a[k] + part * (sign * b[k] - a[k]));
    let length = mean.iter().map(|x| x * x).sum::<f64>().sqrt();
    mean.map(|x| x / length)
}
