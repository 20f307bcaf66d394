//! The stages of `cft_ident::identify` for Python: arguments in, documents, models and pages out.
//!
//! Everything that a person sees (objects, frames, docstrings) is made in Python of what these functions
//! return. Work runs on a thread of its own without the interpreter's lock, while the caller's thread looks for Ctrl-C.

mod data;
mod errors;
mod numbers;
mod stages;
mod work;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("CftIdentError", py.get_type::<errors::CftIdentError>())?;
    module.add("UsageError", py.get_type::<errors::UsageError>())?;
    module.add("InputError", py.get_type::<errors::InputError>())?;
    module.add(
        "UndeterminedError",
        py.get_type::<errors::UndeterminedError>(),
    )?;
    module.add_class::<data::Robot>()?;
    module.add_class::<data::Log>()?;
    module.add_class::<data::Model>()?;
    module.add_class::<data::Part>()?;
    module.add_class::<numbers::State>()?;
    module.add_function(wrap_pyfunction!(stages::run, module)?)?;
    module.add_function(wrap_pyfunction!(stages::main, module)?)?;
    module.add_function(wrap_pyfunction!(stages::friction, module)?)?;
    module.add_function(wrap_pyfunction!(stages::lsq, module)?)?;
    module.add_function(wrap_pyfunction!(stages::validate, module)?)?;
    module.add_function(wrap_pyfunction!(stages::rows, module)?)?;
    module.add_function(wrap_pyfunction!(stages::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(stages::reduce, module)?)?;
    module.add_function(wrap_pyfunction!(stages::merge, module)?)?;
    module.add_function(wrap_pyfunction!(stages::track, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::torque, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::load, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::gravity, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::regressor, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::joint_friction, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::rest_speeds, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::mass_matrix, module)?)?;
    module.add_function(wrap_pyfunction!(numbers::covariance, module)?)?;
    Ok(())
}
