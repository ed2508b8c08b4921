//! An integration that owns its problem and is reused from step to step.
//!
//! diffsol's steppers borrow their problem; here the two are kept together, so that a caller
//! keeps one value. Started again elsewhere it keeps the pattern of ∂F/∂y and the analyses of the
//! linear solver.

use std::any::Any;
use std::marker::PhantomData;
use std::sync::Arc;

use self_cell::self_cell;

use super::consistent::{consistent_slope, make_consistent};
use super::equations::{Equations, tolerances};
use super::error_norm::Grouping;
use super::stepper::{Problem, Stepper, problem};
use super::{Accept, OdeError, OdeProblem, Options, Rejected, Result};
use crate::linear::Shifted;

self_cell!(
    struct Running {
        owner: Problem,
        #[not_covariant]
        dependent: Stepper,
    }
);

/// An integration of a problem of type P.
pub struct Integration<P> {
    running: Running,
    options: Arc<Options>,
    differential: Option<Vec<bool>>,
    newton: Option<Shifted>,
    kind: PhantomData<fn(P)>,
}

impl<P: OdeProblem> Integration<P> {
    /// From `start` at `time`; unknowns without storage are first brought to where their rows are 0.
    ///
    /// # Errors
    /// If F or its derivatives cannot be evaluated there.
    pub fn new(
        mut problem: P,
        time: f64,
        mut start: Vec<f64>,
        mut options: Options,
    ) -> Result<Self> {
        // diffsol keeps its own.
        let atol = std::mem::take(&mut options.atol);
        let options = Arc::new(options);
        let (differential, mut newton, mut slope) = (problem.differential(), None, None);
        if let Some(differential) = &differential {
            let from = (time, start.as_mut_slice());
            make_consistent(&mut problem, differential, from, (&options, &atol), &mut newton)?;
            let (from, by) = ((time, start.as_slice()), (&*options, &atol[..], options.span));
            slope = consistent_slope(&mut problem, differential, from, by, newton.as_mut());
        }
        let running = begin(Box::new(problem), time, (start, atol, slope), &options)?;
        Ok(Self { running, options, differential, newton, kind: PhantomData })
    }

    /// Restarts from `start` at `time`, to be integrated over about `span`.
    ///
    /// # Errors
    /// As for [`Integration::new`]; the integration can then be started again from elsewhere.
    pub fn restart(&mut self, time: f64, mut start: Vec<f64>, span: f64) -> Result<()> {
        let (options, newton) = (&self.options, &mut self.newton);
        if let Some(differential) = &self.differential {
            self.running.with_dependent(|problem, _| {
                let atol = tolerances(problem);
                let slope = problem.eqn.with(|problem| {
                    let from = (time, start.as_mut_slice());
                    make_consistent(problem, differential, from, (options, atol), newton)?;
                    let (from, by) = ((time, start.as_slice()), (&**options, atol, span));
                    Ok::<_, OdeError>(consistent_slope(
                        problem,
                        differential,
                        from,
                        by,
                        newton.as_mut(),
                    ))
                })?;
                problem.eqn.set_slope(time, slope);
                Ok::<_, OdeError>(())
            })?;
        }
        self.running.with_dependent_mut(|_, stepper| stepper.restart(time, &start, span))
    }

    /// Works with the problem; `None` does not happen, as P is what [`Integration::new`] was given.
    pub fn with<R>(&self, f: impl FnOnce(&mut P) -> R) -> Option<R> {
        self.running.with_dependent(|problem, _| {
            problem.eqn.with(|problem| {
                let problem: &mut dyn Any = problem;
                problem.downcast_mut::<P>().map(f)
            })
        })
    }

    /// One step that does not pass `until`, and ends at it exactly where it comes within round-off of
    /// it. `accept` may refuse the new solution (time, values): the step is then repeated with a smaller
    /// size; numbers that are not finite are never shown to it, nor are those from where
    /// the next step would find no finite rates. Rejected step attempts are added to `rejected`.
    ///
    /// # Errors
    /// An error of F or of `accept` that no smaller step cures, or the last one if none did.
    pub fn step(
        &mut self,
        until: f64,
        accept: &mut Accept<'_>,
        rejected: &mut Rejected,
    ) -> Result<()> {
        self.running.with_dependent_mut(|_, stepper| stepper.step(until, accept, rejected))
    }
}

/// Not generic, so that diffsol's methods are compiled with this crate.
fn begin(
    of: Box<dyn OdeProblem>,
    time: f64,
    (start, atol, slope): (Vec<f64>, Vec<f64>, Option<Vec<f64>>),
    options: &Arc<Options>,
) -> Result<Running> {
    let context = Grouping::new(options.displacements.as_ref());
    let equations = Equations::new(of, start, context);
    equations.set_slope(time, slope);
    Running::try_new(problem(equations, time, atol, options)?, |owner| Stepper::new(owner, options))
}
