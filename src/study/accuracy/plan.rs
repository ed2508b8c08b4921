//! Plan of the runs of a study.

use std::path::Path;

use super::advice::Scientific;
use super::reference::stability_override;
use super::{IntegratorCurve, Quantity, Role, Study};
use crate::kinetics::PluginSearch;
use crate::model::{Model, Policy};
use crate::num::Short;
use crate::num::checked::Positive;
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::study::plan::integrator::IntegratorChoice;
use crate::study::plan::{Axis, Plan, seed_keys};

/// StudyOptions of a study.
#[derive(Debug, Clone)]
pub struct StudyOptions {
    /// Integrators, names or tables; the usual ones of the policy if there are none.
    pub integrators: Vec<String>,
    /// Tolerances.
    pub tolerances: Vec<Positive>,
    /// Integrators of the references; those of the policy if there are none.
    pub references: Vec<String>,
    /// Further seeds.
    pub seeds: u16,
    /// Wall time of a run, s; references have `PATIENCE` times as much.
    pub limit: u64,
    /// The target error.
    pub wanted: f64,
    /// Quantity of the target error.
    pub of: Option<Quantity>,
}

impl Default for StudyOptions {
    fn default() -> Self {
        let tolerances = [1e-1, 1e-2, 1e-3, 1e-4].into_iter().filter_map(Positive::new).collect();
        let (integrators, references) = (Vec::new(), Vec::new());
        Self { integrators, tolerances, references, seeds: 2, limit: 300, wanted: 0.01, of: None }
    }
}

/// The tightest tolerance that can be met: numbers of 64 bits have 16 digits, and an error is a difference.
const TIGHTEST_TOLERANCE: f64 = 1e-13;
/// References are so many times tighter than the tightest tolerance.
const REFERENCE_TIGHTENING: f64 = 100.0;
/// The same of a staggered integrator, which is of second order.
const STAGGERED_REFERENCE_TIGHTENING: f64 = 10.0;
/// Ratio between the stabilisations of the references, and of the looser of them to the least of other runs.
const REFERENCE_STABILISATION_RATIO: f64 = 0.1;
/// Ratio of the force tolerance of references to that of other runs.
const REFERENCE_FORCE_RATIO: f64 = 0.01;
/// Round-off leaves forces of some 1e-14.
const MIN_FORCE: f64 = 1e-12;
/// Errors of kinetics alone grow with every period, and tight runs of them cost little.
const STILL_TIGHTER: f64 = 100.0;
/// References may take so many times as long as other runs.
const PATIENCE: u64 = 5;
/// Name of the first key, which chooses the run.
const RUN: &str = "run";

/// Default integrators of a policy, without tolerances. The first is that of seeds.
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

