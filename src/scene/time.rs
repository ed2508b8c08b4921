//! `[time]`: which derivatives are kept, how steps are made, and when to stop.

use serde::{Deserialize, Serialize};

use crate::num::checked::{AtLeast, Positive};
use crate::solve::{DEFAULT_INTEGRATOR, IntegratorSpec, OTHER_INTEGRATOR};
use crate::timescale::{DEFAULT_POLICY, PolicySpec, Storage};

use super::deserialize::read;
use super::document::Node;
use super::problem::Problem;
use super::registry::{Family, choose};

/// The table `[time]`.
#[derive(Debug, Serialize)]
pub struct TimeSpec {
    /// When to stop.
    #[serde(flatten)]
    pub span: Span,
    /// The timescale policy.
    pub policy: Box<dyn PolicySpec>,
    /// How steps are made.
    pub integrator: Box<dyn IntegratorSpec>,
}

/// When to stop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Span {
    /// Time of the last state, from 0.
    pub until: Positive,
    /// Stop when the rates fall below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_when_steady: Option<Positive>,
    /// Stop after this many steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_steps: Option<AtLeast<1>>,
}

/// Reads the table `[time]`.
pub(crate) fn read_time(mut node: Node) -> Result<TimeSpec, Problem> {
    let policy: Box<dyn PolicySpec> = chosen(&mut node, "policy", DEFAULT_POLICY)?;
    let quasi_static = policy.storage() == (Storage { mechanics: 0.0, chemistry: 1.0 });
    let default = if quasi_static { DEFAULT_INTEGRATOR } else { OTHER_INTEGRATOR };
    let integrator = chosen(&mut node, "integrator", default)?;
    let span = read(node).map_err(|p: Problem| p.also_allowed(&["policy", "integrator"]))?;
    Ok(TimeSpec { span, policy, integrator })
}

/// Takes the choice at `key` out of a table; without one, the kind called `default`.
fn chosen<T: ?Sized + Family>(
    node: &mut Node,
    key: &str,
    default: &str,
) -> Result<Box<T>, Problem> {
    let choice = match node.take(key) {
        Some((_, choice)) => choice,
        None => Node::text(default, node.place.clone()),
    };
    choose(choice, Some(default)).map_err(|problem| problem.under(key))
}
