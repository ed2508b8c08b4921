//! Results do not depend on the unit of amounts.

use crate::common::prepare;
use crate::plugins::build::c_library;

/// The scene with a number for K, except where that is a name.
fn with_capacity(scene: &str, k: f64) -> String {
    let number = format!("{k:e}");
    scene.replace('K', &number).replace(&format!("parameters.{number}"), "parameters.K")
}

/// Species at the end in units of K, the largest of them if there are several points, and the least value reached.
fn end(scene: &str, k: f64, keys: &[&str]) -> (Vec<f64>, f64) {
    let scene = with_capacity(scene, k);
    let (_, mut simulation) = prepare(&scene, keys);
    simulation.prepare().unwrap();
    let (until, mut least) = (10.0, f64::INFINITY);
    while simulation.state().time < until {
        simulation.step(until).unwrap_or_else(|e| panic!("{k}: {e}"));
        least = simulation.state().species.iter().flatten().fold(least, |m, c| m.min(c / k));
    }
    let largest = |c: &Vec<f64>| c.iter().fold(f64::NEG_INFINITY, |m, c| m.max(*c)) / k;
    (simulation.state().species.iter().map(largest).collect(), least)
}

const PLACES: [&str; 2] = ["shape = 'point'", "shape = 'disc'\nradius = 3.0\nvertices = 40"];

const INTEGRATORS: [&str; 5] = [
    "'monolithic'",
    "{ kind = 'monolithic', method = 'tr-bdf2' }",
    "'staggered'",
    "{ kind = 'staggered', chemistry = 'bdf' }",
    "{ kind = 'explicit', method = 'tsit45' }",
];

/// Laws whose results are proportional to K: growth from little, production from nothing, decay of zeroth order, a cascade, a
/// reaction of second order, a switch, an oscillator; production that begins at 0, a cascade from nothing, production without
/// decay, one that saturates.
const LAWS: [&str; 11] = [
    "rates.u = 'u*(1 - u/K)'\ninitial.u = 1e-2*",
    "rates.u = 'K - u'",
    "rates.u = '-K*u/(u + 1e-3*K)'\ninitial.u = 1*",
    "rates.u = '-u'\nrates.v = 'u - v'\nrates.w = 'v - 0.1*w'\ninitial.u = 1*",
    "rates.u = '-u*v/K'\nrates.v = '-u*v/K'\ninitial.u = 1*\ninitial.v = 0.5*",
    "rates.u = 'K*hill(u, K, 2)*2 - 0.5*u + 0.01*K'\ninitial.u = 0.1*",
    "rates.u = 'v'\nrates.v = '-u'\ninitial.u = 1*",
    "rates.u = 'K*t*exp(-t) - 0.1*u'",
    "rates.u = 'K - u'\nrates.v = '1e-3*u - v'\nrates.w = 'v - w'",
    "rates.u = 'K*exp(-t)'",
    "rates.u = 'K/(1 + u/K)'",
];

/// The law with its initial values as numbers.
fn scene(law: &str, place: &str, k: f64) -> String {
    let line = |line: &str| match line.split_once(" = ") {
        Some((name, factor)) if name.starts_with("initial") => {
            let factor: f64 = factor.trim_end_matches('*').parse().unwrap();
            format!("{name} = {:e}\n", factor * k)
        }
        _ => format!("{line}\n"),
    };
    let kinetics: String = law.lines().map(line).collect();
    format!(
        "[sheet]\n{place}\n[kinetics]\n{kinetics}[time]\npolicy = 'simultaneous'\nuntil = 10.0\n"
    )
}

