//! Sensitivities of equilibria and of steady states, by the adjoint of the implicit function theorem.
//!
//! ```text
//! g(u, p) = 0        u = x,      g = ∂U/∂x                  at given species
//!                    u = (x, c), g = (∂U/∂x, -dc/dt)        where the chemistry is steady too
//! dJ/dp = ∂J/∂p + λ·∂g/∂p,      (∂g/∂u)ᵀ λ = -∂J/∂u
//! ```
//!
//! One solution with the transposed derivative gives the gradient of J(u, p) by any number of parameters. Of rigid motions
//! that nothing hinders equilibria say nothing: λ has no part along them, as if they were held.
//! Source: Giles & Pierce, Flow, Turbulence and Combustion 65 (2000) 393, doi:10.1023/A:1011430410075.
//! Not covered: constraints, whose multipliers are unknowns too; internal variables. Species that evolve in time: `replay`.

use std::sync::Arc;

use super::continuation::{Unknowns, flatten, unflatten};
use super::equilibrium::Gauge;
use super::stability::Stability;
use super::{Control, Result, SolveError};
use crate::Vec3;
use crate::effects::ParameterField;
use crate::linear::{ShiftedJacobian, SparseLu};
use crate::model::{Coupled, EvaluationBuffers, Model, State, free_motions};
use crate::parallel;

/// Newton's steps that take away what the tolerances of a run leave out of balance.
const MAX_CORRECTIONS: usize = 10;
/// A correction that leaves more than this share of the imbalance has come to round-off.
const LEAST_GAIN: f64 = 0.5;
/// Largest distance, in mean edges, and largest change of a species, in units of its size and typical magnitude, to the point
/// where g is 0: what is further away is at rest for no run.
const FARTHEST: f64 = 0.25;

/// Derivatives along a rigid motion below this share of all are round-off.
const INVARIANT: f64 = 1e-9;

/// A state of a model, and which of its unknowns are u.
pub struct Point {
    /// The model.
    pub model: Arc<Model>,
    /// The state.
    pub state: State,
    /// Whether species are steady, rather than given.
    pub steady_species: bool,
}

/// A point where g is 0, with ∂g/∂u there.
pub struct SteadyPoint {
    point: Point,
    factor: Factor,
    /// Modes of negative curvature of the shape; unknown of a coupled system.
    unstable: Option<usize>,
}

/// ∂g/∂u.
enum Factor {
    /// Of the shape alone, where it is symmetric.
    Shape(Box<Stability>),
    /// Of shape and species, with the rigid motions of the shape.
    Coupled(Box<(Coupled, SparseLu)>, Gauge),
}

impl Point {
    /// The state for another `model` of the same unknowns: with its fixed directions and held values, and with `species` where
    /// these are given.
    #[must_use]
    pub fn state_of(&self, model: &Model, species: &[Vec<f64>]) -> State {
        let mut state = self.state.clone();
        let mut x = state.x.to_vec();
        model.mechanics().set_prescribed(state.time, &mut x);
        state.x = x.into();
        if !self.steady_species {
            state.species.clone_from_slice(species);
        }
        model.hold(state.time, &mut state.species);
        state
    }

    /// g of `model`, one of the same unknowns, at `state`.
    ///
    /// # Errors
    /// Laws that fail.
    pub fn imbalance(&self, model: &Model, state: &State) -> Result<Unknowns> {
        let mut memory = EvaluationBuffers::default();
        let mut at = model.at(state, &mut memory);
        let zeros = |values: &Vec<f64>| vec![0.0; values.len()];
        let species = state.species.iter().map(zeros).collect();
        let mut imbalance = Unknowns { x: vec![Vec3::zeros(); state.x.len()], species };
        if model.moves() {
            at.potential()?.energy_gradient(&state.x, &mut imbalance.x);
        }
        if self.steady_species {
            for (out, rates) in imbalance.species.iter_mut().zip(at.rates()?) {
                out.iter_mut().zip(rates).for_each(|(out, rate)| *out = -rate);
            }
        }
        Ok(imbalance)
    }

    /// The optimal length l̄ of every edge in `model`, one of the same unknowns, at `state`.
    ///
    /// # Errors
    /// Laws that fail.
    pub fn optimal_lengths(&self, model: &Model, state: &State) -> Result<Vec<f64>> {
        let mut memory = EvaluationBuffers::default();
        let mut lengths = model.mechanics().reference().length().to_vec();
        if let Some(factor) = model.at(state, &mut memory).length_factor()? {
            lengths.iter_mut().zip(factor.iter()).for_each(|(length, factor)| *length *= factor);
        }
        Ok(lengths)
    }

