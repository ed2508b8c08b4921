//! Parameters of the staggered integrator in a scene, and what it keeps from step to step.

use serde::{Deserialize, Serialize};

use crate::model::MassWeights;
use crate::num::checked::Positive;
use crate::solve::chemistry::{ChemistryMethod, ChemistrySteps, SteadyChemistry};
use crate::solve::incremental_potential::{Motion, MotionMethod};
use crate::solve::internal_variables::InternalSteps;
use crate::solve::{Integrator, IntegratorSpec, Result, SolveError, fixed_step, scaled};

/// The tolerance that a scene has if it gives none.
pub(super) const DEFAULT_TOLERANCE: f64 = 1e-2;

/// The error of the step before the first, for the same.
pub(super) const FIRST_ERROR: f64 = 0.1;

/// Parameters of the staggered integrator in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaggeredSpec {
    /// How a step is made.
    #[serde(default)]
    pub method: Method,
    /// How the chemistry is integrated within a step; `euler` for Euler and `chebyshev` for Heun if
    /// not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chemistry: Option<ChemistryMethod>,
    /// How a shape with storage moves; `euler` for Euler and `sdirk2` for Heun if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<MotionMethod>,
    /// Euler: the fixed step, 0.01 if not given. Heun: the first step tried; chosen from the first rates if
    /// not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Positive>,
    /// Longest step (heun).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longest_step: Option<Positive>,
    /// Relative tolerance of the coupling error (heun).
    #[serde(default = "default_tolerance")]
    pub rtol: Positive,
    /// Absolute tolerance, in units of each species' typical magnitude (heun).
    #[serde(default = "default_tolerance")]
    pub atol: Positive,
}

impl Default for StaggeredSpec {
    /// Heun's method with the default tolerance.
    fn default() -> Self {
        Self {
            method: Method::default(),
            chemistry: None,
            shape: None,
            step: None,
            longest_step: None,
            rtol: default_tolerance(),
            atol: default_tolerance(),
        }
    }
}

/// Fixed step of Euler's method in a scene that gives none.
const DEFAULT_STEP: f64 = 0.01;

fn default_tolerance() -> Positive {
    const { Positive::constant(DEFAULT_TOLERANCE) }
}

/// How a staggered step is made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Explicit Euler with a fixed step, as in the paper.
    Euler,
    /// Predict, relax, correct, with a step chosen by the error estimate.
    #[default]
    Heun,
}

#[typetag::serialize(name = "staggered")]
impl IntegratorSpec for StaggeredSpec {
    fn name(&self) -> String {
        let method = match self.method {
            Method::Euler => "staggered, Euler",
            Method::Heun => "staggered, predict-relax-correct",
        };
        match self.chemistry {
            None => method.into(),
            Some(chemistry) => format!("{method}, chemistry by {}", chemistry.name()),
        }
    }

    fn integrates_internal(&self) -> bool {
        true
    }

    fn supports_anisotropic_drag(&self) -> bool {
        true
    }

    fn supports_ranks(&self, policy: MassWeights) -> bool {
        use ChemistryMethod as M;
        let explicit = matches!(self.chemistry.unwrap_or(self.usual()), M::Euler | M::Chebyshev);
        explicit && policy.chemistry > 0.0
    }

    fn at_tolerance(&self, tolerance: Positive, until: Positive) -> Box<dyn IntegratorSpec> {
        let (rtol, atol) = scaled(tolerance, self.rtol, self.atol);
        let step = match self.method {
            Method::Euler => Some(fixed_step(tolerance, until)),
            Method::Heun => self.step,
        };
        Box::new(Self { rtol, atol, step, ..self.clone() })
    }

    fn atol(&self) -> Option<f64> {
        (self.method == Method::Heun).then(|| self.atol.get())
    }

    fn rtol(&self) -> Option<f64> {
        (self.method != Method::Euler).then(|| self.rtol.get())
    }

    fn explicit_step(&self) -> Option<f64> {
        let euler = self.method == Method::Euler
            && self.chemistry.unwrap_or(self.usual()) == ChemistryMethod::Euler;
        euler.then(|| self.step.map_or(DEFAULT_STEP, Positive::get))
    }

