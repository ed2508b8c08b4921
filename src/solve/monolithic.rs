//! The coupled system in one piece: diffsol's implicit methods on `M dy/dt = F(t, y)`.
//!
//! Works under every policy: they differ in M alone. Rows without storage make it a semi-explicit
//! differential-algebraic system of index 1 as long as their block of ∂F/∂y is regular. At a
//! buckling point under the quasi-static policy it is not: Newton's method then fails, and the
//! integrator stops with the reason; the staggered integrator goes on there, as does a small drag
//! with `simultaneous`.

use std::sync::Arc;

use diffsol::OdeSolverProblem;
use self_cell::self_cell;
use serde::{Deserialize, Serialize};

use super::chemistry::relax_chemistry;
use super::equilibrium::Relaxation;
use super::ode::{Equations, OdeMethod, OdeProblem, Options, Stepper, make_consistent, problem};
use super::{Integrator, IntegratorSpec, SolveError, StepReport};
use crate::Result;
use crate::num::checked::Positive;
use crate::solve::linear::{LinearChoice, Sparse};
use crate::state::State;
use crate::system::{Coupled, Course, System};
use crate::timescale::Storage;

/// Parameters of the monolithic integrator in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MonolithicSpec {
    /// The method.
    #[serde(default)]
    pub method: ImplicitMethod,
    /// Relative tolerance of displacements and species.
    #[serde(default = "default_rtol")]
    pub rtol: Positive,
    /// Absolute tolerance, in units of the mean edge and of each species' typical magnitude.
    #[serde(default = "default_atol")]
    pub atol: Positive,
    /// First step; chosen from the first rates if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Positive>,
    /// How linear systems are solved.
    #[serde(default)]
    pub linear: LinearChoice,
}

/// diffsol's implicit methods.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ImplicitMethod {
    /// Backward differences of variable order 1 to 5.
    #[default]
    Bdf,
    /// Trapezoidal rule and second backward difference, order 2.
    TrBdf2,
    /// Singly diagonally implicit Runge-Kutta of order 3.
    Esdirk34,
}

impl From<ImplicitMethod> for OdeMethod {
    fn from(method: ImplicitMethod) -> Self {
        match method {
            ImplicitMethod::Bdf => Self::Bdf,
            ImplicitMethod::TrBdf2 => Self::TrBdf2,
            ImplicitMethod::Esdirk34 => Self::Esdirk34,
        }
    }
}

pub(super) fn default_rtol() -> Positive {
    Positive::new(1e-4).unwrap_or(Positive::ONE)
}

pub(super) fn default_atol() -> Positive {
    Positive::new(1e-6).unwrap_or(Positive::ONE)
}

#[typetag::serde(name = "monolithic")]
impl IntegratorSpec for MonolithicSpec {
    fn name(&self) -> String {
        format!("monolithic, {}", OdeMethod::from(self.method).name())
    }

    fn build(&self, policy: Storage) -> Result<Box<dyn Integrator>, SolveError> {
        Ok(Box::new(InOnePiece {
            policy,
            method: self.method.into(),
            linear: self.linear,
            rtol: self.rtol.get(),
            atol: self.atol.get(),
            step: self.step.map(Positive::get),
            part: Part::Whole,
            running: None,
        }))
    }
}

crate::register_kind!(dyn IntegratorSpec, "monolithic", MonolithicSpec);

/// The coupled system on loan to the equations while a step is made.
struct OnLoan {
    system: System,
    coupled: Coupled,
    /// Factors that turn the mass of rows with storage into 1.
    scale: Vec<f64>,
    matrix: Sparse,
}

impl OdeProblem for OnLoan {
    fn unknowns(&self) -> usize {
        self.coupled.layout().unknowns()
    }

    fn stored(&self) -> Option<Vec<bool>> {
        let mass = self.coupled.mass();
        mass.contains(&0.0).then(|| mass.iter().map(|m| *m != 0.0).collect())
    }

    fn residual(&mut self, time: f64, y: &[f64], out: &mut [f64]) -> Result<()> {
        self.coupled.residual(&mut self.system, time, y, out)?;
        for (out, scale) in out.iter_mut().zip(&self.scale) {
            *out *= scale;
        }
        Ok(())
    }

    fn jacobian(&mut self, time: f64, y: &[f64]) -> Result<&Sparse> {
        self.matrix.clone_from(self.coupled.jacobian(&mut self.system, time, y)?);
        self.matrix.scale_rows(&self.scale);
        Ok(&self.matrix)
    }
}

type Owner = OdeSolverProblem<Equations<OnLoan>>;
type Borrower<'a> = Stepper<'a, OnLoan>;

self_cell!(
    struct Running {
        owner: Owner,
        #[not_covariant]
        dependent: Borrower,
    }
);

/// What of the system moves, and how the rest does meanwhile.
enum Part {
    /// All of it.
    Whole,
    /// The shape, with the species on a course.
    Shape(Course),
    /// The species, with the signals on a course.
    Chemistry(Course),
}

/// The integrator of diffsol's methods on the whole system, or on a part of it.
pub(super) struct InOnePiece {
    policy: Storage,
    method: OdeMethod,
    linear: LinearChoice,
    rtol: f64,
    atol: f64,
    step: Option<f64>,
    part: Part,
    running: Option<(Running, Arc<State>)>,
}

