//! B7: Hencky's membrane.

use super::known_answers::membranes::{HENCKY, hencky};
use super::known_answers::{BOND_MEYER, STVK_MEYER};
use super::{converges, over};

#[test]
fn stvk_membranes_rise_as_hencky_says() {
    for case in HENCKY {
        let samples = over(&[150, 800], |n| hencky(n, case, &STVK_MEYER));
        converges(&format!("B7 {case:?}"), &samples, 0.005, 1.5);
    }
}

/// Bonds have one Poisson's ratio, and on irregular meshes they have it roughly.
#[test]
fn bonds_have_poissons_ratio_one_third() {
    let [low, _, third] = HENCKY.map(|case| hencky(800, case, &BOND_MEYER).unwrap().error());
    assert!(third.abs() < 0.01, "{third}");
    assert!(low.abs() > 0.03, "{low}");
}
