//! Solvers: mechanical equilibrium and its stability, coupled stepping.
//!
//! Data flows one way: a stepper makes a trial state, the model is evaluated there, and the state is
//! accepted or dropped. Steppers keep factors, histories and step sizes from step to step; of the model
//! they keep nothing.

pub mod chemistry;
pub mod continuation;
mod control;
pub mod counters;
pub mod diagnosis;
pub mod equilibrium;
mod error;
pub mod explicit;
mod incremental_potential;
mod internal_variables;
pub mod linear_solvers;
mod low_rank;
pub mod monolithic;
mod positivity;
mod progress;
pub mod rejections;
pub mod replay;
mod route;
pub mod sensitivity;
pub mod stability;
pub mod staggered;
mod workspace;

pub use control::Control;
pub use equilibrium::EquilibriumSpec;
pub use error::{Result, SolveError};
pub(crate) use progress::Progress;
pub use workspace::Relaxer;
pub use workspace::Workspace;

use crate::model::{MassWeights, State};
use crate::num::checked::Positive;
use crate::num::decimal;
use crate::record::{Malformed, Record};
use crate::tally::Work;
use equilibrium::Relaxation;
use rejections::Causes;

/// The integrator of a scene that names none.
pub const DEFAULT_INTEGRATOR: &str = "staggered";

/// The integrator of a scene that names none and whose chemistry is steady at every time.
pub const STEADY_CHEMISTRY_INTEGRATOR: &str = "monolithic";

/// The integrator of a scene without space that names none: implicit, with variable order.
pub const POINT_INTEGRATOR: &str = "monolithic";

/// The relative and the absolute tolerance that it has without space, where a step costs microseconds: errors of some
/// 1e-6 on the stiff problems of `models/kinetics`, and species of any size are resolved whatever their typical
/// magnitude is thought to be.
pub const POINT_TOLERANCE: [(&str, f64); 2] = [("rtol", 1e-6), ("atol", 1e-12)];

/// The equilibrium method of a scene that names none.
pub const DEFAULT_EQUILIBRIUM: &str = "lbfgs";

/// A way to advance in time as a scene names it.
#[typetag::serialize(tag = "kind")]
pub trait IntegratorSpec: std::fmt::Debug + Send + Sync {
    /// What the integrator is called in results.
    fn name(&self) -> String;

    /// Whether it solves for a moving shape by the sparse derivatives of its motion, which terms of low
    /// rank and pairs that depend on the shape are not part of.
    fn needs_sparse_motion(&self) -> bool {
        false
    }

    /// Whether constraints stay met on the way of a moving shape.
    fn keeps_constraints(&self) -> bool {
        !self.needs_sparse_motion()
    }

    /// Whether no step of a moving shape passes what effects allow ([`Contact::largest_step`](crate::effects::Contact::largest_step)).
    fn keeps_step_limits(&self) -> bool {
        !self.needs_sparse_motion()
    }

    /// Whether it integrates the internal variables of effects ([`InternalVariables`](crate::effects::InternalVariables)).
    fn integrates_internal(&self) -> bool {
        false
    }

    /// Whether it moves shapes by a drag that differs by direction.
    fn supports_anisotropic_drag(&self) -> bool {
        false
    }

    /// Whether it advances a sheet that is spread over ranks.
    fn supports_ranks(&self, _policy: MassWeights) -> bool {
        false
    }

    /// Whether it solves with the derivatives of the coupled system, those of signals included.
    fn uses_jacobian(&self) -> bool {
        false
    }

    /// The same at another tolerance, the ratio of relative to absolute kept. A method with fixed steps makes
    /// steps of `tolerance` times the span `until`.
    fn at_tolerance(&self, tolerance: Positive, until: Positive) -> Box<dyn IntegratorSpec>;

    /// The relative tolerance that controls its step sizes; none where steps are fixed.
    fn rtol(&self) -> Option<f64>;

    /// The absolute tolerance, in units of typical magnitudes; none for fixed steps.
    fn atol(&self) -> Option<f64> {
        None
    }

    /// The fixed step by which the rates of the chemistry are followed without any check of their change, if
    /// that is how it is done.
    fn explicit_step(&self) -> Option<f64> {
        None
    }

    /// Makes it ready for a policy.
    ///
    /// # Errors
    /// [`SolveError::Pairing`] if it makes no sense with that policy.
    fn build(&self, policy: MassWeights) -> Result<Box<dyn Integrator>, SolveError>;
}

crate::family!(dyn IntegratorSpec, "integrator", "kind");

/// A way to advance a model.
pub trait Integrator: Send {
    /// Makes the chemistry of `state` steady where it has no storage.
    ///
    /// # Errors
    /// If the plugin fails, or the chemistry comes to no rest.
    fn prepare(&mut self, _workspace: &mut Workspace, _state: &mut State) -> Result<()> {
        Ok(())
    }

