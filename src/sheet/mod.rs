//! The sheet: rest positions and topology. It knows no field and no physics.

mod topology;

pub use topology::{Edge, Incidence, Sheet, SheetError};
