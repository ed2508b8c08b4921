//! Why a relaxation came to no end.

use std::sync::Arc;

use super::{Diagnosis, Reason};
use crate::Vec3;
use crate::model::{Model, Potential, State, free_motions};
use crate::num::{Short, real};
use crate::parallel;
use crate::sheet::quality::triangle_quality;
use crate::solve::error::LOOSEST_TOLERANCE;
use crate::solve::{Result, Workspace};

/// Quality below which a triangle counts as collapsed once the energy stops falling.
pub(in crate::solve) const COLLAPSED: f64 = 1e-2;

/// A triangle at rest that is longer than so many heights is to blame for what fails on it: relaxations
/// succeed up to some 20 (`models/hard/cases.toml`).
const NEEDLE_ASPECT_RATIO: f64 = 30.0;
/// A force that round-off makes a share of at least this size of cannot be made smaller.
const ROUND_OFF: f64 = 0.1;
/// An effect that acts on the sheet at rest with so many times the force that doubles the length of edges is
/// beyond anything the sheet can bear.
const OVERLOAD_RATIO: f64 = 10.0;
/// A sheet is flat whose height is below this share of its size.
const FLAT_HEIGHT_SHARE: f64 = 1e-6;
/// The sum of forces below this share of their sizes is round-off.
const OF_A_SUM: f64 = 1e-12;
/// Up to so many times the tolerance a force that a held triangle leaves is nearly at rest.
const NEAR_REST_RATIO: f64 = 100.0;
/// Edges that are longer than so many times their optimal length have no equilibrium near by.
const OVERSTRETCH_RATIO: f64 = 3.0;
/// Edges that are longer than so many times their rest length are those of a motion without bound.
const BLOWN_UP: f64 = 100.0;

/// What kept a relaxation at `x` from a force below `tolerance`, if one of the causes is seen: `residual` is what
/// was left, both in units of [`Potential::force_scale`].
pub fn relaxation(
    potential: &mut Potential,
    x: &[Vec3],
    (residual, tolerance): (f64, f64),
) -> Option<Diagnosis> {
    needle(potential)
        .or_else(|| net_force(potential, x, tolerance))
        .or_else(|| overloaded(potential))
        .or_else(|| round_off(potential, x, (residual, tolerance)))
        .or_else(|| held(potential, x, (residual, tolerance)))
}

/// The triangle at rest that is the longest for its height, if it is too long.
pub fn needle(potential: &Potential) -> Option<Diagnosis> {
    let sheet = potential.sheet();
    let aspect = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| sheet.rest()[v as usize]);
        let longest = [b - a, c - b, a - c].map(|e| e.norm_squared());
        longest.into_iter().fold(0.0, f64::max) / (b - a).cross(&(c - a)).norm()
    };
    let all = sheet.triangles().iter().map(aspect).enumerate();
    let (triangle, worst) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let many =
        sheet.triangles().iter().filter(|corners| aspect(corners) > NEEDLE_ASPECT_RATIO).count();
    (worst > NEEDLE_ASPECT_RATIO).then(|| Diagnosis {
        reason: Reason::Mesh,
        text: format!(
            "at rest triangle {triangle} (vertices {:?}) is {worst:.0} times as long as high, and {many} of {} \
             triangles are longer than {NEEDLE_ASPECT_RATIO} heights: forces across them are not resolved",
            sheet.triangles()[triangle],
            sheet.triangles().len()
        ),
        advice: "a mesh of rounder triangles, which `rumple mesh check FILE` judges".into(),
    })
}

