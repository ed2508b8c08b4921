//! The cotangent scheme: decay rates, order, conservation, maximum principle.

use rumple::Vec3;
use rumple::effects::{Cotan, FieldValues, Measure};
use rumple::sheet::Sheet;

use super::{
    DISC_ZEROS, On, bumpy, decay_rate, diffuse, disc, disc_mode, imbalance, rate, weighted,
};
use crate::common::{Noise, icosphere, irregular, lattice};

fn cotan(sheet: &Sheet, d: f64) -> On<'_, Cotan> {
    On::rest(sheet, Cotan::new(sheet, 0, d, Measure::Concentration, false))
}

fn noise(n: usize) -> Vec<f64> {
    let mut noise = Noise::new(17);
    (0..n).map(|_| noise.number()).collect()
}

/// Relative errors of the three slowest kinds of disc mode.
fn disc_errors(vertices: usize) -> [f64; 3] {
    let sheet = disc(vertices);
    let scheme = cotan(&sheet, 1.0);
    DISC_ZEROS.map(|zero| {
        let mode: Vec<f64> = sheet.rest().iter().map(|x| disc_mode(zero, x)).collect();
        let expected = zero.1 * zero.1;
        (decay_rate(&scheme, scheme.area(), &mode, expected) / expected - 1.0).abs()
    })
}

/// R1 of the table of truths, and second order in the edge length.
#[test]
fn disc_modes_decay_at_their_rates() {
    let (coarse, fine) = (disc_errors(800), disc_errors(12_800));
    assert!(coarse[0] < 1e-3 && coarse[1] < 3e-3 && coarse[2] < 5e-3, "{coarse:?}");
    for (a, b) in coarse.iter().zip(&fine) {
        let order = (a / b).log2() / 2.0;
        println!("relative errors {a:.2e}, {b:.2e}: observed order {order:.2}");
        assert!((1.7..2.5).contains(&order), "order {order}");
    }
}

/// Decay rate over D and shape of a mode.
type Mode = (f64, fn(&Vec3) -> f64);

/// Real spherical harmonics of degree 1, 2, 3 up to factors.
fn harmonics() -> Vec<Mode> {
    vec![
        (2.0, |p| p.x),
        (2.0, |p| p.y),
        (2.0, |p| p.z),
        (6.0, |p| p.x * p.y),
        (6.0, |p| p.y * p.z),
        (6.0, |p| p.z * p.x),
        (6.0, |p| p.x * p.x - p.y * p.y),
        (6.0, |p| 3.0 * p.z * p.z - 1.0),
        (12.0, |p| p.z * (5.0 * p.z * p.z - 3.0)),
        (12.0, |p| p.x * (5.0 * p.z * p.z - 1.0)),
        (12.0, |p| p.y * (5.0 * p.z * p.z - 1.0)),
        (12.0, |p| p.z * (p.x * p.x - p.y * p.y)),
        (12.0, |p| p.x * p.y * p.z),
        (12.0, |p| p.x * (p.x * p.x - 3.0 * p.y * p.y)),
        (12.0, |p| p.y * (3.0 * p.x * p.x - p.y * p.y)),
    ]
}

/// Largest relative error over the modes of every degree, on a sphere of radius 2 with D = 3.
fn sphere_errors(levels: usize) -> [f64; 3] {
    let sheet = icosphere(levels, 2.0);
    let scheme = cotan(&sheet, 3.0);
    let mut worst = [0.0f64; 3];
    for (eigenvalue, harmonic) in harmonics() {
        let mode: Vec<f64> = sheet.rest().iter().map(|x| harmonic(&(x / 2.0))).collect();
        let expected = 3.0 * eigenvalue / 4.0;
        let found = decay_rate(&scheme, scheme.area(), &mode, expected);
        let degree = if eigenvalue < 3.0 { 0 } else { usize::from(eigenvalue > 7.0) + 1 };
        worst[degree] = worst[degree].max((found / expected - 1.0).abs());
    }
    worst
}

