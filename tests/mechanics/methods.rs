//! Newton and steepest descent reach the minimum that L-BFGS reaches, and fail in the same words.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::Material;
use rumple::model::{Mechanics, Potential};
use rumple::solve::SolveError;
use rumple::solve::equilibrium::{
    Descent, DescentSpec, Equilibrium, Goal, Lbfgs, LbfgsSpec, Newton, NewtonSpec, Relaxation,
};

use super::both;
use crate::common::{Noise, irregular};

fn method(name: &str, mechanics: &Mechanics) -> Box<dyn Equilibrium> {
    match name {
        "newton" => Box::new(Newton::new(mechanics, NewtonSpec::default()).unwrap()),
        "descent" => Box::new(Descent::new(DescentSpec::default())),
        _ => Box::new(Lbfgs::new(mechanics, LbfgsSpec::default()).unwrap()),
    }
}

/// A thick sheet that is grown in the middle and starts out of plane.
fn mild() -> (Potential, Vec<Vec3>) {
    let sheet = Arc::new(irregular(12, 12, 0.2));
    let material = Material { young: 50.0, poisson: 1.0 / 3.0, thickness: 1.0 };
    let pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    let mut mechanics = both(&sheet, &material, pins);
    let centre = Vec3::new(6.0, 5.0, 0.0);
    let factor: Vec<f64> = sheet
        .edges()
        .iter()
        .map(|e| {
            let x =
                0.5 * (sheet.rest()[e.vertices[0] as usize] + sheet.rest()[e.vertices[1] as usize]);
            1.0 + 0.3 * (-(x - centre).norm_squared() / 8.0).exp()
        })
        .collect();
    mechanics.set_length_factor(&factor);
    let mut noise = Noise::new(3);
    let x = sheet.rest().iter().zip(sheet.boundary()).map(|(x, boundary)| {
        let z = 0.3 + 0.05 * noise.number();
        if *boundary { *x } else { x + z * Vec3::z() }
    });
    let x = x.collect();
    (mechanics, x)
}

fn relax(
    solver: &mut dyn Equilibrium,
    mechanics: &mut Potential,
    x: &mut [Vec3],
    tolerance: f64,
    max_iterations: usize,
) -> Result<Relaxation, SolveError> {
    solver.relax(mechanics, x, &Goal { tolerance, max_iterations, ..Goal::default() })
}

#[test]
fn they_reach_the_minimum_of_lbfgs() {
    let (mut mechanics, start) = mild();
    let mut results = Vec::new();
    for name in ["lbfgs", "newton", "descent"] {
        let mut solver = method(name, mechanics.mechanics());
        let mut x = start.clone();
        let limit = 1_000_000;
        let before = mechanics.mechanics().tally().work();
        let done = relax(&mut *solver, &mut mechanics, &mut x, 1e-8, limit).unwrap();
        let work = mechanics.mechanics().tally().work() - before;
        println!("{name}: {done:?} {work:?}");
        assert_eq!(work.iterations, done.iterations as u64, "{name}");
        assert!(done.residual <= 1e-8 && work.gradients > work.iterations, "{name} {work:?}");
        assert_eq!(work.factorisations == 0, !["lbfgs", "newton"].contains(&name), "{name}");
        results.push((name, done, x));
    }
    let height = results[0].2.iter().map(|x| x.z).fold(0.0, f64::max);
    assert!(height > 0.5, "the spot stays flat: {height}");
    for (name, done, x) in &results[1..] {
        let energy = results[0].1.energy;
        assert!((done.energy / energy - 1.0).abs() < 1e-9, "{name} {} {energy}", done.energy);
        // Motions in the plane are free: compare quantities invariant under them.
        let apart = x.iter().zip(&results[0].2).map(|(a, b)| (a.z - b.z).abs());
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 1e-4, "{name} {apart}");
    }
    let iterations = |k: usize| results[k].1.iterations;
    assert!(iterations(1) < iterations(2));
}

#[test]
fn descent_never_goes_uphill_and_both_are_the_same_on_any_number_of_threads() {
    let (mut mechanics, start) = mild();
    let mut energies = Vec::new();
    for iterations in [1, 10, 100, 1000] {
        let mut x = start.clone();
        let mut solver = method("descent", mechanics.mechanics());
        let _ = relax(&mut *solver, &mut mechanics, &mut x, 1e-12, iterations);
        energies.push(mechanics.energy(&x));
    }
    assert!(energies.is_sorted_by(|a, b| a > b), "{energies:?}");
    let name = "descent";
    let shapes: Vec<Vec<Vec3>> = [1, 3]
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (mut mechanics, mut x) = mild();
            pool.install(|| {
                let mut solver = method(name, mechanics.mechanics());
                let _ = relax(&mut *solver, &mut mechanics, &mut x, 1e-12, 200);
            });
            x
        })
        .into();
    assert!(shapes[0] == shapes[1], "{name}");
}

#[test]
fn they_fail_in_the_words_of_the_others() {
    let (mut mechanics, start) = mild();
    let name = "descent";
    let mut solver = method(name, mechanics.mechanics());
    let mut x = start.clone();
    let error = relax(&mut *solver, &mut mechanics, &mut x, 1e-9, 5).unwrap_err();
    assert!(matches!(error, SolveError::NotConverged { iterations: 5, .. }), "{error}");
    assert!(x != start && mechanics.energy(&x) < mechanics.energy(&start));
    let goal =
        Goal { tolerance: 1e-9, max_iterations: 9, interrupted: &|| true, ..Goal::default() };
    let error = solver.relax(&mut mechanics, &mut x, &goal).unwrap_err();
    assert!(matches!(error, SolveError::Interrupted), "{error}");
    x[60].x = f64::NAN;
    let error = relax(&mut *solver, &mut mechanics, &mut x, 1e-9, 5).unwrap_err();
    assert!(matches!(error, SolveError::NotFinite), "{error}");
}

/// A vertex is pushed against the opposite edge of its triangles: no step may turn one over.
#[test]
fn no_triangle_turns_over() {
    let name = "descent";
    let (mut mechanics, mut x) = mild();
    let sheet = Arc::clone(mechanics.sheet());
    let normal = |x: &[Vec3], t: usize| {
        let [a, b, c] = sheet.triangles()[t].map(|v| x[v as usize]);
        (b - a).cross(&(c - a))
    };
    x.iter_mut().for_each(|x| x.z = 0.0);
    mechanics.set_length_factor(
        &(0..sheet.edges().len()).map(|e| 1.0 + 0.9 * (e as f64).sin()).collect::<Vec<_>>(),
    );
    for _ in 0..20 {
        let before = x.clone();
        let mut solver = method(name, mechanics.mechanics());
        let _ = relax(&mut *solver, &mut mechanics, &mut x, 1e-9, 1);
        for t in 0..sheet.triangle_count() {
            let (old, new) = (normal(&before, t), normal(&x, t));
            assert!(old.dot(&new) > 0.0 && new.norm() >= 0.4 * old.norm(), "{name} {t}");
        }
    }
}
