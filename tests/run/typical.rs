//! Results do not depend on the unit of amounts.

use crate::common::prepare;

/// Species at the end in units of K, the largest of them if there are several points, and the least value reached.
fn end(scene: &str, k: f64, keys: &[&str]) -> (Vec<f64>, f64) {
    let scene = scene.replace('K', &format!("{k:e}"));
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

const INTEGRATORS: [&str; 6] = [
    "'monolithic'",
    "{ kind = 'monolithic', method = 'tr-bdf2' }",
    "'staggered'",
    "{ kind = 'staggered', chemistry = 'bdf' }",
    "{ kind = 'staggered', chemistry = 'exponential' }",
    "{ kind = 'explicit', method = 'tsit45' }",
];

/// Laws whose results are proportional to K: growth from little, production from nothing, decay of zeroth order, a cascade, a
/// reaction of second order, a switch, an oscillator.
const LAWS: [&str; 7] = [
    "rates.u = 'u*(1 - u/K)'\ninitial.u = 1e-2*",
    "rates.u = 'K - u'",
    "rates.u = '-K*u/(u + 1e-3*K)'\ninitial.u = 1*",
    "rates.u = '-u'\nrates.v = 'u - v'\nrates.w = 'v - 0.1*w'\ninitial.u = 1*",
    "rates.u = '-u*v/K'\nrates.v = '-u*v/K'\ninitial.u = 1*\ninitial.v = 0.5*",
    "rates.u = 'K*hill(u, K, 2)*2 - 0.5*u + 0.01*K'\ninitial.u = 0.1*",
    "rates.u = 'v'\nrates.v = '-u'\ninitial.u = 1*",
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

#[test]
fn an_absolute_tolerance_above_all_values_is_noted() {
    let law = "species.u = { typical = 1.0 }\nrates.u = 'u*(1 - u/K)'\ninitial.u = 1e-2*";
    for (k, noted) in [(1e-9, true), (1e3, false)] {
        let scene = scene(law, PLACES[1], k).replace('K', &format!("{k:e}"));
        let (_, simulation) = prepare(&scene, &[]);
        assert_eq!(
            simulation.notes().concat().contains("the absolute tolerance of species u"),
            noted
        );
        let free = scene.replace("species.u = { typical = 1.0 }", "");
        let (_, simulation) = prepare(&free, &[]);
        assert!(!simulation.notes().concat().contains("the absolute tolerance"), "{k}");
    }
}
