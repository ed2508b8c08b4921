//! How long a run would take, from its first steps, which are made and forgotten.

use std::time::{Duration, Instant};

use super::run_forecast::{Clock, RunForecast};
use super::step_sizes::next_output;
use super::{Way, words};
use crate::num::Short;
use crate::output::Predicted;
use crate::run::{Error, Simulation};
use crate::scene::Scene;
use crate::solve::{Control, SolveError};

/// What the first steps say of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Preview {
    /// How long it takes, in words.
    pub what: String,
    /// What that follows from.
    pub because: String,
    /// The numbers, if a forecast has settled.
    pub predicted: Option<Predicted>,
}

/// Part of the budget that is spent though a forecast has settled: later ones are better, and what is over by
/// then needs none.
const SPENT: f64 = 0.25;

/// How long `scene`, set up as `simulation`, would take to run. Its start is relaxed and steps are made until
/// a forecast has settled, for as long as `budget` at most; the simulation is left where that has led to.
#[must_use]
pub fn preview(scene: &Scene, simulation: &mut Simulation, budget: Duration) -> Preview {
    let began = Instant::now();
    simulation.set_control(Control::new(move || began.elapsed() >= budget, |_| {}));
    let clock = Clock::start();
    let (way, mut forecast) = match simulation.prepare() {
        Ok(_) => (Way::of(scene), RunForecast::new(scene, clock)),
        Err(error) => return gave_up(&error, "relaxing the start", budget),
    };
    loop {
        let (steps, time, seconds) = forecast.reached();
        let after = format!("{steps} steps to time {}", Short(time));
        let made = format!("{after}, made in {}, without output", words::duration(seconds));
        if time >= way.until || way.max_steps.is_some_and(|most| steps >= most) {
            let because = format!("because the start was relaxed, and all {made}");
            return Preview { what: words::duration(seconds), because, predicted: None };
        }
        let settled = |forecast: &RunForecast| {
            let because = format!("from relaxing the start and the first {made}");
            Some(Preview { what: forecast.words()?, because, predicted: forecast.predicted() })
        };
        let target = next_output(&way, time);
        let spent = began.elapsed();
        let known = spent >= budget.mul_f64(SPENT) && forecast.predicted().is_some();
        let stepped = if known || spent >= budget {
            Err(Error::Solve(SolveError::Interrupted))
        } else {
            simulation.step(target)
        };
        match stepped {
            Ok(report) => {
                let time = simulation.state().time;
                forecast.step(
                    &report,
                    time,
                    time >= target || simulation.stepper.breakpoints.include(time),
                );
            }
            Err(error) => {
                let interrupted = matches!(error, Error::Solve(SolveError::Interrupted));
                let known = interrupted.then(|| settled(&forecast)).flatten();
                return known
                    .unwrap_or_else(|| gave_up(&error, &format!("the first {after}"), budget));
            }
        }
    }
}

/// What there is to say when a step, or the start, did not complete.
fn gave_up(error: &Error, until: &str, budget: Duration) -> Preview {
    let (what, because) = match error {
        Error::Solve(SolveError::Interrupted) => {
            let all = words::duration(budget.as_secs_f64());
            let because = format!(
                "because {until} says too little, and {all} is all that --predict allows; a run tells it once \
                 its steps have settled"
            );
            ("not known yet", because)
        }
        error => ("not known", format!("because after {until} it fails: {error}")),
    };
    Preview { what: what.to_owned(), because, predicted: None }
}
