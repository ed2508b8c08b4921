//! What a scene is allowed to say and would make results other than its author means: reported before a run.

use super::{Result, Simulation};
use crate::Stepper;
use crate::effects::MaterialField;
use crate::geometry::area;
use crate::model::{Chemistry, Drag, Model, Policy, Potential, State};
use crate::num::Short;
use crate::scene::Scene;
use crate::sheet::Sheet;
use crate::solve::equilibrium::{FELT_LOAD_RATIO, ForceTolerance, largest_load};
use crate::solve::{Workspace, diagnosis};

/// Forces of this size are those of strains of a hundredth, which is not rest.
const LOOSE_TOLERANCE: f64 = 1e-2;

/// Thickness over radius beyond which a sheet is not thin.
const MAX_THICKNESS_RATIO: f64 = 0.1;

/// The triangles of a disc cover it but for this factor of the radius.
const DISC_RADIUS_FACTOR: f64 = 1.02;

/// Inspects the scene and its sheet.
pub(super) fn on_scene(
    scene: &Scene,
    sheet: &Sheet,
    material: Option<&MaterialField>,
    notes: &mut Vec<String>,
) {
    if scene.time.span.stabilisation.is_some() && scene.time.policy != Policy::QuasiStatic {
        notes.push(format!(
            "time.stabilisation has no effect under the policy {}: it is for quasi-static shapes",
            scene.time.policy.name()
        ));
    }
    let tolerance = scene.equilibrium.tolerance().without_loads();
    if tolerance >= LOOSE_TOLERANCE {
        notes.push(format!(
            "equilibrium.tolerance = {} accepts residual forces that correspond to strains of {} \
             %: its unit is Y times the edge length, and 1e-6 is usual",
            Short(tolerance),
            Short((100.0 * tolerance).min(100.0))
        ));
    }
    let radius = radius(sheet);
    if let Some(thickness) = material.map(|material| material.thickness.largest())
        && thickness > MAX_THICKNESS_RATIO * radius * DISC_RADIUS_FACTOR
    {
        notes.push(format!(
            "material.thickness = {} is {:.2} of the sheet's radius {radius:.4} (of a disc of its \
             area): the theory is for thin sheets, below a tenth",
            Short(thickness),
            thickness / radius
        ));
    }
}

/// The radius of a disc of the same area, or half of the largest extent where that is less, as for a
/// sphere; infinite for a point.
fn radius(sheet: &Sheet) -> f64 {
    if sheet.triangle_count() == 0 {
        return f64::INFINITY;
    }
    let extent = |axis: usize| {
        let values = || sheet.rest().iter().map(|x| x[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    let area = area(sheet, sheet.rest());
    let half = 0.5 * (0..3).map(extent).fold(0.0, f64::max);
    (area / std::f64::consts::PI).sqrt().min(half)
}

/// Inspects the drag under which a shape moves.
pub(super) fn on_drag(scene: &Scene, drag: &Drag, notes: &mut Vec<String>) {
    if scene.written("material.drag").is_none() {
        notes.push(format!(
            "the policy {} moves the shape under a drag, and the scene gives none: it is {} of every vertex, the \
             default of material.drag; the paper's is 100",
            scene.time.policy.name(),
            Short(drag.tangential(0))
        ));
    }
}

/// Inspects the loads on a sheet at rest, which the tolerance has to feel.
pub(super) fn on_loads(
    potential: &mut Potential,
    tolerance: ForceTolerance,
    notes: &mut Vec<String>,
) {
    let (load, number) = (largest_load(potential), tolerance.on(potential));
    let felt = load == 0.0 || load >= FELT_LOAD_RATIO * number;
    let consequence = match tolerance {
        ForceTolerance::Given(_) if felt => return,
        ForceTolerance::Given(_) => "the response to the load will be inaccurate; use \"auto\"",
        ForceTolerance::Auto if number == tolerance.without_loads() => return,
        ForceTolerance::Auto if felt => "the default under gentle loads",
        ForceTolerance::Auto => {
            "round-off of positions allows no less, and the response to the load will be inaccurate"
        }
    };
    notes.push(format!(
        "the largest load on a vertex is {load:.1e} Y times the edge length, and equilibrium is accepted below \
         equilibrium.tolerance = {number:e}: {consequence}"
    ));
}

/// Inspects a law that gives what no energy reads.
pub(super) fn on_law(model: &Model, notes: &mut Vec<String>) {
    let given = |chemistry: &Chemistry| chemistry.descriptor().capabilities.curvature;
    let read = model.mechanics().terms().iter().any(|term| term.reads().curvature);
    if model.chemistry().is_some_and(given) && !read {
        notes.push(
            "the law gives a spontaneous curvature, and no effect bends: it does nothing".into(),
        );
    }
}

/// Inspects coefficients of diffusion that differ from place to place, and those that read species, at the start.
pub(super) fn on_diffusion(model: &Model, start: &State, notes: &mut Vec<String>) {
    let at = |chemistry: &Chemistry| chemistry.ill_posed_at(model.sheet(), &start.species);
    if let Some(found) = model.chemistry().and_then(at) {
        notes.push(format!("warning: {found}"));
    }
}

/// Inspects whether the stability of the equilibria of a quasi-static shape is judged.
pub(super) fn on_stability(scene: &Scene, workspace: &Workspace, notes: &mut Vec<String>) {
    let model = &workspace.model;
    let rests = scene.time.policy.mass_weights().mechanics == 0.0 && model.moves();
    if rests && !model.mechanics().is_planar() && !workspace.judges_stability() {
        notes.push(
            "the stability of equilibria is not judged on sheets of this size, or over ranks: the shape stays at a saddle \
             that it reaches; sheet.imperfection breaks symmetries"
                .into(),
        );
    }
}

/// Inspects fixed explicit steps, which diffusion limits.
///
/// # Errors
/// If the model has no value at the state of `simulation`.
pub(super) fn on_explicit_step(
    scene: &Scene,
    simulation: &mut Simulation,
) -> Result<Option<String>> {
    let Some(step) = scene.time.integrator.explicit_step() else { return Ok(None) };
    let Stepper { workspace, state, .. } = &mut simulation.stepper;
    let limit = diagnosis::explicit_limit(workspace, state)?.filter(|limit| step > *limit);
    Ok(limit.map(|limit| format!("warning: {}", diagnosis::explicit_limit_message(step, limit))))
}
