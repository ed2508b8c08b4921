//! Contact: plates, ribbons on and between planes, and a ring that touches itself.
//!
//! ```text
//! p = κ [(1 - u)²/u - 2 (1 - u) ln u]          plates that carry p are u d̂ apart
//! L⁴ = 72 D h/q                                a heavy strip, clamped h above a plane, leaves it at L from the clamp
//! F = 2 I² D/H²,  I = ∫ √sin θ dθ = 1.19814    a strip bent round between planes H apart (0 < θ < π/2)
//! p R³/D = 5.247                               a ring under pressure touches itself
//! L⁴ = 18 D h²/w                               a strip that sticks to a plane, clamped h above it, leaves it at L
//! ```
//!
//! L: the deflection from where the strip leaves the plane is `w = (q/D) (L x³/18 - x⁴/24)`, without moment there and
//! with w' = 0, w = h at the clamp. The plane pushes at this point with qL/3, and carries q beyond: in all
//! q (S - 2L/3) on a strip of length S, from which L is computed.
//!
//! w: from where the strip sticks, at a curvature of √(2w/D), to the clamp the deflection is `h ξ² (3 - 2ξ)`, ξ = x/L: the strip
//! pulls with 12 D h/L³ per width, from which L is computed. w is the work of parting what rests at a distance where the
//! forces of the barrier and the well balance.
//!
//! H: from where the strip leaves a plane `D κ²/2 = F sin θ`, and the height to the middle is `∫ sin θ dθ/κ = H/2`. D is
//! the rigidity of ribbons (`ribbons.rs`).
//!
//! The ring beyond first contact is compared with one whose walls push at a point and are as far apart. A barrier of reach
//! d̂ spreads the force over a length of the order √(R d̂), so that the two agree as d̂ → 0.
//!
//! A shell is as stiff under a plate or a ball as under a point load (R5 in `shells.rs`) while it is pressed in by much less
//! than its thickness: the contact of radius a has `ln(ℓ/a) ~ h/(2 δ)`, ℓ² = R h/√(12(1-ν²)) (Updike & Kalnins, J. Appl.
//! Mech. 37 (1970) 635, doi:10.1115/1.3408592, have the larger ones).

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{EnergyTerm, Material, Pins};
use rumple::model::{Mechanics, Potential};
use rumple::num::{index, real};
use rumple::sheet::Sheet;

use super::ribbons::{self, Outside, force_at_neck};
use super::shells::{self, SHELL_MEYER};
use super::{Outcome, STVK_HINGE, Sample, area_load, critical, energy, mechanics, relax};

/// `∫ √sin θ dθ` over a quarter.
const QUARTER: f64 = 1.198_140_234_7;
/// Where the walls of a ring touch.
const TOUCHING_LOAD: f64 = 5.246_9;

/// What the barrier carries at the distance u, in units of κ and of the reach.
fn carried(u: f64) -> f64 {
    (1.0 - u) * (1.0 - u) / u - 2.0 * (1.0 - u) * u.ln()
}

