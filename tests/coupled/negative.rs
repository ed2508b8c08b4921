//! Species that their law does not make negative stay so, at loose tolerances as well.

use crate::common::prepare;

const ROBERTSON: &str = r#"
[sheet]
shape = "point"
[kinetics]
initial = { y1 = 1.0, y2 = 0.0, y3 = 0.0 }
species = { y2 = { typical = 1e-5 } }
[kinetics.rates]
y1 = "-0.04*y1 + 1e4*y2*y3"
y2 = "0.04*y1 - 1e4*y2*y3 - 3e7*y2^2"
y3 = "3e7*y2^2"
[time]
policy = "simultaneous"
until = 1e11
"#;

const VAN_DER_POL: &str = r#"
[sheet]
shape = "point"
[kinetics]
initial = { x = 2.0, y = 0.0 }
rates = { x = "y", y = "1e3*(1 - x^2)*y - x" }
[time]
policy = "simultaneous"
until = 3e3
"#;

fn integrators(tolerances: &[f64]) -> Vec<String> {
    let mut all = Vec::new();
    for tolerance in tolerances {
        for method in ["bdf", "tr-bdf2", "esdirk34"] {
            all.push(format!(
                "{{kind='staggered',chemistry='{method}',rtol={tolerance:e},atol={tolerance:e}}}"
            ));
            all.push(format!(
                "{{kind='monolithic',method='{method}',rtol={tolerance:e},atol={tolerance:e}}}"
            ));
        }
    }
    all
}

/// The largest distances of the species below 0 and of their sum from `total` along a run; the error that ends it.
fn run(scene: &str, integrator: &str, total: f64) -> (f64, f64, Option<String>, u64) {
    let (_, mut simulation) = prepare(scene, &[&format!("time.integrator={integrator}")]);
    simulation.prepare().unwrap();
    let until = 1e11;
    let (mut below, mut off) = (0.0_f64, 0.0_f64);
    while simulation.state().time < until {
        if let Err(error) = simulation.step(until) {
            return (below, off, Some(error.to_string()), simulation.state().step);
        }
        let species = &simulation.state().species;
        below = species.iter().flatten().fold(below, |m, c| m.max(-c));
        off = off.max((species.iter().map(|c| c[0]).sum::<f64>() - total).abs());
    }
    (below, off, None, simulation.state().step)
}

#[test]
fn robertsons_species_stay_in_their_range_at_every_tolerance() {
    for integrator in integrators(&[1e-1, 1e-2, 1e-3, 1e-4, 1e-6]) {
        let (below, off, failure, steps) = run(ROBERTSON, &integrator, 1.0);
        println!(
            "{integrator}: {below:.1e} below 0, sum {off:.1e} off, {steps} steps, {failure:?}"
        );
        assert!(failure.is_none(), "{integrator}: {failure:?}");
        assert!(below < 0.2 && off < 0.2, "{integrator}: {below:e}, {off:e}");
    }
}

/// A species that its law makes negative is left alone.
#[test]
fn oscillations_through_zero_are_as_before() {
    for method in ["bdf", "tr-bdf2", "esdirk34"] {
        let integrator =
            format!("time.integrator={{kind='monolithic',method='{method}',rtol=1e-3,atol=1e-3}}");
        let (_, mut simulation) = prepare(VAN_DER_POL, &[&integrator]);
        simulation.prepare().unwrap();
        let mut least = 0.0_f64;
        while simulation.state().time < 3e3 {
            simulation.step(3e3).unwrap_or_else(|e| panic!("{method}: {e}"));
            least = least.min(simulation.state().species[0][0]);
        }
        assert!((-2.2..-1.9).contains(&least), "{method}: {least}");
    }
}
