//! What solvers work with: the model, memory to evaluate it, and how a shape is relaxed.

mod floating;
mod minimisation;
mod rest;
mod saddle;

use std::sync::Arc;

use super::diagnosis::Diagnosis;
use super::equilibrium::{self, Equilibrium, Relaxation};
use super::rejections::{Cause, Rejection, Rejections};
use super::stability::Stability;
use super::{Result, SolveError};
use crate::Vec3;
use crate::effects::EnergyTerm;
use crate::model::{Evaluation, EvaluationBuffers, Model, Potential, Stabilisation, State};
use crate::ode::Rejected;
use crate::record::{Malformed, Record};
use crate::reduction::Reduction;
use crate::solve::Control;

pub(super) use minimisation::{Bound, Minimisation, RampConditions};
pub(super) use rest::DISTANCE_TOLERANCE;

/// The part of the way of an obstacle over which its energy is differenced: far shorter than a gap, far above round-off.
const SHORT_WAY: f64 = 1e-6;

/// Factors by which a force tolerance is tightened at once.
const TIGHTENING: (f64, f64) = (1e-2, 0.3);

/// How a shape is relaxed.
pub struct Relaxer {
    /// The method.
    pub equilibrium: Box<dyn Equilibrium>,
    /// Largest force on a vertex that counts as rest, in units of the force scale.
    pub tolerance: f64,
    /// What it may be tightened to for soft sheets, where the scene does not give it.
    pub tightest: Option<f64>,
    /// Iterations after which a relaxation has failed.
    pub max_iterations: usize,
}

/// A model with what is needed to work on it.
pub struct Workspace {
    /// The model.
    pub model: Arc<Model>,
    /// Who asked for the work.
    pub control: Control,
    /// How a quasi-static shape is stabilised.
    pub stabilisation: Stabilisation,
    memory: EvaluationBuffers,
    relaxer: Option<Relaxer>,
    rejections: Rejections,
    stuck: Option<State>,
    stability: Option<Stability>,
    floating: floating::Floating,
}

impl Workspace {
    /// For `model`; without a relaxer its shape never moves.
    pub fn new(model: Arc<Model>, relaxer: Option<Relaxer>) -> Self {
        let (control, memory) = (Control::default(), EvaluationBuffers::default());
        Self {
            model,
            control,
            stabilisation: Stabilisation::default(),
            memory,
            relaxer,
            rejections: Rejections::default(),
            stuck: None,
            stability: None,
            floating: floating::Floating::default(),
        }
    }

    /// The latest rejected step attempts.
    #[must_use]
    pub fn rejections(&self) -> &Rejections {
        &self.rejections
    }

    /// Counts a rejected step attempt.
    pub fn reject(&mut self, rejected: Rejection) {
        self.model.tally().count(|work| work.rejected += 1);
        self.rejections.note(rejected);
    }

    /// The same of those of a library at a step from `state`.
    pub(super) fn reject_all(&mut self, state: &State, rejected: Rejected) {
        let mut reject = |cause, message| {
            self.reject(Rejection { message, ..Rejection::new(state, f64::NAN, cause) });
        };
        (0..rejected.error).for_each(|_| reject(Cause::Error, String::new()));
        (0..rejected.newton).for_each(|_| reject(Cause::Solver, String::new()));
        for error in rejected.refused {
            let error = SolveError::from(error);
            reject(error.cause(), error.to_string());
        }
    }

    /// The state at which the last relaxation that came to no end has stuck.
    #[must_use]
    pub fn stuck(&self) -> Option<&State> {
        self.stuck.as_ref()
    }

    /// The model at `state`.
    pub fn at<'a>(&'a mut self, state: &'a State) -> Evaluation<'a> {
        self.model.at(state, &mut self.memory)
    }

    /// Largest force on a vertex that counts as rest, in units of the force scale.
    #[must_use]
    pub fn force_tolerance(&self) -> f64 {
        self.relaxer.as_ref().map_or(0.0, |relaxer| relaxer.tolerance)
    }

