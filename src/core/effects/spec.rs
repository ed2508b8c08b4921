//! What a scene lists, what that is bound to, and what comes of it.

use std::path::Path;

use super::directed_growth::DirectedLengthFactor;
use super::energy::{Contact, Energy, EnergyTerm};
use super::field::{Field, FieldValues};
use super::growth::LengthFactor;
use super::hold::DirichletValues;
use super::internal_variables::InternalVariables;
use super::material::{Material, MaterialField};
use super::pin::PrescribedDisplacement;
use super::transport::{Transport, TransportTerm};
use crate::geometry::AreaRule;
use crate::kinetics::breakpoints::TimeDependence;
use crate::kinetics::{Descriptor, Location};
use crate::num::checked::Checked;
use crate::sheet::{Sheet, Surface};

/// What an effect needs of a scene besides its sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// The table `[material]`.
    pub material: bool,
    /// Species, from the table `[kinetics]`.
    pub species: bool,
    /// That vertices move out of the plane z = const, and the key of its table by which it does: it bends
    /// the sheet, pushes it along z, or fixes it there. A scene with `sheet.planar` is refused at that key.
    pub out_of_plane: Option<&'static str>,
}

/// An effect as a scene lists it: its kind and parameters, not yet bound to a sheet.
#[typetag::serialize(tag = "kind")]
pub trait EffectSpec: std::fmt::Debug + Send + Sync {
    /// What the effect is called in results; its kind, unless it says otherwise.
    fn name(&self) -> String {
        self.typetag_name().to_owned()
    }

    /// What it needs of the scene: without that, the scene is refused before anything is built.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// The rule by which it gives areas to vertices, if it has one: the scene's signals, fields and
    /// reports then go by the same.
    fn vertex_area(&self) -> Option<AreaRule> {
        None
    }

    /// The files that it reads, by their keys within its table.
    fn files(&self) -> Vec<(&'static str, &Path)> {
        Vec::new()
    }

    /// Makes their paths absolute: they count from `folder`.
    fn resolve_paths_against(&mut self, _folder: &Path) {}

    /// Binds it to a sheet, a material and the species there are.
    ///
    /// # Errors
    /// A parameter that does not fit the sheet or the kinetics.
    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError>;

    /// Where what it brings has kinks and jumps from time 0 to `until`, and its course between them: steps end there and
    /// pass over no pulse.
    fn time_dependence(&self, _sheet: &Sheet, _until: f64) -> TimeDependence {
        TimeDependence::default()
    }

    /// What it does there, among the other effects of `scene`, that the author of a scene may not have meant; begins with
    /// `warning: ` where results are likely to be wrong.
    fn notes(&self, _context: &EffectContext<'_>, _scene: &SceneSummary<'_>) -> Vec<String> {
        Vec::new()
    }
}

/// What [`EffectSpec::notes`] may know of a scene besides the context of its effect.
#[derive(Debug, Clone, Copy, Default)]
pub struct SceneSummary<'a> {
    /// The names of all effects.
    pub effects: &'a [String],
    /// Whether the shape of the sheet at rest is read from a file.
    pub sheet_file: bool,
}

crate::family!(dyn EffectSpec, "effect", "kind");

/// The names of all effects that a scene of this program can list, sorted.
#[must_use]
pub fn kinds() -> Vec<&'static str> {
    crate::registry::names::<dyn EffectSpec>()
}

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

/// A reader of meshes: the engine itself reads no files.
pub type ReadSurface<'a> = dyn Fn(&Path) -> Result<Surface, String> + Sync + 'a;

