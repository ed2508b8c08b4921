//! Outlines of a polygon: their validity, and where a point lies with respect to them.

use crate::SheetError;
use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real, whole};

/// Largest coordinate: areas stay far from overflow.
const LARGEST: f64 = 1e100;

/// Signed area of a ring in z = 0, positive where it runs counter-clockwise.
pub(super) fn area(ring: &[Vec3]) -> f64 {
    let twice = |k: usize| (ring[k] - ring[0]).cross(&(ring[(k + 1) % ring.len()] - ring[0])).z;
    0.5 * (0..ring.len()).map(twice).sum::<f64>()
}

/// The outline, counter-clockwise, and the holes after it, clockwise; a last point equal to the first is left out. Errors call
/// a ring by its `name`.
///
/// # Errors
/// Rings of fewer than three points or with a point twice in a row, crossings, and holes outside the outline or in one
/// another, with the points.
pub(crate) fn rings<'a>(
    given: impl Iterator<Item = &'a [[f64; 2]]>,
    name: &dyn Fn(usize) -> String,
) -> Result<Vec<Vec<Vec3>>, SheetError> {
    let mut rings = Vec::new();
    for (k, given) in given.enumerate() {
        let mut ring: Vec<Vec3> = given.iter().map(|[x, y]| Vec3::new(*x, *y, 0.0)).collect();
        if ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        let refuse = |what: String| Err(SheetError::Unusable(format!("{} {what}", name(k))));
        if ring.len() < 3 {
            return refuse(format!("has {} points; at least 3 are needed", ring.len()));
        }
        let next = |i: usize| (i + 1) % ring.len();
        if let Some(i) = (0..ring.len()).find(|&i| ring[i] == ring[next(i)]) {
            return refuse(format!("has the point ({}, {}) twice in a row", ring[i].x, ring[i].y));
        }
        if let Some(p) = ring.iter().find(|p| !(p.amax() <= LARGEST)) {
            return refuse(format!("has the point ({}, {}), beyond {LARGEST:e}", p.x, p.y));
        }
        rings.push(ring);
    }
    check_crossings(&rings, name)?;
    for (k, ring) in rings.iter().enumerate().skip(1) {
        let outside = !encloses(&rings[0], ring[0]);
        let other = (1..rings.len()).find(|&j| j != k && encloses(&rings[j], ring[0]));
        let inside = other.map(|j| format!("inside {}", name(j)));
        if let Some(place) = outside.then(|| "outside the outline".to_owned()).or(inside) {
            let (hole, [x, y]) = (name(k), [ring[0].x, ring[0].y]);
            return Err(SheetError::Unusable(format!("{hole} lies {place}, at ({x}, {y})")));
        }
    }
    for (k, ring) in rings.iter_mut().enumerate() {
        if (area(ring) > 0.0) != (k == 0) {
            ring.reverse();
        }
    }
    Ok(rings)
}

/// Refuses two sides that have a point in common, but for the end of neighbours.
fn check_crossings(rings: &[Vec<Vec3>], name: &dyn Fn(usize) -> String) -> Result<(), SheetError> {
    let side = |k: usize, i: usize| [rings[k][i], rings[k][(i + 1) % rings[k].len()]];
    let all = || (0..rings.len()).flat_map(|k| (0..rings[k].len()).map(move |i| (k, i)));
    for (first, (k, i)) in all().enumerate() {
        let n = rings[k].len();
        for (j, m) in all().skip(first + 1) {
            let neighbours = j == k && (m == (i + 1) % n || i == (m + 1) % n);
            if !neighbours && meet(side(k, i), side(j, m)) {
                let [a, b] = side(k, i);
                return Err(SheetError::Unusable(format!(
                    "the outline crosses itself: the side of {} from ({}, {}) to ({}, {}) meets side {m} of {}",
                    name(k),
                    a.x,
                    a.y,
                    b.x,
                    b.y,
                    name(j)
                )));
            }
        }
    }
    Ok(())
}

/// Whether two segments have a point in common.
fn meet([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> bool {
    let apart = |k: usize| a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]);
    let side = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(&(r - p)).z;
    let opposite = |s: f64, t: f64| !(s > 0.0 && t > 0.0 || s < 0.0 && t < 0.0);
    !apart(0)
        && !apart(1)
        && opposite(side(a, b, c), side(a, b, d))
        && opposite(side(c, d, a), side(c, d, b))
}

