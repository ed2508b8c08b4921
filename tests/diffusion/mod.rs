//! Diffusion on flat and curved sheets against known decay rates and conservation laws.

mod along;
mod by_species;
mod cotan;
mod green_gauss;
mod ill_posed;

use rumple::Vec3;
use rumple::effects::{Cotan, Transport};
use rumple::sheet::Sheet;
use rumple::sheet::generate::{SheetShape, generate};
use rumple::solve::Result;
use rumple::solve::chemistry::chebyshev::{Chebyshev, Tolerance};

/// First zero of J_1', and the first two zeros of J_2' and J_0' in the order of their size:
/// modes cos θ, cos 2θ and the axisymmetric one of a disc without flux through its boundary.
pub const DISC_ZEROS: [(i32, f64); 3] =
    [(1, 1.841_183_781_340_659_5), (2, 3.054_236_928_227_140_4), (0, 3.831_705_970_207_512_5)];

/// An irregular disc of radius 1.
pub fn disc(vertices: usize) -> Sheet {
    generate(&SheetShape::Disc { radius: 1.0 }, vertices, 3).unwrap()
}

/// A flat sheet of about unit size pushed out of its plane and stretched unevenly.
pub fn bumpy(sheet: &Sheet) -> Vec<Vec3> {
    let bump = |x: &Vec3| {
        let stretch = 1.0 + 0.2 * (3.0 * x.x).sin();
        Vec3::new(x.x * stretch, x.y * 1.1, 0.3 * (4.0 * x.x).cos() * (3.0 * x.y).sin())
    };
    sheet.rest().iter().map(bump).collect()
}

/// J_n(x) = (1/π) ∫₀^π cos(nτ - x sin τ) dτ; the trapezoidal rule is spectral here.
pub fn bessel(n: i32, x: f64) -> f64 {
    let points = 64;
    let term = |k: i32| {
        let tau = std::f64::consts::PI * f64::from(k) / f64::from(points);
        let end = if k == 0 || k == points { 0.5 } else { 1.0 };
        end * (f64::from(n) * tau - x * tau.sin()).cos()
    };
    (0..=points).map(term).sum::<f64>() / f64::from(points)
}

/// Mode `J_n(j' r) cos nθ` of the unit disc at a point.
pub fn disc_mode((n, zero): (i32, f64), x: &Vec3) -> f64 {
    bessel(n, zero * x.x.hypot(x.y)) * (f64::from(n) * x.y.atan2(x.x)).cos()
}

pub fn weighted(weight: &[f64], a: &[f64], b: &[f64]) -> f64 {
    weight.iter().zip(a).zip(b).map(|((w, a), b)| w * a * b).sum()
}

/// A transport on one shape of its sheet.
pub struct On<'a, T: Transport> {
    transport: T,
    sheet: &'a Sheet,
    operator: T::Operator,
}

impl<'a, T: Transport> On<'a, T> {
    /// On the rest shape.
    pub fn rest(sheet: &'a Sheet, transport: T) -> Self {
        let mut on = Self { transport, sheet, operator: T::Operator::default() };
        on.update(sheet.rest());
        on
    }

    /// On the shape `x` from now on.
    pub fn update(&mut self, x: &[Vec3]) {
        self.transport.assemble(self.sheet, x, &mut self.operator);
    }

    pub fn add_rate(&self, c: &[f64], out: &mut [f64]) {
        self.transport.add_rate((self.sheet, 0.0), &self.operator, c, out);
    }

    pub fn spectral_bound(&self) -> f64 {
        self.transport.spectral_bound((self.sheet, 0.0), &self.operator)
    }
}

impl On<'_, Cotan> {
    pub fn area(&self) -> &[f64] {
        self.transport.effective_operator(&self.operator).area()
    }

    pub fn negative_weights(&self) -> usize {
        self.transport.effective_operator(&self.operator).negative_weights()
    }
}

/// Integrates pure diffusion of `c` over `time`.
pub fn diffuse<T: Transport>(
    scheme: &On<'_, T>,
    c: &mut [f64],
    time: f64,
    tolerance: f64,
) -> Result<Chebyshev> {
    let mut integrator = Chebyshev::default();
    let absolute = vec![tolerance; c.len()];
    let tolerance = Tolerance { relative: tolerance, absolute: &absolute };
    integrator.integrate(0.0, time, c, &tolerance, scheme.spectral_bound(), |_, y, out| {
        out.fill(0.0);
        scheme.add_rate(y, out);
        Ok(())
    })?;
    Ok(integrator)
}

/// Decay rate of a mode, measured over about one decay time `1/expected` in the inner product
/// given by `weight`.
pub fn decay_rate<T: Transport>(
    scheme: &On<'_, T>,
    weight: &[f64],
    mode: &[f64],
    expected: f64,
) -> f64 {
    let mut c = mode.to_vec();
    let time = 1.0 / expected;
    diffuse(scheme, &mut c, time, 1e-8).unwrap();
    (weighted(weight, mode, mode) / weighted(weight, mode, &c)).ln() / time
}

pub fn rate<T: Transport>(scheme: &On<'_, T>, c: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; c.len()];
    scheme.add_rate(c, &mut out);
    out
}

/// `|Σ w c| / Σ |w c|`: how far a weighted sum is from zero.
pub fn imbalance(weight: &[f64], c: &[f64]) -> f64 {
    let terms = || weight.iter().zip(c).map(|(w, c)| w * c);
    terms().sum::<f64>().abs() / terms().map(f64::abs).sum::<f64>()
}
