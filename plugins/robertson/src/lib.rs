//! Robertson's autocatalytic reaction: rates that differ by nine orders of magnitude.
//!
//! ```text
//! dy1/dt = -k1 y1 + k3 y2 y3
//! dy2/dt =  k1 y1 - k3 y2 y3 - k2 y2²
//! dy3/dt =                     k2 y2²
//! ```
//!
//! From (1, 0, 0); the sum is conserved. Reference: H. H. Robertson in J. Walsh (ed.), Numerical
//! Analysis: An Introduction (1966) 178; problem `rober` of the IVP test set.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// The law with its parameters.
    pub struct Robertson {
        k1: 0.04, "1/time", "first rate", at_least(0.0);
        k2: 30000000.0, "1/time", "second rate", at_least(0.0);
        k3: 10000.0, "1/time", "third rate", at_least(0.0);
    }
}

impl Model for Robertson {
    const ABOUT: About = about!(
        "org.rumple.robertson",
        "Autocatalysis with k1 = 0.04, k2 = 3e7, k3 = 1e4: a standard stiff problem. Robertson (1966)."
    );
    const SPECIES: &'static [Species] = &[
        Species::new("y1", "1", "reactant"),
        Species::new("y2", "1", "intermediate").typical(1e-05),
        Species::new("y3", "1", "product"),
    ];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let [y1, y2, y3] = [at.species[0], at.species[1], at.species[2]];
        let (first, second, third) = (y1 * self.k1, y2 * y2 * self.k2, y2 * y3 * self.k3);
        rate[0] = third - first;
        rate[1] = first - third - second;
        rate[2] = second;
        Ok(())
    }
}

export_plugin!(Robertson);
