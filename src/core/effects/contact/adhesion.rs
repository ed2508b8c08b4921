//! Adhesion of a sheet to itself, or to a body with a smooth surface: a well of the distance.
//!
//! ```text
//! a(d) = -w (1 - u²)³,   u = d/r < 1;   0 beyond
//! a'(d) = 6 w/r u (1 - u²)²        at most 1.717 w/r, at d = r/√5
//! ```
//!
//! w is energy per rest area, r the range. a takes the place of the barrier in the sums over vertices and triangles of
//! `mod.rs`, or over vertices of `obstacle.rs`: two parallel sheets at a distance d pull on one another with the traction a'(d), whatever
//! their meshes. Edges do not stick to edges.
//!
//! Surfaces that a barrier b keeps apart rest where `a' + b' = 0`; the work of parting them is -(a + b) there, which is w where
//! the reach of the barrier is much smaller than r. A strip of rigidity D peels off where its curvature is κ = √(2w/D), while the length
//! (D r²/w)^¼ over which it comes off is small.
//!
//! Features whose distance at rest is below 2r, times how far the sheet is to shrink, do not stick to one another: they are
//! neighbours on the sheet.
//!
//! **Hessian.** Exact; the positive part has what acts across the gap, where a'' > 0.
//!
//! Potentials of this kind beside a barrier: Fang, Li, Jiang & Kaufman, *Augmented incremental potential contact for sticky
//! interactions*, IEEE Trans. Vis. Comput. Graph. (2023), doi:10.1109/TVCG.2023.3295656; theirs is of second order in
//! pieces. The curvature at the edge of what sticks: Majidi & Adams, *A simplified formulation of adhesion problems with elastic
//! plates*, Proc. R. Soc. A 465 (2009) 2217, doi:10.1098/rspa.2009.0060.

use serde::{Deserialize, Serialize};

use super::distance_potential::{DistancePotential, Well};
use super::obstacle::{Body, ObstacleDistance, check_ramp};
use super::{Contacts, ObstacleShape};
use crate::Vec3;
use crate::effects::{
    Effect, EffectContext, EffectError, EffectSpec, Needs, Ramp, RampFactor, SceneSummary,
};
use crate::geometry::lumped_areas;
use crate::kinetics::breakpoints::TimeDependence;
use crate::num::checked::{Finite, Positive};
use crate::sheet::Sheet;

/// Parameters of adhesion in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adhesion {
    /// w, energy per rest area.
    pub work: Positive,
    /// The range r, length.
    pub distance: Positive,
    /// What the sheet sticks to; itself without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<ObstacleShape>,
    /// Where that moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<[Finite; 3]>,
    /// The factor of the displacement in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
}

#[typetag::serialize(name = "adhesion")]
impl EffectSpec for Adhesion {
    fn needs(&self) -> Needs {
        let along_z = match &self.to {
            Some(ObstacleShape::Plane { normal, .. }) => normal[2].get() != 0.0,
            to => to.is_some(),
        };
        Needs { out_of_plane: along_z.then_some("to"), ..Needs::default() }
    }

    fn time_dependence(&self, _: &Sheet, until: f64) -> TimeDependence {
        RampFactor::time_dependence_of(self.ramp.as_ref(), until)
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let potential =
            DistancePotential::Well(Well { work: self.work.get(), reach: self.distance.get() });
        let refused = |key, message: &str, help: &str| {
            Err(EffectError { key, message: message.into(), help: Some(help.into()) })
        };
        let Some(to) = &self.to else {
            if self.displacement.is_some() || self.ramp.is_some() {
                let key = if self.ramp.is_some() { "ramp" } else { "displacement" };
                let message = "a sheet that sticks to itself has nothing that moves";
                return refused(key, message, "`to` says what else it sticks to");
            }
            return Ok(Effect::contact(Contacts::with_potential(context.sheet, potential)));
        };
        let form = ObstacleDistance::new(to).map_err(|error| EffectError { key: "to", ..error })?;
        let ObstacleDistance::Smooth(surface) = form else {
            let message = "a sheet does not stick to a mesh";
            return refused("to", message, "a plane, a sphere or a cylinder");
        };
        check_ramp(self.ramp.as_ref(), self.displacement.is_some())?;
        let factor = RampFactor::new(self.ramp.as_ref())?;
        let displacement =
            self.displacement.map_or(Vec3::zeros(), |d| Vec3::from(d.map(Finite::get)));
        let area = lumped_areas(context.sheet);
        Ok(Effect::contact(Body { surface, potential, displacement, factor, area }))
    }

    /// Surfaces that it pulls together where no effect keeps them apart.
    fn notes(&self, _: &EffectContext<'_>, scene: &SceneSummary<'_>) -> Vec<String> {
        let (to, missing, what) = match self.to {
            Some(_) => ("a body", "obstacle", "the sheet may pass into it"),
            None => ("the sheet itself", "contact", "surfaces may pass through one another"),
        };
        let note = format!(
            "it pulls the sheet to {to}, and nothing keeps them apart: {what}; list kind = \"{missing}\" as well"
        );
        if scene.effects.iter().any(|name| name == missing) { Vec::new() } else { vec![note] }
    }
}

crate::register_kind!(dyn EffectSpec, "adhesion", Adhesion);
