//! R1 to R5: shells that rest where they are curved, and spontaneous curvature.

use super::known_answers::shells::{
    SHELL_HINGE, SHELL_MEYER, hemisphere, hemisphere_path, pinched, point, rolled, zoelly,
};
use super::{converges, over};

/// Narrow, where it becomes a piece of a sphere of radius (1+ν)/C₀, and wide, where it is nearly a cylinder of
/// radius 1/C₀.
#[test]
fn spontaneous_curvature_rolls_a_strip() {
    for (models, width, rows, tolerance) in [
        (SHELL_MEYER, 0.5, 4, 0.01),
        (SHELL_MEYER, 4.0, 16, 0.02),
        (SHELL_HINGE, 0.5, 8, 0.02),
        (SHELL_HINGE, 4.0, 16, 0.02),
    ] {
        let sample = rolled(width, rows, &models).unwrap();
        assert!(sample.error().abs() < tolerance, "{} {width}: {sample:?}", models.name);
    }
}

/// Inextensional bending, in which the mean curvature stays: all of the stiffness is that of det Δ. Hinges have
/// it for ν = -1/3.
#[test]
fn a_hemisphere_under_alternating_loads_is_as_soft_as_theory_says() {
    let samples = over(&[32, 64], |around| hemisphere(around, &SHELL_MEYER));
    converges("R2", &samples, 0.04, 1.0);
    let hinges = hemisphere(64, &SHELL_HINGE).unwrap();
    let expected = hinges.exact * (1.0 - 0.3) / (1.0 + 1.0 / 3.0);
    assert!((hinges.computed / expected - 1.0).abs() < 0.05, "{hinges:?}");
}

/// Sze, Liu & Lo, § 3.4: beyond the linear range the displacements of A and B differ by up to a factor of two.
#[test]
fn a_hemisphere_under_large_loads_follows_the_benchmark() {
    let found = hemisphere_path(64, &SHELL_MEYER).unwrap();
    for sample in found.iter().flatten() {
        assert!(sample.error().abs() < 0.03, "{sample:?}");
    }
}

#[test]
fn a_pinched_cylinder_gives_way_as_theory_says() {
    for models in [SHELL_MEYER, SHELL_HINGE] {
        let samples = over(&[64, 128], |around| pinched(around, &models));
        converges(&format!("R3, {}", models.name), &samples, 0.06, 1.0);
    }
}

#[test]
fn a_sphere_at_rest_buckles_at_zoellys_pressure() {
    for models in [SHELL_MEYER, SHELL_HINGE] {
        let sample = zoelly(3300, false, &models).unwrap();
        assert!(sample.error().abs() < 0.03, "{}: {sample:?}", models.name);
    }
}

#[test]
fn a_cap_resists_a_point_load_as_reissner_says() {
    for models in [SHELL_MEYER, SHELL_HINGE] {
        for sample in over(&[2000, 8000], |n| point(n, &models)) {
            assert!(sample.error().abs() < 0.05, "{}: {sample:?}", models.name);
        }
    }
}
