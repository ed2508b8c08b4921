//! What a scene does not have, and so does not pay for.

use super::effects::energies;
use super::{Line, listed};
use crate::effects;
use crate::run::Simulation;
use crate::scene::Scene;

pub(super) fn lines(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let mut lines = Vec::new();
    let mut add = |what: &str, why: &str| lines.push(Line::new(what, why));
    let listed_kinds: Vec<&str> = scene.effects.iter().map(|spec| spec.typetag_name()).collect();
    let others: Vec<&str> =
        effects::kinds().into_iter().filter(|name| !listed_kinds.contains(name)).collect();
    if !others.is_empty() {
        let why =
            "because the scene does not list them: they are not built, and nothing asks for them";
        add(&listed(&others), why);
    }
    if model.moves() {
        mechanics(scene, simulation, &mut add);
    } else {
        let why = "because no effect has an energy";
        add("no relaxation, no Hessian, no factor, no stability analysis", why);
    }
    if let Some(chemistry) = model.chemistry() {
        if chemistry.transports().is_empty() {
            let why = "because no effect transports a species: every point is on its own";
            add("no transport", why);
        }
        let observables = &chemistry.descriptor().observables;
        if !observables.is_empty() && simulation.fields.observed().is_none() {
            let names: Vec<&str> = observables.iter().map(|o| o.name.as_str()).collect();
            let what = format!("no observables ({})", listed(&names));
            add(&what, "because output.fields does not ask for them: the law is not called");
        }
    }
    lines
}

/// Absent parts of the mechanics of a sheet that moves.
fn mechanics(scene: &Scene, simulation: &Simulation, add: &mut impl FnMut(&str, &str)) {
    let model = simulation.model();
    let systems = !scene.equilibrium.linear_systems(model.mechanics(), false).is_empty();
    let rings = model.mechanics().terms().iter().map(|t| t.coupling().rings).max();
    if systems && rings == Some(1) {
        let why = "because no effect couples neighbours of neighbours, as bending does";
        add("no second ring in the matrix", why);
    }
    if systems && rings == Some(0) {
        add("no pairs of vertices in the matrix", "because no effect couples vertices");
    }
    let constrained = model.mechanics().is_constrained();
    if systems && !constrained && energies(simulation, |c| c.low_rank).is_empty() {
        add("no low-rank correction", "because no effect couples all vertices");
    }
    if energies(simulation, |c| c.pairs).is_empty() && systems {
        let why = "because no effect couples pairs that depend on the shape";
        add("the matrix keeps one pattern, analysed once", why);
    }
    if energies(simulation, |c| c.limits_steps).is_empty() {
        add(
            "no step limits except that triangles keep their orientation",
            "because no effect sets any",
        );
    }
    let grows = model.chemistry().is_some_and(|c| c.descriptor().capabilities.length_factor);
    let flows = model.internal().iter().any(|term| term.multiplies_lengths());
    if !grows && !flows && model.growth_names().next().is_none() {
        let why =
            "because no law gives a length factor and no effect grows: they are evaluated once";
        add("optimal lengths stay those at rest", why);
    }
    if !model.mechanics().depends_on_time() {
        add("no energy depends on time", "because no effect declares that: no ramp is listed");
    }
    match &scene.stability {
        None => add("no stability analysis", "because [stability] is absent"),
        Some(spec) if !spec.watch => {
            add("no stability analysis", "because stability.watch is false");
        }
        Some(_) => {}
    }
}
