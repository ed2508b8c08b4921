//! Internal variables: numbers that an effect owns, with rates.
//!
//! ```text
//! dq/dt = f(q, x, l̄, t)          q: one number per vertex, edge or triangle
//! ```
//!
//! They are part of the [`State`](crate::model::State) and of checkpoints, and are integrated with the shape and the
//! species under one error control. What they do is up to the effect: they multiply optimal lengths
//! ([`InternalVariables::multiplies_lengths`]), or an energy reads them by name
//! ([`Conditions::internal`](crate::geometry::Conditions::internal)) when it is prepared: rest angles, a damage that
//! takes away stiffness. Without an effect that brings some, none are stored and nothing is computed.
//!
//! At a given shape an integrator solves for q alone, by a stabilised explicit method that needs a bound on the spectral
//! radius of `∂f/∂q`; what q and shape do to each other is seen by the error estimate of the step.

use crate::geometry::Shape;
use crate::kinetics::Location;
use crate::sheet::Sheet;

/// Internal variables that an effect owns: one number at every place.
pub trait InternalVariables: std::fmt::Debug + Send + Sync + 'static {
    /// What they are called in results and by energies that read them; no two of a scene are called the same.
    fn name(&self) -> &'static str;

    /// Where they are.
    fn location(&self) -> Location;

    /// The value at place number `i` of a sheet that nothing has happened to.
    fn initial(&self, i: usize) -> f64;

    /// The change of a value that matters: absolute tolerances are in units of it.
    fn typical(&self) -> f64 {
        1.0
    }

    /// Writes the rates f at `shape`, whose metric has the optimal lengths that go with `values`.
    fn rates(&self, shape: &Shape<'_>, values: &[f64], out: &mut [f64]);

    /// A bound on the spectral radius of the derivatives of f by the values at a given shape, 1/time.
    fn spectral_bound(&self) -> f64;

    /// Whether they are factors on the optimal lengths of the edges, where they then have to be; each is a positive
    /// number.
    fn multiplies_lengths(&self) -> bool {
        false
    }

    /// How many places there are on a sheet.
    fn count(&self, sheet: &Sheet) -> usize {
        match self.location() {
            Location::Vertex => sheet.vertex_count(),
            Location::Edge => sheet.edges().len(),
            Location::Face => sheet.triangle_count(),
        }
    }
}
