//! A sheet over ranks: which rank owns what, and the part that a rank keeps.
//!
//! ```text
//! owned vertices | ghosts of two rings        by ascending number, ghosts by their owner first
//! counted triangles | others that touch an owned vertex or a neighbour of one
//! ```
//!
//! An element is counted in sums by the lowest rank that owns one of its corners.
//!
//! Vertices are shared out by recursive coordinate bisection: the longest extent is cut, in proportion to the ranks on
//! either side. Reference: Berger & Bokhari, IEEE Trans. Computers C-36 (1987), doi:10.1109/TC.1987.1676942.

use std::sync::Arc;

use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use rumple_numerics::reduction::{
    CommunicationCounts, Communicator, Distribution, HaloMap, Reduction,
};

use super::generate::lattice::{Lattice, Patch};
use super::topology::Share;
use super::{Sheet, SheetError, Surface};

/// The part of a sheet that a rank keeps.
#[derive(Debug, Clone)]
pub struct Subdomain {
    /// Owned vertices and ghosts, and the triangles that touch owned vertices or neighbours of them.
    pub sheet: Sheet,
    /// The number of each of its vertices in the whole sheet.
    pub vertices: Arc<Vec<u32>>,
    /// The number of each of its triangles in the whole sheet.
    pub triangles: Arc<Vec<u32>>,
    /// Vertices and triangles of the whole sheet.
    pub whole: [usize; 2],
    /// The same of the sheet that it was cut from, the whole one or a neighbourhood of the part.
    around: Kept,
}

/// Numbers of vertices and triangles that are kept, and of how many.
#[derive(Debug, Clone)]
struct Kept {
    numbers: [Vec<u32>; 2],
    of: [usize; 2],
}

impl Kept {
    fn restrict<T: Clone>(&self, values: &mut Vec<T>) {
        if let Some(kind) = self.of.iter().position(|count| *count == values.len()) {
            *values = self.numbers[kind].iter().map(|&i| values[i as usize].clone()).collect();
        }
    }
}

/// Shares `points` out over `ranks` of nearly as many points each: the rank of every point.
#[must_use]
pub fn bisect(points: &[Vec3], ranks: usize) -> Vec<u32> {
    fn share(points: &[Vec3], all: &mut [u32], (first, ranks): (usize, usize), out: &mut [u32]) {
        if ranks <= 1 {
            all.iter().for_each(|&i| out[i as usize] = index(first));
            return;
        }
        let extent = |axis: usize| {
            let at = all.iter().map(|&i| points[i as usize][axis]);
            let (low, high) =
                at.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        };
        let axis = (0..3).max_by(|a, b| extent(*a).total_cmp(&extent(*b))).unwrap_or(0);
        let (low, half) = (ranks / 2, all.len() * (ranks / 2) / ranks);
        let by = |a: &u32, b: &u32| {
            points[*a as usize][axis].total_cmp(&points[*b as usize][axis]).then(a.cmp(b))
        };
        if half > 0 && half < all.len() {
            all.select_nth_unstable_by(half, by);
        }
        let (below, above) = all.split_at_mut(half);
        share(points, below, (first, low), out);
        share(points, above, (first + low, ranks - low), out);
    }
    let mut out = vec![0; points.len()];
    let mut all: Vec<u32> = (0..index(points.len())).collect();
    share(points, &mut all, (0, ranks), &mut out);
    out
}

impl Subdomain {
    /// The part of `whole`, which every rank has, of this rank.
    ///
    /// # Errors
    /// Fewer vertices than ranks.
    pub fn cut(whole: &Sheet, communicator: Arc<dyn Communicator>) -> Result<Self, SheetError> {
        let ranks = communicator.size();
        if whole.vertex_count() < ranks {
            let vertices = whole.vertex_count();
            let message = format!("{vertices} vertices cannot be spread over {ranks} ranks");
            return Err(SheetError::Unusable(message));
        }
        Self::cut_from(whole, &bisect(whole.rest(), ranks), communicator)
    }

    /// The part of this rank of a lattice, of which it makes that part and its neighbourhood only.
    ///
    /// # Errors
    /// Fewer points in a direction than ranks.
    pub fn of_lattice(
        lattice: &Lattice,
        communicator: Arc<dyn Communicator>,
    ) -> Result<(Sheet, Self), SheetError> {
        let Patch { sheet, owners } = lattice.patch(communicator.rank(), communicator.size())?;
        let part = Self::cut_from(&sheet, &owners, communicator)?;
        Ok((sheet, part))
    }

