//! Errors of the runs of a study against its references.

use std::path::Path;

use super::reference::{Candidate, Reference, Run, choose};
use super::{Quantity, Role, Study};
use crate::model::State;
use crate::run::Simulation;
use crate::study::gather::{Distance, Measures, MemberResults, MemberStatus, Norm, read};
use crate::study::plan::Plan;
use crate::study::plan::integrator::set_options;
use crate::study::run::Timing;
use crate::tally::Work;

/// Values for all quantities.
type OfQuantities = [Option<f64>; Quantity::ALL.len()];

/// The runs of one combination of the keys that are varied besides.
#[derive(Default)]
pub(super) struct Case {
    /// Keys and values; empty where nothing else is varied.
    pub(super) name: String,
    /// Which values of the keys it has; of the first key, which chooses the run, that of any.
    pub(super) at: Vec<usize>,
    /// Norm of its fields; none if its scene can no longer be set up.
    pub(super) norm: Option<Norm>,
    /// Reference of all runs; none if none completed.
    pub(super) reference: Option<Reference>,
    /// The runs that are compared.
    pub(super) points: Vec<Point>,
    /// For every quantity, half of the range that it has over the seeds, relative to the reference.
    spread: OfQuantities,
    /// Count of seeds that completed.
    pub(super) seeds: usize,
    /// References that are of no use, and why.
    pub(super) lost: Vec<(String, String)>,
}

/// One integrator at one tolerance.
#[derive(Default)]
pub(super) struct Point {
    /// Its name.
    pub(super) name: String,
    /// Its overrides of the scene, as options of the command line.
    pub(super) settings: String,
    /// Which of the curves of the study.
    pub(super) curve: usize,
    /// Its tolerance.
    pub(super) tolerance: f64,
    /// Its force tolerance, if that is varied.
    pub(super) force: Option<f64>,
    /// Its stabilisation, if its shape is stabilised.
    pub(super) stabilisation: Option<f64>,
    /// Results of the run.
    pub(super) found: MemberResults,
    /// Its errors; none if it did not complete or without a reference.
    pub(super) errors: Option<Errors>,
}

/// Errors of a run relative to another.
pub(super) struct Errors {
    /// Of every quantity of [`Quantity::ALL`]: of fields the largest before the references diverge.
    of: OfQuantities,
    /// Distances along time.
    pub(super) course: Vec<Distance>,
}

impl Errors {
    /// Those of a run with `measures` and `states` relative to `truth`, from which references diverge at the time
    /// `diverged`.
    pub(super) fn new(
        norm: &Norm,
        (measures, states): (&[Measures], &[State]),
        truth: &Run,
        diverged: Option<f64>,
    ) -> Self {
        let course = norm.course(states, &truth.states);
        let before = |d: &&Distance| d.time > 0.0 && diverged.is_none_or(|at| d.time < at);
        let of = Quantity::ALL.map(|quantity| match quantity {
            Quantity::Species if !norm.has_species() => None,
            Quantity::Shape if !norm.shape_moves() => None,
            field if field.is_field() => {
                course.iter().filter(before).map(|d| d.of(field)).reduce(f64::max)
            }
            measure => measure.error(measures, &truth.found.measures),
        });
        Self { of, course }
    }

    /// The error of `quantity`.
    pub(super) fn get(&self, quantity: Quantity) -> Option<f64> {
        self.of[quantity as usize]
    }
}

impl Point {
    /// Processor time of its steps, s: the median where they were made several times.
    pub(super) fn seconds(&self) -> Option<f64> {
        self.found.timing.as_ref().map(Timing::median).filter(|seconds| seconds.is_finite())
    }

    /// The work of its steps.
    pub(super) fn work(&self) -> Option<Work> {
        Some(self.found.work? - self.found.start?)
    }

    /// Iterations of relaxations and of Newton's method in its steps, if they are counted.
    pub(super) fn iterations(&self) -> Option<u64> {
        let work = self.work().filter(|_| !self.is_peer())?;
        Some(work.iterations + work.newton_iterations)
    }

    /// The error of `quantity`, if the run completed.
    pub(super) fn error(&self, quantity: Quantity) -> Option<f64> {
        self.errors.as_ref()?.get(quantity)
    }

