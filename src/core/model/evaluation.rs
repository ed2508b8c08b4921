//! A model at a state.
//!
//! Everything is computed once, when it is first asked for, and is gone with the evaluation: no value of
//! one state can be taken for that of another. What outlives it is memory.

use std::borrow::Cow;
use std::sync::Arc;

use super::Model;
use super::chemistry::{Chemistry, SignalColumns, Surface};
use super::error::ModelError;
use super::parameters::at_vertices;
use super::potential::Potential;
use super::signals::Signals;
use super::state::State;
use crate::Vec3;
use crate::effects::{InternalVariables, SPONTANEOUS_CURVATURE};
use crate::num::{real, whole};
use crate::sheet::SheetError;

/// Memory of evaluations, one after the other. Its values are those of the last one, and nothing reads
/// them.
#[derive(Default)]
pub struct EvaluationBuffers {
    potential: Option<Potential>,
    surface: Surface,
    signals: SignalColumns,
    rates: Vec<Vec<f64>>,
}

/// What has been computed.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    average: bool,
    transport: bool,
    potential: bool,
    signals: bool,
    rates: bool,
}

/// A model at a state: optimal lengths, energies, signals and rates, each computed once.
pub struct Evaluation<'a> {
    model: &'a Model,
    state: &'a State,
    memory: &'a mut EvaluationBuffers,
    known: Known,
}

/// All that the derivatives of the rates need.
pub(super) struct Parts<'a> {
    /// None where no rate depends on it.
    pub potential: Option<&'a mut Potential>,
    pub surface: &'a Surface,
    pub signals: &'a SignalColumns,
}

impl Model {
    /// The model at `state`.
    pub fn at<'a>(&'a self, state: &'a State, memory: &'a mut EvaluationBuffers) -> Evaluation<'a> {
        Evaluation::new(self, state, memory, false)
    }
}

impl<'a> Evaluation<'a> {
    /// With `same_shape` the shape is that of the last evaluation in `memory`, surface included.
    pub(super) fn new(
        model: &'a Model,
        state: &'a State,
        memory: &'a mut EvaluationBuffers,
        same_shape: bool,
    ) -> Self {
        let known = Known { average: same_shape, transport: same_shape, ..Known::default() };
        Self { model, state, memory, known }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// The state.
    #[must_use]
    pub fn state(&self) -> &'a State {
        self.state
    }

    fn average(&mut self, chemistry: &Chemistry) -> &Surface {
        if !self.known.average {
            chemistry.average(self.model.sheet(), &self.state.x, &mut self.memory.surface);
            self.known.average = true;
        }
        &self.memory.surface
    }

    /// The transports, and the average over faces if species live there.
    pub fn surface(&mut self) -> &Surface {
        if let Some(chemistry) = self.model.chemistry() {
            self.average(chemistry);
            if !self.known.transport {
                chemistry.transport(self.model.sheet(), &self.state.x, &mut self.memory.surface);
                self.known.transport = true;
            }
        }
        &self.memory.surface
    }

    /// The energies under the optimal lengths of the species.
    ///
    /// # Errors
    /// If a law fails, or reads strains where optimal lengths make no triangle.
    pub fn potential(&mut self) -> Result<&mut Potential, ModelError> {
        let mechanics = self.model.mechanics();
        if !self.known.potential {
            let factor = self.length_factor()?;
            let curvature = self.curvature()?;
            let reduction = self.model.sheet().reduction();
            let fits = |p: &Potential| Arc::ptr_eq(p.mechanics(), mechanics);
            if !self.memory.potential.as_ref().is_some_and(fits) {
                self.memory.potential = Some(Potential::new(mechanics));
            }
            self.set_species();
            let set = self.set_conditions(factor.as_deref(), curvature.as_ref());
            ModelError::agreed(reduction, set)?;
            if let Some(potential) = &mut self.memory.potential {
                potential.balance(&self.state.x, false);
            }
            self.known.potential = true;
        }
        Ok(self.memory.potential.get_or_insert_with(|| Potential::new(mechanics)))
    }

    /// Carries the species that energies read to the vertices.
    fn set_species(&mut self) {
        let Some(chemistry) = self.model.chemistry() else { return };
        let read = self.model.mechanics().species();
        if read.is_empty() {
            return;
        }
        self.average(chemistry);
        let (sheet, species) = (self.model.sheet(), &self.state.species);
        let EvaluationBuffers { potential, surface, .. } = &mut *self.memory;
        let Some(potential) = potential else { return };
        for &s in read {
            let values = at_vertices(sheet, surface.average.as_ref(), &species[s]);
            potential.set_species(s, values);
        }
    }

