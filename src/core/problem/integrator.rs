//! What an integrator has to support for a problem.

use super::Problem;
use crate::effects::InternalVariables;
use crate::kinetics::Signal;
use crate::model::Mechanics;

const UNDER_ALL: &str = "integrator = \"staggered\" supports all effects under every policy";
const OR_EXPLICIT: &str = "integrator = \"staggered\" does under every policy, and so does integrator = { kind = \"explicit\", \
                           method = \"euler\" }";

/// What the law and effects ask for and the integrator of the problem does not support, with the help to it.
pub(super) fn unsupported(
    problem: &Problem<'_>,
    mechanics: &Mechanics,
    internal: &[Box<dyn InternalVariables>],
) -> Option<(String, &'static str)> {
    let integrator = &problem.integrator;
    let mut read = problem.law.iter().flat_map(|law| &law.kinetics.descriptor().signals);
    if integrator.uses_jacobian() && read.any(|read| read.signal == Signal::ContactPressure) {
        let message = "this integrator solves with the derivatives of signals, which contact_pressure, which the law \
            reads, does not have";
        return Some((message.into(), UNDER_ALL));
    }
    let couples_far = mechanics.has_low_rank() || mechanics.couples_pairs();
    if couples_far && integrator.needs_sparse_motion() {
        let message = "this integrator needs derivatives that couple neighbours only, but an effect of the scene (such \
            as volume or contact) couples vertices far apart";
        return Some((message.into(), UNDER_ALL));
    }
    if mechanics.limits_steps() && !integrator.keeps_step_limits() {
        let message = "this integrator would step through surfaces, and an effect of the scene (such as contact) \
            limits steps so that none does";
        return Some((message.into(), UNDER_ALL));
    }
    if mechanics.is_constrained() && !integrator.keeps_constraints() {
        let names = mechanics.constraint_names().collect::<Vec<_>>().join(", ");
        let message =
            format!("this integrator does not keep constraints, and there are some ({names})");
        return Some((message, OR_EXPLICIT));
    }
    if !internal.is_empty() && !integrator.integrates_internal() {
        let names = internal.iter().map(|term| term.name()).collect::<Vec<_>>().join(", ");
        let message = format!(
            "this integrator does not integrate internal variables, and effects of the scene own some ({names})"
        );
        return Some((message, OR_EXPLICIT));
    }
    None
}
