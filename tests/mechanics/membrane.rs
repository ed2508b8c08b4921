//! StVK stretching: patch tests, rest metric, agreement with the bonds.

use std::sync::Arc;

use nalgebra::{Matrix3x2, Vector2};
use rumple::Vec3;
use rumple::effects::{
    BondStretching, Energy, EnergyTerm, HessianPart, Material, StretchingModulus, StretchingWeight,
    StvkStretching,
};
use rumple::model::Potential;
use rumple::sheet::Sheet;
use rumple_numerics::linear::BlockMatrix;

use super::{MATERIAL, crumpled, potential, two_rings};
use crate::common::{irregular, lattice};

const POISSON: [f64; 5] = [-0.5, 0.0, 0.3, 1.0 / 3.0, 0.49];

fn mechanics(sheet: &Arc<Sheet>, energy: impl Energy + 'static) -> Potential {
    let pins = vec![[false; 3]; sheet.vertex_count()];
    potential(Arc::clone(sheet), vec![EnergyTerm::new(energy)], pins)
}

fn stvk(sheet: &Arc<Sheet>, poisson: f64) -> (Potential, f64) {
    let material = Material { poisson, ..MATERIAL };
    let energy = StvkStretching::new(&material, StretchingModulus::Paper);
    (mechanics(sheet, energy), material.stretching_modulus())
}

fn mapped(sheet: &Sheet, f: &Matrix3x2<f64>) -> Vec<Vec3> {
    sheet.rest().iter().map(|x| f * Vector2::new(x.x, x.y)).collect()
}

/// Any affine map of any mesh: the energy is that of the continuum, and the inside is in
/// equilibrium.
#[test]
fn patch_test_for_large_affine_maps_of_any_mesh() {
    let maps = [
        ("biaxial", Matrix3x2::new(1.2, 0.0, 0.0, 1.2, 0.0, 0.0)),
        ("uniaxial", Matrix3x2::new(1.1, 0.0, 0.0, 1.0, 0.0, 0.0)),
        ("shear", Matrix3x2::new(1.0, 0.3, 0.0, 1.0, 0.0, 0.0)),
        ("compressed and tilted", Matrix3x2::new(0.8, 0.1, -0.2, 0.9, 0.4, -0.3)),
    ];
    for sheet in [lattice(9, 8), irregular(9, 8, 0.3)] {
        let sheet = Arc::new(sheet);
        for poisson in POISSON {
            let (mut mechanics, y) = stvk(&sheet, poisson);
            let area: f64 = mechanics.metric().area().iter().sum();
            for (name, f) in &maps {
                let x = mapped(&sheet, f);
                let strain = 0.5 * (f.transpose() * f - nalgebra::Matrix2::identity());
                let density = 0.5 * y / (1.0 - poisson * poisson)
                    * ((1.0 - poisson) * (strain * strain).trace()
                        + poisson * strain.trace() * strain.trace());
                let energy = mechanics.energy(&x);
                let error = (energy / (area * density) - 1.0).abs();
                assert!(error < 1e-12, "{name} ν = {poisson}: {error:e}");
                let force = mechanics.force_of(0, &x);
                let inside = (0..x.len()).filter(|&i| !sheet.boundary()[i]);
                let largest = inside.map(|i| force[i].norm()).fold(0.0, f64::max);
                assert!(largest < 1e-12 * y, "{name} ν = {poisson}: {largest:e}");
            }
        }
    }
}

/// A strip pulled along x that contracts by ν: no force on its free sides, and Y per strain on
/// its ends.
#[test]
fn a_pulled_strip_contracts_by_poissons_ratio() {
    let sheet = Arc::new(irregular(13, 7, 0.2));
    let (_, top) = sheet.rest().iter().fold((0.0, 0.0), |(_, y), x| (0.0, f64::max(y, x.y)));
    for poisson in POISSON {
        let (mut mechanics, y) = stvk(&sheet, poisson);
        let strain = 1e-3;
        let stretch = |green: f64| (1.0 + 2.0 * green).sqrt();
        let (along, across) = (stretch(strain), stretch(-poisson * strain));
        let x = mapped(&sheet, &Matrix3x2::new(along, 0.0, 0.0, across, 0.0, 0.0));
        let force = mechanics.force_of(0, &x);
        let side = |i: usize| (sheet.rest()[i].y - top).abs() < 1e-12;
        let lateral = (0..x.len()).filter(|&i| side(i)).map(|i| force[i].y.abs());
        assert!(lateral.fold(0.0, f64::max) < 1e-12 * y, "ν = {poisson}");
        let half = sheet.rest().iter().map(|x| x.x).fold(0.0, f64::max) / 2.0;
        let pull: f64 =
            (0..x.len()).filter(|&i| sheet.rest()[i].x < half).map(|i| force[i].x).sum();
        let expected = y * strain * along * top;
        assert!((pull / expected - 1.0).abs() < 1e-10, "ν = {poisson}: {pull} {expected}");
    }
}

