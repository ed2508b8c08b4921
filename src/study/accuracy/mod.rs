//! Work-precision study: one scene by several integrators at several tolerances, against references.
//!
//! ```text
//! DIR/sweep.json, members/    a sweep whose first key is which run it is: every other key makes a case
//! DIR/accuracy.json           what every run is for
//! DIR/accuracy.csv            every run: errors of every quantity, time, work
//! DIR/accuracy.md             the report: advice and tables
//! DIR/plots.json              the same with plots, for the viewer
//! ```
//!
//! A [`Study`] plans the runs. Two of every case are references by different methods, a hundred times
//! tighter than the tightest tolerance; their distance is the noise floor of errors. From the
//! output time on at which they diverge, on different branches of a bifurcation, distances of fields have no
//! meaning and only measures are compared, with their spread over seeds as the yardstick.

mod advice;
mod errors;
mod peers;
mod plan;
mod plots;
mod policies;
mod quantity;
mod reference;
mod report;
mod request;
mod stabilisation;

pub use quantity::Quantity;
pub use request::{DEFAULT_REPEATS, Options};
pub use stabilisation::BranchPoint;

use std::path::Path;

use serde::{Deserialize, Serialize};

use self::advice::Scientific;
use self::errors::{Case, Point};
use self::peers::PeerRecord;
use self::policies::Policies;
use super::draw::table;
use super::gather::{MemberResults, MemberStatus, counts, status};
use super::plan::Plan;
use super::{read_document, write_document, write_files};
use crate::output::plot;
use crate::run::{Error, Result};

/// Plan of a work-precision study: integrators, the role of every run, target error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Integrators, a curve each.
    pub curves: Vec<IntegratorCurve>,
    /// The runs of every case, in the order of the first key's values.
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
    /// Where it branches off another curve, if the stabilisation is varied at one tolerance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub branches_off: Option<BranchPoint>,
}

impl IntegratorCurve {
    fn of(choice: &super::plan::integrator::IntegratorChoice) -> Self {
        Self { name: choice.name.clone(), fixed_steps: choice.fixed_steps, branches_off: None }
    }
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
        /// The force tolerance, if that is varied.
        force: Option<f64>,
        /// The stabilisation, if the shape is stabilised.
        stabilisation: Option<f64>,
    },
    /// A reference, the best first.
    Reference {
        /// Integrator and tolerance that make it.
        name: String,
        /// Its method. Two of one method do not confirm one another as well as two of different ones.
        method: String,
        /// Its stabilisation, if it is one of the two that differ in it.
        stabilisation: Option<f64>,
    },
    /// The same scene with other random numbers.
    Seed {
        /// Which.
        seed: u64,
        /// The run that it is compared with.
        like: usize,
    },
}

