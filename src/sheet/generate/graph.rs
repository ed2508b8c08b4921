//! Surfaces over a rectangle: the graph z = f(x, y) of any function, and the wavy strip, which is a bent plane.
//!
//! A graph is relaxed in space: vertices move along x and y, and z follows. Boundary vertices are evenly spaced in arc
//! length. Triangles are those of the (x, y) plane, flipped until they are Delaunay in space. Area and lengths come from
//!
//! ```text
//! A = ∫∫ √(1 + f_x² + f_y²) dx dy,        L = ∫ √(1 + f_x²) dx.
//! ```
//!
//! The wavy strip z = A sin(2πx/λ) has no Gaussian curvature: its rectangle is relaxed flat and bent along the arc length,
//! so that its triangles are as good as flat ones.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rumple_numerics::Vec3;
use rumple_numerics::num::{Short, real, whole};

use super::density::edge_length;
use super::domain::{Domain, Frame, delaunay};
use super::flip::delaunay_in_space;
use super::irregular::too_narrow;
use super::planar::{BOUNDARY_MARGIN, CORNER_OFFSET, FEWEST_ACROSS, Planar};
use crate::SheetError;

/// Intervals along each side of the table that heights are looked up in while vertices move; a wave needs some twenty of
/// them. In the end vertices get the exact height.
const INTERVALS: usize = 1024;

/// Intervals along a curve whose arc length is tabulated.
const CURVE_INTERVALS: usize = 20_000;

/// Steepest slope: beyond it, triangles of the plane say little about the surface.
const MAX_SLOPE: f64 = 20.0;

/// Distances of the vertex inside a corner from it, in edges.
const CORNER_NEAREST: f64 = 1.0;
const CORNER_FARTHEST: f64 = 1.25;

/// z over the (x, y) of points.
pub type Height<'a> = &'a dyn Fn(&[Vec3]) -> Vec<f64>;

/// The graph of a function over a rectangle around the origin.
pub(super) struct Graph<'a> {
    half: [f64; 2],
    height: Height<'a>,
    /// Heights over a grid, row by row along x.
    table: Vec<f64>,
    frame: Frame,
    /// Largest area over that of the plane.
    most: f64,
}

impl<'a> Graph<'a> {
    pub(super) fn new(
        [width, depth]: [f64; 2],
        height: Height<'a>,
        vertices: usize,
    ) -> Result<Self, SheetError> {
        let half = [0.5 * width, 0.5 * depth];
        let table = heights(height, half)?;
        let [a, b] = half;
        let low = table.iter().copied().fold(f64::INFINITY, f64::min);
        let high = table.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let bounds = [Vec3::new(-a, -b, low), Vec3::new(a, b, high)];
        let frame = Frame::new(Vec::new(), 0.0, 1, bounds);
        let mut graph = Self { half, height, table, frame, most: 1.0 };
        let area = graph.measure()?;
        let sides = [0, 1, 2, 3].map(|k| Curve::new(|s| graph.on_side(k, s)));
        let perimeter = sides.iter().map(Curve::length).sum();
        let edge = edge_length(area, perimeter, 2.0, vertices);
        let narrow = sides.iter().map(Curve::length).fold(f64::INFINITY, f64::min);
        if narrow < real(FEWEST_ACROSS) * edge {
            return Err(too_narrow("the shortest side", narrow / edge, FEWEST_ACROSS, vertices));
        }
        graph.frame.edge = edge;
        graph.frame.fixed = graph.boundary(&sides);
        graph.frame.boundary = graph.frame.fixed.len();
        let inside = [0, 1, 2, 3].map(|k| graph.corner_vertex(k, &sides));
        graph.frame.fixed.extend(inside);
        Ok(graph)
    }

    /// (x, y) of a corner, counterclockwise.
    fn corner(&self, k: usize) -> [f64; 2] {
        let [a, b] = self.half;
        [[-a, -b], [a, -b], [a, b], [-a, b]][k % 4]
    }

    /// The point at the parameter `s`, 0 to 1, of the side that begins in corner `k`.
    fn on_side(&self, k: usize, s: f64) -> Vec3 {
        let ([x0, y0], [x1, y1]) = (self.corner(k), self.corner(k + 1));
        self.lift(x0 + s * (x1 - x0), y0 + s * (y1 - y0))
    }

    /// The vertices of the boundary: evenly spaced along each of the `sides`.
    fn boundary(&self, sides: &[Curve; 4]) -> Vec<Vec3> {
        let along = |(k, side): (usize, &Curve)| {
            let count = whole(side.length() / self.frame.edge);
            let parameter = |i| match i {
                0 => 0.0,
                _ => side.parameter_at(side.length() * real(i) / real(count)),
            };
            (0..count).map(|i| self.on_side(k, parameter(i))).collect::<Vec<_>>()
        };
        sides.iter().enumerate().flat_map(along).collect()
    }

