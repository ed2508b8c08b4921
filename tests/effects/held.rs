//! Held values are those of the scene at the end of every step, also where they change in time.

use rumple::{Simulation, Vec3};

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

/// The vertices at the boundary.
fn rim(simulation: &Simulation) -> Vec<usize> {
    let sheet = simulation.sheet();
    (0..sheet.vertex_count()).filter(|&i| sheet.boundary()[i]).collect()
}

/// Steps to the end; the largest error after any step against `exact` of position and time, at all vertices and at those of the
/// boundary.
fn run(text: &str, integrator: &str, until: f64, exact: impl Fn(Vec3, f64) -> f64) -> [f64; 2] {
    let (_, mut simulation) = prepare(text, &[&format!("time.integrator={integrator}")]);
    simulation.prepare().unwrap();
    let rim = rim(&simulation);
    let mut worst = [0.0f64; 2];
    while simulation.state().time < until {
        simulation.step(until).unwrap_or_else(|e| panic!("{integrator}: {e}"));
        let (rest, state) = (simulation.sheet().rest(), simulation.state());
        let off = |i: usize| (state.species[0][i] - exact(rest[i], state.time)).abs();
        worst[0] = (0..rest.len()).fold(worst[0], |worst, i| worst.max(off(i)));
        worst[1] = rim.iter().fold(worst[1], |worst, i| worst.max(off(*i)));
    }
    worst
}

const INTEGRATORS: [(&str, f64); 10] = [
    ("{ kind = 'staggered', method = 'euler', step = 1e-3 }", 2e-3),
    ("{ kind = 'staggered', chemistry = 'tsit45', rtol = 1e-5, atol = 1e-5 }", 1e-4),
    ("{ kind = 'staggered', chemistry = 'chebyshev', rtol = 1e-5, atol = 1e-5 }", 1e-4),
    ("{ kind = 'staggered', chemistry = 'bdf', rtol = 1e-5, atol = 1e-5 }", 1e-4),
    ("{ kind = 'staggered', chemistry = 'esdirk34', rtol = 1e-5, atol = 1e-5 }", 1e-4),
    ("{ kind = 'monolithic', method = 'bdf', rtol = 1e-6, atol = 1e-6 }", 1e-4),
    ("{ kind = 'monolithic', method = 'tr-bdf2', rtol = 1e-6, atol = 1e-6 }", 1e-4),
    ("{ kind = 'monolithic', method = 'esdirk34', rtol = 1e-6, atol = 1e-6 }", 1e-4),
    ("{ kind = 'explicit', method = 'tsit45', rtol = 1e-6, atol = 1e-6 }", 1e-4),
    ("{ kind = 'explicit', method = 'euler', step = 1e-3 }", 2e-3),
];

/// A sheet at rest whose boundary is held at a formula, with this rate of the law.
fn driven(value: &str, rate: &str, start: &str, (policy, vertices): (&str, usize)) -> String {
    format!(
        "sheet = {{ shape = 'disc', radius = 1.0, vertices = {vertices}, planar = true, seed = 3 }}\n\
         time = {{ policy = '{policy}', until = 3.0 }}\n\
         kinetics = {{ rates = {{ c = '{rate}' }}, initial = {{ c = {{ formula = '{start}' }} }} }}\n\
         [[effect]]\nkind = 'diffusion'\nspecies = 'c'\ncoefficient = 0.5\n\
         [[effect]]\nkind = 'hold'\nspecies = 'c'\nwhere = 'rim'\nvalue = '{value}'\n"
    )
}

/// A linear function of the position has no discrete Laplacian within: `(1 + x/3) sin t` solves the equations of the mesh.
#[test]
fn held_values_may_change_in_time() {
    let text = driven("(1 + x/3)*sin(t)", "(1 + x/3)*cos(t)", "0", ("simultaneous", 60));
    for (integrator, bound) in INTEGRATORS {
        let [all, held] = run(&text, integrator, 3.0, |x, t| (1.0 + x.x / 3.0) * t.sin());
        assert!(all < bound, "{integrator}: {all:e}");
        assert!(held < 1e-15, "{integrator}: {held:e}");
    }
}

/// Stokes' second problem: the wave `exp(-k x) sin(t - k x)` of diffusion by `1/(2 k²)`, k = 1, with the order of the mesh.
#[test]
fn a_wave_from_a_boundary_that_oscillates_is_that_of_stokes() {
    let wave = |x: Vec3, t: f64| (-x.x).exp() * (t - x.x).sin();
    let (value, start) = ("exp(-x)*sin(t - x)", "-exp(-x)*sin(x)");
    let error = |vertices: usize, integrator: &str| {
        let text = driven(value, "0", start, ("simultaneous", vertices));
        run(&text, integrator, 3.0, wave)[0]
    };
    let fine = "{ kind = 'monolithic', method = 'bdf', rtol = 1e-7, atol = 1e-8 }";
    let [coarse, finer] = [100, 400].map(|vertices| error(vertices, fine));
    assert!(finer < 2e-3 && coarse / finer > 2.8, "{coarse:e} {finer:e}");
    for (integrator, _) in &INTEGRATORS[1..9] {
        let found = error(100, integrator);
        assert!((found / coarse - 1.0).abs() < 0.1, "{integrator}: {found:e} {coarse:e}");
    }
}

