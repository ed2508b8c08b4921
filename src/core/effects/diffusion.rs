//! Diffusion of one species along the surface.
//!
//! ```text
//! ∂c/∂t = … + D Δ c
//! ```
//!
//! `scheme = "cotan"` (default, species on vertices): Laplace-Beltrami of linear finite elements
//! with lumped mass,
//!
//! ```text
//! (Δc)_i = (1/A_i) Σ_j w_ij (c_j - c_i),   w_ij = ½ (cot α_ij + cot β_ij),   A_i = ⅓ Σ_{T∋i} A_T
//! ```
//!
//! No flux through the boundary comes for free, and `Σ A_i c_i` is conserved because w is symmetric. On
//! Delaunay meshes w ≥ 0, so c stays ≥ 0. The areas are thirds because that is the lumped mass
//! matrix of the same elements: any other split would break second order.
//!
//! **Coefficients that differ from place to place** are constant on each triangle, and `∂c/∂t = ∇·(D ∇c)`:
//!
//! ```text
//! D w_ij → ½ (D_α cot α_ij + D_β cot β_ij)
//! ```
//!
//! with the D of the triangle of each angle. This is the stiffness of the same elements, so it stays symmetric, conserves
//! the total, and no mean is chosen: across a step of D along edges the flux is continuous, as with the harmonic mean; along
//! it the flows add up, as with the arithmetic one.
//!
//! **Coefficients that read species** (`species_coefficient.rs`) are taken at the vertices, with the mean over the ends of an edge.
//!
//! **Along fibres and across them** D may be two numbers, or fields of the rest position (`fibre_diffusion.rs`).
//!
//! `scheme = "green-gauss"` (species on faces): the paper's, see [`GreenGauss`](super::GreenGauss).
//!
//! `metric = "rest"` uses the rest positions once and for all. With `measure = "amount"` the value
//! is `C = c A/A⁰` and `∂C/∂t = (A/A⁰) D Δ(C A⁰/A)`, which conserves `Σ A⁰ C`.
//!
//! Source: Pinkall & Polthier, Exp. Math. 2 (1993) 15, doi:10.1080/10586458.1993.10504266.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::cotan::Cotan;
use super::fibre_diffusion::AnisotropicDiffusivity;
use super::field::named;
use super::green_gauss::GreenGauss;
use super::{
    Effect, EffectContext, EffectError, EffectSpec, Fibre, Field, FieldValues, Measure, Needs,
    TransportTerm,
};
use crate::kinetics::Location;
use crate::kinetics::formula::SpeciesFormula;
use crate::num::checked::NonNegative;

/// Parameters of diffusion in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Diffusion {
    /// Which species.
    pub species: String,
    /// Coefficient D, length²/time; the plugin's default if not given, which must be above 0 then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coefficient: Option<Field<NonNegative>>,
    /// A direction, with a coefficient `along` and one `across` it in place of `coefficient`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fibre: Option<Fibre>,
    /// Coefficient along the fibre, length²/time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<Field<NonNegative>>,
    /// Coefficient across the fibre, length²/time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub across: Option<Field<NonNegative>>,
    /// Discretisation; by default the one that fits where the species lives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scheme: Option<DiffusionScheme>,
    /// Surface along which the species diffuses.
    #[serde(default)]
    pub metric: DiffusionMetric,
}

/// Discretisations of diffusion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DiffusionScheme {
    /// Cotangent Laplace-Beltrami on vertices.
    Cotan,
    /// The paper's Green-Gauss scheme on faces.
    GreenGauss,
}

/// Surfaces to diffuse along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DiffusionMetric {
    /// The current shape.
    #[default]
    Current,
    /// The rest shape.
    Rest,
}

#[typetag::serialize(name = "diffusion")]
impl EffectSpec for Diffusion {
    fn name(&self) -> String {
        format!("diffusion of {}", self.species)
    }

    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        let [coefficient, along, across] = [&self.coefficient, &self.along, &self.across]
            .map(|field| field.as_ref().and_then(Field::file));
        named([
            ("coefficient.file", coefficient),
            ("along.file", along),
            ("across.file", across),
            ("fibre.file", self.fibre.as_ref().and_then(Fibre::file)),
        ])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        let fields = [&mut self.coefficient, &mut self.along, &mut self.across];
        fields.into_iter().flatten().for_each(|field| field.resolve_path_against(folder));
        if let Some(fibre) = &mut self.fibre {
            fibre.resolve_path_against(folder);
        }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let (species, location) = context.species("species", &self.species, "diffuse")?;
        let directed = self.directed()?;
        let usual = context.kinetics.map_or(0.0, |(law, _)| law.species[species].diffusion);
        if self.coefficient.is_none() && directed.is_none() && usual == 0.0 {
            return refuse(
                "species",
                format!("diffusion of {} has no coefficient, and the law gives none", self.species),
                "coefficient = D in length²/time; a law written as text has no default, and 0 can be given",
            );
        }
        if let Some(field) = &self.coefficient
            && let Some(formula) = context.coefficient_of_species(field, location)?
        {
            return Ok(self.by_species(context, species, formula));
        }
        let given = self.coefficient.as_ref();
        let given = given.map(|field| context.values(field, Location::Face, "coefficient"));
        let coefficient = given.transpose()?.unwrap_or(FieldValues::Same(usual));
        let fitting = match location {
            Location::Vertex => DiffusionScheme::Cotan,
            Location::Face | Location::Edge => DiffusionScheme::GreenGauss,
        };
        if self.scheme.is_some_and(|scheme| scheme != fitting) {
            return refuse(
                "scheme",
                format!("this scheme does not fit species on {}", location.nouns()),
                "`cotan` is for species on vertices, `green-gauss` for species on faces; kinetics.location says where \
                 they are",
            );
        }
        match (fitting, directed) {
            (DiffusionScheme::Cotan, None) => {
                let (measure, rest) = (context.measure, self.metric == DiffusionMetric::Rest);
                let scheme = Cotan::new(context.sheet, species, coefficient, measure, rest);
                Ok(Effect::transport(scheme))
            }
            (DiffusionScheme::Cotan, Some(directed)) => self.along(context, species, directed),
            (DiffusionScheme::GreenGauss, None) => self.on_faces(context, species, &coefficient),
            (DiffusionScheme::GreenGauss, Some(_)) => refuse(
                "fibre",
                "the Green-Gauss scheme has the same coefficient in all directions".into(),
                "use kinetics.location = \"vertex\"",
            ),
        }
    }
}

