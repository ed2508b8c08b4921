//! The volume that a closed sheet encloses, kept near a given one, or at it.
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
//! With `exact = true` in place of a stiffness the volume is a constraint,
//!
//! ```text
//! g = (V - V*)/V* = 0
//! ```
//!
//! met to 1e-9 at every equilibrium; its multiplier λ (in the ledger) is the energy `p V*`, so that
//! `p = λ/V*` is the pressure inside that it takes.
//!
//! **Derivatives.** `∂V/∂x_i = Σ_{T∋i} A_T n_T/3`, so the force is that of the pressure p. The second
//! derivatives are `-p ∂²V`, sparse (see the file `cone.rs`), and
//! `(κ/V*) ∂V ⊗ ∂V`, which couples all vertices and is of rank one.
//!
//! Not covered: open sheets; several chambers.

use serde::{Deserialize, Serialize};

use super::cone::{Cone, ConeWork};
use super::ramp::RampFactor;
use super::{
    BlockMatrix, Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy, HessianPart,
    Needs, Ramp, RankOneTerm, Reads,
};
use crate::Vec3;
use crate::geometry::{Shape, volume};
use crate::kinetics::breakpoints::TimeDependence;
use crate::num::Short;
use crate::num::checked::Positive;
use crate::sheet::Sheet;

/// Shares of the volume at rest that a target may begin with: a relaxation to others does not end.
const SHARES: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// Parameters of an enclosed volume in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Volume {
    /// The bulk modulus κ, force per area; none for an exact volume.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Positive>,
    /// Whether the volume is exactly the target.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub exact: bool,
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
    fn needs(&self) -> Needs {
        Needs { out_of_plane: Some("kind"), ..Needs::default() }
    }

    fn time_dependence(&self, _: &Sheet, until: f64) -> TimeDependence {
        RampFactor::time_dependence_of(self.ramp.as_ref(), until)
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let sheet = context.sheet;
        super::cone::check_not_periodic(sheet)?;
        let refuse = |key, message: &str, help: &str| {
            let (message, help) = (message.to_owned(), Some(help.to_owned()));
            Err(EffectError { key, message, help })
        };
        if sheet.reduction().any(sheet.boundary().contains(&true)) {
            return refuse(
                "kind",
                "a sheet with a boundary encloses no volume",
                "use shape = \"sphere\" or a closed mesh; on an open sheet use the effect pressure",
            );
        }
        let origin = centre(sheet);
        let at_rest = volume(sheet, sheet.rest(), origin);
        if !(at_rest > 0.0) {
            return refuse(
                "kind",
                &format!("the sheet at rest encloses the volume {at_rest}"),
                "its triangles must be counter-clockwise seen from outside, and it must not be flat",
            );
        }
        let target = match self.target {
            VolumeTarget::Share(share) => share.get() * at_rest,
            VolumeTarget::Value(value) => value.get(),
        };
        let factor = RampFactor::new(self.ramp.as_ref())?;
        let share = factor.factor_at(0.0) * target / at_rest;
        if share > 0.0 && !SHARES.contains(&share) {
            return refuse(
                if self.ramp.is_some() { "ramp" } else { "target" },
                &format!("the target volume at time 0 is {} of the volume at rest", Short(share)),
                "between 1e-6 and 1e6 of it; a ramp leads further away",
            );
        }
        if !(factor.factor_at(0.0) > 0.0) {
            return refuse(
                "ramp",
                "the target volume is not above 0 at time 0",
                "the ramp multiplies the target: 1 leaves it unchanged",
            );
        }
        let stiffness = self.stiffness.map(Positive::get);
        let enclosed = EnclosedVolume { stiffness, target, factor, origin };
        match (self.stiffness, self.exact) {
            (Some(_), false) => Ok(Effect::energy(enclosed)),
            (None, true) => Ok(Effect::constraint(enclosed)),
            (None, false) => refuse(
                "kind",
                "a volume needs a stiffness",
                "add stiffness = 100.0 (force per area), or exact = true",
            ),
            (Some(_), true) => refuse(
                "stiffness",
                "an exact volume has no stiffness",
                "leave out stiffness, or exact",
            ),
        }
    }
}

crate::register_kind!(dyn EffectSpec, "volume", Volume);

/// The mean of the vertices at rest.
fn centre(sheet: &Sheet) -> Vec3 {
    let (all, count) = (sheet.reduction(), sheet.vertex_count());
    let mean = |axis: usize| all.sum(count, |i| sheet.rest()[i][axis]) / all.count(count);
    Vec3::from([0, 1, 2].map(mean))
}

/// The volume that one closed sheet encloses: the energy `κ (V - V*)²/(2 V*)`, or, without a stiffness, the
/// constraint `(V - V*)/V* = 0`.
#[derive(Debug)]
pub struct EnclosedVolume {
    stiffness: Option<f64>,
    target: f64,
    factor: RampFactor,
    origin: Vec3,
}

impl EnclosedVolume {
    /// V* and `(V - V*)/V*`; neither is a number where the ramp leaves no volume.
    fn target_and_error(&self, shape: &Shape<'_>) -> (f64, f64) {
        let target = self.factor.factor_at(shape.time) * self.target;
        let target = if target > 0.0 { target } else { f64::NAN };
        (target, (volume(shape.sheet, shape.x, self.origin) - target) / target)
    }

    /// Its value, and the derivative of that by V.
    fn value(&self, shape: &Shape<'_>) -> (f64, f64) {
        let (target, excess) = self.target_and_error(shape);
        match self.stiffness {
            Some(stiffness) => (0.5 * stiffness * excess * excess * target, stiffness * excess),
            None => (excess, 1.0 / target),
        }
    }

    /// V times a weight.
    fn cone(&self, weight: f64) -> Cone {
        Cone { weight, apex: self.origin }
    }
}

impl Energy for EnclosedVolume {
    type Work = ConeWork;

    fn name(&self) -> &'static str {
        "volume"
    }

    fn coupling(&self) -> Coupling {
        Coupling { low_rank: self.stiffness.is_some(), ..Coupling::ONE_RING }
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
        let (value, slope) = self.value(shape);
        if gradient.is_some() {
            self.cone(slope).evaluate(shape, work, gradient);
        }
        // It is that of the whole sheet: one rank counts it.
        if shape.sheet.reduction().is_first() { value } else { 0.0 }
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let (_, slope) = self.value(shape);
        self.cone(slope).add_hessian(shape, work, part, into);
    }

    fn low_rank(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        _: HessianPart,
        terms: &mut Vec<RankOneTerm>,
    ) {
        let Some(stiffness) = self.stiffness else { return };
        let (target, _) = self.target_and_error(shape);
        let mut direction = vec![Vec3::zeros(); shape.x.len()];
        self.cone(1.0).evaluate(shape, work, Some(&mut direction));
        terms.push(RankOneTerm { stiffness: stiffness / target, direction });
    }
}
