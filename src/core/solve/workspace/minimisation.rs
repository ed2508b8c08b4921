//! Minimisations of the energy: under a proximal term, within a trust region, from a guess.

use std::sync::Arc;

use super::super::equilibrium::{self, Equilibrium, Goal, Relaxation, TrustRegion, explained};
use super::super::{Result, SolveError, counters};
use super::Workspace;
use crate::Vec3;
use crate::model::{Anchor, CorotationalForces, Model, Potential, State, mean};

/// Most relaxations one after the other where lengths depend on the shape; each leaves a small part of the force.
const MAX_ROUNDS: usize = 30;

/// Strain below which no scaled shape is tried.
const SMALL_GROWTH: f64 = 1e-2;

/// How a minimum is looked for.
pub(in crate::solve) struct Minimisation {
    /// The proximal term, if there is one.
    pub(in crate::solve) anchor: Option<Anchor>,
    /// Where it begins, if that is a better start than the shape there is.
    pub(in crate::solve) guess: Option<Vec<Vec3>>,
    /// What holds the sheet while its start is released.
    pub(in crate::solve) held: Option<RampConditions>,
    /// Radius of the trust region about the start, in mean edges.
    pub(in crate::solve) trust: Option<f64>,
    /// Where it is given up with [`SolveError::Departed`].
    pub(in crate::solve) bound: Option<Bound>,
    /// Largest distance to the equilibrium that counts as rest, in mean edges.
    pub(in crate::solve) distance_tolerance: f64,
}

impl Default for Minimisation {
    fn default() -> Self {
        Self {
            anchor: None,
            guess: None,
            held: None,
            trust: None,
            bound: None,
            distance_tolerance: f64::INFINITY,
        }
    }
}

/// How far from where it is expected the shape may be after a step.
pub(in crate::solve) struct Bound {
    /// The shape before the step.
    pub(in crate::solve) start: Vec<Vec3>,
    /// Where it is expected.
    pub(in crate::solve) about: Vec<Vec3>,
    /// Relative and absolute tolerance of [`Model::shape_misfit`],
    pub(in crate::solve) tolerance: (f64, f64),
    /// and its largest value.
    pub(in crate::solve) most: f64,
}

impl Bound {
    fn excludes(&self, model: &Model, x: &[Vec3]) -> bool {
        model.shape_misfit(&self.start, (&self.about, x), self.tolerance) > self.most
    }
}

/// Length factors in place of those of the species, and forces that hold the sheet.
pub(in crate::solve) struct RampConditions {
    /// Φ of every edge.
    pub(in crate::solve) factor: Vec<f64>,
    pub(in crate::solve) hold: CorotationalForces,
}

impl RampConditions {
    /// Brings `potential` under it.
    pub(in crate::solve) fn act_on(self, potential: &mut Potential) {
        potential.set_length_factor(&self.factor);
        potential.set_hold(Some(self.hold));
    }
}

impl Workspace {
    /// Brings the shape of `state` into equilibrium with its species. On an error the shape is the last
    /// good one.
    ///
    /// Where species live on faces the optimal lengths depend on the shape as well, by the weights that carry
    /// species to vertices: each relaxation is at the lengths of the shape that it begins with, and is
    /// followed by another one until forces vanish at the lengths of its own shape.
    ///
    /// # Errors
    /// If the model has no value there, or the relaxation fails.
    pub fn relax(&mut self, state: &mut State) -> Result<Relaxation> {
        let mut done = self.relax_once(state)?;
        if !self.model.conditions_follow_shape() {
            return Ok(done);
        }
        let tolerance = self.force_tolerance();
        for _ in 1..MAX_ROUNDS {
            let residual = self.at(state).residual()?;
            if !(residual > tolerance) {
                done.residual = residual;
                break;
            }
            done.add(&self.relax_once(state)?);
        }
        Ok(done)
    }

    /// The same at the lengths of the shape that it begins with. In a step from an equilibrium these lag by less
    /// than a thousandth of what changes, and so than the error that the step is allowed.
    ///
    /// # Errors
    /// As for [`Workspace::relax`].
    pub(crate) fn relax_once(&mut self, state: &mut State) -> Result<Relaxation> {
        self.minimise(state, Minimisation::default())
    }

    /// Brings the shape of `state` to the least energy with `anchor`, at most its slack from there; from
    /// `guess`, if that is a better start. On an error the shape is the last good one.
    ///
    /// # Errors
    /// As for [`Workspace::relax`].
    pub(crate) fn relax_anchored(
        &mut self,
        state: &mut State,
        anchor: Anchor,
        guess: Option<Vec<Vec3>>,
    ) -> Result<Relaxation> {
        let minimisation = Minimisation { anchor: Some(anchor), guess, ..Minimisation::default() };
        self.minimise(state, minimisation)
    }

