//! Output times of a run: multiples of `output.every`, counted in integers so that steps end on them exactly.

use crate::model::State;
use crate::num::real;
use crate::scene::Scene;

/// Largest difference between a multiple and the end that is round-off, relative: of two numbers and a product.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

/// Which states are observed and which are frames.
pub struct OutputSchedule {
    every: f64,
    until: f64,
    /// Number of the next multiple of `every`.
    next: usize,
    /// The step whose state was observed last, and the last one that was a frame.
    observed: Option<u64>,
    framed: Option<u64>,
}

impl OutputSchedule {
    /// The schedule of `scene` from its start.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let until = scene.time.span.until.get();
        let every = scene.output.every.map_or(until, |every| every.get().min(until));
        Self { every, until, next: 0, observed: None, framed: None }
    }

    /// Continues at `state`, which was observed, after frames of which the last was at `frame`.
    pub(super) fn resume(&mut self, state: &State, frame: Option<f64>) {
        self.observed = Some(state.step);
        self.framed = self.observed.filter(|_| frame == Some(state.time));
        self.pass(state.time);
    }

    /// Whether the state of this step has not been observed.
    pub(super) fn is_new(&self, step: u64) -> bool {
        self.observed != Some(step)
    }

    /// Whether an output time is reached at `time`.
    pub(super) fn is_due(&self, time: f64) -> bool {
        time >= self.due()
    }

    /// The next output time: the end where a multiple differs from it by round-off, as 3 · 0.3 does from 0.9.
    fn due(&self) -> f64 {
        let multiple = real(self.next) * self.every;
        if (multiple - self.until).abs() <= ROUND_OFF * self.until { self.until } else { multiple }
    }

    /// Whether the state of `step`, which is to be a frame if `wanted`, is one that has not been written.
    pub(super) fn is_frame(&self, step: u64, wanted: bool) -> bool {
        wanted && self.framed != Some(step)
    }

    /// Takes note that the state of `step` is observed, and whether as a frame.
    pub(super) fn observe(&mut self, step: u64, frame: bool) {
        self.observed = Some(step);
        if frame {
            self.framed = Some(step);
        }
    }

    /// Counts the output times up to `time`.
    pub fn pass(&mut self, time: f64) {
        while self.is_due(time) {
            self.next += 1;
        }
    }

    /// The time at which a step has to end.
    #[must_use]
    pub fn target(&self) -> f64 {
        self.due().min(self.until)
    }
}
