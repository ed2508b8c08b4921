//! F2 and F5: what growth and topology bend.

use super::known_answers::growth::{cap, cone, disclination_buckling};
use super::known_answers::{BOND_HINGE, BOND_MEYER, STVK_HINGE, STVK_MEYER};
use super::{converges, over};

#[test]
fn a_disc_grows_into_a_spherical_cap() {
    for models in [BOND_MEYER, STVK_MEYER, STVK_HINGE] {
        let thick = cap(1200, 0.2, &models).unwrap();
        let thin = cap(1200, 0.1, &models).unwrap();
        assert!(thin.thin.error().abs() < 0.02, "{} {thin:?}", models.name);
        // What is left at finite thickness is the free edge: linear in h.
        for found in [thick, thin] {
            assert!(found.edge.error().abs() < 0.006, "{} {found:?}", models.name);
        }
        let ratio = thick.thin.error() / thin.thin.error();
        assert!((1.6..2.6).contains(&ratio), "{} {ratio}", models.name);
    }
}

#[test]
fn a_disc_that_grows_along_its_radius_becomes_a_cone() {
    for models in [BOND_MEYER, STVK_HINGE] {
        let [thick, thin] = [0.2, 0.05].map(|h| cone(1600, h, 1.1, &models).unwrap());
        assert!(thin.error().abs() < 0.02, "{} {thin:?}", models.name);
        assert!(thick.error().abs() < 0.05, "{} {thick:?}", models.name);
    }
}

/// Seung & Nelson's numbers are of bonds and hinges; others have other Gaussian moduli.
#[test]
fn disclinations_buckle_at_the_numbers_of_seung_and_nelson() {
    for (fold, tolerance) in [(5, 0.1), (7, 0.05)] {
        let samples = over(&[4, 8, 16], |n| disclination_buckling(fold, n, &BOND_HINGE));
        let name = format!("F5 {fold}-fold");
        let finest = samples.last().unwrap();
        assert!(finest.error().abs() < tolerance, "{name} {samples:#?}");
        // The limit is not exactly the printed number, so what must fall is the change.
        let [a, b, c] = [0, 1, 2].map(|k| samples[k].computed);
        assert!((c - b).abs() < 0.6 * (b - a).abs(), "{name} {samples:#?}");
    }
    let [five, seven] = [5, 7].map(|fold| disclination_buckling(fold, 16, &BOND_MEYER).unwrap());
    assert!((five.computed / 188.0 - 1.0).abs() < 0.03, "{five:?}");
    assert!((seven.computed / 122.0 - 1.0).abs() < 0.03, "{seven:?}");
}

#[test]
fn caps_converge_with_the_mesh() {
    let samples = over(&[200, 800], |n| Ok(cap(n, 0.1, &STVK_MEYER)?.edge));
    converges("F2", &samples, 0.01, 0.0);
}
