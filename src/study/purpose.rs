//! What the members of a study are run for.

use std::path::Path;

use super::accuracy::Study;
use super::compare::{self, Comparison};
use super::gather::{MemberResults, MemberStatus, counted, counts, gather};
use super::plan::Plan;
use super::{sweep, write_files};
use crate::output::Interrupt;
use crate::output::plot;
use crate::run::{Error, Result};

/// What the members of a study are run for.
#[derive(Debug, Clone)]
pub enum Purpose {
    /// Measures of every member.
    Sweep,
    /// Distances from the first member.
    Compare,
    /// Errors relative to references.
    Accuracy(Study),
}

impl Purpose {
    /// Reads that of `plan` in `root`.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(plan: &Plan, root: &Path) -> Result<Self> {
        let compares = plan.axes.first().is_some_and(|axis| axis.key == compare::KEY);
        Ok(match Study::read(root)? {
            Some(study) => Self::Accuracy(study),
            None if compares => Self::Compare,
            None => Self::Sweep,
        })
    }

    /// The name of the command.
    #[must_use]
    pub fn command(&self) -> &'static str {
        match self {
            Self::Sweep => "sweep",
            Self::Compare => "compare",
            Self::Accuracy(_) => "accuracy",
        }
    }

    /// Does what comes before the members of `plan` in `root`; `say` is called with lines of results.
    pub(super) fn prepare(
        &self,
        (plan, root): (&Plan, &Path),
        say: &dyn Fn(&str),
        interrupt: Interrupt,
    ) -> Result<()> {
        match self {
            Self::Sweep => {}
            Self::Compare => {
                compare::timescales(plan, interrupt)?.iter().for_each(|text| say(text))
            }
            Self::Accuracy(study) => study.write(root)?,
        }
        Ok(())
    }

    /// Writes what there is of `plan` in `root`, and says it and how members stand.
    ///
    /// # Errors
    /// A file that cannot be written; as for [`Purpose::standing`].
    pub fn show(&self, plan: &Plan, root: &Path, say: &dyn Fn(&str), all: bool) -> Result<String> {
        let found = gather(plan, root);
        let page = match self {
            Self::Sweep => sweep::page(plan, &found),
            Self::Compare => Comparison::read(plan, root)?.page(),
            Self::Accuracy(study) => study.page(plan, root),
        };
        sweep::write_tables(plan, &found, root)?;
        write_files(root, &page.files)?;
        plot::write(root, &page.blocks)?;
        say(page.said.trim_end());
        say(&format!("{}; tables and plots are in {}", counts(&found), root.display()));
        self.standing(&found, all)
    }

    /// Says how many of `members` have which status.
    ///
    /// # Errors
    /// [`Error::Incomplete`] if members failed or were killed; if `all` have to be complete, also if some are not. Runs of
    /// an accuracy study may fail, but references.
    pub fn standing(&self, members: &[MemberResults], all: bool) -> Result<String> {
        let lost = |found: &&MemberResults| match self {
            Self::Accuracy(_) => {
                matches!(found.status, MemberStatus::Killed | MemberStatus::Damaged)
            }
            _ => found.status.is_lost() || (all && !found.is_complete()),
        };
        let Some(first) = members.iter().find(lost) else {
            return match self {
                Self::Accuracy(study) if !study.has_reference(members) => Err(Error::Incomplete(
                    "no reference came to its end: errors are not known".into(),
                )),
                _ => Ok(counts(members)),
            };
        };
        Err(Error::Incomplete(format!(
            "{} of {} did not come to their end; the first: {}: {}: {}",
            members.iter().filter(lost).count(),
            counted(members.len()),
            first.name,
            first.status,
            first.reason
        )))
    }
}
