//! Branches of equilibria with a steady chemistry: shape and species at rest together.
//!
//! ```text
//! u = (x, c),   g(u, λ) = ( ∂U/∂x (x; l̄(c)),  -D Δ_x c - R(c, signals(x, c)) ),   ∂g/∂u = -J
//! ```
//!
//! J is the Jacobian of the coupled system (`model/coupled`), without symmetry, factorised by LU. The bordered matrix of
//! `bordered.rs` is solved by block elimination with refinement:
//!
//! ```text
//! -J v = b,   -J w = f,   y = (g - r·w)/(d - r·v),   x = w - v y       and again for what is left of (f, g)
//! ```
//!
//! At a located fold J has lost some five digits of its last pivot, which the refinement brings back.
//!
//! Rigid motions that no pin hinders are held at the vertices of `Layout`, where they carry no force. Solutions are those
//! without a part along them, as on branches of mechanics (`equilibrium/gauge.rs`). Laws that keep a total have a family
//! of steady states at every λ: J is singular along the whole branch, and none is followed.
//!
//! Stability is that of `B du/dt = -g` with the storage B of the policy: eigenvalues μ of `J v = μ B v`, of which those
//! nearest to 0 are known (`spectrum.rs`), and where the shape has no storage the negative ones of ∂²U/∂x², all of them
//! (`stability`, `bifurcations.rs`).
//!
//! Reference: Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (SIAM 2000), section 3.6,
//! doi:10.1137/1.9780898719543.

use std::sync::Arc;

use super::metric::Metric;
use super::spectrum;
use super::system::{Equilibrium, System};
use super::{
    Block, Continuation, CriticalMode, Direction, Settings, Unknowns, UnstableDirections, check,
};
use crate::Vec3;
use crate::linear::{Factor, LinearChoice, Pattern, ShiftedJacobian, dot};
use crate::model::{Coupled, EvaluationBuffers, Layout, Model, Potential, State};
use crate::solve::equilibrium::Gauge;
use crate::solve::stability::Stability;
use crate::solve::{Control, SolveError};
use crate::tally::Tally;

/// No triangle's area may fall below this share in one correction.
const MIN_AREA_SHARE: f64 = 0.1;
/// How far a species may leave its valid range in a correction, relative to its size and typical magnitude.
const RANGE_SLACK: f64 = 0.1;
/// Refinements of a solution with a border.
const REFINEMENTS: usize = 2;

/// The steady states of a family of models.
pub struct SteadyStateSystem<F> {
    family: F,
    factor: Option<(Arc<Pattern>, Factor)>,
    coupled: Option<Coupled>,
    /// Of the last shape that a correction or a tangent began at.
    gauge: Gauge,
    /// Of the shape at given species, where the policy gives it no storage.
    stability: Option<Stability>,
    control: Control,
    tally: Tally,
}

/// A model with the time at which it is evaluated.
pub struct Member {
    model: Arc<Model>,
    time: f64,
}

impl<F, E> Continuation<SteadyStateSystem<F>>
where
    F: FnMut(f64) -> Result<(Arc<Model>, f64), E>,
    E: From<SolveError>,
{
    /// Follows the steady states of `family`, which gives the model at a value of the parameter, with the time at which it is
    /// evaluated: the same effects, fixed directions and species at every λ. Begins at the steady state of `parameter` near `start`, towards larger λ or smaller ones, as `forward` says.
    ///
    /// # Errors
    /// [`SolveError::Continuation`] if no steady state is near; effects that a branch cannot have; those of the family.
    pub fn of_species(
        mut family: F,
        (start, parameter): (Unknowns, f64),
        forward: bool,
        settings: Settings,
        control: &Control,
    ) -> Result<Self, E> {
        let (model, _) = family(parameter)?;
        check(model.mechanics())?;
        let typical: Vec<f64> =
            model.chemistry().map(|chemistry| chemistry.all_typical()).unwrap_or_default();
        let points = start.species.first().map_or(0, Vec::len);
        let metric = Metric::new(model.sheet(), settings.scales(), (&typical, points));
        let follows = model.moves() && model.mass_weights().mechanics == 0.0;
        let stability = follows.then(|| Stability::new(model.mechanics())).transpose()?;
        let system = SteadyStateSystem {
            family,
            factor: None,
            coupled: None,
            gauge: Gauge::default(),
            stability: stability.map(|stability| stability.with_control(control)),
            control: control.clone(),
            tally: model.tally().clone(),
        };
        Self::begin((system, metric), (start, parameter), forward, settings, control)
    }
}

