//! How a check ends.

use crate::KineticsError;

/// How a check ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Well, with what was inspected.
    Good(String),
    /// There was nothing to check.
    Skipped(String),
    /// Something is wrong.
    Fault(String),
}

pub(super) type Check = Result<Verdict, KineticsError>;
