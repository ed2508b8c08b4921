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
        ("hold", "species = 'c'\nwhere = 'rim'\nvalue = '0.1*pos(t - 0.25)'"),
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

/// What a uniform concentration is after a run of a planar disc with this effect, by theory.
fn exchanged(effect: &str, integrator: &str, location: &str) -> f64 {
    let text = format!(
        "sheet = {{ shape = 'disc', radius = 2.0, vertices = 60, planar = true }}\n\
         [kinetics]\nrates.c = '0'\ninitial.c = 0.0\nlocation = '{location}'\n\
         [time]\npolicy = 'simultaneous'\nuntil = 2.0\nintegrator = {integrator}\n[[effect]]\nspecies = 'c'\n{effect}\n"
    );
    let (_, mut simulation) = prepare(&text, &[]);
    simulation.prepare().unwrap();
    while simulation.state().time < 2.0 {
        simulation.step(2.0).unwrap_or_else(|e| panic!("{integrator}: {e}"));
    }
    let area = rumple::geometry::face_areas(simulation.sheet(), simulation.sheet().rest());
    let c = &simulation.state().species[0];
    let all: f64 = area.iter().sum();
    let per_face = |t: usize| match location {
        "face" => c[t],
        _ => simulation.sheet().triangles()[t].iter().map(|v| c[*v as usize]).sum::<f64>() / 3.0,
    };
    (0..area.len()).map(|t| area[t] * per_face(t)).sum::<f64>() / all
}

/// c' = k (c_ref - c) and c' = q L/A in t = 0 … 2, by exact solutions: inflow whose formulas read the time.
#[test]
fn flux_and_exchange_may_change_in_time() {
    let exchange = |rate: &str, reference: &str| {
        format!(
            "kind = 'exchange'\nwhere = 'all'\nper = 'area'\nrate = {rate}\nreference = {reference}"
        )
    };
    let perimeter_per_area = {
        let sheet = generate(&SheetShape::Disc { radius: 2.0 }, 60, 0).unwrap();
        let rest = sheet.rest();
        let edges = sheet.edges().iter().filter(|edge| edge.is_boundary());
        let length = |[a, b]: [u32; 2]| (rest[a as usize] - rest[b as usize]).norm();
        edges.map(|edge| length(edge.vertices)).sum::<f64>()
            / rumple::geometry::face_areas(&sheet, rest).iter().sum::<f64>()
    };
    let t: f64 = 2.0;
    let cases = [
        (exchange("2.0", "'sin(t)'"), 0.8 * t.sin() - 0.4 * t.cos() + 0.4 * (-2.0 * t).exp()),
        (exchange("'1 + t'", "1.0"), 1.0 - (-t - 0.5 * t * t).exp()),
        (
            "kind = 'flux'\nwhere = 'rim'\nvalue = '0.3*t^2'".to_owned(),
            perimeter_per_area * 0.1 * t.powi(3),
        ),
        // A pulse between two steps, of which the run must take note.
        (
            "kind = 'flux'\nwhere = 'rim'\nvalue = '5*step(t - 1.01)*step(1.02 - t)'".to_owned(),
            perimeter_per_area * 0.05,
        ),
    ];
    let integrators = [
        "{ kind = 'staggered', rtol = 1e-4, atol = 1e-4 }",
        "{ kind = 'monolithic', method = 'bdf', rtol = 1e-6, atol = 1e-6 }",
        "{ kind = 'monolithic', method = 'esdirk34', rtol = 1e-6, atol = 1e-6 }",
        "{ kind = 'explicit', method = 'tsit45', rtol = 1e-6, atol = 1e-6 }",
    ];
    for (effect, exact) in &cases {
        for integrator in integrators {
            for location in ["vertex", "face"] {
                let found = exchanged(effect, integrator, location);
                let error = (found - exact).abs() / exact.abs();
                assert!(error < 2e-3, "{effect} {integrator} {location}: {found} {exact}");
            }
        }
    }
}

/// A rate below 0 makes the concentration diverge from that of its surroundings.
#[test]
fn a_rate_of_exchange_that_becomes_negative_ends_the_run() {
    let text = |rate: &str, integrator: &str, location: &str| {
        format!(
            "sheet = {{ shape = 'disc', radius = 2.0, vertices = 60, planar = true }}\n\
             [kinetics]\nrates.c = '0'\ninitial.c = 0.0\nlocation = '{location}'\n\
             [time]\npolicy = 'simultaneous'\nuntil = 2.0\nintegrator = {integrator}\n\
             [[effect]]\nkind = 'exchange'\nspecies = 'c'\nwhere = 'rim'\nreference = 1\nrate = '{rate}'\n"
        )
    };
    for integrator in ["'staggered'", "{ kind = 'monolithic', method = 'bdf' }", "'explicit'"] {
        for location in ["vertex", "face"] {
            let (_, mut simulation) = prepare(&text("1 - t", integrator, location), &[]);
            simulation.prepare().unwrap();
            let error = loop {
                if let Err(error) = simulation.step(2.0) {
                    break error.to_string();
                }
                assert!(simulation.state().time < 2.0, "{integrator} {location}: not noticed");
            };
            let begins = "effect[0].rate: the rate of exchange of `c` becomes -";
            assert!(error.contains(begins) && error.contains("at time 1."), "{error}");
        }
    }
    let scene = rumple::scene::Scene::parse(&text("t - 1", "'explicit'", "vertex"), "s.toml", &[]);
    let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
    let error = rumple::Simulation::new(&scene.unwrap(), &search).err().unwrap().to_string();
    assert!(error.contains("effect[0].rate") && error.contains("-1"), "{error}");
}
