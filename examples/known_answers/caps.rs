//! Snap of a clamped shallow spherical cap (Q3).
//!
//! A cap of the curvature 1/R and the thickness h, clamped at the radius a, carries a uniform vertical load q. With
//! x = r/a, φ = (R/a) dw/dr and Ψ = a N_r r/D the equations of Marguerre and Reissner for shapes of revolution are
//!
//! ```text
//! Lφ = Ψ (φ - x) - Q x²,   LΨ = -λ⁴ (φ²/2 - x φ),       L f = x f'' + f' - f/x
//! φ(0) = Ψ(0) = 0,   φ(1) = 0,   Ψ'(1) = ν Ψ(1)
//! λ⁴ = 12 (1-ν²) a⁴/(R h)²,   Q = q a² R/(2D) = 2 λ² q/q₀,   q₀ = 2 E h²/(R² √(3(1-ν²)))
//! ```
//!
//! with Zoelly's pressure q₀ of the whole sphere. They are solved by shooting from x = 0, along φ'(0). The loads at which
//! the cap snaps down and back are the extremes of Q. λ = 3.5 is between 3.3, below which it does not snap, and 5.5, beyond which it
//! leaves the shapes of revolution before it snaps.
//!
//! Reissner, On axisymmetrical deformations of thin shells of revolution, Proc. Symp. Appl. Math. 3 (1950) 27; Budiansky, Buckling of
//! clamped shallow spherical shells, Proc. IUTAM Symp. Theory of Thin Elastic Shells, Delft (1959) 64; Huang, J. Appl. Mech. 31
//! (1964) 447.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2, Vector4};
use rumple::Vec3;
use rumple::effects::{Material, Pins};
use rumple::model::Potential;
use rumple::sheet::Sheet;
use rumple::solve::Control;
use rumple::solve::continuation::{Continuation, Event, Settings};

use super::branches::points;
use super::plates::{Boundary, plate};
use super::shells::SHELL_MEYER;
use super::{Models, Outcome, Sample, area_load, mechanics};

const MODELS: Models = SHELL_MEYER;
/// λ.
const SHALLOWNESS: f64 = 3.5;
/// Largest load, in units of q₀.
const MAX_LOAD: f64 = 0.8;

/// A cap under a load in units of q₀.
struct Cap {
    sheet: Arc<Sheet>,
    pins: Pins,
    material: Material,
    zoelly: f64,
}

impl Cap {
    fn potential(&self, parameter: f64) -> Outcome<Potential> {
        let load = area_load(-parameter * self.zoelly);
        let effects = [MODELS.stretching, MODELS.bending, &load];
        mechanics(&self.sheet, &self.material, &effects, self.pins.clone())
    }
}

/// The equations at x, of (φ, φ', Ψ, Ψ').
fn slopes(x: f64, y: Vector4<f64>, load: f64) -> Vector4<f64> {
    let [phi, dphi, psi, dpsi] = y.into();
    let stretch = -SHALLOWNESS.powi(4) * (0.5 * phi * phi - x * phi);
    let bend = psi * (phi - x) - load * x * x;
    Vector4::new(dphi, (bend - dphi + phi / x) / x, dpsi, (stretch - dpsi + psi / x) / x)
}

/// φ(1) and Ψ'(1) - ν Ψ(1) of φ'(0), Ψ'(0) and Q, by the method of Runge and Kutta.
fn shot(bend: f64, at: Vector2<f64>, poisson: f64) -> Vector2<f64> {
    const STEPS: u32 = 400;
    let first = 1e-3;
    let h = (1.0 - first) / f64::from(STEPS);
    let mut y = Vector4::new(bend * first, bend, at[0] * first, at[0]);
    for k in 0..STEPS {
        let x = first + h * f64::from(k);
        let a = slopes(x, y, at[1]);
        let b = slopes(x + 0.5 * h, y + 0.5 * h * a, at[1]);
        let c = slopes(x + 0.5 * h, y + 0.5 * h * b, at[1]);
        let d = slopes(x + h, y + h * c, at[1]);
        y += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    Vector2::new(y[0], y[3] - poisson * y[2])
}

/// The first largest and the next smallest load over q₀.
fn limit_loads(poisson: f64) -> Outcome<[f64; 2]> {
    const STEP: f64 = 0.02;
    let mut last = [Vector2::zeros(); 2];
    let mut found = Vec::new();
    let mut loads: Vec<f64> = vec![0.0];
    for k in 1..250 {
        let bend = STEP * f64::from(k);
        let mut at = 2.0 * last[1] - last[0];
        for _ in 0..8 {
            let miss = shot(bend, at, poisson);
            let by = |step: Vector2<f64>| (shot(bend, at + step, poisson) - miss) / 1e-6;
            let columns = [by(Vector2::new(1e-6, 0.0)), by(Vector2::new(0.0, 1e-6))];
            at -= Matrix2::from_columns(&columns).try_inverse().ok_or("no slope")? * miss;
        }
        last = [last[1], at];
        loads.push(at[1] / (2.0 * SHALLOWNESS * SHALLOWNESS));
        if let [.., a, b, c] = loads[..]
            && (b - a) * (c - b) < 0.0
        {
            // The extreme of the parabola through the three.
            found.push(b - (c - a) * (c - a) / (8.0 * (a - 2.0 * b + c)));
        }
        if let [down, back] = found[..] {
            return Ok([down, back]);
        }
    }
    Err("the cap does not snap".into())
}

/// What Q3 finds.
pub struct Snap {
    /// Loads at which it snaps, down and back, over q₀.
    pub limits: [Sample; 2],
    /// Negative eigenvalues before, between and beyond.
    pub negative: [usize; 3],
}

/// Q3 on a mesh of so many vertices.
pub fn cap(vertices: usize) -> Outcome<Snap> {
    let flat = plate(vertices, Boundary::Clamped)?;
    let material = Material { thickness: 0.01, ..flat.material };
    let Material { young, poisson, thickness } = material;
    let stiff = (12.0 * (1.0 - poisson * poisson)).sqrt();
    let curvature = SHALLOWNESS * SHALLOWNESS * thickness / (stiff * flat.radius * flat.radius);
    let zoelly = 4.0 * young * (thickness * curvature).powi(2) / stiff;
    let lift = |x: &Vec3| Vec3::new(x.x, x.y, -0.5 * curvature * (x.x * x.x + x.y * x.y));
    let rest: Vec<Vec3> = flat.sheet.rest().iter().map(lift).collect();
    let sheet = Arc::new(Sheet::new(rest.clone(), flat.sheet.triangles().to_vec())?);
    let family = Cap { sheet: Arc::clone(&sheet), pins: flat.pins, material, zoelly };
    let settings = Settings::over(0.0..=MAX_LOAD, family.potential(0.0)?.mechanics());
    let settings = Settings { length: thickness, longest_step: 0.2, tolerance: 1e-9, ..settings };
    let mut branch = Continuation::new(
        move |p| family.potential(p),
        (rest, 0.0),
        true,
        settings,
        &Control::default(),
    )?;
    let all = points(&mut branch, |_| false)?;
    let folds: Vec<usize> = (0..all.len()).filter(|&k| all[k].event == Event::Fold).collect();
    let [down, back] = folds[..] else { return Err(format!("{} folds", folds.len()).into()) };
    let exact = limit_loads(poisson)?;
    let sample = |k: usize, exact: f64| Sample::new(&sheet, all[k].parameter, exact);
    Ok(Snap {
        limits: [sample(down, exact[0]), sample(back, exact[1])],
        negative: [all[down - 1].negative, all[down + 1].negative, all[back + 1].negative],
    })
}
