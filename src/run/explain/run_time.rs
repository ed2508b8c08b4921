//! How long a run would take, from its first steps, which are made and forgotten.

use std::time::{Duration, Instant};

use super::Line;
use crate::num::Short;
use crate::output::Predicted;
use crate::run::forecast::words::duration;
use crate::run::forecast::{Clock, RunForecast};
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::{Control, SolveError};

/// Share of the budget that is spent though a forecast has settled: later ones are better, and what is over by
/// then needs none.
const SPENT: f64 = 0.25;

/// How long `scene`, set up as `simulation`, would take to run, in words and, if a forecast has settled, in numbers.
/// Its start is relaxed and steps are made until then, for as long as `budget` at most; the simulation is left where
/// that has led to.
pub(super) fn line(
    scene: &Scene,
    simulation: &mut Simulation,
    budget: Duration,
) -> (Line, Option<Predicted>) {
    let clock = Clock::start();
    let began = Instant::now();
    simulation.set_control(Control::new(move || began.elapsed() >= budget, |_| {}));
    let relaxed = simulation.prepare();
    let mut run = RunForecast::new(scene, clock);
    let ended = relaxed.and_then(|_| first_steps(simulation, &mut run, budget));
    let (count, time, seconds) = run.reached();
    let (steps, seconds) = (format!("{count} steps to time {}", Short(time)), duration(seconds));
    let made = format!("{steps}, made in {seconds}, without output");
    let after = match count {
        0 => "relaxing the start".to_owned(),
        _ => format!("the first {steps}"),
    };
    match (ended, run.predicted()) {
        (Err(error), _) if !matches!(error, Error::Solve(SolveError::Interrupted)) => {
            (Line::new("not known", format!("because after {after} it fails: {error}")), None)
        }
        _ if run.target().is_none() => {
            (Line::new(seconds, format!("because the start was relaxed, and all {made}")), None)
        }
        (_, Some((predicted, words))) => {
            let because = format!("from relaxing the start and the first {made}");
            (Line::new(words, because), Some(predicted))
        }
        _ => {
            let all = duration(budget.as_secs_f64());
            let because = format!(
                "because it has not settled after {after}, and {all} is all that --predict allows; a run prints it \
                 once it has"
            );
            (Line::new("not known yet", because), None)
        }
    }
}

/// Steps until a forecast has settled, or the budget is spent.
fn first_steps(simulation: &mut Simulation, run: &mut RunForecast, budget: Duration) -> Result<()> {
    while let Some(target) = run.target() {
        let share = run.reached().2 / budget.as_secs_f64();
        if share >= 1.0 || share >= SPENT && run.predicted().is_some() {
            break;
        }
        let report = simulation.step(target)?;
        let time = simulation.state().time;
        let cut = time >= target || simulation.stepper.breakpoints.include(time);
        run.step(&report, time, cut);
    }
    Ok(())
}
