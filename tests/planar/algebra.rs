//! Matrices of sheets that move in a plane: two unknowns a vertex in blocks, factors and multigrid.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{EnergyTerm, HessianPart, Material, StretchingModulus, StvkStretching};
use rumple::model::{Mechanics, MechanicsParts, Potential};
use rumple::sheet::Sheet;
use rumple_numerics::linear::{BlockCholesky, BlockLdlt, BlockMatrix, Multigrid};

use crate::common::{Noise, allocations, irregular};

const MATERIAL: Material = Material { young: 20.0, poisson: 0.3, thickness: 0.5 };

/// A sheet with a few vertices fixed, in its plane or in space, and a shape in the plane.
fn potential(sheet: &Arc<Sheet>, planar: bool) -> (Potential, Vec<Vec3>) {
    let energy =
        vec![EnergyTerm::new(StvkStretching::new(&MATERIAL, StretchingModulus::PlaneStress))];
    let pins = sheet.rest().iter().map(|x| [x.x < 0.6, x.x < 0.6, !planar]).collect();
    let parts = MechanicsParts { terms: energy, pins, planar, ..MechanicsParts::default() };
    let mechanics = Mechanics::from_parts(Arc::clone(sheet), parts).unwrap();
    let mut noise = Noise::new(3);
    let x = sheet.rest().iter().map(|x| {
        let v = noise.vector();
        x + 0.02 * Vec3::new(v.x, v.y, 0.0)
    });
    (Potential::new(&mechanics), x.collect())
}

fn matrix(sheet: &Arc<Sheet>, planar: bool) -> (BlockMatrix, Vec<Vec3>) {
    let (mut potential, x) = potential(sheet, planar);
    let mut matrix = BlockMatrix::zeros(potential.pattern(&x));
    potential.hessian(&x, HessianPart::Positive, &mut matrix).unwrap();
    matrix.add_diagonal(1e-3);
    (matrix, x)
}

fn loads(n: usize) -> Vec<Vec3> {
    let mut noise = Noise::new(8);
    (0..n).map(|_| Vec3::new(noise.number(), noise.number(), 0.0)).collect()
}

/// The free directions; others are 0 in one and a multiple of the load in the other.
fn free(sheet: &Sheet, mut v: Vec<Vec3>) -> Vec<Vec3> {
    for (v, x) in v.iter_mut().zip(sheet.rest()) {
        if x.x < 0.6 {
            *v = Vec3::zeros();
        }
    }
    v
}

fn apart(a: &[Vec3], b: &[Vec3]) -> f64 {
    let size = b.iter().map(|b| b.norm()).fold(0.0, f64::max);
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / size
}

#[test]
fn blocks_are_those_of_space_without_z() {
    let sheet = Arc::new(irregular(14, 12, 0.2));
    let ((plane, _), (space, _)) = (matrix(&sheet, true), matrix(&sheet, false));
    assert_eq!(9 * plane.bytes(), 4 * space.bytes());
    for i in 0..sheet.vertex_count() {
        assert_eq!(plane.pattern().row(i), space.pattern().row(i));
        for (&j, (a, b)) in plane.pattern().row(i).iter().zip(plane.row(i).zip(space.row(i))) {
            let fixed = [i, j as usize].iter().any(|v| sheet.rest()[*v].x < 0.6);
            let mut flat = b;
            flat.row_mut(2).fill(0.0);
            flat.column_mut(2).fill(0.0);
            assert!(fixed || a == flat, "{i}, {j}: {a} {b}");
        }
    }
}

