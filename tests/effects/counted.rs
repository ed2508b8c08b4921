//! The promise, counted: what a scene does not list costs nothing, and what it lists costs the same whatever
//! else it lists.
//!
//! Models of each effect alone, pairs and all are evaluated at the same shapes on one thread; the tally of
//! each says how often what was evaluated, the allocator how often memory was allocated and how much was kept.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rumple::Simulation;
use rumple::effects::{Effect, EffectContext, HessianPart, Material, Measure};
use rumple::geometry::VertexArea;
use rumple::kinetics::{Location, PluginSearch};
use rumple::model::{
    Chemistry, Drag, EvaluationBuffers, Mechanics, MechanicsParts, Model, ParameterFields, Policy,
    Signals, State, TensionReading,
};
use rumple::run::laws;
use rumple::scene::Scene;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple_numerics::linear::BlockMatrix;

use crate::common::{Noise, allocations, kept, prepare};

/// What scenes list here: a name, the tables, and the meters that they bring.
const PARTS: [(&str, &str, &[&str]); 19] = [
    ("bonds", "kind = 'stretching'", &["effect stretching"]),
    ("stvk", "kind = 'stretching'\nmodel = 'stvk'", &["effect stretching"]),
    ("meyer", "kind = 'bending'", &["effect bending"]),
    ("hinges", "kind = 'bending'\nmodel = 'hinge'", &["effect bending"]),
    ("shell", "kind = 'bending'\nrest = 'mesh'", &["effect bending"]),
    ("curved", "kind = 'bending'\ncurvature = '0.1*x'", &["effect bending"]),
    (
        "shell of hinges",
        "kind = 'bending'\nmodel = 'hinge'\nrest = 'mesh'\ncurvature = 0.1",
        &["effect bending"],
    ),
    ("pin", "kind = 'pin'\nwhere = { half-space = { normal = [0, 0, 1] } }\naxes = 'z'", &[]),
    ("load", "kind = 'load'\nwhere = 'all'\nforce = { per-area = [0.1, 0, 0] }", &["effect load"]),
    ("pressure", "kind = 'pressure'\nvalue = 0.1", &["effect pressure"]),
    ("foundation", "kind = 'foundation'\nwhere = 'all'\nstiffness = 3.0", &["effect foundation"]),
    ("contact", "kind = 'contact'\ndistance = 0.02\nstiffness = 1.0", &["effect contact"]),
    (
        "obstacle",
        "kind = 'obstacle'\nshape = { plane = { point = [0, 0, -9], normal = [0, 0, 1] } }\n\
         distance = 0.1\nstiffness = 1.0",
        &["effect obstacle"],
    ),
    ("volume", "kind = 'volume'\nstiffness = 5.0", &["effect volume"]),
    ("exact volume", "kind = 'volume'\nexact = true", &["effect constraint volume"]),
    ("growth", "kind = 'growth'\nfactor = '1 + 0.01*x'", &["effect growth", LENGTHS]),
    (
        "diffusion",
        "kind = 'diffusion'\nspecies = 'c'\ncoefficient = 0.1",
        &["effect diffusion of c"],
    ),
    (
        "curvature law",
        "rates.c = '0.1*H - c'",
        &["law the law `kinetics`", "signal curvature of the sheet", "signal mean_curvature"],
    ),
    (
        "growing law",
        "rates.c = '0.1 - c'\nlength_factor = '1 + 0.01*c'",
        &["law the law `kinetics`", LENGTHS],
    ),
];

const LENGTHS: &str = "geometry optimal lengths and areas";

/// The scenes: nothing, each part alone, pairs, nearly all and all that can be together.
const COMBINATIONS: [&[&str]; 12] = [
    &[],
    &["bonds", "meyer"],
    &["bonds", "volume"],
    &["bonds", "exact volume"],
    &["stvk", "hinges"],
    &["meyer", "pin"],
    &["bonds", "meyer", "contact"],
    &["bonds", "growth"],
    &["diffusion", "curvature law"],
    &["bonds", "growing law"],
    &["bonds", "meyer", "pin", "load", "pressure", "foundation", "volume"],
    &[
        "bonds",
        "meyer",
        "pin",
        "load",
        "pressure",
        "foundation",
        "volume",
        "growth",
        "diffusion",
        "curvature law",
    ],
];

fn scenes() -> Vec<Vec<&'static str>> {
    // Diffusion alone has no species to act on.
    let alone = PARTS.iter().map(|p| vec![p.0]).filter(|p| p[0] != "diffusion");
    COMBINATIONS.iter().map(|scene| scene.to_vec()).chain(alone).collect()
}

/// A scene as text; its laws come from the parts that are no effects.
fn text(parts: &[&str]) -> String {
    let mut text = String::from(
        "sheet = { shape = 'sphere', radius = 3.0, vertices = 200 }\ntime = { until = 1.0 }\n\
         material = { young = 10.0, poisson = 0.3, thickness = 0.1 }\n",
    );
    let tables = |law: bool| {
        let mine = PARTS.iter().filter(move |part| parts.contains(&part.0));
        mine.filter(move |part| part.0.ends_with("law") == law).map(|part| part.1)
    };
    for table in tables(false) {
        text += &format!("[[effect]]\n{table}\n");
    }
    for table in tables(true) {
        text += &format!("[kinetics]\n{table}\ninitial.c = 0.5\n");
    }
    text
}

