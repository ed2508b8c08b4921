//! Linear solvers that a scene can name besides those of the engine: `equilibrium.preconditioner = "name"`.

use std::sync::{Arc, OnceLock};

use crate::linear::{BlockPattern, LinearError, LinearSolver};

/// Orders and analyses a pattern.
pub type Analyse = fn(&Arc<BlockPattern>) -> Result<Box<dyn LinearSolver>, LinearError>;

/// A linear solver with its name; see [`register_linear_solver!`](crate::register_linear_solver).
pub struct LinearSolverKind {
    /// The name.
    pub name: &'static str,
    /// How one is made.
    pub analyse: Analyse,
}

inventory::collect!(LinearSolverKind);

/// Registers a linear solver: `register_linear_solver!("faer-llt", FaerLlt::analyse)`, with a function from
/// `&Arc<BlockPattern>` to `Result<Box<dyn LinearSolver>, LinearError>`.
#[macro_export]
macro_rules! register_linear_solver {
    ($name:literal, $analyse:expr) => {
        $crate::registry::inventory::submit! {
            $crate::solve::linear_solvers::LinearSolverKind { name: $name, analyse: $analyse }
        }
    };
}

/// The registered solver of this name.
#[must_use]
pub fn find(name: &str) -> Option<&'static LinearSolverKind> {
    inventory::iter::<LinearSolverKind>.into_iter().find(|kind| kind.name == name)
}

/// The names of all registered solvers after those `of_the_engine`, sorted.
pub(super) fn names(of_the_engine: &[&'static str]) -> &'static [&'static str] {
    static NAMES: OnceLock<Vec<&'static str>> = OnceLock::new();
    NAMES.get_or_init(|| {
        let registered = inventory::iter::<LinearSolverKind>.into_iter().map(|kind| kind.name);
        let mut registered: Vec<_> = registered.collect();
        registered.sort_unstable();
        of_the_engine.iter().copied().chain(registered).collect()
    })
}
