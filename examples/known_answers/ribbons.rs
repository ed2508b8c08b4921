//! Ribbons: strips that bend in the plane (x, z) alone, and the elastica that they are.
//!
//! A ribbon is one equilateral triangle wide along y, where nothing moves. Where a sheet of hinges curves by κ along its
//! rows, the edges across fold by `κ l/√3` and carry 8/9 of the energy; those of the rows, which fold by `κ l/√12`, are the
//! boundary of a ribbon and do not. Its bending rigidity is D = 8/9 B.
//!
//! **Ring.** A ring of length 2πR under the pressure p from outside, whose opposite walls press on one another with F
//! per width, has four equal quarters. With R = D = 1, from the far end of the long axis to the neck,
//!
//! ```text
//! κ'' = p - C κ - ½ κ³,   θ' = κ,   x' = cos θ,   y' = sin θ,    0 < s < π/2
//! θ = π/2, κ' = 0, y = 0  at s = 0;    θ = π, y = g/2, κ' = ±F/2  at s = π/2
//! ```
//!
//! g is the distance of the walls at the neck (Flaherty, Keller & Rubinow, SIAM J. Appl. Math. 23 (1972) 446,
//! doi:10.1137/0123047). They touch first (g = F = 0) at p = 5.247. A rest state that is flat, and so has a moment D/R in
//! the circle, has the same shapes: the integral of κ is 2π.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rumple::Vec3;
use rumple::effects::{Block, BlockMatrix, Coupling, Energy, HessianPart, Material};
use rumple::geometry::Shape;
use rumple::num::{index, real};
use rumple::sheet::Sheet;

use super::Outcome;

/// A flat ribbon of `cells` edges of length `edge` along x, with half of the vertices at y = 0.
pub fn flat(cells: usize, edge: f64) -> Outcome<Sheet> {
    let width = 0.75f64.sqrt() * edge;
    let lower = (0..=cells).map(|i| Vec3::new(real(i) * edge, 0.0, 0.0));
    let upper = (0..cells).map(|i| Vec3::new((real(i) + 0.5) * edge, width, 0.0));
    let (b, t) = (|i: usize| index(i), |i: usize| index(cells + 1 + i));
    let mut triangles: Vec<_> = (0..cells).map(|i| [b(i), b(i + 1), t(i)]).collect();
    triangles.extend((0..cells - 1).map(|i| [t(i), b(i + 1), t(i + 1)]));
    Ok(Sheet::new(lower.chain(upper).collect(), triangles)?)
}

/// A ring of radius 1 around the y axis: vertex i < `cells` is at y = 0 and the angle 2πi/cells, vertex
/// `cells` + i half a cell further on the other side.
pub fn ring(cells: usize) -> Outcome<Sheet> {
    let [edge, half] = [1.0, 0.5].map(|share| 2.0 * (share * PI / real(cells)).sin());
    let width = (edge * edge - half * half).sqrt();
    let at = |i: f64, y: f64| {
        let (sin, cos) = (TAU * i / real(cells)).sin_cos();
        Vec3::new(cos, y, sin)
    };
    let lower = (0..cells).map(|i| at(real(i), 0.0));
    let upper = (0..cells).map(|i| at(real(i) + 0.5, width));
    let (b, t) = (|i: usize| index(i % cells), |i: usize| index(cells + i % cells));
    let both = |i: usize| [[b(i), b(i + 1), t(i)], [t(i), b(i + 1), t(i + 1)]];
    Ok(Sheet::new(lower.chain(upper).collect(), (0..cells).flat_map(both).collect())?)
}

/// D, by which a ribbon bends.
pub fn rigidity(material: &Material) -> f64 {
    8.0 / 9.0 * material.bending_rigidity()
}

/// Width of a ribbon.
pub fn width(sheet: &Sheet) -> f64 {
    sheet.rest().iter().map(|x| x.y).fold(0.0, f64::max)
}

