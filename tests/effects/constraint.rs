//! Constraints: met to 1e-9, whichever method relaxes, and with known answers.

use std::sync::Arc;

use rumple::effects::{
    BondStretching, Coupling, Energy, EnergyTerm, HessianPart, HingeBending, Material, Stretching,
};
use rumple::geometry::Shape;
use rumple::model::{Mechanics, MechanicsParts, Potential};
use rumple::solve::equilibrium::{Goal, Lbfgs, LbfgsSpec, relax};
use rumple::solve::stability::Stability;
use rumple::{Simulation, Vec3};
use rumple_numerics::linear::BlockMatrix;

use super::running::{at_end, volume};
use crate::common::{irregular, prepare};

/// The largest error of a constraint that counts as met.
const MET: f64 = 1e-9;

fn sphere(vertices: u32, thickness: f64, rest: &str) -> String {
    format!(
        "sheet = {{ shape = 'sphere', radius = 10.0, vertices = {vertices} }}
        material = {{ young = 1e3, poisson = 0.3333333333333333, thickness = {thickness} }}
        {rest}"
    )
}

/// A sphere is blown up to the share asked for by each of the methods, step by step; what it takes is the
/// pressure of theory: of a membrane with the Green strain e + e²/2 on the grown sphere.
#[test]
fn an_exact_volume_is_that_by_every_method() {
    let y = 1e3 * 0.1 / (1.0 - 1.0 / 9.0);
    let e = 1.1f64.cbrt() - 1.0;
    let expected = 2.0 * y / (1.0 - 1.0 / 3.0) * (e + 0.5 * e * e) / (10.0 * (1.0 + e));
    for (method, vertices) in [("lbfgs", 1000_u32), ("newton", 1000), ("descent", 200)] {
        let mut simulation = at_end(&sphere(
            vertices,
            0.1,
            &format!(
                "equilibrium = {{ method = '{method}', tolerance = 1e-8 }}
                time = {{ until = 1.0, integrator = {{ kind = 'staggered', method = 'euler', step = 0.5 }} }}
                effect = [
                    {{ kind = 'stretching', model = 'stvk' }},
                    {{ kind = 'volume', exact = true, ramp = {{ formula = '1 + 0.1*t' }} }},
                ]"
            ),
        ));
        let sheet = Arc::clone(simulation.sheet());
        let grown = volume(&sheet, &simulation.state().x) / volume(&sheet, sheet.rest());
        assert!((grown / 1.1 - 1.0).abs() < MET, "{method}: {grown}");
        // Waves of a membrane without bending stiffness, which no minimisation brings to rest, feel the stabilising drag.
        let residual = simulation.evaluate().residual().unwrap();
        assert!(residual <= 1e-6, "{method}: {residual:e}");
        let multiplier = simulation.evaluate().potential().unwrap().multipliers()[0];
        let pressure = multiplier / (1.1 * volume(&sheet, sheet.rest()));
        let error = (pressure / expected - 1.0).abs() * f64::from(vertices);
        assert!(error < 10.0, "{method}: {pressure}, theory {expected}");
    }
}

/// Emptied slowly, a shell stays a sphere below the pressure `2 E h²/(R² √(3 (1 - ν²)))` at which it buckles
/// (Zoelly 1915). Where it would need 1.1 times that it has snapped, and needs less than half of it.
#[test]
fn a_shell_buckles_at_the_pressure_of_theory() {
    let critical = 2.0 * 1e3 * (0.4f64 / 10.0).powi(2) / (3.0 * (1.0 - 1.0 / 9.0f64)).sqrt();
    let mut found = Vec::new();
    for share in [0.960, 0.953] {
        let mut simulation = at_end(&sphere(
            2000,
            0.4,
            &format!(
                "time = {{ until = 1.0, integrator = {{ kind = 'staggered', method = 'euler', step = 0.5 }} }}
                effect = [
                    {{ kind = 'stretching', model = 'stvk' }},
                    {{ kind = 'bending' }},
                    {{ kind = 'volume', exact = true, ramp = {{ formula = '1 - {}*t' }} }},
                ]",
                1.0 - share
            ),
        ));
        let x = simulation.state().x.clone();
        let sheet = Arc::clone(simulation.sheet());
        let inside = volume(&sheet, &x);
        assert!((inside / volume(&sheet, sheet.rest()) / share - 1.0).abs() < MET);
        let mut evaluation = simulation.evaluate();
        let potential = evaluation.potential().unwrap();
        let pressure = -potential.multipliers()[0] / inside / critical;
        let mechanics = Arc::clone(potential.mechanics());
        let negative = Stability::new(&mechanics).unwrap().inertia(potential, &x).unwrap().negative;
        found.push((pressure, negative));
    }
    let [(below, 0), (above, 0)] = found[..] else { panic!("{found:?}") };
    assert!(0.9 < below && below < 1.0, "{found:?}");
    assert!(above < 0.5, "{found:?}");
}

