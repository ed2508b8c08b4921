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
//! Reference: Vanag & Epstein, Phys. Chem. Chem. Phys. 11 (2009) 897, doi:10.1039/b813825g. Not covered: coefficients that
//! depend on species.

use serde::{Deserialize, Serialize};

use super::cotan::Cotan;
use super::{Effect, EffectContext, EffectError, EffectSpec, Needs};
use crate::kinetics::Location;
use crate::num::checked::Finite;

/// Parameters of cross-diffusion in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrossDiffusion {
    /// Which species moves.
    pub species: String,
    /// Along the gradient of which one.
    pub by: String,
    /// Coefficient D_uv.
    pub coefficient: Finite,
}

#[typetag::serialize(name = "cross-diffusion")]
impl EffectSpec for CrossDiffusion {
    fn name(&self) -> String {
        format!("cross-diffusion of {} by {}", self.species, self.by)
    }

    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
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
        let scheme = Cotan::new(sheet, species, self.coefficient.get(), measure, false);
        Ok(Effect::transport(scheme.by(by)))
    }
}

crate::register_kind!(dyn EffectSpec, "cross-diffusion", CrossDiffusion);
