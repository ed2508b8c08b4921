//! Messages between parent and child as text: the request for a law, problems of calls.

use serde::{Deserialize, Serialize};

use super::memory::CALLS;
use crate::descriptor::Descriptor;
use crate::{Batch, KineticsError, Outcome, Site, Unreliable, float_bits};

/// The parent's request to create a law.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct CreateRequest {
    /// Bits of the parameters.
    pub(super) parameters: Vec<u64>,
    /// Whether parameters that differ from point to point are handed over as columns.
    pub(super) takes_parameter_columns: bool,
}

/// What was wrong with a call: an error, or a warning about its results.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum CallProblem {
    /// A warning: there are results.
    Unreliable { message: String, point: Option<usize> },
    /// A shorter step may help.
    Retry {
        call: String,
        point: Option<usize>,
        #[serde(with = "float_bits")]
        factor: f64,
        message: String,
    },
    /// No other step will help.
    Failed { call: String, point: Option<usize>, message: String },
    /// Anything else, in words.
    Other(String),
}

impl CallProblem {
    /// Of an outcome; `None` where all is well.
    pub(super) fn of(outcome: Outcome) -> Option<Self> {
        match outcome {
            Ok(None) => None,
            Ok(Some(Unreliable { message, point })) => Some(Self::Unreliable { message, point }),
            Err(error) => Some(Self::of_error(error)),
        }
    }

    pub(super) fn of_error(error: KineticsError) -> Self {
        let number = |site: Option<Box<Site>>| site.map(|site| site.point);
        match error {
            KineticsError::Retry { call, point, factor, message, .. } => {
                Self::Retry { call: call.to_owned(), point: number(point), factor, message }
            }
            KineticsError::Failed { call, point, message, .. } => {
                Self::Failed { call: call.to_owned(), point: number(point), message }
            }
            other => Self::Other(other.to_string()),
        }
    }

    /// As an outcome of a call at a batch of points, if it has some.
    pub(super) fn outcome(self, descriptor: &Descriptor, batch: Option<&Batch<'_>>) -> Outcome {
        let plugin = descriptor.name.clone();
        let known = |call: &str| CALLS.iter().find(|c| **c == call).copied().unwrap_or("a call");
        let site = |point: Option<usize>| {
            let batch = batch?;
            let point = point?.saturating_sub(batch.first);
            Some(Box::new(Site::of(batch, descriptor, &descriptor.signals, point)))
        };
        match self {
            Self::Unreliable { message, point } => Ok(Some(Unreliable { message, point })),
            Self::Retry { call, point, factor, message } => {
                let (call, point) = (known(&call), site(point));
                Err(KineticsError::Retry { plugin, call, point, factor, message })
            }
            Self::Failed { call, point, message } => {
                let (call, point) = (known(&call), site(point));
                Err(KineticsError::Failed { plugin, call, point, message })
            }
            Self::Other(text) => Err(KineticsError::Isolated(text)),
        }
    }
}