/// By what references are made, the best first, and how much tighter than the tightest tolerance: the first two that go
/// with the scene.
const REFERENCES: [(&str, f64); 4] = [
    (r#"{ kind = "monolithic", method = "esdirk34" }"#, REFERENCE_TIGHTENING),
    (r#"{ kind = "monolithic", method = "bdf" }"#, REFERENCE_TIGHTENING),
    (r#"{ kind = "staggered" }"#, STAGGERED_REFERENCE_TIGHTENING),
    (r#"{ kind = "staggered", chemistry = "esdirk34" }"#, 0.5 * STAGGERED_REFERENCE_TIGHTENING),
];
/// Those of stabilised shapes: two whose stabilisations are ten times apart. The looser
/// stabilisation has the looser tolerance, so that their distance has both errors.
const STABILISED_REFERENCES: [(&str, f64); 2] = [
    (r#"{ kind = "staggered" }"#, STAGGERED_REFERENCE_TIGHTENING),
    (r#"{ kind = "staggered" }"#, 0.5 * STAGGERED_REFERENCE_TIGHTENING),
];

/// One run: its role, its name, what it sets.
type Planned = (Role, String, Vec<String>);

/// The scene that a study is of.
struct Base<'a> {
    scene: &'a Path,
    set: &'a [String],
    search: &'a PluginSearch,
    options: &'a StudyOptions,
    /// Integrators and references that are left out, and why.
    left_out: Vec<String>,
}

impl Study {
    /// The runs that `options` ask for of the scene file `scene` with `set`, and the sweep that makes them.
    ///
    /// # Errors
    /// A scene that is not valid, integrators that are asked for and do not go with the scene, errors of what the scene has
    /// not, tolerances that nothing meets.
    pub fn plan(
        scene: &Path,
        set: &[String],
        search: &PluginSearch,
        options: &StudyOptions,
    ) -> Result<(Self, Plan)> {
        if let Some(t) = options.tolerances.iter().find(|t| t.get() < TIGHTEST_TOLERANCE) {
            return Err(Error::Refused(format!(
                "--tolerances {}: below {TIGHTEST_TOLERANCE:e}, which no run can meet in numbers of 16 digits",
                Short(t.get())
            )));
        }
        let plain = Scene::load(scene, set)?;
        let (moves, vertices, force) = size_and_tolerance(&plain, search, options.of)?;
        let mut base = Base { scene, set, search, options, left_out: Vec::new() };
        let candidates = base.candidates(usual(plain.time.policy, moves))?;
        let mut tolerances = options.tolerances.clone();
        tolerances.sort_by(|a, b| b.get().total_cmp(&a.get()));
        let mut planned = base.points(&candidates, &tolerances)?;
        let tightest = tolerances.last().map_or(1e-4, |t| t.get());
        let share = least_stabilisation(&plain, tightest).filter(|_| moves);
        let mut references = base.references(tightest, moves.then_some(force), share)?;
        let watch = stability_override(&plain, moves, vertices);
        references.iter_mut().for_each(|(_, _, sets)| sets.extend(watch.clone()));
        planned.extend(references);
        // Neither the loosest nor the tightest.
        base.add_seeds(&plain, 1.min(tolerances.len() - 1), &mut planned)?;
        let curve = |c: &IntegratorChoice| IntegratorCurve {
            name: c.name.clone(),
            fixed_steps: c.fixed_steps,
        };
        let study = Self {
            curves: candidates.iter().map(curve).collect(),
            runs: planned.iter().map(|(role, _, _)| role.clone()).collect(),
            left_out: base.left_out,
            wanted: options.wanted,
            of: options.of,
        };
        let named = planned.into_iter().map(|(_, name, sets)| (name, sets)).collect();
        let mut plan = Plan::new(scene, set, vec![Axis::named(RUN, named)])?;
        plan.states = true;
        for (member, role) in plan.members.iter_mut().zip(&study.runs) {
            let patience = if matches!(role, Role::Reference { .. }) { PATIENCE } else { 1 };
            member.limit = Some(patience.saturating_mul(options.limit));
        }
        Ok((study, plan))
    }
}

/// Whether the shape of `scene` moves, its number of vertices and the force tolerance; the most where its own integrator
/// does not go with it. Refuses errors `of` what the scene has not.
fn size_and_tolerance(
    scene: &Scene,
    search: &PluginSearch,
    of: Option<Quantity>,
) -> Result<(bool, usize, f64)> {
    match Simulation::new(scene, search) {
        Ok(simulation) => {
            let model = simulation.model();
            of.map_or(Ok(()), |of| of.check(model))?;
            Ok((model.moves(), model.sheet().rest().len(), simulation.force_tolerance()))
        }
        // Others may.
        Err(Error::Solve(SolveError::Pairing(_))) => {
            Ok((true, usize::MAX, scene.equilibrium.tolerance().without_loads()))
        }
        Err(error) => Err(error),
    }
}

/// The least stabilisation of runs at tolerances from `tightest`, which it follows; none where no shape is stabilised.
fn least_stabilisation(scene: &Scene, tightest: f64) -> Option<f64> {
    let given = scene.time.span.stabilisation.map(f64::from).filter(|share| *share > 0.0);
    (scene.time.policy == Policy::QuasiStatic).then(|| given.unwrap_or(tightest))
}

impl Quantity {
    /// Refuses it where `model` has nothing that it could be measured of.
    ///
    /// # Errors
    /// What the scene lacks.
    pub fn check(self, model: &Model) -> Result<()> {
        let lacks = match self {
            Self::Shape | Self::Amplitude | Self::Buckling if !model.moves() => {
                "nothing moves in this scene"
            }
            Self::Species | Self::Spots | Self::Separation if model.chemistry().is_none() => {
                "this scene has no species"
            }
            _ => return Ok(()),
        };
        Err(Error::Refused(format!("--of: {lacks}, so the {} has no error", self.name())))
    }
}

impl Base<'_> {
    /// The integrators that are asked for, or those of the `usual` ones that go with the scene.
    fn candidates(&mut self, usual: &[&str]) -> Result<Vec<IntegratorChoice>> {
        let asked = !self.options.integrators.is_empty();
        let texts: Vec<&str> = match asked {
            true => self.options.integrators.iter().map(String::as_str).collect(),
            false => usual.to_vec(),
        };
        let mut candidates = Vec::new();
        for text in texts {
            let choice = IntegratorChoice::read(self.scene, self.set, text, "--integrator")?;
            match self.fault(&choice, asked)? {
                Some(why) if asked => return Err(Error::Refused(format!("{text}: {why}"))),
                Some(why) => self.left_out.push(format!("{}: {why}", choice.name)),
                None if candidates.contains(&choice) => {}
                None => candidates.push(choice),
            }
        }
        if candidates.is_empty() {
            let why = self.left_out.join("\n");
            return Err(Error::Refused(format!("no integrator goes with this scene:\n{why}")));
        }
        Ok(candidates)
    }

    /// Every integrator at every tolerance.
    fn points(
        &self,
        candidates: &[IntegratorChoice],
        tolerances: &[Positive],
    ) -> Result<Vec<Planned>> {
        let mut planned = Vec::new();
        for (curve, choice) in candidates.iter().enumerate() {
            for at in tolerances {
                let sets = vec![choice.setting(self.scene, self.set, *at)?];
                let tolerance = at.get();
                let name = format!("{}, {}", choice.name, Scientific(tolerance));
                planned.push((Role::Point { curve, tolerance }, name, sets));
            }
        }
        Ok(planned)
    }

    /// References, tighter than `tightest` and, where sheets move, with forces more exact than `force`; two of stabilised
    /// shapes with stabilisations below `share`.
    fn references(
        &mut self,
        tightest: f64,
        force: Option<f64>,
        share: Option<f64>,
    ) -> Result<Vec<Planned>> {
        let asked = &self.options.references;
        let plain = |(text, tighter): &(&'static str, f64)| (*text, *tighter, None);
        let texts: Vec<(&str, f64, Option<f64>)> = match (asked.is_empty(), share) {
            (true, None) => REFERENCES.iter().map(plain).collect(),
            (true, Some(share)) => {
                let larger = REFERENCE_STABILISATION_RATIO * share.min(tightest);
                let shares = [REFERENCE_STABILISATION_RATIO * larger, larger];
                let pair = STABILISED_REFERENCES.iter().zip(shares);
                pair.map(|((text, tighter), share)| (*text, *tighter, Some(share))).collect()
            }
            (false, _) => {
                asked.iter().map(|text| (text.as_str(), REFERENCE_TIGHTENING, None)).collect()
            }
        };
        let mut planned = Vec::new();
        // Without a sheet there are no forces.
        let still = if force.is_none() { STILL_TIGHTER } else { 1.0 };
        for (text, tighter, stabilisation) in texts {
            if asked.is_empty() && planned.len() == 2 {
                break;
            }
            let read = IntegratorChoice::read(self.scene, self.set, text, "--reference");
            let choice = match read
                .and_then(|choice| Ok((self.fault(&choice, !asked.is_empty())?, choice)))
            {
                Ok((None, choice)) => choice,
                Ok((Some(why), choice)) => {
                    self.left_out.push(format!("reference by {}: {why}", choice.name));
                    continue;
                }
                // The user has not asked for it.
                Err(_) if asked.is_empty() => continue,
                Err(error) => return Err(error),
            };
            let tolerance = (tightest / (tighter * still)).max(TIGHTEST_TOLERANCE);
            let Some(tolerance) = Positive::new(tolerance) else { continue };
            let mut sets = vec![choice.setting(self.scene, self.set, tolerance)?];
            let force = force.map(|f| f.min((REFERENCE_FORCE_RATIO * f).max(MIN_FORCE)));
            sets.extend(force.map(|force| format!("equilibrium.tolerance={force:?}")));
            sets.extend(stabilisation.map(|s| format!("time.stabilisation={}", Scientific(s))));
            let mut name = format!("{}, {}", choice.name, Scientific(tolerance.get()));
            name.extend(stabilisation.map(|s| format!(", stabilisation {}", Scientific(s))));
            let title = format!("reference: {name}");
            planned.push((Role::Reference { name }, title, sets));
        }
        Ok(planned)
    }

    /// Adds the run `like` with other seeds, where anything in the scene is random.
    fn add_seeds(&mut self, scene: &Scene, like: usize, planned: &mut Vec<Planned>) -> Result<()> {
        let paths = if self.options.seeds > 0 { seed_keys(scene)? } else { return Ok(()) };
        if paths.is_empty() {
            self.left_out.push("seeds: nothing in the scene is random".to_owned());
            return Ok(());
        }
        // Far from what people write.
        for seed in (1001..).take(self.options.seeds.into()) {
            let seeds = paths.iter().map(|path| format!("{path}={seed}"));
            let sets = planned[like].2.iter().cloned().chain(seeds).collect();
            planned.push((Role::Seed { like }, format!("seed {seed}"), sets));
        }
        Ok(())
    }

    /// Why an integrator does not go with the scene, if it does not; an error, with its place, of one that is asked for.
    fn fault(&self, choice: &IntegratorChoice, asked: bool) -> Result<Option<String>> {
        let Some(tolerance) = self.options.tolerances.first() else {
            return Err(Error::Refused("no tolerances are given".into()));
        };
        let scene = choice.scene(self.scene, self.set, *tolerance)?;
        match Simulation::new(&scene, self.search) {
            Ok(_) => Ok(None),
            Err(Error::Solve(SolveError::Pairing(why))) => Ok(Some(why)),
            // With its own integrator the scene is valid.
            Err(Error::Scene(error)) if !asked => Ok(Some(error.message().to_owned())),
            Err(error) => Err(error),
        }
    }
}
