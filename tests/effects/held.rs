//! Held values are those of the scene at the end of every step.

use crate::common::prepare;

const SHEET: &str = r#"
sheet = { shape = "disc", radius = 3.0, vertices = 60 }
effect = [
    { kind = "diffusion", species = "c", coefficient = 1.0 },
    { kind = "hold", species = "c", where = "rim", value = 38.0 },
]
[kinetics]
rates.c = "1 - 0.1*c"
initial.c = 1.0
[time]
policy = "simultaneous"
until = 2.0
"#;

#[test]
fn held_values_are_exact_under_every_integrator() {
    let methods = ["euler", "chebyshev", "tsit45", "bdf", "tr-bdf2", "esdirk34"];
    let mut integrators: Vec<String> =
        methods.iter().map(|m| format!("{{ kind = 'staggered', chemistry = '{m}' }}")).collect();
    integrators
        .extend(["bdf", "tr-bdf2"].map(|m| format!("{{ kind = 'monolithic', method = '{m}' }}")));
    integrators.push("{ kind = 'explicit', method = 'tsit45' }".into());
    for integrator in integrators {
        let (_, mut simulation) = prepare(SHEET, &[&format!("time.integrator={integrator}")]);
        simulation.prepare().unwrap();
        let rim: Vec<usize> = (0..simulation.sheet().vertex_count())
            .filter(|&i| simulation.sheet().boundary()[i])
            .collect();
        while simulation.state().time < 2.0 {
            simulation.step(2.0).unwrap_or_else(|e| panic!("{integrator}: {e}"));
            let c = &simulation.state().species[0];
            assert!(rim.iter().all(|&i| c[i] == 38.0), "{integrator}: {}", c[rim[0]]);
        }
    }
}
