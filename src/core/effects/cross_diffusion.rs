//! Cross-diffusion: a species that moves along the gradient of another one.
//!
//! ```text
//! ∂u/∂t = … + D_uv Δ v
//! ```
//!
//! D_uv of either sign (length²/time, times the unit of u over that of v): u moves down the gradient of v where it is
//! positive. Discretised as the diffusion of species on vertices is: `Σ A_i u_i` is conserved and nothing crosses the
//! boundary. It does not keep u ≥ 0, and the problem is ill-posed where the matrix D of all coefficients has an eigenvalue with a
//! negative real part, which is refused (`model/chemistry/ill_posed.rs`).
//!
//! A coefficient that reads species gives ∂u/∂t = … + ∇·(D_uv ∇v) (`species_coefficient.rs`): `-χ u` is chemotaxis up the gradient of v
//! (Keller & Segel, J. Theor. Biol. 26 (1970) 399, doi:10.1016/0022-5193(70)90092-5).
//!
//! Reference: Vanag & Epstein, Phys. Chem. Chem. Phys. 11 (2009) 897, doi:10.1039/b813825g.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::cotan::Cotan;
use super::field::named;
use super::{
    Effect, EffectContext, EffectError, EffectSpec, Field, FieldValues, Needs, TransportTerm,
};
use crate::kinetics::Location;

/// Parameters of cross-diffusion in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrossDiffusion {
    /// Which species moves.
    pub species: String,
    /// Along the gradient of which one.
    pub by: String,
    /// Coefficient D_uv; a formula may read species.
    pub coefficient: Field,
}

#[typetag::serialize(name = "cross-diffusion")]
impl EffectSpec for CrossDiffusion {
    fn name(&self) -> String {
        format!("cross-diffusion of {} by {}", self.species, self.by)
    }

    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        named([("coefficient.file", self.coefficient.file())])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.coefficient.resolve_path_against(folder);
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let (species, location) = context.species("species", &self.species, "diffuse")?;
        let (by, _) = context.species("by", &self.by, "be followed")?;
        let refuse = |key, message: String, help: &str| {
            Err(EffectError { key, message, help: Some(help.into()) })
        };
        if species == by {
            return refuse(
                "by",
                format!("`{}` cannot cross-diffuse by itself", self.by),
                "another species, or kind = \"diffusion\"",
            );
        }
        if location != Location::Vertex {
            return refuse(
                "species",
                format!(
                    "cross-diffusion is for species on vertices, and `{}` is on {}",
                    self.species,
                    location.nouns()
                ),
                "kinetics.location = \"vertex\"",
            );
        }
        let (sheet, measure) = (context.sheet, context.measure);
        let of = |coefficient: FieldValues| {
            TransportTerm::new(Cotan::new(sheet, species, coefficient, measure, false).reading(by))
        };
        let formula = context.coefficient_of_species(&self.coefficient, location)?;
        Ok(Effect::transport_term(match formula {
            Some(formula) => of(FieldValues::Same(1.0)).with_coefficient(formula),
            None => of(context.values(&self.coefficient, Location::Face, "coefficient")?),
        }))
    }
}

crate::register_kind!(dyn EffectSpec, "cross-diffusion", CrossDiffusion);
