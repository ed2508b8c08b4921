//! Multigrid: symmetric, positive, exact for rigid motions, as good on fine sheets as on coarse ones.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{HessianPart, Material};
use rumple::model::Potential;
use rumple::sheet::{SheetShape, generate};
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec, Preconditioner, Relaxation};
use rumple_numerics::linear::{BlockMatrix, Multigrid};

use super::{both, two_rings};
use crate::common::Noise;

const RADIUS: f64 = 100.0;

/// A disc whose middle has grown and stands up; its boundary is fixed vertically if `fixed`.
fn dome(vertices: usize, fixed: bool) -> (Potential, Vec<Vec3>) {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: RADIUS }, vertices, 1).unwrap());
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 2.0 };
    let pins = sheet.boundary().iter().map(|boundary| [false, false, fixed && *boundary]).collect();
    let mut mechanics = both(&sheet, &material, pins);
    let spot = |x: &Vec3| (-(x.x * x.x + x.y * x.y) / 800.0).exp();
    let rest = |v: u32| sheet.rest()[v as usize];
    let middle = |e: [u32; 2]| 0.5 * (rest(e[0]) + rest(e[1]));
    let factor: Vec<f64> =
        sheet.edges().iter().map(|e| 1.0 + 0.05 * spot(&middle(e.vertices))).collect();
    mechanics.set_length_factor(&factor);
    let raised = sheet.rest().iter().zip(sheet.boundary());
    let x = raised.map(|(x, boundary)| x + if *boundary { 0.0 } else { 5.0 } * spot(x) * Vec3::z());
    let x = x.collect();
    (mechanics, x)
}

/// The positive part at `x` with a small shift, relative to its mean diagonal.
fn positive(mechanics: &mut Potential, x: &[Vec3], shift: f64) -> BlockMatrix {
    let mut matrix = BlockMatrix::zeros(Arc::new(two_rings(mechanics.sheet())));
    mechanics.hessian(x, HessianPart::Positive, &mut matrix).unwrap();
    matrix.add_diagonal(shift * matrix.mean_diagonal());
    matrix
}

fn prepared(matrix: &BlockMatrix, x: &[Vec3], coarsest: usize) -> Multigrid {
    let mut multigrid = Multigrid::with_coarsest(matrix.pattern(), coarsest).unwrap();
    assert!(multigrid.factorise(matrix, x, true).is_ok());
    multigrid
}

fn solved(multigrid: &mut Multigrid, rhs: &[Vec3]) -> Vec<Vec3> {
    let mut z = rhs.to_vec();
    multigrid.solve(&mut z);
    z
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn product(matrix: &BlockMatrix, v: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); v.len()];
    for i in 0..v.len() {
        for (block, &j) in matrix.row(i).zip(matrix.pattern().row(i)) {
            let j = j as usize;
            out[i] += block * v[j];
            if j != i {
                out[j] += block.tr_mul(&v[i]);
            }
        }
    }
    out
}

/// Iterations of conjugate gradients until `rᵀ M r` has fallen by 1e-12.
fn iterations(matrix: &BlockMatrix, rhs: &[Vec3], multigrid: &mut Multigrid) -> usize {
    let mut r = rhs.to_vec();
    let mut z = solved(multigrid, &r);
    let mut p = z.clone();
    let mut size = dot(&r, &z);
    let enough = 1e-12 * size;
    for iteration in 1..200 {
        let image = product(matrix, &p);
        let alpha = size / dot(&p, &image);
        r.iter_mut().zip(&image).for_each(|(r, a)| *r -= alpha * a);
        z = solved(multigrid, &r);
        let next = dot(&r, &z);
        assert!(next >= 0.0);
        if next < enough {
            return iteration;
        }
        p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + next / size * *p);
        size = next;
    }
    200
}

