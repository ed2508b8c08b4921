//! What cannot be is said where the scene says it, and nothing that is not a number counts as rest.

use rumple::effects::EnergyTerm;
use rumple::effects::prelude::*;
use rumple::model::{Mechanics, Potential};
use rumple::solve::SolveError;
use rumple::solve::equilibrium::{Goal, Lbfgs, LbfgsSpec, explained, relax};
use rumple::{Simulation, kinetics::PluginSearch};

use crate::common::irregular;

fn made(sheet: &str, effects: &str) -> Result<Simulation, rumple::Error> {
    let text = format!(
        "sheet = {{ {sheet}, vertices = 300 }}
        material = {{ young = 1e3, poisson = 0.3333333333333333, thickness = 0.5 }}
        time = {{ until = 2.0, integrator = {{ kind = 'staggered', method = 'euler', step = 0.25 }} }}
        effect = [ {{ kind = 'stretching' }}, {{ kind = 'bending' }}, {effects} ]"
    );
    let scene = rumple::scene::Scene::parse(&text, "scene.toml", &[])?;
    Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))
}

const STRIP: &str = "shape = 'rectangle', width = 12.0, height = 4.0";
const SPHERE: &str = "shape = 'sphere', radius = 5.0";

#[test]
fn what_contradicts_itself_is_refused_at_its_key() {
    let pin =
        |by: &str| format!("{{ kind = 'pin', where = 'rim', axes = 'z', displacement = {by} }}");
    for (sheet, effects, key) in [
        (STRIP, format!("{}, {}", pin("[0, 0, 1]"), pin("[0, 0, -1]")), "effect[3].displacement"),
        (STRIP, pin("[1, 0, 1]"), "effect[2].displacement"),
        (
            STRIP,
            "{ kind = 'pressure', value = 1.0, ramp = { formula = '1/t' } }".into(),
            "effect[2].ramp",
        ),
        (
            STRIP,
            "{ kind = 'pressure', value = 1.0, ramp = { points = [] } }".into(),
            "effect[2].ramp",
        ),
        (
            SPHERE,
            "{ kind = 'volume', stiffness = 1.0, ramp = { formula = 't - 1' } }".into(),
            "effect[2].ramp",
        ),
        (
            SPHERE,
            "{ kind = 'volume', exact = true }, { kind = 'volume', exact = true, target = { share = 2.0 } }"
                .into(),
            "effect",
        ),
        (
            STRIP,
            "{ kind = 'diffusion', species = 'c', coefficient = 1.0 }".into(),
            "effect[2].kind",
        ),
    ] {
        match made(sheet, &effects) {
            Ok(_) => panic!("{effects} is accepted"),
            Err(rumple::Error::Scene(error)) => {
                let said = error.rendered(false);
                assert!(said.contains(key), "{effects}: {said}");
            }
            Err(error) => panic!("{effects}: {error}"),
        }
    }
    // The same twice does not contradict.
    assert!(made(STRIP, &format!("{}, {}", pin("[0, 0, 1]"), pin("[0, 0, 1]"))).is_ok());
}

#[test]
fn a_target_that_becomes_no_volume_ends_the_run_by_name() {
    for kind in ["stiffness = 10.0", "exact = true"] {
        let effect = format!("{{ kind = 'volume', {kind}, ramp = {{ formula = '1 - t' }} }}");
        let mut simulation = made(SPHERE, &effect).unwrap_or_else(|e| panic!("{e}"));
        simulation.prepare().unwrap_or_else(|e| panic!("{e}"));
        let error = loop {
            match simulation.step(2.0) {
                Ok(_) => assert!(simulation.state().time < 1.0, "{kind}"),
                Err(error) => break error,
            }
        };
        assert!(error.to_string().contains("volume"), "{kind}: {error}");
    }
}

struct Nan;

impl Energy for Nan {
    type Work = ();

    fn name(&self) -> &'static str {
        "nan"
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn evaluate(&self, _: &Shape<'_>, (): &mut (), _: Option<&mut [Vec3]>) -> f64 {
        f64::NAN
    }

    fn add_hessian(&self, _: &Shape<'_>, (): &mut (), _: HessianPart, _: &mut BlockMatrix) {}
}

#[test]
fn an_energy_that_is_no_number_is_not_at_rest_though_nothing_pulls() {
    let sheet = std::sync::Arc::new(irregular(6, 5, 0.2));
    let material = Material { young: 10.0, poisson: 0.3, thickness: 0.1 };
    let weight = rumple::effects::Stretching::default().weight;
    let terms = vec![
        EnergyTerm::new(rumple::effects::BondStretching::new(&material, weight)),
        EnergyTerm::new(Nan),
    ];
    let mechanics =
        Mechanics::new(sheet.clone(), terms, vec![[false; 3]; sheet.vertex_count()]).unwrap();
    let mut potential = Potential::new(&mechanics);
    let mut lbfgs = Lbfgs::new(&mechanics, LbfgsSpec::default()).unwrap();
    let mut x = sheet.rest().to_vec();
    let goal = Goal { tolerance: 1e-6, max_iterations: 100, ..Goal::default() };
    let error = relax(&mut lbfgs, &mut potential, &mut x, &goal).unwrap_err();
    match explained(error, &mut potential, &x, 1e-6) {
        SolveError::EffectNotFinite { effect, .. } => assert_eq!(effect, "nan"),
        other => panic!("{other}"),
    }
}

/// A number beyond the vertices panicked; corners far apart passed `check`, and the run panicked where it assembled them.
#[test]
fn elements_with_impossible_corners_are_refused_with_their_numbers() {
    struct Spring;

    impl Element<2> for Spring {
        fn gradient(&self, [a, b]: &[Vec3; 2]) -> (f64, [Vec3; 2]) {
            (0.5 * (b - a).norm_squared(), [a - b, b - a])
        }

        fn hessian(&self, _: &[Vec3; 2], _: HessianPart) -> [[Block; 2]; 2] {
            let k = Block::identity();
            [[k, -k], [-k, k]]
        }
    }

    let sheet = irregular(6, 5, 0.2);
    let count = u32::try_from(sheet.vertex_count()).unwrap();
    let [a, b] = sheet.edges()[0].vertices;
    let made = |corners| Elements::new("springs", &sheet, vec![[a, b], corners], |_, _| Spring);
    let refused = |corners| made(corners).map(|_| ()).unwrap_err().message;
    let edges = made(sheet.edges()[1].vertices).unwrap();
    assert_eq!(edges.coupling(), Coupling::ONE_RING);
    let message = refused([0, count]);
    let expected = format!(
        "element 1 of `springs` has the corners [0, {count}]: there is no vertex {count}, the sheet has {count}"
    );
    assert_eq!(message, expected);
    assert!(refused([3, 3]).ends_with("vertex 3 twice"));
    let far = format!("vertices 0 and {} are more than two edges apart", count - 1);
    assert!(refused([0, count - 1]).ends_with(&far));
    // Across an edge: neighbours of neighbours.
    let edge = sheet.edges().iter().find(|edge| !edge.is_boundary()).unwrap();
    let opposite = edge.triangles.map(|t| {
        let corners = sheet.triangles()[t as usize];
        *corners.iter().find(|v| !edge.vertices.contains(v)).unwrap()
    });
    assert_eq!(made(opposite).unwrap().coupling(), Coupling::TWO_RINGS);
}
