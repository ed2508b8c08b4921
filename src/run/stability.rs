//! The stability of one state in words, numbers and fields, for `inspect`.

use std::fmt;
use std::sync::Arc;

use serde_json::{Value, json};

use super::{Error, Result, Simulation};

use crate::output::{Field, Frame};
use crate::solve::stability::{Mode, Spectrum, Stability};

/// Unit of eigenvalues: stiffness per rest area.
pub(super) const EIGENVALUE_UNIT: &str = "force/length^3";

/// What is known about the stability of a state.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilityReport {
    /// Largest force on a vertex, in units of the force scale.
    pub residual: f64,
    /// Largest force that counts as rest.
    pub tolerance: f64,
    /// Eigenvalues and modes.
    pub spectrum: Spectrum,
}

impl StabilityReport {
    /// Evaluates the current state of `simulation`, with the `count` smallest eigenvalues.
    ///
    /// # Errors
    /// If the plugin fails, or the Hessian cannot be factorised, or the sheet has no energy.
    pub fn new(simulation: &mut Simulation, count: usize) -> Result<Self> {
        let tolerance = simulation.force_tolerance();
        let model = Arc::clone(simulation.model());
        if model.mechanics().is_empty() {
            let message = "the scene lists no effect with an energy: stability is undefined";
            return Err(Error::Refused(message.into()));
        }
        let x = simulation.stepper.state.x.clone();
        let mut at = simulation.evaluate();
        let residual = at.residual()?;
        let potential = at.potential()?;
        let spectrum = Stability::new(model.mechanics())?.spectrum(potential, &x, count)?;
        Ok(Self { residual, tolerance, spectrum })
    }

    /// Whether the forces are small enough to speak of an equilibrium.
    #[must_use]
    pub fn is_equilibrium(&self) -> bool {
        self.residual <= self.tolerance
    }

    /// The verdict in one sentence.
    #[must_use]
    pub fn verdict(&self) -> String {
        let inertia = &self.spectrum.inertia;
        match (inertia.negative, inertia.rigid) {
            (n @ 1.., _) => format!("saddle: {}", directions(n)),
            _ if self.spectrum.is_marginal() => {
                "marginal: no direction lowers the energy, but one that is not a rigid motion \
                 leaves it unchanged"
                    .into()
            }
            (_, 0) => "stable: every direction raises the energy".into(),
            (_, 1) => {
                "stable up to 1 free rigid motion: every other direction raises the energy".into()
            }
            (_, n) => format!(
                "stable up to {n} free rigid motions: every other direction raises the energy"
            ),
        }
    }

    /// The same as JSON: `verdict`, `equilibrium`, `residual`, `negative`, `rigid`, `resolution`,
    /// `eigenvalues`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let inertia = &self.spectrum.inertia;
        let eigenvalues: Vec<f64> = self.spectrum.modes.iter().map(|m| m.eigenvalue).collect();
        json!({
            "verdict": self.verdict(),
            "equilibrium": self.is_equilibrium(),
            "residual": self.residual,
            "negative": inertia.negative,
            "rigid": inertia.rigid,
            "resolution": inertia.resolution,
            "eigenvalues": eigenvalues,
        })
    }
}

/// How many directions go down, in words.
#[must_use]
pub fn directions(negative: usize) -> String {
    match negative {
        0 => "no direction lowers the energy".into(),
        1 => "1 direction lowers the energy".into(),
        n => format!("{n} directions lower the energy"),
    }
}

impl fmt::Display for StabilityReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inertia = &self.spectrum.inertia;
        if !self.is_equilibrium() {
            writeln!(
                f,
                "warning    not an equilibrium: the largest force is {:.2e}, tolerance {:.1e}; \
                 relax first (--relax)",
                self.residual, self.tolerance
            )?;
        }
        writeln!(f, "{}", self.verdict())?;
        writeln!(f, "inertia    {} negative, {} rigid", inertia.negative, inertia.rigid)?;
        writeln!(f, "residual   {:.2e}", self.residual)?;
        writeln!(f, "resolution {:.2e} {EIGENVALUE_UNIT}", inertia.resolution)?;
        for (k, mode) in self.spectrum.modes.iter().enumerate() {
            writeln!(f, "mode {:<5} {:.9e} {EIGENVALUE_UNIT}", k + 1, mode.eigenvalue)?;
        }
        Ok(())
    }
}

/// Adds `modes` to a frame: a vector field each, and the eigenvalues as single numbers.
pub fn add_modes(frame: &mut Frame<'_>, modes: &[Mode]) {
    for (k, mode) in modes.iter().enumerate() {
        let name = format!("mode_{}", k + 1);
        frame
            .field_data
            .push((format!("eigenvalue of {name} [{EIGENVALUE_UNIT}]"), mode.eigenvalue));
        frame.point.push(Field::vector(name, &mode.shape));
    }
}
