//! The sheet: rest positions and topology. It knows no field and no physics.

mod attributes;
mod boundary_distance;
pub mod check;
mod enclosed;
pub mod generate;
pub mod partition;
mod periodic;
pub mod quality;
pub mod read;
mod surface;
mod topology;
pub mod write;

pub use check::Finding;
pub use enclosed::is_turned;
pub use generate::{Height, Lattice, SheetShape, generate, generate_graph};
pub use partition::Subdomain;
pub use quality::MeshReport;
pub use surface::{Array, Surface};
pub use topology::{Edge, Incidence, Sheet, SheetError};
