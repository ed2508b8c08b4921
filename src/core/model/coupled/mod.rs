//! The one coupled system that every policy weighs: `M dy/dt = F(t, y)`.
//!
//! ```text
//! y = (u, c),  u = x - X at the free directions of the vertices,  c point by point
//! F = ( -∂U/∂x (x; l̄(c)),  D Δ_x c + R(c, signals(x, c), t) )
//! M = diag( w_x · drag,  w_c )
//! ```
//!
//! A policy is the two weights of M and nothing else. Fixed directions are not unknowns, and where the
//! shape has no storage neither are its rigid motions, so that its rows stay regular. Displacements take the place of positions, so that relative
//! tolerances do not depend on where the origin is.

mod jacobian;
mod layout;

pub use layout::{Layout, Subsystem};

use std::sync::Arc;

use super::{
    Evaluation, EvaluationBuffers, LinearInTime, Model, ModelError, SignalColumns, State, Surface,
};
use crate::Vec3;
use crate::linear::{Displacements, Sparse};
use crate::tally::Tally;
use jacobian::{Inputs, Jacobian};

/// Species are far out of their range by this share of their size and typical magnitude.
const OUT_OF_RANGE_SHARE: f64 = 0.1;

/// F, its derivatives and M of a [`Model`], or of a part of it.
pub struct Coupled {
    model: Arc<Model>,
    layout: Arc<Layout>,
    /// Of the displacements, and of the species.
    mass: (Vec<f64>, f64),
    state: State,
    memory: EvaluationBuffers,
    gradient: Vec<Vec3>,
    rates: Vec<Vec<f64>>,
    jacobian: Jacobian,
    course: Option<LinearInTime>,
    /// Whether time passes: held values then have rates.
    in_time: bool,
}

impl Coupled {
    /// The unknowns of `part`, weighed as the model says; species that move alone have storage.
    #[must_use]
    pub fn new(model: &Arc<Model>, part: Subsystem) -> Self {
        let still = model.mass_weights().mechanics == 0.0 && part == Subsystem::Whole;
        Self::laid_out(model, part, still)
    }

    /// All unknowns, with the rigid motions held that no pin hinders, whatever has storage: what is solved for a steady
    /// state.
    #[must_use]
    pub fn at_rest(model: &Arc<Model>) -> Self {
        Self::laid_out(model, Subsystem::Whole, true).at_fixed_time()
    }

    /// The same where time does not pass: what is solved for a steady state at a time.
    #[must_use]
    pub(crate) fn at_fixed_time(self) -> Self {
        Self { in_time: false, ..self }
    }

    /// The unknowns of `part`; rigid motions are fixed where the shape is `still`.
    fn laid_out(model: &Arc<Model>, part: Subsystem, still: bool) -> Self {
        let weights = model.mass_weights();
        let layout = Layout::new(model, part, still);
        let weight = if part == Subsystem::Chemistry { 1.0 } else { weights.chemistry };
        let mut mass = vec![0.0; layout.mechanical()];
        for (i, place) in layout.displacements().enumerate() {
            for place in place.into_iter().flatten() {
                mass[place] = weights.mechanics * model.drag().tangential(i);
            }
        }
        Self {
            model: Arc::clone(model),
            layout: Arc::new(layout),
            mass: (mass, weight),
            state: State::default(),
            memory: EvaluationBuffers::default(),
            gradient: Vec::new(),
            rates: Vec::new(),
            jacobian: Jacobian::default(),
            course: None,
            in_time: weight > 0.0,
        }
    }

    /// Lets ∂F/∂y be made for an incomplete factor alone, where it can be: before it is evaluated first.
    pub(crate) fn use_incomplete_factor(&mut self) {
        self.jacobian.in_strips = true;
    }