    /// Brings `state`, which satisfies the rows without storage, forward by one step that does
    /// not pass `until`.
    ///
    /// # Errors
    /// Whatever no smaller step cures; `state` is as before then, bit for bit.
    fn advance(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport>;

    /// Steps after which a run that may be continued renews it; none where all can be stored.
    fn renewed_after(&self) -> Option<u64> {
        None
    }

    /// Clears the history that cannot be stored: the next step restarts from any state like a new integrator's.
    fn renew(&mut self) {}

    /// What later steps depend on besides the state: all of it where [`Self::is_storable`].
    fn memory(&self) -> Record {
        Record::default()
    }

    /// Whether [`Self::memory`] is all of it: what a library remembers cannot be written, and is there from the
    /// first step after [`Integrator::renew`] on.
    fn is_storable(&self) -> bool {
        true
    }

    /// Takes over the memory of one with the same choices: later steps have the same bits.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    fn restore(&mut self, _memory: &Record, _vertices: usize) -> Result<(), Malformed> {
        Ok(())
    }
}

/// A relative tolerance and the absolute one that has the same ratio to it as before.
fn scaled(tolerance: Positive, rtol: Positive, atol: Positive) -> (Positive, Positive) {
    let absolute = decimal(atol.get() / rtol.get() * tolerance.get());
    (tolerance, Positive::new(absolute).unwrap_or(tolerance))
}

/// The step that is this share of the span.
fn fixed_step(share: Positive, span: Positive) -> Positive {
    Positive::new(share.get() * span.get()).unwrap_or(share)
}

/// End of a fixed step, which is shortened only to hit an output time. Where a whole number of steps leads there
/// they share the way evenly, or the rounding of 10⁵ sums would leave a tiny step at its end.
fn end_of_fixed_step(time: f64, step: f64, until: f64) -> f64 {
    let left = until - time;
    let steps = (left / step).round();
    if (left / step - steps).abs() > 1e-6 {
        (time + step).min(until)
    } else if steps <= 1.0 {
        until
    } else {
        time + left / steps
    }
}

/// End of a step that does not pass `until`; the last two steps before it share the way.
pub fn end_of_step(time: f64, step: f64, until: f64) -> f64 {
    let left = until - time;
    if step >= left * (1.0 - 1e-12) {
        until
    } else if 2.0 * step > left {
        time + 0.5 * left
    } else {
        time + step
    }
}

/// How far `what` is on its way through one step of the coupling, in words.
fn under_way(what: &str, (from, now, until): (f64, f64, f64)) -> String {
    let percent = 100.0 * (now - from) / (until - from);
    // Of a way of millions of steps the first per cent is long in coming.
    let percent = match percent {
        0.0 => "0".to_owned(),
        p if p < 0.1 => format!("{p:.1e}"),
        p => format!("{p:.1}"),
    };
    format!("{what}, {percent} % of a step of {:.3e}", until - from)
}

/// What one accepted step did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepReport {
    /// Length of the step.
    pub length: f64,
    /// Error estimate in units of the tolerance (0 for fixed steps).
    pub error: f64,
    /// Rejected step attempts, by their causes; integrators leave it to the caller of the step.
    pub rejected: Causes,
    /// Values of laws and effects in the step that were not finite numbers; likewise.
    pub not_finite: u64,
    /// Why the previous attempt was rejected, if it was.
    pub reason: Option<String>,
    /// Where the relaxations of the step led.
    pub relaxation: Relaxation,
    /// All work of the step, rejected attempts included; integrators leave it to the caller of the step.
    pub work: Work,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends of the steps of a span.
    fn ends(from: f64, step: f64, until: f64) -> Vec<f64> {
        let next = |time: &f64| (*time < until).then(|| end_of_fixed_step(*time, step, until));
        std::iter::successors(Some(from), next).skip(1).collect()
    }

    #[test]
    fn a_whole_number_of_fixed_steps_stays_whole() {
        for (from, step, until, steps) in
            [(0.0, 1e-5, 1.0, 100_000), (9000.0, 0.01, 10_000.0, 100_000), (0.0, 0.1, 0.3, 3)]
        {
            let ends = ends(from, step, until);
            assert_eq!((ends.len(), ends.last()), (steps, Some(&until)));
        }
    }

    #[test]
    fn a_fixed_step_is_shortened_at_the_end_of_its_span() {
        assert_eq!(ends(0.0, 0.4, 1.0), [0.4, 0.8, 1.0]);
        assert_eq!(ends(0.0, 2.0, 1.0), [1.0]);
    }
}
