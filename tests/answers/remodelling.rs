//! V1 to V4: strips whose optimal lengths and rest angles flow.

use super::known_answers::remodelling::{FINE, below_yield, bent, creep, relaxed};
use super::known_answers::{BOND_HINGE, STVK_HINGE};
use super::over;

#[test]
fn the_tension_of_a_strip_that_is_held_relaxes_as_maxwell_says() {
    for models in [BOND_HINGE, STVK_HINGE] {
        let sample = relaxed(150, models.stretching, 1e-4, ("quasi-static", FINE)).unwrap();
        assert!(sample.error().abs() < 3e-4, "{} {sample:?}", models.name);
        // At a larger strain l̄ is not the length at the start any more: F falls as (l - l̄)/l̄².
        let large = relaxed(150, models.stretching, 3e-2, ("quasi-static", FINE)).unwrap();
        assert!(large.error().abs() < 0.07 && large.error() < -1e-3, "{} {large:?}", models.name);
    }
}

#[test]
fn a_strip_under_a_load_creeps_linearly_in_time() {
    let sample = creep(600, STVK_HINGE.stretching, 1e-4).unwrap();
    assert!(sample.error().abs() < 2e-3, "{sample:?}");
}

#[test]
fn a_strip_that_was_held_bent_stays_bent() {
    for threshold in [None, Some(0.04)] {
        let samples = over(&[3, 6], |n| bent(n, threshold));
        for sample in &samples {
            assert!(sample.error().abs() < 5e-3, "{threshold:?} {samples:?}");
        }
    }
}

#[test]
fn nothing_flows_below_the_yield_strain() {
    for models in [BOND_HINGE, STVK_HINGE] {
        let sample = below_yield(150, models.stretching, 1.5).unwrap();
        assert!(sample.error().abs() < 1e-12, "{} {sample:?}", models.name);
        // Beyond it something does.
        let sample = below_yield(150, models.stretching, 0.5).unwrap();
        assert!(sample.computed < 0.9, "{} {sample:?}", models.name);
    }
}