/// The numbers of `unknowns` in the order of the coupled system.
pub(in crate::solve) fn flatten(layout: &Layout, unknowns: &Unknowns) -> Vec<f64> {
    let mut all = vec![0.0; layout.unknowns()];
    for (vertex, places) in layout.displacements().enumerate() {
        for (axis, place) in places.into_iter().enumerate() {
            if let Some(place) = place {
                all[place] = unknowns.x[vertex][axis];
            }
        }
    }
    for (s, values) in unknowns.species.iter().enumerate().take(layout.species()) {
        for (point, value) in values.iter().enumerate() {
            all[layout.concentration(s, point)] = *value;
        }
    }
    all
}

/// The reverse of [`flatten`]; 0 along fixed directions.
pub(in crate::solve) fn unflatten(layout: &Layout, all: &[f64], like: &Unknowns) -> Unknowns {
    let mut unknowns = like.zeros_like();
    for (vertex, places) in layout.displacements().enumerate() {
        unknowns.x[vertex] = Vec3::from_fn(|axis, _| places[axis].map_or(0.0, |place| all[place]));
    }
    for (s, values) in unknowns.species.iter_mut().enumerate().take(layout.species()) {
        for (point, value) in values.iter_mut().enumerate() {
            *value = all[layout.concentration(s, point)];
        }
    }
    unknowns
}

impl<F, E> SteadyStateSystem<F>
where
    F: FnMut(f64) -> Result<(Arc<Model>, f64), E>,
    E: From<SolveError>,
{
    /// Solves `-J x = b` in place.
    fn solve(&mut self, x: &mut [f64]) -> Result<(), SolveError> {
        match &mut self.factor {
            Some((_, factor)) => Ok(factor.solve(x, &self.tally)?),
            None => Ok(()),
        }
    }

    /// The eigenvalues nearest to 0 at `at`, in ascending order of [`CriticalMode::eigenvalue`].
    fn nearest(
        &mut self,
        at: &mut Equilibrium<Member>,
        count: usize,
    ) -> Result<Vec<CriticalMode>, SolveError> {
        self.factorise(at, f64::INFINITY)?;
        let Self { factor, coupled, gauge, tally, control, .. } = self;
        let (Some((_, factor)), Some(coupled)) = (factor, coupled) else { return Ok(Vec::new()) };
        let storage = spectrum::storage(coupled, &at.member.model);
        let mut solve = |x: &mut [f64]| {
            control.check()?;
            Ok(factor.solve(x, tally)?)
        };
        let found = spectrum::nearest(&storage, &mut solve, count)?;
        let layout = coupled.layout();
        let mode = |pair: spectrum::Pair| {
            let mut shape = unflatten(layout, &pair.vector, &at.at);
            gauge.project(&mut shape.x);
            spectrum::normalise(&mut shape, &at.member.model);
            let spectrum::Pair { eigenvalue, frequency, .. } = pair;
            CriticalMode { block: Block::Coupled, eigenvalue, frequency, shape }
        };
        Ok(found.into_iter().map(mode).collect())
    }

    /// What `ask` says of the stability of the shape at given species; none where the shape has storage.
    fn of_shape<T>(
        &mut self,
        at: &Equilibrium<Member>,
        ask: impl Fn(&mut Stability, &mut Potential) -> Result<T, SolveError>,
    ) -> Result<Option<T>, SolveError> {
        let Some(stability) = &mut self.stability else { return Ok(None) };
        let Member { model, time } = &at.member;
        let state = state(model, *time, &at.at);
        let mut memory = EvaluationBuffers::default();
        let mut evaluation = model.at(&state, &mut memory);
        Ok(Some(ask(stability, evaluation.potential()?)?))
    }
}

