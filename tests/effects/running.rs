//! Effects in runs: known answers.

use rumple::Simulation;
use rumple::geometry::aligned;

use crate::common::prepare;

pub(super) fn at_end(text: &str) -> Simulation {
    let (scene, mut simulation) = prepare(text, &[]);
    let until = scene.time.span.until.get();
    simulation.prepare().unwrap_or_else(|e| panic!("{e}"));
    while simulation.state().time < until {
        simulation.step(until).unwrap_or_else(|e| panic!("{e}"));
    }
    simulation
}

/// What a closed sheet encloses at `x`.
pub(super) fn volume(sheet: &rumple::sheet::Sheet, x: &[rumple::Vec3]) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| x[v as usize]);
        a.dot(&b.cross(&c)) / 6.0
    };
    sheet.triangles().iter().map(of).sum()
}

const STRIP: &str = "
sheet = { shape = 'rectangle', width = 12.0, height = 4.0, vertices = 400 }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.5 }
equilibrium = { method = 'lbfgs', tolerance = 1e-9 }
";

/// A sheet on a foundation under a uniform load sinks by load over modulus.
#[test]
fn a_foundation_carries_a_load() {
    let simulation = at_end(&format!(
        "{STRIP}
        time = {{ until = 1.0 }}
        effect = [
            {{ kind = 'stretching' }},
            {{ kind = 'bending' }},
            {{ kind = 'foundation', where = 'all', stiffness = 5.0 }},
            {{ kind = 'load', where = 'all', force = {{ per-area = [0.0, 0.0, -0.1] }}, ramp = {{ formula = 't' }} }},
        ]"
    ));
    for x in &simulation.state().x {
        assert!((x.z + 0.1 / 5.0).abs() < 1e-6, "{x:?}");
    }
}

/// Pulled apart by pins that move, a strip is stretched by what they moved.
#[test]
fn pins_that_move_stretch_a_strip() {
    let simulation = at_end(&format!(
        "{STRIP}
        time = {{ until = 2.0 }}
        effect = [
            {{ kind = 'stretching', model = 'stvk' }},
            {{ kind = 'pin', where = 'all', axes = 'z' }},
            {{ kind = 'pin', where = {{ half-space = {{ point = [-5.99, 0, 0], normal = [-1, 0, 0] }} }}, axes = 'x' }},
            {{ kind = 'pin', where = {{ half-space = {{ point = [5.99, 0, 0], normal = [1, 0, 0] }} }}, axes = 'x',
               displacement = [0.6, 0, 0], ramp = {{ points = [[0, 0], [2, 1]] }} }},
        ]"
    ));
    let sheet = simulation.sheet();
    let width = 12.0;
    for (x, rest) in simulation.state().x.iter().zip(sheet.rest()) {
        let expected = rest.x + 0.6 * (rest.x + 0.5 * width) / width;
        assert!((x.x - expected).abs() < 1e-6, "{x:?} {expected}");
    }
}

/// Growth in a plane without constraint is free of stress, and amounts stay while they are diluted.
#[test]
fn growth_without_a_law_is_free_and_conserves_amounts() {
    let text = format!(
        "{STRIP}
        time = {{ until = 1.0, integrator = {{ kind = 'staggered', rtol = 1e-3, atol = 1e-3 }} }}
        effect = [
            {{ kind = 'stretching' }},
            {{ kind = 'pin', where = 'all', axes = 'z' }},
            {{ kind = 'growth', factor = '1 + 0.2*t' }},
            {{ kind = 'diffusion', species = 'c', coefficient = 0.5 }},
        ]
        [kinetics]
        measure = 'amount'
        rates.c = '0*c'
        initial.c = {{ gaussian = {{ width = 1.0, amplitude = 1.0 }} }}
        "
    );
    let (_, start) = prepare(&text, &[]);
    let mut simulation = at_end(&text);
    let rest = simulation.sheet().rest().to_vec();
    // Where it lies in the plane is free.
    let grown: Vec<rumple::Vec3> = rest.iter().map(|x| 1.2 * x).collect();
    for (x, grown) in aligned(&simulation.state().x, &grown).iter().zip(&grown) {
        assert!((x - grown).norm() < 1e-6, "{x:?} {grown:?}");
    }
    let energy: f64 = simulation.energies().unwrap().iter().map(|(_, e)| e).sum();
    assert!(energy.abs() < 1e-8, "{energy}");
    let mut area = vec![0.0; rest.len()];
    for t in simulation.sheet().triangles() {
        let [a, b, c] = t.map(|v| rest[v as usize]);
        t.iter().for_each(|v| area[*v as usize] += (b - a).cross(&(c - a)).norm() / 6.0);
    }
    let total = |c: &[f64]| -> f64 { c.iter().zip(&area).map(|(c, a)| c * a).sum() };
    let (before, after) = (total(&start.state().species[0]), total(&simulation.state().species[0]));
    assert!((after / before - 1.0).abs() < 1e-12, "{before} {after}");
}

