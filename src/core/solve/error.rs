//! Why a solver stopped without a result.

use super::diagnosis::Diagnosis;
use crate::linear::LinearError;
use crate::model::ModelError;
use crate::num::Short;
use crate::ode::{Failure, OdeError};

/// Shorthand for results with [`SolveError`].
pub type Result<T, E = SolveError> = std::result::Result<T, E>;

/// Residual forces above this correspond to strains of a per cent: no tolerance to recommend.
pub(super) const LOOSEST_TOLERANCE: f64 = 1e-2;

/// What to try when a relaxation does not converge: keys with values.
fn other_ways(residual: f64, tolerance: f64, iterations: Option<usize>) -> String {
    let mut ways = Vec::new();
    if residual <= (1e3 * tolerance).min(0.5 * LOOSEST_TOLERANCE) {
        ways.push(format!(
            "equilibrium.tolerance = {:.0e} if that force is small enough",
            2.0 * residual
        ));
    }
    if let Some(iterations) = iterations {
        ways.push(format!(
            "equilibrium.max_iterations = {} if it still falls",
            iterations.saturating_mul(4).max(1000)
        ));
    }
    format!(
        "{}{}equilibrium.largest_move = 0.2, equilibrium.preconditioner = \"multigrid\", \
         equilibrium.method = \"newton\", or smaller changes per step \
         (time.integrator.longest_step or rtol)",
        if ways.is_empty() { "try " } else { "try, in this order, " },
        ways.iter().map(|way| format!("{way}, ")).collect::<String>(),
    )
}

