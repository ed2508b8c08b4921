//! The Python module `rumple`: scenes, simulations, laws and results.
//!
//! Everything is done by the library; here its values become Python's. The engine works without the interpreter's
//! lock, which is taken again for laws written in Python and, now and then, to ask for signals: a lock of the engine is
//! therefore never waited for with the interpreter's lock held.
#![cfg(feature = "module")]

mod convert;
mod course;
mod engine;
mod gradient;
mod law;
mod log;
mod overrides;
mod plugins;
mod run;
mod scene;
mod simulation;
mod species;
mod step;
mod studies;
mod surface;

use pyo3::prelude::*;

/// Adds functions and classes to the module.
#[pymodule]
fn _rumple(module: &Bound<'_, PyModule>) -> PyResult<()> {
    plugins::remember_package(module.py())?;
    engine::add_errors(module)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<law::Law>()?;
    module.add_class::<law::Batch>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<course::Simulation>()?;
    module.add_class::<gradient::Objective>()?;
    module.add_class::<species::Species>()?;
    module.add_class::<run::State>()?;
    module.add_class::<step::Step>()?;
    module.add_function(wrap_pyfunction!(panic, module)?)?;
    module.add_function(wrap_pyfunction!(run::run, module)?)?;
    module.add_function(wrap_pyfunction!(run::draw, module)?)?;
    module.add_function(wrap_pyfunction!(run::report, module)?)?;
    module.add_function(wrap_pyfunction!(run::resume, module)?)?;
    module.add_function(wrap_pyfunction!(studies::sweep, module)?)?;
    module.add_function(wrap_pyfunction!(studies::accuracy, module)?)?;
    module.add_function(wrap_pyfunction!(studies::compare, module)?)?;
    module.add_function(wrap_pyfunction!(studies::member, module)?)?;
    module.add_function(wrap_pyfunction!(scene::load, module)?)?;
    module.add_function(wrap_pyfunction!(scene::parse, module)?)?;
    module.add_function(wrap_pyfunction!(scene::tables_as_toml, module)?)?;
    module.add_function(wrap_pyfunction!(surface::read_surface, module)?)
}

/// Panics in the engine, for tests.
#[pyfunction(name = "_panic")]
fn panic(py: Python<'_>) -> PyResult<()> {
    engine::call(py, || panic!("on purpose"))
}