    fn build(&self, policy: MassWeights) -> Result<Box<dyn Integrator>> {
        if policy.mechanics == 0.0 && self.shape.is_some() {
            return Err(SolveError::Pairing(
                "under this policy the shape is in equilibrium at every time and does not move under \
                 drag: leave out shape"
                    .into(),
            ));
        }
        if policy.chemistry == 0.0
            && let Some(chemistry) = self.chemistry
        {
            return Err(SolveError::Pairing(format!(
                "under this policy the chemistry is in steady state at every time and not integrated: \
                 leave out chemistry = \"{}\"",
                chemistry.name().to_lowercase()
            )));
        }
        let chemistry = self.chemistry.unwrap_or(self.usual());
        Ok(Box::new(Staggered {
            spec: self.clone(),
            power: chemistry.power(),
            chemistry: ChemistrySteps::new(chemistry),
            step: match self.method {
                Method::Euler => Some(self.step.map_or(DEFAULT_STEP, Positive::get)),
                Method::Heun => self.step.map(Positive::get),
            },
            first: None,
            error: FIRST_ERROR,
            shape: self.motion(),
            motion: Motion::default(),
            stabilised: Stabilised::default(),
            growth: Growth::default(),
            steady: SteadyChemistry::default(),
            internal: InternalSteps::default(),
            policy,
        }))
    }
}

impl StaggeredSpec {
    /// The method for a shape with storage.
    fn motion(&self) -> MotionMethod {
        self.shape.unwrap_or(match self.method {
            Method::Euler => MotionMethod::Euler,
            Method::Heun => MotionMethod::Sdirk2,
        })
    }

    /// The method for the chemistry where the scene names none.
    fn usual(&self) -> ChemistryMethod {
        match self.method {
            Method::Euler => ChemistryMethod::Euler,
            Method::Heun => ChemistryMethod::Chebyshev,
        }
    }
}

crate::register_kind!(dyn IntegratorSpec, "staggered", StaggeredSpec);

/// The staggered integrator.
pub(super) struct Staggered {
    pub(super) spec: StaggeredSpec,
    pub(super) chemistry: ChemistrySteps,
    /// [`ChemistryMethod::power`] of the chemistry's method.
    pub(super) power: f64,
    /// The next step to try; none before the first.
    pub(super) step: Option<f64>,
    /// The first step tried.
    pub(super) first: Option<f64>,
    /// Error estimate of the last step, in units of the tolerance.
    pub(super) error: f64,
    /// How the shape moves, and by what.
    pub(super) shape: MotionMethod,
    pub(super) motion: Motion,
    /// What it keeps where it has no storage.
    pub(super) stabilised: Stabilised,
    pub(super) growth: Growth,
    /// Solves for the steady state of a chemistry without storage.
    pub(super) steady: SteadyChemistry,
    pub(super) internal: InternalSteps,
    pub(super) policy: MassWeights,
}

/// What a quasi-static shape keeps from step to step.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Stabilised {
    /// η and the most that it is, factors on the drag of the scene; none before the first step.
    pub(super) drag: Option<(f64, f64)>,
    /// Iterations since the stability of the shape was checked.
    pub(super) unchecked: usize,
    /// Work of the drag and energy supplied since the start of the run, outside of snaps.
    pub(super) work: (f64, f64),
    /// The snap that is under way.
    pub(super) snap: Option<Snap>,
    /// Whether the shape is under way, rather than at rest.
    pub(super) moves: bool,
    /// The longest step from one equilibrium to another so far.
    pub(super) longest: f64,
}

/// What is known about perturbations that grow under drag.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Growth {
    /// Iterations since the last check.
    pub(super) unchecked: usize,
    /// Checks so far.
    pub(super) checks: u32,
    /// Rate at which the fastest perturbation grew then, if steps were too long for it, 1/time.
    pub(super) rate: Option<f64>,
}

/// A snap.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Snap {
    /// Energy that it has released so far.
    pub(super) released: f64,
    /// The vertex that has moved furthest in a step, and how far.
    pub(super) vertex: usize,
    pub(super) moved: f64,
}
