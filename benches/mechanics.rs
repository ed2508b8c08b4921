//! EnergyTerm, gradient, second derivatives, factor and solution at 20 000 vertices, on one and on two
//! threads: with the default weights and areas, and as the paper prints the energies (weights
//! `paper`, barycentric areas). And the time to make the mesh.
//!
//! `cargo bench --bench mechanics`

#![allow(missing_docs)]

use std::sync::Arc;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use rumple::Vec3;
use rumple::effects::{Bending, BendingWeight, BondStretching, EnergyTerm, HessianPart, Material};
use rumple::effects::{MeyerBending, Stretching, StretchingWeight};
use rumple::geometry::AreaRule;
use rumple::model::{Mechanics, Potential};
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple_numerics::linear::{BlockCholesky, BlockMatrix, Precision};

const DISC: SheetShape = SheetShape::Disc { radius: 100.0 };

fn disc() -> Arc<Sheet> {
    Arc::new(generate(&DISC, 20_000, 1).unwrap())
}

/// Stretching and bending on `sheet` with the boundary fixed vertically.
fn mechanics(
    sheet: &Arc<Sheet>,
    stretching: StretchingWeight,
    bending: BendingWeight,
    area: AreaRule,
) -> Potential {
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(&material, stretching)),
        EnergyTerm::new(MeyerBending::new(sheet, &material, bending, area)),
    ];
    let pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    Potential::new(&Mechanics::new(Arc::clone(sheet), energies, pins).unwrap())
}

fn wavy(sheet: &Sheet) -> Vec<Vec3> {
    let wave = |x: &Vec3| 0.3 * (0.2 * x.x).sin() * (0.17 * x.y).cos();
    sheet.rest().iter().map(|x| Vec3::new(x.x, x.y, wave(x))).collect()
}

/// Factorisation and solution in the precision T.
fn factor<T: Precision>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    pool: &rayon::ThreadPool,
    hessian: &BlockMatrix,
    rhs: &[Vec3],
) {
    let mut cholesky = BlockCholesky::<T>::new(Arc::clone(hessian.pattern())).unwrap();
    group.sample_size(10);
    group.bench_function(format!("factorisation, {name}"), |b| {
        pool.install(|| b.iter(|| cholesky.factorise(hessian).unwrap()));
    });
    group.sample_size(20);
    group.bench_function(format!("solve, {name}"), |b| {
        let mut x = rhs.to_vec();
        pool.install(|| {
            b.iter(|| {
                x.copy_from_slice(rhs);
                cholesky.solve(&mut x);
            });
        });
    });
}

fn variant(criterion: &mut Criterion, name: &str, sheet: &Arc<Sheet>, mut mechanics: Potential) {
    let x = wavy(sheet);
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let pattern = Arc::clone(mechanics.mechanics().pattern());
    let mut hessian = BlockMatrix::zeros(pattern);
    let mut group = criterion.benchmark_group(format!("20 000 vertices, {name}"));
    group.sample_size(20);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        group.bench_function(format!("energy and gradient/{threads}"), |b| {
            pool.install(|| b.iter(|| mechanics.energy_gradient(&x, &mut gradient)));
        });
        // The positive part comes last: it is what is factorised.
        for part in [HessianPart::Full, HessianPart::Positive] {
            group.bench_function(format!("Hessian, {part:?}/{threads}"), |b| {
                pool.install(|| b.iter(|| mechanics.hessian(&x, part, &mut hessian).unwrap()));
            });
        }
        hessian.add_diagonal(1e-6 * hessian.mean_diagonal());
        factor::<f64>(&mut group, &format!("double/{threads}"), &pool, &hessian, &x);
        factor::<f32>(&mut group, &format!("single/{threads}"), &pool, &hessian, &x);
    }
    group.finish();
}

fn benchmarks(criterion: &mut Criterion) {
    let sheet = disc();
    let (stretching, bending) = (Stretching::default(), Bending::default());
    let usual = mechanics(&sheet, stretching.weight, bending.weight, bending.area);
    variant(criterion, "default", &sheet, usual);
    let (stretching, bending) = (StretchingWeight::Paper, BendingWeight::Paper);
    let paper = mechanics(&sheet, stretching, bending, AreaRule::Barycentric);
    variant(criterion, "paper", &sheet, paper);
    let mut group = criterion.benchmark_group("mesh");
    group.sample_size(10);
    group.bench_function("disc of 20 000 vertices", |b| b.iter(disc));
    group.finish();
}

criterion_group!(all, benchmarks);
criterion_main!(all);
