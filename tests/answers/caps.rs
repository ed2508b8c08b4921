//! Q3, Q4: a clamped shallow cap snaps at the loads of the theory of shallow shells; a growing annulus wrinkles at the strain
//! of plate theory.

use super::known_answers::annulus::wrinkled;
use super::known_answers::caps::cap;

#[test]
fn a_shallow_cap_snaps_down_and_back_at_its_limit_loads() {
    let found = cap(500).unwrap();
    for limit in found.limits {
        assert!(limit.error().abs() < 0.03, "{limit:?}");
    }
    assert_eq!(found.negative, [0, 1, 0]);
}

#[test]
fn a_growing_annulus_between_clamped_rims_wrinkles() {
    let found = wrinkled(800).unwrap();
    assert!(found.strain.error().abs() < 0.05, "{:?}", found.strain);
    assert_eq!(found.waves[0], found.waves[1]);
}
