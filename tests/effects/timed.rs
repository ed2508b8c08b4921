//! Formulas of the time in effects: what they are at a time is what the same numbers are at all times.

use rumple::effects::EffectSpec;
use rumple::sheet::{SheetShape, generate};
use rumple::{Simulation, Vec3};

use super::registered::read;
use crate::common::prepare;

/// Of position and time, and the same at t = 2.
const PAIRS: [(&str, &str); 7] = [
    (
        "kind = 'bending'\ncurvature = '0.1*t*(1 + 0.2*x)'",
        "kind = 'bending'\ncurvature = '0.2*(1 + 0.2*x)'",
    ),
    (
        "kind = 'bending'\nrest = 'mesh'\ncurvature = '0.1*t - 0.3*y'",
        "kind = 'bending'\nrest = 'mesh'\ncurvature = '0.2 - 0.3*y'",
    ),
    (
        "kind = 'bending'\nmodel = 'hinge'\ncurvature = 'sin(t - x)'",
        "kind = 'bending'\nmodel = 'hinge'\ncurvature = 'sin(2 - x)'",
    ),
    (
        "kind = 'active-tension'\nvalue = 't*(1 + x)'",
        "kind = 'active-tension'\nvalue = '2*(1 + x)'",
    ),
    (
        "kind = 'active-tension'\nvalue = 'c*t + y'\nfibre = [1, 0.5, 0]",
        "kind = 'active-tension'\nvalue = '2*c + y'\nfibre = [1, 0.5, 0]",
    ),
    (
        "kind = 'load'\nwhere = 'all'\nforce = { per-area = [0, 't*x', 'exp(x - t)'] }",
        "kind = 'load'\nwhere = 'all'\nforce = { per-area = [0, '2*x', 'exp(x - 2)'] }",
    ),
    (
        "kind = 'load'\nwhere = 'rim'\nforce = { per-length = ['t^2', 0, 1] }\nramp = { formula = 't' }",
        "kind = 'load'\nwhere = 'rim'\nforce = { per-length = [4, 0, 1] }\nramp = { formula = 't' }",
    ),
];

fn with(effect: &str) -> Simulation {
    let text = format!(
        "sheet = {{ shape = 'disc', radius = 2.0, vertices = 120 }}\ntime = {{ until = 3.0 }}\n\
         material = {{ young = 10.0, poisson = 0.3, thickness = 0.3 }}\n\
         kinetics = {{ rates = {{ c = '0' }}, initial = {{ c = {{ formula = '1 + 0.3*x' }} }} }}\n\
         [[effect]]\nkind = 'stretching'\n[[effect]]\n{effect}\n"
    );
    let (_, mut simulation) = prepare(&text, &[]);
    for x in &mut simulation.state_mut().x {
        x.z = 0.1 * (x.x + 2.0 * x.y).sin();
    }
    simulation
}

fn at(simulation: &mut Simulation, time: f64) -> (Vec<f64>, Vec<Vec3>) {
    simulation.state_mut().time = time;
    let mut at = simulation.evaluate();
    (at.energies().unwrap(), at.gradient().unwrap())
}

#[test]
fn a_formula_of_the_time_is_the_same_formula_at_every_time() {
    for (timed, fixed) in PAIRS {
        let (mut timed_one, mut fixed_one) = (with(timed), with(fixed));
        let (first, _) = at(&mut timed_one, 0.0);
        let (energies, gradient) = at(&mut timed_one, 2.0);
        let (expected, forces) = at(&mut fixed_one, 2.0);
        let scale = expected[1].abs();
        assert!((first[1] - energies[1]).abs() > 1e-3 * scale, "{timed}");
        assert!((energies[1] - expected[1]).abs() < 1e-12 * scale, "{timed}");
        let largest = forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
        for (f, g) in gradient.iter().zip(&forces) {
            assert!((f - g).norm() < 1e-12 * largest, "{timed}");
        }
        // And back.
        assert_eq!(at(&mut timed_one, 0.0).0, first, "{timed}");
    }
}

/// Steps end where formulas of the time have kinks.
#[test]
fn kinks_of_the_formulas_are_breakpoints() {
    let sheet = generate(&SheetShape::Disc { radius: 1.0 }, 50, 1).unwrap();
    for (kind, table) in [
        ("bending", "curvature = '0.1*max(t - 0.25, x - x)'"),
        ("active-tension", "value = '0.1*step(t - 0.25)'"),
        ("load", "where = 'all'\nforce = { along-normal = 'max(t - 0.25, 0)' }"),
        ("growth", "fibre = [1, 0, 0]\nshear = '0.1*max(t - 0.25, 0)'"),
    ] {
        let spec: Box<dyn EffectSpec> = read(kind, table);
        let times = spec.time_dependence(&sheet, 1.0).breakpoints;
        assert!(times.iter().any(|t| (t - 0.25).abs() < 1e-9), "{kind}: {times:?}");
    }
}

#[test]
fn formulas_of_the_time_that_cannot_be_are_refused() {
    let refused = |effect: &str| {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 2.0, vertices = 120 }}\ntime = {{ until = 3.0 }}\n\
             material = {{ young = 10.0, poisson = 0.3, thickness = 0.3 }}\n\
             [[effect]]\nkind = 'stretching'\n[[effect]]\n{effect}\n"
        );
        let scene = rumple::scene::Scene::parse(&text, "s.toml", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        Simulation::new(&scene, &search).err().unwrap().to_string()
    };
    for (effect, words) in [
        (
            "kind = 'bending'\ncurvature = '1/t'",
            "effect[1].curvature: it is inf at vertex 0 at time 0",
        ),
        (
            "kind = 'bending'\nmodel = 'hinge'\ncurvature = 't'\nremodelling = { time = 1.0 }",
            "effect[1].curvature: rest angles that flow do not read",
        ),
        (
            "kind = 'load'\nwhere = 'all'\nforce = { along-normal = 'log(t)' }",
            "effect[1].force: it is -inf at triangle 0 at time 0",
        ),
        ("kind = 'active-tension'\nvalue = 'time'", "effect[1].value: unknown name `time`"),
    ] {
        let error = refused(effect);
        assert!(error.contains(words), "{error}");
    }
}
