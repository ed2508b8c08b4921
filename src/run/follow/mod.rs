//! Branches of equilibria of a scene along one of its keys: `rumple follow`.
//!
//! ```text
//! key       the number of the scene that is the parameter
//! family    the potential of the scene at every value of it
//! measures  numbers of a shape
//! record    table, frames, diagram
//! ```
//!
//! The branches themselves are of [`crate::solve::continuation`].

mod diagram;
mod family;
mod key;
mod measures;
mod record;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use self::family::SceneFamily;
use self::key::Key;
pub use self::measures::Measure;
use self::record::Record;
use super::{Error, Result, Simulation, inspect, provenance};
use crate::Vec3;
use crate::kinetics::Search;
use crate::num::Short;
use crate::output::{Interrupt, ResultDirectory};
use crate::scene::Scene;
use crate::sheet::Surface;
use crate::solve::continuation::{Continuation, Event, Family, Point, Settings};
use crate::solve::{Control, continuation};

/// What is followed, and how.
#[derive(Debug, Clone)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// Overrides of it.
    pub set: Vec<String>,
    /// The key.
    pub along: String,
    /// Its first value; that of the scene if not given.
    pub from: Option<f64>,
    /// Its last value.
    pub to: f64,
    /// Further values of the range in which branches are followed, beyond those two.
    pub within: Option<[f64; 2]>,
    /// Time at which ramps and growth are evaluated; the end of the scene if not given.
    pub time: Option<f64>,
    /// Most steps of a branch.
    pub steps: usize,
    /// Arc length of the first step.
    pub first_step: f64,
    /// Arc length of the longest step.
    pub longest_step: f64,
    /// Displacement that counts as much as the whole range, if not a tenth of the square root of the area.
    pub length: Option<f64>,
    /// Bifurcations of the first branch at which another one is followed.
    pub switch: usize,
    /// Whether those are followed both ways.
    pub both_ways: bool,
    /// What the diagram shows.
    pub measure: Measure,
}

impl Request {
    /// Refuses a range and steps that mean nothing for a branch that begins at `from`.
    fn check(&self, from: f64) -> Result<()> {
        let Self { to, within, first_step, longest_step, .. } = *self;
        if let Some([least, largest]) = within
            && !(least <= from.min(to) && from.max(to) <= largest)
        {
            return Err(Error::Refused(format!(
                "--within {least} {largest}: the range is to hold the whole way from {from} to {to}, the least value first"
            )));
        }
        if first_step > longest_step {
            return Err(Error::Refused(format!(
                "--first-step {first_step} is longer than --longest-step {longest_step}"
            )));
        }
        Ok(())
    }
}

/// Message of a continuation in progress.
#[derive(Debug, Clone, Copy)]
pub enum News<'a> {
    /// A fold or a bifurcation.
    Event(&'a str),
    /// A step.
    Step(&'a str),
}

/// What was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Found {
    /// Points on all branches.
    pub points: usize,
    /// Branches.
    pub branches: usize,
    /// Folds and bifurcations, in words.
    pub events: Vec<String>,
}

/// A scene that is ready to be followed.
pub struct Follow {
    request: Request,
    key: Key,
    from: f64,
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
    pub fn new(request: Request, search: &Search) -> Result<Self> {
        let Request { scene: file, set, along, to, .. } = &request;
        let key = Key::read(file, set, along, request.from.unwrap_or(*to))?;
        let Some(from) = request.from.or(key.value) else {
            let message = format!(
                "--along {along}: the scene leaves this key out; give the value at which the branch begins by --from"
            );
            return Err(Error::Refused(message));
        };
        if from == *to {
            let message =
                format!("--from and --to are both {to}: a branch needs a range of {along}");
            return Err(Error::Refused(message));
        }
        request.check(from)?;
        let scene = Scene::varied_by(file, set, &key.set(from), key::OPTION)?;
        if !scene.kinetics.is_empty() {
            let message = "branches are those of mechanical equilibria, and this scene has species";
            let help = "leave out [kinetics] and effects on species, or sweep over the key with rumple sweep";
            return Err(scene.error_at("kinetics", message, Some(help)).into());
        }
        let mut simulation = Simulation::new(&scene, search)?;
        if !simulation.model().moves() {
            let message = "no effect of the scene has an energy: every shape is an equilibrium";
            return Err(scene.error_at("effect", message, None).into());
        }
        if let Some(term) = simulation.model().internal().first() {
            let message = format!(
                "branches are those of elastic equilibria, and the shape at rest of this scene changes with its history: {}",
                term.name()
            );
            let help = "leave out remodelling";
            return Err(scene.error_at("effect", &message, Some(help)).into());
        }
        continuation::check(simulation.model().mechanics())?;
        if request.measure == Measure::Volume && simulation.sheet().boundary().contains(&true) {
            let message = "--measure volume: this sheet is open and encloses none; try height";
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
        let follow = Self { request, key, from, scene, simulation, given: false };
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
        }
    }