/// Without storage the chemistry is steady at every time: with nothing but diffusion the linear function itself.
#[test]
fn steady_chemistry_follows_held_values() {
    let text = driven("(1 + x/3)*sin(t)", "0", "0", ("chemistry-fast", 60))
        + "[[effect]]\nkind = 'stretching'\n[material]\nyoung = 1.0\npoisson = 0.3\nthickness = 0.1\n";
    for integrator in ["{ kind = 'staggered' }", "{ kind = 'monolithic', method = 'bdf' }"] {
        let [all, held] = run(&text, integrator, 3.0, |x, t| (1.0 + x.x / 3.0) * t.sin());
        assert!(all < 1e-4 && held < 1e-15, "{integrator}: {all:e} {held:e}");
    }
}

/// Species on faces have the mean over the corners; a jump is met after the step that ends at it.
#[test]
fn held_values_on_faces_follow_a_jump() {
    let text = "sheet = { shape = 'disc', radius = 1.0, vertices = 60, planar = true }\n\
        time = { until = 2.0 }\nkinetics = { rates = { c = '0' }, location = 'face' }\n\
        [[effect]]\nkind = 'hold'\nspecies = 'c'\nwhere = 'all'\nvalue = 'x*(1 + step(t - 1)) + 0.1*t'\n";
    for integrator in ["{ kind = 'staggered' }", "{ kind = 'monolithic', method = 'tr-bdf2' }"] {
        let (_, mut simulation) = prepare(text, &[&format!("time.integrator={integrator}")]);
        simulation.prepare().unwrap();
        let mut ends = Vec::new();
        while simulation.state().time < 2.0 {
            simulation.step(2.0).unwrap();
            let (sheet, state) = (simulation.sheet(), simulation.state());
            ends.push(state.time);
            let factor = if state.time > 1.0 { 2.0 } else { 1.0 };
            for (t, corners) in sheet.triangles().iter().enumerate().filter(|_| state.time != 1.0) {
                let x = corners.map(|v| sheet.rest()[v as usize].x).iter().sum::<f64>() / 3.0;
                let off = state.species[0][t] - factor * x - 0.1 * state.time;
                assert!(off.abs() < 1e-14, "{integrator} at {}: {off:e}", state.time);
            }
        }
        assert!(ends.contains(&1.0), "{integrator}: {ends:?}");
    }
}

/// From a checkpoint the next steps have the same bits.
#[test]
fn runs_with_values_held_in_time_continue_with_the_same_bits() {
    let text = driven("exp(-x)*sin(t - x)", "0", "-exp(-x)*sin(x)", ("simultaneous", 60));
    for (integrator, _) in INTEGRATORS {
        let keys = [&*format!("time.integrator={integrator}")];
        let (scene, mut one) = prepare(&text, &keys);
        one.prepare().unwrap();
        (0..5).for_each(|_| drop(one.step(3.0).unwrap()));
        let checkpoint = rumple::run::Checkpoint::capture(&scene, &mut one).unwrap();
        let (_, mut other) = prepare(&text, &keys);
        checkpoint.take_up(&scene, &mut other).unwrap();
        for _ in 0..5 {
            one.step(3.0).unwrap();
            other.step(3.0).unwrap();
            assert_eq!(one.state().time, other.state().time, "{integrator}");
            assert_eq!(one.state().species, other.state().species, "{integrator}");
        }
    }
}

/// Steps of implicit methods lengthen: held values that move do not restart them.
#[test]
fn held_values_that_move_do_not_restart_the_integrator() {
    let text = driven("(1 + x/3)*exp(-t)", "-c", "1 + x/3", ("simultaneous", 60));
    let integrator = "time.integrator={kind='monolithic',method='bdf'}";
    let steps = |value: &str| {
        let value = format!("effect[1].value=\"{value}\"");
        let (_, mut simulation) = prepare(&text, &[integrator, &value]);
        simulation.prepare().unwrap();
        let mut count = 0;
        while simulation.state().time < 3.0 {
            simulation.step(3.0).unwrap();
            count += 1;
        }
        count
    };
    let (moving, still) = (steps("(1 + x/3)*exp(-t)"), steps("1 + x/3"));
    assert!(moving < 2 * still, "{moving} {still}");
}

#[test]
fn held_values_in_time_that_cannot_be_are_refused() {
    for (effects, words) in [
        ("value = '0.5 - t'", "effect[0].value: it holds c at "),
        ("value = '1/(t - 1)'", "effect[0].value: it holds c at "),
        ("value = '1/t'", "effect[0].value: it is inf at vertex 0 at time 0"),
        (
            "value = 't'\n[[effect]]\nkind = 'hold'\nspecies = 'c'\nwhere = 'all'\nvalue = '0'",
            "effect[1].value: effect[0] holds the species at point",
        ),
    ] {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 2.0, vertices = 60 }}\ntime = {{ until = 3.0 }}\n\
             kinetics = {{ rates = {{ c = '0' }}, species = {{ c = {{ lower = 0.0 }} }} }}\n\
             [[effect]]\nkind = 'hold'\nspecies = 'c'\nwhere = 'rim'\n{effects}\n"
        );
        let scene = rumple::scene::Scene::parse(&text, "s.toml", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        let error = Simulation::new(&scene, &search).err().unwrap().to_string();
        assert!(error.contains(words), "{error}");
    }
}
