//! Whether a policy is justified: how fast the shape relaxes against how fast the chemistry changes.

use std::sync::Arc;

use crate::geometry::{AreaRule, VertexArea};
use crate::num::real;
use crate::run::{Result, Simulation};
use crate::solve::stability::Stability;

/// Relaxation rate of the shape under drag and rate of change of the chemistry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timescales {
    /// Rate of the slowest mode of the shape, `λ/drag` per vertex, 1/time.
    pub shape_rate: f64,
    /// Largest rate of change of a species relative to its size, 1/time.
    pub chemistry_rate: f64,
}

impl Timescales {
    /// At the relaxed start of `simulation`: one factorisation with its modes.
    ///
    /// # Errors
    /// If the plugin fails, or the modes are not found.
    pub fn new(simulation: &mut Simulation) -> Result<Option<Self>> {
        let model = Arc::clone(simulation.model());
        if !model.moves() || model.chemistry().is_none() {
            return Ok(None);
        }
        let sheet = model.sheet();
        let drag = model.drag().mean_normal(sheet);
        let mut at = simulation.evaluate();
        let x = &at.state().x;
        let potential = at.potential()?;
        let spectrum = Stability::new(model.mechanics())?.spectrum(potential, x, 1)?;
        let area = VertexArea::new(sheet, AreaRule::Barycentric);
        let shape = potential.shape(x);
        let corners = |t: usize| area.corner_areas(&shape, t).iter().sum::<f64>();
        let total: f64 = (0..sheet.triangle_count()).map(corners).sum();
        let mean = total / real(sheet.vertex_count());
        let slowest = spectrum.modes.first().map_or(f64::NAN, |mode| mode.eigenvalue);
        let chemistry_rate = at.fastest_rate()?;
        Ok(Some(Self { shape_rate: slowest * mean / drag, chemistry_rate }))
    }

    /// Returns an assessment in a sentence.
    #[must_use]
    pub fn verdict(&self) -> String {
        let ratio = self.chemistry_rate / self.shape_rate;
        let sentence = if !(self.shape_rate > 0.0) {
            "the start is not stable: its softest mode grows rather than relaxes, and how fast it \
             does is up to the drag; quasi-static jumps to where it leads"
        } else if ratio < 0.01 {
            "the shape follows the chemistry at once: quasi-static is justified"
        } else if ratio < 0.3 {
            "the shape lags a little: the error of quasi-static goes with this ratio and is of its \
             size, not bounded by it"
        } else if ratio < 30.0 {
            "the slowest modes of the shape are no faster than the chemistry at its fastest: compare \
             quasi-static with simultaneous before you trust it"
        } else {
            "the slowest modes of the shape lag far behind the chemistry: quasi-static holds only where \
             they do not matter, and chemistry-fast only if the slowest rate of the chemistry is fast \
             too; compare both with simultaneous"
        };
        format!(
            "slowest mode of the shape {:.3e}, chemistry at its fastest {:.3e} per unit of time, ratio \
             {ratio:.2e}: \
             {sentence}",
            self.shape_rate, self.chemistry_rate
        )
    }
}
