//! Flow towards the actual state: Maxwell's law, with a yield point Bingham's and Perzyna's.
//!
//! ```text
//! d(rest)/dt = (e - y sign e)/τ  where |e| > y, 0 elsewhere          e: the deviation from rest
//! ```
//!
//! τ is the relaxation time, y the yield point, 0 for a viscoelastic liquid. Both are fields at the vertices
//! (`field.rs`); an edge has the mean of its ends. At a given shape without yield point, e falls as exp(-t/τ).
//!
//! Reference: Perzyna, Adv. Appl. Mech. 9 (1966) 243, doi:10.1016/S0065-2156(08)70009-7, with a linear overstress
//! function.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::{EffectContext, EffectError, Field, FieldValues};
use crate::kinetics::Location;
use crate::num::checked::{NonNegative, Positive};

/// The rule by which rest values flow, as a scene gives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowRule {
    /// The relaxation time τ.
    pub time: Field<Positive>,
    /// The yield point y; 0 without it.
    #[serde(rename = "yield", default, skip_serializing_if = "Option::is_none")]
    pub threshold: Option<Field<NonNegative>>,
}

/// The names of a flow's keys.
pub(super) struct Keys {
    pub(super) time: &'static str,
    pub(super) threshold: &'static str,
}

impl FlowRule {
    /// The files that it reads.
    pub(super) fn files(&self, [time, threshold]: [&'static str; 2]) -> Vec<(&'static str, &Path)> {
        named([
            (time, self.time.file()),
            (threshold, self.threshold.as_ref().and_then(Field::file)),
        ])
    }

    /// Makes their paths absolute.
    pub(super) fn resolve_paths_against(&mut self, folder: &Path) {
        self.time.resolve_path_against(folder);
        if let Some(threshold) = &mut self.threshold {
            threshold.resolve_path_against(folder);
        }
    }

    /// On the edges of a sheet.
    pub(super) fn on_edges(
        &self,
        context: &EffectContext<'_>,
        keys: &Keys,
    ) -> Result<Flow, EffectError> {
        let sheet = context.sheet;
        let means = |values: FieldValues| match values {
            FieldValues::Same(value) => FieldValues::Same(value),
            FieldValues::Each(all) => {
                let mean = |[a, b]: [u32; 2]| 0.5 * (all[a as usize] + all[b as usize]);
                FieldValues::Each(sheet.edges().iter().map(|edge| mean(edge.vertices)).collect())
            }
        };
        let time = means(context.values(&self.time, Location::Vertex, keys.time)?);
        let threshold = match &self.threshold {
            None => FieldValues::Same(0.0),
            Some(field) => means(context.values(field, Location::Vertex, keys.threshold)?),
        };
        Ok(Flow { fluidity: time.map(|time| 1.0 / time), threshold })
    }
}

/// A flow on the edges of a sheet.
#[derive(Debug, Clone)]
pub(super) struct Flow {
    /// 1/τ.
    fluidity: FieldValues,
    /// y.
    threshold: FieldValues,
}

impl Flow {
    /// The rate at edge `e` under the deviation there; `unit` is what the yield point is counted in.
    #[inline]
    pub(super) fn rate(&self, e: usize, deviation: f64, unit: f64) -> f64 {
        let beyond = deviation.abs() - self.threshold.at(e) * unit;
        if beyond > 0.0 { self.fluidity.at(e) * beyond.copysign(deviation) } else { 0.0 }
    }

    /// The largest 1/τ.
    pub(super) fn fastest(&self) -> f64 {
        self.fluidity.largest()
    }

    /// The largest y.
    pub(super) fn highest(&self) -> f64 {
        self.threshold.largest()
    }
}
