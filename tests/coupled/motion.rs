//! The shape under drag, by minimisations: derivatives, known motions, energy, long steps.

use rumple::effects::HessianPart;
use rumple::model::{Anchor, Drag, EvaluationBuffers, Model, State};
use rumple::{Simulation, Vec3};

use super::{DOME, distance, final_state};
use crate::common::{Noise, prepare};

const ADAPTIVE: &str = "time.integrator={kind=\"staggered\",rtol=1e-3,atol=1e-3}";

/// All states that a run goes through.
fn states(text: &str, overrides: &[&str]) -> (Simulation, Vec<State>) {
    let (scene, mut simulation) = prepare(text, overrides);
    simulation.prepare().unwrap_or_else(|e| panic!("{e}"));
    let until = scene.time.span.until.get();
    let mut all = vec![simulation.state().clone()];
    while simulation.state().time < until {
        simulation.step(until).unwrap_or_else(|e| panic!("{e}"));
        all.push(simulation.state().clone());
    }
    (simulation, all)
}

fn energy(model: &Model, state: &State) -> f64 {
    model.at(state, &mut EvaluationBuffers::default()).energies().unwrap().iter().sum()
}

/// What an anchor adds, by differences of itself and of its gradient.
#[test]
fn an_anchor_has_the_derivatives_it_says() {
    let (_, mut simulation) = prepare(DOME, &[]);
    let sheet = simulation.sheet().clone();
    let mut noise = Noise::new(3);
    let mut shape = |size: f64| -> Vec<Vec3> {
        sheet.rest().iter().map(|x| x + size * noise.vector()).collect()
    };
    let (x, earlier, mut v) = (shape(0.1), shape(0.3), shape(1.0));
    v.iter_mut().zip(sheet.rest()).for_each(|(v, x)| *v -= x);
    let drag = Drag::per_area(50.0, &sheet).with_ratio(3.0);
    let mut evaluation = simulation.evaluate();
    let potential = evaluation.potential().unwrap();
    for (v, pins) in v.iter_mut().zip(potential.pins()) {
        (0..3).filter(|a| pins[*a]).for_each(|a| v[a] = 0.0);
    }
    let weights = drag.weights(&sheet, &x, 7.0);
    let anchor = Anchor { x: earlier, weights, slack: 0.0 };
    let (mut gradient, h) = (vec![Vec3::zeros(); x.len()], 1e-4);
    let mut matrix = rumple_numerics::linear::BlockMatrix::zeros(potential.pattern(&x));
    // Energy, slope along v and curvature, with the anchor less without.
    let mut added = |h: f64| -> [f64; 3] {
        let at: Vec<Vec3> = x.iter().zip(&v).map(|(x, v)| x + h * v).collect();
        let mut found = [[0.0; 3]; 2];
        for (found, anchor) in found.iter_mut().zip([None, Some(anchor.clone())]) {
            potential.set_anchor(anchor);
            found[0] = potential.energy(&at);
            assert!((potential.energy_gradient(&at, &mut gradient) / found[0] - 1.0).abs() < 1e-12);
            found[1] = gradient.iter().zip(&v).map(|(g, v)| g.dot(v)).sum();
            potential.hessian(&at, HessianPart::Full, &mut matrix).unwrap();
            // Fixed directions have a stiffness of their own in the matrix, and none in v.
            found[2] = matrix.quadratic(&v);
        }
        std::array::from_fn(|k| found[1][k] - found[0][k])
    };
    let [down, here, up] = [-h, 0.0, h].map(&mut added);
    for k in 0..2 {
        let difference = (up[k] - down[k]) / (2.0 * h);
        assert!((difference / here[k + 1] - 1.0).abs() < 1e-6, "{k}: {difference} {here:?}");
    }
    assert!(here[0] > 1.0, "{here:?}");
}

/// A free sheet under a uniform load that grows with time moves as a whole, along its normal and in its
/// plane by their own drags, on any mesh: x = f t²/(2γ), which a method of second order has exactly.
#[test]
fn a_free_sheet_moves_by_force_over_drag() {
    let scene = |drag: &str| {
        format!(
            "sheet = {{ shape = 'disc', radius = 5.0, vertices = 150 }}
            material = {{ young = 1e3, poisson = 0.3333333333333333, thickness = 0.5, drag = {drag} }}
            equilibrium = {{ method = 'lbfgs', tolerance = 1e-10 }}
            effect = [
                {{ kind = 'stretching' }}, {{ kind = 'bending' }},
                {{ kind = 'load', where = 'all', force = {{ per-area = [0.3, 0.0, -0.4] }}, ramp = {{ formula = 't' }} }},
            ]
            time = {{ policy = 'simultaneous', until = 2.0, integrator = {{ kind = 'staggered', rtol = 1e-3, atol = 1e-3 }} }}"
        )
    };
    for (drag, velocity) in [
        ("{ per-area = 0.5 }", Vec3::new(0.6, 0.0, -0.8)),
        (
            "{ per-area = { default = 2.0, regions = [{ where = 'all', value = 0.5 }] } }",
            Vec3::new(0.6, 0.0, -0.8),
        ),
        ("{ per-area = { normal = 2.0, tangential = 0.5 } }", Vec3::new(0.6, 0.0, -0.2)),
    ] {
        let (simulation, all) = states(&scene(drag), &[]);
        for (x, rest) in all[all.len() - 1].x.iter().zip(simulation.sheet().rest()) {
            let expected = 2.0 * velocity;
            assert!((x - rest - expected).norm() < 2e-3, "{drag}: {:?}", x - rest);
        }
    }
}

