//! How long a run would take, from its first steps, which are made and forgotten.

use std::time::{Duration, Instant};

use super::lengths::next_output;
use super::outlook::{Clock, Outlook};
use super::{Way, words};
use crate::num::Short;
use crate::run::{Error, Simulation};
use crate::scene::Scene;
use crate::solve::{Control, SolveError};

/// How long `scene`, made ready as `simulation`, would take to run, in words, and from what that follows. Its
/// start is relaxed and steps are made until a forecast has settled, for as long as `budget` at most; the
/// simulation is left where that has led to.
#[must_use]
pub fn preview(scene: &Scene, simulation: &mut Simulation, budget: Duration) -> (String, String) {
    let began = Instant::now();
    simulation.set_control(Control::new(move || began.elapsed() >= budget, |_| {}));
    let clock = Clock::start();
    let (way, mut outlook) = match simulation.prepare() {
        Ok(_) => (Way::of(scene), Outlook::new(scene, clock)),
        Err(error) => return gave_up(&error, "relaxing the start", budget),
    };
    loop {
        let (steps, time, seconds) = outlook.reached();
        let after =
            format!("{steps} steps to time {}, in {}", Short(time), words::duration(seconds));
        if time >= way.until || way.max_steps.is_some_and(|most| steps >= most) {
            return (words::duration(seconds), format!("because that took {after}: all there are"));
        }
        if let Some(text) = outlook.words() {
            return (text, format!("from the start and the first {after}; without output"));
        }
        let target = next_output(&way, time);
        match simulation.step(target) {
            Ok(report) => outlook.step(&report, simulation.state().time, target),
            Err(error) => return gave_up(&error, &format!("the first {after}"), budget),
        }
    }
}

/// What there is to say when a step, or the start, did not come to its end.
fn gave_up(error: &Error, until: &str, budget: Duration) -> (String, String) {
    match error {
        Error::Solve(SolveError::Interrupted) => (
            "not known yet".to_owned(),
            format!(
                "because {} is all that --predict allows and {until} says too little; a run tells it when its \
                 steps have settled",
                words::duration(budget.as_secs_f64())
            ),
        ),
        error => ("not known".to_owned(), format!("because after {until} it fails: {error}")),
    }
}
