//! Shells: sheets that bending leaves at rest where they are curved, and spontaneous curvature.
//!
//! * R1: a flat strip with a spontaneous curvature, against the strip theory of Ashwell, J. R. Aeronaut. Soc. 54
//!   (1950) 708, with C₀ in place of the moment;
//! * R2: the hemisphere with a hole of 18° under alternating point loads: MacNeal & Harder, Finite Elem. Anal.
//!   Des. 1 (1985) 3, doi:10.1016/0168-874X(85)90003-4, and Sze, Liu & Lo, Finite Elem. Anal. Des. 40 (2004) 1551;
//! * R3: the pinched cylinder with rigid diaphragms, w = 164.24 P/(E h): Lindberg, Olson & Cowper, NRC Quart. Bull.
//!   Div. Mech. Eng. 4 (1969), for ν = 0.3, R/h = 100, L/R = 2;
//! * R4: Zoelly's pressure `2 E h²/(R² √(3(1-ν²)))` on a sphere;
//! * R5: Reissner's stiffness `4 E h²/(R √(3(1-ν²)))` under a point load: J. Math. Phys. 25 (1946) 279,
//!   doi:10.1002/sapm1946251279.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{HessianPart, Material, Pins};
use rumple::model::Potential;
use rumple::num::{index, real, whole};
use rumple::sheet::{Sheet, SheetShape, generate};

use super::meshes::Strip;
use super::{Models, Outcome, Sample, Stiffness, critical, mechanics, newton};

const STVK: &str = "kind = 'stretching'\nmodel = 'stvk'\nmodulus = 'plate'";
const MEYER: &str = "kind = 'bending'\nmodel = 'meyer'\nrest = 'mesh'";
const HINGE: &str = "kind = 'bending'\nmodel = 'hinge'\nrest = 'mesh'";

/// Shells whose vertices bend.
pub const SHELL_MEYER: Models = Models { name: "stvk + meyer", stretching: STVK, bending: MEYER };
/// Shells of hinges.
pub const SHELL_HINGE: Models = Models { name: "stvk + hinge", stretching: STVK, bending: HINGE };

/// Linear displacement of R2 under forces of 2: MacNeal & Harder's 0.094, which others have as 0.0935.
const HEMISPHERE: f64 = 0.0935;

/// Force, and displacements of A outwards and B inwards, of R2: Sze, Liu & Lo, § 3.4.
pub const HEMISPHERE_PATH: [(f64, [f64; 2]); 5] = [
    (20.0, [0.855, 0.955]),
    (100.0, [2.596, 3.833]),
    (200.0, [3.406, 5.902]),
    (300.0, [3.816, 7.234]),
    (400.0, [4.067, 8.178]),
];

