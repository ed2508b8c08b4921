//! Rest at fixed conditions: the equilibrium near a shape, and the stable one that the overdamped motion leads to.
//!
//! ```text
//! 0       = -∂U/∂x           near a shape: a minimisation within a trust region
//! W dx/dτ = -∂U/∂x           from anywhere: steps of `incremental_potential` under error control, which grow as the motion
//!                            dies down; W is the drag of the scene, which sets the direction of the motion
//! ```
//!
//! The motion ends where a stable equilibrium is near. In pseudo-time τ nothing changes but the shape and, where the sheet
//! is strained, at first its optimal lengths:
//!
//! ```text
//! l̄_e(τ) = |x_i - x_j|^(1-τ) l̄_e^τ        up to τ = 1, for every edge e = ij of the shape x at τ = 0
//! f(τ)   = (1-τ) f₀                         f₀ = ∂U/∂x there: the forces that hold that shape, which turn with it
//! ```
//!
//! So a dose that asks for much growth at once is grown into slowly, rather than from a crushed sheet.

use super::super::diagnosis;
use super::super::equilibrium::Relaxation;
use super::super::incremental_potential::{Motion, Stepping};
use super::super::route::{Ramp, Route};
use super::super::{Result, SolveError, end_of_step};
use super::{Minimisation, Workspace};
use crate::Vec3;
use crate::model::{CorotationalForces, State};
use crate::sheet::is_turned;

/// Radius of the trust region of a minimisation that is to stay on its branch, in mean edges: with 2 there, coarse meshes
/// came to minima that depended on the linear solver.
pub(in crate::solve) const NEARBY: f64 = 0.25;
/// Largest estimated distance to a minimum, in mean edges: forces alone leave soft bending modes far from it.
pub(in crate::solve) const DISTANCE_TOLERANCE: f64 = 0.02;
/// Tolerances of a step in pseudo-time, relative to the largest displacement and in mean edges.
const TOLERANCE: (f64, f64) = (0.05, 0.1);
/// Drag in units of the stretching stiffness, where lengths are ramped in one unit of pseudo-time.
const DRAG: f64 = 1e-7;
/// Displacement that the first step is expected to make, in mean edges, and its share of a ramp.
const FIRST_DISPLACEMENT: f64 = 0.1;
const FIRST_SHARE: f64 = 0.1;
/// In a step as long as this, in units of a ramp, drag holds nothing any more.
const LONGEST_STEP: f64 = 1e12;
/// Logarithmic strain below which lengths are not ramped.
const SMALL_STRAIN: f64 = 1e-3;
/// Steps are proposed shorter than their error allows, and change by factors between these.
const SAFETY: f64 = 0.9;
const STEP_FACTORS: (f64, f64) = (0.1, 4.0);
/// Most iterations, in units of those after which a single relaxation has failed.
const ITERATION_BUDGET: u64 = 10;
/// Most minimisations where lengths depend on the shape; each leaves a small part of the force.
const MAX_ROUNDS: usize = 10;
/// Most saddles that are left one after the other.
const MAX_SADDLES: usize = 5;

