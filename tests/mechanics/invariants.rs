//! What must not change under rigid motion, mirroring and threads; what must vanish at rest.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};
use rumple::Vec3;
use rumple::effects::{EnergyTerm, FollowerPressure, HessianPart};
use rumple::geometry::{AreaRule, Curvature, VertexArea, angle_at};
use rumple::sheet::Sheet;
use rumple_numerics::linear::BlockMatrix;

use super::{MATERIAL, alone, both, crumpled, potential, two_rings, variants};
use crate::common::{icosphere, irregular, lattice};

#[test]
fn energy_is_blind_to_rigid_motion_and_forces_balance() {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    let x = crumpled(&sheet, 0.1);
    let turn = Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7));
    let away: Vec<Vec3> = x.iter().map(|x| turn * x + Vec3::new(3.0, -2.0, 5.0)).collect();
    for (name, energy) in variants(&sheet) {
        let mut mechanics = alone(&sheet, energy);
        let (here, there) = (mechanics.energy(&x), mechanics.energy(&away));
        assert!((here - there).abs() < 1e-12 * here.abs().max(1.0), "{name}: {here} {there}");
        let force = mechanics.force_of(0, &x);
        let size: f64 = force.iter().map(|f| f.norm()).sum();
        let sum: Vec3 = force.iter().sum();
        let torque: Vec3 = x.iter().zip(&force).map(|(x, f)| x.cross(f)).sum();
        assert!(sum.norm() < 1e-12 * size, "{name}: net force {:e}", sum.norm() / size);
        assert!(torque.norm() < 1e-11 * size, "{name}: net torque {:e}", torque.norm() / size);
    }
}

#[test]
fn the_rest_state_has_no_energy_and_no_force() {
    let sheet = Arc::new(irregular(9, 8, 0.3));
    for (name, energy) in variants(&sheet) {
        let pins = vec![[false; 3]; sheet.vertex_count()];
        let mut mechanics = potential(Arc::clone(&sheet), vec![energy], pins);
        let energy = mechanics.energy(sheet.rest());
        assert!(energy.abs() < 1e-12, "{name}: {energy:e}");
        let force = mechanics.force_of(0, sheet.rest());
        let largest = force.iter().map(|f| f.norm()).fold(0.0, f64::max);
        assert!(largest < 1e-12, "{name}: {largest:e}");
    }
}

#[test]
fn mirroring_turns_the_sign_of_the_mean_curvature_only() {
    let sheet = Arc::new(irregular(9, 8, 0.2));
    let x = crumpled(&sheet, 0.1);
    let mirrored: Vec<Vec3> = x.iter().map(|x| Vec3::new(x.x, x.y, -x.z)).collect();
    let mut mechanics = both(&sheet, &MATERIAL, vec![[false; 3]; sheet.vertex_count()]);
    let area = VertexArea::new(&sheet, AreaRule::default());
    let up = Curvature::evaluate(&mechanics.shape(&x), &area);
    let down = Curvature::evaluate(&mechanics.shape(&mirrored), &area);
    for i in 0..x.len() {
        assert!((up.mean[i] + down.mean[i]).abs() < 1e-12);
        assert!((up.gaussian[i] - down.gaussian[i]).abs() < 1e-12);
    }
    let (a, b) = (mechanics.energy(&x), mechanics.energy(&mirrored));
    assert!((a - b).abs() < 1e-12 * a);
}

#[test]
fn angle_sums_obey_gauss_bonnet_on_any_shape() {
    for (sheet, chi) in [(irregular(9, 8, 0.3), 1.0), (icosphere(2, 1.0), 2.0)] {
        let sheet = Arc::new(sheet);
        let x = crumpled(&sheet, 0.1);
        let mechanics = both(&sheet, &MATERIAL, vec![[false; 3]; sheet.vertex_count()]);
        let shape = mechanics.shape(&x);
        let mut total = 0.0;
        for i in 0..x.len() {
            total += if sheet.boundary()[i] { PI } else { 2.0 * PI };
            for &(t, k) in sheet.vertex_triangles().entries(i) {
                total -= angle_at(&shape, t as usize, k as usize);
            }
        }
        assert!((total - 2.0 * PI * chi).abs() < 1e-9, "{total}");
    }
}

#[test]
fn an_obtuse_flat_sheet_has_no_curvature() {
    let sheet: Sheet = irregular(12, 11, 0.45);
    let sheet = Arc::new(sheet);
    let mechanics = both(&sheet, &MATERIAL, vec![[false; 3]; sheet.vertex_count()]);
    for rule in [AreaRule::FrozenVoronoi, AreaRule::Barycentric, AreaRule::MixedVoronoi] {
        let area = VertexArea::new(&sheet, rule);
        let c = Curvature::evaluate(&mechanics.shape(sheet.rest()), &area);
        let total: f64 = c.area.iter().sum();
        let faces: f64 = mechanics.metric().area().iter().sum();
        assert!((total - faces).abs() < 1e-12 * faces, "{rule:?}");
        assert!(c.mean.iter().all(|h| h.abs() < 1e-11), "{rule:?}");
        assert!(c.gaussian.iter().all(|k| k.abs() < 1e-11), "{rule:?}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let sheet = Arc::new(lattice(60, 50));
    let x = crumpled(&sheet, 0.1);
    let pattern = Arc::new(two_rings(&sheet));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut energies: Vec<_> = variants(&sheet).into_iter().map(|v| v.1).collect();
            energies.push(EnergyTerm::new(FollowerPressure::new(&sheet, 0.7)));
            let pins = vec![[false; 3]; sheet.vertex_count()];
            let mut mechanics = potential(Arc::clone(&sheet), energies, pins);
            let mut g = vec![Vec3::zeros(); x.len()];
            let energy = mechanics.energy_gradient(&x, &mut g);
            let mut hessian = BlockMatrix::zeros(Arc::clone(&pattern));
            mechanics.hessian(&x, HessianPart::Full, &mut hessian).unwrap();
            let blocks: Vec<_> =
                (0..x.len()).flat_map(|i| hessian.row(i)).map(|b| b.map(f64::to_bits)).collect();
            (energy.to_bits(), g.iter().map(|g| g.map(f64::to_bits)).collect::<Vec<_>>(), blocks)
        })
    };
    let one = run(1);
    for threads in [2, 3, 7] {
        assert!(run(threads) == one, "{threads} threads");
    }
}