impl<F, E> System for SteadyStateSystem<F>
where
    F: FnMut(f64) -> Result<(Arc<Model>, f64), E>,
    E: From<SolveError>,
{
    type Error = E;
    type Member = Member;

    fn evaluate(&mut self, mut at: Unknowns, parameter: f64) -> Result<Equilibrium<Member>, E> {
        let (model, time) = (self.family)(parameter)?;
        let (imbalance, energy, residual) = imbalance(&model, time, &mut at)?;
        let (member, iterations) = (Member { model, time }, 0);
        Ok(Equilibrium { at, parameter, member, imbalance, energy, residual, iterations })
    }

    fn factorise(
        &mut self,
        equilibrium: &mut Equilibrium<Member>,
        tolerance: f64,
    ) -> Result<(), SolveError> {
        let Member { model, time } = &equilibrium.member;
        let state = state(model, *time, &equilibrium.at);
        if model.moves() && tolerance.is_finite() {
            let (mut memory, x) = (EvaluationBuffers::default(), &equilibrium.at.x);
            let mut evaluation = model.at(&state, &mut memory);
            let gradient = &equilibrium.imbalance.x;
            self.gauge = Gauge::new(evaluation.potential()?, x, gradient, tolerance);
        }
        let mut coupled = Coupled::at_rest(model);
        coupled.start(&state);
        let y = coupled.pack(&state);
        let jacobian = coupled.jacobian(*time, &y)?;
        let known = self.factor.take().filter(|(pattern, _)| pattern == jacobian.pattern());
        let (pattern, mut factor) = match known {
            Some(known) => known,
            None => {
                let factor = Factor::new(LinearChoice::Lu, jacobian, None)?;
                (Arc::clone(jacobian.pattern()), factor)
            }
        };
        factor.factorise(ShiftedJacobian::new(jacobian, &|_| (0.0, 1.0)), &self.tally)?;
        self.factor = Some((pattern, factor));
        self.coupled = Some(coupled);
        Ok(())
    }

    fn solve_bordered(
        &mut self,
        (column, form): (&Unknowns, &Direction),
        (f, g): (&Unknowns, f64),
    ) -> Result<Direction, SolveError> {
        let Some(layout) = self.coupled.as_ref().map(|coupled| Arc::clone(coupled.layout())) else {
            return Err(SolveError::NotFinite);
        };
        let mut form_of_shape = form.unknowns.clone();
        self.gauge.project(&mut form_of_shape.x);
        let [b, row, f_flat] = [column, &form_of_shape, f].map(|part| flatten(&layout, part));
        let d = form.parameter;
        let mut v = b.clone();
        self.solve(&mut v)?;
        let (mut x, mut y) = (vec![0.0; b.len()], 0.0);
        let (mut left, mut missing) = (f_flat.clone(), g);
        for turn in 0..=REFINEMENTS {
            if turn > 0 {
                let mut product = vec![0.0; x.len()];
                if let Some(coupled) = &self.coupled {
                    coupled.last_jacobian().multiply(&x, &mut product);
                }
                for i in 0..x.len() {
                    left[i] = f_flat[i] + product[i] - b[i] * y;
                }
                missing = g - dot(&row, &x) - d * y;
            }
            self.solve(&mut left)?;
            let more = (missing - dot(&row, &left)) / (d - dot(&row, &v));
            for i in 0..x.len() {
                x[i] += left[i] - v[i] * more;
            }
            y += more;
        }
        let mut unknowns = unflatten(&layout, &x, f);
        self.gauge.project(&mut unknowns.x);
        Ok(Direction { unknowns, parameter: y })
    }

    fn unstable_directions(
        &mut self,
        at: &mut Equilibrium<Member>,
    ) -> Result<UnstableDirections, SolveError> {
        let shape =
            self.of_shape(at, |of, potential| Ok(of.inertia(potential, &at.at.x)?.negative))?;
        let modes = self.nearest(at, spectrum::MAX_EIGENVALUES)?;
        let coupled = modes.iter().filter(|mode| mode.eigenvalue < 0.0).count();
        Ok(UnstableDirections { shape: shape.unwrap_or(0), coupled })
    }

    fn modes(
        &mut self,
        at: &mut Equilibrium<Member>,
        block: Block,
        count: usize,
    ) -> Result<Vec<CriticalMode>, SolveError> {
        if block == Block::Shape {
            let modes = |of: &mut Stability, potential: &mut Potential| {
                Ok(of.spectrum(potential, &at.at.x, count)?.modes)
            };
            let found = self.of_shape(at, modes)?.unwrap_or_default();
            let of = |mode| CriticalMode::of_shape(mode, at.at.zeros_like().species);
            return Ok(found.into_iter().map(of).collect());
        }
        let mut modes = self.nearest(at, spectrum::MAX_EIGENVALUES)?;
        modes.truncate(count);
        Ok(modes)
    }

    fn test_function(
        &mut self,
        at: &mut Equilibrium<Member>,
        mode: &CriticalMode,
    ) -> Result<Option<(f64, Unknowns)>, SolveError> {
        self.factorise(at, f64::INFINITY)?;
        let Some(coupled) = &self.coupled else { return Ok(None) };
        let layout = Arc::clone(coupled.layout());
        let form = match (mode.block, &self.stability) {
            (Block::Coupled, _) => {
                let storage = spectrum::storage(coupled, &at.member.model);
                let shape = flatten(&layout, &mode.shape);
                shape.iter().zip(storage).map(|(v, b)| b * v).collect()
            }
            (Block::Shape, Some(stability)) => {
                // A mode has no part along rigid motions: no force acts where these are held.
                let mut force = at.at.zeros_like();
                for ((f, v), mass) in force.x.iter_mut().zip(&mode.shape.x).zip(stability.mass()) {
                    *f = *mass * v;
                }
                flatten(&layout, &force)
            }
            (Block::Shape, None) => return Ok(None),
        };
        let mut null = form.clone();
        self.solve(&mut null)?;
        let value = 1.0 / dot(&form, &null);
        let mut null = unflatten(&layout, &null, &at.at);
        self.gauge.project(&mut null.x);
        spectrum::normalise(&mut null, &at.member.model);
        Ok(Some((value, null)))
    }

    fn allows(&self, at: &Equilibrium<Member>, next: &Unknowns) -> bool {
        let Member { model, time } = &at.member;
        let mut species = next.species.clone();
        if model.keep_in_range(&mut species, *time, (RANGE_SLACK, RANGE_SLACK)).is_err() {
            return false;
        }
        let here = state(model, *time, &at.at);
        let mut memory = EvaluationBuffers::default();
        let mut evaluation = model.at(&here, &mut memory);
        !model.moves()
            || evaluation.potential().is_ok_and(|potential| {
                potential.keeps_triangles(&at.at.x, &next.x, MIN_AREA_SHARE, 0.0)
            })
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }
}

