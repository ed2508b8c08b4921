//! Step sizes that have fallen to nothing against the interval that they are to cross.

use super::{SolveError, Workspace};
use crate::model::State;
use crate::num::Short;

/// A step below this share of the interval is negligible.
const NEGLIGIBLE: f64 = 1e-12;
/// Negligible steps in a row, with those made within them, after which an integration gives up: a first step for a
/// decay rate of 1e100 doubles its length in a few thousand.
const MAX_NEGLIGIBLE: u64 = 30_000;

/// Counts negligible steps in a row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Progress {
    count: u64,
    step: f64,
}

impl Progress {
    /// Counts a step of this length, made of so many within it, towards the end of an interval.
    pub(crate) fn count(&mut self, step: f64, interval: f64, within: u64) {
        let negligible = step < NEGLIGIBLE * interval;
        self.count = if negligible { self.count.saturating_add(1 + within) } else { 0 };
        self.step = step;
    }

    /// Refuses to continue from `state` after too many of them.
    ///
    /// # Errors
    /// [`SolveError::NoProgress`].
    pub(crate) fn check(&self, workspace: &mut Workspace, state: &State) -> Result<(), SolveError> {
        match self.count < MAX_NEGLIGIBLE {
            true => Ok(()),
            false => Err(no_progress(workspace, state, self.step)),
        }
    }
}

/// That steps of this length lead nowhere from `state`, with the species that changes fastest there.
pub(super) fn no_progress(workspace: &mut Workspace, state: &State, step: f64) -> SolveError {
    let fastest = fastest_species(workspace, state).map_or_else(
        || "the derivatives of its rates ask for them".to_owned(),
        |fastest| format!("{fastest} is the fastest"),
    );
    SolveError::NoProgress { time: state.time, step, fastest }
}

/// The species whose rate is the largest against its typical magnitude, and where.
fn fastest_species(workspace: &mut Workspace, state: &State) -> Option<String> {
    let model = std::sync::Arc::clone(&workspace.model);
    let chemistry = model.chemistry()?;
    let mut at = workspace.at(state);
    let rates = at.rates().ok()?;
    let typical = chemistry.all_typical();
    let each = rates
        .iter()
        .enumerate()
        .flat_map(|(s, rates)| rates.iter().enumerate().map(move |(i, rate)| (s, i, *rate)));
    let share = |(s, _, rate): &(usize, usize, f64)| rate.abs() / typical[*s];
    let (s, point, rate) = each.max_by(|a, b| share(a).total_cmp(&share(b)))?;
    let species = &chemistry.descriptor().species[s];
    let noun = chemistry.location().noun();
    (rate != 0.0).then(|| {
        format!("the rate {} of species `{}` at {noun} {point}", Short(rate), species.name)
    })
}
