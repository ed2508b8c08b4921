//! The Oregonator: the Belousov-Zhabotinsky reaction in three species.
//!
//! ```text
//! dy1/dt = s (y2 + y1 (1 - q y1 - y2))
//! dy2/dt = (y3 - (1 + y1) y2)/s
//! dy3/dt = w (y1 - y3)
//! ```
//!
//! From (1, 2, 3). Reference: R. J. Field and R. M. Noyes, J. Chem. Phys. 60 (1974) 1877,
//! doi:10.1063/1.1681288; problem `orego` of the IVP test set.

use rumple_plugin_sdk::prelude::*;

parameters! {
    /// The law with its parameters.
    pub struct Oregonator {
        s: 77.27, "1", "separation of time scales", above(0.0);
        q: 8.375e-06, "1", "ratio of rates", at_least(0.0);
        w: 0.161, "1/time", "recovery", at_least(0.0);
    }
}

impl Model for Oregonator {
    const ABOUT: About = about!(
        "org.rumple.oregonator",
        "The Belousov-Zhabotinsky reaction in three species: stiff oscillations. Field & Noyes (1974)."
    );
    const SPECIES: &'static [Species] = &[
        Species::new("y1", "1", "bromous acid"),
        Species::new("y2", "1", "bromide"),
        Species::new("y3", "1", "catalyst"),
    ];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let [y1, y2, y3] = [at.species[0], at.species[1], at.species[2]];
        rate[0] = (y2 + y1 * (-y1 * self.q - y2 + 1.0)) * self.s;
        rate[1] = (y3 - (y1 + 1.0) * y2) * (1.0 / self.s);
        rate[2] = (y1 - y3) * self.w;
        Ok(())
    }
}

export_plugin!(Oregonator);
