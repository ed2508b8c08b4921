//! Why a computation failed, and what to try: inspects the state where it stuck.
//!
//! | cause | what is inspected |
//! | --- | --- |
//! | mesh | the triangle at rest that is longest for its height |
//! | load | the force on the whole sheet along motions that nothing holds; forces of effects on the sheet at rest; edges far beyond their optimal length |
//! | start | a sheet that is still flat where its triangles collapse |
//! | tolerance | how much of the force is round-off: what a change of all positions in their last digit makes of it; triangles that are held |
//! | unresolved chemistry | coefficients at which short waves grow without bound; a species that grows ever faster, or chatters; a fixed step beyond the limit of stability |
//!
//! What is cheap is inspected wherever a relaxation fails ([`relaxation`]); the rest where a run does.

mod chemistry;
mod shape;

use std::fmt;

pub use chemistry::{explicit_limit, explicit_limit_message, ill_posed, runaway};
pub(super) use shape::COLLAPSED;
pub(crate) use shape::net_force;
pub use shape::{blows_up, collapse, needle, relaxation, stretched, unbounded};

/// What kept work from its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Triangles that are much longer than high.
    Mesh,
    /// A force that nothing holds, or that is far beyond what the sheet can bear.
    Load,
    /// A start that is an equilibrium, but not a stable one.
    Start,
    /// A tolerance below what the force can be brought to.
    Tolerance,
    /// A chemistry that no step resolves.
    Chemistry,
}

/// Why, in words, and what to try.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// The kind.
    pub reason: Reason,
    /// The cause, with what is to blame.
    pub text: String,
    /// What to try.
    pub advice: String,
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.reason {
            Reason::Mesh => "the mesh",
            Reason::Load => "the load",
            Reason::Start => "the start",
            Reason::Tolerance => "the tolerance",
            Reason::Chemistry => "the chemistry",
        };
        write!(f, "the cause is {what}: {}; try {}", self.text, self.advice)
    }
}
