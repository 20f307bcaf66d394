//! Numbers of a model for a sample or arrays of samples: torque, its parts, regressor, mass matrix, covariance.

use cft_ident::effect::as_code::EffectsCode;
use cft_ident::effect::{AugmentedModel, SampledModel};
use cft_ident::export::Program;
use cft_ident::export::dissipative::DissipativeFriction;
use cft_ident::motion::Stretch;
use cft_ident::robot::Robot;
use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::data::Model;
use crate::errors::{UsageError, of_input, of_stage};

type Rows<'py> = PyReadonlyArrayDyn<'py, f64>;
/// Names of parameters and their covariance, square.
type NamedCovariance<'py> = (Vec<String>, Bound<'py, PyArray2<f64>>);

/// What a model computes with, made once.
pub struct ModelNumbers {
    model: AugmentedModel,
    /// Friction as exported code has it, or why there is no such code.
    friction: Result<DissipativeFriction, String>,
    /// Whether an effect remembers the motion.
    remembers: bool,
    /// Speed of each joint below which it may be at rest \[m/s or rad/s\].
    rest: Vec<f64>,
}

impl ModelNumbers {
    pub fn new(model: &Model) -> PyResult<Self> {
        let file = &model.given.file.robot;
        let model = model.given.numbers().map_err(of_stage)?;
        let mut program = Program::of(&model.model);
        program.rest_by(file);
        let code = EffectsCode::of(&model);
        Ok(Self {
            remembers: code.as_ref().is_ok_and(EffectsCode::remember_anything),
            friction: DissipativeFriction::new(&model).map_err(|e| e.to_string()),
            rest: program.rest,
            model,
        })
    }
}

/// Rows of one motion, checked: as many of each, `joints` wide, all numbers.
struct MotionRows<'a, const K: usize> {
    rows: [&'a [f64]; K],
    joints: usize,
    count: usize,
    /// Whether they were given as one sample, an array of one dimension.
    one: bool,
}

impl<'a, const K: usize> MotionRows<'a, K> {
    fn check(named: [(&str, &'a Rows<'_>); K], robot: &Robot) -> PyResult<Self> {
        let joints = robot.joints();
        let (first, shape) = (named[0].0, named[0].1.shape());
        let mut rows = [&[][..]; K];
        for ((name, x), slot) in named.iter().zip(&mut rows) {
            let given = x.shape();
            if !(1..=2).contains(&given.len()) || given.last() != Some(&joints) {
                return Err(UsageError::new_err(format!(
                    "{name} has shape {}; this model takes one sample, ({joints},), or rows of samples, (N, {joints}): {}",
                    shown(given),
                    robot.joint_names().join(", ")
                )));
            }
            if given != shape {
                return Err(UsageError::new_err(format!(
                    "{name} has shape {}, and {first} {}: give them alike",
                    shown(given),
                    shown(shape)
                )));
            }
            let values = x.as_slice().map_err(of_input)?;
            if let Some(index) = values.iter().position(|x| !x.is_finite()) {
                return Err(UsageError::new_err(format!(
                    "{name} is {} in row {}, joint {}: give finite numbers",
                    values[index],
                    index / joints,
                    robot.joint_names()[index % joints]
                )));
            }
            *slot = values;
        }
        Ok(Self {
            count: rows[0].len() / joints,
            rows,
            joints,
            one: shape.len() == 1,
        })
    }

    /// Refuses rows where one sample is asked for; `instead` says what takes rows.
    fn one_sample(&self, instead: &str) -> PyResult<()> {
        match self.one {
            true => Ok(()),
            false => Err(UsageError::new_err(format!(
                "q has shape ({}, {}), and this takes one sample, ({},){instead}",
                self.count, self.joints, self.joints
            ))),
        }
    }

    fn row(&self, k: usize) -> [&'a [f64]; K] {
        self.rows
            .map(|x| &x[k * self.joints..(k + 1) * self.joints])
    }