/// Under drag, too, step by step.
#[test]
fn an_exact_volume_is_kept_under_drag() {
    for integrator in
        ["{ kind = 'explicit', method = 'euler', step = 1e-3 }", "{ kind = 'staggered' }"]
    {
        kept_by(integrator);
    }
}

fn kept_by(integrator: &str) {
    let (_, mut simulation) = prepare(
        &sphere(
            200,
            0.1,
            &format!(
                "time = {{ until = 0.2, policy = 'simultaneous', integrator = {integrator} }}
                effect = [
                    {{ kind = 'stretching', model = 'stvk' }},
                    {{ kind = 'load', where = {{ ball = {{ centre = [0, 0, 10], radius = 4 }} }}, force = {{ total = [0, 0, -10] }} }},
                    {{ kind = 'pin', where = {{ ball = {{ centre = [0, 0, -10], radius = 4 }} }}, axes = 'xyz' }},
                    {{ kind = 'volume', exact = true, ramp = {{ formula = '1 + 0.1*t' }} }},
                ]"
            ),
        ),
        &[],
    );
    simulation.prepare().unwrap();
    let moved = |simulation: &Simulation| {
        let rest = simulation.sheet().rest().iter();
        rest.zip(&simulation.state().x).map(|(r, x)| (r - x).norm()).fold(0.0, f64::max)
    };
    while simulation.state().time < 0.2 {
        simulation.step(0.2).unwrap();
        let (sheet, state) = (simulation.sheet(), simulation.state());
        let target = volume(sheet, sheet.rest()) * (1.0 + 0.1 * state.time);
        let error = volume(sheet, &state.x) / target - 1.0;
        assert!(error.abs() < MET, "time {}: {error:e}", state.time);
    }
    assert!(moved(&simulation) > 0.01, "{}", moved(&simulation));
}

/// A mean coordinate of all vertices is given.
struct Mean {
    axis: usize,
    value: f64,
}

impl Energy for Mean {
    type Work = ();

    fn name(&self) -> &'static str {
        "mean"
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn evaluate(&self, shape: &Shape<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        let share = 1.0 / f64::from(u32::try_from(shape.x.len()).unwrap());
        if let Some(gradient) = gradient {
            gradient.iter_mut().for_each(|g| g[self.axis] += share);
        }
        shape.x.iter().map(|x| share * x[self.axis]).sum::<f64>() - self.value
    }

