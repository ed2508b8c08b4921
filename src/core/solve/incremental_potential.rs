//! The shape under drag, `γ dx/dt = -∂U/∂x`, by stages that are minimisations.
//!
//! ```text
//! x_k = argmin U(x; c(t_k)) + 1/(2 a Δt) (x - a_k)·γ (x - a_k)
//!
//! euler    a = 1, order 1:           x_1 around x_n
//! sdirk2   a = 1 - 1/√2, order 2:    x_1 around x_n,   at t_n + a Δt
//!                                    x_2 around x_n + (1-a)/a (x_1 - x_n),   at t_n + Δt
//! ```
//!
//! Both are L-stable, so that stiff waves are at rest at the end of every step, and a step is as long as
//! the chemistry allows: it goes through buckling and snaps without a regular Jacobian. In a stage U falls
//! by at least what the drag takes up. As γ/Δt → 0 a stage is a relaxation.
//!
//! What the second stage changes estimates the error, `(x_2 - a_2) - (x_1 - a_1) ≈ a (1-a) Δt² x''`: that of
//! a method of first order, so that the second-order result errs in proportion to the tolerance. A stage
//! is solved to a share of that tolerance, and of the displacement that the velocity before it predicts. Where an iterate is
//! so far from where the last velocities lead that the step cannot be accepted, a stage is given up: a step that is far too long
//! for a snap costs little. Where sdirk2
//! ends with more energy than it started from under the same conditions, its stages say nothing about a motion so
//! rough, and Euler's single stage is taken.
//!
//! References: Alexander, SIAM J. Numer. Anal. 14 (1977), doi:10.1137/0714068 (the method); Jordan,
//! Kinderlehrer & Otto, SIAM J. Math. Anal. 29 (1998), doi:10.1137/S0036141096303359 (steps as minimisations).

use serde::{Deserialize, Serialize};

use super::equilibrium::Relaxation;
use super::route::Route;
use super::workspace::{Bound, Minimisation};
use super::{Result, SolveError, Workspace, counters};
use crate::Vec3;
use crate::model::{Anchor, Mechanics, State};
use crate::parallel;
use crate::record::Malformed;

/// a of sdirk2, `1 - 1/√2`.
const A: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Stages are solved to this share of the tolerance of a step.
const STAGE_TOLERANCE_SHARE: f64 = 0.05;
/// But, however slow the sheet is, not to less than this share of that.
const MIN_SLACK: f64 = 1e-3;
/// Rises of the energy below this share of it are round-off.
const ROUND_OFF: f64 = 1e-9;

/// How the shape moves under drag.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionMethod {
    /// One minimisation a step, of first order.
    Euler,
    /// Two minimisations a step, of second order.
    #[default]
    Sdirk2,
}

impl MotionMethod {
    /// Its name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "implicit Euler, a minimisation a step",
            Self::Sdirk2 => "SDIRK2, two minimisations a step",
        }
    }
}

/// How a step is made.
pub(super) struct Stepping {
    /// Factor on the drag of the scene.
    pub(super) drag: f64,
    /// Two stages rather than one.
    pub(super) second_order: bool,
    /// Lengths below this do not matter,
    pub(super) tolerance: f64,
    /// nor those below this share of the largest displacement: however short steps are, together they move the sheet.
    pub(super) relative: f64,
    /// Largest estimated distance of a stage to its minimum, in mean edges.
    pub(super) distance_tolerance: f64,
    /// Relative and absolute tolerance of a step, and the error in their units at which a stage is given up.
    pub(super) bound: Option<((f64, f64), f64)>,
}

/// Where a step led.
pub(super) struct StepOutcome {
    /// The shape at its end.
    pub(super) x: Vec<Vec3>,
    /// The same by a method of lower order.
    pub(super) coarse: Vec<Vec3>,
    pub(super) done: Relaxation,
}

