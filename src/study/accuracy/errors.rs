//! How far the runs of a study are from their references.

use std::path::Path;

use super::advice::Power;
use super::branch;
use super::norms::Yardstick;
use super::peers::Peer;
use super::{Quantity, Role, Study};
use crate::model::{Policy, State};
use crate::output::ResultDirectory;
use crate::study::choice::typed;
use crate::study::measures::Measures;
use crate::study::states;
use crate::study::sweep::{Found, MemberStatus, Plan, Timing, read};
use crate::tally::Work;

/// References that are further apart than this, relative to the fields, are on different paths.
const PARTED: f64 = 0.1;

/// The runs of one combination of the keys that are varied besides.
#[derive(Debug, Clone)]
pub struct Case {
    /// Keys and values; empty where nothing else is varied.
    pub name: String,
    /// Which values of the other keys it has.
    pub at: Vec<usize>,
    /// What others are compared with; none if no reference came to its end.
    pub reference: Option<Reference>,
    /// The runs that are compared.
    pub points: Vec<Point>,
    /// For every quantity, half of the range that it has over the seeds, relative to the reference.
    pub spread: [Option<f64>; Quantity::ALL.len()],
    /// How many seeds came to their end.
    pub seeds: usize,
    /// References that did not come to their end where there is none, and why.
    pub lost: Vec<(String, String)>,
}

/// What the runs of a case are compared with.
#[derive(Debug, Clone)]
pub struct Reference {
    /// What made it.
    pub name: String,
    /// Another one, and how far that is from it.
    pub confirmed: Option<(String, Errors)>,
    /// Whether both are of one method.
    pub alike: bool,
    /// The output time from which on the two are on different paths.
    pub parted: Option<f64>,
    /// The time from which on it is on a branch that has become unstable.
    pub unstable: Option<f64>,
    /// Whether nothing changes in it.
    pub still: bool,
    /// Measures at the output times.
    pub measures: Vec<Measures>,
    /// Processor time of its steps, s.
    pub seconds: Option<f64>,
    /// References that did not come to their end, and why.
    pub failed: Vec<(String, String)>,
    /// Other references that did, and how far they are from this one at most.
    pub others: Vec<(String, f64)>,
    /// The member of the sweep that it is.
    pub member: usize,
    /// Its states at the output times.
    pub states: Vec<State>,
}

/// One integrator at one tolerance.
#[derive(Debug, Clone)]
pub struct Point {
    /// Its name.
    pub name: String,
    /// What it sets in the scene, as options of the command line.
    pub settings: String,
    /// Which of the curves of the study.
    pub curve: usize,
    /// Its tolerance.
    pub tolerance: f64,
    /// Its force tolerance, if that is varied.
    pub force: Option<f64>,
    /// What is known of the run.
    pub found: Found,
    /// Its errors; none if it did not complete or there is no reference.
    pub errors: Option<Errors>,
}

/// How far a run is from another.
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// Of every quantity of [`Quantity::ALL`]: of fields the largest before paths part.
    pub of: [Option<f64>; Quantity::ALL.len()],
    /// Distances along time.
    pub course: Vec<Distance>,
}

/// Distance of two runs at an output time.
#[derive(Debug, Clone, Copy)]
pub struct Distance {
    /// The time.
    pub time: f64,
    /// Of the worst species.
    pub species: f64,
    /// Of shapes.
    pub shape: f64,
}

impl Distance {
    pub(super) fn largest(&self) -> f64 {
        self.species.max(self.shape)
    }
}

impl Errors {
    /// The error of `quantity`.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> Option<f64> {
        let k = Quantity::ALL.iter().position(|q| *q == quantity)?;
        self.of[k]
    }
}

impl Point {
    /// Processor time of its steps, s: the median where they were made several times.
    #[must_use]
    pub fn seconds(&self) -> Option<f64> {
        self.found.timing.as_ref().map(Timing::median).filter(|seconds| seconds.is_finite())
    }

    /// The work of its steps.
    #[must_use]
    pub fn work(&self) -> Option<Work> {
        Some(self.found.work? - self.found.start?)
    }

