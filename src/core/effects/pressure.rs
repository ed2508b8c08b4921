//! Pressure: a force along the current normals, which follows the sheet.
//!
//! ```text
//! f_i = Σ_{T∋i} p A_T n_T/3,     U = -p V,     V = Σ_T ⅙ (x₀ - O)·[(x₁ - O) × (x₂ - O)]
//! ```
//!
//! p is the pressure on the back of the sheet less that on its front, force/length²: **positive
//! pushes along the normals** (triangles counter-clockwise seen from the side that the normal points
//! to), so it inflates a closed sheet whose normals point outwards. V is then the enclosed volume.
//! On an open sheet V is the volume between the sheet and the cone from its boundary to O, the mean of
//! the boundary's rest positions.
//!
//! **When it is conservative.** Round an interior vertex `∂V/∂x_i = Σ_T A_T n_T/3` whatever O is, so
//! there f is exactly the gradient of pV. At a boundary vertex i between boundary edges (k, i) and (i, j) the
//! cone adds `(p/6) [(x_j - O) × (x_i - O) + (x_i - O) × (x_k - O)]`, which is not a force of the
//! pressure and left out. So f is conservative, and U its energy, where that term does no work: on closed sheets,
//! where the boundary is pinned, and where the boundary stays in a plane through O (all boundary vertices at one
//! height, pinned along z: a lid that slides in its plane). Where the boundary is free, the force is
//! still right but has no energy: U is not one, and a solver that trusts it may stop early.
//!
//! **Hessian.** See the file `cone.rs`: exact away from the boundary, the symmetric part there; it is
//! indefinite, and the positive part has nothing.
//!
//! Reference: e.g. Bonet & Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis* (2008),
//! section 8.5.2. `ramp` multiplies the pressure
//! by a factor of time (see the file `ramp.rs`). Not covered: pressure that depends on the volume (see the
//! effect `volume`).

use serde::{Deserialize, Serialize};

use super::cone::{Cone, ConeWork};
use super::ramp::RampFactor;
use super::{
    Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy, ForceScales, HessianPart,
    Needs, Ramp, Reads,
};
use crate::Vec3;
use crate::geometry::Shape;
use crate::kinetics::breakpoints::TimeDependence;
use crate::linear::BlockMatrix;
use crate::num::checked::Finite;
use crate::sheet::Sheet;

/// Parameters of a pressure in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pressure {
    /// The pressure p, force per area; positive pushes along the normals.
    pub value: Finite,
    /// Its factor in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
}

#[typetag::serialize(name = "pressure")]
impl EffectSpec for Pressure {
    fn needs(&self) -> Needs {
        Needs { out_of_plane: Some("kind"), ..Needs::default() }
    }

    fn time_dependence(&self, _: &Sheet, until: f64) -> TimeDependence {
        RampFactor::time_dependence_of(self.ramp.as_ref(), until)
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        super::cone::check_not_periodic(context.sheet)?;
        let factor = RampFactor::new(self.ramp.as_ref())?;
        let pressure = FollowerPressure::new(context.sheet, self.value.get());
        Ok(Effect::energy(FollowerPressure { factor, ..pressure }))
    }
}

crate::register_kind!(dyn EffectSpec, "pressure", Pressure);

/// Pressure on one sheet.
#[derive(Debug)]
pub struct FollowerPressure {
    cone: Cone,
    factor: RampFactor,
    /// Largest force on a vertex at rest.
    at_rest: f64,
}

impl FollowerPressure {
    /// On `sheet`, of the given value.
    #[must_use]
    pub fn new(sheet: &Sheet, pressure: f64) -> Self {
        let (reduction, rest) = (sheet.reduction(), sheet.rest());
        let mean_of = |chosen: &(dyn Fn(usize) -> bool + Sync)| -> Option<Vec3> {
            let [count, x, y, z] = reduction.sums(rest.len(), |range| {
                let chosen = range.filter(|i| chosen(*i));
                chosen.fold([0.0; 4], |[n, x, y, z], i| {
                    [n + 1.0, x + rest[i].x, y + rest[i].y, z + rest[i].z]
                })
            });
            (count > 0.0).then(|| Vec3::new(x, y, z) / count)
        };
        let apex = mean_of(&|i| sheet.boundary()[i]).or_else(|| mean_of(&|_| true));
        let apex = apex.unwrap_or_default();
        let mut force = vec![Vec3::zeros(); sheet.vertex_count()];
        for corners in sheet.triangles() {
            let [a, b, c] = corners.map(|v| sheet.rest()[v as usize]);
            for v in corners {
                force[*v as usize] += pressure / 6.0 * (b - a).cross(&(c - a));
            }
        }
        Self {
            cone: Cone { weight: -pressure, apex },
            factor: RampFactor::default(),
            at_rest: force.iter().map(nalgebra::Vector3::norm).fold(0.0, f64::max),
        }
    }

    /// With the pressure of the time.
    fn scaled_at(&self, time: f64) -> Cone {
        Cone { weight: self.factor.factor_at(time) * self.cone.weight, ..self.cone }
    }
}

impl Energy for FollowerPressure {
    type Work = ConeWork;

    fn name(&self) -> &'static str {
        "pressure"
    }

    fn coupling(&self) -> Coupling {
        Coupling::ONE_RING
    }

    fn reads(&self) -> Reads<'_> {
        Reads::time(self.factor.changes())
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        self.scaled_at(shape.time).evaluate(shape, work, gradient)
    }

    fn force_scales(&self, _: f64) -> ForceScales {
        let applied = self.factor.largest() * self.at_rest;
        ForceScales { applied, ..ForceScales::default() }
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        self.scaled_at(shape.time).add_hessian(shape, work, part, into);
    }
}
