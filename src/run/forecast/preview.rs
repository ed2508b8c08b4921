//! How long a run would take, from its first steps, which are made and forgotten.

use std::time::{Duration, Instant};

use super::lengths::next_output;
use super::outlook::{Clock, Outlook};
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

/// How long `scene`, made ready as `simulation`, would take to run. Its start is relaxed and steps are made until
/// a forecast has settled, for as long as `budget` at most; the simulation is left where that has led to.
#[must_use]
pub fn preview(scene: &Scene, simulation: &mut Simulation, budget: Duration) -> Preview {
    let began = Instant::now();
    simulation.set_control(Control::new(move || began.elapsed() >= budget, |_| {}));
    let clock = Clock::start();
    let (way, mut outlook) = match simulation.prepare() {
        Ok(_) => (Way::of(scene), Outlook::new(scene, clock)),
        Err(error) => return gave_up(&error, "relaxing the start", budget),
    };
    loop {
        let (steps, time, seconds) = outlook.reached();
        let seconds = words::duration(seconds);
        let after = format!("{steps} steps to time {}", Short(time));
        if time >= way.until || way.max_steps.is_some_and(|most| steps >= most) {
            let because = format!("because it took that to make all {after}, without output");
            return Preview { what: seconds, because, predicted: None };
        }
        if let Some(what) = outlook.words() {
            let because = format!(
                "from relaxing the start and the first {after}, made in {seconds}, without output"
            );
            return Preview { what, because, predicted: outlook.predicted() };
        }
        let target = next_output(&way, time);
        match simulation.step(target) {
            Ok(report) => outlook.step(&report, simulation.state().time, target),
            Err(error) => return gave_up(&error, &format!("the first {after}"), budget),
        }
    }
}

/// What there is to say when a step, or the start, did not come to its end.
fn gave_up(error: &Error, until: &str, budget: Duration) -> Preview {
    let (what, because) = match error {
        Error::Solve(SolveError::Interrupted) => {
            let all = words::duration(budget.as_secs_f64());
            let because = format!(
                "because {all} is all that --predict allows, and {until} says too little; a run tells it \
                 once its steps have settled"
            );
            ("not known yet", because)
        }
        error => ("not known", format!("because after {until} it fails: {error}")),
    };
    Preview { what: what.to_owned(), because, predicted: None }
}