    /// The error of `quantity`, if the run came to its end.
    #[must_use]
    pub fn error(&self, quantity: Quantity) -> Option<f64> {
        self.errors.as_ref()?.get(quantity)
    }

    /// Whether another program made it.
    #[must_use]
    pub fn is_peer(&self) -> bool {
        self.found.at.is_empty()
    }

    /// Whether it came to its end.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.found.status == MemberStatus::Complete
    }
}

impl Case {
    /// The spread of `quantity` over seeds.
    #[must_use]
    pub fn spread_of(&self, quantity: Quantity) -> Option<f64> {
        let k = Quantity::ALL.iter().position(|q| *q == quantity)?;
        self.spread[k]
    }
}

/// Everything that is known of the runs in `root`, case by case.
#[must_use]
pub fn cases(study: &Study, plan: &Plan, root: &Path) -> Vec<Case> {
    let mut all: Vec<Vec<usize>> = Vec::new();
    for member in &plan.members {
        let at = member.at.get(1..).unwrap_or_default().to_vec();
        if !all.contains(&at) {
            all.push(at);
        }
    }
    all.into_iter().map(|at| case(study, plan, root, at)).collect()
}

/// A run and its states.
pub(super) struct Kept {
    pub(super) member: usize,
    pub(super) found: Found,
    pub(super) states: Vec<State>,
}

fn kept(plan: &Plan, root: &Path, member: usize) -> Kept {
    let found = read(plan, root, member, false);
    let states = states::read(&plan.directory(root, member).join(ResultDirectory::STATES));
    Kept { member, found, states }
}

