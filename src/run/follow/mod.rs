//! Branches of equilibria of a scene along one of its keys: `rumple follow`.
//!
//! ```text
//! key       the number of the scene that is the parameter
//! family    the potential of the scene at every value of it
//! measures  numbers of a shape
//! record    table, frames, diagram
//! refusals  scenes and keys that have no branch
//! walk      one branch after another
//! ```
//!
//! The branches themselves are of [`crate::solve::continuation`].

mod diagram;
mod family;
mod key;
mod measures;
mod record;
mod refusals;
mod request;
mod row;
mod walk;

use std::sync::Arc;

use self::family::SceneFamily;
use self::key::Key;
pub use self::measures::Measure;
use self::record::BranchRecord;
pub use self::request::{FollowEvent, FollowSummary, Request};
use super::process::peak_resident;
use super::{Error, Result, Simulation, inspect, provenance};
use crate::Vec3;
use crate::kinetics::PluginSearch;
use crate::model::State;
use crate::output::{Interrupt, ResultDirectory};
use crate::scene::Scene;
use crate::sheet::Surface;
use crate::solve::Control;
use crate::solve::continuation::{Continuation, Settings, Unknowns};

/// A scene that is ready to be followed.
pub struct Follow {
    request: Request,
    key: Key,
    from: f64,
    search: PluginSearch,
    /// The scene at the first value.
    pub scene: Scene,
    /// The same, set up.
    pub simulation: Simulation,
    /// Whether the start is given, and not relaxed.
    given: bool,
}

impl Follow {
    /// Sets up the scene of `request`; nothing is written.
    ///
    /// # Errors
    /// A key, a value or a scene that has no branch, with what is meant.
    pub fn new(request: Request, search: &PluginSearch) -> Result<Self> {
        let Request { scene: file, set, along, to, .. } = &request;
        let key = Key::read(file, set, along, request.from.unwrap_or(*to))?;
        let Some(from) = request.from.or(key.value) else {
            let message = "the scene leaves this key out";
            let help = "give the value at which the branch begins by --from";
            return Err(Scene::load(file, set)?.error_at(&key.target, message, Some(help)).into());
        };
        if from == *to {
            let message =
                format!("--from and --to are both {to}: a branch needs a range of {along}");
            return Err(Error::Refused(message));
        }
        request.check(from)?;
        let scene = Scene::varied(file, set, &key.set(from), refusals::OPTION_NAME)?;
        let mut simulation = Simulation::new(&scene, search)?;
        refusals::check_scene(&scene, &simulation)?;
        if request.measure == Some(Measure::Volume) && simulation.sheet().boundary().contains(&true)
        {
            let message = "--measure volume: this sheet is open and encloses none; try height";
            return Err(scene.error_at("sheet", message, None).into());
        }
        if request.measure == Some(Measure::Mode) && request.switch == 0 {
            let message = "--measure along-mode: the mode is that of the first bifurcation with --switch; give that too";
            return Err(Error::Refused(message.into()));
        }
        let time = match request.time {
            Some(time) if key.is_time => {
                let message =
                    format!("--time {time}: with --along time the parameter is the time itself");
                return Err(Error::Refused(message));
            }
            _ if key.is_time => from,
            time => time.unwrap_or(scene.time.span.until.get()),
        };
        simulation.state_mut().time = time;
        let search = search.clone();
        let follow = Self { request, key, from, search, scene, simulation, given: false };
        follow.check_dependence()?;
        Ok(follow)
    }

    /// Takes the positions of `surface` as the start, in place of relaxing one.
    ///
    /// # Errors
    /// A state of another mesh.
    pub fn take_state(&mut self, surface: &Surface) -> Result<()> {
        inspect::take_state(&mut self.simulation, surface)?;
        self.given = true;
        Ok(())
    }

    fn family(&self) -> SceneFamily {
        SceneFamily {
            file: self.request.scene.clone(),
            set: self.request.set.clone(),
            key: self.key.clone(),
            sheet: Arc::clone(self.simulation.sheet()),
            time: self.simulation.state().time,
            tally: self.simulation.model().tally().clone(),
            search: self.search.clone(),
        }
    }

