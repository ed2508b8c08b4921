//! Delaunay triangles of a curved surface, from any triangles of its points.
//!
//! An edge whose two opposite angles sum to more than π, which is
//!
//! ```text
//! cot α + cot β < 0,
//! ```
//!
//! is replaced by the other diagonal of its two triangles until none is left (C. L. Lawson, Software for C¹ surface
//! interpolation, 1977). Angles are those in space. Where triangles of a chart are stretched this brings back what is
//! near on the surface.

use rumple_numerics::Vec3;
use rumple_numerics::num::index;

/// Sum of cotangents below which an edge is flipped: above round-off, so that four points on a circle do not flip for ever.
const MIN_COTANGENT_SUM: f64 = -1e-10;

/// Flips allowed for each triangle; on a coarse curved surface they may go round in circles.
const MAX_FLIPS: usize = 20;

/// No triangle.
const NONE: u32 = u32::MAX;

/// A triangulation whose edges can be flipped.
struct Mesh<'a> {
    points: &'a [Vec3],
    triangles: Vec<[u32; 3]>,
    /// Of every triangle the one across the side opposite each corner.
    across: Vec<[u32; 3]>,
    /// Triangles at every vertex.
    valence: Vec<u32>,
    /// Fewest of them: a closed fan has three, one at the boundary has one.
    fewest: Vec<u32>,
}

/// Flips edges of oriented triangles until they are Delaunay; the boundary stays.
pub(super) fn delaunay_in_space(points: &[Vec3], triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    let mut mesh = Mesh::new(points, triangles);
    let mut open: Vec<(u32, usize)> =
        (0..mesh.triangles.len()).flat_map(|t| (0..3).map(move |k| (index(t), k))).collect();
    let mut left = MAX_FLIPS * mesh.triangles.len();
    while let Some((t, k)) = open.pop() {
        if left > 0 && mesh.flip(t as usize, k) {
            left -= 1;
            let other = mesh.across[t as usize].into_iter().chain([t]);
            for s in other.filter(|&s| s != NONE) {
                open.extend((0..3).map(|k| (s, k)));
            }
        }
    }
    mesh.triangles
}

impl<'a> Mesh<'a> {
    fn new(points: &'a [Vec3], triangles: Vec<[u32; 3]>) -> Self {
        let mut half: Vec<(u32, u32, u32, usize)> = Vec::with_capacity(3 * triangles.len());
        let mut valence = vec![0; points.len()];
        for (t, tri) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (tri[(k + 1) % 3], tri[(k + 2) % 3]);
                half.push((a.min(b), a.max(b), index(t), k));
                valence[tri[k] as usize] += 1;
            }
        }
        half.sort_unstable();
        let mut across = vec![[NONE; 3]; triangles.len()];
        let mut fewest = vec![3; points.len()];
        for group in half.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
            match *group {
                [(_, _, s, i), (_, _, t, j)] => {
                    across[s as usize][i] = t;
                    across[t as usize][j] = s;
                }
                [(a, b, ..)] => {
                    fewest[a as usize] = 1;
                    fewest[b as usize] = 1;
                }
                _ => {}
            }
        }
        Self { points, triangles, across, valence, fewest }
    }

    /// Flips the side of triangle `t` opposite its corner `k` if it is not Delaunay; whether it did.
    fn flip(&mut self, t: usize, k: usize) -> bool {
        let s = self.across[t][k];
        if s == NONE {
            return false;
        }
        let s = s as usize;
        let Some(j) = (0..3).find(|&j| self.across[s][j] == index(t)) else { return false };
        // c is opposite the edge a b in t, d in s.
        let [c, a, b] = [0, 1, 2].map(|i| self.triangles[t][(k + i) % 3]);
        let d = self.triangles[s][j];
        let spare = |v: u32| self.valence[v as usize] > self.fewest[v as usize];
        if c == d || !spare(a) || !spare(b) {
            return false;
        }
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| self.points[v as usize]);
        let cot = |at: Vec3| {
            let (u, v) = (pa - at, pb - at);
            u.dot(&v) / u.cross(&v).norm().max(f64::MIN_POSITIVE)
        };
        if cot(pc) + cot(pd) >= MIN_COTANGENT_SUM {
            return false;
        }
        let normal = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(&(r - p));
        let before = normal(pc, pa, pb) + normal(pd, pb, pa);
        // A flip that folds the surface is none.
        if normal(pc, pa, pd).dot(&before) <= 0.0 || normal(pd, pb, pc).dot(&before) <= 0.0 {
            return false;
        }
        let (beyond_a, beyond_b) = (self.side(t, a), self.side(t, b));
        let (over_a, over_b) = (self.side(s, a), self.side(s, b));
        // t becomes c a d, s becomes d b c.
        self.triangles[t] = [c, a, d];
        self.triangles[s] = [d, b, c];
        self.across[t] = [over_b, index(s), beyond_b];
        self.across[s] = [beyond_a, index(t), over_a];
        self.relink(over_b, s, t);
        self.relink(beyond_a, t, s);
        self.valence[a as usize] -= 1;
        self.valence[b as usize] -= 1;
        self.valence[c as usize] += 1;
        self.valence[d as usize] += 1;
        true
    }

    /// The triangle across the side of `t` opposite vertex `v`.
    fn side(&self, t: usize, v: u32) -> u32 {
        (0..3).find(|&i| self.triangles[t][i] == v).map_or(NONE, |i| self.across[t][i])
    }

    /// Has the neighbour `of` know triangle `new` in place of `old`.
    fn relink(&mut self, of: u32, old: usize, new: usize) {
        if of != NONE {
            for across in &mut self.across[of as usize] {
                if *across == index(old) {
                    *across = index(new);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_diagonal_is_flipped_and_a_bent_pair_is_not_folded() {
        let thin = [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (2.0, 1.0, 0.0), (2.0, -1.0, 0.0)];
        let points = thin.map(|(x, y, z)| Vec3::new(x, y, z));
        let mut mesh = Mesh::new(&points, vec![[0, 1, 2], [1, 0, 3]]);
        assert!(mesh.flip(0, 2));
        assert_eq!(mesh.triangles, [[2, 0, 3], [3, 1, 2]]);
        assert_eq!(mesh.across, [[NONE, 1, NONE], [NONE, 0, NONE]]);
        assert!(!mesh.flip(0, 1), "the short diagonal stays");
    }
}
