//! The chemical half of a model: `dc/dt = D Δ_x c + R(c, signals, t)` and what c does to lengths.

mod feedback;
mod held;
mod ill_posed;
mod inputs;
mod places;
mod spectral_radius;
mod surface;

use std::sync::{Arc, OnceLock};

use smallvec::SmallVec;

use super::error::ModelError;
use super::mechanics::numbered;
use super::parameters::{ParameterFields, column};
use super::signals::Signals;
use super::unreliable_results::UnreliableResults;
use crate::effects::{
    DirectedLengthFactor, DirichletValues, Measure, Operator, TransportInputs, TransportTerm,
    WrongCoefficient,
};
use crate::kinetics::{
    Batch, Column, Descriptor, Feedback, Kinetics, KineticsError, Location, Outcome, Quantity,
    Signal, field,
};
use crate::parallel;
use crate::sheet::Sheet;
use crate::tally::{Meter, Scope, Tally};
pub use held::HeldValues;
pub use ill_posed::IllPosed;
pub use surface::Surface;
use surface::distinct_operators;

type Few<T> = SmallVec<[T; 4]>;
/// Below so many points an evaluation costs no more than the clock.
const FEW_POINTS: usize = 8;

/// Kinetics on a sheet, with the transport of its species.
pub struct Chemistry {
    kinetics: Arc<dyn Kinetics>,
    parameters: ParameterFields,
    location: Location,
    signals: Signals,
    transports: Vec<TransportTerm>,
    /// Which of the distinct operators each of them has.
    which: Arc<[usize]>,
    measure: Measure,
    direction: Option<DirectedLengthFactor>,
    held: HeldValues,
    /// Typical magnitudes of a run.
    typical: OnceLock<Vec<f64>>,
    flagged: UnreliableResults,
    tally: Tally,
    law: Meter,
    /// One for each transport.
    meters: Vec<Meter>,
}

/// The columns of the signals, in the order of the descriptor.
pub type SignalColumns = Vec<Vec<f64>>;

impl Chemistry {
    /// Puts `kinetics` on `sheet`.
    #[must_use]
    pub fn new(
        sheet: &Sheet,
        kinetics: Arc<dyn Kinetics>,
        mut parameters: ParameterFields,
        location: Location,
        signals: Signals,
        transports: Vec<TransportTerm>,
        measure: Measure,
    ) -> Self {
        parameters.carry(sheet, location, &kinetics.descriptor().capabilities);
        let which = distinct_operators(&transports);
        let (flagged, tally) = (UnreliableResults::default(), Tally::default());
        let (law, meters) = (tally.meter("law", ""), Vec::new());
        let mut made = Self {
            kinetics,
            parameters,
            location,
            signals,
            transports,
            which,
            measure,
            direction: None,
            held: HeldValues::default(),
            typical: OnceLock::new(),
            flagged,
            tally: tally.clone(),
            law,
            meters,
        };
        made.count_with(&tally);
        made
    }

    /// The same with a direction in which its length factor acts.
    #[must_use]
    pub fn with_direction(mut self, direction: Option<DirectedLengthFactor>) -> Self {
        self.direction = direction;
        self
    }

    /// The same with values of species that are held.
    #[must_use]
    pub fn with_held_values(mut self, held: &[DirichletValues]) -> Self {
        self.held = HeldValues::new(self.descriptor().species.len(), held);
        self
    }

    /// Takes the typical magnitudes of the species in a run: once, before the first step.
    pub fn set_typical(&self, typical: Vec<f64>) {
        self.kinetics.set_typical(&typical);
        self.typical.get_or_init(|| typical);
    }

    /// The typical magnitude of a species, the unit of absolute tolerances.
    #[must_use]
    pub fn typical(&self, species: usize) -> f64 {
        let of_law = || self.descriptor().species[species].magnitude();
        self.typical.get().map_or_else(of_law, |typical| typical[species])
    }

    /// Those of all species.
    #[must_use]
    pub fn all_typical(&self) -> Vec<f64> {
        (0..self.descriptor().species.len()).map(|s| self.typical(s)).collect()
    }

