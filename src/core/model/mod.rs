//! What is simulated: a model, immutable, and its states.
//!
//! ```text
//! w_x · drag · dx/dt = -∂U/∂x (x; c)              mechanics
//! w_c ·        dc/dt = D Δ_x c + R(c, signals, t) chemistry
//!              dq/dt = f(q, x, t)                 internal variables of effects
//! ```
//!
//! A [`Model`] is the sheet with the effects, laws and weights w that a scene lists; a [`State`] is
//! time, positions, species and internal variables, and nothing else; an [`Evaluation`] is the model at a state. Solvers ask
//! for its pieces: energies at fixed optimal lengths ([`Potential`]), rates, or both at once with their
//! derivatives (`Coupled`).

mod chemistry;
mod constraint;
mod counters;
mod coupled;
mod drag;
mod drag_spec;
mod error;
mod error_norm;
mod evaluation;
mod hold;
mod linear_in_time;
mod mechanics;
mod parameters;
mod policy;
mod potential;
mod proximal_term;
mod rigid;
mod signals;
mod state;
mod unreliable_results;

pub use chemistry::{Chemistry, HeldValues, IllPosed, SignalColumns, Surface};
pub use coupled::{Coupled, Layout, Subsystem};
pub use drag::{Drag, Weights};
pub use drag_spec::{Coefficient, Directions, DragSpec};
pub use error::ModelError;
pub use evaluation::{Evaluation, EvaluationBuffers};
pub(crate) use hold::CorotationalForces;
pub use linear_in_time::LinearInTime;
pub use mechanics::{Mechanics, MechanicsParts};
pub use parameters::ParameterFields;
pub use policy::{MassWeights, Policy, Stabilisation, Start};
pub use potential::Potential;
pub use proximal_term::Anchor;
pub use rigid::{Motion, free_motions};
pub(crate) use rigid::{align, floats, force_free_motions, mean, minimal_pins, unhindered};
pub use signals::{AtBoundary, Signals, TensionReading};
pub use state::{Positions, State};
pub use unreliable_results::UnreliableResults;

pub use counters::constraint_meter;
pub(crate) use signals::Derivatives;

use std::borrow::Cow;
use std::sync::Arc;

use crate::effects::{InternalVariables, LengthFactor};
use crate::kinetics::Location;
use crate::sheet::Sheet;
use crate::tally::Tally;

/// A sheet with its mechanics, its chemistry if the scene has kinetics, and the weights of both.
pub struct Model {
    mechanics: Arc<Mechanics>,
    chemistry: Option<Chemistry>,
    growth: Vec<LengthFactor>,
    internal: Vec<Box<dyn InternalVariables>>,
    mass_weights: MassWeights,
    drag: Drag,
}

impl Model {
    /// Puts the pieces together; without energies the shape never moves. `drag` resists
    /// the motion of vertices.
    #[must_use]
    pub fn new(
        mechanics: Arc<Mechanics>,
        chemistry: Option<Chemistry>,
        mass_weights: MassWeights,
        drag: Drag,
    ) -> Self {
        let mut chemistry = chemistry;
        if let Some(chemistry) = &mut chemistry {
            chemistry.count_with(mechanics.tally());
        }
        let (growth, internal) = (Vec::new(), Vec::new());
        Self { mechanics, chemistry, growth, internal, mass_weights, drag }
    }

    /// The same with length factors that multiply those of the laws.
    #[must_use]
    pub fn with_growth(mut self, growth: Vec<LengthFactor>) -> Self {
        self.growth = growth;
        self
    }

    /// The same with internal variables of effects.
    #[must_use]
    pub(crate) fn with_internal_variables(
        mut self,
        internal: Vec<Box<dyn InternalVariables>>,
    ) -> Self {
        self.internal = internal;
        self
    }

    /// The internal variables of effects, in the order of [`State::internal`].
    #[must_use]
    pub fn internal(&self) -> &[Box<dyn InternalVariables>] {
        &self.internal
    }

    /// Their values on a sheet that nothing has happened to.
    #[must_use]
    pub fn initial_internal(&self) -> Vec<Vec<f64>> {
        let of = |term: &dyn InternalVariables| {
            (0..term.count(self.sheet())).map(|i| term.initial(i)).collect()
        };
        self.internal.iter().map(|term| of(&**term)).collect()
    }

