//! The chemistry alone: integrated over a step of the coupling, or brought to rest.
//!
//! ```text
//! dc/dt = D Δ c + R(c, s(t)),     Δ of a shape that does not move, s on a straight line in time
//! ```
//!
//! | method | what it is | for |
//! | --- | --- | --- |
//! | `euler` | one explicit step; with moving signals Heun's, of second order | the paper's update |
//! | `chebyshev` | stabilised explicit, of second order, under error control | diffusion, mild kinetics |
//! | `exponential` | exact for what is linear, of third order, under error control | linear decay of any speed |
//! | `tsit45` | explicit, of fifth order, under error control | smooth and not stiff |
//! | `bdf`, `tr-bdf2`, `esdirk34` | implicit, under error control | stiff kinetics |

pub mod chebyshev;
mod exponential;
mod krylov;
mod steady;

pub use steady::relax_chemistry;

use serde::{Deserialize, Serialize};

use self::chebyshev::{Chebyshev, Tolerance};
use self::exponential::Exponential;
use super::monolithic::InOnePiece;
use super::ode::OdeMethod;
use super::{Integrator, SolveError, under_way};
use crate::Result;
use crate::state::State;
use crate::system::{Coupled, Course, System};
use crate::timescale::Storage;

/// What sub-steps are called where their progress is told.
const CHEMISTRY: &str = "integrating the chemistry";

/// How the chemistry is integrated within a step of the coupling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChemistryMethod {
    /// One explicit step.
    Euler,
    /// Runge-Kutta-Chebyshev.
    Chebyshev,
    /// Exponential Rosenbrock.
    Exponential,
    /// Explicit Runge-Kutta of Tsitouras, order 5.
    Tsit45,
    /// Backward differences of variable order.
    Bdf,
    /// Trapezoidal rule and second backward difference, order 2.
    TrBdf2,
    /// Singly diagonally implicit Runge-Kutta of order 3.
    Esdirk34,
}

impl ChemistryMethod {
    /// What it is called in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::Chebyshev => "Chebyshev",
            Self::Exponential => "exponential",
            Self::Tsit45 => OdeMethod::Tsit45.name(),
            Self::Bdf => OdeMethod::Bdf.name(),
            Self::TrBdf2 => OdeMethod::TrBdf2.name(),
            Self::Esdirk34 => OdeMethod::Esdirk34.name(),
        }
    }

    /// The power of the tolerance of a step with which the error of an integration falls: `p/(p+1)`
    /// of a method of order p whose error test sees its own error h^(p+1), 1 of one that goes on
    /// with a better solution than the one it tests.
    pub(super) fn power(self) -> f64 {
        match self {
            Self::Chebyshev | Self::TrBdf2 => 2.0 / 3.0,
            Self::Esdirk34 => 3.0 / 4.0,
            Self::Euler | Self::Exponential | Self::Tsit45 | Self::Bdf => 1.0,
        }
    }
}

/// An integrator of the chemistry with its work arrays.
#[derive(Debug)]
pub struct ChemistrySteps {
    method: ChemistryMethod,
    chebyshev: Chebyshev,
}

impl ChemistrySteps {
    /// By `method`.
    #[must_use]
    pub fn new(method: ChemistryMethod) -> Self {
        Self { method, chebyshev: Chebyshev::default() }
    }

    /// The species of `state` carried on to `until`, with the transport of the shape that `system`
    /// last followed and the signals on `signals`.
    ///
    /// # Errors
    /// If the plugin or the integrator fails.
    pub fn advance(
        &mut self,
        system: &mut System,
        state: &State,
        until: f64,
        signals: &Course,
        tolerance: (f64, f64),
    ) -> Result<Vec<Vec<f64>>> {
        if system.chemistry().is_none() || until <= state.time {
            return Ok(state.species.clone());
        }
        match self.method {
            ChemistryMethod::Euler => euler(system, state, until, signals),
            ChemistryMethod::Chebyshev => {
                stabilised(&mut self.chebyshev, system, state, until, signals, tolerance)
            }
            ChemistryMethod::Exponential => {
                let mut y = Unknowns::new(system, state, signals);
                let absolute = y.coupled.tolerances(system, tolerance.1);
                let tolerance = Tolerance { relative: tolerance.0, absolute: &absolute };
                let mut exponential = Exponential::new(&mut y.coupled, system, tolerance);
                exponential.integrate(state.time, until, &mut y.values)?;
                Ok(y.species(system, state))
            }
            ChemistryMethod::Tsit45 => {
                whole(OdeMethod::Tsit45, system, state, until, signals, tolerance)
            }
            ChemistryMethod::Bdf => whole(OdeMethod::Bdf, system, state, until, signals, tolerance),
            ChemistryMethod::TrBdf2 => {
                whole(OdeMethod::TrBdf2, system, state, until, signals, tolerance)
            }
            ChemistryMethod::Esdirk34 => {
                whole(OdeMethod::Esdirk34, system, state, until, signals, tolerance)
            }
        }
    }
}