    /// Values of every row, `width` of them each, that `fill` writes.
    fn map(&self, width: usize, mut fill: impl FnMut([&'a [f64]; K], &mut [f64])) -> Vec<f64> {
        let mut out = vec![0.0; self.count * width];
        for (k, out) in out.chunks_exact_mut(width).enumerate() {
            fill(self.row(k), out);
        }
        out
    }

    /// Columns `[joint][row]` of one array.
    fn columns(&self, which: usize) -> Vec<Vec<f64>> {
        let column = |j: usize| self.rows[which].iter().skip(j).step_by(self.joints);
        (0..self.joints)
            .map(|j| column(j).copied().collect())
            .collect()
    }

    /// An array of what was computed of each row, of `shape` each, and as one row where one was given.
    fn array<'py>(
        &self,
        py: Python<'py>,
        values: Vec<f64>,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let rows = (!self.one).then_some(self.count);
        let shape: Vec<usize> = rows.into_iter().chain(shape.iter().copied()).collect();
        PyArray1::from_vec(py, values).reshape(shape)
    }
}

/// A shape as numpy shows it.
fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        all => format!(
            "({})",
            all.iter()
                .map(usize::to_string)
                .collect::<Vec<_>>()
                .join(", ")
        ),
    }
}

/// Torques (N x n) with all effects; `dt` is the time between rows where an effect remembers them.
#[pyfunction]
#[pyo3(signature = (model, q, v, a, dt))]
pub fn torque<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    q: Rows<'py>,
    v: Rows<'py>,
    a: Rows<'py>,
    dt: Option<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let numbers = model.numbers()?;
    let augmented = &numbers.model;
    let motion = MotionRows::check([("q", &q), ("v", &v), ("a", &a)], &augmented.model.robot)?;
    let dt = match (dt, numbers.remembers) {
        (Some(dt), _) if dt > 0.0 && dt.is_finite() => dt,
        (None, false) => 1.0,
        (Some(dt), _) => {
            return Err(UsageError::new_err(format!(
                "dt is {dt}: give the seconds between rows, above 0"
            )));
        }
        (None, true) => {
            return Err(UsageError::new_err(
                "effects of this model remember the motion: give the time between rows, dt=0.001, or begin with model.start(q) and take one step a sample",
            ));
        }
    };
    let out = py.detach(|| match augmented.effects.is_empty() {
        true => motion.map(motion.joints, |[q, v, a], tau| {
            augmented.model.torque(q, v, a, tau)
        }),
        false => {
            let hat = augmented.reconstruct(&Stretch {
                dt,
                t: (0..motion.count).map(|k| dt * k as f64).collect(),
                tau: vec![vec![0.0; motion.count]; motion.joints],
                q: motion.columns(0),
                v: motion.columns(1),
                a: motion.columns(2),
                ..Stretch::default()
            });
            by_row(&hat, motion.count)
        }
    });
    motion.array(py, out, &[motion.joints])
}

/// Rows of columns.
fn by_row(columns: &[Vec<f64>], rows: usize) -> Vec<f64> {
    (0..rows)
        .flat_map(|k| columns.iter().map(move |column| column[k]))
        .collect()
}

/// Torques of links and drives (N x n), without friction, offset and effects.
#[pyfunction]
pub fn load<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    q: Rows<'py>,
    v: Rows<'py>,
    a: Rows<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let rigid = &model.numbers()?.model.model;
    let motion = MotionRows::check([("q", &q), ("v", &v), ("a", &a)], &rigid.robot)?;
    let torque =
        |[q, v, a]: [&[f64]; 3], tau: &mut [f64]| rigid.robot.torque(&rigid.theta, q, v, a, tau);
    let out = py.detach(|| motion.map(motion.joints, torque));
    motion.array(py, out, &[motion.joints])
}

/// Torques (N x n) that carry the links at rest.
#[pyfunction]
pub fn gravity<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    q: Rows<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let rigid = &model.numbers()?.model.model;
    let motion = MotionRows::check([("q", &q)], &rigid.robot)?;
    let still = vec![0.0; motion.joints];
    let weight = |[q]: [&[f64]; 1], tau: &mut [f64]| {
        rigid.robot.torque(&rigid.theta, q, &still, &still, tau);
    };
    let out = py.detach(|| motion.map(motion.joints, weight));
    motion.array(py, out, &[motion.joints])
}

