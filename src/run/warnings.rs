//! Warnings of a run: faults of laws and effects, steps that shrink, steps that are rejected repeatedly. Each is given once.

use super::{Error, Simulation, located};
use crate::kinetics::KineticsError;
use crate::solve::StepReport;
use crate::solve::rejections::Causes;

/// Share of the energy supplied from which on the work of a stabilising drag is reported.
const LARGE_DRAG_SHARE: f64 = 0.05;
/// Rejected steps from which on the reason is reported.
const REPORT_AFTER: usize = 5;

/// The warnings given so far.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    faults: Faults,
    shrinking: Shrinking,
    /// Accepted steps with a reason for rejected attempts.
    rejected: usize,
    /// Whether the share of the work of the drag was reported.
    dragged: bool,
    /// Whether the last step left a quasi-static shape under way.
    moving: bool,
}

impl Warnings {
    /// New warnings after the accepted step of `report`, which an output time or a breakpoint may have `cut` short. Faults
    /// are listed in `simulation` as well.
    pub(super) fn after(
        &mut self,
        simulation: &mut Simulation,
        report: &mut StepReport,
        cut: bool,
    ) -> Vec<String> {
        let mut new = self.faults.unreported(simulation);
        simulation.faults.extend_from_slice(&new);
        new.extend(self.shrinking.after(report, simulation.stepper.state.time, cut));
        self.moving = report.relaxation.moving;
        let share = report.relaxation.drag_share;
        if share > LARGE_DRAG_SHARE && !std::mem::replace(&mut self.dragged, true) {
            new.push(format!(
                "the drag that stabilises the shape has taken up {:.0} % of the energy supplied by time {}: the \
                 shape lags behind its equilibrium, or crumples in many small snaps; lower time.stabilisation (or \
                 time.integrator.rtol): the lag falls with it, what snaps release does not",
                100.0 * share,
                simulation.stepper.state.time
            ));
        }
        if let Some(reason) = report.reason.take() {
            self.rejected += 1;
            if self.rejected == REPORT_AFTER {
                new.push(format!("step size repeatedly reduced: {reason}"));
            }
        }
        new
    }

    /// A warning where the run ends.
    pub(super) fn at_end(&self) -> Option<&'static str> {
        self.moving.then_some(
            "the run ends while the shape moves under the stabilising drag: its last shape is not at rest; continue it to a \
             later time",
        )
    }
}

/// Faults of laws and effects reported so far.
#[derive(Debug, Default)]
struct Faults {
    unreliable: bool,
    bad: bool,
    energy: bool,
}

impl Faults {
    /// Those that are new after an accepted step.
    fn unreported(&mut self, simulation: &Simulation) -> Vec<String> {
        let mut news = Vec::new();
        if !self.energy
            && let (_, Some((effect, time))) = simulation.model().mechanics().not_finite()
        {
            self.energy = true;
            news.push(format!(
                "the energy or a force of the effect {effect} was not a finite number on the way at time \
                 {time}; the try was made shorter"
            ));
        }
        let Some(chemistry) = simulation.model().chemistry() else { return news };
        let flagged = chemistry.unreliable_results();
        if !self.unreliable
            && let Some(text) = flagged.unreliable(chemistry.descriptor())
        {
            self.unreliable = true;
            news.push(text);
        }
        if !self.bad
            && let Some(bad) = flagged.bad()
        {
            self.bad = true;
            let error = Error::Kinetics(KineticsError::BadOutput(Box::new(bad.clone())));
            let error = located(error, simulation.sheet(), &simulation.stepper.state.x);
            news.push(format!("{error}; this was in a rejected step"));
        }
        news
    }
}

/// Steps shorter than the longest one by this factor are reported, and again for every further one.
const SHORT_STEP_RATIO: f64 = 1e3;

/// Steps that become far shorter than they were.
#[derive(Debug, Default)]
struct Shrinking {
    longest: f64,
    /// Reported down to here.
    told: f64,
    /// Of the attempts rejected since the longest one, and the last of their reasons.
    rejected: Causes,
    reason: Option<String>,
}

impl Shrinking {
    /// A warning after a step that led to `time`; none if an output time has `cut` it.
    fn after(&mut self, report: &StepReport, time: f64, cut: bool) -> Option<String> {
        if report.length >= self.longest {
            *self = Self { longest: report.length, told: report.length, ..Self::default() };
        }
        self.rejected.add(report.rejected);
        if let Some(reason) = &report.reason {
            self.reason = Some(reason.clone());
        }
        let rejected = self.rejected != Causes::default();
        if cut || !rejected || SHORT_STEP_RATIO * report.length >= self.told {
            return None;
        }
        self.told = report.length;
        let Self { longest, rejected, reason, .. } = self;
        let mut text = format!(
            "time {time}: steps have shrunk by a factor of {:.0e}, from {longest:.1e} to {:.1e}; attempts were rejected for: \
             {rejected}",
            *longest / report.length,
            report.length
        );
        if let Some(reason) = reason {
            text += &format!("; the last one: {reason}");
        }
        Some(text)
    }
}
