//! The quasi-static shape: a path of stable equilibria, followed by continuation, and viscous jumps where it ends.
//!
//! ```text
//! 0 = -∂U/∂x (x; q(s)),   0 ≤ s ≤ 1        q: species, growth, loads, prescribed positions
//! ```
//!
//! is the limit of `drag dx/dt = -∂U/∂x` for vanishing drag (a balanced-viscosity solution): as long as
//! there is a stable equilibrium the shape stays on its branch, and at an instability it follows the gradient
//! flow of U at fixed q to another one. A single minimisation under the conditions of the end of a step knows
//! nothing of that path: its metric would decide which minimum it finds.
//!
//! * [`continuation`]: sub-steps of s, each predicted by the secant through the last two equilibria and
//!   corrected within a trust region about the prediction. A corrector that leaves it is rejected, and
//!   the sub-step repeated shorter; at the shortest sub-step the equilibrium is lost.
//! * [`jump`]: the gradient flow from there, by proximal stages.
//! * [`release`]: the first equilibrium, by the same continuation from a state that is in equilibrium by construction.
//!
//! References: Agostiniani & Rossi, Singular vanishing-viscosity limits of gradient flows: the finite-dimensional
//! case, J. Differential Equations 263 (2017); Scilla & Solombrino, arXiv:1712.06182 (minimising movements
//! converge to this limit only if the proximal weight per step does not vanish against the energy).

mod continuation;
mod jump;
mod release;

pub(super) use release::release;

use continuation::{Continuation, Route};

use super::equilibrium::Relaxation;
use super::{Result, SolveError, Workspace};
use crate::Vec3;
use crate::model::State;
use crate::record::{Malformed, Reading, Record};

/// A shape that follows its equilibrium, with what it keeps from step to step.
#[derive(Debug, Default, Clone)]
pub(super) struct EquilibriumPath {
    /// The time at which a step began, and dx/dt there: a step may be repeated.
    start: Option<(f64, Vec<Vec3>)>,
    /// The same at the end of the last step attempt.
    end: Option<(f64, Vec<Vec3>)>,
}

impl EquilibriumPath {
    /// Writes it.
    pub(super) fn store(&self, record: &mut Record) {
        record.option(self.end.as_ref().or(self.start.as_ref()), |record, (time, velocity)| {
            record.number(*time);
            record.points(velocity);
        });
    }

    /// Reads what one for as many `vertices` has written.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    pub(super) fn restore(
        &mut self,
        reading: &mut Reading<'_>,
        vertices: usize,
    ) -> Result<(), Malformed> {
        self.end = None;
        self.start =
            reading.option(|reading| Ok((reading.number()?, reading.points(vertices)?)))?;
        Ok(())
    }

    /// Lets the shape of `from`, an equilibrium, follow while conditions change to those of `next`, whose
    /// shape is replaced. Between two states of the same time only species change.
    ///
    /// # Errors
    /// If no equilibrium is found.
    pub(super) fn advance(
        &mut self,
        workspace: &mut Workspace,
        from: &State,
        next: &mut State,
    ) -> Result<Relaxation> {
        let step = next.time - from.time;
        if step > 0.0
            && let Some(end) = self.end.take_if(|(time, _)| *time == from.time)
        {
            self.start = Some(end);
        }
        let known = self.start.as_ref().filter(|(time, _)| *time == from.time && step > 0.0);
        let tangent = known.map(|(_, velocity)| velocity.iter().map(|v| step * v).collect());
        let mut continuation = Continuation::new(tangent, 1.0);
        let mut shape = from.clone();
        let done = continuation.follow(workspace, &Route::new(from, next), &mut shape)?;
        next.x = shape.x;
        if step > 0.0 {
            let velocity = continuation.tangent().map(|all| all.iter().map(|v| v / step).collect());
            self.end = velocity.map(|velocity| (next.time, velocity));
        }
        Ok(done)
    }
}

/// Whether a shorter sub-step, or a larger proximal weight, may do without this failure.
fn is_curable(error: &SolveError) -> bool {
    matches!(
        error,
        SolveError::Departed
            | SolveError::NotConverged { .. }
            | SolveError::Stalled { .. }
            | SolveError::Collapsed { .. }
            | SolveError::NotAtRest { .. }
            | SolveError::Constraint { .. }
    )
}
