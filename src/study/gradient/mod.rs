//! Gradients of measures of an equilibrium, or of a steady state, by parameters of its scene.
//!
//! ```text
//! dJ/dp = ∂J/∂p + λ·∂g/∂p        λ by one solution with the transposed derivative (`solve/sensitivity`)
//! ```
//!
//! ∂g/∂p and ∂J/∂p are central differences of one evaluation at a fixed state (`differences`): exact to some 1e-9, whatever
//! effect or law the parameter is of. A gradient by thousands of parameters costs one relaxation and some hundred evaluations.
//!
//! [`Objective`] is J(p) with its gradient, for optimisation: inverse design and fits of what is at rest. The point is the
//! equilibrium at the end of the scene's time, with a law the steady state of shape and chemistry there; or the first equilibrium,
//! of the shape at the species that the scene begins with.
//!
//! Not covered: species on triangles; runs that are not at rest at their end, constraints, internal variables, periodic sheets, ranks.

mod differences;
mod measure;
mod parameter;

use std::sync::Arc;

pub use self::measure::Measure;
pub use self::parameter::Parameter;

use crate::kinetics::{Location, PluginSearch};
use crate::model::{Model, Positions, State};
use crate::run::{Error, Observer, Result, Simulation, StopRules, model_with_start};
use crate::scene::{Scene, SceneSource};
use crate::sheet::Sheet;
use crate::solve::Control;
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
    /// Whether it is the equilibrium that the scene begins with, at the species there, rather than that at its end.
    pub at_start: bool,
}

/// J(p) of the equilibria of a scene.
pub struct Objective {
    request: Request,
    search: PluginSearch,
    control: Control,
    sheet: Arc<Sheet>,
    parameters: Vec<Parameter>,
    measures: Vec<Measure>,
    /// Where work at fixed states is counted.
    tally: Tally,
    /// Where the next relaxation begins.
    warm: Option<Positions>,
}

/// J at one p.
pub struct Evaluated {
    /// J.
    pub value: f64,
    /// p: one list a parameter.
    pub at: Vec<Vec<f64>>,
    /// What is at rest there.
    point: SteadyPoint,
    /// Whether J changes with rigid motions that nothing hinders.
    moves: bool,
}

impl Evaluated {
    /// The state at rest.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.point.point().state
    }

    /// Whether J changes with rigid motions that nothing hinders: it is differentiated as if they were held.
    #[must_use]
    pub fn changes_with_rigid_motions(&self) -> bool {
        self.moves
    }

    /// Number of directions in which the energy falls, if that is known: at a saddle a run does not stay.
    #[must_use]
    pub fn negative_modes(&self) -> Option<usize> {
        self.point.negative_modes()
    }
}

impl Objective {
    /// Reads the scene, the measures and the parameters; nothing is relaxed yet.
    ///
    /// # Errors
    /// A scene, a measure or a key that is wrong, or a scene that is not covered.
    pub fn new(request: Request, search: PluginSearch, control: Control) -> Result<Self> {
        let Request { scene: source, set, .. } = &request;
        let scene = source.scene(set, &[], parameter::OPTION)?;
        let simulation = Simulation::new(&scene, &search)?;
        check(&scene, &simulation)?;
        let sheet = Arc::clone(simulation.sheet());
        let numbers = request.numbers.iter().map(|key| Parameter::number(source, set, &scene, key));
        let fields = request
            .fields
            .iter()
            .map(|key| Parameter::field((source, set), (&scene, &simulation), key));
        let parameters = numbers.chain(fields).collect::<Result<Vec<_>>>()?;
        Parameter::check_apart(&parameters)?;
        let of = |text: &String| Measure::parse(text, simulation.model());
        let measures = request.measures.iter().map(of).collect::<Result<Vec<_>>>()?;
        let tally = simulation.model().tally().clone();
        let warm = None;
        let objective = Self { request, search, control, sheet, parameters, measures, tally, warm };
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
                "--map {}: the energy is no sum of parts at the vertices: maps are of other measures",
                field.key
            )));
        }
        if whole && chemistry && !self.request.at_start {
            let message =
                "the energy of a steady state is not covered: its derivative by species is unknown";
            return Err(Error::Refused(format!("--measure energy: {message}")));
        }
        Ok(())
    }

    /// The scene with the parameters `values`.
    fn scene(&self, values: &[Vec<f64>]) -> Result<Scene> {
        let with = self.parameters.iter().zip(values).enumerate();
        let over: Vec<String> = with.clone().map(|(k, (p, value))| p.set(k, value)).collect();
        let mut scene = self.request.scene.scene(&self.request.set, &over, parameter::OPTION)?;
        with.for_each(|(k, (p, value))| p.give(k, value, (&mut scene, &self.sheet)));
        Ok(scene)
    }

    /// The model with the parameters `values`, and its start.
    fn model(&self, values: &[Vec<f64>]) -> Result<(Model, State)> {
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
        let runs = !self.request.at_start;
        if let Some(warm) = self.warm.take().filter(|_| !runs) {
            simulation.state_mut().x = warm;
        }
        simulation.prepare()?;
        if runs {
            let mut rules = StopRules::new(&scene);
            while rules.stop(&mut simulation.evaluate())?.is_none() {
                simulation.step(scene.time.span.until.get())?;
                simulation.renew(false);
            }
        }
        let tolerance = simulation.force_tolerance();
        let (model, state) = (Arc::clone(simulation.model()), simulation.state());
        let reacts = model.chemistry().is_some();
        let steady = reacts && (runs || model.storage().chemistry == 0.0);
        let point = SteadyPoint::new(model, state, (steady, tolerance), &self.control)?;
        let mut value = 0.0;
        for measure in &self.measures {
            value += measure.value(&point.point().model, &point.point().state)?;
        }
        self.warm = Some(point.point().state.x.clone());
        Ok(Evaluated { value, at: values.to_vec(), point, moves: false })
    }

    /// dJ/dp at an evaluated p: one list a parameter.
    ///
    /// # Errors
    /// A derivative that is singular; laws that fail; a field that acts beyond its neighbourhood.
    pub fn gradient(&self, evaluated: &mut Evaluated) -> Result<Vec<Vec<f64>>> {
        let point = &mut evaluated.point;
        let slope = |measure: &Measure| measure.slope(&point.point().model, &point.point().state);
        let slopes = self.measures.iter().map(slope).collect::<Result<Vec<_>>>()?;
        let slope = slopes.into_iter().reduce(|sum, more| sum.plus(1.0, &more));
        let slope = slope.unwrap_or_default();
        evaluated.moves = point.changes_with_rigid_motions(&slope.x);
        let adjoint = point.adjoint(&slope)?;
        let (values, point) = (&evaluated.at, evaluated.point.point());
        let at = differences::AtFixedState { objective: self, values, point, adjoint };
        (0..self.parameters.len()).map(|k| at.derivative(k)).collect()
    }
}

/// Refuses scenes that are not covered.
fn check(scene: &Scene, simulation: &Simulation) -> Result<()> {
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
    if !model.moves() {
        let message = "gradients are those of shapes at rest: the scene moves no shape";
        return Err(scene.error_at("time.policy", message, None).into());
    }
    Ok(())
}
