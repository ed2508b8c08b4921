//! Whether triangles hang together as one oriented manifold.

use rumple_numerics::Vec3;
use rumple_numerics::num::real;

use super::graph::{DisjointSets, Edges};
use super::{Fault, Findings, MAX_PLACES};

/// Enclosed volume over the sum of its parts' absolute values, below which the sign is one of round-off.
const FLAT_VOLUME_SHARE: f64 = 1e-9;

impl Findings<'_> {
    /// Edges with more than two triangles; false if there are any.
    pub(super) fn edges(&mut self, edges: &Edges) -> bool {
        let bad: Vec<_> = edges.groups().filter(|group| group.len() > 2).collect();
        let places: Vec<_> = bad
            .iter()
            .take(MAX_PLACES)
            .map(|group| {
                let (a, b) = (group[0].low as usize, group[0].high as usize);
                let sharing: Vec<_> =
                    group.iter().take(MAX_PLACES).map(|h| self.triangle(h.triangle)).collect();
                format!(
                    "between {} and {} in {}",
                    self.vertex(a),
                    self.vertex(b),
                    sharing.join(", ")
                )
            })
            .collect();
        self.report(
            Fault::NonManifoldEdge,
            "an edge belongs to more than two triangles",
            bad.len(),
            places.into_iter(),
        );
        bad.is_empty()
    }

    /// Vertices where several fans of triangles meet.
    pub(super) fn fans(&mut self, edges: &Edges) {
        let triangles = &self.surface.triangles;
        let corner = |t: usize, v: u32| {
            3 * t + triangles[t].iter().position(|&w| w == v).unwrap_or_default()
        };
        let mut fan = DisjointSets::new(3 * triangles.len());
        for group in edges.groups() {
            if let [one, other] = group {
                for v in [one.low, one.high] {
                    fan.join(corner(one.triangle, v), corner(other.triangle, v));
                }
            }
        }
        let mut fans = vec![0usize; self.surface.points.len()];
        for (t, tri) in triangles.iter().enumerate() {
            for (k, &v) in tri.iter().enumerate() {
                fans[v as usize] += usize::from(fan.root(3 * t + k) == 3 * t + k);
            }
        }
        let bow_ties: Vec<_> = (0..fans.len()).filter(|&v| fans[v] > 1).collect();
        self.vertices(
            Fault::NonManifoldVertex,
            "parts of the mesh meet in a single vertex only (bow tie)",
            &bow_ties,
        );
    }

    /// Turns triangles until neighbours agree; whether that is possible.
    pub(super) fn orient(&mut self, edges: &Edges, triangles: &mut [[u32; 3]]) -> bool {
        let neighbours = neighbours(edges, triangles.len());
        let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
        let mut twisted = Vec::new();
        for start in 0..triangles.len() {
            if turned[start].is_some() {
                continue;
            }
            turned[start] = Some(false);
            let mut piece = vec![start];
            let mut next = 0;
            while next < piece.len() {
                let t = piece[next];
                next += 1;
                let own = turned[t] == Some(true);
                for (other, agree) in neighbours[t].into_iter().flatten() {
                    match turned[other] {
                        None => {
                            turned[other] = Some(own == agree);
                            piece.push(other);
                        }
                        Some(side) if side != (own == agree) => twisted.push(t.max(other)),
                        Some(_) => {}
                    }
                }
            }
            let many = piece.iter().filter(|&&t| turned[t] == Some(true)).count();
            if 2 * many > piece.len() {
                for &t in &piece {
                    turned[t] = turned[t].map(|side| !side);
                }
            }
        }
        twisted.sort_unstable();
        twisted.dedup();
        if !twisted.is_empty() {
            self.triangles(
                Fault::NotOrientable,
                "the surface has only one side (Möbius strip), seen at",
                &twisted,
            );
            return false;
        }
        let against: Vec<_> = (0..turned.len()).filter(|&t| turned[t] == Some(true)).collect();
        for &t in &against {
            triangles[t].swap(1, 2);
        }
        self.triangles(
            Fault::Orientation,
            "triangles oriented against their neighbours were reversed",
            &against,
        );
        true
    }

    /// Turns an oriented surface over that is closed and has its normals inwards.
    ///
    /// ```text
    /// 6 V = Σ_T a · (b × c)        < 0 where normals point inwards; corners from their mean
    /// ```
    pub(super) fn outwards(&mut self, edges: &Edges, triangles: &mut [[u32; 3]]) {
        if edges.groups().any(|group| group.len() != 2) {
            return;
        }
        let points = &self.surface.points;
        let mean = points.iter().sum::<Vec3>() / real(points.len());
        let part = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize] - mean);
            a.dot(&b.cross(&c))
        };
        let (volume, size) = triangles
            .iter()
            .map(part)
            .fold((0.0, 0.0), |(sum, size), part| (sum + part, size + part.abs()));
        if volume < -FLAT_VOLUME_SHARE * size {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
            let message = "the closed surface had its normals inwards (mean curvature negative, pressure \
                the other way): all its triangles were reversed";
            self.report(Fault::FacesInwards, message, triangles.len(), std::iter::empty());
        }
    }

    /// Pieces that hang together by no vertex; whether there is one only.
    pub(super) fn pieces(&mut self) -> bool {
        let n = self.surface.points.len();
        let mut piece = DisjointSets::new(n);
        for &[a, b, c] in &self.surface.triangles {
            piece.join(a as usize, b as usize);
            piece.join(b as usize, c as usize);
        }
        let mut first: Vec<usize> = Vec::new();
        let mut seen = vec![false; n];
        for (t, tri) in self.surface.triangles.iter().enumerate() {
            let root = piece.root(tri[0] as usize);
            if !std::mem::replace(&mut seen[root], true) {
                first.push(t);
            }
        }
        if first.len() > 1 {
            let message = format!(
                "the mesh has {} disconnected parts (one is expected); they begin at",
                first.len()
            );
            self.triangles(Fault::SeveralComponents, &message, &first);
        }
        first.len() == 1
    }
}

/// The triangle across each side, and whether it is oriented as this one is.
fn neighbours(edges: &Edges, triangles: usize) -> Vec<[Option<(usize, bool)>; 3]> {
    let mut neighbours = vec![[None; 3]; triangles];
    for group in edges.groups() {
        if let [one, other] = group {
            let agree = one.forward != other.forward;
            neighbours[one.triangle][one.side] = Some((other.triangle, agree));
            neighbours[other.triangle][other.side] = Some((one.triangle, agree));
        }
    }
    neighbours
}
