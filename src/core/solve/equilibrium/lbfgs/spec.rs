//! What a scene says about L-BFGS.

use serde::{Deserialize, Serialize};

use super::super::ForceTolerance;
use super::super::preconditioner::{FactorPrecision, Preconditioner};
use crate::num::checked::{AtLeast, Fraction, Positive};

/// Settings of [`Lbfgs`](super::Lbfgs); parameters of `equilibrium.method = "lbfgs"` in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LbfgsSpec {
    /// Largest force on a vertex that counts as rest.
    pub tolerance: ForceTolerance,
    /// Iterations after which a relaxation has failed.
    pub max_iterations: AtLeast<1>,
    /// Pairs remembered. More learn the soft directions sooner, each costs two products.
    pub memory: AtLeast<1>,
    /// Iterations after which the factor is renewed; without it 15, or 5 far from rest up to 6000
    /// vertices. A factorisation costs as much as two iterations at 2000 vertices, and as some ten at
    /// 20 000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refresh: Option<AtLeast<1>>,
    /// Largest move of a vertex in one step, in mean edge lengths. Small values follow the
    /// overdamped path more closely.
    pub largest_move: Positive,
    /// How the Hessian's positive part is inverted.
    pub preconditioner: Preconditioner,
    /// Precision of the factor.
    pub precision: FactorPrecision,
    /// No triangle's area may fall below this share in one step.
    pub area_share: Fraction,
    /// What to do when a triangle collapses; without it `hold` under drag, where the vertices are free again in
    /// the next step, and `stop` otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collapse: Option<Collapse>,
}

/// What to do when a triangle has lost its area and no step lowers the energy with it.
///
/// Where optimal lengths make no triangle, the energy is least where the triangle is flat, and has
/// a kink there: forces of finite size on both sides and no equilibrium in between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Collapse {
    /// Stop with an error that names the triangle.
    Stop,
    /// Hold its vertices for the rest of the relaxation, and count it in the ledger.
    Hold,
    /// Let it turn over, as codes do that do not inspect triangles: the energy jumps there. Where no step
    /// lowers it all the same, `Hold`.
    Turn,
}

impl Default for LbfgsSpec {
    fn default() -> Self {
        Self {
            tolerance: ForceTolerance::Auto,
            max_iterations: const { AtLeast::constant(3000) },
            memory: const { AtLeast::constant(20) },
            refresh: None,
            largest_move: Positive::ONE,
            preconditioner: Preconditioner::Auto,
            precision: FactorPrecision::Auto,
            area_share: const { Fraction::constant(0.4) },
            collapse: None,
        }
    }
}