/// Drag that differs by direction is second order too, though its normals turn.
/// Without stiffness to speak of every vertex follows its own drag: x = f t²/(2γ(X)).
#[test]
fn vertices_move_by_their_own_drag() {
    let scene = "sheet = { shape = 'disc', radius = 5.0, vertices = 150, planar = true }
        material = { young = 1e-9, poisson = 0.3, thickness = 0.5, drag = { per-area = '1 + step(x)' } }
        equilibrium = { method = 'newton', tolerance = 1e-6 }
        effect = [
            { kind = 'stretching' },
            { kind = 'load', where = 'all', force = { per-area = [0.0, 0.1, 0.0] }, ramp = { formula = 't' } },
        ]
        time = { policy = 'simultaneous', until = 1.0, integrator = { kind = 'staggered', rtol = 1e-4, atol = 1e-4 } }";
    let (simulation, all) = states(scene, &[]);
    for (x, rest) in all[all.len() - 1].x.iter().zip(simulation.sheet().rest()) {
        let drag = if rest.x >= 0.0 { 2.0 } else { 1.0 };
        assert!((x.y - rest.y - 0.05 / drag).abs() < 1e-3, "{rest:?} {x:?}");
    }
}

#[test]
fn drag_by_normals_is_second_order() {
    let run = |tolerance: f64| {
        let integrator =
            format!("time.integrator={{kind=\"staggered\",rtol={tolerance:e},atol={tolerance:e}}}");
        let drag = "material.drag={per-area={normal=10.0,tangential=1.0}}";
        states(DOME, &[&integrator, drag]).1.pop().unwrap()
    };
    let reference = run(1e-8);
    let [coarse, fine] = [1e-4, 1e-6].map(|tolerance| {
        let state = run(tolerance);
        let (shape, species) = super::distance(&state, &reference);
        ((state.step as f64).ln(), shape.max(species).ln())
    });
    let order = (coarse.1 - fine.1) / (fine.0 - coarse.0);
    assert!(order > 1.8, "{order}: {coarse:?} {fine:?}");
}

/// From a crumpled start the energy falls with every step, and the steps become as long as the run is.
#[test]
fn the_energy_never_rises_at_fixed_species() {
    let more = ["kinetics.initial.c=0.0", "kinetics.parameters.w=0.0", "time.until=1e4"];
    let (scene, mut simulation) = prepare(DOME, &[&[ADAPTIVE], &more[..]].concat());
    simulation.prepare().unwrap();
    let mut noise = Noise::new(9);
    let pins = simulation.model().mechanics().pins().clone();
    for (x, pins) in simulation.state_mut().x.iter_mut().zip(&pins) {
        let by = 0.6 * noise.vector();
        (0..3).filter(|a| !pins[*a]).for_each(|a| x[a] += by[a]);
    }
    let model = simulation.model().clone();
    let until = scene.time.span.until.get();
    let mut before = energy(&model, simulation.state());
    let start = before;
    let mut steps = 0;
    while simulation.state().time < until {
        simulation.step(until).unwrap();
        let after = energy(&model, simulation.state());
        assert!(after <= before + 1e-9 * before.abs(), "{before} {after}");
        before = after;
        steps += 1;
    }
    assert!(before < 0.5 * start, "{start} {before}");
    assert!(steps < 200, "{steps} steps");
    assert!(simulation.evaluate().residual().unwrap() < 1e-6);
}

/// Fall of the energy = work against drag + work of growth, in all of a run, to the order of the method.
#[test]
fn energy_is_accounted_for() {
    let imbalance = |tolerance: f64| {
        let integrator =
            format!("time.integrator={{kind=\"staggered\",rtol={tolerance:e},atol={tolerance:e}}}");
        let (simulation, all) = states(DOME, &[&integrator]);
        let model = simulation.model();
        let (mut drag, mut growth) = (0.0, 0.0);
        for pair in all.windows(2) {
            let [a, b] = pair else { unreachable!() };
            let mixed =
                |x: &State, c: &State| energy(model, &State { x: x.x.clone(), ..c.clone() });
            growth += 0.5 * (mixed(a, b) - mixed(a, a) + mixed(b, b) - mixed(b, a));
            let moved = a.x.iter().zip(&b.x).map(|(a, b)| (b - a).norm_squared());
            drag += 10.0 * moved.sum::<f64>() / (b.time - a.time);
        }
        let fall = energy(model, &all[0]) - energy(model, &all[all.len() - 1]);
        assert!(drag > 0.0 && growth.abs() > 0.0);
        ((all.len() as f64 - 1.0).ln(), ((fall + growth - drag) / drag).abs().ln())
    };
    let [coarse, fine] = [1e-4, 1e-6].map(imbalance);
    let order = (coarse.1 - fine.1) / (fine.0 - coarse.0);
    assert!(order > 1.6 && fine.1 < 0.01f64.ln(), "{order}: {coarse:?} {fine:?}");
}

