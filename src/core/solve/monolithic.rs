//! The coupled system in one piece: diffsol's implicit methods on `M dy/dt = F(t, y)`.
//!
//! Works under every policy: they differ in M alone. Rows without storage make it a semi-explicit
//! differential-algebraic system of index 1 as long as their block of ∂F/∂y is regular. At a
//! buckling point under the quasi-static policy it is not: Newton's method then fails, and the
//! integrator stops with the reason; the staggered integrator passes it, as does a small drag
//! with `simultaneous`.

mod spec;

pub use spec::{ImplicitMethod, MonolithicSpec};
pub(super) use spec::{default_atol, default_rtol};

use std::sync::Arc;

use super::chemistry::{Leap, SteadyChemistry};
use super::diagnosis::{Diagnosis, Reason};
use super::positivity;
use super::progress::no_progress;
use super::rejections::Rejection;
use super::{Control, Integrator, Result, SolveError, StepReport, Workspace, counters};
use crate::linear::{LinearChoice, Sparse};
use crate::model::{Coupled, Layout, LinearInTime, Model, ModelError, Positions, State, Subsystem};
use crate::ode::{Failure, Integration, OdeError, OdeMethod, OdeProblem, Options, Rejected};
use crate::tally::Meter;

/// Steps after which a run restarts the integration, so that it can be continued from there: what diffsol
/// remembers cannot be stored. A new start of BDF costs some seven steps, seven factorisations and the analysis of
/// the matrix, a hundredth of what so many steps cost; of the other methods less (docs/notebook/performance.md).
const RENEWED_AFTER: u64 = 3000;

/// The coupled system as an integrator sees it: rows with storage divided by their mass.
struct Problem {
    coupled: Coupled,
    control: Control,
    /// Factors that turn the mass of rows with storage into 1; none where all are.
    scale: Option<Vec<f64>>,
}

impl OdeProblem for Problem {
    fn unknowns(&self) -> usize {
        self.coupled.layout().unknowns()
    }

    fn differential(&self) -> Option<Vec<bool>> {
        let differential = || self.coupled.mass().map(|m| m != 0.0);
        differential().any(|differential| !differential).then(|| differential().collect())
    }

    fn rhs(&mut self, time: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure> {
        // Every integration comes by here often.
        self.control.check().map_err(SolveError::into_failure)?;
        let done = self.coupled.residual(time, y, out);
        done.map_err(|e| SolveError::from(self.coupled.blamed(e)).into_failure())?;
        for (out, scale) in out.iter_mut().zip(self.scale.iter().flatten()) {
            *out *= scale;
        }
        Ok(())
    }

    fn jacobian(&mut self, time: f64, y: &[f64]) -> Result<&Sparse, Failure> {
        self.control.check().map_err(SolveError::into_failure)?;
        let jacobian = self.coupled.jacobian(time, y);
        let jacobian = jacobian.map_err(|e| SolveError::from(e).into_failure())?;
        if let Some(scale) = &self.scale {
            jacobian.scale_rows(scale);
        }
        Ok(jacobian)
    }

    fn last_jacobian(&self) -> &Sparse {
        self.coupled.last_jacobian()
    }
}

/// An integration under way.
struct Running {
    integration: Integration<Problem>,
    layout: Arc<Layout>,
    /// Where it is; `None` after a failed step. From another state it restarts.
    at: Option<State>,
    /// The shape of the unknowns, where a sheet that floats is moved rigidly from there.
    unsettled: Option<Positions>,
}

/// The integrator of diffsol's methods on the whole system, or on a part of it.
pub(super) struct Monolithic {
    part: Subsystem,
    method: OdeMethod,
    linear: LinearChoice,
    rtol: f64,
    atol: f64,
    /// Tolerances of the error of one step, relative to these.
    local_share: f64,
    step: Option<f64>,
    course: Option<LinearInTime>,
    running: Option<Running>,
    steady: SteadyChemistry,
    /// Of its steps; made with the first.
    meter: Option<Meter>,
}

impl Monolithic {
    /// With these choices, from the first step on.
    pub(super) fn new(
        part: Subsystem,
        method: OdeMethod,
        (rtol, atol): (f64, f64),
        step: Option<f64>,
    ) -> Self {
        let (linear, steady) = (LinearChoice::default(), SteadyChemistry::default());
        let (course, running, meter) = (None, None, None);
        let local_share = 1.0;
        Self { part, method, linear, rtol, atol, local_share, step, course, running, steady, meter }
    }

