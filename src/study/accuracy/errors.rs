//! Errors of the runs of a study against its reference.

use std::path::Path;

use super::quantity::OfQuantities;
use super::reference::{Reference, errors};
use super::{Quantity, Role, Study};
use crate::run::Simulation;
use crate::study::gather::{MemberResults, MemberStatus, Norm, Run};
use crate::study::plan::Plan;
use crate::study::plan::integrator::set_options;

/// Everything that is known of the runs of a study.
#[derive(Default)]
pub(super) struct Assessment {
    /// Reference of all runs; none if none completed.
    pub(super) reference: Option<Reference>,
    /// The runs that are compared.
    pub(super) points: Vec<ComparedRun>,
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
pub(super) struct ComparedRun {
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

impl ComparedRun {
    /// The error of `quantity`, if the run completed.
    pub(super) fn error(&self, quantity: Quantity) -> Option<f64> {
        self.errors[quantity as usize]
    }
}

impl Assessment {
    /// Returns the uncertainty of the reference in `quantity`: the noise floor of errors.
    pub(super) fn floor(&self, quantity: Quantity) -> Option<f64> {
        self.reference.as_ref()?.confirmed.as_ref()?.1[quantity as usize]
    }

    /// Quantities of which runs have errors.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let known = |q: &Quantity| self.points.iter().any(|p| p.error(*q).is_some());
        Quantity::ALL.into_iter().filter(known).collect()
    }
}

/// Reads the runs of `study` in `root` and compares them with the reference.
pub(super) fn assess(study: &Study, plan: &Plan, root: &Path) -> Assessment {
    let mut all = Assessment::default();
    let Some(norm) = norm(plan) else { return all };
    let mut references = Vec::new();
    let roles = || study.runs.iter().enumerate();
    for (number, role) in roles() {
        let Role::Reference { name } = role else { continue };
        let run = Run::read(plan, root, number);
        match run.found.status {
            MemberStatus::Complete => references.push((name.clone(), number, run)),
            MemberStatus::NotBegun => all.open += 1,
            status => {
                all.open += usize::from(status != MemberStatus::Failed);
                all.lost.push((name.clone(), format!("{status}: {}", run.found.reason)));
            }
        }
    }
    all.reference = Reference::choose(&norm, (plan, root), references);
    let mut courses = Vec::new();
    let like = roles().find_map(|(_, role)| match role {
        Role::Seed { like } => Some(*like),
        _ => None,
    });
    for (number, role) in roles().filter(|(_, role)| !matches!(role, Role::Reference { .. })) {
        let run = Run::read(plan, root, number);
        let complete = run.found.is_complete();
        all.open += usize::from(!complete && run.found.status != MemberStatus::Failed);
        if complete && (Some(number) == like || matches!(role, Role::Seed { .. })) {
            courses.push(run.found.measures.clone());
        }
        let Role::Point { curve, tolerance } = *role else {
            all.seeds += usize::from(complete);
            continue;
        };
        let settings = plan.axes.first().and_then(|axis| axis.settings.get(number));
        let settings = settings.map(|all| set_options(all)).unwrap_or_default();
        let truth = all.reference.as_ref().filter(|_| complete);
        let errors = truth.map(|truth| errors(&norm, &run, &truth.run, truth.diverged));
        let (found, errors) = (run.found, errors.unwrap_or_default());
        all.points.push(ComparedRun { settings, curve, tolerance, found, errors });
    }
    if let Some(reference) = all.reference.as_ref().filter(|_| all.seeds > 0) {
        let measures = &reference.run.found.measures;
        all.spread = Quantity::ALL.map(|quantity| quantity.spread(&courses, measures));
    }
    all
}

/// The norm in which states of the scene of `plan` are compared.
fn norm(plan: &Plan) -> Option<Norm> {
    let scene = plan.scene(0).ok()?;
    Some(Norm::of_model(Simulation::new(&scene, &plan.search()).ok()?.model()))
}
