//! An obstacle: a body with a smooth surface that the sheet does not enter.
//!
//! ```text
//! U = Σ_i A⁰_i b(s(x_i - s(t) d))
//! s = n·(x - p)              plane: the sheet stays on the side that its normal points to
//! s = ±(|x - c| - R)         sphere, and cylinder with the distance from its axis: outside +, inside -
//! ```
//!
//! s is the signed distance from the surface, b the barrier (`barrier.rs`), d the displacement of the obstacle and
//! s(t) its ramp, A⁰ a third of the rest areas of the triangles at a vertex. A flat sheet at a distance s feels the
//! pressure `p = -b'(s)` per rest area. The reach d̂ is half the thickness, unless a scene says otherwise: the sheet is
//! its middle surface.
//!
//! Below a tenth of d̂, where `p = 12 κ`, b is continued by a parabola: an obstacle that a ramp moves into the sheet pushes
//! it out again. It is the vertices that stay out: between them a triangle may cut into a sphere by ℓ²/(8 R), ℓ its
//! edge.
//!
//! **Hessian.** Exact; the positive part leaves out what a convex surface does across its normal.
//!
//! A mesh is an obstacle of another kind (`mesh.rs`).
//!
//! Not covered: friction.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::barrier_of;
use super::distance_potential::DistancePotential;
use super::mesh::MeshBody;
use crate::effects::field::named;
use crate::effects::{
    Block, BlockMatrix, Contact, Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy,
    HessianPart, Interaction, Needs, Ramp, RampFactor, Reads, Touching,
};
use crate::geometry::{Shape, lumped_areas};
use crate::kinetics::breakpoints::TimeDependence;
use crate::num::checked::{Finite, Positive};
use crate::num::whole;
use crate::sheet::Sheet;
use crate::{Vec3, parallel};

/// The share of the reach below which the barrier is a parabola.
const PARABOLA_SHARE: f64 = 0.1;

/// Parameters of an obstacle in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSpec {
    /// Its surface.
    pub shape: ObstacleShape,
    /// The distance d̂ at which the sheet begins to touch it; half the thickness without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<Positive>,
    /// The stiffness κ, stress; a tenth of Young's modulus without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Positive>,
    /// Where it moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<[Finite; 3]>,
    /// The factor of the displacement in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
}

/// The surface of an obstacle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ObstacleShape {
    /// A plane.
    Plane {
        /// A point of it.
        #[serde(default)]
        point: [Finite; 3],
        /// Towards the side of the sheet; the length does not matter.
        normal: [Finite; 3],
    },
    /// A sphere.
    Sphere {
        /// Its centre.
        #[serde(default)]
        centre: [Finite; 3],
        /// Its radius.
        radius: Positive,
        /// Where the sheet is.
        #[serde(default)]
        sheet: Side,
    },
    /// A cylinder without ends.
    Cylinder {
        /// A point of its axis.
        #[serde(default)]
        point: [Finite; 3],
        /// The direction of its axis; the length does not matter.
        axis: [Finite; 3],
        /// Its radius.
        radius: Positive,
        /// Where the sheet is.
        #[serde(default)]
        sheet: Side,
    },
    /// The triangles of a file.
    Mesh(PathBuf),
}

impl ObstacleShape {
    /// The file that it is read from.
    fn file(&self) -> Option<&Path> {
        if let Self::Mesh(file) = self { Some(file) } else { None }
    }
}

/// Where the sheet is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Outside of the obstacle.
    #[default]
    Outside,
    /// In it.
    Inside,
}

#[typetag::serialize(name = "obstacle")]
impl EffectSpec for ObstacleSpec {
    fn needs(&self) -> Needs {
        let along_z = match &self.shape {
            ObstacleShape::Plane { normal, .. } => normal[2].get() != 0.0,
            _ => true,
        };
        let material = self.distance.is_none() || self.stiffness.is_none();
        Needs { material, out_of_plane: along_z.then_some("shape"), ..Needs::default() }
    }

