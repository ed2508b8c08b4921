//! The stabilisation of quasi-static shapes as a setting of accuracy beside the tolerance.
//!
//! The drag that carries a quasi-static shape through instabilities has an error of its own. A study therefore varies the
//! largest share of the energy that it takes up, `time.stabilisation`, at fixed relative tolerances: curves that branch off
//! that of the integrator. The references are two runs whose stabilisations are ten times apart.

use serde::{Deserialize, Serialize};

use super::Role;
use super::advice::Scientific;
use super::plan::{Base, Planned, forced};
use crate::model::Policy;
use crate::num::checked::Positive;
use crate::run::{Error, Result};
use crate::scene::Scene;
use crate::study::plan::Axis;
use crate::study::plan::integrator::IntegratorChoice;

/// The key of the stabilisation.
const KEY: &str = "time.stabilisation";
/// The key of the policy.
const POLICY_KEY: &str = "time.policy";
/// Stabilisations that are studied if the user gives none.
const DEFAULT_SHARES: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];
/// Ratio between the stabilisations of the references, and of the looser of them to the least that is studied.
const REFERENCE_RATIO: f64 = 0.1;

/// The point of another curve at which the stabilisation is varied.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BranchPoint {
    /// Which of the curves.
    pub curve: usize,
    /// Its tolerance.
    pub tolerance: f64,
}

/// The stabilisations of a study.
pub(super) struct Stabilisations {
    /// Those at fixed tolerances, from large to small.
    shares: Vec<f64>,
    /// That of the scene; the relative tolerance for none.
    given: Option<f64>,
}

/// Takes the axis of the stabilisation out of `others`, whose values replace the default ones.
pub(super) fn take_axis(others: &mut Vec<Axis>) -> Option<Axis> {
    let at = others.iter().position(|axis| axis.key == KEY)?;
    Some(others.remove(at))
}

impl Stabilisations {
    /// Those of `scene`, or of the values `asked`; none where no shape is stabilised, or where `others` vary the policy.
    ///
    /// # Errors
    /// Values that are not numbers from 0 to 1.
    pub(super) fn of(
        scene: &Scene,
        moves: bool,
        asked: Option<&Axis>,
        others: &[Axis],
    ) -> Result<Option<Self>> {
        let varied = others.iter().any(|axis| axis.key == POLICY_KEY);
        if !moves || varied || scene.time.policy != Policy::QuasiStatic {
            return Ok(None);
        }
        let mut shares = match asked {
            None => DEFAULT_SHARES.to_vec(),
            Some(axis) => axis.numbers().ok_or_else(|| {
                let values = axis.values.join(",");
                Error::Refused(format!("--over {KEY}={values}: expected numbers from 0 to 1"))
            })?,
        };
        shares.sort_by(|a, b| b.total_cmp(a));
        let given = scene.time.span.stabilisation.map(f64::from);
        Ok(Some(Self { shares, given }))
    }

    /// Returns the stabilisation of `choice` at `tolerance`, if it is stabilised and none is set.
    pub(super) fn default_at(&self, choice: &IntegratorChoice, tolerance: f64) -> Option<f64> {
        is_stabilised(choice).then(|| self.given.unwrap_or(tolerance))
    }

    /// The stabilisations of the references, from small to large: below all that are studied at tolerances from
    /// `tightest`.
    pub(super) fn references(&self, tightest: f64) -> [f64; 2] {
        let studied = self.shares.iter().copied().filter(|share| *share > 0.0);
        let larger = REFERENCE_RATIO * studied.fold(tightest, f64::min);
        [REFERENCE_RATIO * larger, larger]
    }

    /// The runs of the first stabilised integrator at the middle and the tightest of `tolerances`, with the curves that
    /// they belong to; the first of these has the number `next`.
    pub(super) fn points(
        &self,
        base: &Base<'_>,
        candidates: &[IntegratorChoice],
        tolerances: &[Positive],
        next: usize,
    ) -> Result<(Vec<super::IntegratorCurve>, Vec<Planned>)> {
        let (mut curves, mut planned) = (Vec::new(), Vec::new());
        let Some(curve) = candidates.iter().position(is_stabilised) else {
            return Ok((curves, planned));
        };
        let choice = &candidates[curve];
        let mut fixed: Vec<Positive> = tolerances.get(1).into_iter().copied().collect();
        fixed.extend(tolerances.last().filter(|last| !fixed.contains(last)));
        let force = base.options.forces.iter().map(|f| f.get()).reduce(f64::min);
        for at in fixed {
            let tolerance = at.get();
            let name = format!("{}, rtol {}", choice.name, Scientific(tolerance));
            let usual = self.default_at(choice, tolerance);
            for share in self.shares.iter().copied().filter(|share| Some(*share) != usual) {
                let mut sets = vec![choice.at(base.scene, &base.set, at)?, stabilised(share)];
                sets.extend(force.map(forced));
                let (curve, stabilisation) = (next + curves.len(), Some(share));
                let role = Role::Point { curve, tolerance, force, stabilisation };
                planned.push((role, format!("{name}, stabilisation {}", Scientific(share)), sets));
            }
            let branches_off = Some(BranchPoint { curve, tolerance });
            let name = format!("{name}, stabilisation varied");
            curves.push(super::IntegratorCurve { name, fixed_steps: false, branches_off });
        }
        Ok((curves, planned))
    }
}

/// Whether steps of `choice` are stabilised and have a tolerance.
fn is_stabilised(choice: &IntegratorChoice) -> bool {
    choice.method().starts_with("staggered") && !choice.fixed_steps
}

/// The override that sets the stabilisation.
pub(super) fn stabilised(share: f64) -> String {
    format!("{KEY}={}", Scientific(share))
}
