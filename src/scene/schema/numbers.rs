//! Numbers that a reader takes: integers or any, with their bounds where these are 0, 1/2, 1 or -1.

use serde_json::json;

use super::probe::{Described, Probe};
use crate::document::Value;

/// Where the readers' ranges begin and end.
const BOUNDS: [f64; 4] = [-1.0, 0.0, 0.5, 1.0];

/// A number just beside a bound.
const BOUND_OFFSET: f64 = 1e-3;

/// Integers that are tried, from below: kinds of counts begin with one of them.
const TRIED_INTEGERS: [i64; 8] = [-1_000_000, -1, 0, 1, 2, 3, 4, 10_000];

pub(super) fn numbers(probe: &Probe) -> Option<Described> {
    let real = |x: f64| probe.refusal(Value::Float(x));
    let takes = |x: f64| real(x).is_none();
    let tried = [-1e6, 1e6].into_iter().chain(BOUNDS.iter().map(|bound| bound + BOUND_OFFSET));
    let Some(example) = tried.into_iter().rev().find(|x| takes(*x)) else {
        return integers(probe);
    };
    let mut schema = json!({ "type": "number" });
    for bound in BOUNDS {
        let (below, above) = (takes(bound - BOUND_OFFSET), takes(bound + BOUND_OFFSET));
        let exclusive = !takes(bound);
        match (below, above) {
            (false, true) => {
                schema[if exclusive { "exclusiveMinimum" } else { "minimum" }] = bound.into();
            }
            (true, false) => {
                schema[if exclusive { "exclusiveMaximum" } else { "maximum" }] = bound.into();
            }
            _ => {}
        }
    }
    let refused = [-1e6, 1e6, -1.0 - BOUND_OFFSET, 0.0].into_iter().find_map(real);
    if let Some(expected) = refused {
        schema["description"] = expected.into();
    }
    Some(Described { schema, example: Some(Value::Float(example)) })
}

fn integers(probe: &Probe) -> Option<Described> {
    let refusal = |n: i64| probe.refusal(Value::Integer(n));
    let example = TRIED_INTEGERS.into_iter().rev().find(|n| refusal(*n).is_none())?;
    let mut schema = json!({ "type": "integer" });
    let least = TRIED_INTEGERS.into_iter().find(|n| refusal(*n).is_none())?;
    // Between the last two numbers there may be others.
    if least > TRIED_INTEGERS[0] && least < TRIED_INTEGERS[TRIED_INTEGERS.len() - 1] {
        schema["minimum"] = least.into();
    }
    if let Some(expected) = refusal(TRIED_INTEGERS[0]) {
        schema["description"] = expected.into();
    }
    Some(Described { schema, example: Some(Value::Integer(example)) })
}
