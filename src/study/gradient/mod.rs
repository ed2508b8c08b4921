//! Gradients of measures of an equilibrium, of a steady state, or of a run in time, by parameters of its scene.
//!
//! ```text
//! dJ/dp = ∂J/∂p + λ·∂g/∂p        λ by one solution with the transposed derivative (`solve/sensitivity`)
//! ```
//!
//! ∂g/∂p and ∂J/∂p are central differences of one evaluation at a fixed state (`differences`): exact to some 1e-9, whatever
//! effect or law the parameter is of. A gradient by thousands of parameters costs one relaxation and some hundred evaluations. Where a field
//! acts by the optimal lengths l̄ alone, as growth does, ∂²U/∂x∂l̄ of the effects is taken, and l̄ alone is differenced (`local`).
//!
//! [`Objective`] is J(p) with its gradient, for optimisation: inverse design and fits of what is at rest. The point is the
//! equilibrium at the end of the scene's time, with a law the steady state of shape and chemistry there; or the first equilibrium,
//! of the shape at the species that the scene begins with; or the states of a run at some times (`in_time`).
//!
//! Not covered: species on triangles of a sheet that moves, constraints, internal variables, periodic sheets, ranks.

mod course;
mod differences;
mod fixed;
mod in_time;
mod local;
mod measure;
mod objective;
mod parameter;
mod source;

pub use self::course::Course;
pub use self::measure::Measure;
pub use self::objective::{Evaluated, Objective, Place, Request};
pub use self::parameter::Parameter;
pub use self::source::SceneSource;
