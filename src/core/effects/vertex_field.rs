//! Parameters of effects at the vertices that may read species and the time.
//!
//! ```text
//! value = "0.1*m*sin(t)"         a formula of the rest position x, y, z, the time t and the species of the scene
//! ```
//!
//! A formula without either, a number, regions and arrays are what they are elsewhere (`field.rs`). Species are those carried to the
//! vertices, as frozen in a relaxation as optimal lengths are. A species called x, y, z or t cannot be read: these are position and time.

use std::borrow::Cow;

use super::{EffectContext, EffectError, Field, Values};
use crate::geometry::Conditions;
use crate::kinetics::Location;
use crate::kinetics::formula::SpeciesFormula;
use crate::num::checked::Checked;

/// A parameter at the vertices.
#[derive(Debug, Clone)]
pub enum VertexField {
    /// The same whatever the species and the time are.
    Given(Values),
    /// By a formula of species or of the time.
    Formula(Box<SpeciesFormula>),
}

impl VertexField {
    /// Numbers of the species that it reads: what [`Energy::species`](super::Energy::species) says.
    #[must_use]
    pub fn species(&self) -> &[usize] {
        match self {
            Self::Given(_) => &[],
            Self::Formula(formula) => formula.species(),
        }
    }

    /// Whether it reads the time: the energy then [depends on it](super::Energy::depends_on_time).
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        matches!(self, Self::Formula(formula) if formula.depends_on_time())
    }

    /// Its values at the vertices.
    #[must_use]
    pub fn at(&self, conditions: &Conditions<'_>) -> Cow<'_, Values> {
        match self {
            Self::Given(values) => Cow::Borrowed(values),
            Self::Formula(formula) => {
                let rest = conditions.sheet.rest();
                Cow::Owned(Values::Each(
                    formula.at(rest, conditions.time, |s| conditions.species(s)),
                ))
            }
        }
    }

    /// Its derivatives at the vertices by each of the species that it reads.
    #[must_use]
    pub fn slopes(&self, conditions: &Conditions<'_>) -> Vec<Vec<f64>> {
        match self {
            Self::Given(_) => Vec::new(),
            Self::Formula(formula) => {
                formula.slopes(conditions.sheet.rest(), conditions.time, |s| conditions.species(s))
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
        if let Field::Formula(text) = field {
            let species = self.kinetics.map_or(&[][..], |(law, _)| &law.species);
            let species: Vec<&str> = species.iter().map(|s| s.name.as_str()).collect();
            let formula = SpeciesFormula::new(text, &species).map_err(|e| EffectError {
                key,
                message: e.message,
                help: e.help,
            })?;
            if !formula.species().is_empty() || formula.depends_on_time() {
                return Ok(VertexField::Formula(Box::new(formula)));
            }
        }
        self.values(field, Location::Vertex, key).map(VertexField::Given)
    }
}
