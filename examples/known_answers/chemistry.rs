//! Diffusion with boundary values, advection and cross-diffusion, whose answers are known.
//!
//! * C1: the slowest axisymmetric mode J₀(z r) of the unit disc decays at D z², with J₀(z) = 0 where c = 0 is held
//!   (z = 2.4048), and D z J₁(z) = k J₀(z) where `D ∂c/∂n = -k c`: Carslaw & Jaeger, Conduction of Heat in Solids (1959),
//!   section 7.6;
//! * C2: a ring between the radii a and b with the flux q through the inner boundary and c = 0 held at the outer one:
//!   c = (q a/D) ln(b/r);
//! * C3: a Gaussian carried round a sphere by a rigid rotation: it keeps its shape;
//! * C4: growth rates σ of a spherical harmonic of degree l by cross-diffusion: the eigenvalues of A - l(l+1) D.

use rumple::kinetics::PluginSearch;
use rumple::num::real;
use rumple::scene::Scene;
use rumple::sheet::Sheet;
use rumple::{Simulation, Vec3};

use super::{Outcome, Sample};

/// An integrator that resolves time far better than meshes do space.
pub const FINE: &str =
    "{ kind = \"staggered\", chemistry = \"chebyshev\", rtol = 1e-7, atol = 1e-9 }";

/// The same for advection, whose steps Chebyshev's method cannot lengthen.
pub const CARRIED: &str =
    "{ kind = \"staggered\", chemistry = \"tsit45\", rtol = 1e-6, atol = 1e-8 }";

/// The scene `text` from the values `start` of the species at the vertices to its end.
fn run(text: &str, start: impl Fn(&Vec3) -> Vec<f64>) -> Outcome<Simulation> {
    let scene = Scene::parse(text, "known_answers", &[])?;
    let mut simulation = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?;
    let rest = simulation.sheet().rest().to_vec();
    for (i, x) in rest.iter().enumerate() {
        for (s, value) in start(x).into_iter().enumerate() {
            simulation.state_mut().species[s][i] = value;
        }
    }
    simulation.prepare()?;
    let until = scene.time.span.until.get();
    while simulation.state().time < until {
        simulation.step(until)?;
    }
    Ok(simulation)
}

/// A third of the areas around every vertex at rest.
fn areas(sheet: &Sheet) -> Vec<f64> {
    let mut all = vec![0.0; sheet.vertex_count()];
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| sheet.rest()[v as usize]);
        t.iter().for_each(|v| all[*v as usize] += (b - a).cross(&(c - a)).norm() / 6.0);
    }
    all
}

/// `Σ A_i a_i b_i`.
fn product(area: &[f64], a: &[f64], b: &[f64]) -> f64 {
    area.iter().zip(a).zip(b).map(|((area, a), b)| area * a * b).sum()
}

/// J_n(x) = (1/π) ∫₀^π cos(nτ - x sin τ) dτ; the trapezoidal rule is spectral here.
fn bessel(n: i32, x: f64) -> f64 {
    let points = 64;
    let term = |k: i32| {
        let tau = std::f64::consts::PI * f64::from(k) / f64::from(points);
        let end = if k == 0 || k == points { 0.5 } else { 1.0 };
        end * (f64::from(n) * tau - x * tau.sin()).cos()
    };
    (0..=points).map(term).sum::<f64>() / f64::from(points)
}

