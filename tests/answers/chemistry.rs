//! C1 to C4: boundary values, fluxes, advection and cross-diffusion, by every integrator.

use super::known_answers::chemistry::{CARRIED, FINE, cross, decay, ring, rotated};
use super::{converges, over};
use crate::common::prepare;

/// Fine enough that the mesh decides about the error.
const INTEGRATORS: [&str; 6] = [
    "{ kind = \"staggered\", chemistry = \"tr-bdf2\", rtol = 1e-6, atol = 1e-8 }",
    "{ kind = \"staggered\", chemistry = \"bdf\", rtol = 1e-6, atol = 1e-8 }",
    "{ kind = \"staggered\", chemistry = \"tsit45\", rtol = 1e-6, atol = 1e-8 }",
    "{ kind = \"monolithic\", method = \"tr-bdf2\", rtol = 1e-6, atol = 1e-8 }",
    "{ kind = \"monolithic\", method = \"bdf\", rtol = 1e-7, atol = 1e-9 }",
    "{ kind = \"staggered\", method = \"euler\", step = 1e-4 }",
];

#[test]
fn modes_of_a_disc_with_held_values_and_exchange_decay_at_their_rates() {
    for (what, rate) in [("hold", None), ("exchange", Some(1.0))] {
        let samples = over(&[200, 1600], |n| decay(n, rate, FINE));
        converges(what, &samples, 2e-3, 1.6);
        let fine = samples[0].computed;
        for integrator in INTEGRATORS {
            let found = decay(200, rate, integrator).unwrap().computed;
            assert!((found / fine - 1.0).abs() < 5e-4, "{what}, {integrator}: {found}, {fine}");
        }
    }
}

#[test]
fn a_flux_through_a_ring_has_its_logarithmic_profile() {
    let implicit = INTEGRATORS[4];
    let samples = over(&[300, 1200], |n| ring(n, implicit));
    converges("ring", &samples, 3e-3, 1.4);
    let other = ring(300, INTEGRATORS[0]).unwrap().computed;
    assert!((other / samples[0].computed - 1.0).abs() < 1e-5, "{other}, {:?}", samples[0]);
}

#[test]
fn a_gaussian_goes_round_a_sphere_as_it_is() {
    let samples = over(&[600, 2400], |n| rotated(n, "central", CARRIED));
    converges("central", &samples, 0.025, 1.6);
    let upwind = over(&[600, 2400], |n| rotated(n, "upwind", CARRIED));
    converges("upwind", &upwind, 0.2, 0.6);
    let usual = "{ kind = \"staggered\", rtol = 1e-5, atol = 1e-7 }";
    for integrator in [usual, INTEGRATORS[0], INTEGRATORS[4]] {
        let found = rotated(600, "upwind", integrator).unwrap().computed;
        assert!((found / upwind[0].computed - 1.0).abs() < 1e-3, "{integrator}: {found}");
    }
}

#[test]
fn a_mode_grows_by_cross_diffusion_at_its_rate() {
    let samples = over(&[300, 1200], |n| cross(n, FINE));
    converges("cross-diffusion", &samples, 0.02, 1.5);
    let found = cross(300, INTEGRATORS[4]).unwrap().computed;
    assert!((found / samples[0].computed - 1.0).abs() < 1e-4, "{found}, {:?}", samples[0]);
}

/// `Σ A c` with the areas at rest.
fn total(simulation: &rumple::Simulation) -> f64 {
    let (sheet, c) = (simulation.sheet(), &simulation.state().species[0]);
    let third = |t: &[u32; 3]| {
        let [a, b, d] = t.map(|v| sheet.rest()[v as usize]);
        (b - a).cross(&(d - a)).norm() / 6.0
    };
    let of = |t: &[u32; 3]| third(t) * t.iter().map(|v| c[*v as usize]).sum::<f64>();
    sheet.triangles().iter().map(of).sum()
}

