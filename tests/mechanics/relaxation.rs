//! Relaxation: reaches its tolerance, finds flat growth stress-free, refuses what it cannot do.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::Material;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::solve::SolveError;
use rumple::solve::equilibrium::{
    Collapse, Equilibrium, Goal, Lbfgs, LbfgsSpec, Relaxation, explained,
};

use super::both;
use crate::common::{Noise, irregular};

fn goal(tolerance: f64) -> Goal<'static> {
    Goal { tolerance, max_iterations: 2000, ..Goal::default() }
}

/// B2 of the truths: with z fixed at the boundary and free in the plane, uniform growth has no stress.
#[test]
fn uniform_growth_with_a_free_boundary_is_free_of_stress() {
    let sheet = Arc::new(irregular(14, 13, 0.2));
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    let mut mechanics = both(&sheet, &material, pins);
    mechanics.set_length_factor(&vec![1.0 / 0.65; sheet.edges().len()]);
    let mut x = sheet.rest().to_vec();
    let mut solver = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
    let done = solver.relax(&mut mechanics, &mut x, &goal(1e-10)).unwrap();
    let y = material.stretching_modulus();
    assert!(done.energy < 1e-16 * y * sheet.vertex_count() as f64, "{done:?}");
    assert!(x.iter().all(|x| x.z.abs() < 1e-9));
}

#[test]
fn a_grown_spot_buckles_and_comes_to_rest() {
    let sheet = Arc::new(irregular(30, 34, 0.2));
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.3 };
    let pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    let mut mechanics = both(&sheet, &material, pins);
    let centre = Vec3::new(15.0, 15.0, 0.0);
    let inside = |v: u32| (sheet.rest()[v as usize] - centre).norm() < 6.0;
    let factor: Vec<f64> = sheet
        .edges()
        .iter()
        .map(|e| if inside(e.vertices[0]) && inside(e.vertices[1]) { 1.1 } else { 1.0 })
        .collect();
    mechanics.set_length_factor(&factor);
    let mut noise = Noise::new(3);
    let mut x: Vec<Vec3> = sheet.rest().to_vec();
    for (x, boundary) in x.iter_mut().zip(sheet.boundary()) {
        let z = noise.number();
        x.z = if *boundary { 0.0 } else { 1e-3 * z };
    }
    let flat = mechanics.energy(&x);
    let mut solver = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
    let done = solver.relax(&mut mechanics, &mut x, &goal(1e-9)).unwrap();
    assert!(done.residual <= 1e-9);
    assert!(done.energy < 0.5 * flat, "{} {}", done.energy, flat);
    let height = x.iter().map(|x| x.z.abs()).fold(0.0, f64::max);
    assert!(height > 1.0, "{height}");
    // Again from there: nothing left to do.
    let again = solver.relax(&mut mechanics, &mut x, &goal(1e-9)).unwrap();
    assert_eq!(again.iterations, 0);
}

#[test]
fn hopeless_relaxations_are_reported() {
    let sheet = Arc::new(irregular(8, 8, 0.1));
    let material = Material { young: 1.0, poisson: 1.0 / 3.0, thickness: 0.1 };
    let mut mechanics = both(&sheet, &material, vec![[false; 3]; sheet.vertex_count()]);
    mechanics.set_length_factor(&vec![1.2; sheet.edges().len()]);
    let mut solver = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
    let mut x = sheet.rest().to_vec();
    let one = Goal { tolerance: 1e-9, max_iterations: 1, ..Goal::default() };
    let error = solver.relax(&mut mechanics, &mut x, &one).unwrap_err();
    assert!(matches!(error, SolveError::NotConverged { iterations: 1, .. }), "{error}");
    // Strains of per cents are no tolerance to recommend, however loose the one asked for.
    let error = SolveError::NotConverged { iterations: 1, residual: 0.1, tolerance: 0.01 };
    assert!(!error.to_string().contains("equilibrium.tolerance"), "{error}");
    let error = SolveError::NotConverged { iterations: 1, residual: 1e-4, tolerance: 1e-6 };
    assert!(error.to_string().contains("equilibrium.tolerance = 2e-4"), "{error}");
    let stop =
        Goal { tolerance: 1e-9, max_iterations: 100, interrupted: &|| true, ..Goal::default() };
    let error = solver.relax(&mut mechanics, &mut x, &stop).unwrap_err();
    assert!(matches!(error, SolveError::Interrupted));
    x[20] = x[21];
    x[20].x = f64::NAN;
    let error = solver.relax(&mut mechanics, &mut x, &goal(1e-9)).unwrap_err();
    assert!(matches!(error, SolveError::NotFinite), "{error}");
}

