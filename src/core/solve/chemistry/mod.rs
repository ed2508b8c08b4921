//! The chemistry alone: integrated over a step of the coupling, or brought to rest.
//!
//! ```text
//! dc/dt = D Δ c + R(c, s(t)),     Δ of a shape that does not move, s on a straight line in time
//! ```
//!
//! | method | scheme | for |
//! | --- | --- | --- |
//! | `euler` | one explicit step; with moving signals Heun's, of second order | the paper's update |
//! | `chebyshev` | stabilised explicit, of second order, under error control | diffusion, mild kinetics |
//! | `tsit45` | explicit, of fifth order, under error control | smooth and not stiff |
//! | `bdf`, `tr-bdf2`, `esdirk34` | implicit, under error control | stiff kinetics |

pub mod chebyshev;
mod conserved;
mod steady;

pub(super) use steady::{Leap, SteadyChemistry};

use serde::{Deserialize, Serialize};

use self::chebyshev::{Chebyshev, Tolerance};
use super::equilibrium::Relaxation;
use super::monolithic::Monolithic;
use super::{Progress, Result, SolveError, Workspace, counters, under_way};
use crate::model::{Coupled, LinearInTime, State, Subsystem};
use crate::num::Short;
use crate::ode::OdeMethod;
use crate::tally::Work;

/// Evaluations within one step of the coupling from which on the chemistry is called stiff.
const STIFF_EVALUATIONS: usize = 20_000;
/// What is said then.
const IMPLICIT_HINT: &str = "; a law or its diffusion is much faster than the run: time.integrator = { kind = \"monolithic\" } or \
                        chemistry = \"bdf\" may take far less time";
/// What sub-steps are called where their progress is reported.
const PROGRESS_LABEL: &str = "integrating the chemistry";

/// Turns of [`relax_to_steady_state`] at most: what is not at rest then is left to who asked for it.
const MAX_SETTLING_ROUNDS: usize = 50;
/// Tolerances of the steady chemistry in it, and the relative change in a turn that counts as none.
const SETTLING_TOLERANCES: (f64, f64) = (1e-6, 1e-8);

/// Brings the shape and the chemistry of `state` towards a rest of both, in turn: each while the other rests. A stable steady
/// state is reached if the two are not strongly coupled, to some digits.
///
/// # Errors
/// A relaxation or a search for a steady chemistry that fails; errors of the laws.
pub fn relax_to_steady_state(workspace: &mut Workspace, state: &mut State) -> Result<Relaxation> {
    let mut done = workspace.relax(state)?;
    let mut steady = SteadyChemistry::default();
    for _ in 0..MAX_SETTLING_ROUNDS {
        if workspace.model.chemistry().is_none() {
            break;
        }
        let before = state.species.clone();
        steady.solve(workspace, state, SETTLING_TOLERANCES, Leap::Allowed)?;
        if workspace.model.moves() {
            done.add(&workspace.relax(state)?);
        }
        let moved = |(now, then): (&Vec<f64>, &Vec<f64>)| {
            let size = then.iter().fold(f64::MIN_POSITIVE, |size: f64, v| size.max(v.abs()));
            now.iter().zip(then).any(|(a, b)| (a - b).abs() > SETTLING_TOLERANCES.0 * size)
        };
        if !workspace.model.moves() || !state.species.iter().zip(&before).any(moved) {
            break;
        }
    }
    Ok(done)
}

/// How the chemistry is integrated within a step of the coupling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChemistryMethod {
    /// One explicit step.
    Euler,
    /// Runge-Kutta-Chebyshev.
    Chebyshev,
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
    /// Its name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::Chebyshev => "Chebyshev",
            Self::Tsit45 => OdeMethod::Tsit45.name(),
            Self::Bdf => OdeMethod::Bdf.name(),
            Self::TrBdf2 => OdeMethod::TrBdf2.name(),
            Self::Esdirk34 => OdeMethod::Esdirk34.name(),
        }
    }

    /// The power of the tolerance of a step with which the error of an integration falls: `p/(p+1)`
    /// of a method of order p whose error test sees its own error h^(p+1), 1 of one that continues
    /// with a better solution than the one it tests.
    pub(super) fn power(self) -> f64 {
        match self {
            Self::Chebyshev | Self::TrBdf2 => 2.0 / 3.0,
            Self::Esdirk34 => 3.0 / 4.0,
            Self::Euler | Self::Tsit45 | Self::Bdf => 1.0,
        }
    }
}

