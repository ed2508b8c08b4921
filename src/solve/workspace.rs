//! What solvers work with: the model, memory to evaluate it, and how a shape is relaxed.

use std::sync::Arc;

use super::diagnosis::Diagnosis;
use super::equilibrium::{self, Equilibrium, Goal, Relaxation, Trust, explained};
use super::stability::Stability;
use super::tries::{Cause, Tries, Try};
use super::{Result, SolveError, part};
use crate::Vec3;
use crate::model::{Anchor, Evaluation, Memory, Model, Potential, State};
use crate::ode::Rejected;
use crate::record::{Malformed, Reading, Record};
use crate::sheet::is_turned;

/// Whoever asked for long work: it may be interrupted, and reports how far it is.
#[derive(Clone)]
pub struct Control {
    interrupted: Arc<dyn Fn() -> bool + Send + Sync>,
    listener: Arc<Listener>,
}

/// Takes reports; asks for the text only where it shows it.
type Listener = dyn Fn(&dyn Fn() -> String) + Send + Sync;

impl Default for Control {
    /// Nobody: never interrupted.
    fn default() -> Self {
        Self { interrupted: Arc::new(|| false), listener: Arc::new(|_| ()) }
    }
}

impl Control {
    /// `interrupted` is asked now and then, and `true` gives up; `listener` is given reports.
    #[must_use]
    pub fn new(
        interrupted: impl Fn() -> bool + Send + Sync + 'static,
        listener: impl Fn(&dyn Fn() -> String) + Send + Sync + 'static,
    ) -> Self {
        Self { interrupted: Arc::new(interrupted), listener: Arc::new(listener) }
    }

    /// Whether the work is to be given up.
    #[must_use]
    pub fn interrupted(&self) -> bool {
        (self.interrupted)()
    }

    /// Whether to go on.
    ///
    /// # Errors
    /// [`SolveError::Interrupted`].
    pub fn check(&self) -> Result<()> {
        if self.interrupted() { Err(SolveError::Interrupted) } else { Ok(()) }
    }

    /// Reports what is being done, and how far it is.
    pub fn report(&self, text: impl Fn() -> String) {
        (self.listener)(&text);
    }
}

/// How a shape is relaxed.
pub(crate) struct Relaxer {
    pub(crate) equilibrium: Box<dyn Equilibrium>,
    /// Largest force on a vertex that counts as rest, in units of the force scale.
    pub(crate) tolerance: f64,
    pub(crate) max_iterations: usize,
}

/// Most relaxations one after the other where lengths depend on the shape; each leaves a small part of the force.
const ROUNDS: usize = 30;

/// Vertices up to which a factor of the Hessian says whether a shape is stable.
const LARGEST: usize = 50_000;

/// How a minimum is looked for.
pub(super) struct Search {
    /// The proximal term, if there is one.
    pub(super) anchor: Option<Anchor>,
    /// Where it begins, if that is a better start than the shape there is.
    pub(super) guess: Option<Vec<Vec3>>,
    /// Radius of the trust region about the start, in mean edges.
    pub(super) trust: Option<f64>,
    /// Factor on the force tolerance.
    pub(super) looser: f64,
    /// Largest distance to the equilibrium that counts as rest, in mean edges.
    pub(super) displacement: f64,
    /// What holds the sheet while its start is released.
    pub(super) held: Option<Held>,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            anchor: None,
            guess: None,
            trust: None,
            looser: 1.0,
            displacement: f64::INFINITY,
            held: None,
        }
    }
}

/// Length factors in place of those of the species, and forces that hold the vertices.
pub(super) struct Held {
    /// Φ of every edge.
    pub(super) factor: Vec<f64>,
    /// Force on every vertex.
    pub(super) force: Vec<Vec3>,
}

impl Held {
    /// Brings `potential` under it.
    pub(super) fn act_on(self, potential: &mut Potential) {
        potential.set_length_factor(&self.factor);
        potential.set_hold(Some(self.force));
    }
}

/// Sees the shapes on the way from one accepted state to the next.
pub(crate) trait OnTheWay: Send {
    /// A step is tried.
    fn begin(&mut self);

    /// It comes by the shape `x`.
    fn see(&mut self, x: &[Vec3]);
}

/// A model with what is needed to work on it.
pub struct Workspace {
    /// The model.
    pub model: Arc<Model>,
    /// Who asked for the work.
    pub control: Control,
    memory: Memory,
    relaxer: Option<Relaxer>,
    tries: Tries,
    stuck: Option<State>,
    stability: Option<Stability>,
    on_the_way: Option<Box<dyn OnTheWay>>,
}

impl Workspace {
    /// For `model`; without a relaxer its shape never moves.
    pub(crate) fn new(model: Arc<Model>, relaxer: Option<Relaxer>) -> Self {
        let (control, memory) = (Control::default(), Memory::default());
        Self {
            model,
            control,
            memory,
            relaxer,
            tries: Tries::default(),
            stuck: None,
            stability: None,
            on_the_way: None,
        }
    }

