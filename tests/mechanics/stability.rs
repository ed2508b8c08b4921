//! Inertia and modes against dense eigenvalues, plate theory and buckling strains.

use std::f64::consts::PI;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::Pins;
use rumple::effects::{HessianPart, Material};
use rumple::model::Potential;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec};
use rumple::solve::stability::{Spectrum, Stability};
use rumple_numerics::linear::BlockMatrix;

use super::{both, crumpled, two_rings};
use crate::common::{icosphere, irregular};

const MATERIAL: Material = Material { young: 10.0, poisson: 1.0 / 3.0, thickness: 0.5 };

fn boundary(sheet: &Sheet, axes: [bool; 3]) -> Pins {
    sheet.boundary().iter().map(|boundary| axes.map(|a| a && *boundary)).collect()
}

fn relax(mechanics: &mut Potential, x: &mut [Vec3]) {
    let mut solver = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
    let goal = Goal { tolerance: 1e-11, max_iterations: 5000, ..Goal::default() };
    solver.relax(mechanics, x, &goal).unwrap();
}

/// All eigenvalues by a dense method, without the fixed directions.
fn dense(mechanics: &mut Potential, x: &[Vec3], mass: &[f64]) -> Vec<f64> {
    let pattern = Arc::new(two_rings(mechanics.sheet()));
    let mut matrix = BlockMatrix::zeros(Arc::clone(&pattern));
    mechanics.hessian(x, HessianPart::Full, &mut matrix).unwrap();
    let pins = mechanics.pins();
    let free: Vec<(usize, usize)> = (0..x.len())
        .flat_map(|i| (0..3).filter(move |&a| !pins[i][a]).map(move |a| (i, a)))
        .collect();
    let mut place = vec![[None; 3]; x.len()];
    for (k, &(i, a)) in free.iter().enumerate() {
        place[i][a] = Some(k);
    }
    let mut entries = Vec::new();
    for i in 0..x.len() {
        for (block, &j) in matrix.row(i).zip(pattern.row(i)) {
            let j = j as usize;
            for a in 0..3 {
                for b in 0..3 {
                    if let (Some(p), Some(q)) = (place[i][a], place[j][b]) {
                        let value = block[(a, b)] / (mass[i] * mass[j]).sqrt();
                        entries.push((p, q, value));
                    }
                }
            }
        }
    }
    rumple_tests_dense::symmetric(free.len(), &entries)
}