    /// Values of species that are held.
    #[must_use]
    pub fn held(&self) -> &HeldValues {
        &self.held
    }

    /// Counts what it costs with `tally` from now on.
    pub(super) fn count_with(&mut self, tally: &Tally) {
        let descriptor = self.kinetics.descriptor();
        self.tally = tally.clone();
        self.law = tally.meter("law", &descriptor.title());
        let name = |k: usize| descriptor.species.get(k).map_or("", |s| s.name.as_str());
        let of = |t: &TransportTerm| format!("{} of {}", t.name(), name(t.species()));
        let names: Vec<String> = self.transports.iter().map(of).collect();
        let names = numbered(names.iter().map(String::as_str));
        self.meters = names.iter().map(|name| tally.meter("effect", name)).collect();
        self.signals.count_with(tally);
    }

    /// Names of the transports: no two are the same.
    pub fn transport_names(&self) -> impl Iterator<Item = &str> {
        self.meters.iter().map(Meter::name)
    }

    /// The scope of `what` of transport number k.
    pub(super) fn transport_scope(&self, k: usize, what: &'static str) -> Option<Scope> {
        self.meters.get(k).map(|meter| meter.scope(what))
    }

    /// What the kinetics says about itself.
    #[must_use]
    pub fn descriptor(&self) -> &Descriptor {
        self.kinetics.descriptor()
    }

    /// Where parameters differ from place to place.
    #[must_use]
    pub fn parameters(&self) -> &ParameterFields {
        &self.parameters
    }

    /// Whether species are amounts per current or per rest area.
    #[must_use]
    pub fn measure(&self) -> Measure {
        self.measure
    }

    /// Where species live.
    #[must_use]
    pub fn location(&self) -> Location {
        self.location
    }

    /// The signals in use.
    #[must_use]
    pub fn signals(&self) -> &Signals {
        &self.signals
    }

    /// Whether the kinetics reads strains, which compare areas with optimal ones.
    #[must_use]
    pub(crate) fn reads_strain(&self) -> bool {
        let wanted = self.signals.wanted();
        wanted.contains(&Signal::AreaStrain) || wanted.contains(&Signal::Tension)
    }

