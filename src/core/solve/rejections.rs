//! Rejected step attempts: why, how often, and the last of them.
//!
//! A step that is rejected is tried again, shorter. Nothing of the attempt is left but this: how many attempts
//! every cause has cost, which is work that a run counts, and the last few, to find out why
//! a run failed.

use std::collections::VecDeque;
use std::fmt;

use super::SolveError;
use super::diagnosis::Reason;
use crate::model::{ModelError, State};

/// Cause of a rejected step attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Its error estimate is above the tolerance.
    Error,
    /// A law failed, asked for a shorter step, or gave a number that cannot be used.
    Law,
    /// A species left its valid range.
    Range,
    /// An energy, a force or an unknown is not a finite number.
    NotFinite,
    /// A relaxation did not complete.
    Relaxation,
    /// A triangle lost its area, or optimal lengths made none.
    Collapse,
    /// The chemistry did not come to the end of the step, or to its steady state.
    Chemistry,
    /// A linear system or an equation of an implicit method was not solved.
    Solver,
}

impl Cause {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 8] = [
        Self::Error,
        Self::Law,
        Self::Range,
        Self::NotFinite,
        Self::Relaxation,
        Self::Collapse,
        Self::Chemistry,
        Self::Solver,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Law => "law",
            Self::Range => "range",
            Self::NotFinite => "not finite",
            Self::Relaxation => "relaxation",
            Self::Collapse => "collapse",
            Self::Chemistry => "chemistry",
            Self::Solver => "solver",
        }
    }
}

impl SolveError {
    /// Counter of the step attempts rejected for it.
    #[must_use]
    pub fn cause(&self) -> Cause {
        match self {
            Self::Model(ModelError::Kinetics(_)) => Cause::Law,
            Self::Model(ModelError::OutOfRange { value, .. }) if !value.is_finite() => {
                Cause::NotFinite
            }
            Self::Model(ModelError::OutOfRange { .. } | ModelError::Negative { .. }) => {
                Cause::Range
            }
            Self::Model(ModelError::Sheet(_)) | Self::Collapsed { .. } => Cause::Collapse,
            Self::NotAtRest { diagnosis, .. } if diagnosis.reason == Reason::Mesh => {
                Cause::Collapse
            }
            Self::NotFinite | Self::EffectNotFinite { .. } | Self::SpectralBound { .. } => {
                Cause::NotFinite
            }
            Self::NotConverged { .. }
            | Self::NotAtRest { .. }
            | Self::Stalled { .. }
            | Self::Departed
            | Self::Obstructed { .. }
            | Self::WithoutRest { .. }
            | Self::InsideOut
            | Self::Constraint { .. } => Cause::Relaxation,
            Self::StepTooSmall { .. } => Cause::Error,
            Self::TooManySteps { .. }
            | Self::Unresolved { .. }
            | Self::Inadmissible { .. }
            | Self::NotSteady { .. }
            | Self::Leap { .. } => Cause::Chemistry,
            _ => Cause::Solver,
        }
    }
}

/// A rejected step attempt.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejection {
    /// Number of the step that was tried.
    pub step: u64,
    /// Where it was to begin.
    pub time: f64,
    /// How long it was to be; NaN where a library does not tell.
    pub length: f64,
    /// Its error estimate in units of the tolerance; NaN without one.
    pub error: f64,
    /// Why it was rejected.
    pub cause: Cause,
    /// The same in words; empty where the cause says it all.
    pub message: String,
}

/// Rejections that are kept.
const MAX_KEPT: usize = 50;

impl Rejection {
    /// At a step of this length from `state`.
    pub(super) fn new(state: &State, length: f64, cause: Cause) -> Self {
        let (step, time) = (state.step + 1, state.time);
        Self { step, time, length, error: f64::NAN, cause, message: String::new() }
    }
}

/// Rejected step attempts, by [`Cause::ALL`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Causes(pub [u64; Cause::ALL.len()]);

impl Causes {
    /// Those since `before`.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        let mut all = self.0;
        all.iter_mut().zip(before.0).for_each(|(now, before)| *now -= before);
        Self(all)
    }

    /// Adds `more`.
    pub fn add(&mut self, more: Self) {
        self.0.iter_mut().zip(more.0).for_each(|(all, more)| *all += more);
    }

    /// Every cause with how many there are of it.
    pub fn iter(self) -> impl Iterator<Item = (Cause, u64)> {
        Cause::ALL.into_iter().zip(self.0)
    }
}

impl fmt::Display for Causes {
    /// As `12 error, 3 law`: those that there are, the most frequent first.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut all: Vec<_> = self.iter().filter(|(_, count)| *count > 0).collect();
        all.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        let words = all.iter().map(|(cause, count)| format!("{count} {}", cause.name()));
        f.write_str(&words.collect::<Vec<_>>().join(", "))
    }
}

/// The latest rejected step attempts, and the number of each cause.
#[derive(Debug, Clone, Default)]
pub struct Rejections {
    last: VecDeque<Rejection>,
    causes: Causes,
}

impl Rejections {
    /// Adds one, and forgets the oldest.
    pub(super) fn note(&mut self, new: Rejection) {
        let at = Cause::ALL.iter().position(|cause| *cause == new.cause);
        if let Some(count) = at.and_then(|at| self.causes.0.get_mut(at)) {
            *count += 1;
        }
        if self.last.len() == MAX_KEPT {
            self.last.pop_front();
        }
        self.last.push_back(new);
    }

    /// How many there were.
    #[must_use]
    pub fn causes(&self) -> Causes {
        self.causes
    }

    /// The last ones, in their order.
    pub fn last(&self) -> impl DoubleEndedIterator<Item = &Rejection> {
        self.last.iter()
    }
}