impl Workspace {
    /// Brings the shape of `state` to the equilibrium near it, or near `guess` if that is a better start; none, and the
    /// shape unchanged, where there is none within the trust region.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(crate) fn rest_nearby(
        &mut self,
        state: &mut State,
        mut guess: Option<Vec<Vec3>>,
    ) -> Result<Option<Relaxation>> {
        let (mut next, mut done) = (state.clone(), Relaxation::default());
        // Where species live on faces, optimal lengths are those of the shape that a minimisation begins with.
        let rounds = if self.model.conditions_follow_shape() { MAX_ROUNDS } else { 1 };
        for _ in 0..rounds {
            let minimisation = Minimisation {
                guess: guess.take(),
                trust: Some(NEARBY),
                distance_tolerance: DISTANCE_TOLERANCE,
                ..Minimisation::default()
            };
            match self.minimise(&mut next, minimisation) {
                Ok(more) => done.add(&more),
                Err(error) if error.is_without_rest() => return Ok(None),
                Err(error) => return Err(error),
            }
            if rounds > 1 && self.reported_residual(&next)? <= self.force_tolerance() {
                break;
            }
        }
        state.x = next.x;
        Ok(Some(done))
    }

    /// Lets the shape of `state` follow the overdamped motion under its conditions to a stable equilibrium, while lengths go
    /// from those of the shape to those of the species.
    ///
    /// # Errors
    /// If the motion leads to none.
    pub fn settle_shape(&mut self, state: &mut State) -> Result<Relaxation> {
        if !self.model.moves() || !self.reaches_rest() {
            return self.relax(state);
        }
        let begin = state.x.clone();
        let mechanics = self.model.mechanics().clone();
        mechanics.set_prescribed(state.time, &mut state.x);
        let mut done = Relaxation::default();
        let mut ramp = self.ramp_from(state)?;
        for _ in 0..=MAX_SADDLES {
            self.flow(state, ramp.take(), &mut done)?;
            if !self.leave_saddle(state, &mut done)? {
                break;
            }
        }
        self.align(state, &begin)?;
        Ok(done)
    }

    /// From the lengths that the edges of `state` have to those of its species; none where these are the same, or
    /// forces balance already.
    fn ramp_from(&mut self, state: &State) -> Result<Option<Ramp>> {
        if self.reported_residual(state)? <= self.force_tolerance() {
            return Ok(None);
        }
        let model = self.model.clone();
        let Some(to) = self.at(state).length_factor()?.map(|to| to.into_owned()) else {
            return Ok(None);
        };
        let rest = model.mechanics().reference().length();
        let length = |(edge, rest): (&crate::sheet::Edge, &f64)| {
            let [a, b] = edge.vertices.map(|v| state.x[v as usize]);
            (b - a).norm() / rest
        };
        let from: Vec<f64> = model.sheet().edges().iter().zip(rest).map(length).collect();
        let strain = to.iter().zip(&from).map(|(to, from)| (to / from).ln().abs());
        let strain = self.reduction().largest_over_ranks(strain.fold(0.0, f64::max));
        if !(strain > SMALL_STRAIN) {
            return Ok(None);
        }
        let mut at = self.at(state);
        let potential = at.potential()?;
        potential.set_length_factor(&from);
        let mut force = vec![Vec3::zeros(); state.x.len()];
        potential.energy_gradient(&state.x, &mut force);
        let hold = CorotationalForces { force, shape: state.x.to_vec() };
        Ok(Some(Ramp { lengths: (from, to), hold }))
    }

    /// The motion to an equilibrium, stable or not.
    pub(super) fn flow(
        &mut self,
        state: &mut State,
        ramp: Option<Ramp>,
        done: &mut Relaxation,
    ) -> Result<()> {
        if ramp.is_none()
            && let Some(near) = self.rest_nearby(state, None)?
        {
            done.add(&near);
            return Ok(());
        }
        let (begin, extent) = (state.x.clone(), self.extent());
        let edge = self.model.mechanics().reference().mean_edge();
        let most = self.iterations() + ITERATION_BUDGET * self.most_iterations();
        let mut motion = Motion::default();
        let mut course = self.begin_course(state, ramp)?;
        while self.iterations() <= most && course.step > 0.0 && course.step < LONGEST_STEP {
            let until = course.end_of_step();
            let next = self.step_in_pseudo_time(&mut motion, state, &course, until);
            let (x, error) = match next {
                Ok((x, more, error)) => {
                    done.add(&more);
                    (x, error)
                }
                Err(error) if error.is_without_rest() => (Vec::new(), f64::INFINITY),
                Err(error) => return Err(error),
            };
            if !course.accepts(until, error) {
                continue;
            }
            if is_turned(self.model.sheet(), &state.x, &x) {
                return Err(SolveError::InsideOut);
            }
            let moved = self.reduction().distance(&state.x, &x);
            state.x = x.into();
            // A load that nothing holds would move the sheet for ever.
            if self.reduction().distance(&begin, &state.x) > extent
                && let Some(error) = self.diagnosed(state, diagnosis::net_force)?
            {
                return Err(error);
            }
            if course.is_frozen()
                && moved < NEARBY * edge
                && let Some(near) = self.rest_nearby(state, None)?
            {
                done.add(&near);
                return Ok(());
            }
        }
        Err(self.reason_without_rest(state))
    }

    /// Diagonal of the box around the sheet at rest.
    fn extent(&self) -> f64 {
        let (rest, reduction) = (self.model.sheet().rest(), self.reduction());
        let span = |a: usize| {
            reduction.max(rest.len(), |i| rest[i][a]) + reduction.max(rest.len(), |i| -rest[i][a])
        };
        Vec3::new(span(0), span(1), span(2)).norm()
    }

    /// One step, what it took and its error in units of the tolerance.
    fn step_in_pseudo_time(
        &mut self,
        motion: &mut Motion,
        state: &State,
        course: &Course,
        until: f64,
    ) -> Result<(Vec<Vec3>, Relaxation, f64)> {
        let tolerance = self.model.shape_unit(state, TOLERANCE);
        let by = Stepping {
            drag: course.drag,
            second_order: true,
            tolerance,
            relative: TOLERANCE.0,
            distance_tolerance: DISTANCE_TOLERANCE,
            bound: None,
        };
        let (at, clock) = (state.clone(), (course.clock, until));
        let route = Route::frozen(&at, clock, course.ramp.as_ref());
        let moved = motion.advance(self, state, clock, &route, &by)?;
        let [coarse, fine] = [moved.coarse, moved.x].map(|x| State { x: x.into(), ..at.clone() });
        let error = self.model.shape_misfit(&state.x, (&coarse.x, &fine.x), TOLERANCE);
        Ok((fine.x.into(), moved.done, error))
    }

    /// The beginning of a motion in pseudo-time, in which the largest force moves a vertex by a small part of an edge in the first step, or
    /// the lengths go a small part of their way.
    fn begin_course(&mut self, state: &State, ramp: Option<Ramp>) -> Result<Course> {
        let model = self.model.clone();
        let edge = model.mechanics().reference().mean_edge();
        let mean = model.drag().mean(model.sheet());
        let mut at = self.at(state);
        let gradient = at.gradient()?;
        let potential = at.potential()?;
        let stiffness = potential.force_scale() / potential.metric().mean_edge();
        let drag = DRAG * stiffness / mean;
        let speed = |i: usize| gradient[i].norm() / (drag * model.drag().tangential(i));
        let fastest = self.reduction().max(gradient.len(), speed);
        let step = match ramp {
            Some(_) => FIRST_SHARE,
            None => FIRST_DISPLACEMENT * edge / fastest,
        };
        Ok(Course { drag, ramp, clock: 0.0, step })
    }

    /// Why no equilibrium is found near the shape of `state`.
    pub(in crate::solve) fn reason_without_rest(&mut self, state: &State) -> SolveError {
        let cause = self.diagnosed(state, |potential, x, tolerance| {
            let mut gradient = vec![Vec3::zeros(); x.len()];
            potential.energy_gradient(x, &mut gradient);
            let residual = potential.residual(&gradient);
            diagnosis::relaxation(potential, x, (residual, tolerance))
                .or_else(|| diagnosis::collapse(potential, x))
                .or_else(|| diagnosis::stretched(potential, x))
        });
        self.set_stuck(state.clone());
        if let Some(error) = cause.ok().flatten() {
            return error;
        }
        // A relaxation from there says more of why.
        match self.relax_once(&mut state.clone()) {
            Err(error) if error.is_without_rest() => error,
            _ => SolveError::WithoutRest { time: state.time },
        }
    }
}

/// How far a motion in pseudo-time has come.
struct Course {
    /// A factor on the drag of the scene.
    drag: f64,
    ramp: Option<Ramp>,
    clock: f64,
    /// Length of the next step.
    step: f64,
}

impl Course {
    /// Whether nothing changes any more but the shape.
    fn is_frozen(&self) -> bool {
        self.ramp.is_none() || self.clock >= 1.0
    }

    fn end_of_step(&self) -> f64 {
        match self.is_frozen() {
            true => self.clock + self.step,
            false => end_of_step(self.clock, self.step, 1.0),
        }
    }

    /// Continues from `until` after a step whose error is below 1; otherwise it is to be repeated by a shorter one.
    fn accepts(&mut self, until: f64, error: f64) -> bool {
        let (length, factor) = (until - self.clock, SAFETY / error.sqrt());
        let factor = if factor.is_nan() { STEP_FACTORS.0 } else { factor };
        if error <= 1.0 {
            self.clock = until;
            self.step = length * factor.clamp(STEP_FACTORS.0, STEP_FACTORS.1);
            return true;
        }
        self.step = length * factor.clamp(STEP_FACTORS.0, SAFETY);
        false
    }
}