    /// Tightens it by about `share`, if that is allowed and round-off lets it; whether it has.
    pub(super) fn tighten(&mut self, share: f64) -> bool {
        let Some(relaxer) = &mut self.relaxer else { return false };
        let tighter = relaxer.tolerance * share.clamp(TIGHTENING.0, TIGHTENING.1);
        let allowed = relaxer.tightest.is_some_and(|tightest| tighter > tightest);
        if allowed {
            relaxer.tolerance = tighter;
        }
        allowed
    }

    /// Iterations so far, those of rejected searches included.
    pub(super) fn iterations(&self) -> u64 {
        self.model.tally().work().iterations
    }

    /// What sums over the whole sheet are taken over.
    pub(super) fn reduction(&self) -> &Reduction {
        self.model.sheet().reduction()
    }

    /// Iterations after which a relaxation has failed.
    pub(super) fn most_iterations(&self) -> u64 {
        self.relaxer.as_ref().map_or(0, |relaxer| relaxer.max_iterations as u64)
    }

    /// Whether shapes are brought to rest, rather than some way towards it.
    pub(super) fn reaches_rest(&self) -> bool {
        self.relaxer.as_ref().is_some_and(|relaxer| relaxer.equilibrium.reaches_rest())
    }

    /// What later relaxations depend on besides their states.
    #[must_use]
    pub fn memory(&self) -> Record {
        let of =
            |relaxer: &Relaxer| Record::encode(&(relaxer.tolerance, relaxer.equilibrium.memory()));
        self.relaxer.as_ref().map_or_else(Record::default, of)
    }

