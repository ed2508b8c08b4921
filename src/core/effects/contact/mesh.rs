//! A mesh that the sheet neither enters nor leaves: an obstacle of any shape.
//!
//! ```text
//! U = ½ Σ_v A⁰_v Σ_T b(d(v, T)) + ½ Σ_{e,f} ½ (A⁰_e + A⁰_f) m(e, f) b_½(d(e, f))
//! ```
//!
//! over vertices of the sheet with triangles of the mesh and the reverse, and edges of the sheet with those of the mesh: the
//! terms of self-contact (`mod.rs`) between two bodies, of which one has given places `x⁰ + s(t) d`. Parallel surfaces at a
//! distance s from d̂/2 to d̂ push on one another with the pressure `p = -b'(s)`. The mesh has two sides: the sheet stays on
//! the one where it starts, in a closed mesh or outside of it.
//!
//! No step passes through the mesh, nor does the mesh through the sheet when it moves: sheet and mesh are led along straight
//! lines from one time to the next, and a step on which they come much nearer is refused. A start that touches or crosses the
//! mesh is refused with the vertex or triangle.
//!
//! **Hessian.** As that of self-contact.

use std::path::Path;

use super::barrier::Barrier;
use super::distance_potential::DistancePotential;
use super::touching::{self, ContactPair, Weights};
use super::{EDGE_REACH_RATIO, TOUCHING_DISTANCE, halves, sums};
use crate::Vec3;
use crate::effects::{
    BlockMatrix, Contact, Coupling, EffectContext, EffectError, Energy, HessianPart, Interaction,
    RampFactor, Reads, Touching,
};
use crate::geometry::proximity::{PairKind, Proximity, Reach, corner_positions};
use crate::geometry::{Crossings, Shape};
use crate::num::index;
use crate::sheet::Sheet;

/// At rest sheet and mesh are this many reaches apart, so that the reach is the same everywhere.
const REST_SEPARATION: f64 = 4.0;

/// A mesh as an obstacle for one sheet.
#[derive(Debug)]
pub(super) struct MeshBody {
    /// The sheet, then the mesh far away from it.
    both: Sheet,
    /// The vertices of the mesh where its factor is 0.
    mesh: Vec<Vec3>,
    barrier: Barrier,
    /// The displacement at the factor 1.
    displacement: Vec3,
    factor: RampFactor,
    /// Half of the rest area of vertices and of edges.
    vertex: Vec<f64>,
    edge: Vec<f64>,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub(super) struct MeshWork {
    proximity: Option<Proximity>,
    /// Positions of both.
    x: Vec<Vec3>,
}

impl MeshBody {
    /// That of `file`, for the sheet of `context`.
    pub(super) fn read(
        file: &Path,
        context: &EffectContext<'_>,
        barrier: Barrier,
        (displacement, factor): (Vec3, RampFactor),
    ) -> Result<Self, EffectError> {
        let refused = |message: String| EffectError { key: "shape", message, help: None };
        let Some(read) = context.read else {
            return Err(refused(format!("{}: files are not read here", file.display())));
        };
        let surface = read(file).map_err(refused)?;
        let (mesh, _) = surface.into_sheet().map_err(|e| refused(e.to_string()))?;
        let both = side_by_side(context.sheet, &mesh, barrier.reach)
            .map_err(|message| refused(format!("{}: {message}", file.display())))?;
        let (vertex, edge) = halves(&both);
        let mesh = mesh.rest().to_vec();
        Ok(Self { both, mesh, barrier, displacement, factor, vertex, edge })
    }

    /// All contacts at `shape`.
    fn contacts(&self, shape: &Shape<'_>, work: &mut MeshWork) -> Vec<ContactPair> {
        let weights = Weights {
            potential: DistancePotential::Barrier(self.barrier),
            vertex: &self.vertex,
            edge: &self.edge,
            rest: self.both.rest(),
        };
        let (proximity, x) = self.placed(shape, work);
        touching::contacts(proximity.near(&self.both, x, &self.range()), x, &weights)
    }

    fn range(&self) -> Reach {
        let reach = self.barrier.reach;
        Reach { points: reach, edges: EDGE_REACH_RATIO * reach, shrinkage: 1.0 }
    }

    /// What finds pairs, and the positions of both at `shape`.
    fn placed<'w>(
        &self,
        shape: &Shape<'_>,
        work: &'w mut MeshWork,
    ) -> (&'w mut Proximity, &'w [Vec3]) {
        let displacement = self.factor.factor_at(shape.time) * self.displacement;
        work.x.clear();
        work.x.extend(shape.x.iter().copied().chain(self.mesh.iter().map(|x| x + displacement)));
        let make = || {
            let edge = shape.metric.mean_edge();
            Proximity::between(&self.both, shape.x.len(), edge, self.barrier.reach)
        };
        (work.proximity.get_or_insert_with(make), &work.x)
    }

