//! Linear solvers: they solve, and give the same bits on any number of threads.

use std::sync::Arc;

use rumple::Vec3;
use rumple::tally::Tally;
use rumple_numerics::linear::{
    Assembly, Block, BlockLdlt, BlockMatrix, BlockPattern, Entries, LinearChoice,
    MixedPrecisionCholesky, Shifted, Sparse,
};

use super::two_rings;
use crate::common::irregular;

const THREADS: [usize; 4] = [1, 2, 3, 7];

/// What `work` gives on each number of threads is the same; it is returned.
fn on_all<T: PartialEq + Send>(name: &str, work: impl Fn() -> T + Sync) -> T {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(&work)
    };
    let first = on(THREADS[0]);
    for threads in &THREADS[1..] {
        assert!(on(*threads) == first, "{name} on {threads} threads");
    }
    first
}

/// Springs between vertices up to two edges apart, anchored by `anchor`; indefinite where that is negative.
fn springs(columns: usize, rows: usize, planar: bool, anchor: f64) -> BlockMatrix {
    let sheet = irregular(columns, rows, 0.2);
    let pattern = two_rings(&sheet);
    let pattern = Arc::new(if planar { pattern.in_plane() } else { pattern });
    let mut matrix = BlockMatrix::zeros(Arc::clone(&pattern));
    let ends: Vec<(usize, usize)> = (0..pattern.rows())
        .flat_map(|i| pattern.row(i)[1..].iter().map(move |&j| (i, j as usize)))
        .collect();
    let mut diagonal = vec![Block::from_diagonal_element(anchor); pattern.rows()];
    let stiffness = |i: usize, j: usize| {
        let d = sheet.rest()[j] - sheet.rest()[i] + 0.1 * Vec3::new(0.0, 0.0, 1.0);
        d * d.transpose() / d.norm_squared()
    };
    for (i, j) in ends {
        diagonal[i] += stiffness(i, j);
        diagonal[j] += stiffness(i, j);
    }
    matrix.update_rows(|i, row| {
        row.add(i, &diagonal[i]);
        for &j in &pattern.row(i)[1..] {
            row.add(j as usize, &-stiffness(i, j as usize));
        }
    });
    matrix
}

fn times(matrix: &BlockMatrix, x: &[Vec3]) -> Vec<Vec3> {
    let pattern = matrix.pattern();
    let mut out = vec![Vec3::zeros(); x.len()];
    for i in 0..x.len() {
        for (&j, block) in pattern.row(i).iter().zip(matrix.row(i)) {
            let j = j as usize;
            out[i] += block * x[j];
            if j != i {
                out[j] += block.transpose() * x[i];
            }
        }
    }
    out
}

fn forces(n: usize, planar: bool) -> Vec<Vec3> {
    let z = if planar { 0.0 } else { 1.0 };
    (0..n)
        .map(|i| i as f64)
        .map(|i| Vec3::new(i.sin(), (1.3 * i).cos(), z * (0.7 * i).sin()))
        .collect()
}

/// |A x - b| / |b|, largest components.
fn residual(matrix: &BlockMatrix, x: &[Vec3], b: &[Vec3]) -> f64 {
    let differences =
        times(matrix, x).iter().zip(b).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
    differences / b.iter().map(|b| b.amax()).fold(0.0, f64::max)
}

fn check_cholesky(columns: usize, rows: usize, planar: bool, single: bool, allowed: f64) {
    let matrix = springs(columns, rows, planar, 0.05);
    let b = forces(matrix.pattern().rows(), planar);
    let name = format!("{columns} × {rows}, planar: {planar}");
    let x = on_all(&name, || {
        let mut cholesky = MixedPrecisionCholesky::new(Arc::clone(matrix.pattern())).unwrap();
        cholesky.set_double(!single).unwrap();
        // Twice: rooms that were used before are used again.
        for _ in 0..2 {
            cholesky.factorise(&matrix, false).unwrap();
        }
        assert_eq!(cholesky.is_double(), !single);
        let mut x = b.clone();
        cholesky.solve(&mut x);
        x
    });
    let found = residual(&matrix, &x, &b);
    println!("{name}: {found:e}");
    assert!(found < allowed, "{name}: {found:e}");
}

#[test]
fn cholesky_factors() {
    for (columns, rows) in [(2, 2), (3, 5), (70, 60), (300, 12)] {
        for planar in [false, true] {
            check_cholesky(columns, rows, planar, false, 1e-11);
            check_cholesky(columns, rows, planar, true, 2e-3);
        }
    }
}

/// Parts that are not connected, down to single vertices.
#[test]
fn cholesky_factors_of_a_forest() {
    let n = 40;
    let pairs: Vec<[u32; 2]> = (0..10).map(|k| [k, 39 - 2 * k]).collect();
    let pattern = Arc::new(BlockPattern::of_rings(n, 0, &|_, _| {}, &pairs));
    let mut matrix = BlockMatrix::zeros(Arc::clone(&pattern));
    matrix.update_rows(|i, row| {
        for &j in pattern.row(i) {
            let size = if j as usize == i { 3.0 } else { 1.0 };
            row.add(j as usize, &Block::from_diagonal_element(size));
        }
    });
    let b = forces(n, false);
    let x = on_all("forest", || {
        let mut cholesky =
            MixedPrecisionCholesky::in_double_precision(Arc::clone(&pattern)).unwrap();
        cholesky.factorise(&matrix, true).unwrap();
        let mut x = b.clone();
        cholesky.solve(&mut x);
        x
    });
    assert!(residual(&matrix, &x, &b) < 1e-14);
}