/// An integrator of the chemistry, with what it keeps from interval to interval.
pub(super) struct ChemistrySteps {
    method: ChemistryMethod,
    chebyshev: Chebyshev,
    /// The species as the unknowns of a system of their own.
    alone: Option<Coupled>,
    implicit: Option<Monolithic>,
}

impl ChemistrySteps {
    /// By `method`.
    pub(super) fn new(method: ChemistryMethod) -> Self {
        Self { method, chebyshev: Chebyshev::default(), alone: None, implicit: None }
    }

    /// The species of `state` carried on to `until`, on its shape and with the signals on `signals`.
    ///
    /// # Errors
    /// If the plugin or the integrator fails.
    pub(super) fn advance(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        until: f64,
        signals: LinearInTime,
        tolerance: (f64, f64),
    ) -> Result<Vec<Vec<f64>>> {
        if workspace.model.chemistry().is_none() || until <= state.time {
            return Ok(state.species.clone());
        }
        let _scope = counters::part(workspace.model.tally(), counters::CHEMISTRY);
        match self.method {
            ChemistryMethod::Euler | ChemistryMethod::Chebyshev => {
                self.by_own_method(workspace, state, until, signals, tolerance)
            }
            ChemistryMethod::Tsit45 => {
                self.by_diffsol(OdeMethod::Tsit45, workspace, state, until, signals, tolerance)
            }
            ChemistryMethod::Bdf => {
                self.by_diffsol(OdeMethod::Bdf, workspace, state, until, signals, tolerance)
            }
            ChemistryMethod::TrBdf2 => {
                self.by_diffsol(OdeMethod::TrBdf2, workspace, state, until, signals, tolerance)
            }
            ChemistryMethod::Esdirk34 => {
                self.by_diffsol(OdeMethod::Esdirk34, workspace, state, until, signals, tolerance)
            }
        }
    }

    /// Whether it keeps what a library remembers.
    pub(super) fn is_library(&self) -> bool {
        use ChemistryMethod as M;
        matches!(self.method, M::Tsit45 | M::Bdf | M::TrBdf2 | M::Esdirk34)
    }

    /// Whether it remembers nothing of earlier intervals.
    pub(super) fn is_new(&self) -> bool {
        self.implicit.is_none()
    }

    /// Forgets all earlier intervals.
    pub(super) fn forget(&mut self) {
        self.implicit = None;
    }

    fn by_own_method(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        until: f64,
        signals: LinearInTime,
        (rtol, atol): (f64, f64),
    ) -> Result<Vec<Vec<f64>>> {
        let model = &workspace.model;
        let coupled = self.alone.get_or_insert_with(|| Coupled::new(model, Subsystem::Chemistry));
        coupled.start(state);
        let still = signals.is_still();
        coupled.set_course(signals);
        let mut y = coupled.pack(state);
        let absolute = coupled.tolerances(atol);
        let tolerance = Tolerance { relative: rtol, absolute: &absolute };
        let control = &workspace.control;
        match self.method {
            ChemistryMethod::Euler => euler(coupled, (state.time, until), still, &mut y)?,
            _ => {
                // Sources may depend on time where signals do not.
                let chemistry = model.chemistry().into_iter();
                let sources =
                    chemistry.flat_map(|law| law.transports()).any(|term| term.has_sources());
                let times = match still && !sources {
                    true => vec![until],
                    false => vec![state.time, until],
                };
                let bound = coupled.spectral_bound(&times)?;
                let mut evaluations = 0_usize;
                let rate = |t: f64, y: &[f64], out: &mut [f64]| {
                    evaluations += 1;
                    control.report(|| {
                        let stiff =
                            if evaluations > STIFF_EVALUATIONS { IMPLICIT_HINT } else { "" };
                        under_way(PROGRESS_LABEL, (state.time, t, until)) + stiff
                    });
                    control.check()?;
                    Ok(coupled.residual(t, y, out)?)
                };
                let span = (state.time, until);
                self.chebyshev.set_error_norm(workspace.reduction(), state.species.len());
                let before = self.chebyshev.work();
                let done =
                    self.chebyshev.integrate(span.0, span.1, &mut y, &tolerance, bound, rate);
                // Right-hand sides are counted where they are evaluated.
                let more = Work { right_hand_sides: 0, ..self.chebyshev.work() - before };
                model.tally().count(|work| *work += more);
                done.map_err(|error| named(error, workspace, coupled, state, &y))?;
            }
        }
        let mut next = state.clone();
        coupled.layout().unpack(model.mechanics(), until, &y, &mut next);
        model.hold(until, &mut next.species);
        Ok(next.species)
    }