    /// Of the chemistry alone, on the shape that it starts with.
    pub(super) fn of_chemistry(method: OdeMethod, tolerance: (f64, f64)) -> Self {
        Self::new(Subsystem::Chemistry, method, tolerance, None)
    }

    /// Whether it remembers nothing of earlier steps.
    pub(super) fn is_new(&self) -> bool {
        self.running.is_none()
    }

    /// Forgets all earlier steps.
    pub(super) fn forget(&mut self) {
        self.running = None;
    }

    /// Lets the other part go along `course` from now on.
    pub(super) fn set_course(&mut self, course: LinearInTime) {
        self.course = Some(course);
        if let Some(running) = &mut self.running {
            running.at = None;
        }
    }

    /// Restarts from `state`; layout, patterns and analyses stay.
    fn restart(
        &mut self,
        workspace: &Workspace,
        state: &State,
        until: f64,
    ) -> Result<(), OdeError> {
        let span = until - state.time;
        let begin = |coupled: &mut Coupled| {
            coupled.start(state);
            if let Some(course) = &self.course {
                coupled.set_course(course.clone());
            }
            coupled.pack(state)
        };
        if let Some(Running { integration, at, unsettled, .. }) = &mut self.running {
            (*at, *unsettled) = (None, None);
            let start = integration.with(|problem| {
                problem.control = workspace.control.clone();
                begin(&mut problem.coupled)
            });
            return integration.restart(state.time, start.unwrap_or_default(), span);
        }
        let mut coupled = Coupled::new(&workspace.model, self.part);
        let unknowns = coupled.layout().unknowns();
        let displacements = coupled.layout().mechanical() > 0;
        if self.linear.resolve(unknowns, displacements) == LinearChoice::Ilu {
            coupled.use_incomplete_factor();
        }
        let start = begin(&mut coupled);
        let options = Options {
            method: self.method,
            linear: self.linear,
            displacements: coupled.displacements(),
            rtol: self.local_share * self.rtol,
            atol: coupled.tolerances(self.local_share * self.atol),
            step: self.step,
            span,
            tally: workspace.model.tally().clone(),
        };
        let scale = |m: f64| if m == 0.0 { 1.0 } else { 1.0 / m };
        let scaled = coupled.mass().any(|m| scale(m) != 1.0);
        let scale = scaled.then(|| coupled.mass().map(scale).collect());
        let layout = Arc::clone(coupled.layout());
        let control = workspace.control.clone();
        let problem = Problem { coupled, control, scale };
        let integration = Integration::new(problem, state.time, start, options)?;
        self.running = Some(Running { integration, layout, at: None, unsettled: None });
        Ok(())
    }

    /// One step that does not pass `until`, from values raised to 0 where it leads below; on an error `state` is as before.
    pub(super) fn step(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        match self.attempt(workspace, state, until) {
            Err(error @ SolveError::Model(ModelError::Negative { .. })) => {
                let mut raised = positivity::raised(workspace, state, (self.rtol, self.atol))?;
                if self.part == Subsystem::Whole {
                    let message = error.to_string();
                    let new = Rejection::new(state, f64::NAN, error.cause());
                    workspace.reject(Rejection { message, ..new });
                }
                let report = self.attempt(workspace, &mut raised, until)?;
                *state = raised;
                Ok(report)
            }
            done => done,
        }
    }

