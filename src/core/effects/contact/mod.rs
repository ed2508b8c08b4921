//! Contact of a sheet with itself: a barrier that keeps its surfaces apart.
//!
//! ```text
//! U = ½ Σ_v A⁰_v Σ_T b(d(v, T)) + ½ Σ_{e<f} ½ (A⁰_e + A⁰_f) m(e, f) b_½(d(e, f))
//! ```
//!
//! d are distances of vertices from triangles and of edges from edges that are not incident, b the barrier
//! (`barrier.rs`) of reach d̂, b_½ that of reach ½ d̂, m what smooths it for parallel edges, A⁰ rest areas. Edges and
//! corners shared by triangles count once (`touching.rs`). Two parallel sheets at a distance d from d̂/2 to d̂ push on one
//! another with exactly the pressure `p = -b'(d)` per rest area, whatever their meshes: the terms of vertices are a
//! quadrature of it. Those of edges keep edges from crossing where no vertex is near.
//!
//! d̂ is at most the thickness: surfaces touch that are a thickness apart. Of features that are near one another at rest the
//! reach is at most half their distance there, times how far the sheet is to shrink: neighbours do not touch, however
//! fine the mesh.
//!
//! U is infinite at d = 0, and no step passes through that (`geometry/proximity`): a shape that does not cross itself
//! never does. A shape that does is refused as a start.
//!
//! **Hessian.** Exact, but for derivatives of the reach by optimal lengths, which are left out; the positive part has what
//! acts across the gap, `b'' ∇d ∇dᵀ`.
//!
//! References: those of `barrier.rs` and `touching.rs`. Not covered: friction; exchange of species.

mod adhesion;
mod barrier;
mod distance_potential;
mod mesh;
mod mollifier;
mod obstacle;
mod separate;
mod sums;
mod touching;

use serde::{Deserialize, Serialize};

use super::{
    Contact, Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy, HessianPart,
    Interaction, Material, Needs, Pins, SceneSummary, SeparatedStart, Touching,
};
use crate::geometry::proximity::{PairKind, Proximity, Reach, corner_positions};
use crate::geometry::{Conditions, CrossingPairs, Crossings, RestMetric, Shape, lumped_areas};
use crate::linear::BlockMatrix;
use crate::num::Short;
use crate::num::checked::Positive;
use crate::sheet::{Edge, Sheet};
use crate::{Vec3, parallel};
use barrier::Barrier;
use distance_potential::DistancePotential;
use separate::Start;
use touching::{ContactPair, Weights};

pub use adhesion::Adhesion;
pub use obstacle::{ObstacleShape, ObstacleSpec, Side};

/// The stiffness κ in units of Young's modulus, unless a scene says otherwise. Surfaces that push on one another with
/// a hundredth of it are 0.94 of the reach apart.
const DEFAULT_STIFFNESS: f64 = 0.1;
/// The reach of edges in units of that of vertices: apart from where edges cross, surfaces at pressures up to κ are
/// further apart.
const EDGE_REACH_RATIO: f64 = 0.5;

/// A start touches itself where features are nearer than this, in mean edges: apart by no more than the round-off of a
/// mesh file.
const TOUCHING_DISTANCE: f64 = 1e-9;

/// Parameters of self-contact in a scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SelfContact {
    /// The distance d̂ at which surfaces begin to touch, at most the thickness; the thickness without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<Positive>,
    /// The stiffness κ, stress; a tenth of Young's modulus without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Positive>,
    /// Whether a start that touches or crosses itself slightly is moved apart, in place of being refused.
    #[serde(default, skip_serializing_if = "is_false")]
    pub separate: bool,
}

fn is_false(value: &bool) -> bool {
    !value
}

#[typetag::serialize(name = "contact")]
impl EffectSpec for SelfContact {
    fn needs(&self) -> Needs {
        Needs { material: self.distance.is_none() || self.stiffness.is_none(), ..Needs::default() }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let thickness = context.material.map(|m| m.thickness);
        let barrier = barrier_of((self.distance, thickness), self.stiffness, context.material)?;
        let distance = barrier.reach;
        if let Some(thickness) = thickness.filter(|h| distance > *h) {
            let message = format!(
                "contact at a distance of {distance} would act between surfaces that do not touch: the sheet is \
                 {thickness} thick"
            );
            let help = Some("at most material.thickness, which it is without the key".into());
            return Err(EffectError { key: "distance", message, help });
        }
        let contacts = Contacts::with_potential(context.sheet, DistancePotential::Barrier(barrier));
        Ok(Effect::contact(Contacts { separate: self.separate, ..contacts }))
    }