/// A stiff volume keeps a pressed sphere's volume, a soft one follows theory: the membrane of a sphere
/// resists with 2 E₂ ΔR/R² per radius (E₂ = Y/(1-ν)), the volume with κ 3 ΔR/R.
#[test]
fn an_enclosed_volume_inflates_a_sphere() {
    for (stiffness, share) in [(10.0, 1.03), (1e6, 1.03)] {
        let mut simulation = at_end(&format!(
            "
            sheet = {{ shape = 'sphere', radius = 5.0, vertices = 1500 }}
            material = {{ young = 1e3, poisson = 0.3333333333333333, thickness = 0.1 }}
            equilibrium = {{ method = 'lbfgs', tolerance = 1e-9 }}
            time = {{ until = 1.0 }}
            effect = [
                {{ kind = 'stretching', model = 'stvk' }},
                {{ kind = 'volume', stiffness = {stiffness}, target = {{ share = {share} }} }},
            ]"
        ));
        let sheet = std::sync::Arc::clone(simulation.sheet());
        let grown = volume(&sheet, &simulation.state().x) / volume(&sheet, sheet.rest());
        // p = κ (s V₀ - V)/(s V₀) = 2 Y/(1-ν) e/R with V = V₀ (1+e)³.
        let y = 1e3 * 0.1 / (1.0 - 1.0 / 9.0);
        let pressure = |e: f64| stiffness * (1.0 - (1.0 + e).powi(3) / share);
        let resists = |e: f64| {
            // Saint Venant-Kirchhoff: the membrane force of the Green strain e + e²/2 on the grown sphere.
            let green = e + 0.5 * e * e;
            2.0 * y / (1.0 - 1.0 / 3.0) * green * (1.0 + e) / (5.0 * (1.0 + e) * (1.0 + e))
        };
        let (mut low, mut high) = (0.0, 0.01);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if pressure(middle) > resists(middle) { low = middle } else { high = middle }
        }
        let expected = (1.0 + low).powi(3);
        let error = (grown - expected).abs() / (expected - 1.0);
        println!("κ = {stiffness}: V/V₀ = {grown}, theory {expected}, {error:.1e}");
        assert!(error < 1e-2, "κ = {stiffness}: V/V₀ = {grown}, theory {expected}");
        let residual = simulation.evaluate().residual().unwrap();
        assert!(residual < 1e-9, "{residual:e}");
    }
}

