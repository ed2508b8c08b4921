//! A viscous jump: the gradient flow at fixed conditions, from a lost equilibrium to a stable one.
//!
//! ```text
//! W dx/dτ = -∂U/∂x           W: the drag of the scene, which sets the direction of the motion
//! x_{k+1} = argmin U(x) + w/2 (x - x_k)·W (x - x_k)
//! ```
//!
//! by stages whose weight w is chosen so that no vertex moves by more than a trust region at once. It begins
//! where a minimisation leaves a small neighbourhood of the lost equilibrium: along the unstable mode, which
//! has the least stiffness there. It ends where a stage hardly moves and a minimisation without w stays near.
//!
//! Reference: Jordan, Kinderlehrer & Otto, SIAM J. Math. Anal. 29 (1998), doi:10.1137/S0036141096303359.

use super::super::equilibrium::Relaxation;
use super::super::workspace::Search;
use super::super::{Result, SolveError, Workspace};
use super::continuation::{DISPLACEMENT, Route};
use super::is_curable;
use crate::model::{Anchor, State};
use crate::num::real;

/// How far the unstable mode is followed before the first stage, in mean edges.
const SEED: f64 = 0.1;
/// Largest move of a vertex in a stage, in mean edges.
const RADIUS: f64 = 0.5;
/// A stage that moves less than this is nearly at rest, in mean edges.
const STILL: f64 = 0.02;
/// Factor on the force tolerance of a stage.
const LOOSER: f64 = 10.0;
/// Weight of the first stage, and the largest, in units of the stretching stiffness.
const WEIGHTS: (f64, f64) = (1e-5, 1e3);
/// Least and most that a stage makes of the weight, and what a rejected one does, before the first accepted
/// stage and later.
const FACTORS: (f64, f64) = (0.01, 3.0);
const REJECTED: (f64, f64) = (100.0, 10.0);
/// A minimisation without weight that leaves the neighbourhood goes on with this share of the last weight, and a
/// finer bound on displacements.
const ONWARDS: f64 = 0.3;
/// Most stages; several tens are usual.
const STAGES: usize = 2000;

/// Moves the shape of `state` to the equilibrium that its gradient flow under the conditions of `route` at `s` reaches.
///
/// # Errors
/// If it comes to no rest.
pub(super) fn jump(
    workspace: &mut Workspace,
    route: &Route<'_>,
    s: f64,
    state: &mut State,
) -> Result<Relaxation> {
    let before = conditions(workspace, route, s, state)?;
    let mut flow = Flow::new(workspace, before.stiffness);
    let mut done = flow.leave(workspace, route, s, state)?;
    for _ in 0..STAGES {
        let (mut next, held) = route.at(s, state);
        let search = Search { held, ..flow.stage(workspace, state) };
        match workspace.search(&mut next, search) {
            Ok((more, moved)) => {
                done.add(&more);
                state.x = next.x;
                if flow.is_free {
                    let after = conditions(workspace, route, s, state)?;
                    done.jumps += 1;
                    done.released += before.energy - after.energy;
                    return Ok(done);
                }
                flow.accept(moved);
            }
            Err(error) if is_curable(&error) && flow.weight < WEIGHTS.1 * before.stiffness => {
                flow.reject();
            }
            Err(error) => return Err(error),
        }
    }
    Err(SolveError::Departed)
}

/// Energy of a shape, and the stretching stiffness of its sheet.
struct Conditions {
    energy: f64,
    stiffness: f64,
}

fn conditions(
    workspace: &mut Workspace,
    route: &Route<'_>,
    s: f64,
    state: &State,
) -> Result<Conditions> {
    let (state, held) = route.at(s, state);
    let mut at = workspace.at(&state);
    let potential = at.potential()?;
    if let Some(held) = held {
        held.act_on(potential);
    }
    let stiffness = potential.force_scale() / potential.metric().mean_edge();
    let energy = potential.energy(&state.x);
    potential.set_hold(None);
    Ok(Conditions { energy, stiffness })
}

/// The stages of one jump.
struct Flow {
    /// w of the next stage; of the last accepted one.
    weight: f64,
    last: Option<f64>,
    /// Mean drag of a vertex.
    drag: f64,
    /// Whether the next stage is without weight.
    is_free: bool,
    /// Largest estimated distance of a stage to its minimum, in mean edges.
    displacement: f64,
}

impl Flow {
    fn new(workspace: &Workspace, stiffness: f64) -> Self {
        let (model, n) = (&workspace.model, workspace.model.sheet().vertex_count());
        let drag = (0..n).map(|i| model.drag().at(i)).sum::<f64>() / real(n);
        let weight = WEIGHTS.0 * stiffness;
        Self { weight, last: None, drag, is_free: false, displacement: DISPLACEMENT }
    }

    /// Follows the way out of a lost equilibrium for a short distance.
    fn leave(
        &mut self,
        workspace: &mut Workspace,
        route: &Route<'_>,
        s: f64,
        state: &mut State,
    ) -> Result<Relaxation> {
        let (mut next, held) = route.at(s, state);
        let displacement = self.displacement;
        let search = Search { trust: Some(SEED), displacement, held, ..Search::default() };
        let done = match workspace.search(&mut next, search) {
            Ok((done, _)) => done,
            Err(error) if is_curable(&error) => Relaxation::default(),
            Err(error) => return Err(error),
        };
        state.x = next.x;
        Ok(done)
    }

    /// The next stage, from the shape of `state`.
    fn stage(&self, workspace: &Workspace, state: &State) -> Search {
        let model = &workspace.model;
        let anchor = (!self.is_free).then(|| Anchor {
            x: state.x.to_vec(),
            weights: model.drag().weights(model.sheet(), &state.x, self.weight / self.drag),
            slack: 0.0,
        });
        let looser = if self.is_free { 1.0 } else { LOOSER };
        let displacement = self.displacement;
        Search { anchor, trust: Some(RADIUS), looser, displacement, ..Search::default() }
    }

    /// The next weight after a stage that moved a vertex by up to `moved`.
    fn accept(&mut self, moved: f64) {
        self.last = Some(self.weight);
        self.weight *= (2.0 * moved / RADIUS).clamp(FACTORS.0, FACTORS.1);
        self.is_free = moved < STILL;
    }

    /// The next weight after a stage that left its trust region.
    fn reject(&mut self) {
        match self.last {
            Some(last) if self.is_free => {
                self.weight = ONWARDS * last;
                self.displacement *= ONWARDS;
            }
            Some(_) => self.weight *= REJECTED.1,
            None => self.weight *= REJECTED.0,
        }
        self.is_free = false;
    }
}
