//! How stiff the chemistry of a sheet is at its start, and which method suits it.
//!
//! ```text
//! S = ρ T        ρ the spectral radius of ∂(D Δc + R)/∂c, T the span of the run
//! ```
//!
//! An explicit method makes at least some S/3 evaluations, Runge-Kutta-Chebyshev some √S in each of a hundred steps of
//! the coupling; an implicit one solves a few linear systems in each of these whatever S is.

use super::{Result, Simulation};
use crate::scene::Scene;

/// The reaction is stiff beyond this S: of a relaxation oscillator on 1000 vertices with a species that follows at the
/// rate k, the stabilised explicit method takes a third of the time of BDF at S = 3e4, twice as much at 3e6 and nine times
/// at 3e8 (`models/kinetics/stiff-sheet.toml`).
const STIFF_RATIO: f64 = 1e6;
/// Below this S stability limits nothing.
const MILD_RATIO: f64 = 1e3;

/// What `rumple check` says of it, line by line; nothing without species or without space.
///
/// # Errors
/// If a law fails at the start.
pub fn lines(scene: &Scene, simulation: &mut Simulation) -> Result<Vec<String>> {
    if simulation.sheet().triangles().is_empty() {
        return Ok(Vec::new());
    }
    let Some([reaction, diffusion]) = simulation.evaluate().spectral_bounds()? else {
        return Ok(Vec::new());
    };
    let span = scene.time.span.until.get();
    let measured = format!(
        "at the start reactions act at rates up to {reaction:.1e}, diffusion up to {diffusion:.1e} per unit of time: {:.1e} and {:.1e} times the \
         span",
        reaction * span,
        diffusion * span
    );
    let advice = if reaction * span > STIFF_RATIO {
        "the reaction is stiff: time.integrator = { kind = \"staggered\", chemistry = \"bdf\" } or kind = \"monolithic\""
    } else if (reaction + diffusion) * span < MILD_RATIO {
        "not stiff: chemistry = \"chebyshev\" (the default of staggered) or \"tsit45\""
    } else {
        "chemistry = \"chebyshev\" (the default of staggered) suits it"
    };
    Ok(vec![measured, advice.to_owned()])
}
