//! Wrinkling of a growing annulus between clamped rims (Q4).
//!
//! Growth by the factor 1 + ε in the plane cannot spread and becomes the compression N = Y ε/(1-ν), the same in all
//! directions. The annulus buckles into m waves around where `B ∇⁴w + N ∇²w = 0` has a solution
//!
//! ```text
//! w = (α J_m(kr) + β Y_m(kr) + γ r^m + δ r^-m) cos mφ,   N = k² B         (1 and ln r for m = 0)
//! w = ∂w/∂r = 0  at both rims
//! ```
//!
//! that is, at the first zero of a determinant of four rows. Not the shape of revolution (m = 0) is the first one but, for
//! an inner radius of 0.3, one with two waves, for cos and sin alike.
//!
//! Timoshenko & Gere, Theory of Elastic Stability (1961), for circular plates. Clamps as in `plates.rs`: each rim lies midway
//! between its two rows.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Matrix4;
use rumple::effects::{Material, Pins};
use rumple::model::Potential;
use rumple::num::real;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::solve::Control;
use rumple::solve::continuation::{Continuation, Event, Point, Settings};

use super::branches::points;
use super::{Models, Outcome, STVK_MEYER, Sample, mechanics};

const MODELS: Models = STVK_MEYER;
const MATERIAL: Material = Material { young: 1.0, poisson: 1.0 / 3.0, thickness: 0.02 };
/// Most waves around that are tried.
const MAX_WAVES: usize = 6;

/// An annulus that has grown, in units of the strain of theory.
struct Grown {
    sheet: Arc<Sheet>,
    pins: Pins,
    strain: f64,
}

impl Grown {
    fn potential(&self, parameter: f64) -> Outcome<Potential> {
        let effects = [MODELS.stretching, MODELS.bending];
        let mut potential = mechanics(&self.sheet, &MATERIAL, &effects, self.pins.clone())?;
        let factor = vec![1.0 + parameter * self.strain; self.sheet.edges().len()];
        potential.set_length_factor(&factor);
        Ok(potential)
    }
}

/// The integral of `f` from 0 to `end` by Simpson's rule.
fn integral(end: f64, f: impl Fn(f64) -> f64) -> f64 {
    const PARTS: usize = 2000;
    let weight = |k: usize| match k {
        0 | PARTS => 1.0,
        _ if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let h = end / real(PARTS);
    (0..=PARTS).map(|k| weight(k) * f(h * real(k))).sum::<f64>() * h / 3.0
}

/// J_m(x) and Y_m(x) by their integrals: Abramowitz & Stegun 9.1.21 and 9.1.22.
fn bessel(m: usize, x: f64) -> [f64; 2] {
    let order = real(m);
    let sign = if m.is_multiple_of(2) { 1.0 } else { -1.0 };
    let first = integral(PI, |t| (order * t - x * t.sin()).cos()) / PI;
    let swinging = integral(PI, |t| (x * t.sin() - order * t).sin());
    let falling = |t: f64| ((order * t).exp() + sign * (-order * t).exp()) * (-x * t.sinh()).exp();
    [first, (swinging - integral(8.0, falling)) / PI]
}

/// J_m'(x) and Y_m'(x).
fn slope(m: usize, x: f64) -> [f64; 2] {
    let (here, next) = (bessel(m, x), bessel(m + 1, x));
    [0, 1].map(|k: usize| real(m) / x * here[k] - next[k])
}

/// The determinant of w = w' = 0 at the radii `rims`, for m waves.
fn determinant(k: f64, m: usize, rims: [f64; 2]) -> f64 {
    let order = real(m);
    let mut rows = Matrix4::zeros();
    for (rim, r) in rims.into_iter().enumerate() {
        let [value, slope] = [bessel(m, k * r), slope(m, k * r)];
        let smooth = match m {
            0 => [[1.0, r.ln()], [0.0, 1.0 / r]],
            _ => {
                let (grows, falls) = (r.powf(order), r.powf(-order));
                [[grows, falls], [order * grows / r, -order * falls / r]]
            }
        };
        let entries = [
            [value[0], value[1], smooth[0][0], smooth[0][1]],
            [k * slope[0], k * slope[1], smooth[1][0], smooth[1][1]],
        ];
        for (row, entries) in entries.iter().enumerate() {
            for (column, entry) in entries.iter().enumerate() {
                rows[(2 * rim + row, column)] = *entry;
            }
        }
    }
    rows.determinant()
}

/// The smallest k, with its number of waves.
fn first_mode(rims: [f64; 2]) -> (f64, usize) {
    const STEP: f64 = 0.1;
    let of = |m: usize| {
        let value = |k: f64| determinant(k, m, rims);
        let mut low = 2.0;
        let sign = value(low).signum();
        while value(low + STEP).signum() == sign {
            low += STEP;
        }
        let mut high = low + STEP;
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if value(middle).signum() == sign { low = middle } else { high = middle }
        }
        (low, m)
    };
    (0..=MAX_WAVES).map(of).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
}