/// Why a solver stopped without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// A step to a time that is not later.
    #[error("no step leads from time {time} to {until}")]
    NoStep {
        /// The time of the state.
        time: f64,
        /// The time asked for.
        until: f64,
    },
    /// A state of another sheet or of other species.
    #[error("the state has {found} {what}, expected {expected}")]
    Shape {
        /// Of what: positions, species, or values of a species.
        what: String,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A start that an effect cannot begin with.
    #[error("the effect {effect} cannot begin with this shape: {why}")]
    Start {
        /// Its name.
        effect: String,
        /// Why, and where.
        why: String,
    },
    /// The model has no value, or refuses a state.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A sparse factorisation could not be set up or done.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// Energy or force is not a number.
    #[error(
        "energy or force is not a finite number: a triangle has no area, or positions are not \
         finite"
    )]
    NotFinite,
    /// The energy or a force of one effect is not a number.
    #[error(
        "the energy or a force of the effect {effect} is not a finite number at time {time}: its ramp or \
         target has no value there, or a triangle has no area"
    )]
    EffectNotFinite {
        /// Its name.
        effect: String,
        /// The time.
        time: f64,
    },
    /// The force tolerance was not reached.
    #[error(
        "relaxation stopped after {iterations} iterations with a largest force of {residual:.3e} \
         (tolerance {tolerance:.1e}, in units of Y times the edge length); {}",
        other_ways(*residual, *tolerance, Some(*iterations))
    )]
    NotConverged {
        /// Iterations taken.
        iterations: usize,
        /// Largest force left.
        residual: f64,
        /// Force asked for.
        tolerance: f64,
    },
    /// No step goes downhill without collapsing a triangle.
    #[error(
        "relaxation stalled after {iterations} iterations: no step lowers the energy \
         without collapsing a triangle (largest force {residual:.3e}, tolerance {tolerance:.1e}); {}",
        other_ways(*residual, *tolerance, None)
    )]
    Stalled {
        /// Iterations taken.
        iterations: usize,
        /// Largest force left.
        residual: f64,
        /// Force asked for.
        tolerance: f64,
    },
    /// A relaxation came to no end, and why is seen.
    #[error(
        "relaxation stopped{} with a largest force of {residual:.3e} \
         (tolerance {tolerance:.1e}, in units of Y times the edge length); {diagnosis}",
        after(*iterations)
    )]
    NotAtRest {
        /// Iterations taken.
        iterations: usize,
        /// Largest force left.
        residual: f64,
        /// Force asked for.
        tolerance: f64,
        /// Why.
        diagnosis: Box<Diagnosis>,
    },
    /// Something else failed first, and why is seen.
    #[error("{diagnosis}\nit showed as: {error}")]
    Diagnosed {
        /// Why.
        diagnosis: Box<Diagnosis>,
        /// What failed.
        error: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A triangle has lost its area.
    #[error(
        "triangle {triangle} (vertices {vertices:?}) collapses: after {iterations} iterations its \
         area is nearly zero, and no step lowers the energy further (largest force \
         {residual:.3e}); its optimal lengths are {optimal:.3?}. Use equilibrium.method = \"lbfgs\" if it is another, a finer mesh or a smoother \
         length factor, or continue with equilibrium.collapse = \"hold\", which fixes its vertices, or \
         \"turn\", which lets it turn over"
    )]
    Collapsed {
        /// The triangle.
        triangle: usize,
        /// Its vertices.
        vertices: [u32; 3],
        /// Its optimal lengths, opposite each corner.
        optimal: [f64; 3],
        /// Iterations taken.
        iterations: usize,
        /// Largest force left.
        residual: f64,
    },
    /// A policy and an integrator that do not fit.
    #[error("{0}")]
    Pairing(String),
    /// The error estimate asks for ever smaller steps.
    #[error(
        "the error of the coupling needs steps below {step:.1e} at time {time}: a law or the shape jumps or blows up \
         there, or the tolerance asks for more than round-off leaves; try a looser time.integrator.rtol, or a law that is \
         smooth and bounded"
    )]
    StepTooSmall {
        /// Time reached.
        time: f64,
        /// The step that would have been tried next.
        step: f64,
    },
    /// Steps lead nowhere.
    #[error(
        "steps of {step:.1e} lead nowhere at time {}: {fastest}; try smaller rates, a stiff method (time.integrator = \
         {{ kind = \"monolithic\" }}), or an end of the run on the time scale of these rates (time.until)",
        Short(*time)
    )]
    NoProgress {
        /// Time reached.
        time: f64,
        /// The length of the steps.
        step: f64,
        /// The fastest rate.
        fastest: String,
    },
    /// The rates change too fast for any step, or a triangle has no area.
    #[error(
        "the fastest rate of the chemistry at time {time} is not a finite number: a triangle has \
         no area, or a partial derivative of the kinetics is not finite"
    )]
    SpectralBound {
        /// Time reached.
        time: f64,
    },
    /// An integration within a coupling step does not complete.
    #[error("the chemistry needs more than {steps} steps within one coupling step at time {time}")]
    TooManySteps {
        /// Time reached.
        time: f64,
        /// Steps taken.
        steps: usize,
    },
    /// Rates jump however short the steps of the chemistry are.
    #[error(
        "the chemistry is not resolved at time {time}: {} steps of it and {} rejected ones do not lead through one step \
         of the coupling, and they are {length:.1e} long by now. The rate of {what} goes from {:.3e} to {:.3e} within \
         one of them: its law has a pole or a switch there, from where on its equation has no solution, or none that \
         steps can follow; try a law that is smooth and finite there, or an end before that time (time.until)",
        steps[0], steps[1], rates[0], rates[1]
    )]
    Unresolved {
        /// Time reached.
        time: f64,
        /// Length of the steps.
        length: f64,
        /// Steps taken, and rejected.
        steps: [u64; 2],
        /// The number of the unknown whose rate jumps …
        unknown: usize,
        /// … and its description.
        what: String,
        /// Its rate before and after.
        rates: [f64; 2],
    },
    /// A coefficient that reads species becomes inadmissible however short the steps of the chemistry are.
    #[error(
        "{cause}, however short the steps of the chemistry near time {time}; try a formula that stays in its range, as \
         max(…, 0), or an end before that time (time.until)"
    )]
    Inadmissible {
        /// Time reached.
        time: f64,
        /// The coefficient, and where.
        cause: ModelError,
    },
    /// An implicit or explicit integrator of the library gave up.
    #[error(
        "the {method} integrator stopped at time {time}: {message}; try a looser time.integrator.rtol or another \
         integrator, and look whether a law or the shape jumps there"
    )]
    Integrator {
        /// Its name.
        method: &'static str,
        /// Time reached.
        time: f64,
        /// What it says.
        message: String,
    },
    /// The system that an integrator solves has no value, for a reason of its own.
    #[error("{cause}")]
    Problem {
        /// The reason.
        cause: Box<dyn std::error::Error + Send + Sync>,
        /// Whether a smaller step may do without this failure.
        recoverable: bool,
    },
    /// The chemistry comes to no rest while the shape does not move.
    #[error(
        "the chemistry reaches no steady state at time {time} (it still changes by \
         {rate:.1e} of its size per unit of time): the policy `chemistry-fast` needs one"
    )]
    NotSteady {
        /// Time reached.
        time: f64,
        /// Largest relative rate left.
        rate: f64,
    },
    /// The steady state of the chemistry ends, or moves far, in one step.
    #[error("the chemistry leaves its steady state for another one before time {time}")]
    Leap {
        /// End of the step.
        time: f64,
    },
    /// The smallest eigenvalues at a shape were not found.
    #[error("only {found} of the {wanted} smallest eigenvalues of the Hessian were found")]
    Modes {
        /// Eigenvalues that converged.
        found: usize,
        /// Eigenvalues asked for.
        wanted: usize,
    },
    /// A constraint that no shape near by meets at rest.
    #[error("{}", unmet(constraint, *value, *residual))]
    Constraint {
        /// Its name.
        constraint: String,
        /// What should be 0.
        value: f64,
        /// Largest force where it is met, if it is.
        residual: Option<f64>,
    },
    /// An obstacle that a ramp moves comes too near to a shape in one step.
    #[error("{}", obstructed(*time, *pinned))]
    Obstructed {
        /// End of the step.
        time: f64,
        /// The vertex that the obstacle presses most, where pins hold it against that.
        pinned: Option<usize>,
    },
    /// A relaxation has left its trust region.
    #[error("no equilibrium lies within the trust region of the relaxation")]
    Departed,
    /// The shape leaves its branch of equilibria and the gradient flow leads to no other one.
    #[error(
        "at time {time} the shape jumps, and the motion that follows comes to no equilibrium: a limit load, or growth \
         that the mesh does not resolve; try time.policy = \"simultaneous\", which shows the motion, a smaller load, \
         shorter steps (time.integrator.longest_step) or a finer mesh"
    )]
    WithoutRest {
        /// When.
        time: f64,
    },
    /// A shape under drag moves without bound.
    #[error("the motion of the shape under drag blows up near time {time}")]
    BlowUp {
        /// When.
        time: f64,
    },
    /// The volume that a closed sheet encloses changes its sign in a quasi-static step, without pins that lead it there, or while a
    /// start is released.
    #[error(
        "the closed sheet jumps inside out, through itself: the scene lists no contact; try the effect `contact`, a \
         smaller load, or an effect that holds the volume"
    )]
    InsideOut,
    /// A branch of equilibria that is lost.
    #[error("{}", lost(*parameter, *step))]
    Continuation {
        /// The last value of the parameter.
        parameter: f64,
        /// The shortest step, in arc length; 0 at its start.
        step: f64,
    },
    /// An effect with which branches are not followed.
    #[error("branches of equilibria are not followed with the effect {effect}: {why}")]
    NotFollowed {
        /// Its name.
        effect: String,
        /// Why.
        why: String,
    },
    /// No derivative of an equilibrium or a steady state by parameters.
    #[error("no gradient: {why}")]
    NotDifferentiable {
        /// Why.
        why: String,
    },
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}

