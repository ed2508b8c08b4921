//! A problem: what is simulated and how, put together in Rust.
//!
//! ```
//! # use rumple_core as rumple;
//! use rumple::effects::{Bending, Load, Material, Stretching};
//! use rumple::problem::Problem;
//! use rumple::sheet::{SheetShape, generate};
//!
//! let sheet = generate(&SheetShape::Sphere { radius: 10.0, irregular: false }, 200, 1)?;
//! let problem = Problem::on(sheet)
//!     .material(Material { young: 1e5, poisson: 0.3, thickness: 0.1 })
//!     .effect(Stretching::default())
//!     .effect(Bending::default());
//! let mut stepper = problem.stepper()?;
//! stepper.prepare()?;
//! while stepper.state.time < 1.0 {
//!     stepper.step(1.0)?;
//! }
//! assert!(stepper.energies()?.iter().all(|(_, energy)| energy.is_finite()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A scene is translated into one; a program of its own, or another language, needs no scene. Species start at 0: set
//! `stepper.state.species` before [`Stepper::prepare`]. What `rumple check` and
//! `run` add is not here: notes (on a load that is too small for `tolerance`, say), invariants and files.

mod error;
mod integrator;
mod prescriptions;
mod setup;

use std::ops::Deref;
use std::sync::Arc;

use crate::effects::{
    DirectedLengthFactor, DirichletValues, Effect, EffectContext, EffectSpec, InternalVariables,
    LengthFactor, Material, MaterialField, Measure, ReadSurface, TransportTerm,
};
use crate::geometry::VertexArea;
use crate::kinetics::{Kinetics, Location};
use crate::model::{
    AtBoundary, Chemistry, DragSpec, Mechanics, MechanicsParts, Model, ParameterFields, Policy,
    Positions, Stabilisation, Start, State, TensionReading,
};
use crate::sheet::Sheet;
use crate::solve::equilibrium::LbfgsSpec;
use crate::solve::staggered::StaggeredSpec;
use crate::solve::{EquilibriumSpec, IntegratorSpec, Progress, Workspace};
use crate::stepper::{Breakpoints, Stepper};
use crate::tally::Tally;

pub use error::{ProblemError, ProblemPart};

/// A law on a sheet.
#[derive(Clone)]
pub struct Law {
    /// Rates of species, and what these do to lengths.
    pub kinetics: Arc<dyn Kinetics>,
    /// Parameters that differ from place to place.
    pub parameters: ParameterFields,
    /// Where species live; where the law says if not given.
    pub location: Option<Location>,
    /// Whether species are amounts per current or per rest area.
    pub measure: Measure,
    /// How the signal tension is read.
    pub tension: TensionReading,
    /// Curvatures at the boundary.
    pub boundary: AtBoundary,
}

impl Law {
    /// `kinetics` as it describes itself.
    #[must_use]
    pub fn new(kinetics: Arc<dyn Kinetics>) -> Self {
        Self {
            kinetics,
            parameters: ParameterFields::default(),
            location: None,
            measure: Measure::default(),
            tension: TensionReading::default(),
            boundary: AtBoundary::default(),
        }
    }

    /// Where its species live.
    #[must_use]
    pub fn location(&self) -> Location {
        let first = || self.kinetics.descriptor().species.first().map(|s| s.location);
        self.location.or_else(first).unwrap_or(Location::Vertex)
    }
}

/// Settings that are owned, or borrowed from a scene.
enum Given<'a, T: ?Sized> {
    Own(Box<T>),
    Lent(&'a T),
}

impl<T: ?Sized> Deref for Given<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        match self {
            Self::Own(own) => own,
            Self::Lent(lent) => lent,
        }
    }
}

/// Called once an effect is bound, with its number, its settings, the sheet it is bound to and its contributions.
pub type OnEffect<'a> =
    dyn FnMut(usize, &dyn EffectSpec, &EffectContext<'_>, &Effect) -> Result<(), ProblemError> + 'a;

/// A sheet, what acts on it, and how that is solved; see the [module](self).
pub struct Problem<'a> {
    sheet: Arc<Sheet>,
    planar: bool,
    material: Option<MaterialField>,
    effects: Vec<Given<'a, dyn EffectSpec>>,
    law: Option<Law>,
    policy: Policy,
    drag: DragSpec,
    stabilisation: Option<f64>,
    start: Start,
    until: f64,
    integrator: Given<'a, dyn IntegratorSpec>,
    equilibrium: Given<'a, dyn EquilibriumSpec>,
    read: Option<&'a ReadSurface<'a>>,
    tally: Tally,
}