fn spectrum(mechanics: &mut Potential, x: &[Vec3], count: usize) -> Spectrum {
    Stability::new(mechanics.mechanics())
        .unwrap()
        .spectrum(mechanics, x, count)
        .unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn saddles_of_every_order_agree_with_dense_eigenvalues() {
    let sheet = Arc::new(irregular(7, 6, 0.2));
    for (growth, amplitude) in [(1.0, 0.0), (1.0, 0.1), (1.1, 0.05), (1.4, 0.2), (0.8, 0.3)] {
        let mut mechanics = both(&sheet, &MATERIAL, boundary(&sheet, [true; 3]));
        mechanics.set_length_factor(&vec![growth; sheet.edges().len()]);
        let x = crumpled(&sheet, amplitude);
        let mut stability = Stability::new(mechanics.mechanics()).unwrap();
        let expected = dense(&mut mechanics, &x, stability.mass());
        let negative = expected.iter().filter(|l| **l < 0.0).count();
        let inertia = stability.inertia(&mut mechanics, &x).unwrap();
        assert_eq!((inertia.negative, inertia.rigid), (negative, 0), "{growth} {amplitude}");
        let count = 12;
        let found = stability.spectrum(&mut mechanics, &x, count).unwrap();
        assert_eq!(found.modes.len(), count);
        for (mode, expected) in found.modes.iter().zip(&expected) {
            assert!(
                (mode.eigenvalue / expected - 1.0).abs() < 1e-7,
                "{} {expected}",
                mode.eigenvalue
            );
            assert!((mode.shape.iter().map(|v| v.norm()).fold(0.0, f64::max) - 1.0).abs() < 1e-12);
        }
    }
}

/// A sphere's modes come in multiplets of 2l + 1, exactly so where the icosahedron keeps them.
#[test]
fn multiple_eigenvalues_are_all_found() {
    let sheet = Arc::new(icosphere(2, 3.0));
    let mut mechanics = both(&sheet, &MATERIAL, vec![[false; 3]; sheet.vertex_count()]);
    let mut x = sheet.rest().to_vec();
    relax(&mut mechanics, &mut x);
    let mut stability = Stability::new(mechanics.mechanics()).unwrap();
    let expected = dense(&mut mechanics, &x, stability.mass());
    let found = stability.spectrum(&mut mechanics, &x, 13).unwrap();
    assert_eq!((found.inertia.negative, found.inertia.rigid), (0, 6));
    for (mode, expected) in found.modes.iter().zip(&expected[6..]) {
        assert!((mode.eigenvalue / expected - 1.0).abs() < 1e-6, "{} {expected}", mode.eigenvalue);
    }
}

#[test]
fn rigid_motions_are_counted_as_pins_leave_them() {
    // Generated meshes have no triangle with three vertices on the boundary, which could flap at no cost.
    let sheet =
        Arc::new(generate(&SheetShape::Rectangle { width: 8.0, height: 7.0 }, 70, 1).unwrap());
    let some = |vertices: &[usize]| -> Pins {
        (0..sheet.vertex_count()).map(|i| [vertices.contains(&i); 3]).collect()
    };
    let cases: [(&str, Pins, usize); 7] = [
        ("free", some(&[]), 6),
        ("z fixed at the boundary", boundary(&sheet, [false, false, true]), 3),
        // Lifting, and tilting to first order.
        ("x and y fixed at the boundary", boundary(&sheet, [true, true, false]), 3),
        ("one vertex", some(&[30]), 3),
        ("two vertices", some(&[30, 41]), 1),
        ("three vertices", some(&[30, 41, 38]), 0),
        ("the boundary", boundary(&sheet, [true; 3]), 0),
    ];
    for (name, pins, rigid) in cases {
        let mut mechanics = both(&sheet, &MATERIAL, pins);
        let found = spectrum(&mut mechanics, sheet.rest(), 3);
        assert_eq!((found.inertia.negative, found.inertia.rigid), (0, rigid), "{name}");
        let least = found.modes[0].eigenvalue;
        assert!(least > 1e3 * found.inertia.resolution, "{name}: {least:e} {:?}", found.inertia);
        assert!(!found.is_marginal());
    }
}

/// After a relaxation to a usual tolerance turns are still reported from soft modes.
#[test]
fn rigid_motions_are_counted_where_the_sheet_is_bent_and_stressed() {
    let shape = SheetShape::Rectangle { width: 14.0, height: 12.0 };
    let sheet = Arc::new(generate(&shape, 200, 1).unwrap());
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.4 };
    for (axes, rigid) in [([false; 3], 6), ([false, false, true], 3)] {
        let mut mechanics = both(&sheet, &material, boundary(&sheet, axes));
        let centre = sheet.rest().iter().sum::<Vec3>() / sheet.vertex_count() as f64;
        let factor: Vec<f64> = sheet
            .edges()
            .iter()
            .map(|e| {
                1.0 + 0.1 * f64::from((sheet.rest()[e.vertices[0] as usize] - centre).norm() < 3.0)
            })
            .collect();
        mechanics.set_length_factor(&factor);
        let mut x = crumpled(&sheet, 0.02);
        for (x, (r, boundary)) in x.iter_mut().zip(sheet.rest().iter().zip(sheet.boundary())) {
            x.z = if *boundary {
                0.0
            } else {
                x.z + 0.5 * (-(r - centre).norm_squared() / 9.0).exp()
            };
        }
        let mut solver = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default()).unwrap();
        let goal = Goal { tolerance: 1e-6, max_iterations: 5000, ..Goal::default() };
        solver.relax(&mut mechanics, &mut x, &goal).unwrap();
        let found = spectrum(&mut mechanics, &x, 2);
        println!("{axes:?} {:?} {:e}", found.inertia, found.modes[0].eigenvalue);
        assert_eq!((found.inertia.negative, found.inertia.rigid), (0, rigid));
        assert!(found.modes[0].eigenvalue > 2.0 * found.inertia.resolution);
    }
}

