//! The sheet: rest positions and topology. It knows no field and no physics.

pub mod generate;
pub mod quality;
mod topology;

pub use generate::{Shape, generate};
pub use quality::MeshReport;
pub use topology::{Edge, Incidence, Sheet, SheetError};