    fn time_dependence(&self, _: &Sheet, until: f64) -> TimeDependence {
        RampFactor::time_dependence_of(self.ramp.as_ref(), until)
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        named([("shape.mesh", self.shape.file())])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        if let ObstacleShape::Mesh(file) = &mut self.shape {
            *file = folder.join(&*file);
        }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        check_ramp(self.ramp.as_ref(), self.displacement.is_some())?;
        let factor = RampFactor::new(self.ramp.as_ref())?;
        let thickness = context.material.map(|m| 0.5 * m.thickness);
        let barrier = barrier_of((self.distance, thickness), self.stiffness, context.material)?;
        let displacement =
            self.displacement.map_or(Vec3::zeros(), |d| Vec3::from(d.map(Finite::get)));
        Ok(match ObstacleDistance::new(&self.shape)? {
            ObstacleDistance::Mesh(file) => {
                Effect::contact(MeshBody::read(file, context, barrier, (displacement, factor))?)
            }
            ObstacleDistance::Smooth(surface) => {
                let area = lumped_areas(context.sheet);
                Effect::contact(Body {
                    surface,
                    potential: DistancePotential::Barrier(barrier),
                    displacement,
                    factor,
                    area,
                })
            }
        })
    }
}

crate::register_kind!(dyn EffectSpec, "obstacle", ObstacleSpec);

/// Refuses the ramp of a body that has no displacement.
pub(super) fn check_ramp(ramp: Option<&Ramp>, has_displacement: bool) -> Result<(), EffectError> {
    if ramp.is_none() || has_displacement {
        return Ok(());
    }
    let message = "a ramp without a displacement moves nothing".into();
    let help = "as in displacement = [0, 0, 1.5]: where the body is when the ramp is 1";
    Err(EffectError { key: "ramp", message, help: Some(help.into()) })
}

/// How the distance from an obstacle is known.
pub(super) enum ObstacleDistance<'a> {
    Smooth(Surface),
    Mesh(&'a Path),
}

/// A surface with its signed distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    point: Vec3,
    /// The directions that count: all, or those across an axis, or along a normal.
    across: Block,
    /// None for a plane.
    radius: Option<f64>,
    sign: f64,
    /// Of a plane its normal, else what stands for a direction where there is none.
    normal: Vec3,
}

impl<'a> ObstacleDistance<'a> {
    pub(super) fn new(shape: &'a ObstacleShape) -> Result<Self, EffectError> {
        let vector = |v: [Finite; 3]| Vec3::from(v.map(Finite::get));
        let unit = |v: [Finite; 3], what: &str| {
            let message = format!("the {what} must be a nonzero vector");
            let refused = EffectError { key: "shape", message, help: None };
            vector(v).try_normalize(0.0).ok_or(refused)
        };
        let sign = |side: Side| if side == Side::Outside { 1.0 } else { -1.0 };
        Ok(Self::Smooth(match *shape {
            ObstacleShape::Plane { point, normal } => {
                let normal = unit(normal, "normal")?;
                let across = Block::zeros();
                Surface { point: vector(point), across, radius: None, sign: 1.0, normal }
            }
            ObstacleShape::Sphere { centre, radius, sheet } => Surface {
                point: vector(centre),
                across: Block::identity(),
                radius: Some(radius.get()),
                sign: sign(sheet),
                normal: Vec3::z(),
            },
            ObstacleShape::Cylinder { point, axis, radius, sheet } => {
                let axis = unit(axis, "axis")?;
                let aside = if axis.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
                Surface {
                    point: vector(point),
                    across: Block::identity() - axis * axis.transpose(),
                    radius: Some(radius.get()),
                    sign: sign(sheet),
                    normal: axis.cross(&aside).normalize(),
                }
            }
            ObstacleShape::Mesh(ref file) => return Ok(Self::Mesh(file)),
        }))
    }
}

