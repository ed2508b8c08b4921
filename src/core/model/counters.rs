//! Names under which the work of a model is counted.

/// What is counted of an energy in several places.
pub(super) mod energy {
    pub(in crate::model) const ENERGY: &str = "energy";
    pub(in crate::model) const GRADIENT: &str = "energy and gradient";
    pub(in crate::model) const HESSIAN: &str = "Hessian";
    pub(in crate::model) const LOW_RANK: &str = "low-rank terms";
    pub(in crate::model) const STEPS: &str = "step limits";
}

/// The name of the meter of a constraint, which may be called as an energy is.
pub fn constraint_meter(name: &str) -> String {
    format!("constraint {name}")
}

pub(super) fn growth_meter(number: usize) -> String {
    if number == 0 { "growth".to_owned() } else { format!("growth {}", number + 1) }
}