    /// Which unknown is what.
    #[must_use]
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// The diagonal of M; exactly 0 in rows without storage.
    pub fn mass(&self) -> impl Iterator<Item = f64> + '_ {
        let (mass, weight) = &self.mass;
        let species = self.layout.unknowns() - mass.len();
        mass.iter().copied().chain(std::iter::repeat_n(*weight, species))
    }

    /// Where work on it is counted.
    #[must_use]
    pub fn tally(&self) -> &Tally {
        self.model.tally()
    }

    /// Which unknowns are displacements, for linear solvers that treat them apart; `None` without any.
    #[must_use]
    pub fn displacements(&self) -> Option<Displacements> {
        let count = self.layout.mechanical();
        (count > 0).then(|| Displacements {
            place: self.layout.displacements().collect(),
            count,
            pattern: Arc::clone(self.model.mechanics().pattern()),
        })
    }

    /// Absolute tolerances of the unknowns: `atol` times the mean edge for displacements, times the
    /// species' typical magnitude for species.
    #[must_use]
    pub fn tolerances(&self, atol: f64) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.layout.unknowns());
        if self.layout.mechanical() > 0 {
            let edge = self.model.mechanics().reference().mean_edge();
            all.resize(self.layout.mechanical(), atol * edge);
        }
        if let Some(chemistry) = self.model.chemistry() {
            let typical: Vec<f64> = chemistry.all_typical().iter().map(|c| atol * c).collect();
            for _ in 0..self.layout.points() {
                all.extend_from_slice(&typical);
            }
        }
        all
    }

    /// The unknowns of `state`.
    #[must_use]
    pub fn pack(&self, state: &State) -> Vec<f64> {
        let mut y = vec![0.0; self.layout.unknowns()];
        self.layout.pack(self.model.sheet().rest(), state, &mut y);
        y
    }

    /// Takes from `state` what no unknown stands for: before the first residual, and whenever it changed.
    /// Where the shape is fixed, transports are evaluated here, once.
    pub fn start(&mut self, state: &State) {
        let moved = self.state.x != state.x;
        self.state.clone_from(state);
        if moved && self.layout.is_still() {
            self.model.at(state, &mut self.memory).surface();
        }
    }

    /// Lets the signals of [`Subsystem::Chemistry`] go along `course`.
    pub(crate) fn set_course(&mut self, course: LinearInTime) {
        self.course = Some(course);
    }

    /// The signals on their course, if they have one.
    fn given_signals(&self, time: f64) -> Option<SignalColumns> {
        let course = self.course.as_ref().filter(|_| self.layout.species() > 0)?;
        let mut signals = Vec::new();
        course.interpolate(time, &mut signals);
        Some(signals)
    }

    /// The state of the unknowns `y`.
    fn show(&mut self, time: f64, y: &[f64]) {
        self.layout.unpack(self.model.mechanics(), time, y, &mut self.state);
    }

    /// Writes F.
    ///
    /// # Errors
    /// If a law fails, or optimal lengths make no triangle where strains are read.
    pub fn residual(&mut self, time: f64, y: &[f64], out: &mut [f64]) -> Result<(), ModelError> {
        self.tally().count(|work| work.right_hand_sides += 1);
        self.show(time, y);
        let given = self.given_signals(time);
        let Self { model, layout, state, memory, gradient, rates, .. } = self;
        let mut at = Evaluation::new(model, state, memory, layout.is_still());
        if let (Some(signals), Some(chemistry)) = (&given, model.chemistry()) {
            chemistry.rates((model.sheet(), time), at.surface(), &state.species, signals, rates)?;
            layout.pack_species(rates, out);
        } else {
            if layout.mechanical() > 0 {
                gradient.resize(state.x.len(), Vec3::zeros());
                at.potential()?.gradient_within(&state.x, gradient);
                layout.pack_forces(gradient, out);
            }
            if layout.species() > 0 {
                layout.pack_species(at.rates()?, out);
            }
        }
        self.follow_held(time, y, out);
        Ok(())
    }

    /// Lets unknowns that are held follow values g that change in time: F becomes `w_c ∂g/∂t + g - c`.
    fn follow_held(&self, time: f64, y: &[f64], out: &mut [f64]) {
        let Some(chemistry) = self.model.chemistry().filter(|_| self.in_time) else { return };
        chemistry.held().moving(time, |s, point, value, slope| {
            let place = self.layout.concentration(s, point);
            out[place] = self.mass.1 * slope + value - y[place];
        });
    }

    /// Explains `error` by species far outside their valid range, with their places.
    #[must_use]
    pub fn blamed(&self, error: ModelError) -> ModelError {
        let (mut species, time) = (self.state.species.clone(), self.state.time);
        match self.model.keep_in_range(&mut species, time, (OUT_OF_RANGE_SHARE, OUT_OF_RANGE_SHARE))
        {
            Err(range) if error.is_recoverable() => range,
            _ => error,
        }
    }

    /// ∂F/∂y, which may be changed until it is evaluated again.
    ///
    /// Exact but for the derivatives of the Green-Gauss scheme by positions, and the second ones of
    /// mixed-Voronoi area fractions in the bending energy, which are left out.
    ///
    /// # Errors
    /// As for [`Coupled::residual`].
    pub fn jacobian(&mut self, time: f64, y: &[f64]) -> Result<&mut Sparse, ModelError> {
        self.tally().count(|work| work.jacobians += 1);
        self.show(time, y);
        let given = self.given_signals(time);
        let Self { model, layout, state, memory, jacobian, .. } = self;
        let mut at = Evaluation::new(model, state, memory, layout.is_still());
        let (nothing, silent) = (Surface::default(), SignalColumns::new());
        let inputs = match &given {
            Some(signals) => Inputs { potential: None, surface: at.surface(), signals },
            None if layout.species() == 0 => {
                let potential = Some(at.potential()?);
                Inputs { potential, surface: &nothing, signals: &silent }
            }
            None => {
                let parts = at.parts()?;
                Inputs {
                    potential: parts.potential,
                    surface: parts.surface,
                    signals: parts.signals,
                }
            }
        };
        jacobian.fill(model, layout, state, inputs)?;
        Ok(jacobian.matrix_mut())
    }

    /// ∂F/∂y as [`Coupled::jacobian`] left it; empty before.
    #[must_use]
    pub fn last_jacobian(&self) -> &Sparse {
        self.jacobian.matrix()
    }

    /// A bound on the spectral radius of ∂F/∂y of [`Subsystem::Chemistry`] at the state last started from,
    /// with the signals at these times.
    ///
    /// # Errors
    /// As for [`Coupled::residual`].
    pub fn spectral_bound(&mut self, times: &[f64]) -> Result<f64, ModelError> {
        let mut bound: f64 = 0.0;
        for &time in times {
            let Some(signals) = self.given_signals(time) else { continue };
            let Self { model, state, memory, .. } = self;
            let mut at = Evaluation::new(model, state, memory, true);
            if let Some(chemistry) = model.chemistry() {
                let species: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
                let on = (&**model.sheet(), time);
                let bounds = chemistry.spectral_bounds(on, at.surface(), &species, &signals)?;
                bound = bound.max(bounds.iter().sum());
            }
        }
        Ok(bound)
    }
}
