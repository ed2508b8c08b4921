//! A point in the table of a branch.

use crate::solve::continuation::Unknowns;

/// Words of the column of events.
pub(super) const FOLD: &str = "fold";

pub(super) const BIFURCATION: &str = "bifurcation";

pub(super) const SINGULARITY: &str = "singularity";

/// A point in the table.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) branch: usize,
    pub(super) parameter: f64,
    pub(super) energy: f64,
    pub(super) negative: usize,
    /// Those of the table, in its order.
    pub(super) measures: Vec<f64>,
    pub(super) event: &'static str,
    pub(super) kind: &'static str,
    /// What of the row stands before the measures.
    pub(super) text: String,
    /// What of it stands behind them, before the event.
    pub(super) behind: String,
    /// The state, while it is not known yet along which mode its displacement is to be taken.
    pub(super) at: Unknowns,
}

impl Row {
    /// Whether an eigenvalue is 0 there.
    pub(super) fn is_special(&self) -> bool {
        [FOLD, BIFURCATION, SINGULARITY].contains(&self.event)
    }
}
