//! What is held while a parameter changes: a state at rest, or the states of a run, with λ.

use std::sync::Arc;

use crate::model::{Model, State};
use crate::run::Result;
use crate::solve::continuation::Unknowns;
use crate::solve::sensitivity::Point;

/// A state, or a course of states, at which models of other parameters are evaluated.
pub(super) trait Fixed: Sync {
    /// λ·g of `model`, whose species begin as in `start`, by its terms; and the states at which J is measured.
    ///
    /// # Errors
    /// Laws that fail.
    fn terms(&self, model: &Arc<Model>, start: &State) -> Result<(Unknowns, Vec<State>)>;

    /// The only state, if it is one at rest.
    fn at_rest(&self) -> Option<&FixedPoint<'_>> {
        None
    }
}

/// A state at rest, with λ.
pub(super) struct FixedPoint<'a> {
    pub(super) point: &'a Point,
    pub(super) adjoint: Unknowns,
}

impl Fixed for FixedPoint<'_> {
    fn terms(&self, model: &Arc<Model>, start: &State) -> Result<(Unknowns, Vec<State>)> {
        let state = self.point.state_of(model, &start.species);
        let mut terms = self.point.imbalance(model, &state)?;
        terms.x.iter_mut().zip(&self.adjoint.x).for_each(|(g, a)| g.component_mul_assign(a));
        for (g, adjoint) in terms.species.iter_mut().zip(&self.adjoint.species) {
            g.iter_mut().zip(adjoint).for_each(|(g, a)| *g *= a);
        }
        Ok((terms, vec![state]))
    }

    fn at_rest(&self) -> Option<&FixedPoint<'_>> {
        Some(self)
    }
}