/// A shape that moves by minimisations, with what it keeps from step to step.
#[derive(Debug, Default, Clone)]
pub(super) struct Motion {
    last: Option<Last>,
    /// When the step before the last ended, and the velocities there: a step may be tried again.
    start: Option<(f64, Vec<Vec3>)>,
}

/// The last stage of a step.
#[derive(Debug, Clone)]
struct Last {
    /// When it ended.
    time: f64,
    /// Its length.
    span: f64,
    origin: Origin,
    /// Velocities at its end.
    velocity: Vec<Vec3>,
    /// Work of the drag in the stage before it.
    work_before: f64,
}

/// Where a stage began.
#[derive(Debug, Clone)]
enum Origin {
    /// A minimisation around this.
    Anchor(Anchor),
    /// An equilibrium; the stage led to the one near it.
    Rest(Vec<Vec3>),
}

impl Last {
    fn new((time, span): (f64, f64), origin: Origin, x: &[Vec3], work_before: f64) -> Self {
        let mut velocity = vec![Vec3::zeros(); x.len()];
        let about = match &origin {
            Origin::Anchor(anchor) => &anchor.x,
            Origin::Rest(about) => about,
        };
        parallel::fill(&mut velocity, |i| (x[i] - about[i]) / span);
        Self { time, span, origin, velocity, work_before }
    }
}

impl Motion {
    /// When the last step ended, and the velocities there: no more of it is used in later steps.
    pub(super) fn memory(&self) -> Option<(f64, Vec<Vec3>)> {
        let last = self.last.as_ref().map(|last| (last.time, last.velocity.clone()));
        last.or_else(|| self.start.clone())
    }

    /// Takes over the memory of one for as many `vertices`.
    pub(super) fn restore(
        &mut self,
        memory: Option<(f64, Vec<Vec3>)>,
        vertices: usize,
    ) -> Result<(), Malformed> {
        if memory.as_ref().is_some_and(|(_, velocity)| velocity.len() != vertices) {
            return Err(Malformed);
        }
        (self.last, self.start) = (None, memory);
        Ok(())
    }

    /// Begins a step at `start`; the velocities there, if they are known.
    fn begin(&mut self, start: f64) -> Option<&[Vec3]> {
        if let Some(last) = self.last.take().filter(|last| last.time == start) {
            self.start = Some((last.time, last.velocity));
        }
        let known = self.start.as_ref().filter(|(time, _)| *time == start);
        known.map(|(_, velocity)| velocity.as_slice())
    }

    /// Brings the shape of `next` to the equilibrium near that of `from`, looked for where the velocities lead; none where
    /// there is none within the trust region.
    ///
    /// # Errors
    /// If the model has no value there, or an obstacle is in the way.
    pub(super) fn follow_equilibrium(
        &mut self,
        workspace: &mut Workspace,
        from: &State,
        next: &mut State,
    ) -> Result<Option<Relaxation>> {
        workspace.check_way(from, next)?;
        let span = next.time - from.time;
        let guess = self.begin(from.time).map(|velocity| along(&from.x, velocity, span));
        let near = match guess {
            Some(_) => workspace.rest_nearby(next, guess)?,
            None => None,
        };
        // Velocities mislead where what drives the shape has a kink.
        let near = match near {
            None => workspace.rest_nearby(next, None)?,
            near => near,
        };
        if near.is_some() {
            let origin = Origin::Rest(from.x.to_vec());
            self.last = Some(Last::new((next.time, span), origin, &next.x, 0.0));
        }
        Ok(near)
    }

    /// Whether the last step led from an equilibrium to the next one.
    pub(super) fn rests(&self) -> bool {
        self.last.as_ref().is_some_and(|last| matches!(last.origin, Origin::Rest(_)))
    }

