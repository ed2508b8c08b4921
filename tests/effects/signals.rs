//! Fluxes and exchanges that read signals of the shape.

use rumple::kinetics::Signal;
use rumple::{Simulation, Vec3};

use super::registered::read;
use crate::common::prepare;

/// A strip that pins stretch along x, with a law of this rate and these effects of the species.
fn stretched(rate: &str, effects: &str, time: &str) -> String {
    format!(
        "sheet = {{ shape = 'rectangle', width = 4.0, height = 2.0, vertices = 60, planar = true }}\n\
         material = {{ young = 100.0, poisson = 0.3, thickness = 0.1, drag = {{ per-area = 1.0 }} }}\n\
         time = {{ until = 1.0, {time} }}\n\
         [kinetics]\nrates.c = '{rate}'\ninitial.c = 0.5\n\
         [[effect]]\nkind = 'stretching'\n\
         [[effect]]\nkind = 'pin'\naxes = 'xy'\nwhere = {{ half-space = {{ point = [-1.99, 0, 0], normal = [-1, 0, 0] }} }}\n\
         [[effect]]\nkind = 'pin'\naxes = 'xy'\nwhere = {{ half-space = {{ point = [1.99, 0, 0], normal = [1, 0, 0] }} }}\n\
         displacement = [0.6, 0.2, 0]\nramp = {{ formula = 't' }}\n\
         [[effect]]\nkind = 'diffusion'\nspecies = 'c'\ncoefficient = 0.1\n{effects}"
    )
}

fn effect(table: &str) -> String {
    format!("[[effect]]\nspecies = 'c'\n{table}\n")
}

/// The species at the end of a run.
fn end(text: &str) -> Vec<f64> {
    let (_, mut simulation) = prepare(text, &[]);
    simulation.prepare().unwrap();
    while simulation.state().time < 1.0 {
        simulation.step(1.0).unwrap_or_else(|e| panic!("{text}: {e}"));
    }
    simulation.state().species[0].clone()
}

/// A source per area on the whole sheet is a rate of the law: both give the same runs under every policy.
#[test]
fn sources_that_read_signals_are_those_of_a_law() {
    let slowed = "1/(1 + pos(tension)/2)";
    let source = |value: &str| effect(&format!("kind = 'flux'\nwhere = 'all'\nvalue = {value}"));
    let exchange = |rate: &str, reference: &str| {
        let keys = format!("rate = {rate}\nreference = {reference}");
        effect(&format!("kind = 'exchange'\nwhere = 'all'\nper = 'area'\n{keys}"))
    };
    let quoted = format!("'{slowed}'");
    let cases = [
        (source(&quoted), format!("{slowed} - J*c"), Some("-J*c")),
        (exchange(&quoted, "0.3"), format!("{slowed}*(0.3 - c)"), None),
        (exchange("2.0", &quoted), format!("2*({slowed} - c)"), None),
        (exchange("'1 + J*t'", &quoted), format!("(1 + J*t)*({slowed} - c)"), None),
    ];
    let staggered = "integrator = { kind = 'staggered', rtol = 1e-4, atol = 1e-4 }";
    let monolithic = "integrator = { kind = 'monolithic', rtol = 1e-5, atol = 1e-5 }";
    for policy in ["quasi-static", "simultaneous", "chemistry-fast"] {
        for integrator in [staggered, monolithic] {
            let time = format!("policy = '{policy}', {integrator}");
            for (effects, law, beside) in &cases {
                let by_effect = end(&stretched(beside.unwrap_or("0"), effects, &time));
                let by_law = end(&stretched(law, "", &time));
                let without = end(&stretched(&law.replace("tension", "(0*J)"), "", &time));
                let apart = |a: &[f64], b: &[f64]| {
                    a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
                };
                let (error, size) = (apart(&by_effect, &by_law), apart(&without, &by_law));
                assert!(
                    error < 2e-4 * size.max(1e-3),
                    "{policy}, {integrator}, {effects}: {error:e} {size}"
                );
            }
        }
    }
}