/// Why a branch ends, or does not begin.
fn lost(parameter: f64, step: f64) -> String {
    if step == 0.0 {
        return format!(
            "the branch does not begin: Newton's method finds no equilibrium near the start, at the parameter {parameter}; \
             try a smaller equilibrium.tolerance, or a state nearer to an equilibrium"
        );
    }
    format!(
        "the branch is lost beyond the parameter {parameter}: no equilibrium is found within a step of {step:.0e} along it. \
         A triangle collapses there, the energy has a kink, or the mesh does not resolve the shape; try a finer mesh, or a \
         looser equilibrium.tolerance"
    )
}

/// What a constraint wants: a shape that meets it, or forces that come to rest where it is met.
fn unmet(constraint: &str, value: f64, residual: Option<f64>) -> String {
    let advice = "let its target change more slowly (ramp), or give it a stiffness instead";
    match residual {
        Some(residual) => format!(
            "the forces under the constraint {constraint} do not come to rest: it is met, and the largest force is \
             {residual:.1e} (units of Y times the edge length); a larger equilibrium.tolerance, or {advice}"
        ),
        None => format!(
            "the constraint {constraint} is not met: {value:.1e} is left of it (at most 1e-9 is allowed); {advice}"
        ),
    }
}

/// Why an obstacle that moves comes no further before `time`.
fn obstructed(time: f64, pinned: Option<usize>) -> String {
    match pinned {
        Some(vertex) => format!(
            "before time {time} an obstacle reaches vertex {vertex}, which a pin holds in its way; try a displacement that ends before \
             it, or pins elsewhere (where, axes)"
        ),
        None => format!(
            "an obstacle would move through the sheet, or up to it, in one step before time {time}; try a slower ramp or a \
             shorter step"
        ),
    }
}