    /// All `λ_i·∂²U/∂x_i∂l̄_e` that can be different from zero, with vertex i and edge e: a pair may come more than once, and then
    /// counts as the sum.
    ///
    /// # Errors
    /// Laws that fail.
    pub fn by_optimal_lengths(&self, adjoint: &[Vec3]) -> Result<Vec<(usize, usize, f64)>> {
        let mut memory = EvaluationBuffers::default();
        let mut at = self.model.at(&self.state, &mut memory);
        let mut all = Vec::new();
        at.potential()?.mixed_derivatives(
            &self.state.x,
            ParameterField::OptimalLength,
            &mut |i, e, by| all.push((i, e, adjoint[i].dot(&by))),
        );
        Ok(all)
    }
}

impl SteadyPoint {
    /// The equilibrium at `state` or, with `species`, the steady state of shape and chemistry there. What forces below
    /// `tolerance`, in units of the force scale, and the rates of a run have left is taken away by Newton's method.
    ///
    /// # Errors
    /// [`SolveError::NotDifferentiable`] where the model has unknowns besides these, or nothing is at rest near `state`; a
    /// derivative that is singular; laws that fail.
    pub fn new(
        model: Arc<Model>,
        state: &State,
        (species, tolerance): (bool, f64),
        control: &Control,
    ) -> Result<Self> {
        check(&model)?;
        let mut state = state.clone();
        let mut x = state.x.to_vec();
        model.mechanics().set_prescribed(state.time, &mut x);
        state.x = x.into();
        let factor = if species {
            let mut coupled = Coupled::at_rest(&model);
            coupled.start(&state);
            let y = coupled.pack(&state);
            let lu = SparseLu::new(coupled.jacobian(state.time, &y)?)?;
            Factor::Coupled(Box::new((coupled, lu)), Gauge::default())
        } else {
            let stability = Stability::new(model.mechanics())?;
            Factor::Shape(Box::new(stability.with_control(control)))
        };
        let point = Point { model, state, steady_species: species };
        let mut made = Self { point, factor, unstable: None };
        made.correct(tolerance, control)?;
        Ok(made)
    }

    /// The point.
    #[must_use]
    pub fn point(&self) -> &Point {
        &self.point
    }

    /// Number of directions in which the energy of the shape falls, if that is known: a run does not stay at a saddle.
    #[must_use]
    pub fn negative_modes(&self) -> Option<usize> {
        self.unstable
    }

    /// λ, with `slope` = ∂J/∂u; 0 along fixed directions and for given species.
    ///
    /// # Errors
    /// A derivative that is singular.
    pub fn adjoint(&mut self, slope: &Unknowns) -> Result<Unknowns> {
        let mut adjoint = slope.clone();
        adjoint.scale(-1.0);
        self.solve(&mut adjoint, true)?;
        Ok(adjoint)
    }

    /// Newton's method for g = 0.
    fn correct(&mut self, tolerance: f64, control: &Control) -> Result<()> {
        let edge = self.point.model.mechanics().reference().mean_edge();
        let mut left = self.point.imbalance(&self.point.model, &self.point.state)?;
        let unit = self.sizes(&left);
        let mut size = f64::INFINITY;
        for _ in 0..MAX_CORRECTIONS {
            control.check()?;
            self.factorise(&left.x, tolerance)?;
            let mut step = left.clone();
            step.scale(-1.0);
            self.solve(&mut step, false)?;
            self.check_near(&step, edge)?;
            let mut next = self.point.state.clone();
            let x: Vec<Vec3> = next.x.iter().zip(&step.x).map(|(x, d)| x + d).collect();
            next.x = x.into();
            for (values, steps) in next.species.iter_mut().zip(&step.species) {
                values.iter_mut().zip(steps).for_each(|(value, step)| *value += step);
            }
            let before = std::mem::replace(&mut self.point.state, next);
            let after = self.point.imbalance(&self.point.model, &self.point.state)?;
            let share = |(a, unit): (f64, f64)| if unit > 0.0 { a / unit } else { 0.0 };
            let found = self.sizes(&after).into_iter().zip(unit).map(share).fold(0.0, f64::max);
            if !(found < LEAST_GAIN * size) {
                self.point.state = before;
                return Ok(());
            }
            (left, size) = (after, found);
        }
        self.factorise(&left.x, tolerance)
    }

    /// The largest force, and the largest rate relative to the typical magnitude of its species.
    fn sizes(&self, of: &Unknowns) -> [f64; 2] {
        let reduction = self.point.model.sheet().reduction();
        let mut rate = 0.0f64;
        for (values, typical) in of.species.iter().zip(typical(&self.point.model)) {
            rate = values.iter().fold(rate, |rate, value| rate.max(value.abs() / typical));
        }
        [reduction.largest(&of.x), rate]
    }