/// A point of a rest shape with the number of its vertex.
pub(super) fn nearest(sheet: &Sheet, to: Vec3) -> usize {
    let distance = |i: &usize| (sheet.rest()[*i] - to).norm();
    let all = 0..sheet.vertex_count();
    all.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

/// Rows of `around` vertices, each other row shifted by half a place, closed to a band; `at` gives the position of
/// an angle and a row.
fn band(around: usize, rows: usize, at: impl Fn(f64, usize) -> Vec3) -> Outcome<Sheet> {
    let angle = |j: usize, row: usize| TAU * (real(j) + 0.5 * real(row % 2)) / real(around);
    let rest = (0..rows).flat_map(|row| (0..around).map(move |j| (j, row)));
    let rest = rest.map(|(j, row)| at(angle(j, row), row)).collect();
    let number = |row: usize, j: usize| index(row * around + j % around);
    let mut triangles = Vec::new();
    for row in 0..rows - 1 {
        for j in 0..around {
            let [a, b] = [number(row, j), number(row, j + 1)];
            let [c, d] = [number(row + 1, j), number(row + 1, j + 1)];
            triangles.extend(match row % 2 {
                0 => [[a, b, c], [b, d, c]],
                _ => [[a, d, c], [a, b, d]],
            });
        }
    }
    Ok(Sheet::new(rest, triangles)?)
}

/// A load on single vertices, as a scene lists it.
fn point_load(vertex: usize, force: Vec3) -> String {
    let [x, y, z]: [f64; 3] = force.into();
    format!(
        "kind = 'load'\nwhere = {{ vertices = [{vertex}] }}\nforce = {{ per-vertex = [{x:e}, {y:e}, {z:e}] }}"
    )
}

/// R1: curvature of a strip of this width, 12 long, h = 0.1 and ν = 0.3, with the spontaneous curvature 0.25; along
/// its middle.
pub fn rolled(width: f64, rows: usize, models: &Models) -> Outcome<Sample> {
    const C0: f64 = 0.25;
    let material = Material { young: 1e4, poisson: 0.3, thickness: 0.1 };
    let strip = Strip { length: 12.0, width, rows, extra: 0.0 };
    let sheet = Arc::new(strip.mesh()?);
    let model = if models.bending.contains("hinge") { "hinge" } else { "meyer" };
    let mut x = sheet.rest().to_vec();
    let mut pins = vec![[false; 3]; x.len()];
    // Six components, so that nothing but the rigid motions is held.
    for (place, axes) in [
        ([3.0, 0.0], [false, true, true]),
        ([9.0, 0.0], [false, true, true]),
        ([6.0, width], [true, false, true]),
    ] {
        pins[nearest(&sheet, Vec3::new(place[0], place[1], 0.0))] = axes;
    }
    for step in 1..=5u32 {
        let c0 = C0 * f64::from(step) / 5.0;
        let bending = format!("kind = 'bending'\nmodel = '{model}'\ncurvature = {c0:e}");
        let mut mechanics = mechanics(&sheet, &material, &[STVK, &bending], pins.clone())?;
        newton(&mut mechanics, &mut x, 1e-9)?;
    }
    let poisson = if model == "hinge" { -1.0 / 3.0 } else { material.poisson };
    let computed = middle_curvature(&strip, &sheet, &x);
    Ok(Sample::new(&sheet, computed, strip_curvature(C0, width, poisson, &material)?))
}

/// Curvature of the circle through the means of three columns in the middle half.
fn middle_curvature(strip: &Strip, sheet: &Sheet, x: &[Vec3]) -> f64 {
    let half = strip.columns() / 2;
    let reach = half / 2;
    let mean = |column: usize| {
        let on = (0..x.len()).filter(|&i| whole(sheet.rest()[i].x / strip.spacing()) == column);
        let on: Vec<usize> = on.filter(|&i| !sheet.boundary()[i]).collect();
        on.iter().map(|&i| x[i]).sum::<Vec3>() / real(on.len())
    };
    let [a, b, c] = [half - reach, half, half + reach].map(mean);
    let (u, v, w) = (b - a, c - b, c - a);
    2.0 * u.cross(&v).norm() / (u.norm() * v.norm() * w.norm())
}

/// The curvature κ along a strip whose profile w(y) across minimises
/// `∫ (B/2) [(κ + w'' - C₀)² - 2(1-ν) κ w''] + (E h/2) κ² w² dy`.
fn strip_curvature(c0: f64, width: f64, poisson: f64, material: &Material) -> Outcome<f64> {
    let (b, y) = (material.bending_rigidity(), material.young * material.thickness);
    let moment = |k: f64| {
        let beta = (0.25 * y * k * k / b).powf(0.25);
        let m = 0.5 * beta * width;
        let (sin, cos, sinh, cosh) = (m.sin(), m.cos(), m.sinh(), m.cosh());
        // c = cos cosh and s = sin sinh of βy: c'' = -2β² s, s'' = 2β² c.
        let ratio = (cos * sinh - sin * cosh) / (cos * sinh + sin * cosh);
        let d = (c0 - poisson * k) / (2.0 * beta * beta * (cos * cosh - ratio * sin * sinh));
        let a = d * ratio;
        let steps = 2000;
        let integrand = |j: usize| {
            let t = m * real(j) / real(steps);
            let (c, s) = (t.cos() * t.cosh(), t.sin() * t.sinh());
            let (w, bent) = (a * c + d * s, 2.0 * beta * beta * (d * c - a * s));
            b * (k + poisson * bent - c0) + y * k * w * w
        };
        let weight = |j: usize| if j == 0 || j == steps { 0.5 } else { 1.0 };
        (0..=steps).map(|j| weight(j) * integrand(j)).sum::<f64>() / real(steps)
    };
    critical(0.3 * c0, 1.5 * c0, |k| Ok(moment(k) < 0.0))
}

/// The hemisphere of R2, with the vertices A at (R, 0, 0), B at (0, R, 0) and those opposite.
struct Hemisphere {
    sheet: Arc<Sheet>,
    loaded: [usize; 4],
    pins: Pins,
}

impl Hemisphere {
    const MATERIAL: Material = Material { young: 6.825e7, poisson: 0.3, thickness: 0.04 };
    const RADIUS: f64 = 10.0;

    /// Rows of equal triangles in Mercator's projection.
    fn new(around: usize) -> Outcome<Self> {
        let top = (0.25 * PI + 0.2 * PI).tan().ln();
        let rows = 2 * whole(0.5 * top / (0.75f64.sqrt() * TAU / real(around)));
        let sheet = Arc::new(band(around, rows + 1, |angle, row| {
            let latitude = 2.0 * (top * real(row) / real(rows)).exp().atan() - FRAC_PI_2;
            let (sin, cos) = latitude.sin_cos();
            Self::RADIUS * Vec3::new(cos * angle.cos(), cos * angle.sin(), sin)
        })?);
        let loaded = [0, 1, 2, 3].map(|k| k * around / 4);
        let mut pins = vec![[false; 3]; sheet.vertex_count()];
        // What symmetry keeps at 0, as far as it holds the sheet.
        pins[loaded[0]] = [false, true, true];
        pins[loaded[2]] = [false, true, true];
        pins[loaded[1]] = [true, false, false];
        pins[rows * around] = [false, true, false];
        Ok(Self { sheet, loaded, pins })
    }

    /// Outward forces at A and opposite, inward ones at B and opposite.
    fn mechanics(&self, models: &Models, force: f64) -> Outcome<Potential> {
        let axes = [Vec3::x(), -Vec3::y(), -Vec3::x(), Vec3::y()];
        let loads: Vec<String> =
            self.loaded.iter().zip(axes).map(|(v, axis)| point_load(*v, force * axis)).collect();
        let mut effects = vec![models.stretching, models.bending];
        effects.extend(loads.iter().map(String::as_str));
        mechanics(&self.sheet, &Self::MATERIAL, &effects, self.pins.clone())
    }

    /// Displacement of A outwards and of B inwards.
    fn displacements(&self, x: &[Vec3]) -> [f64; 2] {
        [x[self.loaded[0]].x - Self::RADIUS, Self::RADIUS - x[self.loaded[1]].y]
    }
}

/// R2, linear: the mean of both displacements under forces of 2.
pub fn hemisphere(around: usize, models: &Models) -> Outcome<Sample> {
    let hemisphere = Hemisphere::new(around)?;
    let rest = hemisphere.sheet.rest();
    let force = 1e-3;
    let mut loaded = hemisphere.mechanics(models, force)?;
    let mut gradient = vec![Vec3::zeros(); rest.len()];
    loaded.energy_gradient(rest, &mut gradient);
    let forces = gradient.iter().map(|g| -g).collect();
    let mut free = hemisphere.mechanics(models, 0.0)?;
    let moved = Stiffness::new(&hemisphere.sheet)?.response(&mut free, rest, forces)?;
    let x: Vec<Vec3> = rest.iter().zip(moved).map(|(x, u)| x + u).collect();
    let [a, b] = hemisphere.displacements(&x).map(|u| 2.0 * u / force);
    Ok(Sample::new(&hemisphere.sheet, 0.5 * (a + b), HEMISPHERE))
}

/// R2 at the forces of [`HEMISPHERE_PATH`], reached in steps of 40 at most: displacements of A and B.
pub fn hemisphere_path(around: usize, models: &Models) -> Outcome<Vec<[Sample; 2]>> {
    let hemisphere = Hemisphere::new(around)?;
    let mut x = hemisphere.sheet.rest().to_vec();
    let (mut found, mut force) = (Vec::new(), 0.0);
    for (target, exact) in HEMISPHERE_PATH {
        while force < target {
            force = target.min(force + 40.0);
            newton(&mut hemisphere.mechanics(models, force)?, &mut x, 1e-9)?;
        }
        let [a, b] = hemisphere.displacements(&x);
        found.push(
            [(a, exact[0]), (b, exact[1])]
                .map(|(u, exact)| Sample::new(&hemisphere.sheet, u, exact)),
        );
    }
    Ok(found)
}

/// R3: the displacement under the load, times E h/P.
pub fn pinched(around: usize, models: &Models) -> Outcome<Sample> {
    let (radius, length, force) = (300.0, 600.0, 1e-3);
    let material = Material { young: 3e6, poisson: 0.3, thickness: 3.0 };
    let rows = 4 * whole(0.25 * length / (0.75f64.sqrt() * TAU * radius / real(around)));
    let sheet = Arc::new(band(around, rows + 1, |angle, row| {
        let z = length * (real(row) / real(rows) - 0.5);
        Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
    })?);
    let middle = rows / 2 * around;
    let mut pins = vec![[false; 3]; sheet.vertex_count()];
    for v in 0..around {
        pins[v] = [true, true, false];
        pins[rows * around + v] = [true, true, false];
    }
    pins[middle] = [false, false, true];
    let opposite = middle + around / 2;
    let rest = sheet.rest().to_vec();
    let mut forces = vec![Vec3::zeros(); rest.len()];
    forces[middle].x = -force;
    forces[opposite].x = force;
    let mut free = mechanics(&sheet, &material, &[models.stretching, models.bending], pins)?;
    let moved = Stiffness::new(&sheet)?.response(&mut free, &rest, forces)?;
    let w = -moved[middle].x * material.young * material.thickness / force;
    Ok(Sample::new(&sheet, w, 164.24))
}

pub(super) const SPHERE: Material = Material { young: 1e4, poisson: 0.3, thickness: 0.2 };
pub(super) const RADIUS: f64 = 10.0;

/// `E h²/√(3(1-ν²))`.
fn scale() -> f64 {
    let Material { young, poisson, thickness } = SPHERE;
    young * thickness * thickness / (3.0 * (1.0 - poisson * poisson)).sqrt()
}

/// R4: the pressure at which a sphere loses stability; R/h = 50.
pub fn zoelly(vertices: usize, irregular: bool, models: &Models) -> Outcome<Sample> {
    let sheet = Arc::new(generate(&SheetShape::Sphere { radius: RADIUS, irregular }, vertices, 1)?);
    let exact = 2.0 * scale() / (RADIUS * RADIUS);
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mut stiffness = Stiffness::new(&sheet)?;
    let mut from = (0.0, sheet.rest().to_vec());
    let computed = critical(0.5 * exact, 1.3 * exact, |p| {
        let table = format!("kind = 'pressure'\nvalue = {:e}", -p);
        let effects = [models.stretching, models.bending, &table];
        let mut mechanics = mechanics(&sheet, &SPHERE, &effects, pins.clone())?;
        let mut x = from.1.clone();
        let stable = stays_round(&mut mechanics, &mut x, &mut stiffness)?;
        if stable && p > from.0 {
            from = (p, x);
        }
        Ok(stable)
    })?;
    Ok(Sample::new(&sheet, computed, exact))
}

/// Whether the equilibrium near `x` is stable but for rigid motions; found by Newton's method without a line search.
fn stays_round(
    mechanics: &mut Potential,
    x: &mut [Vec3],
    stiffness: &mut Stiffness,
) -> Outcome<bool> {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    for _ in 0..30 {
        mechanics.energy_gradient(x, &mut gradient);
        mechanics.hessian(x, HessianPart::Full, &mut stiffness.matrix)?;
        // A millionth holds the rigid motions, and is far below the lowest stiffness of bending.
        let shift = 1e-7 * stiffness.matrix.mean_diagonal();
        stiffness.matrix.add_diagonal(shift);
        if stiffness.cholesky.factorise(&stiffness.matrix, true).is_err() {
            return Ok(false);
        }
        if mechanics.residual(&gradient) < 1e-10 {
            return Ok(true);
        }
        let mut step: Vec<Vec3> = gradient.iter().map(|g| -g).collect();
        stiffness.cholesky.solve(&mut step);
        x.iter_mut().zip(&step).for_each(|(x, d)| *x += d);
    }
    Err("the sphere under pressure does not come to rest".into())
}

/// A cap with a pinned boundary, rim radius 6, R/h = 50; its vertex nearest to the apex.
pub(super) fn cap(vertices: usize) -> Outcome<(Arc<Sheet>, usize, Pins)> {
    let height = RADIUS - (RADIUS * RADIUS - 36.0).sqrt();
    let sheet = Arc::new(generate(&SheetShape::Cap { radius: RADIUS, height }, vertices, 1)?);
    let apex = nearest(&sheet, Vec3::new(0.0, 0.0, height));
    let pins = sheet.boundary().iter().map(|on| [*on; 3]).collect();
    Ok((sheet, apex, pins))
}

/// Reissner's stiffness.
pub(super) fn reissner() -> f64 {
    4.0 * scale() / RADIUS
}

/// R5: the stiffness of a cap under a small force at its apex.
pub fn point(vertices: usize, models: &Models) -> Outcome<Sample> {
    let (sheet, apex, pins) = cap(vertices)?;
    let mut free = mechanics(&sheet, &SPHERE, &[models.stretching, models.bending], pins)?;
    let rest = sheet.rest().to_vec();
    let centre = (RADIUS * RADIUS - 36.0).sqrt();
    let inwards = Vec3::new(0.0, 0.0, -centre) - rest[apex];
    let inwards = inwards.normalize();
    let mut forces = vec![Vec3::zeros(); rest.len()];
    forces[apex] = 1e-3 * inwards;
    let moved = Stiffness::new(&sheet)?.response(&mut free, &rest, forces)?;
    Ok(Sample::new(&sheet, 1e-3 / moved[apex].dot(&inwards), reissner()))
}
