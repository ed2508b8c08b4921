//! From a scene to a simulation, and from there to results.
//!
//! [`Simulation`] is a scene that is set up: the sheet is read or generated, plugins are loaded, every listed
//! effect is bound. It steps and can be asked for its state and energies. [`run`](run::run) steps it to
//! the end of the scene and shows every accepted state to [`Observer`]s: frames, ledger, stop rules.
//! [`inspect`] and [`stability`] inspect one state without running.

mod checkpoint;
mod costs;
mod error;
pub mod explain;
mod failure;
mod fields;
mod fingerprint;
pub mod follow;
mod initial_state;
pub mod inspect;
mod internal_variables;
mod invariants;
pub mod laws;
pub(crate) mod ledger_row;
mod lints;
mod main_loop;
mod mesh;
mod observe;
pub mod overview;
pub mod pattern;
mod planar;
mod process;
pub mod provenance;
pub mod ranks;
pub mod resume;
#[allow(clippy::module_inception)]
pub mod run;
mod scale_checks;
pub mod schedule;
mod self_intersection;
mod setup;
mod simulation;
pub mod stability;
mod stability_monitor;
pub mod stiffness;
mod summary;
mod typical_magnitudes;
mod warnings;

pub use checkpoint::Checkpoint;
pub use costs::Costs;
pub use error::{Error, Result};
pub use fields::Fields;
pub use invariants::BrokenInvariant;
pub use ledger_row::StepInfo;
pub use observe::{Observer, StopRules};
pub use setup::material;
pub(crate) use setup::model_with_start;
pub use simulation::Simulation;
pub use summary::{Ending, Summary};

pub(crate) use initial_state::field_values;
pub(crate) use mesh::{located, location, read_sheet};
pub(crate) use stability_monitor::stays_at_saddle;