    /// The cell of the table that holds (x, y), with the place in it.
    fn cell(&self, x: f64, y: f64) -> [(usize, f64); 2] {
        [(x, self.half[0]), (y, self.half[1])].map(|(x, half)| {
            let at = 0.5 * (x / half + 1.0) * real(INTERVALS);
            let cell = whole(at.floor()).min(INTERVALS - 1);
            (cell, (at - real(cell)).clamp(0.0, 1.0))
        })
    }

    /// Height at a node of the grid.
    fn height_at_node(&self, i: usize, j: usize) -> f64 {
        self.table[j * (INTERVALS + 1) + i]
    }

    /// The point over (x, y), from the table.
    fn lift(&self, x: f64, y: f64) -> Vec3 {
        let [(i, s), (j, t)] = self.cell(x, y);
        let row =
            |j: usize| (1.0 - s) * self.height_at_node(i, j) + s * self.height_at_node(i + 1, j);
        Vec3::new(x, y, (1.0 - t) * row(j) + t * row(j + 1))
    }

    /// The vertex inside corner `k`, between its `sides`.
    ///
    /// With an angle θ between the sides it is at 2 [`CORNER_OFFSET`] cos(θ/2) edges, as in a flat rectangle, but not nearer or
    /// farther than suits the two triangles there.
    fn corner_vertex(&self, k: usize, sides: &[Curve; 4]) -> Vec3 {
        let ([x, y], edge) = (self.corner(k), self.frame.edge);
        let (after, before) = (&sides[k], &sides[(k + 3) % 4]);
        let offset = CORNER_OFFSET * edge;
        let steps =
            [after.parameter_at(offset), 1.0 - before.parameter_at(before.length() - offset)];
        let [along_x, along_y] = if k.is_multiple_of(2) { steps } else { [steps[1], steps[0]] };
        let (dx, dy) = (-2.0 * x * along_x, -2.0 * y * along_y);
        let corner = self.lift(x, y);
        let along = [self.lift(x + dx, y), self.lift(x, y + dy)].map(|p| (p - corner).normalize());
        let distance = CORNER_OFFSET * (along[0] + along[1]).norm();
        let share = distance.clamp(CORNER_NEAREST, CORNER_FARTHEST) * edge
            / (self.lift(x + dx, y + dy) - corner).norm().max(f64::MIN_POSITIVE);
        self.lift(x + share * dx, y + share * dy)
    }

    /// Slopes along x and y.
    fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        let [(i, s), (j, t)] = self.cell(x, y);
        let along_x = |j: usize| self.height_at_node(i + 1, j) - self.height_at_node(i, j);
        let along_y = |i: usize| self.height_at_node(i, j + 1) - self.height_at_node(i, j);
        let step = self.half.map(|half| 2.0 * half / real(INTERVALS));
        [
            ((1.0 - t) * along_x(j) + t * along_x(j + 1)) / step[0],
            ((1.0 - s) * along_y(i) + s * along_y(i + 1)) / step[1],
        ]
    }

    /// The area by the midpoint rule; also keeps its largest density.
    fn measure(&mut self) -> Result<f64, SheetError> {
        let [a, b] = self.half;
        let mut sum = 0.0;
        for i in 0..INTERVALS {
            for j in 0..INTERVALS {
                let middle =
                    |k: usize, half: f64| half * ((2.0 * real(k) + 1.0) / real(INTERVALS) - 1.0);
                let (x, y) = (middle(i, a), middle(j, b));
                let [p, q] = self.slopes(x, y);
                let slope = p.hypot(q);
                if !(slope <= MAX_SLOPE) {
                    return Err(SheetError::Unusable(format!(
                        "z has the slope {} at x = {}, y = {}; slopes of at most {MAX_SLOPE} are meshed",
                        Short(slope),
                        Short(x),
                        Short(y)
                    )));
                }
                let density = (1.0 + slope * slope).sqrt();
                sum += density;
                self.most = self.most.max(density);
            }
        }
        Ok(4.0 * a * b * sum / real(INTERVALS * INTERVALS))
    }
}