/// R2 of the table of truths, second order. At 642 vertices lumped linear elements are 1.44 % too
/// slow at degree 3, with barycentric or Voronoi areas alike; below 1 % up to degree 2.
#[test]
fn sphere_modes_decay_at_their_rates() {
    let (coarse, fine) = (sphere_errors(3), sphere_errors(4));
    // Degree 1 is exact by symmetry: Σ|∇x_k|² = 2 and Σ x_k² = R² whatever the mesh.
    assert!(coarse[0] < 1e-4 && fine[0] < 1e-4, "{coarse:?} {fine:?}");
    assert!(coarse[1] < 0.006 && coarse[2] < 0.015 && fine[2] < 0.004, "{coarse:?} {fine:?}");
    for (a, b) in coarse.iter().zip(&fine).skip(1) {
        let order = (a / b).log2();
        println!("relative errors {a:.2e}, {b:.2e}: observed order {order:.2}");
        assert!((1.7..2.3).contains(&order), "order {order}");
    }
}

/// On flat sheets linear functions are harmonic, however irregular the mesh; on a lattice x² + y²
/// has its Laplacian of 4.
#[test]
fn polynomials_have_their_laplacian() {
    let sheet = irregular(14, 12, 0.3);
    let linear: Vec<f64> = sheet.rest().iter().map(|x| 2.0 - 3.0 * x.x + x.y).collect();
    let out = rate(&cotan(&sheet, 1.0), &linear);
    let inside = |i: &usize| !sheet.boundary()[*i];
    let worst = (0..out.len()).filter(inside).map(|i| out[i].abs()).fold(0.0, f64::max);
    assert!(worst < 1e-12, "{worst}");

    let sheet = lattice(12, 12);
    let square: Vec<f64> = sheet.rest().iter().map(|x| x.x * x.x + x.y * x.y).collect();
    let out = rate(&cotan(&sheet, 1.0), &square);
    for i in (0..out.len()).filter(|i| !sheet.boundary()[*i]) {
        assert!((out[i] - 4.0).abs() < 1e-11, "{}", out[i]);
    }
}

/// R3 of the table of truths, for the rate and for a whole integration.
#[test]
fn totals_are_conserved_on_curved_sheets() {
    let sheet = disc(800);
    let x = bumpy(&sheet);
    for measure in [Measure::Concentration, Measure::Amount] {
        let mut scheme = On::rest(&sheet, Cotan::new(&sheet, 0, 2.0, measure, false));
        let rest_area = scheme.area().to_vec();
        scheme.update(&x);
        let area = match measure {
            Measure::Concentration => scheme.area().to_vec(),
            Measure::Amount => rest_area,
        };
        let mut c: Vec<f64> = noise(sheet.vertex_count()).iter().map(|c| 1.0 + c).collect();
        assert!(imbalance(&area, &rate(&scheme, &c)) < 1e-12);
        let one = vec![1.0; c.len()];
        let before = weighted(&area, &one, &c);
        diffuse(&scheme, &mut c, 0.3, 1e-5).unwrap();
        let drift = weighted(&area, &one, &c) / before - 1.0;
        println!("{measure:?}: relative drift {drift:.1e}");
        assert!(drift.abs() < 1e-12, "{drift}");
    }
}

/// The steady state of an amount per rest area is a uniform concentration, not a uniform amount.
#[test]
fn amounts_settle_where_the_concentration_is_uniform() {
    let sheet = disc(300);
    let mut scheme = On::rest(&sheet, Cotan::new(&sheet, 0, 1.0, Measure::Amount, false));
    let rest_area = scheme.area().to_vec();
    scheme.update(&bumpy(&sheet));
    let growth: Vec<f64> = scheme.area().iter().zip(&rest_area).map(|(a, b)| a / b).collect();
    let largest = rate(&scheme, &growth).iter().fold(0.0f64, |m, r| m.max(r.abs()));
    assert!(largest < 1e-9 * scheme.spectral_bound(), "{largest}");
    let uniform = rate(&scheme, &vec![1.0; growth.len()]);
    assert!(uniform.iter().any(|r| r.abs() > 1e-3));
}

