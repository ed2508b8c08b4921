//! Values of a species that are held: Dirichlet boundary values.
//!
//! ```text
//! c_p = g_p      at the vertices of the region, or the triangles whose corners all lie in it
//! ```
//!
//! with g a number or a formula of the rest position and time. Exact at every time: the values are set at the start and at the
//! end of every step, and within it the rates of held points are `∂g/∂t + g - c`. Under steady chemistry the same rows are the
//! equations `c = g`. What diffusion carries across the held points is not in the total. g is per current
//! area, or per rest area with `measure = "amount"`.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::{
    DirichletValues, Effect, EffectContext, EffectError, EffectSpec, Field, Needs, Region,
    timed_field,
};
use crate::kinetics::Location;
use crate::kinetics::breakpoints::TimeDependence;
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
        let value = context.timed_field(&self.value, Location::Vertex, "value")?;
        if value.timed_formula().is_some_and(|formula| !formula.is_differentiable()) {
            return Err(EffectError {
                key: "value",
                message: "the formula is too large to be differentiated by the time".into(),
                help: Some("write it shorter".into()),
            });
        }
        let held = match location {
            Location::Vertex => {
                let points = (0..sheet.vertex_count()).filter(|&v| chosen[v]);
                let points: Vec<_> = points.map(|v| (v, [v])).collect();
                DirichletValues::new(sheet, species, &points, &value)
            }
            Location::Face | Location::Edge => {
                DirichletValues::new(sheet, species, &held_triangles(sheet, &chosen)?, &value)
            }
        };
        Ok(Effect { held: vec![held], ..Effect::default() })
    }

    fn time_dependence(&self, sheet: &Sheet, until: f64) -> TimeDependence {
        timed_field::time_dependence([&self.value], sheet, until)
    }
}

/// The triangles whose corners are all chosen, with these.
fn held_triangles(sheet: &Sheet, chosen: &[bool]) -> Result<Vec<(usize, [usize; 3])>, EffectError> {
    let all = sheet.triangles().iter().map(|corners| corners.map(|v| v as usize)).enumerate();
    let inside = all.filter(|(_, corners)| corners.iter().all(|v| chosen[*v]));
    let points: Vec<(usize, [usize; 3])> = inside.collect();
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

crate::register_kind!(dyn EffectSpec, "hold", DirichletSpec);