    /// Those of `state` that multiply optimal lengths.
    ///
    /// # Errors
    /// [`ModelError::Internal`] for a value that is not a positive number.
    pub(crate) fn internal_factors<'a>(
        &self,
        state: &'a State,
    ) -> Result<Vec<&'a [f64]>, ModelError> {
        let mut all = Vec::new();
        let terms = self.internal.iter().zip(&state.internal);
        for (term, values) in terms.filter(|(term, _)| term.multiplies_lengths()) {
            let wrong = |value: &f64| !(*value > 0.0 && value.is_finite());
            if let Some(place) = values.iter().position(wrong) {
                return Err(ModelError::Internal {
                    name: term.name(),
                    location: term.location(),
                    place,
                    value: values[place],
                    range: "a number > 0",
                    time: state.time,
                });
            }
            all.push(values.as_slice());
        }
        Ok(all)
    }

    /// The length factor Φ at every edge of all growth that is not a law's; `None` without any.
    ///
    /// # Errors
    /// [`ModelError::Growth`] where it is not a positive number.
    pub fn growth(&self, time: f64) -> Result<Option<Cow<'_, [f64]>>, ModelError> {
        let mut all: Option<Cow<'_, [f64]>> = None;
        for (k, growth) in self.growth.iter().enumerate() {
            let _scope =
                self.tally().meter("effect", &counters::growth_meter(k)).scope("length factor");
            let factor = growth.at_edges(self.sheet(), time);
            match &mut all {
                None => all = Some(factor),
                Some(all) => {
                    let all = all.to_mut().iter_mut();
                    all.zip(factor.iter()).for_each(|(all, f)| *all *= f);
                }
            }
        }
        let wrong = |f: &f64| !(*f > 0.0 && f.is_finite());
        if let Some(factor) = &all
            && let Some(e) = factor.iter().position(wrong)
        {
            let vertices = self.sheet().edges()[e].vertices;
            return Err(ModelError::Growth { vertices, value: factor[e], time });
        }
        Ok(all)
    }

    /// What the work on it costs.
    #[must_use]
    pub fn tally(&self) -> &Tally {
        self.mechanics.tally()
    }

    /// The sheet.
    #[must_use]
    pub fn sheet(&self) -> &Arc<Sheet> {
        self.mechanics.sheet()
    }

    /// The mechanical half.
    #[must_use]
    pub fn mechanics(&self) -> &Arc<Mechanics> {
        &self.mechanics
    }

    /// The chemical half, if there is kinetics.
    #[must_use]
    pub fn chemistry(&self) -> Option<&Chemistry> {
        self.chemistry.as_ref()
    }

    /// Weights of the two rows.
    #[must_use]
    pub fn mass_weights(&self) -> MassWeights {
        self.mass_weights
    }

    /// What resists the motion of vertices.
    #[must_use]
    pub fn drag(&self) -> &Drag {
        &self.drag
    }

    /// How many values of laws and effects were not finite numbers, in rejected step attempts.
    #[must_use]
    pub fn not_finite(&self) -> u64 {
        let of_laws =
            self.chemistry.as_ref().map_or(0, |chemistry| chemistry.unreliable_results().count());
        of_laws + self.mechanics.not_finite().0
    }

    /// Whether the shape can move.
    #[must_use]
    pub fn moves(&self) -> bool {
        !self.mechanics.is_empty()
    }

    /// Whether lengths and energies say nothing: no effect has an energy, and nothing changes optimal lengths.
    #[must_use]
    pub(crate) fn is_chemistry_alone(&self) -> bool {
        let factor = |c: &Chemistry| c.descriptor().capabilities.length_factor;
        !self.moves()
            && self.growth.is_empty()
            && self.internal.is_empty()
            && !self.chemistry.as_ref().is_some_and(factor)
    }

    /// Whether the conditions of energies depend on the shape: species on faces that set lengths or spontaneous curvatures,
    /// or that energies read, are carried to vertices with weights of the current shape.
    #[must_use]
    pub(crate) fn conditions_follow_shape(&self) -> bool {
        self.chemistry.as_ref().is_some_and(|chemistry| {
            let given = chemistry.descriptor().capabilities;
            let reads = || !self.mechanics.species().is_empty();
            chemistry.location() == Location::Face
                && (given.length_factor || given.curvature || reads())
        })
    }

    /// Whether any species diffuses.
    #[must_use]
    pub(crate) fn diffuses(&self) -> bool {
        self.chemistry.as_ref().is_some_and(|chemistry| !chemistry.transports().is_empty())
    }

    /// Sets the values of species that effects hold at a time.
    pub fn hold(&self, time: f64, species: &mut [Vec<f64>]) {
        if let Some(chemistry) = &self.chemistry {
            chemistry.held().set(time, species);
        }
    }

    /// Brings values that left a species' valid range by less than the tolerance
    /// `atol·typical + rtol·max|c|` back to its edge.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] for a value further out, or none at all (NaN).
    pub(crate) fn keep_in_range(
        &self,
        values: &mut [Vec<f64>],
        time: f64,
        tolerance: (f64, f64),
    ) -> Result<(), ModelError> {
        let Some(chemistry) = &self.chemistry else { return Ok(()) };
        let reduction = self.sheet().reduction();
        let mut largest: Vec<f64> =
            values.iter().map(|c| c.iter().fold(0.0f64, |m, c| m.max(c.abs()))).collect();
        reduction.max_over_ranks(&mut largest);
        let kept = clamp(chemistry, values, &largest, time, tolerance);
        ModelError::agreed(reduction, kept)
    }
}

/// Brings `values` back into their ranges, if they are out by no more than the slack.
fn clamp(
    chemistry: &Chemistry,
    values: &mut [Vec<f64>],
    largest: &[f64],
    time: f64,
    (rtol, atol): (f64, f64),
) -> Result<(), ModelError> {
    let species = chemistry.descriptor().species.iter().enumerate();
    for (((s, species), c), largest) in species.zip(values).zip(largest) {
        let slack = atol * chemistry.typical(s) + rtol * largest;
        let (least, greatest) = (species.lower - slack, species.upper + slack);
        for (point, c) in c.iter_mut().enumerate() {
            if !(*c >= least && *c <= greatest) {
                return Err(ModelError::OutOfRange {
                    species: species.name.clone(),
                    location: chemistry.location(),
                    point,
                    value: *c,
                    range: (species.lower, species.upper),
                    time,
                });
            }
            *c = c.clamp(species.lower, species.upper);
        }
    }
    Ok(())
}