/// The regressor (N x n x p) of the inertial parameters.
#[pyfunction]
pub fn regressor<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    q: Rows<'py>,
    v: Rows<'py>,
    a: Rows<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let robot = &model.numbers()?.model.model.robot;
    let motion = MotionRows::check([("q", &q), ("v", &v), ("a", &a)], robot)?;
    let (n, p) = (motion.joints, robot.parameters().len());
    let row = |[q, v, a]: [&[f64]; 3], y: &mut [f64]| robot.regressor(q, v, a, y);
    let out = py.detach(|| motion.map(n * p, row));
    motion.array(py, out, &[n, p])
}

/// Friction (N x n): the declared law of each joint with the effects that depend on its speed alone.
#[pyfunction]
pub fn joint_friction<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    v: Rows<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let numbers = model.numbers()?;
    let motion = MotionRows::check([("v", &v)], &numbers.model.model.robot)?;
    let friction = numbers.friction.as_ref().map_err(of_input)?;
    let out = py.detach(|| friction.torques(&numbers.model, motion.columns(0)));
    motion.array(py, by_row(&out, motion.count), &[motion.joints])
}

/// Speed of each joint below which it may be at rest \[m/s or rad/s\].
#[pyfunction]
pub fn rest_speeds(model: PyRef<'_, Model>) -> PyResult<Vec<f64>> {
    Ok(model.numbers()?.rest.clone())
}

/// The mass matrix (N x n x n).
#[pyfunction]
pub fn mass_matrix<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    q: Rows<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let rigid = &model.numbers()?.model.model;
    let motion = MotionRows::check([("q", &q)], &rigid.robot)?;
    let n = motion.joints;
    let rest = vec![0.0; n];
    let [mut weight, mut column, mut a] = [rest.clone(), rest.clone(), rest.clone()];
    let out = motion.map(n * n, |[q], mass| {
        rigid
            .robot
            .torque(&rigid.theta, q, &rest, &rest, &mut weight);
        for j in 0..n {
            a[j] = 1.0;
            rigid.robot.torque(&rigid.theta, q, &rest, &a, &mut column);
            a[j] = 0.0;
            for i in 0..n {
                mass[i * n + j] = column[i] - weight[i];
            }
        }
    });
    motion.array(py, out, &[n, n])
}

/// A model on its way along a motion, sample after sample.
#[pyclass(module = "cft_ident._native")]
pub struct State {
    model: SampledModel,
    /// Seconds since the start.
    #[pyo3(get, set)]
    t: f64,
}

#[pymethods]
impl State {
    /// At rest in the pose `q`, at t = 0.
    #[new]
    fn start(model: PyRef<'_, Model>, q: Rows<'_>) -> PyResult<Self> {
        let augmented = &model.numbers()?.model;
        let pose = MotionRows::check([("q", &q)], &augmented.model.robot)?;
        pose.one_sample("")?;
        let mut model = SampledModel::new(augmented.clone(), 1.0);
        model.begin();
        let still = vec![0.0; pose.joints];
        let mut tau = still.clone();
        model.torque(0.0, [pose.rows[0], &still, &still], &mut tau);
        Ok(State { model, t: 0.0 })
    }

    /// The torque of the next sample, `dt` seconds after the one before.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        dt: f64,
        q: Rows<'py>,
        v: Rows<'py>,
        a: Rows<'py>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(UsageError::new_err(format!(
                "dt is {dt}: give the seconds since the sample before, above 0"
            )));
        }
        let robot = &self.model.model().model.robot;
        let motion = MotionRows::check([("q", &q), ("v", &v), ("a", &a)], robot)?;
        motion.one_sample("; for rows there is model.torque(q, v, a, dt=dt)")?;
        let mut tau = vec![0.0; motion.joints];
        self.model.set_interval(dt);
        self.model.torque(self.t, motion.rows, &mut tau);
        self.t += dt;
        motion.array(py, tau, &[motion.joints])
    }
}

/// Names of the parameters and their covariance, row after row.
#[pyfunction]
pub fn covariance<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
) -> PyResult<Option<NamedCovariance<'py>>> {
    let file = &model.given.file;
    // a model that predicts with other numbers than were estimated holds the covariance of the estimates
    let Some(found) = file
        .estimate_covariance
        .as_ref()
        .or(file.covariance.as_ref())
    else {
        return Ok(None);
    };
    let u = found.names.len();
    let all: Vec<f64> = found.matrix.iter().flatten().copied().collect();
    let matrix = PyArray1::from_vec(py, all).reshape([u, u])?;
    Ok(Some((found.names.clone(), matrix)))
}