/// The distance d at which the barrier carries `pressure`, in units of the reach and of κ.
fn distance(pressure: f64) -> f64 {
    let (mut low, mut high) = (1e-9, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if carried(middle) > pressure { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A flat plate of n × n cells, 1 wide, at z.
fn plate(n: usize, z: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = |i: usize| real(i) / real(n);
    let places = (0..(n + 1) * (n + 1)).map(|k| Vec3::new(at(k % (n + 1)), at(k / (n + 1)), z));
    let cells = (0..n * n).map(|k| (k / n) * (n + 1) + k % n);
    let two = |k: usize| [[k, k + 1, k + n + 1], [k + 1, k + n + 2, k + n + 1]];
    (places.collect(), cells.flat_map(two).map(|t| t.map(index)).collect())
}

/// The distance at which two plates of n and 2n + 1 cells rest from `start` on, with other effects on them.
fn apart(n: usize, start: f64, others: &[&str]) -> Outcome<(f64, Arc<Sheet>)> {
    let material = Material { young: 10.0, poisson: 0.3, thickness: 0.5 };
    let (mut rest, mut triangles) = plate(n, 0.0);
    let first = rest.len();
    let (above, more) = plate(2 * n + 1, 100.0);
    rest.extend(above);
    triangles.extend(more.iter().map(|t| t.map(|v| v + index(first))));
    let sheet = Arc::new(Sheet::new(rest, triangles)?);
    // Vertical motion of the upper plate is left.
    let pins: Pins = (0..sheet.vertex_count()).map(|v| [true, true, v < first]).collect();
    let models = [STVK_HINGE.stretching, STVK_HINGE.bending, "kind = 'contact'"];
    let effects: Vec<&str> = models.iter().chain(others).copied().collect();
    let mut mechanics = mechanics(&sheet, &material, &effects, pins)?;
    let low = |x: &Vec3| Vec3::new(x.x, x.y, if x.z > 1.0 { start } else { 0.0 });
    let mut x: Vec<Vec3> = sheet.rest().iter().map(low).collect();
    relax(&mut mechanics, &mut x, 1e-9)?;
    let gap = x[first..].iter().map(|x| x.z).sum::<f64>() / real(x.len() - first);
    Ok((gap, sheet))
}

/// The distance of two plates of n and 2n + 1 cells that are pressed together by `pressure`, in units of κ.
pub fn plates(n: usize, pressure: f64) -> Outcome<Sample> {
    let (gap, sheet) = apart(n, 0.45, &[&area_load(-pressure)])?;
    Ok(Sample::new(&sheet, gap, 0.5 * distance(pressure)))
}

/// The distance of two plates that stick together with the work `work`, in units of κ d̂, and twice the reach of contact.
pub fn stuck(n: usize, work: f64) -> Outcome<Sample> {
    let adhesion = format!("kind = 'adhesion'\nwork = {:e}\ndistance = 1.0", 0.5 * work);
    let (gap, sheet) = apart(n, 0.8, &[&adhesion])?;
    Ok(Sample::new(&sheet, gap, 0.5 * resting(work, 2.0)))
}

/// Where surfaces rest that stick together with the work `work`, in units of κ d̂ and d̂, within the range `range`.
fn resting(work: f64, range: f64) -> f64 {
    let pull = |d: f64| {
        let u = d / range;
        6.0 * work / range * u * (1.0 - u * u).powi(2)
    };
    let (mut low, mut high) = (1e-9, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if carried(middle) > pull(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Sum of the forces of contact number `which` on the vertices of which `of` holds.
fn force(mechanics: &mut Potential, which: usize, x: &[Vec3], of: impl Fn(usize) -> bool) -> Vec3 {
    let place = mechanics.mechanics().contacts().nth(which).unwrap_or(usize::MAX);
    let force = mechanics.force_of(place, x);
    (0..x.len()).filter(|v| of(*v)).map(|v| force[v]).sum()
}

const THIN: Material = Material { young: 1.2e6, poisson: 0.3, thickness: 0.1 };

/// A plane with a reach.
pub(super) fn plane(z: f64, up: f64, reach: f64) -> String {
    format!(
        "kind = 'obstacle'\ndistance = {reach:e}\n\
         shape = {{ plane = {{ point = [0.0, 0.0, {z:e}], normal = [0.0, 0.0, {up:e}] }} }}"
    )
}

/// The length of a heavy strip that is off the plane, with `cells` cells, and a plane of the given reach.
pub fn lift_off(cells: usize, reach: f64) -> Outcome<Sample> {
    let (length, height, exact) = (20.0, 0.2, 10.0f64);
    let edge = length / real(cells);
    let sheet = Arc::new(ribbons::flat(cells, edge)?);
    let weight = 72.0 * ribbons::rigidity(&THIN) * height / exact.powi(4);
    // The first edge that folds stands for half a cell from here.
    let clamp = 0.5 * edge;
    let clamped = |x: &Vec3| x.x < 1.01 * edge;
    let pins = sheet.rest().iter().map(|x| [clamped(x), true, clamped(x)]).collect();
    // A strip that lies on the plane is at z = 0.
    let level = -reach * distance(weight / (0.1 * THIN.young));
    let (plane, load) = (plane(level, 1.0, reach), area_load(-weight));
    let effects = [STVK_HINGE.stretching, STVK_HINGE.bending, &plane, &load];
    let mut mechanics = mechanics(&sheet, &THIN, &effects, pins)?;
    let lowered = |x: &Vec3| {
        let u = (1.0 - (x.x - clamp) / exact).max(0.0);
        let z = if clamped(x) { 1.0 } else { u * u * u * (4.0 - 3.0 * u) };
        Vec3::new(x.x, x.y, height * z)
    };
    let mut x: Vec<Vec3> = sheet.rest().iter().map(lowered).collect();
    relax(&mut mechanics, &mut x, 1e-11)?;
    let carried = force(&mut mechanics, 0, &x, |_| true).z / (weight * ribbons::width(&sheet));
    let end = (real(cells) - 0.25) * edge;
    Ok(Sample::new(&sheet, 1.5 * (end - clamp - carried), exact))
}

/// The length of a strip that is off a plane to which it sticks within `range`, with `cells` cells.
pub fn peeled(cells: usize, range: f64) -> Outcome<Sample> {
    let (length, height, exact) = (20.0, 0.2, 10.0f64);
    let edge = length / real(cells);
    let sheet = Arc::new(ribbons::flat(cells, edge)?);
    let rigidity = ribbons::rigidity(&THIN);
    let parted = 18.0 * rigidity * height * height / exact.powi(4);
    // The barrier is short beside the range, and stiff.
    let reach = 0.1 * range;
    let unit = 0.1 * THIN.young * reach;
    let left = |work: f64, d: f64| {
        work * (1.0 - (0.1 * d).powi(2)).powi(3) + (1.0 - d) * (1.0 - d) * d.ln()
    };
    let (mut low, mut high) = (parted / unit, 2.0 * parted / unit);
    for _ in 0..60 {
        let work = 0.5 * (low + high);
        let enough = left(work, resting(work, 10.0)) > parted / unit;
        if enough { high = work } else { low = work }
    }
    let work = 0.5 * (low + high);
    let level = -reach * resting(work, 10.0);
    let plane = plane(level, 1.0, reach);
    let adhesion = format!(
        "kind = 'adhesion'\nwork = {:e}\ndistance = {range:e}\n\
         to = {{ plane = {{ point = [0.0, 0.0, {level:e}], normal = [0.0, 0.0, 1.0] }} }}",
        work * unit
    );
    let clamp = 0.5 * edge;
    let clamped = |x: &Vec3| x.x < 1.01 * edge;
    let pins = sheet.rest().iter().map(|x| [clamped(x), true, clamped(x)]).collect();
    let effects = [STVK_HINGE.stretching, STVK_HINGE.bending, &plane, &adhesion];
    let mut mechanics = mechanics(&sheet, &THIN, &effects, pins)?;
    let lowered = |x: &Vec3| {
        let u = (1.0 - (x.x - clamp) / exact).max(0.0);
        let z = if clamped(x) { 1.0 } else { u * u * (3.0 - 2.0 * u) };
        Vec3::new(x.x, x.y, height * z)
    };
    let mut x: Vec<Vec3> = sheet.rest().iter().map(lowered).collect();
    relax(&mut mechanics, &mut x, 1e-11)?;
    // The two forces of the plane, the last two effects.
    let mut pull = |k: usize| mechanics.force_of(k, &x).iter().map(|f| f.z).sum::<f64>();
    let pulled = -(pull(2) + pull(3)) / ribbons::width(&sheet);
    Ok(Sample::new(&sheet, (12.0 * rigidity * height / pulled).cbrt(), exact))
}

/// The force on a strip that is bent round between two planes, in units of D/H².
pub fn bent_round(cells: usize, reach: f64) -> Outcome<Sample> {
    let (length, high) = (14.0, 2.0);
    let sheet = Arc::new(ribbons::flat(cells, length / real(cells))?);
    let pins = vec![[false, true, false]; sheet.vertex_count()];
    let planes = [1.0, -1.0].map(|side| plane(side * high, -side, reach));
    let effects = [STVK_HINGE.stretching, STVK_HINGE.bending, &planes[0], &planes[1]];
    let mut mechanics = mechanics(&sheet, &THIN, &effects, pins)?;
    let r = high - 0.9 * reach;
    let round = |x: &Vec3| {
        let s = x.x - 0.5 * length;
        let straight = s.abs() - std::f64::consts::FRAC_PI_2 * r;
        match straight > 0.0 {
            true => Vec3::new(-straight, x.y, s.signum() * r),
            false => Vec3::new(r * (s / r).cos(), x.y, r * (s / r).sin()),
        }
    };
    let mut x: Vec<Vec3> = sheet.rest().iter().map(round).collect();
    relax(&mut mechanics, &mut x, 1e-11)?;
    let [low, top] = [-1.0, 1.0].map(|s| s * x.iter().map(|x| s * x.z).fold(0.0, f64::max));
    let pushed = [0, 1].map(|k| force(&mut mechanics, k, &x, |_| true).z.abs());
    let mean = 0.5 * (pushed[0] + pushed[1]) / ribbons::width(&sheet);
    let computed = mean * (top - low).powi(2) / ribbons::rigidity(&THIN);
    Ok(Sample::new(&sheet, computed, 2.0 * QUARTER * QUARTER))
}

/// A ring under `pressure` in units of D/R³, with other effects.
fn pinched(
    sheet: &Arc<Sheet>,
    material: &Material,
    pressure: f64,
    others: &[&str],
) -> Outcome<Potential> {
    let (width, cells) = (ribbons::width(sheet), sheet.vertex_count() / 2);
    let pressure = pressure * ribbons::rigidity(material);
    let models = [STVK_HINGE.stretching, STVK_HINGE.bending];
    let tables = models.iter().chain(others);
    let mut energies: Vec<EnergyTerm> =
        tables.map(|table| energy(sheet, material, table)).collect::<Outcome<_>>()?;
    energies.push(EnergyTerm::new(Outside { pressure, width, cells }));
    let pins = vec![[false, true, false]; sheet.vertex_count()];
    Ok(Potential::new(&Mechanics::new(Arc::clone(sheet), energies, pins)?))
}

/// A ring pressed in along z, to start from.
fn oval(sheet: &Sheet) -> Vec<Vec3> {
    sheet.rest().iter().map(|x| Vec3::new(1.35 * x.x, x.y, 0.4 * x.z)).collect()
}

/// The distance of the walls of a ring across the middle of its long axis; negative where they have crossed. The ring may
/// have turned, and moved along itself.
fn opening(x: &[Vec3]) -> f64 {
    let mean = x.iter().sum::<Vec3>() / real(x.len());
    let moment = |of: fn(Vec3) -> f64| x.iter().map(|x| of(x - mean)).sum::<f64>();
    let (difference, product) = (moment(|d| d.x * d.x - d.z * d.z), moment(|d| 2.0 * d.x * d.z));
    let (sin, cos) = (0.5 * product.atan2(difference)).sin_cos();
    let turned = |i: usize| {
        let d = x[i % x.len()] - mean;
        [cos * d.x + sin * d.z, cos * d.z - sin * d.x]
    };
    let between = |i: usize| {
        let ([u, v], [next, w]) = (turned(i), turned(i + 1));
        // Where the boundary, which goes round to the left, passes the middle, and which way.
        ((u < 0.0) != (next < 0.0)).then(|| (u - next).signum() * (v - u / (next - u) * (w - v)))
    };
    (0..x.len()).filter_map(between).sum()
}

/// The pressure at which the walls of a ring of `cells` cells touch, in units of D/R³.
pub fn first_contact(cells: usize) -> Outcome<Sample> {
    let material = Material { thickness: 0.01, ..THIN };
    let sheet = Arc::new(ribbons::ring(cells)?);
    let computed = critical(0.91 * TOUCHING_LOAD, 1.12 * TOUCHING_LOAD, |pressure| {
        let mut x = oval(&sheet);
        relax(&mut pinched(&sheet, &material, pressure, &[])?, &mut x, 1e-10)?;
        Ok(opening(&x[..cells]) > 0.0)
    })?;
    Ok(Sample::new(&sheet, computed, TOUCHING_LOAD))
}

/// The force between the walls of a ring of the given thickness under `pressure`, both in units of the ring.
pub fn neck(cells: usize, pressure: f64, thickness: f64) -> Outcome<Sample> {
    let material = Material { thickness, ..THIN };
    let sheet = Arc::new(ribbons::ring(cells)?);
    let mut mechanics = pinched(&sheet, &material, pressure, &["kind = 'contact'"])?;
    let mut x = oval(&sheet);
    relax(&mut mechanics, &mut x, 1e-9)?;
    let upper = |v: usize| sheet.rest()[v].z > 0.0;
    let apart = force(&mut mechanics, 0, &x, upper).norm();
    let place = mechanics.mechanics().contacts().next().unwrap_or(usize::MAX);
    let gap = mechanics.touching(place, &x).map_or(f64::INFINITY, |touching| touching.gap);
    let computed = apart / (ribbons::width(&sheet) * ribbons::rigidity(&material));
    Ok(Sample::new(&sheet, computed, force_at_neck(pressure, gap)?))
}

/// The stiffness of a cap of R/h = 50 that a plate, or a ball of this radius, presses in by about `depth` thicknesses.
pub fn pressed(vertices: usize, depth: f64, reach: f64, ball: Option<f64>) -> Outcome<Sample> {
    let (sheet, apex, pins) = shells::cap(vertices)?;
    let thickness = shells::SPHERE.thickness;
    let (reach, top) = (reach * thickness, sheet.rest()[apex].z);
    let level = top - depth * thickness + reach;
    let plate = match ball {
        None => plane(level, -1.0, reach),
        Some(radius) => format!(
            "kind = 'obstacle'\ndistance = {reach:e}\n\
             shape = {{ sphere = {{ centre = [0.0, 0.0, {:e}], radius = {radius:e} }} }}",
            level + radius
        ),
    };
    let effects = [SHELL_MEYER.stretching, SHELL_MEYER.bending, &plate];
    let mut mechanics = mechanics(&sheet, &shells::SPHERE, &effects, pins)?;
    let mut x = sheet.rest().to_vec();
    relax(&mut mechanics, &mut x, 1e-9)?;
    let place = mechanics.mechanics().contacts().next().unwrap_or(usize::MAX);
    let force: Vec<f64> = mechanics.force_of(place, &x).iter().map(|f| -f.z).collect();
    let whole: f64 = force.iter().sum();
    let sunk = |v: usize| sheet.rest()[v].z - x[v].z;
    let mean = (0..x.len()).map(|v| force[v] * sunk(v)).sum::<f64>() / whole;
    Ok(Sample::new(&sheet, whole / mean, shells::reissner()))
}