    /// Length factor Φ at every edge, from the mean of the species at its two ends; `None` if the
    /// kinetics gives none.
    ///
    /// # Errors
    /// If the plugin fails or gives a factor that is not a positive number.
    pub fn length_factor(
        &self,
        sheet: &Sheet,
        surface: &Surface,
        species: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, KineticsError> {
        if !self.descriptor().capabilities.length_factor {
            return Ok(None);
        }
        let at_edges = self.at_edges(sheet, surface, species);
        let found = self.feedback(Feedback::LengthFactor, Location::Edge, &at_edges)?;
        let Some(mut factor) = found else { return Ok(None) };
        if let Some(direction) = &self.direction {
            let across = self.feedback(Feedback::FactorAcross, Location::Edge, &at_edges)?;
            parallel::update(&mut factor, |e, factor| {
                let across =
                    across.as_ref().map_or_else(|| direction.factor_across(*factor).0, |a| a[e]);
                *factor = direction.edge_factor(e, *factor, across).0;
            });
        }
        Ok(Some(factor))
    }

    /// ∂Φ/∂c at every edge, one column a species; `None` if the kinetics gives no length factor.
    ///
    /// # Errors
    /// As for [`Chemistry::length_factor`].
    pub fn length_factor_slopes(
        &self,
        sheet: &Sheet,
        surface: &Surface,
        species: &[Vec<f64>],
    ) -> Result<Option<Vec<Vec<f64>>>, KineticsError> {
        if !self.descriptor().capabilities.length_factor {
            return Ok(None);
        }
        let at_edges = self.at_edges(sheet, surface, species);
        let found = self.feedback_slopes(Feedback::LengthFactor, Location::Edge, &at_edges)?;
        let Some((factor, mut slopes)) = found else { return Ok(None) };
        if let Some(direction) = &self.direction {
            let across = self.feedback_slopes(Feedback::FactorAcross, Location::Edge, &at_edges)?;
            for (s, slope) in slopes.iter_mut().enumerate() {
                parallel::update(slope, |e, slope| {
                    let (value, by) = match &across {
                        Some((values, slopes)) => (values[e], slopes[s][e]),
                        None => {
                            let (value, by_factor) = direction.factor_across(factor[e]);
                            (value, by_factor * *slope)
                        }
                    };
                    let (_, [by_along, by_across]) = direction.edge_factor(e, factor[e], value);
                    *slope = by_along * *slope + by_across * by;
                });
            }
        }
        Ok(Some(slopes))
    }

    /// Length factor Φ where the species live.
    ///
    /// # Errors
    /// If the plugin fails or gives a factor that is not a positive number.
    pub fn point_length_factor(&self, species: &[Vec<f64>]) -> Result<Vec<f64>, KineticsError> {
        let found = self.feedback(Feedback::LengthFactor, self.location, species)?;
        Ok(found.unwrap_or_else(|| vec![1.0; species.first().map_or(0, Vec::len)]))
    }

    fn batch<R>(
        &self,
        location: Location,
        species: &[impl AsRef<[f64]>],
        signals: &[Vec<f64>],
        f: impl FnOnce(&dyn Kinetics, &Batch<'_>) -> R,
    ) -> R {
        let count = species.first().map_or(0, |c| c.as_ref().len());
        let species: Few<Column<'_>> = species.iter().map(|c| c.as_ref().into()).collect();
        let signals: Few<Column<'_>> = signals.iter().map(|s| column(s, count)).collect();
        let parameters = &self.parameters.columns(location, count);
        let (species, signals) = (&species, &signals);
        let batch = Batch { location, first: 0, count, species, signals, parameters };
        f(self.kinetics.as_ref(), &batch)
    }

    /// One evaluation of the law, which is counted.
    fn evaluate(
        &self,
        quantity: Quantity,
        location: Location,
        (species, signals): (&[impl AsRef<[f64]>], &[Vec<f64>]),
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let what = match (quantity, partials.is_empty()) {
            (Quantity::Rates, true) => "rates",
            (Quantity::Rates, false) => "derivatives of rates",
            (Quantity::Feedback(_), true) => "length factor",
            (Quantity::Feedback(_), false) => "derivatives of the length factor",
            (Quantity::Observables, _) => "observables",
        };
        let points = species.first().map_or(0, |c| c.as_ref().len());
        let law = &self.law;
        law.count(what);
        let brief = points <= FEW_POINTS;
        let _scope = if brief { law.sampled_scope() } else { law.uncounted_scope() };
        self.tally.count(|work| {
            (work.law_calls, work.law_sites) = (work.law_calls + 1, work.law_sites + points as u64)
        });
        self.batch(location, species, signals, |kinetics, batch| {
            field::evaluate(kinetics, quantity, batch, values, partials)
        })
    }

    /// Reaction rates R at every point, one column a species.
    ///
    /// # Errors
    /// If the plugin fails or gives a number that is not finite.
    pub fn reaction(
        &self,
        species: &[&[f64]],
        signals: &SignalColumns,
        out: &mut [&mut [f64]],
    ) -> Result<(), KineticsError> {
        let inputs = (species, self.of_law(signals));
        let outcome = self.evaluate(Quantity::Rates, self.location, inputs, out, &mut []);
        self.flagged.note(self.location, outcome)
    }

    /// Which results the law has flagged, or given wrongly, on the way; each kind is reported once.
    #[must_use]
    pub fn unreliable_results(&self) -> &UnreliableResults {
        &self.flagged
    }

    /// The observables at every point, one column each.
    ///
    /// # Errors
    /// If the plugin fails or gives a number that is not finite.
    pub fn observe(
        &self,
        species: &[&[f64]],
        signals: &SignalColumns,
    ) -> Result<Vec<Vec<f64>>, KineticsError> {
        let count = species.first().map_or(0, |c| c.len());
        // What a law leaves unwritten must not be taken for a result.
        let mut all = vec![vec![f64::NAN; count]; self.descriptor().observables.len()];
        let mut out: Vec<&mut [f64]> = all.iter_mut().map(Vec::as_mut_slice).collect();
        let inputs = (species, &signals[..]);
        self.evaluate(Quantity::Observables, self.location, inputs, &mut out, &mut [])?;
        Ok(all)
    }

    /// Hands the law's inputs at all points to `visit`.
    pub fn with_inputs<R>(
        &self,
        species: &[&[f64]],
        signals: &SignalColumns,
        visit: impl FnOnce(&dyn Kinetics, &Batch<'_>) -> R,
    ) -> R {
        self.batch(self.location, species, self.of_law(signals), visit)
    }

    /// Partial derivatives of the reaction rates, column `s · inputs + j` for rate s by input j:
    /// species, then signal columns.
    ///
    /// # Errors
    /// If the plugin fails or gives a number that is not finite.
    pub fn reaction_partials(
        &self,
        species: &[&[f64]],
        signals: &SignalColumns,
    ) -> Result<field::Columns, KineticsError> {
        let count = species.first().map_or(0, |c| c.len());
        let (n, inputs) = (species.len(), self.descriptor().inputs());
        let mut rates = field::Columns::new(n, count);
        let mut partials = field::Columns::new(n * inputs, count);
        let (values, slopes) = (&mut rates.slices_mut(), &mut partials.slices_mut());
        let inputs = (species, self.of_law(signals));
        let outcome = self.evaluate(Quantity::Rates, self.location, inputs, values, slopes);
        self.flagged.note(self.location, outcome)?;
        Ok(partials)
    }

    /// `D Δ_x c + R` of every species on `surface` at a time; `g - c` where it is held at g. Ghosts have what their owners have.
    ///
    /// # Errors
    /// If the law fails, on any rank.
    pub fn rates(
        &self,
        on: (&Sheet, f64),
        surface: &Surface,
        species: &[Vec<f64>],
        signals: &SignalColumns,
        out: &mut Vec<Vec<f64>>,
    ) -> Result<(), ModelError> {
        let (sheet, time) = on;
        out.resize_with(species.len(), Vec::new);
        for (out, c) in out.iter_mut().zip(species) {
            out.clear();
            out.resize(c.len(), 0.0);
        }
        let c: Few<&[f64]> = species.iter().map(Vec::as_slice).collect();
        let mut r: Few<&mut [f64]> = out.iter_mut().map(Vec::as_mut_slice).collect();
        let reaction = self.reaction(&c, signals, &mut r).map_err(ModelError::from);
        ModelError::agreed(sheet.reduction(), reaction)?;
        for (k, (term, operator)) in self.transports.iter().zip(surface.operators()).enumerate() {
            let _scope = self.transport_scope(k, "rates");
            let inputs = (&c[..], self.signal_values(signals));
            let added = self.add_transport(on, (term, operator), inputs, r[term.species()]);
            match term.may_fail() {
                false => added?,
                true => ModelError::agreed(sheet.reduction(), added)?,
            }
        }
        self.held.set_rates(time, &c, &mut r);
        drop(r);
        sheet.reduction().update_ghost_columns(out);
        Ok(())
    }

    /// Adds the rate of one transport to `out`.
    ///
    /// # Errors
    /// If its coefficient reads species, its factor signals or its rate the time, and is inadmissible somewhere.
    pub fn add_transport(
        &self,
        on: (&Sheet, f64),
        (term, operator): (&TransportTerm, &Operator),
        inputs: TransportInputs<'_>,
        out: &mut [f64],
    ) -> Result<(), ModelError> {
        let range = if term.has_sign() { "a number ≥ 0" } else { "a finite number" };
        term.add_rate_of(on, operator, inputs, out).map_err(|WrongCoefficient { point, value }| {
            let (key, effect, location) = (term.coefficient_key(), term.name(), self.location);
            let (species, time) = (self.descriptor().species[term.species()].name.clone(), on.1);
            match term.has_sources() && !term.has_factor() {
                true => ModelError::Rate { key, effect, species, location, point, value, time },
                false => {
                    ModelError::Coefficient { key, effect, range, species, location, point, value }
                }
            }
        })
    }

    /// The transport effects.
    #[must_use]
    pub fn transports(&self) -> &[TransportTerm] {
        &self.transports
    }
}