#[test]
fn factors_have_two_unknowns_a_vertex_and_solve_the_same() {
    let sheet = Arc::new(irregular(40, 36, 0.2));
    let n = sheet.vertex_count();
    let ((plane, _), (space, _)) = (matrix(&sheet, true), matrix(&sheet, false));
    let mut small = <BlockCholesky>::new(Arc::clone(plane.pattern())).unwrap();
    let mut large = <BlockCholesky>::new(Arc::clone(space.pattern())).unwrap();
    // 4/9, and less where the small factor is stored without supernodes.
    let ratio = small.factor_size() as f64 / large.factor_size() as f64;
    assert!(ratio < 0.5, "{ratio}");
    small.factorise(&plane).unwrap();
    large.factorise(&space).unwrap();
    let rhs = free(&sheet, loads(n));
    let (mut a, mut b) = (rhs.clone(), rhs.clone());
    small.solve(&mut a);
    large.solve(&mut b);
    assert!(apart(&a, &b) < 1e-10, "{}", apart(&a, &b));
    assert!(a.iter().all(|a| a.z == 0.0));

    let mut ldlt = BlockLdlt::new(Arc::clone(plane.pattern())).unwrap();
    assert_eq!(ldlt.factorise(&plane), Ok(0));
    let mut c = rhs.clone();
    ldlt.solve(&mut c);
    assert!(apart(&c, &b) < 1e-10);
    // A shift beyond all eigenvalues turns every unknown, and there are two a vertex.
    let mut shifted = BlockMatrix::zeros(Arc::clone(plane.pattern()));
    shifted.take_shifted(&plane, |_| -1e6);
    assert_eq!(ldlt.factorise(&shifted), Ok(2 * n));
}

#[test]
fn multigrid_has_half_of_the_coarse_unknowns_and_converges_as_in_space() {
    let sheet = Arc::new(irregular(60, 60, 0.2));
    let n = sheet.vertex_count();
    let ((plane, x), (space, _)) = (matrix(&sheet, true), matrix(&sheet, false));
    let prepared = |matrix: &BlockMatrix, coarsest: usize| {
        let mut multigrid = Multigrid::with_coarsest(matrix.pattern(), coarsest).unwrap();
        assert!(multigrid.factorise(matrix, &x, true).is_ok());
        multigrid
    };
    let solve = |multigrid: &mut Multigrid, v: &[Vec3]| {
        let mut z = v.to_vec();
        multigrid.solve(&mut z);
        z
    };
    let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    for coarsest in [100_000, 50] {
        let mut multigrid = prepared(&plane, coarsest);
        let (u, v) = (free(&sheet, loads(n)), free(&sheet, loads(2 * n)[n..].to_vec()));
        let (mu, mv) = (solve(&mut multigrid, &u), solve(&mut multigrid, &v));
        let scale = (dot(&u, &mu) * dot(&v, &mv)).sqrt();
        assert!(dot(&u, &mu) > 0.0 && dot(&v, &mv) > 0.0);
        assert!((dot(&u, &mv) - dot(&v, &mu)).abs() < 1e-6 * scale);
        assert!(mu.iter().all(|z| z.z == 0.0));
    }
    let bytes = |matrix: &BlockMatrix| prepared(matrix, 100_000).bytes() as f64;
    let ratio = bytes(&plane) / bytes(&space);
    assert!(ratio < 0.75, "{ratio}");
    let steps = |matrix: &BlockMatrix| {
        let mut multigrid = prepared(matrix, 50);
        let mut r = free(&sheet, loads(n));
        let mut z = solve(&mut multigrid, &r);
        let (mut p, mut size) = (z.clone(), dot(&r, &z));
        let enough = 1e-12 * size;
        (1..100).find(|_| {
            let image = product(matrix, &p);
            let alpha = size / dot(&p, &image);
            r.iter_mut().zip(&image).for_each(|(r, a)| *r -= alpha * a);
            z = solve(&mut multigrid, &r);
            let next = dot(&r, &z);
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + next / size * *p);
            size = next;
            next < enough
        })
    };
    let (a, b) = (steps(&plane).unwrap(), steps(&space).unwrap());
    assert!(a <= b + 2, "{a} steps of conjugate gradients in the plane, {b} in space");
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

#[test]
fn evaluation_assembly_and_factorisation_allocate_nothing() {
    let sheet = Arc::new(irregular(30, 30, 0.2));
    let (mut potential, x) = potential(&sheet, true);
    let mut hessian = BlockMatrix::zeros(potential.pattern(&x));
    let mut cholesky = <BlockCholesky>::new(potential.pattern(&x)).unwrap();
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let mut work = || {
            potential.energy_gradient(&x, &mut gradient);
            potential.hessian(&x, HessianPart::Positive, &mut hessian).unwrap();
            hessian.add_diagonal(hessian.mean_diagonal());
            cholesky.factorise(&hessian).unwrap();
            cholesky.solve(&mut gradient);
        };
        work();
        let before = allocations();
        work();
        assert_eq!(allocations() - before, 0);
    });
}