    /// That obstacles which move between two states let the shape of the one become that of the other.
    ///
    /// # Errors
    /// [`SolveError::Obstructed`]; as for [`Workspace::relax`] if the model has no value.
    pub(in crate::solve) fn check_way(&mut self, from: &State, to: &State) -> Result<()> {
        if !self.model.mechanics().limits_steps() || from.time == to.time {
            return Ok(());
        }
        if self.at(to).potential()?.allows_path((&from.x, from.time), &to.x) {
            return Ok(());
        }
        let pinned = pinned_in_the_way(self.at(from).potential()?, &from.x);
        Err(SolveError::Obstructed { time: to.time, pinned })
    }

    /// Brings the shape of `state` to a minimum as `minimisation` says. On an error the shape is the last good one.
    ///
    /// # Errors
    /// As for [`Workspace::relax`]; [`SolveError::Departed`] where the trust region was left.
    pub(in crate::solve) fn minimise(
        &mut self,
        state: &mut State,
        minimisation: Minimisation,
    ) -> Result<Relaxation> {
        let Self { model, control, memory, relaxer, stuck, floating, .. } = self;
        if model.is_chemistry_alone() {
            return Ok(Relaxation::default());
        }
        let Minimisation { anchor, guess, held, trust, bound, distance_tolerance } = minimisation;
        let _scope = relaxer.is_some().then(|| counters::part(model.tally(), counters::RELAXATION));
        let mut x = state.x.to_vec();
        model.mechanics().set_prescribed(state.time, &mut state.x);
        let prescribed = state.x.to_vec();
        // Under drag steps are short.
        if anchor.is_some() {
            x.clone_from(&prescribed);
        }
        let mut at = model.at(state, memory);
        let potential = at.potential()?;
        let Some(relaxer) = relaxer else { return Ok(Relaxation::default()) };
        let is_held = held.is_some();
        if let Some(held) = held {
            held.act_on(potential);
        }
        let mut tolerance = relaxer.tolerance;
        let floats = floating.found(potential, &x, relaxer.tolerance);
        if let Some(anchor) = anchor {
            tolerance = tolerance.max(pull(potential, anchor, &x));
        }
        start_from((guess, trust.is_some()), potential, &mut x, &prescribed);
        let start = x.clone();
        let mut led = x.clone();
        potential.mechanics().keep_pins(&prescribed, &mut led);
        let edge = potential.metric().mean_edge();
        let goal = Goal {
            lost: &|x| bound.as_ref().is_some_and(|bound| bound.excludes(model, x)),
            distance_tolerance: distance_tolerance * edge,
            trust: trust.map(|radius| TrustRegion { centre: &start, radius: radius * edge }),
            floats,
            tolerance,
            max_iterations: relaxer.max_iterations,
            interrupted: &|| control.is_interrupted(),
            report: &|done| control.report(|| relaxing(done)),
        };
        let done = relax_anchored(&mut *relaxer.equilibrium, potential, (&mut x, &led), &goal)
            .map_err(|error| explained(error, potential, &x, tolerance));
        let anchor = potential.take_anchor();
        potential.set_hold(None);
        if done.is_ok() && !is_held {
            let by = (model.drag(), relaxer.tolerance);
            floating.settle(potential, (&mut x, &start), anchor, by);
        }
        state.x = x.into();
        if done.as_ref().is_err_and(is_failure) {
            *stuck = Some(state.clone());
        }
        done
    }
}

/// Moves `x` to where pins lead it, by incremental loading, and to the minimum there.
fn relax_anchored(
    method: &mut dyn Equilibrium,
    potential: &mut Potential,
    (x, led): (&mut [Vec3], &[Vec3]),
    goal: &Goal<'_>,
) -> Result<Relaxation> {
    let mut done = equilibrium::load_incrementally(method, potential, x, led, goal)?;
    done.add(&equilibrium::relax(method, potential, x, goal)?);
    Ok(done)
}

/// Whether a relaxation failed, rather than was interrupted or left its trust region.
fn is_failure(error: &SolveError) -> bool {
    !matches!(error, SolveError::Interrupted | SolveError::Departed)
}