impl<'a> EffectContext<'a> {
    /// The material, for an effect that takes it to be the same everywhere.
    ///
    /// # Errors
    /// If it is not, or if there is none: an effect that asks for it declares that in [`EffectSpec::needs`], and the
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

/// A parameter of an effect that does not fit, with the key to blame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct EffectError {
    /// The key in the effect's table.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

/// The error for a key that `model` does not have, but `other` has.
pub(super) fn misplaced(key: &'static str, model: &str, reason: &str, other: &str) -> EffectError {
    EffectError {
        key,
        message: format!("model = \"{model}\" has no {key}: it {reason}"),
        help: Some(format!("leave {key} out, or choose model = \"{other}\"")),
    }
}

/// For every vertex the directions that are fixed.
pub type Pins = Vec<[bool; 3]>;

/// What an effect brings to a model: any of these, and of each as many as it likes.
#[derive(Default)]
pub struct Effect {
    /// Energies.
    pub energies: Vec<EnergyTerm>,
    /// Directions that are fixed.
    pub pins: Option<Pins>,
    /// Fixed directions whose positions are prescribed in time.
    pub prescribed: Vec<PrescribedDisplacement>,
    /// What must be zero at every shape: the value of each, which has no unit (a strain, a share), is
    /// kept below 1e-9 by a force along its gradient.
    pub constraints: Vec<EnergyTerm>,
    /// Length factors that multiply those of laws.
    pub growth: Vec<LengthFactor>,
    /// A direction in which the length factor of the law acts.
    pub direction: Option<DirectedLengthFactor>,
    /// Transports of species.
    pub transports: Vec<TransportTerm>,
    /// Values of species that are held.
    pub held: Vec<DirichletValues>,
    /// Variables of its own with rates.
    pub internal: Vec<Box<dyn InternalVariables>>,
}

impl Effect {
    /// With an energy.
    #[must_use]
    pub fn energy(energy: impl Energy) -> Self {
        Self { energies: vec![EnergyTerm::new(energy)], ..Self::default() }
    }

    /// With an energy of contact.
    #[must_use]
    pub fn contact(energy: impl Contact) -> Self {
        Self { energies: vec![EnergyTerm::contact(energy)], ..Self::default() }
    }

    /// With a constraint: what `zero` gives as its energy is kept at 0.
    #[must_use]
    pub fn constraint(zero: impl Energy) -> Self {
        Self { constraints: vec![EnergyTerm::new(zero)], ..Self::default() }
    }

    /// With fixed directions.
    #[must_use]
    pub fn pins(pins: Pins) -> Self {
        Self { pins: Some(pins), ..Self::default() }
    }

    /// With internal variables.
    #[must_use]
    pub fn internal(internal: impl InternalVariables) -> Self {
        Self { internal: vec![Box::new(internal)], ..Self::default() }
    }

    /// With a transport.
    #[must_use]
    pub fn transport(transport: impl Transport) -> Self {
        Self::transport_term(TransportTerm::new(transport))
    }

    /// An effect that is one transport, perhaps with a coefficient that reads species.
    #[must_use]
    pub fn transport_term(term: TransportTerm) -> Self {
        Self { transports: vec![term], ..Self::default() }
    }

    /// Numbers of its parts. The pattern names every field, so that none is forgotten.
    #[must_use]
    pub fn parts(&self) -> EffectParts {
        let Self {
            energies,
            pins,
            prescribed,
            constraints,
            growth,
            direction,
            transports,
            held,
            internal,
        } = self;
        let directions = |fixed: &[bool; 3]| fixed.iter().filter(|fixed| **fixed).count();
        let pins = pins.as_deref().unwrap_or_default();
        EffectParts {
            energies: energies.len(),
            pins: [
                pins.iter().map(directions).sum(),
                pins.iter().filter(|fixed| directions(fixed) > 0).count(),
            ],
            prescribed: prescribed.len(),
            constraints: constraints.len(),
            growth: growth.len(),
            directs: direction.is_some(),
            transports: transports.len(),
            held: held.iter().map(|held| held.points().len()).sum(),
            internal: internal.len(),
        }
    }
}

/// Numbers of the parts of an effect.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct EffectParts {
    /// Energies.
    pub energies: usize,
    /// Fixed directions, and the vertices that have some.
    pub pins: [usize; 2],
    /// Fixed directions whose positions are prescribed.
    pub prescribed: usize,
    /// Constraints.
    pub constraints: usize,
    /// Length factors.
    pub growth: usize,
    /// Whether it directs the length factor of the law.
    pub directs: bool,
    /// Transports.
    pub transports: usize,
    /// Points whose values are held.
    pub held: usize,
    /// Internal variables.
    pub internal: usize,
}
