//! B1 and B5: circular plates.

use super::known_answers::plates::{Rim, buckling, deflection};
use super::known_answers::{BOND_MEYER, STVK_HINGE, STVK_MEYER};
use super::{converges, over};

const SIZES: [usize; 3] = [150, 400, 800];

#[test]
fn supported_plates_buckle_and_bend_as_they_should() {
    for models in [BOND_MEYER, STVK_MEYER] {
        let samples = over(&SIZES, |n| buckling(n, Rim::Supported, &models));
        converges(&format!("B1 {}", models.name), &samples, 0.03, 0.7);
        let samples = over(&SIZES, |n| deflection(n, Rim::Supported, &models));
        converges(&format!("B5 {}", models.name), &samples, 0.03, 0.7);
    }
}

#[test]
fn clamped_plates_buckle_and_bend_as_they_should() {
    let samples = over(&SIZES, |n| buckling(n, Rim::Clamped, &STVK_MEYER));
    converges("B1", &samples, 0.03, 0.7);
    let samples = over(&SIZES, |n| deflection(n, Rim::Clamped, &STVK_MEYER));
    converges("B5", &samples, 0.03, 0.7);
    // The modulus of bonds on an irregular mesh is uncertain by a percent, which does not fall.
    for sample in over(&SIZES, |n| buckling(n, Rim::Clamped, &BOND_MEYER)) {
        assert!(sample.error().abs() < 0.03, "B1 {sample:?}");
    }
}

/// On irregular meshes the stiffness of hinges is right to some percent and stays so under
/// refinement; a supported rim sees their own Poisson's ratio, -1/3.
#[test]
fn plates_of_hinges_are_right_within_what_their_mesh_allows() {
    for rim in [Rim::Supported, Rim::Clamped] {
        for n in [200, 800] {
            let buckles = buckling(n, rim, &STVK_HINGE).unwrap();
            assert!(buckles.error().abs() < 0.05, "B1 {rim:?} {buckles:?}");
            let bends = deflection(n, rim, &STVK_HINGE).unwrap();
            assert!(bends.error().abs() < 0.05, "B5 {rim:?} {bends:?}");
        }
    }
}
