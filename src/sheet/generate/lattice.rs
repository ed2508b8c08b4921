//! A rectangle of equilateral triangles: points and triangles by their numbers, so that a part of the sheet is made
//! without the rest.
//!
//! ```text
//! rows 0, 2, …    ·   ·   ·   ·       n + 1 points, a = width/n apart
//! rows 1, 3, …    · ·   ·   · ·       n + 2 points, shifted by a/2 between the straight sides
//! ```
//!
//! The first and the last row are even. Vertices are numbered along x, row by row from the lowest; so are triangles, of
//! which there are 2n + 1 between two rows. Between ranks the rows and columns are bisected, the longer extent first, in
//! proportion to the ranks on either side.

use std::ops::Range;
use std::sync::Arc;

use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real, whole};

use super::density::edge_length;
use super::irregular::too_narrow;
use super::planar::FEWEST_ACROSS;
use crate::topology::Share;
use crate::{Sheet, SheetError};

/// Rings of neighbours around what a rank owns that a patch has: two of ghosts, and one that completes the triangles
/// around these.
const PATCH_RINGS: usize = 3;

/// The points of a part of the lattice: rows, and places in them; the last place of an odd row goes with the one before.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Block {
    rows: Range<usize>,
    columns: Range<usize>,
}

/// A part of a lattice around what a rank owns.
pub struct Patch {
    /// The points that the rank owns with three rings of neighbours, and the triangles between them; it knows their
    /// numbers and which vertices lie on the boundary.
    pub sheet: Sheet,
    /// The rank of every vertex of it.
    pub owners: Vec<u32>,
}

/// A rectangle around the origin in z = 0 of rows of nearly equilateral triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    size: [f64; 2],
    /// Intervals of an even row.
    intervals: usize,
    /// Rows of points, an odd number.
    rows: usize,
}

impl Lattice {
    /// Of about `vertices` points in a rectangle of `size` along x and y.
    ///
    /// # Errors
    /// Sizes and numbers of vertices that no generator takes; sides of less than four edges.
    pub fn new(size: [f64; 2], vertices: usize) -> Result<Self, SheetError> {
        let [width, height] = size;
        super::irregular::check(&[("width", width), ("height", height)], vertices)?;
        let edge = edge_length(width * height, 2.0 * (width + height), 2.0, vertices);
        let short = width.min(height);
        if short < real(FEWEST_ACROSS) * edge {
            return Err(too_narrow("the shorter side", short / edge, FEWEST_ACROSS, vertices));
        }
        let pairs = whole((height / (3f64.sqrt() * edge)).round());
        Ok(Self { size, intervals: whole((width / edge).round()), rows: 2 * pairs + 1 })
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.before_row(self.rows)
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        (self.rows - 1) * self.strip()
    }

    /// The rest positions of all vertices, by number.
    pub fn points(&self) -> impl Iterator<Item = Vec3> {
        (0..self.rows).flat_map(move |row| (0..self.places(row)).map(move |i| self.point(row, i)))
    }