/// Whether a ring goes around a point: by the sides that a ray along x crosses.
fn encloses(ring: &[Vec3], p: Vec3) -> bool {
    let n = ring.len();
    odd_crossings((0..n).map(|i| [ring[i], ring[(i + 1) % n]]), p)
}

fn odd_crossings(segments: impl Iterator<Item = [Vec3; 2]>, p: Vec3) -> bool {
    let crosses = |[a, b]: &[Vec3; 2]| {
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    segments.filter(crosses).count() % 2 == 1
}

/// Cells of a grid for every vertex: how many segments are near is known by cell.
const CELLS_PER_VERTEX: f64 = 4.0;

/// Share of the margin by which a point may miss it: that of round-off.
const ROUNDING: f64 = 1e-9;

/// Boundary edges, by cells of a grid.
#[derive(Default)]
pub(super) struct Outline {
    segments: Vec<[Vec3; 2]>,
    margin: f64,
    low: Vec3,
    high: Vec3,
    side: f64,
    columns: usize,
    /// Segments no further than the margin from a cell; of cells without any, whether they lie inside.
    cells: Vec<(Vec<u32>, bool)>,
}

impl Outline {
    /// Free points keep `margin` from the segments, which have the inside on their left.
    pub(super) fn new(segments: Vec<[Vec3; 2]>, margin: f64, vertices: usize) -> Self {
        let first = segments.first().map_or(Vec3::zeros(), |ends| ends[0]);
        let ends = || segments.iter().flatten();
        let low = ends().fold(first, |low, p| low.inf(p));
        let high = ends().fold(first, |high, p| high.sup(p));
        let size = high - low;
        let side =
            (2.0 * margin).max((size.x * size.y / (CELLS_PER_VERTEX * real(vertices))).sqrt());
        let count = |extent: f64| whole((extent / side).floor()) + 1;
        let (columns, rows) = (count(size.x), count(size.y));
        let mut outline = Self { segments, margin, low, high, side, columns, cells: Vec::new() };
        outline.cells = vec![(Vec::new(), false); columns * rows];
        for (k, [a, b]) in outline.segments.iter().enumerate() {
            let cell = |x: f64, axis: usize, count: usize| {
                whole(((x - low[axis]) / side).floor().max(0.0)).min(count - 1)
            };
            let range = |axis: usize, count: usize| {
                let (least, most) = (a[axis].min(b[axis]), a[axis].max(b[axis]));
                cell(least - margin, axis, count)..=cell(most + margin, axis, count)
            };
            for row in range(1, rows) {
                for column in range(0, columns) {
                    outline.cells[row * columns + column].0.push(index(k));
                }
            }
        }
        for k in 0..outline.cells.len() {
            let at = |i: usize, axis: usize| low[axis] + side * (real(i) + 0.5);
            let centre = Vec3::new(at(k % columns, 0), at(k / columns, 1), 0.0);
            outline.cells[k].1 = outline.cells[k].0.is_empty() && outline.has(centre);
        }
        outline
    }

    /// Corners of a box around it.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        [self.low, self.high]
    }

    /// Whether a point lies inside.
    pub(super) fn has(&self, p: Vec3) -> bool {
        odd_crossings(self.segments.iter().copied(), p)
    }

    /// Where a point that is outside, or nearer to the nearest segment than the margin, is moved to; `None` for others.
    pub(super) fn corrected(&self, p: Vec3) -> Option<Vec3> {
        let at = (p - self.low).sup(&Vec3::zeros()) / self.side;
        let rows = self.cells.len() / self.columns;
        let [column, row] =
            [(at.x, self.columns), (at.y, rows)].map(|(x, n)| whole(x.floor()).min(n - 1));
        let (near, inside) = &self.cells[row * self.columns + column];
        if *inside {
            return None;
        }
        let near = near.iter().map(|&k| self.segments[k as usize]);
        let feet = near.map(|[a, b]| {
            let along = b - a;
            let foot = a + along * ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (foot, Vec3::new(-along.y, along.x, 0.0), (p - foot).norm())
        });
        let nearest = feet.min_by(|a, b| a.2.total_cmp(&b.2));
        let (foot, normal, distance) =
            nearest.unwrap_or((self.segments[0][0], Vec3::x(), f64::INFINITY));
        let inside = self.has(p);
        if inside && distance >= (1.0 - ROUNDING) * self.margin {
            return None;
        }
        let away = if inside { p - foot } else { foot - p };
        let direction = away.try_normalize(0.0).unwrap_or(normal.normalize());
        Some(foot + direction * self.margin)
    }
}
