//! Feed-forward torque along a recorded or planned motion, with its prediction band.

use schemars::JsonSchema;
use serde::Serialize;

use crate::band::{Band, Deviation, Reach};
use crate::input::control::Control;
use crate::input::dataset::GivenModel;
use crate::input::error::IdentifyError;
use crate::input::log::Log;
use crate::input::log_data::LogData;
use crate::input::position_cutoff::known;
use crate::input::robot_setup::RobotSetup;
use crate::note::StageNote;
use cft_ident_core::motion::{self, FilterSettings, Summary};
use cft_ident_core::robot::model::Model;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Instant, Provenance};

/// The torque along a motion.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TorqueAlong {
    pub joints: Vec<JointAlong>,
    /// Rows of the motion.
    pub samples: u64,
    pub processing: Summary,
}

/// The torque of one joint.
#[derive(Debug, Serialize, JsonSchema)]
pub struct JointAlong {
    pub joint: String,
    /// "N" or "Nm".
    pub unit: String,
    /// Root mean square \[unit\].
    pub rms: f64,
    /// Largest modulus \[unit\].
    pub peak: f64,
}

/// What `torque` found.
pub struct FeedForward {
    pub along: TorqueAlong,
    pub inputs: Vec<Provenance>,
    pub notes: Vec<StageNote>,
}

/// Torques along a log of positions by a model. `row` gets
/// the time of each sample \[s\], the torque of every joint, their standard deviations and, where the file holds what
/// it takes, half the widths of their 95 % bands \[N or Nm\], and the instant from which time is counted.
pub fn torque(
    given: &GivenModel,
    log: &Log,
    control: &Control,
    row: &mut dyn FnMut(f64, &[f64], Instant),
) -> Result<FeedForward, IdentifyError> {
    let (setup, file, refined) = (&given.setup(), &given.file, &given.numbers()?);
    let model = &refined.model;
    let n = setup.robot.joints();
    let band = Band::new(file, model);
    let deviation = TorqueDeviations::new(setup, file, model);
    // torque, deviation, and half the band's width
    let kinds = if band.is_some() { 3 } else { 2 };
    let mut reach = band.as_ref().map(|band| Reach::new(band.held()));
    let log = &LogData::read_positions(setup, log, control)?;
    let logs = std::slice::from_ref(log);
    let setup = &setup.with_cutoffs_along(logs, &known(model), &vec![0.0; n], control)?;
    let as_held = setup.as_held(&file.held_out);
    let setup = as_held.as_ref().unwrap_or(setup);
    // every row gets its torque: nothing is decimated, and nothing left off at the ends
    let settings = FilterSettings {
        decimation: Some(1),
        q_trim_s: Some(0.0),
        trim_s: Some(0.0),
        ..setup.settings()
    };
    let work = control.begin("torque", None);
    let mut blocks = log.blocks(control)?;
    let origin = log.recording().origin();
    let mut peak = vec![0.0f64; n];
    let mut square = vec![0.0f64; n];
    let mut emit = |t: f64, [q, v]: [&[f64]; 2], values: &[f64]| {
        if let Some(reach) = &mut reach {
            reach.take(q, v, &values[..n]);
        }
        for j in 0..n {
            peak[j] = peak[j].max(values[j].abs());
            square[j] += values[j] * values[j];
        }
        row(t, values, origin);
    };
    let mut read = |block: &mut _| blocks.read(block);
    let failed = |e| IdentifyError::of_run(&log.name(), e);
    let summary = if refined.effects.is_empty() {
        let compute = |s: &motion::MotionSample, out: &mut [f64]| {
            let (tau, rest) = out.split_at_mut(n);
            model.torque(s.q, s.v, s.a, tau);
            let (std, half) = rest.split_at_mut(n);
            deviation.at([s.q, s.v, s.a], std);
            if let Some(band) = &band {
                band.half_widths([s.q, s.v, s.a], tau, half);
            }
        };
        let mut emit = |row: &motion::FilteredRow| emit(row.t, [row.q, row.v], row.raw);
        let channels = kinds * n;
        motion::run(&mut read, n, &settings, None, channels, &compute, &mut emit).map_err(failed)?
    } else {
        // effects remember: they need a stretch from its begin
        let (found, summary) = motion::stretches(0, n, &settings, &mut read).map_err(failed)?;
        let temperatures = setup.temperatures_for(refined, log)?;
        let mut values = vec![0.0; kinds * n];
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for mut stretch in found {
            stretch.temperature = temperatures.along(&stretch.t, n);
            let hat = refined.reconstruct(&stretch);
            for (k, t) in stretch.t.iter().enumerate() {
                stretch.at(k, &mut q, &mut v, &mut a);
                for (x, hat) in values.iter_mut().zip(&hat) {
                    *x = hat[k];
                }
                let (tau, rest) = values.split_at_mut(n);
                let (std, half) = rest.split_at_mut(n);
                deviation.at([&q, &v, &a], std);
                if let Some(band) = &band {
                    band.half_widths([&q, &v, &a], tau, half);
                }
                emit(*t, [&q, &v], &values);
            }
        }
        summary
    };
    drop(work);
    control.check()?;
    let mut notes = log.notes_with(&blocks, &summary);
    notes.extend(StageNote::of_reach(reach.as_ref()));
    let inputs = vec![blocks.provenance()?];
    let rows = summary.rows.max(1) as f64;
    let names = setup.robot.joint_names().iter().enumerate();
    let joints = names.map(|(j, joint)| JointAlong {
        joint: joint.clone(),
        unit: setup.file.torque_unit(j).to_owned(),
        rms: (square[j] / rows).sqrt(),
        peak: peak[j],
    });
    Ok(FeedForward {
        along: TorqueAlong {
            joints: joints.collect(),
            samples: summary.rows,
            processing: summary,
        },
        inputs,
        notes,
    })
}

/// Standard deviations of a model's torque: of its parameters and of what the fit left.
struct TorqueDeviations<'a> {
    of_parameters: Deviation<'a>,
    /// What the fit left, per joint \[N or Nm\].
    residual: Vec<f64>,
}

impl<'a> TorqueDeviations<'a> {
    fn new(setup: &RobotSetup, file: &ModelFile, model: &'a Model) -> Self {
        let joints = setup.robot.joint_names().iter();
        let residual = joints.map(|j| file.residual_std.get(j).copied().unwrap_or(0.0));
        TorqueDeviations {
            of_parameters: Deviation::new(&file.model_covariance(model), model),
            residual: residual.collect(),
        }
    }

    /// Those of every joint at one position, velocity and acceleration.
    fn at(&self, motion: [&[f64]; 3], out: &mut [f64]) {
        self.of_parameters.variances(motion, out);
        for (out, residual) in out.iter_mut().zip(&self.residual) {
            *out = (*out + residual * residual).sqrt();
        }
    }
}
