//! Parameters of effects at the vertices that may read species and the time.
//!
//! ```text
//! value = "0.1*m*sin(t)"         a formula of the rest position x, y, z, the time t and the species of the scene
//! ```
//!
//! A formula without either, a number, regions and arrays are what they are elsewhere (`field.rs`). Species are those carried to the
//! vertices, as frozen in a relaxation as optimal lengths are. A species called x, y, z or t cannot be read: these are position and time.

use std::borrow::Cow;

use super::field::{check_distance, vertex_places};
use super::{EffectContext, EffectError, Field, FieldValues, Measure};
use crate::geometry::Conditions;
use crate::kinetics::Location;
use crate::kinetics::formula::SpeciesFormula;
use crate::num::checked::Checked;

/// A parameter at the vertices.
#[derive(Debug, Clone)]
pub enum VertexField {
    /// The same whatever the species and the time are.
    Given(FieldValues),
    /// By a formula of species or of the time.
    Formula(Box<SpeciesFormula>),
}

impl VertexField {
    /// Numbers of the species that it reads: those of [`Reads`](super::Reads).
    #[must_use]
    pub fn species(&self) -> &[usize] {
        match self {
            Self::Given(_) => &[],
            Self::Formula(formula) => formula.species(),
        }
    }

    /// Whether it reads the time: the energy then has [`Reads::time`](super::Reads::time).
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        matches!(self, Self::Formula(formula) if formula.depends_on_time())
    }

    /// Its values at the vertices.
    #[must_use]
    pub fn evaluate(&self, conditions: &Conditions<'_>) -> Cow<'_, FieldValues> {
        match self {
            Self::Given(values) => Cow::Borrowed(values),
            Self::Formula(formula) => {
                let places = vertex_places(conditions.sheet, formula.depends_on_distance());
                let values = formula.evaluate(places, conditions.time, |s| conditions.species(s));
                Cow::Owned(FieldValues::Each(values))
            }
        }
    }

    /// Its derivatives at the vertices by each of the species that it reads.
    #[must_use]
    pub fn slopes(&self, conditions: &Conditions<'_>) -> Vec<Vec<f64>> {
        match self {
            Self::Given(_) => Vec::new(),
            Self::Formula(formula) => {
                let places = vertex_places(conditions.sheet, formula.depends_on_distance());
                formula.slopes(places, conditions.time, |s| conditions.species(s))
            }
        }
    }
}

impl EffectContext<'_> {
    /// The values of a field at the vertices, whose formula may read species and the time; `key` is to blame. Ranges of N hold where no
    /// species are read.
    ///
    /// # Errors
    /// As for [`Field::on`]; a formula with a name that is neither position, time nor a species.
    pub fn vertex_field<N: Checked>(
        &self,
        field: &Field<N>,
        key: &'static str,
    ) -> Result<VertexField, EffectError> {
        match self.species_formula(field, key, true)? {
            Some(formula) => Ok(VertexField::Formula(Box::new(formula))),
            None => self.values(field, Location::Vertex, key).map(VertexField::Given),
        }
    }

    /// The formula of a field that reads species or, where it may be `timed`, the time; `key` is to blame.
    ///
    /// # Errors
    /// A formula with a name that is neither position, nor the time that it may read, nor a species.
    fn species_formula<N>(
        &self,
        field: &Field<N>,
        key: &'static str,
        timed: bool,
    ) -> Result<Option<SpeciesFormula>, EffectError> {
        let Field::Formula(text) = field else { return Ok(None) };
        let species = self.kinetics.map_or(&[][..], |(law, _)| &law.species);
        let species: Vec<&str> = species.iter().map(|s| s.name.as_str()).collect();
        let formula = SpeciesFormula::new(text, &species, timed).and_then(|formula| {
            check_distance(self.sheet, text, formula.depends_on_distance()).map(|()| formula)
        });
        let formula = formula.map_err(|e| EffectError { key, message: e.message, help: e.help })?;
        let reads = !formula.species().is_empty() || formula.depends_on_time();
        Ok(reads.then_some(formula))
    }

    /// The formula of a coefficient at the vertices that reads species; `None` of one that is constant in time.
    ///
    /// # Errors
    /// As for [`EffectContext::species_formula`]; a coefficient that reads the time, or of amounts, or of species on faces.
    pub(super) fn coefficient_of_species<N>(
        &self,
        field: &Field<N>,
        location: Location,
    ) -> Result<Option<SpeciesFormula>, EffectError> {
        let key = "coefficient";
        let Some(formula) = self.species_formula(field, key, false)? else { return Ok(None) };
        let refuse = |message: &str, help: &str| {
            Err(EffectError { key, message: message.into(), help: Some(help.into()) })
        };
        if location != Location::Vertex {
            return refuse(
                "a coefficient that reads species is for species on vertices",
                "use kinetics.location = \"vertex\"",
            );
        }
        if self.measure == Measure::Amount {
            return refuse(
                "a coefficient that reads species is for concentrations",
                "use kinetics.measure = \"concentration\"",
            );
        }
        Ok(Some(formula))
    }
}
