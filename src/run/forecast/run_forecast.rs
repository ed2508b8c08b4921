//! What a run says of how long it takes, before and after.

use std::time::Instant;

use super::super::costs::processor_time;
use super::{Forecast, Range, StepRule, Taken, Way, words};
use crate::num::{self, Short};
use crate::output::{Predicted, Took};
use crate::scene::Scene;
use crate::solve::StepReport;

/// Wall and processor time since a beginning, s.
#[derive(Debug, Clone, Copy)]
pub(in crate::run) struct Clock {
    began: Instant,
    processor: f64,
}

impl Clock {
    /// From now on.
    pub(in crate::run) fn start() -> Self {
        Self { began: Instant::now(), processor: processor_time().unwrap_or(f64::NAN) }
    }

    /// Wall time, s.
    pub(in crate::run) fn wall(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// Processor time, s; the wall time where the system does not say it.
    fn processor(&self) -> f64 {
        processor_time().map_or_else(|| self.wall(), |now| now - self.processor)
    }
}

/// Forecasts a run in processor time, which is nearly independent of other programs, and converts it to wall
/// time, at the ratio so far.
pub(in crate::run) struct RunForecast {
    clock: Clock,
    forecast: Forecast,
    /// Processor time at the last step.
    before: f64,
    /// The first prediction, which is announced and judged at the end.
    first: Option<Predicted>,
}

/// A run announces nothing before so many seconds: one that is over by then needs no prediction.
const LEAST_SECONDS: f64 = 1.0;

impl RunForecast {
    /// Of a run whose start is relaxed, which began with `clock`.
    pub(in crate::run) fn new(scene: &Scene, clock: Clock) -> Self {
        let before = clock.processor();
        let forecast = Forecast::new(scene.time.integrator.rule(), Way::of(scene), before);
        Self { clock, forecast, before, first: None }
    }

    /// Records a step to `time`, where the run wanted one to end if it is `cut`.
    pub(in crate::run) fn step(&mut self, report: &StepReport, time: f64, cut: bool) {
        let now = self.clock.processor();
        let (length, allowed, seconds) = (report.length, report.allowed, now - self.before);
        self.forecast.step(Taken { time, length, allowed, cut, seconds });
        self.before = now;
    }

    /// Steps so far, the time that they have led to, and seconds since the beginning.
    pub(in crate::run) fn reached(&self) -> (usize, f64, f64) {
        (self.forecast.count, self.forecast.time(), self.clock.wall())
    }

    /// The time at which the next step has to end; none at the end of the run.
    pub(in crate::run) fn target(&self) -> Option<f64> {
        let Forecast { way, count, .. } = &self.forecast;
        let time = self.forecast.time();
        let over = time >= way.until || way.max_steps.is_some_and(|most| *count >= most);
        (!over).then(|| way.next_output(time))
    }

    /// The prediction of the whole run, if it is known, with its words and what other tolerances would cost.
    pub(in crate::run) fn predicted(&self) -> Option<(Predicted, String)> {
        let forecast = &self.forecast;
        let whole = forecast.whole()?;
        let wall = self.in_wall_time(whole);
        let predicted = Predicted {
            seconds: wall.likely,
            least_seconds: wall.least,
            most_seconds: wall.most,
            cpu_seconds: whole.likely,
            steps: (forecast.count + num::whole(forecast.steps_left()?)) as u64,
            after_seconds: self.clock.wall(),
            after_steps: forecast.count as u64,
            after_time: forecast.time(),
            took: None,
        };
        let (here, what) = match forecast.rule {
            StepRule::Fixed(step) => (format!("in steps of {}", Short(step)), "step"),
            StepRule::Controlled { rtol, .. } => (format!("at rtol {}", Short(rtol)), "tolerance"),
        };
        let mut text = format!("{}{} {here}", self.at_most(), words::about(wall));
        let other = |factor| {
            let seconds = self.wall_per_processor() * forecast.whole_at(factor)?;
            Some(words::about(Range::of(seconds)))
        };
        if let (Some(half), Some(double)) = (other(0.5), other(2.0)) {
            text += &format!("; half the {what} {half}, double {double}");
        }
        Some((predicted, text))
    }

    /// What is left in words, where that is known.
    pub(in crate::run) fn left(&self) -> Option<String> {
        let left = self.in_wall_time(self.forecast.left()?);
        let matters = left.likely >= words::NOTHING;
        matters.then(|| format!("{}{} left", self.at_most(), words::about(left)))
    }

    /// The first prediction with its words, once, as soon as there is one.
    pub(in crate::run) fn announced(&mut self) -> Option<(Predicted, String)> {
        if self.first.is_some() || self.clock.wall() < LEAST_SECONDS {
            return None;
        }
        let announced = self.predicted()?;
        self.first = Some(announced.0);
        Some(announced)
    }

    /// The first prediction and what was true, at the end.
    pub(in crate::run) fn judged(&self) -> Option<Predicted> {
        let took = Took { seconds: self.clock.wall(), cpu_seconds: self.clock.processor() };
        self.first.map(|first| Predicted { took: Some(took), ..first })
    }

    fn at_most(&self) -> &'static str {
        if self.forecast.way.may_end_sooner { "at most " } else { "" }
    }

    /// Wall time per processor time so far.
    fn wall_per_processor(&self) -> f64 {
        let ratio = self.clock.wall() / self.clock.processor();
        if ratio.is_finite() { ratio } else { 1.0 }
    }

    /// Other programs that slow this one down may end: at least, in wall time, is without them.
    fn in_wall_time(&self, range: Range) -> Range {
        let ratio = self.wall_per_processor();
        Range { least: range.least * ratio.min(1.0), ..range.map(|seconds| ratio * seconds) }
    }
}
