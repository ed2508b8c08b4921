//! Rest positions, triangles and everything that follows from them once and for all.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use super::surface::Attributes;
use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real};
use rumple_numerics::parallel::element_blocks::ElementBlocks;
use rumple_numerics::reduction::Reduction;

/// Why a sheet was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SheetError {
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {vertices} vertices")]
    VertexOutOfRange {
        /// Number of the triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u64,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A triangle uses one vertex twice.
    #[error("triangle {triangle} uses vertex {vertex} twice")]
    RepeatedVertex {
        /// Number of the triangle, from 0.
        triangle: usize,
        /// The vertex it repeats.
        vertex: u32,
    },
    /// An edge belongs to more than two triangles, or two neighbours disagree on orientation.
    #[error("{what} at the edge between vertices {a} and {b} (triangles {triangles:?})")]
    BadEdge {
        /// "more than two triangles" or "neighbouring triangles are oriented against each other".
        what: &'static str,
        /// First vertex of the edge.
        a: u32,
        /// Second vertex of the edge.
        b: u32,
        /// Triangles that share the edge.
        triangles: Vec<u32>,
    },
    /// Anything else that makes a mesh unusable, with its place.
    #[error("{0}")]
    Unusable(String),
    /// A mesh file could not be read; the message names the line where there is one.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
}

/// An edge (a bond of the paper) with the one or two triangles that share it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// End vertices, the smaller number first.
    pub vertices: [u32; 2],
    /// Sharing triangles; the second is [`Edge::NONE`] on the boundary.
    pub triangles: [u32; 2],
}

impl Edge {
    /// Stands for "no triangle".
    pub const NONE: u32 = u32::MAX;

    /// Whether only one triangle has this edge.
    #[must_use]
    #[inline]
    pub fn is_boundary(&self) -> bool {
        self.triangles[1] == Self::NONE
    }
}

/// For every vertex a short list of (entity, local index) pairs, in one array.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Incidence {
    start: Vec<u32>,
    entry: Vec<(u32, u32)>,
}

impl Incidence {
    /// Collects `(vertex, entity, local)` triples; the entries of a vertex keep their order.
    pub fn new(vertices: usize, triples: impl Iterator<Item = (u32, u32, u32)> + Clone) -> Self {
        let mut start = vec![0u32; vertices + 1];
        for (v, _, _) in triples.clone() {
            start[v as usize + 1] += 1;
        }
        for i in 0..vertices {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut entry = vec![(0, 0); start[vertices] as usize];
        for (v, entity, local) in triples {
            let place = &mut next[v as usize];
            entry[*place as usize] = (entity, local);
            *place += 1;
        }
        Self { start, entry }
    }

    /// The entries of `vertex`.
    #[must_use]
    #[inline]
    pub fn entries(&self, vertex: usize) -> &[(u32, u32)] {
        &self.entry[self.start[vertex] as usize..self.start[vertex + 1] as usize]
    }
}

/// What a part of a sheet knows of the whole.
#[derive(Debug, Clone)]
pub(crate) struct Share {
    /// Vertices that the part owns, which come first, and ghosts of lower ranks, which follow.
    pub(crate) owned: usize,
    pub(crate) before: usize,
    /// Ghosts are images of the part's own vertices.
    pub(crate) periodic: bool,
    /// Of the parts together it is that of the whole.
    pub(crate) euler: i64,
    /// The numbers of the vertices and triangles in the whole, and how many of each that has.
    pub(crate) numbers: Arc<Vec<u32>>,
    pub(crate) triangle_numbers: Arc<Vec<u32>>,
    pub(crate) whole: [usize; 2],
}

/// A triangulated sheet in its rest state: an oriented manifold with or without a boundary.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    rest: Arc<Vec<Vec3>>,
    triangles: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    triangle_edges: Vec<[u32; 3]>,
    vertex_edges: Incidence,
    boundary: Vec<bool>,
    reduction: Reduction,
    share: Option<Share>,
    attributes: Option<Arc<Attributes>>,
    places: Option<Arc<Vec<Vec3>>>,
    // Made when they are first asked for: chemistry on a still shape needs none of them.
    vertex_triangles: OnceLock<Incidence>,
    edge_blocks: OnceLock<ElementBlocks<2>>,
    triangle_blocks: OnceLock<ElementBlocks<3>>,
    distances: [OnceLock<Vec<f64>>; 2],
}

/// The same vertices and triangles: all else follows from them.
impl PartialEq for Sheet {
    fn eq(&self, other: &Self) -> bool {
        self.rest == other.rest && self.triangles == other.triangles
    }
}

