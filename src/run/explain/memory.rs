//! Memory: counted by making the scene ready and evaluating it once; what a run adds is estimated.

use super::Line;
use crate::Vec3;
use crate::run::costs::{Costs, bytes};
use crate::run::{Result, Simulation};
use crate::scene::Scene;
use crate::tally::allocated;

pub(super) fn lines(scene: &Scene, simulation: &mut Simulation) -> Result<Vec<Line>> {
    let vertices = simulation.sheet().vertex_count();
    let mut evaluation = simulation.evaluate();
    if evaluation.model().moves() {
        evaluation.gradient()?;
        evaluation.energies()?;
    }
    evaluation.rates()?;
    let (moves, species) = (
        simulation.model().moves(),
        simulation.state().species.iter().map(Vec::len).sum::<usize>(),
    );
    let mut lines = Vec::new();
    if allocated().is_some() {
        let costs = Costs::of(scene, simulation);
        let kept = costs.bytes.unwrap_or_default() - costs.reserved();
        for part in costs.parts.iter().filter(|part| part.bytes > 0) {
            let what = format!("{:>9}  {}", bytes(part.bytes), part.name);
            lines.push(Line::new(what, String::new()));
        }
        lines.push(Line::new(
            match costs.reserved() {
                0 => format!("{:>9}  in all", bytes(kept)),
                _ => format!("{:>9}  in all, without the room for matrix products", bytes(kept)),
            },
            "counted: allocated by making the scene ready and evaluating its start once",
        ));
    } else {
        let why = "this program's allocator does not count";
        lines.push(Line::new("not counted", why));
    }
    let state = vertices * size_of::<Vec3>() + species * size_of::<f64>();
    let estimate = |count: usize| bytes(i64::try_from(count).unwrap_or(i64::MAX));
    lines.push(Line::new(
        format!("{:>9}  a state: positions and species", estimate(state)),
        "estimated; a run keeps some of them, and solvers vectors of this size",
    ));
    let history = if moves { scene.equilibrium.history_bytes(vertices) } else { 0 };
    if history > 0 {
        lines.push(Line::new(
            format!("{:>9}  history of the relaxation at most", estimate(history)),
            "estimated from equilibrium.memory",
        ));
    }
    if scene.time.integrator.uses_jacobian() {
        lines.push(Line::new(
            "  and the Jacobian of the coupled system with its factor",
            "made in the first step, not counted here: `rumple explain DIR` after a run counts it",
        ));
    }
    if moves && scene.stability.as_ref().is_some_and(|s| s.watch) {
        lines.push(Line::new(
            "  and the Hessian of the stability analysis with its LDLᵀ factor",
            "made when a run begins, not counted here",
        ));
    }
    Ok(lines)
}