/// The force on the whole sheet, where nothing holds it.
pub(crate) fn net_force(
    potential: &mut Potential,
    x: &[Vec3],
    tolerance: f64,
) -> Option<Diagnosis> {
    // A pull towards an earlier shape holds it.
    if potential.anchor().is_some() {
        return None;
    }
    let reduction = potential.reduction().clone();
    let (motions, _) = free_motions(x, potential.pins(), &reduction, |_| 1.0);
    let along = |force: &[Vec3]| -> f64 {
        motions.iter().map(|motion| reduction.dot(&motion.shape, force).powi(2)).sum::<f64>().sqrt()
    };
    let mut gradient = vec![Vec3::zeros(); x.len()];
    potential.energy_gradient(x, &mut gradient);
    let total = along(&gradient);
    // Spread over all vertices.
    if !(total > real(x.len()).sqrt() * tolerance * potential.force_scale()) {
        return None;
    }
    let names: Vec<String> = potential.mechanics().names().map(str::to_owned).collect();
    let forces = names.into_iter().enumerate().filter_map(|(which, name)| {
        let force = potential.force_of(which, x);
        let size = along(&force);
        // What is left of a sum of large forces is round-off.
        let all: f64 = force.iter().map(|f| f.norm()).sum();
        (size > OF_A_SUM * all).then(|| (size, force.iter().sum::<Vec3>(), name))
    });
    let (size, sum, name) = forces.max_by(|a, b| a.0.total_cmp(&b.0))?;
    // No rounding of inner forces, which add up to nothing.
    (size >= 0.5 * total).then(|| Diagnosis {
        reason: Reason::Load,
        text: format!(
            "the effect {name} pushes or turns the sheet as a whole, by a force of ({}, {}, {}) in sum, and nothing \
             holds it: no equilibrium exists",
            Short(sum.x),
            Short(sum.y),
            Short(sum.z)
        ),
        advice: "[[effect]] kind = \"pin\" or \"foundation\", or a load that adds up to nothing".into(),
    })
}

/// The effect with the largest force on the sheet at rest, if that is far too large.
fn overloaded(potential: &mut Potential) -> Option<Diagnosis> {
    let rest = potential.sheet().rest().to_vec();
    let names: Vec<String> = potential.mechanics().names().map(str::to_owned).collect();
    let forces = names.into_iter().enumerate().map(|(which, name)| {
        let force = potential.force_of(which, &rest);
        (potential.residual(&force), name)
    });
    let (size, name) = forces.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (size > OVERLOAD_RATIO).then(|| Diagnosis {
        reason: Reason::Load,
        text: format!(
            "the effect {name} acts on the sheet at rest with {size:.1e} times the force that stretches an edge to \
             twice its length"
        ),
        advice: format!("a value of {name} that fits Young's modulus and the thickness: are the units the same?"),
    })
}

/// The largest stretch of an edge of the shape `x`, if it is far beyond the optimal length, and the effect that causes it.
fn overstretched(potential: &mut Potential, x: &[Vec3]) -> Option<(f64, String)> {
    let optimal = potential.metric().length();
    let stretch = potential.sheet().edges().iter().zip(optimal).map(|(edge, optimal)| {
        let [a, b] = edge.vertices.map(|v| x[v as usize]);
        (b - a).norm() / optimal
    });
    let most = stretch.fold(0.0, f64::max);
    if !(most > OVERSTRETCH_RATIO) {
        return None;
    }
    let names: Vec<String> = potential.mechanics().names().map(str::to_owned).collect();
    let rest = potential.sheet().rest().to_vec();
    let work = names.into_iter().enumerate().map(|(which, name)| {
        let force = potential.force_of(which, x);
        (potential.reduction().sum(x.len(), |i| force[i].dot(&(x[i] - rest[i]))), name)
    });
    let (_, name) = work.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(work, _)| *work > 0.0)?;
    Some((most, name))
}

/// The effect that stretches edges of the shape `x` far beyond their optimal lengths, where no equilibrium is near.
pub fn stretched(potential: &mut Potential, x: &[Vec3]) -> Option<Diagnosis> {
    let (most, name) = overstretched(potential, x)?;
    Some(Diagnosis {
        reason: Reason::Load,
        text: format!(
            "the effect {name} stretches edges to {most:.1} times their optimal length, beyond a limit load"
        ),
        advice: format!(
            "a smaller value of {name}, an effect that holds the volume, or time.policy = \"simultaneous\", which \
             shows the motion beyond the limit load until it blows up (end it before: time.until)"
        ),
    })
}

/// Whether edges of `state`, whose shape moves under drag, are so long that its motion counts as a blow-up.
pub fn blows_up(model: &Model, state: &State) -> bool {
    let (sheet, x) = (model.sheet(), &state.x);
    let long = |[a, b]: [u32; 2]| {
        let of = |x: &[Vec3]| (x[b as usize] - x[a as usize]).norm_squared();
        of(x) > (BLOWN_UP * BLOWN_UP) * of(sheet.rest())
    };
    model.moves()
        && model.mass_weights().mechanics > 0.0
        && sheet.reduction().any(sheet.edges().iter().any(|edge| long(edge.vertices)))
}

