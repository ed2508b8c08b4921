//! How the search for what is near grows with the sheet: a sheet that bends gently, where nothing is, and one in pleats
//! whose layers touch.
//!
//! ```text
//! cargo bench --bench proximity [-- VERTICES …]
//! ```
//!
//! Prints microseconds a vertex, medians of three: clusters and patches, made once; the first list of pairs; asking
//! whether it serves at a shape nearby; the limit of a step that leads beyond it, for which the swept clusters are searched; crossings of
//! triangles, for comparison. One thread. Rows of `docs/notebook/contact.md`.

#![allow(missing_docs)]

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;

use rumple::Vec3;
use rumple::geometry::Crossings;
use rumple::geometry::proximity::{Proximity, Reach};
use rumple::sheet::Sheet;

/// The reach of vertices, in edges.
const REACH: f64 = 1.0;
const RANGE: Reach = Reach { points: REACH, edges: 0.5 * REACH, shrinkage: 1.0 };
/// Layers of pleats are this far apart, and straight on this length, in edges.
const LAYER_GAP: f64 = 0.9 * REACH;
const STRAIGHT_LENGTH: f64 = 12.0;

/// A square of about `vertices` vertices that are 1 apart.
fn square(vertices: u32) -> Result<Sheet, Box<dyn std::error::Error>> {
    let n = vertices.isqrt();
    let place = |k: u32| Vec3::new(f64::from(k % n), f64::from(k / n), 0.0);
    let two = |k: u32| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]];
    let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
    Ok(Sheet::new((0..n * n).map(place).collect(), cells.flat_map(two).collect())?)
}

/// Bent round a cylinder by a radian.
fn bent(sheet: &Sheet) -> Vec<Vec3> {
    let radius = f64::from(u32::try_from(sheet.vertex_count()).unwrap_or(u32::MAX).isqrt());
    let at = |x: &Vec3| {
        let (sin, cos) = (x.x / radius).sin_cos();
        Vec3::new(radius * sin, x.y, radius * (1.0 - cos))
    };
    sheet.rest().iter().map(at).collect()
}

/// In pleats of straight layers and half circles.
fn pleated(sheet: &Sheet) -> Vec<Vec3> {
    let radius = 0.5 * LAYER_GAP;
    let at = |x: &Vec3| {
        let period = STRAIGHT_LENGTH + PI * radius;
        let (layer, s) = ((x.x / period).floor(), x.x.rem_euclid(period));
        let side = if layer.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
        let turn = (s - STRAIGHT_LENGTH).max(0.0) / radius;
        let along = s.min(STRAIGHT_LENGTH) - 0.5 * STRAIGHT_LENGTH + radius * turn.sin();
        Vec3::new(side * along, x.y, LAYER_GAP * layer + radius * (1.0 - turn.cos()))
    };
    sheet.rest().iter().map(at).collect()
}

/// The median of three times that `work` takes on what `made` makes, s.
fn median<T>(mut made: impl FnMut() -> T, mut work: impl FnMut(&mut T)) -> f64 {
    let mut times = [(); 3].map(|()| {
        let mut on = made();
        let start = Instant::now();
        work(&mut on);
        start.elapsed().as_secs_f64()
    });
    times.sort_by(f64::total_cmp);
    times[1]
}

/// One row: `shape` of `sheet`.
fn row(name: &str, sheet: &Sheet, x: &[Vec3]) {
    let fresh = || Proximity::new(sheet, 1.0, REACH);
    let made = median(|| (), |()| _ = black_box(fresh()));
    let mut count = 0;
    let list = median(fresh, |proximity| {
        let (points, edges) = proximity.near(sheet, x, &RANGE);
        count = points.len() + edges.len();
    });
    let wave = |x: &Vec3, by: f64| by * Vec3::new((0.1 * x.y).sin(), 0.0, (0.1 * x.y).cos());
    let nearby: Vec<Vec3> = x.iter().map(|x| x + wave(x, 0.02)).collect();
    // Layers come nearer by a fifth of their distance, and wave by more than the list leaves room for.
    let far: Vec<Vec3> = x.iter().map(|x| Vec3::new(0.0, 0.0, -0.2 * x.z) + wave(x, 1.0)).collect();
    let mut proximity = fresh();
    let _ = proximity.near(sheet, x, &RANGE);
    let none = || ();
    let again = median(none, |()| _ = black_box(proximity.near(sheet, &nearby, &RANGE)));
    let step = median(none, |()| _ = black_box(proximity.largest_step(sheet, (x, &far), &RANGE)));
    let crossings = median(none, |()| _ = black_box(Crossings::new(sheet).find(sheet, x)));
    #[allow(clippy::cast_precision_loss)]
    let n = sheet.vertex_count() as f64;
    let [made, list, again, step, crossings] =
        [made, list, again, step, crossings].map(|s| 1e6 * s / n);
    println!(
        "| {name} | {n} | {count} | {made:.2} | {list:.2} | {again:.3} | {step:.2} | {crossings:.2} |"
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given: Vec<u32> = std::env::args().skip(1).filter_map(|n| n.parse().ok()).collect();
    let sizes = if given.is_empty() { vec![5_000, 20_000, 80_000, 200_000] } else { given };
    let sheets = sizes.iter().map(|n| square(*n)).collect::<Result<Vec<Sheet>, _>>()?;
    println!(
        "| shape | vertices | pairs | clusters | first list | asked again | step | crossings |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(|| {
        for (name, shape) in [("bent", bent as fn(&Sheet) -> Vec<Vec3>), ("pleated", pleated)] {
            sheets.iter().for_each(|sheet| row(name, sheet, &shape(sheet)));
        }
    });
    Ok(())
}