    /// The vertices of all triangles, by number.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        let strip = self.strip();
        let of = move |row| (0..strip).map(move |k| self.corners(row, k));
        (0..self.rows - 1)
            .flat_map(of)
            .map(move |corners| corners.map(|[row, i]| index(self.before_row(row) + i)))
    }

    /// The whole lattice as a sheet.
    ///
    /// # Errors
    /// As for [`Sheet::new`].
    pub fn sheet(&self) -> Result<Sheet, SheetError> {
        Sheet::new(self.points().collect(), self.triangles().collect())
    }

    /// What rank `rank` of `ranks` makes of the lattice.
    ///
    /// # Errors
    /// Fewer points in a direction than ranks.
    pub fn patch(&self, rank: usize, ranks: usize) -> Result<Patch, SheetError> {
        let all = self.all();
        let fits = |k: usize| !self.block(k, ranks).is_empty();
        if !(0..ranks).all(fits) {
            let vertices = self.vertex_count();
            let message = format!("{vertices} vertices cannot be spread over {ranks} ranks");
            return Err(SheetError::Unusable(message));
        }
        let around = self.block(rank, ranks).grown(PATCH_RINGS, &all);
        let mut places = Vec::new();
        for row in around.rows.clone() {
            let end = around.columns.end
                + usize::from(around.columns.end == all.columns.end && row % 2 == 1);
            places.extend((around.columns.start..end).map(|i| [row, i]));
        }
        let numbers: Vec<u32> =
            places.iter().map(|&[row, i]| index(self.before_row(row) + i)).collect();
        let (triangles, triangle_numbers) = self.triangles_among(&numbers, &around);
        let points = places.iter().map(|&[row, i]| self.point(row, i)).collect();
        let boundary = places.iter().map(|&[row, i]| self.is_boundary(row, i)).collect();
        let owners = places.iter().map(|&place| index(self.owner(place, ranks))).collect();
        let share = Share {
            owned: numbers.len(),
            before: 0,
            periodic: false,
            euler: 1,
            numbers: Arc::new(numbers),
            triangle_numbers: Arc::new(triangle_numbers),
            whole: [self.vertex_count(), self.triangle_count()],
        };
        Ok(Patch { sheet: Sheet::new(points, triangles)?.part(boundary, share), owners })
    }

    /// The triangles between the vertices with these numbers, ascending, and their own numbers.
    fn triangles_among(&self, numbers: &[u32], around: &Block) -> (Vec<[u32; 3]>, Vec<u32>) {
        let (mut triangles, mut own) = (Vec::new(), Vec::new());
        let (first, end) = (around.columns.start.saturating_sub(1), around.columns.end + 1);
        for row in around.rows.start..(around.rows.end - 1) {
            // Two triangles a place, one after the other.
            for k in 2 * first..(2 * end + 1).min(self.strip()) {
                let corners = self.corners(row, k);
                let local =
                    corners.map(|[row, i]| numbers.binary_search(&index(self.before_row(row) + i)));
                if let [Ok(a), Ok(b), Ok(c)] = local {
                    triangles.push([a, b, c].map(index));
                    own.push(index(row * self.strip() + k));
                }
            }
        }
        (triangles, own)
    }

    fn strip(&self) -> usize {
        2 * self.intervals + 1
    }

    fn places(&self, row: usize) -> usize {
        self.intervals + 1 + row % 2
    }

    fn before_row(&self, row: usize) -> usize {
        row * (self.intervals + 1) + row / 2
    }

    fn point(&self, row: usize, i: usize) -> Vec3 {
        let n = real(self.intervals);
        let x = if row.is_multiple_of(2) { real(i) } else { (real(i) - 0.5).clamp(0.0, n) };
        let [width, height] = self.size;
        let y = real(row) / real(self.rows - 1);
        Vec3::new(width * (x / n - 0.5), height * (y - 0.5), 0.0)
    }

    fn is_boundary(&self, row: usize, i: usize) -> bool {
        row == 0 || row == self.rows - 1 || i == 0 || i == self.places(row) - 1
    }

    /// Rows and places of the corners of triangle `k` between `row` and the next, counter-clockwise, the lowest number
    /// first.
    fn corners(&self, row: usize, k: usize) -> [[usize; 2]; 3] {
        let (i, above) = (k / 2, row + 1);
        match (row % 2, k % 2) {
            (0, 0) => [[row, i], [above, i + 1], [above, i]],
            (0, _) => [[row, i], [row, i + 1], [above, i + 1]],
            (_, 0) => [[row, i], [row, i + 1], [above, i]],
            (_, _) => [[row, i + 1], [above, i + 1], [above, i]],
        }
    }

    fn all(&self) -> Block {
        Block { rows: 0..self.rows, columns: 0..self.intervals + 1 }
    }

    /// What a rank owns.
    fn block(&self, rank: usize, ranks: usize) -> Block {
        let (mut block, mut first, mut ranks) = (self.all(), 0, ranks);
        while ranks > 1 {
            let (low, high) = block.halves(ranks);
            (block, first, ranks) = match rank < first + ranks / 2 {
                true => (low, first, ranks / 2),
                false => (high, first + ranks / 2, ranks - ranks / 2),
            };
        }
        block
    }

    /// The rank that owns a point.
    fn owner(&self, [row, i]: [usize; 2], ranks: usize) -> usize {
        let place = [row, i.min(self.intervals)];
        let (mut block, mut first, mut ranks) = (self.all(), 0, ranks);
        while ranks > 1 {
            let (low, high) = block.halves(ranks);
            (block, first, ranks) = match low.contains(place) {
                true => (low, first, ranks / 2),
                false => (high, first + ranks / 2, ranks - ranks / 2),
            };
        }
        first
    }
}

impl Block {
    fn is_empty(&self) -> bool {
        self.rows.is_empty() || self.columns.is_empty()
    }

    fn contains(&self, [row, i]: [usize; 2]) -> bool {
        self.rows.contains(&row) && self.columns.contains(&i)
    }

    /// The parts of the first half of `ranks` and of the others.
    fn halves(&self, ranks: usize) -> (Self, Self) {
        let cut = |range: &Range<usize>| range.start + range.len() * (ranks / 2) / ranks;
        let (mut low, mut high) = (self.clone(), self.clone());
        // Rows are √3/2 edges apart.
        if real(self.columns.len()) >= 0.866 * real(self.rows.len()) {
            let at = cut(&self.columns);
            (low.columns.end, high.columns.start) = (at, at);
        } else {
            let at = cut(&self.rows);
            (low.rows.end, high.rows.start) = (at, at);
        }
        (low, high)
    }

    /// With `rings` more rows and columns on each side, within `all`.
    fn grown(&self, rings: usize, all: &Self) -> Self {
        let grown = |range: &Range<usize>, all: &Range<usize>| {
            range.start.saturating_sub(rings)..(range.end + rings).min(all.end)
        };
        Self { rows: grown(&self.rows, &all.rows), columns: grown(&self.columns, &all.columns) }
    }
}
