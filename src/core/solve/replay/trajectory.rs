//! The unknowns of a replay, and the models that are evaluated at them.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::stages::{STAGES, Stages, Window, stage_time};
use crate::model::{Coupled, Layout, Model, State, Subsystem};
use crate::solve::Result;
use crate::solve::continuation::{Unknowns, unflatten};
use crate::solve::sensitivity::not_differentiable;

/// Bytes of all stages with their adjoints.
const MEMORY: usize = 4 << 30;

/// The steps of a replay.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    pub(super) steps: Vec<Window>,
    /// How many steps lead to every time at which the state is asked for.
    pub(super) marks: Vec<usize>,
    /// The largest estimate of the error of a step, in tolerances.
    pub error: f64,
}

impl Schedule {
    /// Number of steps.
    #[must_use]
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Whether it has no steps.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }
}

/// The unknowns of a replay.
pub struct Trajectory {
    pub(super) layout: Arc<Layout>,
    pub(super) start: State,
    pub(super) first: Vec<f64>,
    pub(super) stages: Vec<Stages>,
    pub(super) schedule: Schedule,
}

/// The adjoint of a replay.
pub struct Adjoint {
    /// What F is weighed by at every stage.
    pub(super) weights: Vec<Stages>,
    /// What M is weighed by.
    pub(super) mass: Vec<f64>,
    /// λ_0.
    pub(super) first: Vec<f64>,
}

impl Trajectory {
    /// Its steps.
    #[must_use]
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// y at the end of the last step.
    pub(super) fn last(&self) -> &[f64] {
        self.stages.last().map_or(&self.first, |stages| &stages[STAGES - 1])
    }

    /// Accepts a step.
    pub(super) fn take(&mut self, span: Window, stages: Stages, error: f64) -> Result<()> {
        let bytes = (self.stages.len() + 1) * 2 * STAGES * self.first.len() * size_of::<f64>();
        if bytes > MEMORY {
            return Err(not_differentiable(format!(
                "{} steps up to t = {} need more than {} GiB: a looser tolerance or a coarser mesh has fewer values",
                self.stages.len(),
                span.end,
                MEMORY >> 30
            )));
        }
        self.schedule.steps.push(span);
        self.schedule.error = self.schedule.error.max(error);
        self.stages.push(stages);
        Ok(())
    }

    /// The state of `model` with the unknowns `y`.
    pub(super) fn state(&self, model: &Model, time: f64, y: &[f64]) -> State {
        let mut state = self.start.clone();
        // Values that are held are unknowns too: of another model they are not set again.
        self.layout.unpack(model.mechanics(), time, y, &mut state);
        state
    }

    /// The states at the times asked for, of `model`, one of the same unknowns, at fixed unknowns.
    #[must_use]
    pub fn states(&self, model: &Model) -> Vec<State> {
        let state = |mark: &usize| {
            let (time, y) = match mark.checked_sub(1) {
                None => (self.start.time, &self.first),
                Some(last) => {
                    (self.schedule.steps[last].shown_time, &self.stages[last][STAGES - 1])
                }
            };
            let mut state = self.state(model, time, y);
            state.step = u64::try_from(*mark).unwrap_or_default();
            state
        };
        self.schedule.marks.iter().map(state).collect()
    }

    /// λ_0 of the shape, where the first shape counts.
    #[must_use]
    pub fn first_shape(&self, adjoint: &Adjoint) -> Option<Unknowns> {
        let layout = &*self.layout;
        let counts = adjoint.first[..layout.mechanical()].iter().any(|value| *value != 0.0);
        let mut first = adjoint.first.clone();
        first[layout.mechanical()..].fill(0.0);
        counts.then(|| unflatten(layout, &first, &like(&self.start)))
    }

    /// The terms of λ_0·y_0 + Σ μ·r of `model`, one of the same unknowns that begins with the species of `start`, at fixed unknowns and with the
    /// first shape fixed.
    ///
    /// # Errors
    /// Laws that fail.
    pub fn lagrangian(
        &self,
        adjoint: &Adjoint,
        model: &Arc<Model>,
        start: &State,
    ) -> Result<Unknowns> {
        let mut coupled = Coupled::new(model, Subsystem::Whole);
        coupled.start(&self.start);
        let layout = &*self.layout;
        let mut first = start.clone();
        model.hold(start.time, &mut first.species);
        let first = coupled.pack(&first);
        let mut sum: Vec<f64> = coupled.mass().zip(&adjoint.mass).map(|(m, w)| m * w).collect();
        for k in layout.mechanical()..sum.len() {
            sum[k] += adjoint.first[k] * first[k];
        }
        let mut out = vec![0.0; sum.len()];
        let steps = self.schedule.steps.iter().zip(&self.stages).zip(&adjoint.weights);
        for ((span, stages), weights) in steps {
            for (i, (y, weights)) in stages.iter().zip(weights).enumerate() {
                coupled.residual(stage_time(*span, i), y, &mut out)?;
                sum.iter_mut().zip(weights).zip(&out).for_each(|((s, w), f)| *s -= w * f);
            }
        }
        Ok(unflatten(layout, &sum, &like(&self.start)))
    }
}

fn like(state: &State) -> Unknowns {
    Unknowns { x: state.x.to_vec(), species: state.species.clone() }.zeros_like()
}
