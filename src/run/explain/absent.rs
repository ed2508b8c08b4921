//! What a scene does not list, and so does not pay for.

use super::{Line, listed};
use crate::effects;
use crate::run::Simulation;
use crate::scene::Scene;

pub(super) fn lines(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let mechanics = model.mechanics();
    let listed_kinds: Vec<&str> = scene.effects.iter().map(|spec| spec.typetag_name()).collect();
    let others: Vec<&str> =
        effects::kinds().into_iter().filter(|name| !listed_kinds.contains(name)).collect();
    let grows = model.chemistry().is_some_and(|c| c.descriptor().capabilities.length_factor)
        || model.internal().iter().any(|term| term.multiplies_lengths())
        || model.growth_names().next().is_some();
    let observables = model.chemistry().map_or(&[][..], |c| &c.descriptor().observables);
    let observed = observables.is_empty() || simulation.fields.observed().is_some();
    let all = [
        (
            !others.is_empty(),
            listed(&others),
            "the scene does not list them: they are not built, and nothing asks for them",
        ),
        (!model.moves(), "no relaxation, no Hessian, no factor".into(), "no effect has an energy"),
        (
            model.chemistry().is_some_and(|c| c.transports().is_empty()),
            "no transport".into(),
            "no effect transports a species: every point is on its own",
        ),
        (
            model.moves() && !grows,
            "optimal lengths stay those at rest".into(),
            "no law gives a length factor and no effect grows: they are evaluated once",
        ),
        (
            model.moves() && !mechanics.depends_on_time(),
            "no energy depends on time".into(),
            "no ramp is listed",
        ),
        (
            !scene.stability.as_ref().is_some_and(|spec| spec.watch),
            "no stability analysis".into(),
            match scene.stability {
                None => "[stability] is absent",
                Some(_) => "stability.watch is false",
            },
        ),
        (
            !observed,
            "no observables".into(),
            "output.fields does not ask for them: the law is not called",
        ),
    ];
    let absent = all.into_iter().filter(|(absent, ..)| *absent);
    absent.map(|(_, what, why)| Line::new(what, format!("because {why}"))).collect()
}