/// Where a relaxation stopped that may not have begun.
fn after(iterations: usize) -> String {
    if iterations == 0 { String::new() } else { format!(" after {iterations} iterations") }
}

impl SolveError {
    /// Whether a smaller time step may do without this failure: a relaxation that got stuck on
    /// the way, a chemistry that changed too fast, a law that asks for it.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::Model(error) => error.is_recoverable(),
            Self::Interrupted
            | Self::Pairing(_)
            | Self::Start { .. }
            | Self::Unresolved { .. }
            | Self::NoProgress { .. }
            | Self::Inadmissible { .. } => false,
            Self::Problem { recoverable, .. } => *recoverable,
            _ => true,
        }
    }

    /// Whether it is of a shape that finds no equilibrium.
    pub(super) fn is_without_rest(&self) -> bool {
        matches!(
            self,
            Self::Departed
                | Self::WithoutRest { .. }
                | Self::NotConverged { .. }
                | Self::Stalled { .. }
                | Self::Collapsed { .. }
                | Self::NotAtRest { .. }
                | Self::Constraint { .. }
        )
    }

    /// As a problem tells its integrator.
    pub(super) fn into_failure(self) -> Failure {
        let recoverable = self.is_recoverable();
        Failure { cause: Box::new(self), recoverable }
    }
}

impl From<OdeError> for SolveError {
    fn from(error: OdeError) -> Self {
        match error {
            OdeError::NotFinite => Self::NotFinite,
            OdeError::Linear(error) => Self::Linear(error),
            OdeError::TooFast { step } => {
                let fastest = "a rate is too large for any step".into();
                Self::NoProgress { time: 0.0, step, fastest }
            }
            OdeError::Stopped { method, time, message } => {
                Self::Integrator { method, time, message }
            }
            OdeError::Problem { cause: Failure { cause, recoverable } } => match cause.downcast() {
                Ok(own) => *own,
                Err(cause) => Self::Problem { cause, recoverable },
            },
        }
    }
}