    fn set_conditions(
        &mut self,
        factor: Option<&[f64]>,
        curvature: Option<&Vec<f64>>,
    ) -> Result<(), ModelError> {
        let Some(potential) = &mut self.memory.potential else { return Ok(()) };
        let (terms, values) = (self.model.internal(), &self.state.internal);
        if !terms.is_empty() || curvature.is_some() {
            let internal = terms.iter().map(|term| term.name()).zip(values);
            let curvature = curvature.map(|values| (SPONTANEOUS_CURVATURE, values));
            potential.set_fields(internal.chain(curvature));
        }
        potential.set_conditions(factor, self.state.time);
        potential.set_anchor(None);
        potential.set_hold(None);
        let strained = self.model.chemistry().is_some_and(Chemistry::reads_strain);
        if factor.is_some()
            && strained
            && let Some(t) = potential.metric().impossible_triangle()
        {
            let message = potential.metric().describe_impossible(self.model.sheet(), t);
            return Err(SheetError::Unusable(message).into());
        }
        Ok(())
    }

    /// Length factor Φ at every edge; `None` if nothing changes lengths.
    ///
    /// # Errors
    /// A law that fails, or gives one that is not positive.
    pub fn length_factor(&mut self) -> Result<Option<Cow<'a, [f64]>>, ModelError> {
        let mut all = self.grown()?;
        for values in self.model.internal_factors(self.state)? {
            match &mut all {
                None => all = Some(Cow::Borrowed(values)),
                Some(all) => {
                    let all = all.to_mut().iter_mut();
                    all.zip(values).for_each(|(all, factor)| *all *= factor);
                }
            }
        }
        Ok(all)
    }

    /// Spontaneous curvature C₀ that the law gives every vertex, 1/length; `None` if it gives none.
    ///
    /// # Errors
    /// A law that fails, or gives one that is not finite.
    pub fn curvature(&mut self) -> Result<Option<Vec<f64>>, ModelError> {
        let Some(chemistry) = self.model.chemistry() else { return Ok(None) };
        if !chemistry.descriptor().capabilities.curvature {
            return Ok(None);
        }
        let (sheet, species) = (self.model.sheet(), &self.state.species);
        let curvature = chemistry.curvature(sheet, self.average(chemistry), species);
        ModelError::agreed(sheet.reduction(), curvature.map_err(ModelError::from))
    }

    /// The same of growth and laws alone.
    fn grown(&mut self) -> Result<Option<Cow<'a, [f64]>>, ModelError> {
        let grown = self.model.growth(self.state.time)?;
        let Some(chemistry) = self.model.chemistry() else { return Ok(grown) };
        if !chemistry.descriptor().capabilities.length_factor {
            return Ok(grown);
        }
        let (sheet, species) = (self.model.sheet(), &self.state.species);
        let factor = chemistry.length_factor(sheet, self.average(chemistry), species);
        let mut factor = ModelError::agreed(sheet.reduction(), factor.map_err(ModelError::from))?;
        if let (Some(factor), Some(grown)) = (&mut factor, grown) {
            factor.iter_mut().zip(grown.iter()).for_each(|(factor, grown)| *factor *= grown);
        }
        Ok(factor.map(Cow::Owned))
    }

    /// The signals that the laws read; none without kinetics.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn signals(&mut self) -> Result<&SignalColumns, ModelError> {
        if !self.known.signals {
            let mut columns = std::mem::take(&mut self.memory.signals);
            match self.model.chemistry() {
                None => columns.clear(),
                // No shape is needed for what is not read.
                Some(chemistry) if chemistry.signals().wanted().is_empty() => columns.clear(),
                Some(chemistry) => {
                    let state = self.state;
                    let signals = chemistry.signals();
                    signals.update(self.potential()?, (&state.x, state.time), &mut columns);
                }
            }
            self.memory.signals = columns;
            self.known.signals = true;
        }
        Ok(&self.memory.signals)
    }

    /// `D Δc + R` of every species.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn rates(&mut self) -> Result<&[Vec<f64>], ModelError> {
        if !self.known.rates {
            self.signals()?;
            self.surface();
            let EvaluationBuffers { surface, signals, rates, .. } = &mut *self.memory;
            match self.model.chemistry() {
                None => rates.clear(),
                Some(chemistry) => {
                    let on = (&**self.model.sheet(), self.state.time);
                    chemistry.rates(on, surface, &self.state.species, signals, rates)?;
                }
            }
            self.known.rates = true;
        }
        Ok(&self.memory.rates)
    }

    /// Rates of the internal variables of effects; none without.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn internal_rates(&mut self) -> Result<Vec<Vec<f64>>, ModelError> {
        let (model, state) = (self.model, self.state);
        if model.internal().is_empty() {
            return Ok(Vec::new());
        }
        let shape = self.potential()?.shape(&state.x);
        let of = |term: &dyn InternalVariables, values: &Vec<f64>| {
            let _scope = model.tally().meter("effect", term.name()).scope("rates");
            let mut rates = vec![0.0; values.len()];
            term.rates(&shape, values, &mut rates);
            rates
        };
        let terms = model.internal().iter().zip(&state.internal);
        Ok(terms.map(|(term, values)| of(&**term, values)).collect())
    }

    /// What derivatives of the rates are made of.
    pub(super) fn parts(&mut self) -> Result<Parts<'_>, ModelError> {
        self.signals()?;
        self.surface();
        if !self.model.is_chemistry_alone() {
            self.potential()?;
        }
        let known = self.known.potential;
        let EvaluationBuffers { potential, surface, signals, .. } = &mut *self.memory;
        let potential = potential.as_mut().filter(|_| known);
        Ok(Parts { potential, surface, signals })
    }

    /// The species carried to the vertices (as they are, if they live there).
    pub fn species_at_vertices(&mut self) -> Vec<Vec<f64>> {
        self.at_vertices(&self.state.species)
    }

    /// Values where species live, carried to the vertices.
    pub fn at_vertices(&mut self, values: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let Some(chemistry) = self.model.chemistry() else { return Vec::new() };
        let sheet = self.model.sheet();
        chemistry.at_vertices(sheet, self.average(chemistry), values)
    }

    /// Energy of every effect, by [`super::Mechanics::names`].
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn energies(&mut self) -> Result<Vec<f64>, ModelError> {
        if self.model.is_chemistry_alone() {
            return Ok(Vec::new());
        }
        let x = &self.state.x;
        Ok(self.potential()?.energies(x))
    }

    /// How many triangles have optimal lengths that violate the triangle inequality.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn impossible_triangles(&mut self) -> Result<usize, ModelError> {
        // Those of the rest shape do not.
        if self.model.is_chemistry_alone() {
            return Ok(0);
        }
        let here = real(self.potential()?.metric().impossible_triangles());
        let mut all = [here];
        self.model.sheet().reduction().sum_over_ranks(&mut all);
        Ok(whole(all[0]))
    }

    /// The values at this shape of signals other than those that the laws read.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn values_of(&mut self, signals: &Signals) -> Result<SignalColumns, ModelError> {
        if signals.wanted().is_empty() {
            return Ok(SignalColumns::new());
        }
        let state = self.state;
        Ok(signals.evaluate(self.potential()?, &state.x, state.time))
    }

    /// Gradient of the total energy with the fixed directions set to zero.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn gradient(&mut self) -> Result<Vec<Vec3>, ModelError> {
        let x = &self.state.x;
        let mut gradient = vec![Vec3::zeros(); x.len()];
        self.potential()?.energy_gradient(x, &mut gradient);
        Ok(gradient)
    }

    /// Largest force on a vertex, in units of the force scale; 0 where nothing moves.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn residual(&mut self) -> Result<f64, ModelError> {
        if !self.model.moves() {
            return Ok(0.0);
        }
        let gradient = self.gradient()?;
        Ok(self.potential()?.residual(&gradient))
    }

    /// Bounds on the fastest rates at which disturbances of the species decay or grow, 1/time: by reaction and by
    /// diffusion ([`Chemistry::spectral_bounds`]); `None` without kinetics.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn spectral_bounds(&mut self) -> Result<Option<[f64; 2]>, ModelError> {
        let Some(chemistry) = self.model.chemistry() else { return Ok(None) };
        let species: Vec<&[f64]> = self.state.species.iter().map(Vec::as_slice).collect();
        self.signals()?;
        self.surface();
        let EvaluationBuffers { surface, signals, .. } = &*self.memory;
        let on = (&**self.model.sheet(), self.state.time);
        Ok(Some(chemistry.spectral_bounds(on, surface, &species, signals)?))
    }

    /// Largest `|dc/dt|` over all points, and `|dq/dt|` of internal variables, in units of each one's typical magnitude,
    /// 1/time.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn fastest_rate(&mut self) -> Result<f64, ModelError> {
        let reduction = self.model.sheet().reduction();
        let mut largest: f64 = 0.0;
        for (term, rate) in self.model.internal().iter().zip(self.internal_rates()?) {
            largest = largest.max(reduction.max(rate.len(), |i| rate[i].abs()) / term.typical());
        }
        let Some(chemistry) = self.model.chemistry() else { return Ok(largest) };
        let rates = self.rates()?;
        for (s, rate) in rates.iter().enumerate() {
            let fastest = reduction.max(rate.len(), |i| rate[i].abs());
            largest = largest.max(fastest / chemistry.typical(s));
        }
        let mut held: f64 = 0.0;
        chemistry.held().moving(self.state.time, |s, _, _, slope| {
            held = held.max(slope.abs() / chemistry.typical(s));
        });
        Ok(largest.max(reduction.max(1, |_| held)))
    }

    /// Largest speed of a vertex under drag, in mean edges per unit of time; 0 where the shape has no storage.
    ///
    /// # Errors
    /// As for [`Evaluation::potential`].
    pub fn fastest_motion(&mut self) -> Result<f64, ModelError> {
        let (model, weight) = (self.model, self.model.mass_weights().mechanics);
        if weight == 0.0 || !model.moves() {
            return Ok(0.0);
        }
        let gradient = self.gradient()?;
        let speed = |i: usize| gradient[i].norm() / (weight * model.drag().tangential(i));
        Ok(model.sheet().reduction().max(gradient.len(), speed)
            / model.mechanics().reference().mean_edge())
    }
}
