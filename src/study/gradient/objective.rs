//! J(p) of the equilibria of a scene, or of its run in time.

use std::sync::Arc;

use super::course::{Course, run_to_end};
use super::measure::Measure;
use super::parameter::{OPTION, Parameter};
use super::source::SceneSource;
use crate::geometry::lumped_areas;
use crate::kinetics::{Location, PluginSearch};
use crate::model::{Model, Positions, State};
use crate::run::{Error, Result, Simulation, model_with_start};
use crate::scene::Scene;
use crate::sheet::Sheet;
use crate::solve::Control;
use crate::solve::replay::Schedule;
use crate::solve::sensitivity::SteadyPoint;
use crate::tally::Tally;

/// What is differentiated by what.
#[derive(Debug, Clone)]
pub struct Request {
    /// The scene.
    pub scene: SceneSource,
    /// Its overrides.
    pub set: Vec<String>,
    /// Measures, whose sum is J.
    pub measures: Vec<String>,
    /// Keys of numbers.
    pub numbers: Vec<String>,
    /// Keys of fields.
    pub fields: Vec<String>,
    /// At which states.
    pub place: Place,
}

/// The states at which J is measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// The equilibrium, or steady state, at the end of the scene.
    End,
    /// The equilibrium that the scene begins with, at the species there.
    Start,
    /// Those of a run at these times, ascending, whose J are added; at its end without any.
    InTime(Vec<f64>),
}

/// J(p) of the equilibria of a scene.
pub struct Objective {
    request: Request,
    pub(super) search: PluginSearch,
    pub(super) control: Control,
    pub(super) sheet: Arc<Sheet>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) measures: Vec<Measure>,
    /// Where work at fixed states is counted.
    tally: Tally,
    /// Where the next relaxation begins.
    warm: Option<Positions>,
    /// The steps of the last replay of a run, with the times of J.
    pub(super) schedule: Option<(Schedule, Vec<f64>)>,
    /// Whether the first evaluation in time runs the scene too.
    pub(super) runs_scene: bool,
}

/// J at one p.
pub struct Evaluated {
    /// J.
    pub value: f64,
    /// p: one list a parameter.
    pub at: Vec<Vec<f64>>,
    /// Where it is measured.
    pub(super) found: Found,
    /// Whether J changes with rigid motions that nothing hinders.
    pub(super) moves: bool,
}

/// Where J is measured.
pub(super) enum Found {
    AtRest(Box<SteadyPoint>),
    InTime(Box<Course>),
}

impl Evaluated {
    /// The state at rest, or the last one of a course.
    #[must_use]
    pub fn state(&self) -> &State {
        match &self.found {
            Found::AtRest(point) => &point.point().state,
            Found::InTime(course) => course.last(),
        }
    }

    /// The course of a run in time.
    #[must_use]
    pub fn course(&self) -> Option<&Course> {
        match &self.found {
            Found::AtRest(_) => None,
            Found::InTime(course) => Some(course),
        }
    }

    /// Whether J changes with rigid motions that nothing hinders: it is differentiated as if they were held.
    #[must_use]
    pub fn changes_with_rigid_motions(&self) -> bool {
        self.moves
    }

    /// Number of directions in which the energy falls, if that is known: at a saddle a run does not stay.
    #[must_use]
    pub fn negative_modes(&self) -> Option<usize> {
        match &self.found {
            Found::AtRest(point) => point.negative_modes(),
            Found::InTime(_) => None,
        }
    }
}

impl Objective {
    /// Reads the scene, the measures and the parameters; nothing is relaxed yet.
    ///
    /// # Errors
    /// A scene, a measure or a key that is wrong, or a scene that is not covered.
    pub fn new(request: Request, search: PluginSearch, control: Control) -> Result<Self> {
        let Request { scene: source, set, .. } = &request;
        let scene = source.scene(set, &[], OPTION)?;
        let simulation = Simulation::new(&scene, &search)?;
        check(&scene, &simulation, &request.place)?;
        let sheet = Arc::clone(simulation.sheet());
        let on = (&scene, &simulation, &search);
        let numbers = request.numbers.iter().map(|key| Parameter::number((source, set), on, key));
        let fields = request.fields.iter().map(|key| Parameter::field((source, set), on, key));
        let parameters = numbers.chain(fields).collect::<Result<Vec<_>>>()?;
        Parameter::check_apart(&parameters)?;
        let of = |text: &String| Measure::parse("--measure", text, simulation.model());
        let measures = request.measures.iter().map(of).collect::<Result<Vec<_>>>()?;
        let tally = simulation.model().tally().clone();
        let objective = Self {
            request,
            search,
            control,
            sheet,
            parameters,
            measures,
            tally,
            warm: None,
            schedule: None,
            runs_scene: true,
        };
        objective.check_measures(simulation.model().chemistry().is_some())?;
        Ok(objective)
    }

    /// The parameters, numbers before fields.
    #[must_use]
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The sheet.
    #[must_use]
    pub fn sheet(&self) -> &Arc<Sheet> {
        &self.sheet
    }

    /// Rest area of every vertex, a third of that of its triangles.
    #[must_use]
    pub fn rest_areas(&self) -> Vec<f64> {
        lumped_areas(&self.sheet)
    }