    /// Takes over the memory of one for the same model.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    pub fn restore(&mut self, memory: &Record) -> Result<(), Malformed> {
        match &mut self.relaxer {
            Some(relaxer) => {
                let (tolerance, memory): (f64, Record) = memory.read()?;
                relaxer.tolerance = tolerance;
                relaxer.equilibrium.restore(&memory, self.model.mechanics())
            }
            None => Ok(()),
        }
    }

    /// A step begins.
    pub fn begin_step(&mut self) {
        self.floating.forget();
        if let Some(relaxer) = &mut self.relaxer {
            relaxer.equilibrium.begin_step();
        }
    }

    /// That step has failed, and nothing of it stays but the account of its work.
    pub fn roll_back(&mut self) {
        if let Some(relaxer) = &mut self.relaxer {
            relaxer.equilibrium.roll_back(self.model.mechanics());
        }
    }

    /// Moves the shape of `state` to where the constraints of the model are met; nothing without any.
    ///
    /// # Errors
    /// If the model has no value there, or no such shape is near.
    pub fn project(&mut self, state: &mut State) -> Result<()> {
        if !self.model.mechanics().is_constrained() {
            return Ok(());
        }
        let mut x = state.x.to_vec();
        let left = self.at(state).potential()?.project(&mut x);
        if !(left <= equilibrium::CONSTRAINT_TOLERANCE) {
            let names = self.model.mechanics().constraint_names();
            let constraint = names.collect::<Vec<_>>().join(", ");
            return Err(SolveError::Constraint { constraint, value: left, residual: None });
        }
        state.x = x.into();
        Ok(())
    }

    /// Largest force on a vertex at `state`, for those who inspect the run: no work of its method.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(crate) fn reported_residual(&mut self, state: &State) -> Result<f64> {
        let model = Arc::clone(&self.model);
        model.tally().uncounted(|| Ok(self.at(state).residual()?))
    }

    /// Total energy at `state`, for those who inspect the run: no work of its method.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn energy(&mut self, state: &State) -> Result<f64> {
        let model = Arc::clone(&self.model);
        model.tally().uncounted(|| Ok(self.at(state).potential()?.energy(&state.x)))
    }

    /// Energies of the effects in `state`.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn energies(&mut self, state: &State) -> Result<Vec<f64>> {
        let model = Arc::clone(&self.model);
        model.tally().uncounted(|| Ok(self.at(state).potential()?.energies(&state.x)))
    }

    /// Work on the prescribed pins of `state` on their way to `x`, by the forces at its beginning.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn work_of_pins(&mut self, state: &State, x: &[Vec3]) -> Result<f64> {
        let model = Arc::clone(&self.model);
        let mechanics = model.mechanics();
        if !mechanics.has_prescribed() {
            return Ok(0.0);
        }
        let moved = |i: usize| {
            let pins = mechanics.pins()[i];
            Vec3::from_fn(|a, _| if pins[a] { x[i][a] - state.x[i][a] } else { 0.0 })
        };
        let moved: Vec<Vec3> = (0..x.len()).map(moved).collect();
        let forces = model
            .tally()
            .uncounted(|| -> Result<_> { Ok(self.at(state).potential()?.forces(&state.x)) })?;
        Ok(-self.reduction().dot(&forces, &moved))
    }

    /// What every obstacle that moves does on its way from where it is in `state` to where it is at `time`, at the rate of the
    /// beginning: it has gone nowhere without the sheet. None for other effects.
    ///
    /// # Errors
    /// If the model has no value there.
    pub fn work_of_obstacles(&mut self, state: &State, time: f64) -> Result<Vec<Option<f64>>> {
        let model = Arc::clone(&self.model);
        let terms = model.mechanics().terms();
        let moves = |term: &EnergyTerm| term.reads().time && term.interaction().touches;
        if !terms.iter().any(moves) {
            return Ok(vec![None; terms.len()]);
        }
        let near = State { time: state.time + SHORT_WAY * (time - state.time), ..state.clone() };
        let (at, near) = (self.energies(state)?, self.energies(&near)?);
        let work = |(k, term)| moves(term).then(|| (near[k] - at[k]) / SHORT_WAY);
        Ok(terms.iter().enumerate().map(work).collect())
    }

    /// The vertex that is furthest from where it was, and how far.
    pub(super) fn farthest(&self, from: &[Vec3], to: &[Vec3]) -> (usize, f64) {
        let moved = |i: usize| (to[i] - from[i]).norm_squared();
        let farthest = (0..to.len()).max_by(|a, b| moved(*a).total_cmp(&moved(*b))).unwrap_or(0);
        (farthest, self.reduction().distance(from, to))
    }

    /// The drag, in units of that of the scene, under which stretching relaxes in the time of the chemistry:
    /// `Y T / W̄`.
    ///
    /// # Errors
    /// If the model has no value at `state`.
    pub(super) fn unit_drag(&mut self, state: &State) -> Result<f64> {
        let mean = self.model.drag().mean(self.model.sheet());
        let span = self.stabilisation.span;
        let mut at = self.at(state);
        let time = (1.0 / at.fastest_rate()?).min(span);
        let potential = at.potential()?;
        Ok(potential.force_scale() / potential.metric().mean_edge() * time / mean)
    }

    /// Takes the shape of `state` as that of the first state, but for what is prescribed and constrained.
    ///
    /// # Errors
    /// If the model has no value there, or no shape that meets the constraints is near.
    pub(crate) fn take_shape(&mut self, state: &mut State) -> Result<Relaxation> {
        if !self.model.moves() {
            return Ok(Relaxation::default());
        }
        let model = Arc::clone(&self.model);
        model.mechanics().set_prescribed(state.time, &mut state.x);
        self.project(state)?;
        Ok(Relaxation { energy: self.energy(state)?, ..Relaxation::default() })
    }

    /// Keeps `state` as that at which a search has stuck.
    pub(super) fn set_stuck(&mut self, state: State) {
        self.stuck = Some(state);
    }

    /// The error that a diagnosis at `state` comes to, if it finds a cause: `find` is given the tolerance of forces too.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn diagnosed(
        &mut self,
        state: &State,
        find: impl FnOnce(&mut Potential, &[Vec3], f64) -> Option<Diagnosis>,
    ) -> Result<Option<SolveError>> {
        let tolerance = self.force_tolerance();
        let mut at = self.at(state);
        let residual = at.residual()?;
        let diagnosis = find(at.potential()?, &state.x, tolerance).map(Box::new);
        let iterations = 0;
        Ok(diagnosis.map(|diagnosis| SolveError::NotAtRest {
            iterations,
            residual,
            tolerance,
            diagnosis,
        }))
    }
}