impl Study {
    /// Name of its file.
    pub const FILE: &'static str = "accuracy.json";
    /// Every file that it writes, but for plots.
    pub const FILES: [&'static str; 3] = [Self::FILE, "accuracy.csv", "accuracy.md"];

    /// Reads that in `root` with its members; none where there is none.
    ///
    /// # Errors
    /// If its files cannot be read.
    pub fn read(root: &Path) -> Result<Option<(Self, Plan)>> {
        let study = read_document(&root.join(Self::FILE), "study")?;
        Ok(study.zip(Plan::read(root)?))
    }

    /// Writes it into `root`.
    ///
    /// # Errors
    /// From the operating system.
    pub fn write(&self, root: &Path) -> Result<()> {
        write_document(&root.join(Self::FILE), self)
    }

    /// Whether the run with the values `at` of the keys is a reference.
    fn is_reference(&self, at: &[usize]) -> bool {
        let role = at.first().and_then(|k| self.runs.get(*k));
        matches!(role, Some(Role::Reference { .. }))
    }

    /// Whether every case has a reference that completed, or may still.
    fn has_references(&self, plan: &Plan, found: &[MemberResults]) -> bool {
        let lost =
            |f: &MemberResults| matches!(f.status, MemberStatus::Failed | MemberStatus::Killed);
        let references = || found.iter().filter(|f| self.is_reference(&f.at) && !lost(f));
        plan.members.iter().all(|m| references().any(|f| f.at.get(1..) == m.at.get(1..)))
    }

    /// Says how many of the runs that were `found` have which status.
    ///
    /// # Errors
    /// [`Error::Incomplete`] if a run was killed or is damaged, or if errors are not known.
    pub fn standing(&self, plan: &Plan, found: &[MemberResults]) -> Result<String> {
        for (status, what) in [
            (MemberStatus::Killed, "ended without a status"),
            (MemberStatus::Damaged, "damaged, to be rerun by the whole command"),
        ] {
            let such = || found.iter().filter(|f| f.status == status);
            if let Some(MemberResults { name, reason, .. }) = such().next() {
                let message = format!("{} {what}; the first: {name}: {reason}", such().count());
                return Err(Error::Incomplete(message));
            }
        }
        match self.has_references(plan, found) {
            true => Ok(counts(found)),
            false => {
                Err(Error::Incomplete("no reference came to its end: errors are not known".into()))
            }
        }
    }

    /// The members that are references.
    fn references(&self, plan: &Plan) -> impl Iterator<Item = usize> {
        (0..plan.members.len()).filter(|number| self.is_reference(&plan.members[*number].at))
    }

    /// Refuses the study in `other` if no reference of every case can be imported from it.
    ///
    /// # Errors
    /// A reference of another scene, mesh or law; none that is complete.
    pub fn check_import(&self, plan: &Plan, other: &Path) -> Result<()> {
        let case = |number: usize| plan.members[number].at.get(1..);
        let mut made = Vec::new();
        for number in self.references(plan) {
            made.extend(plan.completed_in(number, other)?.map(|_| case(number)));
        }
        match (0..plan.members.len()).find(|number| !made.contains(&case(*number))) {
            None => Ok(()),
            Some(number) => Err(Error::Refused(format!(
                "{}: has no reference that came to its end for {}: expected the directory of a study of this \
                 scene",
                other.display(),
                plan.name(number)
            ))),
        }
    }

    /// Imports the references that are complete in the study in `other`, whose settings [`Options::taken`] gave
    /// this one, so that they are not computed again.
    ///
    /// # Errors
    /// A reference of another scene, mesh or law; a file that cannot be copied.
    pub fn import(&self, plan: &Plan, root: &Path, other: &Path) -> Result<()> {
        self.references(plan).try_for_each(|number| plan.import(number, root, other))
    }

    /// Gathers the errors of all runs. Nothing is drawn or written.
    #[must_use]
    pub fn gather<'a>(&self, plan: &'a Plan, root: &Path) -> Gathered<'a> {
        let mut cases = errors::cases(self, plan, root);
        let (mut study, faults) = self.with_peers(&mut cases, root);
        study.left_out.extend(faults.iter().cloned());
        let advice = cases.iter().map(|case| advice::advice(&study, case)).collect();
        let policies = policies::policies(plan, &cases);
        Gathered { study, plan, cases, policies, advice, open: unfinished(plan, root), faults }
    }

    /// With the runs of other programs, if there are any, of a study of one case; the errors of others.
    fn with_peers(&self, cases: &mut [Case], root: &Path) -> (Self, Vec<String>) {
        let mut study = self.clone();
        let (peers, mut wrong) = peers::read(root);
        let [case] = cases else {
            if !peers.is_empty() {
                wrong.push(format!("{}: a study of several cases has no peers", peers::FOLDER));
            }
            return (study, wrong);
        };
        for peer in peers {
            if let Some(why) = case.reference.as_ref().and_then(|r| peer.fault(&r.run.states)) {
                wrong.push(why);
                continue;
            }
            let PeerRecord { integrator, tolerance, fixed_steps, .. } = peer.record;
            let point = format!("{integrator}, {}", Scientific(tolerance));
            let known = study.curves.iter().position(|line| line.name == integrator);
            let curve = known.unwrap_or(study.curves.len());
            if known.is_none() {
                study.curves.push(IntegratorCurve {
                    name: integrator,
                    fixed_steps,
                    ..IntegratorCurve::default()
                });
            }
            let (name, found) = (point, peer.found);
            case.add(Point { name, curve, tolerance, found, ..Point::default() }, &peer.states);
        }
        (study, wrong)
    }
}

/// Errors of all runs of a study, with tables, plots and advice.
pub struct Gathered<'a> {
    study: Study,
    plan: &'a Plan,
    cases: Vec<Case>,
    policies: Policies,
    /// Of every case.
    advice: Vec<String>,
    /// Note on the runs that are not complete, if there are any.
    open: Option<String>,
    /// Errors in the runs of other programs.
    faults: Vec<String>,
}

impl Gathered<'_> {
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

    /// Returns the errors for which runs of other programs are left out: file, what was expected, what was found.
    pub(crate) fn faults(&self) -> &[String] {
        &self.faults
    }

    /// The table of all runs, with their errors and times.
    #[must_use]
    pub fn csv(&self) -> String {
        report::csv(&self.study, &self.cases)
    }

    /// Writes the table and the report with its plots into `root`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, root: &Path) -> Result<()> {
        let Self { study, plan, cases, policies, advice, open, .. } = self;
        let [_, csv, md] = Study::FILES.map(str::to_owned);
        let drawings = plots::figures(study, plan, cases, policies);
        let blocks =
            report::blocks(study, plan, (cases, policies), (open.as_deref(), advice), drawings);
        plot::write(root, &blocks)?;
        let text = table::markdown(&blocks);
        write_files(root, vec![(csv, self.csv().into_bytes()), (md, text.into_bytes())])
    }
}

/// Note on the runs that are not complete, if there are any.
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
             may change; the same command continues."
        )
    })
}