    /// p in the scene: one list a parameter.
    #[must_use]
    pub fn values(&self) -> Vec<Vec<f64>> {
        self.parameters.iter().map(|parameter| parameter.value.clone()).collect()
    }

    /// Refuses measures whose derivatives are not covered.
    fn check_measures(&self, chemistry: bool) -> Result<()> {
        let whole = self.measures.iter().any(|measure| !measure.is_local());
        let field = self.parameters.iter().find(|parameter| parameter.is_field());
        if let (true, Some(field)) = (whole, field) {
            return Err(Error::Refused(format!(
                "--map {}: the energy is not known vertex by vertex: maps are of other measures",
                field.key
            )));
        }
        if whole && chemistry && self.request.place != Place::Start {
            let message =
                "the energy is covered at the start only: its derivative by species is unknown";
            return Err(Error::Refused(format!("--measure energy: {message}")));
        }
        Ok(())
    }

    /// The scene with the parameters `values`.
    pub(super) fn scene(&self, values: &[Vec<f64>]) -> Result<Scene> {
        let with = self.parameters.iter().zip(values).enumerate();
        let over: Vec<String> = with.clone().map(|(k, (p, value))| p.set(k, value)).collect();
        let mut scene = self.request.scene.scene(&self.request.set, &over, OPTION)?;
        with.for_each(|(k, (p, value))| p.give(k, value, (&mut scene, &self.sheet)));
        Ok(scene)
    }

    /// The model with the parameters `values`, and its start.
    pub(super) fn model(&self, values: &[Vec<f64>]) -> Result<(Model, State)> {
        model_with_start(&self.scene(values)?, &self.sheet, (&self.search, &self.tally))
    }

    /// Runs the scene with the parameters `values` to its end, and evaluates J at the equilibrium there.
    ///
    /// # Errors
    /// Values that the scene cannot have; a run that fails; an end at which nothing rests.
    pub fn evaluate(&mut self, values: &[Vec<f64>]) -> Result<Evaluated> {
        let scene = self.scene(values)?;
        let mut simulation = Simulation::on_sheet(&scene, &self.search, &self.sheet)?;
        simulation.set_control(self.control.clone());
        let runs = match self.request.place.clone() {
            Place::InTime(times) => {
                return self.evaluate_in_time(values, (&scene, simulation), &times);
            }
            place => place == Place::End,
        };
        match self.warm.take().filter(|_| !runs) {
            Some(warm) => simulation.prepare_near(warm)?,
            None => simulation.prepare()?,
        };
        if runs {
            run_to_end(&mut simulation, &scene)?;
        }
        let tolerance = simulation.force_tolerance();
        let (model, state) = (Arc::clone(simulation.model()), simulation.state());
        let reacts = model.chemistry().is_some();
        let steady = reacts && (runs || model.mass_weights().chemistry == 0.0);
        let point = SteadyPoint::new(model, state, (steady, tolerance), &self.control)?;
        let value = self.measured(&point.point().model, &point.point().state)?;
        self.warm = Some(point.point().state.x.clone());
        let found = Found::AtRest(Box::new(point));
        Ok(Evaluated { value, at: values.to_vec(), found, moves: false })
    }

    /// The states at which J is measured with the parameters `values`, with their model. In time they are those of the replay alone.
    ///
    /// # Errors
    /// As for [`Self::evaluate`].
    pub(crate) fn states(&mut self, values: &[Vec<f64>]) -> Result<(Arc<Model>, Vec<State>)> {
        self.runs_scene = false;
        Ok(match self.evaluate(values)?.found {
            Found::AtRest(point) => {
                let point = point.point();
                (Arc::clone(&point.model), vec![point.state.clone()])
            }
            Found::InTime(course) => (course.model, course.states),
        })
    }

    /// J of a state.
    pub(super) fn measured(&self, model: &Model, state: &State) -> Result<f64> {
        self.measures.iter().map(|measure| measure.value(model, state)).sum()
    }
}

/// Refuses scenes that are not covered.
fn check(scene: &Scene, simulation: &Simulation, place: &Place) -> Result<()> {
    if simulation.sheet().triangles().is_empty() {
        let message = "measures are integrals over a sheet, and a point has no area";
        let help = "a sheet of one species that does not diffuse: shape = \"disc\", vertices = 10";
        return Err(scene.error_at("sheet.shape", message, Some(help)).into());
    }
    if !simulation.sheet().reduction().periods().is_empty() {
        let message = "gradients of periodic sheets are not covered";
        return Err(scene.error_at("sheet.periodic", message, None).into());
    }
    let model = simulation.model();
    let on_faces =
        model.chemistry().is_some_and(|chemistry| chemistry.location() == Location::Face);
    if on_faces && model.moves() {
        let message = "with species on triangles optimal lengths depend on the shape by its areas, which is not covered";
        let help = "--set kinetics.location=vertex has species at the vertices";
        return Err(scene.error_at("kinetics.location", message, Some(help)).into());
    }
    if !model.moves() && !matches!(place, Place::InTime(_)) {
        let message = "gradients are those of shapes at rest: the scene moves no shape";
        let help = "--in-time differentiates the run in time";
        return Err(scene.error_at("time.policy", message, Some(help)).into());
    }
    Ok(())
}