/// The model of a scene, without a way to relax it: that needs stretching.
fn model(sheet: &Arc<Sheet>, parts: &[&str]) -> Arc<Model> {
    let scene = Scene::parse(&text(parts), "counted.toml", &[]).unwrap_or_else(|e| panic!("{e}"));
    let material = Material { young: 10.0, poisson: 0.3, thickness: 0.1 };
    let law =
        laws::load(&scene, &PluginSearch::in_directories(Vec::new()), &mut Vec::new()).unwrap();
    let kinetics = law.map(|law| law.kinetics);
    let place = Location::Vertex;
    let context = EffectContext {
        sheet,
        material: Some(&material),
        varying: None,
        kinetics: kinetics.as_ref().map(|k| (k.descriptor(), place)),
        measure: Measure::Concentration,
        read: None,
    };
    let mut all = Effect::default();
    let mut pins = vec![[false; 3]; sheet.vertex_count()];
    for spec in &scene.effects {
        let effect = spec.build(&context).unwrap();
        all.energies.extend(effect.energies);
        all.constraints.extend(effect.constraints);
        all.growth.extend(effect.growth);
        all.transports.extend(effect.transports);
        for (pins, more) in pins.iter_mut().zip(effect.pins.unwrap_or_default()) {
            (0..3).for_each(|a| pins[a] |= more[a]);
        }
    }
    let (terms, constraints) = (all.energies, all.constraints);
    let parts = MechanicsParts { terms, pins, constraints, ..MechanicsParts::default() };
    let mechanics = Mechanics::from_parts(Arc::clone(sheet), parts).unwrap();
    let chemistry = kinetics.map(|kinetics| {
        let wanted = kinetics.descriptor().signals.iter().map(|read| read.signal).collect();
        let area = VertexArea::new(sheet, rumple::geometry::AreaRule::default());
        let reading = TensionReading::default();
        let signals =
            Signals::new(wanted, place, area, Some(&(&material).into()), reading, Vec::new());
        let fields = ParameterFields::default();
        let (transports, measure) = (all.transports, Measure::Concentration);
        Chemistry::new(sheet, kinetics, fields, place, signals, transports, measure)
    });
    let weights = Policy::default().mass_weights();
    Arc::new(
        Model::new(mechanics, chemistry, weights, Drag::per_vertex(1.0)).with_growth(all.growth),
    )
}

/// How often what was done, by the meter.
type Counts = BTreeMap<String, Vec<(&'static str, u64)>>;

fn counts(model: &Model) -> Counts {
    let all = model.tally().costs().into_iter();
    let all = all.filter(|c| c.counts.iter().any(|(_, n)| *n > 0) || !c.time.is_zero());
    all.map(|c| {
        let counts = c.counts.into_iter().filter(|(_, n)| *n > 0).collect();
        (format!("{} {}", c.group, c.name), counts)
    })
    .collect()
}

const ROUNDS: u64 = 4;

/// Evaluates everything about the model at several shapes on one thread: what was counted, and of every round the
/// allocations and the bytes kept at its end.
fn evaluated(sheet: &Arc<Sheet>, parts: &[&str]) -> (Counts, Vec<(usize, isize)>) {
    let model = model(sheet, parts);
    let mut noise = Noise::new(3);
    let points = model.chemistry().map(|c| c.points(sheet));
    let species = points.map(|n| vec![vec![0.5; n]]).unwrap_or_default();
    let mut state = State { x: sheet.rest().to_vec().into(), species, ..State::default() };
    let mut memory = EvaluationBuffers::default();
    let mut rounds = Vec::new();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let mut matrix = BlockMatrix::zeros(Arc::clone(model.mechanics().pattern()));
        for _ in 0..ROUNDS {
            sheet
                .rest()
                .iter()
                .zip(&mut state.x)
                .for_each(|(x, moved)| *moved = x + 0.01 * noise.vector());
            let (before, held) = (allocations(), kept());
            let mut at = model.at(&state, &mut memory);
            at.energies().unwrap();
            at.gradient().unwrap();
            at.rates().unwrap();
            let potential = at.potential().unwrap();
            potential.hessian(&state.x, HessianPart::Full, &mut matrix).unwrap();
            potential.low_rank(&state.x, HessianPart::Full);
            rounds.push((allocations() - before, kept() - held));
        }
    });
    (counts(&model), rounds)
}

fn sheet() -> Arc<Sheet> {
    Arc::new(generate(&SheetShape::Sphere { radius: 3.0, irregular: true }, 200, 1).unwrap())
}