    /// The part of `whole`, or of a part of it that has three rings around what this rank owns.
    fn cut_from(
        whole: &Sheet,
        owners: &[u32],
        communicator: Arc<dyn Communicator>,
    ) -> Result<Self, SheetError> {
        let rank = communicator.rank();
        let cut = Cut { whole, owners, rank: index(rank) };
        let (vertices, before) = cut.vertices();
        let triangles = cut.triangles(&vertices);
        let mut local = vec![u32::MAX; whole.vertex_count()];
        for (i, &v) in vertices.iter().enumerate() {
            local[v as usize] = index(i);
        }
        let corners = triangles.iter().map(|&t| whole.triangles()[t as usize]);
        let corners = corners.map(|corners| corners.map(|v| local[v as usize])).collect();
        let rest = vertices.iter().map(|&v| whole.rest()[v as usize]).collect();
        let boundary = vertices.iter().map(|&v| whole.boundary()[v as usize]).collect();
        let owned = vertices.iter().filter(|&&v| owners[v as usize] == cut.rank).count();
        let faces = cut.faces(&triangles);
        let distribution = Distribution {
            vertices: cut.halo(&vertices, owned, |v| owners[v as usize], |v| cut.ranks_near(v, 2)),
            faces: cut.halo(&triangles, faces, |t| cut.counted_by(t), |t| cut.ranks_of_face(t)),
            communicator,
            periods: Vec::new(),
            traffic: CommunicationCounts::default(),
        };
        let euler = if rank == 0 { whole.euler_characteristic() } else { 0 };
        let of = [whole.vertex_count(), whole.triangle_count()];
        let numbers = |kept: &[u32], number: &dyn Fn(usize) -> u32| {
            Arc::new(kept.iter().map(|&i| number(i as usize)).collect::<Vec<_>>())
        };
        let around = Kept { numbers: [vertices, triangles], of };
        let vertices = numbers(&around.numbers[0], &|v| whole.number(v));
        let triangles = numbers(&around.numbers[1], &|t| whole.triangle_number(t));
        let share = Share {
            owned,
            before,
            periodic: false,
            euler,
            numbers: Arc::clone(&vertices),
            triangle_numbers: Arc::clone(&triangles),
            whole: whole.counts_of_whole(),
        };
        let sheet = Sheet::new(rest, corners)?.part(boundary, share);
        let sheet = sheet.with_attributes(whole.attributes().cloned());
        let sheet = sheet.reduced_by(Reduction::over(Arc::new(distribution)));
        Ok(Self { sheet, vertices, triangles, whole: whole.counts_of_whole(), around })
    }

    /// The rows of `values`, of which the sheet that this part was cut from has one a vertex, that the part keeps; likewise
    /// of triangles. Others are left as they are.
    pub fn restrict<T: Clone>(&self, values: &mut Vec<T>) {
        self.around.restrict(values);
    }

    /// The part of `surface`, a surface with the vertices and triangles of the whole sheet.
    pub fn restrict_surface(&self, surface: &mut Surface) {
        let [vertices, triangles] = self.whole;
        if surface.points.len() != vertices || surface.triangles.len() != triangles {
            return;
        }
        let of = |kept: &[u32], width: usize, values: &[f64]| -> Vec<f64> {
            let rows = kept.iter().map(|&i| &values[i as usize * width..][..width]);
            rows.flatten().copied().collect()
        };
        for array in &mut surface.point_arrays {
            array.values = of(&self.vertices, array.components, &array.values);
        }
        for array in &mut surface.cell_arrays {
            array.values = of(&self.triangles, array.components, &array.values);
        }
        surface.points = self.vertices.iter().map(|&v| surface.points[v as usize]).collect();
        surface.triangles = self.sheet.triangles().to_vec();
    }
}

impl Sheet {
    /// Of `values`, one a vertex or one a triangle of the sheet that this is a part of, those of its own vertices or
    /// triangles; `None` where there are more or fewer.
    #[must_use]
    pub fn part_of<T: Clone>(&self, values: &[T], on_triangles: bool) -> Option<Vec<T>> {
        let kind = usize::from(on_triangles);
        let count = [self.vertex_count(), self.triangle_count()][kind];
        let number = |i| if on_triangles { self.triangle_number(i) } else { self.number(i) };
        let fits = values.len() == self.counts_of_whole()[kind];
        fits.then(|| (0..count).map(|i| values[number(i) as usize].clone()).collect())
    }

    /// For every vertex whether it is a ghost that no owned vertex is a neighbour of, as its three directions: what around
    /// it is missing here.
    #[must_use]
    pub fn outermost(&self) -> Vec<[bool; 3]> {
        let owned = self.reduction().owned(self.vertex_count());
        let near = |i: usize| {
            let around = self.vertex_edges().entries(i);
            around.iter().any(|&(_, other)| (other as usize) < owned)
        };
        (0..self.vertex_count()).map(|i| [i >= owned && !near(i); 3]).collect()
    }
}

