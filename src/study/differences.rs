//! How far two states are apart.

use crate::Vec3;
use crate::geometry::aligned;
use crate::model::State;
use crate::num::real;

/// Displacements below this share of the sheet's size are none.
const STILL: f64 = 1e-6;
/// What round-off of the alignment leaves, of the sheet's size, is not a distance.
const ROUND_OFF: f64 = 1e-13;

/// How far a field of one state is from that of another, each a root mean square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Of the difference.
    pub distance: f64,
    /// Of what it is compared with, or the least that counts if that is smaller.
    pub size: f64,
}

impl Difference {
    /// The distance as a share of the size.
    #[must_use]
    pub fn relative(&self) -> f64 {
        if self.distance == 0.0 { 0.0 } else { self.distance / self.size }
    }
}

/// Differences of two states.
#[derive(Debug, Clone, PartialEq)]
pub struct Differences {
    /// Of positions, after the rigid motion that makes them least, against the displacement.
    pub shape: Difference,
    /// Of every species, against its values.
    pub species: Vec<Difference>,
}

impl Differences {
    /// The species with the largest relative difference, and that difference.
    #[must_use]
    pub fn worst_species(&self) -> Option<(usize, Difference)> {
        let by = |a: &(usize, Difference), b: &(usize, Difference)| {
            a.1.relative().total_cmp(&b.1.relative())
        };
        self.species.iter().copied().enumerate().max_by(by)
    }
}

/// How far `a` is from `b`.
#[must_use]
pub fn differences(a: &State, b: &State, rest: &[Vec3], typical: &[f64]) -> Differences {
    let rms = |v: &mut dyn Iterator<Item = f64>| -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for v in v {
            sum += v;
            count += 1;
        }
        (sum / real(count.max(1))).sqrt()
    };
    let aligned = aligned(&a.x, &b.x);
    let moved = rms(&mut b.x.iter().zip(rest).map(|(b, r)| (b - r).norm_squared()));
    let apart = rms(&mut aligned.iter().zip(&b.x).map(|(a, b)| (a - b).norm_squared()));
    // A sheet that has not moved is compared with its size.
    let middle = rest.iter().sum::<Vec3>() / real(rest.len().max(1));
    let size = rms(&mut rest.iter().map(|r| (r - middle).norm_squared()));
    let species = a.species.iter().zip(&b.species).zip(typical).map(|((a, b), typical)| {
        let size = rms(&mut b.iter().map(|b| b * b)).max(1e-3 * typical);
        Difference { distance: rms(&mut a.iter().zip(b).map(|(a, b)| (a - b) * (a - b))), size }
    });
    Differences {
        shape: Difference {
            distance: if apart > ROUND_OFF * size { apart } else { 0.0 },
            size: moved.max(STILL * size),
        },
        species: species.collect(),
    }
}
