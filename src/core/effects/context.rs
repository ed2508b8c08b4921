//! What an effect is bound to.

use super::error::EffectError;
use super::field::{Field, FieldValues, ReadSurface};
use super::material::{Material, MaterialField};
use crate::kinetics::{Descriptor, Location};
use crate::num::checked::Checked;
use crate::sheet::Sheet;

/// What an effect is bound to.
#[derive(Clone, Copy)]
pub struct EffectContext<'a> {
    /// The sheet in its rest state.
    pub sheet: &'a Sheet,
    /// Its material, if the scene has one; with the largest values where it differs from place to place.
    pub material: Option<&'a Material>,
    /// Its material where that differs from place to place.
    pub varying: Option<&'a MaterialField>,
    /// Species, if the scene has kinetics.
    pub kinetics: Option<(&'a Descriptor, Location)>,
    /// Whether species are amounts per current or per rest area.
    pub measure: Measure,
    /// Reads the mesh of a file with its arrays, or says why it cannot; none where files are not read.
    pub read: Option<&'a ReadSurface<'a>>,
}

impl<'a> EffectContext<'a> {
    /// The material, for an effect that takes it to be the same everywhere.
    ///
    /// # Errors
    /// If it is not, or if there is none: an effect that asks for it declares that in [`EffectSpec::needs`](super::EffectSpec::needs), and the
    /// scene is then refused earlier.
    pub fn material(&self) -> Result<&'a Material, EffectError> {
        if self.varying.is_some() {
            return Err(EffectError {
                key: "kind",
                message: "this effect needs one Young's modulus and one thickness, and material.young or \
                          material.thickness differs from place to place"
                    .into(),
                help: Some("give numbers there".into()),
            });
        }
        self.any_material()
    }

    /// The material on the triangles.
    ///
    /// # Errors
    /// If there is none, as for [`EffectContext::material`].
    pub fn elasticity(&self) -> Result<MaterialField, EffectError> {
        match self.varying {
            Some(varying) => Ok(varying.clone()),
            None => self.any_material().map(MaterialField::from),
        }
    }

    /// The values of a field at all vertices.
    pub(super) fn at_vertices<N: Checked>(
        &self,
        field: &Field<N>,
        key: &'static str,
    ) -> Result<Vec<f64>, EffectError> {
        let values = self.values(field, Location::Vertex, key)?;
        Ok((0..self.sheet.vertex_count()).map(|v| values.at(v)).collect())
    }

    /// The values of a field at the vertices or triangles; `key` is to blame.
    ///
    /// # Errors
    /// As for [`Field::on`].
    pub fn values<N: Checked>(
        &self,
        field: &Field<N>,
        place: Location,
        key: &'static str,
    ) -> Result<FieldValues, EffectError> {
        field.on(place, self.sheet, self.read, key)
    }

    fn any_material(&self) -> Result<&'a Material, EffectError> {
        self.material.ok_or_else(|| EffectError {
            key: "kind",
            message: "this effect needs a material, and there is none".into(),
            help: Some("add [material] with young, poisson and thickness".into()),
        })
    }

    /// The number of the species that `key` names, and where it lives; `acts` is what it cannot do without kinetics.
    ///
    /// # Errors
    /// No kinetics, or none with that species.
    pub fn species(
        &self,
        key: &'static str,
        name: &str,
        acts: &str,
    ) -> Result<(usize, Location), EffectError> {
        let refuse = |message: String, help: String| EffectError { key, message, help: Some(help) };
        let Some((descriptor, location)) = self.kinetics else {
            return Err(refuse(
                format!("`{name}` cannot {acts}: there are no kinetics"),
                "add a [kinetics] table with a plugin".into(),
            ));
        };
        let Some(species) = descriptor.species_index(name) else {
            let names: Vec<&str> = descriptor.species.iter().map(|s| s.name.as_str()).collect();
            return Err(refuse(
                format!("{} has no species `{name}`", descriptor.name),
                format!("its species: {}", names.join(", ")),
            ));
        };
        Ok((species, location))
    }
}

/// Whether the value of a species is an amount per current or per rest area.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// Current area; growth does not dilute (the paper has no dilution term).
    #[default]
    Concentration,
    /// Rest area; growth dilutes, and the total is conserved.
    Amount,
}
