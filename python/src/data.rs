//! Robots, logs, models and reduced logs as Python holds them.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

use cft_ident::config::{ModelFile, RobotFile};
use cft_ident::identify::{
    self, Control, Dataset, GivenModel, LogData, ReducedLogs, RobotSetup, is_reduced,
};
use cft_ident::log::{LogSpec, Provenance};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::{UsageError, of_input, of_stage};
use crate::numbers::ModelNumbers;

/// Name, joint, value, standard deviation, value in use and unit of a parameter.
type ParameterRow = (String, Option<String>, f64, Option<f64>, f64, String);

/// A robot file.
#[pyclass(frozen, module = "cft_ident._native")]
pub struct Robot {
    pub machine: RobotSetup,
}

#[pymethods]
impl Robot {
    /// From a file, or one that comes with the package such as `configs/ur10.toml`.
    #[staticmethod]
    fn load(path: &str) -> PyResult<Self> {
        let machine = RobotSetup::load(path).map_err(of_stage)?;
        Ok(Robot { machine })
    }

    /// From TOML text; `name` stands for it in messages, and a URDF that the text names is looked for in `folder`.
    #[staticmethod]
    #[pyo3(signature = (text, name, folder=None))]
    fn parse(text: &str, name: &str, folder: Option<PathBuf>) -> PyResult<Self> {
        let file = RobotFile::parse_in(name, text, folder.as_deref()).map_err(of_input)?;
        Ok(Robot {
            machine: RobotSetup::new(name, file),
        })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.machine.name
    }

    /// The robot file as TOML, with the links and limits of its URDF in it.
    #[getter]
    fn text(&self) -> PyResult<String> {
        self.machine.file.to_toml().map_err(of_input)
    }

    #[getter]
    fn joints(&self) -> Vec<String> {
        self.machine.robot.joint_names().to_vec()
    }
}

/// A log: a file, arrays, or a reduced log.
#[pyclass(frozen, module = "cft_ident._native")]
pub struct Log {
    pub logs: Vec<identify::Log>,
    pub spec: Option<LogSpec>,
    /// What the last call read of a file, which the next one does not parse again.
    recording: Arc<Mutex<Option<LogData>>>,
}

impl Log {
    fn new(logs: Vec<identify::Log>, spec: Option<LogSpec>) -> Self {
        Log {
            logs,
            spec,
            recording: Arc::default(),
        }
    }
}

/// The logs of one call.
pub struct GivenLogs {
    pub logs: Vec<identify::Log>,
    /// What calls before it read of the files among them.
    recordings: Vec<Arc<Mutex<Option<LogData>>>>,
}

impl GivenLogs {
    pub fn new(given: &[PyRef<'_, Log>]) -> Self {
        let files = given.iter().filter(|log| log.spec.is_some());
        GivenLogs {
            logs: given.iter().flat_map(|log| log.logs.clone()).collect(),
            recordings: files.map(|log| Arc::clone(&log.recording)).collect(),
        }
    }

    pub fn names(&self) -> Vec<String> {
        self.logs.iter().map(identify::Log::name).collect()
    }

    /// Reads them by a robot file.
    pub fn read(&self, setup: &RobotSetup, control: &Control) -> PyResult<Dataset> {
        let data = Dataset::read_beside(setup, &self.logs, &self.kept(), control);
        let data = data.map_err(of_stage)?;
        self.keep(&data.logs);
        Ok(data)
    }

    /// Adds them to a dataset as logs that are held out.
    pub fn held_out_of(&self, data: Dataset, control: &Control) -> PyResult<Dataset> {
        let beside = [data.logs.as_slice(), &self.kept()];
        let held_out = LogData::read_all(&data.setup, &self.logs, &beside, control);
        let held_out = held_out.map_err(of_stage)?;
        self.keep(&held_out);
        Ok(data.with_held_out(&held_out))
    }

    fn kept(&self) -> Vec<LogData> {
        let kept = self.recordings.iter();
        kept.filter_map(|kept| kept.lock().ok()?.clone()).collect()
    }

    fn keep(&self, read: &[LogData]) {
        let files = read
            .iter()
            .filter(|log| matches!(log.source, identify::Log::File(_)));
        for (kept, log) in self.recordings.iter().zip(files) {
            if let Ok(mut kept) = kept.lock() {
                *kept = Some(log.clone());
            }
        }
    }
}

#[pymethods]
impl Log {
    /// A file; a part of it as in `log.csv@0..70%`. A file of reduced logs counts as its logs.
    #[staticmethod]
    fn load(path: &str) -> PyResult<Self> {
        let spec: LogSpec = path.parse().map_err(of_input)?;
        if is_reduced(&spec.path) {
            let parts = ReducedLogs::load(&spec.path).map_err(of_stage)?;
            return Ok(Log::new(parts.as_logs(), None));
        }
        Ok(Log::new(vec![identify::Log::from(&spec)], Some(spec)))
    }

