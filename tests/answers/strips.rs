//! B3: Euler's strip.

use super::known_answers::strips::{Ends, buckling, height, step};
use super::known_answers::{BOND_MEYER, STVK_HINGE, STVK_MEYER};
use super::{converges, over};

#[test]
fn strips_buckle_at_eulers_load() {
    for models in [BOND_MEYER, STVK_MEYER] {
        for (ends, rows) in [(Ends::Pinned, [2, 6]), (Ends::Clamped, [3, 7])] {
            let samples = over(&rows, |n| buckling(n, ends, &models));
            converges(&format!("B3 {ends:?} {}", models.name), &samples, 0.05, 0.7);
        }
    }
    // Clamps keep the strip from curving across; it is 1/20 wide, so 2 % remain.
    for (ends, rows) in [(Ends::Pinned, [2, 4]), (Ends::Clamped, [3, 5])] {
        for s in over(&rows, |n| buckling(n, ends, &STVK_HINGE)) {
            assert!(s.error().abs() < 0.03, "{ends:?} {s:?}");
        }
    }
}

#[test]
fn strips_rise_beyond_eulers_load() {
    for models in [BOND_MEYER, STVK_MEYER, STVK_HINGE] {
        for load in [2.0, 4.0] {
            let samples = over(&[2, 6], |n| height(n, load, &models));
            let [coarse, fine] = [&samples[0], &samples[1]];
            assert!(fine.error().abs() < 0.03, "{} {fine:?}", models.name);
            assert!(
                fine.error().abs() < coarse.error().abs() + 1e-3,
                "{} {samples:?}",
                models.name
            );
        }
    }
}

#[test]
fn strips_with_a_step_in_thickness_bend_like_beams() {
    for models in [BOND_MEYER, STVK_MEYER, STVK_HINGE] {
        let samples = over(&[4, 8], |n| step(n, &models));
        let [coarse, fine] = [&samples[0], &samples[1]];
        assert!(fine.error().abs() < 0.03, "{} {samples:?}", models.name);
        assert!(fine.error().abs() < coarse.error().abs() + 2e-3, "{} {samples:?}", models.name);
    }
}