impl<'a> Problem<'a> {
    /// A sheet on which nothing acts yet; quasi-static, by `staggered` and `lbfgs` with their defaults.
    pub fn on(sheet: impl Into<Arc<Sheet>>) -> Self {
        Self {
            sheet: sheet.into(),
            planar: false,
            material: None,
            effects: Vec::new(),
            law: None,
            policy: Policy::default(),
            drag: DragSpec::default(),
            stabilisation: None,
            start: Start::default(),
            until: 1.0,
            integrator: Given::Own(Box::new(StaggeredSpec::default())),
            equilibrium: Given::Own(Box::new(LbfgsSpec::default())),
            read: None,
            tally: Tally::default(),
        }
    }

    /// The sheet moves in its plane z = const only.
    #[must_use]
    pub fn planar(self, planar: bool) -> Self {
        Self { planar, ..self }
    }

    /// The material.
    #[must_use]
    pub fn material(self, material: impl Into<Option<Material>>) -> Self {
        self.elasticity(material.into().as_ref().map(MaterialField::from))
    }

    /// The material, which may differ from triangle to triangle.
    #[must_use]
    pub fn elasticity(self, material: impl Into<Option<MaterialField>>) -> Self {
        Self { material: material.into(), ..self }
    }

    /// One more effect.
    #[must_use]
    pub fn effect(mut self, effect: impl EffectSpec + 'static) -> Self {
        self.effects.push(Given::Own(Box::new(effect)));
        self
    }

    /// More effects, which a scene lists.
    #[must_use]
    pub fn effects(mut self, effects: &'a [Box<dyn EffectSpec>]) -> Self {
        self.effects.extend(effects.iter().map(|effect| Given::Lent(&**effect)));
        self
    }

    /// The law of the species.
    #[must_use]
    pub fn law(self, law: impl Into<Option<Law>>) -> Self {
        Self { law: law.into(), ..self }
    }

    /// The timescale policy.
    #[must_use]
    pub fn policy(self, policy: Policy) -> Self {
        Self { policy, ..self }
    }

    /// What resists the motion of vertices.
    #[must_use]
    pub fn drag(self, drag: DragSpec) -> Self {
        Self { drag, ..self }
    }

    /// How far a small drag stabilises a quasi-static shape ([`Stabilisation::share`]).
    #[must_use]
    pub fn stabilisation(self, stabilisation: impl Into<Option<f64>>) -> Self {
        Self { stabilisation: stabilisation.into(), ..self }
    }

    /// What the shape of the first state is.
    #[must_use]
    pub fn start(self, start: Start) -> Self {
        Self { start, ..self }
    }

    /// The end of the time span: pins that move one vertex to different places within it are refused, and kinks and jumps
    /// in time end steps up to it. Nothing else ends there.
    #[must_use]
    pub fn until(self, until: f64) -> Self {
        Self { until, ..self }
    }

    /// How it advances in time.
    #[must_use]
    pub fn integrator(self, integrator: impl IntegratorSpec + 'static) -> Self {
        Self { integrator: Given::Own(Box::new(integrator)), ..self }
    }

    /// How equilibria are found.
    #[must_use]
    pub fn equilibrium(self, method: impl EquilibriumSpec + 'static) -> Self {
        Self { equilibrium: Given::Own(Box::new(method)), ..self }
    }

    /// How effects read meshes from files, for those that name one.
    #[must_use]
    pub fn with_surface_reader(self, read: &'a ReadSurface<'a>) -> Self {
        Self { read: Some(read), ..self }
    }

    /// Counts the work with `tally`, which several problems may share.
    #[must_use]
    pub fn with_tally(self, tally: Tally) -> Self {
        Self { tally, ..self }
    }