    /// Refuses a key that no energy and no fixed direction depends on.
    fn check_dependence(&self) -> Result<()> {
        let mut family = self.family();
        let at = |family: &mut SceneFamily, parameter: f64| -> Result<(Vec<Vec3>, Vec<Vec3>)> {
            let mut potential = family.potential(parameter)?;
            // Not at rest, so that moduli matter.
            let rest = self.simulation.sheet().rest();
            let mut x: Vec<Vec3> =
                rest.iter().map(|x| x + 0.01 * Vec3::new(x.y, x.z, x.x)).collect();
            potential.mechanics().set_prescribed(potential.time(), &mut x);
            let mut gradient = vec![Vec3::zeros(); x.len()];
            potential.energy_gradient(&x, &mut gradient);
            Ok((x, gradient))
        };
        if at(&mut family, self.from)? == at(&mut family, self.request.to)? {
            let path = &self.request.along;
            let message = format!(
                "--along {path}: no force and no pin depends on this key; a branch is followed along a load, a modulus, a \
                 displacement of pins, or along the time of ramps and growth"
            );
            return Err(Error::Refused(message));
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
        listener: &mut dyn FnMut(News<'_>),
        interrupt: Interrupt,
    ) -> Result<Found> {
        provenance::record(&self.scene, None, &self.simulation, directory)?;
        let control = Control::new(move || interrupt.requested(), |_| ());
        self.simulation.set_control(control.clone());
        if !self.given {
            self.simulation.relax()?;
        }
        let start = (self.simulation.state().x.to_vec(), self.from);
        let forward = self.request.to > self.from;
        let (family, settings) = (self.family(), self.settings(&self.simulation));
        let closed = !family.sheet.boundary().contains(&true);
        let fields = (self.simulation.fields.clone(), &self.scene.output);
        let record =
            Record::new(directory, fields, &self.request.along, (self.request.measure, closed));
        let branch = Continuation::new(family, start, forward, settings, &control)?;
        let mut walk =
            Walk { request: &self.request, branch, record, listener, found: Found::default() };
        let outcome = walk.all();
        // What there is of a branch that is lost is drawn as well.
        let drawn = walk.record.write_diagram();
        outcome?;
        drawn?;
        Ok(walk.found)
    }
}

/// Branches that are being followed.
struct Walk<'a> {
    request: &'a Request,
    branch: Continuation<SceneFamily>,
    record: Record<'a>,
    listener: &'a mut dyn FnMut(News<'_>),
    found: Found,
}

impl Walk<'_> {
    /// The first branch, and those that it is left for.
    fn all(&mut self) -> Result<()> {
        let start = self.branch.point().clone();
        self.add(&[start])?;
        let bifurcations = self.follow()?;
        let ways: &[bool] = if self.request.both_ways { &[false, true] } else { &[false] };
        let mut left: VecDeque<(Point, usize, bool)> = VecDeque::new();
        for point in bifurcations.into_iter().take(self.request.switch) {
            let Event::Bifurcation(modes) = &point.event else { continue };
            let each = (0..modes.len()).flat_map(|k| ways.iter().map(move |way| (k, *way)));
            left.extend(each.map(|(k, way)| (point.clone(), k, way)));
        }
        while let Some((point, mode, reverse)) = left.pop_front() {
            self.found.branches += 1;
            let first = self.branch.switch(&point, mode, reverse)?;
            let start = Point { event: Event::Start, ..point };
            self.add(&[start])?;
            self.add(&first)?;
            self.follow()?;
        }
        self.found.branches += 1;
        Ok(())
    }

    /// Follows the branch to its end, or for so many steps; the bifurcations on it.
    fn follow(&mut self) -> Result<Vec<Point>> {
        let mut bifurcations = Vec::new();
        for _ in 0..self.request.steps {
            if self.branch.has_ended() {
                break;
            }
            let points = self.branch.advance()?;
            self.add(&points)?;
            bifurcations.extend(
                points.into_iter().filter(|point| matches!(point.event, Event::Bifurcation(_))),
            );
        }
        self.tell_end();
        Ok(bifurcations)
    }

    /// Says where the branch ended, and why.
    fn tell_end(&mut self) {
        let Request { along, to, steps, .. } = self.request;
        let (number, last) = (self.found.branches, self.branch.point().parameter);
        let at = six_digits(last);
        let text = if !self.branch.has_ended() {
            format!(
                "branch {number}: stops at {along} = {at} after {steps} steps; --steps lets it continue"
            )
        } else if last == *to {
            format!("branch {number}: reaches {along} = {at}")
        } else {
            format!(
                "branch {number}: leaves the range at {along} = {at}, and not at {to}; --within lets it continue"
            )
        };
        (self.listener)(News::Event(&text));
    }

    /// Records `points`.
    fn add(&mut self, points: &[Point]) -> Result<()> {
        let number = self.found.branches;
        self.record.add(self.branch.family(), number, points)?;
        for point in points {
            self.found.points += 1;
            let what = match &point.event {
                Event::Fold => "fold",
                Event::Bifurcation(_) => "bifurcation",
                _ => continue,
            };
            let [at, arc] = [point.parameter, point.arc].map(six_digits);
            let key = &self.request.along;
            let text = format!("branch {number}: {what} at {key} = {at}, arc length {arc}");
            (self.listener)(News::Event(&text));
            self.found.events.push(text);
        }
        if let Some(Point { parameter, negative, .. }) = points.last() {
            let (key, at, count) = (&self.request.along, six_digits(*parameter), self.found.points);
            let text = format!(
                "branch {number}: {count} points, {key} = {at}, {negative} negative eigenvalues"
            );
            (self.listener)(News::Step(&text));
        }
        Ok(())
    }
}

/// A number in six digits.
fn six_digits(value: f64) -> Short {
    Short(format!("{value:.5e}").parse().unwrap_or(value))
}