/// The annulus with two rows of fixed vertices at each rim, and the radii midway between them.
fn annulus(vertices: usize) -> Outcome<(Arc<Sheet>, Pins, [f64; 2])> {
    let sheet = generate(&SheetShape::Annulus { inner: 0.25, outer: 1.0 }, vertices, 1)?;
    let mut fixed = sheet.boundary().to_vec();
    for edge in sheet.edges() {
        for [a, b] in [[0, 1], [1, 0]] {
            if sheet.boundary()[edge.vertices[a] as usize] {
                fixed[edge.vertices[b] as usize] = true;
            }
        }
    }
    let second = |inner: bool| {
        let rest = sheet.rest();
        let is = |i: &usize| fixed[*i] && !sheet.boundary()[*i] && (rest[*i].norm() < 0.6) == inner;
        let radii: Vec<f64> = (0..fixed.len()).filter(is).map(|i| rest[i].norm()).collect();
        radii.iter().sum::<f64>() / real(radii.len())
    };
    let rims = [0.5 * (0.25 + second(true)), 0.5 * (1.0 + second(false))];
    let pins = fixed.iter().map(|fixed| [*fixed; 3]).collect();
    Ok((Arc::new(sheet), pins, rims))
}

/// What Q4 finds.
pub struct Wrinkled {
    /// The strain of the first bifurcation.
    pub strain: Sample,
    /// Waves around of its mode, and of theory.
    pub waves: [usize; 2],
}

/// Q4 on a mesh of so many vertices.
pub fn wrinkled(vertices: usize) -> Outcome<Wrinkled> {
    let (sheet, pins, rims) = annulus(vertices)?;
    let (k, waves) = first_mode(rims);
    let ratio = MATERIAL.bending_rigidity() / MATERIAL.stretching_modulus();
    let exact = k * k * (1.0 - MATERIAL.poisson) * ratio;
    let family = Grown { sheet: Arc::clone(&sheet), pins, strain: exact };
    let settings = Settings::over(0.8..=1.2, family.potential(0.8)?.mechanics());
    let settings = Settings { first_step: 0.05, tolerance: 1e-9, ..settings };
    let start = (sheet.rest().to_vec(), 0.8);
    let mut branch = Continuation::new(
        move |p| family.potential(p),
        start,
        true,
        settings,
        &Control::default(),
    )?;
    let critical = |point: &Point| matches!(point.event, Event::Bifurcation(_));
    // Special points come before the one that the step leads to.
    let all = points(&mut branch, |point| point.negative > 0)?;
    let point = all.iter().find(|point| critical(point)).ok_or("the annulus stays flat")?;
    let Event::Bifurcation(modes) = &point.event else { return Err("no mode".into()) };
    let shape = &modes.first().ok_or("no mode")?.shape.x;
    let power = |m: usize| {
        let part = |turn: fn(f64) -> f64| {
            let of = |(rest, w): (&rumple::Vec3, &rumple::Vec3)| {
                w.z * turn(real(m) * rest.y.atan2(rest.x))
            };
            sheet.rest().iter().zip(shape).map(of).sum::<f64>()
        };
        part(f64::cos).powi(2) + part(f64::sin).powi(2)
    };
    let found = (0..=MAX_WAVES).max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or_default();
    let strain = Sample::new(&sheet, point.parameter * exact, exact);
    Ok(Wrinkled { strain, waves: [found, waves] })
}