/// Adds the pull of `anchor`, with fixed directions as in `x`; the force of its slack, in units of the force scale.
fn pull(potential: &mut Potential, mut anchor: Anchor, x: &[Vec3]) -> f64 {
    anchor.follow_pins(potential.mechanics(), x);
    let slack = anchor.slack_force(potential.reduction()) / potential.force_scale();
    potential.set_anchor(Some(anchor));
    slack
}

/// The vertex of the shape `x` that an obstacle which moves presses most, if pins hold it against most of that force.
fn pinned_in_the_way(potential: &mut Potential, x: &[Vec3]) -> Option<usize> {
    let mechanics = Arc::clone(potential.mechanics());
    let moving = |k: &usize| mechanics.terms()[*k].reads().time;
    let pressed = mechanics.contacts().filter(moving).filter_map(|k| {
        let force = potential.force_of(k, x).into_iter().enumerate();
        force.max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()))
    });
    let most = pressed.max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()));
    let (vertex, force) = most?;
    let fixed = mechanics.pins()[vertex];
    let held: f64 = (0..3).filter(|a| fixed[*a]).map(|a| force[a] * force[a]).sum();
    (held > 0.5 * force.norm_squared()).then_some(vertex)
}

/// How far a relaxation is, in words.
fn relaxing(done: &Relaxation) -> String {
    let Relaxation { iterations, residual, .. } = done;
    format!("relaxing the shape, {iterations} iterations, largest force {residual:.1e}")
}

/// Puts `guess`, or under an anchor or where a minimum `nearby` is looked for `x` [`scaled`], in place of `x`: that which is
/// allowed and has the least energy, if that is less than the energy there; with the fixed directions of `pinned`.
fn start_from(
    (mut guess, nearby): (Option<Vec<Vec3>>, bool),
    potential: &mut Potential,
    x: &mut Vec<Vec3>,
    pinned: &[Vec3],
) {
    // Straight on, a sheet that turns is stretched: it has more energy there, but its equilibrium is near.
    if nearby && let Some(mut guess) = guess.take() {
        let mechanics = Arc::clone(potential.mechanics());
        mechanics.keep_pins(pinned, &mut guess);
        if potential.allows(x, &guess, equilibrium::MIN_AREA_SHARE) {
            *x = guess;
            return;
        }
    }
    let mut guesses = Vec::from_iter(guess);
    // One relaxation a step is to be that of the paper. What a constraint holds has more energy than what does not meet it.
    if (nearby || potential.anchor().is_some()) && !potential.mechanics().is_constrained() {
        guesses.extend(scaled(potential, x));
    }
    if guesses.is_empty() {
        return;
    }
    let mechanics = Arc::clone(potential.mechanics());
    let mut led = x.clone();
    mechanics.keep_pins(pinned, &mut led);
    let mut least = potential.energy(&led);
    let begin = x.clone();
    for mut guess in guesses {
        mechanics.keep_pins(pinned, &mut guess);
        if potential.allows(&begin, &guess, equilibrium::MIN_AREA_SHARE) {
            let energy = potential.energy(&guess);
            if energy < least {
                (least, *x) = (energy, guess);
            }
        }
    }
}

/// `x` scaled about its centre to where its edges fit their optimal lengths best; none if it is nearly that large, or
/// keeps its periods.
fn scaled(potential: &Potential, x: &[Vec3]) -> Option<Vec<Vec3>> {
    let (sheet, reduction) = (potential.sheet(), potential.reduction());
    if !reduction.periods().is_empty() {
        return None;
    }
    let mut sums = [0.0; 2];
    for (edge, optimal) in sheet.edges().iter().zip(potential.metric().length()) {
        let [a, b] = edge.vertices.map(|v| x[v as usize]);
        let length = (b - a).norm();
        sums[0] += optimal * length;
        sums[1] += length * length;
    }
    reduction.sum_over_ranks(&mut sums);
    let factor = sums[0] / sums[1];
    if !((factor - 1.0).abs() > SMALL_GROWTH) {
        return None;
    }
    let centre = mean(x, reduction);
    Some(x.iter().map(|x| centre + factor * (x - centre)).collect())
}

impl Workspace {
    /// Moves the shape of `state`, a minimum, rigidly to where it has no net motion from `about`; nothing unless the sheet
    /// floats.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(in crate::solve) fn align(&mut self, state: &mut State, about: &[Vec3]) -> Result<()> {
        let tolerance = self.force_tolerance();
        let Self { model, memory, floating, .. } = self;
        let mut x = state.x.to_vec();
        let mut at = model.at(state, memory);
        floating.settle(at.potential()?, (&mut x, about), None, (model.drag(), tolerance));
        state.x = x.into();
        Ok(())
    }
}