impl Sheet {
    /// Builds the topology of an oriented triangle mesh.
    ///
    /// Edges are numbered by their (smaller, larger) vertex pair in ascending order, so the
    /// numbering depends on nothing but the triangles.
    ///
    /// # Errors
    /// Vertices out of range or repeated in a triangle, edges with more than two triangles, and
    /// neighbours of opposite orientation. (Zero areas, duplicates and the like are the business
    /// of the mesh checks.)
    pub fn new(rest: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, SheetError> {
        let n = rest.len();
        if n >= u32::MAX as usize || triangles.len() >= (u32::MAX / 3) as usize {
            return Err(SheetError::Unusable(format!("too large a mesh: {n} vertices")));
        }
        for (t, triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                let v = triangle[k];
                if v as usize >= n {
                    return Err(SheetError::VertexOutOfRange {
                        triangle: t,
                        vertex: u64::from(v),
                        vertices: n,
                    });
                }
                if v == triangle[(k + 1) % 3] {
                    return Err(SheetError::RepeatedVertex { triangle: t, vertex: v });
                }
            }
        }
        let (edges, triangle_edges) = edges_of(&triangles)?;
        let vertex_edges = Incidence::new(
            n,
            edges.iter().enumerate().flat_map(|(e, edge)| {
                let [a, b] = edge.vertices;
                [(a, index(e), b), (b, index(e), a)]
            }),
        );
        let mut boundary = vec![false; n];
        for edge in edges.iter().filter(|e| e.is_boundary()) {
            boundary[edge.vertices[0] as usize] = true;
            boundary[edge.vertices[1] as usize] = true;
        }
        Ok(Self {
            rest: Arc::new(rest),
            triangles,
            edges,
            triangle_edges,
            vertex_edges,
            reduction: Reduction::default(),
            share: None,
            attributes: None,
            places: None,
            boundary,
            vertex_triangles: OnceLock::new(),
            edge_blocks: OnceLock::new(),
            triangle_blocks: OnceLock::new(),
            distances: Default::default(),
        })
    }

    /// Number of vertices.
    #[must_use]
    #[inline]
    pub fn vertex_count(&self) -> usize {
        self.rest.len()
    }

    /// Number of triangles.
    #[must_use]
    #[inline]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Rest positions `X_i`.
    #[must_use]
    #[inline]
    pub fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    /// The same sheet, as a part of one that is spread over several ranks.
    #[must_use]
    pub(crate) fn reduced_by(self, reduction: Reduction) -> Self {
        Self { reduction, ..self }
    }

    /// The same sheet, as a part; `boundary` is that of the whole sheet.
    pub(crate) fn part(self, boundary: Vec<bool>, share: Share) -> Self {
        Self { boundary, share: Some(share), ..self }
    }

    /// The same sheet, with the places of its vertices for fields and regions.
    pub(crate) fn placed(self, places: Vec<Vec3>) -> Self {
        Self { places: Some(Arc::new(places)), ..self }
    }

    /// The same sheet with the arrays of its mesh file.
    pub(crate) fn with_attributes(self, attributes: Option<Arc<Attributes>>) -> Self {
        Self { attributes, ..self }
    }

    /// The arrays of its mesh file.
    pub(crate) fn attributes(&self) -> Option<&Arc<Attributes>> {
        self.attributes.as_ref()
    }

    /// The number of vertex `i` in the sheet that this is a part of; `i` of a whole one.
    #[must_use]
    pub fn number(&self, i: usize) -> u32 {
        self.share.as_ref().map_or(index(i), |share| share.numbers[i])
    }

    /// The number of triangle `t` in the sheet that this is a part of; `t` of a whole one.
    #[must_use]
    pub fn triangle_number(&self, t: usize) -> u32 {
        self.share.as_ref().map_or(index(t), |share| share.triangle_numbers[t])
    }

    /// How many vertices and triangles the sheet has that this is a part of.
    #[must_use]
    pub fn counts_of_whole(&self) -> [usize; 2] {
        let own = [self.vertex_count(), self.triangle_count()];
        self.share.as_ref().map_or(own, |share| share.whole)
    }

    /// Whether an element with these corners is counted here, in sums over the whole sheet: each is by one rank, and of its
    /// images the one whose corner with the lowest number is owned.
    #[must_use]
    #[inline]
    pub fn counts(&self, corners: &[u32]) -> bool {
        self.share.as_ref().is_none_or(|&Share { owned, before, periodic, ref numbers, .. }| {
            if periodic {
                let lowest = corners.iter().min_by_key(|v| numbers[**v as usize]);
                return lowest.is_some_and(|v| (*v as usize) < owned);
            }
            let is_lower = |v: &u32| (owned..owned + before).contains(&(*v as usize));
            corners.iter().any(|v| (*v as usize) < owned) && !corners.iter().any(is_lower)
        })
    }

    /// What sums, maxima and decisions over the whole sheet are taken over.
    #[must_use]
    #[inline]
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// Where fields and regions look a vertex up: its rest position, of an image that of its owner.
    #[must_use]
    pub fn places(&self) -> &[Vec3] {
        self.places.as_deref().map_or(&self.rest, Vec::as_slice)
    }

    /// Where fields and regions look the centroid of every triangle up, at rest.
    #[must_use]
    pub fn triangle_places(&self) -> Vec<Vec3> {
        self.triangles.iter().map(|corners| self.place_of(corners)).collect()
    }

