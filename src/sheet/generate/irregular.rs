//! Irregular meshes of a domain, accepted where they are good ones, and what no generator takes.

use rumple_numerics::Vec3;
use rumple_numerics::num::{Short, real};

use super::domain::{Domain, Frame, unfolded};
use super::{noise, order, relax};
use crate::{Sheet, SheetError, quality};

/// Random starts before a shape is declared impossible at the asked number of vertices.
const MAX_ATTEMPTS: u64 = 8;

/// Most vertices a generator makes: indices have 32 bits, and relaxation is serial.
const MAX_VERTICES: usize = 20_000_000;

/// Refuses sizes and numbers of vertices that no generator takes.
pub(super) fn check(sizes: &[(&str, f64)], vertices: usize) -> Result<(), SheetError> {
    for &(name, size) in sizes {
        // The bounds keep areas and squared lengths far from overflow and underflow.
        if !(1e-100..=1e100).contains(&size) {
            return Err(SheetError::Unusable(format!(
                "{name} = {} of the shape must be a positive number between 1e-100 and 1e100",
                Short(size)
            )));
        }
    }
    if vertices > MAX_VERTICES {
        return Err(SheetError::Unusable(format!(
            "{vertices} vertices are too many for a generator; at most {MAX_VERTICES} are made"
        )));
    }
    Ok(())
}

/// Fills a domain with random points, relaxes them, and accepts the mesh if it is a good one.
pub(super) fn irregular(
    domain: &impl Domain,
    vertices: usize,
    seed: u64,
) -> Result<Sheet, SheetError> {
    let mut refused = String::new();
    for attempt in 0..MAX_ATTEMPTS {
        let start = noise::points(domain, vertices, seed, attempt);
        let (points, triangles) = relax::relax(domain, start);
        let placed: Vec<_> = points.iter().map(|&p| domain.place(p)).collect();
        let (placed, triangles) = order::numbered(&points, &placed, &triangles);
        let sheet = Sheet::new(placed, triangles);
        match sheet.map_err(|e| e.to_string()).and_then(|s| accept(s, domain)) {
            Ok(sheet) => return Ok(sheet),
            Err(why) => refused = why,
        }
    }
    Err(SheetError::Unusable(format!(
        "no good mesh of this shape with {vertices} vertices was found in {MAX_ATTEMPTS} random \
         starts (the last one: {refused}); more vertices will help"
    )))
}

/// The promises of a generator, checked on its result.
pub(super) fn accept(sheet: Sheet, domain: &impl Domain) -> Result<Sheet, String> {
    let Frame { euler_characteristic: chi, boundary, .. } = *domain.frame();
    if sheet.euler_characteristic() != chi {
        return Err(format!(
            "Euler characteristic {} instead of {chi}",
            sheet.euler_characteristic()
        ));
    }
    let on_boundary = sheet.boundary().iter().filter(|&&r| r).count();
    if on_boundary != boundary {
        return Err(format!("{on_boundary} boundary vertices instead of {boundary}"));
    }
    for tri in sheet.triangles() {
        let corners = unfolded(tri.map(|v| sheet.rest()[v as usize]), domain.period());
        let centroid = corners.iter().sum::<Vec3>() / 3.0;
        let [x, y, z] = centroid.into();
        let near = || format!("the triangle at ({x:.3}, {y:.3}, {z:.3})");
        if !domain.may_span(centroid) && tri.iter().all(|&v| sheet.boundary()[v as usize]) {
            return Err(format!("{} has all its vertices on the boundary", near()));
        }
        let q = quality::triangle_quality(corners);
        let least = domain.least_quality();
        if q < least {
            return Err(format!("{} has quality {q:.3}, below {least:.3}", near()));
        }
    }
    Ok(sheet)
}

/// The refusal of a shape whose narrowest place is only a few edges wide.
pub(super) fn too_narrow(what: &str, edges: f64, least: usize, vertices: usize) -> SheetError {
    SheetError::Unusable(format!(
        "with {vertices} vertices {what} is only {edges:.1} edges long, but at least {} are \
         needed: give more vertices",
        real(least)
    ))
}
