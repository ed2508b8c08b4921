//! Events of a run: snaps, and changes of stability where the scene asks for them.

use super::checkpoint::ResultsSoFar;
use super::session::Session;
use super::stability_monitor::StabilityMonitor;
use super::{Result, Simulation};
use crate::output::Progress;
use crate::output::events::{Event, Events};
use crate::solve::StepReport;

/// Events of a run, and its stability where the scene asks for it.
pub(super) struct RunEvents {
    pub(super) events: Events,
    pub(super) monitor: Option<StabilityMonitor>,
    /// Negative-curvature directions of the last state; NaN where they are not known.
    pub(super) negative: Option<f64>,
}

impl RunEvents {
    /// Opens the list of events, after those at `results`.
    ///
    /// # Errors
    /// A sheet too large for a factor, or files that cannot be made.
    pub(super) fn open(
        session: &Session<'_>,
        simulation: &mut Simulation,
        results: Option<&ResultsSoFar>,
    ) -> Result<Self> {
        let Session { scene, directory, .. } = session;
        let from = results.and_then(|results| results.watch);
        let monitor = StabilityMonitor::of(scene, simulation, directory, from)?;
        let first = simulation.sheet().reduction().is_first();
        let mut events = match results.filter(|_| first) {
            None => Events::new(directory.events()),
            Some(results) => Events::reopen(directory.events(), results.events)?,
        };
        if monitor.is_some() {
            events.begin()?;
        }
        Ok(Self { events, monitor, negative: None })
    }

    /// Writes an event for a step in which a snap ended, with the vertex that moved most in it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn note_snap(&mut self, simulation: &Simulation, report: &StepReport) -> Result<()> {
        let done = &report.relaxation;
        if done.snaps > 0 {
            let state = &simulation.stepper.state;
            let place = done.snapped.map(|vertex| (vertex, state.x[vertex]));
            self.events.append(&Event {
                time: state.time,
                step: state.step,
                kind: "snap",
                released: Some(done.released),
                place: place.map(|(vertex, x)| (vertex, [x.x, x.y, x.z])),
                ..Event::default()
            })?;
        }
        Ok(())
    }

    /// Analyses the stability of the state that was just accepted, if that is asked for.
    ///
    /// # Errors
    /// As [`StabilityMonitor::look`].
    pub(super) fn analyse(
        &mut self,
        simulation: &mut Simulation,
        report: &mut StepReport,
        progress: &mut Progress,
    ) -> Result<()> {
        if let Some(monitor) = &mut self.monitor {
            let to = (&mut self.events, progress);
            self.negative = Some(monitor.analyse(simulation, report, to)?);
        }
        Ok(())
    }
}
