//! Values of a species that are held: Dirichlet boundary values.
//!
//! ```text
//! c_p = g_p      at the vertices of the region, or the triangles whose corners all lie in it
//! ```
//!
//! with g a number or a formula of the rest position. Exact at every time: the values are set at the start, and the rates
//! of held points are `g - c`, which is 0. Under steady chemistry the same rows are the equations `c = g`. What
//! diffusion carries across the held points is not in the total. g is per current
//! area, or per rest area with `measure = "amount"`.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::{
    DirichletValues, Effect, EffectContext, EffectError, EffectSpec, Field, Needs, Region,
};
use crate::kinetics::Location;
use crate::sheet::Sheet;

/// Parameters of held values in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirichletSpec {
    /// Which species.
    pub species: String,
    /// Where.
    #[serde(rename = "where")]
    pub region: Region,
    /// g, in the unit of the species.
    pub value: Field,
}

#[typetag::serialize(name = "hold")]
impl EffectSpec for DirichletSpec {
    fn name(&self) -> String {
        format!("hold of {}", self.species)
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
        let sheet = context.sheet;
        let (species, location) = context.species("species", &self.species, "be held")?;
        let chosen = self.region.choose(sheet, "hold")?;
        let value = context.at_vertices(&self.value, "value")?;
        let points = match location {
            Location::Vertex => {
                (0..value.len()).filter(|&i| chosen[i]).map(|i| (i, value[i])).collect()
            }
            Location::Face | Location::Edge => held_triangles(sheet, &chosen, &value)?,
        };
        self.check_range(context, species, location, &points)?;
        Ok(Effect { held: vec![DirichletValues { species, points }], ..Effect::default() })
    }
}

/// The triangles whose corners are all chosen, with the means of their values.
fn held_triangles(
    sheet: &Sheet,
    chosen: &[bool],
    value: &[f64],
) -> Result<Vec<(usize, f64)>, EffectError> {
    let all = sheet.triangles().iter().enumerate();
    let inside = all.filter(|(_, corners)| corners.iter().all(|v| chosen[*v as usize]));
    let mean = |corners: &[u32; 3]| corners.iter().map(|v| value[*v as usize]).sum::<f64>() / 3.0;
    let points: Vec<(usize, f64)> = inside.map(|(t, corners)| (t, mean(corners))).collect();
    if !sheet.reduction().any(!points.is_empty()) {
        return Err(EffectError {
            key: "where",
            message: "no triangle has all corners in the region of this hold, and species on faces have no \
                      values at the boundary"
                .into(),
            help: Some("a larger region, or kinetics.location = \"vertex\"".into()),
        });
    }
    Ok(points)
}

impl DirichletSpec {
    /// Refuses values that the law is not valid for.
    fn check_range(
        &self,
        context: &EffectContext<'_>,
        species: usize,
        location: Location,
        points: &[(usize, f64)],
    ) -> Result<(), EffectError> {
        let Some((descriptor, _)) = context.kinetics else { return Ok(()) };
        let range = &descriptor.species[species];
        let wrong = |(_, value): &&(usize, f64)| !(*value >= range.lower && *value <= range.upper);
        match points.iter().find(wrong) {
            None => Ok(()),
            Some((point, value)) => {
                let (noun, lower, upper) = (location.noun(), range.lower, range.upper);
                let message = format!("it holds {} at {value} at {noun} {point}", self.species);
                let help = format!("this species is valid from {lower} to {upper}");
                Err(EffectError { key: "value", message, help: Some(help) })
            }
        }
    }
}

crate::register_kind!(dyn EffectSpec, "hold", DirichletSpec);