fn refuse<T>(key: &'static str, message: String, help: &str) -> Result<T, EffectError> {
    Err(EffectError { key, message, help: Some(help.into()) })
}

/// A fibre, and the coefficients along and across it.
type Directed<'a> = (&'a Fibre, &'a Field<NonNegative>, &'a Field<NonNegative>);

impl Diffusion {
    /// Of a species with a coefficient, that of the law if none is given, along the current shape.
    #[must_use]
    pub fn new(species: impl Into<String>, coefficient: Option<Field<NonNegative>>) -> Self {
        Self {
            species: species.into(),
            coefficient,
            fibre: None,
            along: None,
            across: None,
            scheme: None,
            metric: DiffusionMetric::default(),
        }
    }

    /// What it has of directions; refuses keys that do not go together.
    fn directed(&self) -> Result<Option<Directed<'_>>, EffectError> {
        let keys = [self.fibre.is_some(), self.along.is_some(), self.across.is_some()];
        let given = keys.into_iter().zip(["fibre", "along", "across"]).find(|(given, _)| *given);
        let Some((_, first)) = given else { return Ok(None) };
        if self.coefficient.is_some() {
            let message = "diffusion has one coefficient, or one along and one across a fibre";
            let help = "either coefficient, or fibre with along and across";
            return refuse("coefficient", message.into(), help);
        }
        match (&self.fibre, &self.along, &self.across) {
            (Some(fibre), Some(along), Some(across)) => Ok(Some((fibre, along, across))),
            _ => refuse(
                first,
                "diffusion with a direction needs the fibre and the coefficients along and across it".into(),
                "as in fibre = [1, 0, 0], along = 2.0, across = 0.5",
            ),
        }
    }

    /// The cotangent scheme with a coefficient that reads species.
    fn by_species(
        &self,
        context: &EffectContext<'_>,
        species: usize,
        formula: SpeciesFormula,
    ) -> Effect {
        let (measure, rest) = (context.measure, self.metric == DiffusionMetric::Rest);
        let scheme = Cotan::new(context.sheet, species, 1.0, measure, rest);
        Effect::transport_term(TransportTerm::new(scheme).with_coefficient(formula))
    }

    /// The cotangent scheme with fibres.
    fn along(
        &self,
        context: &EffectContext<'_>,
        species: usize,
        (fibre, along, across): Directed<'_>,
    ) -> Result<Effect, EffectError> {
        let along = context.values(along, Location::Face, "along")?;
        let across = context.values(across, Location::Face, "across")?;
        let fibres = fibre.in_triangles(context)?;
        let fibres = AnisotropicDiffusivity::new(context.sheet, &fibres, &along, &across);
        let (measure, rest) = (context.measure, self.metric == DiffusionMetric::Rest);
        let scheme = Cotan::along(context.sheet, species, (&across, fibres), measure, rest);
        Ok(Effect::transport(scheme))
    }

    /// The paper's scheme.
    fn on_faces(
        &self,
        context: &EffectContext<'_>,
        species: usize,
        coefficient: &FieldValues,
    ) -> Result<Effect, EffectError> {
        if context.measure == Measure::Amount {
            let message = "the Green-Gauss scheme does not conserve amounts".into();
            let help = "use kinetics.location = \"vertex\" with measure = \"amount\"";
            return refuse("scheme", message, help);
        }
        let FieldValues::Same(coefficient) = *coefficient else {
            let message = "the Green-Gauss scheme has one coefficient".into();
            let help = "give a number, or use kinetics.location = \"vertex\"";
            return refuse("coefficient", message, help);
        };
        let rest = self.metric == DiffusionMetric::Rest;
        Ok(Effect::transport(GreenGauss::new(context.sheet, species, coefficient, rest)))
    }
}

crate::register_kind!(dyn EffectSpec, "diffusion", Diffusion);