    /// Refuses a key that no energy and no fixed direction depends on.
    fn check_dependence(&self) -> Result<()> {
        let family = self.family();
        // Not at rest, so that moduli and rates matter.
        let rest = self.simulation.sheet().rest();
        let x: Vec<Vec3> = rest.iter().map(|x| x + 0.01 * Vec3::new(x.y, x.z, x.x)).collect();
        let mut at = Unknowns { x, species: self.simulation.state().species.clone() };
        let chemistry = self.simulation.model().chemistry();
        let described = chemistry.into_iter().flat_map(crate::model::Chemistry::all_typical);
        for (values, typical) in at.species.iter_mut().zip(described) {
            values.iter_mut().for_each(|c| *c += 0.01 * (c.abs() + typical));
        }
        if family.imbalance(self.from, &at)? == family.imbalance(self.request.to, &at)? {
            return Err(refusals::without_effect(&self.scene, &self.key.target));
        }
        Ok(())
    }

    fn settings(&self, simulation: &Simulation) -> Settings {
        let Request { to, within, first_step, longest_step, length, .. } = self.request;
        let ends = within.unwrap_or([to, to]);
        let low = ends.into_iter().fold(self.from.min(to), f64::min);
        let high = ends.into_iter().fold(self.from.max(to), f64::max);
        let usual = Settings::over(low..=high, simulation.model().mechanics());
        let length = length.unwrap_or(usual.length);
        let tolerance = simulation.force_tolerance();
        Settings { first_step, longest_step, length, tolerance, ..usual }
    }

    /// Follows the branches and writes them into `directory`; `listener` gets the progress.
    ///
    /// # Errors
    /// A start or a branch without equilibrium, an interruption, files that cannot be written.
    pub fn run(
        &mut self,
        directory: &ResultDirectory,
        listener: &mut dyn FnMut(FollowEvent<'_>),
        interrupt: Interrupt,
    ) -> Result<FollowSummary> {
        provenance::record(&self.scene, None, &self.simulation, directory)?;
        let control = Control::new(move || interrupt.requested(), |_| ());
        self.simulation.set_control(control.clone());
        let mut found = FollowSummary::default();
        let (family, settings) = (self.family(), self.settings(&self.simulation));
        let Self { request, scene, simulation, from, given, .. } = self;
        let (outcome, spent) = simulation.spend(|simulation| {
            if !*given {
                simulation.stepper.relax_to_steady_state()?;
            }
            let State { x, species, .. } = simulation.state();
            let start = Unknowns { x: x.to_vec(), species: species.clone() };
            let load = load(&family, [*from, request.to], &start)?;
            let fields = (simulation.fields.clone(), &scene.output);
            let of = (&family, (&**simulation.model(), &start), load);
            let record = BranchRecord::new(directory, fields, request, of);
            let told = (listener, &mut found);
            let forward = request.to > *from;
            if species.is_empty() {
                let start = (start.x, *from);
                let family = move |parameter| family.potential(parameter);
                let branch = Continuation::new(family, start, forward, settings, &control)?;
                walk::walk(request, branch, record, told)
            } else {
                let start = (start, *from);
                let family = move |parameter| family.model(parameter);
                let branch = Continuation::of_species(family, start, forward, settings, &control)?;
                walk::walk(request, branch, record, told)
            }
        });
        directory.claim().tell(|reached| {
            reached.time = simulation.state().time;
            reached.spent = spent;
            reached.peak_resident_bytes = peak_resident();
        });
        outcome.map(|()| found)
    }
}

/// The direction in which the key pushes the shape of `at` as it goes from one value to another: the difference of the
/// forces, if there is one.
fn load(family: &SceneFamily, ends: [f64; 2], at: &Unknowns) -> Result<Option<Vec<Vec3>>> {
    let [before, _] = family.imbalance(ends[0], at)?;
    let [after, _] = family.imbalance(ends[1], at)?;
    let force = before.plus(-1.0, &after).x;
    Ok(force.iter().any(|f| *f != Vec3::zeros()).then_some(force))
}
