//! S1 and S2: the cantilevers of Sze, Liu & Lo.

use super::known_answers::sze::{ROLL_LENGTH, moment, shear};
use super::known_answers::{STVK_MEYER, Sample};

#[test]
fn a_cantilever_under_end_shear_follows_the_elastica() {
    let runs = [4, 12].map(|rows| shear(rows, &STVK_MEYER).unwrap());
    assert!(runs.iter().all(|run| run.len() == 5));
    for k in 0..5 {
        for (which, tolerance) in [(0, 0.02), (1, 0.01)] {
            let samples: Vec<Sample> = runs.iter().map(|run| run[k][which]).collect();
            super::converges(&format!("S1, load {k}, {which}"), &samples, tolerance, 0.9);
        }
    }
}

/// First order in the mesh, because the sides carry no bending; the limit is exact.
#[test]
fn a_cantilever_under_end_moment_rolls_up_to_a_ring() {
    let [coarse, fine] = [4, 8].map(|rows| moment(rows, 20, &STVK_MEYER).unwrap());
    for (coarse, fine) in coarse.iter().zip(&fine) {
        for which in [0, 1] {
            let off = [coarse, fine].map(|run| {
                let s = run.1[which];
                ((s.computed - s.exact) / ROLL_LENGTH, s.edge)
            });
            let limit = off[1].0 + (off[1].0 - off[0].0) * off[1].1 / (off[0].1 - off[1].1);
            assert!(off[1].0.abs() < 0.025, "load {}: {off:?}", fine.0);
            assert!(limit.abs() < 0.01, "load {}: limit {limit:.4} {off:?}", fine.0);
        }
    }
}
