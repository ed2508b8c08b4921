//! Solvers: mechanical equilibrium and its stability, coupled stepping, linear systems.

pub mod chemistry;
pub mod equilibrium;
pub mod explicit;
pub mod linear;
pub mod monolithic;
pub mod ode;
pub mod stability;
pub mod staggered;

use crate::Result;
use crate::num::Short;
use crate::state::State;
use crate::system::{Mechanics, System};
use crate::timescale::Storage;
use equilibrium::{Equilibrium, Relaxation};

/// The integrator of a scene that names none.
pub const DEFAULT_INTEGRATOR: &str = "staggered";

/// The integrator of a scene that names none and whose policy is not quasi-static.
pub const OTHER_INTEGRATOR: &str = "monolithic";

/// The equilibrium method of a scene that names none.
pub const DEFAULT_EQUILIBRIUM: &str = "lbfgs";

/// A way to advance in time as a scene names it.
#[typetag::serde(tag = "kind")]
pub trait IntegratorSpec: std::fmt::Debug + Send + Sync {
    /// What the integrator is called in results.
    fn name(&self) -> String;

    /// Makes it ready for a policy.
    ///
    /// # Errors
    /// [`SolveError::Pairing`] if it makes no sense with that policy.
    fn build(&self, policy: Storage) -> Result<Box<dyn Integrator>, SolveError>;
}

/// A way to find mechanical equilibrium as a scene names it.
#[typetag::serde(tag = "method")]
pub trait EquilibriumSpec: std::fmt::Debug + Send + Sync {
    /// What the method is called in results.
    fn name(&self) -> String;

    /// Largest force on a vertex that counts as rest, in units of the force scale.
    fn tolerance(&self) -> f64;

    /// Iterations after which a relaxation has failed.
    fn max_iterations(&self) -> usize;

    /// Makes it ready for a sheet.
    ///
    /// # Errors
    /// If the sheet is too large for it.
    fn build(&self, mechanics: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError>;
}

/// A way to advance the coupled system.
pub trait Integrator: Send {
    /// Makes `state` satisfy the rows without storage, and the shape rest: every run starts from
    /// mechanical equilibrium.
    ///
    /// # Errors
    /// If the relaxation or the plugin fails.
    fn prepare(&mut self, system: &mut System, state: &mut State) -> Result<Relaxation> {
        system.relax(state)
    }

    /// Brings `state`, which satisfies the rows without storage, forward by one step that does
    /// not pass `until`.
    ///
    /// # Errors
    /// Whatever no shorter step cures; `state` is as before then, bit for bit.
    fn advance(&mut self, system: &mut System, state: &mut State, until: f64)
    -> Result<StepReport>;
}

/// End of a fixed step, which is never shortened but to hit an output time.
fn end_of_fixed_step(time: f64, step: f64, until: f64) -> f64 {
    let end = (time + step).min(until);
    if until - end < 1e-9 * step { until } else { end }
}

/// How far `what` is on its way through one step of the coupling, in words.
fn under_way(what: &str, (from, now, until): (f64, f64, f64)) -> String {
    let percent = 100.0 * (now - from) / (until - from);
    // Of a way of millions of steps the first per cent is long in coming.
    let percent = if percent < 0.1 { format!("{percent:.1e}") } else { format!("{percent:.1}") };
    format!("time {from:.6}: {what}, {percent} % of a step of {:.3e}", until - from)
}

/// What one accepted step did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepReport {
    /// Length of the step.
    pub step: f64,
    /// Error estimate in units of the tolerance (0 for fixed steps).
    pub error: f64,
    /// Tries that were rejected before.
    pub rejected: usize,
    /// Why the last of these came to no result, if it did not.
    pub reason: Option<String>,
    /// Work of all relaxations of the step, rejected ones included.
    pub relaxation: Relaxation,
}

/// What to try when a relaxation comes to no end.
const OTHER_WAYS: &str = "try another equilibrium.method (\"lbfgs\", \"newton\", \"fire\"), \
     equilibrium.preconditioner = \"multigrid\", a larger equilibrium.tolerance if that force is small \
     enough, or smaller changes a step (time.integrator.rtol or step)";

/// Why a solver stopped without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// A sparse factorisation could not be set up or done.
    #[error("{0}")]
    Factorisation(String),
    /// Energy or force is not a number.
    #[error(
        "energy or force is not a finite number: a triangle has no area, or positions are not finite"
    )]
    NotFinite,
    /// The force tolerance was not reached.
    #[error(
        "relaxation stopped after {iterations} iterations with a largest force of {residual:.3e} \
         (tolerance {tolerance:.1e}, in units of Y times the edge length); {OTHER_WAYS}"
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
        "relaxation can go no further after {iterations} iterations: no step lowers the energy \
         without collapsing a triangle (largest force {residual:.3e}, tolerance {tolerance:.1e}); \
         {OTHER_WAYS}"
    )]
    Stalled {
        /// Iterations taken.
        iterations: usize,
        /// Largest force left.
        residual: f64,
        /// Force asked for.
        tolerance: f64,
    },
    /// A triangle has lost its area.
    #[error(
        "triangle {triangle} (vertices {vertices:?}) collapses: after {iterations} iterations its \
         area is nearly zero, and no step lowers the energy further (largest force \
         {residual:.3e}); its optimal lengths are {optimal:?}. Use a finer mesh or a smoother \
         length factor, or go on with equilibrium = {{ method = \"lbfgs\", collapse = \"hold\" }}, which \
         holds its vertices"
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
    #[error("the coupling error needs steps below {step:.1e} at time {time}")]
    StepTooSmall {
        /// Time reached.
        time: f64,
        /// The step that would have been tried next.
        step: f64,
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
    /// An integration within a coupling step does not come to its end.
    #[error("the chemistry needs more than {steps} steps within one coupling step at time {time}")]
    TooManySteps {
        /// Time reached.
        time: f64,
        /// Steps taken.
        steps: usize,
    },
    /// A species left its valid range by more than the tolerance.
    #[error(
        "species `{species}` becomes {value:e} at {place} at time {time}; it is valid from {} to \
         {}: the step is too long for its kinetics, or these lead out of the range",
        Short(range.0), Short(range.1)
    )]
    OutOfRange {
        /// The species.
        species: String,
        /// Kind and number of the point.
        place: String,
        /// The value there.
        value: f64,
        /// Valid range.
        range: (f64, f64),
        /// End time of the step.
        time: f64,
    },
    /// An implicit or explicit integrator of the library gave up.
    #[error("the {method} integrator stopped at time {time}: {message}")]
    Integrator {
        /// Its name.
        method: &'static str,
        /// Time reached.
        time: f64,
        /// What it says.
        message: String,
    },
    /// The chemistry comes to no rest while the shape does not move.
    #[error(
        "the chemistry has no steady state that it runs into at time {time} (it still changes by \
         {rate:.1e} of its size per unit of time): the policy `chemistry-fast` needs one"
    )]
    NotSteady {
        /// Time reached.
        time: f64,
        /// Largest relative rate left.
        rate: f64,
    },
    /// The smallest eigenvalues at a shape were not found.
    #[error("only {found} of the {wanted} smallest eigenvalues of the Hessian were found")]
    Modes {
        /// Eigenvalues that converged.
        found: usize,
        /// Eigenvalues asked for.
        wanted: usize,
    },
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}