/// What is out of balance at `at`: ∂U/∂x, and the rates of the species with the opposite sign; with the energy and the
/// largest force in units of the force scale. Fixed directions and values of `at` are set.
///
/// # Errors
/// A law that has no value there.
pub fn imbalance(
    model: &Model,
    time: f64,
    at: &mut Unknowns,
) -> Result<(Unknowns, f64, f64), SolveError> {
    model.mechanics().set_prescribed(time, &mut at.x);
    model.hold(time, &mut at.species);
    let state = state(model, time, at);
    let mut memory = EvaluationBuffers::default();
    let mut evaluation = model.at(&state, &mut memory);
    let mut imbalance = at.zeros_like();
    let (mut energy, mut residual) = (0.0, 0.0);
    if model.moves() {
        let potential = evaluation.potential()?;
        energy = potential.energy_gradient(&at.x, &mut imbalance.x);
        residual = potential.residual(&imbalance.x);
    }
    if model.chemistry().is_some() {
        for (out, rates) in imbalance.species.iter_mut().zip(evaluation.rates()?) {
            out.iter_mut().zip(rates).for_each(|(out, rate)| *out = -rate);
        }
    }
    Ok((imbalance, energy, residual))
}

/// The state of `at`.
fn state(model: &Model, time: f64, at: &Unknowns) -> State {
    let (x, species) = (at.x.clone().into(), at.species.clone());
    State { time, step: 0, x, species, internal: model.initial_internal() }
}