/// What flows in is what the total changes by; values that are held stay, to the bit.
#[test]
fn totals_and_held_values_are_right_by_every_integrator() {
    let scene = |effect: &str, integrator: &str| {
        format!(
            "sheet = {{ shape = \"disc\", radius = 2.0, vertices = 200, seed = 3 }}\n\
             time = {{ until = 0.1, integrator = {integrator} }}\nkinetics = {{ rates = {{ c = \"0\" }}, initial = {{ c = 1.0 }} }}\n\
             [[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 1.0\n\
             [[effect]]\nkind = \"advection\"\nspecies = \"c\"\nvelocity = [\"1 - y\", \"x\", 0.0]\n\
             [[effect]]\nspecies = \"c\"\nwhere = \"rim\"\nvalue = \"0.5 + 0.1*x\"\n{effect}\n"
        )
    };
    for integrator in INTEGRATORS.iter().copied().chain([FINE]) {
        let (_, mut run) = prepare(&scene("kind = \"flux\"", integrator), &[]);
        run.prepare().unwrap();
        let before = total(&run);
        while run.state().time < 0.1 {
            run.step(0.1).unwrap();
        }
        let sheet = run.sheet().clone();
        let edges = sheet.edges().iter().filter(|edge| edge.is_boundary());
        let flow: f64 = edges
            .map(|edge| {
                let [a, b] = edge.vertices.map(|v| sheet.rest()[v as usize]);
                (b - a).norm() * (0.5 + 0.05 * (a.x + b.x))
            })
            .sum();
        let (found, expected) = (total(&run) - before, 0.1 * flow);
        assert!((found / expected - 1.0).abs() < 1e-5, "{integrator}: {found}, {expected}");

        let (_, mut run) = prepare(&scene("kind = \"hold\"", integrator), &[]);
        run.prepare().unwrap();
        while run.state().time < 0.1 {
            run.step(0.1).unwrap();
        }
        let c = &run.state().species[0];
        for (i, x) in sheet.rest().iter().enumerate().filter(|(i, _)| sheet.boundary()[*i]) {
            let held = 0.5 + 0.1 * x.x;
            assert!((c[i] - held).abs() < 1e-14, "{integrator}: {} at vertex {i}, {held}", c[i]);
        }
    }
}

/// What cannot go is refused at its key.
#[test]
fn transports_that_cannot_go_are_refused() {
    for (effect, key, words) in [
        ("kind = 'flux'\nspecies = 'x'\nwhere = 'all'\nvalue = 1", "species", "no species `x`"),
        ("kind = 'flux'\nspecies = 'c'\nwhere = 'all'\nvalue = '1/z'", "value", "at vertex 0"),
        (
            "kind = 'flux'\nspecies = 'c'\nwhere = { ball = { centre = [0, 0, 0], radius = 0.5 } }\nvalue = 1\n\
             per = 'length'",
            "where",
            "no boundary edge",
        ),
        (
            "kind = 'exchange'\nspecies = 'c'\nwhere = 'rim'\nrate = '-1'\nreference = 0",
            "rate",
            "it is -1 at vertex",
        ),
        (
            "kind = 'cross-diffusion'\nspecies = 'c'\nby = 'c'\ncoefficient = 1",
            "by",
            "cannot cross-diffuse by itself",
        ),
        (
            "kind = 'hold'\nspecies = 'c'\nwhere = 'rim'\nvalue = 0\n[[effect]]\nkind = 'hold'\nspecies = 'c'\n\
             where = 'all'\nvalue = 1",
            "value",
            "effect[0] holds",
        ),
    ] {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 2.0, vertices = 100 }}\ntime = {{ until = 1.0 }}\n\
             kinetics = {{ rates = {{ c = '0' }} }}\n[[effect]]\n{effect}\n"
        );
        let scene = rumple::scene::Scene::parse(&text, "scene.toml", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        let error = rumple::Simulation::new(&scene, &search).err().unwrap().to_string();
        assert!(error.contains(words) && error.contains(key), "{effect}: {error}");
    }
}
