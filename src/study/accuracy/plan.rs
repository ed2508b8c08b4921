//! Which runs a study makes.

use std::path::Path;

use super::advice::Power;
use super::branch;
use super::request::TIGHTEST;
use super::{Line, Quantity, Role, Study};
use crate::kinetics::Search;
use crate::model::Policy;
use crate::num::checked::Positive;
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::study::choice::Choice;
use crate::study::sweep::{Axis, Plan, seeds};

/// What a user asks of a study.
#[derive(Debug, Clone)]
pub struct Options {
    /// Integrators, names or tables; the usual ones of the policy if there are none.
    pub integrators: Vec<String>,
    /// Tolerances.
    pub tolerances: Vec<Positive>,
    /// Force tolerances; that of the scene if there are none.
    pub forces: Vec<Positive>,
    /// Integrators of the references; those of the policy if there are none.
    pub references: Vec<String>,
    /// A study with its sweep whose references are taken.
    pub taken: Option<(Study, Plan)>,
    /// Further seeds.
    pub seeds: u16,
    /// Wall time of a run, s; references have `PATIENCE` times as much.
    pub limit: u64,
    /// The error that is wanted.
    pub wanted: f64,
    /// What it is wanted of.
    pub of: Option<Quantity>,
}

/// References are so many times tighter than the tightest tolerance.
const TIGHTER: f64 = 100.0;
/// The same of a staggered integrator, which is of second order.
const TIGHTER_STAGGERED: f64 = 10.0;
/// How much tighter the force tolerance of references is.
const TIGHTER_FORCES: f64 = 0.01;
/// Round-off leaves forces of some 1e-14.
const LEAST_FORCE: f64 = 1e-12;
/// References may take so many times as long as other runs.
pub const PATIENCE: u64 = 5;
/// What the first key is called.
pub const RUN: &str = "run";

/// What a policy is usually integrated by, without tolerances. The first is that of seeds.
fn usual(policy: Policy, moves: bool) -> &'static [&'static str] {
    const STAGGERED: &str = r#"{ kind = "staggered" }"#;
    const STAGGERED_EULER: &str = r#"{ kind = "staggered", method = "euler" }"#;
    const MINIMISED: &str = r#"{ kind = "staggered", shape = "euler" }"#;
    const BDF: &str = r#"{ kind = "monolithic", method = "bdf" }"#;
    const TR_BDF2: &str = r#"{ kind = "monolithic", method = "tr-bdf2" }"#;
    const ESDIRK34: &str = r#"{ kind = "monolithic", method = "esdirk34" }"#;
    const TSIT45: &str = r#"{ kind = "explicit", method = "tsit45" }"#;
    const EULER: &str = r#"{ kind = "explicit", method = "euler" }"#;
    match (policy, moves) {
        (Policy::QuasiStatic, true) => &[STAGGERED, BDF, ESDIRK34, STAGGERED_EULER],
        (Policy::QuasiStatic, false) => &[BDF, TR_BDF2, ESDIRK34, STAGGERED, STAGGERED_EULER],
        (Policy::Simultaneous, true) => {
            &[STAGGERED, MINIMISED, BDF, TR_BDF2, ESDIRK34, TSIT45, EULER]
        }
        (Policy::Simultaneous, false) => &[BDF, TR_BDF2, ESDIRK34, STAGGERED, TSIT45, EULER],
        (Policy::ChemistryFast, _) => &[STAGGERED, BDF, TR_BDF2, ESDIRK34],
    }
}