fn hessian(mechanics: &mut Potential, x: &[Vec3]) -> BlockMatrix {
    let pattern = Arc::new(two_rings(mechanics.sheet()));
    let mut hessian = BlockMatrix::zeros(pattern);
    mechanics.hessian(x, HessianPart::Full, &mut hessian).unwrap();
    hessian
}

/// Largest block of `a - factor·b` over the mean diagonal of `a`.
fn difference(a: &BlockMatrix, b: &BlockMatrix, factor: f64) -> f64 {
    let rows = 0..a.pattern().rows();
    let blocks = rows.flat_map(|i| a.row(i).zip(b.row(i)));
    blocks.map(|(a, b)| (a - factor * b).norm()).fold(0.0, f64::max) / a.mean_diagonal()
}

/// Every entry, boundary included, with and without growth. On an irregular mesh bonds are another
/// material, so the test would notice.
#[test]
fn all_stretching_models_agree_at_the_flat_rest_state_of_a_lattice() {
    for (sheet, same) in [(lattice(7, 6), true), (irregular(7, 6, 0.2), false)] {
        let sheet = Arc::new(sheet);
        for grow in [1.0, 1.54] {
            let x: Vec<Vec3> = sheet.rest().iter().map(|x| grow * x).collect();
            let factor = vec![grow; sheet.edges().len()];
            let of = |mut mechanics: Potential| {
                mechanics.set_length_factor(&factor);
                hessian(&mut mechanics, &x)
            };
            let weight = StretchingWeight::OptimalArea;
            let bond = of(mechanics(&sheet, BondStretching::new(&MATERIAL, weight)));
            let paper = StvkStretching::new(&MATERIAL, StretchingModulus::Paper);
            let plate = StvkStretching::new(&MATERIAL, StretchingModulus::PlaneStress);
            let (paper, plate) = (of(mechanics(&sheet, paper)), of(mechanics(&sheet, plate)));
            let found = difference(&bond, &paper, 1.0);
            assert!(if same { found < 1e-13 } else { found > 1e-2 }, "{found:e}");
            assert!(difference(&paper, &plate, 9.0 / 8.0) < 1e-13);
        }
    }
}

/// Whatever shape the optimal lengths are taken from is free of stress.
#[test]
fn the_shape_of_the_optimal_lengths_is_free_of_stress() {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    let x: Vec<Vec3> = crumpled(&sheet, 0.15).iter().map(|x| 1.3 * x).collect();
    let free = vec![[false; 3]; x.len()];
    let lengths = potential(Arc::clone(&sheet), Vec::new(), free);
    let reference = lengths.metric().reference_length().to_vec();
    let factor: Vec<f64> = (sheet.edges().iter().zip(&reference))
        .map(|(e, l)| (x[e.vertices[0] as usize] - x[e.vertices[1] as usize]).norm() / l)
        .collect();
    let (mut mechanics, y) = stvk(&sheet, 0.3);
    assert!(mechanics.energy(&x) > 1e-3 * y);
    mechanics.set_length_factor(&factor);
    assert!(mechanics.energy(&x) < 1e-28 * y, "{:e}", mechanics.energy(&x));
    let force = mechanics.force_of(0, &x);
    assert!(force.iter().all(|f| f.norm() < 1e-13 * y));
}

/// One bond grows until its triangles are impossible: the energy stays finite, convex in
/// strain, continuous in the growth, and its derivatives stay right.
#[test]
fn optimal_lengths_that_make_no_triangle_are_tamed() {
    let sheet = Arc::new(lattice(4, 4));
    let inner = sheet.edges().iter().position(|e| !e.is_boundary()).unwrap();
    let (mut mechanics, y) = stvk(&sheet, 0.3);
    let x = crumpled(&sheet, 0.1);
    let mut energy_at = |grow: f64| {
        let mut factor = vec![1.0; sheet.edges().len()];
        factor[inner] = grow;
        mechanics.set_length_factor(&factor);
        let energy = mechanics.energy(&x);
        (energy, mechanics.metric().impossible_triangles())
    };
    let mut last = energy_at(1.6).0;
    for step in 1..=200 {
        let (energy, impossible) = energy_at(1.6 + 0.005 * f64::from(step));
        assert!(energy.is_finite() && energy > 0.0);
        assert!((energy / last - 1.0).abs() < 0.1, "{step}: {last} {energy}");
        assert!(energy < 1e3 * y);
        // At step 80 the length is that of the other two together, to round-off.
        assert!(step == 80 || impossible == if step < 80 { 0 } else { 2 }, "{step}");
        last = energy;
    }
    let mut gradient = vec![Vec3::zeros(); x.len()];
    mechanics.energy_gradient(&x, &mut gradient);
    for i in 0..x.len() {
        for a in 0..3 {
            let mut shifted = |h: f64| {
                let mut moved = x.clone();
                moved[i][a] += h;
                mechanics.energy(&moved)
            };
            let slope = (shifted(1e-5) - shifted(-1e-5)) / 2e-5;
            assert!((slope - gradient[i][a]).abs() < 1e-6 * y, "{i} {a}");
        }
    }
}
