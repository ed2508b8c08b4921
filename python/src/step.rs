//! The report of a step.

use pyo3::prelude::*;
use rumple::solve::StepReport;

/// An accepted step.
#[pyclass(module = "rumple", frozen, get_all)]
pub(crate) struct Step {
    /// Number of the step, from 1.
    number: u64,
    /// Time reached.
    time: f64,
    /// Length of the step.
    length: f64,
    /// Error estimate in units of the tolerance (0 for fixed steps).
    error: f64,
    /// Iterations of the relaxations in the step.
    iterations: usize,
    /// Largest force left, in units of the force scale.
    residual: f64,
    /// Rejected step attempts.
    rejected: u64,
    /// Work that the drag took up, energy.
    dissipated: f64,
    /// Snaps that ended.
    snaps: usize,
}

impl Step {
    /// Of `report`, which led to the time and number of `state`.
    pub(crate) fn of(state: &rumple::model::State, report: &StepReport) -> Self {
        Self {
            number: state.step,
            time: state.time,
            length: report.length,
            error: report.error,
            iterations: report.relaxation.iterations,
            residual: report.relaxation.residual,
            rejected: report.work.rejected,
            dissipated: report.relaxation.dissipated,
            snaps: report.relaxation.snaps,
        }
    }
}

#[pymethods]
impl Step {
    fn __repr__(&self) -> String {
        let Self { number, time, length, error, iterations, .. } = self;
        format!(
            "Step(number={number}, time={time}, length={length}, error={error}, iterations={iterations})"
        )
    }
}
