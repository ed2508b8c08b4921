//! The mesh of a scene, and where on it species live and errors are.

use super::{Error, Result};
use crate::Vec3;
use crate::kinetics::{Kinetics, Location};
use crate::run::initial_state;
use crate::scene::{Scene, SheetSource};
use crate::sheet::{self, Sheet};

/// Says where the point is that an error blames.
pub(crate) fn located(mut error: Error, sheet: &Sheet, x: &[Vec3]) -> Error {
    if let Error::Kinetics(kinetics) = &mut error
        && let Some(site) = kinetics.site_mut()
    {
        let corners: &[u32] = match site.location {
            "vertex" => &[crate::num::index(site.point)],
            "edge" => sheet.edges().get(site.point).map_or(&[], |edge| &edge.vertices),
            _ => sheet.triangles().get(site.point).map_or(&[], |corners| corners),
        };
        let places: Vec<&Vec3> = corners.iter().filter_map(|v| x.get(*v as usize)).collect();
        if !places.is_empty() {
            let mean = places.iter().copied().sum::<Vec3>() / crate::num::real(places.len());
            site.position = Some(mean.into());
        }
    }
    error
}

pub(crate) fn read_sheet(scene: &Scene, notes: &mut Vec<String>) -> Result<Sheet> {
    let refuse = |key: &str, e: &sheet::SheetError| {
        Error::Scene(scene.error_at(&format!("sheet.{key}"), &e.to_string(), None))
    };
    match &scene.sheet.source {
        SheetSource::File { file } => {
            let surface = sheet::read::surface(file).map_err(|e| refuse("file", &e))?;
            let (sheet, findings) = surface.into_sheet().map_err(|e| refuse("file", &e))?;
            notes.extend(findings.iter().map(ToString::to_string));
            Ok(sheet)
        }
        SheetSource::Point { .. } => {
            Sheet::new(vec![Vec3::zeros()], Vec::new()).map_err(|e| refuse("shape", &e))
        }
        SheetSource::Generated(shape) => initial_state::generated(scene, shape),
    }
}

pub(crate) fn location(scene: &Scene, kinetics: Option<&dyn Kinetics>) -> Location {
    let chosen = scene.kinetics.first().and_then(|k| k.location);
    let usual = || kinetics.and_then(|k| k.descriptor().species.first().map(|s| s.location));
    chosen.or_else(usual).unwrap_or(Location::Vertex)
}
