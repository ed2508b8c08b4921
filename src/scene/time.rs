//! `[time]`: which derivatives are kept, how steps are made, and when to stop.

use serde::{Deserialize, Serialize};

use crate::model::{Policy, Start};
use crate::num::Short;
use crate::num::checked::{AtLeast, Fraction, Positive};
use crate::solve::{
    DEFAULT_INTEGRATOR, IntegratorSpec, POINT_INTEGRATOR, POINT_TOLERANCE,
    STEADY_CHEMISTRY_INTEGRATOR,
};

use crate::document::DocumentError;
use crate::document::read;
use crate::document::{Node, Value};
use crate::registry::{Family, choose};

/// The table `[time]`.
#[derive(Debug, Serialize)]
pub struct TimeSpec {
    /// How to begin, and when to stop.
    #[serde(flatten)]
    pub span: Span,
    /// The timescale policy.
    pub policy: Policy,
    /// How steps are made.
    pub(crate) integrator: Box<dyn IntegratorSpec>,
}

/// How to begin, and when to stop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Span {
    /// Time of the last state, from 0.
    pub until: Positive,
    /// The shape of the first state: the equilibrium that the sheet grows to from the shape of the scene, or that
    /// shape itself.
    #[serde(default)]
    pub start: Start,
    /// Largest share of the energy supplied in a step that the small drag which stabilises a quasi-static shape takes up; the
    /// relative tolerance if not given; 0 for one relaxation a step without drag.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stabilisation: Option<Fraction>,
    /// Stop when the rates fall below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_when_steady: Option<Positive>,
    /// Stop after this many steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_steps: Option<AtLeast<1>>,
}

impl Span {
    /// Refuses multiples of `every` that are closer than times of the run can be distinguished.
    pub(super) fn check_multiples(&self, every: Positive) -> Result<(), DocumentError> {
        let (every, until) = (every.get(), self.until.get());
        if until / every <= f64::EPSILON.recip() {
            return Ok(());
        }
        let message = format!(
            "every = {} is too short for times up to time.until = {} to differ",
            Short(every),
            Short(until)
        );
        Err(DocumentError::plain(message))
    }
}

/// Methods that are taken for integrators, and whose they are.
const METHODS: [(&str, &str); 5] = [
    ("bdf", "monolithic"),
    ("tr-bdf2", "monolithic"),
    ("esdirk34", "monolithic"),
    ("tsit45", "explicit"),
    ("heun", "staggered"),
];

/// Reads the table `[time]` of a scene that is a `point`, without space, or has a sheet.
pub(crate) fn read_time(mut node: Node, point: bool) -> Result<TimeSpec, DocumentError> {
    if let Some((key, _)) = node.take("from") {
        let gone = "a run begins at time 0 with the start of its scene";
        let help = "`rumple run SCENE --from STATE` begins with another, `rumple resume DIR` continues a run";
        return Err(DocumentError::located(key.place, gone).help(help).under("from"));
    }
    let policy = match node.take("policy") {
        Some((_, node)) => read_policy(node).map_err(|problem| problem.under("policy"))?,
        None => Policy::default(),
    };
    let default = match policy {
        _ if point => POINT_INTEGRATOR,
        Policy::QuasiStatic | Policy::Simultaneous => DEFAULT_INTEGRATOR,
        Policy::ChemistryFast => STEADY_CHEMISTRY_INTEGRATOR,
    };
    let complete = |choice| if point { at_a_point(choice) } else { choice };
    let integrator = chosen(&mut node, "integrator", default, complete).map_err(|problem| {
        let known = problem.as_unknown_name().and_then(|name| METHODS.iter().find(|m| m.0 == name));
        match known {
            None => problem,
            Some((method, kind)) => problem.help(format!(
                "{method} is a method of {kind}: write {{ kind = \"{kind}\", method = \"{method}\" }}"
            )),
        }
    })?;
    let span = read(node).map_err(|p: DocumentError| p.also_allowed(&["policy", "integrator"]))?;
    Ok(TimeSpec { span, policy, integrator })
}

/// Takes the choice at `key` out of a table and completes it; without one, the kind called `default`.
fn chosen<T: ?Sized + Family>(
    node: &mut Node,
    key: &str,
    default: &str,
    complete: impl FnOnce(Node) -> Node,
) -> Result<Box<T>, DocumentError> {
    let choice = match node.take(key) {
        Some((_, choice)) => choice,
        None => Node::default_text(default, node.place.clone()),
    };
    choose(complete(choice), Some(default)).map_err(|problem| problem.under(key))
}

/// Gives the default integrator of a point the tolerances that it has there, where the scene gives none.
fn at_a_point(mut choice: Node) -> Node {
    let place = choice.place.clone();
    if let Value::String(name) = &choice.value {
        let kind = Node::default_text(name, place.clone());
        choice = Node::empty_table(place.clone());
        choice.insert_if_absent("kind", kind.value);
    }
    let named =
        |kind: &Node| matches!(&kind.value, Value::String(name) if name == POINT_INTEGRATOR);
    if choice.get("kind").is_none_or(named) {
        for (key, tolerance) in POINT_TOLERANCE {
            choice.insert_if_absent(key, Value::Float(tolerance));
        }
    }
    choice
}

/// A policy by its name, or as a table with its name as `kind`.
fn read_policy(mut node: Node) -> Result<Policy, DocumentError> {
    let whole = node.place.clone();
    let named = match node.take("kind") {
        Some((_, name)) => {
            let rest: Nothing = read(node).map_err(|p: DocumentError| p.also_allowed(&["kind"]))?;
            let Nothing {} = rest;
            name
        }
        None => node,
    };
    let place = named.place.clone();
    let Value::String(name) = named.value else {
        let problem =
            DocumentError::mismatch("the name of a policy in quotes", named.value.describe());
        return Err(problem.placed(&place));
    };
    let found = Policy::ALL.into_iter().find(|policy| policy.name() == name);
    found.ok_or_else(|| {
        let names = Policy::ALL.map(Policy::name);
        DocumentError::unknown_name("timescale policy", &name, &names).placed(&place).placed(&whole)
    })
}

/// A table without keys.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Nothing {}