impl InOnePiece {
    /// With these choices, from the first step on.
    pub(super) fn new(
        policy: Storage,
        method: OdeMethod,
        (rtol, atol): (f64, f64),
        step: Option<f64>,
    ) -> Self {
        let linear = LinearChoice::default();
        Self { policy, method, linear, rtol, atol, step, part: Part::Whole, running: None }
    }

    /// Of the shape alone, as it moves under drag while the species go along `course`:
    /// `drag dx/dt = -∂U/∂x`.
    pub(super) fn of_shape(policy: Storage, tolerance: (f64, f64), course: Course) -> Self {
        let part = Part::Shape(course);
        Self { part, ..Self::new(policy, OdeMethod::TrBdf2, tolerance, None) }
    }

    /// Of the chemistry alone, with the transport of the shape last followed, while the signals go
    /// along `course`.
    pub(super) fn of_chemistry(method: OdeMethod, tolerance: (f64, f64), course: Course) -> Self {
        let policy = Storage { mechanics: 0.0, chemistry: 1.0 };
        let part = Part::Chemistry(course);
        Self { part, ..Self::new(policy, method, tolerance, None) }
    }

    /// The unknowns and what they obey.
    fn coupled(&self, system: &mut System) -> Coupled {
        let (mut coupled, course) = match &self.part {
            Part::Whole => return Coupled::new(system, self.policy),
            Part::Shape(course) => (Coupled::shape_alone(system, self.policy), course),
            Part::Chemistry(course) => (Coupled::chemistry_alone(system, self.policy), course),
        };
        coupled.set_course(course.clone());
        coupled
    }

    /// Starts anew from `state`.
    fn restart(&self, system: &mut System, state: &State, until: f64) -> Result<Running> {
        let mut coupled = self.coupled(system);
        coupled.start(state);
        let mut start = vec![0.0; coupled.layout().unknowns()];
        coupled.pack(system, state, &mut start);
        let options = Options {
            method: self.method,
            linear: self.linear,
            displacements: coupled.displacements(system),
            rtol: self.rtol,
            atol: coupled.tolerances(system, self.atol),
            step: self.step,
            span: until - state.time,
        };
        let scale = coupled.mass().iter().map(|m| if *m == 0.0 { 1.0 } else { 1.0 / m }).collect();
        let mut loan =
            OnLoan { system: std::mem::take(system), coupled, scale, matrix: Sparse::default() };
        if let Err(error) = make_consistent(&mut loan, state.time, &mut start, &options) {
            *system = loan.system;
            return Err(error);
        }
        let implicit = self.method.is_implicit();
        let equations =
            Equations::new(loan, state.time, start, implicit).map_err(|(loan, e)| {
                *system = loan.system;
                e
            })?;
        let owner = problem(equations, state.time, &options)?;
        let made = Running::try_new_or_recover(owner, |owner| Stepper::new(owner, &options));
        match made {
            Ok(running) => {
                *system = take_back(&running);
                Ok(running)
            }
            Err((owner, error)) => {
                *system = owner.eqn.into_problem().system;
                Err(error)
            }
        }
    }
}

fn take_back(running: &Running) -> System {
    running.with_dependent(|owner, _| owner.eqn.with(|loan| std::mem::take(&mut loan.system)))
}

impl Integrator for InOnePiece {
    fn prepare(&mut self, system: &mut System, state: &mut State) -> Result<Relaxation> {
        let mut done = system.relax(state)?;
        if self.policy.chemistry == 0.0 {
            let work = relax_chemistry(system, state, (self.rtol, self.atol))?;
            done.factorisations += work;
            done.residual = system.residual(state);
        }
        Ok(done)
    }

    fn advance(
        &mut self,
        system: &mut System,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        let running = match self.running.take() {
            Some((running, last)) if *last == *state => running,
            _ => self.restart(system, state, until)?,
        };
        let mut running = running;
        let (before, began) = (state.clone(), state.time);
        let tolerance = (self.rtol, self.atol);
        let loaned = std::mem::take(system);
        let (done, work, earlier) = running.with_dependent_mut(|owner, stepper| {
            owner.eqn.with(|loan| loan.system = loaned);
            let earlier = stepper.work();
            let mut next = before.clone();
            let done = stepper.step(until, |time, y| {
                owner.eqn.with(|loan| {
                    loan.coupled.unpack(&mut loan.system, y, time, &mut next);
                    loan.system.keep_in_range(&mut next.species, time, tolerance)
                })
            });
            (done.map(|()| next), stepper.work(), earlier)
        });
        *system = take_back(&running);
        match done {
            Ok(mut next) => {
                next.step += 1;
                system.follow(&next)?;
                *state = next;
                self.running = Some((running, Arc::new(state.clone())));
            }
            Err(error) => {
                system.follow(&before)?;
                return Err(error);
            }
        }
        let mut report = StepReport {
            step: state.time - began,
            rejected: work.rejected - earlier.rejected,
            ..StepReport::default()
        };
        report.relaxation.iterations = work.iterations - earlier.iterations;
        report.relaxation.factorisations = work.factorisations - earlier.factorisations;
        if !matches!(self.part, Part::Chemistry(_)) {
            report.relaxation.residual = system.residual(state);
        }
        Ok(report)
    }
}