/// λ = B k⁴, k² = π² (m²/a² + n²/b²), for a simply supported rectangle.
#[test]
fn bending_modes_of_a_rectangle_converge_to_plate_theory() {
    let (a, b) = (10.0, 7.0);
    let mut exact: Vec<f64> = (1..5)
        .flat_map(|m| (1..5).map(move |n| (m, n)))
        .map(|(m, n)| {
            let k = PI * PI * (f64::from(m * m) / (a * a) + f64::from(n * n) / (b * b));
            MATERIAL.bending_rigidity() / 1e4 * k * k
        })
        .collect();
    exact.sort_by(f64::total_cmp);
    // A hundredth of the thickness keeps the modes in the plane out of the way.
    let mut material = MATERIAL;
    material.thickness *= 0.01;
    let scale = material.bending_rigidity() / (MATERIAL.bending_rigidity() / 1e4);
    let mut worst = Vec::new();
    for vertices in [300, 1200] {
        let sheet = Arc::new(
            generate(&SheetShape::Rectangle { width: a, height: b }, vertices, 1).unwrap(),
        );
        let mut mechanics = both(&sheet, &material, boundary(&sheet, [true; 3]));
        let found = spectrum(&mut mechanics, sheet.rest(), 4);
        let errors: Vec<f64> =
            found.modes.iter().zip(&exact).map(|(m, e)| m.eigenvalue / (scale * e) - 1.0).collect();
        println!("{vertices} vertices: {errors:?}");
        worst.push(errors.iter().map(|e| e.abs()).fold(0.0, f64::max));
    }
    assert!(worst[0] < 0.25 && worst[1] < 0.12 && worst[1] < 0.7 * worst[0], "{worst:?}");
}

/// B1: a disc with an immovable, simply supported boundary buckles into a dome at
/// `ε = k (1-ν) B/(Y R²)`, k = 4.28241 at ν = 1/3: the smallest eigenvalue crosses 0 there.
#[test]
fn a_grown_disc_loses_its_stability_at_the_buckling_strain() {
    let radius = 10.0;
    let material = Material { young: 1e3, poisson: 1.0 / 3.0, thickness: 0.2 };
    let ratio = material.bending_rigidity() / material.stretching_modulus();
    let critical = 4.282410148730029 * (2.0 / 3.0) * ratio / (radius * radius);
    let mut errors = Vec::new();
    for vertices in [150, 400, 800] {
        let sheet = Arc::new(generate(&SheetShape::Disc { radius }, vertices, 1).unwrap());
        let mut mechanics = both(&sheet, &material, boundary(&sheet, [true; 3]));
        let mut stability = Stability::new(mechanics.mechanics()).unwrap();
        let mut at = |share: f64| {
            mechanics.set_length_factor(&vec![1.0 + share * critical; sheet.edges().len()]);
            let mut x = sheet.rest().to_vec();
            relax(&mut mechanics, &mut x);
            assert!(x.iter().all(|x| x.z == 0.0));
            stability.spectrum(&mut mechanics, &x, 1).unwrap()
        };
        let (below, above) = (at(0.8), at(1.2));
        assert_eq!((below.inertia.negative, above.inertia.negative), (0, 1));
        let (l, h) = (below.modes[0].eigenvalue, above.modes[0].eigenvalue);
        assert!(l > 0.0 && h < 0.0);
        let crossing = 0.8 + 0.4 * l / (l - h);
        println!("{vertices} vertices: buckles at {crossing} of the plate's strain");
        errors.push((crossing - 1.0).abs());
        // Just beside the crossing the sign is right.
        assert_eq!(at(crossing - 1e-3).inertia.negative, 0);
        assert_eq!(at(crossing + 1e-3).inertia.negative, 1);
        let dome = &above.modes[0].shape;
        let top = dome.iter().map(|v| v.z).fold(0.0, f64::max);
        assert!((top - 1.0).abs() < 1e-9 && dome.iter().all(|v| v.z > -1e-6));
        let peak = dome.iter().position(|v| v.z == top).unwrap();
        assert!(sheet.rest()[peak].norm() < 0.2 * radius);
    }
    assert!(errors[0] < 0.08 && errors[2] < 0.05 && errors[2] < errors[0], "{errors:?}");
}

