//! Q1, Q2: branches of equilibria through a bifurcation and two folds.

use super::known_answers::branches::{arch, column};

#[test]
fn a_column_buckles_at_eulers_load_and_bends_as_the_elastica() {
    let found = column(4).unwrap();
    assert!(found.critical.error().abs() < 0.02, "{:?}", found.critical);
    assert!(found.beyond.error().abs() < 0.02, "{:?}", found.beyond);
    // The pitchfork is supercritical: the straight column loses its stability to the bent one.
    assert_eq!(found.negative, [0, 1, 0]);
}

#[test]
fn an_arch_snaps_down_and_back_at_its_limit_loads() {
    let found = arch(4).unwrap();
    for limit in found.limits {
        assert!(limit.error().abs() < 0.03, "{limit:?}");
    }
    assert_eq!(found.negative, [0, 1, 0]);
}