    /// The largest share of a step on which the sheet goes along `direction` and the mesh by `displacement`.
    fn free_share(
        &self,
        from: &Shape<'_>,
        work: &mut MeshWork,
        direction: impl Iterator<Item = Vec3>,
        displacement: Vec3,
    ) -> f64 {
        let both: Vec<Vec3> = direction.chain(self.mesh.iter().map(|_| displacement)).collect();
        let (proximity, x) = self.placed(from, work);
        proximity.largest_step(&self.both, (x, &both), &self.range())
    }

    /// Why a start that touches the mesh is refused: the first pair that does.
    fn touch_refusal(&self, shape: &Shape<'_>, work: &mut MeshWork) -> Option<String> {
        let least = TOUCHING_DISTANCE * shape.metric.mean_edge();
        let sheet = index(shape.x.len());
        let (proximity, x) = self.placed(shape, work);
        let (points, edges) = proximity.near(&self.both, x, &self.range());
        let mut pairs = points.iter().chain(edges);
        let touch = pairs.find(|p| !(p.kind.distance(&corner_positions(x, &p.corners)) > least))?;
        let [a, b, c, d] = touch.corners;
        Some(match touch.kind {
            PairKind::PointTriangle if a < sheet => format!("vertex {a} lies on the mesh"),
            PairKind::PointTriangle => {
                format!("the triangle with the vertices {b}, {c} and {d} touches the mesh")
            }
            PairKind::EdgeEdge => {
                let [a, b] = if a < sheet { [a, b] } else { [c, d] };
                format!("the edge of the vertices {a} and {b} touches the mesh")
            }
        })
    }
}

/// `sheet` and `mesh` as one, so far apart that the reach of no pair is bounded by its distance there.
fn side_by_side(sheet: &Sheet, mesh: &Sheet, reach: f64) -> Result<Sheet, String> {
    let count = index(sheet.vertex_count());
    let bounds = |x: &[Vec3]| {
        let largest = x.iter().fold(x[0], |all, x| all.sup(x));
        (x.iter().fold(x[0], |all, x| all.inf(x)), largest)
    };
    let ((_, end), (begin, _)) = (bounds(sheet.rest()), bounds(mesh.rest()));
    let shift = Vec3::new(end.x - begin.x + REST_SEPARATION * reach, 0.0, 0.0);
    let rest = sheet.rest().iter().copied().chain(mesh.rest().iter().map(|x| x + shift));
    let others = mesh.triangles().iter().map(|t| t.map(|v| v + count));
    let triangles = sheet.triangles().iter().copied().chain(others);
    Sheet::new(rest.collect(), triangles.collect()).map_err(|e| e.to_string())
}

impl Energy for MeshBody {
    type Work = MeshWork;

    fn name(&self) -> &'static str {
        "obstacle"
    }

    fn coupling(&self) -> Coupling {
        Coupling::ONE_RING
    }

    fn reads(&self) -> Reads<'_> {
        Reads::time(self.factor.changes() && self.displacement != Vec3::zeros())
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut MeshWork,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        sums::evaluate(&self.contacts(shape, work), gradient)
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut MeshWork,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let contacts = self.contacts(shape, work);
        sums::add_hessian(&contacts, &work.x, part, into);
    }
}

impl Contact for MeshBody {
    fn interaction(&self) -> Interaction {
        Interaction { limits_steps: true, touches: true, ..Interaction::default() }
    }

    fn largest_step(&self, from: &Shape<'_>, work: &mut MeshWork, direction: &[Vec3]) -> f64 {
        self.free_share(from, work, direction.iter().copied(), Vec3::zeros())
    }

    fn allows_path(
        &self,
        from: &Shape<'_>,
        work: &mut MeshWork,
        (to, time): (&[Vec3], f64),
    ) -> bool {
        let displacement =
            (self.factor.factor_at(time) - self.factor.factor_at(from.time)) * self.displacement;
        let direction = from.x.iter().zip(to).map(|(from, to)| to - from);
        self.free_share(from, work, direction, displacement) >= 1.0
    }

    fn touching(&self, shape: &Shape<'_>, work: &mut MeshWork) -> Touching {
        sums::touching(&self.contacts(shape, work))
    }

    fn refusal(&self, shape: &Shape<'_>, work: &mut MeshWork) -> Option<String> {
        let first = shape.sheet.triangle_count();
        let (_, x) = self.placed(shape, work);
        let found = Crossings::between(&self.both, first).find(&self.both, x);
        let Some([t, _]) = found.first else { return self.touch_refusal(shape, work) };
        let [a, b, c] = shape.sheet.triangles()[t];
        let place = corner_positions(x, &[a, b, c, c]);
        let [x, y, z] = [0, 1, 2].map(|k| (place[0][k] + place[1][k] + place[2][k]) / 3.0);
        Some(format!(
            "{} pairs of triangles of the sheet and of the mesh cross, first the triangle with the vertices {a}, {b} and \
             {c} near ({x:.4}, {y:.4}, {z:.4})",
            found.pairs
        ))
    }
}