    fn by_diffsol(
        &mut self,
        method: OdeMethod,
        workspace: &mut Workspace,
        state: &State,
        until: f64,
        signals: LinearInTime,
        tolerance: (f64, f64),
    ) -> Result<Vec<Vec<f64>>> {
        let mut moving = state.clone();
        let steps =
            self.implicit.get_or_insert_with(|| Monolithic::of_chemistry(method, tolerance));
        steps.set_course(signals);
        let mut progress = Progress::default();
        while moving.time < until {
            let span = (state.time, moving.time, until);
            workspace.control.report(|| under_way(PROGRESS_LABEL, span));
            progress.check(workspace, &moving)?;
            let done = steps.step(workspace, &mut moving, until)?;
            progress.count(done.length, until - state.time, 0);
        }
        if moving.species.iter().flatten().all(|c| c.is_finite()) {
            Ok(moving.species)
        } else {
            Err(SolveError::NotFinite)
        }
    }
}

/// `error` with the name of the unknown that it blames, where the unknowns are `y`.
fn named(
    mut error: SolveError,
    workspace: &Workspace,
    coupled: &Coupled,
    state: &State,
    y: &[f64],
) -> SolveError {
    if let SolveError::Unresolved { unknown, what, .. } = &mut error
        && let Some(chemistry) = workspace.model.chemistry()
    {
        let mut only = vec![0.0; y.len()];
        only.iter_mut().skip(*unknown).take(1).for_each(|y| *y = 1.0);
        let mut place = state.clone();
        coupled.layout().unpack(workspace.model.mechanics(), state.time, &only, &mut place);
        let point = |values: &Vec<f64>| values.iter().position(|c| *c != 0.0);
        let found = place.species.iter().enumerate().find_map(|(s, c)| Some((s, point(c)?)));
        if let Some((s, point)) = found {
            let (name, noun) =
                (&chemistry.descriptor().species[s].name, chemistry.location().noun());
            *what = format!("species `{name}` at {noun} {point} ({name} = {})", Short(y[*unknown]));
        }
    }
    error
}

/// One explicit step. While signals move, Heun's: the mean of the rates at both ends.
fn euler(
    coupled: &mut Coupled,
    (from, until): (f64, f64),
    still: bool,
    y: &mut [f64],
) -> Result<()> {
    coupled.tally().count(|work| work.substeps += 1);
    let step = until - from;
    let start = y.to_vec();
    let mut first = vec![0.0; y.len()];
    coupled.residual(from, &start, &mut first)?;
    let add = |y: &mut [f64], rates: &[f64], step: f64| {
        for (y, r) in y.iter_mut().zip(rates) {
            *y += step * r;
        }
    };
    add(y, &first, step);
    if !still {
        let mut last = vec![0.0; y.len()];
        coupled.residual(until, y, &mut last)?;
        y.copy_from_slice(&start);
        add(y, &first, 0.5 * step);
        add(y, &last, 0.5 * step);
    }
    Ok(())
}
