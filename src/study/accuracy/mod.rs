//! Work-precision study: one scene by several integrators at several tolerances, against references.
//!
//! ```text
//! DIR/sweep.json, members/    a sweep whose only key is which run it is
//! DIR/accuracy.json           what every run is for
//! DIR/accuracy.csv            every run: errors of every quantity, time, work
//! DIR/accuracy.md             the report: advice and tables
//! ```
//!
//! A [`Study`] plans the runs. Two are references by different methods, a hundred times
//! tighter than the tightest tolerance; their distance is the noise floor of errors. From the
//! output time on at which they diverge, on different branches of a bifurcation, distances of fields have no
//! meaning and only measures are compared, with their spread over seeds as the yardstick.

mod advice;
mod errors;
mod plan;
mod quantity;
mod reference;
mod report;

pub use plan::StudyOptions;
pub use quantity::Quantity;

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::gather::{MemberResults, MemberStatus};
use super::plan::Plan;
use super::{Page, read_document, write_document};
use crate::run::Result;

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
    pub(super) fn has_reference(&self, found: &[MemberResults]) -> bool {
        let lost = |status| matches!(status, MemberStatus::Failed | MemberStatus::Killed);
        let mut runs = self.runs.iter().zip(found);
        runs.any(|(role, run)| matches!(role, Role::Reference { .. }) && !lost(run.status))
    }

    /// Gathers the errors of all runs of `plan` in `root`: the advice, a plot and a table.
    #[must_use]
    pub fn page(&self, plan: &Plan, root: &Path) -> Page {
        report::page(self, plan, &errors::assess(self, plan, root))
    }
}