/// The species as the unknowns of a system of their own.
struct Unknowns {
    coupled: Coupled,
    values: Vec<f64>,
}

impl Unknowns {
    fn new(system: &mut System, state: &State, signals: &Course) -> Self {
        let policy = Storage { mechanics: 0.0, chemistry: 1.0 };
        let mut coupled = Coupled::chemistry_alone(system, policy);
        coupled.start(state);
        coupled.set_course(signals.clone());
        let mut values = vec![0.0; coupled.layout().unknowns()];
        coupled.pack(system, state, &mut values);
        Self { coupled, values }
    }

    fn species(&self, system: &mut System, state: &State) -> Vec<Vec<f64>> {
        let mut next = state.clone();
        self.coupled.unpack(system, &self.values, state.time, &mut next);
        next.species
    }
}

/// One explicit step. While signals move, Heun's: the mean of the rates at both ends.
fn euler(system: &System, state: &State, until: f64, signals: &Course) -> Result<Vec<Vec<f64>>> {
    let step = until - state.time;
    let mut at = Vec::new();
    signals.at(state.time, &mut at);
    let first = system.rates(&state.species, &at)?;
    let add = |c: &mut [Vec<f64>], rates: &[Vec<f64>], step: f64| {
        for (c, r) in c.iter_mut().flatten().zip(rates.iter().flatten()) {
            *c += step * r;
        }
    };
    let mut next = state.species.clone();
    add(&mut next, &first, step);
    if !signals.is_still() {
        signals.at(until, &mut at);
        let last = system.rates(&next, &at)?;
        next.clone_from(&state.species);
        add(&mut next, &first, 0.5 * step);
        add(&mut next, &last, 0.5 * step);
    }
    Ok(next)
}

fn stabilised(
    chebyshev: &mut Chebyshev,
    system: &mut System,
    state: &State,
    until: f64,
    signals: &Course,
    (rtol, atol): (f64, f64),
) -> Result<Vec<Vec<f64>>> {
    let Some(chemistry) = system.chemistry() else { return Ok(state.species.clone()) };
    let views: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
    let mut bound: f64 = 0.0;
    let mut at = Vec::new();
    for time in if signals.is_still() { vec![until] } else { vec![state.time, until] } {
        signals.at(time, &mut at);
        bound = bound.max(chemistry.spectral_bound(&views, &at)?);
    }
    let mut y = Unknowns::new(system, state, signals);
    let absolute = y.coupled.tolerances(system, atol);
    let tolerance = Tolerance { relative: rtol, absolute: &absolute };
    let coupled = &mut y.coupled;
    let rate = |t: f64, y: &[f64], out: &mut [f64]| {
        system.tell(|| under_way(CHEMISTRY, (state.time, t, until)));
        coupled.residual(system, t, y, out)
    };
    chebyshev.integrate(state.time, until, &mut y.values, &tolerance, bound, rate)?;
    Ok(y.species(system, state))
}

/// By one of diffsol's methods.
fn whole(
    method: OdeMethod,
    system: &mut System,
    state: &State,
    until: f64,
    signals: &Course,
    tolerance: (f64, f64),
) -> Result<Vec<Vec<f64>>> {
    let mut moving = state.clone();
    let mut steps = InOnePiece::of_chemistry(method, tolerance, signals.clone());
    while moving.time < until {
        system.tell(|| under_way(CHEMISTRY, (state.time, moving.time, until)));
        steps.advance(system, &mut moving, until)?;
    }
    if moving.species.iter().flatten().all(|c| c.is_finite()) {
        Ok(moving.species)
    } else {
        Err(SolveError::NotFinite.into())
    }
}
