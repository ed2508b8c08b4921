//! The paper's scheme on faces: what it gets right, and its known faults.

use rumple::Vec3;
use rumple::effects::GreenGauss;
use rumple::geometry::FaceVertexAverage;
use rumple::sheet::Sheet;
use rumple::sheet::generate::{SheetShape, generate};

use super::{DISC_ZEROS, On, bumpy, decay_rate, disc, disc_mode, imbalance, rate};
use crate::common::{Noise, irregular, lattice};

fn green_gauss(sheet: &Sheet) -> On<'_, GreenGauss> {
    On::rest(sheet, GreenGauss::new(sheet, 0, 1.0, false))
}

fn areas(sheet: &Sheet, x: &[Vec3]) -> Vec<f64> {
    let corners = sheet.triangles().iter().map(|t| t.map(|v| x[v as usize]));
    corners.map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).collect()
}

fn noise(n: usize) -> Vec<f64> {
    let mut noise = Noise::new(23);
    (0..n).map(|_| noise.number()).collect()
}

/// The smooth modes of a disc decay at about the right rate.
#[test]
fn smooth_disc_modes_decay() {
    let sheet = disc(800);
    let scheme = green_gauss(&sheet);
    let area = areas(&sheet, sheet.rest());
    let centre = |t: &[u32; 3]| t.map(|v| sheet.rest()[v as usize]).iter().sum::<Vec3>() / 3.0;
    for zero in DISC_ZEROS {
        let mode: Vec<f64> =
            sheet.triangles().iter().map(|t| disc_mode(zero, &centre(t))).collect();
        let expected = zero.1 * zero.1;
        let error = decay_rate(&scheme, &area, &mode, expected) / expected - 1.0;
        println!("mode {}: relative error of the rate {error:.2e}", zero.0);
        assert!(error.abs() < 0.03, "{error}");
    }
}

/// On flat sheets the total is conserved to round-off, boundary and corners included; on curved ones
/// it is not.
#[test]
fn totals_are_conserved_on_flat_sheets_only() {
    for sheet in [disc(800), irregular(14, 12, 0.25)] {
        let scheme = green_gauss(&sheet);
        let area = areas(&sheet, sheet.rest());
        let out = rate(&scheme, &noise(area.len()));
        assert!(imbalance(&area, &out) < 1e-12, "{}", imbalance(&area, &out));
    }
    let sheet = disc(800);
    let mut scheme = green_gauss(&sheet);
    let x = bumpy(&sheet);
    scheme.update(&x);
    let centre: Vec<f64> = sheet.triangles().iter().map(|t| x[t[0] as usize].x.sin()).collect();
    let fault = imbalance(&areas(&sheet, &x), &rate(&scheme, &centre));
    println!("imbalance on a curved sheet {fault:.1e}");
    assert!(fault > 1e-6, "{fault}");
}

/// The matrix of the scheme, column by column.
fn matrix(scheme: &On<'_, GreenGauss>, faces: usize) -> Vec<(usize, usize, f64)> {
    let mut unit = vec![0.0; faces];
    let mut entries = Vec::new();
    for t in 0..faces {
        unit[t] = 1.0;
        entries.extend(rate(scheme, &unit).into_iter().enumerate().map(|(i, value)| (i, t, value)));
        unit[t] = 0.0;
    }
    entries
}

/// Rates of the modes of a sheet in the shape `x`, and the scheme's bound on them.
fn modes(sheet: &Sheet, x: &[Vec3]) -> (Vec<(f64, f64)>, f64) {
    let mut scheme = green_gauss(sheet);
    scheme.update(x);
    let faces = sheet.triangle_count();
    let eigenvalues = rumple_tests_dense::eigenvalues(faces, &matrix(&scheme, faces));
    (eigenvalues.iter().map(|[re, im]| (*re, re.hypot(*im))).collect(), scheme.spectral_bound())
}

/// Values reach the scheme through the vertices only, so as many modes as there are more faces
/// than vertices are never damped. On generated meshes no mode grows, at the boundary or elsewhere, and
/// all eigenvalues lie within the bound.
#[test]
fn undamped_modes_and_no_growing_ones() {
    let rectangle = generate(&SheetShape::Rectangle { width: 1.0, height: 1.0 }, 120, 1).unwrap();
    let annulus = generate(&SheetShape::Annulus { inner: 0.3, outer: 1.0 }, 180, 1).unwrap();
    let sphere = generate(&SheetShape::Sphere { radius: 1.0, irregular: true }, 100, 1).unwrap();
    for sheet in [disc(120), rectangle, annulus, sphere, lattice(9, 9)] {
        let (modes, bound) = modes(&sheet, sheet.rest());
        let largest = modes.iter().map(|m| m.1).fold(0.0, f64::max);
        let growth = modes.iter().map(|m| m.0).fold(f64::NEG_INFINITY, f64::max);
        let undamped = modes.iter().filter(|m| m.1 < 1e-6 * largest).count();
        let (faces, vertices) = (sheet.triangle_count(), sheet.vertex_count());
        println!(
            "{undamped} of {faces} modes undamped, fastest growth {:.1e} of the largest rate, \
             bound over largest {:.2}",
            growth / largest,
            bound / largest
        );
        assert!(undamped > faces - vertices, "{undamped}");
        assert!(growth < 1e-12 * largest, "{growth}");
        assert!((1.0..12.0).contains(&(bound / largest)), "{bound} {largest}");
    }
}

/// A fault of the scheme itself: its gradient is not the adjoint of its divergence, and on badly
/// irregular meshes a few modes inside the sheet grow slowly. A good mesh that is bent and
/// stretched shows none.
#[test]
fn irregular_meshes_have_growing_modes() {
    let sheet = irregular(11, 10, 0.2);
    let flat = modes(&sheet, sheet.rest());
    let generated = disc(120);
    let curved = modes(&generated, &bumpy(&generated));
    for (name, (modes, bound)) in [("jittered lattice", flat), ("bumpy disc", curved)] {
        let largest = modes.iter().map(|m| m.1).fold(0.0, f64::max);
        let growth = modes.iter().map(|m| m.0).fold(f64::NEG_INFINITY, f64::max) / largest;
        println!("{name}: fastest growth {growth:.1e} of the largest rate");
        assert!(bound > largest);
        let expected = if name == "bumpy disc" { -1e-12..1e-12 } else { 1e-3..1e-2 };
        assert!(expected.contains(&growth), "{growth}");
    }
}

/// The average of faces around a vertex: constants stay, weights fall with the distance.
#[test]
fn averages_weigh_by_inverse_distance() {
    let sheet = irregular(9, 9, 0.25);
    let mut average = FaceVertexAverage::new(&sheet);
    let x = bumpy(&sheet);
    average.update(&sheet, &x);
    let mut out = vec![0.0; sheet.vertex_count()];
    average.apply(&sheet, &vec![3.0; sheet.triangle_count()], &mut out);
    assert!(out.iter().all(|c| (c - 3.0).abs() < 1e-14));

    let c = noise(sheet.triangle_count());
    average.apply(&sheet, &c, &mut out);
    let i = 40;
    let (mut above, mut below) = (0.0, 0.0);
    for (t, corners) in sheet.triangles().iter().enumerate() {
        if corners.iter().any(|v| *v as usize == i) {
            let centre = corners.map(|v| x[v as usize]).iter().sum::<Vec3>() / 3.0;
            let p = (x[i] - centre).norm();
            above += c[t] / p;
            below += 1.0 / p;
        }
    }
    assert!((out[i] - above / below).abs() < 1e-14);
}