    /// From now on `watcher` sees the shapes on the way of a step, where a policy has some.
    pub(crate) fn watch_the_way(&mut self, watcher: Box<dyn OnTheWay>) {
        self.on_the_way = Some(watcher);
    }

    /// A step is tried.
    pub(super) fn begin_way(&mut self) {
        if let Some(watcher) = &mut self.on_the_way {
            watcher.begin();
        }
    }

    /// The shape comes by `to`, along a branch of equilibria or by a jump.
    ///
    /// # Errors
    /// [`SolveError::InsideOut`] if a jump turns it over.
    pub(super) fn pass(&mut self, from: &[Vec3], to: &[Vec3], jumps: bool) -> Result<()> {
        if let Some(watcher) = &mut self.on_the_way {
            watcher.see(to);
        }
        match jumps && is_turned(self.model.sheet(), from, to) {
            true => Err(SolveError::InsideOut),
            false => Ok(()),
        }
    }

    /// The last tries that came to no result.
    #[must_use]
    pub fn tries(&self) -> &Tries {
        &self.tries
    }

    /// Counts a try that came to no result.
    pub(crate) fn reject(&mut self, rejected: Try) {
        self.model.tally().count(|work| work.rejected += 1);
        self.tries.note(rejected);
    }

    /// The same of those of a library at a step from `state`.
    pub(super) fn reject_all(&mut self, state: &State, rejected: Rejected) {
        let mut reject = |cause, message| {
            self.reject(Try { message, ..Try::of(state, f64::NAN, cause) });
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

    /// Iterations so far, those of rejected searches included.
    pub(super) fn iterations(&self) -> u64 {
        self.model.tally().work().iterations
    }

    /// Iterations after which a relaxation has failed.
    pub(super) fn most_iterations(&self) -> u64 {
        self.relaxer.as_ref().map_or(0, |relaxer| relaxer.max_iterations as u64)
    }

    /// Whether shapes are brought to rest, rather than some way towards it.
    pub(super) fn reaches_rest(&self) -> bool {
        self.relaxer.as_ref().is_some_and(|relaxer| relaxer.equilibrium.reaches_rest())
    }

    /// Writes what later relaxations depend on besides their states.
    pub(crate) fn store(&self, record: &mut Record) {
        if let Some(relaxer) = &self.relaxer {
            relaxer.equilibrium.store(record);
        }
    }

    /// Takes over what one for the same model has written.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    pub(crate) fn restore(&mut self, reading: &mut Reading<'_>) -> Result<(), Malformed> {
        match &mut self.relaxer {
            Some(relaxer) => relaxer.equilibrium.restore(reading, self.model.mechanics()),
            None => Ok(()),
        }
    }

    /// A step begins.
    pub(crate) fn mark(&mut self) {
        if let Some(relaxer) = &mut self.relaxer {
            relaxer.equilibrium.mark();
        }
    }

    /// That step has failed, and nothing of it stays but the account of its work.
    pub(crate) fn roll_back(&mut self) {
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
        if !(left <= equilibrium::MET) {
            let names = self.model.mechanics().constraint_names();
            let constraint = names.collect::<Vec<_>>().join(", ");
            return Err(SolveError::Constraint { constraint, value: left, rounds: 1 });
        }
        state.x = x.into();
        Ok(())
    }

    /// Largest force on a vertex at `state`, for those who look at the run: no work of its method.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn residual_to_tell(&mut self, state: &State) -> Result<f64> {
        let model = Arc::clone(&self.model);
        model.tally().uncounted(|| Ok(self.at(state).residual()?))
    }

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
        if !self.model.lengths_follow_shape() {
            return Ok(done);
        }
        let tolerance = self.force_tolerance();
        for _ in 1..ROUNDS {
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
    pub fn relax_once(&mut self, state: &mut State) -> Result<Relaxation> {
        Ok(self.search(state, Search::default())?.0)
    }

    /// Brings the shape of `state` to the least energy with `anchor`, at most its slack from there; from
    /// `guess`, if that is a better start. On an error the shape is the last good one.
    ///
    /// # Errors
    /// As for [`Workspace::relax`].
    pub fn minimise(
        &mut self,
        state: &mut State,
        anchor: Anchor,
        guess: Option<Vec<Vec3>>,
    ) -> Result<Relaxation> {
        let search = Search { anchor: Some(anchor), guess, ..Search::default() };
        Ok(self.search(state, search)?.0)
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

    /// The direction that lowers the energy most at `state`, an equilibrium, if one does; its largest displacement is
    /// 1. None too where stability is unknown: on large sheets, and below round-off.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn unstable_mode(
        &mut self,
        state: &State,
        held: Option<Held>,
    ) -> Result<Option<Vec<Vec3>>> {
        let Self { model, control, memory, relaxer: Some(relaxer), stability, .. } = self else {
            return Ok(None);
        };
        if model.is_chemistry_alone() || state.x.len() > LARGEST {
            return Ok(None);
        }
        let mut at = model.at(state, memory);
        let potential = at.potential()?;
        if let Some(held) = held {
            held.act_on(potential);
        }
        let found = match relaxer.equilibrium.is_minimum(potential, &state.x) {
            Some(true) => Ok(None),
            _ => lowest_mode(stability, control, potential, &state.x),
        };
        potential.set_hold(None);
        match found {
            Err(SolveError::Interrupted) => Err(SolveError::Interrupted),
            found => Ok(found.unwrap_or_default()),
        }
    }

    /// Brings the shape of `state` to a minimum as `search` says; with how far the vertex that moved most is
    /// from where the search began, in mean edges. On an error the shape is the last good one.
    ///
    /// # Errors
    /// As for [`Workspace::relax`]; [`SolveError::Departed`] where the trust region was left.
    pub(super) fn search(
        &mut self,
        state: &mut State,
        search: Search,
    ) -> Result<(Relaxation, f64)> {
        let Self { model, control, memory, relaxer, stuck, .. } = self;
        if model.is_chemistry_alone() {
            return Ok((Relaxation::default(), 0.0));
        }
        let Search { anchor, guess, trust, looser, displacement, held } = search;
        let _scope = relaxer.is_some().then(|| part(model.tally(), part::RELAXATION));
        let mut x = state.x.to_vec();
        model.mechanics().set_prescribed(state.time, &mut state.x);
        let prescribed = state.x.to_vec();
        // Under drag steps are short.
        if anchor.is_some() {
            x.clone_from(&prescribed);
        }
        let mut at = model.at(state, memory);
        let potential = at.potential()?;
        let Some(relaxer) = relaxer else { return Ok((Relaxation::default(), 0.0)) };
        let mut tolerance = relaxer.tolerance * looser;
        if let Some(held) = held {
            held.act_on(potential);
        }
        if let Some(mut anchor) = anchor {
            anchor.follow_pins(model.mechanics(), &x);
            tolerance = tolerance.max(anchor.force() / potential.force_scale());
            potential.set_anchor(Some(anchor));
        }
        start_from(guess, potential, &mut x, &prescribed);
        let start = x.clone();
        let mut led = x.clone();
        potential.mechanics().keep_pins(&prescribed, &mut led);
        let edge = potential.metric().mean_edge();
        let goal = Goal {
            displacement: displacement * edge,
            trust: trust.map(|radius| Trust { centre: &start, radius: radius * edge }),
            tolerance,
            max_iterations: relaxer.max_iterations,
            interrupted: &|| control.interrupted(),
            report: &|done| control.report(|| relaxing(done)),
        };
        let method = &mut *relaxer.equilibrium;
        let mut relax = || {
            let mut done = equilibrium::lead(method, potential, &mut x, &led, &goal)?;
            done.add(&equilibrium::relax(method, potential, &mut x, &goal)?);
            Ok(done)
        };
        let done = relax().map_err(|error| explained(error, potential, &x, tolerance));
        potential.set_anchor(None);
        potential.set_hold(None);
        let moved = equilibrium::distance(&start, &x) / edge;
        state.x = x.into();
        let quiet =
            |error: &SolveError| matches!(error, SolveError::Interrupted | SolveError::Departed);
        if done.as_ref().is_err_and(|error| !quiet(error)) {
            *stuck = Some(state.clone());
        }
        Ok((done?, moved))
    }
}

/// The mode of the lowest eigenvalue at `x`, if that is negative.
fn lowest_mode(
    stability: &mut Option<Stability>,
    control: &Control,
    potential: &mut Potential,
    x: &[Vec3],
) -> Result<Option<Vec<Vec3>>> {
    let judge = match stability.take() {
        Some(judge) => judge,
        None => Stability::new(potential.mechanics())?,
    };
    let judge = stability.insert(judge.with_control(control));
    if judge.inertia(potential, x)?.negative == 0 {
        return Ok(None);
    }
    Ok(judge.spectrum(potential, x, 1)?.modes.pop().map(|mode| mode.shape))
}

/// How far a relaxation is, in words.
fn relaxing(done: &Relaxation) -> String {
    let Relaxation { iterations, residual, .. } = done;
    format!("relaxing the shape, {iterations} iterations, largest force {residual:.1e}")
}

/// Puts `guess` in place of `x`, with the fixed directions of `pinned`, if it is allowed and has less energy.
fn start_from(
    guess: Option<Vec<Vec3>>,
    potential: &mut Potential,
    x: &mut Vec<Vec3>,
    pinned: &[Vec3],
) {
    let Some(mut guess) = guess else { return };
    potential.mechanics().keep_pins(pinned, &mut guess);
    if potential.allows(x, &guess, equilibrium::AREA_SHARE)
        && potential.energy(&guess) < potential.energy(x)
    {
        *x = guess;
    }
}