    /// Refuses a point that is far away.
    fn check_near(&self, step: &Unknowns, edge: f64) -> Result<()> {
        let species =
            self.point.state.species.iter().zip(&step.species).zip(typical(&self.point.model));
        for ((values, steps), typical) in species {
            let far = |(c, d): (&f64, &f64)| d.abs() / (c.abs() + typical);
            let changed = values.iter().zip(steps).map(far).fold(0.0, f64::max);
            if !(changed <= FARTHEST) {
                return Err(not_differentiable(format!(
                    "the nearest steady state of the chemistry is a change by {changed:.1e} of its size away: the species \
                     still change there"
                )));
            }
        }
        let reduction = self.point.model.sheet().reduction();
        let moved = reduction.largest(&step.x) / edge;
        if !(moved <= FARTHEST) {
            return Err(not_differentiable(format!(
                "the nearest equilibrium is {moved:.1e} mean edges away: the shape does not rest there, or is about to lose its \
                 stability"
            )));
        }
        Ok(())
    }

    /// Takes over ∂g/∂u at the state, where the gradient of the energy is `gradient`.
    fn factorise(&mut self, gradient: &[Vec3], tolerance: f64) -> Result<()> {
        let Self { point: Point { model, state, .. }, factor, .. } = self;
        let Factor::Coupled(solver, gauge) = factor else { return Ok(()) };
        let (coupled, lu) = &mut **solver;
        if model.moves() {
            let mut memory = EvaluationBuffers::default();
            let mut at = model.at(state, &mut memory);
            *gauge = Gauge::new(at.potential()?, &state.x, gradient, tolerance);
        }
        coupled.start(state);
        let y = coupled.pack(state);
        let jacobian = coupled.jacobian(state.time, &y)?;
        model.tally().count(|work| work.factorisations += 1);
        Ok(lu.factorise(ShiftedJacobian::new(jacobian, &|_| (0.0, 1.0)))?)
    }

    /// Solves with ∂g/∂u, or its transpose, in place.
    fn solve(&mut self, right: &mut Unknowns, transposed: bool) -> Result<()> {
        let Self { point: Point { model, state, .. }, factor, unstable } = self;
        match factor {
            Factor::Shape(stability) => {
                let mut memory = EvaluationBuffers::default();
                let mut at = model.at(state, &mut memory);
                let potential = at.potential()?;
                let pins = potential.pins().clone();
                let free = |i: usize, v: &mut Vec3| {
                    (0..3).for_each(|a| v[a] *= f64::from(!pins[i][a]));
                };
                parallel::update(&mut right.x, free);
                let inertia = stability.solve(potential, &state.x, &mut right.x)?;
                *unstable = Some(inertia.negative);
                parallel::update(&mut right.x, free);
                right.species.iter_mut().for_each(|values| values.fill(0.0));
            }
            Factor::Coupled(solver, gauge) => {
                let (coupled, lu) = &mut **solver;
                gauge.project(&mut right.x);
                let mut flat = flatten(coupled.layout(), right);
                match transposed {
                    true => lu.solve_transposed(&mut flat)?,
                    false => lu.solve(&mut flat)?,
                }
                *right = unflatten(coupled.layout(), &flat, right);
                gauge.project(&mut right.x);
            }
        }
        Ok(())
    }
}

/// Whether a measure with these derivatives by the positions changes with rigid motions that nothing hinders.
#[must_use]
pub fn changes_with_rigid_motions(model: &Model, x: &[Vec3], slope: &[Vec3]) -> bool {
    let reduction = model.sheet().reduction();
    let (motions, _) = free_motions(x, model.mechanics().pins(), reduction, |_| 1.0);
    let size = reduction.dot(slope, slope).sqrt();
    motions.iter().any(|motion| reduction.dot(&motion.shape, slope).abs() > INVARIANT * size)
}

/// Refuses what a point has unknowns for besides shape and species.
pub(super) fn check(model: &Model) -> Result<()> {
    let mechanics = model.mechanics();
    if let Some(name) = mechanics.constraint_names().next() {
        let why =
            format!("{name} is a constraint, whose multiplier is an unknown that is not covered");
        return Err(not_differentiable(why));
    }
    if !model.initial_internal().is_empty() {
        let why = "internal variables (of growth, remodelling or plasticity) depend on all that was before";
        return Err(not_differentiable(why.to_owned()));
    }
    Ok(())
}

pub(super) fn not_differentiable(why: String) -> SolveError {
    SolveError::NotDifferentiable { why }
}

/// The typical magnitude of every species.
fn typical(model: &Model) -> Vec<f64> {
    model.chemistry().map(|chemistry| chemistry.all_typical()).unwrap_or_default()
}
