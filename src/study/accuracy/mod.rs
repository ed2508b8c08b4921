//! What accuracy costs: one scene by several integrators at several tolerances, against references.
//!
//! ```text
//! DIR/sweep.json, members/    a sweep whose first key is which run it is: every other key makes a case
//! DIR/accuracy.json           what every run is for
//! DIR/accuracy.csv            every run: errors of every quantity, time, work
//! DIR/accuracy.md, .html      the report: advice, tables, plots
//! DIR/*.svg, *.png            the plots
//! ```
//!
//! A [`Study`] plans the runs. Two of every case are references by different methods, a hundred times
//! tighter than the tightest tolerance; how well they agree bounds what can be said of the others. From the
//! output time on at which they are apart, on different branches of a bifurcation, distances of fields mean
//! nothing and only measures are compared, with their spread over seeds as the yardstick.

mod advice;
mod branch;
mod errors;
mod norms;
mod page;
mod peers;
mod plan;
mod plots;
mod policies;
mod quantity;
mod report;
mod request;
mod results;
mod richardson;

pub use errors::{Case, Distance, Point, Reference, cases};
pub use plan::Options;
pub use quantity::Quantity;
pub use results::Gathered;

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::sweep::{Found, MemberStatus, Plan};
use crate::output::{OutputError, atomic};
use crate::run::{Error, Result};

/// What is studied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Integrators, a curve each.
    pub curves: Vec<Line>,
    /// The runs of every case, in the order of the first key's values.
    pub runs: Vec<Role>,
    /// What was left out, and why.
    pub left_out: Vec<String>,
    /// The error that the user can live with.
    pub wanted: f64,
    /// What the error is wanted of; the field that matters, or a measure where paths part, if not given.
    pub of: Option<Quantity>,
}

/// An integrator that is studied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Its name.
    pub name: String,
    /// Whether tolerances are steps, as a share of the whole time.
    pub fixed_steps: bool,
}

/// What a run is for.
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
    },
    /// A reference, the best first.
    Reference {
        /// What makes it.
        name: String,
        /// Its method. Two of one method do not confirm one another as well as two of different ones.
        method: String,
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
    pub const FILES: [&'static str; 4] =
        [Self::FILE, "accuracy.csv", "accuracy.md", "accuracy.html"];

    /// Reads that in `root`; none where there is none.
    ///
    /// # Errors
    /// If its file cannot be read.
    pub fn read(root: &Path) -> Result<Option<Self>> {
        let path = root.join(Self::FILE);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(OutputError::Read { path, source }.into()),
        };
        serde_json::from_str(&text).map(Some).map_err(|error| {
            Error::Refused(format!("{}: is not what a study writes: {error}", path.display()))
        })
    }

    /// Writes it into `root`.
    ///
    /// # Errors
    /// From the operating system.
    pub fn write(&self, root: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        Ok(atomic::replace(&root.join(Self::FILE), |writer| writeln!(writer, "{text}"))?)
    }

    /// Whether every case has a reference that came to its end, or may still.
    #[must_use]
    pub fn has_references(&self, plan: &Plan, found: &[Found]) -> bool {
        let reference = |f: &&Found| {
            let role = f.at.first().and_then(|k| self.runs.get(*k));
            let lost = matches!(f.status, MemberStatus::Failed | MemberStatus::Killed);
            matches!(role, Some(Role::Reference { .. })) && !lost
        };
        let case = |f: &Found| f.at.get(1..).map(<[usize]>::to_vec);
        let cases: Vec<_> = found.iter().filter(reference).map(case).collect();
        plan.members.iter().all(|m| cases.contains(&m.at.get(1..).map(<[usize]>::to_vec)))
    }

    /// The runs that are references.
    fn references(&self, plan: &Plan) -> impl Iterator<Item = usize> {
        let reference = |at: &[usize]| {
            let role = at.first().and_then(|k| self.runs.get(*k));
            matches!(role, Some(Role::Reference { .. }))
        };
        let members = plan.members.iter().enumerate();
        let found: Vec<usize> = members.filter(|(_, m)| reference(&m.at)).map(|(k, _)| k).collect();
        found.into_iter()
    }

    /// Refuses the study in `other` if no reference of every case can be taken from it.
    ///
    /// # Errors
    /// A reference of another scene, mesh or law; none that is complete.
    pub fn can_adopt(&self, plan: &Plan, other: &Path) -> Result<()> {
        let case = |number: usize| plan.members[number].at.get(1..).map(<[usize]>::to_vec);
        let mut made = Vec::new();
        for number in self.references(plan) {
            if plan.made_in(number, other)?.is_some() {
                made.push(case(number));
            }
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

    /// Takes references that are complete over from the study in `other`, whose settings [`Options::taken`] gave
    /// this one, so that they are not made again.
    ///
    /// # Errors
    /// A reference of another scene, mesh or law; a file that cannot be copied.
    pub fn adopt(&self, plan: &Plan, root: &Path, other: &Path) -> Result<()> {
        self.references(plan).try_for_each(|number| plan.adopt(number, root, other))
    }

    /// Reads what there is of all runs: errors, and what they say together. Nothing is drawn or written.
    #[must_use]
    pub fn gather<'a>(&self, plan: &'a Plan, root: &Path) -> Gathered<'a> {
        let mut cases = cases(self, plan, root);
        let (mut study, faults) = self.with_peers(&mut cases, plan, root);
        study.left_out.extend(faults.iter().cloned());
        Gathered::new(study, (cases, faults), plan, root)
    }

    /// With the runs of other programs, if there are any, of a study of one case; what is wrong with others.
    fn with_peers(&self, cases: &mut [Case], plan: &Plan, root: &Path) -> (Self, Vec<String>) {
        let mut study = self.clone();
        let (peers, mut wrong) = peers::read(root);
        if let [case] = cases {
            for peer in peers {
                if let Some(why) = case.reference.as_ref().and_then(|r| peer.fault(&r.states)) {
                    wrong.push(why);
                    continue;
                }
                let known = study.curves.iter().position(|line| line.name == peer.integrator);
                let curve = known.unwrap_or_else(|| {
                    let name = peer.integrator.clone();
                    study.curves.push(Line { name, fixed_steps: peer.fixed_steps });
                    study.curves.len() - 1
                });
                errors::add_peer(case, curve, peer, plan, root, self);
            }
        } else if !peers.is_empty() {
            wrong.push(format!("{}: a study of several cases has no peers", peers::FOLDER));
        }
        (study, wrong)
    }
}
