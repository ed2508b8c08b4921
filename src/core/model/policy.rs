//! Timescale policies: which of the two time derivatives is kept.
//!
//! ```text
//! w_x · drag · dx/dt = -∂U/∂x          w_c · dc/dt = D Δ_x c + R
//!
//! quasi-static     (0, 1)    the shape follows the chemistry at once
//! simultaneous     (1, 1)    both take their time
//! chemistry-fast   (1, 0)    the chemistry follows the shape at once
//! ```
//!
//! A policy is nothing but this pair of weights; effects never learn which one runs.

use serde::{Deserialize, Serialize};

/// Weights of the two rows of the mass matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassWeights {
    /// `w_x`, multiplies the drag.
    pub mechanics: f64,
    /// `w_c`.
    pub chemistry: f64,
}

/// A timescale policy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Mechanics without storage: equilibrium at every time.
    #[default]
    QuasiStatic,
    /// Both rows keep their derivatives.
    Simultaneous,
    /// Chemistry without storage: steady at every time.
    ChemistryFast,
}

impl Policy {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::QuasiStatic, Self::Simultaneous, Self::ChemistryFast];

    /// Its name in scenes and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::QuasiStatic => "quasi-static",
            Self::Simultaneous => "simultaneous",
            Self::ChemistryFast => "chemistry-fast",
        }
    }

    /// Its two weights.
    #[must_use]
    pub fn mass_weights(self) -> MassWeights {
        let (mechanics, chemistry) = match self {
            Self::QuasiStatic => (0.0, 1.0),
            Self::Simultaneous => (1.0, 1.0),
            Self::ChemistryFast => (1.0, 0.0),
        };
        MassWeights { mechanics, chemistry }
    }
}

/// What the shape of the first state is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The stable equilibrium that the overdamped motion leads to from the shape of the scene while it grows to the lengths
    /// of the first species: a dose that asks for much growth at once would crush the sheet.
    #[default]
    Equilibrium,
    /// The shape of the scene: the initial condition of a differential equation.
    Given,
}

/// Automatic stabilisation of a quasi-static shape by a small drag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stabilisation {
    /// Largest share of the energy supplied in a step that the drag takes up; the relative tolerance for none; 0 for one
    /// relaxation a step without drag.
    pub share: Option<f64>,
    /// The span of the run, the longest time scale of the chemistry.
    pub span: f64,
}

impl Default for Stabilisation {
    fn default() -> Self {
        Self { share: None, span: f64::INFINITY }
    }
}