/// Pins that move give the same shape whichever integrator moves them, under drag too.
#[test]
fn pins_that_move_do_so_under_every_integrator() {
    let text = |policy: &str, integrator: &str| {
        format!(
            "{STRIP}
            time = {{ until = 4.0, policy = '{policy}', integrator = {integrator} }}
            effect = [
                {{ kind = 'stretching', model = 'stvk' }},
                {{ kind = 'pin', where = 'all', axes = 'z' }},
                {{ kind = 'pin', where = {{ half-space = {{ point = [-5.99, 0, 0], normal = [-1, 0, 0] }} }}, axes = 'xy' }},
                {{ kind = 'pin', where = {{ half-space = {{ point = [5.99, 0, 0], normal = [1, 0, 0] }} }}, axes = 'xy',
                   displacement = [0.6, 0, 0], ramp = {{ points = [[0, 0], [1, 1]] }} }},
            ]"
        )
    };
    let mut reference = at_end(&text("quasi-static", "'staggered'"));
    let energy = |simulation: &mut Simulation| simulation.energies().unwrap()[0].1;
    let expected = energy(&mut reference);
    assert!(expected > 1.0);
    for (policy, integrator) in [
        ("quasi-static", "'monolithic'"),
        ("simultaneous", "'monolithic'"),
        ("simultaneous", "'staggered'"),
        ("simultaneous", "{ kind = 'explicit', method = 'tsit45' }"),
    ] {
        let mut simulation = at_end(&text(policy, integrator));
        let found = energy(&mut simulation);
        assert!((found / expected - 1.0).abs() < 1e-3, "{policy} {integrator}: {found} {expected}");
        let right = simulation.sheet().rest().iter().position(|x| x.x > 5.99).unwrap();
        let moved = simulation.state().x[right].x - simulation.sheet().rest()[right].x;
        assert!((moved - 0.6).abs() < 1e-12, "{policy} {integrator}: {moved}");
    }
}

/// What cannot be is refused where the scene says it.
#[test]
fn wrong_parameters_of_the_new_effects_name_their_key() {
    let refused = |effect: &str, time: &str| {
        let text =
            format!("{STRIP}\ntime = {time}\neffect = [ {{ kind = 'stretching' }}, {effect} ]");
        let scene = rumple::scene::Scene::parse(&text, "scene.toml", &[]);
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        let made = scene.map_err(rumple::Error::from);
        match made.and_then(|scene| Simulation::new(&scene, &search)) {
            Ok(_) => panic!("{effect} is accepted"),
            Err(rumple::Error::Scene(error)) => error.rendered(false),
            Err(error) => panic!("{effect}: {error}"),
        }
    };
    let usual = "{ until = 1.0 }";
    for (effect, key) in [
        ("{ kind = 'volume', stiffness = 1.0 }", "effect[1].kind"),
        ("{ kind = 'growth', factor = '1 + u' }", "effect[1].factor"),
        ("{ kind = 'growth', factor = 'x' }", "effect[1].factor"),
        ("{ kind = 'foundation', where = 'rim', stiffness = 1.0 }", "effect[1].where"),
        (
            "{ kind = 'foundation', where = 'all', stiffness = 1.0, to = { plane = { normal = [0, 0, 0] } } }",
            "effect[1].to",
        ),
        ("{ kind = 'pressure', value = 1.0, ramp = { formula = 'x*t' } }", "effect[1].ramp"),
        (
            "{ kind = 'pressure', value = 1.0, ramp = { points = [[1, 0], [0, 1]] } }",
            "effect[1].ramp",
        ),
        ("{ kind = 'pin', where = 'rim', axes = 'z', ramp = { formula = 't' } }", "effect[1].ramp"),
    ] {
        let said = refused(effect, usual);
        assert!(said.contains(key), "{effect}: {said}");
    }
    let sphere = STRIP.replace(
        "shape = 'rectangle', width = 12.0, height = 4.0",
        "shape = 'sphere', radius = 3.0",
    );
    let text = format!(
        "{sphere}\ntime = {{ until = 1.0, integrator = 'monolithic' }}\n\
         effect = [ {{ kind = 'stretching' }}, {{ kind = 'volume', stiffness = 1.0 }} ]"
    );
    let scene = rumple::scene::Scene::parse(&text, "scene.toml", &[]).unwrap();
    let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
    match Simulation::new(&scene, &search) {
        Err(rumple::Error::Scene(error)) => {
            assert!(error.rendered(false).contains("time.integrator"), "{error}");
        }
        _ => panic!("volume is accepted with the monolithic integrator"),
    }
}