    fn attempt(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        let tally = workspace.model.tally();
        let meter = self.meter.get_or_insert_with(|| counters::meter(tally, counters::INTEGRATOR));
        let _scope = meter.scope("calls");
        let here = |running: &Running| running.at.as_ref() == Some(state);
        if !self.running.as_ref().is_some_and(here) {
            self.restart(workspace, state, until).map_err(|error| match error {
                OdeError::TooFast { step } => no_progress(workspace, state, step),
                error => error.into(),
            })?;
        }
        let Some(Running { integration, layout, at, unsettled }) = &mut self.running else {
            return Err(SolveError::NotFinite);
        };
        // The accepted state is the start of the next step.
        let mut next = at.take().unwrap_or_else(|| state.clone());
        if let Some(shape) = unsettled.take() {
            next.x = shape;
        }
        let tolerance = (self.rtol, self.atol);
        let model = Arc::clone(&workspace.model);
        let mut rejected = Rejected::default();
        let mut accept = |time: f64, y: &[f64]| {
            layout.unpack(model.mechanics(), time, y, &mut next);
            model.hold(time, &mut next.species);
            let kept = model.keep_in_range(&mut next.species, time, tolerance);
            kept.map_err(|e| SolveError::from(e).into_failure())?;
            // No shorter step from the same values leads elsewhere.
            positivity::check(workspace, state, &next, tolerance)
                .map_err(|e| Failure { recoverable: false, ..e.into_failure() })
        };
        let stepped = integration.step(until, &mut accept, &mut rejected);
        match self.part {
            Subsystem::Whole => workspace.reject_all(state, rejected),
            Subsystem::Chemistry => model.tally().count(|work| {
                work.substeps += u64::from(stepped.is_ok());
                work.rejected_substeps += rejected.count();
            }),
        }
        stepped.map_err(|error| explained(error.into(), &model, (self.part, state.time)))?;
        next.step += 1;
        // Without storage the vertices that are held decide where the sheet lies.
        if self.part == Subsystem::Whole && model.moves() && model.mass_weights().mechanics == 0.0 {
            let shape = next.x.clone();
            workspace.align(&mut next, &state.x)?;
            *unsettled = (next.x != shape).then_some(shape);
        }
        let mut report = StepReport { length: next.time - state.time, ..StepReport::default() };
        if self.part != Subsystem::Chemistry {
            report.relaxation.residual = workspace.reported_residual(&next)?;
        }
        state.clone_from(&next);
        *at = Some(next);
        Ok(report)
    }
}

/// `error` of a part at the time reached: where the chemistry is steady at every time, no step however short leads
/// beyond the end of its steady state.
fn explained(error: SolveError, model: &Model, (part, time): (Subsystem, f64)) -> SolveError {
    let steady = part == Subsystem::Whole && model.mass_weights().chemistry == 0.0;
    // A step over the fold ends at no state of the model.
    let ends = matches!(
        error,
        SolveError::Integrator { .. } | SolveError::Model(ModelError::OutOfRange { .. })
    );
    if !(steady && ends) {
        return error;
    }
    let text = format!(
        "the steady state that the chemistry is in ends near time {time} (a fold), and no step however short leads on to \
         another one"
    );
    let advice = "time.integrator = \"staggered\", which continues with the steady state that the chemistry then reaches";
    let (reason, advice) = (Reason::Chemistry, advice.to_owned());
    let diagnosis = Box::new(Diagnosis { reason, text, advice });
    SolveError::Diagnosed { diagnosis, error: Box::new(error) }
}

impl Integrator for Monolithic {
    fn prepare(&mut self, workspace: &mut Workspace, state: &mut State) -> Result<()> {
        if workspace.model.mass_weights().chemistry == 0.0 {
            let tolerance = (self.rtol, self.atol);
            self.steady.solve(workspace, state, tolerance, Leap::Allowed)?;
        }
        Ok(())
    }

    fn advance(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        self.step(workspace, state, until)
    }
    fn renewed_after(&self) -> Option<u64> {
        Some(RENEWED_AFTER)
    }

    fn renew(&mut self) {
        self.forget();
    }

    fn is_storable(&self) -> bool {
        self.is_new()
    }
}