/// By what references are made, the best first, and how much tighter than the tightest tolerance.
const REFERENCES: [(&str, f64); 4] = [
    (r#"{ kind = "monolithic", method = "esdirk34" }"#, TIGHTER),
    (r#"{ kind = "monolithic", method = "bdf" }"#, TIGHTER),
    (r#"{ kind = "staggered" }"#, TIGHTER_STAGGERED),
    (r#"{ kind = "staggered", chemistry = "exponential" }"#, 0.5 * TIGHTER_STAGGERED),
];
/// Errors of kinetics alone grow with every period, and tight runs of them cost little.
const STILL_TIGHTER: f64 = 100.0;

/// One run: its role, its name, what it sets.
type Planned = (Role, String, Vec<String>);

impl Study {
    /// The runs that `options` ask for of the scene file `scene` with `set`, in every case that `others` make,
    /// and the sweep that makes them.
    ///
    /// # Errors
    /// Scenes that are not valid, integrators that are asked for and do not go with the scene.
    pub fn plan(
        scene: &Path,
        set: &[String],
        others: Vec<Axis>,
        search: &Search,
        options: &Options,
    ) -> Result<(Self, Plan)> {
        let first: Vec<String> = others.iter().flat_map(|axis| axis.overrides(0)).collect();
        let base: Vec<String> = set.iter().chain(&first).cloned().collect();
        let plain = Scene::varied(scene, set, &first)?;
        let (moves, vertices) = match Simulation::new(&plain, search) {
            Ok(simulation) => (simulation.model().moves(), simulation.model().sheet().rest().len()),
            // Its own integrator may not go with it: others may.
            Err(Error::Solve(SolveError::Pairing(_))) => (true, usize::MAX),
            Err(error) => return Err(error),
        };
        let mut left_out = Vec::new();
        let mut candidates = Vec::new();
        let asked = !options.integrators.is_empty();
        let usual = usual(plain.time.policy, moves).iter().map(|text| (*text).to_owned());
        let texts: Vec<String> = if asked { options.integrators.clone() } else { usual.collect() };
        for text in texts {
            let choice = Choice::read(scene, &base, &text, "--integrator")?;
            match fits(scene, &base, search, &choice, options)? {
                Some(why) if asked => return Err(Error::Refused(format!("{text}: {why}"))),
                Some(why) => left_out.push(format!("{}: {why}", choice.name)),
                None if candidates.contains(&choice) => {}
                None => candidates.push(choice),
            }
        }
        if candidates.is_empty() {
            let why = left_out.join("\n");
            return Err(Error::Refused(format!("no integrator goes with this scene:\n{why}")));
        }
        let force = plain.equilibrium.tolerance();
        let mut planned: Vec<Planned> = Vec::new();
        let forces: Vec<Option<Positive>> = match options.forces.is_empty() {
            true => vec![None],
            false => options.forces.iter().copied().map(Some).collect(),
        };
        let mut tolerances = options.tolerances.clone();
        tolerances.sort_by(|a, b| b.get().total_cmp(&a.get()));
        for (curve, choice) in candidates.iter().enumerate() {
            for tolerance in &tolerances {
                for force in &forces {
                    let mut sets = vec![choice.at(scene, &base, *tolerance)?];
                    let mut name = format!("{}, {}", choice.name, Power(tolerance.get()));
                    if let Some(force) = force {
                        sets.push(forced(force.get()));
                        name += &format!(", forces {}", Power(force.get()));
                    }
                    let (tolerance, force) = (tolerance.get(), force.map(Positive::get));
                    planned.push((Role::Point { curve, tolerance, force }, name, sets));
                }
            }
        }
        let tightest = tolerances.last().map_or(1e-4, |t| t.get());
        let tightest_force = forces.iter().flatten().map(|f| f.get()).fold(force, f64::min);
        match &options.taken {
            Some((study, plan)) => planned.extend(taken(study, plan)),
            None => {
                let force = moves.then_some(tightest_force);
                let (scene, tight) = ((scene, &base[..]), (tightest, force));
                let mut made = references(scene, search, options, tight, &mut left_out)?;
                if options.references.is_empty() {
                    made.retain(|(_, _, sets)| {
                        others.iter().all(|axis| allowed((scene.0, set), search, axis, sets))
                    });
                }
                if let Some(watched) = branch::watched(&plain, moves, vertices) {
                    made.iter_mut().for_each(|(_, _, sets)| sets.push(watched.clone()));
                }
                planned.extend(made);
            }
        }
        let found = if options.seeds > 0 { seeds(&plain)? } else { Vec::new() };
        if options.seeds > 0 && found.is_empty() {
            left_out.push("seeds: nothing in the scene is random".to_owned());
        }
        if !found.is_empty() {
            // Neither the loosest nor the tightest.
            let like = (1.min(tolerances.len() - 1)) * forces.len();
            for k in 1..=u64::from(options.seeds) {
                // Far from what people write.
                let seed = 1000 + k;
                let mut sets = planned[like].2.clone();
                sets.extend(found.iter().map(|path| format!("{path}={seed}")));
                planned.push((Role::Seed { seed, like }, format!("seed {seed}"), sets));
            }
        }
        let lines = candidates.iter();
        let line = |c: &Choice| Line { name: c.name.clone(), fixed_steps: c.fixed_steps };
        let study = Self {
            curves: lines.map(line).collect(),
            runs: planned.iter().map(|(role, _, _)| role.clone()).collect(),
            left_out,
            wanted: options.wanted,
            of: options.of,
        };
        let named = planned.into_iter().map(|(_, name, sets)| (name, sets)).collect();
        let axes = [Axis::named(RUN, named)].into_iter().chain(others).collect();
        let mut plan = Plan::new(scene, set, axes)?;
        plan.states = true;
        for member in &mut plan.members {
            let role = member.at.first().and_then(|k| study.runs.get(*k));
            let patience = if matches!(role, Some(Role::Reference { .. })) { PATIENCE } else { 1 };
            member.limit = Some(patience.saturating_mul(options.limit));
        }
        Ok((study, plan))
    }
}

fn forced(tolerance: f64) -> String {
    format!("equilibrium.tolerance={tolerance:?}")
}

/// The references of another study, as that has planned them.
fn taken(study: &Study, plan: &Plan) -> Vec<Planned> {
    let Some(axis) = plan.axes.first() else { return Vec::new() };
    let all = study.runs.iter().zip(&axis.values).zip(&axis.settings);
    let references = all.filter(|((role, _), _)| matches!(role, Role::Reference { .. }));
    references.map(|((role, name), sets)| (role.clone(), name.clone(), sets.clone())).collect()
}

/// References, tighter than `tightest` and, where sheets move, with forces more exact than `force`.
fn references(
    (scene, base): (&Path, &[String]),
    search: &Search,
    options: &Options,
    (tightest, force): (f64, Option<f64>),
    left_out: &mut Vec<String>,
) -> Result<Vec<Planned>> {
    let texts: Vec<(&str, f64)> = match options.references.is_empty() {
        true => REFERENCES.to_vec(),
        false => options.references.iter().map(|text| (text.as_str(), TIGHTER)).collect(),
    };
    let mut planned = Vec::new();
    // Without a sheet there are no forces.
    let still = if force.is_none() { STILL_TIGHTER } else { 1.0 };
    for (text, tighter) in texts {
        let read = Choice::read(scene, base, text, "--reference");
        let read = read.and_then(|c| Ok((fits(scene, base, search, &c, options)?, c)));
        let choice = match read {
            Ok((None, choice)) => choice,
            Ok((Some(why), choice)) => {
                left_out.push(format!("reference by {}: {why}", choice.name));
                continue;
            }
            // Nobody asked for it.
            Err(_) if options.references.is_empty() => continue,
            Err(error) => return Err(error),
        };
        let Some(tolerance) = Positive::new((tightest / (tighter * still)).max(TIGHTEST)) else {
            continue;
        };
        let mut sets = vec![choice.at(scene, base, tolerance)?];
        sets.extend(force.map(|f| forced(f.min((TIGHTER_FORCES * f).max(LEAST_FORCE)))));
        let name = format!("{}, {}", choice.name, Power(tolerance.get()));
        let method = choice.method().to_owned();
        let role = Role::Reference { name: name.clone(), method };
        planned.push((role, format!("reference: {name}"), sets));
    }
    Ok(planned)
}

/// Whether a scene may have `sets` with every value of `axis`, if that is of the integration in time.
fn allowed(
    (scene, set): (&Path, &[String]),
    search: &Search,
    axis: &Axis,
    sets: &[String],
) -> bool {
    let ready = |with: &[String], sets: &[String]| {
        let scene = Scene::varied(scene, with, sets).map_err(Error::from);
        scene.and_then(|scene| Simulation::new(&scene, search)).is_ok()
    };
    let fits = |k| {
        let with: Vec<String> = set.iter().cloned().chain(axis.overrides(k)).collect();
        ready(&with, sets) || !ready(&with, &[])
    };
    !axis.key.starts_with("time.") || (0..axis.values.len()).all(fits)
}

/// Why an integrator does not go with the scene, if it does not.
fn fits(
    scene: &Path,
    set: &[String],
    search: &Search,
    choice: &Choice,
    options: &Options,
) -> Result<Option<String>> {
    let Some(tolerance) = options.tolerances.first() else {
        return Err(Error::Refused("no tolerances are given".into()));
    };
    let scene = choice.scene(scene, set, *tolerance)?;
    match Simulation::new(&scene, search) {
        Ok(_) => Ok(None),
        Err(Error::Solve(SolveError::Pairing(why))) => Ok(Some(why)),
        Err(error) => Err(error),
    }
}