#[test]
fn the_cycle_is_symmetric_and_positive() {
    let (mut mechanics, x) = dome(3000, true);
    let matrix = positive(&mut mechanics, &x, 1e-6);
    let mut noise = Noise::new(5);
    let mut random = || -> Vec<Vec3> { x.iter().map(|_| noise.vector()).collect() };
    for coarsest in [100_000, 100] {
        let mut multigrid = prepared(&matrix, &x, coarsest);
        for _ in 0..5 {
            let (u, v) = (random(), random());
            let (mu, mv) = (solved(&mut multigrid, &u), solved(&mut multigrid, &v));
            let scale = (dot(&u, &mu) * dot(&v, &mv)).sqrt();
            assert!(dot(&u, &mu) > 0.0 && dot(&v, &mv) > 0.0);
            let apart = (dot(&u, &mv) - dot(&v, &mu)).abs() / scale;
            assert!(apart < 1e-9, "{apart}");
        }
    }
}

/// On a sheet that nothing holds the shift alone resists them: `A v` is nearly lost in rounding.
#[test]
fn rigid_motions_are_solved_for_in_one_cycle() {
    let (mut mechanics, x) = dome(3000, false);
    mechanics.set_length_factor(&vec![1.0; mechanics.sheet().edges().len()]);
    let x: Vec<Vec3> = x.iter().map(|x| Vec3::new(x.x, x.y, 0.0)).collect();
    let matrix = positive(&mut mechanics, &x, 1e-6);
    let mut multigrid = prepared(&matrix, &x, 100_000);
    for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
        let shift: Vec<Vec3> = x.iter().map(|_| axis).collect();
        let turn: Vec<Vec3> = x.iter().map(|x| axis.cross(x)).collect();
        for motion in [shift, turn] {
            let found = solved(&mut multigrid, &product(&matrix, &motion));
            let error: Vec<Vec3> = found.iter().zip(&motion).map(|(a, b)| a - b).collect();
            let relative = (dot(&error, &error) / dot(&motion, &motion)).sqrt();
            println!("{relative:.1e}");
            assert!(relative < 1e-3, "{relative}");
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let (mut mechanics, x) = dome(4000, true);
    let matrix = positive(&mut mechanics, &x, 1e-9);
    let rhs: Vec<Vec3> = x.iter().map(|x| Vec3::new(x.y.sin(), x.x.cos(), x.z)).collect();
    let results: Vec<Vec<Vec3>> = [1, 2]
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solved(&mut prepared(&matrix, &x, 100), &rhs))
        })
        .into();
    assert!(results[0] == results[1]);
}

#[test]
fn conjugate_gradients_need_no_more_iterations_on_finer_sheets() {
    let mut counts = Vec::new();
    for (vertices, coarsest) in [(1000, 100_000), (10_000, 100_000), (10_000, 500)] {
        let (mut mechanics, x) = dome(vertices, true);
        let matrix = positive(&mut mechanics, &x, 1e-9);
        let mut gradient = x.clone();
        mechanics.energy_gradient(&x, &mut gradient);
        let mut multigrid = prepared(&matrix, &x, coarsest);
        counts.push(iterations(&matrix, &gradient, &mut multigrid));
    }
    println!("{counts:?}");
    assert!(counts[0] <= 22 && counts[1] <= counts[0] + 6, "{counts:?}");
    // With a third level, which only sheets of more than a million vertices need.
    assert!(counts[2] <= 60, "{counts:?}");
}

fn relaxed(preconditioner: Preconditioner) -> Relaxation {
    let (mut mechanics, mut x) = dome(3000, true);
    let goal = Goal { tolerance: 1e-9, max_iterations: 500, ..Goal::default() };
    let spec = LbfgsSpec { preconditioner, ..LbfgsSpec::default() };
    let mut lbfgs = Lbfgs::new(mechanics.mechanics(), spec).unwrap();
    lbfgs.relax(&mut mechanics, &mut x, &goal).unwrap()
}

#[test]
fn a_relaxation_reaches_the_energy_that_it_reaches_with_the_factor() {
    let done =
        [Preconditioner::Factor, Preconditioner::Multigrid, Preconditioner::Auto].map(relaxed);
    println!("{done:?}");
    assert!((done[1].energy / done[0].energy - 1.0).abs() < 1e-10, "{done:?}");
    assert!(done[1].iterations < 3 * done[0].iterations, "{done:?}");
    // So small a sheet has a factor.
    assert_eq!(done[2], done[0]);
}
