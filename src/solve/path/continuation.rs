//! Natural-parameter continuation with a secant predictor and a corrector in a trust region.
//!
//! ```text
//! x_p = x + Δs dx/ds              dx/ds from the last two equilibria
//! x'  = argmin U(·; q(s + Δs)),   |x'_i - x_p,i| ≤ r for every vertex i
//! ```
//!
//! The distance from prediction to equilibrium grows with Δs², which controls Δs.

use super::super::equilibrium::Relaxation;
use super::super::workspace::{Held, Search};
use super::super::{Result, Workspace, end_of_step};
use super::{is_curable, jump};
use crate::Vec3;
use crate::model::State;
use crate::parallel;

/// Radius of the trust region about a prediction, in mean edges. Smaller ones take more sub-steps; with larger
/// ones a vertex may pass to a neighbouring buckle unnoticed.
const RADIUS: f64 = 1.0;
/// Factor on the force tolerance at the end of inner sub-steps, which are only predicted from. With 1000
/// Model I on a small disc came to other branches.
const INNER: f64 = 100.0;
/// Largest estimated distance to an equilibrium, in mean edges: forces alone leave soft bending modes far from it.
pub(super) const DISPLACEMENT: f64 = 0.02;
/// Shortest sub-step; where it is rejected the equilibrium is lost.
const SHORTEST: f64 = 1e-3;
/// A rejected sub-step is repeated at this share of its length.
const SHRINK: f64 = 0.25;
/// Most that the error estimate makes of a sub-step for the next one, and the most after a rejected one.
const GROWTH: (f64, f64) = (4.0, 1.5);
/// Sub-steps are proposed shorter than the estimate allows.
const SAFETY: f64 = 0.7;
/// The sub-step after a jump.
const AFTER_JUMP: f64 = 0.05;

/// Conditions from those of one state to those of another.
pub(super) struct Route<'a> {
    from: &'a State,
    to: &'a State,
    held: Option<&'a dyn Fn(f64) -> Held>,
}

impl<'a> Route<'a> {
    /// Species and time go along straight lines.
    pub(super) fn new(from: &'a State, to: &'a State) -> Self {
        Self { from, to, held: None }
    }

    /// At the conditions of one state, what holds the sheet changes.
    pub(super) fn held(at: &'a State, held: &'a dyn Fn(f64) -> Held) -> Self {
        Self { from: at, to: at, held: Some(held) }
    }

    /// The conditions at `s`, with the shape of `at`, and what holds the sheet.
    pub(super) fn at(&self, s: f64, at: &State) -> (State, Option<Held>) {
        let mix = |a: f64, b: f64| if s >= 1.0 { b } else { a + s * (b - a) };
        let column = |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| mix(*a, *b)).collect()
        };
        let state = State {
            time: mix(self.from.time, self.to.time),
            step: at.step,
            x: at.x.clone(),
            species: self.from.species.iter().zip(&self.to.species).map(column).collect(),
        };
        (state, self.held.map(|held| held(s)))
    }
}

/// A path that is being followed.
pub(super) struct Continuation {
    /// dx/ds at the last equilibrium.
    tangent: Option<Vec<Vec3>>,
    /// The next sub-step, and its bound.
    step: (f64, f64),
}

impl Continuation {
    /// From an equilibrium with this dx/ds, if it is known; `step` is tried first.
    pub(super) fn new(tangent: Option<Vec<Vec3>>, step: f64) -> Self {
        Self { tangent, step: (step, 1.0) }
    }

    /// dx/ds at the last equilibrium.
    pub(super) fn tangent(self) -> Option<Vec<Vec3>> {
        self.tangent
    }

    /// Follows the equilibrium of `state` along all of `route`.
    ///
    /// # Errors
    /// If a jump comes to no rest; failures that no shorter sub-step cures.
    pub(super) fn follow(
        &mut self,
        workspace: &mut Workspace,
        route: &Route<'_>,
        state: &mut State,
    ) -> Result<Relaxation> {
        let mut done = Relaxation::default();
        let mut s = 0.0;
        while s < 1.0 {
            let end = end_of_step(s, self.step.0.min(self.step.1), 1.0);
            let (mut next, held) = route.at(end, state);
            let search = Search {
                guess: self.predicted(state, end - s),
                trust: Some(RADIUS),
                looser: if end < 1.0 { INNER } else { 1.0 },
                displacement: DISPLACEMENT,
                held,
                anchor: None,
            };
            match workspace.search(&mut next, search) {
                Ok((more, distance)) => {
                    done.add(&more);
                    self.accept(state, &next, end - s, distance);
                    (state.x, s) = (next.x, end);
                }
                Err(error) if is_curable(&error) && end - s > SHORTEST => {
                    self.step = (SHRINK * (end - s), GROWTH.1 * SHRINK * (end - s));
                }
                Err(error) if is_curable(&error) => {
                    done.add(&jump::jump(workspace, route, end, state)?);
                    (self.tangent, self.step, s) = (None, (AFTER_JUMP, 1.0), end);
                }
                Err(error) => return Err(error),
            }
        }
        Ok(done)
    }

    /// The shape of `state` moved on along the tangent.
    fn predicted(&self, state: &State, step: f64) -> Option<Vec<Vec3>> {
        let tangent = self.tangent.as_ref()?;
        let mut x = state.x.to_vec();
        parallel::update(&mut x, |i, x| *x += step * tangent[i]);
        Some(x)
    }

    /// Takes over what a sub-step from `state` to `next` teaches.
    fn accept(&mut self, state: &State, next: &State, step: f64, distance: f64) {
        let mut tangent = next.x.to_vec();
        parallel::update(&mut tangent, |i, v| *v = (*v - state.x[i]) / step);
        self.tangent = Some(tangent);
        let growth = SAFETY * (RADIUS / distance.max(1e-9)).sqrt();
        self.step.0 = step * growth.clamp(0.5, GROWTH.0);
        self.step.1 *= GROWTH.1;
    }
}