    fn notes(&self, context: &EffectContext<'_>, _: &SceneSummary<'_>) -> Vec<String> {
        let thickness = context.material.map(|m| m.thickness);
        let Some(distance) = self.distance.map(Positive::get).or(thickness) else {
            return Vec::new();
        };
        beyond_edges(context.sheet, distance).into_iter().collect()
    }
}

crate::register_kind!(dyn EffectSpec, "contact", SelfContact);

/// Advice where a sheet passes through itself.
pub const NO_CROSSINGS_ADVICE: &str =
    "list the effect `contact`, end the run before, or change what folds it";

/// The barrier that a scene asks for, with what it has without these keys.
fn barrier_of(
    (distance, usual): (Option<Positive>, Option<f64>),
    stiffness: Option<Positive>,
    material: Option<&Material>,
) -> Result<Barrier, EffectError> {
    let missing = |key| EffectError {
        key,
        message: format!("without the table [material] contact needs `{key}`"),
        help: None,
    };
    let young = material.map(|m| DEFAULT_STIFFNESS * m.young);
    Ok(Barrier {
        reach: distance.map(Positive::get).or(usual).ok_or_else(|| missing("distance"))?,
        stiffness: stiffness.map(Positive::get).or(young).ok_or_else(|| missing("stiffness"))?,
    })
}

/// Reports a reach beyond the median length of the edges at rest: half of the features next to one another have a shorter one.
fn beyond_edges(sheet: &Sheet, distance: f64) -> Option<String> {
    let x = sheet.rest();
    let length = |edge: &Edge| (x[edge.vertices[0] as usize] - x[edge.vertices[1] as usize]).norm();
    let mut lengths: Vec<f64> = sheet.edges().iter().map(length).collect();
    lengths.sort_by(f64::total_cmp);
    let (shortest, median) = (*lengths.first()?, lengths[lengths.len() / 2]);
    let key = "the distance of contact, `distance` or else material.thickness,";
    (distance > median).then(|| {
        format!(
            "{key} is {}, above the median edge of {} (the shortest is {}): features that are less than {} apart at rest touch at \
             half of their distance there; give longer edges, or a smaller distance",
            Short(distance),
            Short(median),
            Short(shortest),
            Short(2.0 * distance)
        )
    })
}