    /// Both as a scene has them.
    #[must_use]
    pub fn with_solvers(
        self,
        integrator: &'a (dyn IntegratorSpec + 'static),
        equilibrium: &'a (dyn EquilibriumSpec + 'static),
    ) -> Self {
        let (integrator, equilibrium) = (Given::Lent(integrator), Given::Lent(equilibrium));
        Self { integrator, equilibrium, ..self }
    }

    /// Makes it ready to be stepped, from the rest shape without any species.
    ///
    /// # Errors
    /// The part that does not fit the others.
    pub fn stepper(&self) -> Result<Stepper, ProblemError> {
        self.stepper_with(&mut |_, _, _, _| Ok(()))
    }

    /// The same; `on_effect` may refuse what an effect brings.
    ///
    /// # Errors
    /// As for [`Problem::stepper`], and those of `on_effect`.
    pub fn stepper_with(&self, on_effect: &mut OnEffect<'_>) -> Result<Stepper, ProblemError> {
        let (model, state, area) = self.model_with(on_effect)?;
        let relaxer = self.relaxer(model.mechanics())?;
        let integrator = self.built_integrator(model.mechanics(), model.internal())?;
        let effects = self.effects.iter().map(|effect| &**effect as &dyn EffectSpec);
        let breakpoints = Breakpoints::collect(effects, &self.sheet, self.until);
        let mut workspace = Workspace::new(Arc::new(model), relaxer);
        workspace.stabilisation = Stabilisation { share: self.stabilisation, span: self.until };
        let start = self.start;
        let progress = Progress::default();
        Ok(Stepper { workspace, state, integrator, start, area, breakpoints, progress })
    }

    /// The model alone, without solvers, and its start: the rest shape without any species.
    ///
    /// # Errors
    /// As for [`Problem::stepper`], but for what solvers refuse.
    pub fn model(&self) -> Result<(Model, State), ProblemError> {
        let (model, state, _) = self.model_with(&mut |_, _, _, _| Ok(()))?;
        Ok((model, state))
    }

    /// The model, its start, and the areas of vertices.
    fn model_with(
        &self,
        on_effect: &mut OnEffect<'_>,
    ) -> Result<(Model, State, VertexArea), ProblemError> {
        self.check()?;
        let BoundEffects { mechanics, transports, crossing, held, growth, direction, internal } =
            self.bind(on_effect)?;
        let mechanics = Mechanics::from_parts(Arc::clone(&self.sheet), mechanics)
            .map_err(|e| ProblemError::new(ProblemPart::Sheet, e.to_string(), None))?;
        self.check_ranks(&mechanics)?;
        self.check_contact(&mechanics)?;
        let rule = self.effects.iter().find_map(|effect| effect.vertex_area());
        let area = VertexArea::lazy(rule.unwrap_or_default());
        let chemistry = self.law.clone().map(|law| {
            self.chemistry(law, &area, transports).with_direction(direction).with_held_values(&held)
        });
        check_diffusion(chemistry.as_ref(), crossing)?;
        let species = chemistry.as_ref().map_or(0, |c| c.descriptor().species.len());
        let points = match chemistry.as_ref().map(Chemistry::location) {
            Some(Location::Face) => self.sheet.triangle_count(),
            _ => self.sheet.vertex_count(),
        };
        let mut state = State {
            time: 0.0,
            step: 0,
            x: Positions::from(&*self.sheet),
            species: vec![vec![0.0; points]; species],
            internal: Vec::new(),
        };
        let model =
            Model::new(mechanics, chemistry, self.policy.mass_weights(), self.built_drag()?);
        let model = model.with_growth(growth).with_internal_variables(internal);
        model.hold(state.time, &mut state.species);
        state.internal = model.initial_internal();
        Ok((model, state, area))
    }
}

/// Refuses coefficients of diffusion, the same everywhere, with which short waves grow without bound; `number` is the first effect
/// with cross-diffusion.
fn check_diffusion(
    chemistry: Option<&Chemistry>,
    number: Option<usize>,
) -> Result<(), ProblemError> {
    let Some(number) = number else { return Ok(()) };
    let found = chemistry.and_then(Chemistry::ill_posed).filter(|found| found.triangle.is_none());
    let Some(found) = found else { return Ok(()) };
    let help = "eigenvalues need real parts from 0 on; of two species u and v: D_u D_v from D_uv D_vu on, with kind = \"diffusion\" \
        for each";
    let part = ProblemPart::Effect(number, "coefficient".into());
    Err(ProblemError::new(part, found.to_string(), Some(help)))
}

/// What all effects bring.
#[derive(Default)]
pub(super) struct BoundEffects {
    pub(super) mechanics: MechanicsParts,
    pub(super) transports: Vec<TransportTerm>,
    /// Number of the first effect with cross-diffusion.
    pub(super) crossing: Option<usize>,
    pub(super) held: Vec<DirichletValues>,
    pub(super) growth: Vec<LengthFactor>,
    pub(super) direction: Option<DirectedLengthFactor>,
    pub(super) internal: Vec<Box<dyn InternalVariables>>,
}

impl BoundEffects {
    fn add(&mut self, effect: Effect) {
        self.mechanics.terms.extend(effect.energies);
        self.transports.extend(effect.transports);
        self.held.extend(effect.held);
        self.mechanics.prescribed.extend(effect.prescribed);
        self.mechanics.constraints.extend(effect.constraints);
        self.growth.extend(effect.growth);
        self.internal.extend(effect.internal);
        self.direction = self.direction.take().or(effect.direction);
        for (all, more) in self.mechanics.pins.iter_mut().zip(effect.pins.unwrap_or_default()) {
            for a in 0..3 {
                all[a] |= more[a];
            }
        }
    }
}