/// Shares of the vertices of the boundary length of the current shape.
fn lengths(simulation: &Simulation) -> Vec<f64> {
    let (sheet, x) = (simulation.sheet(), &simulation.state().x);
    let mut shares = vec![0.0; x.len()];
    for edge in sheet.edges().iter().filter(|edge| edge.is_boundary()) {
        let [a, b] = edge.vertices.map(|v| v as usize);
        let length: f64 = (x[a] - x[b]).norm();
        shares[a] += 0.5 * length;
        shares[b] += 0.5 * length;
    }
    shares
}

/// `Σ A⁰ C`.
fn total(simulation: &Simulation) -> f64 {
    let (sheet, c) = (simulation.sheet(), &simulation.state().species[0]);
    let of = |corners: &[u32; 3]| {
        let [p, q, r] = corners.map(|v| sheet.rest()[v as usize]);
        let mean: f64 = corners.iter().map(|v| c[*v as usize]).sum::<f64>() / 3.0;
        let normal: Vec3 = (q - p).cross(&(r - p));
        0.5 * normal.norm() * mean
    };
    sheet.triangles().iter().map(of).sum()
}

/// What flows in at a time: `∮ 1/(1 + pos(σ)) - 0.2 c/J`.
fn inflow(simulation: &mut Simulation) -> f64 {
    let shares = lengths(simulation);
    let signals = simulation.evaluate().signals().unwrap().clone();
    let wanted = simulation.model().chemistry().unwrap().signals().wanted();
    assert_eq!(wanted, [Signal::Tension, Signal::AreaRatio]);
    let area = |x: &[Vec3]| {
        let faces = rumple::geometry::face_areas(simulation.sheet(), x);
        let mut areas = vec![0.0; x.len()];
        for (corners, face) in simulation.sheet().triangles().iter().zip(faces) {
            corners.iter().for_each(|v| areas[*v as usize] += face / 3.0);
        }
        areas
    };
    let (now, rest) = (area(&simulation.state().x), area(simulation.sheet().rest()));
    let c = &simulation.state().species[0];
    let at = |i: usize| 1.0 / (1.0 + signals[0][i].max(0.0)) - 0.2 * c[i] * rest[i] / now[i];
    (0..c.len()).map(|i| shares[i] * at(i)).sum()
}

/// The total changes by what flows in through the boundary: to round-off in a step of Euler, of the shape and the tension at its
/// start, and by the integral over time with others.
#[test]
fn totals_change_by_what_flows_in() {
    let effects = effect("kind = 'flux'\nwhere = 'rim'\nvalue = '1/(1 + pos(tension))'")
        + &effect(
            "kind = 'exchange'\nwhere = 'rim'\nrate = '0.1*J + 0.2 - 0.1*J'\nreference = 0.0",
        );
    let scene = |integrator: &str| {
        let time = format!("policy = 'simultaneous', integrator = {integrator}");
        stretched("0", &effects, &time).replace("initial.c", "measure = 'amount'\ninitial.c")
    };
    let (_, mut simulation) = prepare(&scene("{ kind = 'explicit', step = 2e-4 }"), &[]);
    simulation.prepare().unwrap();
    for _ in 0..500 {
        let (before, flow) = (total(&simulation), inflow(&mut simulation));
        let length = simulation.step(1.0).unwrap().length;
        let error = total(&simulation) - before - length * flow;
        assert!(error.abs() < 1e-13 * before.abs(), "{error:e}");
    }
    for integrator in [
        "{ kind = 'staggered', rtol = 1e-4, atol = 1e-4, longest_step = 0.02 }",
        "{ kind = 'monolithic', rtol = 1e-6, atol = 1e-6 }",
    ] {
        let (_, mut simulation) = prepare(&scene(integrator), &[]);
        simulation.prepare().unwrap();
        let (start, mut flow) = (total(&simulation), inflow(&mut simulation));
        let (first, mut sum) = (flow, 0.0);
        while simulation.state().time < 1.0 {
            let length = simulation.step(1.0).unwrap().length;
            let next = inflow(&mut simulation);
            sum += 0.5 * length * (flow + next);
            flow = next;
        }
        let change = total(&simulation) - start;
        assert!((change / sum - 1.0).abs() < 1e-3, "{integrator}: {change} {sum}");
        assert!((flow / first - 1.0).abs() > 0.2, "{integrator}: {flow} {first}");
    }
}