    /// Whether another program made it.
    pub(super) fn is_peer(&self) -> bool {
        self.found.at.is_empty()
    }

    /// Whether it completed.
    pub(super) fn is_complete(&self) -> bool {
        self.found.status == MemberStatus::Complete
    }
}

impl Case {
    /// The spread of `quantity` over seeds.
    pub(super) fn spread_of(&self, quantity: Quantity) -> Option<f64> {
        self.spread[quantity as usize]
    }

    /// The time from which on the references are on different branches, if they diverge.
    pub(super) fn diverged(&self) -> Option<f64> {
        self.reference.as_ref()?.diverged
    }

    /// Returns the uncertainty of the references in `quantity`: the noise floor of errors.
    pub(super) fn floor(&self, quantity: Quantity) -> Option<f64> {
        self.reference.as_ref()?.confirmed.as_ref()?.1.get(quantity)
    }

    /// Measures of the reference at the output times.
    pub(super) fn measures(&self) -> Option<&[Measures]> {
        Some(&self.reference.as_ref()?.run.found.measures)
    }

    /// Adds a run that came to `states`, with its errors.
    pub(super) fn add(&mut self, mut point: Point, states: &[State]) {
        if let (Some(norm), Some(reference)) = (&self.norm, &self.reference)
            && point.is_complete()
        {
            let run = (&point.found.measures[..], states);
            point.errors = Some(Errors::new(norm, run, &reference.run, reference.diverged));
        }
        self.points.push(point);
    }

    /// Chooses the reference among the complete ones; notes those that failed.
    fn find_reference(&mut self, plan: &Plan, root: &Path, runs: &[(usize, &Role, usize)]) {
        let mut candidates: Vec<Candidate> = Vec::new();
        for (_, role, number) in runs {
            let Role::Reference { name, method, stabilisation } = role else { continue };
            let run = Run::read(plan, root, *number);
            match run.found.status {
                MemberStatus::Complete => {
                    let (name, method) = (name.clone(), method.clone());
                    candidates.push(Candidate { name, method, stabilisation: *stabilisation, run });
                }
                MemberStatus::NotBegun => {}
                status => self.lost.push((name.clone(), format!("{status}: {}", run.found.reason))),
            }
        }
        if let Some(norm) = &self.norm {
            self.reference = choose(norm, (plan, root), candidates, &mut self.lost);
        }
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
    let model = runs.first().and_then(|(.., number)| {
        let scene = plan.scene(*number).ok()?;
        Some(Norm::of(Simulation::new(&scene, &plan.search()).ok()?.model()))
    });
    let name = plan.label(at, |k| k != 0);
    let mut case = Case { name, at: at.to_vec(), norm: model, ..Case::default() };
    case.find_reference(plan, root, &runs);
    let like = study.runs.iter().find_map(|role| match role {
        Role::Seed { like, .. } => Some(*like),
        _ => None,
    });
    let mut courses: Vec<Vec<Measures>> = Vec::new();
    for (run, role, number) in runs {
        match role {
            Role::Reference { .. } => {}
            Role::Point { curve, tolerance, force, stabilisation } => {
                let Run { found, states, .. } = Run::read(plan, root, number);
                if Some(run) == like && found.status == MemberStatus::Complete {
                    courses.push(found.measures.clone());
                }
                let axis = plan.axes.first();
                let name = axis.and_then(|a| a.values.get(run)).cloned().unwrap_or_default();
                let settings = axis.and_then(|a| a.settings.get(run)).map(|all| set_options(all));
                let settings = settings.unwrap_or_default();
                let (curve, tolerance, force) = (*curve, *tolerance, *force);
                let stabilisation = *stabilisation;
                let point = Point {
                    name,
                    settings,
                    curve,
                    tolerance,
                    force,
                    stabilisation,
                    found,
                    errors: None,
                };
                case.add(point, &states);
            }
            Role::Seed { like: of, .. } => {
                let found = read(plan, root, number);
                if found.status == MemberStatus::Complete {
                    case.seeds += 1;
                    courses.extend((Some(*of) == like).then_some(found.measures));
                }
            }
        }
    }
    if let Some(measures) = case.measures().filter(|_| case.seeds > 0) {
        case.spread = Quantity::ALL.map(|quantity| quantity.spread(&courses, measures));
    }
    case
}
