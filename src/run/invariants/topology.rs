//! Gauss and Bonnet: angle defects inside and turning along the boundary add up to 2πχ.

use super::{Invariant, InvariantValue, Step};
use crate::geometry::TotalCurvature;
use crate::model::State;
use crate::run::Result;
use crate::sheet::Sheet;
use crate::solve::Workspace;

/// The sum of angle defects and turning of the boundary, compared with 2πχ; it remembers nothing.
pub(super) struct GaussBonnet;

/// A sum of angles is exact to that.
const ROUND_OFF: f64 = 1e-9;

fn reading(sheet: &Sheet, state: &State) -> InvariantValue {
    let TotalCurvature { defect, worst } = TotalCurvature::of(sheet, &state.x);
    let place = match worst {
        None if defect.abs() < ROUND_OFF => {
            "every triangle is sound, and this is round-off: no step is better".to_owned()
        }
        None => "though every triangle is sound: the topology contradicts itself".to_owned(),
        Some(t) => format!(
            "triangle {t} (vertices {:?}) has angles that do not add up to pi",
            sheet.triangles()[t]
        ),
    };
    InvariantValue { row: vec![defect], value: defect.abs(), place, memory: Vec::new() }
}

impl Invariant for GaussBonnet {
    fn name(&self) -> String {
        "the theorem of Gauss and Bonnet (radians)".into()
    }

    fn advice(&self) -> &'static str {
        "round-off of a million triangles is below 1e-9; where a triangle has lost a side, use a finer mesh or a \
         smoother length factor"
    }

    fn columns(&self) -> Vec<String> {
        vec!["Gauss-Bonnet defect [rad]".into()]
    }

    fn begin(&mut self, workspace: &mut Workspace, state: &State) -> Result<InvariantValue> {
        Ok(reading(workspace.model.sheet(), state))
    }

    fn inspect(&mut self, step: &mut Step<'_>, _: &[f64]) -> Result<InvariantValue> {
        Ok(reading(step.workspace.model.sheet(), step.after))
    }
}
