//! A1, A2: a ring under an active tension that a species sets.

use super::converges;
use super::known_answers::active::{FINE, followed, ring};
use super::over;

#[test]
fn a_ring_follows_the_species_that_sets_its_tension() {
    let samples = over(&[400, 1600], |n| ring(n, ("quasi-static", FINE)));
    converges("ring", &samples, 2e-3, 1.0);
}

/// By a Jacobian that has the derivatives of the forces by the species, and by splitting, which has not.
#[test]
fn policies_and_integrators_agree_on_a_ring() {
    let monolithic = "{ kind = \"monolithic\", rtol = 1e-5, atol = 1e-6 }";
    let reference = ring(400, ("quasi-static", FINE)).unwrap().computed;
    for by in [("quasi-static", monolithic), ("simultaneous", monolithic), ("simultaneous", FINE)] {
        let other = ring(400, by).unwrap().computed;
        assert!((other / reference - 1.0).abs() < 1e-4, "{by:?}: {other} {reference}");
    }
}

#[test]
fn a_branch_of_steady_states_has_the_shape_that_its_species_set() {
    let sample = followed(400).unwrap();
    assert!(sample.error().abs() < 5e-3, "{sample:?}");
}