/// Explicit steps within the bound of the rows keep c between its extremes where no weight is
/// negative, as on the Delaunay meshes of the generator; one flipped edge is noticed.
#[test]
fn delaunay_meshes_keep_the_maximum_principle() {
    let sheet = disc(400);
    let scheme = cotan(&sheet, 1.0);
    assert_eq!(scheme.negative_weights(), 0);
    let mut c = vec![0.0; sheet.vertex_count()];
    c[123] = 1.0;
    // The bound is twice the largest row sum, so this is the longest step that stays positive.
    let step = 2.0 / scheme.spectral_bound();
    let mut highest = 1.0;
    for _ in 0..200 {
        let change = rate(&scheme, &c);
        for (c, r) in c.iter_mut().zip(change) {
            *c += step * r;
        }
        let top = c.iter().fold(0.0f64, |m, c| m.max(*c));
        assert!(c.iter().all(|c| *c >= -1e-16) && top <= highest + 1e-15);
        highest = top;
    }
    assert!(highest < 0.05, "{highest}");

    // Two flat triangles whose angles opposite the common edge add up to more than 180°.
    let x = vec![
        Vec3::new(-1.0, 0.0, 0.0),
        Vec3::new(1.0, 0.0, 0.0),
        Vec3::new(0.0, 0.5, 0.0),
        Vec3::new(0.0, -0.5, 0.0),
    ];
    let obtuse = Sheet::new(x, vec![[0, 1, 2], [1, 0, 3]]).unwrap();
    assert_eq!(cotan(&obtuse, 1.0).negative_weights(), 1);
}

/// The bound is above the largest eigenvalue, and not by much.
#[test]
fn the_spectral_bound_holds_and_is_close() {
    let sheet = disc(300);
    let mut scheme = cotan(&sheet, 1.0);
    for x in [sheet.rest().to_vec(), bumpy(&sheet)] {
        scheme.update(&x);
        let mut mode = noise(sheet.vertex_count());
        let mut largest = 0.0;
        for _ in 0..400 {
            let next = rate(&scheme, &mode);
            let norm = |c: &[f64]| weighted(scheme.area(), c, c).sqrt();
            largest = norm(&next) / norm(&mode);
            mode = next.iter().map(|c| c / largest).collect();
        }
        let ratio = scheme.spectral_bound() / largest;
        println!("bound over largest eigenvalue {ratio:.3}");
        assert!((1.0..1.8).contains(&ratio), "{ratio}");
    }
}

/// A surface frozen at rest ignores the shape, and the same bits come out on one thread and three.
#[test]
fn frozen_metric_and_threads() {
    let sheet = disc(3000);
    let x = bumpy(&sheet);
    let c = noise(sheet.vertex_count());
    let mut frozen = On::rest(&sheet, Cotan::new(&sheet, 0, 1.0, Measure::Concentration, true));
    frozen.update(&x);
    assert_eq!(rate(&frozen, &c), rate(&cotan(&sheet, 1.0), &c));

    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut scheme = cotan(&sheet, 1.0);
            scheme.update(&x);
            let mut c = c.clone();
            diffuse(&scheme, &mut c, 0.01, 1e-4).unwrap();
            c.iter().map(|c| c.to_bits()).collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(3));
}

/// D ∇c is the same on both sides of a step of D: a flux through layers is steady to round-off, and whatever D is,
/// nothing is lost.
#[test]
fn a_flux_across_a_step_of_the_coefficient_is_steady() {
    let sheet = lattice(7, 8);
    let rest = sheet.rest();
    let middle = |t: &[u32; 3]| t.map(|v| rest[v as usize].y).iter().sum::<f64>() / 3.0;
    let mut levels: Vec<f64> = rest.iter().map(|x| x.y).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let step = levels[3];
    let of = |y: f64| if y < step { 0.5 } else { 4.0 };
    let each: Vec<f64> = sheet.triangles().iter().map(|t| of(middle(t))).collect();
    let scheme = On::rest(
        &sheet,
        Cotan::new(&sheet, 0, FieldValues::Each(each), Measure::Concentration, false),
    );
    let layers: Vec<f64> = rest.iter().map(|x| (x.y - step) / of(x.y)).collect();
    let inside = |rates: &[f64]| {
        let interior = rates.iter().zip(sheet.boundary()).filter(|(_, boundary)| !**boundary);
        interior.map(|(rate, _)| rate.abs()).fold(0.0, f64::max)
    };
    let (steady, not) = (rate(&scheme, &layers), rate(&cotan(&sheet, 1.0), &layers));
    assert!(inside(&steady) < 1e-12 && inside(&not) > 0.1, "{steady:?} {not:?}");
    let c = noise(sheet.vertex_count());
    let total: f64 = rate(&scheme, &c).iter().zip(scheme.area()).map(|(r, a)| r * a).sum();
    assert!(total.abs() < 1e-12, "{total}");
}
