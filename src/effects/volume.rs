//! The volume that a closed sheet encloses, held near a given one.
//!
//! ```text
//! U = κ (V - V*)²/(2 V*),    V = Σ_T ⅙ (x₀ - O)·[(x₁ - O) × (x₂ - O)],    V* = s(t) · target
//! ```
//!
//! κ is a bulk modulus, force/length²: the pressure inside is `p = -κ (V - V*)/V*`, positive where the
//! volume is below its target, and pushes along the normals. V > 0 where these point outwards (triangles
//! counter-clockwise seen from outside); O is the mean of the rest positions, which changes round-off
//! alone. The target is a volume, or a share of the volume at rest; `ramp` multiplies it in time.
//!
//! **Derivatives.** `∂V/∂x_i = Σ_{T∋i} A_T n_T/3`, so the force is that of the pressure p. The second
//! derivatives are `-p ∂²V`, sparse and as those of the effect `pressure`, and
//! `(κ/V*) ∂V ⊗ ∂V`, which couples all vertices and is of rank one.
//!
//! Not covered: open sheets; a volume that is exact whatever the pressure.

use serde::{Deserialize, Serialize};

use super::element::{self, Element, Mesh};
use super::ramp::Factor;
use super::{
    Block, BlockMatrix, Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy,
    HessianPart, LowRank, Ramp,
};
use crate::Vec3;
use crate::geometry::Shape;
use crate::linear::LazyStencils;
use crate::num::checked::Positive;
use crate::num::real;
use crate::parallel;
use crate::sheet::Sheet;

/// Parameters of an enclosed volume in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Volume {
    /// The bulk modulus κ, force per area.
    pub stiffness: Positive,
    /// The target.
    #[serde(default)]
    pub target: VolumeTarget,
    /// The factor of the target in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
}

/// A target of the enclosed volume.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VolumeTarget {
    /// In units of the volume at rest.
    Share(Positive),
    /// A volume, length³.
    Value(Positive),
}

impl Default for VolumeTarget {
    fn default() -> Self {
        Self::Share(Positive::ONE)
    }
}

#[typetag::serialize(name = "volume")]
impl EffectSpec for Volume {
    fn name(&self) -> String {
        "volume".into()
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let sheet = context.sheet;
        let refuse = |message: &str, help: &str| {
            let (message, help) = (message.to_owned(), Some(help.to_owned()));
            Err(EffectError { key: "kind", message, help })
        };
        if sheet.rim().contains(&true) {
            return refuse(
                "a sheet with a boundary encloses no volume",
                "use shape = \"sphere\" or a closed mesh; on an open sheet use the effect pressure",
            );
        }
        let origin = sheet.rest().iter().sum::<Vec3>() / real(sheet.vertex_count().max(1));
        let at_rest = volume(sheet, sheet.rest(), origin);
        if !(at_rest > 0.0) {
            return refuse(
                &format!("the sheet at rest encloses the volume {at_rest}"),
                "its triangles must be counter-clockwise seen from outside, and it must not be flat",
            );
        }
        let target = match self.target {
            VolumeTarget::Share(share) => share.get() * at_rest,
            VolumeTarget::Value(value) => value.get(),
        };
        let (stiffness, factor) = (self.stiffness.get(), Factor::new(self.ramp.as_ref())?);
        Ok(Effect::energy(EnclosedVolume { stiffness, target, factor, origin }))
    }
}

crate::register_kind!(dyn EffectSpec, "volume", Volume);

/// `⅙ (x₀ - O)·[(x₁ - O) × (x₂ - O)]` summed.
fn volume(sheet: &Sheet, x: &[Vec3], origin: Vec3) -> f64 {
    let triangles = sheet.triangles();
    parallel::sum(triangles.len(), |t| {
        let [a, b, c] = triangles[t].map(|v| x[v as usize] - origin);
        a.dot(&b.cross(&c)) / 6.0
    })
}

/// `-p` times the volume of a tetrahedron between a triangle and O.
#[derive(Debug, Clone, Copy)]
struct Tetrahedron {
    weight: f64,
    origin: Vec3,
}

impl Element<3> for Tetrahedron {
    fn gradient(&self, x: &[Vec3; 3]) -> (f64, [Vec3; 3]) {
        let [a, b, c] = x.map(|x| x - self.origin);
        let normal = (x[1] - x[0]).cross(&(x[2] - x[0]));
        (self.weight / 6.0 * a.dot(&b.cross(&c)), [self.weight / 6.0 * normal; 3])
    }

    /// On a closed sheet `∂²V` is the sum of these antisymmetric parts, which are symmetric as blocks.
    fn hessian(&self, x: &[Vec3; 3], _: HessianPart) -> [[Block; 3]; 3] {
        let e = [x[2] - x[1], x[0] - x[2], x[1] - x[0]];
        std::array::from_fn(|k| {
            std::array::from_fn(|m| (self.weight / 12.0) * (e[m] - e[k]).cross_matrix())
        })
    }
}

/// The energy of the volume that one closed sheet encloses.
#[derive(Debug)]
pub struct EnclosedVolume {
    stiffness: f64,
    target: f64,
    factor: Factor,
    origin: Vec3,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct VolumeWork {
    pull: Vec<[Vec3; 3]>,
    places: LazyStencils,
}

impl EnclosedVolume {
    /// V* and `∂U/∂V = -p`.
    fn at(&self, shape: &Shape<'_>) -> (f64, f64, f64) {
        let target = self.factor.at(shape.time) * self.target;
        let excess = (volume(shape.sheet, shape.x, self.origin) - target) / target;
        (target, excess, self.stiffness * excess)
    }
}

impl Energy for EnclosedVolume {
    type Work = VolumeWork;

    fn name(&self) -> &'static str {
        "volume"
    }

    fn coupling(&self) -> Coupling {
        Coupling { low_rank: true, ..Coupling::ONE_RING }
    }

    fn depends_on_time(&self) -> bool {
        self.factor.changes()
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let (target, excess, weight) = self.at(shape);
        if gradient.is_some() {
            let element = Tetrahedron { weight, origin: self.origin };
            let mesh = Mesh::triangles(shape.sheet);
            element::evaluate(&mesh, |_| &element, shape.x, &mut work.pull, gradient);
        }
        0.5 * self.stiffness * excess * excess * target
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        if part == HessianPart::Full {
            let (_, _, weight) = self.at(shape);
            let element = Tetrahedron { weight, origin: self.origin };
            let mesh = Mesh::triangles(shape.sheet);
            element::add_hessian(&mesh, |_| &element, shape.x, part, &mut work.places, into);
        }
    }

    fn low_rank(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        _: HessianPart,
        terms: &mut Vec<LowRank>,
    ) {
        let (target, ..) = self.at(shape);
        let mut direction = vec![Vec3::zeros(); shape.x.len()];
        let element = Tetrahedron { weight: 1.0, origin: self.origin };
        let mesh = Mesh::triangles(shape.sheet);
        element::evaluate(&mesh, |_| &element, shape.x, &mut work.pull, Some(&mut direction));
        terms.push(LowRank { stiffness: self.stiffness / target, direction });
    }
}
