//! The meters of a model: what of its work is counted, and under which names.

use crate::tally::{Meter, Tally};

/// What is counted of an energy.
pub(super) mod energy {
    pub(in crate::model) const ENERGY: usize = 0;
    pub(in crate::model) const GRADIENT: usize = 1;
    pub(in crate::model) const HESSIAN: usize = 2;
    pub(in crate::model) const CONDITIONS: usize = 3;
    pub(in crate::model) const LENGTHS: usize = 4;
    pub(in crate::model) const LOW_RANK: usize = 5;
    pub(in crate::model) const PAIRS: usize = 6;
    pub(in crate::model) const STEPS: usize = 7;
    pub(in crate::model) const SPECIES: usize = 8;
}

const ENERGY_METERS: &[&str] = &[
    "energy",
    "energy and gradient",
    "Hessian",
    "conditions",
    "derivatives by lengths",
    "low-rank terms",
    "pairs",
    "step limits",
    "derivatives by species",
];

/// What is counted of a transport.
pub(super) mod transport {
    pub(in crate::model) const SHAPE: usize = 0;
    pub(in crate::model) const RATE: usize = 1;
    pub(in crate::model) const MATRIX: usize = 2;
    pub(in crate::model) const DERIVATIVES: usize = 3;
}

const TRANSPORT_METERS: &[&str] =
    &["operator on a shape", "rates", "matrix", "derivatives by positions"];

/// What is counted of a law.
pub(super) mod law {
    pub(in crate::model) const RATES: usize = 0;
    pub(in crate::model) const PARTIALS: usize = 1;
    pub(in crate::model) const FACTOR: usize = 2;
    pub(in crate::model) const SLOPES: usize = 3;
    pub(in crate::model) const OBSERVABLES: usize = 4;
}

const LAW_METERS: &[&str] = &[
    "rates",
    "derivatives of rates",
    "length factor",
    "derivatives of the length factor",
    "observables",
];

/// What is counted of a signal.
pub(super) mod signal {
    pub(in crate::model) const VALUES: usize = 0;
    pub(in crate::model) const DERIVATIVES: usize = 1;
}

const SIGNAL_METERS: &[&str] = &["values", "derivatives"];

pub(super) fn of_energy(tally: &Tally, name: &str) -> Meter {
    tally.meter("effect", name, ENERGY_METERS)
}

pub(super) fn of_constraint(tally: &Tally, name: &str) -> Meter {
    tally.meter("effect", &constraint_meter(name), ENERGY_METERS)
}

/// The name of the meter of a constraint, which may be called as an energy is.
pub fn constraint_meter(name: &str) -> String {
    format!("constraint {name}")
}

pub(super) fn of_transport(tally: &Tally, name: &str) -> Meter {
    tally.meter("effect", name, TRANSPORT_METERS)
}

pub(super) fn of_growth(tally: &Tally, number: usize) -> Meter {
    tally.meter("effect", &growth_name(number), &["length factor"])
}

pub(super) fn of_internal(tally: &Tally, name: &str) -> Meter {
    tally.meter("effect", name, &["rates"])
}

pub(super) fn growth_name(number: usize) -> String {
    if number == 0 { "growth".to_owned() } else { format!("growth {}", number + 1) }
}

pub(super) fn of_law(tally: &Tally, name: &str) -> Meter {
    tally.meter("law", name, LAW_METERS)
}

pub(super) fn of_signal(tally: &Tally, name: &str) -> Meter {
    tally.meter("signal", name, SIGNAL_METERS)
}

/// The geometry that several signals share.
pub(super) fn of_curvature(tally: &Tally) -> Meter {
    tally.meter("signal", "curvature of the sheet", SIGNAL_METERS)
}

pub(super) fn of_lengths(tally: &Tally) -> Meter {
    tally.meter("geometry", "optimal lengths and areas", &["evaluations"])
}

/// Whether triangles allow a step.
pub(super) fn of_steps(tally: &Tally) -> Meter {
    tally.meter("solver", "check of triangles", &["steps"])
}

pub(super) fn of_jacobian(tally: &Tally) -> Meter {
    tally.meter("solver", "coupled Jacobian", &[])
}