    fn add_hessian(&self, _: &Shape<'_>, (): &mut (), _: HessianPart, _: &mut BlockMatrix) {}
}

/// Several at once, some of them opposed by pins: each is met, and their forces are those of a clamped sheet
/// pulled that far.
#[test]
fn several_constraints_are_met_together() {
    let sheet = Arc::new(irregular(12, 8, 0.25));
    let material = Material { young: 100.0, poisson: 1.0 / 3.0, thickness: 0.5 };
    let terms = || {
        vec![
            EnergyTerm::new(BondStretching::new(&material, Stretching::default().weight)),
            EnergyTerm::new(HingeBending::new(&sheet, &material)),
        ]
    };
    let left = sheet.rest().iter().map(|x| x.x).fold(f64::INFINITY, f64::min);
    let pins: Vec<[bool; 3]> = sheet.rest().iter().map(|x| [x.x < left + 1.2; 3]).collect();
    assert!(pins.contains(&[true; 3]) && pins.contains(&[false; 3]));
    let mean = sheet.rest().iter().sum::<Vec3>() / f64::from(u32::try_from(pins.len()).unwrap());
    let targets = [(0, mean.x + 0.1), (2, mean.z + 0.3)];
    let all = targets.map(|(axis, value)| EnergyTerm::new(Mean { axis, value }));
    let parts = |pins, constraints| MechanicsParts {
        terms: terms(),
        pins,
        constraints,
        ..MechanicsParts::default()
    };
    let mechanics =
        Mechanics::from_parts(Arc::clone(&sheet), parts(pins, all.into_iter().collect())).unwrap();
    assert_eq!(mechanics.constraint_names().collect::<Vec<_>>(), ["mean", "mean 2"]);
    let mut potential = Potential::new(&mechanics);
    let mut lbfgs = Lbfgs::new(&mechanics, LbfgsSpec::default()).unwrap();
    let mut x = sheet.rest().to_vec();
    let goal = Goal { tolerance: 1e-8, max_iterations: 5000, ..Goal::default() };
    let done = relax(&mut lbfgs, &mut potential, &mut x, &goal).unwrap();
    let values = potential.constraint_values(&x);
    assert!(values.iter().all(|g| g.abs() < MET), "{values:?}");
    // The energy rises by λ with the value of the constraint.
    let mut energy = |values: [f64; 2]| {
        let all = [0, 2].map(|axis| (axis, values[axis / 2]));
        let all = all.map(|(axis, value)| EnergyTerm::new(Mean { axis, value }));
        let (pins, all) = (mechanics.pins().clone(), all.into_iter().collect());
        let made = Mechanics::from_parts(Arc::clone(&sheet), parts(pins, all)).unwrap();
        let (mut potential, mut x) = (Potential::new(&made), x.clone());
        let goal = Goal { tolerance: 1e-10, ..goal };
        relax(&mut lbfgs, &mut potential, &mut x, &goal).unwrap();
        potential.energy(&x)
    };
    let at = [targets[0].1, targets[1].1];
    for k in 0..2 {
        let step = 1e-3;
        let (mut up, mut down) = (at, at);
        up[k] += step;
        down[k] -= step;
        let slope = (energy(up) - energy(down)) / (2.0 * step);
        let multiplier = potential.multipliers()[k];
        assert!((slope / multiplier - 1.0).abs() < 1e-4, "{k}: {slope} {multiplier} {done:?}");
    }
}

/// What cannot be is refused where the scene says it.
#[test]
fn constraints_that_cannot_be_are_refused() {
    let refused = |time: &str, effects: &str| {
        let text = sphere(200, 0.1, &format!("time = {time}\neffect = [ {effects} ]"));
        let scene = rumple::scene::Scene::parse(&text, "scene.toml", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        match Simulation::new(&scene, &search) {
            Err(rumple::Error::Scene(error)) => error.rendered(false),
            Err(error) => panic!("{error}"),
            Ok(_) => panic!("{effects} is accepted"),
        }
    };
    let (usual, elastic) = ("{ until = 1.0 }", "{ kind = 'stretching' }");
    let exact = format!("{elastic}, {{ kind = 'volume', exact = true }}");
    let explicit = "{ kind = 'explicit', method = 'tsit45' }";
    let pinned = format!("{exact}, {{ kind = 'pin', where = 'all', axes = 'xyz' }}");
    for (time, effects, key) in [
        (usual, pinned, "pins fix every vertex"),
        ("{ until = 1.0, integrator = 'monolithic' }", exact.clone(), "time.integrator"),
        (
            "{ until = 1.0, policy = 'simultaneous', integrator = 'monolithic' }",
            exact.clone(),
            "time.integrator",
        ),
        (
            &*format!("{{ until = 1.0, policy = 'simultaneous', integrator = {explicit} }}"),
            exact,
            "time.integrator",
        ),
        (usual, "{ kind = 'volume', exact = true }".into(), "effect"),
        (usual, format!("{elastic}, {{ kind = 'volume' }}"), "effect[1].kind"),
        (
            usual,
            format!("{elastic}, {{ kind = 'volume', exact = true, stiffness = 1.0 }}"),
            "effect[1].stiffness",
        ),
    ] {
        let said = refused(time, &effects);
        assert!(said.contains(key), "{effects}: {said}");
    }
}