#[test]
fn results_do_not_depend_on_the_unit_of_amounts() {
    let mut wrong = Vec::new();
    for law in LAWS {
        let exact = {
            let keys = ["time.integrator={ kind = 'monolithic', rtol = 1e-9, atol = 1e-12 }"];
            end(&scene(law, PLACES[0], 1.0), 1.0, &keys).0
        };
        for (place, integrator) in PLACES.iter().flat_map(|p| INTEGRATORS.map(|i| (p, i))) {
            for k in [1.0, 1e-3, 1e-9, 1e-15] {
                let key = format!("time.integrator={integrator}");
                let (found, least) = end(&scene(law, place, k), k, &[&key]);
                let size = exact.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
                let off =
                    found.iter().zip(&exact).any(|(a, b)| (a - b).abs() > 0.05 * size.max(0.2));
                let negative = !law.contains("rates.u = 'v'") && least < -0.05;
                if off || negative {
                    wrong.push(format!(
                        "{law:?}, {place:?}, {integrator}, K = {k:e}: {found:?} for {exact:?}, least {least}"
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The same by a plugin without derivatives, as by a function in Python, and by a formula.
#[test]
fn laws_that_declare_no_typical_magnitude_are_as_formulas() {
    let library = |definitions: &[&str]| {
        let name = format!("logistic{}", definitions.len());
        let file = c_library("tests/run/logistic.c", &name, definitions);
        format!("plugin = '{}'\nparameters.K = K\ninitial.u = 1e-2*", file.display())
    };
    let formula = "parameters.K = K\nrates.u = 'u*(1 - u/K)'\nrates.v = 'u - v'\ninitial.u = 1e-2*";
    let undeclared = library(&[]);
    for (place, integrator) in PLACES.iter().flat_map(|p| INTEGRATORS.map(|i| (p, i))) {
        for k in [1.0, 1e-9, 1e-15] {
            let keys = [&*format!("time.integrator={integrator}")];
            let [(a, _), (b, _)] =
                [formula, &undeclared].map(|law| end(&scene(law, place, k), k, &keys));
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 2e-4;
            assert!(a.iter().zip(&b).all(near), "{place}, {integrator}, {k:e}: {a:?}, {b:?}");
        }
    }
    let typical = |law: &str, k: f64| {
        let (_, simulation) = prepare(&with_capacity(&scene(law, PLACES[0], k), k), &[]);
        simulation.model().chemistry().unwrap().all_typical()
    };
    assert_eq!(typical(&undeclared, 1e-9), typical(formula, 1e-9));
    assert_eq!(typical(&undeclared, 1e-9), [1e-11, 1e-11]);
    assert_eq!(typical(&library(&["TYPICAL=1.0"]), 1e-9), [1.0; 2]);
}

/// Rates that are 0 at the start and at round times, or have a tail there.
#[test]
fn pulses_in_time_have_the_magnitude_of_their_crest() {
    for (rate, size, exact) in [
        ("step(t-40)*step(60-t)*sin(pi*(t-40)/2)^2", 1.0, 10.0),
        ("step(t-30)*sin(pi*t/10)^2", 1.0, 85.0),
        ("exp(-((t-30)/2)^2)", 1.0, 2.0 * std::f64::consts::PI.sqrt()),
        ("1e-6*exp(-((t-123.4)/0.01)^2)", 1e-6, 1e-8 * std::f64::consts::PI.sqrt()),
    ] {
        for integrator in INTEGRATORS {
            let scene = format!(
                "sheet = {{ shape = 'point' }}\nkinetics = {{ rates = {{ c = '{rate}' }} }}\n\
                 time = {{ policy = 'simultaneous', until = 200.0, integrator = {integrator} }}\n"
            );
            let (_, mut simulation) = prepare(&scene, &[]);
            let typical = simulation.model().chemistry().unwrap().all_typical();
            assert_eq!(typical, [size], "{rate}");
            simulation.prepare().unwrap();
            while simulation.state().time < 200.0 {
                simulation.step(200.0).unwrap_or_else(|e| panic!("{rate}, {integrator}: {e}"));
            }
            let c = simulation.state().species[0][0];
            assert!((c - exact).abs() < 0.02 * exact, "{rate}, {integrator}: {c} for {exact}");
        }
    }
}

#[test]
fn an_absolute_tolerance_above_all_values_is_noted() {
    let law = "species.u = { typical = 1.0 }\nrates.u = 'u*(1 - u/K)'\ninitial.u = 1e-2*";
    for (k, noted) in [(1e-9, true), (1e3, false)] {
        let scene = with_capacity(&scene(law, PLACES[1], k), k);
        let (_, simulation) = prepare(&scene, &[]);
        assert_eq!(
            simulation.notes().concat().contains("the absolute tolerance of species u"),
            noted
        );
        let free = scene.replace("species.u = { typical = 1.0 }", "");
        let (_, simulation) = prepare(&free, &[]);
        assert!(!simulation.notes().concat().contains("the absolute tolerance"), "{k}");
        // One that starts at 0.
        let from_nothing = scene
            .replace("initial.u", "rates.v = 'u - v'\nspecies.v = { typical = 1.0 }\ninitial.u");
        let (_, simulation) = prepare(&from_nothing, &[]);
        let notes = simulation.notes().concat();
        assert_eq!(notes.contains("of species v is"), noted, "{k}: {notes}");
    }
}

/// Rates by species of other sizes are large in some units, eigenvalues are not: they are -5, -1 and -1 for every K.
#[test]
fn stabilised_steps_do_not_depend_on_the_unit_of_a_species() {
    let scene = "sheet = { shape = 'disc', radius = 3.0, vertices = 60 }\ntime.until = 3.0\n\
                 [kinetics]\nrates = { a = '-5*a', b = 'a*0.001 - b', w = 'hill(b, 1e-6*K, 2) - w' }\n\
                 parameters.K = KK\ninitial.a = KK\n";
    for k in [1.0, 1e-3, 1e-9] {
        let (_, mut simulation) = prepare(&scene.replace("KK", &format!("{k:e}")), &[]);
        simulation.prepare().unwrap();
        while simulation.state().time < 3.0 {
            simulation.step(3.0).unwrap_or_else(|e| panic!("{k}: {e}"));
        }
        let work = simulation.spent().work;
        assert!(work.right_hand_sides < 1000, "{k}: {}", work.right_hand_sides);
        let w = simulation.state().species[2][0];
        assert!((w - 0.947_99).abs() < 2e-3, "{k}: {w}");
    }
}