/// C1: decay rate of the mode in units of D, where c = 0 is held at the boundary or `rate` is that of an exchange.
pub fn decay(vertices: usize, rate: Option<f64>, integrator: &str) -> Outcome<Sample> {
    let excess = |z: f64| match rate {
        None => bessel(0, z),
        Some(k) => k * bessel(0, z) - z * bessel(1, z),
    };
    let (mut low, mut high) = (0.0, 2.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    let effect = match rate {
        None => "kind = \"hold\"\nvalue = 0.0".to_owned(),
        Some(k) => format!("kind = \"exchange\"\nrate = {k:?}\nreference = 0.0"),
    };
    let exact = low * low;
    let until = 1.0 / exact;
    let text = format!(
        "sheet = {{ shape = \"disc\", radius = 1.0, vertices = {vertices}, seed = 3 }}\n\
         time = {{ until = {until:?}, integrator = {integrator} }}\nkinetics = {{ rates = {{ c = \"0\" }} }}\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 1.0\n\
         [[effect]]\nspecies = \"c\"\nwhere = \"rim\"\n{effect}\n"
    );
    let mode = |x: &Vec3| bessel(0, low * x.norm());
    let simulation = run(&text, |x| vec![mode(x)])?;
    let sheet = simulation.sheet();
    let (area, start) = (areas(sheet), sheet.rest().iter().map(mode).collect::<Vec<_>>());
    let end = &simulation.state().species[0];
    let ratio = product(&area, &start, &start) / product(&area, &start, end);
    Ok(Sample::new(sheet, ratio.ln() / until, exact))
}

/// C2: the steady concentration at the inner boundary, mean over its vertices, for a = 1, b = 3, D = 2 and q = 0.5.
pub fn ring(vertices: usize, integrator: &str) -> Outcome<Sample> {
    let text = format!(
        "sheet = {{ shape = \"annulus\", inner = 1.0, outer = 3.0, vertices = {vertices}, seed = 3 }}\n\
         time = {{ until = 20.0, integrator = {integrator} }}\nkinetics = {{ rates = {{ c = \"0\" }} }}\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 2.0\n\
         [[effect]]\nkind = \"flux\"\nspecies = \"c\"\nvalue = 0.5\nwhere = {{ ring = {{ inner = 0.9, outer = 1.001 }} }}\n\
         [[effect]]\nkind = \"hold\"\nspecies = \"c\"\nvalue = 0.0\nwhere = {{ ring = {{ inner = 2.999, outer = 4.0 }} }}\n"
    );
    let simulation = run(&text, |_| vec![0.0])?;
    let (sheet, c) = (simulation.sheet(), &simulation.state().species[0]);
    let inner: Vec<usize> = (0..c.len()).filter(|&i| sheet.rest()[i].norm() < 1.001).collect();
    let mean = inner.iter().map(|&i| c[i]).sum::<f64>() / real(inner.len());
    Ok(Sample::new(sheet, mean, 0.25 * 3.0f64.ln()))
}

/// C3: 1 plus the L² distance, relative, between a Gaussian of width 0.4 turned by one radian and the exact one.
pub fn rotated(vertices: usize, scheme: &str, integrator: &str) -> Outcome<Sample> {
    let axis = Vec3::new(0.6, 0.0, 0.8);
    let text = format!(
        "sheet = {{ shape = \"sphere\", radius = 1.0, irregular = true, vertices = {vertices}, seed = 3 }}\n\
         time = {{ until = 1.0, integrator = {integrator} }}\nkinetics = {{ rates = {{ c = \"0\" }} }}\n\
         [[effect]]\nkind = \"advection\"\nspecies = \"c\"\nscheme = \"{scheme}\"\n\
         velocity = [\"-0.8*y\", \"0.8*x - 0.6*z\", \"0.6*y\"]\n"
    );
    let place = Vec3::new(0.0, 1.0, 0.0);
    let bump = |x: &Vec3| (-(x - place).norm_squared() / (2.0 * 0.4 * 0.4)).exp();
    let simulation = run(&text, |x| vec![bump(x)])?;
    let sheet = simulation.sheet();
    let back = nalgebra::Rotation3::from_scaled_axis(-axis);
    let exact: Vec<f64> = sheet.rest().iter().map(|x| bump(&(back * x))).collect();
    let c = &simulation.state().species[0];
    let differ: Vec<f64> = c.iter().zip(&exact).map(|(a, b)| a - b).collect();
    let area = areas(sheet);
    let error = product(&area, &differ, &differ) / product(&area, &exact, &exact);
    Ok(Sample::new(sheet, 1.0 + error.sqrt(), 1.0))
}

/// C4: growth rate of the harmonic xyz (l = 3) under `u' = u - 2v`, `v' = 3u - 4v`, D = 0.05 for both and D_uv = -0.2.
pub fn cross(vertices: usize, integrator: &str) -> Outcome<Sample> {
    let (own, by, eigenvalue) = (0.05, -0.2, 12.0);
    let m = [[1.0 - own * eigenvalue, -2.0 - by * eigenvalue], [3.0, -4.0 - own * eigenvalue]];
    let (trace, det) = (m[0][0] + m[1][1], m[0][0] * m[1][1] - m[0][1] * m[1][0]);
    let exact: f64 = 0.5 * (trace + f64::sqrt(trace * trace - 4.0 * det));
    let ratio = (exact - m[0][0]) / m[0][1];
    let text = format!(
        "sheet = {{ shape = \"sphere\", radius = 1.0, irregular = true, vertices = {vertices}, seed = 3 }}\n\
         time = {{ until = 1.0, integrator = {integrator} }}\n\
         kinetics = {{ rates = {{ u = \"u - 2*v\", v = \"3*u - 4*v\" }} }}\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"u\"\ncoefficient = {own:?}\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"v\"\ncoefficient = {own:?}\n\
         [[effect]]\nkind = \"cross-diffusion\"\nspecies = \"u\"\nby = \"v\"\ncoefficient = {by:?}\n"
    );
    let mode = |x: &Vec3| x.x * x.y * x.z;
    let simulation = run(&text, |x| vec![mode(x), ratio * mode(x)])?;
    let sheet = simulation.sheet();
    let (area, start) = (areas(sheet), sheet.rest().iter().map(mode).collect::<Vec<_>>());
    let end = &simulation.state().species[0];
    let ratio = product(&area, &start, end) / product(&area, &start, &start);
    Ok(Sample::new(sheet, ratio.ln(), exact))
}