fn case(study: &Study, plan: &Plan, root: &Path, at: Vec<usize>) -> Case {
    let others = plan.axes.iter().skip(1).zip(&at);
    let name = others.map(|(axis, k)| axis.label(*k)).collect::<Vec<_>>().join(", ");
    let member = |run: usize| {
        let same = |m: &&crate::study::sweep::Point| m.at[0] == run && m.at[1..] == at[..];
        plan.members.iter().position(|m| same(&m))
    };
    let runs = || study.runs.iter().enumerate().filter_map(|(k, role)| Some((k, role, member(k)?)));
    let mut references: Vec<(String, String, Kept)> = Vec::new();
    let mut failed = Vec::new();
    for (_, role, number) in runs() {
        let Role::Reference { name, method } = role else { continue };
        let kept = kept(plan, root, number);
        if kept.found.status == MemberStatus::Complete {
            references.push((name.clone(), method.clone(), kept));
        } else if kept.found.status != MemberStatus::NotBegun {
            failed.push((name.clone(), format!("{}: {}", kept.found.status, kept.found.reason)));
        }
    }
    // Rest shape and typical magnitudes are what differences are relative to.
    let yardstick = runs().next().and_then(|(_, _, number)| Yardstick::of(plan, number));
    let mut case = Case {
        name,
        at: at.clone(),
        reference: None,
        points: Vec::new(),
        spread: Default::default(),
        seeds: 0,
        lost: Vec::new(),
    };
    let mut truth: Option<Kept> = None;
    if let Some(yardstick) = &yardstick
        && let Some((first, second)) = yardstick.closest(&references)
    {
        let alike = second.is_some_and(|second| references[first].1 == references[second].1);
        // One that is elsewhere is on another path, however well two others agree.
        let mut parted: Option<f64> = None;
        let mut others = Vec::new();
        for (k, (name, _, other)) in references.iter().enumerate().filter(|(k, _)| *k != first) {
            let course = yardstick.course(&other.states, &references[first].2.states);
            if course.is_empty() {
                failed.push((name.clone(), "has no states at the same output times".to_owned()));
                continue;
            }
            let apart = course.iter().map(Distance::largest).fold(0.0, f64::max);
            if let Some(at) = course.iter().find(|d| d.largest() > PARTED) {
                parted = Some(parted.map_or(at.time, |earlier| earlier.min(at.time)));
            }
            if Some(k) != second {
                others.push((name.clone(), apart));
            }
        }
        let confirmed = second.map(|second| {
            let (name, _, second) = &references[second];
            (name.clone(), yardstick.errors(second, &references[first].2, parted))
        });
        let (name, _, first) = references.swap_remove(first);
        // Under drag shapes fall along negative-curvature directions all the time.
        let policy = plan.scene(first.member).map(|scene| scene.time.policy);
        let resting = matches!(policy, Ok(Policy::QuasiStatic));
        let unstable = resting.then(|| branch::unstable_from(&plan.directory(root, first.member)));
        case.reference = Some(Reference {
            name,
            parted,
            alike,
            unstable: unstable.flatten(),
            still: yardstick.is_still(&first.states, &first.found.measures),
            confirmed,
            measures: first.found.measures.clone(),
            seconds: first.found.timing.as_ref().map(Timing::median),
            failed: std::mem::take(&mut failed),
            others,
            member: first.member,
            states: first.states.clone(),
        });
        truth = Some(first);
    }
    case.lost = failed;
    let parted = case.reference.as_ref().and_then(|r| r.parted);
    let mut others: Vec<(usize, Vec<Measures>)> = Vec::new();
    for (run, role, number) in runs() {
        match role {
            Role::Reference { .. } => {}
            Role::Point { curve, tolerance, force } => {
                let kept = kept(plan, root, number);
                let ended = kept.found.status == MemberStatus::Complete;
                let errors = match (&truth, &yardstick) {
                    (Some(truth), Some(yardstick)) if ended => {
                        Some(yardstick.errors(&kept, truth, parted))
                    }
                    _ => None,
                };
                if ended {
                    others.push((run, kept.found.measures.clone()));
                }
                let axis = plan.axes.first();
                let name = axis.and_then(|a| a.values.get(run)).cloned().unwrap_or_default();
                let settings = axis.and_then(|a| a.settings.get(run)).map(|all| typed(all));
                let settings = settings.unwrap_or_default();
                let (curve, tolerance, force) = (*curve, *tolerance, *force);
                let found = kept.found;
                case.points.push(Point { name, settings, curve, tolerance, force, found, errors });
            }
            Role::Seed { like, .. } => {
                let found = read(plan, root, number, false);
                if found.status == MemberStatus::Complete {
                    case.seeds += 1;
                    others.push((*like, found.measures));
                }
            }
        }
    }
    if let Some(reference) = &case.reference
        && case.seeds > 0
    {
        let like = study.runs.iter().find_map(|role| match role {
            Role::Seed { like, .. } => Some(*like),
            _ => None,
        });
        let courses: Vec<&[Measures]> =
            others.iter().filter(|(run, _)| Some(*run) == like).map(|(_, m)| &m[..]).collect();
        case.spread = Quantity::ALL.map(|quantity| quantity.spread(&courses, &reference.measures));
    }
    case
}

/// Adds the run of another program to the only case of a study.
pub(super) fn add_peer(
    case: &mut Case,
    curve: usize,
    peer: Peer,
    plan: &Plan,
    root: &Path,
    study: &Study,
) {
    let name = format!("{}, {}", peer.integrator, Power(peer.tolerance));
    let Peer { tolerance, found, states, .. } = peer;
    let truth = case.reference.as_ref().and_then(|reference| {
        let named =
            |role: &Role| matches!(role, Role::Reference { name, .. } if *name == reference.name);
        let run = study.runs.iter().position(named)?;
        let number = plan.members.iter().position(|m| m.at.first() == Some(&run))?;
        Some((kept(plan, root, number), Yardstick::of(plan, number)?))
    });
    let run = Kept { member: 0, found: found.clone(), states };
    let errors =
        truth.filter(|_| found.status == MemberStatus::Complete).map(|(truth, yardstick)| {
            let parted = case.reference.as_ref().and_then(|r| r.parted);
            yardstick.errors(&run, &truth, parted)
        });
    let settings = String::new();
    case.points.push(Point { name, settings, curve, tolerance, force: None, found, errors });
}
