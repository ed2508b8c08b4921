//! The first equilibrium: the start is let go slowly.
//!
//! ```text
//! l̄_e(s) = |x_i - x_j|^(1-s) l̄_e^s                    for every edge e = ij of the start x
//! 0 = -∂U/∂x (x; l̄(s)) + (1 - s) f₀                   f₀ = ∂U/∂x at the start, under l̄(0)
//! ```
//!
//! At s = 0 the edges are free of stress and the forces f₀ balance all others: the start is an equilibrium by
//! construction. Optimal lengths then go to those of the species, and the forces to zero. So a dose that asks
//! for much growth at once is grown into along a path of equilibria, rather than from a crushed sheet, and the
//! first equilibrium does not depend on the metric where that path is smooth.

use super::super::equilibrium::Relaxation;
use super::super::workspace::Held;
use super::super::{Result, Workspace, diagnosis};
use super::{EquilibriumPath, Route};
use crate::Vec3;
use crate::model::State;
use crate::parallel;

/// Brings the shape of `state` into equilibrium with its species along the path above.
///
/// # Errors
/// If the model has no value there, or no equilibrium is found.
pub(in crate::solve) fn first_equilibrium(
    workspace: &mut Workspace,
    state: &mut State,
) -> Result<Relaxation> {
    if !workspace.model.moves() || !workspace.reaches_rest() {
        return workspace.relax(state);
    }
    let model = workspace.model.clone();
    model.mechanics().set_prescribed(state.time, &mut state.x);
    // Across needles no forces are resolved that a path could follow.
    if diagnosis::needle(workspace.at(state).potential()?).is_some() {
        return workspace.relax(state);
    }
    let start = Start::of(workspace, state)?;
    let at = state.clone();
    let held = |s: f64| start.held(s);
    let followed = EquilibriumPath::default().follow(workspace, &Route::held(&at, &held), state);
    let mut done = match followed {
        Ok(done) => done,
        // A start that no such path leads from may still have an equilibrium downhill.
        Err(error) if error.is_without_rest() => {
            state.x = at.x.clone();
            Relaxation::default()
        }
        Err(error) => return Err(error),
    };
    // Where nothing grows, lengths are not set again.
    workspace.at(state).potential()?.set_length_factor(&start.lengths.1);
    done.add(&workspace.relax(state)?);
    workspace.pass(&at.x, &state.x, true)?;
    workspace.settle(state, &at.x)?;
    Ok(done)
}

/// What holds a start.
struct Start {
    /// Length factors of its edges as they are, and of its species.
    lengths: (Vec<f64>, Vec<f64>),
    /// f₀.
    force: Vec<Vec3>,
}

impl Start {
    fn of(workspace: &mut Workspace, state: &State) -> Result<Self> {
        let model = workspace.model.clone();
        let rest = model.mechanics().reference().length();
        let mut at = workspace.at(state);
        let to = at.length_factor()?.map(|factor| factor.into_owned());
        let to = to.unwrap_or_else(|| vec![1.0; rest.len()]);
        let from = model.sheet().edges().iter().zip(rest).map(|(edge, rest)| {
            let [a, b] = edge.vertices.map(|v| state.x[v as usize]);
            (b - a).norm() / rest
        });
        let from: Vec<f64> = from.collect();
        let potential = at.potential()?;
        potential.set_length_factor(&from);
        let mut force = vec![Vec3::zeros(); state.x.len()];
        potential.energy_gradient(&state.x, &mut force);
        Ok(Self { lengths: (from, to), force })
    }

    fn held(&self, s: f64) -> Held {
        let (from, to) = &self.lengths;
        let factor = from.iter().zip(to).map(|(from, to)| from.powf(1.0 - s) * to.powf(s));
        let mut force = self.force.clone();
        parallel::update(&mut force, |_, f| *f *= 1.0 - s);
        Held { factor: factor.collect(), force }
    }
}
