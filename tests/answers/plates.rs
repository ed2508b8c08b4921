//! B1 and B5: circular plates.

use super::known_answers::plates::{Boundary, buckling, deflection};
use super::known_answers::{BOND_MEYER, STVK_HINGE, STVK_MEYER};
use super::{converges, over};

const SIZES: [usize; 3] = [150, 400, 800];

#[test]
fn supported_plates_buckle_and_bend_as_they_should() {
    for models in [BOND_MEYER, STVK_MEYER] {
        let samples = over(&SIZES, |n| buckling(n, Boundary::Supported, &models));
        converges(&format!("B1 {}", models.name), &samples, 0.03, 0.7);
        let samples = over(&SIZES, |n| deflection(n, Boundary::Supported, &models));
        converges(&format!("B5 {}", models.name), &samples, 0.03, 0.7);
    }
}

#[test]
fn clamped_plates_buckle_and_bend_as_they_should() {
    let samples = over(&SIZES, |n| buckling(n, Boundary::Clamped, &STVK_MEYER));
    converges("B1", &samples, 0.03, 0.7);
    let samples = over(&SIZES, |n| deflection(n, Boundary::Clamped, &STVK_MEYER));
    converges("B5", &samples, 0.03, 0.7);
    // The modulus of bonds on an irregular mesh is uncertain by a percent, which does not fall.
    for sample in over(&SIZES, |n| buckling(n, Boundary::Clamped, &BOND_MEYER)) {
        assert!(sample.error().abs() < 0.03, "B1 {sample:?}");
    }
}

/// On irregular meshes the stiffness of hinges is right to some percent and stays so under
/// refinement; a supported boundary sees their own Poisson's ratio, -1/3.
#[test]
fn plates_of_hinges_are_right_within_what_their_mesh_allows() {
    for boundary in [Boundary::Supported, Boundary::Clamped] {
        for n in [200, 800] {
            let buckles = buckling(n, boundary, &STVK_HINGE).unwrap();
            assert!(buckles.error().abs() < 0.05, "B1 {boundary:?} {buckles:?}");
            let bends = deflection(n, boundary, &STVK_HINGE).unwrap();
            assert!(bends.error().abs() < 0.05, "B5 {boundary:?} {bends:?}");
        }
    }
}
