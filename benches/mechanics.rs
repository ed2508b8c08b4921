//! Energy, gradient and second derivatives of the main scene's mechanics at 20 000 vertices, on one
//! and on two threads; and the time to make its mesh.
//!
//! `cargo bench --bench mechanics`

#![allow(missing_docs)]

use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use rumple::Vec3;
use rumple::effects::StretchingWeight;
use rumple::effects::{BendingWeight, BondStretching, Energy, HessianPart, Material, MeyerBending};
use rumple::geometry::AreaRule;
use rumple::sheet::{Shape, Sheet, generate};
use rumple::solve::linear::{BlockCholesky, BlockMatrix, BlockPattern};
use rumple::system::Mechanics;

const DISC: Shape = Shape::Disc { radius: 100.0 };

fn disc() -> Arc<Sheet> {
    Arc::new(generate(&DISC, 20_000, 1).unwrap())
}

fn mechanics(sheet: &Arc<Sheet>) -> Mechanics {
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let area = AreaRule::FrozenVoronoi;
    let energies: Vec<Box<dyn Energy>> = vec![
        Box::new(BondStretching::new(&material, StretchingWeight::OptimalArea)),
        Box::new(MeyerBending::new(sheet, &material, BendingWeight::Area, area)),
    ];
    let pins = sheet.rim().iter().map(|rim| [false, false, *rim]).collect();
    Mechanics::new(Arc::clone(sheet), energies, pins).unwrap()
}

fn wavy(sheet: &Sheet) -> Vec<Vec3> {
    let wave = |x: &Vec3| 0.3 * (0.2 * x.x).sin() * (0.17 * x.y).cos();
    sheet.rest().iter().map(|x| Vec3::new(x.x, x.y, wave(x))).collect()
}

fn benchmarks(criterion: &mut Criterion) {
    let sheet = disc();
    let x = wavy(&sheet);
    let mut group = criterion.benchmark_group("20 000 vertices");
    group.sample_size(20);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut mechanics = mechanics(&sheet);
        let mut gradient = vec![Vec3::zeros(); x.len()];
        group.bench_function(format!("energy and gradient, {threads} threads"), |b| {
            b.iter(|| pool.install(|| mechanics.energy_gradient(&x, &mut gradient)));
        });
        let pattern = Arc::new(BlockPattern::two_rings(&sheet));
        let mut hessian = BlockMatrix::zeros(pattern);
        group.bench_function(format!("Hessian, {threads} threads"), |b| {
            b.iter(|| pool.install(|| mechanics.hessian(&x, HessianPart::Full, &mut hessian)));
        });
    }
    let pattern = Arc::new(BlockPattern::two_rings(&sheet));
    let mut hessian = BlockMatrix::zeros(Arc::clone(&pattern));
    mechanics(&sheet).hessian(&x, HessianPart::Positive, &mut hessian);
    hessian.add_diagonal(1e-6 * hessian.mean_diagonal());
    let mut cholesky = BlockCholesky::new(pattern).unwrap();
    group.bench_function("factorisation", |b| b.iter(|| cholesky.factorise(&hessian).is_ok()));
    let mut rhs = x.clone();
    group.bench_function("solve", |b| b.iter(|| cholesky.solve(&mut rhs)));
    group.sample_size(10);
    group.bench_function("disc mesh", |b| b.iter(disc));
    group.finish();
}

criterion_group!(all, benchmarks);
criterion_main!(all);