    /// The shape of `from` moved on while the clock of `route` goes from one value to a later one.
    ///
    /// # Errors
    /// If a stage fails.
    pub(super) fn advance(
        &mut self,
        workspace: &mut Workspace,
        from: &State,
        (start, until): (f64, f64),
        route: &Route<'_>,
        by: &Stepping,
    ) -> Result<StepOutcome> {
        let _scope = counters::part(workspace.model.tally(), counters::MOTION);
        let step = until - start;
        let velocity = self.begin(start);
        let stage = Stage { from, start, route, velocity, step, by };
        let mut done = Relaxation::default();
        let mut rough = None;
        if by.second_order {
            let pull = stage.pull(workspace, from.x.to_vec(), A);
            let about = stage.moved(A);
            let (first, half) = stage.solve(workspace, pull.clone(), A, None, about)?;
            done.add(&half);
            let anchor = extrapolated(&from.x, &first.x, (1.0 - A) / A);
            let before = (1.0 - A) / A * pull.dissipation(workspace.model.mechanics(), &first.x);
            // The smaller of the two results is the anchor moved on by the increment of the first stage.
            let mut coarse = anchor.clone();
            parallel::update(&mut coarse, |i, x| *x += first.x[i] - from.x[i]);
            let pull = Anchor { x: anchor, ..pull };
            let guess = extrapolated(&from.x, &first.x, 1.0 / A);
            let about = Some(coarse.clone());
            let (next, half) =
                stage.solve(workspace, pull.clone(), 1.0, Some((&first.x, guess)), about)?;
            done.add(&half);
            if !stage.rises(workspace, &next)? {
                self.last =
                    Some(Last::new((until, A * step), Origin::Anchor(pull), &next.x, before));
                return Ok(StepOutcome { x: next.x.into(), coarse, done });
            }
            rough = Some(next.x.into());
        }
        let pull = stage.pull(workspace, from.x.to_vec(), 1.0);
        let (next, half) = stage.solve(workspace, pull.clone(), 1.0, None, None)?;
        done.add(&half);
        // Of Euler's error ½ Δt² x'' twice as much is the difference to where the first velocity leads. A first step has
        // none: half of what it moves is a bound that keeps it short.
        let coarse = rough.unwrap_or_else(|| {
            let led = velocity.map(|velocity| along(&from.x, velocity, step));
            extrapolated(&next.x, led.as_deref().unwrap_or(&from.x), 0.5)
        });
        self.last = Some(Last::new((until, step), Origin::Anchor(pull), &next.x, 0.0));
        Ok(StepOutcome { x: next.x.into(), coarse, done })
    }

    /// Work that the drag has taken up in the step that ended with the shape `x`:
    ///
    /// ```text
    /// ∫ v·γ v dt ≈ Σ_k b_k Δt v_k·γ v_k,      v_k = (x_k - a_k) / (a Δt)
    /// ```
    ///
    /// by the quadrature of the method, b = 1 for Euler, (1-a, a) for sdirk2.
    pub(super) fn dissipated(&self, mechanics: &Mechanics, x: &[Vec3]) -> f64 {
        self.last.as_ref().map_or(0.0, |last| match &last.origin {
            Origin::Anchor(anchor) => last.work_before + anchor.dissipation(mechanics, x),
            Origin::Rest(_) => 0.0,
        })
    }

    /// Solves the last stage once more for `next`, whose species are no longer those that it was solved
    /// with: stiff waves follow them at once, and would be a sudden start of the next step.
    ///
    /// # Errors
    /// If the stage fails; [`SolveError::Departed`] where no equilibrium is near.
    pub(super) fn correct(
        &mut self,
        workspace: &mut Workspace,
        next: &mut State,
    ) -> Result<Relaxation> {
        let Some(last) = self.last.take().filter(|last| last.time == next.time) else {
            return Ok(Relaxation::default());
        };
        let _scope = counters::part(workspace.model.tally(), counters::MOTION);
        let done = match &last.origin {
            Origin::Anchor(anchor) => workspace.relax_anchored(next, anchor.clone(), None)?,
            Origin::Rest(_) => workspace.rest_nearby(next, None)?.ok_or(SolveError::Departed)?,
        };
        let Last { time, span, origin, work_before, .. } = last;
        self.last = Some(Last::new((time, span), origin, &next.x, work_before));
        Ok(done)
    }
}