/// One vertex may move in the plane and wants to be far from its neighbours but for two, which it
/// wants to be near to: it is driven through the edge between these, and their triangle flat.
fn driven_flat(collapse: Collapse) -> (Arc<Sheet>, usize, Result<Relaxation, SolveError>) {
    let sheet = Arc::new(irregular(9, 9, 0.1));
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.05 };
    let vertex = 40;
    assert!(!sheet.boundary()[vertex]);
    let mut pins = vec![[true; 3]; sheet.vertex_count()];
    pins[vertex] = [false, false, true];
    let mut mechanics = both(&sheet, &material, pins);
    let (triangle, corner) = sheet.vertex_triangles().entries(vertex)[0];
    let near = sheet.triangles()[triangle as usize];
    assert_eq!(near[corner as usize] as usize, vertex);
    let mut factor = vec![1.0; sheet.edges().len()];
    for &(e, j) in sheet.vertex_edges().entries(vertex) {
        factor[e as usize] = if near.contains(&j) { 0.2 } else { 2.0 };
    }
    mechanics.set_length_factor(&factor);
    let mut solver = Lbfgs::new(
        mechanics.mechanics(),
        LbfgsSpec { collapse: Some(collapse), ..LbfgsSpec::default() },
    )
    .unwrap();
    let mut x = sheet.rest().to_vec();
    let result = solver.relax(&mut mechanics, &mut x, &goal(1e-6));
    assert!(x.iter().all(|x| x.iter().all(|c| c.is_finite())));
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| x[v as usize]);
        assert!((b - a).cross(&(c - a)).z > 0.0, "a triangle has turned over");
    }
    (sheet, triangle as usize, result)
}

#[test]
fn a_triangle_driven_flat_is_named_or_fixed() {
    let (sheet, driven, result) = driven_flat(Collapse::Stop);
    let error = result.unwrap_err();
    let SolveError::Collapsed { triangle, vertices, .. } = &error else { panic!("{error}") };
    assert_eq!((*triangle, *vertices), (driven, sheet.triangles()[driven]));
    assert!(error.to_string().contains("collapse = \"hold\""), "{error}");

    let (_, _, result) = driven_flat(Collapse::Hold);
    let done = result.unwrap();
    assert!(done.collapsed > 0 && done.residual <= 1e-6, "{done:?}");
}

/// Close to buckling and close to rest every step is level to round-off, and the slope barely
/// falls: neither may stop the relaxation.
#[test]
fn round_off_near_buckling_does_not_stop_a_relaxation() {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 10.0 }, 1000, 1).unwrap());
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.3 };
    let fixed = sheet.boundary().iter().map(|boundary| [*boundary; 3]).collect();
    let mut mechanics = both(&sheet, &material, fixed);
    for seed in [1, 2, 3, 7] {
        let mut noise = Noise::new(seed);
        let start = sheet.rest().iter().zip(sheet.boundary());
        let mut x: Vec<Vec3> = start
            .map(|(x, boundary)| if *boundary { *x } else { x + 1e-3 * noise.number() * Vec3::z() })
            .collect();
        for growth in [0.0, 5e-5, 1e-4, 1.5e-4, 1.8e-4, 1.9e-4, 2.0e-4] {
            mechanics.set_length_factor(&vec![1.0 + growth; sheet.edges().len()]);
            let mut solver = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
            let goal = Goal { tolerance: 1e-10, max_iterations: 300, ..Goal::default() };
            let before = mechanics.mechanics().tally().work();
            let done = solver.relax(&mut mechanics, &mut x, &goal);
            done.unwrap_or_else(|e| panic!("noise {seed}, growth {growth}: {e}"));
            let work = mechanics.mechanics().tally().work() - before;
            assert!(work.gradients < 600, "noise {seed}, growth {growth}: {work:?}");
        }
    }
}

/// Whatever the method, what came to no end at a collapsed triangle is reported as that.
#[test]
fn a_collapsed_triangle_explains_why_a_relaxation_stopped() {
    let sheet = Arc::new(irregular(8, 8, 0.2));
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.3 };
    let mut mechanics = both(&sheet, &material, vec![[false; 3]; sheet.vertex_count()]);
    let stopped = || SolveError::NotConverged { iterations: 7, residual: 0.1, tolerance: 1e-6 };
    let mut x = sheet.rest().to_vec();
    let error = explained(stopped(), &mut mechanics, &x, 1e-6);
    assert!(matches!(error, SolveError::NotConverged { .. }), "{error}");
    let [a, b, c] = sheet.triangles()[20].map(|v| v as usize);
    x[a] = 0.5 * (x[b] + x[c]) + 1e-6 * (x[a] - x[b]);
    match explained(stopped(), &mut mechanics, &x, 1e-6) {
        SolveError::Collapsed { triangle: 20, vertices, iterations: 7, .. } => {
            assert_eq!(vertices, sheet.triangles()[20]);
        }
        error => panic!("{error}"),
    }
    assert!(matches!(
        explained(SolveError::Interrupted, &mut mechanics, &x, 1e-6),
        SolveError::Interrupted
    ));
}