#[test]
fn what_a_scene_does_not_list_is_not_counted_at_all() {
    let sheet = sheet();
    assert!(scenes().len() >= 15);
    for scene in scenes() {
        let (last, _) = evaluated(&sheet, &scene);
        let listed = PARTS.iter().filter(|part| scene.contains(&part.0));
        let mut expected: BTreeSet<&str> = listed.flat_map(|part| part.2).copied().collect();
        // Lengths that nothing grows are set once and for all.
        if !scene.contains(&"growth") && !scene.contains(&"growing law") {
            expected.remove(LENGTHS);
        }
        let found: BTreeSet<&str> = last.keys().map(String::as_str).collect();
        assert_eq!(found, expected, "{scene:?}");
    }
}

#[test]
fn every_listed_effect_is_evaluated_as_often_as_asked_and_no_more() {
    let sheet = sheet();
    for scene in scenes() {
        let (last, _) = evaluated(&sheet, &scene);
        let grows = scene.contains(&"growth") || scene.contains(&"growing law");
        // A constraint is balanced by the forces of each shape, once more, and compared with the sheet at rest.
        let kept = u64::from(scene.contains(&"exact volume"));
        for (name, counts) in &last {
            let count =
                |what: &str| counts.iter().find(|(label, _)| *label == what).map_or(0, |(_, n)| *n);
            let expected: Vec<(&str, u64)> = match name.as_str() {
                "effect growth" => vec![("length factor", ROUNDS)],
                "effect diffusion of c" => {
                    vec![("operator on a shape", ROUNDS), ("rates", ROUNDS)]
                }
                LENGTHS => vec![("evaluations", ROUNDS)],
                n if n.starts_with("law") => {
                    let factor = if scene.contains(&"growing law") { ROUNDS } else { 0 };
                    vec![("rates", ROUNDS), ("length factor", factor)]
                }
                n if n.starts_with("signal") => vec![("values", ROUNDS), ("derivatives", 0)],
                // By itself, in the gradient, in the second derivatives and in their part of low rank.
                "effect constraint volume" => {
                    vec![("energy and gradient", 4 * ROUNDS + 1), ("Hessian", ROUNDS)]
                }
                n => vec![
                    ("energy", ROUNDS),
                    ("energy and gradient", (1 + kept) * ROUNDS),
                    ("Hessian", ROUNDS + kept),
                    ("conditions", 1 + if grows { ROUNDS } else { 0 }),
                    ("low-rank terms", if n == "effect volume" { ROUNDS } else { 0 }),
                    ("pairs", 0),
                    ("step limits", 0),
                    ("derivatives by lengths", 0),
                ],
            };
            for (what, times) in expected {
                assert_eq!(count(what), times, "{scene:?}: {name}, {what}");
            }
        }
    }
}

/// Once its memory is there, no scene keeps more from evaluation to evaluation, and all allocate as often in each.
#[test]
fn evaluations_keep_nothing() {
    let sheet = sheet();
    for scene in scenes() {
        let (_, rounds) = evaluated(&sheet, &scene);
        let later = &rounds[1..];
        assert!(
            later.iter().all(|(count, kept)| *kept == 0 && *count == later[0].0),
            "{scene:?}: {rounds:?}"
        );
    }
}

/// A relaxation evaluates every energy equally often: as often as it says.
#[test]
fn a_relaxation_evaluates_each_energy_as_often_as_it_reports() {
    for method in ["lbfgs", "newton", "descent"] {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 6.0, vertices = 200, bump = {{ amplitude = 0.3, width = 2.0 }} }}
             time = {{ until = 1.0 }}
             material = {{ young = 1e3, poisson = 0.3, thickness = 0.3 }}
             equilibrium = {{ method = '{method}', tolerance = 1e-3 }}
             effect = [
                 {{ kind = 'stretching' }},
                 {{ kind = 'bending' }},
                 {{ kind = 'foundation', where = 'all', stiffness = 1.0 }},
             ]"
        );
        let (_, mut simulation) = prepare(&text, &[]);
        let counted = |simulation: &Simulation, what: &str| -> Vec<u64> {
            let costs = simulation.model().tally().costs();
            let effects = costs.iter().filter(|cost| cost.group == "effect");
            let of = |counts: &[(&str, u64)]| {
                counts.iter().find(|(label, _)| *label == what).map_or(0, |(_, n)| *n)
            };
            effects.map(|cost| of(&cost.counts)).collect()
        };
        let before = counted(&simulation, "energy and gradient");
        let work = simulation.model().tally().work();
        simulation.relax().unwrap_or_else(|e| panic!("{method}: {e}"));
        let done = simulation.model().tally().work() - work;
        let after = counted(&simulation, "energy and gradient");
        assert_eq!(after.len(), 3);
        for (before, after) in before.iter().zip(&after) {
            assert_eq!(after - before, done.gradients, "{method}");
        }
        let hessians = counted(&simulation, "Hessian");
        assert!(hessians.iter().all(|n| *n == hessians[0]), "{method}: {hessians:?}");
        assert_eq!(hessians[0] > 0, ["lbfgs", "newton"].contains(&method), "{method}");
    }
}