#[test]
fn far_beyond_buckling_there_are_many_directions_down() {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 5.0 }, 120, 1).unwrap());
    let material = Material { young: 1e3, poisson: 1.0 / 3.0, thickness: 0.1 };
    let mut mechanics = both(&sheet, &material, boundary(&sheet, [true; 3]));
    mechanics.set_length_factor(&vec![1.02; sheet.edges().len()]);
    let mut x = sheet.rest().to_vec();
    relax(&mut mechanics, &mut x);
    let mut stability = Stability::new(mechanics.mechanics()).unwrap();
    let expected = dense(&mut mechanics, &x, stability.mass());
    let negative = expected.iter().filter(|l| **l < 0.0).count();
    assert!(negative > 20, "{negative}");
    let found = stability.spectrum(&mut mechanics, &x, 6).unwrap();
    assert_eq!(found.inertia.negative, negative);
    for (mode, expected) in found.modes.iter().zip(&expected) {
        assert!((mode.eigenvalue / expected - 1.0).abs() < 1e-7);
    }
    // The same bits on any number of threads.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let again = pool.install(|| stability.spectrum(&mut mechanics, &x, 6).unwrap());
    assert!(again == found);
}

/// A thousand times the buckling strain: rows must be exchanged, and where that is not enough the
/// count is made at a coarser resolution, never silently wrong.
#[test]
fn counts_hold_a_thousand_times_beyond_buckling() {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 14.0 }, 500, 3).unwrap());
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.05 };
    for growth in [1.0001, 1.003, 1.03] {
        let mut mechanics = both(&sheet, &material, boundary(&sheet, [true; 3]));
        mechanics.set_length_factor(&vec![growth; sheet.edges().len()]);
        let mut x = sheet.rest().to_vec();
        relax(&mut mechanics, &mut x);
        let mut stability = Stability::new(mechanics.mechanics()).unwrap();
        let expected = dense(&mut mechanics, &x, stability.mass());
        let inertia = stability.inertia(&mut mechanics, &x).unwrap();
        let negative = expected.iter().filter(|l| **l < -inertia.resolution).count();
        println!("{growth}: {inertia:?}");
        assert!(inertia.negative == negative && negative > 10, "{growth}: {negative} {inertia:?}");
        assert!(inertia.resolution < 1e-3 * expected[0].abs());
    }
}

#[test]
fn what_cannot_be_factorised_is_an_error() {
    let sheet = Arc::new(irregular(5, 5, 0.1));
    let mut mechanics = both(&sheet, &MATERIAL, boundary(&sheet, [true; 3]));
    let mut x = sheet.rest().to_vec();
    x[12].x = f64::NAN;
    let mut stability = Stability::new(mechanics.mechanics()).unwrap();
    assert!(stability.inertia(&mut mechanics, &x).is_err());
    assert!(stability.spectrum(&mut mechanics, &x, 1).is_err());
}