/// A whole sheet, the owners of its vertices, and the rank that a part is cut for.
struct Cut<'a> {
    whole: &'a Sheet,
    owners: &'a [u32],
    rank: u32,
}

impl Cut<'_> {
    fn neighbours(&self, v: u32) -> impl Iterator<Item = u32> {
        self.whole.vertex_edges().entries(v as usize).iter().map(|(_, other)| *other)
    }

    /// The vertices of the part in their order, and how many ghosts are of lower ranks.
    fn vertices(&self) -> (Vec<u32>, usize) {
        let mut here = vec![false; self.owners.len()];
        let owned: Vec<u32> = (0..index(self.owners.len()))
            .filter(|&v| self.owners[v as usize] == self.rank)
            .collect();
        owned.iter().for_each(|&v| here[v as usize] = true);
        let (mut ring, mut ghosts) = (owned.clone(), Vec::new());
        for _ in 0..2 {
            let mut next = Vec::new();
            for v in ring.iter().flat_map(|&v| self.neighbours(v)) {
                if !std::mem::replace(&mut here[v as usize], true) {
                    next.push(v);
                }
            }
            ghosts.extend(&next);
            ring = next;
        }
        ghosts.sort_unstable_by_key(|&v| (self.owners[v as usize], v));
        let before = ghosts.iter().filter(|&&v| self.owners[v as usize] < self.rank).count();
        ([owned, ghosts].concat(), before)
    }

    /// The rank that counts triangle `t`.
    fn counted_by(&self, t: u32) -> u32 {
        let corners = self.whole.triangles()[t as usize];
        corners.map(|v| self.owners[v as usize]).into_iter().min().unwrap_or_default()
    }

    /// The ranks other than this one with an owned vertex at most `rings` edges from `v`.
    fn ranks_near(&self, v: u32, rings: usize) -> Vec<u32> {
        let (mut seen, mut from) = (vec![v], 0);
        for _ in 0..rings {
            let to = seen.len();
            for k in from..to {
                for w in self.neighbours(seen[k]) {
                    if !seen.contains(&w) {
                        seen.push(w);
                    }
                }
            }
            from = to;
        }
        self.others(seen.into_iter().map(|v| self.owners[v as usize]))
    }

    /// The ranks other than this one that have triangle `t`.
    fn ranks_of_face(&self, t: u32) -> Vec<u32> {
        let corners = self.whole.triangles()[t as usize];
        self.others(corners.into_iter().flat_map(|v| {
            self.neighbours(v).chain([v]).map(|v| self.owners[v as usize]).collect::<Vec<_>>()
        }))
    }

    fn others(&self, ranks: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut all: Vec<u32> = ranks.filter(|rank| *rank != self.rank).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The triangles of the part in their order: those that it counts come first.
    fn triangles(&self, vertices: &[u32]) -> Vec<u32> {
        let mut near = vec![false; self.owners.len()];
        for &v in vertices.iter().filter(|&&v| self.owners[v as usize] == self.rank) {
            near[v as usize] = true;
            self.neighbours(v).for_each(|w| near[w as usize] = true);
        }
        let all = self.whole.triangles().iter().enumerate();
        let here = all.filter(|(_, corners)| corners.iter().any(|&v| near[v as usize]));
        let mut triangles: Vec<u32> = here.map(|(t, _)| index(t)).collect();
        triangles.sort_by_key(|&t| {
            let owner = self.counted_by(t);
            (owner != self.rank, owner, t)
        });
        triangles
    }

    fn faces(&self, triangles: &[u32]) -> usize {
        triangles.iter().filter(|&&t| self.counted_by(t) == self.rank).count()
    }

    /// Who sends what of `points`, of which the first `owned` are this rank's.
    fn halo(
        &self,
        points: &[u32],
        owned: usize,
        owner: impl Fn(u32) -> u32,
        users: impl Fn(u32) -> Vec<u32>,
    ) -> HaloMap {
        let mut send: Vec<(usize, Vec<u32>)> = Vec::new();
        let mut receive = send.clone();
        let add = |lists: &mut Vec<(usize, Vec<u32>)>, rank: u32, i: usize| {
            let rank = rank as usize;
            match lists.iter_mut().find(|(other, _)| *other == rank) {
                Some((_, list)) => list.push(index(i)),
                None => lists.push((rank, vec![index(i)])),
            }
        };
        for (i, &point) in points.iter().enumerate() {
            if i < owned {
                users(point).into_iter().for_each(|rank| add(&mut send, rank, i));
            } else {
                add(&mut receive, owner(point), i);
            }
        }
        send.sort_unstable_by_key(|(rank, _)| *rank);
        receive.sort_unstable_by_key(|(rank, _)| *rank);
        HaloMap { owned, count: points.len(), send, receive }
    }
}
