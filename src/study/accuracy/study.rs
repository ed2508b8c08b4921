//! Plan of a work-precision study.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::quantity::Quantity;
use crate::run::Result;
use crate::study::gather::{MemberResults, MemberStatus};
use crate::study::{read_document, write_document};

/// Plan of a work-precision study: integrators, the role of every run, target error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Integrators, a curve each.
    pub curves: Vec<IntegratorCurve>,
    /// The runs, in the order of the members.
    pub runs: Vec<Role>,
    /// Integrators and references that were left out, and why.
    pub left_out: Vec<String>,
    /// The target error.
    pub wanted: f64,
    /// Quantity of the target error; if not given, the field that matters, or a measure where references diverge.
    pub of: Option<Quantity>,
}

/// An integrator that is studied.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct IntegratorCurve {
    /// Its name.
    pub name: String,
    /// Whether tolerances are steps, as a share of the whole time.
    pub fixed_steps: bool,
}

/// Role of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// One integrator at one tolerance.
    Point {
        /// Which of the curves.
        curve: usize,
        /// Its tolerance.
        tolerance: f64,
    },
    /// A reference, the best first.
    Reference {
        /// Integrator and tolerance that make it.
        name: String,
    },
    /// The same scene with other random numbers.
    Seed {
        /// The run that it is compared with.
        like: usize,
    },
}

impl Study {
    /// Name of its file.
    pub const FILE: &'static str = "accuracy.json";
    /// Every file that it writes, but for plots.
    pub const FILES: [&'static str; 3] = [Self::FILE, "accuracy.csv", "accuracy.md"];

    /// Reads that in `root`; none where there is none.
    ///
    /// # Errors
    /// If its file cannot be read.
    pub fn read(root: &Path) -> Result<Option<Self>> {
        read_document(&root.join(Self::FILE), "study")
    }

    /// Writes it into `root`.
    ///
    /// # Errors
    /// From the operating system.
    pub fn write(&self, root: &Path) -> Result<()> {
        write_document(&root.join(Self::FILE), self)
    }

    /// Whether a reference completed, or may still.
    pub(in crate::study) fn has_reference(&self, found: &[MemberResults]) -> bool {
        let lost = |status| matches!(status, MemberStatus::Failed | MemberStatus::Killed);
        let mut runs = self.runs.iter().zip(found);
        runs.any(|(role, run)| matches!(role, Role::Reference { .. }) && !lost(run.status))
    }
}
