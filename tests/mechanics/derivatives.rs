//! Gradients against central differences of the energy, Hessians against those of the gradient.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::HessianPart;
use rumple::model::Potential;
use rumple_numerics::linear::BlockMatrix;

use super::{alone, crumpled, two_rings, variants};
use crate::common::{Noise, irregular};

fn directions(n: usize) -> Vec<Vec<Vec3>> {
    (0..4)
        .map(|seed| {
            let mut noise = Noise::new(100 + seed);
            (0..n).map(|_| noise.vector()).collect()
        })
        .collect()
}

fn moved(x: &[Vec3], d: &[Vec3], h: f64) -> Vec<Vec3> {
    x.iter().zip(d).map(|(x, d)| x + h * d).collect()
}

fn gradient(mechanics: &mut Potential, x: &[Vec3]) -> Vec<Vec3> {
    let mut g = vec![Vec3::zeros(); x.len()];
    mechanics.energy_gradient(x, &mut g);
    g
}

#[test]
fn every_gradient_matches_differences_to_second_order() {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    let x = crumpled(&sheet, 0.08);
    for (name, energy) in variants(&sheet) {
        let mut mechanics = alone(&sheet, energy);
        let g = gradient(&mut mechanics, &x);
        for d in directions(x.len()) {
            let exact: f64 = g.iter().zip(&d).map(|(g, d)| g.dot(d)).sum();
            let error = |mechanics: &mut Potential, h: f64| {
                let rise =
                    mechanics.energy(&moved(&x, &d, h)) - mechanics.energy(&moved(&x, &d, -h));
                (rise / (2.0 * h) - exact).abs() / exact.abs()
            };
            let (coarse, fine) = (error(&mut mechanics, 1e-4), error(&mut mechanics, 1e-5));
            assert!(fine < 1e-6, "{name}: {fine:e}");
            // A hundred times smaller for a ten times smaller step, unless round-off is reached.
            assert!(fine < 0.02 * coarse || fine < 1e-8, "{name}: {coarse:e} then {fine:e}");
        }
    }
}

fn product(matrix: &BlockMatrix, d: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); d.len()];
    for i in 0..d.len() {
        for (&j, block) in matrix.pattern().row(i).iter().zip(matrix.row(i)) {
            let j = j as usize;
            out[i] += block * d[j];
            if i != j {
                out[j] += block.tr_mul(&d[i]);
            }
        }
    }
    out
}

#[test]
fn every_hessian_matches_differences_of_the_gradient() {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    let x = crumpled(&sheet, 0.08);
    let pattern = Arc::new(two_rings(&sheet));
    for (name, energy) in variants(&sheet) {
        if name.contains("MixedVoronoi") {
            continue; // its area fractions are frozen in the Hessian, as documented
        }
        let mut mechanics = alone(&sheet, energy);
        let mut hessian = BlockMatrix::zeros(Arc::clone(&pattern));
        mechanics.hessian(&x, HessianPart::Full, &mut hessian).unwrap();
        let scale = hessian.mean_diagonal();
        for i in 0..x.len() {
            let diagonal = hessian.diagonal(i);
            let skew = (diagonal - diagonal.transpose()).norm() / scale;
            assert!(skew < 1e-12, "{name}: vertex {i} {skew:e}");
        }
        for d in directions(x.len()) {
            let exact = product(&hessian, &d);
            let h = 1e-6;
            let (up, down) = (
                gradient(&mut mechanics, &moved(&x, &d, h)),
                gradient(&mut mechanics, &moved(&x, &d, -h)),
            );
            let mut error = 0.0;
            let mut size = 0.0;
            for i in 0..x.len() {
                error += ((up[i] - down[i]) / (2.0 * h) - exact[i]).norm_squared();
                size += exact[i].norm_squared();
            }
            let error = (error / size).sqrt();
            assert!(error < 1e-6, "{name}: {error:e}");
        }
    }
}

#[test]
fn the_positive_part_is_positive() {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    let x = crumpled(&sheet, 0.15);
    let pattern = Arc::new(two_rings(&sheet));
    for (name, energy) in variants(&sheet) {
        let mut mechanics = alone(&sheet, energy);
        let mut hessian = BlockMatrix::zeros(Arc::clone(&pattern));
        mechanics.hessian(&x, HessianPart::Positive, &mut hessian).unwrap();
        for d in directions(x.len()) {
            let value: f64 = product(&hessian, &d).iter().zip(&d).map(|(p, d)| p.dot(d)).sum();
            assert!(value > 0.0, "{name}: {value:e}");
        }
    }
}