/// The effect that stretches edges far beyond their optimal lengths where the shape moves under drag: beyond a limit load nothing bounds a motion without inertia.
pub fn unbounded(workspace: &mut Workspace, state: &State) -> Result<Option<Diagnosis>> {
    let model = Arc::clone(&workspace.model);
    if !model.moves() || model.mass_weights().mechanics == 0.0 {
        return Ok(None);
    }
    let mut at = workspace.at(state);
    let Some((most, name)) = overstretched(at.potential()?, &state.x) else { return Ok(None) };
    Ok(Some(Diagnosis {
        reason: Reason::Load,
        text: format!(
            "at time {} the effect {name} has stretched edges to {most:.1} times their optimal length: beyond a limit load \
             no equilibrium exists, and a motion under drag, without inertia, blows up in finite time",
            Short(state.time)
        ),
        advice: format!(
            "a smaller value of {name}, an effect that holds the volume, stretching of model = \"stvk\", which stiffens, \
             or an earlier end (time.until)"
        ),
    }))
}

/// Why a triangle collapses in the shape `x`, if it is the start that is to blame.
pub fn collapse(potential: &Potential, x: &[Vec3]) -> Option<Diagnosis> {
    let flat = |x: &[Vec3]| {
        let range = |axis: usize| {
            let all = x.iter().map(|x| x[axis]);
            let ends =
                all.fold((f64::INFINITY, f64::NEG_INFINITY), |e, v| (e.0.min(v), e.1.max(v)));
            ends.1 - ends.0
        };
        range(2) <= FLAT_HEIGHT_SHARE * range(0).max(range(1))
    };
    let free = !potential.mechanics().is_planar();
    (free && flat(potential.sheet().rest()) && flat(x)).then(|| Diagnosis {
        reason: Reason::Start,
        text: "the sheet is still flat: without any unevenness a flat sheet under compression stays flat, on a saddle, \
               until triangles collapse"
            .into(),
        advice: "sheet.imperfection = { amplitude = 1e-3, seed = 1 } or stability.perturb = 0.01, so that it can buckle, \
                 and short steps"
            .into(),
    })
}

/// How much of the force is round-off.
fn round_off(
    potential: &mut Potential,
    x: &[Vec3],
    (residual, tolerance): (f64, f64),
) -> Option<Diagnosis> {
    // A shape that is far from rest has been crushed, whatever round-off makes of it by now.
    if !(residual < LOOSEST_TOLERANCE) {
        return None;
    }
    // Every coordinate goes to the next number, up or down.
    let moved = |i: usize| {
        let sign = |axis: usize| if (7 * i + 5 * axis) % 11 < 5 { 1.0 } else { -1.0 };
        Vec3::from_fn(|axis, _| x[i][axis] * (1.0 + sign(axis) * f64::EPSILON))
    };
    let mut other = vec![Vec3::zeros(); x.len()];
    parallel::fill(&mut other, moved);
    potential.mechanics().keep_pins(x, &mut other);
    let (mut before, mut after) = (vec![Vec3::zeros(); x.len()], vec![Vec3::zeros(); x.len()]);
    potential.energy_gradient(x, &mut before);
    potential.energy_gradient(&other, &mut after);
    parallel::update(&mut after, |i, g| *g -= before[i]);
    let floor = potential.residual(&after);
    (floor >= ROUND_OFF * residual).then(|| Diagnosis {
        reason: Reason::Tolerance,
        text: format!(
            "positions have 16 digits, and a change in the last one changes forces by {floor:.1e} here, so that \
             {tolerance:.1e} is not within reach"
        ),
        advice: format!("equilibrium.tolerance = {:.0e}", 3.0 * residual.max(tolerance)),
    })
}

/// A triangle without area beside which a small force is left.
fn held(potential: &Potential, x: &[Vec3], (residual, tolerance): (f64, f64)) -> Option<Diagnosis> {
    let quality = |t: &[u32; 3]| triangle_quality(t.map(|v| x[v as usize]));
    let all = potential.sheet().triangles().iter().map(quality).enumerate();
    let (triangle, worst) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let nearly = worst < COLLAPSED && residual <= NEAR_REST_RATIO * tolerance;
    nearly.then(|| Diagnosis {
        reason: Reason::Tolerance,
        text: format!(
            "the sheet is nearly at rest, but triangle {triangle} (vertices {:?}) has collapsed (quality {worst:.1e}), and \
             the force beside a triangle without area does not fall any further",
            potential.sheet().triangles()[triangle]
        ),
        advice: format!(
            "equilibrium.tolerance = {:.0e}, or growth in smaller amounts and a finer mesh, so that nothing \
             collapses",
            3.0 * residual
        ),
    })
}
