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
        let now = processor_time().unwrap_or(f64::NAN) - self.processor;
        if now.is_finite() { now } else { self.wall() }
    }
}

/// Forecasts a run in processor time, which is nearly independent of other programs, and converts it to wall
/// time, at the ratio so far.
pub(in crate::run) struct RunForecast {
    rule: StepRule,
    way: Way,
    clock: Clock,
    forecast: Forecast,
    /// Processor time at the last step.
    before: f64,
    steps: u64,
    time: f64,
    /// The first prediction, which is announced and judged at the end.
    first: Option<Predicted>,
}

/// A run announces nothing before so many seconds: one that is over by then needs no prediction.
const LEAST_SECONDS: f64 = 1.0;

impl RunForecast {
    /// Of a run whose start is relaxed, which began with `clock`.
    pub(in crate::run) fn new(scene: &Scene, clock: Clock) -> Self {
        let (rule, way, before) = (scene.time.integrator.rule(), Way::of(scene), clock.processor());
        let forecast = Forecast::new(rule, way, before);
        Self { rule, way, clock, forecast, before, steps: 0, time: 0.0, first: None }
    }

    /// Records a step to `time`, where the run wanted one to end if it is `cut`.
    pub(in crate::run) fn step(&mut self, report: &StepReport, time: f64, cut: bool) {
        let now = self.clock.processor();
        self.forecast.step(Taken {
            time,
            length: report.length,
            allowed: report.allowed,
            cut,
            seconds: now - self.before,
        });
        self.before = now;
        self.steps += 1;
        self.time = time;
    }

    /// What there is to predict, if that is known: the whole run.
    pub(super) fn predicted(&self) -> Option<Predicted> {
        let whole = self.forecast.whole()?;
        let Range { likely, least, most } = self.in_wall_time(whole);
        Some(Predicted {
            seconds: likely,
            least_seconds: least,
            most_seconds: most,
            cpu_seconds: whole.likely,
            steps: self.steps
                + self.forecast.steps_left().map_or(0, |left| num::whole(left) as u64),
            after_seconds: self.clock.wall(),
            after_steps: self.steps,
            after_time: self.time,
            took: None,
        })
    }

    /// The same in words, and what other tolerances would cost.
    pub(super) fn words(&self) -> Option<String> {
        let whole = self.in_wall_time(self.forecast.whole()?);
        let (here, what) = match self.rule {
            StepRule::Fixed(step) => (format!("in steps of {}", Short(step)), "step"),
            StepRule::Controlled { rtol, .. } => (format!("at rtol {}", Short(rtol)), "tolerance"),
        };
        let mut text = format!("{}{} {here}", self.at_most(), words::about(whole));
        let other = |factor| {
            let seconds = self.forecast.whole_at(factor)?;
            Some(words::about(Range::of(self.wall_per_processor() * seconds)))
        };
        if let (Some(half), Some(double)) = (other(0.5), other(2.0)) {
            text += &format!("; half the {what} {half}, double {double}");
        }
        Some(text)
    }

    /// What is left in words, where that is known.
    pub(in crate::run) fn left(&self) -> Option<String> {
        let left = self.in_wall_time(self.forecast.left()?);
        let matters = left.likely >= words::NOTHING;
        matters.then(|| format!("{}{} left", self.at_most(), words::shortly(left)))
    }

    /// The first prediction with its words, once, as soon as there is one.
    pub(in crate::run) fn announced(&mut self) -> Option<(Predicted, String)> {
        if self.first.is_some() || self.clock.wall() < LEAST_SECONDS {
            return None;
        }
        let predicted = self.predicted()?;
        self.first = Some(predicted);
        Some((predicted, self.words()?))
    }

    /// The first prediction and what was true, at the end.
    pub(in crate::run) fn judged(&self) -> Option<Predicted> {
        let took = Took { seconds: self.clock.wall(), cpu_seconds: self.clock.processor() };
        self.first.map(|first| Predicted { took: Some(took), ..first })
    }

    /// Steps so far, the time that they have led to, and seconds since the beginning.
    pub(super) fn reached(&self) -> (u64, f64, f64) {
        (self.steps, self.time, self.clock.wall())
    }

    fn at_most(&self) -> &'static str {
        if self.way.may_end_sooner { "at most " } else { "" }
    }

    /// Wall time per processor time.
    fn wall_per_processor(&self) -> f64 {
        let ratio = self.clock.wall() / self.clock.processor();
        if ratio.is_finite() { ratio } else { 1.0 }
    }

    /// Other programs that slow this one down may end: at least, in wall time, is without them.
    fn in_wall_time(&self, range: Range) -> Range {
        let ratio = self.wall_per_processor();
        Range { least: range.least * ratio.min(1.0), ..range.times_plus(ratio, 0.0) }
    }
}