/// Only signals that a law or a transport reads are evaluated.
#[test]
fn only_signals_that_are_read_are_evaluated() {
    let wanted = |rate: &str, value: &str| {
        let effects = effect(&format!("kind = 'flux'\nwhere = 'rim'\nvalue = {value}"));
        let (_, simulation) = prepare(&stretched(rate, &effects, "policy = 'simultaneous'"), &[]);
        simulation.model().chemistry().unwrap().signals().wanted().to_vec()
    };
    assert_eq!(wanted("0", "'1 + x*t'"), []);
    assert_eq!(wanted("J", "'sigma + J'"), [Signal::AreaRatio, Signal::Tension]);
}

#[test]
fn kinks_of_formulas_with_signals_are_breakpoints() {
    let sheet =
        rumple::sheet::generate(&rumple::sheet::SheetShape::Disc { radius: 1.0 }, 50, 1).unwrap();
    let table = "species = 'c'\nwhere = 'rim'\nvalue = 'tension*step(t - 0.25)'";
    let times = read("flux", table).time_dependence(&sheet, 1.0).breakpoints;
    assert!(times.iter().any(|t| (t - 0.25).abs() < 1e-9), "{times:?}");
}

#[test]
fn formulas_of_signals_that_cannot_be_are_refused() {
    let refused = |kinetics: &str, table: &str| {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 2.0, vertices = 60 }}\ntime = {{ until = 1.0 }}\n\
             kinetics = {{ rates = {{ c = '0' }}{kinetics} }}\n[[effect]]\nspecies = 'c'\nwhere = 'rim'\n{table}\n"
        );
        let scene = rumple::scene::Scene::parse(&text, "s.toml", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        Simulation::new(&scene, &search).err().unwrap().to_string()
    };
    let flux = |value: &str| format!("kind = 'flux'\nvalue = '{value}'");
    for (kinetics, table, words) in [
        ("", flux("tenson"), "unknown name `tenson`"),
        ("", flux("contact_pressure"), "unknown name `contact_pressure`"),
        ("", flux("1/(1 + tension)"), "effect[0].value: it reads the signal tension"),
        (", location = 'face'", flux("J"), "effect[0].value: a formula that reads signals is for"),
        (
            "",
            "kind = 'exchange'\nrate = '1 + H'\nreference = 'a'".to_owned(),
            "effect[0].reference: unknown name `a`",
        ),
    ] {
        let error = refused(kinetics, &table);
        assert!(error.contains(words), "{error}");
    }
}

/// A flux without a value names its key, the vertex and the value.
#[test]
fn an_infinite_flux_names_its_key() {
    for (table, words) in [
        ("kind = 'flux'\nvalue = '1/(J - 1)'", "effect[4].value: the coefficient of flux of `c`"),
        (
            "kind = 'exchange'\nrate = '0.5 - J'\nreference = 1",
            "effect[4].rate: the coefficient of exchange of `c`",
        ),
    ] {
        let effects = effect(&format!("where = 'rim'\n{table}"));
        let (_, mut simulation) =
            prepare(&stretched("0", &effects, "policy = 'simultaneous'"), &[]);
        let error = simulation.evaluate().rates().map(<[_]>::to_vec).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