/// Heights over a grid on the rectangle between -`half` and `half`, row by row along x.
fn heights(height: Height<'_>, half: [f64; 2]) -> Result<Vec<f64>, SheetError> {
    let along = |k: usize, half: f64| half * (2.0 * real(k) / real(INTERVALS) - 1.0);
    let all = 0..=INTERVALS;
    let row =
        |j: usize| all.clone().map(move |i| Vec3::new(along(i, half[0]), along(j, half[1]), 0.0));
    let grid: Vec<Vec3> = all.clone().flat_map(row).collect();
    let table = height(&grid);
    match grid.iter().zip(&table).find(|(_, z)| !z.is_finite()) {
        None => Ok(table),
        Some((p, z)) => Err(SheetError::Unusable(format!(
            "z = {} at x = {}, y = {}; heights must be finite",
            Short(*z),
            Short(p.x),
            Short(p.y)
        ))),
    }
}

impl Domain for Graph<'_> {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        let [x, y] = self.half.map(|half| half * (2.0 * rng.random::<f64>() - 1.0));
        let [p, q] = self.slopes(x, y);
        let kept = rng.random::<f64>() * self.most < (1.0 + p * p + q * q).sqrt();
        let point = Vec3::new(x, y, 0.0);
        let inside = self.constrain(point);
        (kept && inside.xy() == point.xy()).then_some(inside)
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        let [a, b] = self.half;
        let [p, q] = self.slopes(point.x.clamp(-a, a), point.y.clamp(-b, b));
        // A distance on the surface is longer than the one below it.
        let margin = |slope: f64| BOUNDARY_MARGIN * self.frame.edge / (1.0 + slope * slope).sqrt();
        let [a, b] = [a - margin(p), b - margin(q)];
        self.lift(point.x.clamp(-a, a), point.y.clamp(-b, b))
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        delaunay_in_space(points, delaunay(points))
    }

    fn place(&self, point: Vec3) -> Vec3 {
        let flat = Vec3::new(point.x, point.y, 0.0);
        Vec3::new(point.x, point.y, (self.height)(&[flat]).first().copied().unwrap_or(f64::NAN))
    }
}

/// A curve over 0 to 1 with its arc length.
struct Curve {
    /// Arc length at equal steps.
    length: Vec<f64>,
}

impl Curve {
    fn new(point: impl Fn(f64) -> Vec3) -> Self {
        let mut length = Vec::with_capacity(CURVE_INTERVALS + 1);
        let mut last = point(0.0);
        length.push(0.0);
        let mut sum = 0.0;
        for k in 1..=CURVE_INTERVALS {
            let next = point(real(k) / real(CURVE_INTERVALS));
            sum += (next - last).norm();
            length.push(sum);
            last = next;
        }
        Self { length }
    }

    fn length(&self) -> f64 {
        self.length[CURVE_INTERVALS]
    }

    /// The parameter at an arc length.
    fn parameter_at(&self, length: f64) -> f64 {
        let above = self.length.partition_point(|&l| l < length).clamp(1, CURVE_INTERVALS);
        let [low, high] = [self.length[above - 1], self.length[above]];
        (real(above - 1) + (length - low) / (high - low).max(f64::MIN_POSITIVE))
            / real(CURVE_INTERVALS)
    }
}

/// A rectangle bent along x.
pub(super) struct WavyStrip {
    flat: Planar,
    curve: Curve,
    width: f64,
    wave: [f64; 2],
}

impl WavyStrip {
    /// `width` along x below the strip, `height` along y, `amplitude` and `wavelength` of the wave.
    pub(super) fn new(
        [width, height]: [f64; 2],
        [amplitude, wavelength]: [f64; 2],
        vertices: usize,
    ) -> Result<Self, SheetError> {
        let wave = [amplitude, std::f64::consts::TAU / wavelength];
        // Triangles must follow the wave: at least as many of them as edges around a tube.
        let curve = Curve::new(|s| Self::point(width * (s - 0.5), wave));
        let flat = super::planar::rectangle(curve.length(), height, vertices)?;
        let per_wave = wavelength * curve.length() / width / flat.frame().edge;
        if per_wave < 8.0 {
            return Err(too_narrow("a wave", per_wave, 8, vertices));
        }
        Ok(Self { flat, curve, width, wave })
    }

    fn point(x: f64, [amplitude, number]: [f64; 2]) -> Vec3 {
        Vec3::new(x, 0.0, amplitude * (number * x).sin())
    }
}

impl Domain for WavyStrip {
    fn frame(&self) -> &Frame {
        self.flat.frame()
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        self.flat.sample(rng)
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        self.flat.constrain(point)
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        self.flat.triangles(points)
    }

    fn place(&self, point: Vec3) -> Vec3 {
        let s = self.curve.parameter_at(point.x + 0.5 * self.curve.length());
        let bent = Self::point(self.width * (s - 0.5), self.wave);
        Vec3::new(bent.x, point.y, bent.z)
    }
}