impl Surface {
    /// The signed distance at x, its gradient, and its second derivatives.
    fn signed_distance(&self, x: &Vec3) -> (f64, Vec3, Block) {
        let Some(radius) = self.radius else {
            return (self.normal.dot(&(x - self.point)), self.normal, Block::zeros());
        };
        let from = self.across * (x - self.point);
        let distance = from.norm();
        let n = from.try_normalize(0.0).unwrap_or(self.normal);
        let bend = if distance > 0.0 {
            (self.across - n * n.transpose()) / distance
        } else {
            Block::zeros()
        };
        (self.sign * (distance - radius), self.sign * n, self.sign * bend)
    }
}

/// A body with a smooth surface, for one sheet.
#[derive(Debug)]
pub(super) struct Body {
    pub(super) surface: Surface,
    pub(super) potential: DistancePotential,
    /// The displacement at the factor 1.
    pub(super) displacement: Vec3,
    pub(super) factor: RampFactor,
    /// The rest area of every vertex.
    pub(super) area: Vec<f64>,
}

impl Body {
    /// The signed distances of vertices at `shape`, with their derivatives.
    fn distances<'a>(
        &self,
        shape: &'a Shape<'_>,
    ) -> impl Fn(usize) -> (f64, Vec3, Block) + Sync + use<'_, 'a> {
        let displacement = self.factor.factor_at(shape.time) * self.displacement;
        move |i| self.surface.signed_distance(&(shape.x[i] - displacement))
    }

    /// Energy, slope and curvature at the signed distance `s` of vertex i, times its area.
    fn energies(&self, i: usize, s: f64) -> [f64; 3] {
        let potential = &self.potential;
        let d = match potential {
            DistancePotential::Barrier(barrier) => s.max(PARABOLA_SHARE * barrier.reach),
            DistancePotential::Well(_) => s,
        };
        let (energy, slope, curvature) =
            (potential.energy(d), potential.slope(d), potential.curvature(d));
        let beyond = s - d;
        let energy = energy + beyond * (slope + 0.5 * beyond * curvature);
        [energy, slope + beyond * curvature, curvature].map(|value| self.area[i] * value)
    }
}

impl Energy for Body {
    type Work = ();

    fn name(&self) -> &'static str {
        if self.potential.is_barrier() { "obstacle" } else { "adhesion" }
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn reads(&self) -> Reads<'_> {
        Reads::time(self.factor.changes() && self.displacement != Vec3::zeros())
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn evaluate(&self, shape: &Shape<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        let distance = self.distances(shape);
        if let Some(gradient) = gradient {
            parallel::update(gradient, |i, g| {
                let (s, n, _) = distance(i);
                if s < self.potential.reach() {
                    *g += self.energies(i, s)[1] * n;
                }
            });
        }
        let owned = shape.sheet.reduction().owned(shape.x.len());
        parallel::sum(owned, |i| self.energies(i, distance(i).0)[0])
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        (): &mut (),
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let distance = self.distances(shape);
        into.update_rows(|i, row| {
            let (s, n, bend) = distance(i);
            if s >= self.potential.reach() {
                return;
            }
            let [_, slope, curvature] = self.energies(i, s);
            // The bend is negative where the sheet is inside of a surface.
            let full = part == HessianPart::Full;
            let bends = full || slope * self.surface.sign >= 0.0;
            let across = if bends { slope * bend } else { Block::zeros() };
            let along = if full { curvature } else { curvature.max(0.0) };
            row.add(i, &(along * n * n.transpose() + across));
        });
    }
}

impl Contact for Body {
    fn interaction(&self) -> Interaction {
        Interaction { touches: self.potential.is_barrier(), ..Interaction::default() }
    }

    fn touching(&self, shape: &Shape<'_>, (): &mut ()) -> Touching {
        let distance = self.distances(shape);
        let (all, count, reach) = (shape.sheet.reduction(), shape.x.len(), self.potential.reach());
        let near = |i: usize| Some(distance(i).0).filter(|s| *s < reach);
        let pairs = all.sum(count, |i| if near(i).is_some() { 1.0 } else { 0.0 });
        let gap = all.min(count, |i| near(i).unwrap_or(f64::INFINITY));
        Touching { pairs: whole(pairs), gap }
    }
}