#[test]
fn what_is_not_positive_is_refused_wherever_it_is() {
    let positive = springs(60, 50, false, 0.05);
    let mut cholesky =
        MixedPrecisionCholesky::in_double_precision(Arc::clone(positive.pattern())).unwrap();
    let n = positive.pattern().rows();
    for vertex in [0, n / 3, n / 2, n - 1] {
        for bad in [-100.0, f64::NAN] {
            let mut matrix = positive.clone();
            matrix.add_to_diagonal(vertex, 1, bad);
            assert!(cholesky.factorise(&matrix, true).is_err(), "{vertex}: {bad}");
        }
    }
    cholesky.factorise(&positive, true).unwrap();
    let b = forces(n, false);
    let mut x = b.clone();
    cholesky.solve(&mut x);
    assert!(residual(&positive, &x, &b) < 1e-11);
}

#[test]
fn indefinite_factors() {
    let matrix = springs(40, 30, false, -0.5);
    let b = forces(matrix.pattern().rows(), false);
    let (negative, x) = on_all("LDLᵀ", || {
        let mut ldlt = BlockLdlt::new(Arc::clone(matrix.pattern())).unwrap();
        let negative = ldlt.factorise(&matrix).unwrap();
        let mut x = b.clone();
        ldlt.solve(&mut x);
        (negative, x)
    });
    assert!(negative > 10 && residual(&matrix, &x, &b) < 1e-8);
}

/// Diffusion of two species that react, point by point, on a square lattice.
fn diffusion(side: usize) -> Sparse {
    let (n, at) = (2 * side * side, |i: usize, j: usize, s: usize| 2 * (side * j + i) + s);
    let name = |entries: &mut Entries<'_>| {
        for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
            for s in 0..2 {
                let own = at(i, j, s);
                entries.add(own, at(i, j, 1 - s), [0.3, -0.8][s]);
                for (k, l) in
                    [(i + 1, j), (i.wrapping_sub(1), j), (i, j + 1), (i, j.wrapping_sub(1))]
                {
                    if k < side && l < side {
                        entries.add(own, own, -1.0);
                        entries.add(own, at(k, l, s), 1.0);
                    }
                }
            }
        }
    };
    let mut assembly = Assembly::new(n, n, name);
    assembly.fill(name);
    assembly.matrix().clone()
}

#[test]
fn general_factors() {
    for (choice, side, weight) in [
        (LinearChoice::Lu, 30, 2.0),
        (LinearChoice::Ilu, 30, 2.0),
        // Many strips with seams between them.
        (LinearChoice::Ilu, 150, 2.0),
        (LinearChoice::Ilu, 150, 200.0),
    ] {
        let jacobian = diffusion(side);
        let b: Vec<f64> = (0..jacobian.rows()).map(|k| (0.01 * k as f64).sin()).collect();
        let name = format!("{choice:?}, {side}, {weight}");
        let x = on_all(&name, || {
            let mut matrix = Shifted::new(&jacobian, choice, None).unwrap();
            let mut x = b.clone();
            matrix.solve(&jacobian, |_| (1.0, weight), &mut x, &Tally::default()).unwrap();
            x
        });
        let mut product = vec![0.0; b.len()];
        jacobian.multiply(&x, &mut product);
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|v| v * v).sum::<f64>().sqrt();
        let all = || (0..b.len()).map(|k| x[k] - weight * product[k] - b[k]);
        let relative = norm(&mut all()) / norm(&mut b.iter().copied());
        println!("{name}: {relative:e}");
        assert!(relative < 2e-2, "{name}: {relative:e}");
    }
}

/// A matrix that is filled in parts is the same as one that is filled in one go, but for round-off.
#[test]
fn parts_of_an_assembly_add_up() {
    let n = 50;
    let list = |from: usize, entries: &mut Entries<'_>| {
        for k in from..from + 30 {
            entries.add(k % n, (7 * k) % n, (k as f64).sin());
            entries.add(k % 5, (3 * k) % 11, (k as f64).cos());
        }
    };
    let (first, second) = (|e: &mut Entries<'_>| list(0, e), |e: &mut Entries<'_>| list(20, e));
    let last = |e: &mut Entries<'_>| list(40, e);
    let mut parts = Assembly::in_parts(n, n, &[&first, &second], last);
    let whole = |e: &mut Entries<'_>| [0, 20, 40].iter().for_each(|&from| list(from, e));
    let mut one = Assembly::new(n, n, whole);
    one.fill(whole);
    for _ in 0..2 {
        parts.fill_in_parts(&[&first, &second], last);
        for i in 0..n {
            let pairs = parts.matrix().row(i).zip(one.matrix().row(i));
            for ((j, a), (k, b)) in pairs {
                assert!(j == k && (a - b).abs() < 1e-14, "{i} {j} {k}: {a} {b}");
            }
        }
    }
}