/// Half of the rest area of every vertex and of every edge.
fn halves(sheet: &Sheet) -> (Vec<f64>, Vec<f64>) {
    let vertex: Vec<f64> = lumped_areas(sheet).into_iter().map(|area| 0.5 * area).collect();
    let area = |t: u32| {
        let [a, b, c] = sheet.triangles()[t as usize].map(|v| sheet.rest()[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let of_edge = |edge: &Edge| {
        let both = edge.triangles.iter().filter(|t| **t != Edge::NONE);
        both.map(|t| area(*t) / 6.0).sum()
    };
    let edge = sheet.edges().iter().map(of_edge).collect();
    (vertex, edge)
}

/// Self-contact of one sheet, or its adhesion to itself.
#[derive(Debug)]
pub struct Contacts {
    potential: DistancePotential,
    /// Half of the rest area of vertices and of edges.
    vertex: Vec<f64>,
    edge: Vec<f64>,
    separate: bool,
}

impl Contacts {
    /// On `sheet`, at distances below `distance`, with the stiffness κ.
    #[must_use]
    pub fn new(sheet: &Sheet, distance: f64, stiffness: f64) -> Self {
        Self::with_potential(
            sheet,
            DistancePotential::Barrier(Barrier { stiffness, reach: distance }),
        )
    }

    fn with_potential(sheet: &Sheet, potential: DistancePotential) -> Self {
        let (vertex, edge) = halves(sheet);
        Self { potential, vertex, edge, separate: false }
    }

    /// All contacts at `shape`.
    fn contacts(&self, shape: &Shape<'_>, work: &mut ContactWork) -> Vec<ContactPair> {
        let range = self.range(work, shape);
        let proximity = work.proximity(shape, self.potential.reach());
        let near = proximity.near(shape.sheet, shape.x, &range);
        let weights = Weights {
            potential: self.potential,
            vertex: &self.vertex,
            edge: &self.edge,
            rest: shape.sheet.rest(),
        };
        touching::contacts(near, shape.x, &weights)
    }

    fn range(&self, work: &mut ContactWork, shape: &Shape<'_>) -> Reach {
        let shrinkage = *work.shrinkage.get_or_insert_with(|| shrinkage(shape.metric));
        let (points, edges) = (self.potential.reach(), EDGE_REACH_RATIO * self.potential.reach());
        match self.potential {
            DistancePotential::Barrier(_) => Reach { points, edges, shrinkage },
            DistancePotential::Well(_) => Reach { points, edges: 0.0, shrinkage },
        }
    }
}

/// Least ratio of an optimal length to that at rest, at most 1.
fn shrinkage(metric: &RestMetric) -> f64 {
    let (now, rest) = (metric.length(), metric.reference_length());
    let ratio = |e: usize| if now[e] < rest[e] { now[e] / rest[e] } else { 1.0 };
    (-parallel::max(now.len(), |e| -ratio(e))).min(1.0)
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct ContactWork {
    proximity: Option<Proximity>,
    /// How far the sheet is to shrink, once asked for since optimal lengths changed.
    shrinkage: Option<f64>,
}

impl ContactWork {
    fn proximity(&mut self, shape: &Shape<'_>, reach: f64) -> &mut Proximity {
        let edge = shape.metric.mean_edge();
        self.proximity.get_or_insert_with(|| Proximity::new(shape.sheet, edge, reach))
    }
}

impl Energy for Contacts {
    type Work = ContactWork;

    fn name(&self) -> &'static str {
        if self.potential.is_barrier() { "contact" } else { "adhesion" }
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn prepare(&self, _conditions: &Conditions<'_>, work: &mut ContactWork) {
        work.shrinkage = None;
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut ContactWork,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        sums::evaluate(&self.contacts(shape, work), gradient)
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut ContactWork,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        sums::add_hessian(&self.contacts(shape, work), shape.x, part, into);
    }
}

impl Contact for Contacts {
    fn interaction(&self) -> Interaction {
        let barrier = self.potential.is_barrier();
        Interaction { pairs: true, limits_steps: barrier, touches: barrier }
    }

    fn pairs(&self, shape: &Shape<'_>, work: &mut ContactWork, pairs: &mut Vec<[u32; 2]>) {
        for contact in self.contacts(shape, work) {
            let corners = contact.carriers().map(|k| contact.corners[k]);
            let later = |k: usize| corners.clone().skip(k + 1);
            let two = corners.clone().enumerate().flat_map(|(k, a)| later(k).map(move |b| [a, b]));
            pairs.extend(two);
        }
    }

    fn largest_step(&self, from: &Shape<'_>, work: &mut ContactWork, direction: &[Vec3]) -> f64 {
        let range = self.range(work, from);
        work.proximity(from, self.potential.reach()).largest_step(
            from.sheet,
            (from.x, direction),
            &range,
        )
    }

    fn touching(&self, shape: &Shape<'_>, work: &mut ContactWork) -> Touching {
        sums::touching(&self.contacts(shape, work))
    }

    fn separate(
        &self,
        shape: &Shape<'_>,
        work: &mut ContactWork,
        pins: &Pins,
    ) -> Option<SeparatedStart> {
        if !self.separate {
            return None;
        }
        let range = self.range(work, shape);
        let proximity = work.proximity(shape, self.potential.reach());
        let start = Start { sheet: shape.sheet, x: shape.x, pins, range, proximity };
        start.separated()
    }

    fn refusal(&self, shape: &Shape<'_>, work: &mut ContactWork) -> Option<String> {
        let range = self.range(work, shape);
        let proximity = work.proximity(shape, self.potential.reach());
        if !proximity.any_near(shape.sheet, shape.x, &range) {
            return None;
        }
        let found = Crossings::new(shape.sheet).find(shape.sheet, shape.x);
        if found.pairs > 0 {
            let CrossingPairs { pairs, .. } = found;
            let place = found.place(shape.sheet, shape.x);
            let how = match self.separate {
                true => {
                    "; `separate` moves vertices by up to the distance of contact, and they cross by more"
                }
                false => {
                    "; `separate = true` moves apart what crosses by less than the distance of contact"
                }
            };
            return Some(format!("{pairs} pairs of its triangles cross, {place}{how}"));
        }
        let least = TOUCHING_DISTANCE * shape.metric.mean_edge();
        let (points, edges) = proximity.near(shape.sheet, shape.x, &range);
        let mut pairs = points.iter().chain(edges);
        let touch =
            pairs.find(|p| !(p.kind.distance(&corner_positions(shape.x, &p.corners)) > least))?;
        let [a, b, c, d] = touch.corners;
        Some(match touch.kind {
            PairKind::PointTriangle => {
                format!("vertex {a} lies on the triangle with the vertices {b}, {c} and {d}")
            }
            PairKind::EdgeEdge => {
                format!("the edge of the vertices {a} and {b} touches that of {c} and {d}")
            }
        })
    }
}
