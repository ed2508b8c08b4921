//! Contact and adhesion: plates, a strip that is heavy or sticks, a strip between planes, a ring, a shell under a plate or a ball
//! and between plates.

use super::known_answers::contact::{
    bent_round, first_contact, lift_off, neck, peeled, plates, pressed, stuck,
};
use super::known_answers::squeezed::{EXACT, squeezed};
use super::{converges, over};

#[test]
fn plates_are_as_far_apart_as_their_barrier_carries() {
    for pressure in [0.01, 0.1, 1.0] {
        let samples = over(&[2, 8], |n| plates(n, pressure));
        converges(&format!("plates under {pressure}"), &samples, 2e-4, 1.0);
    }
}

#[test]
fn plates_that_stick_rest_where_well_and_barrier_balance() {
    for work in [0.01, 0.1] {
        for s in over(&[2, 8], |n| stuck(n, work)) {
            assert!(s.error().abs() < 1e-6, "work {work}: {s:?}");
        }
    }
}

#[test]
fn a_strip_peels_off_a_plane_where_its_curvature_is_that_of_the_work() {
    for (range, limit) in [(0.1, 0.02), (0.025, 0.005)] {
        for s in over(&[160], |n| peeled(n, range)) {
            assert!(s.error().abs() < limit, "range {range}: {s:?}");
        }
    }
}

#[test]
fn a_heavy_strip_leaves_the_plane_where_beam_theory_says() {
    // Also where the reach is as large as the height of the clamp, and on a coarse mesh where it is a fortieth of a cell.
    for reach in [0.2, 0.05, 0.0125] {
        for s in over(&[20, 80], |n| lift_off(n, reach)) {
            assert!(s.error().abs() < 5e-3, "reach {reach}: {s:?}");
        }
    }
}

#[test]
fn a_strip_bent_round_between_planes_pushes_as_the_elastica() {
    for reach in [0.2, 0.0125] {
        let samples = over(&[40, 80], |n| bent_round(n, reach));
        converges(&format!("reach {reach}"), &samples, 2e-3, 1.5);
    }
}

#[test]
fn a_ring_under_pressure_touches_itself_where_the_elastica_does() {
    converges("first contact", &over(&[48, 192], first_contact), 0.003, 1.8);
}

#[test]
fn the_walls_of_a_ring_push_on_one_another_as_those_of_the_elastica() {
    for pressure in [6.0, 8.0] {
        let samples = over(&[48, 192], |n| neck(n, pressure, 0.02));
        converges(&format!("neck at {pressure}"), &samples, 0.01, 1.8);
    }
}

#[test]
fn a_shell_is_as_stiff_under_a_plate_or_a_ball_as_under_a_point_load() {
    for ball in [None, Some(4.0)] {
        let samples = over(&[1000, 4000], |n| pressed(n, 0.05, 0.0125, ball));
        converges(&format!("{ball:?}"), &samples, 0.04, 0.8);
    }
}

#[test]
fn a_shell_between_plates_lies_flat_on_them_and_pushes_as_shell_theory_says() {
    let samples = squeezed(2562, 0.05).unwrap();
    assert_eq!(samples.len(), EXACT.len());
    for s in samples {
        assert!(s.error().abs() < 0.02, "{s:?}");
    }
}
