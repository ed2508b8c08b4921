//! Exchange of a species with surroundings of given concentration, through the surface or the boundary: Robin boundary
//! values.
//!
//! ```text
//! ∂c/∂t = … + k (c_ref - c)      on the triangles of the region      k: 1/time
//! D ∂c/∂n = k (c_ref - c)        on its boundary edges               k: length/time, n outwards
//! ```
//!
//! k ≥ 0 and c_ref are numbers or formulas of the rest position, time and signals; c and c_ref are amounts per current area, also
//! where the species is counted per rest area. Discretisation: see the files `inflow.rs` and `signal_factor.rs`.
//!
//! Reference: Carslaw & Jaeger, Conduction of Heat in Solids (1959), section 1.9.

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
use crate::num::checked::{Finite, NonNegative};
use crate::sheet::Sheet;

/// Parameters of an exchange in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exchange {
    /// Which species.
    pub species: String,
    /// Where it is exchanged.
    #[serde(rename = "where")]
    pub region: Region,
    /// k: 1/time per area, or length/time per length; not negative.
    pub rate: Field<NonNegative>,
    /// c_ref: the concentration of the surroundings, amount per area.
    pub reference: Field,
    /// What the flux is counted per; length where the whole region is at the boundary, or else area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per: Option<FluxPer>,
}

#[typetag::serialize(name = "exchange")]
impl EffectSpec for Exchange {
    fn name(&self) -> String {
        format!("exchange of {}", self.species)
    }

    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        named([("rate.file", self.rate.file()), ("reference.file", self.reference.file())])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.rate.resolve_path_against(folder);
        self.reference.resolve_path_against(folder);
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let place = context.species("species", &self.species, "be exchanged")?;
        let at_vertices = Location::Vertex;
        let of_rate = context.signal_factor(&self.rate, ("rate", true), place.1)?;
        let of_reference = context.signal_factor(&self.reference, ("reference", false), place.1)?;
        let rate = match &of_rate {
            Some(_) => TimedField::UNIT,
            None => context.timed_field(&self.rate, at_vertices, "rate")?,
        };
        let term = |key, density, factor| {
            let through = FluxSource { region: &self.region, per: self.per, density };
            let inflow = Inflow::new(("exchange", key), context, place, through)?;
            Ok(TransportTerm::new(inflow).with_factor(factor))
        };
        if of_reference.is_none() {
            let reference = context.timed_field(&self.reference, at_vertices, "reference")?;
            let density = InflowDensity::Exchange(rate, reference);
            return Ok(Effect::transport_term(term("rate", density, of_rate)?));
        }
        // -k c and k c_ref have different factors.
        let supply = match (&self.rate, &self.reference, &of_rate) {
            (Field::Formula(rate), Field::Formula(reference), Some(_)) => {
                let product = Field::<Finite>::Formula(format!("({rate})*({reference})"));
                context.signal_factor(&product, ("reference", false), place.1)?
            }
            _ => of_reference,
        };
        let loss = InflowDensity::Exchange(rate.clone(), TimedField::ZERO);
        let transports = vec![
            term("rate", loss, of_rate)?,
            term("reference", InflowDensity::Flux(rate), supply)?,
        ];
        Ok(Effect { transports, ..Effect::default() })
    }

    fn notes(&self, context: &EffectContext<'_>, _: &SceneSummary<'_>) -> Vec<String> {
        note_on_unit(&self.region, self.per, context.sheet).into_iter().collect()
    }

    fn time_dependence(&self, sheet: &Sheet, until: f64) -> TimeDependence {
        let mut found = timed_field::time_dependence([&self.reference], sheet, until);
        found.add(timed_field::time_dependence([&self.rate], sheet, until));
        found
    }
}

crate::register_kind!(dyn EffectSpec, "exchange", Exchange);
