//! Errors of the runs of a study against its references.

use std::path::Path;

use super::reference::{Candidate, Reference, choose};
use super::{Quantity, Role, Study};
use crate::run::Simulation;
use crate::study::gather::{Measures, MemberResults, MemberStatus, Norm, Run, largest};
use crate::study::plan::Plan;
use crate::study::plan::integrator::set_options;

/// Values for all quantities of [`Quantity::ALL`].
pub(super) type OfQuantities = [Option<f64>; Quantity::ALL.len()];

/// The runs of one combination of the keys that are varied besides.
#[derive(Default)]
pub(super) struct Case {
    /// Keys and values; empty where nothing else is varied.
    pub(super) name: String,
    /// Reference of all runs; none if none completed.
    pub(super) reference: Option<Reference>,
    /// The runs that are compared.
    pub(super) points: Vec<Point>,
    /// For every quantity, half of the range that it has over the seeds, relative to the reference.
    pub(super) spread: OfQuantities,
    /// Count of seeds that completed.
    pub(super) seeds: usize,
    /// References that are of no use, and why.
    pub(super) lost: Vec<(String, String)>,
    /// Count of runs that have not ended.
    pub(super) open: usize,
}

/// One integrator at one tolerance.
pub(super) struct Point {
    /// Its overrides of the scene, as options of the command line.
    pub(super) settings: String,
    /// Which of the curves of the study.
    pub(super) curve: usize,
    /// Its tolerance.
    pub(super) tolerance: f64,
    /// Results of the run.
    pub(super) found: MemberResults,
    /// Its errors; none if it did not complete or without a reference.
    errors: OfQuantities,
}

/// Errors of `run` relative to `truth`: of fields the largest before references diverge at the time `diverged`.
pub(super) fn errors(norm: &Norm, run: &Run, truth: &Run, diverged: Option<f64>) -> OfQuantities {
    let course = norm.course(&run.states, &truth.states);
    let before = course.iter().filter(|d| d.time > 0.0 && diverged.is_none_or(|at| d.time < at));
    let fields = largest(before);
    Quantity::ALL.map(|quantity| match quantity {
        Quantity::Species => Some(fields.filter(|_| norm.has_species())?.1),
        Quantity::Shape => Some(fields.filter(|_| norm.shape_moves())?.0),
        measure => measure.error(&run.found.measures, &truth.found.measures),
    })
}

impl Point {
    /// The error of `quantity`, if the run completed.
    pub(super) fn error(&self, quantity: Quantity) -> Option<f64> {
        self.errors[quantity as usize]
    }
}

impl Case {
    /// Counts a run with this status.
    fn count(&mut self, status: MemberStatus) -> MemberStatus {
        self.open += usize::from(!matches!(status, MemberStatus::Complete | MemberStatus::Failed));
        status
    }

    /// Returns the uncertainty of the references in `quantity`: the noise floor of errors.
    pub(super) fn floor(&self, quantity: Quantity) -> Option<f64> {
        self.reference.as_ref()?.confirmed.as_ref()?.1[quantity as usize]
    }

    /// Quantities of which runs have errors.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let known = |q: &Quantity| self.points.iter().any(|p| p.error(*q).is_some());
        Quantity::ALL.into_iter().filter(known).collect()
    }
}

/// Everything that is known of the runs in `root`, case by case.
pub(super) fn cases(study: &Study, plan: &Plan, root: &Path) -> Vec<Case> {
    let mut all: Vec<&[usize]> = Vec::new();
    for member in &plan.members {
        if !all.iter().any(|at| at.get(1..) == member.at.get(1..)) {
            all.push(&member.at);
        }
    }
    all.into_iter().map(|at| case(study, plan, root, at)).collect()
}

fn case(study: &Study, plan: &Plan, root: &Path, at: &[usize]) -> Case {
    let members = plan.members.iter().enumerate().filter(|(_, m)| m.at.get(1..) == at.get(1..));
    let runs = members.filter_map(|(number, m)| {
        let run = *m.at.first()?;
        Some((run, study.runs.get(run)?, number))
    });
    let runs: Vec<(usize, &Role, usize)> = runs.collect();
    let norm = runs.first().and_then(|(.., number)| {
        let scene = plan.scene(*number).ok()?;
        Some(Norm::of(Simulation::new(&scene, &plan.search()).ok()?.model()))
    });
    let mut case = Case { name: plan.label(at, |k| k != 0), ..Case::default() };
    let (mut candidates, mut others) = (Vec::new(), Vec::new());
    for (number, role, member) in runs {
        let Role::Reference { name, method, stabilisation } = role else {
            others.push((number, role, member));
            continue;
        };
        let run = Run::read(plan, root, member);
        match case.count(run.found.status) {
            MemberStatus::Complete => {
                let (name, method, stabilisation) = (name.clone(), method.clone(), *stabilisation);
                candidates.push(Candidate { name, method, stabilisation, member, run });
            }
            MemberStatus::NotBegun => {}
            status => case.lost.push((name.clone(), format!("{status}: {}", run.found.reason))),
        }
    }
    case.reference =
        norm.as_ref().and_then(|n| choose(n, (plan, root), candidates, &mut case.lost));
    add_points(&mut case, norm.as_ref(), (plan, root), others);
    case
}

/// Adds the runs that are compared, and the spread over seeds.
fn add_points(
    case: &mut Case,
    norm: Option<&Norm>,
    (plan, root): (&Plan, &Path),
    runs: Vec<(usize, &Role, usize)>,
) {
    let like = runs.iter().find_map(|(_, role, _)| match role {
        Role::Seed { like } => Some(*like),
        _ => None,
    });
    let mut courses: Vec<Vec<Measures>> = Vec::new();
    for (number, role, member) in runs {
        let run = Run::read(plan, root, member);
        let complete = case.count(run.found.status) == MemberStatus::Complete;
        let Role::Point { curve, tolerance } = role else {
            case.seeds += usize::from(complete);
            courses.extend(complete.then_some(run.found.measures));
            continue;
        };
        if Some(number) == like && complete {
            courses.push(run.found.measures.clone());
        }
        let settings = plan.axes.first().and_then(|axis| axis.settings.get(number));
        let known = norm.zip(case.reference.as_ref()).filter(|_| complete);
        case.points.push(Point {
            settings: settings.map(|all| set_options(all)).unwrap_or_default(),
            curve: *curve,
            tolerance: *tolerance,
            errors: known
                .map(|(norm, truth)| errors(norm, &run, &truth.run, truth.diverged))
                .unwrap_or_default(),
            found: run.found,
        });
    }
    if let Some(reference) = case.reference.as_ref().filter(|_| case.seeds > 0) {
        let measures = &reference.run.found.measures;
        case.spread = Quantity::ALL.map(|quantity| quantity.spread(&courses, measures));
    }
}
