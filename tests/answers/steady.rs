//! Y1, Y2: branches of steady states of chemistry, with a sheet that it makes grow and without.

use super::known_answers::steady::{bistable, turing};

#[test]
fn a_bistable_law_has_its_folds_where_its_cubic_has() {
    let found = bistable(60).unwrap();
    for fold in found.folds {
        // The state is homogeneous: the mesh does not matter.
        assert!(fold.error().abs() < 1e-6, "{fold:?}");
    }
    assert_eq!(found.unstable, [0, 1, 0]);
}

#[test]
fn a_disc_loses_its_homogeneous_state_at_turings_threshold() {
    let found = turing(300).unwrap();
    for threshold in found.thresholds {
        assert!(threshold.error().abs() < 0.03, "{threshold:?}");
    }
    // Two modes of m = 1 and two of m = 2.
    assert_eq!(found.unstable, 4);
}
