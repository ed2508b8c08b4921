//! Flux of a species into the sheet, through its surface or its boundary: sources by region, Neumann boundary values.
//!
//! ```text
//! ∂c/∂t = … + q              on the triangles of the region      q: amount/(time area)
//! D ∂c/∂n = q                on its boundary edges               q: amount/(time length), n outwards
//! ```
//!
//! q > 0 flows in. It is a number or a formula of the rest position, time and signals, counts per current area or length, and adds
//! `∫ q` to the total per unit of time. Discretisation: see the files `inflow.rs` and `signal_factor.rs`.
//!
//! Reference: natural boundary conditions of linear elements, e.g. Ern & Guermond, Theory and Practice of Finite
//! Elements (2004), section 3.1.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::inflow::{FluxPer, FluxSource, Inflow, InflowDensity, note_on_unit};
use super::timed_field::{self, TimedField};
use super::{
    Effect, EffectContext, EffectError, EffectSpec, Field, Needs, Region, SceneSummary,
    TransportTerm,
};
use crate::kinetics::Location;
use crate::kinetics::breakpoints::TimeDependence;
use crate::sheet::Sheet;

/// Parameters of a flux in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flux {
    /// Which species.
    pub species: String,
    /// Where it flows in.
    #[serde(rename = "where")]
    pub region: Region,
    /// q: amount per time and area or length; negative where it flows out.
    pub value: Field,
    /// What q is counted per; length where the whole region is at the boundary, or else area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per: Option<FluxPer>,
}

#[typetag::serialize(name = "flux")]
impl EffectSpec for Flux {
    fn name(&self) -> String {
        format!("flux of {}", self.species)
    }

    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        named([("value.file", self.value.file())])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.value.resolve_path_against(folder);
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let place = context.species("species", &self.species, "flow in")?;
        let factor = context.signal_factor(&self.value, ("value", false), place.1)?;
        let value = match factor {
            Some(_) => TimedField::UNIT,
            None => context.timed_field(&self.value, Location::Vertex, "value")?,
        };
        let density = InflowDensity::Flux(value);
        let through = FluxSource { region: &self.region, per: self.per, density };
        let inflow = Inflow::new(("flux", "value"), context, place, through)?;
        Ok(Effect::transport_term(TransportTerm::new(inflow).with_factor(factor)))
    }

    fn notes(&self, context: &EffectContext<'_>, _: &SceneSummary<'_>) -> Vec<String> {
        note_on_unit(&self.region, self.per, context.sheet).into_iter().collect()
    }

    fn time_dependence(&self, sheet: &Sheet, until: f64) -> TimeDependence {
        timed_field::time_dependence([&self.value], sheet, until)
    }
}

crate::register_kind!(dyn EffectSpec, "flux", Flux);