/// What the stages of one step share.
struct Stage<'a> {
    from: &'a State,
    /// What the clock shows there.
    start: f64,
    route: &'a Route<'a>,
    /// Velocities at the start, if known.
    velocity: Option<&'a [Vec3]>,
    step: f64,
    by: &'a Stepping,
}

impl Stage<'_> {
    /// The pull of a stage whose Δt is `share` of the step.
    fn pull(&self, workspace: &Workspace, x: Vec<Vec3>, share: f64) -> Anchor {
        let model = &workspace.model;
        // Half way, so that a drag that goes by normals is of second order.
        let half = if model.drag().is_isotropic() { None } else { self.moved(0.5) };
        let about = half.as_deref().unwrap_or(&self.from.x);
        let weights =
            model.drag().weights(model.sheet(), about, self.by.drag / (share * self.step));
        let most = STAGE_TOLERANCE_SHARE * self.by.tolerance;
        let slack = self.velocity.map_or(most, |velocity| {
            let farthest = share * self.step * model.sheet().reduction().largest(velocity);
            (self.by.relative * farthest).max(MIN_SLACK * most).min(most)
        });
        Anchor { x, weights, slack }
    }

    /// Where the velocities at the start lead in a share of the step.
    fn moved(&self, share: f64) -> Option<Vec<Vec3>> {
        self.velocity.map(|v| along(&self.from.x, v, share * self.step))
    }

    /// The least energy with `pull` under the conditions after the share `at` of the step; looked for from
    /// the guess, or the good shape before that if it is better, and given up too far from `about`.
    fn solve(
        &self,
        workspace: &mut Workspace,
        pull: Anchor,
        at: f64,
        guess: Option<(&[Vec3], Vec<Vec3>)>,
        about: Option<Vec<Vec3>>,
    ) -> Result<(State, Relaxation)> {
        let (good, guess) = match guess {
            Some((good, guess)) => (good, Some(guess)),
            None => (self.from.x.as_slice(), self.moved(at)),
        };
        let start = State { x: good.to_vec().into(), ..State::clone(self.from) };
        let clock = self.start + at * self.step;
        let (mut state, held) = (self.route.conditions_at(clock, &start), self.route.held(clock));
        workspace.check_way(self.from, &state)?;
        let anchor = Some(pull);
        let distance_tolerance = self.by.distance_tolerance;
        let bound = self.by.bound.zip(about).map(|((tolerance, most), about)| Bound {
            start: self.from.x.to_vec(),
            about,
            tolerance,
            most,
        });
        let minimisation =
            Minimisation { anchor, guess, held, bound, distance_tolerance, trust: None };
        let done = workspace.minimise(&mut state, minimisation)?;
        Ok((state, done))
    }

    /// Whether the energy at `next` is higher than where the step started, both under the conditions at
    /// its end.
    fn rises(&self, workspace: &mut Workspace, next: &State) -> Result<bool> {
        if workspace.model.mechanics().has_prescribed() {
            // Pins that move do work.
            return Ok(false);
        }
        let mut at = workspace.at(next);
        let potential = at.potential()?;
        if let Some(held) = self.route.held(self.start + self.step) {
            held.act_on(potential);
        }
        let (before, after) = (potential.energy(&self.from.x), potential.energy(&next.x));
        potential.set_hold(None);
        Ok(after > before + ROUND_OFF * before.abs())
    }
}

/// `from + share (to - from)`.
fn extrapolated(from: &[Vec3], to: &[Vec3], share: f64) -> Vec<Vec3> {
    let mut out = to.to_vec();
    parallel::update(&mut out, |i, x| *x = from[i] + share * (*x - from[i]));
    out
}

/// `x + step v`.
fn along(x: &[Vec3], velocity: &[Vec3], step: f64) -> Vec<Vec3> {
    let mut out = x.to_vec();
    parallel::update(&mut out, |i, x| *x += step * velocity[i]);
    out
}
