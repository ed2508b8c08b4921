//! What a relaxation does again and again allocates nothing after its first time.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    BendingWeight, BondStretching, EnergyTerm, HessianPart, HingeBending, MeyerBending,
    StretchingModulus, StretchingWeight, StvkStretching,
};
use rumple::geometry::AreaRule;
use rumple_numerics::linear::{BlockMatrix, MixedPrecisionCholesky};

use super::{MATERIAL, crumpled, potential, two_rings};
use crate::common::{allocations, irregular};

#[test]
fn evaluation_assembly_and_factorisation_allocate_nothing() {
    let sheet = Arc::new(irregular(40, 40, 0.2));
    let x = crumpled(&sheet, 0.05);
    let meyer = |weight, area| {
        EnergyTerm::new(MeyerBending::new(&sheet, &MATERIAL, weight, area)) as EnergyTerm
    };
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(&MATERIAL, StretchingWeight::OptimalArea)),
        EnergyTerm::new(StvkStretching::new(&MATERIAL, StretchingModulus::Paper)),
        EnergyTerm::new(HingeBending::new(&sheet, &MATERIAL)),
        meyer(BendingWeight::Area, AreaRule::FrozenVoronoi),
        meyer(BendingWeight::Paper, AreaRule::Barycentric),
    ];
    let pins = sheet.boundary().iter().map(|boundary| [*boundary; 3]).collect();
    let mut mechanics = potential(Arc::clone(&sheet), energies, pins);
    let pattern = Arc::new(two_rings(&sheet));
    let mut hessian = BlockMatrix::zeros(Arc::clone(&pattern));
    let mut cholesky = MixedPrecisionCholesky::in_double_precision(pattern).unwrap();
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    // On the pool's own thread, where the allocations are counted.
    pool.install(|| {
        let mut work = || {
            mechanics.energy_gradient(&x, &mut gradient);
            for part in [HessianPart::Positive, HessianPart::Full] {
                mechanics.hessian(&x, part, &mut hessian).unwrap();
            }
            hessian.add_diagonal(hessian.mean_diagonal());
            let _ = cholesky.factorise(&hessian, true);
            cholesky.solve(&mut gradient);
        };
        work();
        let before = allocations();
        work();
        assert_eq!(allocations() - before, 0);
    });
    let before = allocations();
    std::hint::black_box(vec![1.0; x.len()]);
    assert_eq!(allocations() - before, 1, "allocations are not counted");
}