    /// Where fields and regions look up the middle of an element with these corners, at rest: images of one element have one
    /// place.
    #[must_use]
    pub fn place_of(&self, corners: &[u32]) -> Vec3 {
        let sum: Vec3 = corners.iter().map(|v| self.rest[*v as usize]).sum();
        self.reduction.nearest_image(sum / real(corners.len()))
    }

    /// The same, shared.
    #[must_use]
    pub fn shared_rest(&self) -> &Arc<Vec<Vec3>> {
        &self.rest
    }

    /// Vertices of every triangle, counter-clockwise seen from the side the normal points to.
    #[must_use]
    #[inline]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The edges, sorted by their vertex pair.
    #[must_use]
    #[inline]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// For every triangle the edge opposite each of its corners.
    #[must_use]
    #[inline]
    pub fn triangle_edges(&self) -> &[[u32; 3]] {
        &self.triangle_edges
    }

    /// For every vertex its `(triangle, corner)` pairs, by ascending triangle.
    #[must_use]
    #[inline]
    pub fn vertex_triangles(&self) -> &Incidence {
        self.vertex_triangles.get_or_init(|| {
            let corners = |(t, tri): (usize, &[u32; 3])| {
                let tri = *tri;
                (0u32..3).map(move |k| (tri[k as usize], index(t), k))
            };
            Incidence::new(self.rest.len(), self.triangles.iter().enumerate().flat_map(corners))
        })
    }

    /// For every vertex its `(edge, other end)` pairs, by ascending edge.
    #[must_use]
    #[inline]
    pub fn vertex_edges(&self) -> &Incidence {
        &self.vertex_edges
    }

    /// For every vertex whether it lies on the boundary.
    #[must_use]
    #[inline]
    pub fn boundary(&self) -> &[bool] {
        &self.boundary
    }

    /// The edges, for sums over edges that end up at vertices.
    #[must_use]
    #[inline]
    pub fn edge_blocks(&self) -> &ElementBlocks<2> {
        self.edge_blocks.get_or_init(|| {
            let ends: Vec<_> = self.edges.iter().map(|e| e.vertices).collect();
            ElementBlocks::new(self.vertex_count(), &ends, |ends| self.counts(ends))
        })
    }

    /// The triangles, for sums over triangles that end up at vertices.
    #[must_use]
    #[inline]
    pub fn triangle_blocks(&self) -> &ElementBlocks<3> {
        let counts = |corners: &[u32; 3]| self.counts(corners);
        self.triangle_blocks
            .get_or_init(|| ElementBlocks::new(self.vertex_count(), &self.triangles, counts))
    }

    /// Whether it is a part that does not know the others.
    pub(crate) fn is_lone_part(&self) -> bool {
        self.share.is_some() && self.reduction.distribution().is_none()
    }

    /// The distances to the boundary of vertices or triangles, by `make` when they are first asked for.
    pub(crate) fn stored_distances(
        &self,
        on_triangles: bool,
        make: impl FnOnce() -> Vec<f64>,
    ) -> &[f64] {
        self.distances[usize::from(on_triangles)].get_or_init(make)
    }

    /// Euler characteristic χ = vertices - edges + triangles; of a part of a sheet its share of that.
    #[must_use]
    pub fn euler_characteristic(&self) -> i64 {
        if let Some(share) = &self.share {
            return share.euler;
        }
        let size = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        size(self.rest.len()) - size(self.edges.len()) + size(self.triangles.len())
    }
}

/// Sorts the half-edges and pairs them up.
fn edges_of(triangles: &[[u32; 3]]) -> Result<(Vec<Edge>, Vec<[u32; 3]>), SheetError> {
    // (smaller vertex, larger vertex, triangle, opposite corner, runs from smaller to larger)
    let mut half: Vec<(u32, u32, u32, usize, bool)> = Vec::with_capacity(3 * triangles.len());
    for (t, tri) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (tri[(k + 1) % 3], tri[(k + 2) % 3]);
            half.push((a.min(b), a.max(b), index(t), k, a < b));
        }
    }
    half.sort_unstable();
    let mut edges = Vec::with_capacity(half.len() / 2 + half.len() / 16);
    let mut triangle_edges = vec![[0u32; 3]; triangles.len()];
    for group in half.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
        let (a, b, first, _, forward) = group[0];
        let bad = |what| SheetError::BadEdge {
            what,
            a,
            b,
            triangles: group.iter().map(|h| h.2).collect(),
        };
        if group.len() > 2 {
            return Err(bad("more than two triangles"));
        }
        if group.len() == 2 && group[1].4 == forward {
            return Err(bad("neighbouring triangles are oriented against each other"));
        }
        for h in group {
            triangle_edges[h.2 as usize][h.3] = index(edges.len());
        }
        let second = group.get(1).map_or(Edge::NONE, |h| h.2);
        edges.push(Edge { vertices: [a, b], triangles: [first, second] });
    }
    edges.shrink_to_fit();
    Ok((edges, triangle_edges))
}
