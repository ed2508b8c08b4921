//! What all runs of a study say together, and its files.

use std::path::Path;

use super::errors::Case;
use super::policies::{Policies, policies};
use super::{Study, advice, page, plots, report};
use crate::run::Result;
use crate::study::gather::{MemberStatus, status};
use crate::study::plan::Plan;
use crate::study::sweep::PLOT;
use crate::study::{draw, write_files};

/// Errors of all runs that there are, and what they say together.
pub struct Gathered<'a> {
    study: Study,
    plan: &'a Plan,
    cases: Vec<Case>,
    policies: Policies,
    /// Of every case.
    advice: Vec<String>,
    /// What is still to be made, if anything is.
    open: Option<String>,
    /// What is wrong with runs of other programs.
    faults: Vec<String>,
}

impl<'a> Gathered<'a> {
    pub(super) fn new(
        study: Study,
        (cases, faults): (Vec<Case>, Vec<String>),
        plan: &'a Plan,
        root: &Path,
    ) -> Self {
        let advice = cases.iter().map(|case| advice::advice(&study, case)).collect();
        let policies = policies(plan, &cases);
        Self { study, plan, cases, policies, advice, open: unfinished(plan, root), faults }
    }

    /// The advice in words.
    #[must_use]
    pub fn advice(&self) -> String {
        let named = self.cases.iter().zip(&self.advice);
        let text = |(case, advice): (&Case, &String)| match case.name.is_empty() {
            true => advice.clone(),
            false => format!("{}: {advice}", case.name),
        };
        self.open.iter().cloned().chain(named.map(text)).collect::<Vec<_>>().join("\n\n")
    }

    /// What is wrong with runs of other programs, which are left out for it: file, what was expected, what was found.
    #[must_use]
    pub fn faults(&self) -> &[String] {
        &self.faults
    }

    /// The table of all runs, with their errors and times.
    #[must_use]
    pub fn csv(&self) -> String {
        report::csv(&self.study, &self.cases)
    }

    /// Draws the plots, and writes them, the table and the reports into `root`.
    ///
    /// # Errors
    /// A plot that cannot be drawn, a file that cannot be written.
    pub fn write(&self, root: &Path) -> Result<()> {
        let Self { study, plan, cases, policies, advice, open, .. } = self;
        let [_, csv, md, html] = Study::FILES.map(str::to_owned);
        let mut files = vec![(csv, self.csv().into_bytes())];
        let mut drawings = plots::figures(study, plan, cases, policies);
        for drawing in &mut drawings {
            drawing.name = format!("{PLOT}{}", drawing.name);
            let drawn = draw::files(&drawing.name, &drawing.figure)?;
            drawing.svg = String::from_utf8_lossy(&drawn[0].1).into_owned();
            files.extend(drawn);
        }
        let blocks =
            report::blocks(study, plan, (cases, policies), (open.as_deref(), advice), drawings);
        files.push((md, page::markdown(&blocks).into_bytes()));
        files.push((html, page::html(&blocks).into_bytes()));
        write_files(root, files)
    }
}

/// What is still to be made, if anything is.
fn unfinished(plan: &Plan, root: &Path) -> Option<String> {
    let all = plan.members.len();
    let ended = |number: &usize| {
        let status = status(plan, &plan.directory(root, *number)).0;
        matches!(status, MemberStatus::Complete | MemberStatus::Failed)
    };
    let open = all - (0..all).filter(ended).count();
    (open > 0).then(|| {
        format!(
            "Incomplete: {open} of {all} runs are still to be made. What follows is of those that there are, and \
             may change; the same command goes on."
        )
    })
}