/// What drag may be, and who takes it: errors name the key.
#[test]
fn drag_that_makes_no_sense_is_refused() {
    use rumple::scene::Scene;
    let refused = |drag: &str, integrator: &str| {
        let keys = [format!("material.drag={drag}"), format!("time.integrator={integrator}")];
        let search = rumple::kinetics::PluginSearch::in_directories(vec![
            crate::plugins::build::directory().to_owned(),
        ]);
        let made = Scene::parse(DOME, "scene.toml", &keys)
            .map_err(rumple::Error::from)
            .and_then(|scene| Simulation::new(&scene, &search));
        match made {
            Err(rumple::Error::Scene(error)) => error.rendered(false),
            Err(error) => panic!("{error}"),
            Ok(_) => panic!("{drag} is accepted"),
        }
    };
    let staggered = "\"staggered\"";
    for drag in ["-1.0", "0", "{per-area=-2.0}", "\"high\"", "{per-face=1.0}", "{}"] {
        assert!(refused(drag, staggered).contains("drag"), "{}", refused(drag, staggered));
    }
    for drag in ["{}", "{per-vertex=1.0,per-area=1.0}", "{per-area=1.0,per-vertex=1.0}"] {
        let which = refused(drag, staggered);
        assert!(which.contains("one of the keys `per-vertex` and `per-area`"), "{which}");
    }
    let unknown = refused("{per-aria=1.0}", staggered);
    assert!(unknown.contains("per-area"), "{unknown}");
    let half = refused("{per-area={normal=1.0}}", staggered);
    assert!(half.contains("tangential"), "{half}");
    let by_direction = "{per-area={normal=1.0,tangential=2.0}}";
    for integrator in ["\"monolithic\"", "\"explicit\""] {
        let refusal = refused(by_direction, integrator);
        assert!(refusal.contains("material.drag"), "{refusal}");
    }
}

/// Another unit of time leaves only round-off behind: no decision is a tie that the last digit settles, as
/// whether a factor serves a step twice as long once was.
#[test]
fn units_of_time_change_round_off_only() {
    let in_units = |unit: f64| {
        let keys = [
            format!("time.until={unit:?}"),
            format!("material.drag={:?}", 10.0 * unit),
            format!("kinetics.parameters.w={:?}", 2.0 / unit),
            format!("kinetics.parameters.beta={:?}", 1.0 / unit),
        ];
        let keys: Vec<&str> = keys.iter().map(String::as_str).chain([ADAPTIVE]).collect();
        let slower = format!("coefficient = {:?}", 1.0 / unit);
        final_state(&DOME.replace("coefficient = 1.0", &slower), &keys)
    };
    let reference = in_units(1.0);
    for unit in [1e-6, 0.1, 0.3, 1.7, 1e6] {
        let (shape, species) = distance(&in_units(unit), &reference);
        assert!(shape < 1e-11 && species < 1e-11, "{unit:e}: {shape:e} {species:e}");
    }
}

/// A clamped strip that grows: stiff, so that its imperfection has died down long before it buckles at t = 0.35.
const STRIP: &str = "sheet = { shape = 'rectangle', width = 10.0, height = 2.0, vertices = 300, \
                     imperfection = { amplitude = 1e-3, seed = 1 } }\n\
                     material = { young = 1e4, poisson = 0.3, thickness = 0.2, drag = 0.01 }\n\
                     effect = [{ kind = 'stretching' }, { kind = 'bending' }, \
                     { kind = 'pin', where = 'rim', axes = 'xyz' }, \
                     { kind = 'growth', factor = '1 + 0.03*t' }]\n\
                     time = { policy = 'simultaneous', until = 0.8 }\n";

/// Steps that are long compared with the time in which a perturbation grows damp it: the flat shape has 37.6.
#[test]
fn an_unstable_branch_is_left_however_long_the_steps_are() {
    let at_the_end = |overrides: &[&str]| {
        let (simulation, states) = states(STRIP, overrides);
        (energy(simulation.model(), states.last().unwrap()), states.len())
    };
    let (rest, _) = at_the_end(&["time.policy=\"quasi-static\""]);
    let (moved, steps) = at_the_end(&[]);
    assert!((moved / rest - 1.0).abs() < 0.15, "{moved} {rest}");
    assert!(steps < 60, "{steps}");
}
