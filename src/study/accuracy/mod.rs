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
mod study;

pub use plan::StudyOptions;
pub use quantity::Quantity;
pub use study::{IntegratorCurve, Role, Study};

use std::path::Path;

use super::Page;
use super::plan::Plan;

impl Study {
    /// Gathers the errors of all runs of `plan` in `root`: the advice, a plot and a table.
    #[must_use]
    pub fn page(&self, plan: &Plan, root: &Path) -> Page {
        report::page(self, plan, &errors::assess(self, plan, root))
    }
}
