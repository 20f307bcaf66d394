//! Numbers of a model for arrays of motions: torque, regressor, gravity, friction, mass matrix, covariance.

use cft_ident::effect::AugmentedModel;
use cft_ident::effect::as_code::EffectsCode;
use cft_ident::export::Program;
use cft_ident::export::dissipative::joint_friction as friction_of;
use cft_ident::motion::Stretch;
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::data::Model;
use crate::errors::{UsageError, of_input, of_stage};

type Rows<'py> = PyReadonlyArray2<'py, f64>;

/// A model with its effects.
fn model_of(model: &Model) -> PyResult<AugmentedModel> {
    model.given.numbers().map_err(of_stage)
}

/// Rows of `n` joints.
fn rows<'a>(x: &'a Rows<'_>, n: usize, what: &str) -> PyResult<&'a [f64]> {
    if x.shape()[1] != n {
        return Err(UsageError::new_err(format!(
            "{what} has {} columns, and the model {n} joints",
            x.shape()[1]
        )));
    }
    x.as_slice().map_err(|_| {
        UsageError::new_err(format!(
            "{what} must be contiguous, row after row: use numpy.ascontiguousarray"
        ))
    })
}

/// Arrays of one motion must be as long as each other.
fn together(lengths: &[usize]) -> PyResult<usize> {
    match lengths {
        [first, rest @ ..] if rest.iter().all(|x| x == first) => Ok(*first),
        _ => Err(UsageError::new_err(
            "positions, velocities and accelerations differ in their number of rows",
        )),
    }
}

/// The columns of rows of `n` joints.
fn by_joint(x: &[f64], n: usize) -> Vec<Vec<f64>> {
    let column = |j: usize| x.iter().skip(j).step_by(n).copied().collect();
    (0..n).map(column).collect()
}

/// Rows of columns.
fn by_row(columns: &[Vec<f64>], rows: usize) -> Vec<f64> {
    (0..rows)
        .flat_map(|k| columns.iter().map(move |column| column[k]))
        .collect()
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
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let of = model_of(&model)?;
    let n = of.model.robot.joints();
    let each = [rows(&q, n, "q")?, rows(&v, n, "v")?, rows(&a, n, "a")?];
    let count = together(&each.map(<[f64]>::len))? / n.max(1);
    let out: Vec<f64> = if of.effects.is_empty() {
        let mut out = vec![0.0; count * n];
        for (k, tau) in out.chunks_mut(n.max(1)).enumerate() {
            let [q, v, a] = each.map(|x| &x[k * n..(k + 1) * n]);
            of.model.torque(q, v, a, tau);
        }
        out
    } else {
        let remembers = EffectsCode::of(&of).map_err(of_input)?.remember_anything();
        let dt = match (dt, remembers) {
            (Some(dt), _) if dt > 0.0 => dt,
            (None, false) => 1.0,
            _ => {
                return Err(UsageError::new_err(
                    "effects of this model remember the motion: give the time between rows, dt > 0",
                ));
            }
        };
        let [q, v, a] = each.map(|x| by_joint(x, n));
        let hat = of.reconstruct(&Stretch {
            dt,
            t: (0..count).map(|k| dt * k as f64).collect(),
            tau: vec![vec![0.0; count]; n],
            q,
            v,
            a,
            ..Stretch::default()
        });
        by_row(&hat, count)
    };
    PyArray1::from_vec(py, out).reshape([count, n])
}

/// The regressor (N x n x p) of the inertial parameters.
#[pyfunction]
pub fn regressor<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    q: Rows<'py>,
    v: Rows<'py>,
    a: Rows<'py>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let robot = model.given.file.robot.robot();
    let (n, p) = (robot.joints(), robot.parameters().len());
    let each = [rows(&q, n, "q")?, rows(&v, n, "v")?, rows(&a, n, "a")?];
    let count = together(&each.map(<[f64]>::len))? / n.max(1);
    let mut out = vec![0.0; count * n * p];
    for k in 0..count {
        let [q, v, a] = each.map(|x| &x[k * n..(k + 1) * n]);
        robot.regressor(q, v, a, &mut out[k * n * p..(k + 1) * n * p]);
    }
    PyArray1::from_vec(py, out).reshape([count, n, p])
}

/// Friction (N x n): the declared law of each joint with the effects that depend on its speed alone.
#[pyfunction]
pub fn joint_friction<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    v: Rows<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let of = model_of(&model)?;
    let n = of.model.robot.joints();
    let v = rows(&v, n, "v")?;
    let count = v.len() / n.max(1);
    let found = friction_of(&of, by_joint(v, n)).map_err(of_input)?;
    PyArray1::from_vec(py, by_row(&found, count)).reshape([count, n])
}

/// Speed of each joint below which it may be at rest \[m/s or rad/s\].
#[pyfunction]
pub fn rest_speeds(model: PyRef<'_, Model>) -> PyResult<Vec<f64>> {
    let mut program = Program::of(&model_of(&model)?.model);
    program.rest_by(&model.given.file.robot);
    Ok(program.rest)
}

/// The mass matrix (N x n x n).
#[pyfunction]
pub fn mass_matrix<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
    q: Rows<'py>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let of = model_of(&model)?.model;
    let n = of.robot.joints();
    let q = rows(&q, n, "q")?;
    let (count, rest) = (q.len() / n.max(1), vec![0.0; n]);
    let (mut weight, mut column) = (rest.clone(), rest.clone());
    let mut out = vec![0.0; count * n * n];
    for (q, mass) in q.chunks(n.max(1)).zip(out.chunks_mut((n * n).max(1))) {
        of.robot.torque(&of.theta, q, &rest, &rest, &mut weight);
        for j in 0..n {
            let mut a = rest.clone();
            a[j] = 1.0;
            of.robot.torque(&of.theta, q, &rest, &a, &mut column);
            for i in 0..n {
                mass[i * n + j] = column[i] - weight[i];
            }
        }
    }
    PyArray1::from_vec(py, out).reshape([count, n, n])
}

/// Names of the parameters and their covariance, row after row.
#[pyfunction]
pub fn covariance<'py>(
    py: Python<'py>,
    model: PyRef<'py, Model>,
) -> PyResult<Option<(Vec<String>, Bound<'py, PyArray2<f64>>)>> {
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