/// Pressure on a ring from outside, U = p w A, with the mean area A within its two boundaries.
pub struct Outside {
    /// p.
    pub pressure: f64,
    /// w.
    pub width: f64,
    /// Vertices of either boundary.
    pub cells: usize,
}

impl Outside {
    /// The two neighbours along the boundary, the next one last.
    fn neighbours(&self, i: usize) -> [usize; 2] {
        let first = i / self.cells * self.cells;
        [self.cells - 1, 1].map(|by| first + (i - first + by) % self.cells)
    }
}

impl Energy for Outside {
    type Work = ();

    fn name(&self) -> &'static str {
        "pressure from outside"
    }

    fn coupling(&self) -> Coupling {
        Coupling::TWO_RINGS
    }

    fn evaluate(&self, shape: &Shape<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        let (x, factor) = (shape.x, 0.25 * self.pressure * self.width);
        if let Some(gradient) = gradient {
            for (i, g) in gradient.iter_mut().enumerate() {
                let [before, after] = self.neighbours(i).map(|j| x[j]);
                let d = after - before;
                *g += factor * Vec3::new(d.z, 0.0, -d.x);
            }
        }
        let one = |i: usize| {
            let next = x[self.neighbours(i)[1]];
            x[i].x * next.z - next.x * x[i].z
        };
        factor * (0..x.len()).map(one).sum::<f64>()
    }

    fn add_hessian(&self, _: &Shape<'_>, (): &mut (), part: HessianPart, into: &mut BlockMatrix) {
        if part == HessianPart::Positive {
            return;
        }
        let factor = 0.25 * self.pressure * self.width;
        let by_next = factor * Block::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0);
        into.update_rows(|i, row| {
            for (j, block) in self.neighbours(i).into_iter().zip([-by_next, by_next]) {
                if j > i {
                    row.add(j, &block);
                }
            }
        });
    }
}

/// θ, κ, κ' and y at the neck of a ring with curvature `far` at the far end.
fn neck(p: f64, [far, c]: [f64; 2]) -> [f64; 4] {
    const STEPS: usize = 400;
    let slope =
        |[theta, k, slope, _]: [f64; 4]| [k, slope, p - c * k - 0.5 * k * k * k, theta.sin()];
    let h = FRAC_PI_2 / real(STEPS);
    let along = |u: [f64; 4], k: [f64; 4], by: f64| std::array::from_fn(|i| u[i] + by * k[i]);
    (0..STEPS).fold([FRAC_PI_2, far, 0.0, 0.0], |u, _| {
        let a = slope(u);
        let b = slope(along(u, a, 0.5 * h));
        let c = slope(along(u, b, 0.5 * h));
        let d = slope(along(u, c, h));
        std::array::from_fn(|i| u[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]))
    })
}

/// The force F between the walls of a ring under the pressure `p`, g apart at the neck; negative where they would have
/// to be held together.
pub fn force_at_neck(p: f64, gap: f64) -> Outcome<f64> {
    // A ring between first contact and where the walls begin to touch along a line.
    let mut v = [3.9, -0.4];
    for _ in 0..50 {
        let miss = |v: [f64; 2]| {
            let [theta, _, _, y] = neck(p, v);
            [theta - PI, y - 0.5 * gap]
        };
        let here = miss(v);
        if here.iter().all(|m| m.abs() < 1e-11) {
            return Ok(2.0 * neck(p, v)[2]);
        }
        let h = 1e-6;
        let [a, b] = [[h, 0.0], [0.0, h]].map(|by| {
            let [up, down] = [1.0, -1.0].map(|s| miss([v[0] + s * by[0], v[1] + s * by[1]]));
            [0, 1].map(|i| (up[i] - down[i]) / (2.0 * h))
        });
        let det = a[0] * b[1] - b[0] * a[1];
        v[0] -= (here[0] * b[1] - b[0] * here[1]) / det;
        v[1] -= (a[0] * here[1] - here[0] * a[1]) / det;
    }
    Err(format!("no ring at the pressure {p} is {gap} wide at its neck").into())
}