    /// Arrays: times `[s]`, positions and torques with one row per sample and one column per joint, in SI units;
    /// temperatures of the drives in degC, a column of NaN for a joint without one.
    #[staticmethod]
    #[pyo3(signature = (name, t, q, tau, reference=None, temperature=None))]
    fn arrays(
        name: &str,
        t: PyReadonlyArray1<f64>,
        q: PyReadonlyArray2<f64>,
        tau: PyReadonlyArray2<f64>,
        reference: Option<PyReadonlyArray2<f64>>,
        temperature: Option<PyReadonlyArray2<f64>>,
    ) -> PyResult<Self> {
        let whole = "arrays must be contiguous, row after row: use numpy.ascontiguousarray";
        let rows = |x: &PyReadonlyArray2<f64>| -> PyResult<Vec<f64>> {
            let slice = x.as_slice().map_err(|_| UsageError::new_err(whole))?;
            Ok(slice.to_vec())
        };
        let t = t.as_slice().map_err(|_| UsageError::new_err(whole))?;
        let log = identify::Log::of_rows(name, t, &rows(&q)?, &rows(&tau)?).map_err(of_stage)?;
        let log = match reference {
            Some(reference) => log.with_references(&rows(&reference)?).map_err(of_stage)?,
            None => log,
        };
        let log = match temperature {
            Some(temperature) => {
                let all = rows(&temperature)?;
                let joints = all.len().checked_div(t.len()).unwrap_or(0);
                (0..joints).try_fold(log, |log, j| {
                    let own: Vec<f64> = all.iter().skip(j).step_by(joints).copied().collect();
                    // a joint without a sensor has a column of NaN
                    match own.iter().all(|x| x.is_nan()) {
                        true => Ok(log),
                        false => log.with_temperature(j, &own).map_err(of_stage),
                    }
                })?
            }
            None => log,
        };
        Ok(Log::new(vec![log], None))
    }

    #[getter]
    fn name(&self) -> String {
        let names: Vec<String> = self.logs.iter().map(identify::Log::name).collect();
        names.join(", ")
    }

    /// The file with its span, where it is one.
    #[getter]
    fn path(&self) -> Option<String> {
        self.spec.as_ref().map(ToString::to_string)
    }
}

/// A model file.
#[pyclass(frozen, module = "cft_ident._native")]
pub struct Model {
    pub given: GivenModel,
    pub text: String,
    numbers: OnceLock<ModelNumbers>,
}

impl Model {
    pub fn of(name: &str, file: ModelFile) -> PyResult<Self> {
        let text = file.to_toml().map_err(of_input)?;
        Ok(Model::new(GivenModel::new(name, file), text))
    }

    fn new(given: GivenModel, text: String) -> Self {
        Model {
            given,
            text,
            numbers: OnceLock::new(),
        }
    }

    /// What the model computes with, made at the first call.
    pub fn numbers(&self) -> PyResult<&ModelNumbers> {
        if let Some(numbers) = self.numbers.get() {
            return Ok(numbers);
        }
        let made = ModelNumbers::new(self)?;
        Ok(self.numbers.get_or_init(|| made))
    }

    pub fn provenance(&self) -> Provenance {
        Provenance::of_text(&self.given.name, &self.text)
    }
}

#[pymethods]
impl Model {
    #[staticmethod]
    fn load(path: &str) -> PyResult<Self> {
        let text = cft_ident::config::text(Path::new(path)).map_err(of_input)?;
        let file = ModelFile::parse_in(path, &text, Path::new(path).parent()).map_err(of_input)?;
        Ok(Model::new(GivenModel::new(path, file), text.to_string()))
    }

    #[staticmethod]
    fn parse(text: &str, name: &str) -> PyResult<Self> {
        let file = ModelFile::parse(name, text).map_err(of_input)?;
        Ok(Model::new(GivenModel::new(name, file), text.to_owned()))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.given.name
    }

    /// The file as TOML.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn joints(&self) -> Vec<String> {
        self.given.file.robot.joint_names()
    }

    /// Name, joint, value, standard deviation, value in use and unit of every parameter.
    #[getter]
    fn parameters(&self) -> Vec<ParameterRow> {
        let shown = self.given.file.parameters.iter();
        shown
            .map(|p| {
                (
                    p.name.clone(),
                    p.joint.clone(),
                    p.value,
                    p.std,
                    p.in_use(),
                    p.unit.clone(),
                )
            })
            .collect()
    }
}

/// Reduced logs.
#[pyclass(frozen, module = "cft_ident._native")]
pub struct Part {
    pub logs: Arc<ReducedLogs>,
}

#[pymethods]
impl Part {
    #[staticmethod]
    fn load(path: &str) -> PyResult<Self> {
        let logs = ReducedLogs::load(Path::new(path)).map_err(of_stage)?;
        Ok(Part {
            logs: Arc::new(logs),
        })
    }

    #[staticmethod]
    fn from_bytes(data: &[u8], name: &str) -> PyResult<Self> {
        let logs = ReducedLogs::from_bytes(name, data).map_err(of_stage)?;
        Ok(Part {
            logs: Arc::new(logs),
        })
    }

    /// The bytes of a `.cfi` file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.logs.to_bytes().map_err(of_stage)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Name, SHA-256, samples, seconds, first and last time, and kept blocks of every log.
    #[getter]
    fn logs(&self) -> Vec<(String, String, u64, f64, [f64; 2], usize)> {
        let shown = self.logs.logs().iter().map(|log| {
            let p = &log.provenance;
            let (name, sha) = (p.name.clone(), p.sha256.clone());
            (
                name,
                sha,
                p.samples,
                p.duration_s,
                log.bounds_s,
                log.blocks(),
            )
        });
        shown.collect()
    }

    /// The same as a log for `lsq` and `validate`.
    fn as_log(&self) -> Log {
        Log::new(self.logs.as_logs(), None)
    }
}
