//! What every generated sheet promises.

use std::f64::consts::{PI, TAU};

use rumple::sheet::quality::triangle_angles;
use rumple::sheet::{MeshReport, Shape, Sheet, generate};

const DISC: Shape = Shape::Disc { radius: 100.0 };
const RECTANGLE: Shape = Shape::Rectangle { width: 30.0, height: 10.0 };
const ANNULUS: Shape = Shape::Annulus { inner: 2.0, outer: 7.0 };
const BALL: Shape = Shape::Sphere { radius: 0.5, irregular: true };
const ICOSPHERE: Shape = Shape::Sphere { radius: 0.5, irregular: false };
const CYLINDER: Shape = Shape::Cylinder { radius: 3.0, height: 11.0 };

fn made(shape: &Shape, vertices: usize, seed: u64) -> Sheet {
    generate(shape, vertices, seed).unwrap_or_else(|e| panic!("{shape:?} {vertices} {seed}: {e}"))
}

/// Sum of the curvature of all vertices: 2π (or π on the rim) less the angles there.
fn total_curvature(sheet: &Sheet) -> f64 {
    let mut defect: Vec<f64> =
        sheet.rim().iter().map(|&on_rim| if on_rim { PI } else { TAU }).collect();
    for t in sheet.triangles() {
        let angles = triangle_angles(t.map(|v| sheet.rest()[v as usize]));
        for (&v, angle) in t.iter().zip(angles) {
            defect[v as usize] -= angle;
        }
    }
    defect.iter().sum()
}

fn promises(shape: &Shape, vertices: usize, seed: u64, chi: i64) {
    let what = format!("{shape:?} with {vertices} vertices, seed {seed}");
    let sheet = made(shape, vertices, seed);
    let report = MeshReport::new(&sheet);
    println!("{what}\n{report}");
    assert_eq!(report.vertices, vertices, "{what}");
    assert_eq!(report.euler_characteristic, chi, "{what}");
    assert_eq!(report.all_rim_triangles, 0, "{what}");
    assert!(report.quality.min >= 0.6, "{what}: {:?}", report.quality);
    assert!(report.quality.mean > 0.97, "{what}: {:?}", report.quality);
    assert!(report.irregular_vertices * 50 > vertices, "{what}: nearly a lattice");
    let error = total_curvature(&sheet) - TAU * f64::from(i32::try_from(chi).unwrap());
    assert!(error.abs() < 1e-9, "{what}: Gauss-Bonnet off by {error:e}");
    // Along the curve a neighbour is some √N away; without an order it is N/3.
    #[allow(clippy::cast_precision_loss)]
    let root = (vertices as f64).sqrt();
    assert!(report.mean_index_distance < 4.0 * root, "{what}: {}", report.mean_index_distance);
}

#[test]
fn discs_keep_the_promises() {
    for (vertices, seeds) in [(500, 0..6), (5_000, 0..3), (20_000, 0..2)] {
        for seed in seeds {
            promises(&DISC, vertices, seed, 1);
        }
    }
}

#[test]
fn other_shapes_keep_the_promises() {
    for (vertices, seeds) in [(500, 0..4), (5_000, 0..2)] {
        for seed in seeds {
            promises(&RECTANGLE, vertices, seed, 1);
            promises(&ANNULUS, vertices, seed, 0);
            promises(&BALL, vertices, seed, 2);
            promises(&CYLINDER, vertices, seed, 0);
        }
    }
}
